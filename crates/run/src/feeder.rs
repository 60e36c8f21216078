//! The motion controller: interpreter → frame → planner, one setpoint per servo period.
//!
//! The interpreter is read only as far ahead as the planner has room, so memory does not grow with the program.

use crate::deviation::Programmed;
use crate::probing::Probing;
use crate::program::Program;
use crate::setup::{
    Events, HostLimits, HostPlanner, face, frame, interpreter, limits, open, skip_to_line, tell_probe,
};
use crate::switch::{FormSwitchDrive, switched};
use crate::synchronised::{MOST_MOVES, SynchronisedDrive};
use crate::{Options, messages};
use pkm_canon::diagnostic::Diagnostic;
use pkm_canon::{FileId, Probe, Span};
use pkm_gcode::{FileSource, Interpreter, LineSource, Parameters, Status};
use pkm_hal_sim::{Feedback, Operator, Orient, Setpoint, SetpointSource, Simulation, SpindleCommand};
use pkm_kins::machine::Mechanism;
use pkm_kins::{Joints, Kinematics, Pose};
use pkm_machine::{Machine, Switched};
use pkm_planner::path::{FeedGroup, Geometry, feed_length};
use pkm_planner::{
    Chords, Event, Feed, Frame, Merger, Move, PathMode, PushError, Smoother, SpindleOrder, State,
    SynchronisedMove,
};
use std::collections::VecDeque;
use std::fmt;

mod in_step;

/// Setpoints a smoother can average: its longest window with ten rows between the servo ticks.
const SMOOTHER: usize = 640;

/// Why there is no setpoint.
#[derive(Debug)]
pub(crate) struct FeederError(pub(crate) Box<Diagnostic>);

impl fmt::Display for FeederError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.message)
    }
}

/// What can only begin at rest.
#[derive(Debug)]
enum Pending {
    /// A code of the machine's own.
    Code(i32, Span),
    /// A chain, with the retract scale of a tap.
    Chain(Vec<SynchronisedMove>, Option<f64>),
    Probe(Move, Probe, Span),
    Orient(Orient, Span),
}

/// What the chains in step with the spindle were.
#[derive(Debug, Default)]
pub(crate) struct Chains {
    pub(crate) threads: u64,
    pub(crate) taps: u64,
    /// Those in which the tool never caught up.
    pub(crate) warnings: Vec<Diagnostic>,
}

/// The controller of one run.
pub(crate) struct Feeder<'a> {
    program: &'a Program,
    machine: &'a Machine,
    interpreter: Interpreter,
    source: FileSource<'a>,
    frame: Frame,
    planner: Box<HostPlanner>,
    /// The mechanism in force: of the machine file until a program switches.
    mechanism: Mechanism,
    limits: HostLimits,
    /// What waits for everything before it to be driven.
    pending: Option<Pending>,
    form_switch: Option<FormSwitchDrive>,
    /// Moves in step with the spindle that so far belong to one chain, and the chain under way.
    chain: Vec<SynchronisedMove>,
    in_step: Option<SynchronisedDrive>,
    pub(crate) chains: Chains,
    probing: Option<Probing>,
    /// Whether there is anything to probe.
    has_probe: bool,
    /// What the machine told last; `fresh` until the next setpoint.
    feedback: Feedback,
    fresh: bool,
    /// What the spindle does, and what it will be told when that move (counted from 0) begins.
    spindle: SpindleOrder,
    orders: VecDeque<(u32, SpindleOrder)>,
    /// Moves pushed so far.
    moves: u32,
    /// Where the spindle stands after M19, and the M19 under way with the periods it has waited.
    orient: Option<Orient>,
    orienting: Option<(Span, u64)>,
    /// The interpreter waits to be told where the machine stands.
    synch: bool,
    substeps: u32,
    /// Setpoints given so far.
    given: u64,
    smoother: Option<Box<Smoother<SMOOTHER>>>,
    /// Setpoints not yet reached by the average, oldest first: it is half a window late.
    late: VecDeque<pkm_planner::Setpoint>,
    delay: usize,
    setpoint: pkm_planner::Setpoint,
    queue: VecDeque<(Event, Span)>,
    merger: Merger,
    /// Moves that have left the merger, with the chords they stand for.
    merged: VecDeque<(Move, Chords)>,
    program_ended: bool,
    /// The operator's override, before what the machine adapts.
    feed_override: f64,
    /// The planner runs twice in this period.
    doubled: bool,
    /// Feed hold.
    held: bool,
    aborted: bool,
    failure: Option<Diagnostic>,
    pub(crate) programmed: Programmed,
    pub(crate) blocks: u64,
    pub(crate) path_length_mm: f64,
}

