//! The entry of a scene file that names its volume.

use cutaway_core::volume::VoxelType;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::volume::{RawOptions, UnknownVoxelType};

/// Where a scene file finds its volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum VolumeReference {
    /// A path, relative to the scene file, or `sample:NAME`.
    Path(String),
    /// A raw file with what its name does not tell.
    Described(RawVolumeReference),
}

/// A volume file with a description of its bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawVolumeReference {
    /// Path, relative to the scene file.
    pub path: String,
    /// World units a voxel along x, y, z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spacing: Option<[f64; 3]>,
    /// Voxels along x, y, z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dims: Option<[u32; 3]>,
    /// `uint8`, `int16`, `float32`, ...
    #[serde(default, rename = "type", skip_serializing_if = "Option::is_none")]
    pub voxel_type: Option<String>,
    /// Whether the most significant byte comes first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub big_endian: Option<bool>,
    /// Bytes before the first voxel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub header_bytes: Option<u64>,
}

impl VolumeReference {
    /// Returns the path, as the file has it, or `sample:NAME`.
    pub fn path(&self) -> &str {
        match self {
            Self::Path(path) => path,
            Self::Described(described) => &described.path,
        }
    }

    /// Returns the same reference with another path.
    #[must_use]
    pub fn with_path(&self, path: String) -> Self {
        match self {
            Self::Path(_) => Self::Path(path),
            Self::Described(described) => Self::Described(RawVolumeReference { path, ..described.clone() }),
        }
    }

    /// Returns true if it names a sample, which has no path.
    pub fn is_sample(&self) -> bool {
        self.path().starts_with("sample:")
    }

    /// Returns what it says of raw data; nothing where it is a path alone.
    ///
    /// # Errors
    /// A name that is not a voxel type.
    pub fn raw_options(&self) -> Result<RawOptions, UnknownVoxelType> {
        let Self::Described(described) = self else { return Ok(RawOptions::default()) };
        let unknown = |name: &String| UnknownVoxelType { name: name.clone() };
        let voxel_type = described.voxel_type.as_ref();
        let voxel_type =
            voxel_type.map(|name| VoxelType::from_name(name).ok_or_else(|| unknown(name))).transpose()?;
        let RawVolumeReference { dims, spacing, big_endian, header_bytes, .. } = *described;
        Ok(RawOptions { dims, voxel_type, spacing, big_endian, header_bytes })
    }

    /// Returns a reference to `path`, with a description where `raw` holds one.
    pub fn of_raw(path: String, raw: &RawOptions) -> Self {
        if *raw == RawOptions::default() {
            return Self::Path(path);
        }
        let RawOptions { dims, voxel_type, spacing, big_endian, header_bytes } = *raw;
        let voxel_type = voxel_type.map(|t| t.name().to_owned());
        Self::Described(RawVolumeReference { path, spacing, dims, voxel_type, big_endian, header_bytes })
    }
}
