//! G64 Q: consecutive straight feed moves that lie within Q of one line become that line (LinuxCNC's "naive CAM
//! detector"). CAM output full of tiny collinear chords then costs the planner one piece instead of hundreds.

use crate::path::{Geometry, Line, Vector, combine, norm3};
use crate::planner::Move;
use heapless::Vec;

/// Most chords that become one line: bounds the work of a push.
pub const MOST_MERGED: usize = 64;

/// The end points of the chords a move stands for, its own end last.
pub type Chords = Vec<Vector, MOST_MERGED>;

/// Collects chords until they no longer fit one line.
#[derive(Debug, Clone, Default)]
pub struct Merger {
    chain: Option<(Move, Chords)>,
}

impl Merger {
    /// Takes a move that may be joined with its neighbours within `tolerance_mm` (XYZ and UVW each; 0 = leave it alone),
    /// and calls `emit` with what is complete.
    pub fn push(&mut self, next: Move, tolerance_mm: f64, mut emit: impl FnMut(Move, &Chords)) {
        let Geometry::Line(line) = next.geometry else {
            self.flush(&mut emit);
            emit(next, &Chords::new());
            return;
        };
        let end = next.geometry.at(line.length).position;
        let alone = next.rapid || !(tolerance_mm > 0.0) || norm3(&line.direction, 3) > 0.0;
        if let Some((first, chords)) = &mut self.chain {
            let same = !alone && first.feed == next.feed && first.mode == next.mode;
            if same
                && !chords.is_full()
                && let Geometry::Line(so_far) = first.geometry
                && let Some(whole) = Line::new(so_far.start, end)
                && chords.iter().all(|point| near(&whole, point, tolerance_mm))
                && in_order(&whole, chords)
            {
                first.geometry = Geometry::Line(whole);
                let _ = chords.push(end);
                return;
            }
        }
        self.flush(&mut emit);
        let mut chords = Chords::new();
        let _ = chords.push(end);
        if alone {
            emit(next, &chords);
        } else {
            self.chain = Some((next, chords));
        }
    }

    /// Nothing follows that could be joined.
    pub fn flush(&mut self, mut emit: impl FnMut(Move, &Chords)) {
        if let Some((whole, chords)) = self.chain.take() {
            emit(whole, &chords);
        }
    }
}

/// Where on the line (s, unclamped) a point is nearest, over XYZ and UVW.
fn along(line: &Line, point: &Vector) -> f64 {
    let off = combine(point, &line.start, |p, a| p - a);
    let (mut dot, mut square) = (0.0, 0.0);
    for (i, (o, d)) in off.iter().zip(&line.direction).enumerate() {
        if !(3..6).contains(&i) {
            dot += o * d;
            square += d * d;
        }
    }
    dot / square
}

fn near(line: &Line, point: &Vector, tolerance_mm: f64) -> bool {
    let s = along(line, point);
    let foot = combine(&line.start, &line.direction, |a, d| a + d * s.clamp(0.0, line.length));
    let off = combine(point, &foot, |p, f| p - f);
    norm3(&off, 0) <= tolerance_mm && norm3(&off, 6) <= tolerance_mm
}

/// A path that turns back is not one line, however near it stays.
fn in_order(line: &Line, chords: &Chords) -> bool {
    let mut last = 0.0;
    chords.iter().all(|point| {
        let s = along(line, point);
        let onwards = s >= last;
        last = s;
        onwards
    }) && last <= line.length
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Feed;
    use crate::path::FeedGroup;
    use crate::planner::PathMode;

    fn xy(x: f64, y: f64) -> Vector {
        [x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    /// The lengths of what comes out, and how many chords each stands for.
    fn merged(points: &[Vector], tolerance_mm: f64) -> std::vec::Vec<(f64, usize)> {
        let mut out = std::vec::Vec::new();
        let mut merger = Merger::default();
        let mut keep = |m: Move, chords: &Chords| out.push((m.geometry.length(), chords.len()));
        for pair in points.windows(2) {
            let next = Move {
                geometry: Geometry::Line(Line::new(pair[0], pair[1]).unwrap()),
                feed: Feed { speed: 10.0, group: FeedGroup::Xyz },
                rapid: false,
                mode: PathMode::ExactPath,
                span: Default::default(),
            };
            merger.push(next, tolerance_mm, &mut keep);
        }
        merger.flush(&mut keep);
        out
    }

    #[test]
    fn collinear_chords_become_one_line_and_corners_stay() {
        let points = [xy(0.0, 0.0), xy(1.0, 0.0), xy(2.0, 0.0), xy(3.0, 0.0), xy(3.0, 1.0), xy(3.0, 2.0)];
        assert_eq!(merged(&points, 0.001), [(3.0, 3), (2.0, 2)]);
        assert_eq!(merged(&points, 0.0).len(), 5);
    }

    #[test]
    fn every_chord_end_stays_within_the_tolerance() {
        let points: std::vec::Vec<Vector> =
            (0..=40).map(|k| xy(f64::from(k), 0.004 * f64::from(k % 2))).collect();
        assert_eq!(merged(&points, 0.005), [(40.0, 40)]);
        assert!(merged(&points, 0.0015).len() > 10);
    }

    #[test]
    fn a_path_that_turns_back_is_kept() {
        let points = [xy(0.0, 0.0), xy(5.0, 0.0), xy(2.0, 0.0), xy(6.0, 0.0)];
        assert_eq!(merged(&points, 10.0).len(), 3);
    }
}