impl<'a> Feeder<'a> {
    pub(crate) fn new(
        program: &'a Program,
        machine: &'a Machine,
        options: &Options,
    ) -> Result<Self, Diagnostic> {
        let start = options.program_start(machine);
        let limits = limits(program, machine)?;
        let settings = pkm_planner::Settings {
            servo_period_s: machine.servo_period_ns as f64 / 1e9,
            substeps: options.substeps.max(1),
            settle_periods: machine.path.smoothing_periods,
        };
        let mut planner = Box::new(
            HostPlanner::new(machine.mechanism, limits.clone(), settings, start)
                .map_err(|e| messages::plan(program, machine, &e))?,
        );
        planner.set_feed_override(options.feed_override);
        let window = machine.path.smoothing_periods as usize * options.substeps.max(1) as usize;
        let setpoint = *planner.setpoint();
        let smoother = (window > 1).then(|| Box::new(Smoother::new(window, setpoint.joints)));
        let mut source = open(program, Some(machine))?;
        let mut interpreter = interpreter(machine, options, &start);
        let (mut frame, mut queue) = (frame(machine, &start), VecDeque::new());
        let mut sink = Events { frame: &mut frame, queue: &mut queue };
        skip_to_line(&mut interpreter, program, &mut source, options, &start, &mut sink)?;
        // Nothing of what was skipped moves the machine; the spindle turns as it then would.
        queue.retain(|(event, _)| matches!(event, Event::Spindle(_)));
        Ok(Self {
            program,
            machine,
            interpreter,
            source,
            frame,
            planner,
            mechanism: machine.mechanism,
            limits,
            pending: None,
            form_switch: None,
            chain: Vec::new(),
            in_step: None,
            chains: Chains::default(),
            probing: None,
            has_probe: !options.workpiece(machine).is_empty(),
            feedback: Feedback::default(),
            fresh: false,
            spindle: SpindleOrder::default(),
            orders: VecDeque::new(),
            moves: 0,
            orient: None,
            orienting: None,
            synch: false,
            substeps: settings.substeps,
            given: 0,
            smoother,
            late: VecDeque::new(),
            delay: window / 2,
            setpoint,
            queue,
            merger: Merger::default(),
            merged: VecDeque::new(),
            program_ended: false,
            feed_override: options.feed_override,
            doubled: false,
            held: false,
            aborted: false,
            failure: None,
            programmed: Programmed::default(),
            blocks: 0,
            path_length_mm: 0.0,
        })
    }

    /// Everything driven and at rest.
    pub(crate) fn is_done(&mut self) -> bool {
        self.fill();
        let waits = self.pending.is_some() || !self.chain.is_empty() || self.is_elsewhere();
        // What lies behind a place that cannot be planned is never driven.
        let driven = self.planner.is_idle() || self.failure.is_some() && self.planner.at_rest();
        let taken = self.queue.is_empty() && self.merged.is_empty();
        self.program_ended && taken && !waits && driven
    }

    /// Something else than the planner moves the machine, or it is waited for.
    fn is_elsewhere(&self) -> bool {
        let moves = self.form_switch.is_some() || self.in_step.is_some();
        moves || self.probing.is_some() || self.orienting.is_some()
    }

    /// True while a chain waits for the spindle or follows it.
    pub(crate) fn is_in_step(&self) -> bool {
        self.in_step.is_some()
    }

    /// How far the tool is from where the spindle's turns (now, at the end of the period) say it should be, while it is in step.
    pub(crate) fn synchronisation_error_mm(&self, simulation: &Simulation) -> Option<f64> {
        self.in_step.as_ref()?.error_mm(&simulation.report().feedback.spindle)
    }

    /// The mechanism in force.
    pub(crate) fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    /// Stops for want of the next move that were not the program's.
    pub(crate) fn starved_stops(&self) -> u64 {
        self.planner.work().starved
    }

