//! What a frame tells its shader: the host's side of `shared/frame.wgsl`.

use bytemuck::{Pod, Zeroable};
use cutaway_core::camera::PixelPlane;
use cutaway_core::clip::Impregnation;
use cutaway_core::field::vanishing_gradient;
use cutaway_core::glam::DVec3;
use cutaway_core::scene::{Mode, Scene};

use super::rays::{RayPlane, single};
use crate::classification::GpuClassification;
use crate::volume::GpuVolume;

/// As `Frame` in `shared/frame.wgsl`, field by field; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct FrameUniforms {
    pub(crate) point_first: [f32; 3],
    pub(crate) step_length: f32,
    pub(crate) point_per_x: [f32; 3],
    pub(crate) base_distance: f32,
    pub(crate) point_per_y: [f32; 3],
    pub(crate) opaque_below: f32,
    pub(crate) direction_first: [f32; 3],
    pub(crate) vanishing: f32,
    pub(crate) direction_per_x: [f32; 3],
    pub(crate) ambient: f32,
    pub(crate) direction_per_y: [f32; 3],
    pub(crate) diffuse: f32,
    pub(crate) voxel_from_world_x: [f32; 3],
    pub(crate) specular: f32,
    pub(crate) voxel_from_world_y: [f32; 3],
    pub(crate) specular_power: f32,
    pub(crate) voxel_from_world_z: [f32; 3],
    pub(crate) wrap_power: f32,
    pub(crate) gradient_from_texel_x: [f32; 3],
    pub(crate) mean_diffuse: f32,
    pub(crate) gradient_from_texel_y: [f32; 3],
    pub(crate) mean_specular: f32,
    pub(crate) gradient_from_texel_z: [f32; 3],
    pub(crate) iso_opacity: f32,
    pub(crate) light: [f32; 3],
    pub(crate) headlight: u32,
    pub(crate) extent: [f32; 3],
    pub(crate) parallel: u32,
    pub(crate) table_offset: f32,
    pub(crate) table_scale: f32,
    pub(crate) table_last: u32,
    pub(crate) iso_count: u32,
    pub(crate) blocks: [u32; 3],
    pub(crate) block_edge: f32,
    pub(crate) coarse_blocks: [u32; 3],
    pub(crate) coarse_edge: f32,
    pub(crate) impregnation_depth: f32,
    pub(crate) impregnation: u32,
    pub(crate) overlay: f32,
    pub(crate) cap: u32,
    pub(crate) resolution: [u32; 2],
    pub(crate) bins_offset: f32,
    pub(crate) bins_scale: f32,
    pub(crate) bins_last: u32,
    pub(crate) nodes: u32,
    pub(crate) value_sign: f32,
    pub(crate) adaptive_threshold: f32,
    pub(crate) range_first: f32,
    pub(crate) range_scale: f32,
    pub(crate) per_block_edge: f32,
    pub(crate) per_coarse_edge: f32,
    pub(crate) per_voxels: [f32; 3],
    pub(crate) voxels_per_step: f32,
}

impl FrameUniforms {
    /// The rays of a scene's camera, a [`Lattice`] of `resolution` of its pixels, and what was prepared of the scene's volume.
    pub(crate) fn new(
        scene: &Scene,
        volume: &GpuVolume,
        classification: &GpuClassification,
        resolution: [u32; 2],
    ) -> Self {
        let mut uniforms = Self::zeroed();
        uniforms.resolution = resolution;
        uniforms.set_rays(scene);
        uniforms.set_gradient(scene, volume);
        uniforms.set_light(scene);
        uniforms.set_sampling(scene);
        uniforms.set_clip(scene);
        uniforms.set_classification(classification);
        uniforms
    }

    fn set_rays(&mut self, scene: &Scene) {
        let RayPlane { rays, depth, points: plane, .. } = RayPlane::new(scene, self.resolution);
        let voxel_from_world = scene.volume().voxel_from_world();
        let points = PixelPlane {
            first: voxel_from_world.transform_point3(plane.first),
            per_x: voxel_from_world.transform_vector3(plane.per_x),
            per_y: voxel_from_world.transform_vector3(plane.per_y),
        };
        let ways = match rays.eye() {
            Some(eye) => PixelPlane { first: plane.first - eye, ..plane },
            None => PixelPlane { first: rays.axes().forward, per_x: DVec3::ZERO, per_y: DVec3::ZERO },
        };
        self.parallel = u32::from(rays.eye().is_none());
        self.base_distance = depth as f32;
        [self.point_first, self.point_per_x, self.point_per_y] =
            [points.first, points.per_x, points.per_y].map(single);
        [self.direction_first, self.direction_per_x, self.direction_per_y] =
            [ways.first, ways.per_x, ways.per_y].map(single);
        let m = voxel_from_world.matrix3;
        [self.voxel_from_world_x, self.voxel_from_world_y, self.voxel_from_world_z] =
            [m.x_axis, m.y_axis, m.z_axis].map(single);
        self.extent = single(scene.volume().extent());
        self.per_voxels = single((scene.volume().extent() + 1.0).recip());
    }

