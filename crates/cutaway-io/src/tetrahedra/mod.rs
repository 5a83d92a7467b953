//! Files of unstructured grids: bytes in, [`TetrahedralMesh`] out.
//!
//! | format | read |
//! |---|---|
//! | VTK legacy (`.vtk`, versions 1 to 5) | `DATASET UNSTRUCTURED_GRID`, text and binary |
//! | VTK XML (`.vtu`) | text, base64, appended raw and base64; not compressed, or by zlib, LZ4 or LZMA; several pieces; one of several time steps |
//!
//! The specification is VTK's "file formats" page (<https://docs.vtk.org/en/latest/vtk_file_formats/index.html>). Of a grid's
//! cells tetrahedra are taken as they are; voxels, hexahedra, wedges and pyramids are cut into tetrahedra, each from its
//! corner of the lowest number, so that faces that two cells share are cut alike; cells of higher order are reduced to their
//! corners; what has no volume is left out. The values are data of one component: of the points, else of the cells; the
//! active scalars, else the first, or those that are asked for by name. Not read: polyhedra, `.pvtu`.
//!
//! Nothing is allocated before it is held against the bytes that are there and against the limits.

mod cells;
mod error;
mod grid;
mod legacy;
mod numbers;
#[cfg(test)]
mod tests;
mod vtu;
mod xml;

use std::io::Read;
use std::path::Path;

use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_core::volume::NanMeaning;

pub use error::TetrahedraReadError;
pub use grid::{ArrayInfo, Grid, On};

use crate::files::open_regular;
use crate::limits::Limits;
use crate::text;
use crate::volume::Loaded;
use crate::volume::error::{quoted, shown_name};

/// How to read an unstructured grid.
#[derive(Clone, Debug, Default)]
pub struct TetrahedraReadOptions {
    /// How much memory it may need.
    pub limits: Limits,
    /// Name of the data that are its values; none: those of points before those of cells, the active scalars before
    /// others, and the first that have one component.
    pub array: Option<String>,
    /// Which time step to read of several, from 0; none: the first, with a notice.
    pub time_step: Option<usize>,
    /// How points are shown that have no value (NaN).
    pub nan: NanMeaning,
}

/// The array of flags that say which points and cells are copies of another piece's.
const GHOSTS: &str = "vtkGhostType";

/// Reads the unstructured grid in the file at `path`, as it is rendered.
///
/// # Errors
/// See [`TetrahedraReadError`]: every message names the file, the place, what was found and what was expected. A grid
/// without values is an error; [`read_grid`] reads it.
pub fn read_tetrahedra(
    path: &Path,
    options: &TetrahedraReadOptions,
) -> Result<Loaded<TetrahedralMesh>, TetrahedraReadError> {
    read_grid(path, options)?.into_loaded()
}

/// Reads the unstructured grid in the file at `path`, with values or without.
///
/// # Errors
/// See [`TetrahedraReadError`].
pub fn read_grid(path: &Path, options: &TetrahedraReadOptions) -> Result<Grid, TetrahedraReadError> {
    let file = shown_name(&path.to_string_lossy());
    let open = |error| TetrahedraReadError::Open { file: file.clone(), error };
    let (mut opened, length) = open_regular(path).map_err(open)?;
    let limit = options.limits.max_bytes;
    let too_large =
        |needed| TetrahedraReadError::TooLarge { file: file.clone(), what: "its contents", needed, limit };
    if length > limit {
        return Err(too_large(length));
    }
    let mut bytes = Vec::new();
    // A file may grow meanwhile.
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
    parse(shown_name(name), bytes, options)?.into_loaded()
}

/// Reads an unstructured grid from a file in memory, with values or without; `name` is for messages.
///
/// # Errors
/// As [`read_grid`].
pub fn read_grid_bytes(
    name: &str,
    bytes: &[u8],
    options: &TetrahedraReadOptions,
) -> Result<Grid, TetrahedraReadError> {
    parse(shown_name(name), bytes, options)
}

/// Whether the file at `path` is VTK's, whatever is in it; false where it cannot be read.
pub fn recognize(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = open_regular(path).and_then(|(file, _)| file.take(HEAD).read_to_end(&mut head));
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
        let head = text::without_mark(head);
        if head.starts_with(b"# vtk DataFile Version") {
            return Some(Self::Legacy);
        }
        let text = head.trim_ascii_start();
        let begins = text.starts_with(b"<?xml") || text.starts_with(b"<VTKFile") || text.starts_with(b"<!--");
        let grid = &b"UnstructuredGrid"[..];
        (begins && text.windows(grid.len()).any(|window| window == grid)).then_some(Self::Xml)
    }
}

fn parse(file: String, bytes: &[u8], options: &TetrahedraReadOptions) -> Result<Grid, TetrahedraReadError> {
    if let Some(found) = text::foreign(bytes) {
        return Err(TetrahedraReadError::Encoding { file, found });
    }
    let head = &bytes[..bytes.len().min(HEAD as usize)];
    let wanted = grid::Wanted::new(options.array.clone());
    let parsed = match Format::of(head) {
        Some(Format::Legacy) => legacy::read(&file, bytes, options, &wanted)?,
        Some(Format::Xml) => vtu::read(&file, bytes, options, &wanted)?,
        None => {
            let found = match &head[..head.len().min(40)] {
                [] => "nothing".to_owned(),
                head => quoted(&String::from_utf8_lossy(head)),
            };
            return Err(TetrahedraReadError::UnknownFormat { file, found });
        }
    };
    Ok(Grid::new(file, parsed, wanted, options))
}
