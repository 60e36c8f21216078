//! The tool table in memory, and LinuxCNC's text format of it.

use crate::error::ErrorKind;
use pkm_canon::{Position, Tool};

#[cfg(feature = "alloc")]
type Rows = alloc::vec::Vec<Tool>;
#[cfg(not(feature = "alloc"))]
type Rows = heapless::Vec<Tool, 32>;

/// Most tools a table holds (LinuxCNC: 1001 pockets, one of them the spindle).
pub const MAX_TOOLS: usize = if cfg!(feature = "alloc") { 1000 } else { 32 };

/// The tools of a machine; lengths in machine units. Slot 0 is the spindle, slots 1 and up the rows in file order; or, when arranged by
/// pocket, slots are pockets, each with its tool or with none (number -1), and slot 0 the spindle too.
#[derive(Debug, Clone)]
pub struct ToolTable {
    rows: Rows,
    spindle: Tool,
    by_pocket: bool,
}

impl Default for ToolTable {
    fn default() -> Self {
        Self { rows: Rows::default(), spindle: no_tool(), by_pocket: false }
    }
}

/// An empty spindle.
fn no_tool() -> Tool {
    Tool { pocket: -1, ..Tool::default() }
}

impl ToolTable {
    /// Adds a row at the end.
    ///
    /// # Errors
    /// [`ErrorKind::ToolTableFull`] beyond [`MAX_TOOLS`].
    pub fn push(&mut self, tool: Tool) -> Result<(), ErrorKind> {
        let full = ErrorKind::ToolTableFull { limit: MAX_TOOLS as u16 };
        if self.rows.len() >= MAX_TOOLS {
            return Err(full);
        }
        #[cfg(feature = "alloc")]
        self.rows.push(tool);
        #[cfg(not(feature = "alloc"))]
        self.rows.push(tool).map_err(|_| full)?;
        Ok(())
    }

    /// The slot of a tool number: 0 for tool 0, else the first row that has it.
    pub fn slot(&self, number: i32) -> Option<i32> {
        if self.by_pocket {
            let found = || self.rows.iter().find(|tool| tool.number == number).map(|tool| tool.pocket);
            return if number < 0 {
                None
            } else {
                (self.spindle.number == number).then_some(0).or_else(found)
            };
        }
        if number == 0 {
            return Some(0);
        }
        self.rows.iter().position(|tool| tool.number == number).map(|i| i as i32 + 1)
    }

    /// The row of a slot; slot 0 is the tool in the spindle.
    pub fn get(&self, slot: i32) -> Option<&Tool> {
        match usize::try_from(slot).ok()? {
            0 => Some(&self.spindle),
            _ if self.by_pocket => self.rows.iter().find(|tool| tool.pocket == slot),
            i => self.rows.get(i - 1),
        }
    }

    /// The row of a slot, to change.
    pub fn get_mut(&mut self, slot: i32) -> Option<&mut Tool> {
        match usize::try_from(slot).ok()? {
            0 => Some(&mut self.spindle),
            _ if self.by_pocket => self.rows.iter_mut().find(|tool| tool.pocket == slot),
            i => self.rows.get_mut(i - 1),
        }
    }

    /// For a random tool changer: slots are pockets; what stands in pocket 0 is in the spindle.
    ///
    /// # Errors
    /// [`ErrorKind::ToolPocket`]: a tool without a pocket of its own.
    pub fn arrange_by_pocket(&mut self) -> Result<(), ErrorKind> {
        self.by_pocket = false;
        for (i, tool) in self.rows.iter().enumerate() {
            let taken = self.rows[..i].iter().any(|other| other.pocket == tool.pocket);
            if tool.pocket < 0 || taken {
                return Err(ErrorKind::ToolPocket { number: tool.number, pocket: tool.pocket });
            }
        }
        self.spindle = match self.rows.iter().position(|tool| tool.pocket == 0) {
            Some(row) => self.rows.remove(row),
            None => Tool { number: -1, ..Tool::default() },
        };
        self.by_pocket = true;
        Ok(())
    }

    /// Puts the tool of a slot into the spindle; slot 0 empties it. Arranged by pocket: exchanges it with the tool in the spindle.
    pub fn load_spindle(&mut self, slot: i32) {
        if self.by_pocket {
            if let Some(row) = self.rows.iter_mut().find(|tool| tool.pocket == slot && slot > 0) {
                core::mem::swap(row, &mut self.spindle);
                (row.pocket, self.spindle.pocket) = (slot, 0);
            }
            return;
        }
        self.spindle = match slot {
            0 => no_tool(),
            slot => self.get(slot).copied().unwrap_or_else(no_tool),
        };
    }

    /// Reads LinuxCNC's format: one tool a line, words in any order, `;` begins a comment. A line with any other
    /// word is skipped and handed to `refused` with its number, counted from 1.
    ///
    /// # Errors
    /// [`ErrorKind::ToolTableFull`] beyond [`MAX_TOOLS`].
    pub fn parse(text: &[u8], mut refused: impl FnMut(u32, &[u8])) -> Result<Self, ErrorKind> {
        let mut table = Self::default();
        for (number, line) in (1..).zip(text.split(|&b| b == b'\n')) {
            let words = line.split(|&b| b == b';').next().unwrap_or_default();
            if words.trim_ascii().is_empty() {
                continue;
            }
            match parse_row(words) {
                Some(tool) => table.push(tool)?,
                None => refused(number, line),
            }
        }
        Ok(table)
    }
}

/// `T1 P1 D0.125 Z+0.511`: letter and number, separated by blanks.
fn parse_row(words: &[u8]) -> Option<Tool> {
    let mut tool = Tool { number: -1, pocket: -1, ..Tool::default() };
    let mut offset = [0.0; 9];
    for word in words.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()) {
        let (letter, value) = word.split_first()?;
        let value: f64 = core::str::from_utf8(value).ok()?.parse().ok().filter(|v: &f64| v.is_finite())?;
        let whole = || (value % 1.0 == 0.0 && value.abs() < 1e9).then_some(value as i32);
        match letter.to_ascii_uppercase() {
            b'T' => tool.number = whole()?,
            b'P' => tool.pocket = whole()?,
            b'Q' => tool.orientation = whole()?,
            b'D' => tool.diameter = value,
            b'I' => tool.front_angle = value,
            b'J' => tool.back_angle = value,
            letter => *offset.get_mut(b"XYZABCUVW".iter().position(|&l| l == letter)?)? = value,
        }
    }
    tool.offset = Position::from_array(offset);
    (tool.number >= 0).then_some(tool)
}
