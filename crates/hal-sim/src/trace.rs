//! `trace.csv`: one row per servo period, the first for the start.
//!
//! Columns: `tick,time_s,line`, then `axis.x.pos-cmd_mm` for each coordinate of the machine (`_deg` for A, B, C), then for
//! each joint `joint.0.pos-cmd_mm` and `joint.0.pos-fb_mm` (counted from the edges; `_deg` for rotary joints), then, if the
//! machine has a spindle, `spindle.0.revs` (turns since the last index that was waited for). Numbers are
//! the shortest that read back to the same `f64`; lines end with LF.

use crate::report::{Observer, TickReport};
use crate::simulation::Simulation;
use pkm_kins::{Axis, JointKind, maths};
use pkm_stepgen::Edge;
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
    has_spindle: bool,
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
        let has_spindle = simulation.has_spindle();
        if has_spindle {
            column("spindle.0.revs".to_owned());
        }
        out.text.push(b'\n');
        let mut trace = Self { out, axes, rotary, has_spindle };
        let report = simulation.report();
        trace.row(&report);
        trace
    }

    fn row(&mut self, report: &TickReport<'_>) {
        let TickReport { setpoint, joints, .. } = report;
        let text = &mut self.out.text;
        text.extend_from_slice(itoa::Buffer::new().format(report.tick).as_bytes());
        number(text, report.time_ns as f64 / 1e9);
        text.push(b',');
        text.extend_from_slice(itoa::Buffer::new().format(setpoint.line).as_bytes());
        for &axis in &self.axes {
            number(text, shown(axis.is_rotary(), setpoint.pose.get(axis)));
        }
        for (&rotary, joint) in self.rotary.iter().zip(*joints) {
            number(text, shown(rotary, joint.commanded));
            number(text, shown(rotary, joint.position));
        }
        if self.has_spindle {
            number(text, report.feedback.spindle.revs);
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
        false
    }

    fn edge(&mut self, _edge: &Edge) {}

    fn tick(&mut self, report: &TickReport<'_>) {
        self.row(report);
    }
}
