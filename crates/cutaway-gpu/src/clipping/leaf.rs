//! The objects of a clip as the shaders see them: the host's side of `leaf.wgsl`.

use std::any::Any;

use bytemuck::{Pod, Zeroable};
use cutaway_core::camera::Ray;
use cutaway_core::clip::{AxisBox, Crossing, FlatLeaf, Plane, Solid, Sphere};
use cutaway_core::glam::{DAffine3, DMat3, DVec3};
use cutaway_mesh::MeshSolid;

use super::mesh::LocalSpace;
use crate::frame::{RayPlane, off_axis};

/// Where a value goes that is the expression's own.
pub(super) const ROOT: u32 = u32::MAX;

/// As `Leaf` in `leaf.wgsl`, field by field; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Leaf {
    pub(crate) linear_x: [f32; 3],
    pub(crate) kind: u32,
    pub(crate) linear_y: [f32; 3],
    pub(crate) eye_winding: i32,
    pub(crate) linear_z: [f32; 3],
    pub(crate) inverted: u32,
    pub(crate) first: [f32; 3],
    pub(crate) mirrored: u32,
    pub(crate) per_x: [f32; 3],
    pub(crate) output: u32,
    pub(crate) per_y: [f32; 3],
    pub(crate) bare: u32,
    pub(crate) second: [f32; 3],
    pub(crate) reserved_second: u32,
    pub(crate) clip_x: [f32; 4],
    pub(crate) clip_y: [f32; 4],
    pub(crate) clip_z: [f32; 4],
    pub(crate) clip_w: [f32; 4],
}

const MESH: u32 = 0;
const PLANE: u32 = 1;
const BOX: u32 = 2;
const BALL: u32 = 3;

/// The plane before the eye at which meshes begin, as a fraction of the volume's radius; what lies before it counts as
/// behind the eye.
const NEAREST: f64 = 1e-6;

/// A camera as far as objects see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClipCamera {
    plane: RayPlane,
    /// The eye; where rays are parallel, any point on the camera's axis.
    origin: DVec3,
    /// Half the width and height of the image: at depth 1, or anywhere where rays are parallel.
    half_size: [f64; 2],
    /// Of the image's middle, in halves of its size.
    off_axis: [f64; 2],
}

impl ClipCamera {
    pub(crate) fn new(plane: RayPlane, size: [u32; 2]) -> Self {
        let pixel = plane.rays.plane(1.0).per_x.length();
        let [width, height] = size.map(f64::from);
        let origin = plane.rays.on_axis(0.0);
        let off_axis = off_axis(&plane.rays, size);
        Self { plane, origin, half_size: [0.5 * pixel * width, 0.5 * pixel * height], off_axis }
    }

    /// Half the volume's diagonal, in world units.
    pub(super) fn radius(&self) -> f64 {
        self.plane.radius
    }

    /// Rows of clip_from_world: x, y, z, w, each a direction and what is added.
    fn clip_from_world(&self) -> [(DVec3, f64); 4] {
        let axes = self.plane.rays.axes();
        let row = |v: DVec3| (v, -v.dot(self.origin));
        let w = match self.plane.rays.eye() {
            Some(_) => row(axes.forward),
            None => (DVec3::ZERO, 1.0),
        };
        let side = |axis: DVec3, i: usize| {
            let (along, at) = row(axis / self.half_size[i]);
            (along + w.0 * self.off_axis[i], at + w.1 * self.off_axis[i])
        };
        let depth = match self.plane.rays.eye() {
            Some(_) => (w.0, w.1 - NEAREST * self.plane.radius),
            // The whole line of a parallel ray, behind its origin too.
            None => (DVec3::ZERO, 0.5),
        };
        [side(axes.right, 0), side(axes.up, 1), depth, w]
    }

    /// How many times the eye is inside a mesh.
    ///
    /// A line that is not crossed as often in as out says nothing reliable; others are tried before it is believed.
    fn eye_winding(&self, solid: &MeshSolid, object_from_world: &DAffine3) -> i32 {
        let Some(eye) = self.plane.rays.eye() else { return 0 };
        let axes = self.plane.rays.axes();
        let origin = eye + axes.forward * (NEAREST * self.plane.radius);
        let [low, high] = solid.bounds();
        let in_object = object_from_world.transform_point3(origin);
        if in_object.cmplt(low).any() || in_object.cmpgt(high).any() {
            return 0;
        }
        let sum_along = |direction: DVec3| {
            let mut events = Vec::new();
            let direction = object_from_world.transform_vector3(direction);
            solid.events(&Ray { origin: in_object, direction }, &mut events);
            let sign = |crossing| if crossing == Crossing::Entering { 1 } else { -1 };
            let before: i32 = events.iter().filter(|e| e.t < 0.0).map(|e| sign(e.crossing)).sum();
            (before, events.iter().map(|e| sign(e.crossing)).sum::<i32>() == 0)
        };
        let tries = [axes.forward, axes.right, axes.up, axes.right + axes.up, axes.forward - axes.up];
        let found = tries.map(sum_along);
        found.iter().find(|(_, balanced)| *balanced).unwrap_or(&found[0]).0
    }
}

