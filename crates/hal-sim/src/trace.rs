//! `trace.csv`: one row per servo period, the first for the start.
//!
//! Columns: `tick,time_s,line`, then `axis.x.pos-cmd_mm` for each coordinate of the machine (`_deg` for A, B, C), then for
//! each joint `joint.0.pos-cmd_mm` and `joint.0.pos-fb_mm` (counted from the edges; `_deg` for rotary joints). Numbers are
//! the shortest that read back to the same `f64`; lines end with LF.
//!
//! With substeps there are rows between the ends of periods too; `tick` is there the last period that has ended. Joint
//! commands between are those of the step generator (a cubic through both ends), the pose is theirs by the forward
//! kinematics.

use crate::component::Setpoint;
use crate::simulation::{JointState, Observer, Simulation, TickReport};
use pkm_kins::{Axis, JointKind, Joints, Kinematics, MAX_JOINTS, Pose, maths};
use pkm_stepgen::{Edge, Line};
use std::io::{self, Write};

/// Bytes collected before they are written.
const CHUNK: usize = 1 << 16;

/// Collects text and hands it on in large pieces; the first error ends the writing and is kept.
#[derive(Debug)]
pub(crate) struct Output<W: Write> {
    writer: W,
    pub(crate) text: Vec<u8>,
    error: Option<io::Error>,
}

impl<W: Write> Output<W> {
    pub(crate) fn new(writer: W) -> Self {
        Self { writer, text: Vec::with_capacity(CHUNK + 4096), error: None }
    }

    /// To be called after each line or so.
    #[inline]
    pub(crate) fn spill(&mut self) {
        if self.text.len() >= CHUNK {
            self.flush();
        }
    }

    #[cold]
    fn flush(&mut self) {
        if self.error.is_none() {
            self.error = self.writer.write_all(&self.text).err();
        }
        self.text.clear();
    }

    pub(crate) const fn error(&self) -> Option<&io::Error> {
        self.error.as_ref()
    }

    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.flush();
        if self.error.is_none() {
            self.error = self.writer.flush().err();
        }
        match self.error {
            Some(error) => Err(error),
            None => Ok(self.writer),
        }
    }
}

/// Writes `trace.csv`. An error of the writer is kept; [`Self::finish`] returns it.
#[derive(Debug)]
pub struct TraceWriter<W: Write> {
    out: Output<W>,
    axes: Vec<Axis>,
    rotary: Vec<bool>,
    between: Option<Between>,
}

/// What the rows between the ends of periods need.
struct Between {
    substeps: u32,
    kinematics: Box<dyn Kinematics + Send>,
    steps_per_unit: Vec<f64>,
    servo_period_ns: u64,
    timer_period_ns: u64,
    /// The end of the last period.
    tick: u64,
    setpoint: Setpoint,
    states: Vec<JointState>,
    positive: Vec<bool>,
    edges: Vec<Edge>,
}

impl std::fmt::Debug for Between {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Between").field("substeps", &self.substeps).finish_non_exhaustive()
    }
}

impl Between {
    /// Commanded joints at `u` of the period that ends with `end`, mm or rad.
    fn commanded(&self, end: &Setpoint, u: f64) -> Joints {
        let (seconds, w) = (self.servo_period_ns as f64 / 1e9, 1.0 - u);
        let mut joints = [0.0; MAX_JOINTS];
        for (n, joint) in joints.iter_mut().enumerate() {
            // cubic Hermite, basis functions
            *joint = self.setpoint.joints[n] * (w * w * (1.0 + 2.0 * u))
                + end.joints[n] * (u * u * (3.0 - 2.0 * u))
                + seconds * (self.setpoint.velocities[n] * (w * w * u) - end.velocities[n] * (u * u * w));
        }
        joints
    }

    /// The pose of these joints; where the mechanism has none (rounding, at its edge), between the poses at the ends.
    fn pose(&self, joints: &Joints, end: &Setpoint, u: f64) -> Pose {
        let start = &self.setpoint.pose;
        self.kinematics.forward(joints, start).unwrap_or_else(|_| {
            let mut pose = *start;
            for axis in Axis::ALL {
                pose.set(axis, start.get(axis) + u * (end.pose.get(axis) - start.get(axis)));
            }
            pose
        })
    }
}

impl<W: Write> TraceWriter<W> {
    /// Writes the header and the row of the machine as it stands.
    pub fn new(writer: W, simulation: &Simulation) -> Self {
        let rotary: Vec<bool> = simulation.joint_kinds().map(|kind| kind == JointKind::Rotary).collect();
        let axes: Vec<Axis> = simulation.axes().iter().collect();
        let mut out = Output::new(writer);
        out.text.extend_from_slice(b"tick,time_s,line");
        let mut column = |name: String| {
            out.text.push(b',');
            out.text.extend_from_slice(name.as_bytes());
        };
        for axis in &axes {
            let unit = if axis.is_rotary() { "deg" } else { "mm" };
            column(format!("axis.{}.pos-cmd_{unit}", axis.letter().to_ascii_lowercase()));
        }
        for (n, rotary) in rotary.iter().enumerate() {
            let unit = if *rotary { "deg" } else { "mm" };
            column(format!("joint.{n}.pos-cmd_{unit}"));
            column(format!("joint.{n}.pos-fb_{unit}"));
        }
        out.text.push(b'\n');
        let mut trace = Self { out, axes, rotary, between: None };
        let report = simulation.report();
        trace.row(report.tick, report.time_ns as f64 / 1e9, report.setpoint, report.joints);
        trace
    }

