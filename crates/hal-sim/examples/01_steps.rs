//! Two joints on a circle for two seconds; the step lines go to stdout as a value change dump:
//! `cargo run -p pkm-hal-sim --example 01_steps > steps.vcd`, then open it in PulseView or GTKWave.

use pkm_hal_sim::{JointConfig, PulseTimingNs, Setpoint, Simulation, SimulationConfig, VcdWriter};
use pkm_kins::maths::{PI, cos, sin};
use pkm_kins::{Axis, AxisSet, JointKind, JointRange, Pose};
use std::error::Error;
use std::io::stdout;

fn main() -> Result<(), Box<dyn Error>> {
    let timing = PulseTimingNs { step_length: 2000, step_space: 2000, dir_setup: 1000, dir_hold: 1000 };
    let driver = PulseTimingNs { step_length: 1900, step_space: 1900, dir_setup: 650, dir_hold: 650 };
    let joint = |name: &str, start| JointConfig {
        name: name.to_owned(),
        kind: JointKind::Linear,
        steps_per_unit: 80.0,
        timing,
        driver_minimum: driver,
        range: JointRange { min: -50.0, max: 50.0 },
        start,
        max_acceleration: f64::INFINITY,
        following_error: 0.0,
        switches: None,
    };
    let mut simulation = Simulation::new(&SimulationConfig {
        joints: vec![joint("x", 10.0), joint("y", 0.0)],
        axes: AxisSet::new(&[Axis::X, Axis::Y]),
        start: Pose { x: 10.0, ..Pose::ZERO },
        homed: true,
        servo_period_ns: 1_000_000,
        timer_period_ns: 1000,
        spindle: None,
        workpiece: Vec::new(),
    })?;
    let mut vcd = VcdWriter::new(stdout().lock(), &simulation);
    for tick in 1..=2000 {
        // radius 10 mm, one turn in two seconds, speeding up and slowing down
        let u = f64::from(tick) / 2000.0;
        let (angle, rate) = (2.0 * PI * u * u * (3.0 - 2.0 * u), 2.0 * PI * 6.0 * u * (1.0 - u) / 2.0);
        let (c, s) = (10.0 * cos(angle), 10.0 * sin(angle));
        let mut setpoint = Setpoint { pose: Pose { x: c, y: s, ..Pose::ZERO }, ..Setpoint::default() };
        (setpoint.joints[0], setpoint.joints[1]) = (c, s);
        (setpoint.velocities[0], setpoint.velocities[1]) = (-s * rate, c * rate);
        simulation.tick_to(&setpoint, &mut [&mut vcd])?;
    }
    drop(vcd.finish()?);
    for (n, joint) in simulation.statistics().iter().enumerate() {
        eprintln!("joint {n}: {} steps, never off by more than {:.3}", joint.steps, joint.max_edge_error);
    }
    Ok(())
}
