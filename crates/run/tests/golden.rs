//! The golden table: every shipped program on every shipped machine, and a move of every axis of each, one row each,
//! compared to the byte with `golden.txt`. A row changes when the motion does: look at it, and if it is what was meant, bless it with
//! `PKM_BLESS=1 cargo test --package pkm-run --test golden`.

#![allow(clippy::print_stdout, clippy::disallowed_methods)]

use pkm_canon::diagnostic::Severity;
use pkm_hal_sim::Simulation;
use pkm_kins::{Axis, Kinematics};
use pkm_machine::Machine;
use pkm_run::{Options, Program, Summary, check, run};
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Every axis that a machine can move from its home, there and back, alone and with all the others.
fn every_axis(machine: &Machine) -> Program {
    let program = |moves: &str| Program::Memory {
        name: "every-axis".to_owned(),
        text: format!("G21 G91 G94 G64 P0.02\nF600\n{moves}M2\n").into_bytes(),
    };
    let axes = machine.mechanism.axes();
    let letters = "XYZABCUVW".chars().zip(Axis::ALL).filter(|(_, axis)| axes.contains(*axis));
    let alone = |letter| format!("G1 {letter}-2\nG1 {letter}2\n");
    // A locked axis is refused.
    let letters: Vec<char> = letters
        .map(|(letter, _)| letter)
        .filter(|letter| {
            let checked = check(&program(&alone(*letter)), machine, &Options::default()).expect("readable");
            checked.diagnostics.iter().all(|d| d.severity != Severity::Error)
        })
        .collect();
    assert!(!letters.is_empty(), "{} moves nothing", machine.name);
    let all = |word: &str| letters.iter().map(|letter| format!(" {letter}{word}")).collect::<String>();
    let moves: String = letters.iter().map(|letter| alone(*letter)).collect();
    program(&format!("{moves}G0{}\nG0{}\n", all("-1"), all("1")))
}

fn row(program: &Program, machine: &Machine) -> Result<String, String> {
    let result =
        run(program, machine, &Options::default(), |_: &Simulation| (), |_| ControlFlow::Continue(()));
    let (summary, _) = result.expect("a readable program");
    let error = summary.diagnostics.iter().find(|d| d.severity == Severity::Error);
    match error {
        Some(error) => Err(format!("line {} {}", error.line, error.code)),
        None => Ok(figures(&summary)),
    }
}

/// Duration, worst joint velocity and acceleration, deviation, steps.
fn figures(summary: &Summary) -> String {
    assert!(summary.completed, "{}: no error and not completed", summary.program);
    let worst = |share: fn(&pkm_run::JointSummary) -> f64| {
        summary.joints.iter().map(share).fold(0.0_f64, f64::max) * 100.0
    };
    let velocity = worst(|joint| joint.peak_velocity / joint.velocity_limit);
    let acceleration = worst(|joint| joint.peak_acceleration / joint.acceleration_limit);
    let steps: Vec<String> = summary.joints.iter().map(|joint| joint.steps.to_string()).collect();
    format!(
        "{:10.3} {velocity:8.3} {acceleration:8.3} {:9.5}  {}",
        summary.duration_s,
        summary.max_path_deviation_mm,
        steps.join(" ")
    )
}

fn programs() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../programs");
    let entries = std::fs::read_dir(&folder).expect("a folder of the project");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "ngc"));
    paths.sort();
    paths
}

fn stem(path: &Path) -> String {
    path.file_stem().expect("a name").to_string_lossy().into_owned()
}

fn table() -> String {
    let mut text = format!(
        "{:18} {:16} {:>10} {:>8} {:>8} {:>9}  {}\n",
        "program", "machine", "s", "v %", "a %", "off mm", "steps of each joint"
    );
    for path in std::iter::once(None).chain(programs().into_iter().map(Some)) {
        let name = path.as_deref().map_or("every axis".to_owned(), stem);
        let mut refusals = String::new();
        for (machine, _) in pkm_machine::shipped::SHIPPED {
            let loaded = Machine::load(machine, &[]).expect("a shipped machine");
            let program = path.clone().map_or_else(|| every_axis(&loaded), Program::File);
            match row(&program, &loaded) {
                Ok(figures) => {
                    let _ = writeln!(text, "{name:18} {machine:16} {figures}");
                }
                Err(why) => {
                    let _ = writeln!(refusals, "{name:18} {machine:16} refused: {why}");
                }
            }
        }
        text.push_str(&refusals);
    }
    text
}

#[test]
fn regress_golden_table() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden.txt");
    let got = table();
    println!("{got}");
    if std::env::var_os("PKM_BLESS").is_some() {
        std::fs::write(&path, &got).expect("the table can be written");
    }
    let want = std::fs::read_to_string(&path).expect("golden.txt");
    for (got, want) in got.lines().zip(want.lines()) {
        assert_eq!(got, want, "see the head of golden.rs");
    }
    assert_eq!(got.lines().count(), want.lines().count(), "see the head of golden.rs");
}
