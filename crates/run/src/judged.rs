//! One servo period as the judge of a run saw it: what the report draws.

use pkm_kins::Pose;
use pkm_planner::Setpoint;

/// The end of a servo period.
#[derive(Debug, Clone, Copy)]
pub struct Judged {
    /// Number of the period; 1 is the first.
    pub tick: u64,
    /// What was commanded: pose, joints, line, feed got.
    pub setpoint: Setpoint,
    /// The pose rebuilt from the step edges; `None` during a form switch, or where the counted joints have no pose.
    pub executed: Option<Pose>,
    /// The place of the programmed path nearest to it, before any blend.
    pub nearest: Option<Pose>,
    /// Their distance: the larger of XYZ and UVW.
    pub deviation_mm: Option<f64>,
    /// Distance from a singularity: the smaller of both measures; `None` during a form switch.
    pub singularity: Option<f64>,
    /// The machine homes: its joints are not where they say, and it has no pose yet.
    pub homing: bool,
}
