//! Running a program through pkm and through LinuxCNC's `rs274`, and comparing the two.
#![allow(dead_code, missing_docs, unreachable_pub)]

pub mod generator;

use pkm_canon::text::{Spelling, TextWriter};
use pkm_gcode::{
    FileSource, Interpreter, LineSource, MemorySource, ParameterFile, Settings, ToolTable, canon_text_of,
};
use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

/// What came out of a program: its canonical lines, and the source text of the block that failed.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    pub lines: Vec<String>,
    pub failed_block: Option<String>,
    pub message: String,
    /// What is kept in the parameter file, if there is one: number and value.
    pub kept: Vec<(i32, f64)>,
}

/// The tool table that both sides use.
pub const TOOLS: &str = "T1 P1 D0.125 Z+0.511\nT2 P2 D0.0625 Z+0.1\nT3 P3 D0.201 Z+1.273\n\
                         T4 P4 D0.25 X+0.3 Z+0.7 I20 J-20 Q2\nT99999 P123 Z+0.1\n";

fn text_of(bytes: &[u8]) -> String {
    bytes.iter().map(|&b| char::from(b)).collect()
}

fn stream(text: &[u8]) -> Vec<String> {
    let mut lines: Vec<String> = text_of(text).lines().map(str::to_string).collect();
    while lines.last().is_some_and(|line| line.ends_with("ON_RESET()")) {
        lines.pop();
    }
    lines
}

/// The program as pkm interprets it, on the machine that `rs274` simulates.
pub fn pkm(program: &[u8]) -> Outcome {
    interpret(Settings::rs274(), &mut MemorySource::new(program), TOOLS.as_bytes(), None)
}

/// A program file as pkm interprets it, with a tool table; subroutine files stand beside it.
pub fn pkm_file(program: &Path, tools: &[u8]) -> Outcome {
    let beside = program.parent().expect("a folder").to_path_buf();
    interpret(Settings::rs274(), &mut FileSource::open(program, vec![beside]).expect("a file"), tools, None)
}

/// What `rs274` has interpreted last in that directory, with the parameters it began with.
pub fn pkm_after(directory: &Path, variables: Option<&str>) -> Outcome {
    pkm_with(Settings::rs274(), directory, variables)
}

/// [`pkm_after`] with other settings.
pub fn pkm_with(settings: Settings, directory: &Path, variables: Option<&str>) -> Outcome {
    let program = directory.join("program.ngc");
    let mut source = FileSource::open(&program, vec![directory.to_path_buf()]).expect("a file");
    interpret(settings, &mut source, TOOLS.as_bytes(), variables)
}

/// The numbers and values of a parameter file.
fn kept(text: &[u8]) -> Vec<(i32, f64)> {
    let number = |line: &str| {
        let (index, value) = line.split_once(char::is_whitespace)?;
        Some((index.parse().ok()?, value.trim().parse().ok()?))
    };
    text_of(text).lines().filter_map(number).collect()
}

fn interpret(
    settings: Settings,
    source: &mut dyn LineSource,
    tools: &[u8],
    variables: Option<&str>,
) -> Outcome {
    interpret_by(Interpreter::new(settings), source, tools, variables)
}

/// What an interpreter that is ready to begin makes of a program.
pub fn interpret_by(
    mut interpreter: Interpreter,
    source: &mut dyn LineSource,
    tools: &[u8],
    variables: Option<&str>,
) -> Outcome {
    let tools = ToolTable::parse(tools, |_, _| {}).expect("a small table");
    let mut output: Vec<u8> = Vec::new();
    let mut writer = TextWriter::new(|bytes: &[u8]| output.extend_from_slice(bytes), Spelling::V2_9);
    let (mut failed_block, mut message) = (None, String::new());
    *interpreter.tools_mut() = tools;
    let file = variables.map(|text| {
        ParameterFile::read(text.as_bytes(), interpreter.parameters_mut()).expect("a parameter file")
    });
    canon_text_of(&mut interpreter, source, &mut writer, |error, interpreter, _| {
        failed_block = Some(text_of(interpreter.source_line()));
        message = format!("[{}] {error} at {:?}", error.kind.code(), error.span);
        false
    });
    let kept = file.map_or_else(Vec::new, |file| kept(&file.text(interpreter.parameters())));
    Outcome { lines: stream(&output), failed_block, message, kept }
}

/// True if LinuxCNC's interpreter is installed.
pub fn has_rs274() -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join("rs274").is_file())
}

/// The program as `rs274 -g` interprets it, with the subroutine files beside it; `None` if it does not end in time.
pub fn rs274(program: &[u8], directory: &Path, variables: Option<&str>) -> Option<Outcome> {
    rs274_with(program, directory, variables, None)
}

/// The program as pkm interprets it, with a tool table and other settings.
pub fn pkm_tools(settings: Settings, program: &[u8], tools: &str) -> Outcome {
    interpret(settings, &mut MemorySource::new(program), tools.as_bytes(), None)
}

/// [`rs274`] with an INI file and a tool table.
pub fn rs274_tools(program: &[u8], directory: &Path, ini: &str, tools: &str) -> Option<Outcome> {
    let [file, table, settings] = ["program.ngc", "tool.tbl", "machine.ini"].map(|name| directory.join(name));
    write(&file, program);
    write(&table, tools.as_bytes());
    write(&settings, ini.as_bytes());
    let run = Rs274 { program: &file, tools: &table, beside: directory, scratch: directory };
    run.outcome(None, &[OsStr::new("-i"), settings.as_os_str()])
}

