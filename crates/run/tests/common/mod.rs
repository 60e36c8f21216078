//! Machines and short programs for the fault tests.
#![allow(dead_code, missing_docs, unreachable_pub)]

use pkm_machine::Machine;
use pkm_run::{Options, Outcome, Played, Program, Rehearsal, on_a_large_stack};

/// Machine, program, a pose beside the home pose. The programs have an arc, corners, blends, a dwell, a stop.
pub const CASES: [(&str, &str, &str); 3] = [
    (
        "moma-a",
        "G21 G64 P0.1\nG1 X6 Y-262 F3000\nG2 X9 Y-265 I0 J-3\nG4 P0.05\nG1 X0 Y-265\nM2\n",
        "X1 Y-264",
    ),
    (
        "lambda6",
        "G21 G64 P0.1\nG1 X8 Z-1496 A1 F6000\nG3 X0 Y8 I-8 J0\nG61\nG1 X0 Y0 Z-1500 A0\nM2\n",
        "X1 Z-1501",
    ),
    ("xyz", "G21 G61\nG1 X5 F3000\nG2 X10 Y5 I0 J5\nG1 X0 Y0 Z3\nG0 Z0\nM2\n", "X1 Y2 Z1"),
];

pub fn machine(name: &str, overrides: &[&str]) -> Machine {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Machine::load(name, &overrides).unwrap_or_else(|errors| panic!("{name}: {errors:?}"))
}

pub fn program(text: &str) -> Program {
    Program::Memory { name: "rehearsed.ngc".to_owned(), text: text.as_bytes().to_vec() }
}

/// Each case in turn; `home`: it begins beside home, not knowing where it is.
pub fn on_each_case(home: bool, work: impl Fn(&Machine, &Rehearsal<'_>) + Sync) {
    for (name, text, start) in CASES {
        on_a_large_stack(|| {
            let (machine, program) = (machine(name, &[]), program(text));
            let start = home.then(|| pose(&machine, start));
            let options = Options { home, start, ..Options::default() };
            work(&machine, &Rehearsal::new(&program, &machine, &options).unwrap());
        });
    }
}

/// `X1 Y-264`, the rest as at home.
pub fn pose(machine: &Machine, text: &str) -> pkm_kins::Pose {
    let mut pose = machine.home;
    for word in text.split_whitespace() {
        let axis = pkm_kins::Axis::ALL.into_iter().find(|axis| word.starts_with(axis.letter())).unwrap();
        pose.set(axis, word[1..].parse().unwrap());
    }
    pose
}

pub fn play(rehearsal: &Rehearsal<'_>, faults: &[&str]) -> Played {
    let faults: Vec<_> = faults.iter().map(|text| text.parse().unwrap()).collect();
    rehearsal.play(&faults).unwrap_or_else(|error| panic!("{faults:?}: {error:?}"))
}

/// The outcome and the machine's words; panics at what must not happen, recovery included.
pub fn outcome(machine: &Machine, rehearsal: &Rehearsal<'_>, faults: &[&str]) -> (Outcome, String) {
    let played = play(rehearsal, faults);
    let (name, message) = (&machine.name, played.message);
    let outcome =
        played.verdict.unwrap_or_else(|why| panic!("{name}, --fault {faults:?}: {why} ({message})"));
    played
        .recovery
        .unwrap_or_else(|why| panic!("{name}, --fault {faults:?}: {outcome}, then {why} ({message})"));
    (outcome, message)
}

/// Some ticks of a rehearsal at which all joints move.
pub fn moving_ticks(machine: &Machine, rehearsal: &Rehearsal<'_>) -> Vec<u64> {
    let rows = rehearsal.rows();
    let moves = |i: usize| {
        let fast = |j: usize| {
            let joint = &machine.joints[j];
            let travel = (rows[i].commanded[j] - rows[i - 1].commanded[j]).abs();
            // some steps, and not about to turn
            travel * joint.steps_per_unit > 1.0 && rows[i].homed
        };
        (0..machine.joints.len()).all(fast)
    };
    let ticks: Vec<u64> = (1..rows.len() - 5).filter(|i| (*i..i + 5).all(moves)).map(|i| i as u64).collect();
    assert!(!ticks.is_empty(), "{}: its joints never move together", machine.name);
    let every = (ticks.len() / 3).max(1);
    ticks.into_iter().step_by(every).collect()
}
