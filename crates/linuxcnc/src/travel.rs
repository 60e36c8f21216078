//! What LinuxCNC wants to know of the axes and a machine file need not say: the box the tool stays in, and the speeds at which
//! no joint is asked for more than it can do.

use pkm_kins::{Axis, Kinematics, Mechanism, Pose};
use pkm_machine::{Machine, SwitchTarget};

/// One of the machine's kinematics: an HV-Mill and an O-X glide have two, every other machine one.
#[derive(Debug, Clone, Copy)]
pub struct Mode {
    /// What the switch to it is called; none for the mode the machine starts in.
    pub target: Option<SwitchTarget>,
    /// The mechanism.
    pub mechanism: Mechanism,
    /// A pose it can be at: home, or where a switch from there leads.
    pub pose: Pose,
}

/// The modes, that of the start first.
pub fn modes(machine: &Machine) -> Vec<Mode> {
    let mut list = vec![Mode { target: None, mechanism: machine.mechanism, pose: machine.home }];
    let Ok(joints) = machine.inverse(&machine.home) else { return list };
    for switch in &machine.switches {
        // Switching to what is active changes nothing, and is no mode of its own.
        if let Ok(switched) = machine.switch(&machine.mechanism, switch.to, &joints, &machine.home)
            && switched.mechanism != machine.mechanism
        {
            list.push(Mode { target: Some(switch.to), mechanism: switched.mechanism, pose: switched.pose });
        }
    }
    list
}

/// Where an axis may go, and how fast: mm or degrees, per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AxisTravel {
    pub(crate) axis: Axis,
    pub(crate) min: f64,
    pub(crate) max: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
}

/// All axes, and the linear velocity and acceleration for any direction (LinuxCNC's `MAX_LINEAR_...`).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Travel {
    pub(crate) axes: Vec<AxisTravel>,
    pub(crate) linear_velocity: f64,
    pub(crate) linear_acceleration: f64,
}

/// Poses nearer to a singularity than this do not count for the speeds.
pub(crate) const REGULAR: f64 = 0.25;

/// Part of the joints' acceleration that straight acceleration may use; the rest is for the path's curvature in joint space.
const STRAIGHT_SHARE: f64 = 0.5;

/// Steps of the search for the ends of the travel, mm and degrees.
const STEP: f64 = 1.0;
const MOST_STEPS: i32 = 4000;

/// The pose is one the machine may be at.
pub(crate) fn reachable(machine: &Machine, mechanism: &Mechanism, pose: &Pose, measure: f64) -> bool {
    let Ok(joints) = mechanism.inverse(pose) else { return false };
    let near = |s: pkm_kins::Singularity| s.inverse.min(s.forward) < measure;
    machine.check_travel(&joints).is_ok() && !mechanism.singularity(pose).is_ok_and(near)
}

/// A coordinate in degrees if it is an angle.
fn face(axis: Axis, value: f64) -> f64 {
    if axis.is_rotary() { pkm_kins::maths::degrees(value) } else { value }
}

fn inner(axis: Axis, value: f64) -> f64 {
    if axis.is_rotary() { pkm_kins::maths::radians(value) } else { value }
}

/// The axes that move the joints of a mechanism here.
pub(crate) fn moving_axes(mechanism: &Mechanism, pose: &Pose) -> Vec<Axis> {
    let Ok(jacobian) = mechanism.jacobian(pose) else { return Vec::new() };
    mechanism
        .axes()
        .iter()
        .filter(|&axis| jacobian.iter().any(|row| row.get(axis as usize).is_some_and(|&entry| entry != 0.0)))
        .collect()
}

pub(crate) fn travel(machine: &Machine) -> Travel {
    let modes = modes(machine);
    let axes: Vec<Axis> = machine.mechanism.axes().iter().collect();
    let mut ranges: Vec<(f64, f64)> =
        axes.iter().map(|&axis| machine.home.get(axis)).map(|home| (home, home)).collect();
    for mode in &modes {
        for (axis, range) in axes.iter().zip(&mut ranges) {
            let (low, high) = reach(machine, mode, *axis);
            *range = (range.0.min(low), range.1.max(high));
        }
    }
    let mut allowed = Allowed::default();
    for mode in &modes {
        allowed.sample(machine, mode, &axes, &ranges);
    }
    let rates: Vec<(f64, f64)> =
        allowed.axes.iter_mut().map(|(v, a)| (ninth_tenth(v), ninth_tenth(a))).collect();
    let list =
        axes.iter().zip(&ranges).zip(&rates).map(|((&axis, &(low, high)), &(velocity, acceleration))| {
            let limits = machine.axis(axis);
            let range = limits.and_then(|limits| limits.range);
            // Inwards to whole tenths, but never past home.
            let home = face(axis, machine.home.get(axis));
            let low = range
                .map_or_else(|| ((face(axis, low) * 10.0).ceil() / 10.0).min(home), |r| face(axis, r.min));
            let high = range
                .map_or_else(|| ((face(axis, high) * 10.0).floor() / 10.0).max(home), |r| face(axis, r.max));
            let given_velocity = limits.and_then(|limits| limits.max_velocity);
            let given_acceleration = limits.and_then(|limits| limits.max_acceleration);
            AxisTravel {
                axis,
                min: low,
                max: high,
                velocity: face(axis, given_velocity.unwrap_or(f64::INFINITY).min(velocity)),
                acceleration: face(axis, given_acceleration.unwrap_or(f64::INFINITY).min(acceleration)),
            }
        });
    let axes: Vec<AxisTravel> = list.map(rounded).collect();
    let (linear_velocity, linear_acceleration) =
        (ninth_tenth(&mut allowed.linear.0), ninth_tenth(&mut allowed.linear.1));
    Travel { axes, linear_velocity: round(linear_velocity), linear_acceleration: round(linear_acceleration) }
}

