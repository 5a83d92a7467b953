//! Output files that appear whole or not at all.
//!
//! What enters: a path and a function that writes the content. What leaves: the complete file under that path, or an error
//! that names the path and the file that was there before, untouched. The content goes to a temporary file in the same
//! folder (a rename is atomic only within one file system), is flushed and synced, and takes the final name in one step.
//! The temporary file is removed on every error and on a panic of the writer; a program that ends by a signal calls
//! [`remove_unfinished`] before it does.
//!
//! What a rename would break is written to directly: devices, FIFOs and sockets, and everything named under `/proc` or
//! directly in `/dev`, such as `/dev/stdout`, which may well stand for a regular file.

use std::{
    fmt,
    fs::{self, File, OpenOptions},
    io::{self, BufWriter},
    path::{Path, PathBuf},
};

mod unfinished;

pub use unfinished::remove_unfinished;

/// Links to follow before a chain counts as a loop; what Linux allows.
const MAX_LINKS: usize = 40;

/// Why a file was not written; `E` is what the writer of the content fails with.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AtomicWriteError<E: fmt::Display> {
    /// The path names nothing that can be a file.
    #[error("cannot write '{}': {problem}", path.display())]
    Target {
        /// The path as given.
        path: PathBuf,
        /// What is wrong with it and what to do.
        problem: String,
    },
    /// The file system refused.
    #[error("cannot write '{}': {action}: {error}", path.display())]
    Io {
        /// The path as given.
        path: PathBuf,
        /// What was being done.
        action: &'static str,
        /// What the system said.
        error: io::Error,
    },
    /// The writer of the content failed.
    #[error("cannot write '{}': {error}", path.display())]
    Content {
        /// The path as given.
        path: PathBuf,
        /// What the writer said.
        error: E,
    },
}

/// Writes a file so that it appears whole or not at all.
///
/// `write` fills the buffered file; it need not flush. A new file has the permissions that any new file gets, a replaced
/// one keeps its own. A symbolic link stays and the file that it names is replaced.
pub fn write_atomically<T, E: fmt::Display>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<T, E>,
) -> Result<T, AtomicWriteError<E>> {
    let target = resolve(path).map_err(|problem| problem.at(path))?;
    match target {
        Target::Direct(file) => write_content(path, file, write).map(|(value, _)| value),
        Target::Replace { file, folder, permissions } => {
            replace(path, &file, &folder, permissions.as_ref(), write)
        }
    }
}

/// Where the bytes go.
enum Target {
    /// Into an open file that must not be replaced.
    Direct(File),
    /// Into a temporary file in `folder` that becomes `file`; `permissions` are those of the file that is there.
    Replace { file: PathBuf, folder: PathBuf, permissions: Option<fs::Permissions> },
}

