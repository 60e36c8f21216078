//! The state a program changes: modes, position, offsets, parameters, tools; and what expressions see of it.

use super::compensation::Compensation;
use super::cycles::CycleMemory;
use super::saved::SavedStates;
use super::splines::Splines;
use crate::block::{Block, Reader, Setting};
use crate::error::{Error, ErrorKind};
use crate::expression::{Scope, Tolerance};
use crate::line::Line;
use crate::modal::{FeedMode, Modal, Side};
use crate::parameters::{self, Parameters, system_offset};
use crate::settings::{Dialect, INCH_PER_MM, MM_PER_INCH, Settings};
use crate::tool_table::ToolTable;
use pkm_canon::{Canon, Direction, LengthUnit, Plane, Position, Span};
use pkm_kins::maths;

/// True for the coordinates that are lengths (X Y Z U V W).
pub(crate) const fn is_length(axis: usize) -> bool {
    axis < 3 || axis > 5
}

/// What an arc's radii may differ by without a word: as much as rounding its four numbers to 0.001 mm makes.
const SMALLEST_SPIRAL_MM: f64 = 0.002;

#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) settings: Settings,
    pub(crate) parameters: Parameters,
    pub(crate) tools: ToolTable,
    pub(crate) modal: Modal,
    /// Program coordinates: the machine is at R (position + g92) + g5x + tool offset, R turns X Y.
    pub(crate) position: [f64; 9],
    pub(crate) g5x: [f64; 9],
    pub(crate) g92: [f64; 9],
    pub(crate) tool_offset: [f64; 9],
    pub(crate) rotation_deg: f64,
    pub(crate) cutter: Compensation,
    pub(crate) cycle_memory: CycleMemory,
    pub(crate) splines: Splines,
    pub(crate) saved: SavedStates,
    /// Slot of the tool in the spindle; 0 = none.
    pub(crate) loaded_slot: i32,
    /// The spindle's pocket before G10 wrote a row there; only rs274 shows it again.
    pub(crate) spindle_pocket: Option<i32>,
    /// Open calls.
    pub(crate) call_level: u32,
    /// Remapped codes being executed in each other.
    pub(crate) remap_level: u32,
    #[cfg(feature = "alloc")]
    pub(crate) remaps: crate::remap::Remaps,
    /// What the last return gave; `None` = nothing.
    pub(crate) return_value: Option<f64>,
    /// Undefined named parameters read 0 (LinuxCNC, while it passes over a definition).
    pub(crate) unknown_names_are_zero: bool,
    /// Line of the block being read.
    pub(crate) source_line: u32,
    /// The G94 or G95 that made F unset, until F is set.
    pub(crate) feed_unset: Option<Span>,
    /// See [`super::Interpreter::take_notice`].
    pub(crate) notice: Option<Error>,
    /// The largest difference of an arc's radii so far, mm.
    pub(crate) largest_spiral_mm: f64,
}

impl State {
    pub(crate) fn new(settings: Settings) -> Self {
        Self {
            settings,
            parameters: Parameters::default(),
            tools: ToolTable::default(),
            modal: Modal::new(settings.start_units),
            position: [0.0; 9],
            g5x: [0.0; 9],
            g92: [0.0; 9],
            tool_offset: [0.0; 9],
            rotation_deg: 0.0,
            cutter: Compensation::default(),
            cycle_memory: CycleMemory::default(),
            splines: Splines::default(),
            saved: SavedStates::default(),
            // rs274 begins with slot 1 in force and an empty spindle.
            loaded_slot: i32::from(settings.imitates_rs274),
            spindle_pocket: None,
            call_level: 0,
            remap_level: 0,
            #[cfg(feature = "alloc")]
            remaps: crate::remap::Remaps::default(),
            return_value: None,
            unknown_names_are_zero: false,
            source_line: 0,
            feed_unset: None,
            notice: None,
            largest_spiral_mm: SMALLEST_SPIRAL_MM,
        }
    }

