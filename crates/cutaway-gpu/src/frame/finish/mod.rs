//! From what was cast to the image: pixels between cast ones are filled in, and the whole is blurred, where a scene asks
//! for it.
//!
//! Enters: the targets that rays were cast into, at the size of a [`Lattice`]. Leaves: textures of the image's size, to be
//! read, or to be shown by a window on the same device. A frame that asks for neither goes through untouched; otherwise
//! textures are made for the frame alone.

mod passes;

use cutaway_core::image::blur::gaussian_weights;
use cutaway_core::scene::{Mode, Scene};

use super::lattice::Lattice;
use super::targets::Targets;
use crate::context::Gpu;
use crate::error::GpuError;
#[cfg(test)]
pub(crate) use passes::{BLUR_SHADER, FILL_SHADER};
pub(crate) use passes::{Blur, Fill};
use passes::{Passes, SHOWN, texture};

/// The pipelines.
#[derive(Debug)]
pub(crate) struct Finisher {
    passes: Passes,
}

/// A finished frame, to be read.
#[derive(Debug)]
pub(crate) struct Finished {
    /// Colours and depths of the image's size, counts of the lattice's.
    pub(crate) textures: [wgpu::Texture; 3],
    /// What they take beyond the targets.
    pub(crate) bytes: u64,
}

/// A frame that stays on the device.
#[derive(Clone, Debug)]
pub struct ShownFrame {
    /// Premultiplied display values, `Rgba8Unorm`, to be bound by whoever draws windows with the same device.
    pub texture: wgpu::Texture,
    /// Bytes on the device: volume, ranges of blocks, tables, targets, clip.
    pub gpu_bytes: u64,
}

impl Finisher {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self { passes: gpu.checked("the shaders that finish images", || Passes::new(gpu.device()))? })
    }

    /// Makes of what was cast what the scene asks for.
    pub(crate) fn finish(&self, gpu: &Gpu, scene: &Scene, targets: &Targets) -> Result<Finished, GpuError> {
        let [mut colors, mut depths, counts] = targets.textures().clone();
        let size = scene.settings().resolution;
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let mut bytes = 0;
        let lattice = Lattice::of(scene);
        if lattice.spacing > 1 {
            [colors, depths] = self.fill(gpu, scene, lattice, [&colors, &depths])?;
            bytes += 20 * pixels;
        }
        if scene.settings().blur > 0.0 {
            colors = self.blur(gpu, scene, &colors)?;
            bytes += 32 * pixels;
        }
        Ok(Finished { textures: [colors, depths, counts], bytes })
    }

    /// A finished frame's colours as windows show them, once they are there. `gpu_bytes`: what the frame took.
    pub(crate) fn show(
        &self,
        gpu: &Gpu,
        finished: &Finished,
        gpu_bytes: u64,
    ) -> Result<ShownFrame, GpuError> {
        let colors = &finished.textures[0];
        let size = [colors.width(), colors.height()];
        let texture = gpu.checked("the image", || texture(gpu.device(), size, SHOWN))?;
        self.passes.show(gpu, colors, &texture)?;
        gpu.finish()?;
        Ok(ShownFrame { texture, gpu_bytes })
    }

    fn fill(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        lattice: Lattice,
        cast: [&wgpu::Texture; 2],
    ) -> Result<[wgpu::Texture; 2], GpuError> {
        let settings = scene.settings();
        // Where an extremum lies jumps from ray to ray: a depth between two is the depth of nothing.
        let nearest = matches!(settings.mode, Mode::Mip | Mode::Minip);
        let fill = Fill { spacing: lattice.spacing, nearest_depths: u32::from(nearest), reserved: [0; 2] };
        let filled = gpu.checked("the filled image", || {
            [wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::R32Float]
                .map(|format| texture(gpu.device(), settings.resolution, format))
        })?;
        self.passes.fill(gpu, &fill, cast, [&filled[0], &filled[1]])?;
        Ok(filled)
    }

    /// Along x, then along y, as on the host.
    fn blur(&self, gpu: &Gpu, scene: &Scene, sharp: &wgpu::Texture) -> Result<wgpu::Texture, GpuError> {
        let settings = scene.settings();
        let weights = gaussian_weights(settings.blur);
        let [half, whole] = gpu.checked("the blurred image", || {
            [0, 1].map(|_| texture(gpu.device(), settings.resolution, wgpu::TextureFormat::Rgba32Float))
        })?;
        for (along, from, to) in [([1, 0], sharp, &half), ([0, 1], &half, &whole)] {
            let blur = Blur { along, count: weights.len() as u32, reserved: 0 };
            self.passes.blur(gpu, &blur, &weights, from, to)?;
        }
        Ok(whole)
    }
}
