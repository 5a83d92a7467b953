//! Files of unstructured grids: bytes in, [`TetrahedralMesh`] out.
//!
//! | format | read |
//! |---|---|
//! | VTK legacy (`.vtk`, versions 1 to 5) | `DATASET UNSTRUCTURED_GRID`, text and binary |
//! | VTK XML (`.vtu`) | text, base64, appended raw and base64; not compressed or by zlib; several pieces |
//!
//! The specification is VTK's "file formats" page (<https://docs.vtk.org/en/latest/vtk_file_formats/index.html>). Of a grid's
//! cells tetrahedra are taken as they are; voxels, hexahedra, wedges and pyramids are cut into tetrahedra, each from its
//! corner of the lowest number, so that faces that two cells share are cut alike; quadratic cells are taken by their corners;
//! what has no volume is left out. The value is the point data that has one component: the active scalars, or the first, or
//! the one that is asked for by name. Not read: polyhedra, cell data, time steps, `.pvtu`, compression other than zlib.
//!
//! Nothing is allocated before it is held against the bytes that are there and against the limits.

mod cells;
mod error;
mod legacy;
mod numbers;
#[cfg(test)]
mod tests;
mod vtu;
mod xml;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use cutaway_core::glam::DVec3;
use cutaway_core::tetrahedra::TetrahedralMesh;

pub use error::TetrahedraReadError;

use crate::limits::Limits;
use crate::volume::error::{quoted, shown_name};
use crate::volume::{Loaded, loss_notice};

/// How to read an unstructured grid.
#[derive(Clone, Debug, Default)]
pub struct TetrahedraReadOptions {
    /// How much memory it may need.
    pub limits: Limits,
    /// Name of the point data that are its values; none: the active scalars, or the first that have one component.
    pub array: Option<String>,
}

/// A grid as its file has it.
#[derive(Debug, Default)]
struct Parsed {
    points: Vec<DVec3>,
    cells: cells::Tetrahedra,
    values: Vec<f64>,
    notices: Vec<String>,
}

/// Reads the unstructured grid in the file at `path`.
///
/// # Errors
/// See [`TetrahedraReadError`]: every message names the file, the place, what was found and what was expected.
pub fn read_tetrahedra(
    path: &Path,
    options: &TetrahedraReadOptions,
) -> Result<Loaded<TetrahedralMesh>, TetrahedraReadError> {
    let file = shown_name(&path.to_string_lossy());
    let open = |error| TetrahedraReadError::Open { file: file.clone(), error };
    let mut opened = File::open(path).map_err(open)?;
    let length = opened.metadata().map_err(open)?.len();
    let limit = options.limits.max_bytes;
    let too_large =
        |needed| TetrahedraReadError::TooLarge { file: file.clone(), what: "its contents", needed, limit };
    if length > limit {
        return Err(too_large(length));
    }
    let mut bytes = Vec::new();
    // A pipe has no length.
    (&mut opened).take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(open)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    parse(file, &bytes, options)
}

/// Reads an unstructured grid from a file in memory; `name` is for messages.
///
/// # Errors
/// As [`read_tetrahedra`].
pub fn read_tetrahedra_bytes(
    name: &str,
    bytes: &[u8],
    options: &TetrahedraReadOptions,
) -> Result<Loaded<TetrahedralMesh>, TetrahedraReadError> {
    parse(shown_name(name), bytes, options)
}

/// Whether the file at `path` is VTK's, whatever is in it; false where it cannot be read.
pub fn recognize(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.is_ok() && Format::of(&head).is_some()
}

/// Bytes that tell what a file is.
const HEAD: u64 = 4096;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Legacy,
    Xml,
}

impl Format {
    fn of(head: &[u8]) -> Option<Self> {
        if head.starts_with(b"# vtk DataFile Version") {
            return Some(Self::Legacy);
        }
        let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
        let begins = text.starts_with(b"<?xml") || text.starts_with(b"<VTKFile") || text.starts_with(b"<!--");
        let grid = &b"UnstructuredGrid"[..];
        (begins && text.windows(grid.len()).any(|window| window == grid)).then_some(Self::Xml)
    }
}

fn parse(
    file: String,
    bytes: &[u8],
    options: &TetrahedraReadOptions,
) -> Result<Loaded<TetrahedralMesh>, TetrahedraReadError> {
    let head = &bytes[..bytes.len().min(HEAD as usize)];
    let parsed = match Format::of(head) {
        Some(Format::Legacy) => legacy::read(&file, bytes, options)?,
        Some(Format::Xml) => vtu::read(&file, bytes, options)?,
        None => {
            let found = match &head[..head.len().min(40)] {
                [] => "nothing".to_owned(),
                head => quoted(&String::from_utf8_lossy(head)),
            };
            return Err(TetrahedraReadError::UnknownFormat { file, found });
        }
    };
    let mut notices = parsed.notices;
    notices.extend(parsed.cells.notices());
    let replaced = parsed.values.iter().filter(|value| !value.is_finite()).count();
    if replaced > 0 {
        notices.push(format!("{replaced} values were not finite and are replaced"));
    }
    match TetrahedralMesh::new(parsed.points, parsed.cells.corners, parsed.values) {
        Ok(value) => {
            notices.extend(loss_notice(value.lattice()));
            Ok(Loaded { value, notices })
        }
        Err(error) => Err(TetrahedraReadError::Mesh { file, error }),
    }
}
