//! Machine files: what was written becomes a machine that can run, or a list of diagnostics.
//!
//! `text` → [`MachineFile`] (the shape is right) → [`Machine`] (it can run). An unknown or repeated key, a number that
//! is not finite, a geometry that makes no mechanism, a home pose out of reach: each is a diagnostic with file, line,
//! column, value, limit and remedy.
//!
//! ```
//! let machine = pkm_machine::Machine::load("moma-a", &[]).unwrap();
//! assert_eq!(machine.joints[0].name, "p1");
//! let slower = ["joint.*.max_velocity_mm_s=50".to_owned()];
//! assert_eq!(pkm_machine::Machine::load("moma-a", &slower).unwrap().joints[1].max_velocity, 50.0);
//! ```

mod checks;
pub mod drivers;
pub mod family;
pub mod file;
mod homing;
mod joint;
pub mod kinematics;
mod load;
mod machine;
mod overrides;
mod program;
mod refusal;
pub mod shipped;
pub mod source;
mod switch;
pub mod workpiece;

pub use drivers::DriverTiming;
pub use file::MachineFile;
pub use homing::{Homing, JointHoming};
pub use load::read;
pub use machine::{AxisLimits, Joint, Machine, PathSettings, SingularityGuard, SpindleSettings};
pub use program::{ProgramSettings, RemappedCode};
pub use refusal::Refusal;
pub use switch::{Switch, SwitchTarget, Switched};
