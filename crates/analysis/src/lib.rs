//! Judges and maps.
//!
//! [`checker`] reads a trace and a machine file and nothing else: it shares no code with the planner it judges.

pub mod checker;
