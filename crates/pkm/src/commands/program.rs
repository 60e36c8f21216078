//! What `run` and `check` have in common: the program, the machine, the start pose.

use crate::cli::{Format, ProgramArgs};
use crate::commands::parameters::Kept;
use crate::commands::tool_table;
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::render::diagnostics::{self, Messages};
use pkm_canon::diagnostic::Diagnostic;
use pkm_kins::{Axis, Kinematics, Pose, maths};
use pkm_machine::Machine;
use pkm_run::{Options, Program};
use serde::Serialize;
use std::fs::File;
use std::io::{Read, stdin};
use std::path::Path;

/// The largest program that is taken from a pipe, which has to be kept in memory.
const MOST_PIPED_BYTES: u64 = 64 << 20;

/// A program, the machine it is for, and what both commands may set.
pub(crate) struct Job {
    pub program: Program,
    pub machine: Machine,
    pub options: Options,
    /// The parameter file, to save it.
    pub kept: Option<Kept>,
}

/// The answer in JSON when the question could not be asked.
#[derive(Serialize)]
struct Refused<'a> {
    schema: u32,
    program: String,
    machine: Option<&'a str>,
    completed: bool,
    diagnostics: Vec<diagnostics::Json<'a>>,
}

impl<'a> Refused<'a> {
    fn new(arguments: &'a ProgramArgs, diagnostics: &'a [Diagnostic]) -> Self {
        Self {
            schema: pkm_run::SCHEMA,
            program: arguments.program.display().to_string(),
            machine: arguments.machine.machine.as_deref(),
            completed: false,
            diagnostics: diagnostics.iter().map(diagnostics::Json::from).collect(),
        }
    }
}

/// How a command ends: whoever asked for JSON gets it also when the question could not be asked.
pub(crate) fn answered(
    arguments: &ProgramArgs,
    result: Result<Outcome, Failure>,
) -> Result<Outcome, Failure> {
    match (result, arguments.format) {
        (Err(Failure::CouldNot(diagnostics)), Format::Json) => {
            output::json_line(&Refused::new(arguments, &diagnostics))?;
            Ok(Outcome::CouldNot)
        }
        (result, _) => result,
    }
}

impl Job {
    /// Reads the machine, and a program that comes through a pipe.
    pub(crate) fn new(arguments: &ProgramArgs, messages: &Messages) -> Result<Self, Failure> {
        let name = arguments.machine.machine.as_deref().unwrap_or_default();
        let machine = Machine::load(name, &arguments.machine.set)?;
        let start = arguments.start.as_deref().map(|text| start(&machine, text)).transpose()?;
        let Text { program, options, kept } = Text::new(arguments, messages)?;
        Ok(Self { program, machine, options: Options { start, ..options }, kept })
    }
}

/// A program and what may be set without a machine.
pub(crate) struct Text {
    pub program: Program,
    pub options: Options,
    /// The parameter file, to save it.
    pub kept: Option<Kept>,
}

impl Text {
    /// Reads tools and parameters, and a program that comes through a pipe.
    pub(crate) fn new(arguments: &ProgramArgs, messages: &Messages) -> Result<Self, Failure> {
        let program = open(&arguments.program)?;
        let tools = match &arguments.tool_table {
            // Read once; the job lasts as long as the process.
            Some(path) => Some(&*Box::leak(Box::new(tool_table::read(path, messages)?))),
            None => None,
        };
        let (kept, parameters) = match &arguments.parameters {
            Some(path) => {
                let (kept, parameters) = Kept::read(path)?;
                (Some(kept), Some(&*Box::leak(Box::new(parameters))))
            }
            None => (None, None),
        };
        let surfaces = &arguments.probe_surface;
        let workpiece = (!surfaces.is_empty()).then(|| &*Box::leak(surfaces.clone().into_boxed_slice()));
        let options = Options {
            block_delete: arguments.block_delete,
            workpiece,
            start_line: arguments.bounds.start_line,
            max_blocks: arguments.bounds.max_blocks,
            tools,
            parameters,
            ..Options::default()
        };
        Ok(Self { program, options, kept })
    }
}

/// A program in a file, which is streamed, or in something that can be read only once (a pipe, `-`), which is kept.
pub(crate) fn open(path: &Path) -> Result<Program, Failure> {
    if path == Path::new("-") {
        return keep("-", stdin().lock());
    }
    let name = path.display().to_string();
    let refuse = |error: &dyn std::fmt::Display| {
        let message = format!("cannot read {name}: {error}");
        Failure::could_not(
            "file-open",
            &name,
            message,
            "give the path of a G-code program, or - for standard input",
        )
    };
    let file = File::open(path).map_err(|error| refuse(&error))?;
    let kind = file.metadata().map_err(|error| refuse(&error))?.file_type();
    if kind.is_dir() {
        return Err(refuse(&"it is a folder"));
    }
    if kind.is_file() { Ok(Program::File(path.to_owned())) } else { keep(&name, file) }
}

fn keep(name: &str, input: impl Read) -> Result<Program, Failure> {
    let refuse = |message: String, help| Failure::could_not("file-open", name, message, help);
    let mut text = Vec::new();
    input
        .take(MOST_PIPED_BYTES + 1)
        .read_to_end(&mut text)
        .map_err(|error| refuse(format!("cannot read {name}: {error}"), "give a file"))?;
    if text.len() as u64 > MOST_PIPED_BYTES {
        let message = format!("the program is larger than {MOST_PIPED_BYTES} bytes");
        return Err(refuse(message, "write it to a file, which is read as a stream"));
    }
    Ok(Program::Memory { name: name.to_owned(), text })
}

/// A pose as `--start` states it: letters and numbers, mm and degrees; what is absent is as at home.
pub(crate) fn start(machine: &Machine, text: &str) -> Result<Pose, Failure> {
    let refuse = |message: String| {
        Failure::could_not(
            "start",
            "--start",
            message,
            "write for example --start \"X0 Y-260\" (mm, degrees)",
        )
    };
    let mut pose = machine.home;
    let mut seen = Vec::new();
    let mut rest = text.trim();
    while let Some(letter) = rest.chars().next() {
        let Some(axis) = Axis::ALL.into_iter().find(|axis| axis.letter() == letter.to_ascii_uppercase())
        else {
            return Err(refuse(format!("`{letter}` is not an axis letter")));
        };
        if !machine.mechanism.axes().contains(axis) {
            return Err(refuse(format!("the machine has no axis {}", axis.letter())));
        }
        if seen.contains(&axis) {
            return Err(refuse(format!("axis {} is given twice", axis.letter())));
        }
        seen.push(axis);
        rest = rest[1..].trim_start_matches([' ', '=']);
        let end = rest
            .find(|c: char| c.is_ascii_alphabetic() || c.is_whitespace() || c == ',')
            .unwrap_or(rest.len());
        let (number, after) = rest.split_at(end);
        let value = number.parse::<f64>().ok().filter(|value| value.is_finite() && value.abs() < 1e9);
        let Some(value) = value else {
            return Err(refuse(format!("`{number}` after {} is not a number", axis.letter())));
        };
        pose.set(axis, if axis.is_rotary() { maths::radians(value) } else { value });
        rest = after.trim_start_matches([' ', ',', '\t']);
    }
    Ok(pose)
}
