//! Splines of G5, G5.1, G5.2 and G6.2: clamped NURBS in a plane, cut into cubics with continuous dX/ds.
//!
//! Source: L. Piegl, W. Tiller, The NURBS Book, 2nd ed., algorithms A4.1 (evaluation) and A3.2 (derivative), written as
//! de Boor's triangle on homogeneous coordinates. Without knots of its own a spline has those of RS274/NGC's `NURBS_FEED`:
//! `order` zeros, then one step per span, then `order` times the end. A polynomial spline of order 3 or 4 is reproduced exactly; a rational or
//! higher one within 1e-9 mm, by halving its spans.

use super::{Blend, Point, Vector, combine, norm3};
use pkm_canon::ControlPoint;
use pkm_kins::maths::sqrt;

/// Highest order (degree + 1) that is evaluated.
pub const MAX_ORDER: usize = 12;

/// How far a cubic may be from the curve it stands for, mm.
const FIT_MM: f64 = 1e-9;
/// Halvings of a knot span at most.
const HALVINGS: u32 = 10;

/// A control point in homogeneous coordinates: (x w, y w, w).
type Homogeneous = [f64; 3];

/// A spline whose control points are in machine coordinates of a plane: position = origin + first·a + second·b.
#[derive(Debug, Clone, Copy)]
pub struct Spline<'a> {
    points: &'a [ControlPoint],
    /// Empty: uniform.
    knots: &'a [f64],
    order: usize,
    unit_mm: f64,
}

impl<'a> Spline<'a> {
    /// `None` if there are fewer points than the order, the order is not 2 to [`MAX_ORDER`], a weight is not > 0, or there are
    /// knots but not points + order of them, they fall, or the first or last `order` are not equal.
    pub fn new(points: &'a [ControlPoint], knots: &'a [f64], order: u32, unit_mm: f64) -> Option<Self> {
        let order = usize::try_from(order).ok()?;
        let good = (2..=MAX_ORDER).contains(&order)
            && points.len() >= order
            && points.iter().all(|p| p.weight > 0.0 && p.first.is_finite() && p.second.is_finite());
        let are_equal = |some: Option<&[f64]>| {
            some.is_some_and(|some| some.windows(2).all(|pair| matches!(pair, [a, b] if a == b)))
        };
        let clamped = knots.is_empty()
            || knots.len() == points.len() + order
                && knots.iter().all(|knot| knot.is_finite())
                && knots.windows(2).all(|pair| matches!(pair, [a, b] if a <= b))
                && are_equal(knots.get(..order))
                && are_equal(knots.get(points.len()..))
                && knots.first() < knots.last();
        (good && clamped).then_some(Self { points, knots, order, unit_mm })
    }

    /// Number of knot spans, those of no width included.
    fn spans(&self) -> usize {
        self.points.len() + 1 - self.order
    }

    /// The i-th knot, clamped.
    fn knot(&self, i: usize) -> f64 {
        match self.knots.get(i) {
            Some(knot) => *knot,
            None => i.saturating_sub(self.order - 1).min(self.spans()) as f64,
        }
    }

    /// Where a knot span begins, and how wide it is.
    fn span(&self, span: usize) -> (f64, f64) {
        let begin = self.knot(span + self.order - 1);
        (begin, self.knot(span + self.order) - begin)
    }

    fn homogeneous(&self, i: usize) -> Homogeneous {
        self.points.get(i).map_or([0.0; 3], |p| {
            [p.first * self.unit_mm * p.weight, p.second * self.unit_mm * p.weight, p.weight]
        })
    }

    /// Position and derivative at `t` in knot span `span` (from 0), in the plane, mm.
    fn at(&self, span: usize, t: f64) -> ([f64; 2], [f64; 2]) {
        let degree = self.order - 1;
        let mut d = [[0.0; 3]; MAX_ORDER];
        for (j, slot) in d.iter_mut().enumerate().take(self.order) {
            *slot = self.homogeneous(span + j);
        }
        // Knot index of the span's left end.
        let left = span + degree;
        let mut slope = [0.0; 3];
        for level in 1..=degree {
            if level == degree
                && let (Some(a), Some(b)) = (d.get(degree - 1), d.get(degree))
            {
                let width = self.knot(left + 1) - self.knot(left);
                slope = core::array::from_fn(|k| degree as f64 * (b[k] - a[k]) / width);
            }
            for j in (level..=degree).rev() {
                let low = self.knot(left + j - degree);
                let high = self.knot(left + 1 + j - level);
                let alpha = if high > low { (t - low) / (high - low) } else { 0.0 };
                let before = d.get(j - 1).copied().unwrap_or_default();
                if let Some(here) = d.get_mut(j) {
                    for (value, before) in here.iter_mut().zip(before) {
                        *value = before + alpha * (*value - before);
                    }
                }
            }
        }
        let [x, y, w] = d.get(degree).copied().unwrap_or([0.0, 0.0, 1.0]);
        let place = [x / w, y / w];
        (place, [(slope[0] - slope[2] * place[0]) / w, (slope[1] - slope[2] * place[1]) / w])
    }

