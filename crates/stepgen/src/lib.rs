//! Step generation: joint positions and velocities once per servo period → step and direction edges with
//! integer time stamps, spaced as the driver's data sheet asks.
//!
//! `no_std`, no allocation, no panic; + − × ÷ √ only, so the same edges bit for bit on every platform.
//!
//! ```text
//!  position, velocity      ┌─────────┐ crossings of k + ½   ┌─────────────┐  Edge { time, joint, line, level }
//!  at the period's end ───▶│  edges  │ ───────────────────▶ │ conditioner │ ────────────────────────────▶ sink
//!                          └─────────┘ (time, direction)    └─────────────┘
//! ```
//!
//! [`StepGenerator`] joins the two for one joint. Time is an integer count of timer ticks since the start.
//!
//! ```
//! use pkm_stepgen::{Edge, Line, Period, PulseTimingNs, StepGenerator};
//!
//! // 400 steps/mm, a timer of 1 ns, servo period 1 ms, standing at 0 mm
//! let timing = PulseTimingNs { step_length: 2000, step_space: 2000, dir_setup: 5000, dir_hold: 5000 };
//! let mut joint = StepGenerator::new(0, 400.0, timing.ticks(1).unwrap(), 0.0).unwrap();
//! let mut pulses = 0;
//! // half a period of travel at 20 mm/s: 0.01 mm = 4 steps
//! joint.advance(0.01, 20.0, &Period::new(0, 1_000_000, 1).unwrap(), |edge: Edge| {
//!     pulses += u32::from(edge.line == Line::Step && edge.level);
//! }).unwrap();
//! assert_eq!(pulses, 4);
//! assert_eq!(joint.count(), 4);
//! ```
#![no_std]

pub mod base_thread;
pub mod conditioner;
pub mod drivers;
pub mod edges;
pub mod generator;
pub mod runs;
pub mod step_types;
pub mod timing;

pub use conditioner::{Conditioner, ConditionerReport, Edge, Line};
pub use edges::{Crossings, EdgeError};
pub use generator::StepGenerator;
pub use runs::{Run, RunError, RunLimits};
pub use step_types::StepType;
pub use timing::{Period, PulseTiming, PulseTimingNs, TimingError};
