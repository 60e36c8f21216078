//! The motion controller: interpreter → frame → planner, one setpoint per servo period.
//!
//! The interpreter is read only as far ahead as the planner has room, so memory does not grow with the program.

use crate::deviation::Programmed;
use crate::program::Program;
use crate::switch::{FormSwitchDrive, switched};
use crate::{Options, messages};
use pkm_canon::diagnostic::Diagnostic;
use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::{Interpreter, LineSource, MachineCodes, Parameters, Settings, Status};
use pkm_hal_sim::{Feedback, Operator, Setpoint, SetpointSource};
use pkm_kins::machine::Mechanism;
use pkm_kins::{Joints, Kinematics, Pose, maths};
use pkm_machine::{Machine, Switched};
use pkm_planner::path::{Tolerance, Vector, feed_length};
use pkm_planner::{
    AxisLimits, Chords, Event, Frame, JointLimits, Limits, Merger, Move, Planner, PushError, Smoother, State,
};
use std::collections::VecDeque;
use std::fmt;

/// Pieces and nodes for a look-ahead of thousands of short blocks.
type HostPlanner = Planner<Mechanism, ROWS, 2048, 2048>;

/// Joints and limited axes of any machine here.
const ROWS: usize = 12;
pub(crate) type HostLimits = Limits<ROWS>;

/// Setpoints a smoother can average: its longest window with ten rows between the servo ticks.
const SMOOTHER: usize = 640;

/// Tolerance of a blend in rotary coordinates, rad (0.01°): G64 P speaks of lengths.
const BLEND_RAD: f64 = 0.01 / 180.0 * maths::PI;

/// What the interpreter needs to know of a machine; all axes and no codes of its own without one.
pub(crate) fn settings(machine: Option<&Machine>, options: &Options) -> Settings {
    let common = Settings {
        block_delete: options.block_delete,
        max_blocks: options.max_blocks,
        max_idle_blocks: options.max_blocks,
        ..Settings::default()
    };
    let Some(machine) = machine else { return common };
    let codes: Vec<i32> = machine.switches.iter().map(|switch| switch.code).collect();
    Settings {
        // A machine has no more codes than the interpreter takes.
        machine_codes: MachineCodes::new(&codes).unwrap_or_default(),
        axes: machine.mechanism.axes(),
        ..common
    }
}

/// An interpreter with tools and parameters as the caller gave them.
pub(crate) fn prepared(settings: Settings, options: &Options) -> Interpreter {
    let mut interpreter = Interpreter::new(settings);
    if let Some(tools) = options.tools {
        interpreter.tools_mut().clone_from(tools);
    }
    if let Some(parameters) = options.parameters {
        interpreter.parameters_mut().clone_from(parameters);
    }
    interpreter
}

/// The interpreter of a machine that stands at `start`.
pub(crate) fn interpreter(machine: &Machine, options: &Options, start: &Pose) -> Interpreter {
    let mut interpreter = prepared(settings(Some(machine), options), options);
    interpreter.set_machine_position_mm(face(&start.to_array()));
    interpreter
}

/// Goes to the line that the options ask for; the machine stays where it stands.
pub(crate) fn skip_to_line(
    interpreter: &mut Interpreter,
    program: &Program,
    source: &mut dyn LineSource,
    options: &Options,
    start: &Pose,
    sink: &mut dyn CanonSink,
) -> Result<(), Diagnostic> {
    let Some(line) = options.start_line else { return Ok(()) };
    interpreter
        .skip_to_line(line, source, sink)
        .map_err(|error| interpreter.diagnose(&error, source, &program.name()))?;
    interpreter.begin_elsewhere(face(&start.to_array()));
    Ok(())
}

/// mm and degrees.
pub(crate) fn face(pose: &Vector) -> pkm_canon::Position {
    let mut v = *pose;
    for angle in &mut v[3..6] {
        *angle = maths::degrees(*angle);
    }
    pkm_canon::Position::from_array(v)
}

/// mm and rad.
pub(crate) fn inside(position: &pkm_canon::Position) -> Vector {
    let mut v = position.to_array();
    for angle in &mut v[3..6] {
        *angle = maths::radians(*angle);
    }
    v
}

/// The frame a program starts in.
pub(crate) fn frame(machine: &Machine, start: &Pose) -> Frame {
    let tolerance = Tolerance { length_mm: machine.path.blend_tolerance, angle_rad: BLEND_RAD };
    Frame::new(start.to_array(), tolerance)
}

/// What the joints and axes of a machine may do.
pub(crate) fn limits(program: &Program, machine: &Machine) -> Result<HostLimits, Diagnostic> {
    let joints: Vec<JointLimits> = machine
        .joints
        .iter()
        .map(|joint| JointLimits {
            range: joint.range,
            max_velocity: joint.max_velocity,
            max_acceleration: joint.max_acceleration,
        })
        .collect();
    let axes: Vec<AxisLimits> = machine
        .axes
        .iter()
        .map(|limits| AxisLimits {
            axis: limits.axis,
            range: limits.range,
            max_velocity: limits.max_velocity.unwrap_or(f64::INFINITY),
            max_acceleration: limits.max_acceleration.unwrap_or(f64::INFINITY),
        })
        .collect();
    Limits::new(&joints, &axes, machine.singularity.guard)
        .map_err(|e| messages::host(program, &format!("the machine's limits cannot be planned with: {e:?}")))
}

