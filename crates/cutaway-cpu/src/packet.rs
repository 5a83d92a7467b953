//! Packets: a few neighbouring pixels whose rays are cast together, one a SIMD lane.
//!
//! A ray is kept in voxel space and in *steps*: `position(k) = origin + k * stride`, `k = 0` where it enters the
//! volume's box. Sample `k` stands for the stretch `k..k + 1`, or `k..total` if that is shorter, and lies in its middle.
//! The rays of a packet go in step: at step `j` of the packet a ray takes its sample `j - delay`, its delay being the
//! steps by which it entered the volume later than the first.

use cutaway_core::camera::{Ray, intersect_box};
use cutaway_core::glam::{DVec3, UVec3, Vec3};
use cutaway_core::occupancy::BlockWalk;
use fearless_simd::prelude::*;
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
    /// The axis that all rays follow, if there is one: see [`common_axis`].
    pub(crate) axis: Option<usize>,
    /// By how many steps each ray starts later than the packet, whole numbers.
    pub(crate) delay: [f32; MAX_LANES],
    delays: S::f32s,
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
        let corners = Self::corner_lanes().map(|l| lanes[l].stride);
        let axis = common_axis(&lanes[..Self::LANES], &corners);
        let delay = axis.map_or([0.0; MAX_LANES], |axis| delays(&lanes, axis));
        let delays = S::f32s::from_slice(simd, &delay[..Self::LANES]);
        Self { origin, stride, total, lanes, axis, delay, delays }
    }

    /// The lanes of the packet's corner pixels.
    pub(crate) fn corner_lanes() -> [usize; 4] {
        let width = packet_shape(Self::LANES).0 as usize;
        [0, width - 1, Self::LANES - width, Self::LANES - 1]
    }

    /// Steps of the packet until its last ray has ended.
    pub(crate) fn end(&self) -> u32 {
        let ends = self.lanes.iter().zip(self.delay).filter(|(lane, _)| lane.total > 0.0);
        ends.fold(0.0f32, |end, (lane, delay)| end.max(lane.total.ceil() + delay)) as u32
    }

    /// Step `j` of the packet: where each ray's sample lies along it, in steps, and the length it stands for, in steps:
    /// at most one, and not above zero where the ray has not begun or has ended.
    #[inline(always)]
    pub(crate) fn sample(&self, simd: S, j: u32) -> (S::f32s, S::f32s) {
        let k = S::f32s::splat(simd, j as f32) - self.delays;
        let middle = (k + 0.5).min((k + self.total) * 0.5);
        let length = (self.total - k).min(1.0);
        (middle, k.simd_ge(0.0).select(length, S::f32s::splat(simd, 0.0)))
    }

    /// Rays that have samples at or after step `j` of the packet.
    #[inline(always)]
    pub(crate) fn not_ended(&self, j: u32) -> <S::f32s as SimdBase<S>>::Mask {
        (self.total + self.delays).simd_gt(j as f32)
    }

    /// Position in voxel space at `k` steps along each ray.
    #[inline(always)]
    pub(crate) fn position(&self, k: S::f32s) -> [S::f32s; 3] {
        let ([ox, oy, oz], [sx, sy, sz]) = (self.origin, self.stride);
        [sx.mul_add(k, ox), sy.mul_add(k, oy), sz.mul_add(k, oz)]
    }
}

/// The axis along which all rays of a packet run in the same direction and lean from it by less than three to one: along
/// it, what is empty can be skipped for all of them at once.
fn common_axis(lanes: &[LaneRay], corners: &[Vec3; 4]) -> Option<usize> {
    let forward: Vec3 = corners.iter().sum();
    let axis = forward.abs().max_position();
    let along = |d: Vec3| d[axis] * forward[axis] > 0.0 && 3.0 * d[axis].abs() > d.abs().max_element();
    let together =
        corners.iter().all(|d| along(*d)) && lanes.iter().all(|l| l.total <= 0.0 || along(l.stride));
    together.then_some(axis)
}

/// By how many whole steps each ray enters the volume later than the first one, along an axis: rays that enter through
/// a face at a slant are in step with their neighbours once they are inside.
fn delays(lanes: &[LaneRay; MAX_LANES], axis: usize) -> [f32; MAX_LANES] {
    let hits = || lanes.iter().filter(|l| l.total > 0.0);
    let ascending = hits().any(|l| l.stride[axis] > 0.0);
    let nearer = |a: f32, b: f32| if ascending { a.min(b) } else { a.max(b) };
    let Some(first) = hits().map(|l| l.origin[axis]).reduce(nearer) else { return [0.0; MAX_LANES] };
    lanes.map(
        |l| if l.total > 0.0 { ((l.origin[axis] - first) / l.stride[axis]).floor().max(0.0) } else { 0.0 },
    )
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
