//! The programmed path as corners: lines by their ends, curves by chords, all within a tolerance.

use crate::fan::{Fan, Row};
use crate::sample::face;
use pkm_kins::{Axis, Mechanism, Pose};
use pkm_planner::path::Geometry;
use pkm_run::Programmed;

/// Corners kept, and how far the path may be from them at first, mm or degrees.
const MOST: usize = 32_768;
const TOLERANCE: f64 = 0.001;
/// Chords of one curve, at most.
const MOST_CHORDS: f64 = 2000.0;
/// Refused places and changes of the mechanism kept.
const MOST_NOTES: usize = 1000;

/// A corner.
#[derive(Debug, Clone)]
pub(crate) struct Corner {
    at: f64,
    pub pose: Pose,
    pub line: u32,
    pub rapid: bool,
    /// The path begins anew here: nothing leads from the corner before.
    pub start: bool,
    forced: bool,
    values: [f64; 9],
    count: usize,
}

impl Row for Corner {
    fn at(&self) -> f64 {
        self.at
    }

    fn channels(&self, out: &mut Vec<f64>) {
        out.clear();
        out.extend_from_slice(&self.values[..self.count]);
    }

    fn forced(&self) -> bool {
        self.forced
    }
}

/// The path, and what the check found on it.
#[derive(Debug)]
pub(crate) struct Path {
    axes: Vec<Axis>,
    corners: Fan<Corner>,
    length: f64,
    end: Option<(Pose, bool)>,
    /// Line and pose of every place that the machine cannot be at.
    pub refused: Vec<(u32, Pose)>,
    /// Mechanisms in force, from these lengths on.
    pub mechanisms: Vec<(f64, Mechanism)>,
}

impl Path {
    pub(crate) fn new(axes: &[Axis]) -> Self {
        Self {
            axes: axes.to_vec(),
            corners: Fan::new(TOLERANCE, MOST),
            length: 0.0,
            end: None,
            refused: Vec::new(),
            mechanisms: Vec::new(),
        }
    }

    pub(crate) fn push(&mut self, step: &Programmed<'_>) {
        let geometry = step.geometry;
        let length = geometry.length();
        if let Some(pose) = step.refused
            && self.refused.len() < MOST_NOTES
        {
            self.refused.push((step.line, pose));
        }
        if self.mechanisms.len() < MOST_NOTES
            && self.mechanisms.last().is_none_or(|(_, known)| known != step.mechanism)
        {
            self.mechanisms.push((self.length, *step.mechanism));
        }
        let first = Pose::from_array(geometry.at(0.0).position);
        // Rounding between the end of one move and the start of the next is no jump.
        let joined = self.end.is_some_and(|(end, _)| {
            end.to_array().iter().zip(first.to_array()).all(|(a, b)| (a - b).abs() < 1e-6)
        });
        if !joined {
            self.corner(first, step, 0.0, true, true);
        } else if let Some((end, rapid)) = self.end
            && rapid != step.rapid
        {
            self.corner(end, step, 0.0, false, true);
        }
        let chords = chords(geometry);
        for n in 1..=chords {
            let s = if n == chords { length } else { length * f64::from(n) / f64::from(chords) };
            let pose = Pose::from_array(geometry.at(s).position);
            let forced = n == chords && step.refused.is_some();
            self.corner(pose, step, length / f64::from(chords), false, forced);
        }
    }

    fn corner(&mut self, pose: Pose, step: &Programmed<'_>, by: f64, start: bool, forced: bool) {
        self.length += by;
        let mut values = [0.0; 9];
        for (value, &axis) in values.iter_mut().zip(&self.axes) {
            *value = face(axis, pose.get(axis));
        }
        self.end = Some((pose, step.rapid));
        let count = self.axes.len();
        let (at, line, rapid) = (self.length, step.line, step.rapid);
        self.corners.push(Corner { at, pose, line, rapid, start, forced, values, count });
    }

    /// The corners, where along the path each is, and the bound of the path's distance from them.
    pub(crate) fn finish(self) -> (Vec<Corner>, f64) {
        let error = self.corners.error();
        (self.corners.into_rows(), error)
    }
}

impl Corner {
    /// Length of path up to here.
    pub(crate) fn length(&self) -> f64 {
        self.at
    }
}

/// Chords that stay within half the tolerance of a piece: 1 for a line.
fn chords(geometry: &Geometry) -> u32 {
    if matches!(geometry, Geometry::Line(_)) {
        return 1;
    }
    let length = geometry.length();
    // |r''| where it is sampled; a chord of length h is h²/8 |r''| off.
    let mut bend = 0.0_f64;
    for n in 0..=16 {
        let second = geometry.at(length * f64::from(n) / 16.0).second;
        bend = second.iter().fold(bend, |most, value| most.max(value.abs()));
    }
    (length * (bend / (4.0 * TOLERANCE)).sqrt()).ceil().clamp(4.0, MOST_CHORDS) as u32
}
