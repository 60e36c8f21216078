//! What a component is, what it sees of a period, and how it refuses.

use crate::components::motion::Operator;
use crate::components::spindle::SpindleCommand;
use crate::values::Values;
use pkm_kins::{Joints, Pose};
use pkm_stepgen::{EdgeError, Period};
use std::fmt;

/// What the planner wants at the *end* of a servo period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Setpoint {
    /// Commanded pose, mm and rad.
    pub pose: Pose,
    /// Joint positions, mm or rad.
    pub joints: Joints,
    /// Joint velocities, mm/s or rad/s.
    pub velocities: Joints,
    /// Line of the block that is being executed, counted from 1; 0 = none.
    pub line: u32,
    /// No motion is under way and none is waiting.
    pub in_position: bool,
    /// What the spindle is to do in this period.
    pub spindle: SpindleCommand,
}

/// What the encoder and the drive of the spindle tell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpindleFeedback {
    /// Turns since the last index that was waited for; negative = counter-clockwise.
    pub revs: f64,
    /// Turns a second.
    pub speed_rps: f64,
    /// As fast as commanded.
    pub at_speed: bool,
    /// Still waiting for the index.
    pub index_enable: bool,
    /// At the angle that M19 asked for.
    pub is_oriented: bool,
}

/// What the machine tells the motion controller at the end of a period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Feedback {
    /// Of the spindle, if there is one.
    pub spindle: SpindleFeedback,
    /// `motion.probe-input`
    pub probe: bool,
    /// What the operator asks for.
    pub operator: Operator,
}

/// Where setpoints come from: a planner, a table, a test.
pub trait SetpointSource {
    /// Why there is none.
    type Error;

    /// What the machine tells, before each setpoint; a source that does not listen need not.
    fn feedback(&mut self, feedback: &Feedback) {
        let _ = feedback;
    }

    /// The setpoint for the end of servo period `tick`, counted from 1.
    ///
    /// # Errors
    /// The source's own; the machine then stays where it is.
    fn next(&mut self, tick: u64) -> Result<Setpoint, Self::Error>;
}

/// The period in which a function runs.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a> {
    /// Number of the period of this thread, counted from 1: it ends at `number` × its length.
    pub number: u64,
    /// Its times.
    pub period: Period,
    /// For the motion component: where to be at its end. None: stay.
    pub setpoint: Option<&'a Setpoint>,
}

/// A component: owns its pins (by index) and its state; its functions run on threads.
pub trait Component: std::any::Any + Send + Sync {
    /// Its name, e.g. `stepgen`.
    fn name(&self) -> &'static str;

    /// Runs one of its functions, numbered in the order of `Hal::add_component`.
    ///
    /// # Errors
    /// A [`Fault`]; the outputs stay as they were, or safe.
    fn run(&mut self, function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault>;

    /// A copy with its state, so that a whole HAL can be cloned and continued twice.
    fn boxed_clone(&self) -> Box<dyn Component>;
}

impl Clone for Box<dyn Component> {
    fn clone(&self) -> Self {
        self.boxed_clone()
    }
}

/// Why a component refused; names the pin and the tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// A pin was given NaN or infinity.
    NotFinite {
        /// Servo period.
        tick: u64,
        /// The pin.
        pin: PinName,
        /// What it was given.
        value: f64,
    },
    /// A joint was commanded to jump further than its pulses can follow.
    Jump {
        /// Servo period.
        tick: u64,
        /// The pin.
        pin: PinName,
        /// Change within the period, steps.
        steps: f64,
        /// The most steps that the pulse timing allows in a period.
        max: u64,
    },
    /// A joint was commanded out of its travel.
    OutOfTravel {
        /// Servo period.
        tick: u64,
        /// The pin.
        pin: PinName,
        /// mm or degrees
        value: f64,
        /// mm or degrees
        limit: f64,
    },
    /// A joint is further from its command than allowed.
    FollowingError {
        /// Servo period.
        tick: u64,
        /// The pin.
        pin: PinName,
        /// Commanded less actual position, mm or degrees.
        value: f64,
        /// mm or degrees
        limit: f64,
    },
    /// A joint was commanded to change its speed faster than its motor may.
    Acceleration {
        /// Servo period.
        tick: u64,
        /// The pin.
        pin: PinName,
        /// mm/s² or degrees/s²
        value: f64,
        /// mm/s² or degrees/s²
        limit: f64,
    },
    /// A drive says that it has failed.
    AmplifierFault {
        /// Servo period.
        tick: u64,
        /// The pin.
        pin: PinName,
    },
    /// No setpoint came for too many servo periods in a row.
    MissedPeriods {
        /// Servo period.
        tick: u64,
        /// How many.
        periods: u32,
    },
    /// A limit switch is on.
    LimitSwitch {
        /// Servo period.
        tick: u64,
        /// The pin.
        pin: PinName,
    },
    /// A parameter was set to what the component cannot use.
    Parameter {
        /// Servo period.
        tick: u64,
        /// The parameter.
        pin: PinName,
    },
    /// A step generator refused its target.
    Steps {
        /// Servo period.
        tick: u64,
        /// Which generator.
        joint: u8,
        /// Why.
        error: EdgeError,
    },
}

