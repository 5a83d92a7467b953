//! Temporary files that are being written, so that a process that is told to end can remove them.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// All temporary files of this process.
static UNFINISHED: Mutex<Unfinished> = Mutex::new(Unfinished { files: Vec::new(), ending: false });

struct Unfinished {
    files: Vec<PathBuf>,
    /// If true, no further file may be created.
    ending: bool,
}

fn lock() -> MutexGuard<'static, Unfinished> {
    // The list is whole at any time: a thread that panicked while it held the lock broke nothing.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the files that are being written, and lets no other one begin. For a program that is about to end by a signal:
/// what is being written never appears under its final name.
pub fn remove_unfinished() {
    let mut unfinished = lock();
    unfinished.ending = true;
    for file in unfinished.files.drain(..) {
        // It may have been finished or removed already.
        let _ = std::fs::remove_file(file);
    }
}

/// Keeps a temporary file on the list for as long as this lives.
pub(super) struct Listed(PathBuf);

/// Creates a temporary file and lists it in one step, so that a signal cannot come in between.
pub(super) fn create(
    create: impl FnOnce() -> io::Result<tempfile::NamedTempFile>,
) -> io::Result<(tempfile::NamedTempFile, Listed)> {
    let mut unfinished = lock();
    if unfinished.ending {
        return Err(io::Error::new(io::ErrorKind::Interrupted, "the program is ending"));
    }
    let file = create()?;
    unfinished.files.push(file.path().to_owned());
    let listed = Listed(file.path().to_owned());
    Ok((file, listed))
}

impl Drop for Listed {
    fn drop(&mut self) {
        let path: &Path = &self.0;
        lock().files.retain(|file| file != path);
    }
}
