//! A switch of the mechanism on the way: what is checked and reported, and the joint move that a form switch is.

use crate::messages;
use crate::program::Program;
use pkm_canon::Span;
use pkm_canon::diagnostic::Diagnostic;
use pkm_kins::machine::Mechanism;
use pkm_kins::maths::{ceil, sqrt};
use pkm_kins::{Joints, Kinematics, Pose};
use pkm_machine::{Machine, Switched};
use pkm_planner::{Setpoint, State};

/// The switch that an M code of the machine asks for, with the machine at rest at `joints` and `pose`.
pub(crate) fn switched(
    program: &Program,
    machine: &Machine,
    active: &Mechanism,
    (code, span): (i32, Span),
    joints: &Joints,
    pose: &Pose,
) -> Result<Switched, Diagnostic> {
    let Some(to) = machine.switch_of(code) else {
        return Err(messages::host(program, &format!("M{code} is not in the machine file")));
    };
    machine
        .switch(active, to, joints, pose)
        .map_err(|refusal| messages::switch(program, span, code, to, &refusal))
}

/// A straight move in joint space from rest to rest: one parameter u from 0 to 1, as fast as every joint's limits allow.
///
/// u̇ rises at rate A to V, stays, and falls at rate A: A = min aⱼ/|Δⱼ|, V = min vⱼ/|Δⱼ| (or √A, where V is not reached).
/// The whole is then stretched to last whole servo periods. First and second differences of positions are averages
/// of u̇ and ü, so they keep the limits at any sampling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JointMove {
    from: Joints,
    to: Joints,
    /// Servo periods; 0 if nothing moves.
    pub(crate) periods: u64,
    period_s: f64,
    /// Largest u̇ and the |ü| of the ramps, 1/s and 1/s².
    peak: f64,
    ramp: f64,
}

impl JointMove {
    pub(crate) fn new(machine: &Machine, from: &Joints, to: &Joints) -> Self {
        let period_s = machine.servo_period_ns as f64 / 1e9;
        let (mut velocity, mut acceleration) = (f64::INFINITY, f64::INFINITY);
        for (joint, (from, to)) in machine.joints.iter().zip(from.iter().zip(to)) {
            let distance = (to - from).abs();
            velocity = velocity.min(joint.max_velocity / distance);
            acceleration = acceleration.min(joint.max_acceleration / distance);
        }
        let still = Self { from: *from, to: *to, periods: 0, period_s, peak: 0.0, ramp: 0.0 };
        if !(acceleration.is_finite() && velocity.is_finite()) {
            return still;
        }
        let peak = velocity.min(sqrt(acceleration));
        let fastest_s = 1.0 / peak + peak / acceleration;
        let periods = ceil(fastest_s / period_s);
        let stretch = fastest_s / (periods * period_s);
        Self {
            periods: periods as u64,
            peak: peak * stretch,
            ramp: acceleration * stretch * stretch,
            ..still
        }
    }

    /// Positions and velocities after so many servo periods; at the end for good.
    pub(crate) fn at(&self, periods: f64) -> (Joints, Joints) {
        let left_s = (self.periods as f64 - periods) * self.period_s;
        if !(left_s > 0.0) {
            return (self.to, Joints::default());
        }
        let (time_s, ramp_s) = (periods * self.period_s, self.peak / self.ramp);
        let (u, rate) = if time_s < ramp_s {
            (0.5 * self.ramp * time_s * time_s, self.ramp * time_s)
        } else if left_s < ramp_s {
            (1.0 - 0.5 * self.ramp * left_s * left_s, self.ramp * left_s)
        } else {
            (self.peak * (time_s - 0.5 * ramp_s), self.peak)
        };
        let between = |f: fn(f64, f64, f64) -> f64, share: f64| {
            let mut all = Joints::default();
            for (value, (from, to)) in all.iter_mut().zip(self.from.iter().zip(&self.to)) {
                *value = f(*from, *to, share);
            }
            all
        };
        (between(|from, to, u| from + u * (to - from), u), between(|from, to, rate| rate * (to - from), rate))
    }
}

/// A form switch under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FormSwitchDrive {
    path: JointMove,
    pub(crate) after: Switched,
    pub(crate) span: Span,
    /// Where the links stand at right angles to the rails: the one place that no form has.
    middle: Pose,
    /// Setpoints given so far, and how many there are in all, with the rest at the end.
    given: u64,
    all: u64,
    substeps: u64,
}

