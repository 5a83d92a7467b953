//! The GPU ray caster (Termeer 4.2): a ray a pixel, in a fragment shader.
//!
//! Enters: a prepared volume, its classification and a scene. Leaves: an image with depth, and what it took. A frame goes to
//! the device in tiles small enough that none takes long (100 ms is the aim), so that no driver's watchdog bites.

mod fetches;
mod pipelines;
mod readback;
mod targets;
mod uniforms;

use std::sync::Mutex;

use cutaway_core::image::Image;
use cutaway_core::scene::Scene;
use cutaway_core::volume::{Volume, Voxels};

use crate::classification::GpuClassification;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::ranges::{BlockPipelines, GpuRanges};
use crate::volume::GpuVolume;
pub use fetches::FetchCounts;
use pipelines::{Inputs, Pipelines, Variant};
use targets::{Targets, tiles};
pub(crate) use uniforms::FrameUniforms;

/// The linked shader.
pub(crate) const SHADER: &str = include_str!(concat!(env!("OUT_DIR"), "/raycast_raycast.wgsl"));

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Rays that met something.
    pub rays: u64,
    /// Values of the field that were taken: texture fetches, where the adapter filters; cells looked at, for isosurfaces.
    pub samples: u64,
    /// Stretches of occupied blocks.
    pub segments: u64,
    /// Bytes on the device: volume, ranges of blocks, tables, targets.
    pub gpu_bytes: u64,
    /// The share of samples within the volume that were not taken: empty, or behind opaque ones; 0..=1. Isosurfaces have no
    /// samples to skip: 0.
    pub skipped_fraction: f64,
}

/// Pipelines on a device.
#[derive(Debug)]
pub struct RaycastRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    blocks: BlockPipelines,
    targets: Mutex<Option<Targets>>,
}

/// A volume made ready: on the device, and what is in its blocks.
#[derive(Debug)]
pub struct PreparedVolume {
    voxels: GpuVolume,
    ranges: GpuRanges,
}

impl PreparedVolume {
    /// The voxels on the device.
    pub fn voxels(&self) -> &GpuVolume {
        &self.voxels
    }
}

impl RaycastRenderer {
    /// Makes what all frames share.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let pipelines = Pipelines::new(gpu)?;
        let blocks = BlockPipelines::new(gpu)?;
        Ok(Self { gpu: gpu.clone(), pipelines, blocks, targets: Mutex::new(None) })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Makes a volume ready: uploads it, and finds the ranges of its blocks.
    pub fn prepare(&self, volume: &Volume) -> Result<PreparedVolume, GpuError> {
        let voxels = GpuVolume::new(&self.gpu, volume)?;
        let whole = !matches!(volume.voxels(), Voxels::F32(_));
        let ranges = self.blocks.make_ranges(&self.gpu, &voxels, whole)?;
        Ok(PreparedVolume { voxels, ranges })
    }

    /// Classifies a prepared volume for a scene.
    pub fn classify(&self, volume: &PreparedVolume, scene: &Scene) -> Result<GpuClassification, GpuError> {
        GpuClassification::new(&self.gpu, &self.blocks, &volume.ranges, &volume.voxels, scene)
    }

    /// Renders a frame of a scene with a classification made for it. `progress` is called with the finished share of the
    /// image, 0..=1.
    pub fn render(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        progress: &dyn Fn(f32),
    ) -> Result<(Image, Statistics), GpuError> {
        let frame = self.frame(volume, classification, scene, progress)?;
        Ok((frame.image, frame.statistics))
    }

    /// Renders a frame as [`Self::render`] does, for what each pixel of it took.
    pub fn fetch_counts(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        progress: &dyn Fn(f32),
    ) -> Result<FetchCounts, GpuError> {
        let frame = self.frame(volume, classification, scene, progress)?;
        Ok(FetchCounts::new(scene.settings().resolution, frame.fetches))
    }

    fn frame(
        &self,
        volume: &PreparedVolume,
        classification: &GpuClassification,
        scene: &Scene,
        progress: &dyn Fn(f32),
    ) -> Result<readback::Read, GpuError> {
        debug_assert!(volume.voxels.is_of(scene));
        let resolution = scene.settings().resolution;
        let mut kept = self.targets.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let targets = match kept.take() {
            Some(targets) if targets.size() == resolution => targets,
            _ => Targets::new(&self.gpu, resolution)?,
        };
        let inputs = Inputs { volume: &volume.voxels, classification, ranges: &volume.ranges };
        self.draw(&inputs, scene, &targets, progress)?;
        let mut read = readback::read(&self.gpu, &targets)?;
        read.statistics.gpu_bytes =
            volume.voxels.bytes() + volume.ranges.bytes() + classification.bytes() + targets.bytes();
        *kept = Some(targets);
        Ok(read)
    }

    /// Draws a frame into targets, tile by tile.
    fn draw(
        &self,
        inputs: &Inputs,
        scene: &Scene,
        targets: &Targets,
        progress: &dyn Fn(f32),
    ) -> Result<(), GpuError> {
        let pipeline =
            self.pipelines.get(&self.gpu, Variant::of(scene, inputs.volume, self.gpu.capabilities()))?;
        let uniforms = FrameUniforms::new(scene, inputs.volume, inputs.classification, targets.size());
        let groups =
            self.gpu.checked("a frame's inputs", || self.pipelines.bind(&self.gpu, inputs, &uniforms))?;
        let tiles = tiles(targets.size(), most_steps(scene), self.gpu.adapter().software);
        for (i, tile) in tiles.iter().enumerate() {
            self.gpu.checked("drawing a tile", || {
                let mut encoder =
                    self.gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                {
                    let mut pass = targets.pass(&mut encoder, i == 0);
                    pass.set_pipeline(&pipeline);
                    pass.set_bind_group(0, &groups[0], &[]);
                    pass.set_bind_group(1, &groups[1], &[]);
                    pass.set_scissor_rect(tile.x, tile.y, tile.width, tile.height);
                    pass.draw(0..3, 0..1);
                }
                self.gpu.queue().submit([encoder.finish()]);
            })?;
            progress((i + 1) as f32 / tiles.len() as f32);
        }
        Ok(())
    }
}

/// Steps of a ray through the whole volume, from corner to corner.
fn most_steps(scene: &Scene) -> f64 {
    let corners = scene.volume().corners_in_world();
    let diagonal = (0..4).map(|c| corners[c].distance(corners[7 - c])).fold(0.0, f64::max);
    diagonal / scene.step_length()
}
