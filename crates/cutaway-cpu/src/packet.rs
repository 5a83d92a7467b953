//! Packets: a few neighbouring pixels whose rays are cast together, one a SIMD lane.
//!
//! A ray is kept in voxel space and in *steps*: `position(k) = origin + k * stride`, `k = 0` where it enters the
//! volume's box. Sample `k` stands for the stretch `k..k + 1`, or `k..total` if that is shorter, and lies in its middle.

use cutaway_core::camera::{Ray, intersect_box};
use cutaway_core::glam::{DVec3, UVec3, Vec3};
use cutaway_core::occupancy::BlockWalk;
use fearless_simd::{Simd, SimdBase};

use crate::simd::MAX_LANES;
use crate::tiles::Frame;

/// Width and height in pixels of a packet of this many lanes.
pub(crate) const fn packet_shape(lanes: usize) -> (u32, u32) {
    match lanes {
        16 => (4, 4),
        8 => (4, 2),
        4 => (2, 2),
        _ => (1, 1),
    }
}

/// One ray of a packet, in voxel space, counted in steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneRay {
    /// Where it enters the box.
    pub(crate) origin: Vec3,
    /// A point of its line, whether it meets the box or not: that nearest to the middle of the box.
    pub(crate) line_origin: Vec3,
    pub(crate) stride: Vec3,
    /// Length inside the box, in steps; zero where the ray misses it.
    pub(crate) total: f32,
    /// World distance from the ray's own origin to where `k = 0`.
    pub(crate) t_entry: f64,
    /// World direction, unit length.
    pub(crate) direction: DVec3,
}

impl LaneRay {
    /// A ray of no pixel.
    const NONE: Self = Self {
        origin: Vec3::ZERO,
        line_origin: Vec3::ZERO,
        stride: Vec3::ZERO,
        total: 0.0,
        t_entry: f64::INFINITY,
        direction: DVec3::Z,
    };

    /// The ray of a pixel.
    pub(crate) fn new(frame: &Frame, x: u32, y: u32) -> Self {
        let ray = frame.rays.pixel(x, y);
        let voxel_from_world = frame.volume.voxel_from_world();
        let origin = voxel_from_world.transform_point3(ray.origin);
        let direction = voxel_from_world.transform_vector3(ray.direction);
        Self::in_voxels(ray, origin, direction, frame.volume.extent(), frame.step_length)
    }

    /// A ray of the world whose origin and direction in voxel space are these, in a box from zero to `extent`.
    pub(crate) fn in_voxels(
        ray: Ray,
        origin: DVec3,
        direction: DVec3,
        extent: DVec3,
        step_length: f64,
    ) -> Self {
        // From a far eye, f32 would not tell neighbouring rays apart.
        let t_middle = (extent * 0.5 - origin).dot(direction) / direction.length_squared();
        let line = Self {
            line_origin: (origin + direction * t_middle).as_vec3(),
            stride: (direction * step_length).as_vec3(),
            direction: ray.direction,
            ..Self::NONE
        };
        match intersect_box(origin, direction, extent) {
            None => line,
            Some(segment) => Self {
                origin: (origin + direction * segment.t_near()).as_vec3(),
                total: (segment.length() / step_length) as f32,
                t_entry: segment.t_near(),
                ..line
            },
        }
    }

    /// Its own way through a grid of `blocks`.
    pub(crate) fn walk(&self, blocks: UVec3) -> BlockWalk {
        if self.total > 0.0 {
            BlockWalk::new(self.origin, self.stride, self.total, blocks)
        } else {
            BlockWalk::ENDED
        }
    }
}

/// The rays of a packet, lane by lane and as vectors.
pub(crate) struct Packet<S: Simd> {
    pub(crate) lanes: [LaneRay; MAX_LANES],
    pub(crate) origin: [S::f32s; 3],
    pub(crate) stride: [S::f32s; 3],
    pub(crate) total: S::f32s,
}

impl<S: Simd> Packet<S> {
    /// Lanes in use.
    pub(crate) const LANES: usize = S::f32s::LEN;

    /// The packet of a frame whose first pixel is `(x, y)`. Pixels beyond the image sample nothing.
    #[inline(always)]
    pub(crate) fn new(simd: S, frame: &Frame, x: u32, y: u32) -> Self {
        let lane = |x: u32, y: u32| {
            let lane = LaneRay::new(frame, x, y);
            if x < frame.width && y < frame.height { lane } else { LaneRay { total: 0.0, ..lane } }
        };
        Self::of(simd, lane, x, y)
    }

    /// The packet whose first pixel is `(x, y)`, its rays from a function of pixels.
    #[inline(always)]
    pub(crate) fn of(simd: S, lane: impl Fn(u32, u32) -> LaneRay, x: u32, y: u32) -> Self {
        let (width, height) = packet_shape(Self::LANES);
        let mut lanes = [LaneRay::NONE; MAX_LANES];
        for (l, to) in lanes[..Self::LANES].iter_mut().enumerate() {
            *to = lane(x + l as u32 % width, y + l as u32 / width % height);
        }
        let origin = vector3(simd, lanes.map(|r| r.origin));
        let stride = vector3(simd, lanes.map(|r| r.stride));
        let total = S::f32s::from_slice(simd, &lanes.map(|r| r.total)[..Self::LANES]);
        Self { origin, stride, total, lanes }
    }

    /// The lanes of the packet's corner pixels.
    pub(crate) fn corner_lanes(&self) -> [usize; 4] {
        let width = packet_shape(Self::LANES).0 as usize;
        [0, width - 1, Self::LANES - width, Self::LANES - 1]
    }

    /// Where sample `k` lies along each ray, in steps, and the length it stands for, in steps (0..=1).
    #[inline(always)]
    pub(crate) fn sample(&self, simd: S, k: u32) -> (S::f32s, S::f32s) {
        use fearless_simd::prelude::*;
        let k = S::f32s::splat(simd, k as f32);
        let middle = (k + 0.5).min((k + self.total) * 0.5);
        (middle, (self.total - k).min(1.0))
    }

    /// Position in voxel space at `k` steps along each ray.
    #[inline(always)]
    pub(crate) fn position(&self, k: S::f32s) -> [S::f32s; 3] {
        use fearless_simd::prelude::*;
        let ([ox, oy, oz], [sx, sy, sz]) = (self.origin, self.stride);
        [sx.mul_add(k, ox), sy.mul_add(k, oy), sz.mul_add(k, oz)]
    }
}

/// One vector a component.
#[inline(always)]
pub(crate) fn vector3<S: Simd>(simd: S, lanes: [Vec3; MAX_LANES]) -> [S::f32s; 3] {
    let n = S::f32s::LEN;
    [
        S::f32s::from_slice(simd, &lanes.map(|v| v.x)[..n]),
        S::f32s::from_slice(simd, &lanes.map(|v| v.y)[..n]),
        S::f32s::from_slice(simd, &lanes.map(|v| v.z)[..n]),
    ]
}
