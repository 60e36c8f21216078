//! The fixed order in which the words of a block take effect (RS274/NGC table 8; dialect section 7).

use super::{Out, Status, state::State};
use crate::block::Block;
use crate::error::{Code, Error, ErrorKind};
use crate::line::Line;
use crate::modal::*;
use crate::settings::Dialect;
use pkm_canon::Canon;

impl State {
    /// Executes a complete block.
    pub(crate) fn execute(
        &mut self,
        block: &mut Block,
        line: &Line,
        out: &mut Out<'_>,
    ) -> Result<Status, Error> {
        self.comments(block, line, out)?;
        self.spindle_mode(block, out)?;
        self.feed_mode(block, out);
        self.feed_rate(block, out);
        self.spindle_speed(block, out);
        self.select_tool(block, out)?;
        let mut synch = self.input_output(block, out)?;
        synch |= self.change_tool(block, out)?;
        let replaced = self.spindle(block, out)?;
        if replaced && self.settings.dialect != Dialect::Pkm {
            // What M72 runs takes the block's place: the rest of it is lost (checked with rs274 2.9).
            return Ok(if synch { Status::Synch } else { Status::Running });
        }
        self.coolant(block, out);
        self.overrides(block, out)?;
        synch |= self.user_code(block, out)?;
        if block.g(GGroup::NonModal) == Some(G4) {
            out.emit(Canon::Dwell(block.get(b'P').unwrap_or(0.0)));
        }
        self.plane(block, out)?;
        self.units(block, out);
        self.lathe_mode(block, out);
        self.compensation(block, out)?;
        self.tool_length(block, out)?;
        self.coordinate_system(block, out)?;
        self.path_mode(block, out)?;
        self.distance_mode(block, out);
        self.arc_mode(block, out);
        self.retract_mode(block, out)?;
        self.non_modal(block, out)?;
        synch |= block.g(GGroup::NonModal) == Some(G10) && block.get(b'L') == Some(0.0);
        if block.motion.is_some() {
            synch |= self.motion(block, out)?;
        }
        if let Some(number) = block.m(MGroup::Stop) {
            if self.splines.is_open()
                && matches!(number, 2 | 30 | 99)
                && self.settings.dialect == Dialect::Pkm
            {
                return Err(block.m_error(MGroup::Stop, ErrorKind::NurbsDroppedM { number }));
            }
            self.finish_compensation(block, out)?;
            return Ok(if self.stop(number, out) {
                Status::Ended
            } else if synch {
                Status::Synch
            } else {
                Status::Running
            });
        }
        Ok(if synch { Status::Synch } else { Status::Running })
    }

    /// Group 10: the machine's own codes; no user programs. True if the machine is somewhere else afterwards.
    fn user_code(&mut self, block: &Block, out: &mut Out<'_>) -> Result<bool, Error> {
        let Some(number) = block.m(MGroup::User) else { return Ok(false) };
        let fail = |kind| Err(block.m_error(MGroup::User, kind));
        if !self.settings.machine_codes.contains(number) {
            return fail(ErrorKind::MUnsupported { number });
        }
        let goes = block.motion.is_some_and(|code| code != G80);
        let goes_home = matches!(block.g(GGroup::NonModal), Some(G28 | G30));
        if block.has_axis() || block.has_polar() || goes || goes_home {
            return fail(ErrorKind::AxisWithMachineCode { number });
        }
        if self.modal.compensation.is_some() {
            return fail(ErrorKind::CcOn { what: "a code of the machine's own" });
        }
        if self.splines.is_open() {
            return fail(ErrorKind::NurbsDroppedM { number });
        }
        self.splines.forget();
        self.cycle_memory.old = None;
        out.emit(Canon::MachineCode(number));
        Ok(true)
    }

    /// Groups 0 and 16: settings, offsets, home moves.
    fn non_modal(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        match block.g(GGroup::NonModal) {
            Some(G10) => self.set_data(block, out)?,
            Some(code @ (G28 | G30)) => self.go_home(code, block, out)?,
            Some(code @ (G28_1 | G30_1)) => self.store_home(code, block)?,
            Some(G52) => self.local_offset(block, out)?,
            Some(G92) => self.g92_set(block, out)?,
            _ => {}
        }
        match block.g(GGroup::G92) {
            Some(921) => self.g92_cancel(true, block, out),
            Some(922) => self.g92_cancel(false, block, out),
            Some(923) => self.g92_restore(block, out),
            _ => Ok(()),
        }
    }

    /// Group 1. True if the next block depends on what the machine did.
    fn motion(&mut self, block: &Block, out: &mut Out<'_>) -> Result<bool, Error> {
        let Some(code) = block.motion else { return Ok(false) };
        if !is_cycle(code) {
            self.cycle_memory.old = None;
        }
        if self.splines.is_open() && !self.splines.takes(code) && self.settings.dialect == Dialect::Pkm {
            return Err(block.motion_error(ErrorKind::NurbsDropped { code: Code(code) }));
        }
        if !matches!(code, G5 | G5_2 | G5_3 | G6) {
            self.splines.forget();
        }
        match code {
            G0 | G1 => self.straight(code, block, out)?,
            G2 | G3 => self.arc(code, block, out)?,
            G5 | G6 => self.cubic(code, block, out)?,
            G5_1 | G6_1 => self.quadratic(code, block, out)?,
            G5_2 => self.nurbs_point(block)?,
            G5_3 => self.nurbs_end(block, out)?,
            G6_2 => self.knot_point(block, out)?,
            G33 => self.synchronized(block, out)?,
            G33_1 => self.rigid_tap(block, out)?,
            G38_2..=G38_5 => {
                self.probe(code, block, out)?;
                return Ok(true);
            }
            G76 => self.thread(block, out)?,
            G80 => {
                out.emit(Canon::Comment("interpreter: motion mode set to none".into()));
                self.modal.motion = G80;
            }
            #[cfg(feature = "alloc")]
            700 | 710..=712 | 720..=722 => self.check_lathe_cycle(code, block)?,
            #[cfg(not(feature = "alloc"))]
            700 | 710..=712 | 720..=722 => return Err(block.motion_error(ErrorKind::ONoMemory)),
            code if is_cycle(code) => self.cycle(code, block, out)?,
            code => return Err(block.motion_error(ErrorKind::GUnsupported { code: Code(code) })),
        }
        Ok(false)
    }

    /// M0, M1, M2, M30, M60, M99. True if the program ends.
    fn stop(&mut self, number: i32, out: &mut Out<'_>) -> bool {
        match number {
            0 => out.emit(Canon::ProgramStop),
            1 => out.emit(Canon::OptionalProgramStop),
            60 => {
                out.emit(Canon::PalletShuttle);
                out.emit(Canon::ProgramStop);
            }
            _ => {
                self.end_program(number, out);
                return true;
            }
        }
        false
    }
}
