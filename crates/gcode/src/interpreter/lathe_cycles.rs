//! The lathe's finishing cycle G70 and its roughing cycles G71 to G72.2: a sub gives the profile, in the XZ plane.
//!
//! The sub is executed with its o-words and parameters, but of its blocks only the moves count, as the profile. At its
//! end the passes follow from the profile's height over the cutting direction (see `lathe_profile`).

use super::lathe_profile::{Height, Point, Segment, TINY, moved};
use super::{Interpreter, Out, state::State};
use crate::block::{Block, Reader};
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use crate::source::LineSource;
use alloc::boxed::Box;
use alloc::vec::Vec;
use pkm_canon::{CanonSink, Plane, Span};
use pkm_kins::{Axis, AxisSet, maths};

/// Most moves of a profile.
const MAX_MOVES: u16 = 1000;
/// Most layers, and most finishing passes.
const MAX_PASSES: u16 = 10_000;

/// Corner to be cut at the end of a move: `A` a fillet, `C` its chord.
#[derive(Debug, Clone, Copy)]
struct Corner {
    radius: f64,
    round: bool,
    letter: u8,
}

/// One move as written: `[z, x]`.
#[derive(Debug, Clone, Copy)]
struct Move {
    segment: Segment,
    corner: Option<Corner>,
    span: Span,
}

/// A cycle whose profile is being read.
#[derive(Debug, Clone)]
pub(super) struct Profile {
    /// The block of the cycle.
    block: Block,
    code: GCode,
    /// Calls that are open while the sub itself runs.
    depth: usize,
    /// Where the machine stands.
    position: [f64; 9],
    start: Point,
    moves: Vec<Move>,
    /// A block of the sub was wrong: nothing is cut.
    wrong: bool,
}

impl State {
    /// What can be wrong with the block of a cycle before its sub is read.
    pub(crate) fn check_lathe_cycle(&self, code: GCode, block: &Block) -> Result<(), Error> {
        let fail = |kind| Err(block.motion_error(kind));
        if self.modal.plane != Plane::Xz {
            return fail(ErrorKind::LathePlane { code: Code(code) });
        }
        if self.modal.incremental {
            return fail(ErrorKind::LatheIncremental { code: Code(code) });
        }
        if self.modal.compensation.is_some() && code != 700 {
            return fail(ErrorKind::CycleCc { code: Code(code) });
        }
        if let Some(letter) = b"YABC".iter().copied().find(|letter| block.has(*letter)) {
            return Err(block.word_error(letter, ErrorKind::LatheAxis { letter: letter.into() }));
        }
        if !block.has(b'Q') {
            return fail(ErrorKind::WordMissing { letter: 'Q', code: Code(code) });
        }
        let number = |letter: u8| block.get(letter).unwrap_or(0.0);
        for letter in *b"DERP" {
            if number(letter) < 0.0 {
                let kind = ErrorKind::NegativeWord { letter: letter.into(), value: number(letter) };
                return Err(block.word_error(letter, kind));
            }
        }
        if block.get(b'I').is_some_and(|depth| depth <= TINY) {
            return Err(block.word_error(b'I', ErrorKind::LatheDepth { value: number(b'I') }));
        }
        if let Some(passes) = block.get(b'P')
            && (passes != maths::floor(passes) || !(1.0..=f64::from(MAX_PASSES)).contains(&passes))
        {
            let kind = ErrorKind::LathePasses { value: passes };
            return Err(block.word_error(b'P', kind));
        }
        self.check_feed(code, block)
    }
}

impl Interpreter {
    /// After the block of a cycle: calls its sub.
    pub(super) fn begin_profile(&mut self, source: &mut dyn LineSource) -> Result<(), Error> {
        let Some(code @ (700 | 710..=712 | 720..=722)) = self.block.motion else { return Ok(()) };
        let block = self.block.bare();
        let position = self.state.position;
        let start = [block.get(b'Z').unwrap_or(position[2]), block.get(b'X').unwrap_or(position[0])];
        let depth = self.call_profile(source)?;
        self.state.position[2] = start[0];
        self.state.position[0] = start[1];
        let moves = Vec::new();
        self.lathe = Some(Box::new(Profile { block, code, depth, position, start, moves, wrong: false }));
        Ok(())
    }

