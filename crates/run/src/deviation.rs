//! How far the executed path is from the programmed one. The programmed pieces are kept as the program wrote them,
//! before any blend, for as long as the machine is near them.

use pkm_kins::maths::sqrt;
use pkm_planner::path::{Geometry, Line, Vector};
use std::collections::VecDeque;

/// The programmed moves around the machine.
#[derive(Debug, Default)]
pub(crate) struct Programmed {
    moves: VecDeque<(u32, Geometry)>,
    /// Ends of the chords that a joined move stands for (G64 Q), with the number of that move.
    chords: VecDeque<(u32, Vector)>,
}

impl Programmed {
    /// A move of the planner, with the ends of the chords it stands for, if it is a joined one.
    pub(crate) fn push(&mut self, motion: u32, geometry: Geometry, chords: &[Vector]) {
        self.moves.push_back((motion, geometry));
        if chords.len() > 1 {
            self.chords.extend(chords.iter().map(|end| (motion, *end)));
        }
    }

    /// The machine goes on elsewhere: nothing programmed so far is near.
    pub(crate) fn clear(&mut self) {
        self.moves.clear();
        self.chords.clear();
    }

    /// Distance (mm; the larger of XYZ and UVW) of a pose from the path, and the place on the path that is nearest, while
    /// the planner is on move `motion`, at `s` of it, or on the blend after it.
    pub(crate) fn nearest(&mut self, motion: u32, s: f64, blending: bool, pose: &Vector) -> Option<Near> {
        while self.moves.get(1).is_some_and(|(number, _)| *number <= motion) {
            self.moves.pop_front();
        }
        let &(here, ref geometry) = self.moves.front().filter(|(number, _)| *number <= motion)?;
        while self.chords.front().is_some_and(|(number, _)| *number < here) {
            self.chords.pop_front();
        }
        let mut best = self.off_move(here, geometry, if blending { geometry.length() } else { s }, pose);
        if blending && let Some((next, geometry)) = self.moves.get(1) {
            best = best.nearer(self.off_move(*next, geometry, 0.0, pose));
        }
        Some(best)
    }

    /// Distance from a move as it was programmed: from its chords, if it has any.
    fn off_move(&self, motion: u32, geometry: &Geometry, guess: f64, pose: &Vector) -> Near {
        let mut best = Near { distance_mm: f64::INFINITY, place: *pose };
        let mut start = geometry.at(0.0).position;
        let after = self.chords.iter().skip_while(|(number, _)| *number < motion);
        for (_, end) in after.take_while(|(number, _)| *number == motion) {
            if let Some(line) = Line::new(start, *end) {
                // A line is found from anywhere.
                best = best.nearer(near(&Geometry::Line(line), 0.0, pose));
            }
            start = *end;
        }
        if best.distance_mm.is_finite() { best } else { near(geometry, guess, pose) }
    }
}

/// The place on a path nearest to a pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    /// The larger of the distances in XYZ and UVW.
    pub(crate) distance_mm: f64,
    pub(crate) place: Vector,
}

impl Near {
    fn nearer(self, other: Self) -> Self {
        if other.distance_mm < self.distance_mm { other } else { self }
    }
}

/// The place on a piece nearest to `pose`, found from `s` by Newton's method.
fn near(geometry: &Geometry, mut s: f64, pose: &Vector) -> Near {
    const LENGTHS: [usize; 6] = [0, 1, 2, 6, 7, 8];
    let length = geometry.length();
    for _ in 0..4 {
        let point = geometry.at(s);
        let (mut slope, mut curve) = (0.0, 0.0);
        for i in LENGTHS {
            let off = point.position[i] - pose[i];
            slope += point.first[i] * off;
            curve += point.first[i] * point.first[i] + point.second[i] * off;
        }
        if curve > 0.0 {
            s = (s - slope / curve).clamp(0.0, length);
        }
    }
    let place = geometry.at(s).position;
    let norm = |from: usize| {
        let d = |i: usize| place[from + i] - pose[from + i];
        sqrt(d(0) * d(0) + d(1) * d(1) + d(2) * d(2))
    };
    Near { distance_mm: norm(0).max(norm(6)), place }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pkm_planner::path::Arc;

    #[test]
    fn distance_from_an_arc_is_radial() {
        let start = [10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let arc = Arc::new(start, start, [0.0; 3], [0.0, 0.0, 1.0], 1).unwrap();
        let (c, s) = (0.6, 0.8);
        let pose = [10.3 * c, 10.3 * s, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let got = near(&Geometry::Arc(arc), 9.0, &pose).distance_mm;
        assert!((got - 0.3).abs() < 1e-9, "{got}");
    }
}