    /// Offsets and coordinate system as the parameters hold them at the start. The machine point is kept.
    pub(crate) fn take_over_parameters(&mut self) {
        let machine = self.machine_point(self.position);
        let system = self.parameters.get(parameters::SYSTEM);
        self.modal.system = if (1.0..=9.0).contains(&system) { system as i32 } else { 1 };
        self.load_system(self.modal.system);
        self.g92 = self.kept_g92();
        // The machine that rs274 simulates knows no rotation.
        self.position = match self.settings.imitates_rs274 {
            true => core::array::from_fn(|axis| machine[axis] - self.g5x[axis] - self.g92[axis]),
            false => self.program_point(machine),
        };
    }

    /// Takes over offset and rotation of a coordinate system; the position is not touched.
    pub(crate) fn load_system(&mut self, system: i32) {
        let first = system_offset(system);
        self.modal.system = system;
        self.g5x = self.program_units(self.parameters.nine(first));
        self.rotation_deg = self.parameters.get(first + 9);
    }

    pub(crate) fn set_machine_position_mm(&mut self, position: Position) {
        let mut machine = position.to_array();
        if self.modal.units == LengthUnit::Inch {
            scale_lengths(&mut machine, INCH_PER_MM);
        }
        self.position = self.program_point(machine);
    }

    /// Machine point (program units) of a program point.
    pub(crate) fn machine_point(&self, program: [f64; 9]) -> [f64; 9] {
        let mut p: [f64; 9] = core::array::from_fn(|i| program[i] + self.g92[i]);
        rotate(&mut p, self.rotation_deg);
        core::array::from_fn(|i| p[i] + self.g5x[i] + self.tool_offset[i])
    }

    /// Program point of a machine point (program units).
    pub(crate) fn program_point(&self, machine: [f64; 9]) -> [f64; 9] {
        let mut p: [f64; 9] = core::array::from_fn(|i| machine[i] - self.g5x[i] - self.tool_offset[i]);
        rotate(&mut p, -self.rotation_deg);
        core::array::from_fn(|i| p[i] - self.g92[i])
    }

    /// Nine values from machine units into program units; angles stay.
    pub(crate) fn program_units(&self, mut values: [f64; 9]) -> [f64; 9] {
        for (_, value) in values.iter_mut().enumerate().filter(|(axis, _)| is_length(*axis)) {
            *value = self.settings.program_length(*value, self.modal.units);
        }
        values
    }

    /// Nine values from program units into machine units; angles stay.
    pub(crate) fn machine_units(&self, mut values: [f64; 9]) -> [f64; 9] {
        for (_, value) in values.iter_mut().enumerate().filter(|(axis, _)| is_length(*axis)) {
            *value = self.settings.machine_length(*value, self.modal.units);
        }
        values
    }

    /// G20, G21: all lengths in force change their number, not their meaning. F keeps its number.
    pub(crate) fn convert_units(&mut self, units: LengthUnit) {
        if units == self.modal.units {
            return;
        }
        let factor = match units {
            LengthUnit::Inch => INCH_PER_MM,
            LengthUnit::Mm => MM_PER_INCH,
        };
        self.modal.units = units;
        for values in [&mut self.position, &mut self.g5x, &mut self.g92] {
            scale_lengths(values, factor);
        }
        // The interpreter reads the tool offset back from the machine; rs274's answers with the old number.
        if !self.settings.imitates_rs274 {
            scale_lengths(&mut self.tool_offset, factor);
        }
    }

