//! `driver`: a simulated stepper driver; counts steps and judges the times of its inputs by the data sheet.
//!
//! | pin                   | type     | meaning                                                             |
//! |-----------------------|----------|---------------------------------------------------------------------|
//! | `driver.N.step`, `.dir` | bit in | its inputs; a rising step edge is a step, positive while dir is high |
//! | `driver.N.enable`     | bit in   | false: steps move nothing                                           |
//! | `driver.N.counts`     | s32 out  | position in steps (wraps)                                           |
//! | `driver.N.violations` | u32 out  | times shorter than the data sheet's minima                          |
//!
//! Function: `driver.update`.
//!
//! It shares no code with the conditioner that is to keep these times: each edge is judged by the edges before it. The
//! direction hold counts from the step's rising edge, as in the data sheets of A4988, DRV8825 and TMC2209.

use crate::component::{Component, Fault, Tick};
use crate::hal::{Hal, Role};
use crate::hal_error::HalError;
use crate::values::{BitPin, LineEdge, S32Pin, U32Pin, Values};
use pkm_stepgen::PulseTimingNs;

/// How often each minimum was broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Violations {
    /// Step pulse too short.
    pub step_length: u64,
    /// Time between two pulses too short.
    pub step_space: u64,
    /// Direction changed too shortly before a step.
    pub dir_setup: u64,
    /// Direction changed too shortly after a step.
    pub dir_hold: u64,
}

impl Violations {
    /// All of them.
    pub const fn total(&self) -> u64 {
        self.step_length + self.step_space + self.dir_setup + self.dir_hold
    }
}

/// One driver as its data sheet and its place in the machine have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriverChannel {
    /// The data sheet's minima: step high, step low, direction setup and hold.
    pub minimum: PulseTimingNs,
    /// Position at the start, steps.
    pub start: i64,
}

/// The minima of a driver by its model, in any case.
pub fn minimum(model: &str) -> Option<PulseTimingNs> {
    pkm_stepgen::drivers::find(model).map(|(_, minimum)| minimum)
}

/// State of one driver.
#[derive(Debug, Clone)]
pub struct Driver {
    minimum: PulseTimingNs,
    position: i64,
    steps: u64,
    step_high: bool,
    dir_high: bool,
    last_rise_ns: Option<u64>,
    last_fall_ns: Option<u64>,
    last_turn_ns: Option<u64>,
    min_interval_ns: Option<u64>,
    violations: Violations,
}

impl Driver {
    /// A driver whose inputs are low.
    pub const fn new(channel: &DriverChannel) -> Self {
        Self {
            minimum: channel.minimum,
            position: channel.start,
            steps: 0,
            step_high: false,
            dir_high: false,
            last_rise_ns: None,
            last_fall_ns: None,
            last_turn_ns: None,
            min_interval_ns: None,
            violations: Violations { step_length: 0, step_space: 0, dir_setup: 0, dir_hold: 0 },
        }
    }

    /// The step input changes. Returns the step it makes: −1, 0 or 1.
    pub fn step_edge(&mut self, time_ns: u64, level: bool) -> i64 {
        if level == self.step_high {
            return 0;
        }
        self.step_high = level;
        if !level {
            self.violations.step_length += too_short(time_ns, self.last_rise_ns, self.minimum.step_length);
            self.last_fall_ns = Some(time_ns);
            return 0;
        }
        self.violations.step_space += too_short(time_ns, self.last_fall_ns, self.minimum.step_space);
        self.violations.dir_setup += too_short(time_ns, self.last_turn_ns, self.minimum.dir_setup);
        if let Some(last) = self.last_rise_ns {
            let interval = time_ns.saturating_sub(last);
            self.min_interval_ns = Some(self.min_interval_ns.map_or(interval, |least| least.min(interval)));
        }
        self.last_rise_ns = Some(time_ns);
        self.steps += 1;
        let step = if self.dir_high { 1 } else { -1 };
        self.position += step;
        step
    }

    /// The direction input changes.
    pub fn dir_edge(&mut self, time_ns: u64, level: bool) {
        if level == self.dir_high {
            return;
        }
        self.dir_high = level;
        self.violations.dir_hold += too_short(time_ns, self.last_rise_ns, self.minimum.dir_hold);
        self.last_turn_ns = Some(time_ns);
    }

    /// Position, steps.
    pub const fn position(&self) -> i64 {
        self.position
    }

    /// Steps in either direction.
    pub const fn steps(&self) -> u64 {
        self.steps
    }

    /// Shortest time between two steps, ns; None before the second.
    pub const fn min_interval_ns(&self) -> Option<u64> {
        self.min_interval_ns
    }

    /// Times shorter than the minima.
    pub const fn violations(&self) -> &Violations {
        &self.violations
    }
}

fn too_short(time_ns: u64, since_ns: Option<u64>, minimum_ns: u64) -> u64 {
    u64::from(since_ns.is_some_and(|since| time_ns.saturating_sub(since) < minimum_ns))
}

