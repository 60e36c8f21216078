//! Circular arc, helix and spiral in any plane of XYZ; the other coordinates go linearly with the angle.

use super::{Point, Vector, combine};
use pkm_kins::maths::{TAU, atan2, sincos, sqrt};

/// An arc about `base`: XYZ(s) = base + r(s) (u cos θ + v sin θ) + rate s, with θ = ω s and r = r₀ + ρ s.
/// Unequal end radii (which RS274/NGC tolerates within limits) make a spiral, so the end point is exact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Centre (XYZ) and the other coordinates at s = 0.
    pub base: Vector,
    /// Linear part per s: the helix along the normal, and the other coordinates.
    pub rate: Vector,
    /// Unit vector from the centre to the start.
    pub u: [f64; 3],
    /// Unit vector at a right angle to it, counter-clockwise about the plane's normal.
    pub v: [f64; 3],
    /// Radius at the start, mm.
    pub radius_mm: f64,
    /// dr/ds of a spiral, 0 for a circle.
    pub radius_rate: f64,
    /// dθ/ds, rad/mm; negative = clockwise.
    pub angle_rate: f64,
    /// Parameter length, mm.
    pub length: f64,
}

impl Arc {
    /// The arc from `start` to `end` about the axis through `centre` (XYZ, mm) along the unit `normal`;
    /// `turns` as in `ARC_FEED`: the sign is the direction, |turns| the number of turns begun (0 makes no arc).
    /// `None` if the start lies on the axis.
    pub fn new(start: Vector, end: Vector, centre: [f64; 3], normal: [f64; 3], turns: i32) -> Option<Self> {
        let xyz = |p: &Vector| [p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]];
        let (from, to) = (xyz(&start), xyz(&end));
        let (height_from, height_to) = (dot(from, normal), dot(to, normal));
        let from = minus(from, normal, height_from);
        let to = minus(to, normal, height_to);
        let (r0, r1) = (sqrt(dot(from, from)), sqrt(dot(to, to)));
        if !(r0 > 1e-12) || !(r1 > 1e-12) || turns == 0 {
            return None;
        }
        let u = from.map(|x| x / r0);
        let v = cross(normal, u);
        // Angle of the end counted from the start, in (0, 2π]: equal points are a full turn (RS274/NGC 3.5.3).
        let mut sweep = atan2(dot(to, v), dot(to, u));
        let full = f64::from(turns.unsigned_abs() - 1) * TAU;
        // Rounding must not turn a full circle into no motion or the other way round: below this the points are one.
        let same = 1e-9;
        if turns > 0 {
            if sweep <= same {
                sweep += TAU;
            }
            sweep += full;
        } else {
            if sweep >= -same {
                sweep -= TAU;
            }
            sweep -= full;
        }
        let height = height_to - height_from;
        let around = 0.5 * (r0 + r1) * sweep.abs();
        let length = sqrt(around * around + height * height);
        if !length.is_finite() || !(length > 1e-12) {
            return None;
        }
        let mut base = start;
        let mut rate = [0.0; 9];
        for (i, (b, r)) in base.iter_mut().zip(rate.iter_mut()).enumerate() {
            if let (Some(c), Some(n)) = (centre.get(i), normal.get(i)) {
                *b = c + n * height_from;
                *r = n * height / length;
            } else if let (Some(a), Some(z)) = (start.get(i), end.get(i)) {
                *r = (z - a) / length;
            }
        }
        Some(Arc {
            base,
            rate,
            u,
            v,
            radius_mm: r0,
            radius_rate: (r1 - r0) / length,
            angle_rate: sweep / length,
            length,
        })
    }

    #[inline]
    pub(super) fn at(&self, s: f64) -> Point {
        let w = self.angle_rate;
        let (sine, cosine) = sincos(w * s);
        let (r, rho) = (self.radius_mm + self.radius_rate * s, self.radius_rate);
        let mut point = Point {
            position: combine(&self.base, &self.rate, |base, rate| base + rate * s),
            first: self.rate,
            second: [0.0; 9],
        };
        for i in 0..3 {
            let (u, v) = (self.u[i], self.v[i]);
            let (radial, tangential) = (u * cosine + v * sine, v * cosine - u * sine);
            point.position[i] += r * radial;
            point.first[i] += rho * radial + r * w * tangential;
            point.second[i] = 2.0 * rho * w * tangential - r * w * w * radial;
        }
        point
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: [f64; 3], n: [f64; 3], k: f64) -> [f64; 3] {
    [a[0] - n[0] * k, a[1] - n[1] * k, a[2] - n[2] * k]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::super::norm3;
    use super::*;

    #[test]
    fn quarter_full_and_double_turn_end_where_told() {
        let start = [10.0, 0.0, 1.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0];
        let n = [0.0, 0.0, 1.0];
        let mut end = [0.0, 10.0, 3.0, 0.0, 0.0, 0.0, 7.0, 0.0, 0.0];
        let quarter = Arc::new(start, end, [0.0; 3], n, 1).unwrap();
        let at_end = quarter.at(quarter.length).position;
        for (got, want) in at_end.iter().zip(end) {
            assert!((got - want).abs() < 1e-12, "{at_end:?}");
        }
        assert!((norm3(&quarter.at(1.0).first, 0) - 1.0).abs() < 1e-12);
        end = start;
        let double = Arc::new(start, end, [0.0; 3], n, -2).unwrap();
        assert!((double.length - 40.0 * core::f64::consts::PI).abs() < 1e-9);
        assert!(double.at(1.0).position[1] < 0.0, "G2 is clockwise");
    }

    #[test]
    fn derivatives_match_differences_on_a_spiral() {
        let start = [10.0, 0.0, 1.0, 0.1, 0.0, 0.0, 5.0, 0.0, 0.0];
        let end = [0.0, 11.0, 3.0, 0.3, 0.0, 0.0, 7.0, 0.0, 0.0];
        let arc = Arc::new(start, end, [0.0; 3], [0.0, 0.0, 1.0], 2).unwrap();
        let (s, h) = (7.0, 1e-4);
        let (a, b, c) = (arc.at(s - h), arc.at(s), arc.at(s + h));
        for i in 0..9 {
            assert!(((c.position[i] - a.position[i]) / (2.0 * h) - b.first[i]).abs() < 1e-8);
            assert!(((c.first[i] - a.first[i]) / (2.0 * h) - b.second[i]).abs() < 1e-8);
        }
    }
}
