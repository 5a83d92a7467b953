//! The pipelines of the cell renderer and what they are bound to.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use cutaway_core::lighting::DiffuseCurve;
use cutaway_core::scene::Scene;

use super::tables::Tables;
use super::tiles::TilePipelines;
use super::{CellIntegral, CellOptions, Split};
use crate::classification::GpuClassification;
use crate::context::{Filtering, Gpu};
use crate::error::GpuError;
use crate::volume::{GpuVolume, Resident};

/// Where tetrahedra come from, as `SOURCE` in `draw.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Source {
    Basis,
    Grid,
    Mesh,
}

/// What is decided when shaders are compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    pub(super) source: Source,
    options: CellOptions,
    pub(super) parallel: bool,
    shaded: bool,
    faces_lit: bool,
    clipped: bool,
    curve: u32,
    exact: bool,
    pub(super) filterable: bool,
    brick_edge: Option<u32>,
}

impl Variant {
    pub(super) fn of(
        gpu: &Gpu,
        scene: &Scene,
        volume: &GpuVolume,
        source: Source,
        options: CellOptions,
    ) -> Self {
        let curve = match scene.lighting().diffuse_curve {
            _ if !scene.lighting().shade => 1,
            DiffuseCurve::Clamped => 0,
            DiffuseCurve::TwoSided => 1,
            DiffuseCurve::Wrapped => 2,
        };
        Self {
            source,
            options,
            parallel: scene.camera().orthographic.is_some(),
            shaded: scene.is_shaded(),
            faces_lit: scene.lighting().shade && scene.clip().is_some(),
            clipped: scene.clip().is_some(),
            curve,
            exact: volume.texels().filtering == Filtering::Exact,
            filterable: volume.texels().filterable(gpu.capabilities()),
            brick_edge: volume.brick_edge(),
        }
    }

