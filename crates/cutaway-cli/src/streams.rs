//! Standard output and standard error as files, so that a failure to write shows.
//!
//! Two layers hide it otherwise. The runtime opens `/dev/null` in place of a stream that is closed when the program
//! begins, and `std::io::stdout()` says nothing of a descriptor that cannot be written.

use std::io::{self, Write};

use crate::environment;

/// A stream that results are written to.
pub(crate) enum Stream {
    Output,
    Error,
}

impl Stream {
    /// The stream, ready to be written.
    ///
    /// # Errors
    /// It was closed when the program began.
    pub(crate) fn open(&self) -> io::Result<Box<dyn Write>> {
        let descriptor = match self {
            Self::Output => 1,
            Self::Error => 2,
        };
        if environment::was_closed(descriptor) {
            return Err(io::Error::new(io::ErrorKind::NotConnected, "it is closed"));
        }
        self.file()
    }

    #[cfg(unix)]
    fn file(&self) -> io::Result<Box<dyn Write>> {
        use std::os::fd::AsFd;
        let copy = match self {
            Self::Output => io::stdout().as_fd().try_clone_to_owned(),
            Self::Error => io::stderr().as_fd().try_clone_to_owned(),
        };
        Ok(Box::new(std::fs::File::from(copy?)))
    }

    #[cfg(not(unix))]
    fn file(&self) -> io::Result<Box<dyn Write>> {
        Ok(match self {
            Self::Output => Box::new(io::stdout()),
            Self::Error => Box::new(io::stderr()),
        })
    }
}
