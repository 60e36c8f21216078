//! Cutter radius compensation, G40 to G42.1 (dialect section 11).
//!
//! The tool centre runs beside the programmed path. A move waits until the next one says where the two offset paths
//! meet: around an outside corner goes an arc about the programmed corner, at an inside corner both moves end where
//! their offsets cut. `State::position` is the programmed point, `Compensation::tool` the tool's.

use super::arcs::{PlaneAxes, sweep};
use super::queue::Move;
use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use crate::settings::Dialect;
use pkm_canon::{LengthUnit, Plane};
use pkm_kins::maths;

/// A corner flatter than this (rad) is none.
const SMALL: f64 = 0.05;
const QUARTER: f64 = maths::PI / 2.0;

/// A point in the plane.
type Point = [f64; 2];

/// Cutter compensation that is on.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Compensation {
    pub(crate) radius: f64,
    orientation: i32,
    /// The entry move has not come yet.
    first: bool,
    /// The tool centre in the plane.
    tool: Point,
    /// Where the waiting move begins, if LinuxCNC knows it: not of an entry arc, nor after a stop.
    begin: Option<Point>,
    /// G40 was the last: no arc may follow.
    pub(crate) arc_refused: bool,
}

fn distance(a: Point, b: Point) -> f64 {
    maths::hypot(a[0] - b[0], a[1] - b[1])
}

/// The direction from `a` to `b`.
fn heading(a: Point, b: Point) -> f64 {
    maths::atan2(b[1] - a[1], b[0] - a[0])
}

/// So far from a point in a direction.
fn beside(point: Point, angle: f64, distance: f64) -> Point {
    [point[0] + distance * maths::cos(angle), point[1] + distance * maths::sin(angle)]
}

/// True if the tool runs inside an arc of that turning sense.
fn inside(side: Side, turns: i32) -> bool {
    matches!((side, turns > 0), (Side::Left, true) | (Side::Right, false))
}

impl State {
    /// True if moves are to be offset.
    pub(crate) fn compensates(&self) -> Option<Side> {
        self.modal.compensation.filter(|_| self.cutter.radius > 0.0)
    }

    /// G41, G42 [D tool]; G41.1, G42.1 D diameter [L orientation].
    pub(crate) fn compensation_on(
        &mut self,
        code: GCode,
        block: &Block,
        out: &mut Out<'_>,
    ) -> Result<(), Error> {
        let fail = |kind| Err(block.g_error(GGroup::Compensation, kind));
        if !matches!(self.modal.plane, Plane::Xy | Plane::Xz) {
            return fail(ErrorKind::CcPlane);
        }
        if self.modal.compensation.is_some() {
            return fail(ErrorKind::CcAlready);
        }
        let (diameter, orientation) = match (code, block.get(b'D')) {
            (411 | 421, None) => return fail(ErrorKind::WordMissing { letter: 'D', code: Code(code) }),
            (411 | 421, Some(diameter)) => {
                let orientation = block.get(b'L').unwrap_or(0.0);
                if block.has(b'L') && self.modal.plane != Plane::Xz {
                    return Err(block.word_error(b'L', ErrorKind::CcTool { value: orientation }));
                }
                (diameter, orientation as i32)
            }
            (_, word) => {
                let number = word.unwrap_or(0.0);
                if number != maths::floor(number) {
                    return Err(block.word_error(b'D', ErrorKind::NotInteger { value: number }));
                }
                let tool = self.tool_of(block, b'D', number as i32)?;
                (self.settings.program_length(tool.diameter, self.modal.units), tool.orientation)
            }
        };
        if orientation != 0 && orientation != 9 && self.modal.plane != Plane::Xz {
            return fail(ErrorKind::CcTool { value: orientation.into() });
        }
        let left = matches!(code, 410 | 411) == (diameter >= 0.0);
        let radius = diameter.abs() / 2.0;
        let axes = PlaneAxes::of(self.modal.plane);
        let tool = [self.position[axes.first], self.position[axes.second]];
        self.cutter = Compensation { radius, orientation, first: true, tool, ..Compensation::default() };
        self.modal.compensation = Some(if left { Side::Left } else { Side::Right });
        out.queue.shift = self.lathe_shift();
        out.remark(if left {
            "interpreter: cutter radius compensation on left"
        } else {
            "interpreter: cutter radius compensation on right"
        });
        Ok(())
    }

