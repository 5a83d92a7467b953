//! How exact the adapter's own trilinear filter is, format by format, found by trying.
//!
//! A GPU's filter has weights of eight fractional bits or more: a value between voxels is off by up to 1/256 of its
//! neighbours' difference along each axis, as if the sample lay a 256th of a voxel further, which nobody sees. A filter that
//! *rounds its result* to the format's own steps is another matter: between neighbours that differ by one or two steps of
//! 256 it makes stairs, and gradients, which are differences of such values, point anywhere. So the trial's voxels differ by
//! few steps, and the error is measured against their difference.

use wgpu::util::DeviceExt;

use super::filter_errors::FilterErrors;
use super::gpu::Gpu;
use crate::error::GpuError;
use crate::plumbing::{COMPUTE, bind_in_order, compute_pipeline, floats, group_layout_of, sampler, storage};
use crate::shaders::{Shader, shader};

/// The linked shader.
pub(crate) const SHADER: Shader = shader!(context::filter);

/// Steps of the voxels above [`BASE`]; corner c is at (c & 1, c >> 1 & 1, c >> 2).
const STEPS: [u32; 8] = [0, 3, 1, 4, 2, 0, 4, 1];
const BASE: u32 = 100;
const GREATEST_DIFFERENCE: f32 = 4.0;

/// Places that are tried: a whole number of workgroups.
const PLACES: usize = 128;

/// Tries every format that the device filters.
pub(super) fn probe(gpu: &Gpu) -> Result<FilterErrors, GpuError> {
    let can = gpu.capabilities();
    let formats = [
        (wgpu::TextureFormat::R8Unorm, true),
        (wgpu::TextureFormat::R16Float, true),
        (wgpu::TextureFormat::R16Unorm, can.norm16),
        (wgpu::TextureFormat::R32Float, can.float_filtering),
    ];
    let formats: Vec<_> = formats.into_iter().filter(|(_, there)| *there).map(|(f, _)| f).collect();
    let places = places();
    let buffers = gpu.checked("trying the filter", || Trial::new(gpu, &places).run(gpu, &formats))?;
    for buffer in &buffers {
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }
    gpu.finish()?;
    let mut errors = Vec::new();
    for (format, buffer) in formats.into_iter().zip(buffers) {
        let values = buffer.get_mapped_range(..).map_err(|e| GpuError::Refused {
            what: "reading what the filter made".to_owned(),
            reason: e.to_string(),
        })?;
        let values: &[f32] = bytemuck::cast_slice(&values);
        let error = places.iter().zip(values).fold(0.0f32, |worst, (place, value)| {
            let off = (step_of(format, *value) - exact(place)).abs() / GREATEST_DIFFERENCE;
            // A filter that makes no number at all is as bad as can be.
            if off.is_nan() { f32::INFINITY } else { worst.max(off) }
        });
        errors.push((format, error));
    }
    Ok(FilterErrors::new(errors))
}

/// Places inside the cell of the eight voxels, 0..=1 along each axis: well spread, the corners' fractions among them.
fn places() -> Vec<[f32; 3]> {
    // The generalised golden ratio of three dimensions: an even spread for any number of points.
    let ratios = [0.819_172_5, 0.671_043_6, 0.549_700_5];
    (0..PLACES).map(|i| ratios.map(|r: f32| (0.5 + i as f32 * r).fract())).collect()
}

/// Trilinear interpolation of the steps.
fn exact(place: &[f32; 3]) -> f32 {
    (0..8)
        .map(|c| (0..3).map(|axis| weight(place[axis], c >> axis & 1)).product::<f32>() * STEPS[c] as f32)
        .sum()
}

fn weight(fraction: f32, corner: usize) -> f32 {
    if corner == 1 { fraction } else { 1.0 - fraction }
}

/// Bytes of the voxels in a format.
fn voxels(format: wgpu::TextureFormat) -> Vec<u8> {
    let steps = STEPS.map(|s| BASE + s);
    match format {
        wgpu::TextureFormat::R8Unorm => steps.map(|s| s as u8).to_vec(),
        wgpu::TextureFormat::R16Unorm => bytemuck::cast_slice(&steps.map(|s| s as u16)).to_vec(),
        wgpu::TextureFormat::R16Float => {
            bytemuck::cast_slice(&steps.map(|s| half::f16::from_f32(s as f32 / 256.0).to_bits())).to_vec()
        }
        _ => bytemuck::cast_slice(&steps.map(|s| s as f32 / 256.0)).to_vec(),
    }
}

