//! `pkm canon`: canonical commands as LinuxCNC's `rs274 -g` prints them.

use crate::cli::{Canon, CanonFormat, Dialect, OnError};
use crate::commands::ini::Ini;
use crate::commands::parameters::Kept;
use crate::commands::{program, tool_table};
use crate::interrupt;
use crate::outcome::{self, Failure, Outcome};
use crate::output;
use crate::render::canon_json::JsonWriter;
use crate::render::diagnostics::{Json, Messages};
use pkm_canon::diagnostic::Diagnostic;
use pkm_canon::text::{Spelling, TextWriter};
use pkm_canon::{CanonSink, FileId, Motion9Writer};
use pkm_gcode::{Error, Interpreter, LineSource, Place, Settings, SourceError, ToolTable, canon_text_of};
use serde_json::json;
use std::cell::{Cell, RefCell};
use std::io::{self, BufWriter, Write, stdout};
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) fn run(arguments: &Canon, messages: &Messages) -> Result<Outcome, Failure> {
    let program = program::open(&arguments.program)?;
    let name = program.name();
    let tools = match &arguments.tool_table {
        Some(path) => tool_table::read(path, messages)?,
        None => ToolTable::default(),
    };
    let ini = arguments.ini.as_deref().map(Ini::read).transpose()?;
    let mut settings = settings(arguments);
    if let Some(ini) = &ini {
        ini.apply(&mut settings)?;
        let chosen = arguments.inch || arguments.mm || arguments.format == CanonFormat::Motion9;
        if let Some(units) = ini.machine_units_per_mm()?
            && arguments.dialect != Dialect::LinuxCnc29
            && !chosen
        {
            settings.machine_units_per_mm = units;
        }
    }
    let mut interpreter = Interpreter::new(settings);
    *interpreter.tools_mut() = tools;
    let kept = match &arguments.parameters {
        Some(path) => {
            let (kept, parameters) = Kept::read(path)?;
            *interpreter.parameters_mut() = parameters;
            Some(kept)
        }
        None => None,
    };
    // Subroutine files are looked for beside the program first.
    let folders = ini.as_ref().map(Ini::subroutine_path).unwrap_or_default();
    let mut source = program.open(&folders).map_err(|error| {
        let message = format!("cannot read {name}: {error}");
        Failure::could_not("file-open", &name, message, "check the path and its permissions")
    })?;
    if let Some(ini) = &ini {
        ini.remap(&settings, &mut interpreter, &mut source)?;
    }
    let mut failed = false;
    let report = |diagnostic: &Diagnostic, line: &[u8]| {
        failed = true;
        if arguments.format != CanonFormat::Json {
            messages.print_plainly(diagnostic, line);
        }
        arguments.on_error == OnError::Continue
    };
    match &arguments.output {
        None => {
            let writer = BufWriter::with_capacity(1 << 16, stdout().lock());
            print(arguments, &mut interpreter, &mut source, writer, report)?;
        }
        Some(path) => {
            let told = |error: io::Error| output::failure(path, &error);
            let interrupted = interrupt::flag();
            let file = Interruptible { file: output::Target::open(path).map_err(told)?, by: &interrupted };
            let printed = print(arguments, &mut interpreter, &mut source, BufWriter::new(file), report);
            if interrupted.load(Ordering::Relaxed) {
                let message = format!("interrupted: {} is as it was", path.display());
                messages.print(&[outcome::warning("interrupted", &name, message, "run it again")]);
                return Ok(Outcome::Interrupted);
            }
            let file = printed.and_then(|file| file.into_inner().map_err(io::IntoInnerError::into_error));
            file.and_then(|whole| whole.file.commit()).map_err(told)?;
        }
    }
    if let Some(kept) = kept {
        kept.save(interpreter.parameters())?;
    }
    Ok(if failed { Outcome::No } else { Outcome::Clean })
}

