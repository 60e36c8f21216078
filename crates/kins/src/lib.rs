//! Kinematics of parallel machine tools: pose ⇄ joints, Jacobians, singularities.
//!
//! `no_std`, no allocation, no panic, no time and no files. One file per mechanism, the same order in each:
//! header → parameters as written → validated type → inverse → forward → Jacobian → tests.
//!
//! The manual is `docs/kinematics.md`: every mechanism with its joints, parameters, error codes, accuracy and speed. To add your own
//! mechanism, see `docs/add-a-mechanism.md` and `examples/add_your_own_mechanism.rs`.
#![no_std]
// `!(x >= y)` is how NaN ends on the side of the error.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod attitude;
pub mod cartesian;
pub mod errors;
pub mod geometry;
pub mod hexapod;
pub mod hv_machine;
pub mod hv_mill;
pub mod kinematics;
pub mod lambda6;
pub mod linear_delta;
pub mod machine;
pub mod maths;
#[cfg(feature = "nalgebra")]
pub mod matrix;
pub mod moma;
pub mod moma_4s;
pub mod moma_w;
pub mod named;
pub mod ox_glide;
mod pair;
pub mod planar;
pub mod pose;
pub mod vector;

pub use cartesian::Cartesian;
pub use errors::{ForwardError, GeometryError, InverseError, Key, NoIntersection};
pub use hexapod::{Hexapod, HexapodParameters};
pub use hv_machine::{HvMachine, HvMachineParameters, HvSideParameters};
pub use hv_mill::{HeadParameters, HvMill, HvMillParameters, HvState, Spindle, Turn, delta_t_workpiece};
pub use kinematics::{
    Branches, Jacobian, JointKind, JointLimit, JointMotion, JointRange, Joints, Kinematics, LimitCode,
    MAX_JOINTS, Side, Singularity,
};
pub use lambda6::{Lambda6, Lambda6Leg, Lambda6Parameters, Lambda6Set};
pub use linear_delta::{LinearDelta, LinearDeltaParameters};
pub use machine::Mechanism;
pub use moma::{Moma, MomaConfiguration, MomaParameters};
pub use moma_4s::{Moma4s, Moma4sConfiguration, Moma4sParameters};
pub use moma_w::{MomaW, MomaWParameters};
pub use named::{Name, Named, Slot};
pub use ox_glide::{FormSwitch, FormSwitchError, OxForm, OxGlide, OxGlideParameters};
pub use planar::{Planar, PlanarChain, PlanarParameters, PlanarState, Vec2};
pub use pose::{Axis, AxisSet, Pose};
pub use vector::Vec3;
