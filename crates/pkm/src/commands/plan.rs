//! `pkm plan`: how long every block takes and what limits it.

use crate::cli::{Format, Plan};
use crate::commands::program::{Job, answered};
use crate::interrupt;
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::render::diagnostics::{Json, Messages};
use serde::Serialize;
use std::io::{Write, stdout};

/// The plan as scripts read it.
#[derive(Serialize)]
struct Answer<'a> {
    #[serde(flatten)]
    plan: &'a pkm_run::Plan,
    diagnostics: Vec<Json<'a>>,
}

pub(crate) fn run(arguments: &Plan, messages: &Messages) -> Result<Outcome, Failure> {
    answered(&arguments.program, plan(arguments, messages))
}

fn plan(arguments: &Plan, messages: &Messages) -> Result<Outcome, Failure> {
    interrupt::at_once("plan");
    let job = Job::new(&arguments.program, messages)?;
    let plan = pkm_run::plan(&job.program, &job.machine, &job.options)?;
    match arguments.program.format {
        Format::Json => {
            let answer =
                Answer { plan: &plan, diagnostics: plan.diagnostics.iter().map(Json::from).collect() };
            output::json_line(&answer)?;
        }
        Format::Text => {
            let mut out = stdout().lock();
            messages.print(&plan.diagnostics);
            writeln!(out, "{} on {}: {:.3} s", plan.program, plan.machine, plan.duration_s)?;
            writeln!(out, "  {}", plan.verdict)?;
            if !plan.loss.is_empty() {
                writeln!(out, "  {}", plan.loss)?;
            }
            if plan.starved_stops > 0 {
                writeln!(out, "  {} stops for want of the next block", plan.starved_stops)?;
            }
            let total: f64 = plan.limited_by_s.values().sum();
            for (limit, seconds) in by_time(&plan.limited_by_s) {
                writeln!(out, "  {:5.1} %  {seconds:9.3} s  {limit}", 100.0 * seconds / total)?;
            }
            let mut blocks: Vec<&pkm_run::BlockPlan> = plan.blocks.iter().collect();
            blocks.sort_by(|a, b| b.duration_s.total_cmp(&a.duration_s));
            if !blocks.is_empty() && arguments.longest > 0 {
                writeln!(out, "  the longest blocks, and what limits them:")?;
            }
            for block in blocks.iter().take(arguments.longest) {
                let limits: Vec<String> = by_time(&block.limited_by_s)
                    .into_iter()
                    .take(3)
                    .filter(|(_, seconds)| *seconds >= 0.005 * block.duration_s)
                    .map(|(limit, seconds)| format!("{limit} {:.0} %", 100.0 * seconds / block.duration_s))
                    .collect();
                let place = match block.file {
                    None => format!("line {:6}", block.line),
                    Some(_) => block.place(),
                };
                writeln!(out, "  {place}  {:9.3} s  {}", block.duration_s, limits.join(", "))?;
            }
        }
    }
    Ok(if plan.completed { Outcome::Clean } else { Outcome::No })
}

/// The largest first.
fn by_time(shares: &pkm_run::Shares) -> Vec<(&String, f64)> {
    let mut shares: Vec<(&String, f64)> = shares.iter().map(|(limit, seconds)| (limit, *seconds)).collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    shares
}
