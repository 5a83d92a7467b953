//! The walk of a packet through the blocks of a volume: slab by slab, all rays together.
//!
//! Walking each ray block by block costs more than sampling: every step is a branch that no processor foresees. But the
//! rays of a packet are neighbours. Along the axis that they follow most, a slab of blocks holds, of each ray, one short
//! stretch; all stretches lie within the rectangle of blocks that the packet's four corner rays span on the slab's two
//! faces (central projection onto a plane keeps convexity). If none of those blocks is occupied, the slab is skipped for
//! all rays at once, and if no level-1 block of the rectangle is, eight slabs are.
//!
//! Skipping decides only what is *not* sampled. A sample taken in an empty block is transparent, so a coarser decision
//! for the whole packet changes no pixel.

use cutaway_core::glam::UVec3;
use cutaway_core::value_ranges::BLOCK;
use fearless_simd::Simd;

use crate::packet::Packet;
use crate::simd::MAX_LANES;

/// Stretches are dilated by this many steps, so that rounding at a block's face never loses a sample.
const DILATION: f32 = 2e-3;

/// Rectangles are dilated by this many voxels, for the same reason.
const PAD: f32 = 0.01;

/// A rectangle of blocks of one slab.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    /// The slab's axis, the other two, and the slab's number.
    axes: [usize; 3],
    slab: i32,
    /// First and last block along the other two axes.
    first: [i32; 2],
    last: [i32; 2],
}

impl Rectangle {
    /// Whether a predicate of linear block indices holds for any of its blocks in a grid of these dimensions.
    #[inline(always)]
    pub(crate) fn any(&self, dimensions: UVec3, occupied: impl Fn(usize) -> bool) -> bool {
        let strides = [1, dimensions.x as usize, dimensions.x as usize * dimensions.y as usize];
        let [a, u, v] = self.axes;
        let start = self.slab as usize * strides[a];
        for j in self.first[1]..=self.last[1] {
            let row = start + j as usize * strides[v];
            for i in self.first[0]..=self.last[0] {
                if occupied(row + i as usize * strides[u]) {
                    return true;
                }
            }
        }
        false
    }
}

/// Steps of a packet, `begin..end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stretch {
    pub(crate) begin: u32,
    pub(crate) end: u32,
}

/// Where a packet is on its way.
pub(crate) struct SlabWalk {
    /// The axis that the rays follow most, and the other two.
    axes: [usize; 3],
    ascending: bool,
    /// The slab at hand and the one after the last.
    slab: i32,
    end: i32,
    /// Level-0 blocks along each axis.
    blocks: [i32; 3],
    /// Of the corner rays: position along the other two axes at plane 0 of the first, and its growth a voxel.
    base: [[f32; 4]; 2],
    slope: [[f32; 4]; 2],
    /// Of all rays: how many steps a voxel along the axis takes, the axis position at their first sample, their length
    /// in steps (zero for rays that miss), and by how many steps they begin after the packet.
    steps_per_voxel: [f32; MAX_LANES],
    origin: [f32; MAX_LANES],
    total: [f32; MAX_LANES],
    delay: [f32; MAX_LANES],
    /// Steps of the packet until its last ray has ended.
    last: u32,
    /// No slab is skipped: the rays do not go the same way, or nothing may be skipped.
    unskipped: bool,
    /// First step of the packet that has not been handed out.
    next: u32,
}

