//! A program on a machine: from G-code to step pulses.
//!
//! [`check`] says everything that can be said before anything moves: language errors, poses out of reach, travel,
//! singularities, block by block, all findings. [`run`] does that first, then plans the program, steps it on the
//! simulated HAL and judges the edges. Memory does not grow with the length of the program.

mod check;
pub mod configure;
mod controller;
mod deviation;
mod feeder;
mod jog;
mod judged;
mod language;
mod limited;
mod messages;
mod plan;
mod probing;
mod program;
mod rehearsal;
mod setup;
mod summary;
mod switch;
mod synchronised;
mod wiring;

pub use check::{Checked, Programmed, check, check_with};
pub use jog::{Jog, JogEnd, Jogged, jog};
pub use judged::Judged;
pub use language::check_language;
pub use limited::{Limited, limited};
pub use pkm_analysis::outcome::{Objection, Outcome};
pub use plan::{BlockPlan, JointUse, Plan, Shares, plan};
pub use program::Program;
pub use rehearsal::{Played, Rehearsal};
pub use summary::{ClosestApproach, JointSummary, SCHEMA, Summary, Synchronisation};

use controller::Controller;
use pkm_canon::diagnostic::{Diagnostic, Severity};
use pkm_gcode::{Parameters, ToolTable};
use pkm_hal_sim::components::kinematics::Forward;
use pkm_hal_sim::{Observer, PinFault, Simulation};
use pkm_kins::Pose;
use pkm_machine::Machine;
use pkm_machine::workpiece::Solid;
use std::ops::ControlFlow;
use summary::Account;

/// What a caller may set.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Where the machine stands when the program begins (mm, rad); `None` = the machine's home.
    pub start: Option<Pose>,
    /// Feed override, 1 = 100 %.
    pub feed_override: f64,
    /// Rows between servo ticks: the simulated HAL runs this many times per servo period (1 = once).
    pub substeps: u32,
    /// The run ends, not completed, after so many servo periods.
    pub max_ticks: u64,
    /// `/` lines are skipped.
    pub block_delete: bool,
    /// The program begins at this line, counted from 1, with the state that the lines before it leave.
    pub start_line: Option<u32>,
    /// The most blocks that loops and subs may execute before the program counts as endless; 0 = no limit.
    pub max_blocks: u64,
    /// The tools of the machine; none without it. Read once for the life of the process.
    pub tools: Option<&'static ToolTable>,
    /// The machine begins without knowing where it is, and homes first; the program begins at its home pose.
    pub home: bool,
    /// Faults on pins, in periods of the HAL.
    pub faults: &'static [PinFault],
    /// What the parameters are when the program begins; a fresh set without it.
    pub parameters: Option<&'static Parameters>,
    /// What the probe can touch, in place of what the machine file says.
    pub workpiece: Option<&'static [Solid]>,
}

impl Options {
    /// What the probe can touch.
    fn workpiece<'a>(&self, machine: &'a Machine) -> &'a [Solid] {
        self.workpiece.unwrap_or(&machine.workpiece)
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            start: None,
            feed_override: 1.0,
            substeps: 1,
            max_ticks: 100_000_000,
            block_delete: false,
            start_line: None,
            max_blocks: 10_000_000,
            tools: None,
            home: false,
            faults: &[],
            parameters: None,
            workpiece: None,
        }
    }
}

impl Options {
    /// Where the program begins: homing leads to the home pose.
    fn program_start(&self, machine: &Machine) -> Pose {
        self.start.filter(|_| !self.home).unwrap_or(machine.home)
    }
}

/// How far a run has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Servo periods so far.
    pub ticks: u64,
    /// Line being executed.
    pub line: u32,
}

/// Servo periods between two calls of the progress function.
const PROGRESS_TICKS: u64 = 1000;

/// The planner's queues are larger than the stack of a small thread.
const STACK_BYTES: usize = 64 << 20;

/// The HAL of a machine, wired as for a run with homing, and its mechanism behind the motors: `kinematics.axis.x` ...
///
/// # Errors
/// The machine cannot be wired.
pub fn machine_hal(machine: &Machine) -> Result<pkm_hal_sim::Hal, pkm_hal_sim::ConfigError> {
    let wiring = wiring::Wiring { substeps: 1, switches: true, homed: true, seed: 1 };
    let mut hal = Simulation::new(&wiring::config(machine, machine.home, wiring))?.hal().clone();
    Forward::load(&mut hal, machine.mechanism, machine.home)?;
    for n in 0..machine.joints.len() {
        hal.net(&format!("j{n}-motor-pos"), &[&format!("kinematics.joint.{n}")])?;
    }
    hal.addf("kinematics.forward", "servo-thread")?;
    Ok(hal)
}

