//! Hostile input (promise P5): any bytes end in a reading or a diagnostic with a place; never a panic, never a hang.

#[path = "../fuzz/finite.rs"]
#[allow(unreachable_pub)] // the fuzz targets use it too
mod finite;
mod support;

use finite::Finite;
use pkm_gcode::{ErrorKind, Interpreter, MemorySource, Settings, Status};
use support::generator::{Flavour, Random, program};

/// Codes of all errors, going on after each.
fn codes(text: &[u8]) -> Vec<&'static str> {
    let settings = Settings { max_idle_blocks: 10_000, max_blocks: 50_000, ..Settings::default() };
    let mut interpreter = Interpreter::new(settings);
    let mut source = MemorySource::new(text);
    let mut codes = Vec::new();
    for _ in 0..1_000_000 {
        match interpreter.step(&mut source, &mut Finite) {
            Ok(Status::Ended) => return codes,
            Ok(_) => {}
            Err(error) => {
                let line = interpreter.source_line_of(error.span);
                assert!(error.span.start <= error.span.end, "{error:?}");
                assert!(line.is_empty() || error.span.end as usize <= line.len(), "{error:?}");
                codes.push(error.kind.code());
                let _ = error.to_diagnostic("hostile.ngc", line);
                if interpreter.has_ended() {
                    return codes;
                }
            }
        }
    }
    panic!("the program does not end");
}

#[test]
fn known_nasties() {
    let ones = |n: usize| "1".repeat(n);
    for (text, expected) in [
        (String::new(), "file-empty"),
        ("\n\n  \n".into(), "file-empty"),
        ("%\n".into(), "file-no-end"),
        ("G0 X1\n".into(), "file-no-end"),
        ("G0 X1 (open\nM2".into(), "unclosed-comment"),
        ("G0 (a(b) X1\nM2".into(), "nested-comment"),
        ("G0 X\0\nM2".into(), "bad-number"),
        ("G0 \0X1\nM2".into(), "bad-char"),
        ("G0 X1 \u{e4}\nM2".into(), "bad-char"),
        (format!("G0 X1 ({})\nM2", ones(1_000_000)), "line-too-long"),
        (format!("G0 X{}\nM2", "[".repeat(200)), "expr-depth"),
        (format!("G0 X{}\nM2", "#".repeat(200)), "expr-depth"),
        ("G0 X1e3\nM2".into(), "word-unused"),
        ("G0 X- 5e\nM2".into(), "bad-number"),
        ("#1=1\no1 while [1]\n#1=2\no1 endwhile\nM2".into(), "endless-loop"),
        ("o1 sub\no1 call\no1 endsub\no1 call\nM2".into(), "o-depth"),
        ("o1 call\nM2".into(), "o-not-found"),
    ] {
        assert_eq!(codes(text.as_bytes()).first(), Some(&expected), "{:.40}", text);
    }
    // Read correctly.
    for text in
        ["\u{feff}G0 X1\nM2", "G0 X1\r\nM2\r\n", "%\r\nG0\tX1\r\n%\r\n", "g0x- 5\nm2", "G0 X-0.0 Y.5\nM2"]
    {
        assert_eq!(codes(text.as_bytes()), Vec::<&str>::new(), "{text:?}");
    }
    // 200 nines are a number, but no machine goes there; 400 would be infinite, but the line is at its limit before.
    assert_eq!(codes(format!("G0 X{}\nM2", "9".repeat(200)).as_bytes()), ["number-range"]);
    assert_eq!(codes(format!("F{}\nM2", "9".repeat(200)).as_bytes()), Vec::<&str>::new());
}

#[test]
fn random_bytes_never_panic() {
    for seed in 1..=400 {
        let mut random = Random(seed);
        let length = random.below(3000) as usize;
        let bytes: Vec<u8> = (0..length)
            .map(|_| match random.below(4) {
                0 => random.below(256) as u8,
                1 => b'\n',
                _ => b"GXYZMFSTNOIJKRPQL#<>[]()0123456789.-+*/=%; "[random.below(42) as usize],
            })
            .collect();
        codes(&bytes);
    }
}

#[test]
fn spoiled_programs_never_panic() {
    for seed in 1..=300 {
        codes(program(seed, Flavour::Spoiled).as_bytes());
    }
}

/// Every identifier of the catalogue is kebab case, and no message is empty.
#[test]
fn catalogue_is_whole() {
    for (code, message, _) in ErrorKind::CATALOGUE {
        assert!(!message.is_empty());
        assert!(code.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-'), "{code}");
    }
}

/// Labels and names are bounded: memory does not grow with the length of a program.
#[test]
fn labels_and_names_are_bounded() {
    let many = |line: fn(u32) -> String| (0..100_100).map(line).collect::<String>();
    let labels = many(|i| format!("o{i} if [1]\no{i} endif\n"));
    assert_eq!(codes(labels.as_bytes()).first(), Some(&"o-count"));
    let names = many(|i| format!("#<a{i}>=1\n"));
    assert_eq!(codes(names.as_bytes()).first(), Some(&"param-count"));
}

/// A program that is long is not endless.
#[test]
fn lines_that_run_once_do_not_count_as_executed_blocks() {
    let long = format!("{}M2\n", "#31=1\n".repeat(60_000));
    assert_eq!(codes(long.as_bytes()), Vec::<&str>::new());
}
