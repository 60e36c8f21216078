//! Modes: feed, spindle, coolant, overrides, inputs and outputs, plane, units, path, distance, retract.

use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Error, ErrorKind};
use crate::modal::*;
use crate::parameters;
use crate::settings::Dialect;
use pkm_canon::{Canon, Direction, InputWait, LengthUnit, MotionControlMode, Plane};
use pkm_kins::maths;

impl State {
    /// The spindles a block means: `$n`, all for `$-1`, `otherwise` without `$`.
    pub(crate) fn spindles_of(&self, block: &Block, otherwise: i32) -> core::ops::Range<i32> {
        let last = i32::from(self.settings.spindles.min(8));
        match block.get(b'$').map_or(otherwise, |n| n as i32) {
            -1 => 0..last,
            n => n.min(last - 1)..(n + 1).min(last),
        }
    }

    /// 2.9 refuses spindles that there are: M51 the first and "all", M19 "all" (checked with rs274 2.9).
    fn refuse_spindle_word(&self, refused: impl Fn(f64) -> bool, block: &Block) -> Result<(), Error> {
        match block.get(b'$') {
            Some(value) if refused(value) => {
                let last = self.settings.spindles.saturating_sub(1);
                Err(block.word_error(b'$', ErrorKind::SpindleNumber { value, last }))
            }
            _ => Ok(()),
        }
    }

    fn spindle_at(&mut self, n: i32) -> &mut Spindle {
        &mut self.modal.spindles[(n & 7) as usize]
    }

    /// G96, G97.
    pub(crate) fn spindle_mode(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        match block.g(GGroup::Spindle) {
            Some(G96) => {
                if !block.has(b'S') && !block.speed_follows {
                    return Err(block.g_error(GGroup::Spindle, ErrorKind::SpindleMissingS));
                }
                let limit = block.get(b'D').map_or(1e30, f64::abs);
                for spindle in self.spindles_of(block, 0) {
                    self.spindle_at(spindle).surface_speed = Some(limit);
                    out.emit(Canon::SetSpindleMode { spindle, css_limit: limit });
                }
            }
            Some(_) => {
                for spindle in self.spindles_of(block, 0) {
                    self.spindle_at(spindle).surface_speed = None;
                    out.emit(Canon::SetSpindleMode { spindle, css_limit: 0.0 });
                }
            }
            None => {}
        }
        Ok(())
    }

    /// G93, G94, G95: G94 and G95 set F to 0.
    pub(crate) fn feed_mode(&mut self, block: &Block, out: &mut Out<'_>) {
        let (mode, text) = match block.g(GGroup::FeedMode) {
            None => return,
            Some(930) => (FeedMode::InverseTime, "interpreter: feed mode set to inverse time"),
            Some(940) => (FeedMode::PerMinute, "interpreter: feed mode set to units per minute"),
            Some(_) => (FeedMode::PerTurn, "interpreter: feed mode set to units per revolution"),
        };
        out.remark(text);
        self.modal.feed_mode = mode;
        let per_turn = mode == FeedMode::PerTurn;
        let spindle = if per_turn { block.get(b'$').map_or(0, |n| n as i32) } else { 0 };
        out.emit(Canon::SetFeedMode { spindle, mode: per_turn.into() });
        if mode != FeedMode::InverseTime {
            if self.modal.feed != 0.0 {
                self.feed_unset = Some(block.g_span(GGroup::FeedMode));
            }
            self.modal.feed = 0.0;
            out.emit(Canon::SetFeedRate(0.0));
        }
    }

    /// F; in inverse time it belongs to the move.
    pub(crate) fn feed_rate(&mut self, block: &Block, out: &mut Out<'_>) {
        if let Some(feed) = block.get(b'F')
            && self.modal.feed_mode != FeedMode::InverseTime
        {
            (self.modal.feed, self.feed_unset) = (feed, None);
            out.emit(Canon::SetFeedRate(feed));
        }
    }

    /// S.
    pub(crate) fn spindle_speed(&mut self, block: &Block, out: &mut Out<'_>) {
        if let Some(speed) = block.get(b'S') {
            for spindle in self.spindles_of(block, 0) {
                self.spindle_at(spindle).speed = speed;
                out.emit(Canon::SetSpindleSpeed { spindle, speed });
            }
        }
    }

