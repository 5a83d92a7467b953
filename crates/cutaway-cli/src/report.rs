//! What is said: results on standard output; errors, notices and progress on standard error.
//!
//! Neither panics where nobody listens: `println!` and `eprintln!` would.

use std::fmt;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Mutex;
use std::time::Duration;

use anyhow::Context;
use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};

use crate::streams;

/// An error that lies in how the program was called: exit code 2.
#[derive(Debug)]
pub(crate) struct WrongUse(String);

impl fmt::Display for WrongUse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for WrongUse {}

/// Wrong use, with this message.
pub(crate) fn wrong_use(message: impl Into<String>) -> anyhow::Error {
    anyhow::Error::new(WrongUse(message.into()))
}

/// Writes results to standard output. A reader that has gone (`cutaway presets | head -1`) has what it wanted.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    match write_to(&streams::Stream::Output, text.as_bytes()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.context("could not write to standard output"),
    }
}

/// Writes bytes that someone needs whole, such as an image, to standard output.
pub(crate) fn print_bytes(bytes: &[u8]) -> anyhow::Result<()> {
    write_to(&streams::Stream::Output, bytes).context("could not write to standard output")
}

/// Writes text that someone needs whole, such as statistics, to standard error.
pub(crate) fn print_error_stream(text: &str) -> anyhow::Result<()> {
    write_to(&streams::Stream::Error, text.as_bytes()).context("could not write to standard error")
}

fn write_to(stream: &streams::Stream, bytes: &[u8]) -> std::io::Result<()> {
    let mut to = stream.open()?;
    to.write_all(bytes)?;
    to.flush()
}

/// One line on standard error, without whatever a file name may hold to confuse a terminal.
pub(crate) fn say(line: &str) {
    let line: String = line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    // Nothing to be done where even this cannot be written.
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// One line that says what went wrong.
pub(crate) fn error(error: &anyhow::Error) {
    say(&format!("error: {error:#}"));
}

/// How much is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Verbosity {
    Quiet,
    Normal,
    Verbose,
}

impl Verbosity {
    pub(crate) fn new(quiet: bool, verbose: bool) -> Self {
        if quiet {
            Self::Quiet
        } else if verbose {
            Self::Verbose
        } else {
            Self::Normal
        }
    }

    /// Something the user should know.
    pub(crate) fn notice(self, message: &str) {
        if self >= Self::Normal {
            say(&format!("note: {message}"));
        }
    }

    /// Something that a curious user wants to know.
    pub(crate) fn detail(self, message: impl FnOnce() -> String) {
        if self >= Self::Verbose {
            say(&message());
        }
    }

    /// A progress bar that shows itself, on a terminal, once work takes over a second.
    pub(crate) fn progress(self, what: &'static str) -> Progress {
        let visible = self >= Self::Normal && std::io::stderr().is_terminal();
        Progress { what, started: std::time::Instant::now(), visible, bar: Mutex::new(None) }
    }
}

/// See [`Verbosity::progress`].
pub(crate) struct Progress {
    what: &'static str,
    started: std::time::Instant,
    visible: bool,
    bar: Mutex<Option<ProgressBar>>,
}

impl Progress {
    /// The finished share, 0..=1.
    pub(crate) fn set(&self, share: f32) {
        if !self.visible || self.started.elapsed() < Duration::from_secs(1) {
            return;
        }
        // A poisoned lock means another thread failed while drawing: the work matters more than the bar.
        let Ok(mut bar) = self.bar.lock() else { return };
        let bar = bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(1000).with_message(self.what).with_elapsed(self.started.elapsed());
            let style = ProgressStyle::with_template("{msg} [{bar:32}] {percent}%, {left} left");
            bar.with_style(style.map_or_else(|_| ProgressStyle::default_bar(), |s| s.with_key("left", left)))
        });
        bar.set_position((share * 1000.0) as u64);
    }
}

/// The time left at the mean speed so far. The bar's own guess is wrong here: it sees the first second's work, done
/// before there was a bar, as done at once.
fn left(state: &ProgressState, text: &mut dyn fmt::Write) {
    let seconds = state.elapsed().as_secs_f64() * (1.0 / f64::from(state.fraction()).max(1e-3) - 1.0);
    // Nothing to be done where a string cannot be written to.
    let _ = write!(text, "{}", HumanDuration(Duration::from_secs_f64(seconds.max(0.0))));
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Ok(Some(bar)) = self.bar.lock().map(|mut bar| bar.take()) {
            bar.finish_and_clear();
        }
    }
}
