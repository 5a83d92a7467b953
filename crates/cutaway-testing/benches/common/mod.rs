//! Scenes that are measured: fixed volumes, views and transfer functions.
#![allow(dead_code, reason = "each benchmark uses a part of it")]

use cutaway_core::analytic::AnalyticField;
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Mode, RenderSettings, Scene};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::{Geometry, Rescale, Volume, VoxelType};
use cutaway_core::with_voxels;
use cutaway_cpu::{Classification, CpuRenderer, CpuVolume, SimdChoice, Statistics};
use cutaway_testing::scenes::{framed, point};

/// Width and height of the images.
pub(crate) const IMAGE: [u32; 2] = [256, 256];

/// The signal of Marschner and Lobb in `size` voxels a side, held as `voxel_type`: 0 to 255, 0 to 4095, or 0 to 1.
pub(crate) fn marschner_lobb(size: u32, voxel_type: VoxelType) -> Volume {
    let field = AnalyticField::MarschnerLobb.volume(size);
    let geometry = || Geometry::from_spacing(DVec3::ONE);
    let dimensions = UVec3::splat(size);
    with_voxels!(field.voxels(), voxels => {
        let values = voxels.iter().map(|v| f64::from(*v));
        match voxel_type {
            VoxelType::U8 => {
                let voxels: Vec<u8> = values.map(|v| (v * 255.0) as u8).collect();
                Volume::new(dimensions, voxels, Rescale::IDENTITY, geometry())
            }
            VoxelType::U16 => {
                let voxels: Vec<u16> = values.map(|v| (v * 4095.0) as u16).collect();
                Volume::new(dimensions, voxels, Rescale::IDENTITY, geometry())
            }
            _ => return field,
        }
    })
    .expect("a cube of voxels with unit spacing")
}

/// What of a volume is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Look {
    /// Nearly nothing: the top hundredth of the values.
    AlmostEmpty,
    /// Everything, so faintly that no ray ends early.
    Transparent,
    /// A surface that ends every ray.
    Opaque,
}

impl Look {
    fn function(self, [lo, hi]: [f64; 2]) -> TransferFunction {
        let at = |share: f64| lo + share * (hi - lo);
        let points = match self {
            Self::AlmostEmpty => vec![point(at(0.99), [1.0; 3], 0.0), point(at(1.0), [1.0; 3], 0.05)],
            Self::Transparent => {
                vec![point(at(0.0), [0.1, 0.2, 0.9], 1e-4), point(at(1.0), [1.0, 0.9, 0.2], 0.01)]
            }
            Self::Opaque => vec![point(at(0.5), [0.9, 0.5, 0.3], 0.0), point(at(0.51), [0.9, 0.5, 0.3], 1.0)],
        };
        TransferFunction::new(points).expect("ordered points")
    }
}

/// A framed view of a volume, in steps of one voxel.
pub(crate) fn scene(volume: &Volume, mode: Mode, look: Look, shade: bool) -> Scene {
    let [lo, hi] = volume.value_range();
    let iso = if mode == Mode::Iso { vec![0.5 * (lo + hi)] } else { Vec::new() };
    let settings = RenderSettings { mode, iso, step: 1.0, resolution: IMAGE, ..RenderSettings::default() };
    let lighting = Lighting { shade, ..Lighting::default() };
    framed(volume, &look.function(volume.value_range()), lighting, settings)
}

/// A scene on a renderer, ready for frames.
pub(crate) struct Ready {
    renderer: CpuRenderer,
    volume: CpuVolume,
    classification: Classification,
    scene: Scene,
}

impl Ready {
    /// `None` where the processor lacks the instructions. `threads`: 0 for one a core.
    pub(crate) fn new(scene: Scene, simd: SimdChoice, threads: usize) -> Option<Self> {
        let renderer = CpuRenderer::new(threads, simd).ok()?;
        let volume = renderer.prepare(scene.volume()).expect("a volume that the engine can address");
        let classification = renderer.classify(&volume, &scene);
        Some(Self { renderer, volume, classification, scene })
    }

    /// Renders a frame.
    pub(crate) fn frame(&self) -> Statistics {
        let (image, statistics) =
            self.renderer.render(&self.volume, &self.classification, &self.scene, &|_| {});
        std::hint::black_box(image);
        statistics
    }
}
