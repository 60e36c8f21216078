//! Pieces of exact boundaries: segments, and arcs of ellipses (circles among them), with closed-form areas.
//!
//! Every boundary of a planar P-R-R mechanism is one of these: a slider at an end of its travel moves the platform on a
//! circle, a link square to its guide on a line, parallel links on an ellipse.

use pkm_kins::Vec2;
use pkm_kins::maths::{TAU, acos, atan2, cos, hypot, sin, sincos};

/// Two points nearer than this are one, mm. Tangencies are found to about √ε l ≈ 3e-6 mm.
pub(crate) const SAME_MM: f64 = 1e-4;

/// A directed piece of a curve, mm and rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// A straight line between two points.
    Segment {
        /// Where it begins.
        from: Vec2,
        /// Where it ends.
        to: Vec2,
    },
    /// centre + u cos φ + v sin φ for φ from `start` to `end`, in either sense; a circle if u ⟂ v and |u| = |v|.
    Arc {
        /// Centre.
        centre: Vec2,
        /// First half axis.
        u: Vec2,
        /// Second half axis (conjugate to the first).
        v: Vec2,
        /// First angle.
        start: f64,
        /// Last angle.
        end: f64,
    },
}

pub(crate) fn cross(a: Vec2, b: Vec2) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(crate) fn dot(a: Vec2, b: Vec2) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(crate) fn sub(a: Vec2, b: Vec2) -> Vec2 {
    [a[0] - b[0], a[1] - b[1]]
}

/// a + k b
pub(crate) fn plus(a: Vec2, k: f64, b: Vec2) -> Vec2 {
    [a[0] + k * b[0], a[1] + k * b[1]]
}

pub(crate) fn distance(a: Vec2, b: Vec2) -> f64 {
    hypot(a[0] - b[0], a[1] - b[1])
}

impl Curve {
    /// The point at a share of the piece, 0 ≤ `share` ≤ 1.
    pub fn at(&self, share: f64) -> Vec2 {
        match *self {
            Self::Segment { from, to } => plus(from, share, sub(to, from)),
            Self::Arc { centre, u, v, start, end } => {
                let (s, c) = sincos(start + share * (end - start));
                plus(plus(centre, c, u), s, v)
            }
        }
    }

    /// The direction of travel there, not of unit length.
    fn tangent(&self, share: f64) -> Vec2 {
        match *self {
            Self::Segment { from, to } => sub(to, from),
            Self::Arc { u, v, start, end, .. } => {
                let (s, c) = sincos(start + share * (end - start));
                let turn = if end < start { -1.0 } else { 1.0 };
                plus([-s * u[0] * turn, -s * u[1] * turn], c * turn, v)
            }
        }
    }

    /// Unit vector to the left of the direction of travel.
    pub(crate) fn left(&self, share: f64) -> Option<Vec2> {
        let [x, y] = self.tangent(share);
        let length = hypot(x, y);
        (length > 0.0).then(|| [-y / length, x / length])
    }

    /// The same piece in the other direction.
    pub(crate) fn reversed(self) -> Self {
        match self {
            Self::Segment { from, to } => Self::Segment { from: to, to: from },
            Self::Arc { centre, u, v, start, end } => Self::Arc { centre, u, v, start: end, end: start },
        }
    }

    /// The part between two shares.
    pub(crate) fn part(&self, first: f64, last: f64) -> Self {
        match *self {
            Self::Segment { .. } => Self::Segment { from: self.at(first), to: self.at(last) },
            Self::Arc { centre, u, v, start, end } => {
                let angle = |share: f64| start + share * (end - start);
                Self::Arc { centre, u, v, start: angle(first), end: angle(last) }
            }
        }
    }

    /// ½ ∫ (x dy − y dx) along the piece: the areas of a closed loop's pieces sum up to its area (Green).
    pub(crate) fn area(&self) -> f64 {
        match *self {
            Self::Segment { from, to } => 0.5 * cross(from, to),
            Self::Arc { centre, u, v, start, end } => {
                let ((s0, c0), (s1, c1)) = (sincos(start), sincos(end));
                let drift = cross(centre, u) * (c1 - c0) + cross(centre, v) * (s1 - s0);
                0.5 * (drift + cross(u, v) * (end - start))
            }
        }
    }

    /// Length, mm: exact for segments and circles, at most this for ellipses.
    pub(crate) fn length(&self) -> f64 {
        match *self {
            Self::Segment { from, to } => distance(from, to),
            Self::Arc { u, v, start, end, .. } => {
                let (a, b) = (hypot(u[0], u[1]), hypot(v[0], v[1]));
                (end - start).abs() * if (a - b).abs() < 1e-9 * a { a } else { hypot(a, b) }
            }
        }
    }

    /// Appends points of the piece, its end not among them, with chords at most `tolerance_mm` off the curve.
    pub(crate) fn points(&self, tolerance_mm: f64, into: &mut Vec<Vec2>) {
        let count = match *self {
            Self::Segment { .. } => 1,
            Self::Arc { u, v, start, end, .. } => {
                // sagitta r (1 − cos(step/2)) ≤ r step²/8
                let r = hypot(u[0], u[1]).max(hypot(v[0], v[1]));
                let step = (8.0 * tolerance_mm / r).sqrt();
                ((end - start).abs() / step).ceil().clamp(1.0, 10_000.0) as usize
            }
        };
        into.extend((0..count).map(|k| self.at(k as f64 / count as f64)));
    }

