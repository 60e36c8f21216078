//! `docs/gcode.md` says what the interpreter does: its list of errors is made from [`ErrorKind::CATALOGUE`], its lists of
//! codes are tried out. `PKM_BLESS=1` writes the list of errors anew.

mod support;

use pkm_gcode::{ErrorKind, Interpreter, MemorySource, Settings};
use std::fmt::Write;
use std::path::PathBuf;

const BEGIN: &str = "<!-- errors: written by `PKM_BLESS=1 cargo test -p pkm-gcode --test manual` -->\n";
const END: &str = "<!-- end of errors -->\n";

fn path() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/gcode.md"))
}

fn manual() -> String {
    std::fs::read_to_string(path()).expect("docs/gcode.md")
}

/// One row per condition; `…` stands for a number or word of the program.
fn catalogue() -> String {
    let mut text = String::from("| identifier | message | what to do |\n| --- | --- | --- |\n");
    for (code, message, help) in ErrorKind::CATALOGUE {
        let mut pattern = String::new();
        let mut inside = false;
        for c in message.chars() {
            match c {
                '{' => {
                    inside = true;
                    pattern.push('…');
                }
                '}' => inside = false,
                _ if !inside => pattern.push(c),
                _ => {}
            }
        }
        let cell = |text: &str| text.replace('|', "\\|").replace('<', "&lt;").replace('*', "\\*");
        let _ = writeln!(text, "| `{code}` | {} | {} |", cell(&pattern), cell(help));
    }
    text
}

#[test]
fn the_list_of_errors_is_that_of_the_interpreter() {
    let manual = manual();
    let begin = manual.find(BEGIN).expect("the mark before the errors") + BEGIN.len();
    let end = manual.find(END).expect("the mark after the errors");
    if std::env::var_os("PKM_BLESS").is_some() {
        let new = format!("{}{}{}", &manual[..begin], catalogue(), &manual[end..]);
        support::write(&path(), new.as_bytes());
        return;
    }
    assert_eq!(&manual[begin..end], catalogue(), "stale: run it with PKM_BLESS=1");
}

/// The identifiers a block is refused with in pkm's own dialect; empty if it is accepted.
fn refused(block: &str) -> &'static str {
    let text = format!("{block}\nM2\n");
    let mut source = MemorySource::new(text.as_bytes());
    let mut interpreter = Interpreter::new(Settings::default());
    let mut sink = pkm_canon::text::TextWriter::new(|_: &[u8]| {}, pkm_canon::text::Spelling::V2_9);
    interpreter.step(&mut source, &mut sink).err().map_or("", |error| error.kind.code())
}

/// The words of the section's code spans, in order.
fn words(section: &str) -> Vec<String> {
    let manual = manual();
    let begin = manual.find(section).unwrap_or_else(|| panic!("{section} is missing"));
    let text = manual[begin..].split("\n## ").next().expect("a section").to_owned();
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn codes_are_known_or_refused_as_the_manual_says() {
    let known = words("# Codes\n");
    assert!(known.len() > 100, "{} codes", known.len());
    for code in &known {
        assert_ne!(refused(code), "g-unknown", "{code}");
        assert_ne!(refused(code), "m-unknown", "{code}");
    }
    let missing = words("# Not supported\n");
    assert!(!missing.is_empty());
    for code in &missing {
        assert!(matches!(refused(code), "g-unknown" | "m-unknown"), "{code}: {:?}", refused(code));
    }
    // And no code is forgotten: every G number that is understood is on one list.
    for tenths in 0..1000 {
        let code = match tenths % 10 {
            0 => format!("G{}", tenths / 10),
            tenth => format!("G{}.{tenth}", tenths / 10),
        };
        assert_eq!(refused(&code) != "g-unknown", known.contains(&code), "{code}");
    }
    for number in 0..100 {
        let code = format!("M{number}");
        assert_eq!(refused(&code) != "m-unknown", known.contains(&code), "{code}");
    }
}
