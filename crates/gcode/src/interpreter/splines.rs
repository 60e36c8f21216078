//! Splines in a plane: cubic G5, quadratic G5.1, NURBS blocks G5.2 to G5.3; G6 and G6.1, the same curves, and NURBS with
//! knots of their own, G6.2 (LinuxCNC 2.10 and pkm). LinuxCNC 2.9 has G5 to G5.3 alone, in the XY plane.

use super::arcs::PlaneAxes;
use super::{Out, state::State};
use crate::block::{AXIS_LETTERS, Block};
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use crate::settings::Dialect;
use heapless::Vec;
use pkm_canon::{Canon, ControlPoint, Plane, Span};

/// Most control points of one NURBS; of G6.2 the last blocks, which hold knots alone, count too.
#[cfg(feature = "alloc")]
const MAX_POINTS: usize = 256;
#[cfg(not(feature = "alloc"))]
const MAX_POINTS: usize = 32;

/// What splines remember from block to block.
#[derive(Debug, Clone, Default)]
pub(crate) struct Splines {
    points: Vec<ControlPoint, MAX_POINTS>,
    /// One per block of G6.2; empty for the other splines.
    knots: Vec<f64, MAX_POINTS>,
    order: u32,
    /// Last tangent of a G5 (P, Q) and its plane; the next one may continue it.
    tangent: Option<([f64; 2], Plane)>,
    last_tangent: [f64; 2],
}

impl Splines {
    /// True between the first control point of a NURBS and its end.
    pub(crate) fn is_open(&self) -> bool {
        !self.points.is_empty()
    }

    /// True if a motion goes on with the NURBS that is open.
    pub(crate) fn takes(&self, code: GCode) -> bool {
        if self.knots.is_empty() { matches!(code, G5_2 | G5_3) } else { code == G6_2 }
    }

    /// Any other motion ends a spline.
    pub(crate) fn forget(&mut self) {
        self.tangent = None;
    }

    fn clear(&mut self) {
        self.points.clear();
        self.knots.clear();
    }
}

/// The plane of a spline.
#[derive(Clone, Copy)]
struct SplinePlane {
    plane: Plane,
    /// First and second axis.
    axes: [usize; 2],
    /// The axes of I and J, which are those of the plane in the order of their letters.
    start_tangent: [usize; 2],
    /// The axes of P and Q.
    end_tangent: [usize; 2],
    /// The axis words of a point.
    words: &'static str,
}

impl SplinePlane {
    fn point(&self, place: &[f64; 9], weight: f64) -> ControlPoint {
        let [first, second] = self.axes;
        ControlPoint { first: place[first], second: place[second], weight }
    }

    fn moved(&self, place: &[f64; 9], axes: [usize; 2], by: [f64; 2]) -> ControlPoint {
        let mut place = *place;
        place[axes[0]] += by[0];
        place[axes[1]] += by[1];
        self.point(&place, 1.0)
    }

    /// How many axis words of a point a block has: none, half of them, or all.
    fn words_in(&self, block: &Block) -> usize {
        self.axes.iter().filter(|axis| block.axis(**axis).is_some()).count()
    }
}

impl State {
    /// The plane of the spline of a block.
    fn spline_plane(&self, code: GCode, block: &Block) -> Result<SplinePlane, Error> {
        let dialect = self.settings.dialect;
        let plane = if dialect == Dialect::LinuxCnc29 { Plane::Xy } else { self.modal.plane };
        let (start_tangent, words) = match plane {
            Plane::Xy => ([0, 1], "X and Y"),
            Plane::Xz => ([0, 2], "X and Z"),
            Plane::Yz => ([1, 2], "Y and Z"),
            Plane::Uv | Plane::Uw | Plane::Vw => return Err(self.spline_axes(code, block)),
        };
        let axes = PlaneAxes::of(plane);
        // In LinuxCNC 2.10 P of G5 is along Z in G18, but I along X.
        let end_tangent =
            if dialect == Dialect::LinuxCnc210 { [axes.first, axes.second] } else { start_tangent };
        Ok(SplinePlane { plane, axes: [axes.first, axes.second], start_tangent, end_tangent, words })
    }

    fn spline_axes(&self, code: GCode, block: &Block) -> Error {
        let planes = if self.settings.is_newer() { "G17, G18 or G19" } else { "G17" };
        block.motion_error(ErrorKind::SplineAxes { code: Code(code), planes })
    }

