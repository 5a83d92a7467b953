//! The GPU ray caster (Termeer 4.2): a ray a pixel, in a fragment shader.
//!
//! Enters: a prepared volume, its classification and a scene. Leaves: an image with depth, and what it took. A frame goes to
//! the device in tiles small enough that none takes long (100 ms is the aim), so that no driver's watchdog bites.

mod finish;
mod pipelines;
mod readback;
mod sampling;
mod targets;
mod uniforms;

use std::sync::{Mutex, OnceLock};

use cutaway_core::image::Image;
use cutaway_core::scene::Scene;
use cutaway_core::value_ranges::ValueRanges;
use cutaway_core::volume::Volume;

use crate::classification::GpuClassification;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::volume::GpuVolume;
#[cfg(test)]
pub(crate) use finish::{BLUR_SHADER, Blur, FILL_SHADER, Fill};
use finish::{Finisher, Lattice};
use pipelines::{Inputs, Pipelines, Variant};
pub(crate) use sampling::GpuPreintegration;
pub use sampling::notices;
#[cfg(test)]
pub(crate) use sampling::{DIRECTIONS_SHADER, Slab};
use sampling::{GpuDirections, SamplingVariant, cost_of_step};
use targets::{Targets, tiles};
pub(crate) use uniforms::{BlockLevels, FrameUniforms};

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
    /// Bytes on the device: volume, tables, targets.
    pub gpu_bytes: u64,
}

/// Pipelines on a device.
#[derive(Debug)]
pub struct RaycastRenderer {
    gpu: Gpu,
    pipelines: Pipelines,
    targets: Mutex<Option<Targets>>,
    finisher: Finisher,
}

/// A volume made ready: on the device, and what is in its blocks.
#[derive(Debug)]
pub struct PreparedVolume {
    voxels: GpuVolume,
    ranges: ValueRanges,
    /// Made when a scene first asks for them.
    directions: OnceLock<GpuDirections>,
}

impl PreparedVolume {
    /// Directions of its gradient, where a scene wants them.
    fn directions(&self, gpu: &Gpu, scene: &Scene) -> Result<Option<&GpuDirections>, GpuError> {
        if !SamplingVariant::of(scene).wants_directions() {
            return Ok(None);
        }
        if let Some(made) = self.directions.get() {
            return Ok(Some(made));
        }
        let made = GpuDirections::new(gpu, scene.volume(), &self.voxels)?;
        Ok(Some(self.directions.get_or_init(|| made)))
    }

    /// The voxels on the device.
    pub fn voxels(&self) -> &GpuVolume {
        &self.voxels
    }
}

impl RaycastRenderer {
    /// Makes what all frames share.
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let pipelines = Pipelines::new(gpu)?;
        let finisher = Finisher::new(gpu)?;
        Ok(Self { gpu: gpu.clone(), pipelines, targets: Mutex::new(None), finisher })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Makes a volume ready: uploads it.
    pub fn prepare(&self, volume: &Volume) -> Result<PreparedVolume, GpuError> {
        let voxels = GpuVolume::new(&self.gpu, volume)?;
        Ok(PreparedVolume { voxels, ranges: ValueRanges::new(volume), directions: OnceLock::new() })
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
        let resolution = Lattice::of(scene).size;
        let mut kept = self.targets.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let targets = match kept.take() {
            Some(targets) if targets.size() == resolution => targets,
            _ => Targets::new(&self.gpu, resolution)?,
        };
        let directions = volume.directions(&self.gpu, scene)?;
        let inputs = Inputs { volume: &volume.voxels, classification, directions };
        self.draw(&inputs, scene, &targets, progress)?;
        let finished = self.finisher.finish(&self.gpu, scene, &targets)?;
        let read = readback::read(&self.gpu, &finished.textures)?;
        let sampled = classification.bytes() + directions.map_or(0, GpuDirections::bytes);
        let bytes = volume.voxels.bytes() + sampled + targets.bytes() + finished.bytes;
        *kept = Some(targets);
        let statistics = Statistics { gpu_bytes: bytes, ..read.statistics };
        Ok((read.image, statistics))
    }

    /// Draws a frame into targets, tile by tile.
    fn draw(
        &self,
        inputs: &Inputs,
        scene: &Scene,
        targets: &Targets,
        progress: &dyn Fn(f32),
    ) -> Result<(), GpuError> {
        let pipeline = self.pipelines.get(&self.gpu, Variant::of(scene, inputs.volume))?;
        let uniforms = FrameUniforms::new(scene, inputs.volume, inputs.classification, targets.size());
        let groups =
            self.gpu.checked("a frame's inputs", || self.pipelines.bind(&self.gpu, inputs, &uniforms))?;
        let tiles =
            tiles(targets.size(), most_steps(scene) * cost_of_step(scene), self.gpu.adapter().software);
        for (i, tile) in tiles.iter().enumerate() {
            self.gpu.checked("drawing a tile", || {
                let mut encoder =
                    self.gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                {
                    let mut pass = targets.pass(&mut encoder, i == 0);
                    pass.set_pipeline(&pipeline);
                    pass.set_bind_group(0, &groups[0], &[]);
                    pass.set_bind_group(1, &groups[1], &[]);
                    pass.set_bind_group(2, &groups[2], &[]);
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
