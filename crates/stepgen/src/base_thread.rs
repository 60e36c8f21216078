//! LinuxCNC's software `stepgen` (step type 0, position mode), emulated period by period, to compare with.
//!
//! It is a phase accumulator: every base period a fixed-point velocity is added, and a pulse begins when the whole part
//! changes. A pulse can begin at a multiple of the base period only, and the position follows 1.5 servo periods late:
//! what [`crate::StepGenerator`] is for. `.ci/judge-stepgen` compares it with LinuxCNC 2.9's own under `halrun`: the
//! same lines in every base period.

use crate::timing::{PulseTimingNs, TimingError};

/// Fraction bits of the accumulator.
const FRACTION_BITS: u32 = 28;
const ONE_STEP: f64 = (1_i64 << FRACTION_BITS) as f64;
const HALF_STEP: i64 = 1 << (FRACTION_BITS - 1);

/// One channel.
#[derive(Debug, Clone)]
pub struct BaseThreadStepgen {
    steps_per_unit: f64,
    base_period_ns: u64,
    servo_period_s: f64,
    /// On the grid of the base period.
    timing: PulseTimingNs,
    /// steps/s
    max_frequency: f64,
    /// steps/s²
    max_acceleration: f64,

    /// What the servo thread wants, steps/s, and where its last command was, steps.
    frequency: f64,
    last_command: f64,
    target_increment: i64,

    increment: i64,
    largest_change: i64,
    accumulator: i64,
    positive: bool,
    /// Waiting until the other direction is allowed.
    held: bool,
    until_pulse_end_ns: u64,
    until_direction_change_ns: u64,
    until_reversed_step_ns: u64,
}

/// The two lines after a base period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepDir {
    /// A pulse is active.
    pub step: bool,
    /// LinuxCNC's polarity: true while moving in the negative direction.
    pub dir: bool,
}

impl BaseThreadStepgen {
    /// Standing at 0, with LinuxCNC's defaults for velocity and acceleration: as fast as the pulses allow.
    ///
    /// # Errors
    /// `ZeroTimerPeriod` for a base period of 0, `ServoPeriod` for a servo period of 0, `NotWhole` if it is no multiple
    /// of the base period.
    pub fn new(
        steps_per_unit: f64,
        timing: PulseTimingNs,
        base_period_ns: u64,
        servo_period_ns: u64,
    ) -> Result<Self, TimingError> {
        if base_period_ns == 0 {
            return Err(TimingError::ZeroTimerPeriod);
        }
        if servo_period_ns == 0 {
            return Err(TimingError::ServoPeriod { servo_period_ns });
        }
        if !servo_period_ns.is_multiple_of(base_period_ns) {
            return Err(TimingError::NotWhole { servo_period_ns, timer_period_ns: base_period_ns });
        }
        // A pulse has a length, and a change of direction takes a period, whatever was asked.
        let mut timing = timing;
        timing.step_length = timing.step_length.max(1);
        if timing.dir_setup == 0 {
            timing.dir_hold = timing.dir_hold.max(1);
        }
        let timing = timing.on_grid(base_period_ns);
        let servo_period_s = servo_period_ns as f64 * 1e-9;
        let max_frequency = 1.0 / (timing.step_interval() as f64 * 1e-9);
        Ok(Self {
            steps_per_unit,
            base_period_ns,
            servo_period_s,
            timing,
            max_frequency,
            max_acceleration: max_frequency * (1.0 / servo_period_s),
            frequency: 0.0,
            last_command: 0.0,
            target_increment: 0,
            increment: 0,
            largest_change: 0,
            accumulator: HALF_STEP,
            positive: true,
            held: false,
            until_pulse_end_ns: 0,
            until_direction_change_ns: 0,
            until_reversed_step_ns: 0,
        })
    }

    /// The servo thread (`stepgen.update-freq`): a new position command, mm or degrees.
    ///
    /// Meets the command's velocity and, by half of what is left per period, its position 1.5 periods ago.
    pub fn update(&mut self, position: f64) {
        let period = self.servo_period_s;
        let per_second = 1.0 / period;
        let command = position * self.steps_per_unit;
        let wanted = (command - self.last_command) * per_second;
        self.last_command = command;

        let position = (self.accumulator - HALF_STEP) as f64 * (1.0 / ONE_STEP);
        let ramp = if wanted > self.frequency { self.max_acceleration } else { -self.max_acceleration };
        let ramp_time = (wanted - self.frequency) / ramp;
        let reached = position + (wanted + self.frequency) * 0.5 * ramp_time;
        let aim = command + wanted * (ramp_time - 1.5 * period);
        let error = reached - aim;
        let step = self.max_acceleration * period;
        let frequency = if ramp_time >= period {
            // Not this period. The other way, if the position gains by it.
            let change = -2.0 * ramp * period * ramp_time;
            let back = (error + change * 2.0).abs() < error.abs();
            self.frequency + if back { -ramp } else { ramp } * period
        } else if error.abs() < 0.0001 {
            wanted
        } else {
            // Not `clamp`: this must be LinuxCNC's for NaN too.
            (wanted - 0.5 * error * per_second).min(self.frequency + step).max(self.frequency - step)
        };
        self.frequency = frequency.min(self.max_frequency).max(-self.max_frequency);
        let base_period_s = self.base_period_ns as f64 * 0.000_000_001;
        let scale = ONE_STEP * base_period_s;
        self.target_increment = (self.frequency * scale) as i64;
        self.largest_change = (self.max_acceleration * (scale * base_period_s)) as i64;
    }

    /// The base thread (`stepgen.make-pulses`): the lines for the next base period.
    pub fn pulse(&mut self) -> StepDir {
        for timer in [&mut self.until_pulse_end_ns, &mut self.until_direction_change_ns] {
            *timer = timer.saturating_sub(self.base_period_ns);
        }
        if self.until_reversed_step_ns > 0 {
            self.until_reversed_step_ns = self.until_reversed_step_ns.saturating_sub(self.base_period_ns);
            self.held &= self.until_reversed_step_ns > 0;
        }
        if !self.held {
            let before = self.increment;
            self.increment = if self.largest_change == 0 {
                self.target_increment
            } else {
                self.target_increment.min(before + self.largest_change).max(before - self.largest_change)
            };
            self.held = (self.increment >= 0) != (before >= 0) && self.until_reversed_step_ns != 0;
        }
        let mut stepped = false;
        if !self.held {
            let before = self.accumulator;
            self.accumulator = before.wrapping_add(self.increment);
            stepped = (before ^ self.accumulator) >> FRACTION_BITS & 1 == 1;
        }
        if self.until_direction_change_ns == 0 && self.increment != 0 {
            self.positive = self.increment > 0;
        }
        if stepped {
            self.until_pulse_end_ns = self.timing.step_length;
            self.until_direction_change_ns = self.until_pulse_end_ns + self.timing.dir_hold;
            self.until_reversed_step_ns = self.until_direction_change_ns + self.timing.dir_setup;
        }
        StepDir { step: self.until_pulse_end_ns != 0, dir: !self.positive }
    }

    /// Steps from the start (`stepgen.counts`).
    #[must_use]
    pub const fn count(&self) -> i64 {
        self.accumulator >> FRACTION_BITS
    }
}
