//! Everything that can be said before anything moves, block by block: language, reach, travel, singularities.
//!
//! Nothing is planned here: every programmed move is sampled closely along its whole length. All findings are
//! reported (one a block and kind), not only the first.

use crate::probing::contact;
use crate::program::Program;
use crate::setup::{
    Events, HostLimits, face, frame, inside, interpreter, limits, open, settings, skip_to_line, tell_probe,
};
use crate::switch::switched;
use crate::synchronised::judge;
use crate::{Options, messages};
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_canon::{FileId, Span};
use pkm_gcode::{LineSource, Remap, Status, static_check};
use pkm_kins::machine::Mechanism;
use pkm_kins::{JointRange, Kinematics, Pose, Singularity};
use pkm_machine::Machine;
use pkm_planner::path::{FeedGroup, Geometry};
use pkm_planner::{Event, Feed, Frame, Move, PlanError, PlanErrorKind, SynchronisedMove};
use std::collections::{BTreeSet, VecDeque};
use std::ops::ControlFlow;

/// Distance between samples, mm (see `Geometry::places` for what turns), and the most samples a move gets.
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
    /// What was found where: a loop or a sub that runs often says it once.
    known: BTreeSet<(String, u32, u32, String)>,
    /// The first block that probes.
    pub probes: Option<Span>,
    /// The spindle is used.
    pub turns: bool,
}

impl Checked {
    /// True if a finding forbids to run the program.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity == Severity::Error)
    }

    /// More is not worth looking for.
    pub(crate) fn is_full(&self) -> bool {
        self.diagnostics.len() > MOST_FINDINGS
    }

    /// What reading finds without running: an error is left out where the run has found one in the same line.
    pub(crate) fn add_static(
        &mut self,
        program: &Program,
        machine: Option<&Machine>,
        options: &Options,
    ) -> Result<(), Diagnostic> {
        let mut source = open(program, machine)?;
        let remaps: Vec<Remap> = machine
            .into_iter()
            .flat_map(|machine| machine.program.remaps.iter().map(|code| code.remap.clone()))
            .collect();
        let settings = settings(machine, options);
        let found = static_check(&mut source, &settings, &remaps, options.parameters, &program.name());
        for finding in found {
            let same_line = |b: &&mut Diagnostic| {
                b.severity == Severity::Error && (finding.line, &finding.file) == (b.line, &b.file)
            };
            let told = self.diagnostics.iter_mut().find(same_line);
            match told.filter(|_| finding.severity == Severity::Error) {
                None => self.add(program, finding),
                // That its end is missing has nothing to do with what is wrong in its head.
                Some(_) if finding.code == "o-unclosed" => self.add(program, finding),
                // Why a loop does not end says more than that it has not ended.
                Some(told) if finding.code == "endless-loop" => *told = finding,
                Some(told) if told.code == finding.code => told.notes.extend(finding.notes),
                Some(_) => {}
            }
        }
        Ok(())
    }

    /// In the order a person reads: the program's own lines, then those of its subroutine files. What is about no line
    /// comes first; that there is more to find comes last.
    pub(crate) fn sort(&mut self, program: &Program) {
        let own = program.name();
        self.diagnostics.sort_by(|a, b| {
            let key = |d: &Diagnostic| (d.code == messages::TOO_MANY, d.file != own, d.line == 0);
            let ((more_a, other_a, whole_a), (more_b, other_b, whole_b)) = (key(a), key(b));
            (more_a, other_a, !whole_a, &a.file, a.line, a.column)
                .cmp(&(more_b, other_b, !whole_b, &b.file, b.line, b.column))
        });
    }

    pub(crate) fn add(&mut self, program: &Program, finding: Diagnostic) {
        let key = (finding.file.clone(), finding.line, finding.column, finding.code.clone());
        if !self.known.insert(key) {
            return;
        }
        match self.diagnostics.len() {
            n if n < MOST_FINDINGS => self.diagnostics.push(finding),
            MOST_FINDINGS => self.diagnostics.push(messages::too_many(program, MOST_FINDINGS)),
            _ => {}
        }
    }
}

/// A move as the program wrote it.
#[derive(Debug, Clone, Copy)]
pub struct Programmed<'a> {
    /// Its shape.
    pub geometry: &'a Geometry,
    /// G0.
    pub rapid: bool,
    /// Its line; 0 in the file of a subroutine.
    pub line: u32,
    /// The mechanism in force.
    pub mechanism: &'a Mechanism,
    /// The worst pose of it that the machine cannot take, if there is one.
    pub refused: Option<Pose>,
}

/// Checks a whole program.
///
/// # Errors
/// The program cannot be read.
pub fn check(program: &Program, machine: &Machine, options: &Options) -> Result<Checked, Diagnostic> {
    check_with(program, machine, options, |_| {})
}

