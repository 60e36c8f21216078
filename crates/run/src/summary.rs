//! What a run was: the JSON summary that scripts rely on, gathered tick by tick from the simulated machine.

use crate::check::Checked;
use crate::feeder::Feeder;
use crate::judged::Judged;
use crate::program::Program;
use pkm_canon::diagnostic::Diagnostic;
use pkm_gcode::Parameters;
use pkm_hal_sim::Simulation;
use pkm_kins::machine::Mechanism;
use pkm_kins::maths::sqrt;
use pkm_kins::{Joints, Kinematics, MAX_JOINTS, Pose};
use pkm_machine::Machine;
use serde::Serialize;

/// Version of the summary.
pub const SCHEMA: u32 = 1;

/// One joint over the whole run; mm or degrees, and seconds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointSummary {
    /// As the machine file names it.
    pub name: String,
    /// Lowest commanded position.
    pub min: f64,
    /// Highest commanded position.
    pub max: f64,
    /// Largest |first difference| of the commanded position over a servo period.
    pub peak_velocity: f64,
    /// Largest |second difference|.
    pub peak_acceleration: f64,
    /// From the machine file.
    pub velocity_limit: f64,
    /// From the machine file.
    pub acceleration_limit: f64,
    /// Steps in either direction.
    pub steps: u64,
    /// Shortest time between two steps; 0 if there were fewer than two.
    pub min_pulse_interval_ns: u64,
}

/// Where the program came nearest to a singularity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClosestApproach {
    /// Line of the block.
    pub line: u32,
    /// The joint whose link is nearest to a right angle with its guide.
    pub joint: String,
}

/// How well the tool kept step with the spindle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Synchronisation {
    /// Chains of moves in step.
    pub threads: u64,
    /// Rigid taps.
    pub taps: u64,
    /// Largest |pitch × turns − place on the path| at the ends of servo periods, while in step.
    pub max_error_mm: f64,
    /// Servo periods in step.
    pub ticks_in_step: u64,
}

/// The summary of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Version of this format.
    pub schema: u32,
    /// The program's name.
    pub program: String,
    /// The machine's name.
    pub machine: String,
    /// The whole program ran.
    pub completed: bool,
    /// Blocks executed.
    pub blocks: u64,
    /// From the first motion to rest after the last.
    pub duration_s: f64,
    /// Length of the programmed path, in the coordinates the feed counts.
    pub path_length_mm: f64,
    /// Servo periods simulated.
    pub servo_ticks: u64,
    /// In joint order.
    pub joints: Vec<JointSummary>,
    /// Largest distance between the path rebuilt from the edges and the programmed one, at the ends of servo periods.
    pub max_path_deviation_mm: f64,
    /// How far half a step of every joint can move the tool, at the worst place of this run: the share of
    /// `max_path_deviation_mm` that any stepping machine has.
    pub half_step_reach_mm: f64,
    /// Largest |counted − commanded| position at the ends of servo periods, steps.
    pub max_step_error_steps: f64,
    /// The same just before and after each edge (timer resolution included).
    pub max_edge_error_steps: f64,
    /// Smallest singularity measure on the way. This, the deviation and the reach are those of programmed paths; a form
    /// switch, which passes a singularity on purpose, does not count.
    pub min_singularity_distance: f64,
    /// Where that was.
    pub closest_approach: ClosestApproach,
    /// Stops, or all but, for want of the next block, which the program did not ask for; left out when there were none.
    #[serde(skip_serializing_if = "is_zero")]
    pub starved_stops: u64,
    /// Times shorter than the driver's data sheet allows.
    pub driver_timing_violations: u64,
    /// Steps moved later for the driver's sake, and the largest delay.
    pub delayed_steps: u64,
    /// ns
    pub max_step_delay_ns: u64,
    /// Of a program with motion in step with the spindle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub synchronisation: Option<Synchronisation>,
    /// What a person should know.
    #[serde(skip)]
    pub diagnostics: Vec<Diagnostic>,
    /// The parameters after a program that was completed.
    #[serde(skip)]
    pub parameters: Option<Box<Parameters>>,
}

pub(crate) fn is_zero(count: &u64) -> bool {
    *count == 0
}

