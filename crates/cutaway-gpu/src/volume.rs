//! A volume on the device: its voxels as a 3D texture.
//!
//! A texel is a stored number (see `cutaway_core::volume::Rescale`) divided by the greatest that its type can hold, or, for
//! floats, its place in the volume's range, 0..=1, so that whatever precision a format has is used on values that occur.

use std::borrow::Cow;

use cutaway_core::glam::UVec3;
use cutaway_core::scene::Scene;
use cutaway_core::volume::{Volume, Voxels};
use half::f16;
use rayon::prelude::*;

use crate::context::{Capabilities, Filtering, Gpu};
use crate::error::GpuError;

/// How a stored number stands in a texture: `stored = texel * stored_per_texel + stored_at_zero`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texels {
    /// What it is kept as.
    pub format: wgpu::TextureFormat,
    /// Stored units of one texel unit.
    pub stored_per_texel: f64,
    /// The stored number of a texel of 0.
    pub stored_at_zero: f64,
    /// How values between voxels are found.
    pub filtering: Filtering,
}

impl Texels {
    /// The most precise way to hold these voxels that the device has.
    fn choose(volume: &Volume, capabilities: &Capabilities) -> Self {
        let [lo, hi] = volume.stored_range().map(f64::from);
        let float = if capabilities.float_filtering { Filtering::Hardware } else { Filtering::Exact };
        let (format, stored_per_texel, stored_at_zero, filtering) = match volume.voxels() {
            Voxels::U8(_) => (wgpu::TextureFormat::R8Unorm, 255.0, 0.0, Filtering::Hardware),
            Voxels::U16(_) if capabilities.norm16 => {
                (wgpu::TextureFormat::R16Unorm, 65535.0, 0.0, Filtering::Hardware)
            }
            Voxels::U16(_) => (wgpu::TextureFormat::R32Float, 65535.0, 0.0, float),
            Voxels::F32(_) => (wgpu::TextureFormat::R32Float, if hi > lo { hi - lo } else { 1.0 }, lo, float),
        };
        // Where nothing filters there is no choice.
        let filtering = match capabilities.filtering {
            Some(Filtering::Exact) => Filtering::Exact,
            _ => filtering,
        };
        Self { format, stored_per_texel, stored_at_zero, filtering }
    }

    /// The texel of a stored number.
    pub fn texel(&self, stored: f64) -> f64 {
        (stored - self.stored_at_zero) / self.stored_per_texel
    }

    /// Whether the device can filter the texture; else only single voxels can be read.
    pub(crate) fn filterable(&self, capabilities: &Capabilities) -> bool {
        self.format != wgpu::TextureFormat::R32Float || capabilities.float_filtering
    }

    /// The bytes of these voxels as the texture takes them.
    fn bytes<'a>(&self, voxels: &'a Voxels) -> Cow<'a, [u8]> {
        let texel = |stored: f32| self.texel(f64::from(stored)) as f32;
        match (voxels, self.format) {
            (Voxels::U8(v), wgpu::TextureFormat::R8Unorm) => Cow::Borrowed(v),
            (Voxels::U16(v), wgpu::TextureFormat::R16Unorm) => Cow::Borrowed(bytemuck::cast_slice(v)),
            (_, wgpu::TextureFormat::R16Float) => {
                let texels: Vec<u16> = (0..voxels.len())
                    .into_par_iter()
                    .map(|i| f16::from_f32(texel(voxels.get(i))).to_bits())
                    .collect();
                Cow::Owned(bytemuck::cast_slice(&texels).to_vec())
            }
            _ => {
                let texels: Vec<f32> =
                    (0..voxels.len()).into_par_iter().map(|i| texel(voxels.get(i))).collect();
                Cow::Owned(bytemuck::cast_slice(&texels).to_vec())
            }
        }
    }
}

/// A volume on the device.
#[derive(Debug)]
pub struct GpuVolume {
    dimensions: UVec3,
    texels: Texels,
    view: wgpu::TextureView,
    bytes: u64,
}

impl GpuVolume {
    pub(crate) fn new(gpu: &Gpu, volume: &Volume) -> Result<Self, GpuError> {
        let texels = Texels::choose(volume, gpu.capabilities());
        let dimensions = volume.dimensions();
        let most = gpu.capabilities().max_texture_3d;
        if dimensions.max_element() > most {
            let reason = format!("its textures have at most {most} voxels along a side");
            return Err(GpuError::TooLarge { dimensions, reason });
        }
        let size =
            wgpu::Extent3d { width: dimensions.x, height: dimensions.y, depth_or_array_layers: dimensions.z };
        let texel_bytes = texels.format.block_copy_size(None).unwrap_or(4);
        let texture = gpu.checked("the volume's texture", || {
            gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some("volume"),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format: texels.format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
        })?;
        let bytes = texels.bytes(volume.voxels());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(dimensions.x * texel_bytes),
            rows_per_image: Some(dimensions.y),
        };
        gpu.checked("uploading the volume", || {
            gpu.queue().write_texture(texture.as_image_copy(), &bytes, layout, size);
            gpu.queue().submit([]);
        })?;
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(Self { dimensions, texels, view, bytes: bytes.len() as u64 })
    }

    /// How its numbers stand in the texture.
    pub fn texels(&self) -> &Texels {
        &self.texels
    }

    /// Voxels along x, y, z.
    pub fn dimensions(&self) -> UVec3 {
        self.dimensions
    }

    /// What it takes of the device's memory.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(crate) fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Whether this is the volume of a scene, as far as that can be told.
    pub(crate) fn is_of(&self, scene: &Scene) -> bool {
        scene.volume().dimensions() == self.dimensions
    }
}
