//! Stepper drivers: the shortest step and direction times they accept.
//!
//! Figures are the minima of the makers' data sheets (rounded up to whole ns), measured at the driver's input. "Seconded"
//! says who else states the figure; what nobody else does is marked.
//!
//! | model   | source                                                                                  |
//! |---------|-----------------------------------------------------------------------------------------|
//! | A4988   | Allegro A4988 data sheet, "timing requirements": STEP high and low 1 µs, DIR setup and hold 200 ns. Seconded: Marlin `Configuration_adv.h` (1 µs, 200 ns), applied-ee.github.io "Step/Direction Interface" |
//! | DRV8825 | TI SLVSA73, "timing requirements": STEP high and low 1.9 µs, DIR setup and hold 650 ns. Seconded: both of these (2 µs rounded, 650 ns) |
//! | TMC2209 | Trinamic TMC2209, "STEP/DIR interface": max(filter, t_CLK + 20 ns) = 104 ns at 12 MHz, DIR 20 ns. Seconded: both of these (100 ns rounded, 20 ns) |
//! | DM542   | Leadshine DM542 manual: pulse high and low 2.5 µs, DIR setup 5 µs; no hold is stated, 5 µs taken. Not seconded |
//! | TB6600  | boxes named TB6600 differ by maker; slow figures on purpose: 5 µs, 5 µs, 20 µs, 20 µs. Marlin guesses 3 µs and 1.5 µs; others report 5 µs for DIR from a data sheet |

use crate::timing::PulseTimingNs;

/// The drivers whose data sheets are known here.
pub const DRIVERS: [(&str, PulseTimingNs); 5] = [
    ("A4988", PulseTimingNs { step_length: 1000, step_space: 1000, dir_setup: 200, dir_hold: 200 }),
    ("DRV8825", PulseTimingNs { step_length: 1900, step_space: 1900, dir_setup: 650, dir_hold: 650 }),
    ("TMC2209", PulseTimingNs { step_length: 104, step_space: 104, dir_setup: 20, dir_hold: 20 }),
    ("DM542", PulseTimingNs { step_length: 2500, step_space: 2500, dir_setup: 5000, dir_hold: 5000 }),
    ("TB6600", PulseTimingNs { step_length: 5000, step_space: 5000, dir_setup: 20_000, dir_hold: 20_000 }),
];

/// The minima of a driver by its model name (case does not matter).
pub fn find(model: &str) -> Option<(&'static str, PulseTimingNs)> {
    DRIVERS.into_iter().find(|(name, _)| name.eq_ignore_ascii_case(model))
}