impl Summary {
    /// The program was refused before anything moved.
    pub(crate) fn refused(program: &Program, machine: &Machine, checked: Checked) -> Self {
        let joints = machine.joints.iter().map(|joint| JointSummary {
            name: joint.name.clone(),
            min: 0.0,
            max: 0.0,
            peak_velocity: 0.0,
            peak_acceleration: 0.0,
            velocity_limit: joint.to_face(joint.max_velocity),
            acceleration_limit: joint.to_face(joint.max_acceleration),
            steps: 0,
            min_pulse_interval_ns: 0,
        });
        Summary {
            schema: SCHEMA,
            program: program.name(),
            machine: machine.name.clone(),
            completed: false,
            blocks: checked.blocks,
            duration_s: 0.0,
            path_length_mm: 0.0,
            servo_ticks: 0,
            joints: joints.collect(),
            max_path_deviation_mm: 0.0,
            half_step_reach_mm: 0.0,
            max_step_error_steps: 0.0,
            max_edge_error_steps: 0.0,
            min_singularity_distance: 0.0,
            closest_approach: ClosestApproach { line: 0, joint: String::new() },
            starved_stops: 0,
            driver_timing_violations: 0,
            delayed_steps: 0,
            max_step_delay_ns: 0,
            synchronisation: None,
            diagnostics: checked.diagnostics,
            parameters: None,
        }
    }
}

/// Servo periods between two looks at the half-step reach, which needs 2ⁿ forward solutions.
const REACH_EVERY: u64 = 256;

/// Gathers the summary tick by tick.
/// A joint over its limit of velocity or acceleration, in its own units.
pub(crate) struct Excess {
    pub(crate) line: u32,
    pub(crate) joint: usize,
    pub(crate) quantity: &'static str,
    pub(crate) value: f64,
    pub(crate) limit: f64,
}

pub(crate) struct Account<'a> {
    machine: &'a Machine,
    period_s: f64,
    ticks: u64,
    first_motion: Option<u64>,
    last_motion: u64,
    last: [Joints; 2],
    min: Joints,
    max: Joints,
    velocity: Joints,
    acceleration: Joints,
    /// The first joint over a limit.
    pub(crate) excess: Option<Excess>,
    deviation_mm: f64,
    reach_mm: f64,
    singularity: f64,
    closest: (u32, usize),
    /// Largest error in step, and periods in step.
    in_step: (f64, u64),
    /// In the last period: the pose rebuilt from the edges, and the distance from a singularity.
    executed: Option<Pose>,
    measure: Option<f64>,
}

impl<'a> Account<'a> {
    pub(crate) fn new(machine: &'a Machine, simulation: &Simulation) -> Self {
        let start = simulation.report().setpoint.joints;
        Self {
            machine,
            period_s: machine.servo_period_ns as f64 / 1e9,
            ticks: 0,
            first_motion: None,
            last_motion: 0,
            last: [start; 2],
            min: start,
            max: start,
            velocity: [0.0; MAX_JOINTS],
            acceleration: [0.0; MAX_JOINTS],
            excess: None,
            deviation_mm: 0.0,
            reach_mm: 0.0,
            singularity: f64::INFINITY,
            closest: (0, 0),
            in_step: (0.0, 0),
            executed: None,
            measure: None,
        }
    }

    /// A period of homing: it takes time, but is no path.
    pub(crate) fn homing(&mut self, simulation: &Simulation) {
        self.ticks += 1;
        let joints = simulation.report().setpoint.joints;
        (self.last, self.min, self.max) = ([joints; 2], joints, joints);
    }

