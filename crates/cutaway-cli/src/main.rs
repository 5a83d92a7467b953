//! `cutaway`: renders volumes and cuts them open.
//!
//! Exit codes: 0 done, 1 failed, 2 wrong use. Errors are one line on standard error: what was wrong, where, what to do.
#![deny(unsafe_code)]

#[cfg(test)]
mod advice;
mod args;
mod clip;
mod commands;
mod environment;
mod load;
mod options;
mod outputs;
mod report;
mod scene;
mod signals;
mod streams;
mod threads;
mod unavailable;
mod values;

use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Command};

fn main() -> ExitCode {
    environment::quiet_vulkan_layers();
    signals::clean_up();
    signals::fail_without_memory();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return unavailable::explain(&error),
    };
    match run(cli.command) {
        Ok(code) => code,
        Err(error) => {
            report::error(&error);
            ExitCode::from(if error.is::<report::WrongUse>() { 2 } else { 1 })
        }
    }
}

fn run(command: Command) -> anyhow::Result<ExitCode> {
    if !matches!(command, Command::Presets(_) | Command::Schema | Command::Completions { .. }) {
        threads::start();
    }
    match command {
        Command::Render(args) => commands::render::run(&args)?,
        Command::View(args) => commands::view::run(&args)?,
        Command::Info(args) => commands::info::run(&args)?,
        Command::Convert(args) => commands::convert::run(&args)?,
        Command::Compare(args) => return commands::compare::run(&args),
        Command::Presets(args) => commands::presets::run(&args)?,
        Command::Schema => commands::schema::run()?,
        Command::Bench(args) => commands::bench::run(&args)?,
        Command::Completions { shell } => commands::completions::run(shell)?,
    }
    Ok(ExitCode::SUCCESS)
}