    /// What a lathe tool's orientation adds to Z and X.
    fn lathe_shift(&self) -> [f64; 2] {
        if self.modal.plane != Plane::Xz {
            return [0.0; 2];
        }
        let radius = self.cutter.radius;
        let z = match self.cutter.orientation {
            2 | 7 | 3 => -radius,
            1 | 5 | 4 => radius,
            _ => 0.0,
        };
        let x = match self.cutter.orientation {
            2 | 6 | 1 => -radius,
            3 | 8 | 4 => radius,
            _ => 0.0,
        };
        [z, x]
    }

    /// G40.
    pub(crate) fn compensation_off(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let entered = self.compensates().is_some() && !self.cutter.first;
        self.finish_compensation(block, out)?;
        out.remark("interpreter: cutter radius compensation off");
        self.modal.compensation = None;
        self.cutter = Compensation { arc_refused: entered, ..Compensation::default() };
        Ok(())
    }

    /// The waiting move ends at its offset point and goes out.
    pub(crate) fn finish_compensation(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        if self.compensates().is_some() && !self.cutter.first {
            self.end_at(self.cutter.tool, block, out)?;
            self.cutter.begin = None;
        }
        Ok(())
    }

    /// G20, G21 between compensated moves. LinuxCNC converts the begin of the waiting move once for every waiting command
    /// (checked with rs274 2.9); pkm once.
    pub(crate) fn convert_compensation(&mut self, factor: f64, out: &mut Out<'_>) {
        let waiting = out.queue.scale(factor);
        let times = if self.settings.dialect == Dialect::Pkm { 1 } else { waiting };
        self.cutter.radius *= factor;
        self.cutter.tool = self.cutter.tool.map(|value| value * factor);
        for _ in 0..times {
            self.cutter.begin = self.cutter.begin.map(|point| point.map(|value| value * factor));
        }
    }

    /// The waiting moves go out as they are.
    fn let_go(&mut self, out: &mut Out<'_>) {
        out.flush();
        self.cutter.begin = None;
    }

    /// Moves the end of the waiting moves and lets them go.
    fn end_at(&mut self, point: Point, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let axes = PlaneAxes::of(self.modal.plane);
        let slack = match self.modal.units {
            LengthUnit::Mm => 0.0254,
            LengthUnit::Inch => 0.001,
        };
        if out.queue.is_empty() {
            return Ok(());
        }
        for waiting in out.queue.moves_mut() {
            match waiting {
                Move::Straight { direction, end, .. } => {
                    if let Some(begin) = self.cutter.begin {
                        let along =
                            direction[0] * (point[0] - begin[0]) + direction[1] * (point[1] - begin[1]);
                        if along < 0.0 {
                            return Err(Error { kind: ErrorKind::CcGouge, span: block.span() });
                        }
                    }
                    (end[axes.first], end[axes.second]) = (point[0], point[1]);
                }
                Move::Arc { sweep: programmed, end, centre, turns } => {
                    let old = distance(*centre, [end[axes.first], end[axes.second]]);
                    if (old - distance(*centre, point)).abs() > 0.01 {
                        return Err(Error { kind: ErrorKind::CcConcave, span: block.span() });
                    }
                    if let Some(begin) = self.cutter.begin {
                        let angle = sweep(begin, point, *centre, *turns);
                        if *programmed != 0.0 && angle.abs() > programmed.abs() + slack {
                            return Err(Error { kind: ErrorKind::CcConcave, span: block.span() });
                        }
                    }
                    (end[axes.first], end[axes.second]) = (point[0], point[1]);
                }
            }
        }
        out.flush();
        self.cutter.begin = Some(point);
        Ok(())
    }

