//! What a person reads about a wrong program: `tests/diagnostics.txt` holds programs and, behind each, everything that is
//! said about it: `line:columns [code] message`, remedy, other places. `PKM_BLESS=1` writes what is said anew; read it.

mod support;

use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_canon::{Canon, CanonSink, FileId, Span};
use pkm_gcode::{
    Dialect, Interpreter, LineSource, MemorySource, Place, Settings, SourceError, Status, ToolTable,
    static_check,
};
use std::fmt::Write;
use std::path::PathBuf;

struct Nothing;

impl CanonSink for Nothing {
    fn command(&mut self, _: &Canon<'_>, _: Span) {}
}

/// A program and the files of its subs, in memory.
struct Files<'a> {
    files: Vec<(&'a str, MemorySource<'a>)>,
    current: usize,
}

impl LineSource for Files<'_> {
    fn place(&self) -> Place {
        Place { file: FileId(self.current as u16), ..self.files[self.current].1.place() }
    }

    fn next_line(&mut self) -> Result<Option<&[u8]>, SourceError> {
        self.files[self.current].1.next_line()
    }

    fn seek(&mut self, place: Place) -> Result<(), SourceError> {
        self.current = place.file.0.into();
        self.files[self.current].1.seek(place)
    }

    fn find_subroutine(&mut self, name: &str) -> Result<Option<Place>, SourceError> {
        let wanted = format!("{name}.ngc");
        let found = self.files.iter().position(|(file, _)| *file == wanted);
        Ok(found.map(|i| Place { file: FileId(i as u16), line: 0, offset: 0 }))
    }

    fn file_name(&self, file: FileId) -> Option<String> {
        Some(self.files[usize::from(file.0)].0.to_owned())
    }
}

/// What reading alone says, then what running adds.
fn said(files: &[(&str, &str)]) -> Vec<Diagnostic> {
    let sources = files.iter().map(|(name, text)| (*name, MemorySource::new(text.as_bytes()))).collect();
    let mut source = Files { files: sources, current: 0 };
    let settings =
        Settings { dialect: Dialect::Pkm, max_blocks: 1000, max_idle_blocks: 1000, ..Settings::default() };
    let mut said = static_check(&mut source, &settings, &[], None, "program");
    source.seek(Place::default()).expect("memory can be sought");
    let mut interpreter = Interpreter::new(settings);
    *interpreter.tools_mut() = ToolTable::parse(support::TOOLS.as_bytes(), |_, _| {}).expect("a table");
    loop {
        match interpreter.step(&mut source, &mut Nothing) {
            Ok(Status::Ended) => return said,
            Ok(_) => {
                if let Some(notice) = interpreter.take_notice() {
                    said.push(Diagnostic {
                        severity: Severity::Note,
                        ..interpreter.diagnose(&notice, &source, "program")
                    });
                }
            }
            Err(error) => {
                let new = interpreter.diagnose(&error, &source, "program");
                let known = |d: &Diagnostic| (&d.file, d.line, &d.code) == (&new.file, new.line, &new.code);
                if !said.iter().any(known) {
                    said.push(new);
                }
                if interpreter.has_ended() {
                    return said;
                }
            }
        }
    }
}

fn told(said: &[Diagnostic]) -> String {
    let mut text = String::new();
    for d in said {
        let severity = match d.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        let file = if d.file == "program" { String::new() } else { format!("{}:", d.file) };
        let (from, to) = (d.column, d.end_column.saturating_sub(1));
        let _ = writeln!(text, "  {file}{}:{from}-{to} {severity}[{}] {}", d.line, d.code, d.message);
        if let Some(help) = &d.help {
            let _ = writeln!(text, "      {help}");
        }
        for note in &d.notes {
            let _ = writeln!(text, "      {} {}:{}:{}", note.message, note.file, note.line, note.column);
        }
    }
    if said.is_empty() { "  nothing\n".to_owned() } else { text }
}

#[test]
fn everything_that_is_said_about_wrong_programs() {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/diagnostics.txt"));
    let stored = std::fs::read_to_string(&path).expect("tests/diagnostics.txt");
    let mut fresh = String::new();
    let mut cases = 0;
    for case in stored.split("==== ").skip(1) {
        let (title, rest) = case.split_once('\n').expect("a title");
        let (program, _) = rest.split_once("---- said\n").expect("---- said");
        let mut files = vec![("program", String::new())];
        for line in program.lines() {
            match line.strip_prefix("---- file ") {
                Some(name) => files.push((name, String::new())),
                None => files.last_mut().expect("a file").1.extend([line, "\n"]),
            }
        }
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
        let _ = write!(fresh, "==== {title}\n{program}---- said\n{}", told(&said(&files)));
        cases += 1;
    }
    assert!(cases >= 20, "only {cases} cases");
    let head = stored.split("==== ").next().expect("the head");
    let fresh = format!("{head}{fresh}");
    if std::env::var_os("PKM_BLESS").is_some() {
        support::write(&path, fresh.as_bytes());
    } else if fresh != stored {
        let differs = fresh.lines().zip(stored.lines()).find(|(a, b)| a != b);
        panic!("tests/diagnostics.txt is stale: {differs:?}\nread what is said now with PKM_BLESS=1");
    }
}
