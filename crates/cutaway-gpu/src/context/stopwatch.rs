//! How long the device worked on passes, where it can tell.

use super::arrival::Arrival;
use super::gpu::Gpu;
use crate::error::GpuError;

/// A time on the device's clock before the first and one after the last of several passes.
#[derive(Debug)]
pub(crate) struct Stopwatch {
    times: wgpu::QuerySet,
    resolved: wgpu::Buffer,
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
            let from = wgpu::BufferUsages::COPY_SRC;
            Some(Self {
                times: gpu.device().create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("stopwatch"),
                    ty: kind,
                    count: 2,
                }),
                resolved: buffer("times", wgpu::BufferUsages::QUERY_RESOLVE | from),
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

    /// Has the two times read once the device is done with the passes that wrote them.
    pub(crate) fn submit(&self, gpu: &Gpu) -> Result<PendingTime, GpuError> {
        let mapped = gpu.checked(WHAT, || {
            let mapped = gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("times on their way"),
                size: BYTES,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.resolve_query_set(&self.times, 0..2, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &mapped, 0, BYTES);
            gpu.queue().submit([encoder.finish()]);
            mapped
        })?;
        Ok(PendingTime { times: Arrival::of(mapped, WHAT), tick: self.tick })
    }
}

const WHAT: &str = "reading the stopwatch";

/// Two times on their way to the host.
#[derive(Debug)]
pub(crate) struct PendingTime {
    times: Arrival,
    tick: f64,
}

impl PendingTime {
    /// Whether they are there.
    pub(crate) fn is_there(&self) -> bool {
        self.times.is_there()
    }

    /// Milliseconds between them, to be asked for once they are there.
    pub(crate) fn milliseconds(self) -> Result<f64, GpuError> {
        let [first, last]: [u64; 2] = self.times.bytes(bytemuck::pod_read_unaligned)?;
        Ok(last.saturating_sub(first) as f64 * self.tick)
    }
}