/// An error before it is given the path.
enum Problem {
    Target(String),
    Io(&'static str, io::Error),
}

impl Problem {
    fn at<E: fmt::Display>(self, path: &Path) -> AtomicWriteError<E> {
        let path = path.to_owned();
        match self {
            Self::Target(problem) => AtomicWriteError::Target { path, problem },
            Self::Io(action, error) => AtomicWriteError::Io { path, action, error },
        }
    }
}

fn replace<T, E: fmt::Display>(
    path: &Path,
    file: &Path,
    folder: &Path,
    permissions: Option<&fs::Permissions>,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<T, E>,
) -> Result<T, AtomicWriteError<E>> {
    let io = |action| move |error| Problem::Io(action, error).at(path);
    let created = unfinished::create(|| temporary_file(folder));
    // Dropped last: the file is on the list for as long as it is there.
    let (temporary, _listed) = created.map_err(io("creating a temporary file beside it"))?;
    let (temporary, temporary_path) = temporary.into_parts();
    let (value, temporary) = write_content(path, temporary, write)?;
    if let Some(permissions) = permissions {
        temporary.set_permissions(permissions.clone()).map_err(io("setting its permissions"))?;
    }
    temporary.sync_all().map_err(io("syncing it to the disk"))?;
    // Windows renames no open file.
    drop(temporary);
    temporary_path
        .persist(file)
        .map_err(|refused| Problem::Io("giving the finished file its name", refused.error).at(path))?;
    sync_folder(folder);
    Ok(value)
}

/// Runs the writer on a file and flushes it.
fn write_content<T, E: fmt::Display>(
    path: &Path,
    file: File,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<T, E>,
) -> Result<(T, File), AtomicWriteError<E>> {
    let mut buffered = BufWriter::with_capacity(1 << 16, file);
    let value =
        write(&mut buffered).map_err(|error| AtomicWriteError::Content { path: path.to_owned(), error })?;
    let flushed = buffered.into_inner().map_err(io::IntoInnerError::into_error);
    let file = flushed.map_err(|error| Problem::Io("writing", error).at(path))?;
    Ok((value, file))
}

/// Finds out what a path stands for, following symbolic links one by one: a link may lead to a device.
fn resolve(path: &Path) -> Result<Target, Problem> {
    let mut file = path.to_owned();
    for _ in 0..MAX_LINKS {
        let folder = folder_of(&file)?;
        if holds_devices(&folder) {
            return open_directly(&file);
        }
        match fs::symlink_metadata(&file) {
            Ok(found) if found.is_symlink() => {
                let to = fs::read_link(&file).map_err(|e| Problem::Io("following the link", e))?;
                file = folder.join(to);
            }
            Ok(found) if found.is_dir() => return Err(is_folder()),
            Ok(found) if found.is_file() && found.permissions().readonly() => {
                return Err(Problem::Target("the file that is there is read-only".into()));
            }
            Ok(found) if found.is_file() => {
                let permissions = Some(found.permissions());
                return Ok(Target::Replace { file, folder, permissions });
            }
            Ok(_special) => return open_directly(&file),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Ok(Target::Replace { file, folder, permissions: None });
            }
            Err(error) => return Err(Problem::Io("looking at what is there", error)),
        }
    }
    Err(Problem::Target(format!("more than {MAX_LINKS} symbolic links follow one another")))
}

/// The existing folder that a file is, or would be, in; canonical.
fn folder_of(file: &Path) -> Result<PathBuf, Problem> {
    if file.as_os_str().is_empty() {
        return Err(Problem::Target("the path is empty; give a file name".into()));
    }
    let slash_last =
        file.as_os_str().as_encoded_bytes().last().is_some_and(|&b| std::path::is_separator(b.into()));
    let (Some(_), Some(parent), false) = (file.file_name(), file.parent(), slash_last) else {
        return Err(is_folder());
    };
    let folder = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    match fs::canonicalize(folder) {
        Ok(found) if found.is_dir() => Ok(found),
        Ok(_) => Err(Problem::Target(format!("'{}' is not a folder", folder.display()))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(Problem::Target(format!("the folder '{}' does not exist; create it first", folder.display())))
        }
        Err(error) => Err(Problem::Io("looking for its folder", error)),
    }
}

fn is_folder() -> Problem {
    Problem::Target("it is a folder; give the name of a file in it".into())
}

/// Whether a folder's entries stand for something else than files in it. Files in `/dev/shm` are files.
fn holds_devices(folder: &Path) -> bool {
    cfg!(unix) && (folder == Path::new("/dev") || folder.starts_with("/proc"))
}

/// Opens what must not be replaced. Appending does not matter to devices and pipes, and where `/dev/stdout` stands for
/// a file it keeps what is in it; the shell has emptied it where that was asked for.
fn open_directly(file: &Path) -> Result<Target, Problem> {
    match OpenOptions::new().append(true).open(file) {
        Ok(file) => Ok(Target::Direct(file)),
        Err(error) if file.is_dir() => {
            drop(error);
            Err(is_folder())
        }
        Err(error) => Err(Problem::Io("opening it", error)),
    }
}

/// A file under a temporary name with the permissions of a newly created one.
fn temporary_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".cutaway-").suffix(".tmp");
    #[cfg(unix)]
    {
        // The file creation mask applies to it, as to any other file.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// Makes the new name itself last. The file is whole either way, and not every file system can do it: no error.
fn sync_folder(folder: &Path) {
    if cfg!(unix)
        && let Ok(folder) = File::open(folder)
    {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests;
