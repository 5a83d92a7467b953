//! What is decided of cells when their shaders are compiled.

use cutaway_core::scene::Scene;

use super::options::{CellIntegral, CellOptions};
use crate::context::{Filtering, Gpu};
use crate::frame::diffuse_curve;
use crate::plumbing::flag;
use crate::volume::GpuVolume;

/// Where tetrahedra come from, as `SOURCE` in `draw.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Source {
    Basis,
    Grid,
    Mesh,
}

/// What is decided when shaders are compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    pub(super) source: Source,
    pub(super) options: CellOptions,
    pub(super) parallel: bool,
    shaded: bool,
    faces_lit: bool,
    clipped: bool,
    curve: u32,
    exact: bool,
    pub(super) filterable: bool,
    pub(super) brick_edge: Option<u32>,
}

impl Variant {
    pub(super) fn of(
        gpu: &Gpu,
        scene: &Scene,
        volume: &GpuVolume,
        source: Source,
        options: CellOptions,
    ) -> Self {
        Self {
            source,
            options,
            parallel: scene.camera().orthographic.is_some(),
            shaded: scene.is_shaded(),
            faces_lit: scene.lighting().shade && scene.clip().is_some(),
            clipped: scene.clip().is_some(),
            curve: diffuse_curve(scene),
            exact: volume.texels().filtering == Filtering::Exact,
            filterable: volume.texels().filterable(gpu.capabilities()),
            brick_edge: volume.brick_edge(),
        }
    }

    /// Of a grid's shaders, which read voxels.
    pub(super) fn of_voxels(&self) -> [(&'static str, f64); 4] {
        [
            ("BRICKED", flag(self.brick_edge.is_some())),
            ("BRICK_EDGE", f64::from(self.brick_edge.unwrap_or(1))),
            ("EXACT_FILTERING", flag(self.exact)),
            ("SPLIT", self.split()),
        ]
    }

    fn split(&self) -> f64 {
        f64::from(self.options.split.count())
    }

    pub(super) fn of_drawing(&self) -> Vec<(&'static str, f64)> {
        let source = match self.source {
            Source::Basis => 0.0,
            Source::Grid => 1.0,
            Source::Mesh => 2.0,
        };
        let integral = match self.options.integral {
            CellIntegral::Average => 0.0,
            CellIntegral::Partial => 1.0,
            CellIntegral::Exact => 2.0,
        };
        let mut constants = self.of_voxels().to_vec();
        constants.extend([
            ("SOURCE", source),
            ("INTEGRAL", integral),
            ("EXPONENTIAL_TABLE", flag(self.options.exponential_table)),
            ("SHADED", flag(self.shaded)),
            ("FACES_LIT", flag(self.faces_lit)),
            ("CLIPPED", flag(self.clipped)),
            ("DIFFUSE_CURVE", f64::from(self.curve)),
        ]);
        constants
    }
}
