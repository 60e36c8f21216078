//! Whole-program tests of `pkm`: what goes in at the command line, what comes out, and the exit status.

mod canon;
mod hal;
mod kins;
mod machines;
mod programs;
mod run;
mod smoke;
mod support;
mod views;