    /// M3, M4, M5, M19, M70 to M73. True if M72 has run other blocks.
    pub(crate) fn spindle(&mut self, block: &Block, out: &mut Out<'_>) -> Result<bool, Error> {
        match block.m(MGroup::Spindle) {
            Some(number @ (3 | 4)) => {
                let direction = if number == 3 { Direction::Clockwise } else { Direction::Counterclockwise };
                for spindle in self.spindles_of(block, 0) {
                    self.spindle_at(spindle).turning = Some(direction);
                    out.emit(Canon::StartSpindle { spindle, direction });
                }
            }
            Some(5) => {
                let otherwise = if self.settings.dialect == Dialect::LinuxCnc29 { 0 } else { -1 };
                for spindle in self.spindles_of(block, otherwise) {
                    self.spindle_at(spindle).turning = None;
                    out.emit(Canon::StopSpindle { spindle });
                }
            }
            Some(19) => self.orient(block, out)?,
            Some(number) => return self.save_or_restore(number, block, out),
            None => {}
        }
        Ok(false)
    }

    /// M19 R P Q: orient to R degrees, P 0 shortest way 1 clockwise 2 counter-clockwise, wait at most Q seconds.
    fn orient(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let (angle, way, timeout) = (block.get(b'R'), block.get(b'P'), block.get(b'Q'));
        let mode = way.unwrap_or(0.0) as i32;
        if self.settings.dialect == Dialect::LinuxCnc29 {
            self.refuse_spindle_word(|n| n < 0.0, block)?;
        }
        for spindle in self.spindles_of(block, 0) {
            if angle.is_some() || way.is_some() {
                self.spindle_at(spindle).turning = None;
                out.emit(Canon::OrientSpindle {
                    spindle,
                    angle: angle.unwrap_or(0.0) + self.settings.orient_offset_deg,
                    mode,
                });
            }
            if let Some(timeout) = timeout {
                if timeout <= 0.0 {
                    let kind = ErrorKind::OrientRange { letter: 'Q', value: timeout };
                    return Err(block.word_error(b'Q', kind));
                }
                out.emit(Canon::WaitOrientComplete { spindle, timeout });
            }
        }
        Ok(())
    }

    /// M7, M8, M9.
    pub(crate) fn coolant(&mut self, block: &Block, out: &mut Out<'_>) {
        let Some(code) = block.m(MGroup::Coolant) else { return };
        let both = code == MIST_AND_FLOOD.into();
        if code == 7 || both {
            self.modal.mist = true;
            out.emit(Canon::Mist(true));
        }
        if code == 8 || both {
            self.modal.flood = true;
            out.emit(Canon::Flood(true));
        }
        if code == 9 {
            (self.modal.mist, self.modal.flood) = (false, false);
            out.emit(Canon::Mist(false));
            out.emit(Canon::Flood(false));
        }
    }

    /// M48 to M53.
    pub(crate) fn overrides(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let Some(number) = block.m(MGroup::Override) else { return Ok(()) };
        if self.modal.compensation.is_some() {
            return Err(block.m_error(MGroup::Override, ErrorKind::CcOn { what: "an override switch" }));
        }
        let on = block.get(b'P').is_none_or(|p| p != 0.0);
        if let Some(p) = block.get(b'P')
            && p < 0.0
        {
            return Err(block.word_error(b'P', ErrorKind::NegativeWord { letter: 'P', value: p }));
        }
        match number {
            48 | 49 => {
                self.set_feed_override(number == 48, out);
                for spindle in self.spindles_of(block, -1) {
                    self.set_speed_override(spindle, number == 48, out);
                }
            }
            50 => self.set_feed_override(on, out),
            51 => {
                if self.settings.dialect == Dialect::LinuxCnc29 {
                    self.refuse_spindle_word(|n| n <= 0.0, block)?;
                }
                let otherwise = if self.settings.is_newer() { 0 } else { -1 };
                for spindle in self.spindles_of(block, otherwise) {
                    self.set_speed_override(spindle, on, out);
                }
            }
            52 => {
                self.modal.adaptive_feed = on;
                out.emit(Canon::AdaptiveFeed(on));
            }
            _ => {
                self.modal.feed_hold = on;
                out.emit(Canon::FeedHold(on));
            }
        }
        Ok(())
    }

    pub(crate) fn set_feed_override(&mut self, on: bool, out: &mut Out<'_>) {
        self.modal.feed_override = on;
        out.emit(Canon::FeedOverride(on));
    }