fn rounded(axis: AxisTravel) -> AxisTravel {
    AxisTravel { velocity: round(axis.velocity), acceleration: round(axis.acceleration), ..axis }
}

/// Down to a hundredth.
fn round(value: f64) -> f64 {
    if value.is_finite() { ((value * 100.0).floor() / 100.0).max(0.01) } else { 1.0 }
}

/// The ends of an axis' travel: a search outwards from the poses at which the other axes are at their ends, twice.
fn reach(machine: &Machine, mode: &Mode, wanted: Axis) -> (f64, f64) {
    let axes = moving_axes(&mode.mechanism, &mode.pose);
    if !axes.contains(&wanted) {
        let here = mode.pose.get(wanted);
        return (here, here);
    }
    let march = |from: &Pose, axis: Axis, step: f64| {
        let mut pose = *from;
        for _ in 0..MOST_STEPS {
            let mut next = pose;
            next.set(axis, pose.get(axis) + inner(axis, step));
            if !reachable(machine, &mode.mechanism, &next, machine.singularity.guard) {
                break;
            }
            pose = next;
        }
        pose
    };
    let mut starts = vec![mode.pose];
    for &axis in &axes {
        for step in [-STEP, STEP] {
            let end = march(&mode.pose, axis, step);
            // Halfway, too: the widest place of a workspace is seldom at its end.
            let mut middle = end;
            middle.set(axis, (end.get(axis) + mode.pose.get(axis)) / 2.0);
            starts.extend([middle, end]);
        }
    }
    let mut range = (mode.pose.get(wanted), mode.pose.get(wanted));
    for start in starts {
        if reachable(machine, &mode.mechanism, &start, machine.singularity.guard) {
            range.0 = range.0.min(march(&start, wanted, -STEP).get(wanted));
            range.1 = range.1.max(march(&start, wanted, STEP).get(wanted));
        }
    }
    range
}

/// What the joints allow at the poses looked at so far.
#[derive(Default)]
struct Allowed {
    /// For each axis, velocity and acceleration, mm or rad.
    axes: Vec<(Vec<f64>, Vec<f64>)>,
    linear: (Vec<f64>, Vec<f64>),
}

/// Poses looked at per mode.
const SAMPLES: u32 = 4000;

/// The value that nine of ten reach or exceed; infinite if there are none.
fn ninth_tenth(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 10).copied().unwrap_or(f64::INFINITY)
}

impl Allowed {
    /// Looks at poses spread over the box.
    fn sample(&mut self, machine: &Machine, mode: &Mode, axes: &[Axis], ranges: &[(f64, f64)]) {
        let moving = moving_axes(&mode.mechanism, &mode.pose);
        let mut number: u64 = 1;
        let mut fraction = || {
            number = number.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (number >> 11) as f64 / (1_u64 << 53) as f64
        };
        self.look(machine, mode, axes, &mode.pose);
        for _ in 0..SAMPLES {
            let mut pose = mode.pose;
            for (&axis, &(low, high)) in axes.iter().zip(ranges) {
                if moving.contains(&axis) {
                    // Angles only near the pose: a table turned by ten turns is the same table.
                    let reach = if axis.is_rotary() { (high - low).min(1.0) } else { high - low };
                    let low = if axis.is_rotary() { pose.get(axis) - reach / 2.0 } else { low };
                    pose.set(axis, low + reach * fraction());
                }
            }
            if reachable(machine, &mode.mechanism, &pose, REGULAR) {
                self.look(machine, mode, axes, &pose);
            }
        }
    }

    /// What is the most that every joint can follow here.
    fn look(&mut self, machine: &Machine, mode: &Mode, axes: &[Axis], pose: &Pose) {
        let Ok(jacobian) = mode.mechanism.jacobian(pose) else { return };
        let most = |per_unit: &dyn Fn(&[f64; 9]) -> f64| {
            let mut allowed = (f64::INFINITY, f64::INFINITY);
            for (joint, row) in machine.joints.iter().zip(&jacobian) {
                let rate = per_unit(row);
                if rate > 1e-9 {
                    allowed.0 = allowed.0.min(joint.max_velocity / rate);
                    allowed.1 = allowed.1.min(STRAIGHT_SHARE * joint.max_acceleration / rate);
                }
            }
            allowed
        };
        let keep = |(velocities, accelerations): &mut (Vec<f64>, Vec<f64>), allowed: (f64, f64)| {
            if allowed.0.is_finite() {
                velocities.push(allowed.0);
                accelerations.push(allowed.1);
            }
        };
        self.axes.resize_with(axes.len(), Default::default);
        for (&axis, place) in axes.iter().zip(&mut self.axes) {
            keep(place, most(&|row| row[axis as usize].abs()));
        }
        for linear in [[Axis::X, Axis::Y, Axis::Z], [Axis::U, Axis::V, Axis::W]] {
            let length = |row: &[f64; 9]| {
                let square = linear.iter().map(|&axis| row[axis as usize] * row[axis as usize]).sum();
                pkm_kins::maths::sqrt(square)
            };
            keep(&mut self.linear, most(&length));
        }
    }
}
