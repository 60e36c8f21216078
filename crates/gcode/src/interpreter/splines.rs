//! Splines in the XY plane: cubic G5, quadratic G5.1, NURBS blocks G5.2 to G5.3.

use super::{Out, state::State};
use crate::block::Block;
use crate::error::{Code, Error, ErrorKind};
use crate::modal::*;
use crate::settings::Dialect;
use heapless::Vec;
use pkm_canon::{Canon, ControlPoint, Plane};

/// Most control points of one NURBS.
#[cfg(feature = "alloc")]
const MAX_POINTS: usize = 256;
#[cfg(not(feature = "alloc"))]
const MAX_POINTS: usize = 32;

/// What splines remember from block to block.
#[derive(Debug, Clone, Default)]
pub(crate) struct Splines {
    points: Vec<ControlPoint, MAX_POINTS>,
    order: u32,
    /// Last tangent of a G5 (P, Q), which the next one may continue.
    tangent: Option<[f64; 2]>,
    last_tangent: [f64; 2],
}

impl Splines {
    /// True between G5.2 and G5.3.
    pub(crate) fn is_open(&self) -> bool {
        !self.points.is_empty()
    }

    /// Any other motion ends a spline.
    pub(crate) fn forget(&mut self) {
        self.tangent = None;
    }
}

impl State {
    /// What holds for G5 and G5.1.
    fn check_spline(&self, code: GCode, block: &Block) -> Result<(), Error> {
        let refused =
            block.has_any(b"ZABCUVW") || self.modal.plane != Plane::Xy || self.modal.compensation.is_some();
        if refused {
            return Err(block.motion_error(ErrorKind::SplineAxes { code: Code(code) }));
        }
        if self.settings.dialect == Dialect::LinuxCnc29 && self.modal.feed_mode == FeedMode::PerTurn {
            return Ok(());
        }
        self.check_feed(code, block)
    }

    /// G5 I J P Q: control points start, start + (I, J), end + (P, Q), end.
    pub(crate) fn cubic(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.check_spline(G5, block)?;
        let words = |words| Err(block.motion_error(ErrorKind::SplineWords { code: Code(G5), words }));
        let [p, q] = match (block.get(b'P'), block.get(b'Q')) {
            (Some(p), Some(q)) => [p, q],
            _ => return words("P and Q"),
        };
        let [i, j] = match (block.get(b'I'), block.get(b'J'), self.splines.tangent) {
            (Some(i), Some(j), _) => [i, j],
            (None, None, Some([p, q])) => [-p, -q],
            // 2.9 does not ask whether the motion before was a G5 (checked with rs274 2.9).
            (None, None, None) if self.settings.dialect == Dialect::LinuxCnc29 => {
                let [p, q] = self.splines.last_tangent;
                [-p, -q]
            }
            _ => return words("I and J"),
        };
        let end = self.end_point(block)?;
        let [x, y, ..] = self.position;
        let points = [[x, y], [x + i, y + j], [end[0] + p, end[1] + q], [end[0], end[1]]];
        self.emit_points(&points, out);
        (self.splines.tangent, self.splines.last_tangent) = (Some([p, q]), [p, q]);
        self.set_spline_motion(G5);
        self.position = end;
        Ok(())
    }

    /// G5.1 I J: control points start, start + (I, J), end.
    pub(crate) fn quadratic(&mut self, block: &Block, out: &mut Out<'_>) -> Result<(), Error> {
        self.check_spline(G5_1, block)?;
        let (Some(i), Some(j)) = (block.get(b'I'), block.get(b'J')) else {
            let kind = ErrorKind::SplineWords { code: Code(G5_1), words: "I and J" };
            return Err(block.motion_error(kind));
        };
        let end = self.end_point(block)?;
        let [x, y, ..] = self.position;
        self.emit_points(&[[x, y], [x + i, y + j], [end[0], end[1]]], out);
        self.set_spline_motion(G5_1);
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
    fn emit_points(&mut self, points: &[[f64; 2]], out: &mut Out<'_>) {
        if self.settings.dialect == Dialect::Pkm {
            self.splines.points.clear();
        }
        for [first, second] in points {
            let _ = self.splines.points.push(ControlPoint { first: *first, second: *second, weight: 1.0 });
        }
        out.emit(Canon::NurbsFeed { points: &self.splines.points, order: points.len() as u32 });
        self.splines.points.clear();
    }

    /// G5.2 X Y P L: one control point; the first block without X Y begins at the present position with weight P.
    pub(crate) fn nurbs_point(&mut self, block: &Block) -> Result<(), Error> {
        let words = |words| Err(block.motion_error(ErrorKind::SplineWords { code: Code(G5_2), words }));
        let compat = self.settings.dialect != Dialect::Pkm;
        if !compat {
            self.check_spline(G5_2, block)?;
        }
        let (point, weight) = (block.has(b'X'), block.get(b'P').unwrap_or(-1.0));
        if point != block.has(b'Y') {
            return words("X and Y");
        }
        let begins = self.splines.points.is_empty() || self.modal.motion != G5_2;
        if !self.splines.points.is_empty() && weight <= 0.0 {
            return match block.has(b'P') {
                true => Err(block.word_error(b'P', ErrorKind::NurbsWeight { value: weight })),
                false => words("P"),
            };
        }
        if !self.splines.points.is_empty() && !point {
            return words("X and Y");
        }
        if compat && self.modal.feed_mode == FeedMode::PerMinute && self.modal.feed == 0.0 {
            return Err(block.motion_error(ErrorKind::FeedZero { code: Code(G5_2) }));
        }
        if begins {
            self.splines.points.clear();
            let first_weight = if !point && weight > 0.0 { weight } else { 1.0 };
            let [first, second, ..] = self.position;
            self.splines.order = 3;
            self.push_point(ControlPoint { first, second, weight: first_weight }, block)?;
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
                return Err(block.word_error(b'P', ErrorKind::NurbsWeight { value: weight }));
            }
            let end = self.end_point(block)?;
            self.push_point(ControlPoint { first: end[0], second: end[1], weight }, block)?;
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
        out.emit(Canon::NurbsFeed { points: &self.splines.points, order });
        if let Some(last) = self.splines.points.last() {
            (self.position[0], self.position[1]) = (last.first, last.second);
        }
        self.splines.points.clear();
        self.splines.forget();
        self.modal.motion = G80;
        Ok(())
    }
}
