//! From errors of the rooms below to one sentence for a person: what, where, value, limit, what to do.

use crate::program::Program;
use crate::summary::Excess;
use pkm_canon::Span;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_hal_sim::{Fault, HalError, HomingError, PinFault};
use pkm_kins::{InverseError, JointKind, JointLimit, Kinematics, Pose, Side, Singularity, maths};
use pkm_machine::{Machine, Refusal, SwitchTarget};
use pkm_planner::{PlanError, PlanErrorKind, SpindleOrder, Stage, SynchronisedMove};
use std::io;

fn at(
    program: &Program,
    span: Span,
    code: &str,
    severity: Severity,
    message: String,
    help: &str,
) -> Diagnostic {
    // Columns count from 1; 0 is the line as a whole.
    let (column, end_column) = if span.end > span.start { (span.start + 1, span.end + 1) } else { (0, 0) };
    Diagnostic {
        code: code.to_owned(),
        severity,
        message,
        help: Some(help.to_owned()),
        file: program.name(),
        line: span.line,
        column,
        end_column,
        notes: Vec::new(),
    }
}

/// The program cannot be read.
pub(crate) fn unreadable(program: &Program, error: &io::Error) -> Diagnostic {
    let message = format!("cannot read {}: {error}", program.name());
    at(program, Span::default(), "file-open", Severity::Error, message, "check the path and its permissions")
}

/// Something is wrong with the machine or this computer, not with a block.
pub(crate) fn host(program: &Program, what: &str) -> Diagnostic {
    at(program, Span::default(), "cannot-run", Severity::Error, what.to_owned(), "check the machine file")
}

/// The coordinates a machine has, as a program writes them.
pub(crate) fn place(machine: &Machine, pose: &Pose) -> String {
    let words = machine.mechanism.axes().iter().map(|axis| {
        let value = pose.get(axis);
        let value = if axis.is_rotary() { maths::degrees(value) } else { value };
        format!("{}{:.3}", axis.letter(), value + 0.0)
    });
    words.collect::<Vec<_>>().join(" ")
}

/// A place on the path that the machine cannot be at.
pub(crate) fn plan(program: &Program, machine: &Machine, error: &PlanError) -> Diagnostic {
    let place = place(machine, &error.pose);
    match error.kind {
        PlanErrorKind::JointTravel { joint, value, range } => {
            let low = value < range.min;
            let (side, limit) = if low { (Side::Low, range.min) } else { (Side::High, range.max) };
            let code = machine.refused_travel(&JointLimit { joint, side, value, limit }).code;
            let (joint_name, unit, face): (_, _, &dyn Fn(f64) -> f64) = match machine.joints.get(joint) {
                Some(j) => (j.name.as_str(), unit(j.kind), &|v| j.to_face(v)),
                None => ("?", "mm", &|v| v),
            };
            let message = format!(
                "at {place} joint {joint_name} would have to be at {:.4} {unit} (travel {} to {} {unit})",
                face(value),
                face(range.min),
                face(range.max)
            );
            let beyond = face(if low { range.min - value } else { value - range.max });
            let help = format!(
                "move the part so that {joint_name} comes {beyond:.4} {unit} {}, or choose another configuration",
                if low { "higher" } else { "lower" }
            );
            at(program, error.span, &code, Severity::Error, message, &help)
        }
        PlanErrorKind::AxisTravel { axis, value, range } => {
            let side = if value < range.min { "low" } else { "high" };
            let code = format!("axis_limit_{side}:{}", axis.letter());
            let (unit, face): (_, fn(f64) -> f64) =
                if axis.is_rotary() { ("°", maths::degrees) } else { ("mm", |v| v) };
            let message = format!(
                "{}{:.4} {unit} is outside the axis' range of {} to {} {unit}",
                axis.letter(),
                face(value),
                face(range.min),
                face(range.max)
            );
            at(program, error.span, &code, Severity::Error, message, "shift the work offset or the part")
        }
        PlanErrorKind::Unreachable(inner) => {
            let code = inner.code().to_string();
            if let InverseError::Singular { measure } = inner
                && let Ok(near) = machine.mechanism.singularity(&error.pose)
            {
                let (which, help) = kind_of_singularity(machine, &near);
                let message = format!(
                    "at {place} the mechanism is too near to a singularity ({which}): measure {measure:.2e}, guard {}",
                    machine.singularity.guard
                );
                return at(program, error.span, &code, Severity::Error, message, help);
            }
            let message = format!("{place} cannot be reached: {inner}");
            let help = match inner {
                InverseError::AxisLocked { .. } if !machine.switches.is_empty() => {
                    "make the mechanism that this axis belongs to the active one first, by its M code"
                }
                InverseError::FormSwitch { .. } => {
                    "no move may pass here: keep further away, or switch the form by its M code"
                }
                _ => {
                    "move the part into the workspace (`pkm workspace` draws it), or choose another configuration"
                }
            };
            at(program, error.span, &code, Severity::Error, message, help)
        }
        PlanErrorKind::NoFeed => feed_unset(program, error.span),
        PlanErrorKind::NoPitch => pitch_zero(program, error.span),
        _ => at(
            program,
            error.span,
            "cannot-run",
            Severity::Error,
            format!("{place} cannot be run"),
            "please report this message",
        ),
    }
}

