//! One file per subcommand.

pub(crate) mod canon;
pub(crate) mod check;
pub(crate) mod configure;
pub(crate) mod faults;
pub(crate) mod generate;
pub(crate) mod hal;
pub(crate) mod import_linuxcnc;
pub(crate) mod ini;
pub(crate) mod jog;
pub(crate) mod kins;
pub(crate) mod linuxcnc;
pub(crate) mod machines;
pub(crate) mod parameters;
pub(crate) mod plan;
pub(crate) mod plot;
pub(crate) mod program;
pub(crate) mod run;
pub(crate) mod steps;
pub(crate) mod tool_table;
pub(crate) mod workspace;
