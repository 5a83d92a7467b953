//! What a user names a volume by: a file of voxels, one of an unstructured grid, or a sample.
//!
//! Enters: a name, and what was said of it. Leaves: a volume or an unstructured grid.

use std::ffi::OsStr;
use std::fmt;
use std::path::{Path, PathBuf};

use cutaway_core::scene::Data;

use crate::samples::{SampleError, read_sample};
use crate::tetrahedra::{self, TetrahedraReadError, TetrahedraReadOptions, read_tetrahedra};
use crate::volume::{RawOptions, ReadError, ReadOptions, read_volume};

/// What the names of samples begin with.
const SAMPLE: &str = "sample:";

/// What a name stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VolumeName {
    /// The sample of this name, which does not have the prefix `sample:` any more.
    Sample(String),
    /// A file.
    File(PathBuf),
}

impl VolumeName {
    /// What somebody wrote.
    pub fn new(name: &OsStr) -> Self {
        match name.to_str().and_then(|name| name.strip_prefix(SAMPLE)) {
            Some(sample) => Self::Sample(sample.to_owned()),
            None => Self::File(PathBuf::from(name)),
        }
    }

    /// What a file in `folder` says, whose paths begin there.
    pub fn within(folder: &Path, name: &str) -> Self {
        match Self::new(OsStr::new(name)) {
            Self::File(path) => Self::File(folder.join(path)),
            sample => sample,
        }
    }
}

impl fmt::Display for VolumeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sample(name) => write!(f, "{SAMPLE}{name}"),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

/// A volume by its name.
#[derive(Debug)]
pub struct NamedVolume {
    /// A volume or an unstructured grid.
    pub data: Data,
    /// What the reader had to say, one line each.
    pub notices: Vec<String>,
}

/// Why there is no volume of a name.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NamedVolumeError {
    /// No name at all.
    #[error("the name of the volume is empty; give a file or `sample:NAME`")]
    Empty,
    /// A sample is not what raw data are.
    #[error("{name} is no raw file: leave out dims, type, spacing, big-endian and header-bytes")]
    DescribedSample {
        /// The sample.
        name: VolumeName,
    },
    /// Another one than the first was asked of what holds one.
    #[error("{name} holds one {what}: leave out the index of another")]
    OnlyOne {
        /// The sample or file.
        name: VolumeName,
        /// `volume`.
        what: &'static str,
    },
    /// No such sample.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// A file that is no volume, or not a good one.
    #[error(transparent)]
    Volume(#[from] ReadError),
    /// An unstructured grid that is not a good one.
    #[error(transparent)]
    Tetrahedra(#[from] TetrahedraReadError),
}

/// Reads what a name stands for. A file that is described as raw data is never taken for an unstructured grid.
///
/// # Errors
/// What is wrong with the name, with what was said of it, or with the file.
pub fn read_named(name: &VolumeName, options: &ReadOptions) -> Result<NamedVolume, NamedVolumeError> {
    let described = options.raw != RawOptions::default();
    let of_several = options.volume_index.is_some_and(|index| index > 0);
    let only_one = |what| NamedVolumeError::OnlyOne { name: name.clone(), what };
    let loaded = match name {
        VolumeName::Sample(_) if described => {
            return Err(NamedVolumeError::DescribedSample { name: name.clone() });
        }
        VolumeName::Sample(_) if of_several => return Err(only_one("volume")),
        VolumeName::Sample(sample) => read_sample(sample, options)?,
        VolumeName::File(path) if path.as_os_str().is_empty() => return Err(NamedVolumeError::Empty),
        VolumeName::File(path) if !described && tetrahedra::recognize(path) => {
            let options = TetrahedraReadOptions {
                limits: options.limits,
                array: None,
                time_step: options.volume_index,
                nan: options.nan,
            };
            let loaded = read_tetrahedra(path, &options)?;
            return Ok(NamedVolume { data: loaded.value.into(), notices: loaded.notices });
        }
        VolumeName::File(path) => read_volume(path, options)?,
    };
    Ok(NamedVolume { data: loaded.value.into(), notices: loaded.notices })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use cutaway_core::volume::VoxelType;

    fn read(name: &str, options: &ReadOptions) -> Result<NamedVolume, String> {
        read_named(&VolumeName::new(OsStr::new(name)), options).map_err(|e| e.to_string())
    }

    #[test]
    fn names_say_what_they_are() {
        let folder = Path::new("scenes");
        assert_eq!(VolumeName::within(folder, "a.nrrd"), VolumeName::File("scenes/a.nrrd".into()));
        assert_eq!(VolumeName::within(folder, "/a.nrrd"), VolumeName::File("/a.nrrd".into()));
        let sample = VolumeName::within(folder, "sample:sphere:8");
        assert_eq!(sample, VolumeName::Sample("sphere:8".to_owned()));
        assert_eq!(sample.to_string(), "sample:sphere:8");
    }

    #[test]
    fn samples_files_and_grids_are_read() {
        let plain = ReadOptions::default();
        let sample = read("sample:sphere:8", &plain).unwrap();
        assert!(sample.data.volume().is_some_and(|volume| volume.dimensions().x == 8));
        let folder = tempfile::tempdir().unwrap();
        let grid = folder.path().join("grid.vtk");
        let text = "# vtk DataFile Version 3.0\none\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n\
                    0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\n\
                    SCALARS value float 1\nLOOKUP_TABLE default\n0 1 2 3\n";
        std::fs::write(&grid, text).unwrap();
        let name = grid.to_str().unwrap();
        assert!(read(name, &plain).unwrap().data.grid().is_some());
        let second = ReadOptions { volume_index: Some(1), ..plain.clone() };
        let error = read(name, &second).unwrap_err();
        assert!(error.contains("there is no time step 1: the file holds 1"), "{error}");
        // As raw data it is what it is said to be.
        let raw = RawOptions {
            dims: Some([4, 4, 4]),
            voxel_type: Some(VoxelType::U8),
            header_bytes: Some(text.len() as u64 - 64),
            ..RawOptions::default()
        };
        let raw = ReadOptions { raw, ..plain };
        assert!(read(name, &raw).unwrap().data.grid().is_none());
    }

    #[test]
    fn what_does_not_go_together_is_said() {
        let plain = ReadOptions::default();
        assert!(read("", &plain).unwrap_err().contains("is empty"));
        assert!(read("sample:nothing", &plain).unwrap_err().contains(samples::names()[0]));
        let described = RawOptions { dims: Some([2, 2, 2]), ..RawOptions::default() };
        let described = ReadOptions { raw: described, ..plain.clone() };
        assert!(read("sample:sphere", &described).unwrap_err().contains("sample:sphere is no raw file"));
        let second = ReadOptions { volume_index: Some(1), ..plain };
        assert!(read("sample:sphere", &second).unwrap_err().contains("sample:sphere holds one volume"));
    }
}
