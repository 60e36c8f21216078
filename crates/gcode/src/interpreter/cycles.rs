//! Canned cycles G73, G74, G81 to G89 (RS274/NGC 3.5.16): holes along the normal axis of the plane.

use super::arcs::PlaneAxes;
use super::{Out, state::State};
use crate::block::{AXIS_LETTERS, Block};
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use crate::settings::Dialect;
use pkm_canon::{Canon, Direction, LengthUnit, MotionControlMode, Plane, Position};

/// Words that stay while the same cycle stays active.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CycleMemory {
    r: f64,
    depth: f64,
    p: f64,
    q: f64,
    ijk: [f64; 3],
    /// Height before the first of an unbroken run of cycles.
    pub(crate) old: Option<f64>,
}

/// One cycle with its words, in program coordinates.
#[derive(Debug, Clone, Copy)]
struct Cycle {
    code: GCode,
    axes: PlaneAxes,
    r: f64,
    bottom: f64,
    clear: f64,
    p: f64,
    q: f64,
    ijk: [f64; 3],
    /// How far G73 and G83 back off.
    clearance: f64,
    /// The spindle turns as the cycle needs it.
    spindle_ready: bool,
}

/// Moves of a cycle: a hole position in the plane and heights along the normal axis.
struct Hole<'a, 'b> {
    out: &'a mut Out<'b>,
    /// Where the tool is; the coordinates that a cycle does not move stay.
    position: &'a mut [f64; 9],
    axes: PlaneAxes,
    at: [f64; 2],
}

impl Hole<'_, '_> {
    fn point(&mut self, [first, second]: [f64; 2], height: f64) -> Position {
        self.position[self.axes.first] = first;
        self.position[self.axes.second] = second;
        self.position[self.axes.normal] = height;
        Position::from_array(*self.position)
    }

    fn traverse(&mut self, height: f64) {
        self.traverse_beside(self.at, height);
    }

    fn traverse_beside(&mut self, at: [f64; 2], height: f64) {
        let point = self.point(at, height);
        self.out.emit(Canon::StraightTraverse(point));
    }

    fn feed(&mut self, height: f64) {
        let point = self.point(self.at, height);
        self.out.emit(Canon::StraightFeed(point));
    }

    fn emit(&mut self, command: Canon<'_>) {
        self.out.emit(command);
    }
}

impl State {
    /// A cycle at one or several holes.
    pub(crate) fn cycle(&mut self, code: GCode, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let fail = |kind| Err(block.motion_error(kind));
        if self.modal.feed == 0.0 {
            return fail(ErrorKind::FeedZero { code: Code(code) });
        }
        if self.modal.feed_mode == FeedMode::InverseTime {
            return fail(ErrorKind::CycleG93 { code: Code(code) });
        }
        if self.modal.compensation.is_some() {
            return fail(ErrorKind::CycleCc { code: Code(code) });
        }
        let axes = PlaneAxes::of(self.modal.plane);
        let again = self.modal.motion == code;
        let depth_word = block.axis(axes.normal);
        if depth_word.is_none() && !again {
            let letter = AXIS_LETTERS[axes.normal].into();
            return fail(ErrorKind::CycleDepth { code: Code(code), letter });
        }
        let others: &[u8] = if axes.normal < 3 { b"UVW" } else { b"XYZ" };
        if let Some(letter) = others.iter().copied().find(|letter| block.has(*letter)) {
            return Err(block.word_error(letter, ErrorKind::CycleUvw));
        }
        if !block.has(b'R') && !again {
            return fail(ErrorKind::CycleR { code: Code(code) });
        }
        if block.get(b'L') == Some(0.0) {
            return Err(block.word_error(b'L', ErrorKind::CycleL0));
        }
        let memory = self.cycle_memory;
        let r_word = block.get(b'R').unwrap_or(memory.r);
        let depth_word = depth_word.unwrap_or(memory.depth);
        let present = self.position[axes.normal];
        let mut old = memory.old.unwrap_or(present);
        let (r, bottom) = match self.modal.incremental {
            false => (r_word, depth_word),
            true => (r_word + old, depth_word + r_word + old),
        };
        if r < bottom {
            let kind = ErrorKind::CycleRBelow { r, depth: bottom };
            return Err(block.word_error(b'R', kind));
        }
        self.cycle_memory.r = r_word;
        self.cycle_memory.depth = depth_word;
        self.cycle_memory.old = Some(old);
        let rises = old < r;
        if rises {
            self.position[axes.normal] = r;
            out.emit(Canon::StraightTraverse(Position::from_array(self.position)));
            old = r;
        }
        let clear = if self.modal.retract_to_old { old } else { r };
        let path = self.modal.path;
        if path != MotionControlMode::ExactPath {
            out.emit(Canon::SetMotionControlMode(MotionControlMode::ExactPath));
        }
        let cycle = self.cycle_words(code, axes, [r, bottom, clear], again, block)?;
        let repeats = block.get(b'L').map_or(1, |l| l as i64);
        // After a switch to G98 the tool rises to the old height first.
        let mut height = self.position[axes.normal].max(clear);
        for _ in 0..repeats {
            // In G91 each repeat goes on from the last hole; polar words turn on.
            let next = self.end_point(block)?;
            let at = [next[axes.first], next[axes.second]];
            let mut hole = Hole { out: &mut *out, position: &mut self.position, axes, at };
            hole.traverse(height);
            if height != r {
                hole.traverse(r);
            }
            if !cycle.spindle_ready {
                return fail(ErrorKind::SpindleNotTurning { code: Code(code) });
            }
            drill(&cycle, &mut self.modal, &self.settings, &mut hole);
            height = clear;
        }
        self.position[axes.normal] = clear;
        if path != MotionControlMode::ExactPath {
            out.emit(Canon::SetMotionControlMode(path));
            out.emit(Canon::SetNaivecamTolerance(self.modal.naivecam_tolerance));
        }
        self.modal.motion = code;
        Ok(())
    }