/// From what a texture of a format yields to steps above [`BASE`].
fn step_of(format: wgpu::TextureFormat, value: f32) -> f32 {
    let scale = match format {
        wgpu::TextureFormat::R8Unorm => 255.0,
        wgpu::TextureFormat::R16Unorm => 65535.0,
        _ => 256.0,
    };
    value * scale - BASE as f32
}

/// What a trial needs whatever the format.
struct Trial {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
    sampler: wgpu::Sampler,
    places: wgpu::Buffer,
}

impl Trial {
    fn new(gpu: &Gpu, places: &[[f32; 3]]) -> Self {
        let device = gpu.device();
        let shader = SHADER.module(device);
        let layout = layout(device);
        let pipeline = compute_pipeline(device, &shader, "filter_at_places", &[Some(&layout)], &[]);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        // Two voxels along each axis, whose centres are at a quarter and three quarters.
        let coordinates: Vec<[f32; 4]> =
            places.iter().map(|p| [0.25 + 0.5 * p[0], 0.25 + 0.5 * p[1], 0.25 + 0.5 * p[2], 0.0]).collect();
        let places = gpu.buffer("places", bytemuck::cast_slice(&coordinates), wgpu::BufferUsages::STORAGE);
        Self { layout, pipeline, sampler, places }
    }

    /// Submits a trial of each format; the buffers will hold the values.
    fn run(&self, gpu: &Gpu, formats: &[wgpu::TextureFormat]) -> Vec<wgpu::Buffer> {
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let buffers = formats.iter().map(|format| self.filter(gpu, *format, &mut encoder)).collect();
        gpu.queue().submit([encoder.finish()]);
        buffers
    }

    fn filter(
        &self,
        gpu: &Gpu,
        format: wgpu::TextureFormat,
        encoder: &mut wgpu::CommandEncoder,
    ) -> wgpu::Buffer {
        let device = gpu.device();
        let texture = device.create_texture_with_data(
            gpu.queue(),
            &wgpu::TextureDescriptor {
                label: Some("filter"),
                size: wgpu::Extent3d { width: 2, height: 2, depth_or_array_layers: 2 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            &voxels(format),
        );
        let size = (PLACES * size_of::<f32>()) as u64;
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("filtered"),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let values = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let read = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let resources = [
            wgpu::BindingResource::TextureView(&view),
            wgpu::BindingResource::Sampler(&self.sampler),
            self.places.as_entire_binding(),
            values.as_entire_binding(),
        ];
        let group = bind_in_order(device, &self.layout, &resources);
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(PLACES as u32 / 64, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&values, 0, &read, 0, size);
        read
    }
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let voxels = floats(true, wgpu::TextureViewDimension::D3);
    group_layout_of(device, "filter", COMPUTE, &[voxels, sampler(true), storage(true), storage(false)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::GpuOptions;
    use crate::context::filter_errors::LARGEST_ERROR;

    #[test]
    fn rounding_to_steps_is_not_exact_enough() {
        let places = places();
        let rounded = places.iter().map(|p| (exact(p).round() - exact(p)).abs() / GREATEST_DIFFERENCE);
        assert!(rounded.fold(0.0, f32::max) > 4.0 * LARGEST_ERROR);
        let eighth_bit = |f: f32| (f * 256.0).floor() / 256.0;
        let cut = places.iter().map(|p| (exact(&p.map(eighth_bit)) - exact(p)).abs() / GREATEST_DIFFERENCE);
        assert!(cut.fold(0.0, f32::max) <= LARGEST_ERROR);
    }

    #[test]
    fn an_adapter_tells_of_every_format_it_filters() {
        let gpu = match Gpu::new(&GpuOptions::default()) {
            Ok(gpu) => gpu,
            Err(e) => return println!("not run: {e}"),
        };
        println!("{:?}", gpu.filter_errors());
        for format in [wgpu::TextureFormat::R8Unorm, wgpu::TextureFormat::R16Float] {
            // Worse than rounding to the nearest voxel is no filter.
            assert!(gpu.filter_errors().of(format).is_some_and(|e| e < 0.5));
        }
        let norm16 = gpu.filter_errors().of(wgpu::TextureFormat::R16Unorm);
        assert_eq!(norm16.is_some(), gpu.capabilities().norm16);
    }
}