    /// Length by Simpson's rule on every span, mm: only the scale of s.
    fn length_mm(&self) -> f64 {
        const PIECES: u8 = 8;
        let mut sum = 0.0;
        for span in 0..self.spans() {
            let (begin, width) = self.span(span);
            if width == 0.0 {
                continue;
            }
            for k in 0..=PIECES {
                let t = begin + width * f64::from(k) / f64::from(PIECES);
                let [x, y] = self.at(span, t).1;
                let factor = if k == 0 || k == PIECES { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
                sum += width * factor * sqrt(x * x + y * y) / (3.0 * f64::from(PIECES));
            }
        }
        sum
    }

    /// The first control point: where the spline begins, in the plane, mm.
    pub fn begin(&self) -> [f64; 2] {
        let [x, y, w] = self.homogeneous(0);
        [x / w, y / w]
    }

    /// Calls `emit` with the cubics of the spline in order. `lift` takes a place or a direction (`true`) in the plane
    /// to nine machine coordinates.
    pub fn cubics(&self, lift: impl Fn([f64; 2], bool) -> Vector, mut emit: impl FnMut(Blend)) {
        let length = self.length_mm();
        if !(length > 1e-12) {
            return;
        }
        // One scale for the whole spline, so that dX/ds is continuous from cubic to cubic.
        let per_t = length / (self.knot(self.points.len()) - self.knot(self.order - 1));
        let end = |span: usize, t: f64| {
            let (place, slope) = self.at(span, t);
            Point {
                position: lift(place, false),
                first: lift(slope, true).map(|d| d / per_t),
                second: [0.0; 9],
            }
        };
        for span in 0..self.spans() {
            let (begin, whole) = self.span(span);
            if whole == 0.0 {
                continue;
            }
            let mut parts = 1_u32;
            for halving in 0..=HALVINGS {
                let width = whole / f64::from(parts);
                let cubic = |k: u32| {
                    let t = begin + f64::from(k) * width;
                    (t, Blend::hermite(&end(span, t), &end(span, t + width), width * per_t))
                };
                let fits = (0..parts).all(|k| {
                    let (t, cubic) = cubic(k);
                    [0.25, 0.5, 0.75].into_iter().all(|u| {
                        let (got, want) = (cubic.at(u * cubic.length), end(span, t + u * width));
                        norm3(&combine(&got.position, &want.position, |a, b| a - b), 0) <= FIT_MM
                    })
                });
                if fits || halving == HALVINGS {
                    (0..parts).for_each(|k| emit(cubic(k).1));
                    break;
                }
                parts *= 2;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lift(p: [f64; 2], _: bool) -> Vector {
        [p[0], p[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    fn point(first: f64, second: f64, weight: f64) -> ControlPoint {
        ControlPoint { first, second, weight }
    }

    #[test]
    fn a_cubic_of_four_points_is_one_exact_piece() {
        let points =
            [point(0.0, 0.0, 1.0), point(0.0, 10.0, 1.0), point(20.0, 10.0, 1.0), point(20.0, 0.0, 1.0)];
        let mut pieces = 0;
        Spline::new(&points, &[], 4, 1.0).unwrap().cubics(lift, |cubic| {
            pieces += 1;
            // Bernstein form at t = 1/3.
            let got = cubic.at(cubic.length / 3.0).position;
            let t = 1.0_f64 / 3.0;
            let x = 3.0 * t * t * (1.0 - t) * 20.0 + t * t * t * 20.0;
            let y = 3.0 * t * (1.0 - t) * (1.0 - t) * 10.0 + 3.0 * t * t * (1.0 - t) * 10.0;
            assert!((got[0] - x).abs() < 1e-12 && (got[1] - y).abs() < 1e-12, "{got:?} {x} {y}");
        });
        assert_eq!(pieces, 1);
    }

    #[test]
    fn a_rational_quadratic_is_a_circle() {
        let w = 0.5_f64.sqrt();
        let points = [point(10.0, 0.0, 1.0), point(10.0, 10.0, w), point(0.0, 10.0, 1.0)];
        let mut last: Option<Blend> = None;
        let mut pieces = 0;
        Spline::new(&points, &[], 3, 1.0).unwrap().cubics(lift, |cubic| {
            pieces += 1;
            for k in 0..=20 {
                let p = cubic.at(cubic.length * f64::from(k) / 20.0).position;
                let r = (p[0] * p[0] + p[1] * p[1]).sqrt();
                assert!((r - 10.0).abs() < 2e-9, "{r}");
            }
            if let Some(last) = last {
                let (a, b) = (last.at(last.length).first, cubic.at(0.0).first);
                assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12, "a seam: {a:?} {b:?}");
            }
            last = Some(cubic);
        });
        assert!(pieces > 1);
    }

    #[test]
    fn a_long_spline_passes_its_ends_and_stays_smooth() {
        let points: [ControlPoint; 7] =
            core::array::from_fn(|i| point(5.0 * i as f64, [0.0, 4.0, -3.0, 8.0, 2.0, -1.0, 0.5][i], 1.0));
        let mut last: Option<Blend> = None;
        Spline::new(&points, &[], 4, 1.0).unwrap().cubics(lift, |cubic| {
            let begin = cubic.at(0.0);
            match last {
                None => assert!(begin.position[0].abs() + begin.position[1].abs() < 1e-12),
                Some(last) => {
                    let end = last.at(last.length);
                    for i in 0..9 {
                        assert!((end.position[i] - begin.position[i]).abs() < 1e-12);
                        assert!((end.first[i] - begin.first[i]).abs() < 1e-12);
                    }
                }
            }
            last = Some(cubic);
        });
        let last = last.unwrap();
        let end = last.at(last.length).position;
        assert!((end[0] - 30.0).abs() < 1e-12 && (end[1] - 0.5).abs() < 1e-12, "{end:?}");
    }
}
