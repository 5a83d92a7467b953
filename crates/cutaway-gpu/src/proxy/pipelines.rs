//! Pipelines and bindings of the proxy: its building, its two ends along rays, and its wireframe.

use super::uniforms::Gathering;
use super::{CELLS_SHADER, RANGE_SHADER, VIEW_SHADER};
use crate::context::Gpu;
use crate::error::GpuError;
use crate::plumbing::{
    COMPUTE, FRAGMENT, UNIFORM, VERTEX, bind_in_order, compute_pipeline, floats, group_layout,
    pipeline_layout, storage, texture,
};

/// What distances are gathered in; see [`Gathering`].
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;
/// What the ray caster reads: nearest distance, farthest one negated, and where opaque geometry is.
pub(crate) const RANGE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// What distances are kept in.
pub(crate) fn gathered_format(gathering: Gathering) -> wgpu::TextureFormat {
    match gathering {
        Gathering::Blend32 => wgpu::TextureFormat::Rgba32Float,
        Gathering::Blend16 => wgpu::TextureFormat::Rgba16Float,
        Gathering::Sorted => wgpu::TextureFormat::R32Float,
    }
}

/// Pipelines on a device.
#[derive(Debug)]
pub(crate) struct ProxyPipelines {
    gathering: Gathering,
    /// Boxes, quads, and the end of it.
    build: [wgpu::ComputePipeline; 3],
    build_layout: wgpu::BindGroupLayout,
    /// One that blends, or two that sort: nearest, farthest.
    gather: Vec<wgpu::RenderPipeline>,
    view_layout: wgpu::BindGroupLayout,
    lines: wgpu::RenderPipeline,
    lines_layout: wgpu::BindGroupLayout,
    /// From all of the volume, and from what was gathered.
    range: [wgpu::RenderPipeline; 2],
    range_layout: wgpu::BindGroupLayout,
    frame_layout: wgpu::BindGroupLayout,
}

impl ProxyPipelines {
    pub(crate) fn new(gpu: &Gpu, line_format: wgpu::TextureFormat) -> Result<Self, GpuError> {
        let gathering = Gathering::of(gpu.capabilities());
        gpu.checked("the proxy geometry's pipelines", || Self::make(gpu.device(), gathering, line_format))
    }

    fn make(device: &wgpu::Device, gathering: Gathering, line_format: wgpu::TextureFormat) -> Self {
        let (both, fragment, compute) = (VERTEX | FRAGMENT, FRAGMENT, COMPUTE);
        let (uniform, read, write) = (UNIFORM, storage(true), storage(false));
        let flat = wgpu::TextureViewDimension::D2;
        let (float, uint) = (floats(false, flat), texture(wgpu::TextureSampleType::Uint, flat));
        let layout = |types: &[(wgpu::ShaderStages, wgpu::BindingType)]| layout(device, types);
        let build_layout = layout(&[uniform, read, write, write, write, write].map(|ty| (compute, ty)));
        let frame_layout = layout(&[(both, uniform)]);
        let view_layout = layout(&[(both, uniform), (VERTEX, read)]);
        let lines_layout = layout(&[(both, uniform), (VERTEX, read), (fragment, float)]);
        let range_layout = layout(&[uniform, float, float, float, uint, read].map(|ty| (fragment, ty)));
        let view = VIEW_SHADER.module(device);
        let gather = match gathering {
            Gathering::Sorted => {
                vec![
                    sorting(device, &view, &[&frame_layout, &view_layout], wgpu::CompareFunction::Less),
                    sorting(device, &view, &[&frame_layout, &view_layout], wgpu::CompareFunction::Greater),
                ]
            }
            _ => {
                let target = wgpu::ColorTargetState {
                    format: gathered_format(gathering),
                    blend: Some(BLEND),
                    write_mask: wgpu::ColorWrites::ALL,
                };
                vec![
                    Drawing {
                        module: &view,
                        layouts: &[&frame_layout, &view_layout],
                        entries: ["triangle_corner", "blended_distances"],
                        target,
                        lines: false,
                        depth: None,
                    }
                    .pipeline(device),
                ]
            }
        };
        let lines = Drawing {
            module: &view,
            layouts: &[&frame_layout, &lines_layout],
            entries: ["edge_end", "line"],
            target: line_format.into(),
            lines: true,
            depth: None,
        }
        .pipeline(device);
        let range = RANGE_SHADER.module(device);
        let gathered = if gathering == Gathering::Sorted { "range_of_sorted" } else { "range_of_blended" };
        let range = ["range_of_all", gathered].map(|entry| {
            Drawing {
                module: &range,
                layouts: &[&frame_layout, &range_layout],
                entries: ["whole_range", entry],
                target: RANGE_FORMAT.into(),
                lines: false,
                depth: None,
            }
            .pipeline(device)
        });
        let build = compute_pipelines(device, &build_layout);
        Self {
            gathering,
            build,
            build_layout,
            gather,
            view_layout,
            lines,
            lines_layout,
            range,
            range_layout,
            frame_layout,
        }
    }

    pub(crate) fn gathering(&self) -> Gathering {
        self.gathering
    }

    /// Boxes, quads, and the end of it.
    pub(crate) fn build(&self) -> [&wgpu::ComputePipeline; 3] {
        self.build.each_ref()
    }

