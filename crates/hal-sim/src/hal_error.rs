//! Why the HAL refuses.

use crate::hal::MAX_NAME;
use crate::values::PinType;
use pkm_stepgen::TimingError;
use std::fmt;

/// Why the HAL refuses. Names are as the caller gave them.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum HalError {
    /// Longer than [`MAX_NAME`], empty, or with a character that names do not have.
    BadName { name: String },
    /// The name is taken.
    Taken { name: String },
    /// Nothing has this name; `what` says what was looked for.
    Unknown { what: &'static str, name: String },
    /// Two types that do not match.
    WrongType { name: String, expected: PinType, found: PinType },
    /// A second writer for a signal.
    SecondWriter { signal: String, writer: String, pin: String },
    /// The pin is linked to another signal.
    Linked { pin: String, signal: String },
    /// The value cannot be set from outside: an output, a read-only parameter, a signal with a writer.
    NotSettable { name: String },
    /// The value is NaN or infinite.
    NotFinite { name: String },
    /// A function is on a thread already.
    FunctionInUse { function: String, thread: String },
    /// Thread period 0, shorter than the first thread's or not a multiple of it.
    ThreadPeriod { thread: String, period_ns: u64, base_period_ns: u64 },
    /// A period and the timer do not go together.
    Timing(TimingError),
}

impl fmt::Display for HalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadName { name } => write!(
                f,
                "'{name}' is not a name: 1 to {MAX_NAME} characters of a-z, 0-9, '.', '-' (signals also A-Z, '_')"
            ),
            Self::Taken { name } => write!(f, "the name '{name}' is taken"),
            Self::Unknown { what, name } => write!(f, "there is no {what} '{name}'"),
            Self::WrongType { name, expected, found } => {
                write!(f, "'{name}' is of type {expected}, not {found}")
            }
            Self::SecondWriter { signal, writer, pin } => {
                write!(f, "signal '{signal}' is written by '{writer}' already; '{pin}' cannot write it too")
            }
            Self::Linked { pin, signal } => write!(f, "pin '{pin}' is linked to signal '{signal}' already"),
            Self::NotSettable { name } => write!(f, "'{name}' cannot be set: something else writes it"),
            Self::NotFinite { name } => write!(f, "'{name}' can only be set to a finite number"),
            Self::FunctionInUse { function, thread } => {
                write!(f, "function '{function}' is on thread '{thread}' already")
            }
            Self::ThreadPeriod { thread, period_ns, base_period_ns } => write!(
                f,
                "the period of thread '{thread}', {period_ns} ns, is not a multiple of the first thread's, {base_period_ns} ns"
            ),
            Self::Timing(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for HalError {}

impl From<TimingError> for HalError {
    fn from(error: TimingError) -> Self {
        Self::Timing(error)
    }
}