fn unit(kind: pkm_kins::JointKind) -> &'static str {
    match kind {
        pkm_kins::JointKind::Linear => "mm",
        pkm_kins::JointKind::Rotary => "°",
    }
}

/// The operator gave the program up.
pub(crate) fn aborted(program: &Program, line: u32) -> Diagnostic {
    let span = Span { line, ..Span::default() };
    let message = format!("aborted in line {line}: the machine stands on the path");
    at(program, span, "aborted", Severity::Error, message, "run the program again from its beginning")
}

/// Drives off from outside.
pub(crate) fn emergency_stop(program: &Program, line: u32, tick: u64) -> Diagnostic {
    let span = Span { line, ..Span::default() };
    let message = format!(
        "emergency stop in line {line} at tick {tick}: drives off, the machine stands where its steps stand"
    );
    at(
        program,
        span,
        "emergency-stop",
        Severity::Error,
        message,
        "release it, reset, home, and run the program again",
    )
}

/// A joint found no zero.
pub(crate) fn homing(program: &Program, error: &HomingError) -> Diagnostic {
    at(
        program,
        Span::default(),
        "homing",
        Severity::Error,
        error.to_string(),
        "look at the switch and its wiring, then home again",
    )
}

/// A fault for a pin that the machine does not have.
pub(crate) fn no_such_pin(program: &Program, fault: &PinFault, error: &HalError) -> Diagnostic {
    let message = format!("the fault {fault} cannot be: {error}");
    at(
        program,
        Span::default(),
        "fault-pin",
        Severity::Error,
        message,
        "`pkm hal show --machine FILE pin` lists the pins; a fault needs one with direction IN",
    )
}

/// A joint that was driven over a limit.
pub(crate) fn excess(program: &Program, machine: &Machine, excess: &Excess) -> Diagnostic {
    let span = Span { line: excess.line, ..Span::default() };
    let joint = &machine.joints[excess.joint];
    let message = format!(
        "{} was driven at {:.6} times its limit of {}, {} {}",
        joint.name,
        excess.value / excess.limit,
        excess.quantity,
        joint.to_face(excess.limit),
        match (joint.kind, excess.quantity) {
            (JointKind::Linear, "velocity") => "mm/s",
            (JointKind::Linear, _) => "mm/s²",
            (JointKind::Rotary, "velocity") => "°/s",
            (JointKind::Rotary, _) => "°/s²",
        },
    );
    let help =
        "this is a fault of the planner, not of the program: please report it with program and machine file";
    at(program, span, "limit-exceeded", Severity::Error, message, help)
}

/// A refusal of the simulated HAL.
pub(crate) fn fault(program: &Program, line: u32, fault: &Fault) -> Diagnostic {
    let span = Span { line, ..Span::default() };
    let help = match fault {
        Fault::Jump { .. } | Fault::Steps { .. } => {
            "lower the joint's max velocity or steps per unit, or shorten the driver's times"
        }
        Fault::FollowingError { .. } => {
            "look for lost steps, a slipping encoder or a drive that is off; then home"
        }
        Fault::LimitSwitch { .. } => "reset, then move the joint off its switch: only that way is allowed",
        Fault::AmplifierFault { .. } => "mend the drive, reset, home",
        _ => "reset, home, and run the program again",
    };
    at(program, span, "hal-fault", Severity::Error, fault.to_string(), help)
}

pub(crate) fn max_ticks(program: &Program, ticks: u64, line: u32) -> Diagnostic {
    let span = Span { line, ..Span::default() };
    let message = format!("the run was ended after {ticks} servo periods (--max-ticks), in line {line}");
    at(
        program,
        span,
        "max-ticks",
        Severity::Error,
        message,
        "raise --max-ticks if the program is meant to run longer",
    )
}

pub(crate) fn interrupted(program: &Program, line: u32, ticks: u64) -> Diagnostic {
    let span = Span { line, ..Span::default() };
    let message = format!("interrupted in line {line} after {ticks} servo periods");
    at(program, span, "interrupted", Severity::Error, message, "run it again to finish it")
}

