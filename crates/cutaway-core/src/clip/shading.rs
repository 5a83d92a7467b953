//! What clip surfaces look like, and how many of them count: settings.

use std::fmt;
use std::num::NonZeroU32;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::{Serialize, Serializer};

use crate::scene::{SceneError, setting};

/// How the light on a clip surface reaches into the volume.
///
/// Where a volume is cut through what is homogeneous, its gradient is noise, and so would be the light on the cut.
/// Behind a surface that faces the viewer, the surface's own normal therefore takes part in lighting the samples, with
/// a weight that depends on their depth below it (Termeer 2.4, after Weiskopf et al. 2003).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Impregnation {
    /// Samples are lit by their gradient alone.
    None,
    /// By the surface's normal alone, down to the thickness.
    Step,
    /// By the surface's normal, less and less down to the thickness.
    #[default]
    Linear,
}

impl Impregnation {
    /// The weight of the surface's normal at `depth` as a fraction of the thickness, 0 or more.
    #[inline]
    pub fn weight(self, depth: f64) -> f64 {
        match self {
            Self::Linear => (1.0 - depth).max(0.0),
            Self::Step if depth < 1.0 => 1.0,
            _ => 0.0,
        }
    }

    /// The least cosine between ray and normal that depth is measured with.
    ///
    /// A sample at `t` along the ray, behind a surface at `t_near`, lies `(t - t_near) |n · d|` below the plane of the
    /// surface. That is its true depth below a flat surface, where Termeer's distance along the ray is too much by the
    /// cosine's inverse. But of a curved surface the ray comes away soon if it is nearly along it, and the plane never
    /// does: beyond this angle (75.5 degrees) the layer is taken for as long along the ray as at it.
    pub const LEAST_COSINE: f64 = 0.25;
}

/// What clip surfaces look like.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClipShading {
    /// How the surface's normal lights what lies behind it.
    pub impregnation: Impregnation,
    /// How deep that goes, in units of the smallest voxel spacing; 0 to 1000000.
    pub thickness: f64,
    /// Opacity with which the clip surface itself is drawn, white and lit, 0 to 1.
    pub overlay: f64,
    /// Whether an isosurface that is cut open is closed by the cut.
    pub cap: bool,
}

impl Default for ClipShading {
    fn default() -> Self {
        Self { impregnation: Impregnation::default(), thickness: 3.0, overlay: 0.0, cap: false }
    }
}

impl ClipShading {
    /// Checks every number.
    pub fn validate(&self) -> Result<(), SceneError> {
        if !(0.0..=1e6).contains(&self.thickness) {
            return Err(setting("thickness", crate::numbers::exact(self.thickness), "0 to 1000000 voxels"));
        }
        if !(0.0..=1.0).contains(&self.overlay) {
            return Err(setting("overlay", crate::numbers::exact(self.overlay), "0 to 1"));
        }
        Ok(())
    }
}

/// How many of the segments that clipping leaves of a ray are used; in a file `"auto"` or a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SegmentCount {
    /// All that matter to the picture.
    #[default]
    Auto,
    /// The first of them.
    AtMost(NonZeroU32),
}

impl Serialize for SegmentCount {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str("auto"),
            Self::AtMost(n) => serializer.serialize_u32(n.get()),
        }
    }
}

impl<'de> Deserialize<'de> for SegmentCount {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct CountVisitor;
        impl Visitor<'_> for CountVisitor {
            type Value = SegmentCount;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "`\"auto\"` or a whole number of 1 to {}", u32::MAX)
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<SegmentCount, E> {
                match text {
                    "auto" => Ok(SegmentCount::Auto),
                    _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
                }
            }

            fn visit_u64<E: de::Error>(self, n: u64) -> Result<SegmentCount, E> {
                let most = u32::try_from(n).ok().and_then(NonZeroU32::new);
                most.map(SegmentCount::AtMost)
                    .ok_or_else(|| E::invalid_value(de::Unexpected::Unsigned(n), &self))
            }
        }
        deserializer.deserialize_any(CountVisitor)
    }
}

impl JsonSchema for SegmentCount {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SegmentCount".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "All segments, or at most so many.",
            "anyOf": [
                { "type": "string", "const": "auto" },
                { "type": "integer", "minimum": 1, "maximum": u32::MAX },
            ],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_fall_from_one_to_nothing() {
        let weights = |i: Impregnation| [0.0, 0.25, 0.999, 1.0, 5.0].map(|d| (i.weight(d) * 1000.0).round());
        assert_eq!(weights(Impregnation::None), [0.0; 5]);
        assert_eq!(weights(Impregnation::Step), [1000.0, 1000.0, 1000.0, 0.0, 0.0]);
        assert_eq!(weights(Impregnation::Linear), [1000.0, 750.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let shading = ClipShading::default();
        assert!(shading.validate().is_ok());
        for thickness in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(ClipShading { thickness, ..shading.clone() }.validate().is_err());
        }
        for overlay in [-0.1, 1.1, f64::NAN] {
            assert!(ClipShading { overlay, ..shading.clone() }.validate().is_err());
        }
    }

    #[test]
    fn counts_are_auto_or_numbers() {
        let read = |text: &str| serde_json::from_str::<SegmentCount>(text).map_err(|e| e.to_string());
        let three = SegmentCount::AtMost(NonZeroU32::new(3).unwrap());
        for (text, count) in [("\"auto\"", SegmentCount::Auto), ("3", three)] {
            assert_eq!(read(text), Ok(count));
            assert_eq!(serde_json::to_string(&count).unwrap(), text);
        }
        for wrong in ["0", "-1", "1.5", "\"all\"", "null", "4294967296"] {
            assert!(read(wrong).unwrap_err().contains("whole number of 1"), "{wrong}");
        }
    }
}
