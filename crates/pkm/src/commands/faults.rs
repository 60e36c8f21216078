//! `pkm run --fault` and `--faults`: how a program ends with a fault, as the judge sees it.

use crate::cli::{Format, Run};
use crate::commands::program::Job;
use crate::interrupt;
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::render::diagnostics::Messages;
use pkm_hal_sim::PinFault;
use pkm_machine::Machine;
use pkm_run::{Options, Played, Program, Rehearsal, on_a_large_stack};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{Write, stdout};
use std::sync::atomic::Ordering;

/// A list of faults and what came of them.
#[derive(Serialize)]
struct Told {
    fault: Vec<String>,
    /// Empty: what must not happen.
    outcome: String,
    /// Why the machine stopped.
    message: String,
    /// What must not happen; empty: nothing of that kind.
    objection: String,
}

#[derive(Serialize)]
struct All {
    schema: u32,
    program: String,
    machine: String,
    servo_ticks: u64,
    seed: u64,
    faults: Vec<Told>,
}

fn tell(faults: &[PinFault], played: Played) -> Told {
    let (mut outcome, mut objection) = (String::new(), String::new());
    match (played.verdict, played.recovery) {
        (Ok(good), Ok(())) => outcome = good.to_string(),
        (Err(bad), _) => objection = bad.to_string(),
        (Ok(good), Err(why)) => objection = format!("{good}; but the machine cannot be used again: {why}"),
    }
    Told {
        fault: faults.iter().map(PinFault::to_string).collect(),
        outcome,
        message: played.message,
        objection,
    }
}

/// Why the rehearsal cannot be: an error of the program is an answer, everything else no question.
fn refused(messages: &Messages, diagnostic: pkm_canon::diagnostic::Diagnostic) -> Outcome {
    messages.print(&[diagnostic]);
    Outcome::No
}

/// `--faults N --seed S`: N runs with one random fault each.
pub(crate) fn random(arguments: &Run, count: u64, messages: &Messages) -> Result<Outcome, Failure> {
    let Job { program, machine, options, .. } = Job::new(&arguments.program, messages)?;
    let options = Options { home: arguments.home, ..options };
    on_a_large_stack(|| {
        let rehearsal = match Rehearsal::new(&program, &machine, &options) {
            Ok(rehearsal) => rehearsal,
            Err(diagnostic) => return Ok(refused(messages, diagnostic)),
        };
        let interrupted = interrupt::flag();
        let mut told = Vec::new();
        for n in 0..count {
            if interrupted.load(Ordering::Relaxed) {
                break;
            }
            let faults = [rehearsal.random_fault(arguments.seed.wrapping_add(n))];
            told.push(tell(&faults, rehearsal.play(&faults)?));
        }
        let all = All {
            schema: pkm_run::SCHEMA,
            program: program.name(),
            machine: machine.name.clone(),
            servo_ticks: rehearsal.periods(),
            seed: arguments.seed,
            faults: told,
        };
        print(&all, arguments.program.format)?;
        Ok(if interrupted.load(Ordering::Relaxed) {
            Outcome::Interrupted
        } else if all.faults.iter().all(|told| told.objection.is_empty()) {
            Outcome::Clean
        } else {
            Outcome::No
        })
    })
}

fn print(all: &All, format: Format) -> Result<(), Failure> {
    if format == Format::Json {
        return output::json_line(all);
    }
    let mut out = stdout().lock();
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for told in &all.faults {
        let answer = if told.objection.is_empty() { &told.outcome } else { "NOT as it must end" };
        *counts.entry(answer).or_default() += 1;
        for fault in &told.fault {
            write!(out, "--fault {fault}  ")?;
        }
        let why = if told.objection.is_empty() { &told.message } else { &told.objection };
        writeln!(out, "{answer}{}{why}", if why.is_empty() { "" } else { ": " })?;
    }
    writeln!(
        out,
        "{} on {}: {} servo periods, {} faults",
        all.program,
        all.machine,
        all.servo_ticks,
        all.faults.len()
    )?;
    for (answer, count) in counts {
        writeln!(out, "  {count:>6}  {answer}")?;
    }
    Ok(())
}

/// The judge's sentence on a run with these faults; None: the program cannot be rehearsed.
pub(crate) fn verdict(
    program: &Program,
    machine: &Machine,
    options: &Options,
    faults: &[PinFault],
) -> Option<(bool, String)> {
    on_a_large_stack(|| {
        let rehearsal = Rehearsal::new(program, machine, options).ok()?;
        let told = tell(faults, rehearsal.play(faults).ok()?);
        let late = faults.iter().filter(|fault| fault.tick > rehearsal.periods()).count();
        let note = if late > 0 {
            format!(" ({late} of the faults come after the end of the program)")
        } else {
            String::new()
        };
        Some(match told.objection.as_str() {
            "" => (true, format!("{}{note}", told.outcome)),
            objection => (false, format!("NOT as it must end: {objection}{note}")),
        })
    })
}
