//! Three-dimensional textures.

use cutaway_core::glam::UVec3;

use crate::context::Gpu;

/// A texture to be filled by the host. To be called within [`Gpu::checked`].
pub(super) fn texture_3d(gpu: &Gpu, label: &str, size: UVec3, format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: size.z },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}