    /// A period of the program.
    pub(crate) fn tick(&mut self, simulation: &Simulation, feeder: &mut Feeder<'_>) {
        self.ticks += 1;
        (self.executed, self.measure) = (None, None);
        let setpoint = feeder.setpoint();
        let [before, last] = self.last;
        let mut moved = false;
        for (j, &q) in setpoint.joints.iter().enumerate().take(self.machine.joints.len()) {
            moved |= q != last[j];
            self.min[j] = self.min[j].min(q);
            self.max[j] = self.max[j].max(q);
            let velocity = (q - last[j]) / self.period_s;
            let acceleration = (q - 2.0 * last[j] + before[j]) / (self.period_s * self.period_s);
            // Only a new peak can be the first above a limit.
            if velocity.abs() > self.velocity[j] {
                self.velocity[j] = velocity.abs();
                self.judge(j, "velocity", setpoint.span.line);
            }
            if acceleration.abs() > self.acceleration[j] {
                self.acceleration[j] = acceleration.abs();
                self.judge(j, "acceleration", setpoint.span.line);
            }
        }
        self.last = [last, setpoint.joints];
        if moved {
            self.first_motion.get_or_insert(self.ticks - 1);
            self.last_motion = self.ticks;
        }
        if let Some(error_mm) = feeder.synchronisation_error_mm(simulation) {
            let (most, ticks) = self.in_step;
            self.in_step = (most.max(error_mm.abs()), ticks + 1);
        }
        if feeder.is_switching() {
            return;
        }
        let mechanism = feeder.mechanism();
        if let Ok(measure) = mechanism.singularity(&setpoint.pose) {
            let value = measure.inverse.min(measure.forward);
            self.measure = Some(value);
            if value < self.singularity {
                self.singularity = value;
                self.closest = (setpoint.span.line, measure.inverse_joint);
            }
        }
        if self.ticks % REACH_EVERY == 1 {
            let reach_mm = half_step_reach_mm(self.machine, mechanism, &setpoint.pose, &setpoint.joints);
            self.reach_mm = self.reach_mm.max(reach_mm);
        }
        self.executed = simulation.feedback_pose(mechanism).ok();
        if let Some(executed) = &self.executed {
            feeder.programmed.pass(feeder.setpoint().motion);
            let pose = executed.to_array();
            let farthest = feeder.programmed.beyond(self.deviation_mm, feeder.setpoint(), &pose);
            self.deviation_mm = farthest.unwrap_or(self.deviation_mm);
        }
    }

    /// The planner promises that this never happens; a run looks all the same.
    fn judge(&mut self, joint: usize, quantity: &'static str, line: u32) {
        let limits = &self.machine.joints[joint];
        // What differences of positions carry of rounding.
        let rounding = 8.0 * f64::EPSILON * self.max[joint].abs().max(self.min[joint].abs()) / self.period_s;
        let (value, limit, rounding) = match quantity {
            "velocity" => (self.velocity[joint], limits.max_velocity, rounding),
            _ => (self.acceleration[joint], limits.max_acceleration, rounding / self.period_s),
        };
        if self.excess.is_none() && value > limit * (1.0 + 1e-6) + rounding {
            self.excess = Some(Excess { line, joint, quantity, value, limit });
        }
    }

    /// The last period, in full.
    pub(crate) fn judged(&self, simulation: &Simulation, feeder: &Feeder<'_>, homing: bool) -> Judged {
        let mut setpoint = *feeder.setpoint();
        if homing {
            let commanded = simulation.report().setpoint;
            (setpoint.pose, setpoint.joints, setpoint.feed_use) = (commanded.pose, commanded.joints, 0.0);
        }
        let executed = self.executed.filter(|_| !homing);
        let near = executed.and_then(|pose| feeder.programmed.nearest(&setpoint, &pose.to_array()));
        Judged {
            tick: self.ticks,
            setpoint,
            executed,
            nearest: near.map(|near| Pose::from_array(near.place)),
            deviation_mm: near.map(|near| near.distance_mm),
            singularity: self.measure.filter(|_| !homing),
            homing,
        }
    }

