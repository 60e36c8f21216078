//! Pulse timing in nanoseconds and in timer ticks, and the servo period.

/// Pulse timing as a data sheet or a person states it, ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PulseTimingNs {
    /// Least time the step line is active.
    pub step_length: u64,
    /// Least time the step line is inactive.
    pub step_space: u64,
    /// Least time from a change of direction to the next active step edge.
    pub dir_setup: u64,
    /// Least time from the end of a step pulse to a change of direction.
    pub dir_hold: u64,
}

/// Pulse timing in timer ticks. Cannot exist unless step length and space are at least one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PulseTiming {
    step_length: u32,
    step_space: u32,
    dir_setup: u32,
    dir_hold: u32,
}

/// Why a timing or a period is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimingError {
    /// The timer's period is 0 ns.
    ZeroTimerPeriod,
    /// A pulse time of 2³¹ timer ticks or more.
    PulseTime {
        /// As given, ns.
        time_ns: u64,
    },
    /// The servo period is 0, or 2³¹ timer ticks or more.
    ServoPeriod {
        /// As given, ns.
        servo_period_ns: u64,
    },
    /// The servo period is not a whole number of timer periods.
    NotWhole {
        /// As given, ns.
        servo_period_ns: u64,
        /// As given, ns.
        timer_period_ns: u64,
    },
}

impl PulseTimingNs {
    /// The times rounded up to multiples of the step timer's period, which is above 0.
    #[must_use]
    pub const fn on_grid(self, timer_period_ns: u64) -> Self {
        const fn up(time_ns: u64, period_ns: u64) -> u64 {
            time_ns.div_ceil(period_ns) * period_ns
        }
        Self {
            step_length: up(self.step_length, timer_period_ns),
            step_space: up(self.step_space, timer_period_ns),
            dir_setup: up(self.dir_setup, timer_period_ns),
            dir_hold: up(self.dir_hold, timer_period_ns),
        }
    }

    /// Shortest time from one pulse to the next, ns.
    pub const fn step_interval(self) -> u64 {
        self.step_length + self.step_space
    }

    /// In ticks of a timer of `timer_period_ns`, rounded up; step length and space are one tick at least.
    ///
    /// # Errors
    /// `ZeroTimerPeriod`, `PulseTime`.
    pub fn ticks(&self, timer_period_ns: u64) -> Result<PulseTiming, TimingError> {
        if timer_period_ns == 0 {
            return Err(TimingError::ZeroTimerPeriod);
        }
        let up = |time_ns: u64| match u32::try_from(time_ns.div_ceil(timer_period_ns)) {
            Ok(ticks) if ticks < 1 << 31 => Ok(ticks),
            _ => Err(TimingError::PulseTime { time_ns }),
        };
        Ok(PulseTiming {
            step_length: up(self.step_length)?.max(1),
            step_space: up(self.step_space)?.max(1),
            dir_setup: up(self.dir_setup)?,
            dir_hold: up(self.dir_hold)?,
        })
    }
}

impl PulseTiming {
    /// Least time the step line is active, ticks, ≥ 1.
    pub const fn step_length(&self) -> u64 {
        self.step_length as u64
    }

    /// Least time the step line is inactive, ticks, ≥ 1.
    pub const fn step_space(&self) -> u64 {
        self.step_space as u64
    }

    /// Least time from a change of direction to the next active step edge, ticks.
    pub const fn dir_setup(&self) -> u64 {
        self.dir_setup as u64
    }

    /// Least time from the end of a step pulse to a change of direction, ticks.
    pub const fn dir_hold(&self) -> u64 {
        self.dir_hold as u64
    }

    /// Least time between two steps in one direction, ticks, ≥ 2.
    pub const fn step_interval(&self) -> u64 {
        self.step_length() + self.step_space()
    }

    /// The most steps that fit into a period: one more than whole intervals, for a period that starts with a step.
    pub const fn max_steps(&self, period: &Period) -> u64 {
        period.ticks as u64 / self.step_interval() + 1
    }
}

/// One servo period: times in (start, start + ticks].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    start: u64,
    ticks: u32,
    seconds: f64,
}

impl Period {
    /// A period of `servo_period_ns` that begins at `start` (timer ticks).
    ///
    /// # Errors
    /// Periods of 0, 2³¹ timer ticks or more in a servo period, or a servo period that is not a whole number of timer periods.
    pub fn new(start: u64, servo_period_ns: u64, timer_period_ns: u64) -> Result<Self, TimingError> {
        if timer_period_ns == 0 {
            return Err(TimingError::ZeroTimerPeriod);
        }
        if !servo_period_ns.is_multiple_of(timer_period_ns) {
            return Err(TimingError::NotWhole { servo_period_ns, timer_period_ns });
        }
        let ticks = servo_period_ns / timer_period_ns;
        match u32::try_from(ticks) {
            Ok(ticks) if ticks > 0 && ticks < 1 << 31 => {
                Ok(Self { start, ticks, seconds: servo_period_ns as f64 / 1e9 })
            }
            _ => Err(TimingError::ServoPeriod { servo_period_ns }),
        }
    }

    /// The period that follows this one.
    pub const fn next(&self) -> Self {
        Self { start: self.end(), ticks: self.ticks, seconds: self.seconds }
    }

    /// Time at which it begins (not part of it), timer ticks.
    pub const fn start(&self) -> u64 {
        self.start
    }

    /// Time at which it ends (part of it), timer ticks.
    pub const fn end(&self) -> u64 {
        self.start.saturating_add(self.ticks as u64)
    }

    /// Length in timer ticks, ≥ 1.
    pub const fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Length in seconds.
    pub const fn seconds(&self) -> f64 {
        self.seconds
    }
}

impl core::fmt::Display for TimingError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::ZeroTimerPeriod => write!(f, "the timer period is 0 ns"),
            Self::PulseTime { time_ns } => {
                write!(f, "a pulse time of {time_ns} ns is 2^31 timer ticks or more")
            }
            Self::ServoPeriod { servo_period_ns } => {
                write!(f, "a servo period of {servo_period_ns} ns is not between 1 and 2^31 - 1 timer ticks")
            }
            Self::NotWhole { servo_period_ns, timer_period_ns } => write!(
                f,
                "the servo period of {servo_period_ns} ns is not a whole number of timer periods of {timer_period_ns} ns"
            ),
        }
    }
}

impl core::error::Error for TimingError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nanoseconds_round_up_to_ticks() {
        let timing = PulseTimingNs { step_length: 1900, step_space: 1, dir_setup: 650, dir_hold: 0 };
        let ticks = timing.ticks(1000).unwrap();
        assert_eq!((ticks.step_length(), ticks.step_space()), (2, 1));
        assert_eq!((ticks.dir_setup(), ticks.dir_hold()), (1, 0));
        assert_eq!(timing.ticks(0), Err(TimingError::ZeroTimerPeriod));
    }

    #[test]
    fn periods_are_checked() {
        assert!(Period::new(0, 0, 1).is_err());
        assert!(Period::new(0, 1000, 0).is_err());
        assert!(Period::new(0, 1000, 300).is_err());
        assert!(Period::new(0, 1 << 40, 1).is_err());
        let period = Period::new(5, 1000, 100).unwrap();
        assert_eq!((period.start(), period.end(), period.next().start()), (5, 15, 15));
    }
}
