//! Bundles: packets of neighbouring pixels that go through the volume together, slab by slab.
//!
//! Walking each ray block by block costs more than sampling: every step is a branch that no processor foresees. But
//! neighbouring rays meet the same blocks. Along the axis that they follow most, a slab of blocks holds, of each ray, one
//! short stretch; all stretches of a packet lie within a rectangle of blocks that its bounds give. If none of those blocks
//! can be seen, the slab is skipped for all its rays at once, and if no level-1 block of the bundle's rectangle can, eight
//! slabs are. In front of a surface a block is empty for half of its depth: where not all of a slab can be seen a packet
//! asks blocks of half the edge, the nearer ones and the farther. All packets of a bundle cross a slab before any goes on
//! to the next, so that the voxels of the slab are fetched into the nearest cache once for all of them; those of a large
//! volume are asked for as soon as it is known which, so that they come while other packets are at work.
//!
//! Skipping decides only what is *not* sampled. A sample taken in an empty block is transparent, so a coarser decision
//! for a whole packet changes no pixel.

use cutaway_core::glam::UVec3;
use cutaway_core::value_ranges::BLOCK;
use fearless_simd::Simd;

use crate::classification::{BlockMap, cast_piece};
use crate::clipping::TileClip;
use crate::packet::{Axis, Bounds, Packet, packet_shape};
use crate::rays::Frame;

/// Edge of a bundle in pixels; a multiple of every packet's shape. Small enough that the voxels of a slab stay in the
/// first cache beside what its packets have accumulated.
pub(crate) const BUNDLE: u32 = 16;

/// Stretches are dilated by this many steps, so that rounding at a block's face never loses a sample.
const DILATION: f32 = 2e-3;

/// Rectangles are dilated by this many voxels, for the same reason.
const PAD: f32 = 0.01;

/// Steps of a packet, `begin..end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stretch {
    pub(crate) begin: u32,
    pub(crate) end: u32,
}

/// A rectangle of blocks of one slab.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    /// Linear index of its first block, and from block to block and from row to row.
    start: usize,
    stride: [usize; 2],
    /// Blocks along the two axes across the slab.
    count: [u32; 2],
}

impl Rectangle {
    /// Combines what a function of linear block indices says of all its blocks.
    #[inline(always)]
    pub(crate) fn fold<T>(&self, first: T, combine: impl Fn(T, usize) -> T) -> T {
        let mut value = first;
        for j in 0..self.count[1] as usize {
            let row = self.start + j * self.stride[1];
            for i in 0..self.count[0] as usize {
                value = combine(value, row + i * self.stride[0]);
            }
        }
        value
    }
}

/// A slab of blocks across the axis that a bundle follows. Positions along a descending axis are negated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slab {
    /// Its number, of its level.
    number: i32,
    /// Where it begins and ends.
    near: f32,
    far: f32,
}

/// A grid of blocks, seen along an axis that rays follow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    axis: usize,
    ascending: bool,
    /// Blocks along x, y, z, and voxels along the edge of one.
    dimensions: [i32; 3],
    edge: f32,
}

impl Slabs {
    /// Blocks of this `edge` in voxels, seen along an axis.
    pub(crate) fn new((axis, ascending): (usize, bool), dimensions: UVec3, edge: u32) -> Self {
        Self { axis, ascending, dimensions: dimensions.as_ivec3().to_array(), edge: edge as f32 }
    }

    /// The slab of a number.
    #[inline(always)]
    pub(crate) fn slab(&self, number: i32) -> Slab {
        let (low, high) = (number as f32 * self.edge, (number + 1) as f32 * self.edge);
        if self.ascending {
            Slab { number, near: low, far: high }
        } else {
            Slab { number, near: -high, far: -low }
        }
    }

    /// The numbers of the first and the last slab that bounds reach into, in the order in which rays meet them.
    #[inline(always)]
    fn range(&self, inside: [f32; 2]) -> [i32; 2] {
        let last = self.dimensions[self.axis] - 1;
        let number = |p: f32| {
            let p = if self.ascending { p } else { -p };
            ((p / self.edge) as i32).clamp(0, last)
        };
        // A thousandth of a voxel more at both ends, for rounding.
        [number(inside[0] - 1e-3), number(inside[1] + 1e-3)]
    }

    /// The two slabs of blocks of half the edge that a slab consists of, the nearer one first. Of the last slab the second
    /// may be beyond the volume.
    #[inline(always)]
    fn halves_of(&self, number: i32) -> [Option<Slab>; 2] {
        let half = |i: i32| (2 * number + i < self.dimensions[self.axis]).then(|| self.slab(2 * number + i));
        if self.ascending { [half(0), half(1)] } else { [half(1), half(0)] }
    }

