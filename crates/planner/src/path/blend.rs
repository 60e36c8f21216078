//! Corner blends: a cubic that leaves one piece and joins the next with continuous dX/ds.
//!
//! Between two lines it is the parabola with the corner as its control point: with `d` the distance cut off on
//! both sides, it stays within `d |e₂ − e₁| / 4` of the corner, so `d = min(L₁/2, L₂/2, 4P/|e₂ − e₁|)` keeps
//! the deviation within P by construction. With an arc on either side the deviation is measured and `d` halved
//! until it is within P.

use super::{Geometry, Point, Vector, combine, norm3};

/// How far a blend may leave the programmed path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// XYZ and UVW, each, mm (G64 P).
    pub length_mm: f64,
    /// A, B and C together, rad.
    pub angle_rad: f64,
}

impl Tolerance {
    /// The largest k with k·v within the tolerance.
    fn multiple(&self, v: &Vector) -> f64 {
        let length = norm3(v, 0).max(norm3(v, 6));
        let by_length = if length > 0.0 { self.length_mm / length } else { f64::INFINITY };
        let angle = norm3(v, 3);
        let by_angle = if angle > 0.0 { self.angle_rad / angle } else { f64::INFINITY };
        by_length.min(by_angle)
    }
}

/// X(w) = c₀ + c₁ w + c₂ w² + c₃ w³, w = s / length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blend {
    /// c₀ to c₃.
    pub coefficients: [Vector; 4],
    /// Parameter length, twice what is cut off on each side.
    pub length: f64,
}

impl Blend {
    /// Blends the end of `before` into the start of `after`. Returns how much is cut off on each side (in either's
    /// parameter) with the blend; `None` if nothing can be cut off or the direction turns right back.
    pub fn new(before: &Geometry, after: &Geometry, tolerance: Tolerance) -> Option<(f64, Self)> {
        let (e1, e2) = (before.tangent(before.length()), after.tangent(0.0));
        let turn = combine(&e2, &e1, |b, a| b - a);
        let back = combine(&e2, &e1, |b, a| b + a);
        if norm3(&back, 0).max(norm3(&back, 6)).max(norm3(&back, 3)) < 1e-6 {
            return None;
        }
        let room = 0.5 * before.length().min(after.length());
        let mut d = room.min(4.0 * tolerance.multiple(&turn));
        let straight = matches!((before, after), (Geometry::Line(_), Geometry::Line(_)));
        for _ in 0..60 {
            if !(d > 1e-10) {
                return None;
            }
            let a = before.at(before.length() - d);
            let b = after.at(d);
            let blend = Self::hermite(&a, &b, 2.0 * d);
            if straight || blend.deviates_within(before, after, d, tolerance) {
                return Some((d, blend));
            }
            d *= 0.5;
        }
        None
    }

    /// The cubic from `a` to `b` with their derivatives, over a parameter length.
    pub(super) fn hermite(a: &Point, b: &Point, length: f64) -> Self {
        let chord = combine(&b.position, &a.position, |b, a| b - a);
        let (m0, m1) = (a.first.map(|x| x * length), b.first.map(|x| x * length));
        let c2 = combine(&combine(&m0, &m1, |p, q| 2.0 * p + q), &chord, |m, c| 3.0 * c - m);
        let c3 = combine(&combine(&m0, &m1, |p, q| p + q), &chord, |m, c| m - 2.0 * c);
        Blend { coefficients: [a.position, m0, c2, c3], length }
    }

    /// Compares with the path at the same parameter, which is never nearer than the path itself.
    fn deviates_within(&self, before: &Geometry, after: &Geometry, d: f64, tolerance: Tolerance) -> bool {
        const SAMPLES: u8 = 16;
        // Between the samples the distance differs by less than this share of itself.
        const MARGIN: f64 = 1.05;
        (1..SAMPLES).all(|k| {
            let s = 2.0 * d * f64::from(k) / f64::from(SAMPLES);
            let path = if s < d { before.at(before.length() - d + s) } else { after.at(s - d) };
            let off = combine(&self.at(s).position, &path.position, |a, b| (a - b) * MARGIN);
            tolerance.multiple(&off) >= 1.0
        })
    }

    #[inline]
    pub(super) fn at(&self, s: f64) -> Point {
        let [c0, c1, c2, c3] = &self.coefficients;
        let k = 1.0 / self.length;
        let w = s * k;
        let mut point = Point { position: [0.0; 9], first: [0.0; 9], second: [0.0; 9] };
        for i in 0..9 {
            let (c2, c3) = (c2[i], c3[i]);
            point.position[i] = c0[i] + (c1[i] + (c2 + c3 * w) * w) * w;
            point.first[i] = (c1[i] + (2.0 * c2 + 3.0 * c3 * w) * w) * k;
            point.second[i] = (2.0 * c2 + 6.0 * c3 * w) * k * k;
        }
        point
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Arc, Line};
    use super::*;
    use pkm_kins::maths::sqrt;

    const P: Tolerance = Tolerance { length_mm: 0.1, angle_rad: 0.01 };

    fn xy(x: f64, y: f64) -> Vector {
        [x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    #[test]
    fn right_angle_between_lines_uses_the_whole_tolerance() {
        let a = Geometry::Line(Line::new(xy(0.0, 0.0), xy(10.0, 0.0)).unwrap());
        let b = Geometry::Line(Line::new(xy(10.0, 0.0), xy(10.0, 10.0)).unwrap());
        let (d, blend) = Blend::new(&a, &b, P).unwrap();
        assert!((d - 0.4 / 2f64.sqrt()).abs() < 1e-12, "{d}");
        let mid = blend.at(d).position;
        let off = sqrt((mid[0] - 10.0) * (mid[0] - 10.0) + mid[1] * mid[1]);
        assert!((off - 0.1).abs() < 1e-12, "{off}");
        let end = blend.at(2.0 * d);
        assert!((end.first[1] - 1.0).abs() < 1e-12 && end.first[0].abs() < 1e-12);
    }

    #[test]
    fn blend_between_line_and_arc_stays_within_tolerance_of_both() {
        let a = Geometry::Line(Line::new(xy(-10.0, 3.0), xy(5.0, 0.0)).unwrap());
        let b = Geometry::Arc(Arc::new(xy(5.0, 0.0), xy(-5.0, 0.0), [0.0; 3], [0.0, 0.0, 1.0], 1).unwrap());
        let (d, blend) = Blend::new(&a, &b, P).unwrap();
        let mut worst = 0.0_f64;
        for k in 0..=1000 {
            let p = blend.at(2.0 * d * f64::from(k) / 1000.0).position;
            let to_arc = ((p[0] * p[0] + p[1] * p[1]).sqrt() - 5.0).abs();
            let t = 15.0 / (15.0_f64 * 15.0 + 9.0).sqrt();
            let n = 3.0 / (15.0_f64 * 15.0 + 9.0).sqrt();
            let to_line = ((p[0] - 5.0) * n + p[1] * t).abs();
            worst = worst.max(to_arc.min(to_line));
        }
        assert!(worst <= 0.1 && worst > 0.001, "{worst}");
    }
}
