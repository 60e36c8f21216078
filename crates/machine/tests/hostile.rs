//! Spoiled machine files: any text ends in a machine or in diagnostics, never in a panic (promise P5).

use pkm_machine::{Machine, shipped};

/// A small generator of random numbers; the seed is printed when a case fails.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}

/// What is put in place of a word.
const WORDS: &[&str] = &[
    "nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "1e308",
    "-1e308",
    "1e-308",
    "9223372036854775807",
    "-1",
    "\"\"",
    "[]",
    "{}",
    "[[]]",
    "true",
    "1979-05-27",
    "\u{0}",
    "\u{feff}",
    "é",
    "[[joint]]",
    "[servo]",
    "=",
    "\"\"\"",
    "'",
    "#",
    "\r\n",
    "a.b.c = 1",
    "min_mm = 3",
    "0x10",
    "1_000",
    "[195, 195, 195]",
    "name",
];

fn spoil(text: &str, random: &mut Random) -> String {
    let mut text = text.to_owned();
    for _ in 0..=random.below(3) {
        let mut cut = |text: &str| {
            let mut at = random.below(text.len() + 1);
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            at
        };
        let (a, b) = (cut(&text), cut(&text));
        let (from, to) = (a.min(b), a.max(b).min(a.min(b) + 40));
        let to = (to..=text.len()).find(|&at| text.is_char_boundary(at)).unwrap_or(text.len());
        match random.below(4) {
            0 => text.replace_range(from..to, ""),
            1 => {
                let copy = text[from..to].to_owned();
                text.insert_str(from, &copy);
            }
            2 => text.insert_str(from, WORDS[random.below(WORDS.len())]),
            _ => {
                // One value for another.
                let values: Vec<usize> = text.match_indices("= ").map(|(at, _)| at + 2).collect();
                if !values.is_empty() {
                    let at = values[random.below(values.len())];
                    let end = text[at..].find(['\n', ' ', ',']).map_or(text.len(), |length| at + length);
                    text.replace_range(at..end, WORDS[random.below(WORDS.len())]);
                }
            }
        }
    }
    text
}

#[test]
fn spoiled_files_end_in_diagnostics() {
    let cases = 3000;
    let mut refused = 0;
    for seed in 1..=cases {
        let mut random = Random(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(seed));
        let (name, text) = shipped::SHIPPED[random.below(shipped::SHIPPED.len())];
        let text = spoil(text, &mut random);
        let result = std::panic::catch_unwind(|| Machine::parse("spoiled.toml", &text, &[]));
        let result = result.unwrap_or_else(|_| panic!("seed {seed} ({name}) panics:\n{text}"));
        let Err(findings) = result else { continue };
        refused += 1;
        assert!(!findings.is_empty(), "seed {seed}: refused without a reason");
        for finding in findings {
            let line = text.split('\n').nth((finding.line as usize).saturating_sub(1)).unwrap_or("");
            let inside = finding.line == 0 || finding.column as usize <= line.len() + 1;
            assert!(inside, "seed {seed}: {finding:?} lies outside the file");
        }
    }
    assert!(refused > cases / 4, "only {refused} of {cases} were refused: the spoiler is too kind");
}

#[test]
fn spoiled_overrides_end_in_diagnostics() {
    let keys = [
        "joint.*.min_mm",
        "kinematics.l_mm.0",
        "home.x",
        "servo",
        "*",
        "joint",
        "kinematics",
        "a.b.c.d.e",
        "0",
        "",
    ];
    for key in keys {
        for value in WORDS {
            let text = format!("{key}={value}");
            let overrides = [text.clone()];
            let result = std::panic::catch_unwind(|| Machine::load("moma-a", &overrides));
            let result = result.unwrap_or_else(|_| panic!("--set {text:?} panics"));
            if let Err(findings) = result {
                assert!(!findings.is_empty(), "{text}");
            }
        }
    }
}
