//! From targets on the device to an image.

use cutaway_core::image::Image;

use super::fetches::FetchCounts;
use super::targets::NO_DEPTH;
use crate::context::{Arrival, Gpu};
use crate::error::GpuError;

/// What came back.
pub(crate) struct Read {
    pub(crate) image: Image,
    /// What its rays took.
    pub(crate) taken: Taken,
    /// Texture fetches of every ray.
    pub(crate) fetches: FetchCounts,
}

/// What all rays of a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Taken {
    /// Rays that met something.
    pub(crate) rays: u64,
    /// Values of the field.
    pub(crate) samples: u64,
    /// Stretches of occupied blocks.
    pub(crate) stretches: u64,
    /// The share of steps at which the field was not looked at, 0..=1.
    pub(crate) skipped_fraction: f64,
}

/// A frame on its way to the host.
#[derive(Debug)]
pub(crate) struct Reading {
    size: [u32; 2],
    colors: Copy,
    rest: Option<DepthsAndCounts>,
}

#[derive(Debug)]
struct DepthsAndCounts {
    depths: Copy,
    counts: Copy,
    /// Rays along x and y.
    counted: [u32; 2],
}

impl Reading {
    /// Submits the copies of a frame: colours, depths, and counts, which may be of fewer pixels.
    pub(crate) fn begin(gpu: &Gpu, [colors, depths, counts]: &[wgpu::Texture; 3]) -> Result<Self, GpuError> {
        let size = [colors.width(), colors.height()];
        let counted = [counts.width(), counts.height()];
        let [colors, depths, counts] = copies(gpu, [colors, depths, counts])?;
        Ok(Self { size, colors, rest: Some(DepthsAndCounts { depths, counts, counted }) })
    }

    /// Submits the copy of colours alone.
    pub(crate) fn begin_colors(gpu: &Gpu, colors: &wgpu::Texture) -> Result<Self, GpuError> {
        let size = [colors.width(), colors.height()];
        let [colors] = copies(gpu, [colors])?;
        Ok(Self { size, colors, rest: None })
    }

    /// Whether all of it is there.
    pub(crate) fn is_there(&self) -> bool {
        let rest = self.rest.iter().flat_map(|rest| [&rest.depths, &rest.counts]);
        rest.chain([&self.colors]).all(|copy| copy.arrival.is_there())
    }

    /// What came back, to be called once it is there.
    pub(crate) fn read(self) -> Result<Read, GpuError> {
        let [width, height] = self.size;
        let image = Image::new(width, height, self.colors.texels()?);
        let Some(DepthsAndCounts { depths, counts, counted }) = self.rest else {
            let fetches = FetchCounts::new([0; 2], Vec::new());
            return Ok(Read { image: image.expect(CHECKED), taken: Taken::default(), fetches });
        };
        let mut depths: Vec<f32> = depths.texels()?;
        for depth in depths.iter_mut().filter(|d| **d >= NO_DEPTH) {
            *depth = f32::INFINITY;
        }
        let counts: Vec<PixelCounts> = counts.texels()?.iter().map(PixelCounts::unpacked).collect();
        let fetches = FetchCounts::new(counted, counts.iter().map(|c| c.samples).collect());
        let image = image.and_then(|image| image.with_depth(depths));
        Ok(Read { image: image.expect(CHECKED), taken: sum(&counts), fetches })
    }
}

const CHECKED: &str = "one pixel a fragment of a size that the scene has checked";

/// Submits the copies of textures to where the host can read them.
fn copies<const N: usize>(gpu: &Gpu, textures: [&wgpu::Texture; N]) -> Result<[Copy; N], GpuError> {
    let copies = gpu.checked(WHAT, || {
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let copies = textures.map(|texture| copy(gpu, &mut encoder, texture));
        gpu.queue().submit([encoder.finish()]);
        copies
    })?;
    Ok(copies.map(|(buffer, row, padded_row)| Copy { arrival: Arrival::of(buffer, WHAT), row, padded_row }))
}

const WHAT: &str = "reading the image";

/// What a pixel's ray took: `packed_counts` of `pixel.wgsl`, unpacked.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PixelCounts {
    samples: u32,
    stretches: u32,
    steps: f64,
    taken: f64,
}

impl PixelCounts {
    fn unpacked(&[counts, steps]: &[u32; 2]) -> Self {
        let (steps, share) = (f64::from(steps & 0xf_ffff), f64::from(steps >> 20) / 4095.0);
        Self { samples: counts & 0x3f_ffff, stretches: counts >> 22, steps, taken: steps * share }
    }
}

fn sum(counts: &[PixelCounts]) -> Taken {
    let mut sum = Taken::default();
    let (mut steps, mut taken) = (0.0, 0.0);
    for c in counts {
        sum.rays += u64::from(c.samples > 0);
        sum.samples += u64::from(c.samples);
        sum.stretches += u64::from(c.stretches);
        steps += c.steps;
        taken += c.taken;
    }
    sum.skipped_fraction = if steps > 0.0 { (1.0 - taken / steps).max(0.0) } else { 0.0 };
    sum
}

/// A texture on its way to the host.
#[derive(Debug)]
struct Copy {
    arrival: Arrival,
    row: usize,
    padded_row: usize,
}

/// A buffer that a texture is copied to, and the bytes of a row: those of texels, and all.
fn copy(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    texture: &wgpu::Texture,
) -> (wgpu::Buffer, usize, usize) {
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
    (buffer, row as usize, padded_row as usize)
}

impl Copy {
    /// Rows without their padding.
    fn texels<T: bytemuck::Pod>(&self) -> Result<Vec<T>, GpuError> {
        self.arrival.bytes(|mapped| {
            let rows = mapped.len() / self.padded_row;
            let mut texels = Vec::with_capacity(rows * self.row / size_of::<T>());
            for row in mapped.chunks(self.padded_row) {
                texels.extend_from_slice(bytemuck::cast_slice(&row[..self.row]));
            }
            texels
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_come_out_of_their_words() {
        let counts = PixelCounts::unpacked(&[700 | 5 << 22, 80 | 819 << 20]);
        assert_eq!(counts, PixelCounts { samples: 700, stretches: 5, steps: 80.0, taken: 16.0 });
        let taken = sum(&[counts, PixelCounts::unpacked(&[0, 0])]);
        assert_eq!((taken.rays, taken.samples, taken.stretches), (1, 700, 5));
        assert!((taken.skipped_fraction - 0.8).abs() < 1e-12);
        assert_eq!(sum(&[]).skipped_fraction, 0.0);
    }
}