    pub(crate) fn gather(&self) -> &[wgpu::RenderPipeline] {
        &self.gather
    }

    pub(crate) fn lines(&self) -> &wgpu::RenderPipeline {
        &self.lines
    }

    pub(crate) fn range_of_all(&self) -> &wgpu::RenderPipeline {
        &self.range[0]
    }

    pub(crate) fn range_of_gathered(&self) -> &wgpu::RenderPipeline {
        &self.range[1]
    }

    pub(crate) fn bind_build(&self, gpu: &Gpu, buffers: [&wgpu::Buffer; 6]) -> wgpu::BindGroup {
        bind_in_order(gpu.device(), &self.build_layout, &buffers.map(wgpu::Buffer::as_entire_binding))
    }

    pub(crate) fn bind_frame(&self, gpu: &Gpu, frame: &wgpu::Buffer) -> wgpu::BindGroup {
        bind_in_order(gpu.device(), &self.frame_layout, &[frame.as_entire_binding()])
    }

    pub(crate) fn bind_view(&self, gpu: &Gpu, view: &wgpu::Buffer, quads: &wgpu::Buffer) -> wgpu::BindGroup {
        bind_in_order(gpu.device(), &self.view_layout, &[view.as_entire_binding(), quads.as_entire_binding()])
    }

    pub(crate) fn bind_lines(
        &self,
        gpu: &Gpu,
        view: &wgpu::Buffer,
        quads: &wgpu::Buffer,
        depths: &wgpu::TextureView,
    ) -> wgpu::BindGroup {
        let depths = wgpu::BindingResource::TextureView(depths);
        bind_in_order(
            gpu.device(),
            &self.lines_layout,
            &[view.as_entire_binding(), quads.as_entire_binding(), depths],
        )
    }

    /// `textures`: of opaque geometry, nearest, farthest, inside.
    pub(crate) fn bind_range(
        &self,
        gpu: &Gpu,
        limits: &wgpu::Buffer,
        textures: [&wgpu::TextureView; 4],
        boxes: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let [opaque, nearest, farthest, inside] = textures.map(wgpu::BindingResource::TextureView);
        let resources =
            [limits.as_entire_binding(), opaque, nearest, farthest, inside, boxes.as_entire_binding()];
        bind_in_order(gpu.device(), &self.range_layout, &resources)
    }
}

/// Distances: the least. How often a ray enters and leaves: the sum.
const BLEND: wgpu::BlendState = wgpu::BlendState {
    color: wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Min,
    },
    alpha: wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    },
};

/// A pipeline that draws with one module into one target.
struct Drawing<'a> {
    module: &'a wgpu::ShaderModule,
    layouts: &'a [&'a wgpu::BindGroupLayout],
    entries: [&'a str; 2],
    target: wgpu::ColorTargetState,
    lines: bool,
    depth: Option<wgpu::DepthStencilState>,
}

impl Drawing<'_> {
    fn pipeline(self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let layouts: Vec<_> = self.layouts.iter().map(|l| Some(*l)).collect();
        let layout = pipeline_layout(device, self.entries[1], &layouts);
        let topology = match self.lines {
            true => wgpu::PrimitiveTopology::LineList,
            false => wgpu::PrimitiveTopology::TriangleList,
        };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.entries[1]),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(self.entries[0]),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { topology, ..wgpu::PrimitiveState::default() },
            depth_stencil: self.depth,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: self.module,
                entry_point: Some(self.entries[1]),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(self.target)],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// Keeps the nearest or the farthest distance; the first also counts, in the stencil, the solids that a ray begins in.
fn sorting(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layouts: &[&wgpu::BindGroupLayout],
    compare: wgpu::CompareFunction,
) -> wgpu::RenderPipeline {
    let counting = |operation| wgpu::StencilFaceState {
        compare: wgpu::CompareFunction::Always,
        fail_op: operation,
        depth_fail_op: operation,
        pass_op: operation,
    };
    let stencil = match compare {
        wgpu::CompareFunction::Less => wgpu::StencilState {
            front: counting(wgpu::StencilOperation::DecrementWrap),
            back: counting(wgpu::StencilOperation::IncrementWrap),
            read_mask: 0xff,
            write_mask: 0xff,
        },
        _ => wgpu::StencilState::default(),
    };
    let depth = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(compare),
        stencil,
        bias: wgpu::DepthBiasState::default(),
    };
    let target = gathered_format(Gathering::Sorted).into();
    let entries = ["triangle_corner", "sorted_distance"];
    Drawing { module, layouts, entries, target, lines: false, depth: Some(depth) }.pipeline(device)
}

fn compute_pipelines(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> [wgpu::ComputePipeline; 3] {
    let module = CELLS_SHADER.module(device);
    ["find_boxes", "add_quads", "finish"]
        .map(|entry| compute_pipeline(device, &module, entry, &[Some(layout)], &[]))
}

fn layout(device: &wgpu::Device, types: &[(wgpu::ShaderStages, wgpu::BindingType)]) -> wgpu::BindGroupLayout {
    let bindings: Vec<_> =
        (0u32..).zip(types).map(|(binding, (stages, ty))| (binding, *stages, *ty)).collect();
    group_layout(device, "proxy", &bindings)
}
