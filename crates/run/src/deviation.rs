//! How far the executed path is from the programmed one. The programmed pieces are kept as the program wrote them,
//! before any blend, for as long as the machine is near them.

use pkm_kins::maths::sqrt;
use pkm_planner::Setpoint;
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

    /// The machine has come to move `motion`: nothing before it is near.
    pub(crate) fn pass(&mut self, motion: u32) {
        while self.moves.get(1).is_some_and(|(number, _)| *number <= motion) {
            self.moves.pop_front();
        }
        let here = self.moves.front().map_or(motion, |(number, _)| *number);
        while self.chords.front().is_some_and(|(number, _)| *number < here) {
            self.chords.pop_front();
        }
    }

    /// The move that the machine is on.
    fn here(&self, setpoint: &Setpoint) -> Option<&(u32, Geometry)> {
        self.moves.front().filter(|(number, _)| *number <= setpoint.motion)
    }

    /// The place of the path that is nearest to a pose, while the planner is at `setpoint`.
    pub(crate) fn nearest(&self, setpoint: &Setpoint, pose: &Vector) -> Option<Near> {
        let (here, geometry) = self.here(setpoint)?;
        let best = self.off_move(*here, geometry, guess(setpoint, geometry), pose);
        let next = self.moves.get(1).filter(|_| setpoint.blending);
        Some(match next {
            Some((next, geometry)) => best.nearer(self.off_move(*next, geometry, 0.0, pose)),
            None => best,
        })
    }

    /// The distance of a pose from the path, if it is above `mm`. The place that the planner is at is on the path too, so
    /// the nearest one is looked for only if that place is farther.
    pub(crate) fn beyond(&self, mm: f64, setpoint: &Setpoint, pose: &Vector) -> Option<f64> {
        let (here, geometry) = self.here(setpoint)?;
        let chords = self.chords.front().is_some_and(|(number, _)| number == here);
        let place = || geometry.at(guess(setpoint, geometry)).position;
        if !chords && off(&place(), pose) <= mm {
            return None;
        }
        self.nearest(setpoint, pose).map(|near| near.distance_mm).filter(|distance| *distance > mm)
    }

    /// Distance from a move as it was programmed: from its chords, if it has any.
    fn off_move(&self, motion: u32, geometry: &Geometry, guess: f64, pose: &Vector) -> Near {
        let after = self.chords.iter().skip_while(|(number, _)| *number < motion);
        let mut chords = after.take_while(|(number, _)| *number == motion).peekable();
        if chords.peek().is_none() {
            return near(geometry, guess, pose);
        }
        let mut best = Near { distance_mm: f64::INFINITY, place: *pose };
        let mut start = geometry.at(0.0).position;
        for (_, end) in chords {
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

/// Where on its move the planner says it is; on the blend after it, the end.
fn guess(setpoint: &Setpoint, geometry: &Geometry) -> f64 {
    let s = if setpoint.blending { f64::INFINITY } else { setpoint.s };
    s.max(0.0).min(geometry.length()) // what is no number is 0
}

/// The larger of the distances in XYZ and UVW, mm.
fn off(place: &Vector, pose: &Vector) -> f64 {
    let norm = |from: usize| {
        let d = |i: usize| place[from + i] - pose[from + i];
        sqrt(d(0) * d(0) + d(1) * d(1) + d(2) * d(2))
    };
    norm(0).max(norm(6))
}

/// The place on a piece nearest to `pose`, found from `s` by Newton's method.
fn near(geometry: &Geometry, mut s: f64, pose: &Vector) -> Near {
    const LENGTHS: [usize; 6] = [0, 1, 2, 6, 7, 8];
    let length = geometry.length();
    let mut point = geometry.at(s);
    for _ in 0..4 {
        let (mut slope, mut curve) = (0.0, 0.0);
        for i in LENGTHS {
            let off = point.position[i] - pose[i];
            slope += point.first[i] * off;
            curve += point.first[i] * point.first[i] + point.second[i] * off;
        }
        let next = (s - slope / curve).clamp(0.0, length);
        if !(curve > 0.0) || next == s {
            break;
        }
        s = next;
        point = geometry.at(s);
    }
    Near { distance_mm: off(&point.position, pose), place: point.position }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pkm_canon::Span;
    use pkm_kins::Pose;
    use pkm_planner::State;
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

    #[test]
    fn what_the_planner_says_does_not_count() {
        let to = |x| [x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let mut programmed = Programmed::default();
        programmed.push(0, Geometry::Line(Line::new(to(0.0), to(10.0)).unwrap()), &[]);
        // The chords of a move go where it does not.
        let joined = Geometry::Line(Line::new(to(10.0), to(20.0)).unwrap());
        let middle = [15.0, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        programmed.push(1, joined, &[middle, to(20.0)]);
        let still = Setpoint {
            pose: Pose::ZERO,
            joints: Default::default(),
            joint_velocity: Default::default(),
            motion: 0,
            s: 0.0,
            blending: false,
            feed_use: 1.0,
            span: Span::default(),
            state: State::Moving,
            starved: false,
        };
        // Where it is said to be, said to be elsewhere, and gone past the end.
        for (motion, s, x, y, want) in [
            (0, 5.0, 5.0, 1e-6, Some(1e-6)),
            (0, 1.0, 5.0, 1e-6, Some(1e-6)),
            (0, 1.0, 5.0, 0.0, None),
            (0, 10.5, 10.5, 0.0, Some(0.5)),
            (0, f64::NAN, 5.0, 1e-6, Some(1e-6)),
            (1, 5.0, 15.0, 0.0, Some(0.01)),
            (1, 5.0, 15.0, 0.01, None),
        ] {
            let mut pose = to(x);
            pose[1] = y;
            programmed.pass(motion);
            let got = programmed.beyond(1e-9, &Setpoint { motion, s, ..still }, &pose);
            let close = |want: f64| got.is_some_and(|got| (got - want).abs() < 1e-5 * want);
            assert!(want.map_or(got.is_none(), close), "{motion} {s} {x} {y}: {got:?}");
        }
    }
}
