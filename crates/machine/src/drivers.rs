//! Stepper drivers: the shortest step and direction times they accept.
//!
//! Figures are the minima of the makers' data sheets (rounded up to whole ns), measured at the driver's input:
//!
//! | model   | source                                                                                  |
//! |---------|-----------------------------------------------------------------------------------------|
//! | A4988   | Allegro A4988 data sheet, "timing requirements": STEP high and low 1 µs, DIR setup and hold 200 ns |
//! | DRV8825 | TI SLVSA73, "timing requirements": STEP high and low 1.9 µs, DIR setup and hold 650 ns    |
//! | TMC2209 | Trinamic TMC2209, "STEP/DIR interface": max(filter, t_CLK + 20 ns) = 104 ns at 12 MHz, DIR 20 ns |
//! | DM542   | Leadshine DM542 manual: pulse high and low 2.5 µs, DIR setup 5 µs; no hold is stated, 5 µs taken |
//! | TB6600  | boxes named TB6600 differ by maker; the slowest usual figures: 5 µs, 5 µs, 20 µs, 20 µs   |

use pkm_stepgen::PulseTimingNs;

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

/// The drivers whose data sheets are known here.
pub const DRIVERS: [(&str, StepTiming); 5] = [
    ("A4988", timing(1_000, 1_000, 200, 200)),
    ("DRV8825", timing(1_900, 1_900, 650, 650)),
    ("TMC2209", timing(104, 104, 20, 20)),
    ("DM542", timing(2_500, 2_500, 5_000, 5_000)),
    ("TB6600", timing(5_000, 5_000, 20_000, 20_000)),
];

const fn timing(
    step_length_ns: u64,
    step_space_ns: u64,
    direction_setup_ns: u64,
    direction_hold_ns: u64,
) -> StepTiming {
    StepTiming { step_length_ns, step_space_ns, direction_setup_ns, direction_hold_ns }
}

/// The minima of a driver by its model name (case does not matter).
pub fn find(model: &str) -> Option<(&'static str, StepTiming)> {
    DRIVERS.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(model))
}