impl Fault {
    /// Motion refused, and stops the machine itself.
    pub const fn is_of_motion(&self) -> bool {
        !matches!(self, Self::Steps { .. } | Self::Parameter { .. })
    }
}

/// Name of a numbered pin, without allocation: `joint.0.pos-cmd`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinName {
    /// `joint`
    pub owner: &'static str,
    /// `0`, or an axis letter
    pub index: PinIndex,
    /// `pos-cmd`
    pub pin: &'static str,
}

/// The middle of a pin's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinIndex {
    /// A number.
    Number(u8),
    /// A letter, printed in lower case.
    Letter(char),
}

impl fmt::Display for PinName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.index {
            PinIndex::Number(number) => write!(f, "{}.{number}.{}", self.owner, self.pin),
            PinIndex::Letter(letter) => {
                write!(f, "{}.{}.{}", self.owner, letter.to_ascii_lowercase(), self.pin)
            }
        }
    }
}

/// To a millionth, which is what a person reads of it.
fn short(value: f64) -> f64 {
    if value.abs() < 1e9 { (value * 1e6).round() / 1e6 } else { value }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { tick, pin, value } => write!(f, "{pin} was given {value} at tick {tick}"),
            Self::Jump { tick, pin, steps, max } => write!(
                f,
                "{pin} jumps by {steps} steps at tick {tick}; the pulse timing allows {max} in a servo period"
            ),
            Self::OutOfTravel { tick, pin, value, limit } => {
                write!(f, "{pin} is {value} at tick {tick}, beyond the end of travel at {limit}")
            }
            Self::FollowingError { tick, pin, value, limit } => {
                write!(f, "{pin} is {} at tick {tick}, the limit is {limit}", short(value))
            }
            Self::Acceleration { tick, pin, value, limit } => {
                write!(
                    f,
                    "{pin} asks for an acceleration of {} at tick {tick}, the limit is {limit}",
                    short(value)
                )
            }
            Self::AmplifierFault { tick, pin } => write!(f, "{pin} is on at tick {tick}: a drive has failed"),
            Self::MissedPeriods { tick, periods } => {
                write!(f, "no setpoint came for {periods} servo periods up to tick {tick}")
            }
            Self::LimitSwitch { tick, pin } => write!(f, "{pin} is on at tick {tick}"),
            Self::Parameter { tick, pin } => write!(f, "{pin} cannot be used as it is set, at tick {tick}"),
            Self::Steps { tick, joint, error } => write!(f, "stepgen.{joint} at tick {tick}: {error}"),
        }
    }
}

impl std::error::Error for Fault {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_following_error_is_told_in_digits_one_can_read() {
        let pin = PinName { owner: "joint", index: PinIndex::Number(1), pin: "f-error" };
        let fault = Fault::FollowingError { tick: 401, pin, value: 0.026_533_213_925_006_294, limit: 0.0075 };
        assert_eq!(fault.to_string(), "joint.1.f-error is 0.026533 at tick 401, the limit is 0.0075");
    }
}