    /// G0 and G1 with compensation; `end` is the programmed end.
    pub(crate) fn straight_compensated(
        &mut self,
        traverse: bool,
        side: Side,
        end: [f64; 9],
        block: &Block,
        out: &mut Out<'_>,
    ) -> Result<(), Error> {
        let axes = PlaneAxes::of(self.modal.plane);
        let from = [self.position[axes.first], self.position[axes.second]];
        let to = [end[axes.first], end[axes.second]];
        let radius = self.cutter.radius;
        let outward = if side == Side::Left { QUARTER } else { -QUARTER };
        let mut direction = [to[0] - from[0], to[1] - from[1]];
        let mut offset_end = self.cutter.tool;
        if self.cutter.first {
            let length = distance(from, to);
            if length <= radius {
                return Err(Error { kind: ErrorKind::CcEntry { length, radius }, span: block.span() });
            }
            let across = heading(from, to) + outward;
            offset_end = beside(to, across, radius);
            // Seen across, the entry move never turns round, however far the corner behind it draws it back.
            direction = [maths::cos(across), maths::sin(across)];
            self.cutter.begin = Some(from);
            self.cutter.first = false;
        } else if from != to {
            let along = heading(from, to);
            offset_end = beside(to, along + outward, radius);
            let corner = Corner { from, along, side, outward, traverse, end, arc: None };
            self.turn_corner(&corner, beside(from, along + outward, radius), block, out)?;
        }
        let mut point = end;
        (point[axes.first], point[axes.second]) = (offset_end[0], offset_end[1]);
        out.queue.push_move(Move::Straight { traverse, direction, end: point }, out.span);
        self.cutter.tool = offset_end;
        self.position = end;
        Ok(())
    }

    /// G2 and G3 with compensation; `centre` is the programmed one, seen from the programmed start.
    pub(crate) fn arc_compensated(
        &mut self,
        side: Side,
        end: [f64; 9],
        centre: Point,
        turns: i32,
        block: &Block,
        out: &mut Out<'_>,
    ) -> Result<(), Error> {
        let axes = PlaneAxes::of(self.modal.plane);
        let from = [self.position[axes.first], self.position[axes.second]];
        let to = [end[axes.first], end[axes.second]];
        let radius = self.cutter.radius;
        let arc_radius = distance(centre, to);
        let is_inside = inside(side, turns);
        if is_inside && arc_radius <= radius {
            return Err(Error { kind: ErrorKind::CcGouge, span: block.span() });
        }
        // The tool ends beside the end point, towards the centre or away from it.
        let gamma = if is_inside { heading(to, centre) } else { heading(centre, to) };
        let offset_end = beside(to, gamma, radius);
        let mut programmed = sweep(from, to, centre, turns);
        let mut offset_centre = centre;
        if self.cutter.first {
            let length = distance(from, to);
            if length <= radius {
                return Err(Error { kind: ErrorKind::CcEntry { length, radius }, span: block.span() });
            }
            // An arc from the uncompensated start that ends tangent to the offset arc: its centre lies on the line
            // from the offset end to the programmed centre, as far from the start as from the end.
            let half = distance(from, offset_end) / 2.0;
            let to_centre = heading(offset_end, centre);
            let angle = heading(offset_end, from) - to_centre;
            if maths::cos(angle).abs() < 1e-4 {
                return Err(Error { kind: ErrorKind::CcGouge, span: block.span() });
            }
            offset_centre = beside(offset_end, to_centre, half / maths::cos(angle));
            programmed = sweep(from, offset_end, offset_centre, turns);
            self.cutter.first = false;
            if !matches!(self.cutter.orientation, 0 | 9) {
                // A lathe tool: first the point that is offset goes to where the arc begins.
                let mut start = end;
                (start[axes.first], start[axes.second]) = (from[0], from[1]);
                start[axes.normal] = self.position[axes.normal];
                let waiting = Move::Straight { traverse: false, direction: [0.0; 2], end: start };
                out.queue.push_move(waiting, out.span);
                self.cutter.begin = Some(from);
            }
        } else {
            let outward = if side == Side::Left { QUARTER } else { -QUARTER };
            let to_centre = heading(from, centre);
            let along = if turns > 0 { to_centre - QUARTER } else { to_centre + QUARTER };
            let corner = Corner {
                from,
                along,
                side,
                outward,
                traverse: false,
                end,
                arc: Some(CornerArc { turns, centre, radius: arc_radius }),
            };
            let middle = beside(from, if is_inside { to_centre } else { to_centre + maths::PI }, radius);
            self.turn_corner(&corner, middle, block, out)?;
        }
        let mut point = end;
        (point[axes.first], point[axes.second]) = (offset_end[0], offset_end[1]);
        out.queue
            .push_move(Move::Arc { sweep: programmed, end: point, centre: offset_centre, turns }, out.span);
        self.cutter.tool = offset_end;
        self.position = end;
        Ok(())
    }

