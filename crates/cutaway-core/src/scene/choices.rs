//! The choices that settings offer by name: modes, engines, and ways of sampling.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a ray makes of the values along it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Emission and absorption, front to back.
    #[default]
    Composite,
    /// Surfaces of constant value (`iso`).
    Iso,
    /// Maximum of the value, then classified.
    Mip,
    /// Minimum of the value, then classified.
    Minip,
    /// Mean of the value over the kept length, then classified.
    Mean,
}

impl Mode {
    /// Every mode.
    pub const ALL: [Self; 5] = [Self::Composite, Self::Iso, Self::Mip, Self::Minip, Self::Mean];

    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Composite => "composite",
            Self::Iso => "iso",
            Self::Mip => "mip",
            Self::Minip => "minip",
            Self::Mean => "mean",
        }
    }
}

/// Which renderer makes the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// The best one here.
    #[default]
    Auto,
    /// The CPU ray caster.
    Cpu,
    /// The GPU ray caster.
    Raycast,
    /// Slices across the view, blended on the GPU.
    Slices,
    /// Projected tetrahedra, blended on the GPU: grids, and unstructured grids, which no other engine takes.
    Cells,
    /// The slow, exact renderer that the others are held against.
    Reference,
}

impl Engine {
    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Cpu => "cpu",
            Self::Raycast => "raycast",
            Self::Slices => "slices",
            Self::Cells => "cells",
            Self::Reference => "reference",
        }
    }
}

/// How empty space is skipped. All ways give the same image.
///
/// The GPU ray caster begins and ends its rays at the surface of a *proxy geometry* of cells that can be visible (Termeer,
/// figure 4.8), and crosses what is empty in between block by block. The other engines have no use for a proxy: to them
/// every way but [`Self::Off`] is [`Self::Auto`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpaceSkipping {
    /// Every sample inside the volume is taken.
    Off,
    /// Proxy: all cells that can be visible, as boxes.
    Cells,
    /// Proxy: the same, each shrunk to what can be visible in it.
    Fitted,
    /// Proxy: those that touch a cell that cannot be visible, or the volume's border.
    Boundary,
    /// Proxy: only the faces between cells that can be visible and cells that cannot.
    Contour,
    /// Proxy: shrunk cells, without the faces that two of them share.
    FittedContour,
    /// Blocks that cannot be visible are crossed without a sample, in the way that is fastest.
    #[default]
    Auto,
}

impl SpaceSkipping {
    /// Every way.
    pub const ALL: [Self; 7] = [
        Self::Off,
        Self::Cells,
        Self::Fitted,
        Self::Boundary,
        Self::Contour,
        Self::FittedContour,
        Self::Auto,
    ];

    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Cells => "cells",
            Self::Fitted => "fitted",
            Self::Boundary => "boundary",
            Self::Contour => "contour",
            Self::FittedContour => "fitted-contour",
            Self::Auto => "auto",
        }
    }
}

/// Where along a ray samples lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// A fixed step apart, from where the ray enters the volume.
    #[default]
    View,
    /// On the planes of voxels across the axis that the ray follows most (Termeer 4.1.1): there the field is bilinear. The
    /// step is that between planes, whatever `step` says.
    Object,
}

/// How the gradient for lighting is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Gradient {
    /// Central differences of the voxels, interpolated.
    #[default]
    Central,
    /// The same smoothed across by 1 2 1 along the two other axes: calmer on noisy data, softer on fine detail.
    Sobel,
    /// Directions of central differences, computed once a volume and kept in 32 bits a voxel, then interpolated.
    Precomputed,
}

/// How the voxels lie in memory while an image is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// As they came: x fastest, then y, then z. Needs no preparation.
    #[default]
    Linear,
    /// In bricks with copies of their neighbours' nearest voxels: what a ray needs is near itself in memory.
    Bricks,
}

/// Which pixels the CPU engine casts, and which it fills in between them. The reference casts every pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ImageInterpolation {
    /// Every pixel is cast.
    #[default]
    Off,
    /// A coarse lattice of pixels is cast; what lies between is filled where colour, opacity and depth allow it, and cast
    /// where they do not.
    Adaptive,
    /// Every so many pixels along x and y are cast, whatever lies between: 2 to 16.
    #[serde(untagged)]
    Factor(u32),
}

impl ImageInterpolation {
    /// The factors that there are.
    pub const FACTORS: std::ops::RangeInclusive<u32> = 2..=16;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn image_interpolation_is_a_name_or_a_number() {
        let all = [
            ("\"off\"", ImageInterpolation::Off),
            ("\"adaptive\"", ImageInterpolation::Adaptive),
            ("3", ImageInterpolation::Factor(3)),
        ];
        for (text, setting) in all {
            assert_eq!(serde_json::from_str::<ImageInterpolation>(text).unwrap(), setting);
            assert_eq!(serde_json::to_string(&setting).unwrap(), text);
        }
        for wrong in ["\"on\"", "2.5", "-2", "true", "{}"] {
            assert!(serde_json::from_str::<ImageInterpolation>(wrong).is_err(), "{wrong}");
        }
    }
}