    /// The words of the cycle itself; what stays from the last block of the same cycle is filled in.
    fn cycle_words(
        &mut self,
        code: GCode,
        axes: PlaneAxes,
        [r, bottom, clear]: [f64; 3],
        again: bool,
        block: &Block,
    ) -> Result<Cycle, Error> {
        let fail = |kind| Err(block.motion_error(kind));
        let memory = &mut self.cycle_memory;
        if matches!(code, G82 | G86 | G88 | G89) {
            match block.get(b'P') {
                None if !again => return fail(ErrorKind::CycleP { code: Code(code) }),
                p => memory.p = p.unwrap_or(memory.p),
            }
        } else if matches!(code, G74 | G84) {
            // LinuxCNC keeps the dwell of the last cycle here.
            memory.p = block.get(b'P').unwrap_or(memory.p);
        }
        if matches!(code, G73 | G83) {
            match block.get(b'Q') {
                None if !again => return fail(ErrorKind::CycleQ { code: Code(code) }),
                Some(q) if q <= 0.0 => {
                    return Err(block.word_error(b'Q', ErrorKind::CycleQ { code: Code(code) }));
                }
                q => memory.q = q.unwrap_or(memory.q),
            }
        }
        if code == G87 {
            for (letter, place) in b"IJK".iter().zip(0..) {
                match block.get(*letter) {
                    None if !again => return fail(ErrorKind::CycleIjk { code: Code(code) }),
                    value => memory.ijk[place] = value.unwrap_or(memory.ijk[place]),
                }
            }
        }
        let turning = self.modal.spindles[0].turning;
        let spindle_ready = match code {
            G84 => turning == Some(Direction::Clockwise),
            G74 => turning == Some(Direction::Counterclockwise),
            G86 | G87 | G88 => turning.is_some(),
            _ => true,
        };
        let CycleMemory { p, q, ijk, .. } = *memory;
        let clearance = self.peck_clearance(code, block);
        Ok(Cycle { code, axes, r, bottom, clear, p, q, ijk, clearance, spindle_ready })
    }
}

impl State {
    /// How far G73 and G83 back off: fixed in 2.9, else the D word or what the machine says.
    fn peck_clearance(&self, code: GCode, block: &Block) -> f64 {
        let inch = self.modal.units == LengthUnit::Inch;
        if !self.settings.is_newer() {
            return if inch { 0.010 } else { 0.254 };
        }
        let set = if code == G73 { self.settings.g73_clearance } else { self.settings.g83_clearance };
        block.get(b'D').or(set).unwrap_or(if inch { 0.05 } else { 1.0 })
    }
}