    /// Ends the waiting move at a corner; around an outside corner an arc follows it to `middle`.
    fn turn_corner(
        &mut self,
        corner: &Corner,
        middle: Point,
        block: &Block,
        out: &mut Out<'_>,
    ) -> Result<(), Error> {
        let axes = PlaneAxes::of(self.modal.plane);
        let Corner { from, along, side, outward, arc, .. } = *corner;
        let tool = self.cutter.tool;
        // Direction of travel before the corner.
        let before = heading(from, tool) - outward;
        // Change of direction seen from the tool side. Before an arc LinuxCNC adds a turn at most once.
        let mut beta = if side == Side::Left { before - along } else { along - before };
        if beta > 1.5 * maths::PI {
            beta -= maths::TAU;
        }
        if beta < -QUARTER {
            beta += maths::TAU;
        }
        if arc.is_none() && beta < -QUARTER {
            beta += maths::TAU;
        }
        let previous = match out.queue.front() {
            Some(Move::Arc { centre, end, turns, .. }) => Some(CornerArc {
                turns,
                centre,
                radius: distance(centre, [end[axes.first], end[axes.second]]),
            }),
            _ => None,
        };
        let mut concave = !(-SMALL..=maths::PI + SMALL).contains(&beta);
        // Over a half circle and straight on beside it: stay on the outer side instead of looping.
        match (arc, previous) {
            (Some(arc), _) => concave |= (beta - maths::PI).abs() < SMALL && !inside(side, arc.turns),
            (None, Some(arc)) => concave |= beta > maths::PI - SMALL && !inside(side, arc.turns),
            (None, None) => {}
        }
        if concave {
            let cut = match (previous, arc) {
                (None, None) => self.cut_of_lines(before, beta),
                (None, Some(arc)) => self.cut_of_line_and_arc(&arc, side, before, beta),
                (Some(previous), None) => self.cut_of_arc_and_line(&previous, corner),
                (Some(previous), Some(arc)) => self.cut_of_arcs(&previous, &arc, side),
            };
            let Some(cut) = cut else {
                return Err(Error { kind: ErrorKind::CcConcave, span: block.span() });
            };
            return self.end_at(cut, block, out);
        }
        if beta <= SMALL {
            self.let_go(out);
            self.cutter.begin = Some(tool);
            return Ok(());
        }
        match arc {
            None => self.end_at(tool, block, out)?,
            Some(_) => self.let_go(out),
        }
        // The height does not move along; the rotary axes and U V W do (checked with rs274 2.9).
        let mut end = corner.end;
        end[axes.normal] = self.position[axes.normal];
        (end[axes.first], end[axes.second]) = (middle[0], middle[1]);
        if corner.traverse {
            out.queue.push_move(Move::Straight { traverse: true, direction: [0.0; 2], end }, out.span);
        } else {
            let turns = if side == Side::Left { -1 } else { 1 };
            out.queue.push_move(Move::Arc { sweep: 0.0, end, centre: from, turns }, out.span);
        }
        out.flush();
        self.cutter.begin = Some(middle);
        Ok(())
    }

