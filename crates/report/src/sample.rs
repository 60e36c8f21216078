//! One kept row of the run: the commanded state, what came of it, and what limits it.

use crate::fan::Row;
use pkm_kins::{Axis, Joints, MAX_JOINTS, Pose, maths};
use pkm_machine::Machine;
use pkm_run::{Judged, Limited, limited};

/// mm or rad → mm or degrees.
pub(crate) fn face(axis: Axis, value: f64) -> f64 {
    if axis.is_rotary() { maths::degrees(value) } else { value }
}

/// A row.
#[derive(Debug, Clone)]
pub(crate) struct Sample {
    /// Servo period; in a program that was refused the number of the sample.
    pub tick: u64,
    /// Line of the main program; 0 in a subroutine's file.
    pub line: u32,
    pub limit: u8,
    pub pose: Pose,
    pub joints: Joints,
    /// Rebuilt from the edges, and the place of the programmed path nearest to it.
    pub executed: Option<(Pose, Pose)>,
    /// Velocity and acceleration as shares of their limits, signed.
    pub shares: [[f64; 2]; MAX_JOINTS],
    pub feed: f64,
    pub singularity: f64,
    pub deviation_mm: f64,
    /// Joints and axes, as the fan compares them: mm and degrees.
    channels: [f64; 2 * MAX_JOINTS],
    channel_count: usize,
    /// The pose jumps here: another mechanism's coordinates are in force. No path leads to this row.
    pub jump: bool,
}

/// Codes of what limits: 0 feed, 1 feed on a corner's blend, 2 look-ahead, 3 dwell, then four for each joint: velocity,
/// acceleration, and both on a blend.
fn code(limit: Limited) -> u8 {
    let joint = |joint: usize, acceleration: bool, corner: bool| {
        (4 + 4 * joint) as u8 + u8::from(acceleration) + 2 * u8::from(corner)
    };
    match limit {
        Limited::Feed => 0,
        Limited::Corner => 1,
        // The spindle is told apart by `pkm plan` alone.
        Limited::LookAhead | Limited::Spindle => 2,
        Limited::Dwell => 3,
        Limited::Velocity { joint: j, corner } => joint(j, false, corner),
        Limited::Acceleration { joint: j, corner } => joint(j, true, corner),
    }
}

impl Sample {
    /// The machine at rest at a pose.
    pub(crate) fn still(machine: &Machine, axes: &[Axis], tick: u64, pose: Pose, joints: Joints) -> Self {
        let mut channels = [0.0; 2 * MAX_JOINTS];
        let values = machine.joints.iter().zip(joints).map(|(joint, value)| joint.to_face(value));
        let values = values.chain(axes.iter().map(|&axis| face(axis, pose.get(axis))));
        let mut channel_count = 0;
        for (channel, value) in channels.iter_mut().zip(values) {
            *channel = value;
            channel_count += 1;
        }
        Self {
            tick,
            line: 0,
            limit: 2,
            pose,
            joints,
            executed: None,
            shares: [[0.0; 2]; MAX_JOINTS],
            feed: 0.0,
            singularity: f64::NAN,
            deviation_mm: f64::NAN,
            channels,
            channel_count,
            jump: false,
        }
    }

    /// The end of a servo period; `before` are the joints two periods and one period ago.
    pub(crate) fn judged(
        machine: &Machine,
        axes: &[Axis],
        judged: &Judged,
        before: &[Joints; 2],
        period_s: f64,
    ) -> Self {
        let setpoint = &judged.setpoint;
        let (limit, shares) = limited(machine, setpoint, before, period_s);
        let main_program = setpoint.span.file == pkm_canon::FileId(0);
        Self {
            line: if main_program { setpoint.span.line } else { 0 },
            limit: code(limit),
            executed: judged.executed.map(|pose| (pose, judged.nearest.unwrap_or(pose))),
            shares,
            feed: setpoint.feed_use,
            singularity: judged.singularity.unwrap_or(f64::NAN),
            deviation_mm: judged.deviation_mm.unwrap_or(f64::NAN),
            ..Self::still(machine, axes, judged.tick, setpoint.pose, setpoint.joints)
        }
    }

    /// The curves' values: for each joint its place in its travel (0 to 1) and its shares, then feed, distance from
    /// singularities, deviation.
    pub(crate) fn curves(&self, machine: &Machine, out: &mut Vec<f64>) {
        out.clear();
        for ((joint, q), share) in machine.joints.iter().zip(self.joints).zip(self.shares) {
            out.push((q - joint.range.min) / (joint.range.max - joint.range.min));
            out.extend_from_slice(&share);
        }
        out.extend_from_slice(&[self.feed, self.singularity, self.deviation_mm]);
    }
}

impl Row for Sample {
    fn at(&self) -> f64 {
        self.tick as f64
    }

    fn channels(&self, out: &mut Vec<f64>) {
        out.clear();
        out.extend_from_slice(&self.channels[..self.channel_count]);
    }

    fn forced(&self) -> bool {
        self.jump
    }
}