/// [`rs274`] with an INI file.
pub fn rs274_with(
    program: &[u8],
    directory: &Path,
    variables: Option<&str>,
    ini: Option<&str>,
) -> Option<Outcome> {
    let file = directory.join("program.ngc");
    let tools = directory.join("tool.tbl");
    write(&file, program);
    write(&tools, TOOLS.as_bytes());
    for (name, text) in generator::SUB_FILES {
        write(&directory.join(name), text.as_bytes());
    }
    let mut options: Vec<&OsStr> = Vec::new();
    let ini_path = directory.join("machine.ini");
    if let Some(ini) = ini {
        write(&ini_path, ini.as_bytes());
        options.extend([OsStr::new("-i"), ini_path.as_os_str()]);
    }
    let run = Rs274 { program: &file, tools: &tools, beside: directory, scratch: directory };
    run.outcome(variables, &options)
}

/// A program file, which stays where it is, for `rs274 -g`.
pub struct Rs274<'a> {
    pub program: &'a Path,
    pub tools: &'a Path,
    /// Where it looks for subroutine files.
    pub beside: &'a Path,
    /// Where it may write.
    pub scratch: &'a Path,
}

impl Rs274<'_> {
    /// What it prints; `None` if it does not end in time.
    pub fn outcome(&self, variables: Option<&str>, options: &[&OsStr]) -> Option<Outcome> {
        // It always writes a parameter file, without `-v` to a folder of the system.
        let path = self.scratch.join("variables");
        match variables {
            Some(variables) => write(&path, variables.as_bytes()),
            None => drop(std::fs::remove_file(&path)),
        }
        let output = Command::new("timeout")
            .args(["10", "rs274"].map(OsStr::new))
            // All that run with one home share one map of the tools there.
            .env("HOME", self.scratch)
            .args([OsStr::new("-v"), path.as_os_str(), OsStr::new("-t"), self.tools.as_os_str()])
            .args(options)
            .args([OsStr::new("-g"), self.program.as_os_str()])
            .current_dir(self.beside)
            .output()
            .expect("rs274 runs");
        if output.status.code() == Some(124) {
            return None;
        }
        let talk = text_of(&output.stderr);
        let talk: Vec<&str> = talk.lines().collect();
        let failed = !output.status.success();
        let kept = variables.map(|_| kept(&std::fs::read(&path).expect("the parameter file")));
        Some(Outcome {
            lines: stream(&output.stdout),
            failed_block: failed.then(|| talk.last().map(|line| line.to_string()).unwrap_or_default()),
            message: if failed { talk[talk.len().saturating_sub(2)].to_string() } else { String::new() },
            kept: kept.unwrap_or_default(),
        })
    }
}

#[allow(clippy::disallowed_methods)] // scratch files of a test need no atomic write
pub fn write(path: &Path, bytes: &[u8]) {
    std::fs::write(path, bytes).expect("a writable directory");
}

/// The first difference, if there is one: numbers may differ by 1e-4, everything else not at all.
pub fn difference(oracle: &Outcome, ours: &Outcome) -> Option<String> {
    for i in 0..oracle.lines.len().max(ours.lines.len()) {
        let (a, b) = (oracle.lines.get(i), ours.lines.get(i));
        if !matches!((a, b), (Some(a), Some(b)) if same_line(a, b)) {
            return Some(format!(
                "canonical line {}\n  rs274: {}\n  pkm:   {}\n  rs274 says {:?}\n  pkm says   {:?}",
                i + 1,
                a.map_or("(none)", String::as_str),
                b.map_or("(none)", String::as_str),
                oracle.message,
                ours.message
            ));
        }
    }
    // What rs274 repeats of the source line ends at a NUL and its own line length; compare what it shows.
    let block = |outcome: &Outcome| outcome.failed_block.as_ref().map(|text| text.trim().to_string());
    if block(oracle) != block(ours) {
        return Some(format!(
            "failing block\n  rs274: {:?} {:?}\n  pkm:   {:?} {:?}",
            oracle.failed_block, oracle.message, ours.failed_block, ours.message
        ));
    }
    // LinuxCNC writes six decimals.
    let close = |a: &(i32, f64), b: &(i32, f64)| a.0 == b.0 && (a.1 - b.1).abs() <= 2e-6;
    let differs = |(a, b): &(&(i32, f64), &(i32, f64))| !close(a, b);
    if let Some((a, b)) = oracle.kept.iter().zip(&ours.kept).find(differs) {
        return Some(format!("kept parameter\n  rs274: {a:?}\n  pkm:   {b:?}"));
    }
    if oracle.kept.len() != ours.kept.len() {
        return Some(format!("{} parameters kept, {} by pkm", oracle.kept.len(), ours.kept.len()));
    }
    None
}

fn same_line(a: &str, b: &str) -> bool {
    if a == b {
        return true;
    }
    let (a, b) = (pieces(a), pieces(b));
    a.len() == b.len()
        && a.iter().zip(&b).all(|(a, b)| match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(x), Ok(y)) if a.contains('.') && b.contains('.') => {
                (x - y).abs() <= 1.01e-4_f64.max(x.abs() * 1e-9)
            }
            _ => a == b,
        })
}

/// A line cut into numbers and what is between them.
fn pieces(line: &str) -> Vec<&str> {
    let is_number = |b: u8| b.is_ascii_digit() || b == b'.' || b == b'-';
    let mut pieces = Vec::new();
    let (mut start, bytes) = (0, line.as_bytes());
    for i in 1..=bytes.len() {
        if i == bytes.len() || is_number(bytes[i]) != is_number(bytes[i - 1]) {
            if let Some(piece) = line.get(start..i) {
                pieces.push(piece);
            }
            start = i;
        }
    }
    pieces
}
