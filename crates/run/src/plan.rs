//! Where the time of a program goes: how long every block takes and what limits it.
//!
//! The program is planned and driven without the HAL. At every servo period the joints' velocities and accelerations
//! (differences of the setpoints) and the feed are compared with their limits; the period is booked under the one
//! that is used most.

use crate::check::check;
use crate::feeder::Feeder;
use crate::limited::limited;
use crate::probing::Shadow;
use crate::program::Program;
use crate::{Options, messages};
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_hal_sim::SetpointSource;
use pkm_kins::Kinematics;
use pkm_machine::Machine;
use serde::Serialize;
use std::collections::BTreeMap;

/// Seconds under each limit: `feed`, `p1 velocity`, `p1 acceleration`, `dwell`, `spindle` (in step with it, or waiting for it),
/// or `look-ahead` where nothing is at its
/// limit (short moves from stop to stop, rounding to whole servo periods).
pub type Shares = BTreeMap<String, f64>;

/// One block.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BlockPlan {
    /// Its line.
    pub line: u32,
    /// Time spent on it, blends after it included.
    pub duration_s: f64,
    /// Seconds of it under each limit.
    pub limited_by_s: Shares,
}

/// What a program uses of one joint; mm or degrees.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointUse {
    /// As the machine file names it.
    pub name: String,
    /// Lowest position.
    pub min: f64,
    /// Highest position.
    pub max: f64,
}

/// The plan of a program.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Version of this format.
    pub schema: u32,
    /// The program's name.
    pub program: String,
    /// The machine's name.
    pub machine: String,
    /// The whole program can run.
    pub completed: bool,
    /// From the first motion to rest after the last, dwells included.
    pub duration_s: f64,
    /// In program order of lines.
    pub blocks: Vec<BlockPlan>,
    /// Seconds of the whole program under each limit.
    pub limited_by_s: Shares,
    /// The largest of them in words.
    pub verdict: String,
    /// What the motion uses of every joint, in joint order.
    pub joints: Vec<JointUse>,
    /// Smallest singularity measure on the way (a form switch does not count); 0 if nothing was driven.
    pub min_singularity_distance: f64,
    /// What a person should know.
    #[serde(skip)]
    pub diagnostics: Vec<Diagnostic>,
}

/// Plans a program.
///
/// # Errors
/// The program cannot be read.
pub fn plan(program: &Program, machine: &Machine, options: &Options) -> Result<Plan, Diagnostic> {
    let mut checked = check(program, machine, options)?;
    if let Some(span) = checked.probes.filter(|_| options.workpiece(machine).is_empty()) {
        checked.diagnostics.push(messages::probe_not_wired(program, span));
    }
    let mut plan = Plan {
        schema: crate::SCHEMA,
        program: program.name(),
        machine: machine.name.clone(),
        completed: false,
        duration_s: 0.0,
        blocks: Vec::new(),
        limited_by_s: Shares::new(),
        verdict: "refused before anything moves".to_owned(),
        joints: Vec::new(),
        min_singularity_distance: 0.0,
        diagnostics: checked.diagnostics,
    };
    if plan.diagnostics.iter().any(|d| d.severity == Severity::Error) {
        return Ok(plan);
    }
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new()
            .stack_size(crate::STACK_BYTES)
            .spawn_scoped(scope, || drive(program, machine, options, &mut plan))
            .map_err(|e| messages::host(program, &format!("cannot start a thread: {e}")))?;
        worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })?;
    Ok(plan)
}

fn drive(program: &Program, machine: &Machine, options: &Options, plan: &mut Plan) -> Result<(), Diagnostic> {
    let options = Options { substeps: 1, ..*options };
    let mut feeder = Feeder::new(program, machine, &options)?;
    let mut shadow = Shadow::new(machine, options.workpiece(machine));
    let period_s = machine.servo_period_ns as f64 / 1e9;
    let start = feeder.setpoint().joints;
    let mut before = [start; 2];
    let mut blocks: BTreeMap<u32, Shares> = BTreeMap::new();
    let (mut ticks, mut first, mut last) = (0_u64, None, 0);
    let (mut lowest, mut highest, mut nearest) = (start, start, f64::INFINITY);
    while !feeder.is_done() {
        ticks += 1;
        if ticks > options.max_ticks {
            plan.diagnostics.push(messages::max_ticks(program, options.max_ticks, feeder.line()));
            return Ok(());
        }
        feeder.feedback(&shadow.feedback);
        let told = feeder.next(ticks).map_err(|e| *e.0)?;
        shadow.step(&told);
        let setpoint = *feeder.setpoint();
        let moves = setpoint.joints != before[1];
        if moves {
            first.get_or_insert(ticks - 1);
            last = ticks;
        }
        if moves || setpoint.state == pkm_planner::State::Dwell || feeder.is_in_step() {
            let words = match feeder.is_in_step() {
                true => "spindle".to_owned(),
                false => limited(machine, &setpoint, &before, period_s).0.words(machine),
            };
            *blocks.entry(setpoint.span.line).or_default().entry(words).or_default() += period_s;
        }
        before = [before[1], setpoint.joints];
        for ((low, high), q) in lowest.iter_mut().zip(&mut highest).zip(setpoint.joints) {
            (*low, *high) = (low.min(q), high.max(q));
        }
        if !feeder.is_switching()
            && let Ok(measure) = feeder.mechanism().singularity(&setpoint.pose)
        {
            nearest = nearest.min(measure.inverse.min(measure.forward));
        }
    }
    let ends = machine.joints.iter().zip(lowest.into_iter().zip(highest));
    plan.joints = ends
        .map(|(joint, (low, high))| JointUse {
            name: joint.name.clone(),
            min: joint.to_face(low),
            max: joint.to_face(high),
        })
        .collect();
    plan.min_singularity_distance = if nearest.is_finite() { nearest } else { 0.0 };
    plan.diagnostics.extend(feeder.failure().cloned());
    plan.completed = feeder.failure().is_none();
    plan.duration_s = (last - first.unwrap_or(last)) as f64 * period_s;
    for (line, shares) in blocks {
        for (limit, seconds) in &shares {
            *plan.limited_by_s.entry(limit.clone()).or_default() += seconds;
        }
        plan.blocks.push(BlockPlan { line, duration_s: shares.values().sum(), limited_by_s: shares });
    }
    plan.verdict = verdict(&plan.limited_by_s);
    Ok(())
}

fn verdict(shares: &Shares) -> String {
    let total: f64 = shares.values().sum();
    let most = shares.iter().fold(None, |most: Option<(&String, f64)>, (name, &seconds)| match most {
        Some((_, known)) if known >= seconds => most,
        _ => Some((name, seconds)),
    });
    match most {
        Some((name, seconds)) if total > 0.0 => {
            format!("{name} limits {:.0} % of this program", 100.0 * seconds / total)
        }
        _ => "nothing moves".to_owned(),
    }
}
