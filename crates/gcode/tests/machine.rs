//! What the machine's configuration changes, against `rs274 -i`: wrapped rotary axes, a locking indexer, two spindles,
//! moves before a tool change. Skipped, and said so, where `rs274` is not installed.

mod support;

use pkm_gcode::Settings;
use support::{difference, has_rs274, pkm_with, rs274_with};

const INI: &str = "[EMCIO]\nTOOL_CHANGE_AT_G30 = 1\nTOOL_CHANGE_QUILL_UP = 1\nTOOL_CHANGE_WITH_SPINDLE_ON = 1\n\
                   [RS274NGC]\nORIENT_OFFSET = 10\nOWORD_NARGS = 1\n[AXIS_A]\nWRAPPED_ROTARY = 1\n\
                   [AXIS_B]\nLOCKING_INDEXER_JOINT = 4\n[TRAJ]\nSPINDLES = 2\n";

const VARIABLES: &str = "5181\t1.0\n5182\t2.0\n5183\t3.0\n5184\t40\n5185\t0\n";

/// The same for pkm.
fn settings() -> Settings {
    Settings {
        tool_change_at_g30: true,
        tool_change_quill_up: true,
        tool_change_with_spindle_on: true,
        orient_offset_deg: 10.0,
        oword_nargs: true,
        wrapped_rotary: [true, false, false],
        locking_indexer: [false, true, false],
        spindles: 2,
        ..Settings::rs274()
    }
}

const PROGRAMS: [&str; 21] = [
    "G0 X10 Y20 Z30\nM3\nT1 M6\nG0 X1",
    "G43 H1\nG0 X10 Y20 Z30\nM3\nT2 M6\nG0 X1",
    "G0 A350\nA10\nA-350\nA-10\nA0\nA-0\nG91 A400\nG90 A370",
    "G0 A-370",
    "G92 A400",
    "G52 A-360",
    "G10 L20 P1 A400",
    "G10 L2 P1 A50\nG0 A20\nG53 G0 A10\nG53 A-10\nG92 A30\nG0 A-20\nG30",
    "G91 G0 A-370\nG28.1\n(print,#5164)\nG90 A-20\nG28",
    "G0 B10\nG1 B20",
    "G0 X1 B20",
    "G61\nG0 B20\nG91 B30",
    "G0 X1\nB5\nB6\nX2",
    "G30 X1 B3",
    "G0 B3\nX1\nB4\nG28 B5\nT1 M6\nG30",
    "G2 X1 B3 R4",
    "G38.2 B4",
    "o1 sub\nG0 X[#<n_args>]\no1 endsub\no1 call [3] [4] [1]\no1 call",
    "M3 $1\nS100 $-1\nM5\nM5 $-1\nM19 R355\nM19 R3 $1",
    "M48\nM49\nM51 P0\nM51 $1",
    "M3 $1 S300\nG95 F1\nG33 Z-3 K1 $1\nG96 S100\nM4 $-1\nG97 S3 $1",
];

