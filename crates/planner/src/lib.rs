//! From canonical commands to one setpoint per servo period, within the limits of every joint.
//!
//! The way of the data: [`Frame`] turns canonical commands (program units and coordinates) into [`Move`]s (mm, rad,
//! machine coordinates); [`Planner::push`] joins them to a path (stops, blends); the grid cuts the path into nodes
//! and asks the kinematics what each joint would have to do there; the look-ahead computes, from the end of what is
//! known backwards, how fast each node may be passed; [`Planner::tick`] goes as fast as that allows.
//!
//! `no_std`, no allocation, fixed queues, bounded work per tick. The end of the queue is always planned as a stop,
//! so the machine can stop on the path at any time and a starved queue ends at rest at the end of what is known.
//!
//! ```
//! use pkm_kins::{JointRange, Moma, MomaConfiguration, Pose};
//! use pkm_planner::path::{FeedGroup, Geometry, Line};
//! use pkm_planner::{Feed, JointLimits, Limits, Move, PathMode, Planner, Settings, State};
//!
//! // Two sliders with 200 mm of travel, 100 mm/s, 1000 mm/s²; the machine stands at `home`.
//! let moma = Moma::new(&MomaConfiguration::A.into()).unwrap();
//! let home = Pose { y: -265.0, ..Pose::ZERO };
//! let range = JointRange { min: 0.0, max: 200.0 };
//! let joint = JointLimits { range, max_velocity: 100.0, max_acceleration: 1000.0 };
//! // 0.05: how near to a singularity it may come (0 singular, 1 best).
//! let limits = Limits::<2>::new(&[joint, joint], &[], 0.05).unwrap();
//! let settings = Settings { servo_period_s: 1e-3, substeps: 1, settle_periods: 0 };
//! let mut planner = Planner::<_, 2, 16, 256>::new(moma, limits, settings, home).unwrap();
//!
//! // One line at 50 mm/s, then rest.
//! let end = Pose { x: 20.0, y: -250.0, ..Pose::ZERO };
//! let line = Line::new(*planner.end(), end.to_array()).unwrap();
//! let feed = Feed { speed: 50.0, group: FeedGroup::Xyz };
//! let geometry = Geometry::Line(line);
//! planner.push(Move { geometry, feed, rapid: false, mode: PathMode::ExactStop, span: Default::default() }).unwrap();
//! planner.finish();
//!
//! // The servo interrupt: joint positions and velocities for the step generators.
//! let mut ticks = 0;
//! let setpoint = loop {
//!     let setpoint = planner.tick().unwrap();
//!     ticks += 1;
//!     if setpoint.state == State::Idle {
//!         break setpoint;
//!     }
//! };
//! // 25 mm at 50 mm/s, and a little to set off and to stop.
//! assert!((500..600).contains(&ticks), "{ticks}");
//! assert!((setpoint.pose.x - 20.0).abs() < 1e-9 && setpoint.joint_velocity[0] == 0.0);
//! ```
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