    /// A and C are corners in a profile, U and W increments: whatever axes the machine has.
    pub(super) fn profile_reader<'a>(&self, reader: Reader<'a>) -> Reader<'a> {
        match self.lathe {
            Some(_) => Reader { axes: AxisSet::new(&Axis::ALL), ..reader },
            None => reader,
        }
    }

    /// A block of the sub: its move joins the profile.
    pub(super) fn take_profile_block(&mut self) -> Result<(), Error> {
        let Some(profile) = self.lathe.as_mut() else { return Ok(()) };
        let (block, state) = (&self.block, &mut self.state);
        let Some(code) = block.motion else { return Ok(()) };
        if !matches!(code, G0 | G1 | G2 | G3) {
            return Err(block.motion_error(ErrorKind::LatheMove { code: Code(code) }));
        }
        state.modal.motion = code;
        let from = [state.position[2], state.position[0]];
        let diameter = if state.modal.diameter { 0.5 } else { 1.0 };
        let coordinate = |present: f64, absolute: Option<f64>, increment: Option<f64>| {
            absolute.unwrap_or(present) + increment.unwrap_or(0.0)
        };
        let to = [
            coordinate(from[0], block.get(b'Z'), block.get(b'W')),
            coordinate(from[1], block.get(b'X'), block.get(b'U').map(|u| u * diameter)),
        ];
        if let Some(letter) = b"XZUW".iter().copied().find(|letter| {
            let limit = state.settings.largest_number();
            block.has(*letter) && to.iter().any(|c| c.abs() > limit)
        }) {
            let value = to[0].abs().max(to[1].abs());
            let kind = ErrorKind::NumberTooLarge { value, limit: state.settings.largest_number() };
            return Err(block.word_error(letter, kind));
        }
        if maths::hypot(to[0] - from[0], to[1] - from[1]) < TINY && !matches!(code, G2 | G3) {
            return Ok(());
        }
        let arc = match code {
            G2 | G3 => Some((state.profile_centre(code, from, to, block)?, code == G3)),
            _ => None,
        };
        let corner = |letter: u8, round| {
            let radius = block.get(letter)?;
            Some(Corner { radius, round, letter })
        };
        let corner = corner(b'A', true).or_else(|| corner(b'C', false));
        if block.has(b'A') && block.has(b'C') {
            return Err(block.word_error(b'C', ErrorKind::LatheCorner));
        }
        if let Some(Corner { radius, letter, .. }) = corner
            && radius <= 0.0
        {
            return Err(block.word_error(letter, ErrorKind::LatheCorner));
        }
        if profile.moves.len() >= MAX_MOVES.into() {
            return Err(block.motion_error(ErrorKind::LatheTooMany { limit: MAX_MOVES }));
        }
        let span = corner.map_or(block.span(), |corner| block.word_span(corner.letter));
        profile.moves.push(Move { segment: Segment { from, to, arc }, corner, span });
        (state.position[2], state.position[0]) = (to[0], to[1]);
        Ok(())
    }

    /// A block of the sub was wrong.
    pub(super) fn spoil_profile(&mut self) {
        if let Some(profile) = self.lathe.as_mut() {
            profile.wrong = true;
        }
    }

    /// Cuts, if the sub has returned.
    pub(super) fn end_profile(&mut self, sink: &mut dyn CanonSink) -> Result<(), Error> {
        if self.lathe.as_ref().is_none_or(|profile| self.calls_open() >= profile.depth) {
            return Ok(());
        }
        let Some(profile) = self.lathe.take() else { return Ok(()) };
        // What is wrong with the cycle is not wrong with the end of its sub.
        self.forget_o_word();
        self.state.position = profile.position;
        if profile.wrong {
            return Ok(());
        }
        let mut out = Out { sink, span: profile.block.span(), queue: &mut self.queue };
        self.state.cut_profile(&profile, &mut out)
    }
}

