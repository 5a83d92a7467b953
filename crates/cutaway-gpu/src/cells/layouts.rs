//! The layouts that the cell renderer's shaders are bound by.

use crate::plumbing::{COMPUTE, FRAGMENT, UNIFORM, VERTEX, floats, group_layout, sampler, storage, texture};

/// Layouts of groups of bindings.
#[derive(Debug)]
pub(super) struct Layouts {
    /// By whether the adapter filters the voxels.
    pub(super) scene: [wgpu::BindGroupLayout; 2],
    pub(super) image: wgpu::BindGroupLayout,
    pub(super) tables: wgpu::BindGroupLayout,
    pub(super) select: wgpu::BindGroupLayout,
    pub(super) project_grid: wgpu::BindGroupLayout,
    pub(super) project_mesh: wgpu::BindGroupLayout,
    pub(super) sort: wgpu::BindGroupLayout,
    pub(super) draw: wgpu::BindGroupLayout,
    pub(super) widen: wgpu::BindGroupLayout,
}

impl Layouts {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let make = |label, bindings: &[(u32, wgpu::ShaderStages, wgpu::BindingType)]| {
            group_layout(device, label, bindings)
        };
        let all = VERTEX | FRAGMENT | COMPUTE;
        let (read, write) = (storage(true), storage(false));
        let d3 = wgpu::TextureViewDimension::D3;
        let scene = [false, true].map(|filterable| {
            make(
                "scene",
                &[
                    (0, all, UNIFORM),
                    (1, all, floats(filterable, d3)),
                    (2, all, sampler(filterable)),
                    (3, COMPUTE, read),
                    (5, all, texture(wgpu::TextureSampleType::Uint, d3)),
                ],
            )
        });
        Self {
            scene,
            image: make("image", &[(1, FRAGMENT, read), (2, FRAGMENT, read)]),
            tables: make(
                "tables",
                &[(0, all, UNIFORM), (1, all, read), (2, VERTEX | COMPUTE, read), (3, FRAGMENT, read)],
            ),
            select: make(
                "select",
                &[
                    (0, COMPUTE, UNIFORM),
                    (1, COMPUTE, write),
                    (2, COMPUTE, write),
                    (3, COMPUTE, write),
                    (4, COMPUTE, write),
                ],
            ),
            project_grid: make(
                "project grid",
                &[
                    (0, COMPUTE, UNIFORM),
                    (1, COMPUTE, read),
                    (2, COMPUTE, read),
                    (3, COMPUTE, read),
                    (4, COMPUTE, write),
                ],
            ),
            project_mesh: make(
                "project mesh",
                &[
                    (0, COMPUTE, UNIFORM),
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
                    (0, COMPUTE, UNIFORM),
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
                    (0, VERTEX, UNIFORM),
                    (1, VERTEX, UNIFORM),
                    (2, VERTEX, read),
                    (3, VERTEX, read),
                    (4, VERTEX, read),
                    (5, VERTEX, read),
                    (6, VERTEX, read),
                ],
            ),
            widen: make("widen", &[(0, FRAGMENT, floats(false, wgpu::TextureViewDimension::D2))]),
        }
    }
}
