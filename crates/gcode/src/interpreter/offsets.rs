//! Coordinate systems and offsets: G54 to G59.3, G10, G28, G30, G52, G92. None of them moves the machine: each
//! recomputes the program position so that the machine point stays.

use super::{
    Out,
    state::{State, rotate},
};
use crate::block::Block;
use crate::error::{Error, ErrorKind};
use crate::modal::*;
use crate::parameters::{self, system_offset};
use crate::settings::Dialect;
use pkm_canon::{Canon, Position};
use pkm_kins::maths;

impl State {
    fn no_compensation(&self, block: &Block, group: GGroup, what: &'static str) -> Result<(), Error> {
        match self.modal.compensation {
            None => Ok(()),
            Some(_) => Err(block.g_error(group, ErrorKind::CcOn { what })),
        }
    }

    /// G54 to G59.3.
    pub(crate) fn coordinate_system(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let Some(code) = block.g(GGroup::System) else { return Ok(()) };
        self.no_compensation(block, GGroup::System, "another coordinate system")?;
        let system = match code {
            540..=590 => i32::from(code - 530) / 10,
            code => i32::from(code - 584),
        };
        if system == self.modal.system {
            out.emit(Canon::Comment("interpreter: continuing to use same coordinate system".into()));
            return Ok(());
        }
        self.parameters.set(parameters::SYSTEM, system.into());
        let g92 = self.g92;
        self.keep_machine_point(|state| {
            state.load_system(system);
            // The new position is read with G92 as LinuxCNC keeps it (checked with rs274 2.9).
            if state.settings.dialect != Dialect::Pkm {
                state.g92 = state.kept_g92();
            }
        });
        self.g92 = g92;
        out.emit(self.g5x_command());
        out.emit(self.g92_command());
        out.emit(Canon::SetXyRotation(self.rotation_deg));
        Ok(())
    }

    /// Changes offsets; the program position follows so that the machine stays where it is.
    pub(crate) fn keep_machine_point(&mut self, change: impl FnOnce(&mut Self)) {
        let machine = self.machine_point(self.position);
        change(self);
        self.position = self.program_point(machine);
    }

    /// G10 L2, L20 (coordinate systems); L0, L1, L10, L11 (tool table).
    pub(crate) fn set_data(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let fail = |kind| Err(block.g_error(GGroup::NonModal, kind));
        match block.get(b'L').map(|l| l as i32) {
            None => fail(ErrorKind::OffsetLMissing),
            Some(l @ (2 | 20)) => self.set_system(l, block, out),
            Some(l @ (0 | 1 | 10 | 11)) => self.set_tool_data(l, block, out),
            Some(l) => Err(block.word_error(b'L', ErrorKind::OffsetL { value: l.into() })),
        }
    }

