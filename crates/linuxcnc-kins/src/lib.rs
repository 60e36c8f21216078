//! LinuxCNC kinematics modules: the kinematics that planned and checked a program on the desk, loaded into an unmodified
//! LinuxCNC by `loadrt moma_kins` (and `moma_w_kins`, `hv_machine_kins`, `ox_glide_kins`, `lambda_kins`, ...).
//!
//! * `ffi`: everything unsafe; LinuxCNC's HAL and the symbols a module exports.
//! * `module`: what all modules do: geometry from HAL, calls, errors.
//! * [`mechanism`]: what a mechanism must say to be a module.
//! * [`switchable`]: HV-Mill with both mechanisms, O-X glide with both forms.
//! * `message`: errors as texts for LinuxCNC.
//!
//! No allocation after load, no panic (a profile with `panic = "abort"` links the handler of `ffi`, which refers to a symbol that
//! exists nowhere: a module with a panic in it cannot be loaded), no file is read: `rtapi_app` runs with root's rights, so
//! geometry comes through HAL (`setp`, as `pkm linuxcnc` writes it) and never from a path.
//!
//! The manual is `docs/linuxcnc.md`.
#![no_std]

#[cfg(not(panic = "abort"))]
extern crate std; // for tests: its panic handler

pub mod ffi;
pub mod mechanism;
mod message;
mod module;
pub mod switchable;

pub use pkm_kins;
