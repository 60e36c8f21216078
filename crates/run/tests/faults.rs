//! Faults: each of them ends as it must, and the machine can be used afterwards.
//!
//! `PKM_FAULTS` sets the number of random faults (default 300).

use pkm_machine::Machine;
use pkm_run::{Options, Outcome, Program, Rehearsal, on_a_large_stack};
use std::collections::BTreeMap;

/// Machine, program: short, with an arc, corners, a dwell and a stop.
const CASES: [(&str, &str); 3] = [
    ("moma-a", "G21 G64 P0.1\nG1 X6 Y-262 F3000\nG2 X9 Y-265 I0 J-3\nG4 P0.05\nG1 X0 Y-265\nM2\n"),
    ("lambda6", "G21 G64 P0.1\nG1 X8 Z-1496 A1 F6000\nG3 X0 Y8 I-8 J0\nG61\nG1 X0 Y0 Z-1500 A0\nM2\n"),
    ("xyz", "G21 G61\nG1 X5 F3000\nG2 X10 Y5 I0 J5\nG1 X0 Y0 Z3\nG0 Z0\nM2\n"),
];

fn machine(name: &str) -> Machine {
    // the joints stand beside their switches and home fast: the tail of every run is short
    let overrides: &[&str] = &[];
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Machine::load(name, &overrides).unwrap_or_else(|errors| panic!("{name}: {errors:?}"))
}

fn program(text: &str) -> Program {
    Program::Memory { name: "rehearsed.ngc".to_owned(), text: text.as_bytes().to_vec() }
}

/// Plays: the outcome, or what is wrong with it.
fn play(rehearsal: &Rehearsal<'_>, text: &str) -> Result<Outcome, String> {
    let played = rehearsal.play(&text.parse().unwrap()).map_err(|error| error.message)?;
    let message = &played.message;
    let outcome = played.verdict.map_err(|objection| format!("{objection} ({message})"))?;
    played.recovery.map_err(|why| format!("{outcome}, then {why} ({message})"))?;
    Ok(outcome)
}

#[test]
fn random_faults_end_well() {
    on_a_large_stack(random_faults);
}

fn random_faults() {
    let count: u64 = std::env::var("PKM_FAULTS").ok().and_then(|text| text.parse().ok()).unwrap_or(300);
    let first: u64 = std::env::var("PKM_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    let mut outcomes: BTreeMap<Outcome, u64> = BTreeMap::new();
    let mut bad = Vec::new();
    for (n, (name, text)) in CASES.iter().enumerate() {
        let (machine, program) = (machine(name), program(text));
        let rehearsal = Rehearsal::new(&program, &machine, &Options::default()).unwrap();
        eprintln!("{name}: {} periods", rehearsal.periods());
        for seed in (first..first + count).filter(|seed| seed % 3 == n as u64) {
            let fault = rehearsal.random_fault(seed).to_string();
            match play(&rehearsal, &fault) {
                Ok(outcome) => *outcomes.entry(outcome).or_default() += 1,
                Err(why) => bad.push(format!("{name} seed {seed} fault {fault}: {why}")),
            }
        }
    }
    eprintln!("{outcomes:?}");
    assert!(bad.is_empty(), "{} of {count}:\n{}", bad.len(), bad[..bad.len().min(40)].join("\n"));
    assert!(outcomes.len() >= 3, "{outcomes:?}: the test does not test");
}