    pub(crate) fn g5x_command(&self) -> Canon<'static> {
        Canon::SetG5xOffset { system: self.modal.system, offset: Position::from_array(self.g5x) }
    }

    pub(crate) fn g92_command(&self) -> Canon<'static> {
        Canon::SetG92Offset(Position::from_array(self.g92))
    }

    pub(crate) fn reader(&self) -> Reader<'_> {
        Reader {
            #[cfg(feature = "alloc")]
            remaps: &self.remaps,
            #[cfg(not(feature = "alloc"))]
            remaps: core::marker::PhantomData,
            axes: self.settings.axes,
            diameter: self.modal.diameter,
            spindles: self.settings.spindles.min(8),
            machine_codes: self.settings.machine_codes,
            newer: self.settings.is_newer(),
            both_coolants: self.settings.dialect == Dialect::Pkm,
            largest: self.settings.largest_number(),
        }
    }

    /// Stores the parameter settings of a block; they take effect together.
    pub(crate) fn store_settings(&mut self, block: &Block, line: &Line) -> Result<(), Error> {
        for setting in &block.settings {
            match *setting {
                Setting::Number { index, value } => self.parameters.set(index, value),
                Setting::Name { start, end, value, at } => {
                    let name = line.code().get(start.into()..end.into()).unwrap_or_default();
                    let error = |kind| Error { kind, span: block.setting_span(at) };
                    if self.predefined(name).is_some() {
                        return Err(error(ErrorKind::ParamReadonlyNamed));
                    }
                    self.parameters.set_named(name, value).map_err(error)?;
                }
            }
        }
        Ok(())
    }

    #[cfg(feature = "alloc")]
    pub(crate) fn enter_sub(&mut self, arguments: Option<[f64; parameters::ARGUMENTS]>) {
        self.call_level += 1;
        self.parameters.enter();
        if let Some(arguments) = arguments {
            self.parameters.set_arguments(&arguments);
        }
    }

    #[cfg(feature = "alloc")]
    pub(crate) fn leave_sub(&mut self, arguments: Option<[f64; parameters::ARGUMENTS]>) {
        self.call_level = self.call_level.saturating_sub(1);
        self.parameters.leave();
        if let Some(arguments) = arguments {
            self.parameters.set_arguments(&arguments);
        }
    }

    #[cfg(feature = "alloc")]
    pub(crate) fn set_return_value(&mut self, value: Option<f64>) {
        self.return_value = value;
    }

    /// Value of a predefined named parameter.
    pub(crate) fn predefined(&self, name: &[u8]) -> Option<f64> {
        let modal = &self.modal;
        let flag = |condition: bool| Some(if condition { 1.0 } else { 0.0 });
        let spindle = modal.spindles[0];
        match name {
            b"_vmajor" => Some(if self.settings.dialect == Dialect::LinuxCnc210 { 2.10 } else { 2.9 }),
            b"_vminor" => Some(0.0),
            b"_metric_machine" if self.settings.imitates_rs274 => Some(-1.0), // it has no INI file
            b"_metric_machine" => flag((self.settings.machine_units_per_mm - 1.0).abs() < 1e-6),
            b"_line" => Some(self.source_line.into()),
            b"_motion_mode" => Some(modal.motion.into()),
            b"_plane" => Some(match modal.plane {
                Plane::Xy => 170.0,
                Plane::Xz => 180.0,
                Plane::Yz => 190.0,
                Plane::Uv => 171.0,
                Plane::Uw => 181.0,
                Plane::Vw => 191.0,
            }),
            b"_ccomp" => Some(match modal.compensation {
                None => 400.0,
                Some(Side::Left) => 410.0,
                Some(Side::Right) => 420.0,
            }),
            b"_metric" => flag(modal.units == LengthUnit::Mm),
            b"_imperial" => flag(modal.units == LengthUnit::Inch),
            b"_absolute" => flag(!modal.incremental),
            b"_incremental" => flag(modal.incremental),
            b"_inverse_time" => flag(modal.feed_mode == FeedMode::InverseTime),
            b"_units_per_minute" => flag(modal.feed_mode == FeedMode::PerMinute),
            b"_units_per_rev" => flag(modal.feed_mode == FeedMode::PerTurn),
            b"_coord_system" => Some(match modal.system {
                system @ 1..=6 => f64::from(530 + 10 * system),
                system => f64::from(584 + system),
            }),
            b"_tool_offset" => flag(self.tool_offset.iter().any(|o| *o != 0.0)),
            b"_retract_r_plane" => flag(!modal.retract_to_old),
            b"_retract_old_z" => flag(modal.retract_to_old),
            b"_spindle_rpm_mode" => flag(spindle.surface_speed.is_none()),
            b"_spindle_css_mode" => flag(spindle.surface_speed.is_some()),
            b"_ijk_absolute_mode" => flag(modal.arc_centre_absolute),
            b"_lathe_diameter_mode" => flag(modal.diameter),
            b"_lathe_radius_mode" => flag(!modal.diameter),
            b"_spindle_on" => flag(spindle.turning.is_some()),
            b"_spindle_cw" => flag(spindle.turning == Some(Direction::Clockwise)),
            b"_mist" => flag(modal.mist),
            b"_flood" => flag(modal.flood),
            b"_speed_override" => flag(spindle.speed_override),
            b"_feed_override" => flag(modal.feed_override),
            b"_adaptive_feed" => flag(modal.adaptive_feed),
            b"_feed_hold" => flag(modal.feed_hold),
            b"_feed" => Some(modal.feed),
            b"_rpm" => Some(spindle.speed.abs()),
            b"_current_tool" => self.tools.get(0).map(|tool| tool.number.into()),
            b"_current_pocket" => Some(self.pocket_of(self.loaded_slot)),
            b"_selected_tool" => Some(modal.selected_tool.into()),
            b"_selected_pocket" => Some(self.pocket_of(modal.selected_slot)),
            b"_task" => Some(0.0),
            b"_remap_level" => Some(self.remap_level.into()),
            b"_call_level" => Some(self.call_level.into()),
            b"_value" => Some(self.return_value.unwrap_or(0.0)),
            b"_value_returned" => flag(self.return_value.is_some()),
            _ => {
                let axis = |letter: &u8| b"xyzabcuvw".iter().position(|l| l == letter);
                match name {
                    [b'_', letter] => Some(self.position[axis(letter)?]),
                    [b'_', b'a', b'b', b's', b'_', letter] => {
                        Some(self.machine_point(self.position)[axis(letter)?])
                    }
                    _ => None,
                }
            }
        }
    }
}

