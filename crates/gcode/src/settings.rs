//! What the machine and the person set before a program runs.

use pkm_canon::{LengthUnit, MACHINE_CODES, MOST_MACHINE_CODES};
use pkm_kins::{Axis, AxisSet};

/// Whose rules decide where versions differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dialect {
    /// LinuxCNC 2.9, as Debian ships it.
    LinuxCnc29,
    /// LinuxCNC 2.10.
    LinuxCnc210,
    /// LinuxCNC's language with its dangerous quirks corrected or refused.
    #[default]
    Pkm,
}

/// The M codes that a machine's own file gives a meaning to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MachineCodes([i16; MOST_MACHINE_CODES]);

impl MachineCodes {
    /// `None` if there are more than [`MOST_MACHINE_CODES`], or one is outside [`MACHINE_CODES`].
    pub fn new(codes: &[i32]) -> Option<Self> {
        let mut all = Self::default();
        if codes.len() > MOST_MACHINE_CODES || !codes.iter().all(|code| MACHINE_CODES.contains(code)) {
            return None;
        }
        for (place, code) in all.0.iter_mut().zip(codes) {
            *place = *code as i16;
        }
        Some(all)
    }

    /// True if the machine has this code.
    pub fn contains(&self, number: i32) -> bool {
        MACHINE_CODES.contains(&number) && self.0.iter().any(|code| i32::from(*code) == number)
    }
}

/// Settings of one interpreter; they do not change while a program runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Whose rules.
    pub dialect: Dialect,
    /// Axis letters the program may use.
    pub axes: AxisSet,
    /// Machine units per mm: the unit of the kept parameters and of the tool table. 1 on a metric machine.
    pub machine_units_per_mm: f64,
    /// Length unit in force at the start (G20 or G21).
    pub start_units: LengthUnit,
    /// Lines that begin with `/` are skipped.
    pub block_delete: bool,
    /// Number of spindles, 1 to 8.
    pub spindles: u8,
    /// M codes of the machine's own; none by default.
    pub machine_codes: MachineCodes,
    /// Accepted difference of an arc's two radii, inch program.
    pub arc_radius_tolerance_inch: f64,
    /// The same, mm program.
    pub arc_radius_tolerance_mm: f64,
    /// The longest chain of blocks without motion, dwell or input before a loop counts as endless; 0 = no limit.
    pub max_idle_blocks: u64,
    /// The most blocks one run may execute; 0 = no limit.
    pub max_blocks: u64,
    /// Follow the oddities of the machine that `rs274` simulates: slot 1 counts as loaded at the start, and M61
    /// leaves the spindle's row of the tool table as it was.
    pub imitates_rs274: bool,
}

impl Default for Settings {
    /// A metric machine with all nine axes, under pkm's own dialect.
    fn default() -> Self {
        Self {
            dialect: Dialect::Pkm,
            axes: AxisSet::new(&Axis::ALL),
            machine_units_per_mm: 1.0,
            start_units: LengthUnit::Mm,
            block_delete: false,
            spindles: 1,
            machine_codes: MachineCodes::default(),
            arc_radius_tolerance_inch: 0.002_828_4,
            arc_radius_tolerance_mm: 0.028_284,
            max_idle_blocks: 10_000_000,
            max_blocks: 0,
            imitates_rs274: false,
        }
    }
}

impl Settings {
    /// The machine that Debian's `rs274` simulates: an inch machine with the axes XYZABC, started in mm.
    pub fn rs274() -> Self {
        Self {
            dialect: Dialect::LinuxCnc29,
            axes: AxisSet::new(&[Axis::X, Axis::Y, Axis::Z, Axis::A, Axis::B, Axis::C]),
            machine_units_per_mm: 0.039_370_078_740_16,
            max_idle_blocks: 0,
            imitates_rs274: true,
            ..Self::default()
        }
    }

    /// The largest number of an axis word; LinuxCNC takes any.
    pub(crate) fn largest_number(&self) -> f64 {
        if self.dialect == Dialect::Pkm { 1e9 } else { f64::INFINITY }
    }

    /// Program units of a length in machine units.
    pub(crate) fn program_length(&self, length: f64, units: LengthUnit) -> f64 {
        let mm = length / self.machine_units_per_mm;
        match units {
            LengthUnit::Mm => mm,
            LengthUnit::Inch => mm * INCH_PER_MM,
        }
    }

    /// Machine units of a length in program units.
    pub(crate) fn machine_length(&self, length: f64, units: LengthUnit) -> f64 {
        let in_machine = length * self.machine_units_per_mm;
        match units {
            LengthUnit::Mm => in_machine,
            LengthUnit::Inch => in_machine * MM_PER_INCH,
        }
    }
}

pub(crate) const INCH_PER_MM: f64 = 1.0 / 25.4;
pub(crate) const MM_PER_INCH: f64 = 25.4;
