//! Packets: a few neighbouring pixels whose rays are cast together, one a SIMD lane.
//!
//! A ray is kept in voxel space and in *steps*: `position(k) = origin + k * stride`, `k = 0` where it enters the
//! volume's box. Sample `k` stands for the stretch `k..k + 1`, or `k..total` if that is shorter, and lies in its middle.

use cutaway_core::camera::{RayGenerator, intersect_box};
use cutaway_core::glam::{DVec3, UVec3, Vec3};
use cutaway_core::occupancy::BlockWalk;
use cutaway_core::volume::Volume;
use fearless_simd::{Simd, SimdBase};

use crate::simd::MAX_LANES;

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
    pub(crate) origin: Vec3,
    pub(crate) stride: Vec3,
    /// Length inside the box, in steps; zero where the ray misses it.
    pub(crate) total: f32,
    /// World distance from the ray's own origin to where `k = 0`.
    pub(crate) t_entry: f64,
    /// World direction, unit length.
    pub(crate) direction: DVec3,
}

impl LaneRay {
    const MISS: Self = Self {
        origin: Vec3::ZERO,
        stride: Vec3::ZERO,
        total: 0.0,
        t_entry: f64::INFINITY,
        direction: DVec3::Z,
    };

    pub(crate) fn new(rays: &RayGenerator, volume: &Volume, step_length: f64, x: u32, y: u32) -> Self {
        let ray = rays.pixel(x, y);
        let origin = volume.voxel_from_world().transform_point3(ray.origin);
        let direction = volume.voxel_from_world().transform_vector3(ray.direction);
        match intersect_box(origin, direction, volume.extent()) {
            None => Self { direction: ray.direction, ..Self::MISS },
            Some(segment) => Self {
                origin: (origin + direction * segment.t_near()).as_vec3(),
                stride: (direction * step_length).as_vec3(),
                total: (segment.length() / step_length) as f32,
                t_entry: segment.t_near(),
                direction: ray.direction,
            },
        }
    }

    /// Its way through a grid of `blocks`.
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

    /// The packet whose first pixel is `(x, y)`; pixels beyond the image miss the volume.
    #[inline(always)]
    pub(crate) fn new(simd: S, frame: &crate::tiles::Frame, x: u32, y: u32) -> Self {
        let (width, height) = packet_shape(Self::LANES);
        let mut lanes = [LaneRay::MISS; MAX_LANES];
        for (l, lane) in lanes[..Self::LANES].iter_mut().enumerate() {
            let (px, py) = (x + l as u32 % width, y + l as u32 / width % height);
            if px < frame.width && py < frame.height {
                *lane = LaneRay::new(&frame.rays, frame.volume, frame.step_length, px, py);
            }
        }
        let origin = vector3(simd, lanes.map(|r| r.origin));
        let stride = vector3(simd, lanes.map(|r| r.stride));
        let total = S::f32s::from_slice(simd, &lanes.map(|r| r.total)[..Self::LANES]);
        Self { origin, stride, total, lanes }
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

/// The stretches of each lane that are still to be sampled, as sample numbers, and which lanes are still under way.
pub(crate) struct Runs {
    walks: [BlockWalk; MAX_LANES],
    begin: [u32; MAX_LANES],
    end: [u32; MAX_LANES],
    /// Lengths of the rays, in steps.
    total: [f32; MAX_LANES],
    active: u32,
}

/// A stretch of sample numbers over which the set of lanes does not change.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    pub(crate) begin: u32,
    pub(crate) end: u32,
    /// Bit `l`: lane `l` samples here.
    pub(crate) lanes: u32,
}

/// The sample numbers `begin..end` of a ray of length `total` that lie in `t0..t1`, all in steps.
#[inline(always)]
fn samples_within(t0: f32, t1: f32, total: f32) -> (u32, u32) {
    let number = |t: f32| (t - 0.5).ceil().max(0.0) as u32;
    let count = total.ceil();
    // The last sample is in the middle of a shorter stretch: nearer than half a step to the one before it.
    let last = 0.5 * (count - 1.0 + total);
    let end = if t1 + DILATION > last { count as u32 } else { number(t1 + DILATION) };
    (number(t0 - DILATION), end)
}

/// Blocks are dilated by this many steps, so that rounding at a block's face never loses a sample.
const DILATION: f32 = 2e-3;

impl Runs {
    pub(crate) fn new<S: Simd>(packet: &Packet<S>, blocks: UVec3) -> Self {
        let mut runs = Self {
            walks: [BlockWalk::ENDED; MAX_LANES],
            begin: [0; MAX_LANES],
            end: [0; MAX_LANES],
            total: std::array::from_fn(|l| packet.lanes[l].total),
            active: 0,
        };
        for l in 0..Packet::<S>::LANES {
            if packet.lanes[l].total > 0.0 {
                runs.walks[l] = packet.lanes[l].walk(blocks);
                runs.active |= 1 << l;
            }
        }
        runs
    }

    /// Ends lanes for good.
    #[inline(always)]
    pub(crate) fn finish(&mut self, lanes: u32) {
        self.active &= !lanes;
    }

    /// The next stretch at or after sample `k`; `next_run` gives a lane's next run of blocks, in steps.
    #[inline(always)]
    pub(crate) fn next(
        &mut self,
        k: u32,
        mut next_run: impl FnMut(usize, &mut BlockWalk) -> Option<(f32, f32)>,
    ) -> Option<Stretch> {
        let mut begin = u32::MAX;
        let mut rest = self.active;
        while rest != 0 {
            let l = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            while self.end[l] <= k {
                match next_run(l, &mut self.walks[l]) {
                    Some((t0, t1)) => (self.begin[l], self.end[l]) = samples_within(t0, t1, self.total[l]),
                    None => {
                        self.active &= !(1 << l);
                        break;
                    }
                }
            }
            if self.active >> l & 1 == 1 {
                begin = begin.min(self.begin[l].max(k));
            }
        }
        if self.active == 0 {
            return None;
        }
        let mut stretch = Stretch { begin, end: u32::MAX, lanes: 0 };
        let mut rest = self.active;
        while rest != 0 {
            let l = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            if self.begin[l] <= begin {
                stretch.lanes |= 1 << l;
                stretch.end = stretch.end.min(self.end[l]);
            } else {
                stretch.end = stretch.end.min(self.begin[l]);
            }
        }
        Some(stretch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_run_holds_exactly_the_samples_whose_middle_is_in_it(
            total in 0.01f32..50.0, a in 0.0f32..=1.0, b in 0.0f32..=1.0,
        ) {
            let (t0, t1) = (a.min(b) * total, a.max(b) * total);
            let (begin, end) = samples_within(t0, t1, total);
            for k in 0..total.ceil() as u32 {
                let middle = (k as f32 + 0.5).min(0.5 * (k as f32 + total));
                if (t0..t1).contains(&middle) {
                    prop_assert!((begin..end).contains(&k), "{k} of {begin}..{end}");
                }
            }
            prop_assert!(end <= total.ceil() as u32);
        }
    }
}
