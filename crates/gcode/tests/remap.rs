//! Codes that a sub stands for, against `rs274 -i` with the same REMAP lines. Skipped, and said so, where `rs274` is not
//! installed.

mod support;

use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::{Dialect, FileSource, Interpreter, Remap, Settings, Status};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use support::{Outcome, difference, has_rs274};

/// Code and options, and the body of the sub.
const REMAPS: [(&str, &str, &str); 14] = [
    (
        "M400",
        "modalgroup=10 argspec=Pq",
        "(print,p #<p> level #<_call_level> #<_remap_level> one #1)\nG0 X#<p>\no1 if [EXISTS[#<q>]]\n(print,q #<q>)\no1 endif",
    ),
    ("M401", "modalgroup=6 argspec=@PQx", "(print,#1 #2 #3 #<_x>)\n#1=99\nM400 P[#2+1]"),
    (
        "M402",
        "modalgroup=5",
        "(print,#<_value> #5420)\nG91 G1 X1 F70\nG90\no9 if [#5420 GT 40]\no<m402> return [3]\no9 endif",
    ),
    ("M403", "modalgroup=8 argspec=N>^", "(print,#<f> #<s>)\nM3"),
    ("M404", "modalgroup=4 argspec=d", "(print,stop)\nM0"),
    ("M405", "modalgroup=9", "(print,deep #<_remap_level>)\nM405"),
    ("G88.1", "modalgroup=1 argspec=XYzr", "o5 repeat [2]\nG91 G1 X#<x> Y#<y> F30\no5 endrepeat\nG90"),
    ("G12", "argspec=@xl", "(print,#1 #2 #<_motion_mode>)"),
    ("M6", "modalgroup=6", "(print,change #<_selected_tool>)\nG53 G0 Z1\nM6\nG43"),
    ("M61", "modalgroup=6 argspec=q", "(print,set #<q>)\nM61 Q#<q>"),
    ("T", "argspec=T", "(print,prepare #<t>)\nT#<t>"),
    ("S", "argspec=s", "(print,speed #<s>)\nS[#<s>*2]"),
    ("F", "argspec=f", "(print,feed #<f>)\nF[#<f>+1]"),
    ("M1", "modalgroup=4", "(print,optional)\nM1"),
];

fn name(code: &str) -> String {
    code.to_ascii_lowercase().replace('.', "_") + "sub"
}

