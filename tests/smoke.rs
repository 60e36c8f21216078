//! Every shipped machine runs a small program: each axis a little out and back, then all together.

use crate::support::pkm_with_input;
use pkm_kins::{Axis, Kinematics, Pose, maths};
use pkm_machine::{Machine, shipped};
use std::fmt::Write as _;

/// The axes that this machine can move from where it stands (others are locked in its mode, or idle).
fn movable(machine: &Machine) -> Vec<Axis> {
    let can_move = |axis: &Axis| {
        let mut there = machine.home;
        there.set(*axis, there.get(*axis) + if axis.is_rotary() { maths::radians(1.0) } else { 1.0 });
        let mut velocity = Pose::ZERO;
        velocity.set(*axis, 1.0);
        machine.inverse(&there).is_ok()
            && machine.mechanism.motion(&machine.home, &velocity, &Pose::ZERO).is_ok()
    };
    machine.mechanism.axes().iter().filter(can_move).collect()
}

fn program(machine: &Machine, axes: &[Axis]) -> String {
    let face = |axis: Axis, value: f64| if axis.is_rotary() { maths::degrees(value) } else { value };
    let mut text = String::from("G21 G90 G64 P0.01 F300\n");
    let word = |axis: Axis, by: f64| format!("{}{} ", axis.letter(), face(axis, machine.home.get(axis)) + by);
    for &axis in axes {
        let _ = writeln!(text, "G1 {}\nG0 {}", word(axis, 1.0), word(axis, 0.0));
    }
    for by in [0.5, -0.5, 0.0] {
        let all: String = axes.iter().map(|&axis| word(axis, by)).collect();
        let _ = writeln!(text, "G1 {all}");
    }
    text.push_str("M2\n");
    text
}

#[test]
fn every_shipped_machine_runs() {
    for (name, _) in shipped::SHIPPED {
        let machine = Machine::load(name, &[]).unwrap();
        let axes = movable(&machine);
        assert!(axes.len() >= 2, "{name} moves only {axes:?}");
        let program = program(&machine, &axes);
        let run = pkm_with_input(&["run", "-", "--machine", name, "--format", "json"], program.as_bytes());
        assert_eq!(run.status, 0, "{name}: {}{}\n{program}", run.stdout, run.stderr);
        let summary = &run.json_lines()[0];
        assert_eq!(summary["completed"], true, "{name}");
        assert!(summary["max_step_error_steps"].as_f64().unwrap() <= 0.5, "{name}: {summary}");
        assert_eq!(summary["driver_timing_violations"], 0, "{name}");
        for joint in summary["joints"].as_array().unwrap() {
            for (peak, limit) in
                [("peak_velocity", "velocity_limit"), ("peak_acceleration", "acceleration_limit")]
            {
                assert!(joint[peak].as_f64() <= joint[limit].as_f64(), "{name}: {joint}");
            }
        }
    }
}
