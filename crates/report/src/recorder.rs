//! Watches a run and keeps what the report shows.

use crate::blocks::Blocks;
use crate::envelope::Envelope;
use crate::fan::Fan;
use crate::page;
use crate::programmed::{Corner, Path};
use crate::sample::Sample;
use crate::skeleton::Drawing;
use crate::workspace::{Space, spaces};
use pkm_kins::{Axis, Joints, Kinematics, Mechanism, Pose};
use pkm_machine::Machine;
use pkm_run::{Judged, Programmed, Summary};
use std::io::{self, BufRead, Write};

/// Rows are kept while they take less than this in the page, before base64.
const MOST_BYTES: usize = 3 << 19;
/// How far the machine may be from between two kept rows at first: mm or degrees, any joint or axis.
const TOLERANCE: f64 = 0.001;
/// Length between two samples of a program that was refused, mm, and the most of them.
const SPACING_MM: f64 = 2.0;
const MOST_SAMPLES: f64 = 4000.0;

/// A place of the run that a person may want to go to.
#[derive(Debug, Clone)]
pub(crate) struct Peak {
    pub what: &'static str,
    /// The joint, if it is one's.
    pub joint: Option<usize>,
    /// Larger is more remarkable.
    pub value: f64,
    pub sample: Option<Sample>,
}

/// Watches a run.
#[derive(Debug)]
pub struct Recorder<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) axes: Vec<Axis>,
    pub(crate) drawing: Drawing,
    pub(crate) workspaces: Vec<Space>,
    pub(crate) envelope: Envelope,
    pub(crate) blocks: Blocks,
    pub(crate) peaks: Vec<Peak>,
    pub(crate) period_s: f64,
    rows: Fan<Sample>,
    most_rows: usize,
    path: Path,
    before: [Joints; 2],
    curves: Vec<f64>,
    start: Pose,
    /// Of the newest row.
    pose: Pose,
}

/// What the page is written from.
#[derive(Debug)]
pub(crate) struct Recorded<'a> {
    pub recorder: Recorder<'a>,
    pub rows: Vec<Sample>,
    /// The machine is nowhere further from the lines between the rows, mm or degrees.
    pub error: f64,
    pub corners: Vec<Corner>,
    pub refused: Vec<(u32, Pose)>,
    /// False: nothing ran, the rows are samples of the programmed path.
    pub timed: bool,
}

impl<'a> Recorder<'a> {
    /// Begins with the machine at rest at `start` (mm, rad).
    pub fn new(machine: &'a Machine, start: Pose) -> Self {
        let joints = machine.mechanism.inverse(&start).unwrap_or_default();
        let axes: Vec<Axis> = machine.mechanism.axes().iter().collect();
        let drawing = Drawing::new(machine, &joints, &start);
        let n = machine.joints.len();
        let bytes = 14 + 8 * (axes.len() + n) + 4 * (2 * axes.len() + 2 * n + 3) + 12 * drawing.moving;
        let peak = |what, joint| Peak { what, joint, value: f64::NEG_INFINITY, sample: None };
        let mut peaks = Vec::new();
        for joint in 0..n {
            let all = ["velocity", "acceleration", "low end", "high end"];
            peaks.extend(all.map(|what| peak(what, Some(joint))));
        }
        peaks.extend([peak("deviation", None), peak("singularity", None)]);
        let mut recorder = Self {
            machine,
            drawing,
            workspaces: spaces(machine, &start),
            envelope: Envelope::new(3 * n + 3),
            blocks: Blocks::default(),
            peaks,
            period_s: machine.servo_period_ns as f64 / 1e9,
            rows: Fan::new(TOLERANCE, MOST_BYTES / bytes),
            most_rows: MOST_BYTES / bytes,
            path: Path::new(&axes),
            before: [joints; 2],
            curves: Vec::new(),
            start,
            pose: start,
            axes,
        };
        recorder.push(Sample::still(machine, &recorder.axes, 0, start, joints));
        recorder
    }

    /// A checked move of the program.
    pub fn programmed(&mut self, step: &Programmed<'_>) {
        self.path.push(step);
    }

    /// A servo period.
    pub fn judged(&mut self, judged: &Judged) {
        if judged.homing {
            // Nothing is known of where the machine is: the curves stay empty, and the drawing begins behind it.
            self.before = [judged.setpoint.joints; 2];
            self.rows = Fan::new(TOLERANCE, self.most_rows);
            self.curves.fill(f64::NAN);
            self.envelope.push(&self.curves);
            return;
        }
        let mut sample = Sample::judged(self.machine, &self.axes, judged, &self.before, self.period_s);
        // A switch of the mechanism moves no joint.
        sample.jump = sample.joints == self.before[1] && sample.pose != self.pose;
        self.pose = sample.pose;
        self.before = [self.before[1], sample.joints];
        self.blocks.push(sample.line, judged.tick - 1);
        self.peaks(&sample);
        self.push(sample);
    }

