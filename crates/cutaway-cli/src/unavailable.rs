//! Options and commands of the interface that this version does not have: refused by name, never ignored.

use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Options that the interface names and later versions will have.
const OPTIONS: &[&str] = &[
    "--sampling",
    "--adaptive-threshold",
    "--pre-integration",
    "--jitter",
    "--image-interpolation",
    "--blur",
    "--cut",
    "--probe",
    "--crop",
    "--clip-plane",
    "--clip-pose",
    "--segments",
    "--backmost",
    "--clip-events",
    "--buffer-depth",
    "--impregnation",
    "--impregnation-thickness",
    "--clip-intensity",
    "--turntable",
    "--frames",
    "--gpu",
];

/// Commands that the interface names and later versions will have.
const COMMANDS: &[&str] = &["view", "convert"];

/// Prints what is wrong with a command line; 0 for `--help` and `--version`, 2 otherwise.
pub(crate) fn explain(error: clap::Error) -> ExitCode {
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let missing = match error.kind() {
        ErrorKind::UnknownArgument => context(ContextKind::InvalidArg).filter(|a| OPTIONS.contains(a)),
        ErrorKind::InvalidSubcommand => {
            context(ContextKind::InvalidSubcommand).filter(|c| COMMANDS.contains(c))
        }
        _ => None,
    };
    if let Some(name) = missing {
        eprintln!(
            "error: `{name}` does not exist in this version of cutaway; `cutaway help` shows what does"
        );
        return ExitCode::from(2);
    }
    let usage_error = error.use_stderr();
    if usage_error && !matches!(error.kind(), ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand) {
        eprintln!("{}", one_line(&error.to_string()));
    } else {
        // Nothing to be done where even this cannot be written.
        let _ = error.print();
    }
    ExitCode::from(if usage_error { 2 } else { 0 })
}

/// Clap's message as one line: the error, its tips, then where to read on.
fn one_line(message: &str) -> String {
    let parts = message.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with("Usage:"));
    let parts: Vec<&str> = parts.filter(|l| !l.starts_with("For more information")).collect();
    format!("{} (try `--help`)", parts.join("; ").replace(":; ", ": "))
}