/// Which of the two kinds of singularity is the nearer one, and what it does to a machine.
fn kind_of_singularity(machine: &Machine, measure: &Singularity) -> (String, &'static str) {
    if measure.forward < measure.inverse {
        (
            "type 2, between the links".to_owned(),
            "a small error of the joints moves the tool far here: move the part away, or choose another configuration",
        )
    } else {
        let name = machine.joints.get(measure.inverse_joint).map_or("?", |j| j.name.as_str());
        (
            format!("type 1, at joint {name}"),
            "a joint must go fast here to move the tool slowly: move the part away, or choose another configuration",
        )
    }
}

pub(crate) fn too_near_singularity(
    program: &Program,
    machine: &Machine,
    span: Span,
    pose: &Pose,
    measure: &Singularity,
) -> Diagnostic {
    let (which, help) = kind_of_singularity(machine, measure);
    let value = measure.forward.min(measure.inverse);
    let message = format!(
        "at {} the mechanism comes near a singularity ({which}): measure {value:.4} (warned below {})",
        place(machine, pose),
        machine.singularity.warn
    );
    at(program, span, "near-singular", Severity::Warning, message, help)
}

pub(crate) fn feed_unset(program: &Program, span: Span) -> Diagnostic {
    let message =
        "a feed move with no feed rate: F is 0, or G95 counts turns of a spindle that does not turn";
    let help = "give an F word (and start the spindle for G95) before the first G1, G2 or G3";
    at(program, span, "feed-zero", Severity::Error, message.to_owned(), help)
}

/// The language knows it, the simulated machine does not.
pub(crate) fn unsupported(program: &Program, span: Span, what: &str) -> Diagnostic {
    let message = format!("{what} cannot be run on the simulated machine yet");
    at(
        program,
        span,
        "unsupported-motion",
        Severity::Error,
        message,
        "take it out to run the rest; `pkm canon` interprets it",
    )
}

/// A switch that the mechanism refuses.
pub(crate) fn switch(
    program: &Program,
    span: Span,
    code: i32,
    to: SwitchTarget,
    refusal: &Refusal,
) -> Diagnostic {
    let message = format!("M{code} cannot switch to {to}: {}", refusal.message);
    let help = match to {
        SwitchTarget::Form(_) => "move away from the rails' ends and from the form switch first",
        SwitchTarget::Mechanism(_) => {
            "move to another pose first, or correct where the idle mechanism rests (machine file)"
        }
    };
    at(program, span, &refusal.code, Severity::Error, message, help)
}

/// The first move of a run that does not begin at the first line.
pub(crate) fn approach(program: &Program, machine: &Machine, span: Span, start: &Pose) -> Diagnostic {
    let message =
        format!("the first move goes straight from where the machine stands, {}", place(machine, start));
    let help = "see that nothing is in the way: jog nearer, or begin at a line that retracts first";
    at(program, span, "start-line", Severity::Note, message, help)
}

/// What a form switch means.
pub(crate) fn form_switch(program: &Program, span: Span) -> Diagnostic {
    let message = "on the way to the other form the platform passes c = 0, where it is not held".to_owned();
    at(
        program,
        span,
        "form-switch",
        Severity::Note,
        message,
        "its inertia or an external stop must carry it through; nothing may touch it",
    )
}

/// The check ends here.
pub(crate) fn not_checked_further(program: &Program, span: Span) -> Diagnostic {
    let message = "what follows is not checked: it depends on where this switch leads".to_owned();
    at(program, span, "not-checked", Severity::Note, message, "mend this block and check again")
}

/// The code of [`too_many`].
pub(crate) const TOO_MANY: &str = "too-many";

pub(crate) fn too_many(program: &Program, kept: usize) -> Diagnostic {
    let message = format!("only the first {kept} findings are listed");
    at(program, Span::default(), TOO_MANY, Severity::Note, message, "mend these and check again")
}

fn pitch_zero(program: &Program, span: Span) -> Diagnostic {
    let message = "a move in step with the spindle whose travel per turn is not above 0".to_owned();
    at(program, span, "pitch-zero", Severity::Error, message, "give the pitch: K (in G76: P) above 0")
}

/// S0.
pub(crate) fn spindle_stands(program: &Program, span: Span) -> Diagnostic {
    let message = "a move in step with a spindle whose speed is 0".to_owned();
    at(program, span, "spindle-speed-zero", Severity::Error, message, "give an S word above 0 before it")
}

/// The spindle cannot turn as fast as it is told.
pub(crate) fn spindle_too_slow(program: &Program, span: Span, wanted: f64, most: f64) -> Diagnostic {
    let message = format!("the spindle would have to turn at {wanted:.1} rpm; it reaches {most:.1} rpm");
    let help = "lower S (or I of G33.1), or correct spindle.max_speed_rpm in the machine file";
    at(program, span, "spindle-speed-limit", Severity::Error, message, help)
}