    /// What holds for G5, G5.1, G6 and G6.1, in pkm for every spline.
    fn check_spline(&self, code: GCode, block: &Block) -> Result<(), Error> {
        let normal = AXIS_LETTERS[PlaneAxes::of(self.modal.plane).normal];
        // LinuxCNC 2.10 passes over the word of the third axis.
        let leaves = block.has(normal) && self.settings.dialect != Dialect::LinuxCnc210;
        let in_xy = self.modal.plane == Plane::Xy || self.settings.is_newer();
        if leaves || block.has_any(b"ABCUVW") || !in_xy || self.modal.compensation.is_some() {
            return Err(self.spline_axes(code, block));
        }
        if self.settings.dialect == Dialect::LinuxCnc29 && self.modal.feed_mode == FeedMode::PerTurn {
            return Ok(());
        }
        self.check_feed(code, block)
    }

    /// Where the words of a block lead to in its plane.
    fn spline_end(&self, block: &Block, plane: &SplinePlane) -> Result<[f64; 9], Error> {
        let programmed = self.end_point(block)?;
        let mut end = self.position;
        for axis in plane.axes {
            end[axis] = programmed[axis];
        }
        Ok(end)
    }

    /// G5, G6 I J P Q: control points start, start + (I, J), end + (P, Q), end.
    pub(crate) fn cubic(&mut self, code: GCode, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.check_spline(code, block)?;
        let plane = self.spline_plane(code, block)?;
        let words = |words| Err(block.motion_error(ErrorKind::SplineWords { code: Code(code), words }));
        let end_tangent = match (block.get(b'P'), block.get(b'Q')) {
            (Some(p), Some(q)) => [p, q],
            _ => return words("P and Q"),
        };
        let start_tangent = match (block.get(b'I'), block.get(b'J'), self.splines.tangent) {
            (Some(i), Some(j), _) => [i, j],
            (None, None, Some((tangent, of))) if of == plane.plane => tangent.map(|value| -value),
            // 2.9 does not ask whether the motion before was a G5 (checked with rs274 2.9).
            (None, None, None) if self.settings.dialect == Dialect::LinuxCnc29 => {
                self.splines.last_tangent.map(|value| -value)
            }
            _ => return words("I and J"),
        };
        let end = self.spline_end(block, &plane)?;
        let points = [
            plane.point(&self.position, 1.0),
            plane.moved(&self.position, plane.start_tangent, start_tangent),
            plane.moved(&end, plane.end_tangent, end_tangent),
            plane.point(&end, 1.0),
        ];
        self.emit_points(&plane, &points, out);
        self.splines.tangent = Some((end_tangent, plane.plane));
        self.splines.last_tangent = end_tangent;
        self.set_spline_motion(code);
        self.position = end;
        Ok(())
    }

    /// G5.1, G6.1 I J: control points start, start + (I, J), end.
    pub(crate) fn quadratic(&mut self, code: GCode, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.check_spline(code, block)?;
        let plane = self.spline_plane(code, block)?;
        let (Some(i), Some(j)) = (block.get(b'I'), block.get(b'J')) else {
            let kind = ErrorKind::SplineWords { code: Code(code), words: "I and J" };
            return Err(block.motion_error(kind));
        };
        let end = self.spline_end(block, &plane)?;
        let points = [
            plane.point(&self.position, 1.0),
            plane.moved(&self.position, plane.start_tangent, [i, j]),
            plane.point(&end, 1.0),
        ];
        self.emit_points(&plane, &points, out);
        self.set_spline_motion(code);
        self.position = end;
        Ok(())
    }

    /// In LinuxCNC the motion before stays in force: axis words alone go on with it (checked with rs274 2.9).
    fn set_spline_motion(&mut self, code: GCode) {
        if self.settings.dialect == Dialect::Pkm {
            self.modal.motion = code;
        }
    }

    /// A whole spline. Control points that another motion cut off are still there in LinuxCNC and go before it (checked
    /// with rs274 2.9).
    fn emit_points(&mut self, plane: &SplinePlane, points: &[ControlPoint], out: &mut Out<'_>) {
        if self.settings.dialect == Dialect::Pkm || !self.splines.knots.is_empty() {
            self.splines.clear();
        }
        for point in points {
            let _ = self.splines.points.push(*point);
        }
        let (points, order) = (&self.splines.points[..], points.len() as u32);
        out.emit(Canon::NurbsFeed { plane: plane.plane, points, knots: &[], order });
        self.splines.clear();
    }

