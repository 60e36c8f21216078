//! The planning cases whose shortest possible durations are known, judged on the trace alone: first and second
//! differences of the joint positions at the servo period and at a tenth of it.
//!
//! `val_…`: T_ref is from an outside source.

use crate::catalogue::{Known, all, flower_on_moma};
use crate::harness::{Disturbance, Sampling, Trace, drive, with_stack};

/// A run in whose trace nothing is over its limit and which ends where the path does, on the path all the way.
fn clean(
    name: &str,
    known: &Known,
    sampling: Sampling,
    disturbance: Disturbance,
    one_per_tick: bool,
) -> Trace {
    let Known { id, case, p_mm, .. } = known;
    let goal = case.moves.last().unwrap().0;
    let goal = goal.at(goal.length()).position;
    let trace = drive(case, sampling, disturbance, one_per_tick);
    println!(
        "{id} {name}: {:.4} s = {:.4} T_ref, v {:.6} a {:.6}, off the path {:.1e} mm",
        trace.duration_s,
        trace.duration_s / known.t_ref_s,
        trace.velocity,
        trace.acceleration,
        trace.path_error_mm
    );
    assert!(trace.velocity <= 1.0 + sampling.slack(), "{id} {name}: velocity {}", trace.velocity);
    assert!(trace.acceleration <= 1.0 + sampling.slack(), "{id} {name}: acceleration {}", trace.acceleration);
    let off = trace.path_error_mm;
    assert!(off <= p_mm.max(1e-9), "{id} {name}: {off} mm off the path");
    for (got, want) in trace.end.iter().zip(goal) {
        assert!((got - want).abs() < 1e-9, "{id} {name}: ends at {:?}", trace.end);
    }
    trace
}

fn judge(ids: &[&str]) {
    let mut cases = all();
    cases.retain(|known| ids.contains(&known.id));
    assert_eq!(cases.len(), ids.len());
    for known in &cases {
        with_stack(|| {
            for (name, sampling) in
                [("1 ms", Sampling::SERVO), ("0.1 ms", Sampling::TENTH), ("10 kHz", Sampling::FAST)]
            {
                let duration_s = clean(name, known, sampling, Disturbance::None, false).duration_s;
                let ratio = duration_s / known.t_ref_s;
                assert!(
                    (0.995..=1.01).contains(&ratio),
                    "{} {name}: {duration_s} s, {ratio} T_ref",
                    known.id
                );
            }
            clean("override", known, Sampling::SERVO, Disturbance::RandomOverride, false);
            clean("hold", known, Sampling::SERVO, Disturbance::HoldThirds, false);
            clean("one per tick", known, Sampling::SERVO, Disturbance::None, true);
        });
    }
}

#[test]
fn val_lines_on_moma() {
    judge(&["P01", "P02", "P06", "P07"]);
}

#[test]
fn val_circle_on_moma() {
    judge(&["P03"]);
}

#[test]
fn val_chords_on_moma() {
    judge(&["P04", "P13", "P14", "P15"]);
}

#[test]
fn val_zigzag_on_moma() {
    judge(&["P05", "P16"]);
}

#[test]
fn val_trapezoid_on_identity() {
    judge(&["P08", "P09", "P17"]);
}

#[test]
fn val_linear_delta() {
    judge(&["P10", "P11"]);
}

#[test]
fn val_hexapod() {
    judge(&["P12"]);
}

/// A planner that starves on short chords takes many times as long.
#[test]
fn twenty_thousand_chords_take_no_longer_than_a_thousand() {
    with_stack(|| {
        let [few, many] = [1000, 20_000].map(|chords| {
            let case = flower_on_moma(chords);
            drive(&case, Sampling::SERVO, Disturbance::None, false)
        });
        println!("{} s against {} s", many.duration_s, few.duration_s);
        assert!((many.duration_s / few.duration_s - 1.0).abs() <= 0.02);
        assert!(many.velocity <= 1.0 + 1e-6 && many.acceleration <= 1.0 + 1e-6);
        assert!(many.path_error_mm <= 0.01);
    });
}
