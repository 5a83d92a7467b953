//! How cells come to the image: the host's side of `view.wgsl`.

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::{DAffine3, DVec3, DVec4, UVec3};

use crate::frame::RayPlane;

/// As `CellView` in `view.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct CellViewUniforms {
    pub(crate) x: [f32; 4],
    pub(crate) y: [f32; 4],
    pub(crate) depth: [f32; 4],
    pub(crate) axis: [f32; 2],
    pub(crate) inverse: f32,
    pub(crate) least_w: f32,
    pub(crate) eye: [f32; 4],
    pub(crate) size: [f32; 2],
    pub(crate) value_offset: f32,
    pub(crate) value_scale: f32,
    pub(crate) per_unit: f32,
    pub(crate) piece_last: u32,
    pub(crate) cells_x: u32,
    pub(crate) cells_y: u32,
    pub(crate) cells_z: u32,
    pub(crate) draw_all: u32,
    pub(crate) keeps_behind: u32,
    pub(crate) reserved_y: u32,
}

/// What is nearer to the eye than this share of its distance from the volume's middle is not drawn.
const LEAST_W: f64 = 1e-3;

/// A camera and the space that cells are in, in f64.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellCamera {
    /// Pixels from the axis before the division, and depth: affine functions of a point in the cells' space.
    pub(crate) rows: [DVec4; 3],
    pub(crate) axis: [f64; 2],
    pub(crate) inverse: f64,
    /// The eye in the cells' space and 1, or the direction towards it and 0.
    pub(crate) eye: DVec4,
    size: [u32; 2],
}

impl CellCamera {
    pub(crate) fn new(plane: &RayPlane, world_from_cells: &DAffine3, size: [u32; 2]) -> Self {
        let rays = &plane.rays;
        let middle = rays.on_axis(plane.depth);
        let forward = rays.axes().forward;
        let points = &plane.points;
        let [right, down] = [points.per_x, points.per_y].map(|v| v / v.length_squared());
        let row = |direction: DVec3| {
            let linear = world_from_cells.matrix3.transpose() * direction;
            linear.extend((world_from_cells.translation - middle).dot(direction))
        };
        let eye = match rays.eye() {
            Some(eye) => world_from_cells.inverse().transform_point3(eye).extend(1.0),
            None => world_from_cells.matrix3.inverse().mul_vec3(-forward).normalize_or_zero().extend(0.0),
        };
        Self {
            rows: [right, down, forward].map(row),
            axis: [right, down].map(|d| (middle - points.first).dot(d)),
            inverse: if rays.eye().is_some() { 1.0 / plane.depth } else { 0.0 },
            eye,
            size,
        }
    }

    pub(crate) fn is_parallel(&self) -> bool {
        self.inverse == 0.0
    }

    /// Whether something of a box in the cells' space is nearer than the nearest that is drawn, or behind the eye.
    pub(crate) fn reaches_behind(&self, lo: DVec3, hi: DVec3) -> bool {
        let row = self.rows[2];
        let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
        let nearest = row.truncate().dot(middle) + row.w - row.truncate().abs().dot(half);
        1.0 + nearest * self.inverse < LEAST_W
    }

    /// Where the eye divides the cells of a grid along each axis: cells before it are drawn in ascending order, the others
    /// in descending order.
    pub(crate) fn pivot(&self, cells: UVec3) -> UVec3 {
        let along = |axis: usize| {
            let (at, last) = (self.eye[axis], cells[axis]);
            if self.is_parallel() {
                return if at > 0.0 { last } else { 0 };
            }
            // A conversion of floats to integers stops at the ends of the integers' range.
            (at.floor().max(0.0) as u32).min(last)
        };
        UVec3::new(along(0), along(1), along(2))
    }

    pub(crate) fn uniforms(&self) -> CellViewUniforms {
        let single = |v: DVec4| v.as_vec4().to_array();
        let [x, y, depth] = self.rows.map(single);
        CellViewUniforms {
            x,
            y,
            depth,
            axis: self.axis.map(|a| a as f32),
            inverse: self.inverse as f32,
            least_w: LEAST_W as f32,
            eye: single(self.eye),
            size: self.size.map(|n| n as f32),
            ..CellViewUniforms::zeroed()
        }
    }
}
