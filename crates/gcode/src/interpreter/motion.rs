//! Straight moves: G0, G1, G53, polar words, inverse time.

use super::{Out, state::State};
use crate::block::{AXIS_LETTERS, Block};
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use crate::settings::Dialect;
use pkm_canon::{Canon, MotionControlMode, Plane, Position};
use pkm_kins::maths;

impl State {
    /// G0, G1.
    pub(crate) fn straight(&mut self, code: GCode, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        if code == G1 {
            self.check_feed(code, block)?;
        }
        let before = self.modal.motion;
        self.modal.motion = code;
        let end = self.end_point(block)?;
        if code == G1 {
            self.inverse_time_rate(block, |state| straight_length(&state.position, &end), out);
        }
        self.cutter.arc_refused = false;
        if let Some(side) = self.compensates() {
            if block.g(GGroup::NonModal) == Some(G53) {
                return Err(block.g_error(GGroup::NonModal, ErrorKind::CcOn { what: "G53" }));
            }
            return self.straight_compensated(code == G0, side, end, block, out);
        }
        if self.indexer(code, &end, block)?.is_some() {
            // Not a motion that axis words alone go on with (checked with rs274 2.9).
            if self.settings.dialect != Dialect::Pkm {
                self.modal.motion = before;
            }
            self.turn_indexers(&end, out);
            return Ok(());
        }
        self.position = end;
        let end = Position::from_array(end);
        out.emit(if code == G0 { Canon::StraightTraverse(end) } else { Canon::StraightFeed(end) });
        Ok(())
    }

    /// A feed move needs a feed.
    pub(crate) fn check_feed(&self, code: GCode, block: &Block) -> Result<(), Error> {
        let code = Code(code);
        let fail = |kind| Err(block.motion_error(kind));
        match self.modal.feed_mode {
            FeedMode::PerMinute | FeedMode::PerTurn if self.modal.feed == 0.0 => {
                fail(ErrorKind::FeedZero { code })
            }
            FeedMode::PerTurn if self.modal.spindles[0].speed == 0.0 => {
                fail(ErrorKind::SpindleZeroG95 { code })
            }
            FeedMode::InverseTime if !block.has(b'F') => fail(ErrorKind::FeedMissingG93 { code }),
            _ => Ok(()),
        }
    }

    /// G93: F moves per minute; the canon wants units per minute.
    pub(crate) fn inverse_time_rate(
        &mut self,
        block: &Block,
        length: impl FnOnce(&Self) -> f64,
        out: &mut Out<'_>,
    ) {
        if self.modal.feed_mode == FeedMode::InverseTime
            && let Some(f) = block.get(b'F')
        {
            self.modal.feed = (length(self) * f).max(0.1);
            out.emit(Canon::SetFeedRate(self.modal.feed));
        }
    }

    /// Where a block's axis words lead to, in program coordinates.
    pub(crate) fn end_point(&self, block: &Block) -> Result<[f64; 9], Error> {
        if block.g(GGroup::NonModal) == Some(G53) {
            return self.machine_end_point(block);
        }
        let mut end = self.position;
        if block.has_polar() {
            [end[0], end[1]] = self.polar_end(block)?;
        }
        for (axis, coordinate) in end.iter_mut().enumerate() {
            if let Some(value) = block.axis(axis) {
                *coordinate = match self.modal.incremental {
                    true => *coordinate + value,
                    false => self.unwrapped(axis, value, *coordinate, block)?,
                };
            }
        }
        Ok(end)
    }

    /// Where an absolute word of a wrapped rotary axis leads: its size is the position within a turn, its sign the
    /// direction (checked with rs274 2.9).
    fn unwrapped(&self, axis: usize, value: f64, present: f64, block: &Block) -> Result<f64, Error> {
        if !(3..6).contains(&axis) || !self.settings.wrapped_rotary[axis - 3] {
            return Ok(value);
        }
        self.check_wrapped(axis, value, block)?;
        Ok(next_turn(value.abs(), value.is_sign_negative(), present))
    }

    /// A word of a wrapped rotary axis is less than a turn.
    pub(crate) fn check_wrapped(&self, axis: usize, value: f64, block: &Block) -> Result<(), Error> {
        if (3..6).contains(&axis) && self.settings.wrapped_rotary[axis - 3] && value.abs() >= 360.0 {
            let letter = AXIS_LETTERS[axis];
            return Err(block.word_error(letter, ErrorKind::WrappedRange { letter: letter.into(), value }));
        }
        Ok(())
    }

    /// A locking indexer moves alone, by G0. `None` = no indexer moves.
    fn indexer(&self, code: GCode, end: &[f64; 9], block: &Block) -> Result<Option<usize>, Error> {
        let moves = |axis: usize| end[axis] != self.position[axis];
        let Some(axis) = (3..6).find(|axis| self.settings.locking_indexer[axis - 3] && moves(*axis)) else {
            return Ok(None);
        };
        let letter = AXIS_LETTERS[axis];
        if code != G0 {
            return Err(block.word_error(letter, ErrorKind::IndexerFeed { letter: letter.into() }));
        }
        if (0..9).any(|other| other != axis && moves(other)) {
            return Err(block.word_error(letter, ErrorKind::IndexerAlone { letter: letter.into() }));
        }
        Ok(Some(axis))
    }

