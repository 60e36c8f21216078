//! Every row of [`ErrorKind::CATALOGUE`] is raised by something: a program here, or one of `diagnostics.txt`. A row that
//! nothing raises is a promise of the manual that nothing keeps.

mod support;

use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::{
    Dialect, ErrorKind, Interpreter, LineSource, MachineCodes, MemorySource, ParameterFile, Parameters,
    Remap, Settings, ToolTable, static_check,
};
use std::collections::BTreeSet;

/// Rows that need an interpreter without memory, a file that cannot be read, or a start from a line (start_line.rs).
const ELSEWHERE: [&str; 4] = ["param-memory", "o-memory", "file-open", "start-line"];
/// A line has no room for so many: the row guards the list of settings.
const OUT_OF_REACH: &str = "more than {limit} parameter settings in one block";

/// Identifier, and a program that raises it; `|` ends a line.
const PROGRAMS: [(&str, &str); 181] = [
    ("file-empty", ""),
    ("file-no-end", "%|G0 X1"),
    ("file-no-end", "G0 X1"),
    (
        "line-too-long",
        "G0 X000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000001|M2",
    ),
    ("bad-char", "G0 X1 N5|M2"),
    ("unclosed-comment", "G0 X1 (open|M2"),
    ("nested-comment", "G0 X1 (a (b) c)|M2"),
    ("bad-number", "G0 X1.2.3|M2"),
    ("bad-number", "G0 X|M2"),
    ("bad-number", "NX1|M2"),
    ("bad-number", "G0 X--1|M2"),
    ("number-range", "G0 X1000000000000|M2"),
    ("not-integer", "T1.5|M2"),
    ("negative-word", "G0 X1 L-1|M2"),
    ("negative-f", "F-1|M2"),
    ("negative-s", "S-1|M2"),
    ("g-range", "G100|M2"),
    ("g-unknown", "G99.9|M2"),
    ("g-unknown", "G6.3|M2"),
    ("m-unknown", "M300|M2"),
    ("lathe-cycle", "G71 Q1|M2"),
    ("lathe-cycle", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-5|o1 endsub|G0 X20 Z1|G91 G71 Q1|M2"),
    ("lathe-cycle", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-5|o1 endsub|G0 X20 Z1|G71 Q1 Y1|M2"),
    ("lathe-cycle", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-5|o1 endsub|G0 X20 Z1|G71 Q1 I0|M2"),
    ("lathe-cycle", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-5|o1 endsub|G0 X20 Z1|G70 Q1 P0|M2"),
    ("lathe-cycle", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-5|o1 endsub|G0 X20 Z1|G71 Q1 I0.0001|M2"),
    ("lathe-cycle", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-5|o1 endsub|G0 X20 Z1|G71 Q1 X2 Z0|M2"),
    ("lathe-profile", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-5|o1 endsub|G0 X20 Z1|G71 Q7|M2"),
    ("lathe-profile", "G18 F1|o1 sub|G0 X2|o1 endsub|G0 X20 Z1|G71 Q1|M2"),
    ("lathe-profile", "G18 F1|o1 sub|G3 X2 Z0 R20|G1 Z-4|o1 endsub|G0 X20 Z1|G71 Q1|M2"),
    ("lathe-profile", "G18 F1|o1 sub|G0 X2 Z0|G81 Y-5 R9|o1 endsub|G0 X20 Z1|G71 Q1|M2"),
    ("lathe-profile", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4 A9|X6 Z-5|o1 endsub|G0 X20 Z1|G71 Q1|M2"),
    ("lathe-profile", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-2|X8 Z-9|o1 endsub|G0 X20 Z1|G71 Q1|M2"),
    ("lathe-profile", "G18 F1|o1 sub|G0 X2 Z0|G1 X8|o1 endsub|G0 X20 Z1|G71 Q1|M2"),
    ("lathe-profile", "G18 F1|o1 sub|G0 X2 Z0|G1 Z-4|X6 Z-2|X1 Z-9|o1 endsub|G0 X20 Z1|G70 Q1|M2"),
    ("m-unknown", "M100|M2"),
    ("m-too-many", "M3 M7 M48 M64 P1 M0 M6|M2"),
    ("modal-clash", "G0 G1|M2"),
    ("modal-clash", "M3 M4|M2"),
    ("word-repeated", "G0 X1 X2|M2"),
    ("word-unused", "G0 X1 Q2|M2"),
    ("word-missing", "F1 M3 S1|G33 Z1|M2"),
    ("word-missing", "G43.2|M2"),
    ("word-missing", "M61|M2"),
    ("axis-clash", "G92 G1 X1|M2"),
    ("axis-clash", "M450 G0 X1|M2"),
    ("axis-missing", "G81|M2"),
    ("axis-without-motion", "X1|M2"),
    ("axis-without-motion", "G80 X1|M2"),
    ("param-range", "G0 X#9999|M2"),
    ("param-readonly", "#5400=1|M2"),
    ("param-readonly", "#<_line>=1|M2"),
    ("param-undefined", "#<a>=[#<_bb>+1]|o1 if [0]|#<_bb>=1|o1 endif|M2"),
    ("param-undefined", "G0 X#<nothing>|M2"),
    ("param-cc", "F100|G41 D1|G1 X10|#1=#5420|M2"),
    ("param-name", "#<abc=1|M2"),
    ("param-elsewhere", "o1 if [EXISTS[#<_hal[a]>]]|G0 X#<_hal[a]>|o1 endif|M2"),
    ("param-unset", "G0 X#100|M2"),
    ("param-equal", "#1 2|M2"),
    ("expr-unclosed", "G0 X[1|M2"),
    ("expr-depth", "G0 X[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[1]|M2"),
    ("expr-operator", "G0 X[1 FOO 2]|M2"),
    ("expr-function", "G0 XFOO[1]|M2"),
    ("expr-bracket", "G0 XSIN1|M2"),
    ("expr-bracket", "G0 XATAN[1]|M2"),
    ("expr-bracket", "G0 XEXISTS[1]|M2"),
    ("math-div0", "G0 X[1/0]|M2"),
    ("math-domain", "G0 X[[-2]**0.5]|M2"),
    ("math-domain", "G0 XSQRT[-1]|M2"),
    ("math-domain", "G0 XLN[0]|M2"),
    ("math-domain", "G0 XACOS[2]|M2"),
    ("math-domain", "G0 XASIN[2]|M2"),
    ("math-nan", "G0 X[1 MOD 0]|M2"),
    ("math-inf", "G0 XEXP[1000]|M2"),
    ("o-unknown", "o1 wat|M2"),
    ("o-unknown", "o|M2"),
    ("o-trailing", "o1 if [1] junk|o1 endif|M2"),
    ("o-label-duplicate", "o1 if [1]|o1 endif|o1 if [1]|o1 endif|M2"),
    ("o-label-unknown", "o1 endif|M2"),
    ("o-unclosed", "o1 if [1]|M2"),
    ("o-nested-sub", "o1 sub|o2 sub|o2 endsub|o1 endsub|M2"),
    ("o-redefined-sub", "o1 sub|o1 endsub|o1 sub|o1 endsub|M2"),
    ("o-not-in-sub", "o1 return|M2"),
    ("o-not-found", "o1 call|M2"),
    (
        "o-args",
        "o1 sub|o1 endsub|o1 call [1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1][1]|M2",
    ),
    ("o-depth", "o1 sub|o1 call|o1 endsub|o1 call|M2"),
    ("o-style", "O5|o5 call|M99|M2"),
    ("o-style", "M98 P5|M2|o5 sub|o5 endsub"),
    ("m98-no-p", "M98|M2"),
    ("o-unused", "o1 sub|o1 endsub|M2"),
    ("endless-loop", "o1 while [1]|o1 endwhile|M2"),
    ("endless-loop", "#31=1|o1 while [#31]|#32=1|o1 endwhile|M2"),
    ("too-many-blocks", "#31=1|o1 while [#31]|G0 X#31|o1 endwhile|M2"),
    ("blank-inside", "G0 X1 0|M2"),
    ("power-sign", "G0 X[-2**2]|M2"),
    ("power-chain", "G0 X[2**3**2]|M2"),
    ("comment-inactive", "G0 X1 ; (msg, hi)|M2"),
    ("comment-several", "G0 X1 (msg, a) (b)|M2"),
    ("feed-zero", "G1 X1|M2"),
    ("feed-missing-g93", "G93|G1 X1|M2"),
    ("spindle-zero-g95", "G95 F1|G1 X1|M2"),
    ("spindle-not-turning", "G33 Z1 K1|M2"),
    ("spindle-number", "M3 S1 $5|M2"),
    ("word-missing", "G96|M2"),
    ("arc-no-centre", "F1|G2 X1|M2"),
    ("arc-no-centre", "F1|G90.1|G2 X1 I1|M2"),
    ("arc-mixed", "F1|G2 X1 I1 R1|M2"),
    ("arc-wrong-axis", "F1|G2 X1 I1 K1|M2"),
    ("arc-radius-small", "F1|G2 X10 R1|M2"),
    ("arc-same-end", "F1|G2 X0 R1|M2"),
    ("arc-end-missing", "F1|G2 Z1 R1|M2"),
    ("arc-zero-radius", "F1|G2 X1 I0|M2"),
    ("arc-radius-mismatch", "F1|G2 X10 I1|M2"),
    ("arc-plane", "F1|G17.1|G2 U1 I1|M2"),
    ("arc-turns", "F1|G2 X2 I1 P1.5|M2"),
    ("word-missing", "G4|M2"),
    ("dwell-with-arc", "F1|G4 P1 G2 X2 I1|M2"),
    ("g53-motion", "G53 G81 X1|M2"),
    ("g53-incremental", "G91|G53 G0 X1|M2"),
    ("polar-plane", "G18|G0 @1 ^1|M2"),
    ("polar-mixed", "G0 @1 ^1 X1|M2"),
    ("polar-origin", "G0 @1|M2"),
    ("indexer", "F1|G1 C10|M2"),
    ("indexer", "G0 C10 X1|M2"),
    ("wrapped-range", "G0 B400|M2"),
    ("cycle-r", "F1|G81 X1 Z-1|M2"),
    ("cycle-depth", "F1|G81 X1 R1|M2"),
    ("cycle-r-below", "F1|G81 X1 Z1 R-1|M2"),
    ("cycle-l0", "F1|G81 X1 Z-1 R1 L0|M2"),
    ("cycle-p", "F1|G82 X1 Z-1 R1|M2"),
    ("cycle-q", "F1|G83 X1 Z-1 R1|M2"),
    ("word-missing", "F1 S1 M3|G87 X1 Z-1 R1|M2"),
    ("cycle-rotary", "F1|G81 X1 A1 Z-1 R1|M2"),
    ("cycle-rotary", "F1|G81 X1 U1 Z-1 R1|M2"),
    ("cycle-g93", "F1|G93|G81 X1 Z-1 R1 F1|M2"),
    ("cycle-cc", "F1|G41 D1|G1 X10|G81 X1 Z-1 R1|M2"),
    ("cc-on", "F1|G41 D1|G1 X10|G18|M2"),
    ("cc-plane", "G19|G41 D1|M2"),
    ("cc-already", "G41 D1|G41 D1|M2"),
    ("cc-entry", "F1|G41.1 D10|G1 X1|M2"),
    ("cc-arc-after", "F1|G41.1 D1|G1 X10|X20|G40|G2 X22 I1|M2"),
    ("cc-tool", "T4 M6|G17|G41|G1 X10 F1|M2"),
    ("probe-feed", "G38.2 X1|M2"),
    ("probe-cc", "F1|G41 D1|G1 X10|G38.2 X20|M2"),
    ("probe-short", "F1|G38.2 X0|M2"),
    ("tool-unknown", "T77|M2"),
    ("tool-missing", "M6|M2"),
    ("offset-p", "G10 L2 P20 X1|M2"),
    ("offset-p", "G10 L2 P1 I1 X1|M2"),
    ("offset-l", "G10 L3 P1 X1|M2"),
    ("offset-l", "G10 P1 X1|M2"),
    ("offset-empty", "G92|M2"),
    ("tool-loaded", "T1 M6|G10 L0|M2"),
    ("io-missing", "M64|M2"),
    ("io-range", "M64 P-1|M2"),
    ("io-range", "M66 P1 L9 Q1|M2"),
    ("io-timeout", "M66 P1 L1|M2"),
    ("io-range", "M19 R400|M2"),
    ("state-none", "M72|M2"),
    ("spline-words", "F1|G5 X1 Y1|M2"),
    ("spline-words", "F1|G5 X1 Z1 P1 Q1 I1 J1|M2"),
    ("spline-words", "F1|G5.2 X1 Y1 P1|X2 Y2 P-1|M2"),
    ("spline-words", "F1|G19 G6 Y1 Z1 P1 Q1|M2"),
    ("spline-words", "F1|G6.2 P3 X1 Y1 K0 R1|M2"),
    ("spline-words", "F1|G6.2 P1.5 Q1 X1 Y1 K0 R1|M2"),
    ("nurbs-knots", "F1|G6.2 P3 Q1 X1 Y1 K0 R1|X2 Y2 K1 R1|M2"),
    ("nurbs-points", "F1|G6.2 P2 Q1 X1 Y1 K0 R1|K0|K0|M2"),
    ("nurbs-points", "F1|G5.2 X1 Y1 P1|G18|M2"),
    ("nurbs-points", "F1|G5.2 X1 Y1 P1|M2"),
    ("nurbs-points", "G5.3|M2"),
    ("nurbs-points", "F1|G5.2 X1 Y1 P1|G0 X1|M2"),
    ("nurbs-points", "F1|G5.2 X1 Y1 P1|M450|M2"),
    ("thread-ijk", "S1 M3|G18|G76 Z-1 P1 I0 J1 K1|M2"),
    ("thread-ijk", "S1 M3|G76 Z-1 P1 I-1 J1 K2|M2"),
    ("thread-ijk", "S1 M3|G18|G76 Z-1 Y1 P1 I-1 J1 K2|M2"),
    ("abort-comment", "(abort,stop)|M2"),
    ("comment-parameter", "(print,#)|M2"),
    ("comment-python", "(py,x=1)|M2"),
    ("cc-gouge", "F1|G42.1 D10|G1 X20|X40|Y20|X41|Y0|M2"),
    ("cc-gouge", "F1|G42.1 D2|G1 X20|X40|G2 X39 Y11 R10|X30 Y9 R5|G1 X40 Y2|M2"),
    ("arc-spiral", "F1|G2 X20.01 I10|M2"),
];

struct Nothing;

impl CanonSink for Nothing {
    fn command(&mut self, _: &Canon<'_>, _: Span) {}
}

fn settings(dialect: Dialect) -> Settings {
    Settings {
        dialect,
        max_idle_blocks: 1000,
        max_blocks: 2000,
        machine_codes: MachineCodes::new(&[450]).unwrap_or_default(),
        wrapped_rotary: [false, true, false],
        locking_indexer: [false, false, true],
        ..Settings::default()
    }
}

/// What reading and running a program says: identifier and message.
fn said(text: &[u8], settings: Settings) -> Vec<(&'static str, String)> {
    let mut said = Vec::new();
    let mut source = MemorySource::new(text);
    for finding in static_check(&mut source, &settings, &[], None, "program") {
        let row = ErrorKind::CATALOGUE.iter().find(|row| row.0 == finding.code).expect("a row");
        said.push((row.0, finding.message));
    }
    let mut source = MemorySource::new(text);
    let mut interpreter = Interpreter::new(settings);
    *interpreter.tools_mut() = ToolTable::parse(support::TOOLS.as_bytes(), |_, _| {}).expect("a table");
    loop {
        match interpreter.step(&mut source as &mut dyn LineSource, &mut Nothing) {
            Ok(pkm_gcode::Status::Ended) => return said,
            Ok(_) => said.extend(interpreter.take_notice().map(|n| (n.kind.code(), n.to_string()))),
            Err(error) => {
                said.push((error.kind.code(), error.to_string()));
                if interpreter.has_ended() {
                    return said;
                }
            }
        }
    }
}

/// True if a message is one of a row: what stands in braces is anything.
fn fits(message: &str, pattern: &str) -> bool {
    let mut pieces: Vec<&str> = Vec::new();
    let mut rest = pattern;
    while let Some((before, after)) = rest.split_once('{') {
        pieces.push(before);
        rest = after.split_once('}').expect("a closed brace").1;
    }
    pieces.push(rest);
    let Some(mut message) = message.strip_prefix(pieces[0]) else { return false };
    for piece in &pieces[1..] {
        match message.find(piece) {
            Some(at) => message = &message[at + piece.len()..],
            None => return false,
        }
    }
    true
}

#[test]
fn every_row_of_the_catalogue_is_raised() {
    let mut told: BTreeSet<(&str, String)> = BTreeSet::new();
    let mut failures: Vec<String> = Vec::new();
    for (code, program) in PROGRAMS {
        let text = program.replace('|', "\n");
        let found = said(text.as_bytes(), settings(Dialect::Pkm));
        if !found.iter().any(|(id, _)| *id == code) {
            failures.push(format!("{code}: {program}\n    raises {found:?}"));
        }
        told.extend(found);
    }
    // What takes more than a line.
    let names: String = (0..100_010).map(|n| format!("#<n{n}>=1\n")).collect();
    let labels: String = (0..100_010).map(|n| format!("o{n} if [1]\no{n} endif\n")).collect();
    let waiting = "F100\nG41 D1\nG1 X10\nX20\n".to_owned() + &"(wait)\n".repeat(2000);
    let points = "F100\nG5.2 X1 Y1 P1\n".to_owned() + &"X2 Y2 P1\n".repeat(300);
    let nested: String = (0..101).map(|n| format!("o{n} if [1]\n")).collect();
    let profile =
        "G18 F1\no1 sub\n".to_owned() + &"G1 W-1\n".repeat(1010) + "o1 endsub\nG0 X9 Z1\nG71 Q1\nM2\n";
    for text in [names, labels, waiting, points, nested, profile] {
        told.extend(said(text.as_bytes(), settings(Dialect::Pkm)));
    }
    told.extend(said(b"\xef\xbb\xbfG0 X1\nM2\n", settings(Dialect::LinuxCnc29)));
    told.extend(said(b"G0 X1\x80\nM2\n", settings(Dialect::Pkm)));
    let small = pkm_kins::AxisSet::new(&[pkm_kins::Axis::X]);
    told.extend(said(b"G0 U1\nM2\n", Settings { axes: small, ..settings(Dialect::Pkm) }));
    let whole = ParameterFile::read(b"5161 1\n5162 2\n", &mut Parameters::default()).expect("a file");
    let whole = whole.text(&Parameters::default());
    let changed = String::from_utf8_lossy(&whole).replace("5162\t0", "5162\t1");
    let cut = &whole[..whole.len() / 2];
    for bytes in [changed.as_bytes(), cut, b"5161 x\n", b"5162 1\n5161 1\n"] {
        let (_, error) = ParameterFile::read(bytes, &mut Parameters::default()).expect_err("a damaged file");
        told.insert((error.code(), error.to_string()));
    }
    for (remap, program) in [("M400 argspec=P ngc=a", "M400|M2"), ("M400 argspec=> ngc=a", "M400|M2")] {
        let settings = settings(Dialect::Pkm);
        let mut interpreter = Interpreter::new(settings);
        assert!(interpreter.add_remap(Remap::parse(remap, &settings).expect("a remap")));
        let text = program.replace('|', "\n");
        let mut source = MemorySource::new(text.as_bytes());
        let error = interpreter.step(&mut source, &mut Nothing).expect_err("words are missing");
        told.insert((error.kind.code(), error.to_string()));
    }
    let mut table = ToolTable::parse(b"T1 P2\nT2 P2\n", |_, _| {}).expect("a table");
    let error = table.arrange_by_pocket().expect_err("a pocket for two");
    told.insert((error.code(), error.to_string()));
    let tools: String = (0..1010).map(|n| format!("T{n} P{n}\n")).collect();
    let error = ToolTable::parse(tools.as_bytes(), |_, _| {}).expect_err("too many tools");
    told.insert((error.code(), error.to_string()));

    for (code, pattern, _) in ErrorKind::CATALOGUE {
        let raised = told.iter().any(|(id, message)| id == code && fits(message, pattern));
        if !raised && !ELSEWHERE.contains(code) && *pattern != OUT_OF_REACH {
            failures.push(format!("nothing raises {code}: {pattern}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
