//! A deterministic simulated HAL in LinuxCNC's manner, and a simulated machine on it.
//!
//! ```text
//!  setpoints      ┌────────┐ joint.N.motor-pos-cmd ┌─────────┐ step, dir ┌────────┐ counts ┌───────┐
//!  of a planner ─▶│ motion │ ─────────────────────▶│ stepgen │ ─────────▶│ driver │ ──────▶│ motor │
//!                 └────────┘                       └─────────┘   edges   └────────┘        └───────┘
//!                      ▲                    joint.N.motor-pos-fb                               │
//!                      └───────────────────────────────────────────────────────────────────────┘
//! ```
//!
//! * [`Hal`]: pins, signals, parameters, functions, threads.
//! * [`components`]: one file each, the same order in each: what it is → pins → state → functions → tests.
//! * [`Simulation`]: the machine above ready-wired, one call per servo period, with statistics and observers.
//! * [`VcdWriter`], [`TraceWriter`], [`StreamWriter`]: observers that write `steps.vcd`, `trace.csv` and a compact stream.
//! * [`hal_file`]: HAL files, as people know them.
//!
//! Time is an integer count of timer ticks; there is no clock. A [`Hal`] and a [`Simulation`] are `Clone`: a copy goes
//! on from the same state.

pub mod block;
pub mod component;
pub mod components;
mod config;
pub mod faults;
mod free;
pub mod hal;
mod hal_error;
pub mod hal_file;
pub mod homing;
pub mod modules;
mod pins;
mod report;
pub mod simulation;
pub mod stream;
pub mod trace;
pub mod values;
pub mod vcd;

pub use component::{
    Component, Fault, Feedback, PinIndex, PinName, Setpoint, SetpointSource, SpindleFeedback, Tick,
};
pub use components::driver::Violations;
pub use components::motion::Operator;
pub use components::spindle::{Orient, SpindleCommand, SpindleConfig, SpindleModel};
pub use config::{ConfigError, JointConfig, SimulationConfig, Switches};
pub use faults::{FaultKind, FaultTextError, PinFault};
pub use free::Free;
pub use hal::{Hal, MAX_NAME, Role};
pub use hal_error::HalError;
pub use homing::{HomeJoint, Homing, HomingConfig, HomingError};
pub use pkm_stepgen::{Edge, Line, PulseTimingNs};
pub use report::{JointState, JointStatistics, Observer, TickReport};
pub use simulation::{Simulation, TickError};
pub use stream::{StreamSteps, StreamWriter};
pub use trace::TraceWriter;
pub use values::{BitPin, FloatPin, PinType, S32Pin, U32Pin, Value, Values};
pub use vcd::{VcdSteps, VcdWriter};
