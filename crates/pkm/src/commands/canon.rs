//! `pkm canon`: canonical commands as LinuxCNC's `rs274 -g` prints them.

use crate::cli::{Canon, Dialect, OnError};
use crate::commands::program;
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::render::diagnostics::Messages;
use atomic_write_file::AtomicWriteFile;
use pkm_canon::diagnostic::Severity;
use pkm_canon::text::{Spelling, TextWriter};
use pkm_gcode::{FileSource, LineSource, MemorySource, Place, Settings, SourceError, ToolTable, canon_text};
use pkm_run::Program;
use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufWriter, Read, Write, stdout};
use std::path::{Path, PathBuf};

/// The largest tool table that is read.
const MOST_TABLE_BYTES: u64 = 1 << 20;

pub(crate) fn run(arguments: &Canon, messages: &Messages) -> Result<Outcome, Failure> {
    let program = program::open(&arguments.program)?;
    let name = program.name();
    let tools = match &arguments.tool_table {
        Some(path) => tool_table(path, messages)?,
        None => ToolTable::default(),
    };
    let mut source: Box<dyn LineSource> = match &program {
        Program::File(path) => {
            // Subroutine files are looked for beside the program.
            let beside = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
            Box::new(FileSource::open(path, vec![beside]).map_err(|error| {
                let message = format!("cannot read {name}: {error}");
                Failure::could_not("file-open", &name, message, "check the path and its permissions")
            })?)
        }
        Program::Memory { text, .. } => Box::new(MemorySource::new(text)),
    };
    let mut failed = false;
    let report = |error: &pkm_gcode::Error, line: &[u8]| {
        failed = true;
        messages.print_plainly(&error.to_diagnostic(&name, line), line);
        arguments.on_error == OnError::Continue
    };
    match &arguments.output {
        None => {
            print(
                arguments,
                tools,
                source.as_mut(),
                BufWriter::with_capacity(1 << 16, stdout().lock()),
                report,
            )?;
        }
        Some(path) => {
            let told = |error: io::Error| output::failure(path, &error);
            let file = AtomicWriteFile::open(path).map_err(told)?;
            let file =
                print(arguments, tools, source.as_mut(), BufWriter::new(file), report).map_err(told)?;
            file.into_inner()
                .map_err(io::IntoInnerError::into_error)
                .map_err(told)?
                .commit()
                .map_err(told)?;
        }
    }
    Ok(if failed { Outcome::No } else { Outcome::Clean })
}

/// Prints the whole program; the writer comes back flushed.
fn print<W: Write>(
    arguments: &Canon,
    tools: ToolTable,
    source: &mut dyn LineSource,
    mut writer: W,
    mut report: impl FnMut(&pkm_gcode::Error, &[u8]) -> bool,
) -> io::Result<W> {
    let (dialect, spelling) = match arguments.dialect {
        Dialect::LinuxCnc29 => (pkm_gcode::Dialect::LinuxCnc29, Spelling::V2_9),
        Dialect::LinuxCnc210 => (pkm_gcode::Dialect::LinuxCnc210, Spelling::V2_10),
        Dialect::Pkm => (pkm_gcode::Dialect::Pkm, Spelling::V2_9),
    };
    let rs274 = Settings::rs274();
    let settings = Settings {
        dialect,
        axes: arguments.axes,
        machine_units_per_mm: if arguments.mm { 1.0 } else { rs274.machine_units_per_mm },
        block_delete: arguments.block_delete,
        ..rs274
    };
    let stop = Cell::new(false);
    let mut error = None;
    let mut line = |bytes: &[u8]| {
        if error.is_none() {
            error = writer.write_all(bytes).err();
            stop.set(error.is_some());
        }
    };
    let mut text = TextWriter::new(&mut line, spelling);
    let mut source = Stoppable { source, stop: &stop };
    canon_text(settings, tools, &mut source, &mut text, |error, line| !stop.get() && report(error, line));
    match error {
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
}

/// A tool table; lines that are no tool are skipped with a warning.
fn tool_table(path: &Path, messages: &Messages) -> Result<ToolTable, Failure> {
    let name = path.display().to_string();
    let refuse = |message: String, help| Failure::could_not("tool-table", &name, message, help);
    let mut text = Vec::new();
    File::open(path).and_then(|file| file.take(MOST_TABLE_BYTES + 1).read_to_end(&mut text)).map_err(
        |error| refuse(format!("cannot read {name}: {error}"), "check the path and its permissions"),
    )?;
    if text.len() as u64 > MOST_TABLE_BYTES {
        return Err(refuse(format!("larger than {MOST_TABLE_BYTES} bytes"), "give a tool table"));
    }
    let mut skipped = Vec::new();
    let table = ToolTable::parse(&text, |line, _| skipped.push(line))
        .map_err(|error| refuse(error.to_string(), "give a shorter table"))?;
    let warnings: Vec<_> = skipped
        .into_iter()
        .map(|line| pkm_canon::diagnostic::Diagnostic {
            code: "tool-table".into(),
            severity: Severity::Warning,
            message: "this line is no tool and is skipped".into(),
            help: Some("write for example: T1 P1 D6 Z12.5 ;end mill".into()),
            file: name.clone(),
            line,
            column: 1,
            end_column: 1,
        })
        .collect();
    messages.print(&warnings);
    Ok(table)
}
