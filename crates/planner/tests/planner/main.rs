//! Tests of the planner from outside: known cases, and random paths.
#![allow(clippy::print_stdout)]

mod cases;
mod catalogue;
mod harness;
mod random;