#[test]
fn configured_machines_agree_with_rs274() {
    if !has_rs274() {
        eprintln!("skipped: rs274 is not installed");
        return;
    }
    let directory = std::env::temp_dir().join(format!("pkm-machine-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a scratch directory");
    for program in PROGRAMS {
        let text = format!("F100 S100\n{program}\nM2\n");
        let oracle = rs274_with(text.as_bytes(), &directory, Some(VARIABLES), Some(INI)).expect("an end");
        let ours = pkm_with(settings(), &directory, Some(VARIABLES));
        assert_eq!(difference(&oracle, &ours), None, "{program}");
    }
    let _ = std::fs::remove_dir_all(&directory);
}

/// Rows in another order than their pockets, a tool 0 and a gap.
const POCKETS: &str = "T1 P3 D0.125 Z+0.511\nT2 P1 D0.0625 Z+0.1\nT3 P5 D0.201 X+0.3 Z+1.273\nT0 P7\nT4 P2 D0.25 Z0.7 I20 J-20 Q2\n";

const SEEN: &str = "(print,#5400 #5401 #5403 #5410 #<_current_tool> #<_current_pocket> #<_selected_tool> #<_selected_pocket>)\n";

/// What programs may do with tools; what they see of them is printed after every block.
const TOOL_BLOCKS: [&str; 24] = [
    "T1",
    "T2",
    "T3",
    "T4",
    "T0",
    "M6",
    "M6",
    "M6",
    "G43",
    "G43 H1",
    "G43 H3",
    "G43 H0",
    "G49",
    "M61 Q2",
    "M61 Q4",
    "M61 Q0",
    "G10 L1 P1 Z3",
    "G10 L1 P2 R4 X1",
    "G10 L10 P3 Z3",
    "G10 L11 P4 Z2",
    "G10 L0",
    "T3 M6 G43",
    "M5 T2 M6",
    "G0 X1 Z2",
];

/// Seeded programs on changers with and without pockets of their own.
#[test]
fn tool_changers_agree_with_rs274() {
    if !has_rs274() {
        eprintln!("skipped: rs274 is not installed");
        return;
    }
    let directory = std::env::temp_dir().join(format!("pkm-tools-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a scratch directory");
    let count: u64 = std::env::var("PKM_ORACLE_COUNT").ok().and_then(|n| n.parse().ok()).unwrap_or(20);
    let (mut failures, mut compared) = (Vec::new(), 0);
    for random in [false, true] {
        let ini = format!("[EMCIO]\nRANDOM_TOOLCHANGER = {}\n", i32::from(random));
        for seed in 1..=count {
            let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mut text = SEEN.to_owned();
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let block = TOOL_BLOCKS[(state >> 33) as usize % TOOL_BLOCKS.len()];
                text += &format!("{block}\n{SEEN}");
            }
            text += "M2\n";
            let oracle = support::rs274_tools(text.as_bytes(), &directory, &ini, POCKETS);
            let Some(oracle) = oracle else { continue };
            compared += 1;
            let settings = Settings { random_toolchanger: random, ..Settings::rs274() };
            let ours = support::pkm_tools(settings, text.as_bytes(), POCKETS);
            if let Some(difference) = difference(&oracle, &ours) {
                failures.push(format!("random {random}, seed {seed}: {difference}\n{text}"));
            }
        }
    }
    let _ = std::fs::remove_dir_all(&directory);
    eprintln!("{compared} programs compared, {} differ", failures.len());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The machine that rs274 simulates exchanges nothing; a real one does.
#[test]
fn a_random_tool_changer_exchanges_tools() {
    let settings = Settings { random_toolchanger: true, ..Settings::default() };
    let run = |text: &str, table: &str| support::pkm_tools(settings, text.as_bytes(), table);
    let table = "T1 P3 Z1\nT2 P1 Z2\nT9 P0 Z9\nT0 P7\n";
    let outcome = run(
        &format!(
            "{SEEN}G43\nT1\n{SEEN}M6 G43\n{SEEN}M6\nT9 M6\n{SEEN}G43 H1\nT0 M6\n{SEEN}M61 Q2\n{SEEN}G10 L1 P2 Z5\nG10 L1 P0 Z1\n"
        ),
        table,
    );
    let said: Vec<&str> = outcome.lines.iter().map(|line| line.get(13..).unwrap_or(line)).collect();
    // #5400 #5401 #5403 #5410, current tool and pocket, selected tool and pocket
    let row = |tool: i32, z: i32, selected: i32, pocket: i32| -> String {
        let numbers = [tool, 0, z, 0, tool, 0, selected, pocket];
        numbers.map(|n| format!("{n}.000000")).join(" ")
    };
    let rows: Vec<&str> = outcome
        .lines
        .iter()
        .map(String::as_str)
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
        .collect();
    // T1 comes from pocket 3, and T9 goes there; T0 takes T9's place, and so on.
    let expected = [
        row(9, 9, 0, 0),
        row(9, 9, 1, 3),
        row(1, 1, 1, 0),
        row(9, 9, 9, 0),
        row(0, 0, 0, 0),
        row(2, 2, 0, 0),
    ];
    assert_eq!(rows, expected);
    let changes: Vec<&str> = said
        .iter()
        .copied()
        .filter(|line| line.starts_with("CHANGE_TOOL") || line.starts_with("SET_TOOL"))
        .collect();
    // T1 from 3; M6 again: none; T9 from 3; T0 from 7; M61: T2 from 1, T0 goes there.
    assert_eq!(
        changes[..5],
        ["CHANGE_TOOL(3)", "CHANGE_TOOL(0)", "CHANGE_TOOL(3)", "CHANGE_TOOL(7)", "CHANGE_TOOL_NUMBER(1)"]
    );
    assert!(changes[5].starts_with("SET_TOOL_TABLE_ENTRY(0, 2, "), "in the spindle: {changes:?}");
    assert_eq!(changes.len(), 6);
    assert!(outcome.message.starts_with("[offset-p]"), "{}", outcome.message);
    for (program, table, code) in [
        ("T0\nM2\n", "T1 P1\n", "[tool-unknown]"),
        ("T1\nM2\n", "T1 P1\nT2 P1\n", "[tool-pocket]"),
        ("T1\nM2\n", "T1\n", "[tool-pocket]"),
    ] {
        let outcome = run(program, table);
        assert!(outcome.message.starts_with(code), "{program}{table}{}", outcome.message);
    }
    // Without a tool in pocket 0 the spindle is empty, which is not tool 0.
    assert_eq!(
        run("(print,#5400)\nM2\n", "T0 P1\n").lines.iter().filter(|line| *line == "-1.000000").count(),
        1
    );
}
