//! What can be wrong with a volume file, and how it is said: one lower-case line with the file, the place, what was
//! found, what was expected and what to do.

use std::fmt;
use std::io;

use cutaway_core::volume::VolumeError;

use crate::limits::bytes_text;

/// Where in a file something was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Offset from the start of the file (after decompression where the whole file is compressed).
    Byte(u64),
    /// Line of a text header, counted from 1.
    Line(usize),
    /// In no particular place: an option, or the name of the file itself.
    Whole,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(offset) => write!(f, "byte {offset}: "),
            Self::Line(line) => write!(f, "line {line}: "),
            Self::Whole => Ok(()),
        }
    }
}

/// Why a volume could not be read. `file` is the path as given, or the data file that a header names.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file could not be opened.
    #[error("cannot open {file}: {error}{}", hinted(hint))]
    Open {
        /// File that was to be opened.
        file: String,
        /// What the system said.
        error: io::Error,
        /// What to do, or empty.
        hint: &'static str,
    },
    /// Reading failed half-way.
    #[error("{file}: byte {offset}: cannot read: {error}")]
    Io {
        /// File that was read.
        file: String,
        /// How far reading came.
        offset: u64,
        /// What the system said.
        error: io::Error,
    },
    /// A format, or a flavour of a format, that is known but not read.
    #[error("{file}: {found}{}", hinted(hint))]
    Unsupported {
        /// File with it.
        file: String,
        /// What it is and that it is not read.
        found: String,
        /// What is supported, or what to do.
        hint: &'static str,
    },
    /// Nothing tells what the file is.
    #[error("{file}: unknown format: the file begins with {found}{}", hinted(hint))]
    UnknownFormat {
        /// The file.
        file: String,
        /// Its first bytes.
        found: String,
        /// What is supported, and how to describe raw data.
        hint: &'static str,
    },
    /// A field of a header (or an option) has a value that makes no sense.
    #[error("{file}: {place}`{field}` is {found}, expected {expected}{}", hinted(hint))]
    Field {
        /// File with the field.
        file: String,
        /// Where the field is.
        place: Place,
        /// Name of the field as its format writes it.
        field: &'static str,
        /// Its value, quoted.
        found: Box<str>,
        /// What it should be.
        expected: String,
        /// What to do, or empty.
        hint: &'static str,
    },
    /// A line of a text header that is neither field, comment nor key.
    #[error("{file}: line {line}: found {found}, expected {expected}")]
    Syntax {
        /// File with the line.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is there, quoted.
        found: String,
        /// What should be.
        expected: &'static str,
    },
    /// A field that the format requires is not there.
    #[error("{file}: the header has no `{field}`, expected {expected}")]
    MissingField {
        /// File with the header.
        file: String,
        /// Name of the field.
        field: &'static str,
        /// What it would say.
        expected: &'static str,
    },
    /// The file ends before its data or its header do.
    #[error(
        "{file}: found {found} bytes of {what}, expected {expected}; the file is cut short or its header is wrong"
    )]
    TooShort {
        /// The file.
        file: String,
        /// `header`, `data`, ...
        what: &'static str,
        /// Bytes (or numbers, for text) found.
        found: u64,
        /// What was expected, in words.
        expected: String,
    },
    /// The file goes on where it must end.
    #[error("{file}: the file has {found}, expected {expected}{}", hinted(hint))]
    TooLong {
        /// The file.
        file: String,
        /// Bytes found, in words.
        found: String,
        /// What was expected, in words.
        expected: String,
        /// What to do.
        hint: &'static str,
    },
    /// Compressed or textual data cannot be decoded.
    #[error("{file}: byte {offset}: the {encoding} data are damaged: {reason}")]
    Decode {
        /// The file.
        file: String,
        /// Offset in the file up to which the decoder has read.
        offset: u64,
        /// Name of the encoding.
        encoding: &'static str,
        /// What the decoder said, or what was found.
        reason: String,
    },
    /// A volume larger than the limit.
    #[error(
        "{file}: {what} need {}, more than the limit of {}; crop or resample the data first, or take a machine with more memory",
        bytes_text(*needed), bytes_text(*limit)
    )]
    TooLarge {
        /// The file.
        file: String,
        /// What is so large.
        what: String,
        /// Bytes that it needs, saturated.
        needed: u64,
        /// [`Limits::max_bytes`](crate::limits::Limits::max_bytes).
        limit: u64,
    },
    /// The system gives no memory, though the limit would allow it.
    #[error("{file}: no memory for {}; free some or convert the file to a smaller one", bytes_text(*needed))]
    NoMemory {
        /// The file.
        file: String,
        /// Bytes that the voxels need.
        needed: u64,
    },
    /// A header names a data file outside its own folder.
    #[error(
        "{file}: {place}the data file {name} {why}; data files must lie in the header's folder or below: move it there and name it without a path"
    )]
    Outside {
        /// The header.
        file: String,
        /// Where the name is.
        place: Place,
        /// The name, quoted.
        name: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// The volume asked for does not exist.
    #[error("{file}: there is no volume {index}: the file holds {volumes}, numbered from 0")]
    VolumeIndex {
        /// The file.
        file: String,
        /// Index asked for.
        index: usize,
        /// How many there are.
        volumes: u64,
    },
    /// The parts are well-formed but make no volume.
    #[error("{file}: {error}")]
    Volume {
        /// The file.
        file: String,
        /// What the core said.
        error: Box<VolumeError>,
    },
}

/// What to do about colours, vectors and tensors.
pub(crate) const TUPLE_HINT: &str =
    "choose one component with the volume index or convert the file to one with a single number a voxel";

/// A hint as a message ends with it.
pub(crate) fn hinted(hint: &str) -> String {
    if hint.is_empty() { String::new() } else { format!("; {hint}") }
}

/// Text from a file as it may be shown: quoted, escaped, on one line, cut after 60 characters.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().nth(LONGEST).is_some() {
        shown.push_str("...");
    }
    format!("\"{shown}\"")
}

/// A number as it may be shown: never as hundreds of digits.
pub(crate) fn number(value: f64) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-5..1e16).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// A file's name as it may be shown: without control characters.
pub(crate) fn shown_name(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_files_is_shown_on_one_short_line() {
        assert_eq!(quoted("a\n\u{1b}[31mb"), "\"a\\n\\u{1b}[31mb\"");
        assert_eq!(quoted(&"x".repeat(1000)).len(), 65);
        assert_eq!(shown_name("a\nb"), "a\u{fffd}b");
        assert_eq!([1e-300, -2e300, 0.5, 0.0].map(number), ["1e-300", "-2e300", "0.5", "0"]);
    }
}
