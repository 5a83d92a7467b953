//! Occupancy: which blocks of a volume a classification can make visible, and how a ray crosses them.
//!
//! Made from [`ValueRanges`] in time proportional to the number of blocks, so a transfer-function edit is cheap: no
//! voxel is read. [`BlockWalk`] crosses the two levels along a ray and yields the occupied stretches: empty level-1
//! blocks in one step, the rest block by block.

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use crate::value_ranges::{BLOCK, BlockGrid, ValueRanges};

/// What a ray does at a level-0 block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum BlockState {
    /// It may hold something visible.
    Occupied,
    /// Nothing in it is visible.
    Empty,
    /// Nothing in its whole level-1 block is visible.
    EmptyLevel1,
}

/// Which blocks can be visible.
#[derive(Clone, Debug, PartialEq)]
pub struct Occupancy {
    /// Blocks of [`BLOCK`]³ cells; each also knows about its level-1 block.
    states: BlockGrid<BlockState>,
    /// Whether any block of a level-1 block is occupied.
    level1: BlockGrid<bool>,
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

    fn from_level0(occupied: BlockGrid<bool>) -> Self {
        let level1 = occupied.coarser(false, |any, b| any | b);
        let d = occupied.dimensions;
        let row = |row: usize| {
            let (y, z) = (row as u32 % d.y, row as u32 / d.y);
            let (occupied, level1) = (&occupied, &level1);
            (0..d.x).map(move |x| {
                let b = UVec3::new(x, y, z);
                match (occupied.get(b), level1.get(b / BLOCK)) {
                    (true, _) => BlockState::Occupied,
                    (false, true) => BlockState::Empty,
                    (false, false) => BlockState::EmptyLevel1,
                }
            })
        };
        let blocks = (0..(d.y * d.z) as usize).into_par_iter().flat_map_iter(row).collect();
        Self { states: BlockGrid { dimensions: d, blocks }, level1 }
    }

    /// Whether a level-0 block is occupied.
    pub fn is_occupied(&self, b: UVec3) -> bool {
        self.states.get(b) == BlockState::Occupied
    }

    /// Whether the level-0 block of a linear index is occupied.
    #[inline]
    pub fn level0(&self, index: usize) -> bool {
        self.states.blocks[index] == BlockState::Occupied
    }

    /// Whether any block in the level-1 block of a linear index is occupied.
    #[inline]
    pub fn level1(&self, index: usize) -> bool {
        self.level1.blocks[index]
    }

    /// Level-1 blocks along x, y, z.
    pub fn level1_dimensions(&self) -> UVec3 {
        self.level1.dimensions
    }

    /// Level-0 blocks along x, y, z.
    pub fn dimensions(&self) -> UVec3 {
        self.states.dimensions
    }

    /// The share of level-0 blocks that are occupied, 0..=1.
    pub fn occupied_fraction(&self) -> f64 {
        let occupied = self.states.blocks.iter().filter(|b| **b == BlockState::Occupied).count();
        occupied as f64 / self.states.blocks.len().max(1) as f64
    }

    /// The next stretch of occupied blocks along a walk that was begun with these blocks' dimensions.
    #[inline]
    pub fn next_run(&self, walk: &mut BlockWalk) -> Option<(f32, f32)> {
        walk.next_run(|index, _| self.states.blocks[index])
    }
}

/// A ray on its way through the blocks of a volume.
///
/// The ray is `origin + t * direction` in voxel space, inside the volume's box for `t` in `0..t_end`; `t` may have any
/// unit. Stretches come in ascending order; a run of touching occupied blocks comes as one, unless it is longer than
/// [`BlockWalk::LONGEST_RUN`] blocks (so that a ray which will end early is not walked to its far end first).
#[derive(Clone, Copy, Debug)]
pub struct BlockWalk {
    origin: [f32; 3],
    direction: [f32; 3],
    inverse: [f32; 3],
    /// Blocks along each axis.
    dimensions: [i32; 3],
    /// The block that the ray is in.
    block: [i32; 3],
    /// Where the ray leaves the block along each axis.
    exit: [f32; 3],
    /// Where the ray enters the block.
    t: f32,
    t_end: f32,
    /// A thousandth of a voxel along the ray: past a block's face, on the far side of rounding.
    nudge: f32,
}

/// Components of a direction below this count as zero: such a ray never reaches a plane of that axis.
const NO_DIRECTION: f32 = 1e-12;

impl BlockWalk {
    /// Blocks after which a run is handed out even if the next block is occupied too.
    pub const LONGEST_RUN: u32 = 4;