    /// True during a form switch: no path is programmed then.
    pub(crate) fn is_switching(&self) -> bool {
        self.form_switch.is_some()
    }

    /// The parameters as the program left them.
    pub(crate) fn parameters(&self) -> &Parameters {
        self.interpreter.parameters()
    }

    pub(crate) fn failure(&self) -> Option<&Diagnostic> {
        self.failure.as_ref()
    }

    /// Line being executed.
    pub(crate) fn line(&self) -> u32 {
        let elsewhere = self.form_switch.as_ref().map(|switch| switch.span);
        let elsewhere = elsewhere.or(self.in_step.as_ref().map(|drive| drive.span));
        elsewhere.unwrap_or(self.planner.setpoint().span).line
    }

    /// The path of a subroutine file.
    pub(crate) fn file_name(&self, file: FileId) -> String {
        self.source.file_name(file).unwrap_or_default()
    }

    /// The setpoint given last.
    pub(crate) fn setpoint(&self) -> &pkm_planner::Setpoint {
        &self.setpoint
    }

    /// Interprets as far ahead as the planner has room.
    fn fill(&mut self) {
        // A tick, too, can come upon a place that cannot be planned, when nothing is left to push.
        if self.failure.is_none()
            && let Some(fault) = self.planner.fault().copied()
        {
            self.fail(messages::plan(self.program, self.machine, &fault));
        }
        // After an abort the program stands where the machine stands.
        if self.aborted && self.planner.is_idle() && !self.is_elsewhere() {
            self.frame.set_position(*self.planner.end());
            self.interpreter.set_machine_position_mm(face(self.frame.position()));
        }
        self.conclude_probing();
        while self.planner.has_room() && !self.is_elsewhere() {
            if self.pending.is_some() {
                self.planner.finish();
                if !self.planner.is_idle() || !self.given.is_multiple_of(self.substeps.into()) {
                    return;
                }
                // What the probe tells before the first period says nothing.
                if matches!(self.pending, Some(Pending::Probe(..))) && (!self.fresh || self.given == 0) {
                    return;
                }
                if let Some(pending) = self.pending.take()
                    && let Err(failure) = self.begin(pending)
                {
                    self.fail(failure);
                }
            } else if let Some((step, chords)) = self.merged.pop_front() {
                if let Err(failure) = self.push(step, &chords) {
                    self.fail(failure);
                }
            } else if let Some((event, span)) = self.queue.pop_front() {
                if let Err(failure) = self.take(event, span) {
                    self.fail(failure);
                }
            } else if self.program_ended {
                self.flush_merger();
                if self.merged.is_empty() {
                    self.planner.finish();
                    if self.chain.is_empty() {
                        return;
                    }
                    self.close_chain();
                }
            } else if self.synch {
                self.synch = false;
                self.interpreter.set_machine_position_mm(face(self.frame.position()));
            } else {
                self.step();
            }
        }
    }

    /// What the operator asks for, every period.
    fn operator(&mut self, operator: &Operator) {
        self.doubled = operator.doubled;
        self.planner.hold(operator.feed_hold);
        self.planner.set_feed_override(self.feed_override * operator.adaptive_feed);
        self.held = operator.feed_hold;
        if operator.abort && !self.aborted {
            self.aborted = true;
            if let Some(drive) = &mut self.in_step {
                drive.abort();
            }
            self.fail(messages::aborted(self.program, self.line()));
            self.planner.abort();
        }
    }

    fn step(&mut self) {
        let mut sink = Events { frame: &mut self.frame, queue: &mut self.queue };
        match self.interpreter.step(&mut self.source, &mut sink) {
            Ok(status) => {
                self.blocks += 1;
                self.program_ended = status == Status::Ended;
                self.synch = status == Status::Synch;
            }
            Err(error) => {
                let failure = self.interpreter.diagnose(&error, &self.source, &self.program.name());
                self.fail(failure);
            }
        }
    }

    fn fail(&mut self, failure: Diagnostic) {
        self.failure.get_or_insert(failure);
        self.program_ended = true;
        self.queue.clear();
        self.merger = Merger::default();
        self.merged.clear();
        self.chain.clear();
        self.pending = None;
        self.orienting = None;
    }

