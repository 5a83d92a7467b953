//! The pipelines that bin and draw tiles.

use super::super::variant::Variant;
use crate::plumbing::{
    COMPUTE, FRAGMENT, RenderSetup, UNIFORM, compute_pipeline, floats, group_layout, render_pipeline,
    storage, texture,
};
use crate::shaders::{Shader, shader};

/// The linked shaders.
pub(crate) const TILES_MESH_SHADER: Shader = shader!(cells::tiles::mesh);
pub(crate) const TILES_BIN_SHADER: Shader = shader!(cells::tiles::bin);
pub(crate) const TILES_COMPOSITE_SHADER: Shader = shader!(cells::tiles::composite);
pub(crate) const TILES_SHOW_SHADER: Shader = shader!(cells::tiles::show);

/// Steps, and what they are bound to.
#[derive(Debug)]
pub(in super::super) struct TilePipelines {
    pub(in super::super) layouts: TileLayouts,
    pub(in super::super) key_mesh: wgpu::ComputePipeline,
    pub(in super::super) keep_mesh: wgpu::ComputePipeline,
    pub(super) sum_runs: wgpu::ComputePipeline,
    pub(super) sum_tiles: wgpu::ComputePipeline,
    pub(super) list_runs: wgpu::ComputePipeline,
    /// In parts, then whole; of each in perspective, then under parallel rays; of each by whether the adapter filters the voxels.
    composites: [[[wgpu::ComputePipeline; 2]; 2]; 2],
    pub(super) show: wgpu::RenderPipeline,
}

#[derive(Debug)]
pub(in super::super) struct TileLayouts {
    pub(in super::super) key_mesh: wgpu::BindGroupLayout,
    pub(in super::super) keep_mesh: wgpu::BindGroupLayout,
    pub(in super::super) keep_grid: wgpu::BindGroupLayout,
    pub(super) lists: wgpu::BindGroupLayout,
    pub(super) composite: wgpu::BindGroupLayout,
    pub(super) show: wgpu::BindGroupLayout,
}

fn stored(format: wgpu::TextureFormat) -> wgpu::BindingType {
    wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format,
        view_dimension: wgpu::TextureViewDimension::D2,
    }
}

impl TileLayouts {
    fn new(device: &wgpu::Device) -> Self {
        let make = |label, bindings: &[(u32, wgpu::ShaderStages, wgpu::BindingType)]| {
            group_layout(device, label, bindings)
        };
        let compute = |bindings: &[(u32, wgpu::BindingType)]| -> Vec<_> {
            bindings.iter().map(|(binding, ty)| (*binding, COMPUTE, *ty)).collect()
        };
        let (read, write) = (storage(true), storage(false));
        let d2 = wgpu::TextureViewDimension::D2;
        let words = texture(wgpu::TextureSampleType::Uint, d2);
        let floats = floats(false, d2);
        let records = stored(wgpu::TextureFormat::Rgba32Uint);
        Self {
            key_mesh: make("keys", &compute(&[(3, read), (4, read), (6, write), (7, UNIFORM), (8, read)])),
            keep_mesh: make(
                "records of a mesh",
                &compute(&[(0, UNIFORM), (1, write), (2, records), (3, read), (4, read), (5, read)]),
            ),
            keep_grid: make(
                "records of a grid",
                &compute(&[(0, UNIFORM), (1, write), (2, records), (3, UNIFORM), (4, read), (5, read)]),
            ),
            lists: make(
                "lists of tiles",
                &compute(&[
                    (0, UNIFORM),
                    (1, write),
                    (2, write),
                    (3, write),
                    (4, write),
                    (5, words),
                    (6, stored(wgpu::TextureFormat::R32Uint)),
                ]),
            ),
            composite: make(
                "tiles",
                &compute(&[
                    (0, UNIFORM),
                    (1, read),
                    (2, read),
                    (3, read),
                    (4, words),
                    (5, words),
                    (6, floats),
                    (7, write),
                    (8, stored(wgpu::TextureFormat::Rgba32Float)),
                ]),
            ),
            show: make("image in tiles", &[(0, FRAGMENT, UNIFORM), (1, FRAGMENT, read)]),
        }
    }
}

impl TilePipelines {
    /// `scene` by whether the adapter filters the voxels.
    pub(in super::super) fn new(
        device: &wgpu::Device,
        scene: &[wgpu::BindGroupLayout; 2],
        tables: &wgpu::BindGroupLayout,
    ) -> Self {
        let layouts = TileLayouts::new(device);
        let mesh = TILES_MESH_SHADER.module(device);
        let bin = TILES_BIN_SHADER.module(device);
        let composite = TILES_COMPOSITE_SHADER.module(device);
        let show = TILES_SHOW_SHADER.module(device);
        let of_mesh =
            |entry, layout| compute_pipeline(device, &mesh, entry, &[None, Some(layout), Some(tables)], &[]);
        let of_lists = |entry| compute_pipeline(device, &bin, entry, &[Some(&layouts.lists)], &[]);
        let composite = |whole: f64, parallel: f64, filterable: usize| {
            let groups = [Some(&scene[filterable]), Some(&layouts.composite), Some(tables)];
            let constants = [("WHOLE", whole), ("PARALLEL", parallel)];
            compute_pipeline(device, &composite, "composite_tiles", &groups, &constants)
        };
        let composites = [0.0, 1.0].map(|whole| {
            [0.0, 1.0].map(|parallel| [0, 1].map(|filterable| composite(whole, parallel, filterable)))
        });
        Self {
            key_mesh: of_mesh("key_mesh", &layouts.key_mesh),
            keep_mesh: of_mesh("keep_mesh", &layouts.keep_mesh),
            sum_runs: of_lists("sum_runs"),
            sum_tiles: of_lists("sum_tiles"),
            list_runs: of_lists("list_runs"),
            composites,
            show: render_pipeline(
                device,
                &show,
                ["show_all", "show_pixel"],
                &RenderSetup {
                    label: "image in tiles",
                    groups: &[Some(&layouts.show)],
                    constants: &[],
                    targets: &[Some(wgpu::TextureFormat::Rgba32Float.into())],
                },
            ),
            layouts,
        }
    }

    pub(super) fn composite(&self, variant: Variant, whole: bool) -> &wgpu::ComputePipeline {
        &self.composites[usize::from(whole)][usize::from(variant.parallel)][usize::from(variant.filterable)]
    }
}