impl State {
    fn profile_centre(&mut self, code: GCode, from: Point, to: Point, block: &Block) -> Result<Point, Error> {
        if block.has(b'R') {
            if block.has_any(b"IJK") {
                return Err(block.word_error(b'R', ErrorKind::ArcMixed));
            }
            return self.centre_of_radius(code, block.get(b'R').unwrap_or(0.0), from, to, block);
        }
        if block.has(b'J') {
            return Err(block.word_error(b'J', ErrorKind::ArcWrongAxis { letter: 'J', plane: "XZ" }));
        }
        if !block.has_any(b"IK") {
            return Err(block.motion_error(ErrorKind::ArcNoCentre { code: Code(code) }));
        }
        let axes = super::arcs::PlaneAxes::of(Plane::Xz);
        self.centre_of_words(code, axes, from, to, block)
    }

    fn cut_profile(&mut self, profile: &Profile, out: &mut Out<'_>) -> Result<(), Error> {
        let Profile { block, code, start, .. } = profile;
        let fail = |kind| Err(block.motion_error(kind));
        // The first move leads to the profile.
        let moves = match profile.moves.split_first() {
            Some((first, rest)) if first.segment.arc.is_none() && !rest.is_empty() => rest,
            Some((first, rest)) if !rest.is_empty() => {
                return Err(Error { kind: ErrorKind::LatheFirst, span: first.span });
            }
            _ => return Err(block.word_error(b'Q', ErrorKind::LatheEmpty)),
        };
        let mut path = with_corners(moves)?;
        let roughs = *code != 700;
        if roughs {
            let shift = [block.get(b'W').unwrap_or(0.0), block.get(b'U').unwrap_or(0.0)];
            for Move { segment, .. } in &mut path {
                let by = |point: Point| [point[0] + shift[0], point[1] + shift[1]];
                segment.from = by(segment.from);
                segment.to = by(segment.to);
                segment.arc = segment.arc.map(|(centre, ccw)| (by(centre), ccw));
            }
        }
        let across = match code {
            700 => Frame::of(*start, &path, false).first_turn_back(&path).is_some(),
            code => *code >= 720,
        };
        let frame = Frame::of(*start, &path, across);
        if let Some(span) = frame.first_turn_back(&path) {
            let axis = if across { 'X' } else { 'Z' };
            let kind = match roughs {
                true => ErrorKind::LatheTurnsBack { axis },
                false => ErrorKind::LatheTurnsBackBoth,
            };
            return Err(Error { kind, span });
        }
        let segments: Vec<Segment> = path.iter().map(|part| frame.segment(part.segment)).collect();
        let start = frame.inner(*start);
        let (Some(first), Some(last)) = (segments.first(), segments.last()) else {
            return Err(block.word_error(b'Q', ErrorKind::LatheEmpty));
        };
        if frame.sides[0] == 0.0 || last.to[0] - first.from[0] < TINY {
            return fail(ErrorKind::LatheFlat { axis: if across { 'X' } else { 'Z' } });
        }
        if frame.sides[1] == 0.0 || (roughs && start[1] <= first.from[1] + TINY) {
            return fail(ErrorKind::LatheStart { code: Code(*code) });
        }
        let stock = block.get(b'D').unwrap_or(0.0);
        let absolute = core::mem::replace(&mut self.modal.arc_centre_absolute, true);
        let mut tool = Tool { state: self, block, out, frame, at: start, end: last.to };
        let done = match roughs {
            true => tool.rough(&segments, start, stock, *code % 10),
            false => tool.finish(&segments, start, stock),
        };
        self.modal.arc_centre_absolute = absolute;
        done
    }
}

