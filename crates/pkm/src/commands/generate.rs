//! `pkm generate`: man page and completions.

use crate::cli::{Cli, Generate, What};
use crate::outcome::{Failure, Outcome};
use clap::CommandFactory;
use clap_complete::Shell;
use std::io::{Write, stdout};

pub(crate) fn run(arguments: &Generate) -> Result<Outcome, Failure> {
    let mut command = Cli::command();
    command.build();
    let mut text = Vec::new();
    let shell = match arguments.what {
        What::Man => {
            let page = match &arguments.subcommand {
                Some(name) => command.find_subcommand(name).cloned().ok_or_else(|| {
                    let message = format!("`{name}` is not a subcommand");
                    Failure::could_not("usage", "pkm", message, "`pkm help` lists them")
                })?,
                None => command,
            };
            clap_mangen::Man::new(page).render(&mut text)?;
            stdout().lock().write_all(&text)?;
            return Ok(Outcome::Clean);
        }
        What::CompleteBash => Shell::Bash,
        What::CompleteZsh => Shell::Zsh,
        What::CompleteFish => Shell::Fish,
    };
    clap_complete::generate(shell, &mut command, "pkm", &mut text);
    stdout().lock().write_all(&text)?;
    Ok(Outcome::Clean)
}
