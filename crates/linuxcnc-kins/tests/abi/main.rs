//! The modules as LinuxCNC loads them, without LinuxCNC: this binary stands in for the HAL, opens the shared objects that cargo
//! built beside it with `dlopen`, as `rtapi_app` does, and calls what `motmod` calls.
#![cfg(target_os = "linux")]
#![allow(unsafe_code)] // the C side of the interface

mod calculation;
mod geometry;
mod motmod;
mod stub;
mod switching;
