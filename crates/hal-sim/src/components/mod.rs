//! The components, one file each.

pub mod driver;
pub mod motion;
pub mod motor;
pub mod stepgen;
