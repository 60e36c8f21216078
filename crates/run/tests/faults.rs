//! Random single faults: each of them ends as it must, and the machine can be used afterwards.
//!
//! `PKM_FAULTS` sets their number (default 300), `PKM_SEED` the first. Two threads.

mod common;

use common::{CASES, machine, program};
use pkm_run::{Options, Outcome, Rehearsal, on_a_large_stack};
use std::collections::BTreeMap;

type Outcomes = BTreeMap<Outcome, u64>;

/// Every sixth seed, from `part` on: one machine, homing first or not.
fn random_faults(part: u64, count: u64, first: u64) -> (Outcomes, Vec<String>) {
    let (name, text, start) = CASES[part as usize % 3];
    let (machine, program) = (machine(name, &[]), program(text));
    let home = part >= 3;
    let start = home.then(|| common::pose(&machine, start));
    let rehearsal =
        Rehearsal::new(&program, &machine, &Options { home, start, ..Options::default() }).unwrap();
    let (mut outcomes, mut bad) = (Outcomes::new(), Vec::new());
    for seed in (first..first + count).filter(|seed| seed % 6 == part) {
        let fault = rehearsal.random_fault(seed);
        let played = rehearsal.play(std::slice::from_ref(&fault)).unwrap();
        match (played.verdict, played.recovery) {
            (Ok(outcome), Ok(())) => *outcomes.entry(outcome).or_default() += 1,
            (verdict, recovery) => bad.push(format!(
                "{name}, home {home}, seed {seed}, --fault {fault}: {verdict:?}, {recovery:?} ({})",
                played.message
            )),
        }
    }
    (outcomes, bad)
}

#[test]
fn random_faults_end_well() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let (count, first) = (number("PKM_FAULTS").unwrap_or(300), number("PKM_SEED").unwrap_or(0));
    let half = |parts: [u64; 3]| on_a_large_stack(|| parts.map(|part| random_faults(part, count, first)));
    let results = std::thread::scope(|scope| {
        let other = scope.spawn(|| half([0, 2, 4]));
        let mine = half([1, 3, 5]);
        [mine, other.join().unwrap()]
    });
    let (mut outcomes, mut bad) = (Outcomes::new(), Vec::new());
    for (some, worse) in results.into_iter().flatten() {
        for (outcome, count) in some {
            *outcomes.entry(outcome).or_default() += count;
        }
        bad.extend(worse);
    }
    eprintln!("{count} faults from seed {first}: {outcomes:?}");
    assert!(bad.is_empty(), "{} of {count}:\n{}", bad.len(), bad[..bad.len().min(40)].join("\n"));
    assert!(outcomes.len() >= 4 && outcomes.values().all(|count| *count > 0), "{outcomes:?}: too tame");
}
