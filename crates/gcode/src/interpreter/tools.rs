//! Tools: T, M6, M61, tool length offsets (G43, G43.1, G43.2, G49), tool table settings (G10 L1, L10, L11).

use super::{
    Out,
    state::{State, rotate},
};
use crate::block::Block;
use crate::error::{Error, ErrorKind};
use crate::modal::*;
use crate::settings::Dialect;
use pkm_canon::{Canon, Position, Tool};
use pkm_kins::maths;

impl State {
    /// T.
    pub(crate) fn select_tool(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let Some(number) = block.get(b'T').map(|t| t as i32) else { return Ok(()) };
        let slot = self.tools.slot(number);
        let Some(slot) = slot else {
            return Err(block.word_error(b'T', ErrorKind::ToolUnknown { number }));
        };
        self.modal.selected_slot = slot;
        self.modal.selected_tool = number;
        out.emit(Canon::SelectTool(number));
        Ok(())
    }

    /// M6, M61. True if the tool changes.
    pub(crate) fn change_tool(&mut self, block: &Block, out: &mut Out<'_>) -> Result<bool, Error> {
        match block.m(MGroup::Tool) {
            Some(6) => {
                if self.modal.compensation.is_some() {
                    return Err(block.m_error(MGroup::Tool, ErrorKind::CcOn { what: "a tool change" }));
                }
                if self.modal.selected_slot < 0 && self.settings.dialect == Dialect::Pkm {
                    return Err(block.m_error(MGroup::Tool, ErrorKind::ToolNotSelected));
                }
                if self.settings.dialect == Dialect::LinuxCnc29 {
                    out.emit(Canon::StartChange);
                }
                if !self.settings.tool_change_with_spindle_on {
                    for spindle in 0..self.settings.spindles.min(8) {
                        self.modal.spindles[usize::from(spindle)].turning = None;
                        out.emit(Canon::StopSpindle { spindle: spindle.into() });
                    }
                }
                self.move_to_tool_change(out);
                let (slot, tool) = (self.modal.selected_slot.max(0), self.modal.selected_tool);
                out.emit(Canon::ChangeTool { slot, tool });
                self.take_tool(slot);
                if self.settings.retain_g43 && self.modal.follows_tool {
                    let loaded = match self.settings.exchanges_tools() {
                        true => self.tools.get(0).filter(|tool| tool.number > 0),
                        false => self.tools.get(slot).filter(|_| slot > 0),
                    };
                    self.modal.follows_tool = loaded.is_some();
                    let offset = loaded.copied().unwrap_or_default().offset;
                    let offset = self.program_units(offset.to_array());
                    self.keep_machine_point(|state| state.tool_offset = offset);
                    out.emit(Canon::UseToolLengthOffset(Position::from_array(offset)));
                }
                Ok(true)
            }
            Some(number @ 61) => {
                let Some(q) = block.get(b'Q') else {
                    let kind = ErrorKind::WordMissingM { letter: 'Q', number };
                    return Err(block.m_error(MGroup::Tool, kind));
                };
                let tool = maths::round(q);
                if (q - tool).abs() > 0.0001 {
                    return Err(block.word_error(b'Q', ErrorKind::NotInteger { value: q }));
                }
                let tool = tool as i32;
                let slot = if tool < 0 { None } else { self.tools.slot(tool) };
                let Some(slot) = slot else {
                    return Err(block.word_error(b'Q', ErrorKind::ToolUnknown { number: tool }));
                };
                out.emit(Canon::ChangeToolNumber { slot, tool });
                // rs274's stays as it was (checked with rs274 2.9).
                if self.settings.imitates_rs274 && !self.settings.exchanges_tools() {
                    self.spindle_is_read_back();
                    self.loaded_slot = slot;
                } else {
                    self.take_tool(slot);
                }
                Ok(true)
            }
            _ => Ok(false),
        }
    }

    /// The tool of a slot goes into the spindle; a random tool changer puts the one that was there into its pocket.
    fn take_tool(&mut self, slot: i32) {
        if self.settings.exchanges_tools() {
            self.tools.load_spindle(slot);
            self.loaded_slot = 0;
            // It is there now: another M6 changes nothing.
            self.modal.selected_slot = 0;
            return;
        }
        self.spindle_is_read_back();
        // rs274 copies the slot to slot 0: with T0 the tool stays (checked with rs274 2.9).
        if !(slot == 0 && self.settings.imitates_rs274) {
            self.tools.load_spindle(slot);
        }
        self.loaded_slot = slot;
    }

    /// The machine that rs274 simulates kept the pocket of its spindle when G10 wrote a row there (checked with rs274 2.9).
    fn spindle_is_read_back(&mut self) {
        if let Some(pocket) = self.spindle_pocket.take()
            && let Some(spindle) = self.tools.get_mut(0)
        {
            spindle.pocket = pocket;
        }
    }

