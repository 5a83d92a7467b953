//! How the shaders of blocks are run.

use bytemuck::Pod;
use cutaway_core::glam::UVec3;

use crate::context::Gpu;

/// A task, for a shader to read.
pub(super) fn uniform(gpu: &Gpu, task: &impl Pod) -> wgpu::Buffer {
    gpu.buffer("task", bytemuck::bytes_of(task), wgpu::BufferUsages::UNIFORM)
}

/// Workgroups for so many items.
pub(super) fn groups_of(items: UVec3, per_group: UVec3) -> UVec3 {
    UVec3::new(items.x.div_ceil(per_group.x), items.y.div_ceil(per_group.y), items.z.div_ceil(per_group.z))
}

/// Submits one dispatch of so many workgroups.
pub(super) fn dispatch(gpu: &Gpu, pipeline: &wgpu::ComputePipeline, group: &wgpu::BindGroup, groups: UVec3) {
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(groups.x, groups.y, groups.z);
    }
    gpu.queue().submit([encoder.finish()]);
}
