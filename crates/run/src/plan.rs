//! Where the time of a program goes: how long every block takes and what limits it.
//!
//! The program is planned and driven without the HAL. At every servo period the joints' velocities and accelerations
//! (differences of the setpoints) and the feed are compared with their limits; the period is booked under the one
//! that is used most. What a period got less than the programmed feed is booked as lost.

use crate::check::check;
use crate::feeder::Feeder;
use crate::limited::{Limited, limited};
use crate::probing::Shadow;
use crate::program::Program;
use crate::{Options, messages};
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_canon::{FileId, Span};
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
    /// The subroutine file it stands in; `None` in the program itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Its line.
    pub line: u32,
    /// Time spent on it, blends after it included.
    pub duration_s: f64,
    /// Seconds of it under each limit.
    pub limited_by_s: Shares,
    /// Seconds of it lost against the programmed feed.
    pub lost_s: f64,
}

impl BlockPlan {
    /// `line 7`, or `hop.ngc:3` in a subroutine file.
    pub fn place(&self) -> String {
        match &self.file {
            None => format!("line {}", self.line),
            Some(file) => format!("{file}:{}", self.line),
        }
    }
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
    /// From the first motion or dwell to the end of the last.
    pub duration_s: f64,
    /// In program order of lines.
    pub blocks: Vec<BlockPlan>,
    /// Seconds of the whole program under each limit.
    pub limited_by_s: Shares,
    /// Seconds lost against the programmed feed, with its override, by the limit that took them. Rapids and dwells lose none.
    pub lost_s: Shares,
    /// The largest limit in words, and what 10 % more of it would save (planned again with it).
    pub verdict: String,
    /// What the motion uses of every joint, in joint order.
    pub joints: Vec<JointUse>,
    /// Smallest singularity measure on the way (a form switch does not count); 0 if nothing was driven.
    pub min_singularity_distance: f64,
    /// Where time is lost, in words.
    pub loss: String,
    /// Stops, or all but, for want of the next block; left out when there were none.
    #[serde(skip_serializing_if = "crate::summary::is_zero")]
    pub starved_stops: u64,
    /// What a person should know.
    #[serde(skip)]
    pub diagnostics: Vec<Diagnostic>,
}

/// Plans a program.
///
/// # Errors
/// The program cannot be read.
pub fn plan(program: &Program, machine: &Machine, options: &Options) -> Result<Plan, Diagnostic> {
    planned(program, machine, options, true)
}

/// `tries`: the verdict says what 10 % more would save, which takes as long again.
pub(crate) fn planned(
    program: &Program,
    machine: &Machine,
    options: &Options,
    tries: bool,
) -> Result<Plan, Diagnostic> {
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
        lost_s: Shares::new(),
        verdict: "refused before anything moves".to_owned(),
        joints: Vec::new(),
        min_singularity_distance: 0.0,
        loss: String::new(),
        starved_stops: 0,
        diagnostics: checked.diagnostics,
    };
    if plan.diagnostics.iter().any(|d| d.severity == Severity::Error) {
        return Ok(plan);
    }
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new()
            .stack_size(crate::STACK_BYTES)
            .spawn_scoped(scope, || fill(program, machine, options, tries, &mut plan))
            .map_err(|e| messages::host(program, &format!("cannot start a thread: {e}")))?;
        worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })?;
    Ok(plan)
}

/// How much more of a limit the verdict tries.
const MORE: f64 = 1.1;

/// Servo periods by limit, and lost: their sums are exact, as those of seconds are not.
#[derive(Default)]
struct Book {
    spent: BTreeMap<Limited, f64>,
    lost: BTreeMap<Limited, f64>,
}

fn seconds(machine: &Machine, periods: f64) -> f64 {
    periods * machine.servo_period_ns as f64 / 1e9
}

/// A program driven without the HAL.
struct Driven {
    blocks: BTreeMap<(FileId, u32), Book>,
    /// Subroutine files by number.
    files: BTreeMap<FileId, String>,
    duration_s: f64,
    starved_stops: u64,
    joints: Vec<JointUse>,
    min_singularity_distance: f64,
    /// Why it did not come to its end.
    failure: Option<Diagnostic>,
}

impl Driven {
    /// Over all blocks, each limit wherever it was met; servo periods.
    fn causes(&self, of: fn(&Book) -> &BTreeMap<Limited, f64>) -> BTreeMap<Limited, f64> {
        let mut causes = BTreeMap::new();
        for (limit, periods) in self.blocks.values().flat_map(of) {
            *causes.entry(limit.cause()).or_default() += periods;
        }
        causes
    }
}