/// [`check`], and shows every move to `seen` when it has been checked.
///
/// # Errors
/// As [`check`].
pub fn check_with(
    program: &Program,
    machine: &Machine,
    options: &Options,
    seen: impl FnMut(&Programmed<'_>),
) -> Result<Checked, Diagnostic> {
    let mut checked = interpret(program, machine, options, seen)?;
    checked.add_static(program, Some(machine), options)?;
    checked.sort(program);
    Ok(checked)
}

/// Interprets the program and looks at every move.
fn interpret(
    program: &Program,
    machine: &Machine,
    options: &Options,
    mut seen: impl FnMut(&Programmed<'_>),
) -> Result<Checked, Diagnostic> {
    let start = options.program_start(machine);
    let mut checked = Checked::default();
    let mut mechanism = machine.mechanism;
    let at_start = mechanism.inverse(&start).map_err(PlanErrorKind::Unreachable);
    let limits = limits(program, machine)?;
    if let Err(kind) = at_start.and_then(|joints| limits.check_travel(&start, &joints)) {
        let error = PlanError { kind, span: Span::default(), pose: start };
        let mut finding = messages::plan(program, machine, &error);
        finding.message = format!("where the machine stands at the start: {}", finding.message);
        finding.help = Some("choose a start within reach: --start, or home in the machine file".to_owned());
        checked.add(program, finding);
    }
    let mut interpreter = interpreter(machine, options, &start);
    let mut source = open(program, Some(machine))?;
    let mut frame = frame(machine, &start);
    let workpiece = options.workpiece(machine);
    let mut probed = None;
    let mut queue = VecDeque::new();
    let mut sink = Events { frame: &mut frame, queue: &mut queue };
    if let Err(finding) = skip_to_line(&mut interpreter, program, &mut source, options, &start, &mut sink) {
        checked.add(program, finding);
        return Ok(checked);
    }
    queue.clear();
    let mut approaches = options.start_line.is_some();
    loop {
        let mut sink = Events { frame: &mut frame, queue: &mut queue };
        let stepped = interpreter.step(&mut source, &mut sink);
        if let Err(error) = &stepped {
            let finding = interpreter.diagnose(error, &source, &program.name());
            checked.add(program, finding);
            if checked.is_full() || interpreter.has_ended() {
                return Ok(checked);
            }
            // A block at fault moves nothing, but what it sets and where it leads holds for the blocks behind it.
            queue.retain(|(event, _)| matches!(event, Event::MachineCode(_)));
            let mut sink = Events { frame: &mut frame, queue: &mut queue };
            interpreter.go_on(&mut source, &mut sink);
            queue.retain(|(event, _)| matches!(event, Event::MachineCode(_)));
            if let Some((number, span)) = interpreter.lost_machine_code().filter(|_| queue.is_empty()) {
                queue.push_back((Event::MachineCode(number), span));
            } else {
                frame.set_position(inside(&interpreter.machine_position_mm()));
            }
        }
        if let Some(notice) = interpreter.take_notice() {
            let finding = interpreter.diagnose(&notice, &source, &program.name());
            checked.add(program, Diagnostic { severity: Severity::Note, ..finding });
        }
        let switches = matches!(queue.front(), Some((Event::MachineCode(_), _)));
        checked.blocks += u64::from(stepped.is_ok());
        while let Some((event, span)) = queue.pop_front() {
            let mut findings = Vec::new();
            let mut cannot_go_on = false;
            match event {
                Event::Move(step) => {
                    checked.moves += 1;
                    if core::mem::take(&mut approaches) {
                        findings.push(messages::approach(program, machine, span, &start));
                    }
                    let refused =
                        check_move(program, machine, &mechanism, &limits, (&step, span), &mut findings);
                    seen(&programmed(&step.geometry, step.rapid, span, &mechanism, refused));
                }
                Event::Synchronised(step) => {
                    checked.moves += 1;
                    checked.turns = true;
                    let alone = (&step, None);
                    let refused = check_in_step(program, machine, &limits, &mechanism, alone, &mut findings);
                    seen(&programmed(&step.geometry, false, span, &mechanism, refused));
                }
                Event::RigidTap { step, retract_scale } => {
                    checked.moves += 1;
                    checked.turns = true;
                    let tap = (&step, Some(retract_scale));
                    let refused = check_in_step(program, machine, &limits, &mechanism, tap, &mut findings);
                    seen(&programmed(&step.geometry, false, span, &mechanism, refused));
                }
                Event::Probe(step, probe) => {
                    if checked.probes.is_none() {
                        checked.probes = Some(span);
                        findings.push(messages::probe_assumed(program, span, !workpiece.is_empty()));
                    }
                    checked.moves += 1;
                    let refused =
                        check_move(program, machine, &mechanism, &limits, (&step, span), &mut findings);
                    seen(&programmed(&step.geometry, false, span, &mechanism, refused));
                    let met = contact(workpiece, &step.geometry, probe.away);
                    let place = step.geometry.at(met.unwrap_or(step.geometry.length())).position;
                    // Nothing known: as if it met something at the end.
                    probed = Some((place, met.is_some() || workpiece.is_empty()));
                    frame.set_position(place);
                }
                Event::Spindle(_) | Event::Orient { .. } => checked.turns = true,
                Event::Unsupported(what) => findings.push(messages::unsupported(program, span, what)),
                Event::MachineCode(number) => {
                    let code = (number, span);
                    let switch =
                        check_switch(program, machine, &mut mechanism, code, &mut frame, &mut findings);
                    if let Err(finding) = switch {
                        findings.push(finding);
                        findings.push(messages::not_checked_further(program, span));
                        cannot_go_on = true;
                    }
                }
                Event::Dwell { .. } | Event::Stop => {}
            }
            let in_inches = frame.unit_mm() > 1.0;
            for mut finding in findings {
                // The commonest reason why a whole program is out of reach.
                if let (Severity::Error, true, Some(help)) = (finding.severity, in_inches, &mut finding.help)
                {
                    help.push_str("; lengths are in inches here (G20)");
                }
                // In a sub: its own file, and the calls that led there.
                finding.file = source.file_name(span.file).unwrap_or(finding.file);
                finding.notes.extend(interpreter.call_notes(&source, &program.name()));
                checked.add(program, finding);
            }
            if cannot_go_on {
                return Ok(checked);
            }
        }
        match stepped {
            Ok(Status::Ended) => return Ok(checked),
            Ok(Status::Synch) => {
                if let Some((place, tripped)) = probed.take() {
                    tell_probe(&mut interpreter, &Pose::from_array(place), tripped);
                }
                interpreter.set_machine_position_mm(face(frame.position()));
            }
            Err(_) if switches => interpreter.set_machine_position_mm(face(frame.position())),
            Ok(Status::Running) | Err(_) => {}
        }
    }
}

/// A move in step with the spindle; a tap has a retract scale.
fn check_in_step(
    program: &Program,
    machine: &Machine,
    limits: &HostLimits,
    mechanism: &Mechanism,
    (step, retract_scale): (&SynchronisedMove, Option<f64>),
    findings: &mut Vec<Diagnostic>,
) -> Option<Pose> {
    let feed = Feed { speed: f64::INFINITY, group: FeedGroup::Xyz };
    let SynchronisedMove { geometry, mode, span, .. } = *step;
    let along = Move { geometry, feed, rapid: true, mode, span };
    let refused = check_move(program, machine, mechanism, limits, (&along, span), findings);
    // What cannot be reached is told; how fast that would be says nothing.
    if findings.iter().all(|finding| finding.severity != Severity::Error)
        && let Err(finding) = judge(program, machine, limits, mechanism, step, retract_scale)
    {
        findings.push(finding);
    }
    refused
}

fn programmed<'a>(
    geometry: &'a Geometry,
    rapid: bool,
    span: Span,
    mechanism: &'a Mechanism,
    refused: Option<Pose>,
) -> Programmed<'a> {
    let line = if span.file == FileId(0) { span.line } else { 0 };
    Programmed { geometry, rapid, line, mechanism, refused }
}

