//! Faults as data: what a component reads on one of its pins is not what the signal says, from a tick on, for some ticks.
//!
//! A fault stands between a signal and one reader; everything else goes on as it is, so a list of faults replays a failure
//! exactly. As text, a fault is `tick,pin,kind` or `tick+ticks,pin,kind`:
//!
//! | kind           | the component reads                                                    |
//! |----------------|------------------------------------------------------------------------|
//! | `set=VALUE`    | the value                                                              |
//! | `freeze`       | what the signal was before the fault began                             |
//! | `invert`       | the contrary (bit), the negative (numbers)                             |
//! | `offset=VALUE` | as much more (numbers)                                                 |
//! | `nan`, `inf`   | no number (float)                                                      |
//!
//! A bit pin shows no edges inside periods while it has a fault: steps on it are lost.

use crate::values::{PinType, Value, Values};
use std::fmt;
use std::str::FromStr;

/// What the component reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultKind {
    /// This.
    Set(Value),
    /// What the signal was before the fault began.
    Freeze,
    /// The contrary or the negative.
    Invert,
    /// So much more.
    Offset(f64),
    /// NaN.
    NotANumber,
    /// Infinity.
    Infinite,
}

/// One fault on one pin.
#[derive(Debug, Clone, PartialEq)]
pub struct PinFault {
    /// The first period with it, counted from 1.
    pub tick: u64,
    /// For how many periods; None: to the end.
    pub ticks: Option<u64>,
    /// An input of a component.
    pub pin: String,
    /// What it does. A `Set` from text has the type that its value looks like; the pin's type counts.
    pub kind: FaultKind,
}

/// Why text is no fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FaultTextError {
    /// It has not three parts.
    Parts,
    /// The tick, or the number of ticks, is no number from 1 on.
    Tick(String),
    /// No such kind, or its value is none.
    Kind(String),
}

impl fmt::Display for FaultTextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parts => write!(f, "a fault is written tick,pin,kind or tick+ticks,pin,kind"),
            Self::Tick(text) => write!(f, "'{text}' is no tick: a whole number from 1 on, or tick+ticks"),
            Self::Kind(text) => {
                write!(f, "'{text}' is no fault: set=VALUE, freeze, invert, offset=VALUE, nan or inf")
            }
        }
    }
}

impl std::error::Error for FaultTextError {}

impl FromStr for PinFault {
    type Err = FaultTextError;

    fn from_str(text: &str) -> Result<Self, FaultTextError> {
        let mut parts = text.splitn(3, ',').map(str::trim);
        let (Some(time), Some(pin), Some(kind)) = (parts.next(), parts.next(), parts.next()) else {
            return Err(FaultTextError::Parts);
        };
        let number = |text: &str| text.parse().ok().filter(|number: &u64| *number > 0);
        let (tick, ticks) = match time.split_once('+') {
            Some((tick, ticks)) => (number(tick), number(ticks).map(Some)),
            None => (number(time), Some(None)),
        };
        let (Some(tick), Some(ticks)) = (tick, ticks) else {
            return Err(FaultTextError::Tick(time.to_owned()));
        };
        let finite = |text: &str| text.parse().ok().filter(|number: &f64| number.is_finite());
        let kind = match kind.split_once('=') {
            None if kind == "freeze" => Some(FaultKind::Freeze),
            None if kind == "invert" => Some(FaultKind::Invert),
            None if kind == "nan" => Some(FaultKind::NotANumber),
            None if kind == "inf" => Some(FaultKind::Infinite),
            Some(("set", "true")) => Some(FaultKind::Set(Value::Bit(true))),
            Some(("set", "false")) => Some(FaultKind::Set(Value::Bit(false))),
            Some(("set", value)) => finite(value).map(|value| FaultKind::Set(Value::Float(value))),
            Some(("offset", value)) => finite(value).map(FaultKind::Offset),
            _ => None,
        }
        .ok_or_else(|| FaultTextError::Kind(kind.to_owned()))?;
        Ok(Self { tick, ticks, pin: pin.to_owned(), kind })
    }
}

impl fmt::Display for PinFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.tick)?;
        if let Some(ticks) = self.ticks {
            write!(f, "+{ticks}")?;
        }
        write!(f, ",{},", self.pin)?;
        match self.kind {
            FaultKind::Set(Value::Bit(value)) => write!(f, "set={value}"),
            FaultKind::Set(value) => write!(f, "set={value}"),
            FaultKind::Freeze => write!(f, "freeze"),
            FaultKind::Invert => write!(f, "invert"),
            FaultKind::Offset(value) => write!(f, "offset={value}"),
            FaultKind::NotANumber => write!(f, "nan"),
            FaultKind::Infinite => write!(f, "inf"),
        }
    }
}

