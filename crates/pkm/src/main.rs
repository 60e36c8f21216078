//! `pkm`: parse arguments, call the rooms, show results.

mod cli;
mod commands;
mod interrupt;
mod outcome;
mod output;
mod render;
mod storage;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    let messages = render::diagnostics::Messages::new(cli.color, cli.command.overrides());
    let result = match &cli.command {
        cli::Command::Run(arguments) => commands::run::run(arguments, &messages),
        cli::Command::Check(arguments) => commands::check::run(arguments, &messages),
        cli::Command::Plan(arguments) => commands::plan::run(arguments, &messages),
        cli::Command::Canon(arguments) => commands::canon::run(arguments, &messages),
        cli::Command::Hal(arguments) => commands::hal::run(arguments, &messages),
        cli::Command::Jog(arguments) => commands::jog::run(arguments),
        cli::Command::Configure(arguments) => commands::configure::run(arguments, &messages),
        cli::Command::Plot(arguments) => commands::plot::run(arguments, &messages),
        cli::Command::Workspace(arguments) => commands::workspace::run(arguments, &messages),
        cli::Command::Kins(command) => commands::kins::run(command),
        cli::Command::Steps(arguments) => commands::steps::run(arguments),
        cli::Command::Machines(arguments) => commands::machines::run(arguments),
        cli::Command::Linuxcnc(arguments) => commands::linuxcnc::run(arguments, &messages),
        cli::Command::ImportLinuxcnc(arguments) => commands::import_linuxcnc::run(arguments, &messages),
        cli::Command::Generate(arguments) => commands::generate::run(arguments),
    };
    match result {
        Ok(outcome) => outcome.into(),
        Err(failure) => failure.report(&messages).into(),
    }
}
