//! What a simulated machine is made of, and how it is wired.

use crate::block::{self, Block};
use crate::components::motion::shown;
use crate::components::probe::{Probe, Solid};
use crate::components::shaft_encoder::ShaftEncoder;
use crate::components::shaft_switch::ShaftSwitch;
use crate::components::spindle::{Spindle, SpindleConfig};
use crate::hal::Hal;
use crate::hal_error::HalError;
use crate::values::Value;
use pkm_kins::maths::{self, PI};
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
    /// mm/s² or rad/s²; infinite: any.
    pub max_acceleration: f64,
    /// Largest following error, mm or rad; 0: any.
    pub following_error: f64,
    /// Its switches, if they are simulated.
    pub switches: Option<Switches>,
}

/// The switches of a joint, mm or rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switches {
    /// Place of the home switch.
    pub home: f64,
    /// The home switch is on from its place downwards, otherwise upwards.
    pub home_below: bool,
    /// The limit switches are on below and above it.
    pub limits: JointRange,
    /// How long each contact bounces, ns.
    pub bounce_ns: u32,
    /// Of the bounces.
    pub seed: u32,
    /// Distance of the encoder's index pulses, which are at its multiples; 0: none.
    pub index_pitch: f64,
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
    /// The joints know where they are. Otherwise every joint begins at 0, wherever it stands, and must be homed.
    pub homed: bool,
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

/// The switches that a machine can have: name of the block, pin of the joint.
const SWITCHES: [(&str, &str); 3] =
    [("home-switch", "home-sw-in"), ("pos-switch", "pos-lim-sw-in"), ("neg-switch", "neg-lim-sw-in")];

/// Loads and wires the switches of one joint whose motor stands at 0 when the joint is at `origin` (mm or rad).
fn wire_switches(
    hal: &mut Hal,
    n: usize,
    joint: &JointConfig,
    switches: &Switches,
    origin: f64,
) -> Result<(), HalError> {
    let places =
        [(switches.home, switches.home_below), (switches.limits.max, false), (switches.limits.min, true)];
    for ((name, pin), (place, below)) in SWITCHES.into_iter().zip(places) {
        let name = format!("{name}.{n}");
        block::load::<ShaftSwitch>(hal, std::slice::from_ref(&name))?;
        let at = shown(joint.kind, place - origin);
        hal.setp(&format!("{name}.at"), Value::Float(at))?;
        hal.setp(&format!("{name}.below"), Value::Bit(below))?;
        hal.setp(&format!("{name}.bounce-ns"), Value::U32(switches.bounce_ns))?;
        hal.setp(&format!("{name}.seed"), Value::U32(switches.seed))?;
        hal.net(&format!("j{n}-motor-pos"), &[&format!("{name}.position")])?;
        hal.net(&format!("j{n}-{pin}"), &[&format!("{name}.out"), &format!("joint.{n}.{pin}")])?;
        hal.addf(&name, THREAD)?;
    }
    if switches.index_pitch > 0.0 {
        let name = format!("index-encoder.{n}");
        block::load::<ShaftEncoder>(hal, std::slice::from_ref(&name))?;
        let scale = joint.steps_per_unit;
        let per_turn = maths::round((switches.index_pitch * scale).abs()) as u32;
        hal.setp(&format!("{name}.scale"), Value::Float(shown_scale(joint.kind, scale)))?;
        hal.setp(&format!("{name}.offset"), Value::Float(shown(joint.kind, origin)))?;
        hal.setp(&format!("{name}.counts-per-turn"), Value::U32(per_turn))?;
        hal.net(&format!("j{n}-motor-pos"), &[&format!("{name}.position")])?;
        let index = format!("joint.{n}.index-in");
        hal.net(&format!("j{n}-index"), &[&format!("{name}.phase-z"), &index])?;
        hal.addf(&format!("{name}{}", ShaftEncoder::FUNCTION), THREAD)?;
    }
    Ok(())
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
            ("stepped", "stepgen.N.position-fb", "joint.N.motor-pos-stepped"),
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

/// The switches of all joints; `origins`: where the joints are when their motors stand at 0.
pub(crate) fn wire_all_switches(
    hal: &mut Hal,
    joints: &[JointConfig],
    origins: &[f64],
) -> Result<(), HalError> {
    for (n, (joint, origin)) in joints.iter().zip(origins).enumerate() {
        if let Some(switches) = &joint.switches {
            wire_switches(hal, n, joint, switches, *origin)?;
        }
    }
    Ok(())
}

/// Spindle and probe, behind everything else. Returns the spindle's place among the components.
pub(crate) fn wire_spindle_and_probe(
    hal: &mut Hal,
    config: &SimulationConfig,
) -> Result<Option<usize>, HalError> {
    let place = config.spindle.map(|_| hal.components().count());
    if let Some(spindle) = &config.spindle {
        Spindle::load(hal, spindle)?;
        hal.addf("spindle.0.update", THREAD)?;
    }
    if config.workpiece.is_empty() {
        return Ok(place);
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
    hal.addf("probe.0.update", THREAD)?;
    Ok(place)
}