    pub(crate) fn set_speed_override(&mut self, spindle: i32, on: bool, out: &mut Out<'_>) {
        self.spindle_at(spindle).speed_override = on;
        out.emit(Canon::SpeedOverride { spindle, on });
    }

    /// M62 to M68. True if an input is read.
    pub(crate) fn input_output(&mut self, block: &Block, out: &mut Out<'_>) -> Result<bool, Error> {
        let Some(number) = block.m(MGroup::Io) else { return Ok(false) };
        if self.modal.compensation.is_some() {
            return Err(block.m_error(MGroup::Io, ErrorKind::CcOn { what: "an input or output" }));
        }
        let index = |letter: u8| match block.get(letter) {
            Some(value) if (0.0..1e6).contains(&value) => Ok(maths::round(value) as i32),
            // LinuxCNC leaves the range to the machine.
            Some(value) if self.settings.dialect != Dialect::Pkm => Ok(maths::round(value) as i32),
            value => {
                let kind = ErrorKind::IoRange { number, letter: letter.into(), value: value.unwrap_or(-1.0) };
                Err(block.word_error(letter, kind))
            }
        };
        match number {
            62 | 63 => out.emit(Canon::MotionOutputBit { index: index(b'P')?, on: number == 62 }),
            64 | 65 => out.emit(Canon::AuxOutputBit { index: index(b'P')?, on: number == 64 }),
            67 => {
                let value = block.get(b'Q').unwrap_or(-1.0);
                out.emit(Canon::MotionOutputValue { index: index(b'E')?, value });
            }
            68 => {
                let value = block.get(b'Q').unwrap_or(-1.0);
                out.emit(Canon::AuxOutputValue { index: index(b'E')?, value });
            }
            _ => {
                self.wait_input(block, out)?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// M66 P or E [L Q].
    fn wait_input(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let fail = |letter: u8, kind| Err(block.word_error(letter, kind));
        let range = |letter: char, value| ErrorKind::IoRange { number: 66, letter, value };
        let (digital, analog) = (block.get(b'P'), block.get(b'E'));
        let (index, is_analog) = match (digital, analog) {
            (Some(p), None) => (p, false),
            (None, Some(e)) => (e, true),
            (Some(_), Some(e)) => return fail(b'E', range('E', e)),
            (None, None) => {
                let kind = ErrorKind::IoMissing { number: 66, letter: 'P' };
                return Err(block.m_error(MGroup::Io, kind));
            }
        };
        let letter = if is_analog { b'E' } else { b'P' };
        if !(0.0..1e6).contains(&index) {
            return fail(letter, range(letter.into(), index));
        }
        let l = block.get(b'L').unwrap_or(0.0);
        let wait = match l as i32 {
            0 => InputWait::Immediate,
            1 => InputWait::Rise,
            2 => InputWait::Fall,
            3 => InputWait::High,
            4 => InputWait::Low,
            _ => return fail(b'L', range('L', l)),
        };
        if is_analog && wait != InputWait::Immediate {
            return fail(b'L', range('L', l));
        }
        let timeout = block.get(b'Q').unwrap_or(0.0);
        if timeout < 0.0 || (wait != InputWait::Immediate && timeout <= 0.0) {
            return fail(b'Q', ErrorKind::IoTimeout);
        }
        out.emit(Canon::WaitInput { index: maths::round(index) as i32, analog: is_analog, wait, timeout });
        // Without a machine's answer a digital input reads as it was, anything but 0 becoming 1.
        if !is_analog && self.parameters.get(parameters::INPUT) != 0.0 {
            self.parameters.set(parameters::INPUT, 1.0);
        }
        Ok(())
    }

    /// G17, G18, G19 and their UVW partners.
    pub(crate) fn plane(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let Some(code) = block.g(GGroup::Plane) else { return Ok(()) };
        if self.modal.compensation.is_some() {
            return Err(block.g_error(GGroup::Plane, ErrorKind::CcOn { what: "another plane" }));
        }
        self.modal.plane = match code {
            170 => Plane::Xy,
            180 => Plane::Xz,
            190 => Plane::Yz,
            171 => Plane::Uv,
            181 => Plane::Uw,
            _ => Plane::Vw,
        };
        out.emit(Canon::SelectPlane(self.modal.plane));
        Ok(())
    }

    /// G20, G21.
    pub(crate) fn units(&mut self, block: &Block, out: &mut Out<'_>) {
        let units = match block.g(GGroup::Units) {
            None => return,
            Some(200) => LengthUnit::Inch,
            Some(_) => LengthUnit::Mm,
        };
        out.emit(Canon::UseLengthUnits(units));
        let factor = self.modal.units.mm() / units.mm();
        self.convert_units(units);
        if factor != 1.0 && self.modal.compensation.is_some() {
            self.convert_compensation(factor, out);
        }
    }

    /// G7, G8: X words are diameters or radii, those of the switching block too.
    pub(crate) fn lathe_mode(&mut self, block: &mut Block, out: &mut Out<'_>) {
        let diameter = match block.g(GGroup::Lathe) {
            None => return,
            Some(code) => code == 70,
        };
        if diameter == self.modal.diameter {
            return;
        }
        self.modal.diameter = diameter;
        if block.has(b'X') {
            block.scale(b'X', if diameter { 0.5 } else { 2.0 });
        }
        out.remark(if diameter {
            "interpreter: Lathe diameter mode changed to diameter"
        } else {
            "interpreter: Lathe diameter mode changed to radius"
        });
    }

    /// G40 to G42.1.
    pub(crate) fn compensation(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        match block.g(GGroup::Compensation) {
            None => Ok(()),
            Some(400) => self.compensation_off(block, out),
            Some(code) => self.compensation_on(code, block, out),
        }
    }

    /// G61, G61.1, G64 [P] [Q].
    pub(crate) fn path_mode(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let Some(code) = block.g(GGroup::Path) else { return Ok(()) };
        if self.modal.compensation.is_some() {
            return Err(block.g_error(GGroup::Path, ErrorKind::CcOn { what: "another path mode" }));
        }
        let newer = self.settings.is_newer();
        self.modal.path = match code {
            610 => MotionControlMode::ExactPath,
            611 => MotionControlMode::ExactStop,
            _ => {
                let default = if newer { self.settings.g64_tolerance } else { 0.0 };
                MotionControlMode::Continuous { tolerance: block.get(b'P').unwrap_or(default) }
            }
        };
        if newer
            && code == G64
            && let Some(r) = block.get(b'R')
        {
            // R 0 or less asks for trapezoidal profiles, else for S curves, so aggressive in corners.
            let (kind, peak_scale) = if r <= 0.0 { (0, 1.0) } else { (1, r.clamp(0.1, 1.0)) };
            out.emit(Canon::SetPlannerMode { kind, peak_scale });
        }
        out.emit(Canon::SetMotionControlMode(self.modal.path));
        if let MotionControlMode::Continuous { tolerance } = self.modal.path {
            let default = match (newer, block.has(b'P')) {
                (true, false) => self.settings.g64_naivecam_tolerance,
                _ => tolerance,
            };
            self.modal.naivecam_tolerance = block.get(b'Q').unwrap_or(default);
            out.emit(Canon::SetNaivecamTolerance(self.modal.naivecam_tolerance));
        }
        Ok(())
    }

    /// G90, G91.
    pub(crate) fn distance_mode(&mut self, block: &Block, out: &mut Out<'_>) {
        let Some(code) = block.g(GGroup::Distance) else { return };
        let incremental = code == 910;
        if incremental != self.modal.incremental {
            out.remark(if incremental {
                "interpreter: distance mode changed to incremental"
            } else {
                "interpreter: distance mode changed to absolute"
            });
            self.modal.incremental = incremental;
        }
    }

    /// G90.1, G91.1.
    pub(crate) fn arc_mode(&mut self, block: &Block, out: &mut Out<'_>) {
        let Some(code) = block.g(GGroup::ArcCentre) else { return };
        let absolute = code == 901;
        if absolute != self.modal.arc_centre_absolute {
            out.remark(if absolute {
                "interpreter: IJK distance mode changed to absolute"
            } else {
                "interpreter: IJK distance mode changed to incremental"
            });
            self.modal.arc_centre_absolute = absolute;
        }
    }

    /// G98, G99.
    pub(crate) fn retract_mode(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let Some(code) = block.g(GGroup::Retract) else { return Ok(()) };
        if self.modal.compensation.is_some() {
            return Err(block.g_error(GGroup::Retract, ErrorKind::CcOn { what: "another retract mode" }));
        }
        self.modal.retract_to_old = code == 980;
        out.remark(if self.modal.retract_to_old {
            "interpreter: retract mode set to old_z"
        } else {
            "interpreter: retract mode set to r_plane"
        });
        Ok(())
    }
}