impl FormSwitchDrive {
    /// `settle_periods`: rest at the end, for the average over the joints to arrive.
    pub(crate) fn new(
        machine: &Machine,
        joints: &Joints,
        after: Switched,
        span: Span,
        substeps: u32,
        settle_periods: u32,
    ) -> Self {
        let path = JointMove::new(machine, joints, &after.joints);
        // y² + c² = l², and c goes to −c.
        let c = 0.5 * (after.joints[0] - joints[0]);
        let middle = Pose { y: sqrt(after.pose.y * after.pose.y + c * c), ..after.pose };
        let substeps = u64::from(substeps);
        let all = (path.periods + u64::from(settle_periods)) * substeps;
        Self { path, after, span, middle, given: 0, all, substeps }
    }

    pub(crate) fn is_over(&self) -> bool {
        self.given >= self.all
    }

    /// The next setpoint; `now` is the planner's, at rest.
    pub(crate) fn next(&mut self, before: &Mechanism, now: &Setpoint) -> Setpoint {
        self.given += 1;
        let (joints, joint_velocity) = self.path.at(self.given as f64 / self.substeps as f64);
        Setpoint {
            pose: self.pose(before, &joints),
            joints,
            joint_velocity,
            feed_use: 0.0,
            span: self.span,
            state: State::Moving,
            ..*now
        }
    }

    /// Forward kinematics of the form that the sign of c says.
    pub(crate) fn pose(&self, before: &Mechanism, joints: &Joints) -> Pose {
        before
            .forward(joints, &self.middle)
            .or_else(|_| self.after.mechanism.forward(joints, &self.middle))
            .unwrap_or(self.middle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine(overrides: &[&str]) -> Machine {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        Machine::load("ox-glide-o", &overrides).unwrap()
    }

    #[test]
    fn the_joint_move_keeps_the_limits_and_uses_them() {
        // Long enough to reach the velocity limit, too short to, one joint slower than the other, hardly anything.
        let cases: [(&[&str], [f64; 3]); 4] = [
            (&[], [105.0, -105.0, 0.0]),
            (&[], [3.0, -3.0, 0.0]),
            (&["joint.1.max_velocity_mm_s=20", "joint.1.max_acceleration_mm_s2=300"], [80.0, -80.0, 0.0]),
            (&[], [1e-9, -1e-9, 0.0]),
        ];
        for (overrides, by) in cases {
            let machine = machine(overrides);
            let mut from = Joints::default();
            (from[0], from[1], from[2]) = (10.0, 120.0, 100.0);
            let mut to = from;
            for (to, by) in to.iter_mut().zip(by) {
                *to += by;
            }
            let path = JointMove::new(&machine, &from, &to);
            let dt = 1e-3;
            let mut at = vec![from, from];
            at.extend((1..=path.periods).map(|n| path.at(n as f64).0));
            assert_eq!(path.at(0.0), (from, Joints::default()), "at rest at the start");
            assert_eq!(path.at(path.periods as f64), (to, Joints::default()), "at rest at the end");
            at.extend([to, to]);
            let mut used = 0.0_f64;
            for w in at.windows(3) {
                for (j, joint) in machine.joints.iter().enumerate() {
                    let v = ((w[2][j] - w[1][j]) / dt).abs() / joint.max_velocity;
                    let a = ((w[2][j] - 2.0 * w[1][j] + w[0][j]) / (dt * dt)).abs() / joint.max_acceleration;
                    assert!(v <= 1.0 + 1e-9 && a <= 1.0 + 1e-9, "{by:?}: {v} {a}");
                    used = used.max(v).max(a);
                }
            }
            assert!(path.periods == 1 || used > 0.95, "{by:?}: slow, {used}");
            // The velocity told is the derivative of the position.
            for n in 1..path.periods {
                let (h, n) = (1e-4, n as f64);
                let (ahead, behind, told) = (path.at(n + h).0, path.at(n - h).0, path.at(n).1);
                let found = (ahead[0] - behind[0]) / (2.0 * h * dt);
                assert!((found - told[0]).abs() < 0.06, "{by:?}: {found} {told:?}");
            }
        }
    }

    #[test]
    fn a_move_to_where_the_joints_stand_takes_no_time() {
        let path = JointMove::new(&machine(&[]), &[7.0; 9], &[7.0; 9]);
        assert_eq!((path.periods, path.at(0.0)), (0, ([7.0; 9], [0.0; 9])));
    }
}
