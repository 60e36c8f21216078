//! What pins hold: one typed array per type, and the edges of bit lines inside a servo period.
//!
//! A pin is an index; where it points (its own cell or its signal's) is looked up in one more array, so that linking
//! costs nothing in the tick. Nothing here allocates once the edge queues have grown to their largest size.

/// Type of a pin, signal or parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum PinType {
    Bit,
    Float,
    S32,
    U32,
}

/// A value with its type.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub enum Value {
    Bit(bool),
    Float(f64),
    S32(i32),
    U32(u32),
}

impl Value {
    /// Its type.
    pub const fn pin_type(self) -> PinType {
        match self {
            Self::Bit(_) => PinType::Bit,
            Self::Float(_) => PinType::Float,
            Self::S32(_) => PinType::S32,
            Self::U32(_) => PinType::U32,
        }
    }
}

impl std::fmt::Display for PinType {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Bit => "bit",
            Self::Float => "float",
            Self::S32 => "s32",
            Self::U32 => "u32",
        })
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bit(value) => f.pad(if *value { "TRUE" } else { "FALSE" }),
            Self::Float(value) => f.pad(&value.to_string()),
            Self::S32(value) => f.pad(&value.to_string()),
            Self::U32(value) => f.pad(&value.to_string()),
        }
    }
}

/// A bit pin or parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitPin(pub(crate) u32);
/// A float pin or parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FloatPin(pub(crate) u32);
/// A signed integer pin or parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct S32Pin(pub(crate) u32);
/// An unsigned integer pin or parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct U32Pin(pub(crate) u32);

/// The values of one type: cells, and for each pin the cell it points to.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bank<T> {
    pub(crate) cells: Vec<T>,
    pub(crate) pins: Vec<u32>,
    /// A pin's own cell, where it points while it is not linked.
    pub(crate) own: Vec<u32>,
}

impl<T: Copy> Bank<T> {
    /// A new cell.
    pub(crate) fn cell(&mut self, value: T) -> u32 {
        self.cells.push(value);
        self.cells.len() as u32 - 1
    }

    /// A new pin with a cell of its own.
    pub(crate) fn pin(&mut self, value: T) -> u32 {
        let cell = self.cell(value);
        self.pins.push(cell);
        self.own.push(cell);
        self.pins.len() as u32 - 1
    }

    fn get(&self, pin: u32) -> T {
        self.cells[self.pins[pin as usize] as usize]
    }

    fn set(&mut self, pin: u32, value: T) {
        self.cells[self.pins[pin as usize] as usize] = value;
    }
}

/// An edge of one bit line inside a period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineEdge {
    /// Timer ticks.
    pub time: u64,
    /// Level after the edge.
    pub level: bool,
}

/// The edges of a bit line, in order of time. The writer retires what is past; a reader remembers by a running number
/// what it has seen, so that it sees each edge once, wherever it stands in the thread.
#[derive(Debug, Clone, Default)]
pub struct EdgeQueue {
    edges: Vec<LineEdge>,
    first: u64,
}

impl EdgeQueue {
    /// Appends an edge; its time is not before that of the last one.
    #[inline]
    pub fn push(&mut self, time: u64, level: bool) {
        debug_assert!(self.edges.last().is_none_or(|last| last.time <= time));
        self.edges.push(LineEdge { time, level });
    }

    /// How many of the edges come up to and including `time`; the few that do not are at the end.
    #[inline]
    fn until(&self, time: u64) -> usize {
        self.edges.len() - self.edges.iter().rev().take_while(|edge| edge.time > time).count()
    }

    /// Forgets the edges up to and including `time`.
    #[inline]
    pub fn retire(&mut self, time: u64) {
        let past = self.until(time);
        self.edges.drain(..past);
        self.first += past as u64;
    }

    /// The edges that have not been retired.
    pub fn edges(&self) -> &[LineEdge] {
        &self.edges
    }

    /// Drops the edges after `time`, but leaves the end of a pulse that has begun; `level` is that of the line before
    /// the first edge here.
    pub fn cut_after(&mut self, time: u64, level: bool) {
        let past = self.until(time);
        let high = past.checked_sub(1).map_or(level, |last| self.edges[last].level);
        self.edges.truncate(past + usize::from(high));
    }

    /// The edges that the cursor has not seen, up to and including `until`; moves the cursor past them.
    #[inline]
    pub fn read(&self, cursor: &mut u64, until: u64) -> &[LineEdge] {
        let end = self.until(until);
        let start = (cursor.saturating_sub(self.first) as usize).min(end);
        *cursor = self.first + end as u64;
        &self.edges[start..end]
    }

    /// The level after the last edge up to and including `time`, if there is such an edge.
    #[inline]
    pub fn level_at(&self, time: u64) -> Option<bool> {
        self.edges[..self.until(time)].last().map(|edge| edge.level)
    }
}

