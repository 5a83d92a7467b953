//! Occupancy: which blocks of a volume a classification can make visible, and how a ray crosses them.
//!
//! Made from [`ValueRanges`] in time proportional to the number of blocks, so a transfer-function edit is cheap: no
//! voxel is read. [`BlockWalk`] crosses the two levels along a ray and yields the occupied stretches: empty level-1
//! blocks in one step, the rest block by block.

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use crate::value_ranges::{BLOCK, BlockGrid, ValueRanges};

/// Which blocks can be visible.
#[derive(Clone, Debug, PartialEq)]
pub struct Occupancy {
    /// Blocks of [`BLOCK`]³ cells.
    pub level0: BlockGrid<bool>,
    /// Whether any level-0 block in a block of [`BLOCK`]³ of them is occupied.
    pub level1: BlockGrid<bool>,
}

impl Occupancy {
    /// Asks `visible(least, greatest stored number)` for every block.
    pub fn new(ranges: &ValueRanges, visible: impl Fn(f32, f32) -> bool + Sync) -> Self {
        let blocks: Vec<bool> = ranges.level0.blocks.par_iter().map(|&[lo, hi]| visible(lo, hi)).collect();
        Self::from_level0(BlockGrid { dimensions: ranges.level0.dimensions, blocks })
    }

    /// Every block occupied: no skipping.
    pub fn full(ranges: &ValueRanges) -> Self {
        let blocks = vec![true; ranges.level0.blocks.len()];
        Self::from_level0(BlockGrid { dimensions: ranges.level0.dimensions, blocks })
    }

    fn from_level0(level0: BlockGrid<bool>) -> Self {
        let level1 = level0.coarser(false, |any, b| any | b);
        Self { level0, level1 }
    }

    /// The share of level-0 blocks that are occupied, 0..=1.
    pub fn occupied_fraction(&self) -> f64 {
        let occupied = self.level0.blocks.iter().filter(|b| **b).count();
        occupied as f64 / self.level0.blocks.len().max(1) as f64
    }

    /// The next stretch of occupied blocks along a walk.
    #[inline]
    pub fn next_run(&self, walk: &mut BlockWalk) -> Option<(f32, f32)> {
        walk.next_run(
            self.level1.dimensions,
            |b| self.level1.blocks[b],
            self.level0.dimensions,
            |b| self.level0.blocks[b],
        )
    }
}

/// A ray on its way through the blocks of a volume.
///
/// The ray is `origin + t * direction` in voxel space, inside the volume's box for `t` in `0..t_end`; `t` may have any
/// unit. Stretches come in ascending order; a run of touching occupied blocks comes as one, unless it is longer than
/// [`BlockWalk::LONGEST_RUN`] blocks (so that a ray which will end early is not walked to its far end first).
#[derive(Clone, Copy, Debug)]
pub struct BlockWalk {
    origin: Vec3,
    direction: Vec3,
    /// Distance to the far plane of a block of edge 1 at the origin, and its growth: `(side - origin) / direction`.
    inverse: Vec3,
    /// 1 where the ray leaves a block through its upper plane.
    upper: Vec3,
    t: f32,
    t_end: f32,
    /// A step that certainly leaves a block plane behind: a thousandth of a voxel.
    nudge: f32,
}

impl BlockWalk {
    /// Blocks after which a run is handed out even if the next block is occupied too.
    pub const LONGEST_RUN: u32 = 4;