impl Scope for State {
    fn numbered(&self, index: i32) -> Result<f64, ErrorKind> {
        Ok(match index {
            5420..=5428 if self.modal.compensation.is_some() => return Err(ErrorKind::ParamCc { index }),
            5420..=5428 => self.position[(index - 5420) as usize],
            5400..=5413 => {
                let tool = self.tools.get(0).copied().unwrap_or_default();
                match index {
                    5400 => tool.number.into(),
                    5401..=5409 => tool.offset.to_array()[(index - 5401) as usize],
                    5410 => tool.diameter,
                    5411 => tool.front_angle,
                    5412 => tool.back_angle,
                    _ => tool.orientation.into(),
                }
            }
            5021..=5029 if self.settings.dialect != Dialect::LinuxCnc29 => {
                self.machine_point(self.position)[(index - 5021) as usize]
            }
            5081..=5089 if self.settings.dialect != Dialect::LinuxCnc29 => {
                self.tool_offset[(index - 5081) as usize]
            }
            _ => self.parameters.get(index),
        })
    }

    fn named(&self, name: &[u8]) -> Option<f64> {
        if name.first() == Some(&b'_')
            && let Some(value) = self.predefined(name)
        {
            return Some(value);
        }
        self.parameters.named(name).or_else(|| self.unknown_names_are_zero.then_some(0.0))
    }

    fn tolerance(&self) -> Tolerance {
        match self.settings.dialect {
            Dialect::LinuxCnc29 => Tolerance { equal: 1e-4, ordered: false },
            Dialect::LinuxCnc210 | Dialect::Pkm => Tolerance { equal: 1e-6, ordered: true },
        }
    }

    fn strict(&self) -> bool {
        self.settings.dialect == Dialect::Pkm
    }
}

/// Multiplies the lengths of nine coordinates.
pub(crate) fn scale_lengths(values: &mut [f64; 9], factor: f64) {
    for (_, value) in values.iter_mut().enumerate().filter(|(axis, _)| is_length(*axis)) {
        *value *= factor;
    }
}

/// Turns X and Y counter-clockwise.
pub(crate) fn rotate(values: &mut [f64; 9], degrees: f64) {
    if degrees == 0.0 {
        return;
    }
    let (cos, sin) = maths::cos_sin_deg(degrees);
    let [x, y, ..] = *values;
    values[0] = x * cos - y * sin;
    values[1] = x * sin + y * cos;
}
