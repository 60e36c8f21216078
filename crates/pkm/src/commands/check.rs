//! `pkm check`: everything that can be said before cutting.

use crate::cli::{Check, Format};
use crate::commands::program::{Job, Text, answered};
use crate::interrupt;
use crate::outcome::{Failure, Outcome};
use crate::output;
use crate::render::diagnostics::{Json, Messages};
use pkm_canon::diagnostic::Severity;
use serde::Serialize;
use std::io::{Write, stdout};

/// The answer as scripts read it.
#[derive(Serialize)]
struct Answer<'a> {
    schema: u32,
    program: String,
    machine: Option<&'a str>,
    ok: bool,
    blocks: u64,
    moves: u64,
    diagnostics: Vec<Json<'a>>,
}

pub(crate) fn run(arguments: &Check, messages: &Messages) -> Result<Outcome, Failure> {
    answered(&arguments.program, check(arguments, messages))
}

fn check(arguments: &Check, messages: &Messages) -> Result<Outcome, Failure> {
    interrupt::at_once("check");
    let (program, machine, checked) = if arguments.program.machine.machine.is_some() {
        let job = Job::new(&arguments.program, messages)?;
        let checked = pkm_run::check(&job.program, &job.machine, &job.options)?;
        (job.program, Some(job.machine.name), checked)
    } else {
        let text = Text::new(&arguments.program, messages)?;
        let checked = pkm_run::check_language(&text.program, &text.options)?;
        (text.program, None, checked)
    };
    match arguments.program.format {
        Format::Json => {
            output::json_line(&Answer {
                schema: pkm_run::SCHEMA,
                program: program.name(),
                machine: machine.as_deref(),
                ok: !checked.has_errors(),
                blocks: checked.blocks,
                moves: checked.moves,
                diagnostics: checked.diagnostics.iter().map(Json::from).collect(),
            })?;
        }
        Format::Text => {
            messages.print(&checked.diagnostics);
            let count = |severity| checked.diagnostics.iter().filter(|d| d.severity == severity).count();
            writeln!(
                stdout(),
                "{}: {} blocks, {} moves{}: {}, {}",
                program.name(),
                checked.blocks,
                checked.moves,
                machine.map_or_else(String::new, |machine| format!(" on {machine}")),
                plural(count(Severity::Error), "error"),
                plural(count(Severity::Warning), "warning"),
            )?;
        }
    }
    Ok(if checked.has_errors() { Outcome::No } else { Outcome::Clean })
}

/// `no errors`, `1 error`, `2 errors`.
fn plural(count: usize, word: &str) -> String {
    match count {
        0 => format!("no {word}s"),
        1 => format!("1 {word}"),
        _ => format!("{count} {word}s"),
    }
}
