//! From what was cast to the image: pixels between cast ones are filled in, and the whole is blurred, where a scene asks
//! for it.
//!
//! Enters: the targets that rays were cast into, at the size of a [`Lattice`]. Leaves: textures of the image's size, to be
//! read, or to be shown by a window on the same device. A frame that asks for neither goes through untouched; otherwise
//! textures are made for the frame alone.

mod passes;

use bytemuck::{Pod, Zeroable};
use cutaway_core::image::blur::gaussian_weights;
use cutaway_core::scene::{ImageInterpolation, Mode, Scene};

use super::targets::Targets;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::shaders::{Shader, shader};
use passes::{Passes, SHOWN, texture};

/// The linked shaders.
pub(crate) const FILL_SHADER: Shader = shader!(raycast::finish::fill);
pub(crate) const BLUR_SHADER: Shader = shader!(raycast::finish::blur);

/// `Fill` in `fill.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Fill {
    pub(crate) spacing: u32,
    pub(crate) nearest_depths: u32,
    pub(crate) reserved: [u32; 2],
}

/// `Blur` in `blur.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Blur {
    pub(crate) along: [i32; 2],
    pub(crate) count: u32,
    pub(crate) reserved: u32,
}

/// The pixels that are cast: lattice pixel `(i, j)` is pixel `(i, j) * spacing` of the image. A lattice reaches beyond the
/// image's right and lower border, so that every pixel lies in a cell with four corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lattice {
    /// Pixels from one cast pixel to the next.
    pub(crate) spacing: u32,
    /// Cast pixels along x and y.
    pub(crate) size: [u32; 2],
}

impl Lattice {
    pub(crate) fn of(scene: &Scene) -> Self {
        let settings = scene.settings();
        match settings.image_interpolation {
            ImageInterpolation::Factor(spacing) => {
                Self { spacing, size: settings.resolution.map(|side| (side - 1) / spacing + 2) }
            }
            ImageInterpolation::Off | ImageInterpolation::Adaptive => {
                Self { spacing: 1, size: settings.resolution }
            }
        }
    }
}

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
