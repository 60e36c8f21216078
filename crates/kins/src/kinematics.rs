//! The face every mechanism shows: LinuxCNC's `kinematicsInverse` and `kinematicsForward`, with typed errors.
//!
//! A branch (working or assembly mode) is part of the mechanism's parameters; nothing switches it silently.
//! Joint travel is not part of a mechanism: it is checked with [`JointRange`], because a machine file states it.

use crate::pose::{AxisSet, Pose};
use core::fmt;

pub use crate::errors::{ForwardError, GeometryError, InverseError, NoIntersection};

/// The most joints a machine may have here (LinuxCNC's modules for these machines need at most seven).
pub const MAX_JOINTS: usize = 9;

/// Joint positions in joint order (mm or rad); entries past the machine's joint count are 0.
pub type Joints = [f64; MAX_JOINTS];

/// ∂joint/∂pose: one row per joint, nine columns in letter order; angular columns per radian.
pub type Jacobian = [[f64; 9]; MAX_JOINTS];

/// Whether a joint's coordinate is a length or an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// mm
    Linear,
    /// rad
    Rotary,
}

/// Which end of a range was passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Side {
    Low,
    High,
}

/// Joint positions with their first and second derivative along a path (or in time).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointMotion {
    /// q: mm or rad
    pub position: Joints,
    /// dq/ds, or q̇ in mm/s, rad/s
    pub velocity: Joints,
    /// d²q/ds², or q̈
    pub acceleration: Joints,
}

/// How near a pose is to each kind of singularity. Both measures are dimensionless, 1 at best, 0 at a singularity
/// (Lambda's σ may exceed 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Singularity {
    /// Type 1 (inverse): the smallest μ over the joints, the cosine between link and guide.
    pub inverse: f64,
    /// The joint with the smallest μ, counted from 0.
    pub inverse_joint: usize,
    /// Type 2 (forward): ν, the sine between the links; |σ| for Lambda. The smaller of both for two mechanisms.
    pub forward: f64,
}

/// Travel of one joint (mm or rad), both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub struct JointRange {
    pub min: f64,
    pub max: f64,
}

/// A joint outside its travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimit {
    /// Counted from 0.
    pub joint: usize,
    /// Which end.
    pub side: Side,
    /// Where the joint would have to be (mm or rad).
    pub value: f64,
    /// The end of its travel (mm or rad).
    pub limit: f64,
}

impl JointRange {
    /// Slack for rounding, from the specification (mm, rad).
    pub const TOLERANCE: f64 = 1e-9;

    /// True within the range or past its ends by rounding only; false for NaN.
    pub fn contains(&self, value: f64) -> bool {
        value >= self.min - Self::TOLERANCE && value <= self.max + Self::TOLERANCE
    }

    /// Checks the joints against their travel and names the first one outside.
    pub fn check(ranges: &[JointRange], joints: &Joints) -> Result<(), JointLimit> {
        for ((range, &value), joint) in ranges.iter().zip(joints).zip(0..MAX_JOINTS) {
            if !(value >= range.min - Self::TOLERANCE) {
                return Err(JointLimit { joint, side: Side::Low, value, limit: range.min });
            }
            if !(value <= range.max + Self::TOLERANCE) {
                return Err(JointLimit { joint, side: Side::High, value, limit: range.max });
            }
        }
        Ok(())
    }
}

/// The code of a joint outside its travel, e.g. `limit_low:2`, `m2:limit_high:1`, `slider_min:4`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LimitCode {
    prefix: &'static str,
    word: &'static str,
    name: &'static str,
}

impl LimitCode {
    /// `{prefix}{word}:{name}`.
    pub const fn new(prefix: &'static str, word: &'static str, name: &'static str) -> Self {
        Self { prefix, word, name }
    }
}

impl fmt::Display for LimitCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}:{}", self.prefix, self.word, self.name)
    }
}

/// All solutions of one query, at most [`Branches::CAPACITY`]: a list without allocation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Branches<T> {
    items: [T; 16],
    count: usize,
}

impl<T: Copy + Default + PartialEq> Branches<T> {
    /// The most solutions kept: MOMA-W has 2⁴ working modes.
    pub const CAPACITY: usize = 16;

    /// No solution.
    pub fn new() -> Self {
        Self { items: [T::default(); 16], count: 0 }
    }

    /// Adds a solution, unless it is there already (two branches meet at a singularity) or the list is full.
    pub fn push(&mut self, item: T) {
        if self.as_slice().contains(&item) {
            return;
        }
        if let Some(place) = self.items.get_mut(self.count) {
            *place = item;
            self.count = self.count.saturating_add(1);
        }
    }

    /// The solutions.
    pub fn as_slice(&self) -> &[T] {
        self.items.get(..self.count).unwrap_or(&[])
    }
}

