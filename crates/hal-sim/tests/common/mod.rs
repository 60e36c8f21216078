//! A machine and a motion for the tests.
#![allow(dead_code, missing_docs, unreachable_pub)]

use pkm_hal_sim::{JointConfig, PulseTimingNs, Setpoint, SetpointSource, Simulation, SimulationConfig};
use pkm_kins::maths::{PI, cos, sin};
use pkm_kins::{Axis, AxisSet, JointKind, JointRange, Pose};
use std::convert::Infallible;

pub const SERVO_NS: u64 = 1_000_000;

pub fn config(joints: usize, timer_period_ns: u64) -> SimulationConfig {
    let timing = PulseTimingNs { step_length: 2000, step_space: 2000, dir_setup: 2000, dir_hold: 2000 };
    let minimum = PulseTimingNs { step_length: 1900, step_space: 1900, dir_setup: 650, dir_hold: 650 };
    let joint = |n: usize| JointConfig {
        name: format!("p{}", n + 1),
        kind: if n == 4 { JointKind::Rotary } else { JointKind::Linear },
        steps_per_unit: if n == 4 { 100.0 * 180.0 / PI } else { 400.0 },
        timing,
        driver_minimum: minimum,
        range: JointRange { min: -1000.0, max: 1000.0 },
        start: wave(n, 0.0).0,
        max_acceleration: f64::INFINITY,
        following_error: 0.0,
        switches: None,
    };
    SimulationConfig {
        joints: (0..joints).map(joint).collect(),
        axes: AxisSet::new(&[Axis::X, Axis::Y, Axis::B]),
        start: Pose::ZERO,
        homed: true,
        servo_period_ns: SERVO_NS,
        timer_period_ns,
        spindle: None,
        workpiece: Vec::new(),
    }
}

/// Position and velocity of joint n at time t: starts at rest, reverses, differs from joint to joint.
pub fn wave(n: usize, t: f64) -> (f64, f64) {
    let omega = 3.0 + n as f64;
    // about 20 mm/s; joint 4 is rotary: about 80 degrees/s
    let (speed, base) = if n == 4 { (1.4, 0.5) } else { (20.0, n as f64 * 1.00125) };
    let amplitude = speed / omega;
    (base + amplitude * (1.0 - cos(omega * t)), amplitude * omega * sin(omega * t))
}

pub struct Waves {
    pub joints: usize,
}

impl SetpointSource for Waves {
    type Error = Infallible;

    fn next(&mut self, tick: u64) -> Result<Setpoint, Infallible> {
        let mut setpoint = Setpoint { line: (tick / 100) as u32 + 1, ..Setpoint::default() };
        for n in 0..self.joints {
            let (position, velocity) = wave(n, (tick * SERVO_NS) as f64 / 1e9);
            setpoint.joints[n] = position;
            setpoint.velocities[n] = velocity;
        }
        setpoint.pose.x = setpoint.joints[0];
        Ok(setpoint)
    }
}

pub fn machine(joints: usize) -> (Simulation, Waves) {
    (Simulation::new(&config(joints, 100)).unwrap(), Waves { joints })
}
