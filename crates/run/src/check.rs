//! Everything that can be said before anything moves, block by block: language, reach, travel, singularities.
//!
//! Nothing is planned here: every programmed move is sampled closely along its whole length. All findings are
//! reported (one a block and kind), not only the first.

use crate::feeder::{Events, face, frame, interpreter};
use crate::program::Program;
use crate::switch::switched;
use crate::{Options, messages};
use pkm_canon::Span;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_gcode::Status;
use pkm_kins::machine::Mechanism;
use pkm_kins::{JointRange, Joints, Kinematics, Pose};
use pkm_machine::Machine;
use pkm_planner::path::Geometry;
use pkm_planner::{Event, Frame, Move, PlanError, PlanErrorKind};
use std::collections::VecDeque;

/// Distance between samples, mm (or rad where only angles move), and the most samples a move gets.
const SPACING: f64 = 0.25;
const MOST_SAMPLES: u32 = 100_000;
/// Findings kept.
const MOST_FINDINGS: usize = 1000;

/// The outcome of a check.
#[derive(Debug, Clone, Default)]
pub struct Checked {
    /// All findings, in program order.
    pub diagnostics: Vec<Diagnostic>,
    /// Blocks executed.
    pub blocks: u64,
    /// Moves looked at.
    pub moves: u64,
}

impl Checked {
    /// True if a finding forbids to run the program.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity == Severity::Error)
    }

    fn add(&mut self, program: &Program, finding: Diagnostic) {
        match self.diagnostics.len() {
            n if n < MOST_FINDINGS => self.diagnostics.push(finding),
            MOST_FINDINGS => self.diagnostics.push(messages::too_many(program, MOST_FINDINGS)),
            _ => {}
        }
    }
}

/// Checks a whole program.
///
/// # Errors
/// The program cannot be read.
pub fn check(program: &Program, machine: &Machine, options: &Options) -> Result<Checked, Diagnostic> {
    let start = options.start.unwrap_or(machine.home);
    let mut checked = Checked::default();
    let mut mechanism = machine.mechanism;
    let at_start = mechanism.inverse(&start).map_err(PlanErrorKind::Unreachable);
    if let Err(kind) = at_start.and_then(|joints| travel(machine, &start, &joints)) {
        let error = PlanError { kind, span: Span::default(), pose: start };
        let mut finding = messages::plan(program, machine, &error);
        finding.message = format!("where the machine stands at the start: {}", finding.message);
        finding.help = Some("choose a start within reach: --start, or home in the machine file".to_owned());
        checked.add(program, finding);
    }
    let mut interpreter = interpreter(machine, options, &start);
    let mut source = program.open().map_err(|e| messages::unreadable(program, &e))?;
    let mut frame = frame(machine, &start);
    let mut queue = VecDeque::new();
    loop {
        let mut sink = Events { frame: &mut frame, queue: &mut queue };
        match interpreter.step(&mut *source, &mut sink) {
            Ok(status) => {
                checked.blocks += 1;
                while let Some((event, span)) = queue.pop_front() {
                    match event {
                        Event::Move(step) => {
                            checked.moves += 1;
                            check_move(program, machine, &mechanism, &step, span, &mut checked);
                        }
                        Event::Unsupported(what) => {
                            checked.add(program, messages::unsupported(program, span, what));
                        }
                        Event::MachineCode(number) => {
                            let code = (number, span);
                            let switch = check_switch(
                                program,
                                machine,
                                &mut mechanism,
                                code,
                                &mut frame,
                                &mut checked,
                            );
                            if let Err(finding) = switch {
                                checked.add(program, finding);
                                checked.add(program, messages::not_checked_further(program, span));
                                return Ok(checked);
                            }
                        }
                        Event::Dwell { .. } | Event::Stop => {}
                    }
                }
                match status {
                    Status::Running => {}
                    Status::Synch => interpreter.set_machine_position_mm(face(frame.position())),
                    Status::Ended => return Ok(checked),
                }
            }
            Err(error) => {
                queue.clear();
                checked.add(program, error.to_diagnostic(&program.name(), interpreter.source_line()));
                if interpreter.has_ended() || checked.diagnostics.len() > MOST_FINDINGS {
                    return Ok(checked);
                }
            }
        }
    }
}

