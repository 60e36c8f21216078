//! From canonical commands to one setpoint per servo period, within the limits of every joint.
//!
//! The way of the data: [`Frame`] turns canonical commands (program units and coordinates) into [`Move`]s (mm, rad,
//! machine coordinates); [`Planner::push`] joins them to a path (stops, blends); the grid cuts the path into nodes
//! and asks the kinematics what each joint would have to do there; the look-ahead computes, from the end of what is
//! known backwards, how fast each node may be passed; [`Planner::tick`] goes as fast as that allows.
//!
//! `no_std`, no allocation, fixed queues, bounded work per tick. The end of the queue is always planned as a stop,
//! so the machine can stop on the path at any time and a starved queue ends at rest at the end of what is known.
#![no_std]

#[cfg(test)]
#[macro_use]
extern crate std;

mod executor;
mod frame;
mod grid;
mod interval;
mod jerk;
mod limits;
mod merge;
mod operator;
mod pair;
pub mod path;
mod planner;
mod switch;
mod synchronised;
mod walk;

pub use frame::{Event, Frame, SpindleOrder};
pub use jerk::Smoother;
pub use limits::{AxisLimits, Feed, GUARD, JointLimits, Limits, LimitsError};
pub use merge::{Chords, MOST_MERGED, Merger};
pub use planner::{Move, PathMode, Planner, PushError, Setpoint, Settings, State, Work};
pub use synchronised::{RESERVE, SpindleReading, Stage, Synchronised, SynchronisedMove, Tap};

use pkm_canon::Span;
use pkm_kins::{Axis, InverseError, JointRange, Pose};

/// Why a piece of the path cannot be run, with its place in the source and on the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanError {
    /// What is wrong.
    pub kind: PlanErrorKind,
    /// The block.
    pub span: Span,
    /// The pose at which it was found (mm, rad).
    pub pose: Pose,
}

/// What is wrong with a pose on the path.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum PlanErrorKind {
    /// No joint positions, or too near a singularity.
    Unreachable(InverseError),
    /// A feed that is not above 0: the move would never end.
    NoFeed,
    /// A move in step with the spindle whose travel per turn is not above 0.
    NoPitch,
    /// A joint outside its travel.
    JointTravel {
        /// From 0.
        joint: usize,
        /// Where it would have to be, mm or rad.
        value: f64,
        /// Its travel.
        range: JointRange,
    },
    /// An axis outside its travel.
    AxisTravel {
        /// Which.
        axis: Axis,
        /// Where it would have to be, mm or rad.
        value: f64,
        /// Its travel.
        range: JointRange,
    },
}
