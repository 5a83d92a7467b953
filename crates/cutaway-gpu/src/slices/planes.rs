//! The planes of a frame: across the view, one step apart, counted from the eye, so that no slab reaches behind it.
//!
//! Everything is in voxel space, where bricks are boxes along the axes whatever the grid is like in the world: a plane is the
//! set of points `p` with `normal.dot(p) == distance`, where `normal` is how much the depth grows a voxel along each axis.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use cutaway_core::camera::{PixelPlane, RayGenerator};
use cutaway_core::glam::{DAffine3, DMat4, DVec3};
use cutaway_core::scene::Scene;

use super::intersection::sequence;
use super::octree::{Brick, Viewpoint};
use crate::error::GpuError;
use crate::frame::RayPlane;
use crate::frame::clip_from_world;

/// As `SliceFrame` in `frame.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct SliceUniforms {
    pub(crate) clip_from_voxel: [[f32; 4]; 4],
    pub(crate) normal: [f32; 3],
    pub(crate) offset: f32,
    pub(crate) narrow_margin: [f32; 3],
    pub(crate) spacing: f32,
    pub(crate) wide_margin: [f32; 3],
    pub(crate) first_depth: f32,
    pub(crate) sequence: u32,
    pub(crate) last_plane: u32,
    pub(crate) kind: f32,
    pub(crate) length_unit: f32,
}

/// As `Brick` in `frame.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct BrickRecord {
    pub(crate) origin: [f32; 3],
    pub(crate) edge: f32,
    pub(crate) cut: u32,
    pub(crate) reserved_x: u32,
    pub(crate) reserved_y: u32,
    pub(crate) reserved_z: u32,
}

/// Planes of a frame at the most: their number must be exact in f32.
const MOST_PLANES: f64 = (1 << 20) as f64;

/// Share of a voxel that a brick is drawn larger on every side, so that rounding does not cost a pixel.
const OUTWARD: f64 = 0.01;

/// The same as a share of a pixel.
const OUTWARD_PIXEL: f64 = 0.125;

/// The corner of a box (`c & 1, c >> 1 & 1, c >> 2`) that is nearest along a normal.
pub(super) fn front_corner(normal: DVec3) -> u32 {
    (0..3).map(|axis| u32::from(normal[axis] < 0.0) << axis).sum()
}

/// The planes of a frame, and how boxes lie to them.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    normal: DVec3,
    offset: f64,
    /// Of plane 0, from the depth of the rays' points.
    first_depth: f64,
    spacing: f64,
    count: u32,
    narrow_margin: DVec3,
    wide_margin: DVec3,
    /// The far corner of the volume's box.
    extent: DVec3,
    viewpoint: Viewpoint,
    clip_from_voxel: DMat4,
    length_unit: f64,
    /// Half a box's diagonal of one voxel in each direction, in the world.
    voxel_radius: f64,
    /// Of the rays' points from the eye; pixels there in a unit of the world.
    depth: f64,
    pixels_per_unit: f64,
    pixels: f64,
}

/// The most voxels that a ray of an image passes per unit of depth: a norm, so that it is greatest at a corner.
fn most_voxels(
    rays: &RayGenerator,
    points: &PixelPlane,
    depth: f64,
    size: [u32; 2],
    voxel_from_world: &DAffine3,
) -> f64 {
    let per_depth = |point: DVec3| match rays.eye() {
        Some(eye) => (point - eye) / depth,
        None => rays.axes().forward,
    };
    let corners = [0, size[0]].into_iter().flat_map(|x| [0, size[1]].map(|y| points.at(x, y)));
    corners.map(|p| voxel_from_world.transform_vector3(per_depth(p)).length()).fold(0.0, f64::max)
}

