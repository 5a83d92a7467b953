//! Opening the files that a user names, so that no name can make the program wait.
//!
//! Opening a named pipe waits until another program opens its other end, and a device may never end. Both are therefore
//! looked at before they are opened. A pipe that this process already holds (`/dev/stdin`, or what a shell passes for
//! `<(command)`) has its other end, so that what is read once, from start to end, can be read from it.

use std::fs::{File, Metadata};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Opens a regular file. Returns the file and its length in bytes.
///
/// # Errors
/// What the system said, or the kind of thing that is not a regular file: a folder, a named pipe, a device, a socket.
pub(crate) fn open_regular(path: &Path) -> io::Result<(File, u64)> {
    let found = path.metadata().map_err(plain)?;
    if !found.is_file() {
        return Err(refusal(&found));
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    Ok((file, length))
}

/// Opens what is read once from start to end: a regular file, or a pipe that this process already holds.
///
/// # Errors
/// As [`open_regular`].
pub(crate) fn open_once(path: &Path) -> io::Result<File> {
    let found = path.metadata().map_err(plain)?;
    if found.is_file() || is_fifo(&found) && is_descriptor(path) {
        return File::open(path);
    }
    Err(refusal(&found))
}

/// The system's words for a missing file, without their number.
fn plain(error: io::Error) -> io::Error {
    match error.kind() {
        ErrorKind::NotFound => io::Error::new(ErrorKind::NotFound, "no such file"),
        _ => error,
    }
}

fn refusal(found: &Metadata) -> io::Error {
    if found.is_dir() {
        return io::Error::new(ErrorKind::IsADirectory, "it is a folder");
    }
    let what = kind(found);
    io::Error::new(
        ErrorKind::InvalidInput,
        format!("it is {what}, not a regular file; save its contents to a file and name that file"),
    )
}

#[cfg(unix)]
fn kind(found: &Metadata) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    let kind = found.file_type();
    if kind.is_fifo() {
        "a named pipe (FIFO)"
    } else if kind.is_socket() {
        "a socket"
    } else if kind.is_char_device() || kind.is_block_device() {
        "a device"
    } else {
        "something else"
    }
}

#[cfg(not(unix))]
fn kind(_: &Metadata) -> &'static str {
    "something else"
}

#[cfg(unix)]
fn is_fifo(found: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    found.file_type().is_fifo()
}

#[cfg(not(unix))]
fn is_fifo(_: &Metadata) -> bool {
    false
}

/// True if a path names a file descriptor of this process, possibly through links such as `/dev/stdin`. The last link is
/// not followed: what `/proc/self/fd/0` links to may be a named pipe.
fn is_descriptor(path: &Path) -> bool {
    const MOST_LINKS: usize = 8;
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let folder = match path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            Some(parent) => parent.canonicalize(),
            None => PathBuf::from(".").canonicalize(),
        };
        let Ok(folder) = folder else { return false };
        if folder.ends_with("fd") && (folder.starts_with("/proc") || folder.starts_with("/dev")) {
            return true;
        }
        match std::fs::read_link(&path) {
            Ok(to) => path = folder.join(to),
            Err(_) => return false,
        }
    }
    false
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::io::Read;
    use std::process::Command;

    fn fifo(folder: &Path) -> PathBuf {
        let path = folder.join("pipe");
        assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
        path
    }

    #[test]
    fn pipes_with_a_name_are_refused_before_they_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let path = fifo(folder.path());
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        for path in [&path, &link] {
            for error in [open_regular(path).unwrap_err(), open_once(path).unwrap_err()] {
                assert!(error.to_string().contains("named pipe"), "{error}");
            }
        }
        let error = open_once(Path::new("/dev/null")).unwrap_err();
        assert!(error.to_string().contains("a device"), "{error}");
        assert_eq!(open_once(folder.path()).unwrap_err().kind(), ErrorKind::IsADirectory);
    }

    #[test]
    fn pipes_that_are_open_already_are_read() {
        if !cfg!(target_os = "linux") {
            return;
        }
        use std::io::Write;
        use std::os::fd::AsRawFd;
        let (reader, mut writer) = io::pipe().unwrap();
        writer.write_all(b"text").unwrap();
        drop(writer);
        let path = PathBuf::from(format!("/dev/fd/{}", reader.as_raw_fd()));
        let mut text = String::new();
        open_once(&path).unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "text");
        assert!(open_regular(&path).is_err());
    }
}