fn scratch(what: &str) -> PathBuf {
    let directory = std::env::temp_dir().join(format!("pkm-remap-{what}-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a scratch directory");
    for (code, _, body) in REMAPS {
        let body = body.replace("o<m402> return", "o<m402sub> return");
        let (sub, file) = (name(code), directory.join(name(code) + ".ngc"));
        support::write(&file, format!("o<{sub}> sub\n{body}\no<{sub}> endsub [7]\n").as_bytes());
    }
    directory
}

fn ini() -> String {
    REMAPS.iter().fold("[RS274NGC]\n".to_owned(), |mut ini, (code, options, _)| {
        let _ = writeln!(ini, "REMAP = {code} {options} ngc={}", name(code));
        ini
    })
}

/// An interpreter with the remapped codes.
fn interpreter(settings: Settings) -> Interpreter {
    let mut interpreter = Interpreter::new(settings);
    for (code, options, _) in REMAPS {
        let remap =
            Remap::parse(&format!("{code} {options} ngc={}", name(code)), &settings).expect("a remap");
        assert!(interpreter.add_remap(remap));
    }
    interpreter
}

fn pkm(settings: Settings, directory: &Path) -> Outcome {
    let mut source =
        FileSource::open(&directory.join("program.ngc"), vec![directory.to_path_buf()]).expect("a program");
    support::interpret_by(interpreter(settings), &mut source, support::TOOLS.as_bytes(), None)
}

fn compare(program: &str, directory: &Path) -> Option<Option<String>> {
    let mut oracle = support::rs274_tools(program.as_bytes(), directory, &ini(), support::TOOLS)?;
    let mut ours = pkm(Settings::rs274(), directory);
    // What rs274 shows of a code whose words are missing is the call it made up.
    if oracle.failed_block.as_ref().is_some_and(|block| block.starts_with("O <"))
        && ours.failed_block.is_some()
    {
        assert!(ours.message.starts_with("[word-missing]"), "{}", ours.message);
        (oracle.failed_block, ours.failed_block) = (None, None);
    }
    Some(difference(&oracle, &ours))
}

const PROGRAMS: [&str; 40] = [
    "M400 P3",
    "G1 X5 F10 M400 P4 Q9 (a remark)",
    "M400 Q3",
    "M401 P1.23456 Q2",
    "M401 P3 Q4 X5",
    "G1 F5\nM401 P3 Q4 X5\nX7",
    "M402\nM402\nG0 X41 M402\n(print,#<_value>)",
    "M403",
    "F10\nM403",
    "F10 S5\nN30 M403",
    "M403 F3 S4",
    "M404\nG1 F4 X2 M404 D2",
    "M405",
    "G88.1 X1 Y2 Z3\nX7",
    "G88.1 X1",
    "G12 X3\nG12 L4\nX5",
    "G0 X1\nG12 X3\nX5",
    "G88.1 X1 Y1 M400 P3",
    "G81 G88.1 X1 Y1",
    "G92 G12 X1",
    "T2 M6\nT1 M6 G43\nM61 Q2\nM61 Q77",
    "T77",
    "T1 S5 F6 M3 M6 M8 G0 X9 M1\nG1 X3 F2",
    "S100\nG96 S20 D300\nG97",
    "G93 G1 X4 F2 M400 P3\nX7 F3\nG94 F5\nX8",
    "M400 M401 P1",
    "M401 M6 P1 Q1",
    "#1=5 #2=6 #<p>=3\nM400 P[#1+1]\n(print,#1 #2 #<p> #<_value> #<_value_returned>)",
    "o1 if [1]\nM400 P9\no1 endif\no2 repeat [2]\nM401 P1 Q1\no2 endrepeat",
    "o<q> sub\nM400 P#1\nT2 M6\no<q> endsub\no<q> call [4]\n(print,#<_value>)",
    "T1 (remark) M6 (print,hello)\nM400 P1 (print,x)\nG12 X1 (print,y)",
    "G91 G88.1 X1 Y1\nM72",
    "M400 P1 X",
    "M402.5",
    "M406",
    "M400 P2 R7 H3\nG1 F0 M400 P3 X3",
    "M400 P1 P2",
    "G20 M400 P1\nG7 M400 P1 G88.1 X3 Y4",
    "G41.1 D2 G1 X9 F4 M400 P3\nG40",
    "M70 M400 P2\nG20\nM72 M400 P1",
];

#[test]
fn remapped_codes_agree_with_rs274() {
    if !has_rs274() {
        eprintln!("skipped: rs274 is not installed");
        return;
    }
    let directory = scratch("cases");
    let mut failures = Vec::new();
    for program in PROGRAMS {
        match compare(&format!("{program}\nM2\n"), &directory) {
            Some(Some(difference)) => failures.push(format!("{program}: {difference}")),
            Some(None) => {}
            None => failures.push(format!("{program}: rs274 does not end")),
        }
    }
    let _ = std::fs::remove_dir_all(&directory);
    assert!(failures.is_empty(), "{} differ\n{}", failures.len(), failures.join("\n"));
}

/// Words and codes that random blocks are made of; at most one of each row.
const WORDS: [&[&str]; 9] = [
    &["M400 P3", "M400 P-2.55555 Q4", "M401 P1 Q2", "M402", "M403", "M6", "M61 Q2", "M8", "M64 P1", "M3"],
    &["T1", "T2", "T0", "T3"],
    &["F20", "F300", "F1.5"],
    &["S10", "S200"],
    &["G0 X3", "G1 X5 Y2", "X7 Z1", "G88.1 X1 Y2", "G12 X4", "G12", "Y3"],
    &["G90", "G91", "G20", "G21", "G43", "G49", "G94"],
    &["(print,here #<_x>)", "(remark)"],
    &["M0", "M1", "M404"],
    &["#31=[#31+1]", "#<a>=2"],
];

#[test]
fn random_programs_with_remapped_codes_agree_with_rs274() {
    if !has_rs274() {
        eprintln!("skipped: rs274 is not installed");
        return;
    }
    let directory = scratch("random");
    let count: u64 = std::env::var("PKM_ORACLE_COUNT").ok().and_then(|n| n.parse().ok()).unwrap_or(40);
    let (mut failures, mut compared, mut failed) = (Vec::new(), 0, 0);
    for seed in 1..=count {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut random = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        };
        let mut text = "F100 S50\n".to_owned();
        for _ in 0..10 {
            for words in WORDS {
                if random(3) == 0 {
                    text += words[random(words.len())];
                    text += " ";
                }
            }
            text += "\n";
        }
        text += "M2\n";
        match compare(&text, &directory) {
            Some(Some(difference)) => failures.push(format!("seed {seed}: {difference}\n{text}")),
            Some(None) => compared += 1,
            None => {}
        }
        failed += u32::from(pkm(Settings::rs274(), &directory).failed_block.is_some());
    }
    let _ = std::fs::remove_dir_all(&directory);
    eprintln!("{compared} programs agree, {failed} of them with an error; {} differ", failures.len());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn pkm_refuses_words_that_nobody_uses() {
    let directory = scratch("strict");
    let settings = Settings { dialect: Dialect::Pkm, ..Settings::default() };
    for (program, said) in [
        ("M400 P1 R7", "[word-unused] no code in this block uses the R word"),
        ("G88.1 X1 Y1 A3", "[word-unused] no code in this block uses the A word"),
        ("M400 Q1", "[word-missing] the remapped code needs P"),
        ("M403", "[word-missing] the remapped code needs F greater than 0"),
        ("M405", "[o-depth]"),
        ("M400 P1 Q2\nG88.1 X1 Y1 R5\nG12 L3", ""),
    ] {
        support::write(&directory.join("program.ngc"), format!("{program}\nM2\n").as_bytes());
        let outcome = pkm(settings, &directory);
        assert!(
            outcome.message.starts_with(said) && outcome.message.is_empty() == said.is_empty(),
            "{program}: {}",
            outcome.message
        );
    }
    let _ = std::fs::remove_dir_all(&directory);
}

struct Nothing;

impl CanonSink for Nothing {
    fn command(&mut self, _: &Canon<'_>, _: Span) {}
}

/// Spoiled programs, gone on with after every error, end without a panic in every dialect.
#[test]
fn spoiled_programs_end() {
    let directory = scratch("spoiled");
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let mut errors = 0;
    for round in 0..300 {
        let mut text: Vec<u8> = b"F100 S50\n".to_vec();
        for _ in 0..20 {
            for words in WORDS {
                if random(3) == 0 {
                    text.extend_from_slice(words[random(words.len())].as_bytes());
                }
            }
            let more =
                ["\n", "\no7 if [0]\n", "\no7 endif\n", "\nM98 P5\n", "\no<m400sub> call [1]\n", "\nM405\n"];
            text.extend_from_slice(more[if random(4) > 0 { 0 } else { random(more.len()) }].as_bytes());
        }
        text.extend_from_slice(b"M2\n");
        for _ in 0..random(12) {
            let at = random(text.len());
            text[at] = b" \nOMGPXF[]#<>1.%"[random(16)];
        }
        let dialect = [Dialect::LinuxCnc29, Dialect::LinuxCnc210, Dialect::Pkm][round % 3];
        let settings =
            Settings { dialect, max_blocks: 20_000, max_idle_blocks: 20_000, ..Settings::default() };
        let path = directory.join("program.ngc");
        support::write(&path, &text);
        let mut source = FileSource::open(&path, vec![directory.clone()]).expect("a program");
        let mut interpreter = interpreter(settings);
        let mut steps = 0;
        loop {
            match interpreter.step(&mut source, &mut Nothing) {
                Ok(Status::Ended) => break,
                Ok(_) => {}
                Err(_) => errors += 1,
            }
            steps += 1;
            assert!(steps < 100_000, "round {round} does not end: {}", String::from_utf8_lossy(&text));
        }
    }
    let _ = std::fs::remove_dir_all(&directory);
    assert!(errors > 300, "only {errors} errors: nothing was spoiled");
}
