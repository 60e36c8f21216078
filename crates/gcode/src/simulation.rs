//! The machine that `rs274` simulates, as far as the interpreter reads it back (canon-format section 6).

use crate::error::Error;
use crate::interpreter::{Interpreter, PlaneAxes, Status};
use crate::settings::Settings;
use crate::source::LineSource;
use crate::tool_table::ToolTable;
use pkm_canon::{Canon, CanonSink, LengthUnit, Position, Span};

/// Passes commands on and follows the tool as `rs274` does: in program coordinates, X to C only.
pub struct SimulatedMachine<S> {
    sink: S,
    position: [f64; 9],
    g5x: [f64; 9],
    g92: [f64; 9],
    units: LengthUnit,
    probed: Option<[f64; 9]>,
    /// The interpreter asks where the tool is: after a probe, a tool change or a new tool table, not after an input
    /// (checked with rs274 2.9).
    is_asked: bool,
    /// LinuxCNC 2.9's does not know where a spline ends.
    forgets_splines: bool,
}

impl<S: CanonSink> SimulatedMachine<S> {
    /// A machine at position 0 that hands every command to `sink`.
    pub fn new(sink: S) -> Self {
        let zero = [0.0; 9];
        Self {
            sink,
            position: zero,
            g5x: zero,
            g92: zero,
            units: LengthUnit::Mm,
            probed: None,
            is_asked: false,
            forgets_splines: false,
        }
    }

    /// Tells the interpreter what the machine did.
    pub fn answer(&mut self, interpreter: &mut Interpreter) {
        if core::mem::take(&mut self.is_asked) {
            interpreter.set_position(Position::from_array(self.position));
        }
        if let Some(point) = self.probed.take() {
            interpreter.set_probe_result(Position::from_array(point), false);
        }
    }

    fn shift(&mut self, old: [f64; 9], new: [f64; 9]) {
        for axis in 0..6 {
            self.position[axis] += old[axis] - new[axis];
        }
    }

    fn go(&mut self, end: &Position) {
        let end = end.to_array();
        self.position[..6].copy_from_slice(&end[..6]);
    }

    /// Stops a little before the target, towards the start: 0.254 mm or 0.01 in.
    fn probe(&mut self, end: &Position) {
        let (from, to) = (self.position, end.to_array());
        let [dx, dy, dz] = [0, 1, 2].map(|axis| to[axis] - from[axis]);
        let distance = pkm_kins::maths::sqrt(dx * dx + dy * dy + dz * dz);
        self.probed = Some(to);
        self.go(end);
        if distance > 0.0 {
            let back = match self.units {
                LengthUnit::Mm => 0.254,
                LengthUnit::Inch => 0.01,
            };
            for (axis, step) in [dx, dy, dz].into_iter().enumerate() {
                self.position[axis] -= back * step / distance;
            }
        }
    }
}

impl<S: CanonSink> CanonSink for SimulatedMachine<S> {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        match command {
            Canon::StraightTraverse(end) | Canon::StraightFeed(end) | Canon::ArcFeed { end, .. } => {
                self.go(end);
            }
            Canon::StraightProbe { end, .. } => self.probe(end),
            // rs274 takes the point behind the last one; mostly that is 0 (checked with rs274 2.9).
            Canon::NurbsFeed { .. } if self.forgets_splines => self.position[..2].fill(0.0),
            Canon::NurbsFeed { plane, points, .. } => {
                let axes = PlaneAxes::of(*plane);
                if let Some(last) = points.last() {
                    (self.position[axes.first], self.position[axes.second]) = (last.first, last.second);
                }
            }
            Canon::SetG5xOffset { offset, .. } => {
                let new = offset.to_array();
                self.shift(self.g5x, new);
                self.g5x = new;
            }
            Canon::SetG92Offset(offset) => {
                let new = offset.to_array();
                self.shift(self.g92, new);
                self.g92 = new;
            }
            Canon::UseLengthUnits(units) if *units != self.units => {
                let factor = self.units.mm() / units.mm();
                self.units = *units;
                for values in [&mut self.position, &mut self.g5x, &mut self.g92] {
                    values[..3].iter_mut().for_each(|value| *value *= factor);
                }
            }
            _ => {}
        }
        self.is_asked |= matches!(
            command,
            Canon::StraightProbe { .. }
                | Canon::ChangeTool { .. }
                | Canon::ChangeToolNumber { .. }
                | Canon::ReloadTooldata
        );
        self.sink.command(command, span);
    }

    fn line_read(&mut self, text: &[u8], span: Span) {
        self.sink.line_read(text, span);
    }
}

/// Interprets a whole program on the simulated machine and frames its commands as `rs274 -g` does. Every error goes
/// to `report` with its source line; `report` says whether to go on with the next block.
pub fn canon_text(
    settings: Settings,
    tools: ToolTable,
    source: &mut dyn LineSource,
    sink: &mut dyn CanonSink,
    mut report: impl FnMut(&Error, &[u8]) -> bool,
) -> Interpreter {
    let mut interpreter = Interpreter::new(settings);
    *interpreter.tools_mut() = tools;
    canon_text_of(&mut interpreter, source, sink, |error, interpreter, _| {
        report(error, interpreter.source_line())
    });
    interpreter
}

/// [`canon_text`] with an interpreter that the caller has prepared (parameters, tools); `report` gets the interpreter
/// and the source too, for [`Interpreter::diagnose`].
pub fn canon_text_of(
    interpreter: &mut Interpreter,
    source: &mut dyn LineSource,
    sink: &mut dyn CanonSink,
    mut report: impl FnMut(&Error, &Interpreter, &dyn LineSource) -> bool,
) {
    let mut machine = SimulatedMachine::new(sink);
    machine.forgets_splines = !interpreter.settings().is_newer();
    loop {
        match interpreter.step(source, &mut machine) {
            Ok(Status::Running) => {}
            Ok(Status::Synch) => machine.answer(interpreter),
            Ok(Status::Ended) => break,
            Err(error) => {
                let go_on = report(&error, interpreter, source);
                if !go_on || interpreter.has_ended() {
                    break;
                }
                machine.answer(interpreter);
            }
        }
    }
    if interpreter.has_begun() {
        machine.command(&Canon::OnReset, Span::default());
        machine.command(&Canon::OnReset, Span::default());
    }
}