#[derive(Debug, Clone)]
struct Pins {
    step: BitPin,
    dir: BitPin,
    enable: BitPin,
    counts: S32Pin,
    violations: U32Pin,
    step_cursor: u64,
    dir_cursor: u64,
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Drivers {
    channels: Vec<(Driver, Pins)>,
    timer_period_ns: u64,
}

impl Drivers {
    /// Loads the component: pins and function.
    ///
    /// # Errors
    /// `Taken` if it is loaded already.
    pub fn load(hal: &mut Hal, channels: &[DriverChannel]) -> Result<(), HalError> {
        let mut with_pins = Vec::new();
        for (n, channel) in channels.iter().enumerate() {
            let name = |pin: &str| format!("driver.{n}.{pin}");
            let pins = Pins {
                step: hal.new_bit("driver", &name("step"), Role::In, false)?,
                dir: hal.new_bit("driver", &name("dir"), Role::In, false)?,
                enable: hal.new_bit("driver", &name("enable"), Role::In, true)?,
                counts: hal.new_s32("driver", &name("counts"), Role::Out, channel.start as i32)?,
                violations: hal.new_u32("driver", &name("violations"), Role::Out, 0)?,
                step_cursor: 0,
                dir_cursor: 0,
            };
            with_pins.push((Driver::new(channel), pins));
        }
        let timer_period_ns = hal.timer_period_ns();
        let component = Self { channels: with_pins, timer_period_ns };
        hal.add_component(Box::new(component), &["driver.update".to_owned()])
    }

    /// The drivers, in channel order.
    pub fn drivers(&self) -> impl Iterator<Item = &Driver> {
        self.channels.iter().map(|(driver, _)| driver)
    }
}

impl Component for Drivers {
    fn name(&self) -> &'static str {
        "driver"
    }

    fn run(&mut self, _function: usize, values: &mut Values, tick: &Tick<'_>) -> Result<(), Fault> {
        let end = tick.period.end();
        for (driver, pins) in &mut self.channels {
            let enabled = values.bit(pins.enable);
            let steps = values.edges(pins.step).read(&mut pins.step_cursor, end);
            let mut turns = values.edges(pins.dir).read(&mut pins.dir_cursor, end);
            let position = driver.position;
            // an input whose edges were not seen (a broken wire, mended) has its level nevertheless
            let start_ns = tick.period.start() * self.timer_period_ns;
            let before = |edges: &[LineEdge], level| edges.first().map_or(level, |edge| !edge.level);
            driver.dir_edge(start_ns, before(turns, values.bit(pins.dir)));
            driver.step_edge(start_ns, before(steps, values.bit(pins.step)));
            // both lines in order of time; at the same time the direction first, and its setup time is then 0
            for step in steps {
                while let [turn, later @ ..] = turns
                    && turn.time <= step.time
                {
                    driver.dir_edge(turn.time * self.timer_period_ns, turn.level);
                    turns = later;
                }
                driver.step_edge(step.time * self.timer_period_ns, step.level);
            }
            for turn in turns {
                driver.dir_edge(turn.time * self.timer_period_ns, turn.level);
            }
            if !enabled {
                driver.position = position;
            }
            values.set_s32(pins.counts, driver.position as i32);
            let violations = driver.violations.total();
            values.set_u32(pins.violations, u32::try_from(violations).unwrap_or(u32::MAX));
        }
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Component> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINIMUM: PulseTimingNs =
        PulseTimingNs { step_length: 1900, step_space: 1900, dir_setup: 650, dir_hold: 650 };

    /// Direction at 1000, pulse 2000 to 4000, pulse 6000 to 8000, direction at 9000; each time moved by `change`.
    fn play(change: [i64; 6]) -> Driver {
        let mut driver = Driver::new(&DriverChannel { minimum: MINIMUM, start: 10 });
        let mut at = [1000_i64, 2000, 4000, 6000, 8000, 9000].iter().zip(change).map(|(t, c)| (t + c) as u64);
        let mut next = || at.next().unwrap_or(0);
        driver.dir_edge(next(), true);
        for _ in 0..2 {
            driver.step_edge(next(), true);
            driver.step_edge(next(), false);
        }
        driver.dir_edge(next(), false);
        driver
    }

    #[test]
    fn each_minimum_is_judged() {
        let total = |change| *play(change).violations();
        let none = Violations::default();
        assert_eq!(total([0; 6]), none);
        // exactly the minimum is legal, one ns less is not
        assert_eq!(total([350, 0, -100, 0, -100, 0]), none);
        assert_eq!(total([351, 0, 0, 0, 0, 0]), Violations { dir_setup: 1, ..none });
        assert_eq!(total([0, 0, -101, 0, -101, 0]), Violations { step_length: 2, ..none });
        assert_eq!(total([0, 0, 101, 0, 0, 0]), Violations { step_space: 1, ..none });
        assert_eq!(total([0, 0, 0, 0, 0, -2350]), none);
        assert_eq!(total([0, 0, 0, 0, 0, -2351]), Violations { dir_hold: 1, ..none });
    }

    #[test]
    fn steps_are_counted_at_the_rising_edge_in_the_direction_of_the_line() {
        let mut driver = play([0; 6]);
        assert_eq!((driver.position(), driver.steps(), driver.min_interval_ns()), (12, 2, Some(4000)));
        assert_eq!(driver.step_edge(20_000, true), -1);
        assert_eq!(driver.step_edge(20_001, true), 0); // no change of the line, no step
        assert_eq!(driver.position(), 11);
    }
}