    /// Writes `substeps` rows a period, the last at its end. To be called before the first period.
    #[must_use]
    pub fn with_substeps(
        mut self,
        simulation: &Simulation,
        substeps: u32,
        kinematics: Box<dyn Kinematics + Send>,
    ) -> Self {
        let report = simulation.report();
        self.between = (substeps > 1).then(|| Between {
            substeps,
            kinematics,
            steps_per_unit: simulation.steps_per_unit().collect(),
            servo_period_ns: simulation.servo_period_ns(),
            timer_period_ns: simulation.hal().timer_period_ns(),
            tick: report.tick,
            setpoint: *report.setpoint,
            states: report.joints.to_vec(),
            positive: vec![false; report.joints.len()],
            edges: Vec::new(),
        });
        self
    }

    /// The rows inside the period that has just ended.
    fn rows_between(&mut self, report: &TickReport<'_>) {
        let Some(mut between) = self.between.take() else { return };
        let start_ns = between.tick * between.servo_period_ns;
        let edges = std::mem::take(&mut between.edges);
        let mut edges_left = edges.iter().peekable();
        for i in 1..=between.substeps {
            let u = f64::from(i) / f64::from(between.substeps);
            let time_ns = start_ns as f64 + between.servo_period_ns as f64 * u;
            while let Some(edge) =
                edges_left.next_if(|edge| (edge.time * between.timer_period_ns) as f64 <= time_ns)
            {
                let n = usize::from(edge.joint);
                match edge.line {
                    Line::Dir => between.positive[n] = edge.level,
                    Line::Step if edge.level => {
                        between.states[n].count += if between.positive[n] { 1 } else { -1 };
                    }
                    _ => {}
                }
            }
            if i == between.substeps {
                break; // the row of the end itself comes from the report
            }
            let joints = between.commanded(report.setpoint, u);
            let setpoint = Setpoint { pose: between.pose(&joints, report.setpoint, u), ..*report.setpoint };
            for (n, state) in between.states.iter_mut().enumerate() {
                state.commanded = joints[n];
                state.position = state.count as f64 / between.steps_per_unit[n];
            }
            self.row(between.tick, time_ns / 1e9, &setpoint, &between.states);
        }
        between.edges = edges;
        between.edges.clear();
        between.tick = report.tick;
        between.setpoint = *report.setpoint;
        self.between = Some(between);
    }

    fn row(&mut self, tick: u64, time_s: f64, setpoint: &Setpoint, joints: &[JointState]) {
        let text = &mut self.out.text;
        text.extend_from_slice(itoa::Buffer::new().format(tick).as_bytes());
        number(text, time_s);
        text.push(b',');
        text.extend_from_slice(itoa::Buffer::new().format(setpoint.line).as_bytes());
        for &axis in &self.axes {
            number(text, shown(axis.is_rotary(), setpoint.pose.get(axis)));
        }
        for (&rotary, joint) in self.rotary.iter().zip(joints) {
            number(text, shown(rotary, joint.commanded));
            number(text, shown(rotary, joint.position));
        }
        text.push(b'\n');
        self.out.spill();
    }

    /// The first error of the writer, if there was one; nothing was written after it.
    pub const fn error(&self) -> Option<&io::Error> {
        self.out.error()
    }

    /// Writes what is left and returns the writer.
    ///
    /// # Errors
    /// The first error of the writer.
    pub fn finish(self) -> io::Result<W> {
        self.out.finish()
    }
}

fn shown(rotary: bool, value: f64) -> f64 {
    if rotary { maths::degrees(value) } else { value }
}

#[inline]
fn number(text: &mut Vec<u8>, value: f64) {
    text.push(b',');
    // −0 becomes 0
    text.extend_from_slice(zmij::Buffer::new().format(value + 0.0).as_bytes());
}

impl<W: Write> Observer for TraceWriter<W> {
    fn wants_edges(&self) -> bool {
        self.between.is_some()
    }

    fn edge(&mut self, edge: &Edge) {
        if let Some(between) = &mut self.between {
            between.edges.push(*edge);
        }
    }

    fn tick(&mut self, report: &TickReport<'_>) {
        self.rows_between(report);
        self.row(report.tick, report.time_ns as f64 / 1e9, report.setpoint, report.joints);
    }
}