    /// Points of the piece from end to end, chords at most `tolerance_mm` off.
    pub fn polyline(&self, tolerance_mm: f64) -> Vec<Vec2> {
        let mut points = Vec::new();
        self.points(tolerance_mm, &mut points);
        points.push(self.at(1.0));
        points
    }

    /// The share at which the piece passes `point`, if it does within [`SAME_MM`].
    pub(crate) fn share_of(&self, point: Vec2) -> Option<f64> {
        let share = match *self {
            Self::Segment { from, to } => {
                let d = sub(to, from);
                dot(sub(point, from), d) / dot(d, d)
            }
            Self::Arc { .. } => self.share_of_angle(self.angle_of(point)?)?,
        };
        let share = share.clamp(0.0, 1.0);
        (distance(self.at(share), point) <= SAME_MM).then_some(share)
    }

    /// The angle of a point as seen from the arc's centre, in the arc's own axes.
    fn angle_of(&self, point: Vec2) -> Option<f64> {
        let [c, s] = self.own(point)?;
        Some(atan2(s, c))
    }

    /// A point in the frame in which the arc is a unit circle.
    fn own(&self, point: Vec2) -> Option<Vec2> {
        let Self::Arc { centre, u, v, .. } = *self else { return None };
        let det = cross(u, v);
        let d = sub(point, centre);
        (det != 0.0).then(|| [cross(d, v) / det, cross(u, d) / det])
    }

    /// The share of an angle, turned by full turns into the arc's range; slightly outside counts as an end.
    fn share_of_angle(&self, angle: f64) -> Option<f64> {
        let Self::Arc { start, end, .. } = *self else { return None };
        let (low, span) = (start.min(end), (end - start).abs());
        let mut past = (angle - low) % TAU;
        if past < 0.0 {
            past += TAU;
        }
        if past > span + 0.5 * (TAU - span) {
            past -= TAU;
        }
        let share = past / span;
        let slack = 1e-6 / span;
        if share < -slack || share > 1.0 + slack {
            return None;
        }
        let share = share.clamp(0.0, 1.0);
        Some(if end < start { 1.0 - share } else { share })
    }

    /// Points in which two pieces meet or touch.
    pub(crate) fn meet(&self, other: &Self) -> Vec<Vec2> {
        let candidates = match (self, other) {
            (Self::Segment { from: a, to: b }, Self::Segment { from: c, to: d }) => {
                let (p, q) = (sub(*b, *a), sub(*d, *c));
                let det = cross(p, q);
                if det == 0.0 {
                    return Vec::new();
                }
                vec![plus(*a, cross(sub(*c, *a), q) / det, p)]
            }
            (Self::Arc { .. }, Self::Segment { from, to }) => self.crossings(*from, *to),
            (Self::Segment { from, to }, Self::Arc { .. }) => other.crossings(*from, *to),
            (Self::Arc { .. }, Self::Arc { .. }) => self.on_the_other(other),
        };
        let meets = |p: &Vec2| {
            p[0].is_finite()
                && p[1].is_finite()
                && self.share_of(*p).is_some()
                && other.share_of(*p).is_some()
        };
        candidates.into_iter().filter(meets).collect()
    }

    /// Points of the arc's whole ellipse on a line: A cos φ + B sin φ = C.
    fn crossings(&self, from: Vec2, to: Vec2) -> Vec<Vec2> {
        let Self::Arc { centre, u, v, .. } = *self else { return Vec::new() };
        let d = sub(to, from);
        let (a, b, c) = (cross(d, u), cross(d, v), -cross(d, sub(centre, from)));
        let r = hypot(a, b);
        let ratio = c / r;
        // Touching within rounding counts.
        if !(ratio.abs() <= 1.0 + 1e-12) {
            return Vec::new();
        }
        let (middle, half) = (atan2(b, a), acos(ratio.clamp(-1.0, 1.0)));
        [middle - half, middle + half]
            .map(|phi| plus(plus(centre, cos(phi), u), sin(phi), v))
            .into_iter()
            .collect()
    }

    /// Points of `self` on the whole ellipse of `other`, where g(φ) = |own(self(φ))|² − 1 = 0: a trigonometric polynomial of
    /// degree 2 with at most four roots. Found by sign changes in cells, and between roots of the derivative where a cell
    /// hides two.
    fn on_the_other(&self, other: &Self) -> Vec<Vec2> {
        const CELLS: u32 = 96;
        let g = |share: f64| other.own(self.at(share)).map_or(f64::NAN, |p| dot(p, p) - 1.0);
        let mut found = Vec::new();
        for k in 0..CELLS {
            let (low, high) = (f64::from(k) / f64::from(CELLS), f64::from(k + 1) / f64::from(CELLS));
            let (g_low, g_high) = (g(low), g(high));
            if g_low == 0.0 {
                found.push(self.at(low));
            }
            if g_low * g_high < 0.0 {
                found.push(self.at(bisect(&g, low, high)));
                continue;
            }
            // A pair of roots, or a touch: the extremum between.
            let extremum = ternary(&|x| g(x) * g_low.signum(), low, high);
            let g_mid = g(extremum);
            if g_low * g_mid < 0.0 {
                found.push(self.at(bisect(&g, low, extremum)));
                found.push(self.at(bisect(&g, extremum, high)));
            } else if g_mid.abs() < 1e-11 {
                found.push(self.at(extremum));
            }
        }
        found
    }
}

/// A root of `f` between two places where its signs differ.
fn bisect(f: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let sign = f(low) < 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (f(middle) < 0.0) == sign { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A minimum of `f` in a range in which it has one.
fn ternary(f: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..40 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if f(a) < f(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}
