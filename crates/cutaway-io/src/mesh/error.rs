//! What can be wrong with a mesh file, said as the readers of volumes say it.

use std::io;

use cutaway_mesh::MeshError;

use crate::limits::bytes_text;
use crate::volume::Place;
use crate::volume::error::hinted;

/// Why a mesh could not be read. `file` is the path as given, or the buffer that a glTF file names.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshReadError {
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
    /// Reading failed half-way, or compressed data are damaged.
    #[error("{file}: byte {offset}: cannot read: {error}")]
    Io {
        /// File that was read.
        file: String,
        /// How far reading came (after decompression).
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
    #[error(
        "{file}: not a mesh: the file begins with {found}; supported are PLY (.ply), STL (.stl), OBJ (.obj) and glTF \
         (.gltf, .glb)"
    )]
    UnknownFormat {
        /// The file.
        file: String,
        /// Its first bytes, quoted.
        found: String,
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
    /// A field of a glTF file has a value that makes no sense.
    #[error("{file}: `{field}` is {found}, expected {expected}")]
    Field {
        /// The file.
        file: String,
        /// The field, from the root of the file.
        field: String,
        /// Its value.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// Not JSON, or not what glTF has there; serde's message names line and column.
    #[error("{file}: not glTF: {error}")]
    Json {
        /// The file.
        file: String,
        /// Where and why.
        error: serde_json::Error,
    },
    /// A face names a vertex that is not there.
    #[error(
        "{file}: {place}a face names vertex {found}, but the file has {vertices}, numbered from {first}; its faces or \
         its vertices are damaged"
    )]
    Index {
        /// The file.
        file: String,
        /// Where the name is.
        place: Place,
        /// The vertex that it names.
        found: i64,
        /// How many there are.
        vertices: u64,
        /// Number of the first one.
        first: u32,
    },
    /// A coordinate is NaN or infinite, or larger than 32-bit floats can be.
    #[error("{file}: {place}a coordinate is {found}, expected a finite 32-bit number; mend the file")]
    NotFinite {
        /// The file.
        file: String,
        /// Where.
        place: Place,
        /// The coordinate.
        found: String,
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
        /// What was expected, in words.
        expected: String,
    },
    /// A mesh larger than the limit.
    #[error(
        "{file}: {what} need {}, more than the limit of {}; simplify the mesh, or use a machine with more memory",
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
    /// A glTF file names a buffer outside its own folder.
    #[error(
        "{file}: `{field}`: the buffer {name} {why}; buffers must lie in the file's folder or below: move it there and \
         name it without a path"
    )]
    Outside {
        /// The file.
        file: String,
        /// The field that names it.
        field: String,
        /// The name, quoted.
        name: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// The parts are well-formed but make no mesh.
    #[error("{file}: {error}")]
    Mesh {
        /// The file.
        file: String,
        /// What is wrong.
        error: MeshError,
    },
}
