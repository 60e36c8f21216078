//! What a machine file and the options make of interpreter, frame and limits; mm and degrees at the face.

use crate::program::Program;
use crate::{Options, messages};
use pkm_canon::diagnostic::Diagnostic;
use pkm_canon::{Canon, CanonSink, Span};
use pkm_gcode::{FileSource, Interpreter, LineSource, MachineCodes, Settings};
use pkm_kins::machine::Mechanism;
use pkm_kins::{Kinematics, Pose, maths};
use pkm_machine::Machine;
use pkm_planner::path::{Tolerance, Vector};
use pkm_planner::{AxisLimits, Event, Frame, JointLimits, Limits, Planner};
use std::collections::VecDeque;

/// Pieces and nodes for a look-ahead of thousands of short blocks.
pub(crate) type HostPlanner = Planner<Mechanism, ROWS, 2048, 2048>;

/// Joints and limited axes of any machine: nine of each.
const ROWS: usize = 18;
pub(crate) type HostLimits = Limits<ROWS>;

/// Tolerance of a blend in rotary coordinates, rad (0.01°): G64 P speaks of lengths.
pub(crate) const BLEND_RAD: f64 = 0.01 / 180.0 * maths::PI;

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
        random_toolchanger: machine.program.random_tool_changer,
        ..common
    }
}

/// The program, and the subs that the machine's codes stand for.
///
/// # Errors
/// The program cannot be read, or one of the subs is not found.
pub(crate) fn open<'a>(
    program: &'a Program,
    machine: Option<&Machine>,
) -> Result<FileSource<'a>, Diagnostic> {
    let settings = machine.map(|machine| &machine.program);
    let folders = settings.map(|settings| settings.subroutine_path.as_slice()).unwrap_or_default();
    let mut source = program.open(folders).map_err(|e| messages::unreadable(program, &e))?;
    for code in settings.into_iter().flat_map(|settings| &settings.remaps) {
        if !matches!(source.find_subroutine(code.remap.sub()), Ok(Some(_))) {
            return Err(code.missing.clone());
        }
    }
    Ok(source)
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
    for code in &machine.program.remaps {
        interpreter.add_remap(code.remap.clone());
    }
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

/// Tells the interpreter where the probe answered: machine coordinates, mm and rad.
pub(crate) fn tell_probe(interpreter: &mut Interpreter, at: &Pose, tripped: bool) {
    interpreter.set_machine_position_mm(face(&at.to_array()));
    let point = interpreter.position();
    interpreter.set_probe_result(point, tripped);
}