/// A switch without motion.
fn check_switch(
    program: &Program,
    machine: &Machine,
    mechanism: &mut Mechanism,
    code: (i32, Span),
    frame: &mut Frame,
    checked: &mut Checked,
) -> Result<(), Diagnostic> {
    let pose = Pose::from_array(*frame.position());
    let joints = mechanism.inverse(&pose).map_err(|error| {
        let kind = PlanErrorKind::Unreachable(error);
        messages::plan(program, machine, &PlanError { kind, span: code.1, pose })
    })?;
    let after = switched(program, machine, mechanism, code, &joints, &pose)?;
    if after.joints != joints {
        checked.add(program, messages::form_switch(program, code.1));
    }
    *mechanism = after.mechanism;
    frame.set_position(after.pose.to_array());
    Ok(())
}

/// Travel of joints and axes.
fn travel(machine: &Machine, pose: &Pose, joints: &Joints) -> Result<(), PlanErrorKind> {
    for (joint, (limits, &value)) in machine.joints.iter().zip(joints).enumerate() {
        let range = limits.range;
        if !range.contains(value) {
            return Err(PlanErrorKind::JointTravel { joint, value, range });
        }
    }
    for limits in &machine.axes {
        let value = pose.get(limits.axis);
        if let Some(range) = limits.range
            && !range.contains(value)
        {
            return Err(PlanErrorKind::AxisTravel { axis: limits.axis, value, range });
        }
    }
    Ok(())
}

/// By how much more than `known` an error of the same kind misses; negative for another kind.
fn excess(kind: &PlanErrorKind, known: &PlanErrorKind) -> f64 {
    let beyond = |value: f64, range: JointRange| (range.min - value).max(value - range.max);
    match (kind, known) {
        (
            PlanErrorKind::JointTravel { joint, value, range },
            PlanErrorKind::JointTravel { joint: known_joint, value: known, .. },
        ) if joint == known_joint => beyond(*value, *range) - beyond(*known, *range),
        (
            PlanErrorKind::AxisTravel { axis, value, range },
            PlanErrorKind::AxisTravel { axis: known_axis, value: known, .. },
        ) if axis == known_axis => beyond(*value, *range) - beyond(*known, *range),
        _ => -1.0,
    }
}

/// Samples one move from end to end; the worst place of the first kind of trouble is the block's finding.
fn check_move(
    program: &Program,
    machine: &Machine,
    mechanism: &Mechanism,
    step: &Move,
    span: Span,
    checked: &mut Checked,
) {
    if !step.rapid && !(step.feed.speed > 0.0) {
        checked.add(program, messages::feed_unset(program, span));
    }
    let length = step.geometry.length();
    let bend = if matches!(step.geometry, Geometry::Line(_)) { 1.0 } else { 4.0 };
    let count = (length * bend / SPACING).clamp(2.0, f64::from(MOST_SAMPLES)) as u32;
    let mut nearest: Option<(f64, usize, Pose)> = None;
    let mut worst: Option<(PlanErrorKind, Pose)> = None;
    for k in 0..=count {
        let s = if k == count { length } else { length * f64::from(k) / f64::from(count) };
        let point = step.geometry.at(s);
        let [pose, first, second] = [point.position, point.first, point.second].map(Pose::from_array);
        // Not the place alone: an axis may be locked, a form switch too near to be passed.
        let motion = mechanism.motion(&pose, &first, &second).map_err(PlanErrorKind::Unreachable);
        if let Err(kind) = motion.and_then(|motion| travel(machine, &pose, &motion.position)) {
            if worst.as_ref().is_none_or(|(known, _)| excess(&kind, known) > 0.0) {
                worst = Some((kind, pose));
            }
            continue;
        }
        let Ok(measure) = mechanism.singularity(&pose) else { continue };
        let value = measure.inverse.min(measure.forward);
        if !(value >= machine.singularity.guard) {
            worst.get_or_insert((
                PlanErrorKind::Unreachable(pkm_kins::InverseError::Singular { measure: value }),
                pose,
            ));
        } else if value < machine.singularity.warn && nearest.is_none_or(|(best, ..)| value < best) {
            nearest = Some((value, measure.inverse_joint, pose));
        }
    }
    if let Some((kind, pose)) = worst {
        checked.add(program, messages::plan(program, machine, &PlanError { kind, span, pose }));
        return;
    }
    if let Some((value, joint, pose)) = nearest {
        checked.add(program, messages::too_near_singularity(program, machine, span, &pose, joint, value));
    }
}