fn fill(
    program: &Program,
    machine: &Machine,
    options: &Options,
    tries: bool,
    plan: &mut Plan,
) -> Result<(), Diagnostic> {
    let driven = drive(program, machine, options)?;
    plan.diagnostics.extend(driven.failure.clone());
    plan.completed = driven.failure.is_none();
    (plan.duration_s, plan.starved_stops) = (driven.duration_s, driven.starved_stops);
    (plan.joints, plan.min_singularity_distance) = (driven.joints.clone(), driven.min_singularity_distance);
    let in_seconds = |periods: BTreeMap<String, f64>| -> Shares {
        periods.into_iter().map(|(limit, periods)| (limit, seconds(machine, periods))).collect()
    };
    // Not `sum`, which makes -0 of nothing.
    let total =
        |book: &BTreeMap<Limited, f64>| seconds(machine, book.values().fold(0.0, |all, one| all + one));
    // Servo periods of the whole program, by limit.
    let (mut spent, mut lost) = (BTreeMap::new(), BTreeMap::new());
    let mut longest_loss = (0.0, String::new());
    for ((file, line), book) in &driven.blocks {
        let mut here = BTreeMap::new();
        for (limit, periods) in &book.spent {
            *here.entry(limit.words(machine)).or_default() += periods;
            *spent.entry(limit.words(machine)).or_default() += periods;
        }
        for (limit, periods) in &book.lost {
            *lost.entry(limit.words(machine)).or_default() += periods;
        }
        let block = BlockPlan {
            file: driven.files.get(file).cloned(),
            line: *line,
            duration_s: total(&book.spent),
            limited_by_s: in_seconds(here),
            lost_s: total(&book.lost),
        };
        if block.lost_s > longest_loss.0 {
            longest_loss = (block.lost_s, block.place());
        }
        plan.blocks.push(block);
    }
    (plan.limited_by_s, plan.lost_s) = (in_seconds(spent), in_seconds(lost));
    plan.verdict = verdict(program, machine, options, tries, &driven)?;
    plan.loss = loss(machine, &driven, longest_loss);
    Ok(())
}

