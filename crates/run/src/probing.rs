//! Probing moves (G38.2 to G38.5): where they end, and the machine as far as they and the spindle need it without its HAL.

use pkm_canon::{Probe, Span};
use pkm_hal_sim::components::probe::touches;
use pkm_hal_sim::{Feedback, Setpoint, SpindleConfig, SpindleModel};
use pkm_kins::Pose;
use pkm_machine::Machine;
use pkm_machine::workpiece::Solid;
use pkm_planner::path::Geometry;

/// A probing move under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Probing {
    pub(crate) probe: Probe,
    pub(crate) span: Span,
    /// Where it met (or lost) something.
    pub(crate) tripped: Option<Pose>,
}

fn tool(pose: &Pose) -> [f64; 3] {
    [pose.x, pose.y, pose.z]
}

/// Where along a geometry the probe first meets (or, `away`, loses) the workpiece; `None`: nowhere. For checks: a run finds the
/// place by itself, at the end of a servo period.
pub(crate) fn contact(workpiece: &[Solid], geometry: &Geometry, away: bool) -> Option<f64> {
    const SPACING_MM: f64 = 0.05;
    const MOST: f64 = 1e5;
    let there = |s: f64| touches(workpiece, tool(&Pose::from_array(geometry.at(s).position))) != away;
    let length = geometry.length();
    let count = pkm_kins::maths::ceil(length / SPACING_MM).clamp(1.0, MOST);
    let mut before = 0.0;
    for i in 0..=count as u32 {
        let s = length * (f64::from(i) / count).min(1.0);
        if there(s) {
            let (mut low, mut high) = (before, s);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if there(middle) { high = middle } else { low = middle }
            }
            return Some(high);
        }
        before = s;
    }
    None
}

/// Spindle and probe of a machine whose HAL does not run (`pkm plan`).
#[derive(Debug, Clone)]
pub(crate) struct Shadow {
    spindle: SpindleModel,
    config: SpindleConfig,
    workpiece: Vec<Solid>,
    period_s: f64,
    pub(crate) feedback: Feedback,
}

/// The spindle as the simulated HAL takes it.
pub(crate) fn spindle_config(machine: &Machine) -> SpindleConfig {
    SpindleConfig {
        max_speed_rpm: machine.spindle.max_speed_rpm,
        acceleration_rpm_s: machine.spindle.acceleration_rpm_s,
    }
}

impl Shadow {
    pub(crate) fn new(machine: &Machine, workpiece: &[Solid]) -> Self {
        Self {
            spindle: SpindleModel::default(),
            config: spindle_config(machine),
            workpiece: workpiece.to_vec(),
            period_s: machine.servo_period_ns as f64 / 1e9,
            feedback: Feedback::default(),
        }
    }

    /// A servo period.
    pub(crate) fn step(&mut self, setpoint: &Setpoint) {
        self.spindle.step(&setpoint.spindle, &self.config, self.period_s);
        let probe = touches(&self.workpiece, tool(&setpoint.pose));
        self.feedback = Feedback { spindle: self.spindle.feedback(), probe, ..Feedback::default() };
    }
}
