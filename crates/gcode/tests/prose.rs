//! G-code as prose: every Markdown file in `tests/prose` explains a rule; its fenced `ngc` blocks run, and trailing
//! comments say what each line must do: `; canon: COMMAND(...)` (one per `|`), `; error: [code] word`, where `word`
//! is what must be underlined. `; canon: -` means no command. A fence `ngc linuxcnc` runs as `rs274` would; in a fence
//! `ngc machine` the machine has codes M428, M429 and M150 of its own.

mod support;

use pkm_canon::text::{Spelling, TextWriter};
use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::{Interpreter, MachineCodes, MemorySource, Settings, Status, ToolTable};

/// Collects `(source line, canonical text)`.
#[derive(Default)]
struct Lines {
    lines: Vec<(u32, String)>,
    plane: pkm_canon::Plane,
}

impl CanonSink for Lines {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        if let Canon::SelectPlane(plane) = command {
            self.plane = *plane;
        }
        let mut text: Vec<u8> = Vec::new();
        let mut writer = TextWriter::new(|bytes: &[u8]| text = bytes.to_vec(), Spelling::V2_9);
        writer.command(&Canon::SelectPlane(self.plane), span);
        writer.command(command, span);
        let text = String::from_utf8_lossy(&text).trim_end().to_string();
        // Behind sequence number and N column.
        self.lines.push((span.line, text.get(13..).unwrap_or(&text).to_string()));
    }
}

/// What a line promises.
fn expectation(line: &str) -> (&str, Option<&str>) {
    match line.split_once("; canon:").or_else(|| line.split_once("; error:")) {
        Some((code, expected)) if line.contains("; error:") => (code, Some(expected.trim())),
        Some((code, expected)) => (code, Some(expected.trim())),
        None => (line, None),
    }
}

fn run(name: &str, first_line: usize, kind: &str, block: &[&str]) -> Vec<String> {
    let mut complaints = Vec::new();
    let program = block.join("\n");
    let mut settings = if kind.contains("linuxcnc") { Settings::rs274() } else { Settings::default() };
    if kind.contains("machine") {
        settings.machine_codes = MachineCodes::new(&[428, 429, 150]).expect("in range");
    }
    let mut interpreter = Interpreter::new(settings);
    *interpreter.tools_mut() = ToolTable::parse(support::TOOLS.as_bytes(), |_, _| {}).expect("a table");
    let mut source = MemorySource::new(program.as_bytes());
    let (mut lines, mut errors) = (Lines::default(), Vec::new());
    loop {
        match interpreter.step(&mut source, &mut lines) {
            Ok(Status::Ended) => break,
            Ok(_) => {}
            Err(error) => {
                let text = interpreter.source_line().to_vec();
                let span = error.span.start as usize..error.span.end as usize;
                let word = String::from_utf8_lossy(text.get(span).unwrap_or_default()).to_string();
                if error.kind.code() == "file-no-end" {
                    break; // a fence needs no M2
                }
                errors.push((error.span.line, format!("[{}] {word}", error.kind.code())));
                if interpreter.has_ended() {
                    break;
                }
            }
        }
    }
    for (index, line) in block.iter().enumerate() {
        let number = index as u32 + 1;
        let said: Vec<&str> =
            lines.lines.iter().filter(|(l, _)| *l == number).map(|(_, t)| t.as_str()).collect();
        let said = said.join(" | ").replace("-0.0000", "0.0000");
        let wrong: Vec<&str> = errors.iter().filter(|(l, _)| *l == number).map(|(_, t)| t.as_str()).collect();
        let wrong = wrong.join(" | ");
        let at = format!("{name}:{}", first_line + index);
        match expectation(line) {
            (_, Some(expected)) if line.contains("; error:") && wrong.trim_end() == expected => {}
            (_, Some(expected)) if line.contains("; error:") => {
                complaints.push(format!("{at}: expected error {expected}\n  found {wrong:?}"));
            }
            (_, Some(expected)) => {
                let expected = if expected == "-" { "" } else { expected };
                if said != expected || !wrong.is_empty() {
                    complaints.push(format!("{at}: expected {expected}\n  found {said} {wrong}"));
                }
            }
            (_, None) if !wrong.is_empty() => {
                complaints.push(format!("{at}: unexpected error {wrong}"));
            }
            _ => {}
        }
    }
    complaints
}

#[test]
fn prose_holds() {
    let directory = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/prose");
    let mut files: Vec<_> = std::fs::read_dir(&directory)
        .expect("tests/prose")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .collect();
    files.sort();
    let (mut complaints, mut blocks) = (Vec::new(), 0);
    for path in files {
        let text = std::fs::read_to_string(&path).expect("a readable file");
        let name = path.file_name().expect("a name").to_string_lossy().to_string();
        let (mut fence, mut begin): (Option<(String, Vec<&str>)>, usize) = (None, 0);
        for (index, line) in text.lines().enumerate() {
            match (&mut fence, line.strip_prefix("```")) {
                (None, Some(kind)) if kind.starts_with("ngc") => {
                    fence = Some((kind.to_string(), Vec::new()));
                    begin = index + 2;
                }
                (Some((kind, lines)), Some(_)) => {
                    blocks += 1;
                    complaints.extend(run(&name, begin, kind, lines));
                    fence = None;
                }
                (Some((_, lines)), None) => lines.push(line),
                (None, _) => {}
            }
        }
    }
    assert!(blocks > 10, "only {blocks} blocks found");
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}