/// Puts in the fillets and chamfers.
fn with_corners(moves: &[Move]) -> Result<Vec<Move>, Error> {
    let mut path: Vec<Move> = Vec::with_capacity(moves.len() * 2);
    let mut begin = None;
    for (index, &part) in moves.iter().enumerate() {
        let mut part = part;
        let fail = || Err(Error { kind: ErrorKind::LatheCorner, span: part.span });
        if let Some(begin) = begin.take() {
            part.segment.from = begin;
        }
        let Some(Corner { radius, round, .. }) = part.corner else {
            path.push(part);
            continue;
        };
        let Some(next) = moves.get(index + 1) else { return fail() };
        if part.segment.arc.is_some() || next.segment.arc.is_some() {
            return fail();
        }
        let corner = part.segment.to;
        let (into, away) = (direction(part.segment.from, corner), direction(corner, next.segment.to));
        let turn = maths::atan2(into[0] * away[1] - into[1] * away[0], into[0] * away[0] + into[1] * away[1]);
        let cut = radius * maths::tan(turn.abs() / 2.0);
        let length = |s: &Segment| maths::hypot(s.to[0] - s.from[0], s.to[1] - s.from[1]);
        if !cut.is_finite() || cut < TINY || cut > length(&part.segment) + TINY || cut > length(&next.segment)
        {
            return fail();
        }
        let (from, to) = (moved(corner, into, -cut), moved(corner, away, cut));
        part.segment.to = from;
        let side = if turn > 0.0 { radius } else { -radius };
        let arc = round.then(|| (moved(from, [-into[1], into[0]], side), turn > 0.0));
        path.push(part);
        path.push(Move { segment: Segment { from, to, arc }, corner: None, span: part.span });
        begin = Some(to);
    }
    path.retain(|part| part.segment.arc.is_some() || part.segment.normal(false) != [0.0; 2]);
    Ok(path)
}

fn direction(from: Point, to: Point) -> Point {
    let [dt, dv] = [to[0] - from[0], to[1] - from[1]];
    let length = maths::hypot(dt, dv);
    if length > 0.0 { [dt / length, dv / length] } else { [0.0; 2] }
}

/// From `[z, x]` to `[t, v]` and back: perhaps exchanged, perhaps mirrored.
#[derive(Debug, Clone, Copy)]
struct Frame {
    across: bool,
    /// 1 or -1; 0 where it cannot be told.
    sides: [f64; 2],
}

impl Frame {
    /// The frame in which the profile leads towards +t and the start lies above the chord of the profile.
    fn of(start: Point, path: &[Move], across: bool) -> Self {
        let mut frame = Self { across, sides: [1.0; 2] };
        let (Some(first), Some(last)) = (path.first(), path.last()) else { return frame };
        let [from, to, last, start] =
            [first.segment.from, last.segment.to, last.segment.from, start].map(|point| frame.inner(point));
        let sign = |x: f64| if x.abs() < TINY { 0.0 } else { x.signum() };
        frame.sides[0] = sign(to[0] - from[0]);
        // Above the chord to where the last move begins; above the first point where that says nothing.
        let chord = [last[0] - from[0], last[1] - from[1]];
        let above = chord[0] * (start[1] - from[1]) - chord[1] * (start[0] - from[0]);
        let side = sign(above) * frame.sides[0];
        frame.sides[1] = if side == 0.0 { sign(start[1] - from[1]) } else { side };
        frame
    }

    fn inner(&self, [z, x]: Point) -> Point {
        let [t, v] = if self.across { [x, z] } else { [z, x] };
        [t * self.sides[0], v * self.sides[1]]
    }

    fn outer(&self, [t, v]: Point) -> Point {
        let [t, v] = [t * self.sides[0], v * self.sides[1]];
        if self.across { [v, t] } else { [t, v] }
    }

    /// True if clockwise and counter-clockwise change places.
    fn mirrors(&self) -> bool {
        (self.sides[0] * self.sides[1] < 0.0) != self.across
    }

    fn segment(&self, segment: Segment) -> Segment {
        Segment {
            from: self.inner(segment.from),
            to: self.inner(segment.to),
            arc: segment.arc.map(|(centre, ccw)| (self.inner(centre), ccw != self.mirrors())),
        }
    }

    /// The first move that does not go on in the cutting direction.
    fn first_turn_back(&self, path: &[Move]) -> Option<Span> {
        path.iter().find(|part| !self.segment(part.segment).rises()).map(|part| part.span)
    }
}

