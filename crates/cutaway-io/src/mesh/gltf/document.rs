//! The parts of glTF's JSON that make a mesh: <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>.
//!
//! Everything else is skipped as it is parsed.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::whole;

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    #[serde(default, deserialize_with = "whole::some")]
    pub(super) scene: Option<u64>,
    #[serde(default)]
    pub(super) scenes: Vec<Scene>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
    #[serde(default)]
    pub(super) extensions_required: Vec<String>,
}

/// What is read before everything else, because the types of all other parts depend on it.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Head {
    #[serde(default)]
    pub(super) asset: Asset,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct Asset {
    pub(super) version: Option<Version>,
}

/// A version: text, or a number where a writer did not know better.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Version {
    Text(String),
    Number(f64),
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            // 1 is shown as 1.0.
            Self::Number(number) => write!(f, "{number:?}"),
        }
    }
}

/// Parses only where meshes have names, as in version 1.0.
#[derive(Debug, Deserialize)]
pub(super) struct NamedMeshes {
    #[serde(rename = "meshes")]
    _meshes: BTreeMap<String, IgnoredAny>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default, deserialize_with = "whole::list")]
    pub(super) nodes: Vec<u64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    #[serde(default, deserialize_with = "whole::list")]
    pub(super) children: Vec<u64>,
    #[serde(default, deserialize_with = "whole::some")]
    pub(super) mesh: Option<u64>,
    #[serde(default, deserialize_with = "whole::some")]
    pub(super) skin: Option<u64>,
    /// Column by column.
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<Box<[f64; 3]>>,
    /// x, y, z, w.
    pub(super) rotation: Option<Box<[f64; 4]>>,
    pub(super) scale: Option<Box<[f64; 3]>>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: Attributes,
    #[serde(default, deserialize_with = "whole::some")]
    pub(super) indices: Option<u64>,
    #[serde(default, deserialize_with = "whole::some")]
    pub(super) mode: Option<u64>,
    pub(super) targets: Option<IgnoredAny>,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Attributes {
    #[serde(default, rename = "POSITION", deserialize_with = "whole::some")]
    pub(super) position: Option<u64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    #[serde(default, deserialize_with = "whole::some")]
    pub(super) buffer_view: Option<u64>,
    #[serde(default, deserialize_with = "whole::one")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole::one")]
    pub(super) component_type: u64,
    #[serde(default)]
    pub(super) normalized: bool,
    #[serde(deserialize_with = "whole::one")]
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) sparse: Option<Sparse>,
}

/// Elements that replace those of the buffer view, or zeros.
#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    #[serde(deserialize_with = "whole::one")]
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    #[serde(deserialize_with = "whole::one")]
    pub(super) buffer_view: u64,
    #[serde(default, deserialize_with = "whole::one")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole::one")]
    pub(super) component_type: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    #[serde(deserialize_with = "whole::one")]
    pub(super) buffer_view: u64,
    #[serde(default, deserialize_with = "whole::one")]
    pub(super) byte_offset: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    #[serde(deserialize_with = "whole::one")]
    pub(super) buffer: u64,
    #[serde(default, deserialize_with = "whole::one")]
    pub(super) byte_offset: u64,
    #[serde(deserialize_with = "whole::one")]
    pub(super) byte_length: u64,
    #[serde(default, deserialize_with = "whole::some")]
    pub(super) byte_stride: Option<u64>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    #[serde(deserialize_with = "whole::one")]
    pub(super) byte_length: u64,
    pub(super) uri: Option<String>,
}

impl Document {
    /// How many vertices and triangles a mesh has by its accessors' counts.
    pub(super) fn size_of(&self, mesh: &Mesh) -> (u64, u64) {
        let count_of = |accessor: Option<u64>| {
            let accessor = accessor.and_then(|index| self.accessors.get(usize::try_from(index).ok()?));
            let Some(accessor) = accessor else { return 0 };
            let view =
                accessor.buffer_view.and_then(|index| self.buffer_views.get(usize::try_from(index).ok()?));
            // A view that is too short is an error of its own.
            view.map_or(accessor.count, |view| accessor.count.min(view.byte_length))
        };
        mesh.primitives.iter().fold((0, 0), |(vertices, triangles): (u64, u64), primitive| {
            let of_positions = count_of(primitive.attributes.position);
            let corners =
                if primitive.indices.is_some() { count_of(primitive.indices) } else { of_positions };
            let of_corners = match primitive.mode.unwrap_or(4) {
                4 => corners / 3,
                5 | 6 => corners.saturating_sub(2),
                _ => return (vertices, triangles),
            };
            (vertices.saturating_add(of_positions), triangles.saturating_add(of_corners))
        })
    }
}
