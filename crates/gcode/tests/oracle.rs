//! pkm against LinuxCNC's own interpreter: seeded random programs, valid and spoiled. Skipped, and said so, where
//! `rs274` is not installed.

mod support;

use support::generator::{Flavour, program, variables};
use support::{difference, has_rs274, pkm_after, rs274};

/// Programs per flavour: `PKM_ORACLE_COUNT`, or few enough for every test run.
fn count() -> u64 {
    std::env::var("PKM_ORACLE_COUNT").ok().and_then(|n| n.parse().ok()).unwrap_or(20)
}

/// Programs of the first 200 seeds that may differ: flavour, seed, canonical line of the first difference, why.
const KNOWN: [(Flavour, u64, &str, &str); 0] = [];

#[test]
fn random_programs_agree_with_rs274() {
    if !has_rs274() {
        eprintln!("skipped: rs274 is not installed");
        return;
    }
    let directory = std::env::temp_dir().join(format!("pkm-oracle-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a scratch directory");
    let first: u64 = std::env::var("PKM_ORACLE_SEED").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    let only = std::env::var("PKM_ORACLE_FLAVOUR").ok();
    let (mut failures, mut compared) = (Vec::new(), 0);
    for flavour in Flavour::ALL {
        if only.as_ref().is_some_and(|only| *only != format!("{flavour:?}")) {
            continue;
        }
        for seed in first..first + count() {
            let text = program(seed, flavour);
            let variables = (flavour == Flavour::Tables).then(|| variables(seed));
            let Some(oracle) = rs274(text.as_bytes(), &directory, variables.as_deref()) else {
                eprintln!("{flavour:?} seed {seed} not compared: rs274 does not end");
                continue;
            };
            compared += 1;
            let known = KNOWN.iter().find(|known| (known.0, known.1) == (flavour, seed));
            match (difference(&oracle, &pkm_after(&directory, variables.as_deref())), known) {
                (None, None) => {}
                (None, Some(_)) => {
                    failures.push(format!("{flavour:?} seed {seed} agrees now: take it off the list"));
                }
                (Some(difference), Some((.., place, reason))) if difference.starts_with(place) => {
                    eprintln!("{flavour:?} seed {seed} differs as known: {reason}");
                }
                (Some(difference), _) => failures.push(format!("{flavour:?} seed {seed}: {difference}")),
            }
        }
    }
    let _ = std::fs::remove_dir_all(&directory);
    eprintln!("{compared} programs compared, {} differ", failures.len());
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
