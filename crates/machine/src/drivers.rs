//! Stepper drivers: the shortest step and direction times they accept. The table of data sheets is `pkm_stepgen::drivers`.

use pkm_stepgen::PulseTimingNs;
pub use pkm_stepgen::drivers::DRIVERS;

/// Step and direction times, ns: either the minima of a driver or what a machine file configures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepTiming {
    /// STEP active.
    pub step_length_ns: u64,
    /// STEP inactive between two pulses.
    pub step_space_ns: u64,
    /// DIR stable before the STEP edge.
    pub direction_setup_ns: u64,
    /// DIR stable after the STEP edge.
    pub direction_hold_ns: u64,
}

impl StepTiming {
    /// The times rounded up to multiples of the step timer's period.
    pub const fn on_grid(self, timer_period_ns: u64) -> Self {
        const fn up(time_ns: u64, period_ns: u64) -> u64 {
            time_ns.div_ceil(period_ns) * period_ns
        }
        Self {
            step_length_ns: up(self.step_length_ns, timer_period_ns),
            step_space_ns: up(self.step_space_ns, timer_period_ns),
            direction_setup_ns: up(self.direction_setup_ns, timer_period_ns),
            direction_hold_ns: up(self.direction_hold_ns, timer_period_ns),
        }
    }

    /// The same for the step generator.
    pub const fn pulses(self) -> PulseTimingNs {
        PulseTimingNs {
            step_length: self.step_length_ns,
            step_space: self.step_space_ns,
            dir_setup: self.direction_setup_ns,
            dir_hold: self.direction_hold_ns,
        }
    }

    /// Shortest time from one pulse to the next, ns.
    pub const fn shortest_pulse_interval_ns(self) -> u64 {
        self.step_length_ns + self.step_space_ns
    }
}

/// A driver and the shortest times it accepts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriverTiming {
    /// Model, or `custom` where the machine file states its own figures.
    pub model: String,
    /// The minima, ns.
    pub minimum: StepTiming,
}

impl DriverTiming {
    /// The minima for the step generator.
    pub const fn pulses(&self) -> PulseTimingNs {
        self.minimum.pulses()
    }
}

/// The minima of a driver by its model name (case does not matter).
pub fn find(model: &str) -> Option<(&'static str, StepTiming)> {
    let (model, minimum) = pkm_stepgen::drivers::find(model)?;
    let PulseTimingNs { step_length, step_space, dir_setup, dir_hold } = minimum;
    let minimum = StepTiming {
        step_length_ns: step_length,
        step_space_ns: step_space,
        direction_setup_ns: dir_setup,
        direction_hold_ns: dir_hold,
    };
    Some((model, minimum))
}
