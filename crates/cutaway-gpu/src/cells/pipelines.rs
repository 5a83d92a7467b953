//! The pipelines of the cell renderer and what they are bound to.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use super::layouts::Layouts;
use super::options::Split;
use super::pass::pass;
use super::tables::Tables;
use super::tiles::TilePipelines;
use super::variant::Variant;
use crate::classification::GpuClassification;
use crate::context::Gpu;
use crate::error::GpuError;
use crate::plumbing::{RenderSetup, bind, bind_buffers, compute_pipeline, render_pipeline};
use crate::shaders::{Shader, shader};
use crate::volume::{GpuVolume, Resident};

/// The linked shaders.
pub(crate) const DRAW_SHADER: Shader = shader!(cells::draw);
pub(crate) const SELECT_SHADER: Shader = shader!(cells::select);
pub(crate) const PROJECT_GRID_SHADER: Shader = shader!(cells::project_grid);
pub(crate) const PROJECT_MESH_SHADER: Shader = shader!(cells::project_mesh);
pub(crate) const SORT_SHADER: Shader = shader!(cells::sort);
pub(crate) const TILES_GRID_SHADER: Shader = shader!(cells::tiles::grid);
pub(crate) const WIDEN_SHADER: Shader = shader!(cells::widen);

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
                draw: DRAW_SHADER.module(device),
                select: SELECT_SHADER.module(device),
                project_grid: PROJECT_GRID_SHADER.module(device),
                keep_grid: TILES_GRID_SHADER.module(device),
                mesh,
                tiles,
                widen: render_pipeline(
                    device,
                    &WIDEN_SHADER.module(device),
                    ["widen_all", "widen_pixel"],
                    &RenderSetup {
                        label: "widen",
                        groups: &[Some(&layouts.widen)],
                        constants: &[],
                        targets: &[Some(wgpu::TextureFormat::Rgba32Float.into())],
                    },
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
        let constants = variant.of_drawing();
        let groups = [Some(scene), Some(&layouts.image), Some(&layouts.tables), Some(&layouts.draw)];
        let targets = [Some(wgpu::ColorTargetState {
            format: self.target,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        })];
        let drawn = RenderSetup { label: "cells", groups: &groups, constants: &constants, targets: &targets };
        render_pipeline(device, &self.draw, ["place_vertex", "draw_pixel"], &drawn)
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
                compute_pipeline(
                    device,
                    &self.select,
                    entry,
                    &[scene, Some(&layouts.select), tables],
                    constants,
                )
            };
            GridPipelines {
                order: select("order_blocks", &all),
                count: select("count_tetrahedra", &all),
                sum: select("sum_blocks", &all),
                list: select("list_tetrahedra", &all),
                project: compute_pipeline(
                    device,
                    &self.project_grid,
                    "project_listed",
                    &[scene, Some(&layouts.project_grid), tables],
                    &all,
                ),
                keep: compute_pipeline(
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
            gpu.device(),
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
        bind(
            gpu.device(),
            &self.layouts.image,
            &[(1, ranges.as_entire_binding()), (2, list.as_entire_binding())],
        )
    }

    pub(super) fn bind_tables(&self, gpu: &Gpu, view: &wgpu::Buffer, tables: &Tables) -> wgpu::BindGroup {
        let buffers = [view, &tables.pieces, &tables.bins, &tables.integrals];
        bind_buffers(gpu.device(), &self.layouts.tables, &buffers)
    }

    /// Copies the 16-bit target to the image.
    pub(super) fn widen(
        &self,
        gpu: &Gpu,
        from: &wgpu::TextureView,
        to: &wgpu::TextureView,
    ) -> Result<(), GpuError> {
        gpu.checked("the image of cells", || {
            let group =
                bind(gpu.device(), &self.layouts.widen, &[(0, wgpu::BindingResource::TextureView(from))]);
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

fn mesh_pipelines(device: &wgpu::Device, layouts: &Layouts) -> MeshPipelines {
    let project = PROJECT_MESH_SHADER.module(device);
    let sort = SORT_SHADER.module(device);
    let projected = |entry| {
        compute_pipeline(
            device,
            &project,
            entry,
            &[None, Some(&layouts.project_mesh), Some(&layouts.tables)],
            &[],
        )
    };
    MeshPipelines {
        points: projected("project_points"),
        tetrahedra: projected("project_tetrahedra"),
        sort: ["count_digits", "sum_digits", "move_keys", "take_order", "make_draws"]
            .map(|entry| compute_pipeline(device, &sort, entry, &[Some(&layouts.sort)], &[])),
    }
}