    /// Of a grid's shaders, which read voxels.
    fn of_voxels(&self) -> [(&'static str, f64); 4] {
        let flag = |on: bool| f64::from(u8::from(on));
        [
            ("BRICKED", flag(self.brick_edge.is_some())),
            ("BRICK_EDGE", f64::from(self.brick_edge.unwrap_or(1))),
            ("EXACT_FILTERING", flag(self.exact)),
            ("SPLIT", self.split()),
        ]
    }

    fn split(&self) -> f64 {
        f64::from(self.options.split.count())
    }

    fn of_drawing(&self) -> Vec<(&'static str, f64)> {
        let flag = |on: bool| f64::from(u8::from(on));
        let source = match self.source {
            Source::Basis => 0.0,
            Source::Grid => 1.0,
            Source::Mesh => 2.0,
        };
        let integral = match self.options.integral {
            CellIntegral::Average => 0.0,
            CellIntegral::Partial => 1.0,
            CellIntegral::Exact => 2.0,
        };
        let mut constants = self.of_voxels().to_vec();
        constants.extend([
            ("SOURCE", source),
            ("INTEGRAL", integral),
            ("EXPONENTIAL_TABLE", flag(self.options.exponential_table)),
            ("SHADED", flag(self.shaded)),
            ("FACES_LIT", flag(self.faces_lit)),
            ("CLIPPED", flag(self.clipped)),
            ("DIFFUSE_CURVE", f64::from(self.curve)),
        ]);
        constants
    }
}

/// Steps that are computed for a grid.
#[derive(Clone, Debug)]
pub(super) struct GridPipelines {
    pub(super) order: wgpu::ComputePipeline,
    pub(super) count: wgpu::ComputePipeline,
    pub(super) sum: wgpu::ComputePipeline,
    pub(super) list: wgpu::ComputePipeline,
    pub(super) project: wgpu::ComputePipeline,
    /// For tiles.
    pub(super) keep: wgpu::ComputePipeline,
}

/// Steps that are computed for a mesh.
#[derive(Debug)]
pub(super) struct MeshPipelines {
    pub(super) points: wgpu::ComputePipeline,
    pub(super) tetrahedra: wgpu::ComputePipeline,
    /// Count, sum and move; then the order and the draws.
    pub(super) sort: [wgpu::ComputePipeline; 5],
}

/// How cells are cut, whether voxels can be filtered, and cells along an edge of a brick.
type GridKey = (Split, bool, Option<u32>);

/// Shaders, layouts, and a pipeline a variant.
#[derive(Debug)]
pub(super) struct Pipelines {
    draw: wgpu::ShaderModule,
    select: wgpu::ShaderModule,
    project_grid: wgpu::ShaderModule,
    keep_grid: wgpu::ShaderModule,
    pub(super) mesh: MeshPipelines,
    pub(super) tiles: TilePipelines,
    pub(super) layouts: Layouts,
    widen: wgpu::RenderPipeline,
    target: wgpu::TextureFormat,
    drawing: Mutex<HashMap<Variant, wgpu::RenderPipeline>>,
    grids: Mutex<HashMap<GridKey, GridPipelines>>,
    samplers: [wgpu::Sampler; 2],
}

/// Layouts of groups of bindings.
#[derive(Debug)]
pub(super) struct Layouts {
    /// By whether the adapter filters the voxels.
    scene: [wgpu::BindGroupLayout; 2],
    image: wgpu::BindGroupLayout,
    tables: wgpu::BindGroupLayout,
    pub(super) select: wgpu::BindGroupLayout,
    pub(super) project_grid: wgpu::BindGroupLayout,
    pub(super) project_mesh: wgpu::BindGroupLayout,
    pub(super) sort: wgpu::BindGroupLayout,
    pub(super) draw: wgpu::BindGroupLayout,
    widen: wgpu::BindGroupLayout,
}

pub(super) const COMPUTE: wgpu::ShaderStages = wgpu::ShaderStages::COMPUTE;
const VERTEX: wgpu::ShaderStages = wgpu::ShaderStages::VERTEX;
pub(super) const FRAGMENT: wgpu::ShaderStages = wgpu::ShaderStages::FRAGMENT;

fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

pub(super) fn uniform() -> wgpu::BindingType {
    buffer(wgpu::BufferBindingType::Uniform)
}

pub(super) fn storage(read_only: bool) -> wgpu::BindingType {
    buffer(wgpu::BufferBindingType::Storage { read_only })
}

pub(super) fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

pub(super) fn group_layout(
    device: &wgpu::Device,
    label: &str,
    bindings: &[(u32, wgpu::ShaderStages, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = bindings
        .iter()
        .map(|&(binding, visibility, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

impl Layouts {
    fn new(device: &wgpu::Device) -> Self {
        let make = |label, bindings: &[(u32, wgpu::ShaderStages, wgpu::BindingType)]| {
            group_layout(device, label, bindings)
        };
        let all = VERTEX | FRAGMENT | COMPUTE;
        let (read, write) = (storage(true), storage(false));
        let d3 = wgpu::TextureViewDimension::D3;
        let scene = [false, true].map(|filterable| {
            let sampler = if filterable {
                wgpu::SamplerBindingType::Filtering
            } else {
                wgpu::SamplerBindingType::NonFiltering
            };
            make(
                "scene",
                &[
                    (0, all, uniform()),
                    (1, all, texture(wgpu::TextureSampleType::Float { filterable }, d3)),
                    (2, all, wgpu::BindingType::Sampler(sampler)),
                    (3, COMPUTE, read),
                    (5, all, texture(wgpu::TextureSampleType::Uint, d3)),
                ],
            )
        });
        let flat = wgpu::TextureSampleType::Float { filterable: false };
        Self {
            scene,
            image: make("image", &[(1, FRAGMENT, read), (2, FRAGMENT, read)]),
            tables: make(
                "tables",
                &[(0, all, uniform()), (1, all, read), (2, VERTEX | COMPUTE, read), (3, FRAGMENT, read)],
            ),
            select: make(
                "select",
                &[
                    (0, COMPUTE, uniform()),
                    (1, COMPUTE, write),
                    (2, COMPUTE, write),
                    (3, COMPUTE, write),
                    (4, COMPUTE, write),
                ],
            ),
            project_grid: make(
                "project grid",
                &[
                    (0, COMPUTE, uniform()),
                    (1, COMPUTE, read),
                    (2, COMPUTE, read),
                    (3, COMPUTE, read),
                    (4, COMPUTE, write),
                ],
            ),
            project_mesh: make(
                "project mesh",
                &[
                    (0, COMPUTE, uniform()),
                    (1, COMPUTE, read),
                    (2, COMPUTE, read),
                    (3, COMPUTE, write),
                    (4, COMPUTE, read),
                    (5, COMPUTE, write),
                    (6, COMPUTE, write),
                ],
            ),
            sort: make(
                "sort",
                &[
                    (0, COMPUTE, uniform()),
                    (1, COMPUTE, read),
                    (2, COMPUTE, write),
                    (3, COMPUTE, write),
                    (4, COMPUTE, write),
                    (5, COMPUTE, write),
                    (6, COMPUTE, write),
                ],
            ),
            draw: make(
                "tetrahedra",
                &[
                    (0, VERTEX, uniform()),
                    (1, VERTEX, uniform()),
                    (2, VERTEX, read),
                    (3, VERTEX, read),
                    (4, VERTEX, read),
                    (5, VERTEX, read),
                    (6, VERTEX, read),
                ],
            ),
            widen: make("widen", &[(0, FRAGMENT, texture(flat, wgpu::TextureViewDimension::D2))]),
        }
    }
}

pub(super) fn computed(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    entry: &'static str,
    layouts: &[Option<&wgpu::BindGroupLayout>],
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: layouts,
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        module: shader,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}

impl Pipelines {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let device = gpu.device();
        gpu.checked("the cell renderer's shaders", || {
            let layouts = Layouts::new(device);
            let mesh = mesh_pipelines(device, &layouts);
            let tiles = TilePipelines::new(device, &layouts.scene, &layouts.tables);
            let samplers = [wgpu::FilterMode::Nearest, wgpu::FilterMode::Linear].map(|filter| {
                device.create_sampler(&wgpu::SamplerDescriptor {
                    label: Some("voxels"),
                    mag_filter: filter,
                    min_filter: filter,
                    ..wgpu::SamplerDescriptor::default()
                })
            });
            let blends = gpu.capabilities().float_blending;
            Self {
                draw: super::DRAW_SHADER.module(device),
                select: super::SELECT_SHADER.module(device),
                project_grid: super::PROJECT_GRID_SHADER.module(device),
                keep_grid: super::TILES_GRID_SHADER.module(device),
                mesh,
                tiles,
                widen: over_all(
                    device,
                    "widen",
                    &super::WIDEN_SHADER.module(device),
                    ["widen_all", "widen_pixel"],
                    &layouts.widen,
                ),
                layouts,
                target: if blends {
                    wgpu::TextureFormat::Rgba32Float
                } else {
                    wgpu::TextureFormat::Rgba16Float
                },
                drawing: Mutex::default(),
                grids: Mutex::default(),
                samplers,
            }
        })
    }

    /// The format that tetrahedra are blended in.
    pub(super) fn target(&self) -> wgpu::TextureFormat {
        self.target
    }

    pub(super) fn drawing(&self, gpu: &Gpu, variant: Variant) -> Result<wgpu::RenderPipeline, GpuError> {
        let mut made = self.drawing.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = made.get(&variant) {
            return Ok(pipeline.clone());
        }
        let pipeline =
            gpu.checked("the cell renderer's pipeline", || self.draw_pipeline(gpu.device(), variant))?;
        made.insert(variant, pipeline.clone());
        Ok(pipeline)
    }

    fn draw_pipeline(&self, device: &wgpu::Device, variant: Variant) -> wgpu::RenderPipeline {
        let layouts = &self.layouts;
        let scene = &layouts.scene[usize::from(variant.filterable)];
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("cells"),
            bind_group_layouts: &[
                Some(scene),
                Some(&layouts.image),
                Some(&layouts.tables),
                Some(&layouts.draw),
            ],
            immediate_size: 0,
        });
        let constants = variant.of_drawing();
        let compilation = wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("cells"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &self.draw,
                entry_point: Some("place_vertex"),
                compilation_options: compilation.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.draw,
                entry_point: Some("draw_pixel"),
                compilation_options: compilation,
                targets: &[Some(wgpu::ColorTargetState {
                    format: self.target,
                    blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    pub(super) fn grid(&self, gpu: &Gpu, variant: Variant) -> Result<GridPipelines, GpuError> {
        let key = (variant.options.split, variant.filterable, variant.brick_edge);
        let mut made = self.grids.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipelines) = made.get(&key) {
            return Ok(pipelines.clone());
        }
        let device = gpu.device();
        let pipelines = gpu.checked("the cell renderer's computations", || {
            let layouts = &self.layouts;
            let scene = Some(&layouts.scene[usize::from(variant.filterable)]);
            let tables = Some(&layouts.tables);
            let voxels = variant.of_voxels();
            // Constants that a shader does not have are an error.
            let bricks = &voxels[..2];
            let all = [bricks[0], bricks[1], voxels[3]];
            let select = |entry, constants: &[(&str, f64)]| {
                computed(device, &self.select, entry, &[scene, Some(&layouts.select), tables], constants)
            };
            GridPipelines {
                order: select("order_blocks", &all),
                count: select("count_tetrahedra", &all),
                sum: select("sum_blocks", &all),
                list: select("list_tetrahedra", &all),
                project: computed(
                    device,
                    &self.project_grid,
                    "project_listed",
                    &[scene, Some(&layouts.project_grid), tables],
                    &all,
                ),
                keep: computed(
                    device,
                    &self.keep_grid,
                    "keep_grid",
                    &[scene, Some(&self.tiles.layouts.keep_grid), tables],
                    &all,
                ),
            }
        })?;
        made.insert(key, pipelines.clone());
        Ok(pipelines)
    }

    /// Voxels and what a frame tells all shaders.
    pub(super) fn bind_scene(
        &self,
        gpu: &Gpu,
        frame: &wgpu::Buffer,
        volume: &GpuVolume,
        classification: &GpuClassification,
        resident: &Resident,
    ) -> wgpu::BindGroup {
        let filterable = usize::from(volume.texels().filterable(gpu.capabilities()));
        bind(
            gpu,
            &self.layouts.scene[filterable],
            &[
                (0, frame.as_entire_binding()),
                (1, wgpu::BindingResource::TextureView(&resident.voxels)),
                (2, wgpu::BindingResource::Sampler(&self.samplers[filterable])),
                (3, classification.occupied().as_entire_binding()),
                (5, wgpu::BindingResource::TextureView(&resident.pages)),
            ],
        )
    }

    pub(super) fn bind_image(&self, gpu: &Gpu, segments: [&wgpu::Buffer; 2]) -> wgpu::BindGroup {
        let [ranges, list] = segments;
        bind(gpu, &self.layouts.image, &[(1, ranges.as_entire_binding()), (2, list.as_entire_binding())])
    }

    pub(super) fn bind_tables(&self, gpu: &Gpu, view: &wgpu::Buffer, tables: &Tables) -> wgpu::BindGroup {
        let buffers = [view, &tables.pieces, &tables.bins, &tables.integrals];
        bind_buffers(gpu, &self.layouts.tables, &buffers)
    }

    /// Copies the 16-bit target to the image.
    pub(super) fn widen(
        &self,
        gpu: &Gpu,
        from: &wgpu::TextureView,
        to: &wgpu::TextureView,
    ) -> Result<(), GpuError> {
        gpu.checked("the image of cells", || {
            let group = bind(gpu, &self.layouts.widen, &[(0, wgpu::BindingResource::TextureView(from))]);
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = pass(&mut encoder, to, Some(wgpu::Color::TRANSPARENT));
                pass.set_pipeline(&self.widen);
                pass.set_bind_group(0, &group, &[]);
                pass.draw(0..3, 0..1);
            }
            gpu.queue().submit([encoder.finish()]);
        })
    }
}

/// A pass that draws into one view, cleared first or not.
pub(super) fn pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
    clear: Option<wgpu::Color>,
) -> wgpu::RenderPass<'e> {
    let load = clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear);
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("cells"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops,
        })],
        ..wgpu::RenderPassDescriptor::default()
    })
}

