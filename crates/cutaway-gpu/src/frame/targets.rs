//! What a frame is drawn into, and the tiles that it is drawn in.

use crate::context::Gpu;
use crate::error::GpuError;

/// Premultiplied colour; world distance from the eye; values taken and stretches crossed.
pub(crate) const FORMATS: [wgpu::TextureFormat; 3] =
    [wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::R32Float, wgpu::TextureFormat::Rg32Uint];

/// Depths from here on mean that nothing is there: `NO_DEPTH` in `shared/ray.wgsl`.
pub(crate) const NO_DEPTH: f32 = 1e30;

/// The textures that a frame of one size is drawn into.
#[derive(Debug)]
pub(crate) struct Targets {
    size: [u32; 2],
    textures: [wgpu::Texture; 3],
    views: [wgpu::TextureView; 3],
}

impl Targets {
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        check_size(gpu, size)?;
        let textures = gpu.checked("the image", || {
            FORMATS.map(|format| {
                // Cells may be composited by compute shaders.
                let stored = match format {
                    wgpu::TextureFormat::Rgba32Float => wgpu::TextureUsages::STORAGE_BINDING,
                    _ => wgpu::TextureUsages::empty(),
                };
                gpu.device().create_texture(&wgpu::TextureDescriptor {
                    label: Some("image"),
                    size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                        | wgpu::TextureUsages::TEXTURE_BINDING
                        | wgpu::TextureUsages::COPY_SRC
                        | wgpu::TextureUsages::COPY_DST
                        | stored,
                    view_formats: &[],
                })
            })
        })?;
        let views =
            [0, 1, 2].map(|i: usize| textures[i].create_view(&wgpu::TextureViewDescriptor::default()));
        Ok(Self { size, textures, views })
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    pub(crate) fn bytes(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1]) * 28
    }

    pub(crate) fn textures(&self) -> &[wgpu::Texture; 3] {
        &self.textures
    }

    pub(crate) fn views(&self) -> &[wgpu::TextureView; 3] {
        &self.views
    }

    /// A pass that draws into them; the first of a frame clears them.
    pub(crate) fn pass<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        first: bool,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'e> {
        let load = if first { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
        let attachment = |view| {
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("raycast"),
            color_attachments: &[
                attachment(&self.views[0]),
                attachment(&self.views[1]),
                attachment(&self.views[2]),
            ],
            timestamp_writes,
            ..wgpu::RenderPassDescriptor::default()
        })
    }
}

/// An error that names the limit that an image of this size exceeds.
fn check_size(gpu: &Gpu, [width, height]: [u32; 2]) -> Result<(), GpuError> {
    let refused = |reason| Err(GpuError::ImageTooLarge { width, height, reason });
    let most = gpu.capabilities().max_texture_2d;
    if width.max(height) > most {
        return refused(format!("its images have at most {most} pixels along a side"));
    }
    let row = (u64::from(width) * 16).next_multiple_of(u64::from(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT));
    let (bytes, most) = (row * u64::from(height), gpu.device().limits().max_buffer_size);
    if bytes > most {
        return refused(format!("{bytes} bytes are needed to hand it back, its buffers have at most {most}"));
    }
    Ok(())
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TileRect {
    pub(crate) x: u32,
    pub(crate) y: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// Samples that a software adapter takes in 100 ms at the least (shaded, two cores), and a GPU.
pub(crate) const SAMPLES_AT_ONCE: [f64; 2] = [4e6, 1e9];

/// Tiles of an image whose rays have up to `steps` steps, each small enough for one submission.
pub(crate) fn tiles([width, height]: [u32; 2], steps: f64, software: bool) -> Vec<TileRect> {
    let pixels = SAMPLES_AT_ONCE[usize::from(!software)] / steps.max(1.0);
    // Bands of the image: a software rasteriser hands out squares of 64 pixels a side to its threads, and a tile of one such
    // square would leave all but one of them idle. Pixels go in blocks of four rows at most.
    let across = ((pixels / 4.0) as u32).clamp(64, width.max(64));
    let down = (pixels / f64::from(across)).clamp(4.0, 16384.0) as u32 / 4 * 4;
    let rows = (0..height).step_by(down as usize);
    rows.flat_map(|y| (0..width).step_by(across as usize).map(move |x| (x, y)))
        .map(|(x, y)| TileRect { x, y, width: across.min(width - x), height: down.min(height - y) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (size, steps, software) in
            [([67, 45], 1.0, true), ([512, 300], 1e3, true), ([4096, 2160], 1e5, false)]
        {
            let tiles = tiles(size, steps, software);
            let covered: u64 = tiles.iter().map(|t| u64::from(t.width) * u64::from(t.height)).sum();
            assert_eq!(covered, u64::from(size[0]) * u64::from(size[1]));
            let inside = |t: &TileRect| t.x + t.width <= size[0] && t.y + t.height <= size[1] && t.width > 0;
            assert!(tiles.iter().all(inside));
        }
    }
}
