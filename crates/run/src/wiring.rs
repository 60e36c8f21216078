//! From a machine file to the simulated machine and its homing.

use pkm_hal_sim::{HomeJoint, Homing, HomingConfig, JointConfig, SimulationConfig, Switches};
use pkm_kins::{JointRange, Kinematics, Pose};
use pkm_machine::Machine;

/// Limit switches stand so far beyond the travel, as a share of it.
const OVERTRAVEL: f64 = 0.01;

/// How a machine is simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wiring {
    /// Periods of the HAL in a servo period.
    pub(crate) substeps: u64,
    /// It has switches.
    pub(crate) switches: bool,
    /// It knows where it is.
    pub(crate) homed: bool,
    /// Of the bounces of its switches.
    pub(crate) seed: u32,
}

/// The machine at a pose that it can be at.
pub(crate) fn config(machine: &Machine, start: Pose, wiring: Wiring) -> SimulationConfig {
    let at_start = machine.mechanism.inverse(&start).unwrap_or_default();
    let joints = machine.joints.iter().zip(at_start).map(|(joint, start)| {
        let beyond = OVERTRAVEL * (joint.range.max - joint.range.min);
        let limits = JointRange { min: joint.range.min - beyond, max: joint.range.max + beyond };
        let switches = Switches {
            home: joint.homing.switch,
            home_below: joint.homing.search_velocity < 0.0,
            limits,
            bounce_ns: machine.homing.bounce_ns,
            seed: wiring.seed,
            index_pitch: joint.homing.index_pitch,
        };
        JointConfig {
            name: joint.name.clone(),
            kind: joint.kind,
            steps_per_unit: joint.steps_per_unit,
            timing: joint.timing,
            driver_minimum: joint.driver.minimum,
            range: joint.range,
            start,
            max_acceleration: joint.max_acceleration,
            following_error: joint.following_error,
            switches: wiring.switches.then_some(switches),
        }
    });
    SimulationConfig {
        joints: joints.collect(),
        axes: machine.mechanism.axes(),
        start,
        homed: wiring.homed,
        servo_period_ns: machine.servo_period_ns / wiring.substeps,
        timer_period_ns: machine.timer_period_ns,
        spindle: None,
        workpiece: Vec::new(),
    }
}

/// The homing of a machine whose joints stand at `positions` by what is known now, mm or rad; it ends at pose `to`.
pub(crate) fn homing(machine: &Machine, to: Pose, substeps: u64, positions: &[f64]) -> Homing {
    let at_home = machine.mechanism.inverse(&to).unwrap_or_default();
    let joints = machine.joints.iter().zip(at_home).map(|(joint, home)| HomeJoint {
        name: joint.name.clone(),
        search_velocity: joint.homing.search_velocity,
        latch_velocity: joint.homing.latch_velocity,
        switch: joint.homing.reference(),
        home,
        sequence: joint.homing.sequence,
        use_index: joint.homing.index_pitch > 0.0,
        repeat: 2.0 / joint.steps_per_unit,
        travel: (joint.range.max - joint.range.min) * (1.0 + 2.0 * OVERTRAVEL),
        velocity: joint.homing.search_velocity.abs(),
        acceleration: joint.max_acceleration,
    });
    let period_s = (machine.servo_period_ns / substeps) as f64 / 1e9;
    let config = HomingConfig { period_s, debounce_s: machine.homing.debounce_s };
    Homing::new(config, joints.collect(), positions)
}
