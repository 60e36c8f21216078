//! LinuxCNC configurations from machine files, and machine files from LinuxCNC configurations.
//!
//! [`configuration`] writes a complete, annotated configuration for a machine: INI, HAL, geometry, tool table, an example program and
//! a README. [`import`] reads limits, scales, periods, step timing and geometry of a configuration into a machine file. The manual is
//! `docs/linuxcnc.md`; the modules themselves are in `crates/linuxcnc-kins`.

mod configuration;
mod example;
mod hal;
mod import;
mod ini;
mod modules;
mod travel;

pub use configuration::{Configuration, configuration};
pub use import::{ImportError, Imported, import};
pub use ini::Ini;
pub use modules::{Module, module};
pub use travel::{Mode, modes};
