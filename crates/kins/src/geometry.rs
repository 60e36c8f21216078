//! Why parameters make no mechanism: typed, and naming the key as the machine file writes it.

use core::fmt;

/// A parameter as the machine file names it: its key, and its place where the key is a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key {
    /// The key, e.g. `l_mm`.
    pub name: &'static str,
    /// Place in the list, from 0.
    pub index: Option<usize>,
}

impl Key {
    /// A key that is not a list.
    pub const fn of(name: &'static str) -> Self {
        Self { name, index: None }
    }

    /// One entry of a list.
    pub const fn at(name: &'static str, index: usize) -> Self {
        Self { name, index: Some(index) }
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.index {
            Some(index) => write!(f, "{}[{index}]", self.name),
            None => f.write_str(self.name),
        }
    }
}

/// Why parameters make no mechanism.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum GeometryError {
    /// The parameter is NaN or infinite.
    NotFinite {
        /// Which one.
        key: Key,
    },
    /// The parameter lies outside what makes a mechanism.
    OutOfRange {
        /// Which one.
        key: Key,
        /// As written.
        value: f64,
        /// Smallest allowed value.
        low: f64,
        /// Largest allowed value.
        high: f64,
    },
    /// A length that must be positive is not.
    NotPositive {
        /// Which one.
        key: Key,
        /// As written.
        value: f64,
    },
    /// A mode is not +1 or −1.
    NotASign {
        /// Which one.
        key: Key,
        /// As written.
        value: i8,
    },
    /// Both sliders run on one rail in the same mode: the joints cannot tell points apart.
    CoincidentRails,
    /// Two planes that must differ are one (`D = 0` or `b_z = 0`).
    DegeneratePlanes {
        /// The distance that is 0.
        key: Key,
    },
    /// One length must be smaller than another.
    NotLess {
        /// The smaller one.
        key: Key,
        /// As written.
        value: f64,
        /// The larger one.
        than: Key,
        /// As written, or what follows from the parameters.
        limit: f64,
    },
    /// Points that must span a plane lie in one line or coincide.
    DegeneratePoints {
        /// Which ones.
        key: Key,
    },
    /// The machine would have no axis.
    NoAxis,
}

impl GeometryError {
    /// The parameter at fault, if one alone is.
    pub fn key(&self) -> Option<Key> {
        match *self {
            Self::NotFinite { key }
            | Self::OutOfRange { key, .. }
            | Self::NotPositive { key, .. }
            | Self::NotASign { key, .. }
            | Self::DegeneratePlanes { key }
            | Self::NotLess { key, .. }
            | Self::DegeneratePoints { key } => Some(key),
            Self::CoincidentRails | Self::NoAxis => None,
        }
    }
}

impl fmt::Display for GeometryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { key } => write!(f, "{key} is not a finite number"),
            Self::OutOfRange { key, value, low, high } => {
                write!(f, "{key} = {value} is outside {low} to {high}")
            }
            Self::NotPositive { key, value } => write!(f, "{key} = {value} must be greater than 0"),
            Self::NotASign { key, value } => write!(f, "{key} = {value} must be 1 or -1"),
            Self::CoincidentRails => f.write_str(
                "both sliders run on the same rail in the same working mode; \
                 set different reference_mm, guide_angle_deg or working_mode",
            ),
            Self::DegeneratePlanes { key } => write!(f, "{key} is 0: two planes that must differ coincide"),
            Self::NotLess { key, value, than, limit } => {
                write!(f, "{key} = {value} must be less than {than} ({limit})")
            }
            Self::DegeneratePoints { key } => write!(f, "the points {key} coincide or lie in one line"),
            Self::NoAxis => f.write_str("the list of axes is empty"),
        }
    }
}

impl core::error::Error for GeometryError {}

/// The largest length a mechanism may have, mm: a kilometre. It keeps every formula far from overflow.
pub(crate) const MAX_LENGTH_MM: f64 = 1e6;

/// A finite number of at most `MAX_LENGTH_MM` in size.
pub(crate) fn coordinate(key: Key, value: f64) -> Result<f64, GeometryError> {
    if !value.is_finite() {
        return Err(GeometryError::NotFinite { key });
    }
    if !(-MAX_LENGTH_MM..=MAX_LENGTH_MM).contains(&value) {
        return Err(GeometryError::OutOfRange { key, value, low: -MAX_LENGTH_MM, high: MAX_LENGTH_MM });
    }
    Ok(value)
}

/// A positive length of at least a micrometre.
pub(crate) fn length(key: Key, value: f64) -> Result<f64, GeometryError> {
    let value = coordinate(key, value)?;
    if value <= 0.0 {
        return Err(GeometryError::NotPositive { key, value });
    }
    if value < 1e-3 {
        return Err(GeometryError::OutOfRange { key, value, low: 1e-3, high: MAX_LENGTH_MM });
    }
    Ok(value)
}

/// A finite angle, at most a thousand turns.
pub(crate) fn angle_deg(key: Key, value: f64) -> Result<f64, GeometryError> {
    if !value.is_finite() {
        return Err(GeometryError::NotFinite { key });
    }
    if !(-360e3..=360e3).contains(&value) {
        return Err(GeometryError::OutOfRange { key, value, low: -360e3, high: 360e3 });
    }
    Ok(value)
}

/// +1 or −1.
pub(crate) fn sign(key: Key, value: i8) -> Result<f64, GeometryError> {
    match value {
        1 => Ok(1.0),
        -1 => Ok(-1.0),
        _ => Err(GeometryError::NotASign { key, value }),
    }
}
