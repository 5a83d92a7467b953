//! Event lists: the pipeline that fills them, and the sweep over them.

use super::buffers::{ListBuffers, SegmentBuffers, TARGET};
use super::clip::GpuClip;
use super::sweep::{Sweep, SweepInputs};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::plumbing::{
    FRAGMENT, UNIFORM, VERTEX, bind, bind_buffers, group_layout, group_layout_of, pipeline_layout, storage,
};
use crate::shaders::{Shader, shader};

/// The linked shader that makes event lists.
pub(crate) const LISTS_SHADER: Shader = shader!(clipping::lists);
/// The linked shader that sweeps over them.
pub(crate) const SWEEP_SHADER: Shader = shader!(clipping::sweep_lists);

/// Triangles of one submission on a software adapter and on a GPU: far less than 100 ms.
const TRIANGLES_AT_ONCE: [u32; 2] = [1 << 18, 1 << 22];

/// Event lists and their sweep.
#[derive(Debug)]
pub(super) struct Lists {
    pipeline: wgpu::RenderPipeline,
    frame: wgpu::BindGroupLayout,
    leaves: wgpu::BindGroupLayout,
    mesh: wgpu::BindGroupLayout,
    out: wgpu::BindGroupLayout,
    sweep: Sweep,
}

impl Lists {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let sweep = Sweep::new(gpu, SWEEP_SHADER, &[storage(true); 2])?;
        gpu.checked("the event lists' pipeline", || {
            let device = gpu.device();
            let layout =
                |stage, types: &[wgpu::BindingType]| group_layout_of(device, "event lists", stage, types);
            let frame = layout(FRAGMENT, &[UNIFORM]);
            let leaves = group_layout(device, "event lists", &[(1, VERTEX | FRAGMENT, storage(true))]);
            let mesh = layout(VERTEX, &[storage(true); 3]);
            let out = layout(FRAGMENT, &[storage(false); 3]);
            let pipeline = pipeline(device, &[&frame, &leaves, &mesh, &out]);
            Self { pipeline, frame, leaves, mesh, out, sweep }
        })
    }

    /// Submits a frame's lists and the sweep over them.
    pub(super) fn submit(
        &self,
        gpu: &Gpu,
        lists: &ListBuffers,
        inputs: &FrameInputs,
    ) -> Result<(), GpuError> {
        gpu.checked("clearing event lists", || {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&inputs.segments.counters, 0, None);
            encoder.clear_buffer(&lists.heads, 0, None);
            gpu.queue().submit([encoder.finish()]);
        })?;
        self.submit_lists(gpu, lists, inputs)?;
        let source = gpu.checked("event lists", || {
            bind_buffers(gpu.device(), self.sweep.source_layout(), &[&lists.heads, &lists.nodes])
        })?;
        let FrameInputs { frame, clip, limit, radius, segments } = *inputs;
        self.sweep.submit(gpu, &SweepInputs { frame, clip, limit, radius, segments, source: &source })
    }

    fn submit_lists(&self, gpu: &Gpu, lists: &ListBuffers, inputs: &FrameInputs) -> Result<(), GpuError> {
        let at_once = TRIANGLES_AT_ONCE[usize::from(!gpu.adapter().software)];
        for (leaf, mesh) in &inputs.clip.meshes {
            let groups = gpu.checked("event lists", || {
                let [positions, triangles, normals] = mesh.buffers();
                let device = gpu.device();
                let leaves = bind(device, &self.leaves, &[(1, inputs.clip.leaves.as_entire_binding())]);
                [
                    bind_buffers(device, &self.frame, &[inputs.frame]),
                    leaves,
                    bind_buffers(device, &self.mesh, &[positions, triangles, normals]),
                    bind_buffers(device, &self.out, &[&lists.heads, &lists.nodes, &inputs.segments.counters]),
                ]
            })?;
            for first in (0..mesh.triangles()).step_by(at_once as usize) {
                let end = mesh.triangles().min(first.saturating_add(at_once));
                gpu.checked("event lists", || {
                    let mut encoder =
                        gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                    {
                        let mut pass = begin(&mut encoder, &lists.target);
                        pass.set_pipeline(&self.pipeline);
                        for (i, group) in (0u32..).zip(&groups) {
                            pass.set_bind_group(i, group, &[]);
                        }
                        pass.draw(3 * first..3 * end, *leaf..*leaf + 1);
                    }
                    gpu.queue().submit([encoder.finish()]);
                })?;
            }
        }
        Ok(())
    }
}

/// What a frame's segments are made from, and where they go.
#[derive(Clone, Copy)]
pub(super) struct FrameInputs<'a> {
    /// The frame's uniforms.
    pub(super) frame: &'a wgpu::Buffer,
    pub(super) clip: &'a GpuClip,
    pub(super) limit: cutaway_core::clip::SegmentLimit,
    /// Half the volume's diagonal, in world units.
    pub(super) radius: f64,
    pub(super) segments: &'a SegmentBuffers,
}

fn begin<'e>(encoder: &'e mut wgpu::CommandEncoder, target: &wgpu::TextureView) -> wgpu::RenderPass<'e> {
    let ops = wgpu::Operations {
        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
        store: wgpu::StoreOp::Discard,
    };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("event lists"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops,
        })],
        ..wgpu::RenderPassDescriptor::default()
    })
}

fn pipeline(device: &wgpu::Device, layouts: &[&wgpu::BindGroupLayout]) -> wgpu::RenderPipeline {
    let layouts: Vec<_> = layouts.iter().map(|layout| Some(*layout)).collect();
    let layout = pipeline_layout(device, "event lists", &layouts);
    let module = LISTS_SHADER.module(device);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("event lists"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("mesh_corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        // Both sides of every triangle.
        primitive: wgpu::PrimitiveState { cull_mode: None, ..Default::default() },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("add_node"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: TARGET,
                blend: None,
                write_mask: wgpu::ColorWrites::empty(),
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