    fn set_system(&mut self, l: i32, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let p = block.get(b'P').unwrap_or(-1.0);
        // LinuxCNC cuts the fraction off.
        let strict = self.settings.dialect == Dialect::Pkm;
        let system = if strict { maths::round(p) } else { maths::floor(p + 0.0001) };
        if (strict && (p - system).abs() > 0.0001) || !(0.0..=9.0).contains(&system) {
            return Err(block.word_error(b'P', ErrorKind::OffsetP { value: p, first: 0, last: 9 }));
        }
        let system = if system == 0.0 { self.modal.system } else { system as i32 };
        let refused: &[u8] = if l == 20 { b"IJR" } else { b"IJ" };
        if let Some(letter) = refused.iter().copied().find(|letter| block.has(*letter)) {
            return Err(block.word_error(letter, ErrorKind::OffsetWord { letter: letter.into(), l }));
        }
        if l == 20 {
            self.check_wrapped_words(block)?;
        }
        let active = system == self.modal.system;
        if active {
            self.no_compensation(block, GGroup::NonModal, "G10 of the active coordinate system")?;
        }
        let first = system_offset(system);
        let mut offset = self.program_units(self.parameters.nine(first));
        let rotation = match block.get(b'R') {
            Some(degrees) => degrees,
            None => self.parameters.get(first + 9),
        };
        match l {
            2 => {
                for (axis, offset) in offset.iter_mut().enumerate() {
                    *offset = block.axis(axis).unwrap_or(*offset);
                }
            }
            _ => self.offset_for_reading(block, rotation, &mut offset),
        }
        let kept = self.parameters.nine(first);
        let mut stored = self.machine_units(offset);
        let together = l == 20 && rotation != 0.0 && block.has_any(b"XY");
        for axis in 0..9 {
            if block.axis(axis).is_none() && !(axis < 2 && together) {
                stored[axis] = kept[axis];
            }
        }
        self.parameters.set_nine(first, &stored);
        self.parameters.set(first + 9, rotation);
        if active {
            let change = |state: &mut Self| {
                state.g5x = offset;
                state.rotation_deg = rotation;
            };
            if self.settings.dialect == Dialect::Pkm {
                self.keep_machine_point(change);
            } else {
                // LinuxCNC turns the position without its G92 offset: the machine point is lost if both are used.
                let g92 = core::mem::take(&mut self.g92);
                self.keep_machine_point(change);
                self.g92 = g92;
            }
            out.emit(self.g5x_command());
            out.emit(Canon::SetXyRotation(self.rotation_deg));
        } else {
            out.emit(Canon::Comment("interpreter: setting coordinate system origin".into()));
        }
        Ok(())
    }

    fn check_wrapped_words(&self, block: &Block) -> Result<(), Error> {
        (3..6).try_for_each(|axis| match block.axis(axis) {
            Some(value) => self.check_wrapped(axis, value, block),
            None => Ok(()),
        })
    }

    /// G10 L20: machine = R (p + g92) + offset + tool, with p as wanted; axes without a word keep their present
    /// reading in that system. In a turned system X and Y change together.
    fn offset_for_reading(&self, block: &Block, rotation_deg: f64, offset: &mut [f64; 9]) {
        let machine = self.machine_point(self.position);
        let without_tool: [f64; 9] = core::array::from_fn(|axis| machine[axis] - self.tool_offset[axis]);
        let g92 = if self.settings.dialect == Dialect::Pkm { self.g92 } else { self.kept_g92() };
        let mut reading: [f64; 9] = core::array::from_fn(|axis| without_tool[axis] - offset[axis]);
        rotate(&mut reading, -rotation_deg);
        for (axis, reading) in reading.iter_mut().enumerate() {
            if let Some(value) = block.axis(axis) {
                *reading = value + g92[axis];
            }
        }
        rotate(&mut reading, rotation_deg);
        let together = rotation_deg != 0.0 && block.has_any(b"XY");
        for axis in 0..9 {
            if block.axis(axis).is_some() || (axis < 2 && together) {
                offset[axis] = without_tool[axis] - reading[axis];
            }
        }
    }

    /// G28, G30: by the programmed point to the stored machine point.
    pub(crate) fn go_home(&mut self, code: GCode, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.no_compensation(block, GGroup::NonModal, "a move to the stored position")?;
        let by = self.end_point(block)?;
        self.turn_indexers(&by, out);
        self.position = by;
        out.emit(Canon::StraightTraverse(Position::from_array(by)));
        let first = if code == G28 { parameters::G28_HOME } else { parameters::G30_HOME };
        let mut home = self.program_units(self.parameters.nine(first));
        self.keep_rotary_tool_offset(&mut home);
        let mut home = self.program_point(home);
        for axis in 3..6 {
            if self.settings.wrapped_rotary[axis - 3] {
                home[axis] = super::motion::next_turn(home[axis], false, by[axis]);
            }
        }
        let all = !block.has_axis();
        let end = core::array::from_fn(
            |axis| {
                if all || block.axis(axis).is_some() { home[axis] } else { by[axis] }
            },
        );
        self.turn_indexers(&end, out);
        self.position = end;
        out.emit(Canon::StraightTraverse(Position::from_array(end)));
        Ok(())
    }