/// A stretch of a layer, and where the tool comes down to it.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    enter: f64,
    from: f64,
    to: f64,
    v: f64,
    /// The tool stands where it may go straight to `enter`.
    next: bool,
}

/// Moves the tool: each is a block G0, G1, G2 or G3 of its own.
struct Tool<'a, 'b> {
    state: &'a mut State,
    block: &'a Block,
    out: &'a mut Out<'b>,
    frame: Frame,
    at: Point,
    /// Where the profile ends.
    end: Point,
}

impl Tool<'_, '_> {
    fn move_block(&mut self, to: Point) -> Block {
        let mut block = self.block.bare();
        let [z, x] = self.frame.outer(to);
        for letter in *b"XZIKQDEPRUW" {
            block.set(letter, None);
        }
        block.set(b'Z', Some(z));
        block.set(b'X', Some(x));
        self.at = to;
        block
    }

    fn rapid(&mut self, to: Point) -> Result<(), Error> {
        let block = self.move_block(to);
        self.state.straight(G0, &block, self.out)
    }

    fn feed(&mut self, to: Point) -> Result<(), Error> {
        if maths::hypot(to[0] - self.at[0], to[1] - self.at[1]) < TINY {
            return Ok(());
        }
        let block = self.move_block(to);
        self.state.straight(G1, &block, self.out)
    }

    fn arc(&mut self, to: Point, centre: Point, ccw: bool) -> Result<(), Error> {
        let radius = |point: Point| maths::hypot(point[0] - centre[0], point[1] - centre[1]);
        let smallest = 2.0 * self.state.radius_resolution();
        let chord = maths::hypot(to[0] - self.at[0], to[1] - self.at[1]);
        if radius(self.at).min(radius(to)) < smallest || chord < smallest {
            return self.feed(to);
        }
        let mut block = self.move_block(to);
        let [k, i] = self.frame.outer(centre);
        block.set(b'I', Some(i));
        block.set(b'K', Some(k));
        let code = if ccw != self.frame.mirrors() { G3 } else { G2 };
        self.state.arc(code, &block, self.out)
    }

    /// Along a height.
    fn follow(&mut self, height: &Height, from: f64, to: f64) -> Result<(), Error> {
        for piece in height.between(from, to) {
            self.feed(piece.begin())?;
            match piece.arc() {
                None => self.feed(piece.end())?,
                Some((centre, ccw)) => self.arc(piece.end(), centre, ccw)?,
            }
        }
        Ok(())
    }

    /// Back to the start above all that stays.
    fn home(&mut self, start: Point, clear: f64) -> Result<(), Error> {
        if self.at[1] < clear {
            self.rapid([self.at[0], clear])?;
        }
        if clear > start[1] {
            self.rapid([start[0], clear])?;
        }
        self.rapid(start)
    }

    /// G70: along the profile, at falling distances.
    fn finish(&mut self, segments: &[Segment], start: Point, from: f64) -> Result<(), Error> {
        let to = self.block.get(b'E').unwrap_or(0.0);
        let passes = self.block.get(b'P').unwrap_or(1.0);
        let mut left = passes;
        while left > 0.0 {
            left -= 1.0;
            let distance = to + (from - to) * left / passes;
            let (begin, end) = self.ends(segments, distance);
            let height = Height::of(segments, distance, begin[0], end[0]);
            self.rapid(start)?;
            self.rapid(begin)?;
            self.follow(&height, begin[0], end[0])?;
            self.feed(end)?;
            self.home(start, start[1].max(height.highest()))?;
        }
        Ok(())
    }

    /// Begin and end of the profile at a distance.
    fn ends(&self, segments: &[Segment], distance: f64) -> (Point, Point) {
        let begin = segments.first().map(|s| moved(s.from, s.normal(false), distance)).unwrap_or(self.at);
        let end = segments.last().map(|s| moved(s.to, s.normal(true), distance)).unwrap_or(self.end);
        (begin, end)
    }

