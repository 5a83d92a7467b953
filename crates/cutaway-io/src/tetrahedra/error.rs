//! What can be wrong with a file of an unstructured grid, said as the readers of volumes say it.

use std::io;

use cutaway_core::tetrahedra::TetrahedraError;

use crate::limits::bytes_text;
use crate::text::SAVE_AS_UTF_8;
use crate::volume::Place;

/// Why an unstructured grid could not be read. `file` is the path as given.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TetrahedraReadError {
    /// The file could not be opened or read.
    #[error("cannot read {file}: {error}")]
    Open {
        /// The file.
        file: String,
        /// What the system said.
        error: io::Error,
    },
    /// Text in an encoding that is not read.
    #[error("{file}: this is {found}; {SAVE_AS_UTF_8}")]
    Encoding {
        /// The file.
        file: String,
        /// The encoding.
        found: &'static str,
    },
    /// Nothing tells what the file is.
    #[error(
        "{file}: not an unstructured grid: the file begins with {found}; supported are VTK legacy (.vtk) and VTK XML (.vtu)"
    )]
    UnknownFormat {
        /// The file.
        file: String,
        /// Its first bytes, quoted.
        found: String,
    },
    /// A flavour of a format that is known but not read.
    #[error("{file}: {found}; supported are {supported}")]
    Unsupported {
        /// The file.
        file: String,
        /// What it has that is not read.
        found: String,
        /// What is.
        supported: &'static str,
    },
    /// Something is there that does not belong there.
    #[error("{file}: {place}found {found}, expected {expected}")]
    Syntax {
        /// The file.
        file: String,
        /// Where.
        place: Place,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },
    /// A cell that is none.
    #[error("{file}: cell {cell}: found {found}, expected {expected}")]
    Cell {
        /// The file.
        file: String,
        /// Which cell, from 0.
        cell: usize,
        /// What is there.
        found: String,
        /// What should be.
        expected: String,
    },
    /// The file ends before its data do.
    #[error(
        "{file}: found {found} bytes of {what}, expected {expected}; the file is cut short or its header is wrong"
    )]
    TooShort {
        /// The file.
        file: String,
        /// What is missing.
        what: String,
        /// Bytes found.
        found: u64,
        /// Bytes expected, in words.
        expected: String,
    },
    /// A grid larger than the limit.
    #[error(
        "{file}: {what} need {}, more than the limit of {}; take a smaller grid, or a machine with more memory",
        bytes_text(*needed), bytes_text(*limit)
    )]
    TooLarge {
        /// The file.
        file: String,
        /// What is so large.
        what: &'static str,
        /// Bytes that it needs, saturated.
        needed: u64,
        /// [`Limits::max_bytes`](crate::limits::Limits::max_bytes).
        limit: u64,
    },
    /// No data that could be the values.
    #[error("{file}: the grid has points and cells, but no values to show: found {found}, expected {wanted}")]
    NoValues {
        /// The file.
        file: String,
        /// What data there are.
        found: String,
        /// What was looked for.
        wanted: String,
    },
    /// The time step asked for does not exist.
    #[error("{file}: there is no time step {index}: the file holds {steps}, numbered from 0")]
    TimeStep {
        /// The file.
        file: String,
        /// Index asked for.
        index: usize,
        /// How many there are.
        steps: usize,
    },
    /// The parts are well-formed but make no grid.
    #[error("{file}: {error}")]
    Mesh {
        /// The file.
        file: String,
        /// What is wrong.
        error: TetrahedraError,
    },
}