    fn set_gradient(&mut self, scene: &Scene, volume: &GpuVolume) {
        let source = scene.volume();
        let [lo, hi] = source.value_range();
        // In units of the value range and the largest spacing, so that no volume's gradients leave what f32 can hold.
        let largest = source.spacing().max_element();
        let span = if hi > lo { hi - lo } else { 1.0 };
        let value_per_texel = source.rescale().slope * volume.texels().stored_per_texel / span;
        // Half, for differences are over two voxels.
        let m = source.voxel_from_world().matrix3.transpose() * (0.5 * value_per_texel * largest);
        [self.gradient_from_texel_x, self.gradient_from_texel_y, self.gradient_from_texel_z] =
            [m.x_axis, m.y_axis, m.z_axis].map(single);
        self.vanishing = (vanishing_gradient(source) * largest / span) as f32;
        self.value_sign = source.rescale().slope.signum() as f32;
    }

    fn set_light(&mut self, scene: &Scene) {
        let lighting = scene.lighting();
        self.ambient = lighting.ambient as f32;
        self.diffuse = lighting.diffuse as f32;
        self.specular = lighting.specular as f32;
        self.specular_power = lighting.specular_power as f32;
        self.wrap_power = lighting.wrap_power as f32;
        let (d, s) = lighting.mean_curves();
        (self.mean_diffuse, self.mean_specular) = (d as f32, s as f32);
        let light = lighting.light.and_then(|l| DVec3::from_array(l).try_normalize());
        self.headlight = u32::from(light.is_none());
        self.light = single(light.unwrap_or(DVec3::Z));
    }

    fn set_sampling(&mut self, scene: &Scene) {
        let settings = scene.settings();
        self.step_length = scene.step_length() as f32;
        self.voxels_per_step = scene.voxels_per_step().unwrap_or(0.0) as f32;
        // Of an image in f32, what is less cannot be seen.
        self.opaque_below = (1.0 - settings.early_termination).max(1e-7) as f32;
        self.adaptive_threshold = settings.adaptive_threshold.unwrap_or(1.0) as f32;
        self.iso_opacity = settings.iso_opacity as f32;
        self.iso_count = if settings.mode == Mode::Iso { settings.iso.len() as u32 } else { 0 };
    }

    fn set_clip(&mut self, scene: &Scene) {
        let shading = scene.clip_shading();
        self.overlay = shading.overlay as f32;
        self.cap = u32::from(shading.cap);
        self.impregnation_depth = scene.impregnation_depth().unwrap_or(0.0) as f32;
        self.impregnation = match shading.impregnation {
            _ if scene.impregnation_depth().is_none() => 0,
            Impregnation::None => 0,
            Impregnation::Step => 1,
            Impregnation::Linear => 2,
        };
    }

    fn set_classification(&mut self, classification: &GpuClassification) {
        let map = classification.index_map();
        (self.table_offset, self.table_scale, self.table_last) = (map.offset, map.scale, map.last);
        if let Some(tables) = classification.preintegration() {
            let map = tables.index_map();
            (self.bins_offset, self.bins_scale, self.bins_last) = (map.offset, map.scale, map.last);
            self.nodes = tables.nodes();
        }
        let blocks = classification.blocks();
        self.blocks = blocks.fine.to_array();
        self.coarse_blocks = blocks.coarse.to_array();
        let ranges = classification.range_map();
        (self.range_first, self.range_scale) = (ranges.first as f32, ranges.scale as f32);
        self.block_edge = blocks.fine_edge as f32;
        self.coarse_edge = blocks.coarse_edge as f32;
        (self.per_block_edge, self.per_coarse_edge) = (self.block_edge.recip(), self.coarse_edge.recip());
    }
}
