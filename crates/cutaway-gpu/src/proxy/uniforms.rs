//! What the shaders of the proxy are told.

use bytemuck::{Pod, Zeroable};
use cutaway_core::camera::RayGenerator;
use cutaway_core::glam::{DMat4, DVec3};
use cutaway_core::scene::Scene;

use crate::context::Capabilities;
use crate::frame::{clip_from_world, rays_of, single};

/// As `Build` in `cells.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct BuildUniforms {
    pub(crate) blocks: [u32; 3],
    pub(crate) blocks_per_unit: u32,
    pub(crate) units: [u32; 3],
    pub(crate) units_per_cell: u32,
    pub(crate) cells: [u32; 3],
    pub(crate) capacity: u32,
    pub(crate) fitted: u32,
    pub(crate) glued: u32,
    pub(crate) boundary: u32,
    pub(crate) first_slab: u32,
}

/// As `ProxyView` in `view.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct ProxyViewUniforms {
    pub(crate) clip_from_voxel: [[f32; 4]; 4],
    pub(crate) world_from_voxel_x: [f32; 3],
    pub(crate) slack: f32,
    pub(crate) world_from_voxel_y: [f32; 3],
    pub(crate) distance_unit: f32,
    pub(crate) world_from_voxel_z: [f32; 3],
    pub(crate) rounding: f32,
    pub(crate) margin: [f32; 3],
    pub(crate) unit_edge: f32,
    pub(crate) line_color: [f32; 3],
    pub(crate) mirrored: u32,
}

/// As `Limits` in `range.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct LimitsUniforms {
    pub(crate) distance_unit: f32,
    pub(crate) slack: f32,
    pub(crate) opaque: u32,
    pub(crate) nothing_above: f32,
    pub(crate) cells: [u32; 3],
    pub(crate) cell_edge: f32,
}

/// How distances of the proxy are gathered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Gathering {
    /// By blending 32-bit floats.
    Blend32,
    /// By blending 16-bit floats, rounded outward.
    Blend16,
    /// By two passes with depth tests.
    Sorted,
}

impl Gathering {
    pub(crate) fn of(capabilities: &Capabilities) -> Self {
        match capabilities {
            Capabilities { sorted_ranges: true, .. } => Self::Sorted,
            Capabilities { float_blending: true, .. } => Self::Blend32,
            _ => Self::Blend16,
        }
    }

    /// What distances are cleared to, in units of `distance_unit`.
    pub(crate) fn nothing(self) -> f64 {
        match self {
            Self::Blend16 => 60_000.0,
            _ => 1e30,
        }
    }
}

/// Share of a voxel that quads are moved outward, and that stretches are longer at both ends.
const OUTWARD: f64 = 0.01;

/// The same as a share of a pixel.
const OUTWARD_PIXEL: f64 = 0.125;

impl ProxyViewUniforms {
    pub(crate) fn new(
        scene: &Scene,
        [width, height]: [u32; 2],
        unit_edge: f32,
        gathering: Gathering,
    ) -> Self {
        let volume = scene.volume();
        let rays = rays_of(scene, [width, height]);
        let corners = volume.corners_in_world();
        let farthest = corners.iter().map(|c| rays.depth_of(*c)).fold(0.0, f64::max);
        let radius = 0.5 * (0..4).map(|c| corners[c].distance(corners[7 - c])).fold(0.0, f64::max);
        // Coordinates of 24 bits: of large volumes they are coarser than a hundredth of a voxel.
        let rounding = 4e-6 * volume.extent().max_element();
        let pixel = rays.plane(farthest.max(f64::MIN_POSITIVE)).per_x.length();
        let voxel_from_world = volume.voxel_from_world().matrix3;
        let rows = [0, 1, 2].map(|i| voxel_from_world.row(i).length());
        let margin = DVec3::from_array(rows) * (OUTWARD_PIXEL * pixel) + (OUTWARD + rounding);
        let m = volume.world_from_voxel().matrix3;
        let slack = (OUTWARD + rounding) * volume.spacing().max_element();
        let radius = radius + (0..3).map(|axis| m.col(axis).length() * margin[axis]).sum::<f64>();
        Self {
            clip_from_voxel: clip_from_world(scene, [width, height], farthest + radius)
                .mul_mat4(&DMat4::from(*volume.world_from_voxel()))
                .as_mat4()
                .to_cols_array_2d(),
            world_from_voxel_x: single(m.x_axis),
            slack: slack as f32,
            world_from_voxel_y: single(m.y_axis),
            distance_unit: (2.0 * radius * slant(&rays, [width, height])) as f32,
            world_from_voxel_z: single(m.z_axis),
            // Half a unit in the last place, twice.
            rounding: if gathering == Gathering::Blend16 { 1.0 / 512.0 } else { 0.0 },
            margin: single(margin),
            unit_edge,
            line_color: [1.0; 3],
            mirrored: u32::from(m.determinant() < 0.0),
        }
    }
}

impl ProxyViewUniforms {
    /// For geometry that is no proxy: without margin or slack.
    pub(crate) fn of_geometry(scene: &Scene, size: [u32; 2], clip_from_world: DMat4) -> Self {
        let clip_from_voxel = clip_from_world.mul_mat4(&DMat4::from(*scene.volume().world_from_voxel()));
        let clip_from_voxel = clip_from_voxel.as_mat4().to_cols_array_2d();
        let margin = [0.0; 3];
        Self { clip_from_voxel, margin, slack: 0.0, ..Self::new(scene, size, 1.0, Gathering::Blend32) }
    }
}

/// The largest ratio of a distance along a ray to the depth that it covers.
fn slant(rays: &RayGenerator, [width, height]: [u32; 2]) -> f64 {
    let plane = rays.plane(1.0);
    match rays.eye() {
        Some(eye) => plane.at(0, 0).distance(eye).max(plane.at(width, height).distance(eye)),
        None => 1.0,
    }
}