    /// The steps of a packet in a slab, of whose halves only what may be visible.
    #[inline(always)]
    fn visible_stretch(&self, bounds: &Bounds, halves: &[Option<Slab>; 2], blocks: &[u8]) -> Option<Stretch> {
        let mut seen: Option<Stretch> = None;
        for slab in halves.iter().flatten() {
            if bounds.reaches(slab) && self.rectangle(bounds, slab).fold(0, |any, b| any | blocks[b]) != 0 {
                let Stretch { begin, end } = bounds.stretch(slab);
                seen = Some(Stretch { begin: seen.map_or(begin, |s| s.begin), end });
            }
        }
        seen
    }

    /// The blocks that bounds may touch within a slab.
    #[inline(always)]
    pub(crate) fn rectangle(&self, bounds: &Bounds, slab: &Slab) -> Rectangle {
        let others = [(self.axis + 1) % 3, (self.axis + 2) % 3];
        let strides = [1, self.dimensions[0] as usize, (self.dimensions[0] * self.dimensions[1]) as usize];
        let (mut start, mut count) = (slab.number as usize * strides[self.axis], [0; 2]);
        let (near, far) = (slab.near.max(bounds.inside[0]), slab.far.min(bounds.inside[1]));
        for k in 0..2 {
            let at = |p: f32, side: usize| bounds.across[k][side] + bounds.slope[k][side] * p;
            let low = at(near, 0).min(at(far, 0)) - PAD;
            let high = at(near, 1).max(at(far, 1)) + PAD;
            let last = self.dimensions[others[k]] - 1;
            let block = |p: f32| ((p / self.edge) as i32).clamp(0, last);
            let (first, last) = (block(low), block(high));
            start += first as usize * strides[others[k]];
            count[k] = (last - first + 1).max(1) as u32;
        }
        Rectangle { start, stride: others.map(|a| strides[a]), count }
    }
}

impl Bounds {
    /// The steps at which any ray of the packet may be in a slab.
    #[inline(always)]
    pub(crate) fn stretch(&self, slab: &Slab) -> Stretch {
        let ([least, greatest], [slow, fast]) = (self.origin, self.stride);
        let to_near = slab.near - greatest;
        let begin = to_near / if to_near > 0.0 { fast } else { slow };
        let to_far = slab.far - least;
        let end = to_far / if to_far > 0.0 { slow } else { fast };
        // Sample j lies at j + 1/2; a ray's last one, of a shorter stretch, lies up to half a step before that.
        let full = (end - 0.5 + DILATION).floor() + 1.0;
        let end = if full >= self.end[0] - 1.0 { (end + DILATION).floor() + 1.0 } else { full };
        Stretch {
            begin: (begin - 0.5 - DILATION).ceil().clamp(0.0, 4e9) as u32,
            end: end.min(self.end[1].ceil()).max(0.0) as u32,
        }
    }

    /// Bounds of both packets together.
    fn union(&self, other: &Self) -> Self {
        if !self.hits {
            return *other;
        } else if !other.hits {
            return *self;
        }
        let inside = join(self.inside, other.inside);
        let mut union = Self { inside, hits: true, ..*self };
        for k in 0..2 {
            // Each one's straight lines bound it where it is; the union's must do so over all of `inside`.
            let at =
                |b: &Self, p: f32| [b.across[k][0] + b.slope[k][0] * p, b.across[k][1] + b.slope[k][1] * p];
            let (near, far) = (inside[0], inside[1].max(inside[0] + 1.0));
            let (at_near, at_far) =
                (join(at(self, near), at(other, near)), join(at(self, far), at(other, far)));
            for side in 0..2 {
                let growth = (at_far[side] - at_near[side]) / (far - near);
                union.slope[k][side] = growth;
                union.across[k][side] = at_near[side] - growth * near;
            }
        }
        union
    }

    /// Whether any ray is within a slab.
    #[inline(always)]
    fn reaches(&self, slab: &Slab) -> bool {
        self.inside[0] <= slab.far + 1e-3 && self.inside[1] >= slab.near - 1e-3
    }
}

fn join([a, b]: [f32; 2], [c, d]: [f32; 2]) -> [f32; 2] {
    [a.min(c), b.max(d)]
}