/// A switch without motion.
fn check_switch(
    program: &Program,
    machine: &Machine,
    mechanism: &mut Mechanism,
    code: (i32, Span),
    frame: &mut Frame,
    findings: &mut Vec<Diagnostic>,
) -> Result<(), Diagnostic> {
    let pose = Pose::from_array(*frame.position());
    let joints = mechanism.inverse(&pose).map_err(|error| {
        let kind = PlanErrorKind::Unreachable(error);
        messages::plan(program, machine, &PlanError { kind, span: code.1, pose })
    })?;
    let after = switched(program, machine, mechanism, code, &joints, &pose)?;
    if after.joints != joints {
        findings.push(messages::form_switch(program, code.1));
    }
    *mechanism = after.mechanism;
    frame.set_position(after.pose.to_array());
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

/// Samples one move from end to end; the worst place of the first kind of trouble is the block's finding, and the answer.
fn check_move(
    program: &Program,
    machine: &Machine,
    mechanism: &Mechanism,
    limits: &HostLimits,
    (step, span): (&Move, Span),
    findings: &mut Vec<Diagnostic>,
) -> Option<Pose> {
    if !step.rapid && !(step.feed.speed > 0.0) {
        findings.push(messages::feed_unset(program, span));
    }
    let bend = if matches!(step.geometry, Geometry::Line(_)) { 1.0 } else { 4.0 };
    let count = step.geometry.places(SPACING / bend, MOST_SAMPLES).max(2);
    let mut nearest: Option<(f64, Singularity, Pose)> = None;
    let mut worst: Option<(PlanErrorKind, Pose)> = None;
    limits.walk(mechanism, &step.geometry, (count, true), None, |pose, outcome| {
        match outcome {
            Err(kind) => {
                if worst.as_ref().is_none_or(|(known, _)| excess(&kind, known) > 0.0) {
                    worst = Some((kind, *pose));
                }
            }
            Ok(measure) => {
                let value = measure.inverse.min(measure.forward);
                if value < machine.singularity.warn && nearest.is_none_or(|(best, ..)| value < best) {
                    nearest = Some((value, measure, *pose));
                }
            }
        }
        ControlFlow::Continue(())
    });
    if let Some((kind, pose)) = worst {
        findings.push(messages::plan(program, machine, &PlanError { kind, span, pose }));
        return Some(pose);
    }
    if let Some((_, measure, pose)) = nearest {
        findings.push(messages::too_near_singularity(program, machine, span, &pose, &measure));
    }
    None
}
