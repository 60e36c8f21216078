//! What a simulated machine is made of, and how it is wired.

use crate::components::probe::{Probe, Solid};
use crate::components::spindle::{Spindle, SpindleConfig};
use crate::hal::Hal;
use crate::hal_error::HalError;
use pkm_kins::maths::PI;
use pkm_kins::{Axis, AxisSet, JointKind, JointRange, MAX_JOINTS, Pose};
use pkm_stepgen::{EdgeError, PulseTimingNs};
use std::fmt;

/// One joint of the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct JointConfig {
    /// For people.
    pub name: String,
    /// Length or angle.
    pub kind: JointKind,
    /// Steps per mm or rad, not 0; negative turns the motor the other way round.
    pub steps_per_unit: f64,
    /// Times of the pulses as configured.
    pub timing: PulseTimingNs,
    /// The driver's minima by its data sheet: step high, step low, direction setup and hold.
    pub driver_minimum: PulseTimingNs,
    /// Travel, mm or rad.
    pub range: JointRange,
    /// Where it stands at the start, mm or rad.
    pub start: f64,
}

/// The machine.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulationConfig {
    /// In joint order, 1 to [`MAX_JOINTS`].
    pub joints: Vec<JointConfig>,
    /// The coordinates it has.
    pub axes: AxisSet,
    /// Its pose at the start, mm and rad.
    pub start: Pose,
    /// ns, a multiple of the timer's period.
    pub servo_period_ns: u64,
    /// Unit of all edge times, ns.
    pub timer_period_ns: u64,
    /// The spindle, if there is one.
    pub spindle: Option<SpindleConfig>,
    /// What the probe can touch; nothing: no probe is wired.
    pub workpiece: Vec<Solid>,
}

/// Why a machine cannot be wired.
#[derive(Debug, Clone, PartialEq)]
pub enum ConfigError {
    /// No joint, or more than [`MAX_JOINTS`].
    JointCount(usize),
    /// A joint's scale or start is not finite, the scale is 0, or the start is beyond 2³² steps.
    Joint {
        /// Counted from 0.
        joint: usize,
        /// Why.
        error: EdgeError,
    },
    /// Periods, pulse times.
    Hal(HalError),
}

impl From<HalError> for ConfigError {
    fn from(error: HalError) -> Self {
        Self::Hal(error)
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::JointCount(count) => write!(f, "{count} joints; a machine has 1 to {MAX_JOINTS}"),
            Self::Joint { joint, error } => write!(f, "joint {joint}, scale or start: {error}"),
            Self::Hal(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ConfigError {}

/// The thread that everything runs on.
pub(crate) const THREAD: &str = "servo-thread";

/// Steps per mm, or per degree (HAL pins of rotary joints are in degrees).
pub(crate) fn shown_scale(kind: JointKind, steps_per_unit: f64) -> f64 {
    match kind {
        JointKind::Linear => steps_per_unit,
        JointKind::Rotary => steps_per_unit * (PI / 180.0),
    }
}

/// Nets and functions of a machine with so many joints.
pub(crate) fn wire(hal: &mut Hal, joints: usize) -> Result<(), HalError> {
    for n in 0..joints {
        for (signal, writer, reader) in [
            ("pos-cmd", "joint.N.motor-pos-cmd", "stepgen.N.position-cmd"),
            ("vel-cmd", "joint.N.vel-cmd", "stepgen.N.velocity-cmd"),
            ("step", "stepgen.N.step", "driver.N.step"),
            ("dir", "stepgen.N.dir", "driver.N.dir"),
            ("enable", "joint.N.amp-enable-out", "stepgen.N.enable"),
            ("enable", "joint.N.amp-enable-out", "driver.N.enable"),
            ("counts", "driver.N.counts", "motor.N.counts"),
            ("motor-pos", "motor.N.position", "joint.N.motor-pos-fb"),
        ] {
            let numbered = |pin: &str| pin.replace('N', &n.to_string());
            hal.net(&format!("j{n}-{signal}"), &[&numbered(writer), &numbered(reader)])?;
        }
    }
    for function in [
        "motion-command-handler",
        "motion-controller",
        "stepgen.update-freq",
        "driver.update",
        "motor.update",
        "stepgen.capture-position",
    ] {
        hal.addf(function, THREAD)?;
    }
    Ok(())
}

/// Spindle and probe, behind everything else.
pub(crate) fn wire_spindle_and_probe(hal: &mut Hal, config: &SimulationConfig) -> Result<(), HalError> {
    if let Some(spindle) = &config.spindle {
        Spindle::load(hal, spindle)?;
        hal.addf("spindle.0.update", THREAD)?;
    }
    if config.workpiece.is_empty() {
        return Ok(());
    }
    Probe::load(hal, &config.workpiece)?;
    for (letter, axis) in [("x", Axis::X), ("y", Axis::Y), ("z", Axis::Z)] {
        // An axis that the machine has not stays at 0.
        if config.axes.contains(axis) {
            let pins = [format!("axis.{letter}.pos-cmd"), format!("probe.0.{letter}")];
            hal.net(&format!("tool-{letter}"), &[&pins[0], &pins[1]])?;
        }
    }
    hal.net("probe", &["probe.0.tripped", "motion.probe-input"])?;
    hal.addf("probe.0.update", THREAD)
}
