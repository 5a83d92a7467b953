//! The entry of a scene file that names its volume.

use std::fmt;

use cutaway_core::volume::VoxelType;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use crate::volume::{RawOptions, ReadOptions, UnknownVoxelType};

/// Where a scene file finds its volume.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum VolumeReference {
    /// A path, relative to the scene file, or `sample:NAME`.
    Path(String),
    /// A file with what its name does not tell: a description of raw voxels, the index of a volume.
    Described(RawVolumeReference),
}

/// A volume file with a description of its bytes, or with the index of one of its volumes.
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
    /// Index of the volume in a file of several (a time series), from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume_index: Option<usize>,
}

// Derived, it would forget where an error is.
impl<'de> Deserialize<'de> for VolumeReference {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ReferenceVisitor;
        impl<'de> Visitor<'de> for ReferenceVisitor {
            type Value = VolumeReference;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a path, `sample:NAME`, or an object with `path` and what the file does not say")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<VolumeReference, E> {
                Ok(VolumeReference::Path(text.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<VolumeReference, A::Error> {
                RawVolumeReference::deserialize(MapAccessDeserializer::new(map))
                    .map(VolumeReference::Described)
            }
        }
        deserializer.deserialize_any(ReferenceVisitor)
    }
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

    /// Returns the same reference to another volume of its file.
    #[must_use]
    pub fn with_volume_index(&self, volume_index: Option<usize>) -> Self {
        let options = ReadOptions { volume_index, ..ReadOptions::default() };
        match self {
            Self::Path(path) => Self::with_options(path.clone(), &options),
            Self::Described(described) => {
                Self::Described(RawVolumeReference { volume_index, ..described.clone() })
            }
        }
    }

    /// Returns true if it names a sample, which has no path.
    pub fn is_sample(&self) -> bool {
        self.path().starts_with("sample:")
    }

    /// Returns what it says of the file, within the default limits; nothing where it is a path alone.
    ///
    /// # Errors
    /// A name that is not a voxel type.
    pub fn read_options(&self) -> Result<ReadOptions, UnknownVoxelType> {
        let Self::Described(described) = self else { return Ok(ReadOptions::default()) };
        let unknown = |name: &String| UnknownVoxelType { name: name.clone() };
        let voxel_type = described.voxel_type.as_ref();
        let voxel_type =
            voxel_type.map(|name| VoxelType::from_name(name).ok_or_else(|| unknown(name))).transpose()?;
        let RawVolumeReference { dims, spacing, big_endian, header_bytes, volume_index, .. } = *described;
        let raw = RawOptions { dims, voxel_type, spacing, big_endian, header_bytes };
        Ok(ReadOptions { raw, volume_index, ..ReadOptions::default() })
    }

    /// Returns a reference to `path`, with whatever `options` say of the file.
    pub fn with_options(path: String, options: &ReadOptions) -> Self {
        // The first volume is what a path alone means, too; but of colours and vectors only an index chooses one.
        if options.raw == RawOptions::default() && options.volume_index.is_none() {
            return Self::Path(path);
        }
        let RawOptions { dims, voxel_type, spacing, big_endian, header_bytes } = options.raw;
        let voxel_type = voxel_type.map(|t| t.name().to_owned());
        let volume_index = options.volume_index;
        Self::Described(RawVolumeReference {
            path,
            spacing,
            dims,
            voxel_type,
            big_endian,
            header_bytes,
            volume_index,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn report_10_the_index_of_a_volume_is_kept() {
        let options = ReadOptions { volume_index: Some(1), ..ReadOptions::default() };
        let reference = VolumeReference::with_options("three.nii.gz".to_owned(), &options);
        let text = serde_json::to_string(&reference).unwrap();
        assert_eq!(text, r#"{"path":"three.nii.gz","volume_index":1}"#);
        let again: VolumeReference = serde_json::from_str(&text).unwrap();
        assert_eq!(again, reference);
        assert_eq!(again.read_options().unwrap().volume_index, Some(1));
        assert_eq!(again.with_path("a".to_owned()).read_options().unwrap().volume_index, Some(1));
        let other = again.with_volume_index(Some(2));
        assert_eq!(other.read_options().unwrap().volume_index, Some(2));
        let plain = VolumeReference::with_options("a.nrrd".to_owned(), &ReadOptions::default());
        assert_eq!(plain, VolumeReference::Path("a.nrrd".to_owned()));
    }
}
