//! The GPU ray caster (Termeer 4.2): a ray a pixel, in a fragment shader.
//!
//! Enters: a prepared volume, its classification and a scene. Leaves: an image with depth, and what it took. A frame goes to
//! the device in tiles small enough that none takes long (100 ms is the aim), so that no driver's watchdog bites.

mod pipelines;
mod readback;
mod targets;
mod uniforms;

use std::sync::Mutex;

use cutaway_core::image::Image;
use cutaway_core::scene::Scene;
use cutaway_core::value_ranges::ValueRanges;
use cutaway_core::volume::Volume;

use crate::classification::GpuClassification;
use crate::clip_layers::{ClipLayers, ClipStatistics};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::volume::GpuVolume;
use pipelines::{Inputs, Pipelines, Variant};
use targets::{Targets, tiles};
pub(crate) use uniforms::{BlockLevels, FrameUniforms, RayPlane};

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
    /// Bytes on the device: volume, tables, targets, clip.
    pub gpu_bytes: u64,
    /// What clipping took; nothing where there is none.
    pub clip: ClipStatistics,
}

/// Pipelines on a device.
#[derive(Debug)]
pub struct RaycastRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    targets: Mutex<Option<Targets>>,
    clip: Mutex<ClipLayers>,
}

/// A volume made ready: on the device, and what is in its blocks.
#[derive(Debug)]
pub struct PreparedVolume {
    voxels: GpuVolume,
    ranges: ValueRanges,
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
        Ok(Self { gpu: gpu.clone(), pipelines, targets: Mutex::new(None), clip: Mutex::default() })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Makes a volume ready: uploads it.
    pub fn prepare(&self, volume: &Volume) -> Result<PreparedVolume, GpuError> {
        let voxels = GpuVolume::new(&self.gpu, volume)?;
        Ok(PreparedVolume { voxels, ranges: ValueRanges::new(volume) })
    }

    /// Classifies a prepared volume for a scene.
    pub fn classify(&self, volume: &PreparedVolume, scene: &Scene) -> Result<GpuClassification, GpuError> {
        GpuClassification::new(&self.gpu, &volume.ranges, &volume.voxels, scene)
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
        debug_assert!(volume.voxels.is_of(scene));
        let resolution = scene.settings().resolution;
        let mut kept = self.targets.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let targets = match kept.take() {
            Some(targets) if targets.size() == resolution => targets,
            _ => Targets::new(&self.gpu, resolution)?,
        };
        let uniforms = FrameUniforms::new(scene, &volume.voxels, classification, resolution);
        let mut clip_layers = self.clip.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let clip = match scene.clip() {
            Some(clip) => clip_layers.update(&self.gpu, clip, scene, &uniforms)?,
            None => ClipStatistics::default(),
        };
        let segments = clip_layers.segments().filter(|_| scene.clip().is_some());
        let inputs = Inputs { volume: &volume.voxels, classification, segments };
        self.draw(&inputs, scene, &uniforms, &targets, progress)?;
        let read = readback::read(&self.gpu, &targets)?;
        let bytes = volume.voxels.bytes() + classification.bytes() + targets.bytes() + clip_layers.bytes();
        *kept = Some(targets);
        let statistics = Statistics { gpu_bytes: bytes, clip, ..read.statistics };
        Ok((read.image, statistics))
    }

    /// Draws a frame into targets, tile by tile.
    fn draw(
        &self,
        inputs: &Inputs,
        scene: &Scene,
        uniforms: &FrameUniforms,
        targets: &Targets,
        progress: &dyn Fn(f32),
    ) -> Result<(), GpuError> {
        let pipeline = self.pipelines.get(&self.gpu, Variant::of(scene, inputs.volume))?;
        let groups =
            self.gpu.checked("a frame's inputs", || self.pipelines.bind(&self.gpu, inputs, uniforms))?;
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
