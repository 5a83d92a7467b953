//! From targets on the device to an image.

use cutaway_core::image::Image;

use super::Statistics;
use crate::context::Gpu;
use crate::error::GpuError;

/// What came back.
pub(crate) struct Read {
    pub(crate) image: Image,
    pub(crate) statistics: Statistics,
}

/// Depths from here on mean that nothing is there; see `NO_DEPTH` in the shader.
const NO_DEPTH: f32 = 1e30;

/// Copies a frame (colours, depths, and counts, which may be of fewer pixels) to the host and waits for it.
pub(crate) fn read(gpu: &Gpu, [colors, depths, counts]: &[wgpu::Texture; 3]) -> Result<Read, GpuError> {
    let (width, height) = (colors.width(), colors.height());
    let copies = gpu.checked("reading the image", || {
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let copies = [colors, depths, counts].map(|texture| copy(gpu, &mut encoder, texture));
        gpu.queue().submit([encoder.finish()]);
        copies
    })?;
    for copy in &copies {
        copy.buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    }
    gpu.finish()?;
    let [colors, depths, counts] = copies;
    let pixels: Vec<[f32; 4]> = bytemuck::cast_slice(&colors.bytes()?).to_vec();
    let mut depths: Vec<f32> = bytemuck::cast_slice(&depths.bytes()?).to_vec();
    for depth in depths.iter_mut().filter(|d| **d >= NO_DEPTH) {
        *depth = f32::INFINITY;
    }
    let mut statistics = Statistics::default();
    for [samples, runs] in bytemuck::cast_slice::<u8, [u32; 2]>(&counts.bytes()?) {
        statistics.rays += u64::from(*samples > 0);
        statistics.samples += u64::from(*samples);
        statistics.segments += u64::from(*runs);
    }
    let image = Image::new(width, height, pixels).and_then(|image| image.with_depth(depths));
    Ok(Read { image: image.expect("one pixel a fragment of a size that the scene has checked"), statistics })
}

/// A texture on its way to the host.
struct Copy {
    buffer: wgpu::Buffer,
    row: usize,
    padded_row: usize,
}

fn copy(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture) -> Copy {
    let size = texture.size();
    let row = size.width * texture.format().block_copy_size(None).unwrap_or(16);
    let padded_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("image on its way"),
        size: u64::from(padded_row) * u64::from(size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded_row), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        size,
    );
    Copy { buffer, row: row as usize, padded_row: padded_row as usize }
}

impl Copy {
    /// Rows without their padding.
    fn bytes(&self) -> Result<Vec<u8>, GpuError> {
        let mapped = self
            .buffer
            .get_mapped_range(..)
            .map_err(|e| GpuError::Refused { what: "reading the image".to_owned(), reason: e.to_string() })?;
        let mut bytes = Vec::with_capacity(self.row * (mapped.len() / self.padded_row));
        for row in mapped.chunks(self.padded_row) {
            bytes.extend_from_slice(&row[..self.row]);
        }
        Ok(bytes)
    }
}