/// A packet on its way, and what it has accumulated.
pub(crate) struct Member<S: Simd, T> {
    pub(crate) packet: Packet<S>,
    pub(crate) sum: T,
    /// Its first pixel in the image.
    pub(crate) pixel: (u32, u32),
    /// Its number among the packets of the bundle.
    pub(crate) index: usize,
    /// Its first step that has not been handed out.
    next: u32,
    /// What it is to take in the slab at hand, and what is there.
    due: Option<(Stretch, u8)>,
    /// Whether anything further on can still be seen.
    open: bool,
}

/// The packets of up to [`BUNDLE`]² pixels.
pub(crate) struct Bundle<S: Simd, T> {
    axis: Axis,
    /// Of all packets together.
    bounds: Bounds,
    pub(crate) members: Vec<Member<S, T>>,
}

impl<S: Simd, T: Copy> Bundle<S, T> {
    pub(crate) fn new() -> Self {
        Self { axis: None, bounds: Bounds::default(), members: Vec::with_capacity(Self::packets()) }
    }

    /// Takes the packets of the pixels from `(x, y)` on that are wanted, within the image, and meet the volume; where it is
    /// clipped, the pieces of a rank. `sum(i)` is what the `i`-th packet of the bundle has accumulated so far.
    #[inline(always)]
    pub(crate) fn fill(
        &mut self,
        simd: S,
        frame: &Frame,
        (x, y): (u32, u32),
        clip: Option<(&TileClip, usize)>,
        sum: impl Fn(usize) -> T,
    ) {
        self.members.clear();
        self.bounds = Bounds::default();
        let (width, height) = (BUNDLE.min(frame.width - x), BUNDLE.min(frame.height - y));
        self.axis = frame.common_axis(x, y, width, height);
        let shape = packet_shape(Packet::<S>::LANES);
        let mut number = 0;
        for j in (0..BUNDLE).step_by(shape.1 as usize) {
            for i in (0..BUNDLE).step_by(shape.0 as usize) {
                let (pixel, index) = ((x + i, y + j), number);
                number += 1;
                if i >= width || j >= height || !frame.wants(pixel, shape) {
                    continue;
                }
                let kept = clip.map(|(clip, rank)| clip.lanes(pixel, shape, rank));
                let packet = Packet::new(simd, frame, self.axis, pixel, kept.as_ref());
                if packet.bounds.hits {
                    self.bounds = self.bounds.union(&packet.bounds);
                    self.members.push(Member {
                        packet,
                        sum: sum(index),
                        pixel,
                        index,
                        next: 0,
                        due: None,
                        open: true,
                    });
                }
            }
        }
    }

    /// Packets of a whole bundle.
    pub(crate) fn packets() -> usize {
        (BUNDLE * BUNDLE) as usize / Packet::<S>::LANES
    }

    /// Hands out stretches, near ones first.
    ///
    /// Each is longer by `margin` steps at both ends: for steps that see more than their middle. `blocks` says what is
    /// where; `look_ahead(packet, stretch)` is told of all stretches in a slab before the first of them is taken;
    /// `take(packet, sum, stretch, what is there)` returns whether anything further on can still be seen by the packet.
    #[inline(always)]
    pub(crate) fn march(
        &mut self,
        blocks: &BlockMap,
        margin: u32,
        look_ahead: impl Fn(&Packet<S>, Stretch),
        mut take: impl FnMut(&Packet<S>, &mut T, Stretch, u8) -> bool,
    ) {
        let Some(axis) = self.axis else {
            for m in &mut self.members {
                take(
                    &m.packet,
                    &mut m.sum,
                    Stretch { begin: 0, end: m.packet.bounds.end[1].ceil() as u32 },
                    !0,
                );
            }
            return;
        };
        let slabs = Slabs::new(axis, blocks.fine.dimensions, BLOCK);
        let coarse = Slabs::new(axis, blocks.coarse.dimensions, BLOCK * BLOCK);
        let halves = Slabs::new(axis, blocks.halves.dimensions, BLOCK / 2);
        let ([mut number, last], step) = (slabs.range(self.bounds.inside), if axis.1 { 1 } else { -1 });
        let size = BLOCK as i32;
        let mut looked_at = i32::MIN;
        let mut open = self.members.len();
        while (last - number) * step >= 0 && open > 0 {
            let parent = number / size;
            if parent != looked_at {
                looked_at = parent;
                let rectangle = coarse.rectangle(&self.bounds, &coarse.slab(parent));
                if rectangle.fold(0, |any, b| any | blocks.coarse.blocks[b]) == 0 {
                    number = if axis.1 { (parent + 1) * size } else { parent * size - 1 };
                    continue;
                }
            }
            let slab = slabs.slab(number);
            let half_slabs = halves.halves_of(number);
            number += step;
            if slabs.rectangle(&self.bounds, &slab).fold(0, |any, b| any | blocks.fine.blocks[b]) == 0 {
                continue;
            }
            for m in self.members.iter_mut().filter(|m| m.open && m.packet.bounds.reaches(&slab)) {
                let bounds = &m.packet.bounds;
                let there = slabs.rectangle(bounds, &slab).fold(0, |any, b| any | blocks.fine.blocks[b]);
                let seen = if there & cast_piece::PARTLY != 0 {
                    halves.visible_stretch(bounds, &half_slabs, &blocks.halves.blocks)
                } else if there != 0 {
                    Some(bounds.stretch(&slab))
                } else {
                    None
                };
                let Some(Stretch { begin, end }) = seen else { continue };
                // What was handed out before reaches down to where the last visible slab begins; nothing of this slab
                // lies before that, for each ray meets the slabs in turn.
                let stretch = Stretch {
                    begin: begin.saturating_sub(margin).max(m.next),
                    end: (end + margin).min(bounds.end[1].ceil() as u32),
                };
                if stretch.begin < stretch.end {
                    look_ahead(&m.packet, stretch);
                    (m.next, m.due) = (stretch.end, Some((stretch, there)));
                }
            }
            for m in &mut self.members {
                if let Some((stretch, there)) = m.due.take() {
                    m.open = take(&m.packet, &mut m.sum, stretch, there);
                    open -= usize::from(!m.open);
                }
            }
        }
    }

