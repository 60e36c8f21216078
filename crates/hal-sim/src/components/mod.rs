//! The components, one file each.

pub mod and2;
pub mod charge_pump;
pub mod comp;
pub mod ddt;
pub mod driver;
pub mod estop_latch;
pub mod integ;
pub mod limit1;
pub mod limit3;
pub mod lut5;
pub mod motion;
pub mod motor;
pub mod mult2;
pub mod mux2;
pub mod mux4;
pub mod not;
pub mod or2;
pub mod pid;
pub mod scale;
pub mod siggen;
pub mod stepgen;
pub mod sum2;
pub mod xor2;