    fn push(&mut self, sample: Sample) {
        sample.curves(self.machine, &mut self.curves);
        self.envelope.push(&self.curves);
        self.rows.push(sample);
    }

    fn peaks(&mut self, sample: &Sample) {
        let n = self.machine.joints.len();
        let joints = (0..n).flat_map(|j| {
            let [velocity, acceleration] = sample.shares[j];
            [velocity.abs(), acceleration.abs(), -sample.joints[j], sample.joints[j]]
        });
        let all = joints.chain([sample.deviation_mm, -sample.singularity]);
        for (peak, value) in self.peaks.iter_mut().zip(all) {
            if value > peak.value {
                peak.value = value;
                peak.sample = Some(sample.clone());
            }
        }
    }

    /// Writes the page. `text` is the program, read line by line; lines that are not UTF-8 are shown with replacements.
    ///
    /// # Errors
    /// Those of `text` and `out`.
    pub fn write(self, summary: &Summary, text: impl BufRead, out: &mut impl Write) -> io::Result<()> {
        page::write(&self.finish(summary.servo_ticks > 0), summary, text, out)
    }

    fn finish(mut self, timed: bool) -> Recorded<'a> {
        let rows = std::mem::replace(&mut self.rows, Fan::new(TOLERANCE, 16));
        let path = std::mem::replace(&mut self.path, Path::new(&[]));
        let mut error = rows.error();
        let mut rows = rows.into_rows();
        let refused = path.refused.clone();
        let mechanisms = path.mechanisms.clone();
        let (corners, _) = path.finish();
        if timed {
            rows.extend(self.peaks.iter().filter_map(|peak| peak.sample.clone()));
            rows.sort_by_key(|row| row.tick);
            rows.dedup_by_key(|row| row.tick);
        } else {
            error = 0.0;
            rows.truncate(1);
            self.sample_path(&corners, &mechanisms, &refused, &mut rows);
        }
        Recorded { recorder: self, rows, error, corners, refused, timed }
    }

    /// The machine along a programmed path that was refused: wherever it has joints, within their travel or not.
    fn sample_path(
        &mut self,
        corners: &[Corner],
        mechanisms: &[(f64, Mechanism)],
        refused: &[(u32, Pose)],
        rows: &mut Vec<Sample>,
    ) {
        let total = corners.last().map_or(0.0, Corner::length);
        let spacing = SPACING_MM.max(total / MOST_SAMPLES);
        let mut from = self.start;
        let mut at = 0.0;
        let mut refused = refused.iter().peekable();
        for corner in corners {
            let length = corner.length();
            let steps = if corner.start { 1 } else { ((length - at) / spacing).ceil().max(1.0) as u32 };
            let mechanism = mechanisms
                .iter()
                .rev()
                .find(|(since, _)| *since < length)
                .map_or(&self.machine.mechanism, |(_, mechanism)| mechanism);
            for n in 1..=steps {
                let share = f64::from(n) / f64::from(steps);
                let mut pose = corner.pose;
                if n < steps {
                    for &axis in &self.axes {
                        pose.set(axis, from.get(axis) + share * (corner.pose.get(axis) - from.get(axis)));
                    }
                }
                let mut place = |pose: Pose| {
                    let Ok(joints) = mechanism.inverse(&pose) else { return };
                    let mut sample = Sample::still(self.machine, &self.axes, 0, pose, joints);
                    sample.line = corner.line;
                    rows.push(sample);
                };
                // The refused place itself, where the path passes it: there a joint is past its end the furthest.
                if let Some((_, bad)) = refused.next_if(|(line, bad)| {
                    *line == corner.line && distance(bad, &pose) <= 1.01 * (length - at) / f64::from(steps)
                }) {
                    place(*bad);
                }
                place(pose);
            }
            (from, at) = (corner.pose, length);
        }
        self.blocks = Blocks::default();
        for (row, tick) in rows.iter_mut().zip(0..) {
            row.tick = tick;
            if tick > 0 {
                self.blocks.push(row.line, tick);
            }
        }
    }
}

/// The largest difference of any coordinate.
fn distance(a: &Pose, b: &Pose) -> f64 {
    a.to_array().iter().zip(b.to_array()).fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}
