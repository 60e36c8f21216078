//! The path: pieces in all nine coordinates, each with exact first and second derivatives along its parameter s.
//!
//! The parameter runs from 0 to `length()`. On lines and arcs |dX/ds| of XYZ is 1 where XYZ moves; where only
//! UVW moves it is their length, and a purely rotary move uses its angle (rad). Blends keep dX/ds continuous,
//! so pieces may be scaled differently.

mod arc;
mod blend;
mod line;
mod spline;

pub use arc::Arc;
pub use blend::{Blend, Tolerance};
pub use line::Line;
pub use spline::{MAX_ORDER, Spline};

use pkm_kins::Pose;
use pkm_kins::maths::{self, TAU, sqrt};

const EIGHTH_TURN: f64 = TAU / 8.0;

/// Nine coordinates or their derivatives, in letter order (mm, rad).
pub type Vector = [f64; 9];

/// A point of a path with its derivatives along s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// X(s): mm, rad
    pub position: Vector,
    /// dX/ds
    pub first: Vector,
    /// d²X/ds²
    pub second: Vector,
}

/// A point as the kinematics want it.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    pub(crate) pose: Pose,
    pub(crate) first: Pose,
    pub(crate) second: Pose,
}

impl Place {
    pub(crate) const ZERO: Self = Self { pose: Pose::ZERO, first: Pose::ZERO, second: Pose::ZERO };

    #[inline(always)]
    fn set(&mut self, point: &Point) {
        self.pose = Pose::from_array(point.position);
        self.first = Pose::from_array(point.first);
        self.second = Pose::from_array(point.second);
    }
}

/// Which coordinates the feed counts, for one move. The rule is LinuxCNC's: XYZ if they move, else UVW, else ABC. In a blend
/// between moves of different groups each counts its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum FeedGroup {
    Xyz,
    Uvw,
    Abc,
}

/// The shape of one piece.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub enum Geometry {
    Line(Line),
    Arc(Arc),
    Blend(Blend),
    /// No motion: a dwell at this place.
    Hold(Vector),
}

impl Geometry {
    /// Parameter length (≥ 0).
    pub fn length(&self) -> f64 {
        match self {
            Geometry::Line(line) => line.length,
            Geometry::Arc(arc) => arc.length,
            Geometry::Blend(blend) => blend.length,
            Geometry::Hold(_) => 0.0,
        }
    }

    /// dX/ds at s.
    pub(crate) fn tangent(&self, s: f64) -> Vector {
        match self {
            Geometry::Line(line) => line.direction,
            _ => self.at(s).first,
        }
    }

    /// How far it turns, rad: A, B and C (at least), and about an arc's centre.
    fn turning(&self) -> (f64, f64) {
        match self {
            Geometry::Line(line) => (norm3(&line.direction, 3) * line.length, 0.0),
            Geometry::Arc(arc) => (norm3(&arc.rate, 3) * arc.length, arc.angle_rate.abs() * arc.length),
            Geometry::Blend(blend) => {
                let [_, c1, c2, c3] = &blend.coefficients;
                (norm3(c1, 3) + 2.0 * norm3(c2, 3) + 3.0 * norm3(c3, 3), 0.0)
            }
            Geometry::Hold(_) => (0.0, 0.0),
        }
    }

    /// The longest step, in s, over which it turns so little that what lies between cannot go unseen: a turn later everything looks
    /// the same.
    pub(crate) fn longest_step(&self) -> f64 {
        let (rad, round) = self.turning();
        let turned = rad.max(round);
        if turned > EIGHTH_TURN { self.length() * (EIGHTH_TURN / turned) } else { f64::INFINITY }
    }

    /// Into how many parts it is cut to be looked at `spacing_mm` apart (of XYZ or UVW), or 0.02 rad (of ABC), or an eighth of a turn
    /// about an arc's centre; at least 1, at most `most`.
    pub fn places(&self, spacing_mm: f64, most: u32) -> u32 {
        const SPACING_RAD: f64 = 0.02;
        let (rad, round) = self.turning();
        let uvw = norm3(&self.tangent(0.0), 6);
        let mm = self.length() * uvw.max(1.0);
        let count = maths::ceil((mm / spacing_mm).max(rad / SPACING_RAD).max(round / EIGHTH_TURN));
        if count < f64::from(most) { (count as u32).max(1) } else { most }
    }

    /// Position and derivatives at s.
    #[inline]
    pub fn at(&self, s: f64) -> Point {
        match self {
            Geometry::Line(line) => line.at(s),
            Geometry::Arc(arc) => arc.at(s),
            Geometry::Blend(blend) => blend.at(s),
            Geometry::Hold(place) => Point { position: *place, first: [0.0; 9], second: [0.0; 9] },
        }
    }

    /// The place at s.
    #[inline]
    pub(crate) fn look(&self, s: f64, place: &mut Place) {
        // One by one: a point of any of them would first be put together, then taken apart.
        match self {
            Geometry::Line(line) => place.set(&line.at(s)),
            Geometry::Arc(arc) => place.set(&arc.at(s)),
            Geometry::Blend(blend) => place.set(&blend.at(s)),
            Geometry::Hold(_) => place.set(&self.at(s)),
        }
    }

    /// From another place of this same geometry to the one at s: on a line only the pose changes. True if no more did.
    #[inline]
    pub(crate) fn look_on(&self, s: f64, place: &mut Place) -> bool {
        match self {
            Geometry::Line(line) => {
                place.pose = Pose::from_array(line.position(s));
                true
            }
            _ => {
                self.look(s, place);
                false
            }
        }
    }
}

/// Euclidean length of three of the nine coordinates, starting at `from` (0 = XYZ, 3 = ABC, 6 = UVW).
pub(crate) fn norm3(v: &Vector, from: usize) -> f64 {
    let square = |i: usize| v.get(from + i).map_or(0.0, |x| x * x);
    sqrt(square(0) + square(1) + square(2))
}

/// |v| of the coordinates the feed counts.
#[inline]
pub fn feed_length(v: &Vector, group: FeedGroup) -> f64 {
    match group {
        FeedGroup::Xyz => norm3(v, 0),
        FeedGroup::Uvw => norm3(v, 6),
        FeedGroup::Abc => norm3(v, 3),
    }
}

/// The feed group of a displacement (RS274/NGC 3.5.19 as LinuxCNC applies it).
pub fn feed_group(displacement: &Vector) -> FeedGroup {
    // Below a picometre a coordinate only carries rounding.
    const STILL: f64 = 1e-9;
    if norm3(displacement, 0) > STILL {
        FeedGroup::Xyz
    } else if norm3(displacement, 6) > STILL {
        FeedGroup::Uvw
    } else {
        FeedGroup::Abc
    }
}

pub(crate) fn combine(a: &Vector, b: &Vector, f: impl Fn(f64, f64) -> f64) -> Vector {
    let mut out = *a;
    for (x, y) in out.iter_mut().zip(b) {
        *x = f(*x, *y);
    }
    out
}