impl Planes {
    pub(super) fn new(scene: &Scene, size: [u32; 2]) -> Result<Self, GpuError> {
        let volume = scene.volume();
        let RayPlane { rays, depth, points, radius } = RayPlane::new(scene, size);
        let m = volume.world_from_voxel().matrix3;
        let forward = rays.axes().forward;
        let normal = DVec3::new(forward.dot(m.x_axis), forward.dot(m.y_axis), forward.dot(m.z_axis));
        let origin_depth = rays.depth_of(volume.world_from_voxel().translation);
        let voxel_from_world = volume.voxel_from_world();
        // How far a ray goes along each axis of voxels, per unit of depth.
        let corners = [0, size[0]].into_iter().flat_map(|x| [0, size[1]].map(|y| points.at(x, y)));
        let most = corners.map(|point| match rays.eye() {
            Some(eye) => voxel_from_world.transform_vector3((point - eye) / depth).abs(),
            None => voxel_from_world.transform_vector3(forward).abs(),
        });
        let most = most.fold(DVec3::ZERO, DVec3::max);
        let spacing = match scene.voxels_per_step() {
            None => scene.step_length(),
            // Planes are as far apart for all rays: as near as the ray needs that crosses voxels fastest.
            Some(voxels) => voxels / most_voxels(&rays, &points, depth, size, voxel_from_world),
        };
        let extent = volume.extent();
        let depths = volume.corners_in_world().map(|corner| rays.depth_of(corner));
        let [nearest, farthest] =
            depths.iter().fold([f64::MAX, f64::MIN], |[a, b], d| [a.min(*d), b.max(*d)]);
        let pixel = rays.plane(farthest.max(f64::MIN_POSITIVE)).per_x.length();
        let rows = [0, 1, 2].map(|i| voxel_from_world.matrix3.row(i).length());
        let rounding = 4e-6 * extent.max_element();
        let narrow_margin = DVec3::from_array(rows) * (OUTWARD_PIXEL * pixel) + (OUTWARD + rounding);
        let first = (nearest.max(0.0) / spacing).floor();
        let count = ((farthest / spacing).ceil() - first).max(0.0);
        if count > MOST_PLANES {
            let smallest = (farthest - nearest.max(0.0)) / MOST_PLANES / volume.spacing().min_element();
            return Err(GpuError::TooManySlices { needed: count, most: MOST_PLANES as u32, smallest });
        }
        let direction = voxel_from_world.transform_vector3(forward);
        let clip_from_world = clip_from_world(scene, size, farthest.max(0.0) + 2.0 * radius);
        Ok(Self {
            normal,
            offset: depth - origin_depth,
            first_depth: (first + 0.5) * spacing - depth,
            spacing,
            count: count as u32,
            narrow_margin,
            wide_margin: narrow_margin + most * (0.5 * spacing),
            extent,
            viewpoint: match rays.eye() {
                Some(eye) => Viewpoint::Eye(voxel_from_world.transform_point3(eye)),
                None => Viewpoint::Direction(direction),
            },
            clip_from_voxel: clip_from_world.mul_mat4(&DMat4::from(*volume.world_from_voxel())),
            length_unit: 2.0 * radius,
            voxel_radius: 0.5
                * (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt(),
            depth: if rays.eye().is_some() { depth } else { f64::INFINITY },
            pixels_per_unit: 1.0 / points.per_x.length(),
            pixels: f64::from(size[0]) * f64::from(size[1]),
        })
    }

    /// Where bricks are seen from.
    pub(super) fn viewpoint(&self) -> Viewpoint {
        self.viewpoint
    }

    pub(super) fn uniforms(&self, kind: f64) -> SliceUniforms {
        let single = |v: DVec3| v.as_vec3().to_array();
        SliceUniforms {
            clip_from_voxel: self.clip_from_voxel.as_mat4().to_cols_array_2d(),
            normal: single(self.normal),
            offset: self.offset as f32,
            narrow_margin: single(self.narrow_margin),
            spacing: self.spacing as f32,
            wide_margin: single(self.wide_margin),
            first_depth: self.first_depth as f32,
            sequence: sequence(front_corner(self.normal)),
            last_plane: self.count.saturating_sub(1),
            kind: kind as f32,
            length_unit: self.length_unit as f32,
        }
    }

    /// Whether the slabs of some of a brick's stretches may be cut, by the volume's box or, where there is any, by clipping: then
    /// their middles lie beside their planes, by up to half a slab.
    fn may_be_cut(&self, brick: &Brick, clipped: bool) -> bool {
        let edge = f64::from(brick.edge);
        let origin = brick.origin.as_dvec3();
        let reaches_further = (self.wide_margin - edge).max_element() > 0.0;
        let at_border = origin.min_element() <= 0.0 || (self.extent - origin - edge).min_element() <= 0.0;
        clipped || reaches_further || at_border
    }

    /// What the vertex shader is told of a brick, and the instances (planes, the farthest first) that meet it.
    pub(super) fn brick(&self, brick: &Brick, clipped: bool) -> (BrickRecord, Range<u32>) {
        let cut = self.may_be_cut(brick, clipped);
        let margin = if cut { self.wide_margin } else { self.narrow_margin };
        let origin = brick.origin.as_dvec3();
        let size = (self.extent - origin).min(DVec3::splat(brick.edge.into()));
        let (lo, hi) = (origin - margin, origin + size + margin);
        let (near, far) = (self.normal * lo, self.normal * hi);
        let depth_of = |v: DVec3| v.element_sum() - self.offset - self.first_depth;
        let first = (depth_of(near.min(far)) / self.spacing).ceil().clamp(0.0, self.count.into()) as u32;
        let end = (depth_of(near.max(far)) / self.spacing + 1.0).floor().clamp(0.0, self.count.into()) as u32;
        let record = BrickRecord {
            origin: brick.origin.as_vec3().to_array(),
            edge: brick.edge as f32,
            cut: u32::from(cut),
            reserved_x: 0,
            reserved_y: 0,
            reserved_z: 0,
        };
        (record, self.count - end.max(first)..self.count - first)
    }

    /// About how many pixels a slice of a brick covers: of a ball around it, at the depth of its nearest point.
    pub(super) fn pixels_of_slice(&self, brick: &Brick) -> f64 {
        let origin = brick.origin.as_dvec3();
        let size = (self.extent - origin).min(DVec3::splat(brick.edge.into()));
        let radius = self.voxel_radius * size.max_element();
        let middle = self.normal.dot(origin + 0.5 * size) - self.offset;
        let nearer = if self.depth.is_finite() {
            ((self.depth + middle - radius) / self.depth).max(1e-6)
        } else {
            1.0
        };
        let across = 2.0 * radius * self.pixels_per_unit / nearer;
        (across * across).min(self.pixels)
    }
}
