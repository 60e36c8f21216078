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
