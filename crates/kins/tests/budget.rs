//! The error budget: what every mechanism may be off in a round trip at regular poses (forward measure above 0.2, inverse above
#![allow(clippy::print_stdout)] // the table is the result
//! 0.05), and what was found. A mechanism that is missing from the table fails the test.

#[path = "common/zoo.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod zoo;

use pkm_kins::{Kinematics, MAX_JOINTS, Mechanism, Pose};
use zoo::{Rng, cases, seed};

/// Mechanism; forward(inverse(pose)) in mm and rad; inverse(forward(joints)) in mm.
const BUDGET: [(&str, f64, f64, f64); 10] = [
    ("Cartesian", 0.0, 0.0, 0.0),
    ("Planar", 1e-12, 0.0, 2e-12),
    ("Moma", 1e-12, 0.0, 2e-12),
    ("Moma4s", 1e-12, 0.0, 2e-12),
    ("MomaW", 2e-12, 0.0, 2e-11),
    ("HvMill", 2e-12, 0.0, 5e-12),
    ("HvMachine", 2e-12, 0.0, 5e-12),
    ("OxGlide", 1e-12, 0.0, 1e-12),
    ("Lambda6", 2e-9, 5e-12, 2e-9),
    ("LinearDelta", 2e-12, 0.0, 5e-12),
];
const HEXAPOD: (&str, f64, f64, f64) = ("Hexapod", 1e-9, 1e-11, 1e-9);

#[test]
fn every_mechanism_keeps_its_budget() {
    let budget: Vec<_> = BUDGET.into_iter().chain([HEXAPOD]).collect();
    for kind in Mechanism::KINDS {
        assert!(budget.iter().any(|row| row.0 == *kind), "{kind} has no row in the budget");
        assert!(cases().iter().any(|case| case.mechanism.kind() == *kind), "{kind} is tested nowhere");
    }
    for (kind, pose_mm, pose_rad, joint_mm) in budget {
        let (mut mm, mut rad, mut q, mut n) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
        for case in cases().iter().filter(|case| case.mechanism.kind() == kind) {
            let m = &case.mechanism;
            let mut rng = Rng::new(seed());
            for _ in 0..5000 {
                let pose = case.pose(&mut rng);
                let Ok(joints) = m.inverse(&pose) else { continue };
                let measure = m.singularity(&pose).unwrap();
                let regular = if kind == "Hexapod" { 0.01 } else { 0.2 };
                if measure.forward < regular || measure.inverse < 0.05 {
                    continue;
                }
                let mut seed = pose;
                if kind == "Lambda6" || kind == "Hexapod" {
                    seed = Pose { x: pose.x + 0.02, y: pose.y - 0.02, c: pose.c + 2e-4, ..pose };
                }
                let back = m.forward(&joints, &seed).unwrap();
                for axis in m.axes().iter() {
                    let off = (back.get(axis) - pose.get(axis)).abs();
                    if axis.is_rotary() { rad = rad.max(off) } else { mm = mm.max(off) }
                }
                let again = m.inverse(&back).unwrap();
                for j in 0..MAX_JOINTS {
                    q = q.max((again[j] - joints[j]).abs());
                }
                n += 1;
            }
        }
        println!(
            "{kind:12} {n:6} poses: {mm:.1e} of {pose_mm:.1e} mm, {rad:.1e} of {pose_rad:.1e} rad, joints {q:.1e} of {joint_mm:.1e} mm"
        );
        assert!(n > 500, "{kind}: {n} regular poses");
        assert!(
            mm <= pose_mm && rad <= pose_rad && q <= joint_mm,
            "{kind} exceeds its budget (seed {})",
            seed()
        );
    }
}