/// The faults of a HAL.
#[derive(Debug, Clone, Default)]
pub(crate) struct Faults(Vec<Injected>);

#[derive(Debug, Clone)]
struct Injected {
    tick: u64,
    end: u64,
    kind: FaultKind,
    pin_type: PinType,
    /// Index of the pin among those of its type.
    index: usize,
    /// Cell that the pin reads while the fault is there.
    cell: u32,
    /// Cell that it reads otherwise; known while the fault is there.
    original: Option<u32>,
    frozen: Value,
}

impl Faults {
    /// Takes up a fault of a pin; `now` is the next period.
    pub(crate) fn add(
        &mut self,
        fault: &PinFault,
        pin_type: PinType,
        index: u32,
        now: u64,
        values: &mut Values,
    ) {
        let index = index as usize;
        let frozen = values.cell(pin_type, values.pin_cells(pin_type)[index]);
        let cell = values.new_cell(frozen);
        let tick = fault.tick.max(now);
        let end = fault.ticks.map_or(u64::MAX, |ticks| tick.saturating_add(ticks));
        let kind = fault.kind;
        self.0.push(Injected { tick, end, kind, pin_type, index, cell, original: None, frozen });
    }

    /// Redirects pins whose faults begin with period `now`, and back those whose faults end. True if one is there.
    pub(crate) fn begin_and_end(&mut self, now: u64, values: &mut Values) -> bool {
        for n in 0..self.0.len() {
            let fault = &mut self.0[n];
            let (pin_type, index) = (fault.pin_type, fault.index);
            let pin = values.pin_cells(pin_type)[index];
            if now == fault.tick {
                fault.original = Some(pin);
                fault.frozen = values.cell(pin_type, pin);
                values.pin_cells_mut(pin_type)[index] = fault.cell;
            } else if now == fault.end
                && let Some(original) = fault.original.take()
            {
                let cell = fault.cell;
                if pin == cell {
                    values.pin_cells_mut(pin_type)[index] = original;
                } else if let Some(later) =
                    self.0.iter_mut().find(|later| later.original == Some(cell) && later.pin_type == pin_type)
                {
                    // another fault began on the same pin meanwhile: it reads the signal itself from now on
                    later.original = Some(original);
                }
            }
        }
        self.0.iter().any(|fault| fault.original.is_some())
    }

    /// Gives all pins back to their signals.
    pub(crate) fn clear(&mut self, values: &mut Values) {
        // the last that began points to the cell of the one before
        for fault in self.0.drain(..).rev() {
            if let Some(original) = fault.original {
                values.pin_cells_mut(fault.pin_type)[fault.index] = original;
            }
        }
    }

    /// Lets the faulty pins show what they make of their signals.
    pub(crate) fn show(&self, values: &mut Values) {
        for fault in &self.0 {
            if let Some(original) = fault.original {
                let value = values.cell(fault.pin_type, original);
                values.set_cell(fault.cell, fault.apply(value));
            }
        }
    }
}

impl Injected {
    /// What the component reads in place of `value`.
    fn apply(&self, value: Value) -> Value {
        let number = |bits: bool, float: f64, s32: i64, u32: i64| match value {
            Value::Bit(_) => Value::Bit(bits),
            Value::Float(_) => Value::Float(float),
            Value::S32(_) => Value::S32(s32.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32),
            Value::U32(_) => Value::U32(u32.clamp(0, i64::from(u32::MAX)) as u32),
        };
        let now = match value {
            Value::Bit(bit) => f64::from(u8::from(bit)),
            Value::Float(float) => float,
            Value::S32(s32) => f64::from(s32),
            Value::U32(u32) => f64::from(u32),
        };
        let whole = |float: f64| float as i64;
        match self.kind {
            FaultKind::Set(Value::Bit(bit)) => {
                let float = f64::from(u8::from(bit));
                number(bit, float, whole(float), whole(float))
            }
            FaultKind::Set(Value::Float(float)) => number(float != 0.0, float, whole(float), whole(float)),
            FaultKind::Set(Value::S32(s32)) => number(s32 != 0, f64::from(s32), s32.into(), s32.into()),
            FaultKind::Set(Value::U32(u32)) => number(u32 != 0, f64::from(u32), u32.into(), u32.into()),
            FaultKind::Freeze => self.frozen,
            FaultKind::Invert => number(now == 0.0, -now, whole(-now), whole(-now)),
            FaultKind::Offset(offset) => {
                let float = now + offset;
                number(now != 0.0, float, whole(float), whole(float))
            }
            FaultKind::NotANumber => number(now != 0.0, f64::NAN, whole(now), whole(now)),
            FaultKind::Infinite => number(now != 0.0, f64::INFINITY, whole(now), whole(now)),
        }
    }
}
