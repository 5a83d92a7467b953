//! What an adapter can do beyond what all can, and what stands in for it.

use super::adapter::AdapterSummary;
use crate::error::GpuError;

/// How a value between voxels is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filtering {
    /// By the adapter's own trilinear filter.
    #[default]
    Hardware,
    /// From eight voxels, in f32.
    Exact,
}

/// Features to be treated as missing, so that what stands in for them is used.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Fallbacks {
    /// Without 16-bit normalised textures.
    pub without_norm16: bool,
    /// Without filtering of 32-bit float textures.
    pub without_float_filtering: bool,
    /// Without blending of 32-bit float targets.
    pub without_float_blending: bool,
    /// Without timestamps.
    pub without_timestamps: bool,
    /// Values between voxels are found this way, whatever the adapter's filter is like.
    pub filtering: Option<Filtering>,
    /// Voxels are kept in this format, if it is one of `R8Unorm`, `R16Unorm`, `R16Float` and `R32Float` that the device
    /// has and that holds them; 8-bit voxels fit in all, 16-bit ones not in `R8Unorm`, floats only in the two last.
    pub texel_format: Option<wgpu::TextureFormat>,
    /// Largest side of a 3D texture, if the adapter's is not smaller.
    pub max_texture_3d: Option<u32>,
    /// Largest buffer and texture in bytes, if the adapter's are not smaller.
    pub max_bytes: Option<u64>,
    /// Ends of rays at proxy geometry are found by two passes with depth tests, not by blending.
    pub sorted_ranges: bool,
}

/// What the device can do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Capabilities {
    /// 16-bit normalised textures.
    pub norm16: bool,
    /// Filtering of 32-bit float textures.
    pub float_filtering: bool,
    /// Blending of 32-bit float targets.
    pub float_blending: bool,
    /// Times of passes.
    pub timestamps: bool,
    /// A way to find values between voxels that was asked for.
    pub filtering: Option<Filtering>,
    /// A format for voxels that was asked for.
    pub texel_format: Option<wgpu::TextureFormat>,
    /// Largest side of a 3D texture.
    pub max_texture_3d: u32,
    /// Largest side of a 2D texture.
    pub max_texture_2d: u32,
    /// Largest buffer in bytes that a shader can see at once.
    pub max_buffer: u64,
    /// Largest single texture that is tried, in bytes.
    pub max_texture_bytes: u64,
    /// Ends of rays at proxy geometry are found by two passes with depth tests, not by blending.
    pub sorted_ranges: bool,
}

/// Features that are used where they are there.
pub(super) fn optional_features() -> wgpu::Features {
    wgpu::Features::TEXTURE_FORMAT_16BIT_NORM
        | wgpu::Features::FLOAT32_FILTERABLE
        | wgpu::Features::FLOAT32_BLENDABLE
        | wgpu::Features::TIMESTAMP_QUERY
}

/// The limits asked for: WebGPU's own, but as large textures and buffers as there are.
pub(super) fn limits(adapter: &wgpu::Adapter) -> wgpu::Limits {
    let there = adapter.limits();
    wgpu::Limits {
        max_texture_dimension_2d: there.max_texture_dimension_2d,
        max_texture_dimension_3d: there.max_texture_dimension_3d,
        max_buffer_size: there.max_buffer_size,
        max_storage_buffer_binding_size: there.max_storage_buffer_binding_size,
        ..wgpu::Limits::default()
    }
}

/// Whether the adapter has what every renderer here needs.
pub(super) fn check(summary: &AdapterSummary, adapter: &wgpu::Adapter) -> Result<(), GpuError> {
    let there = adapter.limits();
    let mut lacking = Vec::new();
    wgpu::Limits::default().check_limits_with_fail_fn(&there, false, |name, wanted, found| {
        lacking.push(format!("{name} is {found}, {wanted} are needed"));
    });
    if lacking.is_empty() {
        return Ok(());
    }
    Err(GpuError::Insufficient { adapter: summary.name.clone(), lacking: lacking.join("; ") })
}

impl Capabilities {
    pub(super) fn probe(device: &wgpu::Device, fallbacks: &Fallbacks) -> Self {
        let features = device.features();
        let limits = device.limits();
        let has = |feature, without: bool| features.contains(feature) && !without;
        let most = fallbacks.max_bytes.unwrap_or(u64::MAX);
        Self {
            norm16: has(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM, fallbacks.without_norm16),
            float_filtering: has(wgpu::Features::FLOAT32_FILTERABLE, fallbacks.without_float_filtering),
            float_blending: has(wgpu::Features::FLOAT32_BLENDABLE, fallbacks.without_float_blending),
            timestamps: has(wgpu::Features::TIMESTAMP_QUERY, fallbacks.without_timestamps),
            filtering: fallbacks.filtering,
            texel_format: fallbacks.texel_format,
            max_texture_3d: limits.max_texture_dimension_3d.min(fallbacks.max_texture_3d.unwrap_or(u32::MAX)),
            max_texture_2d: limits.max_texture_dimension_2d,
            max_buffer: limits.max_buffer_size.min(limits.max_storage_buffer_binding_size).min(most),
            max_texture_bytes: most,
            sorted_ranges: fallbacks.sorted_ranges,
        }
    }
}

/// What a device that can do everything can do.
#[cfg(test)]
pub(crate) fn all_capabilities() -> Capabilities {
    Capabilities {
        norm16: true,
        float_filtering: true,
        float_blending: true,
        timestamps: true,
        filtering: None,
        texel_format: None,
        max_texture_3d: 2048,
        max_texture_2d: 8192,
        max_buffer: 1 << 30,
        max_texture_bytes: 1 << 30,
        sorted_ranges: false,
    }
}
