//! Judges and maps.
//!
//! [`checker`] reads a trace and a machine file and nothing else: it shares no code with the planner it judges.
//! [`workspace`] says what a machine can reach, from the same kinematics that moves it; [`figure`] draws it.

pub mod checker;
pub mod figure;
pub mod outcome;
pub mod parallel;
pub mod trace;
pub mod workspace;
