//! Kinematics of parallel machine tools: pose ⇄ joints, Jacobians, singularities.
//!
//! `no_std`, no allocation, no panic, no time and no files. One file per mechanism, the same order in each:
//! header → parameters as written → validated type → inverse → forward → Jacobian → tests.
#![no_std]

pub mod kinematics;
pub mod maths;
pub mod pose;

pub use kinematics::{
    ForwardError, InverseError, Jacobian, JointKind, JointLimit, JointMotion, JointRange, Joints, Kinematics,
    MAX_JOINTS, Side, Singularity,
};
pub use pose::{Axis, AxisSet, Pose};
