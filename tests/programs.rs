//! The shipped programs: as their generator writes them, and inside their machine's workspace.

#[path = "../programs/generate.rs"]
mod generate;

use pkm_kins::{Axis, Kinematics, Pose};
use pkm_machine::Machine;

fn shipped(name: &str) -> String {
    let path = format!("{}/../../programs/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

#[test]
fn generated_programs_are_current() {
    for (name, text) in
        [("moma-w-aerofoil.ngc", generate::aerofoil()), ("moma-w-moulding.ngc", generate::moulding())]
    {
        assert!(
            shipped(name) == text,
            "programs/{name} is not what programs/generate.rs writes; run \
             `cargo run --example generate-programs -- {}` into it",
            if name.contains("aerofoil") { "aerofoil" } else { "moulding" }
        );
    }
}

/// The end points of the straight moves of a generated program, in mm.
fn end_points(text: &str, home: Pose) -> Vec<Pose> {
    let mut pose = home;
    let mut points = vec![home];
    for line in text.lines().filter(|line| line.starts_with("G0 ") || line.starts_with("G1 ")) {
        for word in line.split_whitespace().skip(1) {
            let (letter, value) = word.split_at(1);
            let axis = Axis::ALL.into_iter().find(|axis| letter.starts_with(axis.letter())).unwrap();
            pose.set(axis, value.parse().unwrap());
        }
        points.push(pose);
    }
    points
}

#[test]
fn hot_wire_programs_stay_inside_the_workspace() {
    let machine = Machine::load("moma-w", &[]).unwrap();
    for name in ["moma-w-aerofoil.ngc", "moma-w-moulding.ngc"] {
        let points = end_points(&shipped(name), machine.home);
        assert!(points.len() > 300, "{name}: {} blocks", points.len());
        assert!(
            points.iter().filter(|p| p.x != p.u && p.y != p.v).count() > 250,
            "{name}: both ends are the same"
        );
        let rest = points[points.len() - 1];
        assert_eq!(rest, Pose { y: 18.0, v: 18.0, ..machine.home }, "{name} ends above the block");
        let mut nearest = f64::INFINITY;
        for (block, pair) in points.windows(2).enumerate() {
            for step in 0..=10 {
                let share = f64::from(step) / 10.0;
                let mut pose = Pose::ZERO;
                for axis in Axis::ALL {
                    pose.set(axis, pair[0].get(axis) + share * (pair[1].get(axis) - pair[0].get(axis)));
                }
                let joints = machine.inverse(&pose);
                assert!(joints.is_ok(), "{name} move {block}: {pose:?}: {joints:?}");
                let measure = machine.mechanism.singularity(&pose).unwrap();
                nearest = nearest.min(measure.inverse).min(measure.forward);
            }
        }
        assert!(nearest > 0.1, "{name} comes within {nearest} of a singularity");
    }
}