    /// G5.2 with the words of a point, P and L: one control point; the first block without a point begins at the present position with
    /// weight P.
    pub(crate) fn nurbs_point(&mut self, block: &Block) -> Result<(), Error> {
        let words = |words| Err(block.motion_error(ErrorKind::SplineWords { code: Code(G5_2), words }));
        let compat = self.settings.dialect != Dialect::Pkm;
        if !compat {
            self.check_spline(G5_2, block)?;
        }
        let plane = self.spline_plane(G5_2, block)?;
        if !self.splines.takes(G5_2) {
            self.splines.clear();
        }
        let (point, weight) = (plane.words_in(block) == 2, block.get(b'P').unwrap_or(-1.0));
        if plane.words_in(block) == 1 {
            return words(plane.words);
        }
        let begins = self.splines.points.is_empty() || self.modal.motion != G5_2;
        if !self.splines.points.is_empty() && weight <= 0.0 {
            return match block.has(b'P') {
                true => Err(block.word_error(b'P', ErrorKind::NurbsWeight { letter: 'P', value: weight })),
                false => words("P"),
            };
        }
        if !self.splines.points.is_empty() && !point {
            return words(plane.words);
        }
        if compat && self.modal.feed_mode == FeedMode::PerMinute && self.modal.feed == 0.0 {
            return Err(block.motion_error(ErrorKind::FeedZero { code: Code(G5_2) }));
        }
        if begins {
            self.splines.points.clear();
            let first_weight = if !point && weight > 0.0 { weight } else { 1.0 };
            self.splines.order = 3;
            self.push_point(plane.point(&self.position, first_weight), block)?;
        }
        if let Some(l) = block.get(b'L')
            && l > 3.0
        {
            self.splines.order = l as u32;
        }
        if point {
            // LinuxCNC does not look at the weight of a point in the first block.
            let weight = if compat || block.has(b'P') { weight } else { 1.0 };
            if !compat && weight <= 0.0 {
                return Err(block.word_error(b'P', ErrorKind::NurbsWeight { letter: 'P', value: weight }));
            }
            let end = self.spline_end(block, &plane)?;
            self.push_point(plane.point(&end, weight), block)?;
        }
        self.modal.motion = G5_2;
        Ok(())
    }

    fn push_point(&mut self, point: ControlPoint, block: &Block) -> Result<(), Error> {
        let kind = ErrorKind::NurbsTooMany { limit: MAX_POINTS as u16 };
        self.splines.points.push(point).map_err(|_| block.motion_error(kind))
    }

    /// G5.3: the spline through the control points given since G5.2.
    pub(crate) fn nurbs_end(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let (points, order) = (self.splines.points.len(), self.splines.order);
        if self.modal.motion != G5_2 || points < order as usize {
            let kind = ErrorKind::NurbsPoints { points: points as u16, order: order.max(3) as u16 };
            return Err(block.motion_error(kind));
        }
        let plane = self.spline_plane(G5_3, block)?;
        self.emit_nurbs(&plane, points, out);
        Ok(())
    }

    /// The NURBS through the first `points` control points; the position is its end.
    fn emit_nurbs(&mut self, plane: &SplinePlane, points: usize, out: &mut Out<'_>) {
        let order = self.splines.order;
        let points = &self.splines.points[..points];
        out.emit(Canon::NurbsFeed { plane: plane.plane, points, knots: &self.splines.knots, order });
        if let Some(last) = points.last() {
            let [first, second] = plane.axes;
            (self.position[first], self.position[second]) = (last.first, last.second);
        }
        self.splines.clear();
        self.splines.forget();
        self.modal.motion = G80;
    }