    /// G71, G72: layers, then along what they leave; `variant` 0 = all, 1 = without pockets, 2 = only these.
    fn rough(&mut self, segments: &[Segment], start: Point, stock: f64, variant: i16) -> Result<(), Error> {
        let depth = self.block.get(b'I').unwrap_or(1.0);
        let retract = self.block.get(b'R').unwrap_or(0.5);
        let (begin, end) = self.ends(segments, stock);
        let from = start[0].min(begin[0]);
        let to = end[0].min(self.end[0]);
        let height = Height::of(segments, stock, from, to);
        let layers = (start[1] - height.lowest()) / depth;
        if layers.is_nan() || layers > f64::from(MAX_PASSES) {
            let kind = ErrorKind::LatheLayers { limit: MAX_PASSES };
            return Err(self.block.word_error(b'I', kind));
        }
        let (climb, pockets) = height.climb();
        self.rapid(start)?;
        if variant != 2 {
            let mut v = start[1];
            loop {
                v -= depth;
                let Some(&[a, b]) = climb.free(v, from, to).first() else { break };
                if a > from + TINY {
                    break;
                }
                self.rapid([from, v])?;
                self.feed([b, v])?;
                let back = retract.min((b - a) / 2.0);
                self.rapid([b - back, v + back])?;
                self.rapid([from, v + back])?;
            }
            self.follow_from_above(&climb, from, to, start[1])?;
            self.feed_out(end, to, start[1])?;
        }
        if variant != 1 {
            for pocket in pockets {
                let clear = start[1].max(pocket.rim + retract);
                let top = pocket.rim.min(start[1]);
                let mut stack: Vec<Stretch> = Vec::new();
                let push = |stack: &mut Vec<Stretch>, enter: f64, stretches: &[[f64; 2]], v: f64| {
                    // The leftmost comes first; the others are entered from the peak before them.
                    for (index, &[from, to]) in stretches.iter().enumerate().rev() {
                        let enter = match index.checked_sub(1).and_then(|before| stretches.get(before)) {
                            Some(before) => height.peak(before[1], from),
                            None => enter,
                        };
                        stack.push(Stretch { enter, from, to, v, next: index == 0 });
                    }
                };
                let v = top - depth;
                let over = height.free(top, pocket.from, pocket.to);
                for &[from, to] in over.iter().rev() {
                    let begin = stack.len();
                    push(&mut stack, from, &height.free(v, from, to), v);
                    stack[begin..].iter_mut().for_each(|stretch| stretch.next = false);
                }
                while let Some(stretch) = stack.pop() {
                    let Stretch { enter, from, to, v, next } = stretch;
                    if !next {
                        self.rapid([self.at[0], clear])?;
                        self.rapid([enter, clear])?;
                    }
                    self.follow_down(&height, enter, from, v)?;
                    self.feed([to, v])?;
                    let back = retract.min((to - from) / 2.0);
                    self.rapid([to - back, v + back])?;
                    self.rapid([from, v + back])?;
                    push(&mut stack, from, &height.free(v - depth, from, to), v - depth);
                }
                self.rapid([self.at[0], clear])?;
                self.rapid([pocket.from, clear])?;
                self.follow(&height, pocket.from, pocket.to)?;
                if pocket.to >= to - TINY {
                    self.feed_out(end, to, start[1])?;
                }
            }
        }
        let highest = height.highest();
        let clear = if highest > start[1] { highest + retract } else { start[1] };
        self.home(start, clear)
    }

    /// Comes down at feed and follows a height.
    fn follow_from_above(&mut self, height: &Height, from: f64, to: f64, above: f64) -> Result<(), Error> {
        if self.at[0] != from {
            self.rapid([from, above])?;
        }
        self.follow(height, from, to)
    }

    /// Down the flank of a pocket to the begin of a layer.
    fn follow_down(&mut self, height: &Height, enter: f64, from: f64, v: f64) -> Result<(), Error> {
        self.follow(height, enter, from)?;
        self.feed([from, v])
    }

    /// To the end of the profile, and out of the material.
    fn feed_out(&mut self, end: Point, to: f64, above: f64) -> Result<(), Error> {
        if (end[0] - to).abs() < TINY && end[1] > self.at[1] {
            self.feed(end)?;
        }
        self.feed([self.at[0], above.max(self.at[1])])
    }
}
