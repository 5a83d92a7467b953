//! What the draws of a frame share, whether of a grid or of a mesh.

use std::sync::{Mutex, PoisonError};

use super::pipelines::Pipelines;
use super::variant::Variant;
use crate::clock::Moment;
use crate::context::Gpu;
use crate::error::GpuError;

/// What a frame's draws share.
pub(super) struct Drawing<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) pipelines: &'a Pipelines,
    pub(super) variant: Variant,
    pub(super) target: &'a wgpu::TextureView,
    /// The frame's colours, which the target may be a narrower form of.
    pub(super) colors: &'a wgpu::TextureView,
    pub(super) scene: &'a wgpu::BindGroup,
    pub(super) image: &'a wgpu::BindGroup,
    pub(super) tables: &'a wgpu::BindGroup,
    pub(super) piece_texels: &'a wgpu::TextureView,
    pub(super) timing: Option<&'a Mutex<Timing>>,
}

/// Setting up and drawing, one after the other.
#[derive(Debug)]
pub(super) struct Timing {
    pub(super) since: Moment,
    pub(super) setup_ms: f64,
    pub(super) draw_ms: f64,
}

impl Drawing<'_> {
    pub(super) fn set(
        &self,
        pass: &mut wgpu::RenderPass,
        pipeline: &wgpu::RenderPipeline,
        tetrahedra: &wgpu::BindGroup,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, self.scene, &[]);
        pass.set_bind_group(1, self.image, &[]);
        pass.set_bind_group(2, self.tables, &[]);
        pass.set_bind_group(3, tetrahedra, &[]);
    }

    pub(super) fn restart(&self) {
        if let Some(timing) = self.timing {
            timing.lock().unwrap_or_else(PoisonError::into_inner).since = Moment::now();
        }
    }

    /// Adds the time since the last call to setting up or to drawing.
    pub(super) fn add(&self, to: fn(&mut Timing) -> &mut f64) -> Result<(), GpuError> {
        let Some(timing) = self.timing else { return Ok(()) };
        self.gpu.finish()?;
        let mut timing = timing.lock().unwrap_or_else(PoisonError::into_inner);
        let passed = timing.since.milliseconds();
        *to(&mut timing) += passed;
        timing.since = Moment::now();
        Ok(())
    }

    pub(super) fn end_of_setup(&self) -> Result<(), GpuError> {
        self.add(|timing| &mut timing.setup_ms)
    }

    pub(super) fn end_of_drawing(&self) -> Result<(), GpuError> {
        self.add(|timing| &mut timing.draw_ms)
    }
}

/// Indices of fans of four triangles around the first of five vertices each.
pub(super) fn indices(gpu: &Gpu, tetrahedra: u64) -> wgpu::Buffer {
    const FAN: [u32; 12] = [0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1];
    let all: Vec<u32> = (0..tetrahedra as u32).flat_map(|tet| FAN.map(|vertex| 5 * tet + vertex)).collect();
    gpu.buffer("indices", bytemuck::cast_slice(&all), wgpu::BufferUsages::INDEX)
}
