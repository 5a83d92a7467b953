//! `cutaway completions`.

use clap::CommandFactory;

use crate::args::Cli;
use crate::report;

pub(crate) fn run(shell: clap_complete::Shell) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "cutaway", &mut script);
    report::print(&String::from_utf8(script)?)
}