fn drive(program: &Program, machine: &Machine, options: &Options) -> Result<Driven, Diagnostic> {
    let options = Options { substeps: 1, ..*options };
    let mut feeder = Feeder::new(program, machine, &options)?;
    let mut shadow = Shadow::new(machine, options.workpiece(machine));
    let period_s = machine.servo_period_ns as f64 / 1e9;
    let start = feeder.setpoint().joints;
    let mut before = [start; 2];
    let mut blocks: BTreeMap<(FileId, u32), Book> = BTreeMap::new();
    let mut files = BTreeMap::new();
    let (mut ticks, mut first, mut last) = (0_u64, None, 0);
    let (mut lowest, mut highest, mut nearest) = (start, start, f64::INFINITY);
    let mut failure = None;
    while !feeder.is_done() {
        ticks += 1;
        if ticks > options.max_ticks {
            failure = Some(messages::max_ticks(program, options.max_ticks, feeder.line()));
            break;
        }
        feeder.feedback(&shadow.feedback);
        let told = feeder.next(ticks).map_err(|e| *e.0)?;
        shadow.step(&told);
        let setpoint = *feeder.setpoint();
        let moves = setpoint.joints != before[1] || setpoint.state == pkm_planner::State::Dwell;
        if moves {
            first.get_or_insert(ticks - 1);
            last = ticks;
        }
        let in_step = feeder.is_in_step();
        if moves || in_step {
            let limit = match in_step {
                true => Limited::Spindle,
                false => limited(machine, &setpoint, &before, period_s).0,
            };
            let Span { file, line, .. } = setpoint.span;
            if file != FileId(0) {
                files.entry(file).or_insert_with(|| feeder.file_name(file));
            }
            let book = blocks.entry((file, line)).or_default();
            *book.spent.entry(limit).or_default() += 1.0;
            // 0 on rapids
            let lost = 1.0 - setpoint.feed_use / options.feed_override;
            if setpoint.feed_use > 0.0 && lost > 0.0 && !in_step {
                *book.lost.entry(limit).or_default() += lost;
            }
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
    let joints = ends
        .map(|(joint, (low, high))| JointUse {
            name: joint.name.clone(),
            min: joint.to_face(low),
            max: joint.to_face(high),
        })
        .collect();
    Ok(Driven {
        blocks,
        files,
        duration_s: seconds(machine, (last - first.unwrap_or(last)) as f64),
        starved_stops: feeder.starved_stops(),
        joints,
        min_singularity_distance: if nearest.is_finite() { nearest } else { 0.0 },
        failure: failure.or_else(|| feeder.failure().cloned()),
    })
}

/// The limit with the most time; of equals the first.
fn most(causes: &BTreeMap<Limited, f64>) -> Option<(Limited, f64)> {
    causes.iter().fold(None, |most: Option<(Limited, f64)>, (&limit, &periods)| match most {
        Some((_, known)) if known >= periods => most,
        _ => Some((limit, periods)),
    })
}

/// What limits the most of the time, and what more of it would save.
fn verdict(
    program: &Program,
    machine: &Machine,
    options: &Options,
    tries: bool,
    driven: &Driven,
) -> Result<String, Diagnostic> {
    let causes = driven.causes(|book| &book.spent);
    let total: f64 = causes.values().sum();
    let Some((limit, periods)) = most(&causes).filter(|_| total > 0.0) else {
        return Ok("nothing moves".to_owned());
    };
    let share = 100.0 * periods / total;
    let text = match limit {
        Limited::Dwell => format!("dwells take {share:.0} % of this program's time"),
        _ => format!("{} limits {share:.0} % of this program's time", limit.subject(machine)),
    };
    let (mut stronger, mut faster) = (machine.clone(), *options);
    match limit {
        // the planner takes up to 200 %
        Limited::Feed if options.feed_override * MORE <= 2.0 => faster.feed_override *= MORE,
        Limited::Velocity { joint, .. } => stronger.joints[joint].max_velocity *= MORE,
        Limited::Acceleration { joint, .. } => stronger.joints[joint].max_acceleration *= MORE,
        _ => return Ok(text),
    }
    if !tries || driven.failure.is_some() {
        return Ok(text);
    }
    let again = drive(program, &stronger, &faster)?;
    let saved_s = driven.duration_s - again.duration_s;
    Ok(match again.failure {
        None if saved_s > 0.0 => {
            let share = 100.0 * saved_s / driven.duration_s;
            format!("{text}; 10 % more of it would save {saved_s:.3} s ({share:.1} %)")
        }
        None => format!("{text}; 10 % more of it would save nothing"),
        Some(_) => text,
    })
}

/// Where the program falls short of its feed: three limits and the worst block.
fn loss(machine: &Machine, driven: &Driven, (block_s, place): (f64, String)) -> String {
    let causes = driven.causes(|book| &book.lost).into_iter();
    let mut causes: Vec<(Limited, f64)> = causes
        .map(|(limit, periods)| (limit, seconds(machine, periods)))
        .filter(|(_, lost_s)| *lost_s >= 0.0005)
        .collect();
    causes.sort_by(|a, b| b.1.total_cmp(&a.1));
    let lost_s: f64 = causes.iter().map(|(_, lost_s)| lost_s).sum();
    if causes.is_empty() {
        return "no time is lost against the programmed feed".to_owned();
    }
    let named: Vec<String> = causes
        .iter()
        .take(3)
        .map(|(limit, lost_s)| match limit {
            // nearly the feed: what is left to it is no limit's
            Limited::Feed => format!("{lost_s:.3} s just below the feed"),
            _ => format!("{lost_s:.3} s to {}", limit.subject(machine)),
        })
        .collect();
    format!(
        "{lost_s:.3} s are lost against the programmed feed: {}; most in {place} ({block_s:.3} s)",
        named.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_a_large_stack;

    fn of(machine: &Machine, text: &str) -> Plan {
        let program = Program::Memory { name: "planned.ngc".to_owned(), text: text.as_bytes().to_vec() };
        on_a_large_stack(|| plan(&program, machine, &Options::default()).unwrap())
    }

    #[test]
    fn the_verdict_is_measured_and_the_books_balance() {
        let machine = Machine::load("xyz", &[]).unwrap();
        let text = "G21 G61\nG1 X30 F600000\nG0 X0\nG4 P0.1\nG1 Y20 F300\nM2\n";
        // long enough at one limit of one joint
        for text in [text, "G21 G61\nG1 X3 F600000\nM2\n", "G21 G61\nG1 X90 F600000\nM2\n"] {
            let here = of(&machine, text);
            assert!(here.completed, "{:?}", here.diagnostics);
            let sum = |shares: &Shares| shares.values().sum::<f64>();
            let blocks: f64 = here.blocks.iter().map(|block| block.duration_s).sum();
            assert!((sum(&here.limited_by_s) - blocks).abs() < 1e-9);
            // between blocks in G61 there may be a period at rest
            assert!((here.duration_s - blocks).abs() < 0.004, "{} {blocks}", here.duration_s);
            let (subject, rest) = here.verdict.split_once(" limits ").unwrap();
            let saved: f64 =
                rest.split_once("would save ").unwrap().1.split_once(" s").unwrap().0.parse().unwrap();
            let mut stronger = machine.clone();
            let mut options = Options::default();
            match subject.split_once("'s ") {
                None => options.feed_override = 1.1,
                Some((name, what)) => {
                    let joint = stronger.joints.iter_mut().find(|joint| joint.name == name).unwrap();
                    match what {
                        "velocity" => joint.max_velocity *= 1.1,
                        "acceleration" => joint.max_acceleration *= 1.1,
                        _ => panic!("{subject}"),
                    }
                }
            }
            let program = Program::Memory { name: String::new(), text: text.as_bytes().to_vec() };
            let there = on_a_large_stack(|| plan(&program, &stronger, &options).unwrap());
            assert!(saved > 0.0);
            assert!((here.duration_s - there.duration_s - saved).abs() < 0.0006, "{}", here.verdict);
            // X at 10 m/s takes nothing: all of its time is lost, of a slow Y hardly any, of a rapid none
            let [fast, others @ ..] = here.blocks.as_slice() else { panic!() };
            assert!((fast.duration_s - fast.lost_s).abs() < 0.012, "{fast:?}");
            assert!(others.iter().all(|block| block.lost_s < 0.02), "{others:?}");
            assert!(here.loss.contains(&format!("most in line 2 ({:.3} s)", fast.lost_s)), "{}", here.loss);
        }
    }
}
