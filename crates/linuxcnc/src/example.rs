//! A program that every machine can run: around a square and a circle about the place where it stands, a little of every
//! angle, and all of it again after each switch of the mechanism.

use crate::travel::{Mode, Travel, modes, moving_axes, reachable};
use pkm_kins::{Axis, Pose, maths};
use pkm_machine::{Machine, SwitchTarget};
use std::fmt::Write as _;

/// Sizes tried, mm: the first that fits.
const SIZES: [f64; 5] = [20.0, 10.0, 5.0, 2.0, 1.0];
/// Angles tried, degrees.
const ANGLES: [f64; 2] = [5.0, 2.0];

/// The example program of a machine.
pub(crate) fn example(machine: &Machine, travel: &Travel) -> String {
    let mut text = format!("(Example for {}: exact path)\nG21 G90 G94 G17 G61\n", machine.name);
    let all = modes(machine);
    let code = |target: SwitchTarget| machine.switches.iter().find(|switch| switch.to == target);
    for (number, mode) in all.iter().enumerate() {
        if let Some(target) = mode.target {
            let Some(switch) = code(target) else { continue };
            let _ = writeln!(text, "M{} ({target})", switch.code);
        }
        figure(machine, travel, mode, &mut text);
        // Back to the mode of the start.
        if mode.target.is_some() && number + 1 == all.len() {
            let back = machine.switches.iter().find(|switch| Some(switch.to) != mode.target);
            if let Some(switch) = back {
                let _ = writeln!(text, "M{} ({})", switch.code, switch.to);
                // One more move, to see that the machine is all there.
                figure(machine, travel, &all[0], &mut text);
            }
        }
    }
    text.push_str("M2\n");
    text
}

fn figure(machine: &Machine, travel: &Travel, mode: &Mode, text: &mut String) {
    let axes = moving_axes(&mode.mechanism, &mode.pose);
    let linear: Vec<Axis> = axes.iter().copied().filter(|axis| !axis.is_rotary()).collect();
    let rotary: Vec<Axis> = axes.iter().copied().filter(|axis| axis.is_rotary()).collect();
    let fits = |offsets: &[(Axis, f64)]| {
        let mut pose = mode.pose;
        for &(axis, by) in offsets {
            pose.set(axis, pose.get(axis) + by);
        }
        reachable(machine, &mode.mechanism, &pose, machine.singularity.warn)
    };
    // Nothing takes longer than a second or two.
    let sizes = || SIZES.iter().copied().filter(|&r| r <= travel.linear_velocity || r == 1.0);
    let at = |offsets: &[(Axis, f64)]| {
        offsets.iter().map(|&(axis, by)| word(&mode.pose, axis, by)).collect::<Vec<_>>().join(" ")
    };
    let feed = |axes: &[Axis]| {
        let own = travel.axes.iter().filter(|t| axes.contains(&t.axis)).map(|t| t.velocity);
        let angular = axes.iter().all(|axis| axis.is_rotary());
        let most = if angular { f64::INFINITY } else { travel.linear_velocity };
        format!("F{}", (own.fold(most, f64::min) * 60.0 * 0.8).floor().clamp(1.0, 1800.0))
    };
    // The plane of the first two axes: a square, and a circle in it if the plane is X Y.
    if let [first, second, others @ ..] = linear.as_slice() {
        let (first, second) = (*first, *second);
        let corner = |r: f64| [(r, r), (-r, r), (-r, -r), (r, -r)];
        let size = sizes().find(|&r| {
            corner(r).iter().all(|&(a, b)| fits(&[(first, a), (second, b)]))
                && [(0.0, r), (r, 0.0), (0.0, -r), (-r, 0.0)]
                    .iter()
                    .all(|&(a, b)| fits(&[(first, a), (second, b)]))
        });
        let _ = writeln!(text, "{}", feed(&linear));
        if let Some(r) = size {
            for (a, b) in corner(r) {
                let _ = writeln!(text, "G1 {}", at(&[(first, a), (second, b)]));
            }
            let _ = writeln!(text, "G1 {}", at(&[(first, r), (second, 0.0)]));
            if (first, second) == (Axis::X, Axis::Y) {
                let _ = writeln!(text, "G3 {} I{} J0", at(&[(first, r), (second, 0.0)]), -r);
            }
            let _ = writeln!(text, "G1 {}", at(&[(first, 0.0), (second, 0.0)]));
        }
        for &axis in others {
            if let Some(r) = sizes().find(|&r| fits(&[(axis, r)]) && fits(&[(axis, -r)])) {
                for by in [r, -r, 0.0] {
                    let _ = writeln!(text, "G1 {}", at(&[(axis, by)]));
                }
            } else if let Some(r) = sizes().find(|&r| fits(&[(axis, r)])) {
                let _ = writeln!(text, "G1 {}", at(&[(axis, r)]));
                let _ = writeln!(text, "G1 {}", at(&[(axis, 0.0)]));
            }
        }
    }
    for axis in rotary {
        let _ = writeln!(text, "{}", feed(&[axis]));
        let fit = |&angle: &f64| {
            let by = maths::radians(angle);
            fits(&[(axis, by)]) && fits(&[(axis, -by)])
        };
        if let Some(angle) = ANGLES.iter().copied().find(fit) {
            for by in [angle, -angle, 0.0] {
                let _ = writeln!(text, "G1 {}", at(&[(axis, maths::radians(by))]));
            }
        }
    }
}

/// `X12.5`: the coordinate of the pose and an offset, five decimals at most.
fn word(pose: &Pose, axis: Axis, by: f64) -> String {
    let value = pose.get(axis) + by;
    let value = if axis.is_rotary() { maths::degrees(value) } else { value };
    let rounded = (value * 1e5).round() / 1e5;
    format!("{}{}", axis.letter(), if rounded == 0.0 { 0.0 } else { rounded })
}
