//! A test that messages only advise options that exist.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::CommandFactory;

use crate::args::Cli;

/// Options of other programs: of Cargo, in advice on how to build the viewer, and of a shell's arithmetic.
const OF_OTHERS: [&str; 3] = ["--release", "--features", "--locked"];

/// Every option of every command, and those that clap adds.
fn options(command: &clap::Command, into: &mut BTreeSet<String>) {
    into.extend(command.get_arguments().filter_map(|a| a.get_long()).map(|long| format!("--{long}")));
    command.get_subcommands().for_each(|command| options(command, into));
}

fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, into);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            into.push(path);
        }
    }
}

/// Words like `--step` in what a line has in front of a comment.
fn words(line: &str) -> Vec<String> {
    let code =
        if line.trim_start().starts_with("//") && !line.trim_start().starts_with("///") { "" } else { line };
    let mut words = Vec::new();
    for (at, _) in code.match_indices("--") {
        let before = code[..at].chars().next_back();
        let word: String =
            code[at + 2..].chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
        let starts = before.is_none_or(|c| !c.is_alphanumeric() && c != '-');
        if starts && word.starts_with(|c: char| c.is_ascii_lowercase()) {
            words.push(format!("--{}", word.trim_end_matches('-')));
        }
    }
    words
}

#[test]
fn report_b6_advice_names_options_that_exist() {
    let mut known: BTreeSet<String> = OF_OTHERS.iter().map(|option| (*option).to_owned()).collect();
    known.extend(["--help".to_owned(), "--version".to_owned()]);
    known.extend(crate::unavailable::OPTIONS.iter().map(|option| (*option).to_owned()));
    options(&Cli::command(), &mut known);
    let mut files = Vec::new();
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for entry in std::fs::read_dir(crates).unwrap() {
        let source = entry.unwrap().path().join("src");
        if source.is_dir() {
            sources(&source, &mut files);
        }
    }
    assert!(files.len() > 100, "only {} files", files.len());
    let mut wrong = Vec::new();
    for file in files.iter().filter(|file| !file.ends_with("tests.rs") && !file.ends_with("advice.rs")) {
        let text = std::fs::read_to_string(file).unwrap();
        // Tests name what must not exist.
        let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
        for (number, line) in text.lines().enumerate() {
            let unknown = words(line).into_iter().filter(|word| !known.contains(word));
            wrong.extend(unknown.map(|word| format!("{}:{}: {word}", file.display(), number + 1)));
        }
    }
    assert!(wrong.is_empty(), "options that do not exist:\n{}", wrong.join("\n"));
}

#[test]
fn options_are_found_in_messages() {
    assert_eq!(words("take `--step 2`, or --clip-plane; a--b - -- x"), ["--step", "--clip-plane"]);
    assert!(words("    // --nothing").is_empty());
}