    /// Brings every locking indexer to where `end` has it, one after the other, in exact path.
    pub(crate) fn turn_indexers(&mut self, end: &[f64; 9], out: &mut Out<'_>) {
        for (axis, &angle) in end.iter().enumerate().skip(3).take(3) {
            if !self.settings.locking_indexer[axis - 3] || self.position[axis] == angle {
                continue;
            }
            let path = self.modal.path;
            if path != MotionControlMode::ExactPath {
                out.emit(Canon::SetMotionControlMode(MotionControlMode::ExactPath));
            }
            self.position[axis] = angle;
            out.emit(Canon::StraightTraverse(Position::from_array(self.position)));
            if path != MotionControlMode::ExactPath {
                out.emit(Canon::SetMotionControlMode(path));
                out.emit(Canon::SetNaivecamTolerance(self.modal.naivecam_tolerance));
            }
        }
    }

    /// No feed moves an indexer.
    pub(crate) fn no_indexer(&self, end: &[f64; 9], block: &Block) -> Result<(), Error> {
        self.indexer(G1, end, block).map(|_| ())
    }

    /// G53: the words are machine coordinates; other axes stay. For A B C the tool offset is *not* taken off
    /// (LinuxCNC), except under pkm's own dialect.
    fn machine_end_point(&self, block: &Block) -> Result<[f64; 9], Error> {
        if let Some(letter) = b"@^".iter().copied().find(|letter| block.has(*letter)) {
            return Err(block.word_error(letter, ErrorKind::PolarMixed { letter: 'G' }));
        }
        let mut machine = self.machine_point(self.position);
        for (axis, coordinate) in machine.iter_mut().enumerate() {
            if let Some(value) = block.axis(axis) {
                *coordinate = value;
            }
        }
        self.keep_rotary_tool_offset(&mut machine);
        let mut end = self.program_point(machine);
        for (axis, angle) in end.iter_mut().enumerate().skip(3).take(3) {
            if let Some(value) = block.axis(axis)
                && self.settings.wrapped_rotary[axis - 3]
            {
                self.check_wrapped(axis, value, block)?;
                // LinuxCNC drops the sign of the program coordinate (checked with rs274 2.9).
                let degrees = match self.settings.dialect {
                    Dialect::Pkm => value.abs() - (value - *angle),
                    _ => angle.abs(),
                };
                *angle = next_turn(degrees, value.is_sign_negative(), self.position[axis]);
            }
        }
        // What was not named stays, bit for bit; X and Y are one where the system is turned.
        for (axis, coordinate) in end.iter_mut().enumerate() {
            let turned = axis < 2 && self.rotation_deg != 0.0 && block.has_any(b"XY");
            if block.axis(axis).is_none() && !turned {
                *coordinate = self.position[axis];
            }
        }
        Ok(end)
    }

    /// `@radius ^angle` from the program origin; one given keeps the other of the present point.
    fn polar_end(&self, block: &Block) -> Result<[f64; 2], Error> {
        if self.modal.plane != Plane::Xy && self.settings.dialect == Dialect::Pkm {
            return Err(block.word_error(first_polar(block), ErrorKind::PolarPlane));
        }
        if let Some(letter) = b"XY".iter().copied().find(|letter| block.has(*letter)) {
            return Err(block.word_error(letter, ErrorKind::PolarMixed { letter: letter.into() }));
        }
        let [x, y, ..] = self.position;
        let (present_radius, present_angle) = (maths::hypot(x, y), maths::atan2(y, x));
        let (radius, angle) = (block.get(b'@'), block.get(b'^').map(maths::radians));
        if (angle.is_none() || self.modal.incremental) && x == 0.0 && y == 0.0 {
            return Err(block.word_error(b'@', ErrorKind::PolarOrigin));
        }
        let (radius, angle) = if self.modal.incremental {
            (present_radius + radius.unwrap_or(0.0), present_angle + angle.unwrap_or(0.0))
        } else {
            (radius.unwrap_or(present_radius), angle.unwrap_or(present_angle))
        };
        Ok([radius * maths::cos(angle), radius * maths::sin(angle)])
    }
}

/// The next angle that is `degrees` within its turn, from `present` in the direction of the sign.
pub(crate) fn next_turn(degrees: f64, backwards: bool, present: f64) -> f64 {
    let turns = maths::floor((present - degrees) / 360.0);
    let below = degrees + 360.0 * turns;
    if backwards || below == present { below } else { below + 360.0 }
}

fn first_polar(block: &Block) -> u8 {
    if block.has(b'@') { b'@' } else { b'^' }
}

/// Length that inverse time counts: of X Y Z, if zero of U V W, if zero of A B C.
fn straight_length(from: &[f64; 9], to: &[f64; 9]) -> f64 {
    let length = |axes: [usize; 3]| {
        let [a, b, c] = axes.map(|axis| to[axis] - from[axis]);
        maths::sqrt(a * a + b * b + c * c)
    };
    [[0, 1, 2], [6, 7, 8], [3, 4, 5]].map(length).into_iter().find(|l| *l != 0.0).unwrap_or(0.0)
}