impl<T: Copy + Default + PartialEq> Default for Branches<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// [`Kinematics::motion`] of a mechanism with a [`Kinematics::motion_into`] of its own.
#[inline]
pub(crate) fn motion_of(
    mechanism: &impl Kinematics,
    pose: &Pose,
    velocity: &Pose,
    acceleration: &Pose,
) -> Result<JointMotion, InverseError> {
    let mut motion = JointMotion::default();
    mechanism.motion_into(pose, velocity, acceleration, &mut motion)?;
    Ok(motion)
}

/// What every mechanism can do. Implementations never panic, allocate, loop without bound or return NaN.
pub trait Kinematics {
    /// Number of joints, at most [`MAX_JOINTS`].
    fn joint_count(&self) -> usize;

    /// The coordinates the machine has.
    fn axes(&self) -> AxisSet;

    /// Length or angle.
    fn joint_kind(&self, joint: usize) -> JointKind;

    /// How the specification's error codes name a joint's travel: prefix and name, so that the code is
    /// `{prefix}limit_low:{name}`, e.g. `("", "1")`, `("m2:", "1")`, `("", "AB")`.
    fn joint_code(&self, joint: usize) -> (&'static str, &'static str);

    /// The code of a joint outside its travel: what a message should show. `limit_low:1` by default;
    /// Lambda writes `slider_min:1`.
    fn limit_code(&self, limit: &JointLimit) -> LimitCode {
        let (prefix, name) = self.joint_code(limit.joint);
        let word = match limit.side {
            Side::Low => "limit_low",
            Side::High => "limit_high",
        };
        LimitCode::new(prefix, word, name)
    }

    /// Pose → joints, in the configured working mode.
    ///
    /// # Errors
    /// See [`InverseError`]; joint travel is not checked here.
    fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError>;

    /// Joints → pose, in the configured assembly mode. `seed` is a pose nearby; closed forms ignore it.
    ///
    /// # Errors
    /// See [`ForwardError`]; joint travel is not checked here.
    fn forward(&self, joints: &Joints, seed: &Pose) -> Result<Pose, ForwardError>;

    /// [`Self::inverse`] straight into the machine's own places of `joints`: the others keep their value, and after an error
    /// nothing is written. What a servo thread calls: for a planar mechanism moving nine places would cost as much as solving it.
    ///
    /// # Errors
    /// As [`Self::inverse`].
    #[inline]
    fn inverse_into(&self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
        let all = self.inverse(pose)?;
        for (place, joint) in joints.iter_mut().zip(all).take(self.joint_count()) {
            *place = joint;
        }
        Ok(())
    }

    /// [`Self::forward`] in LinuxCNC's manner: `pose` holds the seed, then the answer; after an error still the seed.
    ///
    /// # Errors
    /// As [`Self::forward`].
    #[inline]
    fn forward_into(&self, joints: &Joints, pose: &mut Pose) -> Result<(), ForwardError> {
        *pose = self.forward(joints, pose)?;
        Ok(())
    }

    /// ∂joints/∂pose at `pose`.
    ///
    /// # Errors
    /// As [`Self::inverse`], and `Singular` where the derivative does not exist.
    fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError>;

    /// Joint positions, velocities and accelerations for a pose moving with `velocity` and `acceleration`
    /// (per second, or per unit of any path parameter).
    ///
    /// # Errors
    /// As [`Self::jacobian`].
    fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError>;

    /// [`Self::motion`] straight into `motion`, of which only the machine's own places count then, and after an error nothing. What
    /// the planner calls at every node.
    ///
    /// # Errors
    /// As [`Self::motion`].
    #[inline]
    fn motion_into(
        &self,
        pose: &Pose,
        velocity: &Pose,
        acceleration: &Pose,
        motion: &mut JointMotion,
    ) -> Result<(), InverseError> {
        *motion = self.motion(pose, velocity, acceleration)?;
        Ok(())
    }

    /// The joints at `pose` if nothing is in the way of a motion through it: what [`Self::motion`] answers and refuses,
    /// without the derivatives. For looking along a path.
    ///
    /// # Errors
    /// As [`Self::motion`].
    #[inline]
    fn passage(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<Joints, InverseError> {
        match self.motion(pose, velocity, acceleration) {
            Ok(motion) => Ok(motion.position),
            Err(error) => Err(error),
        }
    }

    /// Distance from singularities at a reachable pose.
    ///
    /// # Errors
    /// As [`Self::inverse`].
    fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError>;

    /// The joints of every working mode, the configured one first where it exists.
    ///
    /// # Errors
    /// As [`Self::inverse`], if no working mode reaches the pose.
    fn inverse_branches(&self, pose: &Pose) -> Result<Branches<Joints>, InverseError> {
        let mut all = Branches::new();
        all.push(self.inverse(pose)?);
        Ok(all)
    }

    /// The pose of every assembly mode, the configured one first where it exists.
    ///
    /// # Errors
    /// As [`Self::forward`], if no assembly exists.
    fn forward_branches(&self, joints: &Joints, seed: &Pose) -> Result<Branches<Pose>, ForwardError> {
        let mut all = Branches::new();
        all.push(self.forward(joints, seed)?);
        Ok(all)
    }
}
