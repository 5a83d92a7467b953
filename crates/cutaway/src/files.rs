//! Files in one call: volumes and grids, solids, images.

use std::ffi::OsStr;
use std::path::Path;
use std::sync::Arc;

use cutaway_core::clip::Solid;
use cutaway_core::image::Image;
use cutaway_core::scene::Data;
use cutaway_io::image::{BitDepth, WriteImageError, write_image};
use cutaway_io::named::{NamedVolumeError, VolumeName, read_named};
use cutaway_io::scene_file::ClipSource;
use cutaway_io::solids::{SolidReadError, read_solid as read_source, source_of_file};
use cutaway_io::volume::ReadOptions;
use cutaway_mesh::EventFinder;

/// The reason why a file was not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// A volume or an unstructured grid.
    #[error(transparent)]
    Volume(#[from] NamedVolumeError),
    /// A surface that cuts.
    #[error(transparent)]
    Solid(#[from] SolidReadError),
    /// A path that is not Unicode text.
    #[error("{0}: the name is not Unicode; rename the file")]
    NotUnicode(String),
}

/// Reads a volume or an unstructured grid from a file, or a sample: `sample:NAME`.
///
/// For raw voxels, one volume of several, limits and notices see [`io::named::read_named`](cutaway_io::named::read_named).
///
/// # Errors
/// The file, the place in it, and what is wrong.
pub fn read(name: impl AsRef<OsStr>) -> Result<Data, ReadError> {
    Ok(read_named(&VolumeName::new(name.as_ref()), &ReadOptions::default())?.data)
}

/// Reads a closed surface from a file of a mesh or of spline patches. Holes are closed.
///
/// # Errors
/// The file, and what is wrong; a surface that cannot be closed.
pub fn read_solid(path: impl AsRef<Path>) -> Result<Arc<dyn Solid>, ReadError> {
    let path = path.as_ref();
    let name = path.to_str().ok_or_else(|| ReadError::NotUnicode(path.display().to_string()))?;
    let source: ClipSource = source_of_file(name.to_owned());
    let external = source.external().expect("a file's source is in a file");
    Ok(read_source(external, EventFinder::default())?.solid)
}

/// Saving images.
pub trait SaveImage {
    /// Saves the image, whole or not at all: `.png` with 8 bits, `.exr`, or `.npy`.
    ///
    /// # Errors
    /// A name of another format, or what the system said.
    fn save(&self, path: impl AsRef<Path>) -> Result<(), WriteImageError>;
}

impl SaveImage for Image {
    fn save(&self, path: impl AsRef<Path>) -> Result<(), WriteImageError> {
        write_image(path.as_ref(), self, BitDepth::Eight)
    }
}