    /// The machine rests and nothing is waiting: what needs that begins.
    fn begin(&mut self, pending: Pending) -> Result<(), Diagnostic> {
        match pending {
            Pending::Code(code, span) => self.switch((code, span)),
            Pending::Orient(orient, span) => {
                self.orient = Some(orient);
                self.orienting = Some((span, 0));
                Ok(())
            }
            Pending::Chain(moves, retract_scale) => self.begin_chain(moves, retract_scale),
            Pending::Probe(step, probe, span) => {
                if !self.has_probe {
                    return Err(messages::probe_not_wired(self.program, span));
                }
                if self.feedback.probe != probe.away {
                    return Err(messages::probe_at_start(self.program, span, probe.away));
                }
                self.push(step, &Chords::default())?;
                self.planner.finish();
                self.probing = Some(Probing { probe, span, tripped: None });
                Ok(())
            }
        }
    }

    /// At rest, at the beginning of a servo period: does what a code of the machine's own asks for.
    fn switch(&mut self, code: (i32, Span)) -> Result<(), Diagnostic> {
        let joints = self.planner.setpoint().joints;
        let pose = Pose::from_array(*self.frame.position());
        let after = switched(self.program, self.machine, &self.mechanism, code, &joints, &pose)?;
        if after.joints == joints {
            return self.arrive(&after, code.1);
        }
        let settle = self.machine.path.smoothing_periods;
        self.form_switch =
            Some(FormSwitchDrive::new(self.machine, &joints, after, code.1, self.substeps, settle));
        Ok(())
    }

    /// The machine stands at the end of a switch.
    fn arrive(&mut self, after: &Switched, span: Span) -> Result<(), Diagnostic> {
        self.planner.switch(after.mechanism, after.pose, span).map_err(|error| match error {
            PushError::Plan(error) => messages::plan(self.program, self.machine, &error),
            PushError::Full => messages::host(self.program, "a switch while the machine moves"),
        })?;
        self.mechanism = after.mechanism;
        self.frame.set_position(after.pose.to_array());
        self.programmed.clear();
        Ok(())
    }

    /// The planned setpoint, or that of a form switch. The planner keeps step with the servo periods in either case.
    fn planned(&mut self) -> Result<pkm_planner::Setpoint, Diagnostic> {
        if let Err(error) = self.planner.tick() {
            return Err(messages::plan(self.program, self.machine, &error));
        }
        self.given += 1;
        if let Some(drive) = &mut self.in_step {
            let spindle = &self.feedback.spindle;
            return drive.next(self.program, self.machine, &self.mechanism, spindle, &self.setpoint);
        }
        let planned = self.planner.setpoint();
        Ok(match &mut self.form_switch {
            Some(drive) => drive.next(&self.mechanism, planned),
            None => *planned,
        })
    }

    /// The pose of averaged joints. Near a singularity they may have none; the planned one is shown then.
    fn pose_of(&self, joints: &Joints, planned: &Pose) -> Pose {
        match &self.form_switch {
            Some(drive) => drive.pose(&self.mechanism, joints),
            None => self.mechanism.forward(joints, &self.setpoint.pose).unwrap_or(*planned),
        }
    }

    /// What waits in the merger goes on its way.
    fn flush_merger(&mut self) {
        self.merger.flush(|step, chords| self.merged.push_back((step, chords.clone())));
    }