    /// Hands out stretches in the order of their slabs' bounds, greatest first: for extrema.
    ///
    /// `bound` says what a block's samples cannot exceed; `take` returns what the packet needs to be worth another sample:
    /// the least that its rays have found, and the farthest step at which one has found it (an equal number nearer than
    /// that is still news).
    #[inline(always)]
    pub(crate) fn march_best_first(
        &mut self,
        dimensions: UVec3,
        bound: impl Fn(usize) -> f32,
        mut take: impl FnMut(&Packet<S>, &mut T, Stretch) -> (f32, f32),
    ) {
        let Some(axis) = self.axis else {
            for m in &mut self.members {
                let end = m.packet.bounds.end[1].ceil() as u32;
                take(&m.packet, &mut m.sum, Stretch { begin: 0, end });
            }
            return;
        };
        let slabs = Slabs::new(axis, dimensions, BLOCK);
        let [first, last] = slabs.range(self.bounds.inside);
        let greatest = |r: Rectangle| r.fold(f32::NEG_INFINITY, |g, b| g.max(bound(b)));
        let (low, high) = (first.min(last), first.max(last));
        let mut order: Vec<(f32, Slab)> = (low..=high)
            .map(|number| slabs.slab(number))
            .map(|slab| (greatest(slabs.rectangle(&self.bounds, &slab)), slab))
            .collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.near.total_cmp(&b.1.near)));
        let mut found = vec![(f32::NEG_INFINITY, f32::INFINITY); self.members.len()];
        for (limit, slab) in order {
            for (m, found) in self.members.iter_mut().zip(&mut found) {
                let worth = |limit: f32, begin: u32| {
                    limit > found.0 || (limit == found.0 && (begin as f32) < found.1)
                };
                if !worth(limit, 0) || !m.packet.bounds.reaches(&slab) {
                    continue;
                }
                let stretch = m.packet.bounds.stretch(&slab);
                let limit = greatest(slabs.rectangle(&m.packet.bounds, &slab));
                if stretch.begin < stretch.end && worth(limit, stretch.begin) {
                    *found = take(&m.packet, &mut m.sum, stretch);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LaneWork, SimdChoice, dispatch};
    use cutaway_core::camera::Camera;
    use cutaway_core::glam::{DVec3, Vec3};
    use cutaway_core::scene::{Layer, RenderSettings, Scene};
    use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
    use cutaway_core::value_ranges::BlockGrid;
    use cutaway_core::volume::{Geometry, Rescale, Volume};
    use proptest::prelude::*;

    const BLOCKS: UVec3 = UVec3::new(17, 11, 14);

    /// A bundle at a place of a frame, marched; every sample in a visible block must be handed out, once.
    struct March<'a> {
        frame: &'a Frame<'a>,
        at: (u32, u32),
        blocks: &'a BlockMap,
    }

    impl LaneWork for March<'_> {
        fn run<S: Simd>(self, simd: S) {
            let mut bundle = Bundle::<S, u32>::new();
            bundle.fill(simd, self.frame, self.at, None, |_| 0);
            for (i, member) in bundle.members.iter_mut().enumerate() {
                member.sum = i as u32;
            }
            let mut handed_out: Vec<Vec<Stretch>> = vec![Vec::new(); bundle.members.len()];
            bundle.march(
                self.blocks,
                0,
                |_, _| {},
                |_, i, stretch, _| {
                    let stretches = &mut handed_out[*i as usize];
                    assert!(stretch.begin < stretch.end);
                    assert!(stretches.last().is_none_or(|last| last.end <= stretch.begin));
                    stretches.push(stretch);
                    true
                },
            );
            let mut best_first: Vec<Vec<Stretch>> = vec![Vec::new(); bundle.members.len()];
            let bound = |b: usize| f32::from(self.blocks.fine.blocks[b]);
            bundle.march_best_first(BLOCKS, bound, |_, i, stretch| {
                best_first[*i as usize].push(stretch);
                (0.0, f32::NEG_INFINITY)
            });
            for (member, (marched, best)) in bundle.members.iter().zip(handed_out.iter().zip(&best_first)) {
                check(&member.packet, &self.blocks.halves, BLOCK / 2, marched);
                check(&member.packet, &self.blocks.fine, BLOCK, best);
            }
        }
    }

    /// Holds that all samples in visible blocks of this edge were handed out.
    fn check<S: Simd>(packet: &Packet<S>, blocks: &BlockGrid<u8>, edge: u32, stretches: &[Stretch]) {
        for l in 0..Packet::<S>::LANES {
            let (first, end) = (packet.first[l], packet.end[l]);
            for j in first as u32..end.ceil() as u32 {
                let middle = (j as f32 + 0.5).min(0.5 * (j as f32 + end));
                let at = |a: usize| packet.origin[a][l] + packet.stride[a][l] * middle;
                let p = Vec3::new(at(0), at(1), at(2));
                let block = (p / edge as f32).as_uvec3().min(blocks.dimensions - UVec3::ONE);
                let handed_out = stretches.iter().any(|s| (s.begin..s.end).contains(&j));
                assert!(handed_out || blocks.get(block) == 0, "sample {j} at {p} in block {block}");
            }
        }
    }

    fn volume() -> Volume {
        // Along y the last block is less than half a one.
        let d = BLOCKS * BLOCK - UVec3::new(2, 5, 3);
        let voxels = vec![0u8; (d.x * d.y * d.z) as usize];
        Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    proptest! {
        #[test]
        fn every_sample_in_a_visible_block_is_handed_out_once(
            position in prop::array::uniform3(-150.0f64..250.0),
            focal in prop::array::uniform3(20.0f64..100.0),
            angle in 5.0f64..100.0,
            orthographic: bool,
            at in (0u32..45, 0u32..45),
            seed: u64,
            sparsity in 0u32..5,
            step in 0.2f64..3.0,
        ) {
            let camera = Camera {
                position, focal_point: focal, view_up: [0.1, 0.2, 1.0], view_angle: angle,
                orthographic: orthographic.then_some(80.0),
            };
            prop_assume!(DVec3::from_array(position).distance(DVec3::from_array(focal)) > 1.0);
            let hash = |i: usize| (i as u64 * 131).wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let volume = volume();
            let cells = (volume.dimensions() - UVec3::ONE).to_array();
            let dimensions = UVec3::from_array(cells.map(|n| n.div_ceil(BLOCK / 2)));
            let piece = |i: usize| {
                let seen = hash(i).trailing_zeros() >= sparsity;
                if seen { cast_piece::VISIBLE | cast_piece::PARTLY } else { 0 }
            };
            let count = (dimensions.x * dimensions.y * dimensions.z) as usize;
            let halves = BlockGrid { dimensions, blocks: (0..count).map(piece).collect() };
            let fine = halves.coarser_by(2, 0, |any, b| any | b);
            prop_assert_eq!(fine.dimensions, BLOCKS);
            let coarse = fine.coarser(0, |any, b| any | b);
            let blocks = BlockMap { halves, fine, coarse };
            let gray = ControlPoint { value: 0.0, color: [0.5; 3], opacity: 0.5 };
            let function = TransferFunction::new(vec![gray]).unwrap();
            let settings = RenderSettings { step, resolution: [61, 61], ..Default::default() };
            let scene = Scene::new(Layer::new(volume.clone(), &function), camera, settings).unwrap();
            let frame = Frame::new(&scene);
            for choice in [SimdChoice::Scalar, SimdChoice::Avx2, SimdChoice::Auto] {
                if let Ok(level) = choice.level() {
                    dispatch(level, March { frame: &frame, at, blocks: &blocks });
                }
            }
        }
    }
}