/// All values of a HAL. Components read and write their pins through it.
#[derive(Debug, Clone, Default)]
pub struct Values {
    pub(crate) bits: Bank<bool>,
    pub(crate) floats: Bank<f64>,
    pub(crate) s32s: Bank<i32>,
    pub(crate) u32s: Bank<u32>,
    /// One queue per bit cell; most stay empty and own no memory.
    pub(crate) edges: Vec<EdgeQueue>,
}

impl Values {
    /// Where the pins of a type point.
    pub(crate) const fn pin_cells(&self, pin_type: PinType) -> &Vec<u32> {
        match pin_type {
            PinType::Bit => &self.bits.pins,
            PinType::Float => &self.floats.pins,
            PinType::S32 => &self.s32s.pins,
            PinType::U32 => &self.u32s.pins,
        }
    }

    /// The same, to redirect one.
    pub(crate) const fn pin_cells_mut(&mut self, pin_type: PinType) -> &mut Vec<u32> {
        match pin_type {
            PinType::Bit => &mut self.bits.pins,
            PinType::Float => &mut self.floats.pins,
            PinType::S32 => &mut self.s32s.pins,
            PinType::U32 => &mut self.u32s.pins,
        }
    }

    pub(crate) fn cell(&self, pin_type: PinType, cell: u32) -> Value {
        let cell = cell as usize;
        match pin_type {
            PinType::Bit => Value::Bit(self.bits.cells[cell]),
            PinType::Float => Value::Float(self.floats.cells[cell]),
            PinType::S32 => Value::S32(self.s32s.cells[cell]),
            PinType::U32 => Value::U32(self.u32s.cells[cell]),
        }
    }

    pub(crate) fn set_cell(&mut self, cell: u32, value: Value) {
        let cell = cell as usize;
        match value {
            Value::Bit(value) => self.bits.cells[cell] = value,
            Value::Float(value) => self.floats.cells[cell] = value,
            Value::S32(value) => self.s32s.cells[cell] = value,
            Value::U32(value) => self.u32s.cells[cell] = value,
        }
    }

    /// A new cell of a signal.
    pub(crate) fn new_cell(&mut self, value: Value) -> u32 {
        match value {
            Value::Bit(value) => {
                let cell = self.bits.cell(value);
                self.edges.resize_with(self.bits.cells.len(), Default::default);
                cell
            }
            Value::Float(value) => self.floats.cell(value),
            Value::S32(value) => self.s32s.cell(value),
            Value::U32(value) => self.u32s.cell(value),
        }
    }

    /// Level of a bit pin.
    #[inline]
    pub fn bit(&self, pin: BitPin) -> bool {
        self.bits.get(pin.0)
    }

    /// Sets a bit pin.
    #[inline]
    pub fn set_bit(&mut self, pin: BitPin, value: bool) {
        self.bits.set(pin.0, value);
    }

    /// Value of a float pin.
    #[inline]
    pub fn float(&self, pin: FloatPin) -> f64 {
        self.floats.get(pin.0)
    }

    /// Sets a float pin.
    #[inline]
    pub fn set_float(&mut self, pin: FloatPin, value: f64) {
        self.floats.set(pin.0, value);
    }

    /// Value of a signed pin.
    #[inline]
    pub fn s32(&self, pin: S32Pin) -> i32 {
        self.s32s.get(pin.0)
    }

    /// Sets a signed pin.
    #[inline]
    pub fn set_s32(&mut self, pin: S32Pin, value: i32) {
        self.s32s.set(pin.0, value);
    }

    /// Value of an unsigned pin.
    #[inline]
    pub fn u32(&self, pin: U32Pin) -> u32 {
        self.u32s.get(pin.0)
    }

    /// Sets an unsigned pin.
    #[inline]
    pub fn set_u32(&mut self, pin: U32Pin, value: u32) {
        self.u32s.set(pin.0, value);
    }

    /// Whether a float pin is linked to a signal.
    #[inline]
    pub fn float_is_linked(&self, pin: FloatPin) -> bool {
        self.floats.pins[pin.0 as usize] != self.floats.own[pin.0 as usize]
    }

    /// The edges inside the period on the line that a bit pin is linked to.
    #[inline]
    pub fn edges(&self, pin: BitPin) -> &EdgeQueue {
        &self.edges[self.bits.pins[pin.0 as usize] as usize]
    }

    /// The same, for the line's writer, who ends with [`Self::show_edges`].
    #[inline]
    pub fn edges_mut(&mut self, pin: BitPin) -> &mut EdgeQueue {
        &mut self.edges[self.bits.pins[pin.0 as usize] as usize]
    }

    /// The line takes the level that its edges give it at `now`.
    #[inline]
    pub fn show_edges(&mut self, pin: BitPin, now: u64) {
        let cell = self.bits.pins[pin.0 as usize] as usize;
        if let Some(level) = self.edges[cell].level_at(now) {
            self.bits.cells[cell] = level;
        }
    }
}
