//! `pkm jog`: jogs the simulated machine, one move after the other.

use crate::cli::Jog as Arguments;
use crate::commands::program::start;
use crate::outcome::{Failure, Outcome};
use comfy_table::{ContentArrangement, Table, presets};
use pkm_kins::{Axis, JointKind, Kinematics, Pose, maths};
use pkm_machine::Machine;
use pkm_run::{Jog, Jogged, jog};
use std::io::{Write, stdout};

/// `x+10`, `p1-3.5`, `y-` (to the limit): what and how far, mm or rad.
fn parse(machine: &Machine, text: &str) -> Option<(Jogged, f64)> {
    let at = text.rfind(['+', '-'])?;
    let (name, way) = text.split_at(at);
    let (sign, number) = way.split_at(1);
    let distance = match number {
        "" => f64::INFINITY,
        _ => number.parse().ok().filter(|way: &f64| way.is_finite() && *way >= 0.0)?,
    };
    let joint = machine.joints.iter().position(|joint| joint.name == name);
    let axis = Axis::ALL.into_iter().find(|axis| name.eq_ignore_ascii_case(&axis.letter().to_string()));
    let (what, rotary) = match (joint, axis) {
        (Some(n), _) => (Jogged::Joint(n), machine.joints[n].kind == JointKind::Rotary),
        (None, Some(axis)) => (Jogged::Axis(axis), axis.is_rotary()),
        (None, None) => return None,
    };
    let distance = if rotary { maths::radians(distance) } else { distance };
    Some((what, if sign == "-" { -distance } else { distance }))
}

fn place(machine: &Machine, pose: &Pose) -> String {
    let word = |axis: Axis| {
        let value = pose.get(axis);
        format!("{}{:.4}", axis.letter(), if axis.is_rotary() { maths::degrees(value) } else { value } + 0.0)
    };
    machine.mechanism.axes().iter().map(word).collect::<Vec<_>>().join(" ")
}

pub(crate) fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let machine = Machine::load(&arguments.machine.machine, &arguments.machine.set)?;
    let mut pose = match &arguments.start {
        Some(text) => start(&machine, text)?,
        None => machine.home,
    };
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(["jog", "travelled", "periods", "ends at", "joints", "stopped by"]);
    for text in &arguments.moves {
        let Some((what, distance)) = parse(&machine, text) else {
            let message = format!("'{text}' is no jog of this machine");
            let joints: Vec<&str> = machine.joints.iter().map(|joint| joint.name.as_str()).collect();
            let help = format!("write x+10, y- (to the limit), or a joint: {}", joints.join(", "));
            return Err(Failure::could_not("jog", text, message, &help));
        };
        let rotary = match what {
            Jogged::Axis(axis) => axis.is_rotary(),
            Jogged::Joint(n) => machine.joints[n].kind == JointKind::Rotary,
        };
        let face = |value: f64| if rotary { maths::degrees(value) } else { value };
        let velocity = if rotary { maths::radians(arguments.velocity) } else { arguments.velocity };
        let end = jog(&machine, &pose, &Jog { what, distance, velocity }).map_err(|refusal| {
            Failure::could_not(&refusal.code, text, refusal.message, "jog from another pose")
        })?;
        let joints = machine.joints.iter().zip(end.joints);
        let joints: Vec<String> =
            joints.map(|(joint, value)| format!("{} {:.4}", joint.name, joint.to_face(value))).collect();
        table.add_row([
            text.clone(),
            format!("{:+.4}", face(end.travelled)),
            end.periods.to_string(),
            place(&machine, &end.pose),
            joints.join(" "),
            end.stopped_by.map_or_else(String::new, |refusal| refusal.message),
        ]);
        pose = end.pose;
    }
    let mut out = stdout().lock();
    for line in table.lines() {
        writeln!(out, "{}", line.trim_end())?;
    }
    Ok(Outcome::Clean)
}