    /// G6.2 P Q, then per block a point, its weight R and a knot K; after the points as many blocks with a knot alone as the order P
    /// says. The spline ends with the last of that many equal knots.
    pub(crate) fn knot_point(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        let words = |words| Err(block.motion_error(ErrorKind::SplineWords { code: Code(G6_2), words }));
        self.check_spline(G6_2, block)?;
        let plane = self.spline_plane(G6_2, block)?;
        if self.splines.knots.is_empty() || self.modal.motion != G6_2 {
            self.splines.clear();
        }
        let begins = self.splines.knots.is_empty();
        self.check_order(block, begins)?;
        let point = match plane.words_in(block) {
            1 => return words(plane.words),
            given => given == 2,
        };
        let weight = match block.get(b'R') {
            Some(r) if r > 0.0 => r,
            Some(value) => {
                return Err(block.word_error(b'R', ErrorKind::NurbsWeight { letter: 'R', value }));
            }
            None if point => return words("R"),
            None => 0.0,
        };
        let Some(knot) = block.get(b'K') else { return words("K") };
        self.check_knot(knot, block)?;
        // After a knot alone no point comes, and not before there are points.
        let after_points = self.splines.points.last().is_some_and(|last| last.weight == 0.0);
        if point && after_points || !point && begins {
            return words(if begins { plane.words } else { "its points before the knots that stand alone" });
        }
        if begins {
            self.splines.order = block.get(b'P').unwrap_or(0.0) as u32;
        }
        let end = self.spline_end(block, &plane)?;
        self.push_point(plane.point(&end, weight), block)?;
        let _ = self.splines.knots.push(knot);
        self.modal.motion = G6_2;
        let (blocks, order) = (self.splines.knots.len(), self.splines.order as usize);
        if blocks > order && self.splines.knots[blocks - order] == knot {
            let points = self.splines.points.iter().filter(|point| point.weight > 0.0).count();
            if points != blocks - order || points < order {
                self.splines.clear();
                self.modal.motion = G80;
                let kind = ErrorKind::NurbsPoints { points: points as u16, order: order as u16 };
                return Err(block.motion_error(kind));
            }
            self.emit_nurbs(&plane, points, out);
        }
        Ok(())
    }

    /// P, the order, stands in the first block, with Q, LinuxCNC's way of cutting the curve.
    fn check_order(&self, block: &Block, begins: bool) -> Result<(), Error> {
        let wrong = |letter: u8, value| {
            Err(block.word_error(letter, ErrorKind::NurbsOrder { letter: letter.into(), value }))
        };
        let near = |value: f64| (pkm_kins::maths::round(value) - value).abs() < 1e-4;
        let order = begins.then_some(2.0..=MAX_POINTS as f64 / 2.0);
        match (block.get(b'P'), block.get(b'Q')) {
            (Some(p), _) if !near(p) => wrong(b'P', p),
            (Some(p), _) if order.is_some_and(|range| !range.contains(&p)) => wrong(b'P', p),
            (Some(p), _) if !begins && p as u32 != self.splines.order => wrong(b'P', p),
            (_, Some(q)) if !near(q) || !(1.0..=3.0).contains(&q) => wrong(b'Q', q),
            (Some(_), Some(_)) => Ok(()),
            _ if !begins => Ok(()),
            _ => {
                let kind = ErrorKind::SplineWords { code: Code(G6_2), words: "P and Q in its first block" };
                Err(block.motion_error(kind))
            }
        }
    }

    /// Knots do not fall, and the first ones, as many as the order says, are equal. LinuxCNC's are whole numbers from 0 on.
    fn check_knot(&self, knot: f64, block: &Block) -> Result<(), Error> {
        let knots = &self.splines.knots;
        let falls = knots.last().is_some_and(|last| knot < *last);
        let opens = knots.len() < self.splines.order as usize && knots.first().is_some_and(|k| *k != knot);
        let fraction = (pkm_kins::maths::round(knot) - knot).abs() >= 1e-4;
        let refused = self.settings.dialect != Dialect::Pkm && (fraction || knot < 0.0);
        if falls || opens || refused {
            return Err(block.word_error(b'K', ErrorKind::NurbsKnot { value: knot }));
        }
        Ok(())
    }

    /// The end of the program drops no control points (pkm).
    pub(crate) fn check_spline_ended(&self, span: Span) -> Result<(), Error> {
        if self.settings.dialect != Dialect::Pkm || !self.splines.is_open() {
            return Ok(());
        }
        let (points, order) = (self.splines.points.len() as u16, self.splines.order as u16);
        Err(Error { kind: ErrorKind::NurbsPoints { points, order }, span })
    }

    /// Between its control points a NURBS keeps its plane, units and offsets (pkm).
    pub(crate) fn check_open_spline(&self, block: &Block) -> Result<(), Error> {
        const KEPT: [GGroup; 7] = [
            GGroup::Plane,
            GGroup::Units,
            GGroup::ToolLength,
            GGroup::System,
            GGroup::Lathe,
            GGroup::NonModal,
            GGroup::G92,
        ];
        for group in KEPT {
            if let Some(code) = block.g(group).filter(|code| *code != G4) {
                return Err(block.g_error(group, ErrorKind::NurbsDropped { code: Code(code) }));
            }
        }
        Ok(())
    }
}
