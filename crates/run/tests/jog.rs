//! Jogging: in joint and world mode, within soft limits and singularity guards.

mod common;

use common::machine;
use pkm_kins::{Axis, Kinematics};
use pkm_run::{Jog, Jogged, jog};

#[test]
fn a_jog_goes_as_far_as_is_asked() {
    let machine = machine("moma-a", &[]);
    let x = Jog { what: Jogged::Axis(Axis::X), distance: -7.5, velocity: 20.0 };
    let end = jog(&machine, &machine.home, &x).unwrap();
    assert!((end.pose.x - (machine.home.x - 7.5)).abs() < 1e-9 && end.pose.y == machine.home.y, "{end:?}");
    assert!(end.stopped_by.is_none() && end.periods > 375, "{end:?}");
    let joint = Jog { what: Jogged::Joint(1), distance: 3.0, velocity: 20.0 };
    let after = jog(&machine, &end.pose, &joint).unwrap();
    assert!((after.joints[1] - end.joints[1] - 3.0).abs() < 1e-9);
    assert!((after.joints[0] - end.joints[0]).abs() < 1e-9, "the other joint stands");
}

#[test]
fn a_jog_to_the_limit_ends_where_the_next_place_is_not_allowed() {
    let mut reasons = Vec::new();
    for name in ["moma-a", "moma-c", "lambda6", "xyz", "hv-mill-h3"] {
        let machine = machine(name, &[]);
        let axes = machine.mechanism.axes().iter().map(Jogged::Axis).collect::<Vec<_>>();
        let all = axes.into_iter().chain((0..machine.joints.len()).map(Jogged::Joint));
        for what in all.filter(|what| !matches!(what, Jogged::Axis(axis) if axis.is_rotary())) {
            for distance in [f64::INFINITY, f64::NEG_INFINITY] {
                let end = match jog(&machine, &machine.home, &Jog { what, distance, velocity: 1000.0 }) {
                    Ok(end) => end,
                    Err(refusal) => panic!("{name} {what:?} {distance}: {refusal:?}"),
                };
                machine.check_travel(&end.joints).unwrap();
                machine.check_axes(&end.pose).unwrap();
                let measure = machine.mechanism.singularity(&end.pose).unwrap();
                assert!(measure.inverse.min(measure.forward) >= machine.singularity.guard, "{name} {what:?}");
                let why = end.stopped_by.unwrap_or_else(|| panic!("{name} {what:?} goes on for ever"));
                // there, no further
                let more = Jog { what, distance: 1e-3_f64.copysign(distance), velocity: 1.0 };
                if let Ok(again) = jog(&machine, &end.pose, &more) {
                    assert!(again.travelled.abs() < 1e-6, "{name} {what:?}: {again:?} after {why:?}");
                }
                reasons.push(why.code);
            }
        }
    }
    for code in ["limit_low:1", "limit_high:2"] {
        assert!(reasons.iter().any(|reason| reason == code), "{code}: {reasons:?}");
    }
}

#[test]
fn what_cannot_be_jogged_is_refused() {
    let machine = machine("moma-a", &[]);
    let refused = |what, distance, velocity| {
        let error = jog(&machine, &machine.home, &Jog { what, distance, velocity }).unwrap_err();
        error.message
    };
    assert!(refused(Jogged::Axis(Axis::Z), 1.0, 1.0).contains("no such axis or joint"));
    assert!(refused(Jogged::Joint(2), 1.0, 1.0).contains("no such axis or joint"));
    assert!(refused(Jogged::Joint(0), f64::NAN, 1.0).contains("velocity above 0"));
    assert!(refused(Jogged::Joint(0), 1.0, 0.0).contains("velocity above 0"));
}
