//! How the places where rays cross clip meshes are found: settings. Every way finds the same places, some of them only so
//! far.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::{Serialize, Serializer};

/// How meshes are asked where rays cross them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ClipEvents {
    /// What is fastest on the engine in use: `raster` on the CPU, `lists` on a GPU.
    #[default]
    Auto,
    /// On the CPU: a uniform grid (Termeer 3.1.2).
    Grid,
    /// On the CPU: an octree (Termeer 3.1.2).
    Octree,
    /// On the CPU: a bounding volume hierarchy.
    Bvh,
    /// On the CPU: rasterisation into lists of tiles (Termeer 3.2).
    Raster,
    /// On a GPU: front and back faces culled by turns, peeled layer by layer (Termeer 3.2.3 and 3.2.4).
    Peel,
    /// On a GPU: a list of all crossings a pixel.
    Lists,
}

/// Which kind of engine a way of finding events is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClipEventsHome {
    /// Any: it stands for the engine's own.
    Any,
    /// Engines that run on the processor.
    Cpu,
    /// Engines that run on a graphics device.
    Gpu,
}

impl ClipEvents {
    /// Every way.
    pub const ALL: [Self; 7] =
        [Self::Auto, Self::Grid, Self::Octree, Self::Bvh, Self::Raster, Self::Peel, Self::Lists];

    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Grid => "grid",
            Self::Octree => "octree",
            Self::Bvh => "bvh",
            Self::Raster => "raster",
            Self::Peel => "peel",
            Self::Lists => "lists",
        }
    }

    /// Which kind of engine has it; on another one the engine's own way takes its place.
    pub fn home(self) -> ClipEventsHome {
        match self {
            Self::Auto => ClipEventsHome::Any,
            Self::Grid | Self::Octree | Self::Bvh | Self::Raster => ClipEventsHome::Cpu,
            Self::Peel | Self::Lists => ClipEventsHome::Gpu,
        }
    }
}

/// Bits of a number in the layers that clip surfaces are peeled into (Termeer's VCRbufferDepth); in a file `16` or `32`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BufferDepth {
    /// Half precision: half the memory and traffic, surfaces off by up to 1/4096 of the volume's diagonal.
    Half,
    /// Single precision.
    #[default]
    Single,
}

impl BufferDepth {
    /// How many bits.
    pub fn bits(self) -> u32 {
        match self {
            Self::Half => 16,
            Self::Single => 32,
        }
    }

    /// The one of so many bits, if there is one.
    pub fn from_bits(bits: u64) -> Option<Self> {
        match bits {
            16 => Some(Self::Half),
            32 => Some(Self::Single),
            _ => None,
        }
    }
}

impl Serialize for BufferDepth {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u32(self.bits())
    }
}

impl<'de> Deserialize<'de> for BufferDepth {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct BitsVisitor;
        impl Visitor<'_> for BitsVisitor {
            type Value = BufferDepth;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("16 or 32 bits")
            }

            fn visit_u64<E: de::Error>(self, bits: u64) -> Result<BufferDepth, E> {
                BufferDepth::from_bits(bits)
                    .ok_or_else(|| E::invalid_value(de::Unexpected::Unsigned(bits), &self))
            }
        }
        deserializer.deserialize_u64(BitsVisitor)
    }
}

impl JsonSchema for BufferDepth {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "BufferDepth".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Bits of a number in the layers that clip surfaces are peeled into.",
            "type": "integer",
            "enum": [16, 32],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_numbers_of_bits() {
        let read = |text: &str| serde_json::from_str::<BufferDepth>(text).map_err(|e| e.to_string());
        for (text, depth) in [("16", BufferDepth::Half), ("32", BufferDepth::Single)] {
            assert_eq!(read(text), Ok(depth));
            assert_eq!(serde_json::to_string(&depth).unwrap(), text);
        }
        for wrong in ["8", "-16", "24", "16.5", "\"16\"", "null"] {
            assert!(read(wrong).unwrap_err().contains("16 or 32 bits"), "{wrong}");
        }
    }

    #[test]
    fn ways_of_finding_events_have_the_names_of_files() {
        for how in ClipEvents::ALL {
            let text = format!("\"{}\"", how.name());
            assert_eq!(serde_json::to_string(&how).unwrap(), text);
            assert_eq!(serde_json::from_str::<ClipEvents>(&text).unwrap(), how);
        }
    }
}