impl Leaf {
    /// None where no shader knows the solid.
    pub(crate) fn new(leaf: &FlatLeaf, view: &ClipCamera) -> Option<Self> {
        let solid: &dyn Any = leaf.solid.as_ref();
        let pose = leaf.object_from_world();
        let mut uniforms = if let Some(mesh) = solid.downcast_ref::<MeshSolid>() {
            Self::mesh(mesh, pose, view)
        } else if let Some(plane) = solid.downcast_ref::<Plane>() {
            Self::plane(plane, pose, view)
        } else if let Some(cube) = solid.downcast_ref::<AxisBox>() {
            Self::cube(cube, pose, view)
        } else if let Some(ball) = solid.downcast_ref::<Sphere>() {
            Self::ball(ball, pose, view)
        } else {
            return None;
        };
        let output = leaf.output();
        uniforms.output = output.gate.unwrap_or(ROOT);
        uniforms.inverted = u32::from(output.inverted);
        Some(uniforms)
    }

    fn of(kind: u32, linear: DMat3) -> Self {
        let mut leaf = Self::zeroed();
        leaf.kind = kind;
        [leaf.linear_x, leaf.linear_y, leaf.linear_z] =
            [linear.x_axis, linear.y_axis, linear.z_axis].map(single);
        leaf
    }

    fn mesh(solid: &MeshSolid, object_from_world: &DAffine3, view: &ClipCamera) -> Self {
        let frame = LocalSpace::of(solid.mesh());
        let local_from_world = frame.local_from_object() * *object_from_world;
        let world_from_local = local_from_world.inverse();
        let mut leaf = Self::of(MESH, local_from_world.matrix3);
        leaf.set_points(&local_from_world, view);
        leaf.mirrored = u32::from(local_from_world.matrix3.determinant() < 0.0);
        leaf.eye_winding = view.eye_winding(solid, object_from_world);
        [leaf.clip_x, leaf.clip_y, leaf.clip_z, leaf.clip_w] = view.clip_from_world().map(|(row, at)| {
            let m = world_from_local.matrix3;
            let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|column| row.dot(column) as f32);
            [x, y, z, (row.dot(world_from_local.translation) + at) as f32]
        });
        leaf
    }

    fn plane(plane: &Plane, object_from_world: &DAffine3, view: &ClipCamera) -> Self {
        // The normal as a covector in the world; along it all numbers are world lengths.
        let normal = object_from_world.matrix3.transpose() * plane.normal();
        let gap = |p: DVec3| plane.distance() - plane.normal().dot(object_from_world.transform_point3(p));
        let scale = 1.0 / normal.length();
        let points = &view.plane.points;
        let row = normal * scale;
        let linear = DMat3::from_cols(DVec3::X * row.x, DVec3::X * row.y, DVec3::X * row.z);
        let mut leaf = Self::of(PLANE, linear);
        leaf.first = single(DVec3::X * (gap(points.first) * scale));
        leaf.per_x = single(DVec3::X * -row.dot(points.per_x));
        leaf.per_y = single(DVec3::X * -row.dot(points.per_y));
        leaf
    }

    fn cube(cube: &AxisBox, object_from_world: &DAffine3, view: &ClipCamera) -> Self {
        let mut leaf = Self::of(BOX, object_from_world.matrix3);
        let points = &view.plane.points;
        let point = object_from_world.transform_point3(points.first);
        leaf.first = single(cube.min() - point);
        leaf.second = single(cube.max() - point);
        leaf.per_x = single(-object_from_world.transform_vector3(points.per_x));
        leaf.per_y = single(-object_from_world.transform_vector3(points.per_y));
        leaf
    }

    fn ball(ball: &Sphere, object_from_world: &DAffine3, view: &ClipCamera) -> Self {
        let to_unit = DAffine3::from_scale(DVec3::splat(1.0 / ball.radius()))
            * DAffine3::from_translation(-ball.center());
        let unit_from_world = to_unit * *object_from_world;
        let mut leaf = Self::of(BALL, unit_from_world.matrix3);
        leaf.set_points(&unit_from_world, view);
        leaf
    }

    fn set_points(&mut self, object_from_world: &DAffine3, view: &ClipCamera) {
        let points = &view.plane.points;
        self.first = single(object_from_world.transform_point3(points.first));
        self.per_x = single(object_from_world.transform_vector3(points.per_x));
        self.per_y = single(object_from_world.transform_vector3(points.per_y));
    }
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}
