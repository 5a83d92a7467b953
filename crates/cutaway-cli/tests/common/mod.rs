//! Runs the program as a user does, and says what every run must hold to.
#![allow(dead_code, reason = "each test file uses a part of it")]

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Stdio};

use cutaway_core::image::Image;

/// What a run left behind.
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) out: Vec<u8>,
    pub(crate) err: String,
    line: String,
}

/// A command that runs in `folder`, where nobody listens or types.
pub(crate) fn command(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cutaway"));
    command.current_dir(folder).stdin(Stdio::null()).env("RUST_BACKTRACE", "1");
    // As over ssh, in a container or a batch job: drivers must find nothing to say about it.
    command.env_remove("XDG_RUNTIME_DIR");
    // No test opens a window on somebody's desktop.
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(name);
    }
    command
}

/// Runs `cutaway` with these arguments.
pub(crate) fn cutaway<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Run {
    let output = command(folder).args(arguments).output().expect("the program starts");
    let words: Vec<_> = arguments.iter().map(|a| a.as_ref().to_string_lossy()).collect();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    let line = words.join(" ");
    assert!(!err.contains("panicked") && !err.contains("backtrace"), "{line}\n{err}");
    Run { code: output.status.code().expect("no signal ended it"), out: output.stdout, err, line }
}

/// Runs `cutaway` with arguments separated by blanks.
pub(crate) fn run(folder: &Path, line: &str) -> Run {
    cutaway(folder, &line.split_whitespace().collect::<Vec<_>>())
}

impl Run {
    /// It did what was asked; returns what it printed.
    #[track_caller]
    pub(crate) fn succeeds(self) -> String {
        assert_eq!(self.code, 0, "{}\n{}", self.line, self.err);
        String::from_utf8_lossy(&self.out).into_owned()
    }

    /// As [`succeeds`](Self::succeeds), and it had nothing to remark.
    #[track_caller]
    pub(crate) fn succeeds_silently(self) -> String {
        assert_eq!(self.err, "", "{}", self.line);
        self.succeeds()
    }

    /// It ended with `code` (1: failed, 2: wrong use) and one line on standard error that holds each of `says`.
    #[track_caller]
    pub(crate) fn fails(self, code: i32, says: &[&str]) {
        let Self { err, line, .. } = &self;
        assert_eq!(self.code, code, "{line}\n{err}");
        assert!(err.ends_with('\n') && err.lines().count() == 1, "not one line: {line}\n{err}");
        let message = err.strip_prefix("error: ").unwrap_or_else(|| panic!("{line}\n{err}"));
        assert!(!message.starts_with(char::is_uppercase), "{line}\n{err}");
        for part in says {
            assert!(err.contains(part), "{line}\nmissing: {part}\n{err}");
        }
        assert_eq!(self.out, b"", "{line}");
    }
}

/// An image file, decoded.
#[track_caller]
pub(crate) fn image(path: impl AsRef<Path>) -> Image {
    cutaway_io::image::read_image(path.as_ref()).unwrap_or_else(|e| panic!("{e}"))
}

/// Names of the files in a folder, sorted.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// An attached NRRD file of little-endian voxels.
pub(crate) fn nrrd(dims: [usize; 3], kind: &str, voxels: &[u8]) -> Vec<u8> {
    let [x, y, z] = dims;
    let header = format!(
        "NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {x} {y} {z}\nencoding: raw\nendian: little\n\n"
    );
    [header.as_bytes(), voxels].concat()
}
