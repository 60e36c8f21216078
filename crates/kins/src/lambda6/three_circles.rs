//! The planar three-circle problem (planar 3-RPR) that remains of the forward kinematics: x, y and yaw.
//!
//! Newton from a warm start, or every real solution from a trigonometric polynomial; both bounded.

use super::{Lambda6, Leg};
use crate::attitude::yawed;
use crate::kinematics::Branches;
use crate::maths::{PI, TAU, cos, fabs, sin, sincos, sqrt};
use crate::vector::{Vec3, add, cross, dot, scale};

/// What the joints fix in closed form: ρᵢ, and the tilted platform joints.
pub(super) struct Circles {
    pub(super) rho: [f64; 3],
    /// qᵢ, tilted but not yet yawed.
    pub(super) arms: [Vec3; 3],
    pub(super) z: f64,
    pub(super) psi: f64,
    pub(super) theta: f64,
}

/// The unknowns of the three-circle problem.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Planar3 {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) phi: f64,
}

/// To (−π, π].
pub(super) fn wrap(angle: f64) -> f64 {
    // The angles here are at most a few turns, so the loop is bounded.
    let mut angle = angle;
    for _ in 0..16 {
        if angle > PI {
            angle -= TAU;
        } else if angle <= -PI {
            angle += TAU;
        }
    }
    angle
}

impl Lambda6 {
    /// Newton on the three circles. Returns the solution and σ, `None` if it did not converge; `solves` counts its steps.
    ///
    /// Source: standard Newton. Assumes all ρ > 0. Guarantee: an accepted result has |F| < 1e-10 mm. Cost: at most 16 solves
    /// and 17 evaluations.
    pub(super) fn newton(
        &self,
        circles: &Circles,
        start: Planar3,
        solves: &mut u32,
    ) -> Option<(Planar3, f64)> {
        let mut now = start;
        for _ in 0..17 {
            let yaw = sincos(now.phi);
            let mut residuals = [0.0; 3];
            let mut rows = [[0.0; 3]; 3];
            let each = self.legs.iter().zip(circles.arms).zip(circles.rho);
            for (((leg, arm), rho), (residual, row)) in each.zip(residuals.iter_mut().zip(rows.iter_mut())) {
                let m = yawed(yaw, arm);
                let w = [m[0] + now.x - leg.shaft[0], m[1] + now.y - leg.shaft[1]];
                let inverse = 1.0 / rho;
                *residual = 0.5 * (w[0] * w[0] + w[1] * w[1] - rho * rho) * inverse;
                *row = [w[0] * inverse, w[1] * inverse, (m[0] * w[1] - m[1] * w[0]) * inverse];
            }
            let [a, b, c] = rows;
            let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
            let det = dot(a, bc);
            let worst = fabs(residuals[0]).max(fabs(residuals[1])).max(fabs(residuals[2]));
            if worst < 1e-10 {
                // Rows in the order 1, 3, 2.
                return Some((now, -det / self.platform_radius));
            }
            if !(fabs(det) > 1e-9) {
                return None;
            }
            *solves = solves.saturating_add(1);
            // Inverse of a matrix with rows a, b, c: columns b×c, c×a, a×b over the determinant.
            let step = scale(
                -1.0 / det,
                add(add(scale(residuals[0], bc), scale(residuals[1], ca)), scale(residuals[2], ab)),
            );
            let longest = sqrt(step[0] * step[0] + step[1] * step[1]) / (self.base_radius / 4.0);
            let widest = fabs(step[2]) / 0.5;
            let shrink = longest.max(widest).max(1.0);
            now = Planar3 {
                x: now.x + step[0] / shrink,
                y: now.y + step[1] / shrink,
                phi: now.phi + step[2] / shrink,
            };
            if !(now.x.is_finite() && now.y.is_finite() && now.phi.is_finite()) {
                return None;
            }
        }
        None
    }

