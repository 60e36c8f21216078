//! Tests of the planner from outside: known cases, and random paths.
#![allow(clippy::print_stdout)]

mod bad_input;
mod cases;
mod catalogue;
mod harness;
mod operator;
mod random;
mod runtime;
mod synchronised;