/// The machine that `rs274` simulates, as far as the arguments do not say otherwise.
fn settings(arguments: &Canon) -> Settings {
    let rs274 = Settings::rs274();
    Settings {
        dialect: match arguments.dialect {
            Dialect::LinuxCnc29 => pkm_gcode::Dialect::LinuxCnc29,
            Dialect::LinuxCnc210 => pkm_gcode::Dialect::LinuxCnc210,
            Dialect::Pkm => pkm_gcode::Dialect::Pkm,
        },
        axes: arguments.axes,
        machine_units_per_mm: if arguments.mm || arguments.format == CanonFormat::Motion9 {
            1.0
        } else {
            rs274.machine_units_per_mm
        },
        block_delete: arguments.block_delete,
        max_blocks: arguments.bounds.max_blocks,
        max_idle_blocks: arguments.bounds.max_blocks,
        ..rs274
    }
}

/// Prints the whole program; the writer comes back flushed.
fn print<W: Write>(
    arguments: &Canon,
    interpreter: &mut Interpreter,
    source: &mut dyn LineSource,
    mut writer: W,
    mut report: impl FnMut(&Diagnostic, &[u8]) -> bool,
) -> io::Result<W> {
    let spelling = match arguments.dialect {
        Dialect::LinuxCnc29 | Dialect::Pkm => Spelling::V2_9,
        Dialect::LinuxCnc210 => Spelling::V2_10,
    };
    let name = arguments.program.display().to_string();
    let stop = Cell::new(false);
    let error = RefCell::new(None);
    let output = RefCell::new(&mut writer);
    let line = |bytes: &[u8]| {
        if !stop.get()
            && let Err(failure) = output.borrow_mut().write_all(bytes)
        {
            error.replace(Some(failure));
            stop.set(true);
        }
    };
    let mut sink: Box<dyn CanonSink> = match arguments.format {
        CanonFormat::Rs274 => Box::new(TextWriter::new(line, spelling)),
        CanonFormat::Motion9 => Box::new(Motion9Writer::new(line)),
        CanonFormat::Json => Box::new(JsonWriter::new(line, &name)),
    };
    let mut source = Stoppable { source, stop: &stop };
    let mut told = |error: &Error, interpreter: &Interpreter, source: &dyn LineSource| {
        let text = interpreter.source_line();
        let diagnostic = interpreter.diagnose(error, source, &name);
        if arguments.format == CanonFormat::Json {
            let object = json!({ "schema": pkm_run::SCHEMA, "diagnostic": Json::from(&diagnostic) });
            line(format!("{object}\n").as_bytes());
        }
        !stop.get() && report(&diagnostic, text)
    };
    let begun = match arguments.bounds.start_line {
        Some(line) => interpreter.skip_to_line(line, &mut source, &mut *sink),
        None => Ok(()),
    };
    match begun {
        Err(error) => drop(told(&error, interpreter, &source)),
        Ok(()) => canon_text_of(interpreter, &mut source, &mut *sink, told),
    }
    drop(sink);
    match error.take() {
        Some(error) => Err(error),
        None => {
            writer.flush()?;
            Ok(writer)
        }
    }
}

/// A program that ends as soon as nobody takes its commands any more; it may be endless.
struct Stoppable<'a> {
    source: &'a mut dyn LineSource,
    stop: &'a Cell<bool>,
}

impl LineSource for Stoppable<'_> {
    fn place(&self) -> Place {
        self.source.place()
    }

    fn next_line(&mut self) -> Result<Option<&[u8]>, SourceError> {
        if self.stop.get() { Err(SourceError::Unreadable) } else { self.source.next_line() }
    }

    fn seek(&mut self, place: Place) -> Result<(), SourceError> {
        self.source.seek(place)
    }

    fn find_subroutine(&mut self, name: &str) -> Result<Option<Place>, SourceError> {
        self.source.find_subroutine(name)
    }

    fn file_name(&self, file: FileId) -> Option<String> {
        self.source.file_name(file)
    }
}

/// A file that takes nothing more after Ctrl-C; what was written so far is thrown away.
struct Interruptible<'a> {
    file: output::Target,
    by: &'a AtomicBool,
}

impl Write for Interruptible<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.by.load(Ordering::Relaxed) {
            Err(io::ErrorKind::Other.into())
        } else {
            self.file.write(bytes)
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