    /// Starts at `t = 0`.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3, t_end: f32) -> Self {
        // A component of about zero counts as upward: its plane is then never behind the ray, its distance +infinity.
        let pick = |d: f32| if d > -1e-12 { 1.0 } else { 0.0 };
        let upper = Vec3::new(pick(direction.x), pick(direction.y), pick(direction.z));
        let invert = |d: f32| if d.abs() > 1e-12 { 1.0 / d } else { f32::INFINITY };
        let inverse = Vec3::new(invert(direction.x), invert(direction.y), invert(direction.z));
        let nudge = 1e-3 / direction.abs().max_element().max(1e-12);
        Self { origin, direction, inverse, upper, t: 0.0, t_end, nudge }
    }

    /// A walk that has already ended.
    pub const ENDED: Self = Self {
        origin: Vec3::ZERO,
        direction: Vec3::ZERO,
        inverse: Vec3::ZERO,
        upper: Vec3::ZERO,
        t: 0.0,
        t_end: 0.0,
        nudge: 1.0,
    };

    /// Leaves out everything before `t`.
    #[inline]
    pub fn skip_to(&mut self, t: f32) {
        self.t = self.t.max(t);
    }

    /// The next stretch of blocks for which both predicates hold; they get linear block indices.
    #[inline]
    pub fn next_run(
        &mut self,
        dimensions1: UVec3,
        level1: impl Fn(usize) -> bool,
        dimensions0: UVec3,
        level0: impl Fn(usize) -> bool,
    ) -> Option<(f32, f32)> {
        let mut run: Option<(f32, u32)> = None;
        while self.t < self.t_end {
            let p = self.origin + self.direction * (self.t + self.nudge);
            let cell = p.max(Vec3::ZERO).as_uvec3();
            let b1 = (cell / (BLOCK * BLOCK)).min(dimensions1 - UVec3::ONE);
            let index = |b: UVec3, d: UVec3| {
                (b.z as usize * d.y as usize + b.y as usize) * d.x as usize + b.x as usize
            };
            if !level1(index(b1, dimensions1)) {
                if let Some((start, _)) = run {
                    return Some((start, self.t));
                }
                self.leave(b1, (BLOCK * BLOCK) as f32);
                continue;
            }
            let b0 = (cell / BLOCK).min(dimensions0 - UVec3::ONE);
            let occupied = level0(index(b0, dimensions0));
            match run {
                None if occupied => run = Some((self.t, 1)),
                Some((start, n)) if !occupied || n == Self::LONGEST_RUN => return Some((start, self.t)),
                Some((start, n)) => run = Some((start, n + 1)),
                None => {}
            }
            self.leave(b0, BLOCK as f32);
        }
        run.map(|(start, _)| (start, self.t_end))
    }

    /// Moves on to where the ray leaves block `b` of a grid of this `edge`.
    #[inline]
    fn leave(&mut self, b: UVec3, edge: f32) {
        let plane = (b.as_vec3() + self.upper) * edge;
        let exit = (plane - self.origin) * self.inverse;
        // Along components of zero this is infinite, or NaN on a plane; neither is ever the least.
        let exit = exit.x.min(exit.y.min(exit.z.min(self.t_end)));
        self.t = exit.max(self.t + self.nudge);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn runs(occupancy: &Occupancy, mut walk: BlockWalk) -> Vec<(f32, f32)> {
        std::iter::from_fn(|| occupancy.next_run(&mut walk)).collect()
    }

    fn occupancy(dimensions: UVec3, occupied: impl Fn(UVec3) -> bool) -> Occupancy {
        let mut blocks = Vec::new();
        for z in 0..dimensions.z {
            for y in 0..dimensions.y {
                for x in 0..dimensions.x {
                    blocks.push(occupied(UVec3::new(x, y, z)));
                }
            }
        }
        Occupancy::from_level0(BlockGrid { dimensions, blocks })
    }

    #[test]
    fn an_axis_ray_finds_its_blocks() {
        let one = occupancy(UVec3::new(20, 2, 2), |b| b.x == 12 && b.y == 0 && b.z == 0);
        let walk = BlockWalk::new(Vec3::new(0.0, 3.0, 3.0), Vec3::X, 159.0);
        assert_eq!(runs(&one, walk), [(96.0, 104.0)]);
        let back = BlockWalk::new(Vec3::new(159.0, 3.0, 3.0), Vec3::NEG_X, 159.0);
        let found = runs(&one, back);
        assert!(
            found.len() == 1 && (found[0].0 - 55.0).abs() < 1e-4 && (found[0].1 - 63.0).abs() < 1e-4,
            "{found:?}"
        );
        assert!(runs(&one, BlockWalk::ENDED).is_empty());
    }

    proptest! {
        /// Occupancy never hides a visible sample, and skips at least what is not within reach of one.
        #[test]
        fn every_point_in_an_occupied_block_is_in_a_run(
            seed: u64, origin in prop::array::uniform3(0.0f32..=1.0), to in prop::array::uniform3(0.0f32..=1.0),
        ) {
            let d = UVec3::new(13, 9, 17);
            let hash = |b: UVec3| (u64::from(b.x) * 31 + u64::from(b.y) * 57 + u64::from(b.z) * 131 + seed)
                .wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61 == 0;
            let occupancy = occupancy(d, hash);
            let size = d.as_vec3() * BLOCK as f32;
            let (a, b) = (Vec3::from_array(origin) * size, Vec3::from_array(to) * size);
            prop_assume!(a.distance(b) > 1.0);
            let t_end = a.distance(b);
            let direction = (b - a) / t_end;
            let found = runs(&occupancy, BlockWalk::new(a, direction, t_end));
            for pair in found.windows(2) {
                prop_assert!(pair[0].1 <= pair[1].0);
            }
            for i in 0..4000 {
                let t = t_end * (i as f32 + 0.5) / 4000.0;
                let p = a + direction * t;
                let block = (p / BLOCK as f32).as_uvec3().min(d - UVec3::ONE);
                // Within a hundredth of a voxel of a block's plane either side is right.
                let off = (p / BLOCK as f32 - (p / BLOCK as f32).round()).abs().min_element() * BLOCK as f32;
                if off > 0.01 {
                    let covered = found.iter().any(|r| (r.0..r.1).contains(&t));
                    prop_assert_eq!(covered, occupancy.level0.get(block), "at {}", t);
                }
            }
        }
    }
}