    /// A walk that has already ended.
    pub const ENDED: Self = Self {
        origin: [0.0; 3],
        direction: [0.0; 3],
        inverse: [0.0; 3],
        dimensions: [1; 3],
        block: [0; 3],
        exit: [f32::INFINITY; 3],
        t: 0.0,
        t_end: 0.0,
        nudge: 1.0,
    };

    /// Starts at `t = 0`. `dimensions`: level-0 blocks along x, y, z.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3, t_end: f32, dimensions: UVec3) -> Self {
        let nudge = 1e-3 / direction.abs().max_element().max(NO_DIRECTION);
        let mut walk = Self {
            origin: origin.to_array(),
            direction: direction.to_array(),
            inverse: (1.0 / direction).to_array(),
            dimensions: dimensions.as_ivec3().to_array(),
            t_end,
            nudge,
            ..Self::ENDED
        };
        walk.enter(0.0);
        walk
    }

    /// The next stretch of blocks that are occupied; `state` gets a block's linear index and its coordinates.
    #[inline]
    pub fn next_run(&mut self, state: impl Fn(usize, [i32; 3]) -> BlockState) -> Option<(f32, f32)> {
        let mut run: Option<(f32, u32)> = None;
        while self.t < self.t_end {
            let [x, y, z] = self.block;
            let index = (z * self.dimensions[1] + y) * self.dimensions[0] + x;
            match (state(index as usize, self.block), run) {
                (BlockState::Occupied, None) => run = Some((self.t, 1)),
                (BlockState::Occupied, Some((start, n))) if n < Self::LONGEST_RUN => {
                    run = Some((start, n + 1))
                }
                (_, Some((start, _))) => return Some((start, self.t)),
                (BlockState::Empty, None) => {}
                (BlockState::EmptyLevel1, None) => {
                    self.leap();
                    continue;
                }
            }
            self.step();
        }
        run.map(|(start, _)| (start, self.t_end))
    }

    /// The distance at which the ray meets the far side of block `b` of an edge, along an axis.
    #[inline]
    fn plane(&self, axis: usize, b: i32, edge: i32) -> f32 {
        let d = self.direction[axis];
        if d.abs() < NO_DIRECTION {
            return f32::INFINITY;
        }
        let side = (b + i32::from(d > 0.0)) * edge;
        (side as f32 - self.origin[axis]) * self.inverse[axis]
    }

    /// To the neighbour through whose face the ray goes.
    #[inline]
    fn step(&mut self) {
        let [x, y, z] = self.exit;
        let axis = if x <= y.min(z) {
            0
        } else if y <= z {
            1
        } else {
            2
        };
        self.t = self.exit[axis].max(self.t);
        self.block[axis] += if self.direction[axis] > 0.0 { 1 } else { -1 };
        if self.block[axis] < 0 || self.block[axis] >= self.dimensions[axis] {
            self.t = self.t_end;
            return;
        }
        self.exit[axis] = self.plane(axis, self.block[axis], BLOCK as i32);
    }

    /// Past the whole level-1 block.
    #[inline]
    fn leap(&mut self) {
        let far = |axis: usize| self.plane(axis, self.block[axis] / BLOCK as i32, (BLOCK * BLOCK) as i32);
        let exit = far(0).min(far(1)).min(far(2));
        self.enter(exit.max(self.t + self.nudge));
    }

    /// Finds the block at `t`.
    #[inline]
    fn enter(&mut self, t: f32) {
        self.t = t;
        for axis in 0..3 {
            let p = self.origin[axis] + self.direction[axis] * (t + self.nudge);
            self.block[axis] = ((p * (1.0 / BLOCK as f32)) as i32).clamp(0, self.dimensions[axis] - 1);
            self.exit[axis] = self.plane(axis, self.block[axis], BLOCK as i32);
        }
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
        let walk = BlockWalk::new(Vec3::new(0.0, 3.0, 3.0), Vec3::X, 159.0, UVec3::new(20, 2, 2));
        assert_eq!(runs(&one, walk), [(96.0, 104.0)]);
        let back = BlockWalk::new(Vec3::new(159.0, 3.0, 3.0), Vec3::NEG_X, 159.0, UVec3::new(20, 2, 2));
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
            let found = runs(&occupancy, BlockWalk::new(a, direction, t_end, d));
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
                    prop_assert_eq!(covered, occupancy.is_occupied(block), "at {}", t);
                }
            }
        }
    }
}