/// The joints cannot follow the spindle.
pub(crate) fn spindle_too_fast(
    program: &Program,
    step: &SynchronisedMove,
    fastest_rpm: f64,
    is_tap: bool,
) -> Diagnostic {
    let rpm = step.turns_s * 60.0;
    let speed = step.turns_s * step.per_turn;
    let message = format!(
        "at {rpm:.1} rpm this move would need {speed:.3} mm/s{}; the highest speed that works here is {:.1} rpm",
        if is_tap { " (or the spindle more turns to stop in)" } else { "" },
        pkm_kins::maths::floor(fastest_rpm * 10.0) / 10.0
    );
    let help =
        "lower S; the joints' velocities and accelerations set this speed, with a tenth kept for catching up";
    at(program, step.span, "spindle-too-fast", Severity::Error, message, help)
}

/// The joints cannot follow the spindle's ramps.
pub(crate) fn spindle_ramp(program: &Program, span: Span, rate: f64, most: f64) -> Diagnostic {
    let message = format!(
        "a tap here can follow a spindle that changes its speed by {most:.1} rpm/s, this one does by {rate:.1}"
    );
    let help = "lower spindle.acceleration_rpm_s in the machine file (and in the drive)";
    at(program, span, "spindle-ramp", Severity::Error, message, help)
}

/// The spindle did not do what a move in step with it waited for.
pub(crate) fn spindle_timeout(
    program: &Program,
    span: Span,
    stage: Stage,
    order: &SpindleOrder,
    rpm: f64,
    timeout_s: f64,
) -> Diagnostic {
    let (code, what) = match stage {
        Stage::AtSpeed => ("spindle-not-at-speed", "the spindle did not reach its speed"),
        Stage::Index => ("spindle-no-index", "the spindle's index did not come"),
        _ => ("spindle-stands", "the spindle stood still during a move in step with it"),
    };
    let wanted = order.speed_rpm;
    let message = format!("{what} within {timeout_s} s: {wanted:.1} rpm are commanded, it turns at {rpm:.1}");
    let help = "check the drive and spindle.0.at-speed, or raise spindle.timeout_s in the machine file";
    at(program, span, code, Severity::Error, message, help)
}

pub(crate) fn chain_too_long(program: &Program, span: Span, most: usize) -> Diagnostic {
    let message = format!("more than {most} moves in step with the spindle without a break");
    at(program, span, "chain-too-long", Severity::Error, message, "make them fewer and longer")
}

/// The move ended before the tool had caught up.
pub(crate) fn never_in_step(program: &Program, span: Span) -> Diagnostic {
    let message = "the tool never caught up with the spindle: the move is too short for its speed".to_owned();
    let help = "begin further away (the first turns are run-in), or lower S";
    at(program, span, "never-in-step", Severity::Warning, message, help)
}

/// What a check takes for granted about a probe.
pub(crate) fn probe_assumed(program: &Program, span: Span, known: bool) -> Diagnostic {
    let message = if known {
        "probing moves are checked to their end; what follows, from where they meet the workpiece"
    } else {
        "probing moves are checked to their end, and what follows as if they met something there"
    };
    let help = "--probe-surface (or probe.workpiece in the machine file) says what there is to meet";
    at(program, span, "probe-assumed", Severity::Note, message.to_owned(), help)
}

/// A probing move on a machine without a probe.
pub(crate) fn probe_not_wired(program: &Program, span: Span) -> Diagnostic {
    let message = "this machine has no probe: nothing is said of what it could meet".to_owned();
    let help = "give --probe-surface \"Z-5\", or probe.workpiece in the machine file";
    at(program, span, "probe-not-wired", Severity::Error, message, help)
}

/// The probe is already where the move should bring it.
pub(crate) fn probe_at_start(program: &Program, span: Span, away: bool) -> Diagnostic {
    let (message, help) = if away {
        ("the probe touches nothing when the move away from contact begins", "begin in contact")
    } else {
        ("the probe already touches when the move towards contact begins", "back off first")
    };
    at(program, span, "probe-at-start", Severity::Error, message.to_owned(), help)
}

/// G38.2 and G38.4 must trip.
pub(crate) fn probe_no_contact(
    program: &Program,
    machine: &Machine,
    span: Span,
    away: bool,
    end: &Pose,
) -> Diagnostic {
    let (what, code) = if away { ("lost no contact", "G38.5") } else { ("met nothing", "G38.3") };
    let message = format!("the probe {what} on its way to {}", place(machine, end));
    let help = format!("probe further, or use {code}, which sets #5070 instead");
    at(program, span, "probe-no-contact", Severity::Error, message, &help)
}

/// M19 did not end.
pub(crate) fn orient_timeout(program: &Program, span: Span, timeout_s: f64) -> Diagnostic {
    let message = format!("the spindle did not reach its angle within {timeout_s} s");
    at(
        program,
        span,
        "spindle-not-oriented",
        Severity::Error,
        message,
        "check the drive and spindle.0.is-oriented",
    )
}
