//! Jogging: one joint or one coordinate, as far as is asked or as it is safe.
//!
//! Before anything moves the way is looked at, step by step: soft limits of joints and axes, reach, working and assembly
//! mode, the singularity guard. The jog ends at the last safe place. A joint then moves on its own ([`Free`]); a
//! coordinate is a line, planned like any other, so every joint keeps its limits.

use crate::program::Program;
use crate::wiring::{self, Wiring};
use crate::{Options, run};
use pkm_hal_sim::{Free, Setpoint, Simulation};
use pkm_kins::{Axis, Joints, Kinematics, Pose, maths};
use pkm_machine::{Machine, Refusal};
use std::ops::ControlFlow;

/// What is jogged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Jogged {
    /// World mode: one coordinate of the tool, the others stay.
    Axis(Axis),
    /// Joint mode: one joint, the others stand.
    Joint(usize),
}

/// One jog.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jog {
    /// What moves.
    pub what: Jogged,
    /// How far, with sign, mm or rad; infinite: to the limit.
    pub distance: f64,
    /// mm/s or rad/s, above 0; more than the joints' limits allow is not reached.
    pub velocity: f64,
}

/// Where a jog ended.
#[derive(Debug, Clone, PartialEq)]
pub struct JogEnd {
    /// mm, rad
    pub pose: Pose,
    /// mm or rad
    pub joints: Joints,
    /// Way of the coordinate or the joint, with sign, mm or rad.
    pub travelled: f64,
    /// Servo periods.
    pub periods: u64,
    /// What ended it early.
    pub stopped_by: Option<Refusal>,
}

/// The way is looked at in pieces of this length (mm or rad), then halved down to [`NEAR`].
const LOOK: f64 = 0.1;
const LOOK_RAD: f64 = 0.002;
const NEAR: f64 = 1e-7;
/// A jog to the limit looks so far at most, mm or rad.
const FAR: f64 = 1e5;

/// Whether the machine may stand there; its joints and pose.
fn at(machine: &Machine, what: Jogged, from: &(Joints, Pose), way: f64) -> Result<(Joints, Pose), Refusal> {
    let (mut joints, mut pose) = *from;
    match what {
        Jogged::Axis(axis) => {
            pose.set(axis, pose.get(axis) + way);
            joints = machine.inverse(&pose)?;
        }
        Jogged::Joint(n) => {
            joints[n] += way;
            pose = machine.forward(&joints, &pose)?;
            let back = machine.inverse(&pose)?;
            if back.iter().zip(&joints).any(|(back, joint)| (back - joint).abs() > 1e-6) {
                let message = "the mechanism would change its working or assembly mode".to_owned();
                return Err(Refusal { code: "working_mode".to_owned(), joint: None, message });
            }
        }
    }
    machine.check_axes(&pose)?;
    let measure = machine.mechanism.singularity(&pose).map_err(|error| machine.refused_pose(&error))?;
    let measure = measure.inverse.min(measure.forward);
    if !(measure >= machine.singularity.guard) {
        let guard = machine.singularity.guard;
        let message =
            format!("the mechanism comes too near to a singularity: measure {measure:.6}, guard {guard}");
        return Err(Refusal { code: "singular".to_owned(), joint: None, message });
    }
    Ok((joints, pose))
}

