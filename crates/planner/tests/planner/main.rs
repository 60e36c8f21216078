//! Tests of the planner from outside: known cases, and random paths.

mod cases;
mod harness;
mod random;
