//! Straight moves: G0, G1, G53, polar words, inverse time.

use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use pkm_canon::{Canon, Plane, Position};
use pkm_kins::maths;

impl State {
    /// G0, G1.
    pub(crate) fn straight(&mut self, code: GCode, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        if code == G1 {
            self.check_feed(code, block)?;
        }
        self.modal.motion = code;
        let end = self.end_point(block)?;
        if code == G1 {
            self.inverse_time_rate(block, straight_length(&self.position, &end), out);
        }
        self.cutter.arc_refused = false;
        if let Some(side) = self.compensates() {
            if block.g(GGroup::NonModal) == Some(G53) {
                return Err(block.g_error(GGroup::NonModal, ErrorKind::CcOn { what: "G53" }));
            }
            return self.straight_compensated(code == G0, side, end, block, out);
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
    pub(crate) fn inverse_time_rate(&mut self, block: &Block, length: f64, out: &mut Out<'_>) {
        if self.modal.feed_mode == FeedMode::InverseTime
            && let Some(f) = block.get(b'F')
        {
            self.modal.feed = (length * f).max(0.1);
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
                *coordinate = if self.modal.incremental { *coordinate + value } else { value };
            }
        }
        Ok(end)
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
        if self.modal.plane != Plane::Xy {
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