impl SlabWalk {
    /// A walk of a packet through a grid of `blocks`.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(packet: &Packet<S>, blocks: UVec3) -> Self {
        let lanes = &packet.lanes[..Packet::<S>::LANES];
        let corners =
            Packet::<S>::corner_lanes().map(|l| (packet.lanes[l].line_origin, packet.lanes[l].stride));
        let axis = packet.axis.unwrap_or(0);
        let mut walk = Self {
            axes: [axis, (axis + 1) % 3, (axis + 2) % 3],
            ascending: corners[0].1[axis] > 0.0,
            slab: 0,
            end: 0,
            blocks: blocks.as_ivec3().to_array(),
            base: [[0.0; 4]; 2],
            slope: [[0.0; 4]; 2],
            steps_per_voxel: [0.0; MAX_LANES],
            origin: [0.0; MAX_LANES],
            total: packet.lanes.map(|l| l.total),
            delay: packet.delay,
            last: packet.end(),
            unskipped: packet.axis.is_none(),
            next: 0,
        };
        let (axes, ascending) = (walk.axes, walk.ascending);
        for (c, (origin, direction)) in corners.iter().enumerate() {
            for k in 0..2 {
                let slope = direction[axes[k + 1]] / direction[axis];
                walk.slope[k][c] = slope;
                walk.base[k][c] = origin[axes[k + 1]] - origin[axis] * slope;
            }
        }
        let last_slab = walk.blocks[axis] - 1;
        let slab_of = |p: f32| ((p / BLOCK as f32) as i32).clamp(0, last_slab);
        let (mut lowest, mut highest) = (i32::MAX, i32::MIN);
        for (l, lane) in lanes.iter().enumerate().filter(|(_, lane)| lane.total > 0.0) {
            walk.origin[l] = lane.origin[axis];
            walk.steps_per_voxel[l] = 1.0 / lane.stride[axis];
            let exit = lane.origin[axis] + lane.stride[axis] * lane.total;
            // A thousandth of a voxel more at both ends, for rounding.
            lowest = lowest.min(slab_of(lane.origin[axis].min(exit) - 1e-3));
            highest = highest.max(slab_of(lane.origin[axis].max(exit) + 1e-3));
        }
        (walk.slab, walk.end) = if lowest > highest {
            (0, 0)
        } else if ascending {
            (lowest, highest + 1)
        } else {
            (highest, lowest - 1)
        };
        walk
    }

    /// Hands out every sample of every ray as one stretch.
    pub(crate) fn without_skipping(mut self) -> Self {
        self.unskipped = true;
        self
    }

    /// The next stretch with a block for which `occupied` holds. `level0` and `level1` say whether any block of a
    /// rectangle is occupied.
    #[inline(always)]
    pub(crate) fn next(
        &mut self,
        level0: impl Fn(&Rectangle) -> bool,
        level1: impl Fn(&Rectangle) -> bool,
    ) -> Option<Stretch> {
        if self.unskipped {
            self.unskipped = false;
            self.slab = self.end;
            return (self.last > 0).then_some(Stretch { begin: 0, end: self.last });
        }
        let size = BLOCK as i32;
        let mut looked_at_level1 = i32::MIN;
        while self.slab != self.end {
            let slab1 = self.slab / size;
            if slab1 != looked_at_level1 {
                looked_at_level1 = slab1;
                if !level1(&self.rectangle(slab1, size * size)) {
                    self.slab = if self.ascending {
                        ((slab1 + 1) * size).min(self.end)
                    } else {
                        (slab1 * size - 1).max(self.end)
                    };
                    continue;
                }
            }
            let slab = self.slab;
            self.slab += if self.ascending { 1 } else { -1 };
            if level0(&self.rectangle(slab, size)) {
                let stretch = self.stretch(slab);
                if stretch.begin < stretch.end {
                    self.next = stretch.end;
                    return Some(stretch);
                }
            }
        }
        None
    }

    /// The blocks of `edge` voxels that the packet may touch between the faces of a slab of that thickness.
    #[inline(always)]
    fn rectangle(&self, slab: i32, edge: i32) -> Rectangle {
        let (near, far) = ((slab * edge) as f32, ((slab + 1) * edge) as f32);
        let (mut first, mut last) = ([0; 2], [0; 2]);
        for k in 0..2 {
            let (mut lo, mut hi) = (f32::INFINITY, f32::NEG_INFINITY);
            for c in 0..4 {
                let at_near = near.mul_add(self.slope[k][c], self.base[k][c]);
                let at_far = far.mul_add(self.slope[k][c], self.base[k][c]);
                lo = lo.min(at_near.min(at_far));
                hi = hi.max(at_near.max(at_far));
            }
            let most = self.blocks[self.axes[k + 1]] - 1;
            let most = if edge == BLOCK as i32 { most } else { most / BLOCK as i32 };
            let block = |p: f32| ((p / edge as f32) as i32).clamp(0, most);
            first[k] = block(lo - PAD);
            last[k] = block(hi + PAD);
        }
        Rectangle { axes: self.axes, slab, first, last }
    }

    /// The steps of the packet at which any ray is in a slab, those already handed out left out.
    ///
    /// What was handed out before reaches down to where the last occupied slab begins. Nothing of this slab lies before
    /// that: a slab's beginning is the least of *all* rays', on their lines before and after the volume too, and each
    /// of them meets the slabs in turn.
    #[inline(always)]
    fn stretch(&self, slab: i32) -> Stretch {
        let (near, far) = ((slab * BLOCK as i32) as f32, ((slab + 1) * BLOCK as i32) as f32);
        let (mut begin, mut end) = (f32::INFINITY, 0.0f32);
        for l in 0..MAX_LANES {
            let at_near = (near - self.origin[l]) * self.steps_per_voxel[l];
            let at_far = (far - self.origin[l]) * self.steps_per_voxel[l];
            let (total, delay) = (self.total[l], self.delay[l]);
            let k0 = at_near.min(at_far) - DILATION;
            let k1 = at_near.max(at_far) + DILATION;
            let hits = total > 0.0;
            let inside = hits & (k1 >= 0.0) & (k0 <= total);
            // Sample k lies at k + 1/2; the last one, of a shorter stretch, lies up to half a step before that.
            let upto = if k1 + 1.0 > total { total.ceil() } else { (k1 - 0.5).ceil() };
            begin = begin.min(if hits { (k0 - 0.5).ceil() + delay } else { f32::INFINITY });
            end = end.max(if inside { upto + delay } else { 0.0 });
        }
        Stretch { begin: (begin.clamp(0.0, 4e9) as u32).max(self.next), end: end as u32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::LaneRay;
    use crate::simd::{LaneWork, SimdChoice, dispatch};
    use cutaway_core::camera::Camera;
    use cutaway_core::glam::DVec3;
    use proptest::prelude::*;

    /// A packet of a camera that looks at a grid of blocks, walked; every sample in an occupied block must be handed out.
    struct Walk<'a> {
        camera: &'a Camera,
        at: (u32, u32),
        blocks: UVec3,
        occupied: &'a (dyn Fn(UVec3) -> bool + Sync),
        step: f64,
    }

    impl LaneWork for Walk<'_> {
        fn run<S: Simd>(self, simd: S) {
            let extent = (self.blocks * BLOCK - UVec3::splat(3)).as_dvec3();
            let rays = self.camera.rays(64, 64);
            let lane = |x, y| {
                let ray = rays.pixel(x, y);
                LaneRay::in_voxels(ray, ray.origin, ray.direction, extent, self.step)
            };
            let packet = Packet::<S>::of(simd, lane, self.at.0, self.at.1);
            let mut walk = SlabWalk::new(&packet, self.blocks);
            let d = self.blocks;
            let at = |i: usize| {
                let (x, rest) = (i as u32 % d.x, i as u32 / d.x);
                (self.occupied)(UVec3::new(x, rest % d.y, rest / d.y))
            };
            let d1 = UVec3::new(d.x.div_ceil(BLOCK), d.y.div_ceil(BLOCK), d.z.div_ceil(BLOCK));
            let level1 = |i: usize| {
                let (x, rest) = (i as u32 % d1.x, i as u32 / d1.x);
                let b = UVec3::new(x, rest % d1.y, rest / d1.y) * BLOCK;
                let end = (b + BLOCK).min(d);
                (b.z..end.z)
                    .any(|z| (b.y..end.y).any(|y| (b.x..end.x).any(|x| (self.occupied)(UVec3::new(x, y, z)))))
            };
            let mut handed_out = Vec::new();
            while let Some(s) = walk.next(|r| r.any(d, at), |r| r.any(d1, level1)) {
                assert!(s.begin < s.end && handed_out.last().is_none_or(|l: &Stretch| l.end <= s.begin));
                handed_out.push(s);
            }
            for (l, lane) in packet.lanes[..Packet::<S>::LANES].iter().enumerate() {
                let delay = packet.delay[l] as u32;
                for k in 0..lane.total.ceil() as u32 {
                    let middle = (k as f32 + 0.5).min(0.5 * (k as f32 + lane.total));
                    let p = lane.origin + lane.stride * middle;
                    let block = (p / BLOCK as f32).as_uvec3().min(d - UVec3::ONE);
                    let covered = handed_out.iter().any(|s| (s.begin..s.end).contains(&(k + delay)));
                    assert!(covered || !(self.occupied)(block), "sample {k} at {p} in block {block}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn every_sample_in_an_occupied_block_is_handed_out(
            position in prop::array::uniform3(-150.0f64..250.0),
            focal in prop::array::uniform3(20.0f64..100.0),
            angle in 5.0f64..100.0,
            orthographic: bool,
            at in (0u32..60, 0u32..60),
            seed: u64,
            sparsity in 0u32..5,
            step in 0.2f64..3.0,
        ) {
            let camera = Camera {
                position, focal_point: focal, view_up: [0.1, 0.2, 1.0], view_angle: angle,
                orthographic: orthographic.then_some(80.0),
            };
            prop_assume!(DVec3::from_array(position).distance(DVec3::from_array(focal)) > 1.0);
            let hash = move |b: UVec3| (u64::from(b.x) * 31 + u64::from(b.y) * 57 + u64::from(b.z) * 131)
                .wrapping_add(seed)
                .wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let occupied = move |b: UVec3| hash(b).trailing_zeros() >= sparsity;
            let blocks = UVec3::new(17, 11, 14);
            for choice in [SimdChoice::Scalar, SimdChoice::Auto] {
                let walk = Walk { camera: &camera, at, blocks, occupied: &occupied, step };
                dispatch(choice.level().unwrap(), walk);
            }
        }
    }
}