    /// What a random tool changer needs before the first block.
    pub(crate) fn prepare_random_changer(&mut self) -> Result<(), ErrorKind> {
        if self.settings.exchanges_tools() {
            self.loaded_slot = 0;
            return self.tools.arrange_by_pocket();
        }
        // rs274 begins without a tool, not even tool 0 (checked with rs274 2.9).
        if let Some(spindle) = self.tools.get_mut(0) {
            spindle.number = -1;
        }
        Ok(())
    }

    /// The pocket of a slot as the program sees it.
    pub(crate) fn pocket_of(&self, slot: i32) -> f64 {
        let slot = if self.settings.imitates_rs274 { slot.max(0) } else { slot };
        let pocket = match self.tools.get(slot) {
            _ if self.settings.random_toolchanger => slot.max(0),
            _ if slot < 0 => -1,
            // rs274's spindle is a row with a pocket, which its tool came from, or -1 (checked with rs274 2.9).
            _ if slot == 0 && !self.settings.imitates_rs274 => 0,
            Some(tool) => tool.pocket,
            None => slot,
        };
        pocket.into()
    }

    /// The tool of a number word; 0 is the tool in the spindle.
    pub(crate) fn tool_of(&self, block: &Block, letter: u8, number: i32) -> Result<Tool, Error> {
        let slot = match self.tools.slot(number) {
            // With a random tool changer rs274 takes H0 for the slot it has loaded (checked with rs274 2.9).
            Some(0)
                if letter == b'H' && self.settings.random_toolchanger && !self.settings.exchanges_tools() =>
            {
                Some(self.loaded_slot)
            }
            slot => slot,
        };
        slot.and_then(|slot| self.tools.get(slot))
            .copied()
            .ok_or_else(|| block.word_error(letter, ErrorKind::ToolUnknown { number }))
    }

    /// G43, G43.1, G43.2, G49.
    pub(crate) fn tool_length(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let Some(code) = block.g(GGroup::ToolLength) else { return Ok(()) };
        if self.modal.compensation.is_some() {
            return Err(block.g_error(GGroup::ToolLength, ErrorKind::CcOn { what: "a tool length offset" }));
        }
        let named = |present: [f64; 9]| -> [f64; 9] {
            core::array::from_fn(|axis| block.axis(axis).unwrap_or(present[axis]))
        };
        let tool_row = |state: &Self| -> Result<[f64; 9], Error> {
            let tool = match block.get(b'H') {
                Some(number) => state.tool_of(block, b'H', number as i32)?,
                // The tool in the spindle; in the block that changes it, the new one.
                None => {
                    let slot = if block.m(MGroup::Tool).is_some() { state.loaded_slot } else { 0 };
                    state.tools.get(slot).copied().unwrap_or_default()
                }
            };
            Ok(state.program_units(tool.offset.to_array()))
        };
        let offset = match code {
            G43 => tool_row(self)?,
            G43_1 => named(self.tool_offset),
            G43_2 => {
                let words = block.has_axis();
                if words && self.settings.dialect == Dialect::LinuxCnc29 {
                    // 2.9 looks the tool of the missing H word up (checked with rs274 2.9).
                    let number = block.get(b'H').map_or(-1, |h| h as i32);
                    self.tool_of(block, b'H', number)?;
                }
                if block.has(b'H') == words {
                    let kind = ErrorKind::WordMissing { letter: 'H', code: crate::error::Code(code) };
                    return Err(block.g_error(GGroup::ToolLength, kind));
                }
                let added = if words { named([0.0; 9]) } else { tool_row(self)? };
                core::array::from_fn(|axis| self.tool_offset[axis] + added[axis])
            }
            _ => [0.0; 9],
        };
        self.modal.follows_tool = code == G43;
        self.keep_machine_point(|state| state.tool_offset = offset);
        out.emit(Canon::UseToolLengthOffset(Position::from_array(offset)));
        Ok(())
    }

    /// The moves that a machine makes before it changes the tool: Z to machine zero, then to the G30 position.
    fn move_to_tool_change(&mut self, out: &mut Out<'_>) {
        let mut go = |state: &mut Self, machine: [f64; 9], only_z: bool| {
            let target = state.program_point(machine);
            out.remark("AXIS,hide");
            match only_z {
                true => state.position[2] = target[2],
                false => {
                    state.turn_indexers(&target, out);
                    state.position = target;
                }
            }
            out.emit(Canon::StraightTraverse(Position::from_array(state.position)));
            out.remark("AXIS,show");
        };
        if self.settings.tool_change_quill_up {
            go(self, [0.0; 9], true);
        }
        if self.settings.tool_change_at_g30 {
            let mut home = self.program_units(self.parameters.nine(crate::parameters::G30_HOME));
            self.keep_rotary_tool_offset(&mut home);
            go(self, home, false);
        }
    }