/// Does work that needs more stack than small threads have: the planner's queues are large.
///
/// # Panics
/// As the work does, and if no thread can be started.
pub fn on_a_large_stack<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, work);
        let worker = worker.expect("a thread can be started");
        worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// Runs a program on the simulated machine. The whole program is checked first; if that finds an error, nothing moves
/// and the summary says so (`completed: false`, with the findings).
///
/// `outputs` is called once the machine is wired and returns what wants to see every edge and every tick; it comes
/// back with the summary. `progress` is called now and then and may end the run.
///
/// # Errors
/// The program cannot be read, or the machine cannot be simulated: a diagnostic.
pub fn run<O: Observer + Send>(
    program: &Program,
    machine: &Machine,
    options: &Options,
    outputs: impl FnOnce(&Simulation) -> O + Send,
    progress: impl FnMut(&Progress) -> ControlFlow<()> + Send,
) -> Result<(Summary, Option<O>), Diagnostic> {
    let checked = check(program, machine, options)?;
    run_checked(program, machine, options, checked, outputs, progress, None::<fn(&mut O, &Judged)>)
}

/// [`run`] for a program that was checked already. `judged`, if there is one, sees the outputs and every servo period as
/// the judge of the run saw it.
///
/// # Errors
/// As [`run`].
pub fn run_checked<O: Observer + Send>(
    program: &Program,
    machine: &Machine,
    options: &Options,
    mut checked: Checked,
    outputs: impl FnOnce(&Simulation) -> O + Send,
    progress: impl FnMut(&Progress) -> ControlFlow<()> + Send,
    judged: Option<impl FnMut(&mut O, &Judged) + Send>,
) -> Result<(Summary, Option<O>), Diagnostic> {
    if let Some(span) = checked.probes.filter(|_| options.workpiece(machine).is_empty()) {
        checked.diagnostics.push(messages::probe_not_wired(program, span));
    }
    if checked.has_errors() {
        return Ok((Summary::refused(program, machine, checked), None));
    }
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new()
            .name("run".to_owned())
            .stack_size(STACK_BYTES)
            .spawn_scoped(scope, || drive(program, machine, options, checked, outputs, progress, judged))
            .map_err(|e| messages::host(program, &format!("cannot start a thread: {e}")))?;
        worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn drive<O: Observer>(
    program: &Program,
    machine: &Machine,
    options: &Options,
    checked: Checked,
    outputs: impl FnOnce(&Simulation) -> O,
    mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    mut judged: Option<impl FnMut(&mut O, &Judged)>,
) -> Result<(Summary, Option<O>), Diagnostic> {
    // A machine without a program for its spindle is simulated without it.
    let has_spindle = checked.turns || checked.probes.is_some();
    let mut controller = Controller::new(program, machine, options, (false, has_spindle))?;
    let mut outputs = outputs(&controller.simulation);
    let mut account = Account::new(machine, &controller.simulation);
    let mut findings = checked.diagnostics;
    let mut completed = false;
    let mut ticks = 0;
    loop {
        if controller.is_done() {
            completed = controller.feeder.failure().is_none();
            findings.extend(controller.feeder.failure().cloned());
            break;
        }
        if ticks >= options.max_ticks {
            findings.push(messages::max_ticks(program, options.max_ticks, controller.feeder.line()));
            break;
        }
        if ticks % PROGRESS_TICKS == 0
            && progress(&Progress { ticks, line: controller.feeder.line() }).is_break()
        {
            findings.push(messages::interrupted(program, controller.feeder.line(), ticks));
            break;
        }
        ticks += 1;
        let homing = controller.is_homing();
        if let Err(stop) = controller.period(&mut [&mut outputs]) {
            controller.stop(&mut [&mut outputs]);
            findings.push(stop);
            break;
        }
        if homing {
            account.homing(&controller.simulation);
        } else {
            account.tick(&controller.simulation, &mut controller.feeder);
        }
        if let Some(judged) = &mut judged {
            judged(&mut outputs, &account.judged(&controller.simulation, &controller.feeder, homing));
        }
    }
    let Controller { simulation, feeder, .. } = &mut controller;
    findings.append(&mut feeder.chains.warnings);
    if let Some(excess) = &account.excess {
        findings.push(messages::excess(program, machine, excess));
    }
    let mut summary = account.finish(program, machine, simulation, feeder);
    summary.completed = completed && !findings.iter().any(|d| d.severity == Severity::Error);
    summary.diagnostics = findings;
    summary.parameters = summary.completed.then(|| Box::new(feeder.parameters().clone()));
    Ok((summary, Some(outputs)))
}
