//! What clipping fills for an image of one size: event lists and segments, in buffers that grow as scenes need them.

use crate::context::Gpu;
use crate::error::GpuError;

/// What the pass that makes event lists draws into, and never writes.
pub(super) const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Bytes of a node and of a segment.
const ENTRY: u64 = 16;

/// What a sweep counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SweepCounts {
    /// Nodes and segments that were asked for: more than there is room for where lists were cut short.
    pub(crate) nodes: u32,
    pub(crate) segments: u32,
    /// Lines whose events did not balance.
    pub(crate) repaired: u32,
    /// Segments that are used.
    pub(crate) kept_segments: u32,
}

/// The segments of an image, as shared/segments.wgsl reads them, and what belongs to them.
#[derive(Debug)]
pub(crate) struct SegmentBuffers {
    size: [u32; 2],
    pub(crate) ranges: wgpu::Buffer,
    pub(crate) list: wgpu::Buffer,
    /// Four numbers; see [`SweepCounts`].
    pub(crate) counters: wgpu::Buffer,
    /// A copy of them that the host can read.
    counters_read: wgpu::Buffer,
}

/// The events of an image, a list a pixel.
#[derive(Debug)]
pub(crate) struct ListBuffers {
    pub(super) heads: wgpu::Buffer,
    pub(super) nodes: wgpu::Buffer,
    /// A pass must have a target, even one that only fills buffers.
    pub(super) target: wgpu::TextureView,
}

fn buffer(
    gpu: &Gpu,
    label: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, GpuError> {
    gpu.checked(label, || {
        gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    })
}

/// A buffer of so many entries, and some more: what one frame needs, the next one needs about.
fn entries(gpu: &Gpu, of: &'static str, needed: u64) -> Result<wgpu::Buffer, GpuError> {
    let most = gpu.capabilities().max_buffer / ENTRY;
    if needed > most {
        return Err(GpuError::ClipTooLarge { of, needed, most });
    }
    let room = (needed + needed / 4).max(4096).min(most);
    buffer(gpu, of, room * ENTRY, wgpu::BufferUsages::STORAGE)
}

fn pixels([width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height)
}

fn per_pixel(gpu: &Gpu, what: &'static str, size: [u32; 2], bytes: u64) -> Result<wgpu::Buffer, GpuError> {
    let (needed, most) = (pixels(size), gpu.capabilities().max_buffer / bytes);
    if needed > most {
        return Err(GpuError::ClipTooLarge { of: "pixels", needed, most });
    }
    buffer(gpu, what, needed * bytes, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST)
}

impl SegmentBuffers {
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        use wgpu::BufferUsages as Usage;
        Ok(Self {
            size,
            ranges: per_pixel(gpu, "segments of pixels", size, 8)?,
            list: entries(gpu, "segments", pixels(size))?,
            counters: buffer(gpu, "clip counters", 16, Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST)?,
            counters_read: buffer(gpu, "clip counters", 16, Usage::MAP_READ | Usage::COPY_DST)?,
        })
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// How many segments the list holds.
    pub(crate) fn capacity(&self) -> u32 {
        u32::try_from(self.list.size() / ENTRY).unwrap_or(u32::MAX)
    }

    /// Makes room for this many segments; false if there was enough.
    pub(crate) fn grow(&mut self, gpu: &Gpu, needed: u32) -> Result<bool, GpuError> {
        if needed <= self.capacity() {
            return Ok(false);
        }
        self.list = entries(gpu, "segments", u64::from(needed))?;
        Ok(true)
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.ranges.size() + self.list.size()
    }

    /// Waits for what has been submitted and reads what it counted.
    pub(crate) fn read_counters(&self, gpu: &Gpu) -> Result<SweepCounts, GpuError> {
        gpu.checked("counting segments", || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&self.counters, 0, &self.counters_read, 0, 16);
            gpu.queue().submit([encoder.finish()]);
        })?;
        self.counters_read.map_async(wgpu::MapMode::Read, .., |_| {});
        gpu.finish()?;
        let mapped = self
            .counters_read
            .get_mapped_range(..)
            .map_err(|e| GpuError::Refused { what: "counting segments".to_owned(), reason: e.to_string() })?;
        let [nodes, segments, repaired, kept_segments] = bytemuck::pod_read_unaligned(&mapped);
        drop(mapped);
        self.counters_read.unmap();
        Ok(SweepCounts { nodes, segments, repaired, kept_segments })
    }
}

impl ListBuffers {
    pub(super) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        let target = gpu.checked("the event lists' target", || {
            let texture = gpu.device().create_texture(&wgpu::TextureDescriptor {
                label: Some("target of event lists"),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: TARGET,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        })?;
        // An object covers part of the image, twice.
        let nodes = entries(gpu, "surface crossings", pixels(size))?;
        Ok(Self { heads: per_pixel(gpu, "event lists", size, 4)?, nodes, target })
    }

    /// Makes room for this many nodes; false if there was enough.
    pub(super) fn grow(&mut self, gpu: &Gpu, needed: u32) -> Result<bool, GpuError> {
        if u64::from(needed) <= self.nodes.size() / ENTRY {
            return Ok(false);
        }
        self.nodes = entries(gpu, "surface crossings", u64::from(needed))?;
        Ok(true)
    }

    pub(super) fn bytes(&self) -> u64 {
        self.heads.size() + self.nodes.size()
    }
}