    /// Half the angle of the corner; the line before retreats by r / tan of it.
    fn cut_of_lines(&self, before: f64, beta: f64) -> Option<Point> {
        let half = (beta + maths::PI) / 2.0;
        (half != 0.0)
            .then(|| beside(self.cutter.tool, before + maths::PI, self.cutter.radius / maths::tan(half)))
    }

    /// The line's offset runs at a known distance from the arc's centre: programmed it is R cos beta.
    fn cut_of_line_and_arc(&self, arc: &CornerArc, side: Side, before: f64, beta: f64) -> Option<Point> {
        let radius = self.cutter.radius;
        let from_line = -arc.radius * maths::cos(beta);
        let turn = if arc.turns > 0 { 1.0 } else { -1.0 };
        let (size, ratio) = if inside(side, arc.turns) {
            (arc.radius - radius, (from_line + radius) / (arc.radius - radius))
        } else {
            (arc.radius + radius, (from_line - radius) / (arc.radius + radius))
        };
        let bow = turn * angle(ratio)?.0;
        let direction = if inside(side, arc.turns) { before + bow } else { before + maths::PI - bow };
        Some(beside(arc.centre, direction, size))
    }

    /// `previous` is the offset arc. Its centre's distance from the line, then from the line's offset.
    fn cut_of_arc_and_line(&self, previous: &CornerArc, corner: &Corner) -> Option<Point> {
        let radius = self.cutter.radius;
        let Corner { from, along, side, .. } = *corner;
        let is_inside = inside(side, previous.turns);
        let square_to = if previous.turns > 0 { along + QUARTER } else { along - QUARTER };
        let programmed = if is_inside { previous.radius + radius } else { previous.radius - radius };
        let from_line = programmed * maths::cos(square_to - heading(from, previous.centre));
        let from_offset = if is_inside { from_line - radius } else { from_line + radius };
        let opening = angle(from_offset / previous.radius)?.1;
        let opening = if is_inside == (previous.turns > 0) { -opening } else { opening };
        Some(beside(previous.centre, opening + square_to + maths::PI, previous.radius))
    }

    /// The triangle of both centres and the cut: law of cosines at the first centre. Which of the two cuts it is follows
    /// from the turning senses, not from the distance to the corner (checked with rs274 2.9).
    fn cut_of_arcs(&self, previous: &CornerArc, arc: &CornerArc, side: Side) -> Option<Point> {
        let radius = self.cutter.radius;
        let size = if inside(side, arc.turns) { arc.radius - radius } else { arc.radius + radius };
        let (old, gap) = (previous.radius, distance(previous.centre, arc.centre));
        let opening = angle((old * old + gap * gap - size * size) / (2.0 * old * gap))?.1;
        let opening = if inside(side, previous.turns) == (arc.turns > 0) { opening } else { -opening };
        Some(beside(previous.centre, heading(previous.centre, arc.centre) + opening, old))
    }
}

/// Arc sine and arc cosine of a ratio; `None` where there is no such angle.
fn angle(ratio: f64) -> Option<(f64, f64)> {
    (-1.0..=1.0).contains(&ratio).then(|| (maths::asin(ratio), maths::acos(ratio)))
}

/// An arc beside a corner.
#[derive(Debug, Clone, Copy)]
struct CornerArc {
    turns: i32,
    centre: Point,
    radius: f64,
}

/// A corner of the programmed path.
struct Corner {
    from: Point,
    /// Direction of travel after it.
    along: f64,
    side: Side,
    /// From the direction of travel to the tool: a quarter turn left or right.
    outward: f64,
    traverse: bool,
    /// Where the move after the corner ends.
    end: [f64; 9],
    /// The programmed arc that follows, if one does.
    arc: Option<CornerArc>,
}
