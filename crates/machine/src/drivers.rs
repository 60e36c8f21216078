//! The driver of a joint. The table of data sheets is `pkm_stepgen::drivers`.

use pkm_stepgen::PulseTimingNs;
pub use pkm_stepgen::drivers::DRIVERS;

/// A driver and the shortest times it accepts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriverTiming {
    /// Model, or `custom` where the machine file states its own figures.
    pub model: String,
    /// The minima.
    pub minimum: PulseTimingNs,
}