/// Collects the events of one block.
pub(crate) struct Events<'a> {
    pub(crate) frame: &'a mut Frame,
    pub(crate) queue: &'a mut VecDeque<(Event, Span)>,
}

impl CanonSink for Events<'_> {
    fn command(&mut self, command: &Canon<'_>, span: Span) {
        self.frame.apply(command, span, |event| self.queue.push_back((event, span)));
    }
}

/// Why there is no setpoint.
#[derive(Debug)]
pub(crate) struct FeederError(pub(crate) Box<Diagnostic>);

impl fmt::Display for FeederError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.message)
    }
}

/// The controller of one run.
pub(crate) struct Feeder<'a> {
    program: &'a Program,
    machine: &'a Machine,
    interpreter: Interpreter,
    source: Box<dyn LineSource + 'a>,
    frame: Frame,
    planner: Box<HostPlanner>,
    /// The mechanism in force: of the machine file until a program switches.
    mechanism: Mechanism,
    /// A code of the machine's own that waits for everything before it to be driven.
    code: Option<(i32, Span)>,
    form_switch: Option<FormSwitchDrive>,
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
            HostPlanner::new(machine.mechanism, limits, settings, start)
                .map_err(|e| messages::plan(program, machine, &e))?,
        );
        planner.set_feed_override(options.feed_override);
        let window = machine.path.smoothing_periods as usize * options.substeps.max(1) as usize;
        let setpoint = *planner.setpoint();
        let smoother = (window > 1).then(|| Box::new(Smoother::new(window, setpoint.joints)));
        let mut source = program.open().map_err(|e| messages::unreadable(program, &e))?;
        let mut interpreter = interpreter(machine, options, &start);
        let (mut frame, mut queue) = (frame(machine, &start), VecDeque::new());
        let mut sink = Events { frame: &mut frame, queue: &mut queue };
        skip_to_line(&mut interpreter, program, &mut *source, options, &start, &mut sink)?;
        Ok(Self {
            program,
            machine,
            interpreter,
            source,
            frame,
            planner,
            mechanism: machine.mechanism,
            code: None,
            form_switch: None,
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
        let waits = self.code.is_some() || self.form_switch.is_some();
        // What lies behind a place that cannot be planned is never driven.
        let driven = self.planner.is_idle() || self.failure.is_some() && self.planner.at_rest();
        let taken = self.queue.is_empty() && self.merged.is_empty();
        self.program_ended && taken && !waits && driven
    }

    /// The mechanism in force.
    pub(crate) fn mechanism(&self) -> &Mechanism {
        &self.mechanism
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
        self.form_switch.as_ref().map_or(self.planner.setpoint().span, |switch| switch.span).line
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
        while self.planner.has_room() && self.form_switch.is_none() {
            if let Some(code) = self.code {
                if !self.planner.is_idle() || !self.given.is_multiple_of(self.substeps.into()) {
                    return;
                }
                self.code = None;
                if let Err(failure) = self.switch(code) {
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
                    return;
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
        if operator.abort && !self.aborted {
            self.aborted = true;
            self.fail(messages::aborted(self.program, self.line()));
            self.planner.abort();
        }
    }

    fn step(&mut self) {
        let mut sink = Events { frame: &mut self.frame, queue: &mut self.queue };
        match self.interpreter.step(&mut *self.source, &mut sink) {
            Ok(status) => {
                self.blocks += 1;
                self.program_ended = status == Status::Ended;
                self.synch = status == Status::Synch;
            }
            Err(error) => {
                let failure = self.interpreter.diagnose(&error, &*self.source, &self.program.name());
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
        self.code = None;
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
        let planned =
            self.planner.tick().map_err(|error| messages::plan(self.program, self.machine, &error))?;
        self.given += 1;
        let Some(drive) = &mut self.form_switch else { return Ok(planned) };
        Ok(drive.next(&self.mechanism, &planned))
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
                self.code = Some((number, span));
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
    }

    fn next(&mut self, _tick: u64) -> Result<Setpoint, FeederError> {
        if self.doubled {
            self.fill();
            self.planned().map_err(|failure| FeederError(Box::new(failure)))?;
        }
        self.fill();
        let mut setpoint = self.planned().map_err(|failure| FeederError(Box::new(failure)))?;
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
            setpoint =
                pkm_planner::Setpoint { joints, joint_velocity, pose, state: setpoint.state, ..middle };
        }
        self.setpoint = setpoint;
        if let Some(drive) = self.form_switch.take_if(|drive| drive.is_over())
            && let Err(failure) = self.arrive(&drive.after, drive.span)
        {
            self.fail(failure);
        }
        Ok(Setpoint {
            pose: setpoint.pose,
            joints: setpoint.joints,
            velocities: setpoint.joint_velocity,
            line: setpoint.span.line,
            in_position: setpoint.state == State::Idle,
            spindle: Default::default(),
        })
    }
}
