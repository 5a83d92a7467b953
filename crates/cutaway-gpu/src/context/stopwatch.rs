//! How long the device worked on passes, where it can tell.

use super::gpu::Gpu;
use crate::error::GpuError;

/// A time on the device's clock before the first and one after the last of several passes.
#[derive(Debug)]
pub(crate) struct Stopwatch {
    times: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    mapped: wgpu::Buffer,
    /// Milliseconds of a tick.
    tick: f64,
}

/// Bytes of two times.
const BYTES: u64 = 16;

impl Stopwatch {
    /// None where the device has no timestamps.
    pub(crate) fn new(gpu: &Gpu) -> Result<Option<Self>, GpuError> {
        if !gpu.capabilities().timestamps {
            return Ok(None);
        }
        let buffer = |label, usage| {
            let size = BYTES;
            let mapped_at_creation = false;
            gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation,
            })
        };
        gpu.checked("a stopwatch", || {
            let kind = wgpu::QueryType::Timestamp;
            let (to, from) = (wgpu::BufferUsages::COPY_DST, wgpu::BufferUsages::COPY_SRC);
            Some(Self {
                times: gpu.device().create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("stopwatch"),
                    ty: kind,
                    count: 2,
                }),
                resolved: buffer("times", wgpu::BufferUsages::QUERY_RESOLVE | from),
                mapped: buffer("times on their way", wgpu::BufferUsages::MAP_READ | to),
                tick: f64::from(gpu.queue().get_timestamp_period()) * 1e-6,
            })
        })
    }

    /// What a pass is to write: when it began if it is the first, when it ended if it is the last.
    pub(crate) fn writes(&self, first: bool, last: bool) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        (first || last).then_some(wgpu::RenderPassTimestampWrites {
            query_set: &self.times,
            beginning_of_pass_write_index: first.then_some(0),
            end_of_pass_write_index: last.then_some(1),
        })
    }

    /// Milliseconds between the two times, when the device is done with the passes that wrote them; waits for that.
    pub(crate) fn milliseconds(&self, gpu: &Gpu) -> Result<f64, GpuError> {
        let what = "reading the stopwatch";
        gpu.checked(what, || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.resolve_query_set(&self.times, 0..2, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.mapped, 0, BYTES);
            gpu.queue().submit([encoder.finish()]);
        })?;
        self.mapped.map_async(wgpu::MapMode::Read, .., |_| {});
        gpu.finish()?;
        let ticks = {
            let mapped = self
                .mapped
                .get_mapped_range(..)
                .map_err(|e| GpuError::Refused { what: what.to_owned(), reason: e.to_string() })?;
            let times: [u64; 2] = bytemuck::pod_read_unaligned(&mapped);
            times[1].saturating_sub(times[0])
        };
        self.mapped.unmap();
        Ok(ticks as f64 * self.tick)
    }
}