    pub(crate) fn finish(
        self,
        program: &Program,
        machine: &Machine,
        simulation: &Simulation,
        feeder: &Feeder<'_>,
    ) -> Summary {
        let statistics = simulation.statistics();
        let joints =
            machine.joints.iter().zip(&statistics).enumerate().map(|(j, (joint, counted))| JointSummary {
                name: joint.name.clone(),
                min: joint.to_face(self.min[j]),
                max: joint.to_face(self.max[j]),
                peak_velocity: joint.to_face(self.velocity[j]),
                peak_acceleration: joint.to_face(self.acceleration[j]),
                velocity_limit: joint.to_face(joint.max_velocity),
                acceleration_limit: joint.to_face(joint.max_acceleration),
                steps: counted.steps,
                min_pulse_interval_ns: counted.min_pulse_interval_ns.unwrap_or(0),
            });
        let (max_error_mm, ticks_in_step) = self.in_step;
        let (threads, taps) = (feeder.chains.threads, feeder.chains.taps);
        let synchronisation =
            (threads + taps > 0).then_some(Synchronisation { threads, taps, max_error_mm, ticks_in_step });
        let largest =
            |f: fn(&pkm_hal_sim::JointStatistics) -> f64| statistics.iter().map(f).fold(0.0, f64::max);
        Summary {
            schema: SCHEMA,
            program: program.name(),
            machine: machine.name.clone(),
            completed: false,
            blocks: feeder.blocks,
            duration_s: (self.last_motion - self.first_motion.unwrap_or(self.last_motion)) as f64
                * self.period_s,
            path_length_mm: feeder.path_length_mm,
            servo_ticks: self.ticks,
            joints: joints.collect(),
            max_path_deviation_mm: self.deviation_mm,
            half_step_reach_mm: self.reach_mm,
            max_step_error_steps: largest(|s| s.max_step_error),
            max_edge_error_steps: largest(|s| s.max_edge_error),
            min_singularity_distance: if self.singularity.is_finite() { self.singularity } else { 0.0 },
            closest_approach: ClosestApproach {
                line: self.closest.0,
                joint: machine.joints.get(self.closest.1).map_or_else(String::new, |j| j.name.clone()),
            },
            starved_stops: feeder.starved_stops(),
            driver_timing_violations: statistics.iter().map(|s| s.violations.total()).sum(),
            delayed_steps: statistics.iter().map(|s| s.delayed_steps).sum(),
            max_step_delay_ns: statistics.iter().map(|s| s.max_delay_ns).max().unwrap_or(0),
            synchronisation,
            diagnostics: Vec::new(),
            parameters: None,
        }
    }
}

/// How far the tool can be from its place when every joint is half a step away from its own.
fn half_step_reach_mm(machine: &Machine, mechanism: &Mechanism, pose: &Pose, joints: &Joints) -> f64 {
    let n = machine.joints.len().min(MAX_JOINTS);
    let mut farthest = 0.0_f64;
    for corner in 0..1_u32 << n {
        let mut moved = *joints;
        for (j, (joint, q)) in machine.joints.iter().zip(&mut moved).enumerate() {
            let half = 0.5 / joint.steps_per_unit;
            *q += if corner & (1 << j) == 0 { half } else { -half };
        }
        if let Ok(there) = mechanism.forward(&moved, pose) {
            let (a, b) = (there.to_array(), pose.to_array());
            let norm = |from: usize| {
                let d = |i: usize| a[from + i] - b[from + i];
                sqrt(d(0) * d(0) + d(1) * d(1) + d(2) * d(2))
            };
            farthest = farthest.max(norm(0)).max(norm(6));
        }
    }
    farthest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::Controller;
    use crate::{Options, messages, on_a_large_stack};
    use pkm_hal_sim::Observer;

    #[test]
    fn a_joint_that_is_driven_over_a_limit_is_named() {
        on_a_large_stack(|| {
            let text = b"G21 G90 G64 P0.01\nG0 X20 Y-260\nG1 X-20 F2000\nM2\n".to_vec();
            let program = Program::Memory { name: "driven.ngc".to_owned(), text };
            let machine = Machine::load("moma-a", &[]).unwrap();
            // Driven with the machine's limits, judged with others.
            let judge = |change: fn(&mut Machine)| {
                let mut judging = machine.clone();
                change(&mut judging);
                let mut controller =
                    Controller::new(&program, &machine, &Options::default(), (false, false)).unwrap();
                let mut account = Account::new(&judging, &controller.simulation);
                while !controller.is_done() {
                    controller.period(&mut [] as &mut [&mut dyn Observer]).unwrap();
                    account.tick(&controller.simulation, &mut controller.feeder);
                }
                account.excess.map(|excess| messages::excess(&program, &judging, &excess).message)
            };
            assert_eq!(judge(|_| ()), None);
            let slower = judge(|machine| machine.joints[1].max_velocity = 90.0).unwrap();
            assert!(slower.starts_with("p2 was driven at 1.0"), "{slower}");
            assert!(slower.ends_with(" its limit of velocity, 90 mm/s"), "{slower}");
            let softer = judge(|machine| machine.joints[0].max_acceleration = 999.0).unwrap();
            assert!(softer.starts_with("p1 was driven at 1.0004"), "{softer}");
        });
    }
}
