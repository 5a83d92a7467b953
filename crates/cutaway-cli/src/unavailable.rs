//! Options of the interface that this version does not have: refused by name, never ignored.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::CommandFactory;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::args::Cli;
use crate::report;
use crate::streams;
use crate::values::closest;

/// Options that the interface names and later versions will have.
pub(crate) const OPTIONS: &[&str] = &["--turntable", "--frames"];

/// Prints what is wrong with a command line; 0 for `--help` and `--version`, 2 otherwise.
pub(crate) fn explain(error: &clap::Error) -> ExitCode {
    let usage_error = error.use_stderr();
    if usage_error && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let line = unknown_name(error).unwrap_or_else(|| one_line(&error.to_string()));
        report::say(&line);
    } else {
        return print(error, usage_error);
    }
    ExitCode::from(2)
}

/// Prints help or the version on standard output, or how the program is called on standard error.
fn print(error: &clap::Error, usage_error: bool) -> ExitCode {
    let printed = match streams::Stream::Output.open() {
        Err(closed) if !usage_error => Err(closed),
        _ => error.print(),
    };
    match printed {
        _ if usage_error => ExitCode::from(2),
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            report::error(&anyhow::Error::new(error).context("could not write to standard output"));
            ExitCode::FAILURE
        }
        _ => ExitCode::SUCCESS,
    }
}

/// What to say of an option or a command that is not there.
fn unknown_name(error: &clap::Error) -> Option<String> {
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let (what, name, there, later) = match error.kind() {
        ErrorKind::UnknownArgument => {
            let command = called_command();
            let name = context(ContextKind::InvalidArg)?;
            if !name.starts_with('-') {
                return missing_value(&command);
            }
            ("option", name, options_of(&command), OPTIONS)
        }
        ErrorKind::InvalidSubcommand => {
            let command = called_command();
            let there = command.get_subcommands().map(|c| c.get_name().to_owned()).collect();
            ("command", context(ContextKind::InvalidSubcommand)?, there, [].as_slice())
        }
        _ => return None,
    };
    if later.contains(&name) {
        return Some(format!(
            "error: `{name}` does not exist in this version of cutaway; `cutaway help` shows what does"
        ));
    }
    let names: Vec<&str> = there.iter().map(String::as_str).chain(later.iter().copied()).collect();
    // The dashes that all options begin with would make them all alike.
    let bare: Vec<&str> = names.iter().map(|name| name.trim_start_matches('-')).collect();
    let tip = match closest(name.trim_start_matches('-'), &bare) {
        Some(near) if later.iter().any(|l| l.trim_start_matches('-') == near) => {
            format!("; `{}` does not exist in this version of cutaway", dashed(name, near))
        }
        Some(near) => format!("; did you mean `{}`?", dashed(name, near)),
        None => String::new(),
    };
    Some(format!("error: there is no {what} `{name}`{tip} (try `--help`)"))
}

/// A name with the dashes of an option, if it is one.
fn dashed(like: &str, name: &str) -> String {
    if like.starts_with('-') { format!("--{name}") } else { name.to_owned() }
}

/// The command that the arguments call.
fn called_command() -> clap::Command {
    let mut command = Cli::command();
    for argument in std::env::args_os().skip(1).filter_map(|a| a.into_string().ok()) {
        if let Some(found) = command.find_subcommand(&argument) {
            command = found.clone();
        }
    }
    command
}

fn options_of(command: &clap::Command) -> Vec<String> {
    command.get_arguments().filter_map(|a| a.get_long()).map(|long| format!("--{long}")).collect()
}

/// In `--iso --mode iso` it is not the last word that is wrong: numbers may begin with a hyphen, so `--mode` was taken
/// for the value of `--iso`.
fn missing_value(command: &clap::Command) -> Option<String> {
    let takes_value = |name: &str| {
        command.get_arguments().any(|a| a.get_long() == Some(name) && a.get_action().takes_values())
    };
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let found = arguments.windows(2).find_map(|pair| {
        let (option, next) = (pair[0].to_str()?, pair[1].to_str()?);
        (takes_value(option.strip_prefix("--")?) && next.starts_with("--")).then_some((option, next))
    });
    found.map(|(option, next)| {
        format!("error: `{option}` needs a value, found the option `{next}` (try `--help`)")
    })
}

/// Clap's message as one line: the error, its tips, then where to read on.
fn one_line(message: &str) -> String {
    let parts = message.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with("Usage:"));
    // What begins with `tip: to pass` is about values that look like options: never what was meant here.
    let parts = parts.filter(|l| !l.starts_with("For more information") && !l.starts_with("tip: to pass"));
    format!("{} (try `--help`)", parts.collect::<Vec<_>>().join("; ").replace(":; ", ": "))
}