    /// LinuxCNC does not take the tool offset of A B C off machine coordinates (G28, G30, G53); pkm does.
    pub(crate) fn keep_rotary_tool_offset(&self, machine: &mut [f64; 9]) {
        if self.settings.dialect != Dialect::Pkm {
            let rotary = 3..6;
            for (coordinate, offset) in machine[rotary.clone()].iter_mut().zip(&self.tool_offset[rotary]) {
                *coordinate += offset;
            }
        }
    }

    /// G28.1, G30.1: stores the machine point.
    pub(crate) fn store_home(&mut self, code: GCode, block: &Block) -> Result<(), Error> {
        self.no_compensation(block, GGroup::NonModal, "storing the position")?;
        let first = if code == G28_1 { parameters::G28_HOME } else { parameters::G30_HOME };
        let mut machine = self.machine_units(self.machine_point(self.position));
        for (angle, _) in
            machine[3..6].iter_mut().zip(self.settings.wrapped_rotary).filter(|(_, wrapped)| *wrapped)
        {
            *angle -= 360.0 * maths::floor(*angle / 360.0);
        }
        self.parameters.set_nine(first, &machine);
        Ok(())
    }

    /// G52 and G92 as the parameters have them: LinuxCNC looks there in G10 and G54 to G59.3, also where a program has changed them since
    /// (checked with rs274 2.9).
    pub(crate) fn kept_g92(&self) -> [f64; 9] {
        match self.parameters.get(parameters::G92_APPLIED) {
            0.0 => [0.0; 9],
            _ => self.program_units(self.parameters.nine(parameters::G92_OFFSET)),
        }
    }

    fn store_g92(&mut self, applied: bool) {
        let stored = self.machine_units(self.g92);
        self.parameters.set_nine(parameters::G92_OFFSET, &stored);
        self.parameters.set(parameters::G92_APPLIED, applied.into());
    }

    /// G92: the present point reads the given values.
    pub(crate) fn g92_set(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.no_compensation(block, GGroup::NonModal, "G92")?;
        self.check_wrapped_words(block)?;
        for axis in 0..9 {
            if let Some(value) = block.axis(axis) {
                self.g92[axis] += self.position[axis] - value;
                self.position[axis] = value;
            }
        }
        self.store_g92(true);
        out.emit(self.g92_command());
        Ok(())
    }

    /// G52: a local offset; it shares its storage with G92.
    pub(crate) fn local_offset(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.no_compensation(block, GGroup::NonModal, "G52")?;
        self.check_wrapped_words(block)?;
        for axis in 0..9 {
            if let Some(value) = block.axis(axis) {
                self.position[axis] += self.g92[axis] - value;
                self.g92[axis] = value;
            }
        }
        self.store_g92(true);
        out.emit(self.g92_command());
        Ok(())
    }

    /// G92.1 (forgets the stored offset), G92.2 (keeps it).
    pub(crate) fn g92_cancel(&mut self, forget: bool, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.no_compensation(block, GGroup::G92, "G92.1 or G92.2")?;
        self.keep_machine_point(|state| state.g92 = [0.0; 9]);
        self.parameters.set(parameters::G92_APPLIED, 0.0);
        if forget {
            self.store_g92(false);
        }
        out.emit(self.g92_command());
        Ok(())
    }

    /// G92.3: the stored offset back.
    pub(crate) fn g92_restore(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.no_compensation(block, GGroup::G92, "G92.3")?;
        let stored = self.program_units(self.parameters.nine(parameters::G92_OFFSET));
        self.keep_machine_point(|state| state.g92 = stored);
        self.parameters.set(parameters::G92_APPLIED, 1.0);
        out.emit(self.g92_command());
        Ok(())
    }
}
