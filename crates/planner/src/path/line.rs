//! Straight line in nine coordinates.

use super::{FeedGroup, Point, Vector, combine, feed_group, feed_length, norm3};

/// A straight line; all coordinates go linearly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Where it starts.
    pub start: Vector,
    /// dX/ds, constant.
    pub direction: Vector,
    /// Parameter length.
    pub length: f64,
}

impl Line {
    /// The line between two points; `None` if they are the same to rounding.
    pub fn new(start: Vector, end: Vector) -> Option<Self> {
        let displacement = combine(&end, &start, |b, a| b - a);
        let length = match feed_group(&displacement) {
            // A long UVW or rotary move with a minute XYZ part must not be measured by that part alone.
            FeedGroup::Xyz => feed_length(&displacement, FeedGroup::Xyz).max(norm3(&displacement, 6) * 1e-3),
            group => feed_length(&displacement, group),
        };
        (length > 1e-12 && length.is_finite()).then(|| Line {
            start,
            direction: displacement.map(|d| d / length),
            length,
        })
    }

    #[inline]
    pub(super) fn position(&self, s: f64) -> Vector {
        combine(&self.start, &self.direction, |x, d| x + d * s)
    }

    #[inline]
    pub(super) fn at(&self, s: f64) -> Point {
        Point { position: self.position(s), first: self.direction, second: [0.0; 9] }
    }
}