/// Jogs a machine that stands at rest at `start`.
///
/// # Errors
/// The machine may not stand at `start`, or what is asked for is not there.
pub fn jog(machine: &Machine, start: &Pose, jog: &Jog) -> Result<JogEnd, Refusal> {
    let refuse = |message: &str| Refusal { code: "jog".to_owned(), joint: None, message: message.to_owned() };
    let rotary = match jog.what {
        Jogged::Axis(axis) if machine.mechanism.axes().contains(axis) => axis.is_rotary(),
        Jogged::Joint(n) if n < machine.joints.len() => machine.joints[n].kind == pkm_kins::JointKind::Rotary,
        _ => return Err(refuse("the machine has no such axis or joint")),
    };
    if !(jog.velocity > 0.0 && jog.velocity.is_finite()) || jog.distance.is_nan() {
        return Err(refuse("a jog needs a velocity above 0 and a distance"));
    }
    let from = (machine.inverse(start)?, *start);
    at(machine, jog.what, &from, 0.0)?;
    // the last safe way
    let asked = jog.distance.abs().min(FAR);
    let look = if rotary { LOOK_RAD } else { LOOK };
    let signed = |way: f64| way.copysign(jog.distance);
    let (mut good, mut stopped_by) = (0.0, None);
    let mut near = from;
    while good < asked {
        let next = f64::min(good + look, asked);
        let seen = (near.0, Pose { ..near.1 });
        match at(machine, jog.what, &seen, signed(next - good)) {
            Ok(there) => (good, near) = (next, there),
            Err(refusal) => {
                let (mut low, mut high) = (0.0, next - good);
                let mut last = refusal;
                while high - low > NEAR {
                    let middle = 0.5 * (low + high);
                    match at(machine, jog.what, &near, signed(middle)) {
                        Ok(_) => low = middle,
                        Err(refusal) => (high, last) = (middle, refusal),
                    }
                }
                near = at(machine, jog.what, &near, signed(low))?;
                good += low;
                stopped_by = Some(last);
                break;
            }
        }
    }
    let periods = match jog.what {
        Jogged::Joint(n) => drive_joint(machine, start, n, near.0[n], jog.velocity)?,
        Jogged::Axis(axis) => drive_axis(machine, start, axis, near.1.get(axis), jog.velocity)?,
    };
    Ok(JogEnd { pose: near.1, joints: near.0, travelled: signed(good), periods, stopped_by })
}

fn failed(message: String) -> Refusal {
    Refusal { code: "jog".to_owned(), joint: None, message }
}

/// Joint mode on the simulated machine; the periods it took.
fn drive_joint(
    machine: &Machine,
    start: &Pose,
    n: usize,
    target: f64,
    velocity: f64,
) -> Result<u64, Refusal> {
    let wiring = Wiring { substeps: 1, switches: true, homed: true, seed: 1 };
    let mut simulation = Simulation::new(&wiring::config(machine, *start, wiring))
        .map_err(|error| failed(error.to_string()))?;
    let period_s = machine.servo_period_ns as f64 / 1e9;
    let joint = &machine.joints[n];
    let mut setpoint = Setpoint { ..*simulation.report().setpoint };
    let mut free = Free::new(setpoint.joints[n]);
    free.go(target, velocity.min(joint.max_velocity), joint.max_acceleration, period_s);
    while !free.is_done() {
        setpoint.joints[n] = free.tick();
        setpoint.velocities[n] = free.travel() / period_s;
        // the pose follows the joints; between two places that were looked at it cannot be lost
        setpoint.pose = machine.mechanism.forward(&setpoint.joints, &setpoint.pose).unwrap_or(setpoint.pose);
        simulation.tick_to(&setpoint, &mut []).map_err(|fault| failed(fault.to_string()))?;
    }
    Ok(simulation.tick_number())
}

/// World mode: a line, planned and run; the periods it took.
fn drive_axis(
    machine: &Machine,
    start: &Pose,
    axis: Axis,
    target: f64,
    velocity: f64,
) -> Result<u64, Refusal> {
    let face = |value: f64| if axis.is_rotary() { maths::degrees(value) } else { value };
    if target == start.get(axis) {
        return Ok(0);
    }
    let feed = face(velocity) * 60.0;
    let text = format!("G21 G90 G94 G61\nG1 {}{} F{feed}\nM2\n", axis.letter(), face(target));
    let program = Program::Memory { name: "jog".to_owned(), text: text.into_bytes() };
    let options = Options { start: Some(*start), ..Options::default() };
    let ran = run(&program, machine, &options, |_| (), |_| ControlFlow::Continue(()));
    let (summary, _) = ran.map_err(|error| failed(error.message))?;
    match summary.diagnostics.into_iter().find(|d| d.severity == pkm_canon::diagnostic::Severity::Error) {
        Some(error) => Err(failed(error.message)),
        None => Ok(summary.servo_ticks),
    }
}