    /// G10 L0, L1, L10, L11.
    pub(crate) fn set_tool_data(&mut self, l: i32, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        if l == 0 {
            if self.tools.get(0).is_some_and(|tool| tool.number > 0) {
                return Err(block.g_error(GGroup::NonModal, ErrorKind::ToolLoaded));
            }
            self.spindle_is_read_back();
            out.emit(Canon::ReloadTooldata);
            return Ok(());
        }
        if !block.has_axis() && !block.has_any(b"RIJQ") {
            let code = crate::error::Code(G10);
            return Err(block.g_error(GGroup::NonModal, ErrorKind::OffsetEmpty { code }));
        }
        let p = block.get(b'P').unwrap_or(-1.0);
        let number = maths::round(p);
        let range = ErrorKind::OffsetP { value: p, first: 1, last: i32::MAX };
        if (p - number).abs() > 0.0001 || number < 1.0 {
            return Err(block.word_error(b'P', range));
        }
        let number = number as i32;
        let Some(slot) = self.tools.slot(number) else {
            return Err(block.word_error(b'P', ErrorKind::ToolUnknown { number }));
        };
        let Some(mut tool) = self.tools.get(slot).copied() else {
            return Err(block.word_error(b'P', ErrorKind::ToolUnknown { number }));
        };
        self.change_tool_row(l, &mut tool, block)?;
        if let Some(row) = self.tools.get_mut(slot) {
            *row = tool;
        }
        out.emit(Canon::SetToolTableEntry { slot, tool: &tool });
        if slot == self.loaded_slot && !self.settings.random_toolchanger {
            let pocket = self.tools.get(0).map(|spindle| spindle.pocket);
            self.spindle_pocket = self.spindle_pocket.or(pocket);
            self.tools.load_spindle(slot);
            out.emit(Canon::SetToolTableEntry { slot: 0, tool: &tool });
        }
        Ok(())
    }

    /// The words of G10 L1, L10, L11 into a row.
    fn change_tool_row(&self, l: i32, tool: &mut Tool, block: &Block) -> Result<(), Error> {
        let mut offset = tool.offset.to_array();
        let values: [Option<f64>; 9] = match l {
            1 => core::array::from_fn(|axis| block.axis(axis)),
            _ => self.tool_offset_for_reading(l, &offset, block),
        };
        for axis in 0..9 {
            if let Some(value) = values[axis] {
                offset[axis] = if super::state::is_length(axis) {
                    self.settings.machine_length(value, self.modal.units)
                } else {
                    value
                };
            }
        }
        tool.offset = Position::from_array(offset);
        if let Some(radius) = block.get(b'R') {
            tool.diameter = self.settings.machine_length(radius, self.modal.units) * 2.0;
        }
        if let Some(angle) = block.get(b'I') {
            tool.front_angle = angle;
        }
        if let Some(angle) = block.get(b'J') {
            tool.back_angle = angle;
        }
        if let Some(q) = block.get(b'Q') {
            let orientation = maths::round(q);
            if (q - orientation).abs() > 0.0001 || !(0.0..=9.0).contains(&orientation) {
                return Err(block.word_error(b'Q', ErrorKind::CcTool { value: q }));
            }
            tool.orientation = orientation as i32;
        }
        Ok(())
    }

    /// L10: the tool offset with which the present point reads the given values in the active system; L11: in
    /// G59.3, without G92. Axes without a word keep their part of the present offset *along the system's axes*, so
    /// in a turned system X and Y change together.
    fn tool_offset_for_reading(&self, l: i32, present: &[f64; 9], block: &Block) -> [Option<f64>; 9] {
        let number = if l == 10 { self.modal.system } else { 9 };
        let first = crate::parameters::system_offset(number);
        let (system, rotation, g92) = if l == 10 && self.settings.dialect == Dialect::Pkm {
            (self.g5x, self.rotation_deg, self.g92)
        } else {
            // LinuxCNC takes the parameters, also where a program has changed them since (checked with rs274 2.9).
            let system = self.program_units(self.parameters.nine(first));
            let g92 = if l == 10 { self.kept_g92() } else { [0.0; 9] };
            (system, self.parameters.get(first + 9), g92)
        };
        let machine = self.machine_point(self.position);
        let mut reading: [f64; 9] = core::array::from_fn(|axis| machine[axis] - system[axis]);
        rotate(&mut reading, -rotation);
        let mut offset = self.program_units(*present);
        rotate(&mut offset, -rotation);
        for (axis, offset) in offset.iter_mut().enumerate() {
            if let Some(value) = block.axis(axis) {
                *offset = reading[axis] - g92[axis] - value;
            }
        }
        rotate(&mut offset, rotation);
        let together = rotation != 0.0 && block.has_any(b"XY");
        core::array::from_fn(|axis| {
            (block.axis(axis).is_some() || (axis < 2 && together)).then_some(offset[axis])
        })
    }
}
