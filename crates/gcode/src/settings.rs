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
    /// A, B, C go round: in G90 a value from 0 to below 360 is a position, its sign the direction; one turn at most.
    pub wrapped_rotary: [bool; 3],
    /// A, B, C are locked while the machine cuts: each moves alone, and only by G0.
    pub locking_indexer: [bool; 3],
    /// Each tool has a pocket of its own, and M6 exchanges it with the one in the spindle: slots are pockets, and tool 0 is a tool like any
    /// other.
    pub random_toolchanger: bool,
    /// M6 first moves Z to machine zero.
    pub tool_change_quill_up: bool,
    /// M6 first moves to the G30 position.
    pub tool_change_at_g30: bool,
    /// M6 leaves the spindle turning.
    pub tool_change_with_spindle_on: bool,
    /// M6 while G43 is in force takes the new tool's offset; T0 M6 cancels it.
    pub retain_g43: bool,
    /// A sub finds the number of its arguments in `#<n_args>`.
    pub oword_nargs: bool,
    /// Added to the angle of M19, degrees.
    pub orient_offset_deg: f64,
    /// The end of the program leaves the coordinate system as it is (LinuxCNC 2.10 and pkm).
    pub keeps_system_at_end: bool,
    /// The end of the program takes G52 and G92 back (LinuxCNC 2.10 and pkm).
    pub forgets_g92_at_end: bool,
    /// How far G73 backs off without a D word, program units (LinuxCNC 2.10 and pkm); `None` = 1 mm or 0.05 in.
    pub g73_clearance: Option<f64>,
    /// The same of G83.
    pub g83_clearance: Option<f64>,
    /// Tolerance of G64 without P, and of its naive CAM without Q (LinuxCNC 2.10 and pkm), program units.
    pub g64_tolerance: f64,
    /// See [`Settings::g64_tolerance`].
    pub g64_naivecam_tolerance: f64,
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
            wrapped_rotary: [false; 3],
            locking_indexer: [false; 3],
            random_toolchanger: false,
            tool_change_quill_up: false,
            tool_change_at_g30: false,
            tool_change_with_spindle_on: false,
            retain_g43: false,
            oword_nargs: false,
            orient_offset_deg: 0.0,
            keeps_system_at_end: false,
            forgets_g92_at_end: false,
            g73_clearance: None,
            g83_clearance: None,
            g64_tolerance: 0.0,
            g64_naivecam_tolerance: 0.0,
            arc_radius_tolerance_inch: 0.002_828_4,
            arc_radius_tolerance_mm: 0.028_284,
            max_idle_blocks: 10_000_000,
            max_blocks: 0,
            imitates_rs274: false,
        }
    }
}

impl Settings {
    /// True where LinuxCNC 2.10 and pkm have something that 2.9 lacks.
    pub(crate) fn is_newer(&self) -> bool {
        self.dialect != Dialect::LinuxCnc29
    }

    /// True if M6 exchanges tools. Those of the machine that rs274 simulates stay where they are (checked with rs274 2.9).
    pub(crate) fn exchanges_tools(&self) -> bool {
        self.random_toolchanger && !(self.imitates_rs274 && self.dialect != Dialect::Pkm)
    }

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
