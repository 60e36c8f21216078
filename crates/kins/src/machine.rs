//! One type over all mechanisms, for code that must not be generic (planner queue, HAL, command line).

use crate::cartesian::Cartesian;
use crate::errors::{ForwardError, InverseError};
use crate::hexapod::Hexapod;
use crate::hv_machine::HvMachine;
use crate::hv_mill::HvMill;
use crate::kinematics::{
    Branches, Jacobian, JointKind, JointLimit, JointMotion, Joints, Kinematics, LimitCode, Singularity,
};
use crate::lambda6::Lambda6;
use crate::linear_delta::LinearDelta;
use crate::moma::Moma;
use crate::moma_4s::Moma4s;
use crate::moma_w::MomaW;
use crate::ox_glide::OxGlide;
use crate::planar::Planar;
use crate::pose::{AxisSet, Pose};

/// Joint numbers in codes, from 1.
pub(crate) fn number(joint: usize) -> &'static str {
    ["1", "2", "3", "4", "5", "6", "7", "8", "9"].get(joint).copied().unwrap_or("?")
}

macro_rules! mechanisms {
    ($($(#[$doc:meta])* $name:ident($kind:ty)),+ $(,)?) => {
        /// Any mechanism of this crate.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[non_exhaustive]
        #[allow(clippy::large_enum_variant)] // no heap: the largest one sets the size
        pub enum Mechanism {
            $($(#[$doc])* $name($kind)),+
        }

        impl Mechanism {
            /// The name of every kind of mechanism.
            pub const KINDS: &'static [&'static str] = &[$(stringify!($name)),+];

            /// Which kind this one is: an entry of [`Self::KINDS`].
            pub const fn kind(&self) -> &'static str {
                match self { $(Self::$name(_) => stringify!($name)),+ }
            }
        }

        $(impl From<$kind> for Mechanism {
            fn from(mechanism: $kind) -> Self {
                Self::$name(mechanism)
            }
        })+

        impl Kinematics for Mechanism {
            fn joint_count(&self) -> usize {
                match self { $(Self::$name(m) => m.joint_count()),+ }
            }
            fn axes(&self) -> AxisSet {
                match self { $(Self::$name(m) => Kinematics::axes(m)),+ }
            }
            fn joint_kind(&self, joint: usize) -> JointKind {
                match self { $(Self::$name(m) => m.joint_kind(joint)),+ }
            }
            fn joint_code(&self, joint: usize) -> (&'static str, &'static str) {
                match self { $(Self::$name(m) => m.joint_code(joint)),+ }
            }
            fn limit_code(&self, limit: &JointLimit) -> LimitCode {
                match self { $(Self::$name(m) => m.limit_code(limit)),+ }
            }
            #[inline]
            fn inverse(&self, pose: &Pose) -> Result<Joints, InverseError> {
                match self { $(Self::$name(m) => Kinematics::inverse(m, pose)),+ }
            }
            #[inline]
            fn forward(&self, joints: &Joints, seed: &Pose) -> Result<Pose, ForwardError> {
                match self { $(Self::$name(m) => Kinematics::forward(m, joints, seed)),+ }
            }
            #[inline(always)]
            fn inverse_into(&self, pose: &Pose, joints: &mut Joints) -> Result<(), InverseError> {
                match self { $(Self::$name(m) => m.inverse_into(pose, joints)),+ }
            }
            #[inline(always)]
            fn forward_into(&self, joints: &Joints, pose: &mut Pose) -> Result<(), ForwardError> {
                match self { $(Self::$name(m) => m.forward_into(joints, pose)),+ }
            }
            fn jacobian(&self, pose: &Pose) -> Result<Jacobian, InverseError> {
                match self { $(Self::$name(m) => Kinematics::jacobian(m, pose)),+ }
            }
            #[inline]
            fn motion(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<JointMotion, InverseError> {
                match self { $(Self::$name(m) => Kinematics::motion(m, pose, velocity, acceleration)),+ }
            }
            #[inline]
            fn motion_into(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose, motion: &mut JointMotion) -> Result<(), InverseError> {
                match self { $(Self::$name(m) => m.motion_into(pose, velocity, acceleration, motion)),+ }
            }
            #[inline]
            fn passage(&self, pose: &Pose, velocity: &Pose, acceleration: &Pose) -> Result<Joints, InverseError> {
                match self { $(Self::$name(m) => Kinematics::passage(m, pose, velocity, acceleration)),+ }
            }
            fn singularity(&self, pose: &Pose) -> Result<Singularity, InverseError> {
                match self { $(Self::$name(m) => Kinematics::singularity(m, pose)),+ }
            }
            fn inverse_branches(&self, pose: &Pose) -> Result<Branches<Joints>, InverseError> {
                match self { $(Self::$name(m) => Kinematics::inverse_branches(m, pose)),+ }
            }
            fn forward_branches(&self, joints: &Joints, seed: &Pose) -> Result<Branches<Pose>, ForwardError> {
                match self { $(Self::$name(m) => Kinematics::forward_branches(m, joints, seed)),+ }
            }
        }
    };
}

mechanisms! {
    /// Joint = coordinate.
    Cartesian(Cartesian),
    /// Two P-R-R chains, any parameters.
    Planar(Planar),
    /// Two sliders, two links, one hinge.
    Moma(Moma),
    /// Platform on two pairs of links.
    Moma4s(Moma4s),
    /// Hot wire between two MOMA 4S.
    MomaW(MomaW),
    /// One mechanism of the HV-Mill with carriage, table and head.
    HvMill(HvMill),
    /// The HV-Mill with both mechanisms, one active.
    HvMachine(HvMachine),
    /// Two forms on one rail.
    OxGlide(OxGlide),
    /// Six sliders on three shafts.
    Lambda6(Lambda6),
    /// Three carriages on vertical columns.
    LinearDelta(LinearDelta),
    /// Six struts of variable length.
    Hexapod(Hexapod),
}

impl Mechanism {
    /// Limits that couple joints and therefore are no joint's travel: Lambda's slider spacing. The inverse applies them by
    /// itself; after a forward query they are asked for here.
    ///
    /// # Errors
    /// `Spacing`.
    pub fn coupled_limits(&self, joints: &Joints) -> Result<(), InverseError> {
        match self {
            Self::Lambda6(m) => m.check_spacing(joints),
            _ => Ok(()),
        }
    }

    /// The same mechanism without limits of its own that are not geometry (wire length and tilt, ...):
    /// what `--no-limits` asks.
    pub fn without_limits(self) -> Self {
        match self {
            Self::MomaW(m) => Self::MomaW(m.without_limits()),
            Self::OxGlide(m) => Self::OxGlide(m.without_limits()),
            Self::Lambda6(m) => Self::Lambda6(m.without_limits()),
            other => other,
        }
    }
}