/// One hole; the tool is above it at R.
fn drill(cycle: &Cycle, modal: &mut Modal, settings: &crate::Settings, hole: &mut Hole<'_, '_>) {
    let Cycle { code, r, bottom, clear, p, q, .. } = *cycle;
    let spindle = 0;
    let direction = modal.spindles[0].turning.unwrap_or(Direction::Clockwise);
    let start = Canon::StartSpindle { spindle, direction };
    let stop = Canon::StopSpindle { spindle };
    match code {
        G73 | G83 => {
            let clearance = cycle.clearance;
            let mut depth = r - q;
            while depth > bottom {
                hole.feed(depth);
                if code == G83 {
                    hole.traverse(r);
                }
                hole.traverse(depth + clearance);
                depth -= q;
            }
            hole.feed(bottom);
            hole.traverse(clear);
        }
        G74 | G84 => tap(cycle, modal, settings, hole, direction),
        850 => {
            hole.feed(bottom);
            hole.feed(r);
            hole.traverse(clear);
        }
        G86 => {
            hole.feed(bottom);
            hole.emit(Canon::Dwell(p));
            hole.emit(stop);
            hole.traverse(clear);
            hole.emit(start);
        }
        G87 => back_bore(cycle, hole, direction),
        G88 => {
            hole.feed(bottom);
            hole.emit(Canon::Dwell(p));
            hole.emit(stop);
            hole.emit(Canon::ProgramStop);
            hole.emit(start);
        }
        G89 => {
            hole.feed(bottom);
            hole.emit(Canon::Dwell(p));
            hole.feed(clear);
        }
        G82 => {
            hole.feed(bottom);
            hole.emit(Canon::Dwell(p));
            hole.traverse(clear);
        }
        _ => {
            hole.feed(bottom);
            hole.traverse(clear);
        }
    }
}

const fn reverse(direction: Direction) -> Direction {
    match direction {
        Direction::Clockwise => Direction::Counterclockwise,
        Direction::Counterclockwise => Direction::Clockwise,
    }
}

/// G84, G74: in with the spindle turning, out with it reversed. LinuxCNC permutes the axes of the two feeds twice
/// in G18 and G19, which is a crash on a real machine; pkm's own dialect does it right.
fn tap(
    cycle: &Cycle,
    modal: &Modal,
    settings: &crate::Settings,
    hole: &mut Hole<'_, '_>,
    direction: Direction,
) {
    let spindle = 0;
    let permuted = settings.dialect != Dialect::Pkm && !matches!(modal.plane, Plane::Xy | Plane::Uv);
    let feed = |hole: &mut Hole<'_, '_>, height: f64| {
        if !permuted {
            return hole.feed(height);
        }
        let Hole { at, axes, .. } = *hole;
        let mut point = *hole.position;
        match modal.plane {
            // Depth to X, first to Y, second to Z.
            Plane::Xz | Plane::Uw => {
                (point[axes.second], point[axes.normal], point[axes.first]) = (height, at[0], at[1]);
            }
            // Depth to Y, second to X, first to Z.
            _ => (point[axes.first], point[axes.normal], point[axes.second]) = (height, at[1], at[0]),
        }
        hole.emit(Canon::StraightFeed(Position::from_array(point)));
    };
    hole.emit(Canon::FeedOverride(false));
    hole.emit(Canon::SpeedOverride { spindle, on: false });
    feed(hole, cycle.bottom);
    hole.emit(Canon::StopSpindle { spindle });
    hole.emit(Canon::StartSpindle { spindle, direction: reverse(direction) });
    hole.emit(Canon::Dwell(cycle.p));
    feed(hole, cycle.clear);
    hole.emit(Canon::StopSpindle { spindle });
    hole.emit(Canon::StartSpindle { spindle, direction });
    if modal.feed_override {
        hole.emit(Canon::FeedOverride(true));
    }
    if modal.spindles[0].speed_override {
        hole.emit(Canon::SpeedOverride { spindle, on: true });
    }
}

/// G87: bores from below: through the hole beside its axis, up to K, and back.
fn back_bore(cycle: &Cycle, hole: &mut Hole<'_, '_>, direction: Direction) {
    let spindle = 0;
    let Cycle { axes, r, bottom, clear, ijk, .. } = *cycle;
    let word = |letter: u8| ijk[usize::from(letter - b'I')];
    let beside = [hole.at[0] + word(axes.first_centre), hole.at[1] + word(axes.second_centre)];
    let top = word(axes.normal_centre);
    // The canon's own code of the direction: 2 clockwise, 3 counter-clockwise.
    let mode = if direction == Direction::Clockwise { 2 } else { 3 };
    hole.traverse_beside(beside, r);
    hole.emit(Canon::StopSpindle { spindle });
    hole.emit(Canon::OrientSpindle { spindle, angle: 0.0, mode });
    hole.traverse_beside(beside, bottom);
    hole.traverse(bottom);
    hole.emit(Canon::StartSpindle { spindle, direction });
    hole.feed(top);
    hole.feed(bottom);
    hole.emit(Canon::StopSpindle { spindle });
    hole.emit(Canon::OrientSpindle { spindle, angle: 0.0, mode });
    hole.traverse_beside(beside, bottom);
    hole.traverse_beside(beside, clear);
    hole.traverse(clear);
    hole.emit(Canon::StartSpindle { spindle, direction });
}
