//! `pkm configure`: which configuration of a reconfigurable machine runs a program best.

use crate::cli::{Configure, Format, RankBy};
use crate::commands::program::{Job, answered};
use crate::interrupt;
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::render::diagnostics::Messages;
use comfy_table::{ContentArrangement, Table, presets};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pkm_analysis::parallel;
use pkm_machine::family::Family;
use pkm_run::configure::{Found, Judged, Rank, Verdict, search};
use serde::Serialize;
use std::io::{self, IsTerminal, Write, stderr, stdout};
use std::sync::atomic::Ordering;

/// The answer as scripts read it.
#[derive(Serialize)]
struct Answer<'a> {
    schema: u32,
    program: String,
    machine: &'a str,
    runs: usize,
    ended_early: bool,
    configurations: &'a [Judged],
}

pub(crate) fn run(arguments: &Configure, messages: &Messages) -> Result<Outcome, Failure> {
    answered(&arguments.program, work(arguments, messages))
}

fn work(arguments: &Configure, messages: &Messages) -> Result<Outcome, Failure> {
    let wanted = &arguments.program.machine;
    let name = wanted.machine.as_deref().unwrap_or_default();
    let family = Family::load(name, &wanted.set)?;
    let Job { program, options, .. } = Job::new(&arguments.program, messages)?;
    let bar = progress_bar(family.count());
    let interrupted = interrupt::flag();
    let progress = || {
        bar.inc(1);
        !interrupted.load(Ordering::Relaxed)
    };
    let rank = match arguments.rank_by {
        RankBy::Time => Rank::Time,
        RankBy::Singularity => Rank::Singularity,
        RankBy::Travel => Rank::Travel,
    };
    let threads = arguments.threads.unwrap_or_else(parallel::cores);
    let found = search(&family, &program, &options, rank, threads, &progress);
    bar.finish_and_clear();
    let found = found?;
    match arguments.program.format {
        Format::Json => {
            output::json_line(&Answer {
                schema: pkm_run::SCHEMA,
                program: program.name(),
                machine: name,
                runs: found.runs,
                ended_early: found.ended,
                configurations: &found.configurations,
            })?;
        }
        Format::Text => text(&mut stdout().lock(), &program.name(), name, &family, &found)?,
    }
    Ok(if found.ended {
        Outcome::Interrupted
    } else if found.runs > 0 {
        Outcome::Clean
    } else {
        Outcome::No
    })
}

fn text(
    out: &mut impl Write,
    program: &str,
    machine: &str,
    family: &Family,
    found: &Found,
) -> io::Result<()> {
    let tried = found.configurations.len();
    match found.runs {
        0 => writeln!(out, "{program}: none of {tried} configurations of {machine} can run it")?,
        runs => writeln!(out, "{program}: {runs} of {tried} configurations of {machine} can run it")?,
    }
    if found.ended {
        writeln!(out, "interrupted after {tried} of {} configurations", family.count())?;
    }
    if found.still {
        writeln!(out, "nothing moves in this program: all that can run it rank alike")?;
    }
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(["", "configuration", "time s", "singularity", "travel mm"]);
    for (index, judged) in found.configurations.iter().take(found.runs).enumerate() {
        if let Verdict::Runs(figures) = &judged.verdict {
            table.add_row([
                format!("{}.", index + 1),
                judged.name.clone(),
                format!("{:.3}", figures.duration_s),
                format!("{:.3}", figures.min_singularity_distance),
                format!("{:.3}", figures.travel_mm),
            ]);
        }
    }
    if found.runs > 0 {
        for line in table.lines() {
            writeln!(out, "{}", line.trim_end())?;
        }
    }
    for judged in found.configurations.iter().skip(found.runs) {
        match &judged.verdict {
            Verdict::Fails { line: 0, message, .. } => writeln!(out, "no  {}: {message}", judged.name)?,
            Verdict::Fails { line, message, .. } => {
                writeln!(out, "no  {}: line {line}: {message}", judged.name)?
            }
            Verdict::NoMachine { message, .. } => {
                writeln!(out, "no  {}: no machine: {message}", judged.name)?
            }
            Verdict::Runs(_) => {}
        }
    }
    if let (Some(best), true) = (found.configurations.first(), found.runs > 0) {
        let set: Vec<String> = best.set.iter().map(|text| format!("--set '{text}'")).collect();
        writeln!(out, "the best: pkm run {program} --machine {machine} {}", set.join(" "))?;
    }
    Ok(())
}

/// Configurations, on a terminal; nothing elsewhere.
fn progress_bar(count: usize) -> ProgressBar {
    if !stderr().is_terminal() {
        return ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
    }
    let bar = ProgressBar::new(count as u64);
    let style = ProgressStyle::with_template("{wide_bar} {pos} of {len} configurations, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    bar.set_style(style);
    bar
}
