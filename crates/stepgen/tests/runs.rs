//! Runs: what they say is what was asked, within the tolerance.

mod common;

use common::{Random, cases};
use pkm_stepgen::runs::MAX_RUN_BYTES;
use pkm_stepgen::{Run, RunError, RunLimits};

/// All steps as runs; checks the promises on the way.
fn runs(times: &[u64], limits: &RunLimits, context: &str) -> Vec<Run> {
    let (mut last, mut rest, mut runs) = (0, times, Vec::new());
    while let Some(run) = Run::longest(0, true, last, rest, limits) {
        let (covered, after) = rest.split_at(run.count as usize);
        let mut before = last;
        for (time, wanted) in run.times(last).zip(covered) {
            assert!(time >= before + limits.min_interval, "{context}: {run:?}");
            assert!(time.abs_diff(*wanted) <= limits.tolerance, "{context}: {time} {wanted} {run:?}");
            let period = |time: u64| (time - 1).checked_div(limits.period);
            assert_eq!(period(time), period(*wanted), "{context}");
            before = time;
        }
        (last, rest) = (before, after);
        runs.push(run);
    }
    runs
}

#[test]
fn accelerated_motion_becomes_few_runs() {
    // p = ½ a t², 400 000 steps/s²: half a second, 100 ns ticks
    let times: Vec<u64> = (0..50_000_u32)
        .map(|k| ((2.0 * (f64::from(k) + 0.5) / 400_000.0).sqrt() * 1e7 + 0.5) as u64)
        .collect();
    let count = |tolerance, period| {
        let limits = RunLimits { tolerance, min_interval: 40 - 2 * tolerance, period };
        runs(&times, &limits, &format!("tolerance {tolerance} period {period}")).len()
    };
    // exact; within 0.2 µs; within 1 µs
    assert!(count(0, 0) < 21_000, "{}", count(0, 0));
    assert!(count(2, 0) < 4000, "{}", count(2, 0));
    assert!(count(10, 0) < 2000, "{}", count(10, 0));
    assert!(count(2, 10_000) < 4500, "{}", count(2, 10_000));
}

#[test]
fn uniform_motion_is_one_run() {
    let times: Vec<u64> = (1..=10_000).map(|i| 1000 + 250 * i).collect();
    let all = runs(&times, &RunLimits { tolerance: 0, min_interval: 40, period: 0 }, "uniform");
    assert_eq!(all.len(), 2, "{all:?}");
}

#[test]
fn any_steps_come_back_within_the_tolerance() {
    for seed in 0..cases(500) {
        let mut random = Random::new(seed);
        let limits = RunLimits {
            tolerance: random.below(4),
            min_interval: 1,
            period: [0, 10_000][random.below(2) as usize],
        };
        let scale = 10_u64.pow(random.below(7) as u32 + 1);
        let mut time = 0;
        let times: Vec<u64> = (0..300)
            .map(|_| {
                time += 8 + random.below(scale);
                time
            })
            .collect();
        runs(&times, &limits, &format!("seed {seed}"));
    }
}

#[test]
fn bytes_come_back_and_damaged_ones_are_refused() {
    let mut random = Random::new(9);
    for _ in 0..cases(2000) {
        let mut any = || random.bits() >> random.below(64);
        let run = Run {
            joint: (any() & 0x7f) as u8,
            forward: any() & 1 == 1,
            interval: any(),
            count: (any() as u32).max(1),
            add: any() as i64,
        };
        let mut bytes = [0; MAX_RUN_BYTES];
        let length = run.encode(&mut bytes);
        assert_eq!(Run::decode(&bytes[..length]), Ok((run, &[][..])));
        for short in 0..length {
            assert_eq!(Run::decode(&bytes[..short]), Err(RunError::Short));
        }
    }
    assert_eq!(Run::decode(&[0, 5, 0, 0]), Err(RunError::BadNumber)); // no steps
    assert_eq!(Run::decode(&[0xff; 30]), Err(RunError::BadNumber));
    let run = Run { joint: 1, forward: true, interval: 300, count: 2, add: -1 };
    let mut bytes = [0; MAX_RUN_BYTES];
    assert_eq!(run.encode(&mut bytes), 5);
    assert_eq!(bytes[..5], [0x81, 0xac, 0x02, 0x02, 0x01]);
}