    /// P, det and F of the eliminated problem at one yaw: (x, y) = P/det, F = |P + det m₁|² − det² ρ₁².
    fn eliminated(&self, circles: &Circles, phi: f64) -> ([f64; 2], f64, f64) {
        let yaw = sincos(phi);
        let [l1, l2, l3] = &self.legs;
        let [q1, q2, q3] = circles.arms;
        let [rho1, rho2, rho3] = circles.rho;
        let centre = |leg: &Leg, q: Vec3| {
            let m = yawed(yaw, q);
            [m[0] - leg.shaft[0], m[1] - leg.shaft[1]]
        };
        let (m1, m2, m3) = (centre(l1, q1), centre(l2, q2), centre(l3, q3));
        let a = [m2[0] - m1[0], m2[1] - m1[1]];
        let b = [m3[0] - m1[0], m3[1] - m1[1]];
        let square = |m: [f64; 2]| m[0] * m[0] + m[1] * m[1];
        let s = 0.5 * (rho2 * rho2 - rho1 * rho1 - square(m2) + square(m1));
        let t = 0.5 * (rho3 * rho3 - rho1 * rho1 - square(m3) + square(m1));
        let det = a[0] * b[1] - a[1] * b[0];
        let p = [s * b[1] - t * a[1], a[0] * t - b[0] * s];
        let n = [p[0] + det * m1[0], p[1] + det * m1[1]];
        (p, det, n[0] * n[0] + n[1] * n[1] - det * det * rho1 * rho1)
    }

    /// Every real solution of the three-circle problem for the upright platform with its σ: at most six.
    ///
    /// F(φ) is a trigonometric polynomial of degree 3: seven samples give its coefficients; 72 cells are searched for sign
    /// changes of F and, for pairs of roots within a cell, of F'. Cost: at most 72 × 3 bisections of 60 steps; always ends.
    pub(super) fn all_solutions(&self, circles: &Circles, solves: &mut u32) -> Branches<(Planar3, f64)> {
        let mut all = Branches::new();
        let mut series = Series { mean: 0.0, harmonics: [[0.0; 2]; 3] };
        let mut sample = 0.0;
        for _ in 0..7 {
            let phi = TAU * sample / 7.0;
            let (_, _, f) = self.eliminated(circles, phi);
            series.mean += f / 7.0;
            let mut order = 1.0;
            for harmonic in &mut series.harmonics {
                harmonic[0] += f * cos(order * phi) * (2.0 / 7.0);
                harmonic[1] += f * sin(order * phi) * (2.0 / 7.0);
                order += 1.0;
            }
            sample += 1.0;
        }
        let mut keep = |phi: f64| {
            let (p, det, _) = self.eliminated(circles, phi);
            let (x, y) = (p[0] / det, p[1] / det);
            if !(x.is_finite() && y.is_finite()) {
                return;
            }
            if let Some((mut found, sigma)) = self.newton(circles, Planar3 { x, y, phi }, solves) {
                found.phi = wrap(found.phi);
                let known = |(other, _): &(Planar3, f64)| {
                    fabs(wrap(other.phi - found.phi)) < 1e-7 && fabs(other.x - found.x) < 1e-4
                };
                if !all.as_slice().iter().any(known) {
                    all.push((found, sigma));
                }
            }
        };
        const CELL: f64 = TAU / 72.0;
        let mut low = -PI;
        let mut at_low = series.value(low);
        for _ in 0..72 {
            let high = low + CELL;
            let at_high = series.value(high);
            if at_low[0] * at_high[0] <= 0.0 {
                keep(bisect(low, high, |phi| series.value(phi)[0]));
            } else if at_low[1] * at_high[1] < 0.0 {
                let extremum = bisect(low, high, |phi| series.value(phi)[1]);
                if series.value(extremum)[0] * at_low[0] <= 0.0 {
                    keep(bisect(low, extremum, |phi| series.value(phi)[0]));
                    keep(bisect(extremum, high, |phi| series.value(phi)[0]));
                }
            }
            (low, at_low) = (high, at_high);
        }
        all
    }
}

/// A trigonometric polynomial of degree 3.
struct Series {
    mean: f64,
    harmonics: [[f64; 2]; 3],
}

impl Series {
    /// F and F'.
    fn value(&self, phi: f64) -> [f64; 2] {
        let (mut f, mut slope, mut order) = (self.mean, 0.0, 1.0);
        for [a, b] in self.harmonics {
            let (s, c) = sincos(order * phi);
            f += a * c + b * s;
            slope += order * (b * c - a * s);
            order += 1.0;
        }
        [f, slope]
    }
}

/// Root of a function that changes sign between the ends: 60 halvings.
fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let sign = f(low);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) * sign > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