    fn take(&mut self, event: Event, span: Span) -> Result<(), Diagnostic> {
        if !self.chain.is_empty() && !matches!(event, Event::Synchronised(_)) {
            self.queue.push_front((event, span));
            self.close_chain();
            return Ok(());
        }
        if let Event::Move(step) = event {
            let within_mm = self.frame.merge_tolerance_mm();
            self.merger.push(step, within_mm, |step, chords| self.merged.push_back((step, chords.clone())));
            return Ok(());
        }
        self.flush_merger();
        if !self.merged.is_empty() {
            self.queue.push_front((event, span));
            return Ok(());
        }
        match event {
            Event::Unsupported(what) => Err(messages::unsupported(self.program, span, what)),
            Event::MachineCode(number) => {
                self.planner.finish();
                self.pending = Some(Pending::Code(number, span));
                Ok(())
            }
            Event::Synchronised(_) if self.chain.len() >= MOST_MOVES => {
                Err(messages::chain_too_long(self.program, span, MOST_MOVES))
            }
            Event::Synchronised(step) => {
                self.chain.push(step);
                Ok(())
            }
            Event::RigidTap { step, retract_scale } => {
                self.planner.finish();
                self.pending = Some(Pending::Chain(vec![step], Some(retract_scale)));
                Ok(())
            }
            Event::Probe(step, probe) => {
                self.planner.finish();
                self.pending = Some(Pending::Probe(step, probe, span));
                Ok(())
            }
            Event::Orient { angle_deg, direction } => {
                self.planner.finish();
                self.pending = Some(Pending::Orient(Orient { angle_deg, direction }, span));
                Ok(())
            }
            Event::Spindle(order) => {
                match self.orders.back_mut() {
                    Some((motion, last)) if *motion == self.moves => *last = order,
                    _ => self.orders.push_back((self.moves, order)),
                }
                Ok(())
            }
            Event::Stop => {
                self.planner.finish();
                Ok(())
            }
            Event::Dwell { ns } => self.planner.push_dwell(ns, span).map_err(|error| self.refused(&error)),
            // Taken above.
            Event::Move(_) => Ok(()),
        }
    }

    fn push(&mut self, step: Move, chords: &Chords) -> Result<(), Diagnostic> {
        let motion = self.planner.push(step).map_err(|error| self.refused(&error))?;
        self.moves = motion.wrapping_add(1);
        let length = step.geometry.length();
        self.path_length_mm += length * feed_length(&step.geometry.at(0.0).first, step.feed.group);
        if length > 0.0 {
            self.programmed.push(motion, step.geometry, chords);
        }
        Ok(())
    }

    fn refused(&self, error: &PushError) -> Diagnostic {
        match error {
            PushError::Plan(error) => messages::plan(self.program, self.machine, error),
            // `has_room` was asked.
            PushError::Full => messages::host(self.program, "the planner's queue overran"),
        }
    }
}

impl SetpointSource for Feeder<'_> {
    type Error = FeederError;

    fn feedback(&mut self, feedback: &Feedback) {
        self.operator(&feedback.operator);
        self.feedback = *feedback;
        self.fresh = true;
    }

    fn next(&mut self, _tick: u64) -> Result<Setpoint, FeederError> {
        let told = |failure| FeederError(Box::new(failure));
        // In step with the spindle the place follows its turns, not the number of periods.
        if self.doubled && self.in_step.is_none() {
            self.fill();
            self.planned().map_err(told)?;
        }
        self.fill();
        self.wait_for_angle().map_err(told)?;
        self.order_spindle();
        let mut setpoint = self.planned().map_err(told)?;
        self.fresh = false;
        if let Some(fault) = self.planner.fault().copied() {
            let failure = messages::plan(self.program, self.machine, &fault);
            self.fail(failure);
        }
        if let Some(smoother) = &mut self.smoother {
            let (joints, joint_velocity) = smoother.push(&setpoint.joints, &setpoint.joint_velocity);
            let pose = self.pose_of(&joints, &setpoint.pose);
            self.late.push_back(setpoint);
            // The place on the path is that of the setpoint in the middle of the window.
            let middle = match self.late.len() {
                n if n > self.delay => self.late.pop_front().unwrap_or(setpoint),
                _ => self.late.front().copied().unwrap_or(setpoint),
            };
            // In step with the spindle there is no time for an average; it follows, and has arrived before the next move.
            if self.in_step.is_none() {
                let state = setpoint.state;
                setpoint = pkm_planner::Setpoint { joints, joint_velocity, pose, state, ..middle };
            }
        }
        self.setpoint = setpoint;
        if let Some(drive) = self.form_switch.take_if(|drive| drive.is_over())
            && let Err(failure) = self.arrive(&drive.after, drive.span)
        {
            self.fail(failure);
        }
        let spindle = self.spindle_command();
        if let Err(failure) = self.end_chain() {
            self.fail(failure);
        }
        Ok(Setpoint {
            pose: setpoint.pose,
            joints: setpoint.joints,
            velocities: setpoint.joint_velocity,
            line: setpoint.span.line,
            in_position: setpoint.state == State::Idle,
            spindle,
        })
    }
}

#[cfg(test)]
#[path = "feeder_tests.rs"]
mod tests;
