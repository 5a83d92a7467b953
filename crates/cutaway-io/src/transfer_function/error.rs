//! Why a transfer function was not read or written.

use cutaway_core::transfer_function::TransferFunctionError;

use super::{FunctionFormat, MAX_BYTES, MAX_POINTS};
use crate::atomic::AtomicWriteError;
use crate::json_words;
use crate::text::SAVE_AS_UTF_8;

/// Why a transfer function was not read. Every message is one line and begins with the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FunctionReadError {
    /// The file could not be opened or read.
    #[error("cannot read {file}: {error}")]
    Io {
        /// The file.
        file: String,
        /// What the system said.
        error: std::io::Error,
    },
    /// No colour map of the name asked for.
    #[error("{file}: found no colour map {name}; there are {known}")]
    NoMap {
        /// The file.
        file: String,
        /// The name asked for, quoted.
        name: String,
        /// Names of some of those that there are.
        known: String,
    },
    /// Far more than a transfer function can be.
    #[error("{file}: larger than {MAX_BYTES} bytes; this is not a transfer function")]
    TooLarge {
        /// The file.
        file: String,
    },
    /// Text in an encoding that is not read.
    #[error("{file}: this is {found}; {SAVE_AS_UTF_8}")]
    Encoding {
        /// The file.
        file: String,
        /// The encoding.
        found: &'static str,
    },
    /// None of the formats.
    #[error(
        "{file}: found {found}, expected a transfer function: JSON of cutaway, ParaView or Slicer (.vp.json), or Slicer's .vp"
    )]
    UnknownFormat {
        /// The file.
        file: String,
        /// How it begins, quoted.
        found: String,
    },
    /// Not JSON, or not what the format has; serde's message names field, line and column.
    #[error("{file}: not {}: {}{}", format.article(), json_words::plain(error), format.hint())]
    Json {
        /// The file.
        file: String,
        /// What it was taken for.
        format: FunctionFormat,
        /// Where and why.
        error: serde_json::Error,
    },
    /// A field that is missing, or is not what it should be.
    #[error("{file}: {field}: found {found}, expected {expected}")]
    Field {
        /// The file.
        file: String,
        /// Which field, as the file names it.
        field: String,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },
    /// A line of a text file that is not what it should be.
    #[error("{file}: line {line} ({what}): found {found}, expected {expected}")]
    Line {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What the line holds.
        what: &'static str,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },
    /// The points do not make a transfer function.
    #[error("{file}: {}{error}", if list.is_empty() { String::new() } else { format!("{list}: ") })]
    Function {
        /// The file.
        file: String,
        /// Which list of points, as the file names it; none where there is one.
        list: &'static str,
        /// Which point, and why.
        error: TransferFunctionError,
    },
    /// More points than a function may have, or than its curves take as straight lines.
    #[error("{file}: more than {MAX_POINTS} points, the most a transfer function may have; thin it out")]
    TooManyPoints {
        /// The file.
        file: String,
    },
}

/// Why a transfer function was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FunctionWriteError {
    /// The name says no format.
    #[error(
        "{file}: expected a name that ends in .json (cutaway), .pv.json (ParaView), .vp or .vp.json (Slicer)"
    )]
    Extension {
        /// The file.
        file: String,
    },
    /// The file was not written.
    #[error(transparent)]
    Write(#[from] AtomicWriteError<std::io::Error>),
}