pub(super) fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: &[(u32, wgpu::BindingResource)],
) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry> = resources
        .iter()
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding: *binding, resource: resource.clone() })
        .collect();
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// Buffers at the bindings from 0 on.
pub(super) fn bind_buffers(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let resources: Vec<(u32, wgpu::BindingResource)> =
        (0u32..).zip(buffers.iter().map(|b| b.as_entire_binding())).collect();
    bind(gpu, layout, &resources)
}

fn mesh_pipelines(device: &wgpu::Device, layouts: &Layouts) -> MeshPipelines {
    let project = super::PROJECT_MESH_SHADER.module(device);
    let sort = super::SORT_SHADER.module(device);
    let projected = |entry| {
        computed(device, &project, entry, &[None, Some(&layouts.project_mesh), Some(&layouts.tables)], &[])
    };
    MeshPipelines {
        points: projected("project_points"),
        tetrahedra: projected("project_tetrahedra"),
        sort: ["count_digits", "sum_digits", "move_keys", "take_order", "make_draws"]
            .map(|entry| computed(device, &sort, entry, &[Some(&layouts.sort)], &[])),
    }
}

/// Draws one triangle over a whole image of floats.
pub(super) fn over_all(
    device: &wgpu::Device,
    label: &'static str,
    shader: &wgpu::ShaderModule,
    [vertex, fragment]: [&'static str; 2],
    group: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(group)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba32Float.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
