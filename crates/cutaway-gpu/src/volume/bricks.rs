//! How a volume is cut into bricks, and which of them are to be there at which level.
//!
//! A brick is a cube of cells with its voxels and one voxel around them, so a *slot* of `edge + 3` texels along each axis,
//! whatever the brick's level: one of level `l` stretches over `edge << l` cells and has every `1 << l`-th voxel, averaged
//! over its surroundings. Only visible bricks are wanted; where there are not slots enough, groups of eight become one of
//! the next level, those first that lose least.

use cutaway_core::glam::UVec3;
use cutaway_core::value_ranges::{BLOCK, ValueRanges};

/// Texels of a slot along an axis beyond the cells of its brick: the far voxel of the last cell, and one on either side.
pub(crate) const BORDER: u32 = 3;

/// Slots along an axis at the most: their coordinates have ten bits, see `shared/bricks.wgsl`.
const MOST_SLOTS: u32 = 1023;

/// Cells along an edge of a brick, the first choice first: of larger ones less is border, of smaller ones less is empty.
const EDGES: [u32; 4] = [32, 64, 16, BLOCK];

/// A volume's bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BrickGrid {
    /// Voxels of the volume.
    pub(crate) dimensions: UVec3,
    /// Cells along an edge of a brick of the finest level.
    pub(crate) edge: u32,
    /// Bricks of the finest level along x, y, z.
    pub(crate) pages: UVec3,
    /// Slots along any axis of the atlas at the most.
    pub(super) side: u32,
    /// Slots at the most.
    pub(crate) most_slots: u64,
}

impl BrickGrid {
    /// Bricks for an atlas of at most `max_side` texels along an axis and `max_bytes`; `None` if it holds not even one.
    pub(crate) fn new(dimensions: UVec3, texel_bytes: u32, max_side: u32, max_bytes: u64) -> Option<Self> {
        let grids = EDGES.iter().filter_map(|&edge| {
            let pages = (dimensions - UVec3::ONE).max(UVec3::ONE).map(|cells| cells.div_ceil(edge));
            let side = (max_side / (edge + BORDER)).min(MOST_SLOTS);
            let slot_bytes = u64::from(edge + BORDER).pow(3) * u64::from(texel_bytes);
            let most_slots = u64::from(side).pow(3).min(max_bytes / slot_bytes);
            let fits = most_slots > 0 && pages.max_element() <= max_side;
            fits.then_some(Self { dimensions, edge, pages, side, most_slots })
        });
        // The first that holds everything; else the one that holds most.
        let mut best: Option<Self> = None;
        for grid in grids {
            if grid.most_slots >= grid.page_count() as u64 {
                return Some(grid);
            }
            best = best.filter(|b| b.most_cells() >= grid.most_cells()).or(Some(grid));
        }
        best
    }

    fn most_cells(&self) -> u64 {
        self.most_slots * u64::from(self.edge).pow(3)
    }

    /// Bricks of the finest level.
    pub(crate) fn page_count(&self) -> usize {
        self.pages.x as usize * self.pages.y as usize * self.pages.z as usize
    }

    /// Texels along an edge of a slot.
    pub(crate) fn slot_edge(&self) -> u32 {
        self.edge + BORDER
    }

    /// Slots along x, y, z of an atlas for `wanted` bricks, or as many as may be; at least one.
    pub(crate) fn atlas(&self, wanted: u64) -> UVec3 {
        let wanted = wanted.clamp(1, self.most_slots);
        let side = u64::from(self.side);
        let x = (wanted as f64).cbrt().ceil().clamp(1.0, side as f64) as u64;
        let y = ((wanted as f64 / x as f64).sqrt().ceil() as u64).clamp(1, side);
        let z = wanted.div_ceil(x * y).clamp(1, side);
        if x * y * z <= self.most_slots {
            return UVec3::new(x as u32, y as u32, z as u32);
        }
        // The last layer would be over the limit in bytes; of a few slots, a row of them.
        match self.most_slots / (x * y) {
            0 => UVec3::new(self.most_slots.min(side) as u32, 1, 1),
            z => UVec3::new(x as u32, y as u32, z as u32),
        }
    }

    fn coordinates(&self, page: usize) -> UVec3 {
        let (x, y) = (self.pages.x as usize, self.pages.y as usize);
        UVec3::new((page % x) as u32, (page / x % y) as u32, (page / (x * y)) as u32)
    }

    fn page(&self, at: UVec3) -> usize {
        (at.z as usize * self.pages.y as usize + at.y as usize) * self.pages.x as usize + at.x as usize
    }
}

/// A brick: its level, and its place among the bricks of that level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Brick {
    pub(crate) level: u32,
    pub(crate) at: [u32; 3],
}

/// What a classification wants of a volume in bricks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Wanted {
    /// Of each brick of the finest level, whether anything in it can be visible.
    pub(crate) visible: Vec<bool>,
    /// The least and greatest stored number in it.
    ranges: Vec<[f32; 2]>,
}

impl Wanted {
    /// The bricks of which `occupied` is true of a block. With `margin`, also of a block beside one of theirs: for what
    /// looks further than the samples that it draws.
    pub(crate) fn new(grid: &BrickGrid, ranges: &ValueRanges, occupied: &[bool], margin: bool) -> Self {
        let blocks = ranges.level0.dimensions;
        let edge = grid.edge / BLOCK;
        let reach = u32::from(margin);
        let mut wanted = Self {
            visible: vec![false; grid.page_count()],
            ranges: vec![[f32::INFINITY, f32::NEG_INFINITY]; grid.page_count()],
        };
        let mut block = 0;
        for z in 0..blocks.z {
            for y in 0..blocks.y {
                for x in 0..blocks.x {
                    let at = UVec3::new(x, y, z);
                    let page = grid.page(at / edge);
                    let ([lo, hi], [a, b]) = (wanted.ranges[page], ranges.level0.blocks[block]);
                    wanted.ranges[page] = [lo.min(a), hi.max(b)];
                    if occupied[block] {
                        let first = at.saturating_sub(UVec3::splat(reach)) / edge;
                        let last = (at + reach).min(blocks - UVec3::ONE) / edge;
                        wanted.show(grid, first, last);
                    }
                    block += 1;
                }
            }
        }
        wanted
    }

    fn show(&mut self, grid: &BrickGrid, first: UVec3, last: UVec3) {
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    self.visible[grid.page(UVec3::new(x, y, z))] = true;
                }
            }
        }
    }

    /// Bricks that can be visible.
    pub(crate) fn count(&self) -> u64 {
        self.visible.iter().filter(|v| **v).count() as u64
    }
}

/// Which bricks are to be there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Plan {
    /// Of each brick of the finest level, the level it is kept at; `None` where nothing is visible.
    pub(crate) levels: Vec<Option<u32>>,
    /// All bricks that are to be there.
    pub(crate) bricks: Vec<Brick>,
}

impl Plan {
    /// The finest bricks that fit into so many slots, one at least.
    pub(crate) fn new(grid: &BrickGrid, wanted: &Wanted, slots: u64) -> Self {
        let mut levels: Vec<Option<u32>> = wanted.visible.iter().map(|v| v.then_some(0)).collect();
        let mut count = wanted.count();
        let mut level = 0;
        while count > slots.max(1) {
            level += 1;
            count = coarsen(grid, wanted, &mut levels, level, count, slots);
        }
        let mut bricks: Vec<Brick> = (0..levels.len())
            .filter_map(|page| levels[page].map(|level| brick_of(grid, page, level)))
            .collect();
        bricks.sort_unstable();
        bricks.dedup();
        Self { levels, bricks }
    }

    /// The coarsest level.
    pub(crate) fn coarsest(&self) -> u32 {
        self.levels.iter().flatten().copied().max().unwrap_or(0)
    }

    /// The share of visible bricks that are coarser than the volume.
    pub(crate) fn coarser_share(&self) -> f64 {
        let visible = self.levels.iter().flatten().count().max(1);
        self.levels.iter().flatten().filter(|l| **l > 0).count() as f64 / visible as f64
    }
}

/// The brick of a level in which a brick of the finest level lies.
pub(crate) fn brick_of(grid: &BrickGrid, page: usize, level: u32) -> Brick {
    Brick { level, at: (grid.coordinates(page) >> level).to_array() }
}

/// Merges bricks into those of `level` until `count` is at most `slots`, or all are; the new count.
fn coarsen(
    grid: &BrickGrid,
    wanted: &Wanted,
    levels: &mut [Option<u32>],
    level: u32,
    mut count: u64,
    slots: u64,
) -> u64 {
    let mut groups: std::collections::BTreeMap<Brick, Group> = std::collections::BTreeMap::new();
    for (page, own) in levels.iter().enumerate() {
        let Some(own) = *own else { continue };
        let group = groups.entry(brick_of(grid, page, level)).or_default();
        let [lo, hi] = wanted.ranges[page];
        group.span = [group.span[0].min(lo), group.span[1].max(hi)];
        group.members.insert(brick_of(grid, page, own));
        group.pages.push(page);
    }
    let mut groups: Vec<Group> = groups.into_values().filter(|g| g.members.len() > 1).collect();
    groups.sort_by(|a, b| a.loss().total_cmp(&b.loss()));
    for group in groups {
        if count <= slots {
            break;
        }
        count -= group.members.len() as u64 - 1;
        for page in group.pages {
            levels[page] = Some(level);
        }
    }
    count
}

/// Bricks that could become one.
struct Group {
    members: std::collections::BTreeSet<Brick>,
    pages: Vec<usize>,
    span: [f32; 2],
}

impl Default for Group {
    fn default() -> Self {
        let span = [f32::INFINITY, f32::NEG_INFINITY];
        Self { members: Default::default(), pages: Vec::new(), span }
    }
}

impl Group {
    /// What merging costs a slot that it frees: detail is at most the span of values.
    fn loss(&self) -> f32 {
        (self.span[1] - self.span[0]) / (self.members.len() as f32 - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_edge_is_the_first_that_holds_everything() {
        let d = UVec3::new(1000, 900, 800);
        assert_eq!(BrickGrid::new(d, 1, 2048, u64::MAX).unwrap().edge, 32);
        // 200 texels: 5 slots along an axis for 10 by 4 by 4 bricks, 2 for 5 by 2 by 2, but 10 for 19 by 7 by 7.
        assert_eq!(BrickGrid::new(UVec3::new(300, 100, 100), 1, 200, u64::MAX).unwrap().edge, 16);
        assert_eq!(BrickGrid::new(d, 4, 10, u64::MAX), None);
        assert_eq!(BrickGrid::new(d, 4, 2048, 100), None);
    }

    fn wanted(grid: &BrickGrid, seed: u64) -> Wanted {
        let hash = |i: usize| (i as u64 + seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 56;
        let n = grid.page_count();
        Wanted {
            visible: (0..n).map(|i| hash(i) > 100).collect(),
            ranges: (0..n)
                .map(|i| [hash(i + n) as f32, hash(i + n) as f32 + hash(i + 2 * n) as f32])
                .collect(),
        }
    }

    proptest! {
        /// An atlas has room for what is wanted, or is as large as it may be to within a layer, and never larger.
        #[test]
        fn an_atlas_keeps_its_limits(side in 11u32..3000, bytes in 2000u64..1 << 40, n in 1u64..1 << 30) {
            if let Some(grid) = BrickGrid::new(UVec3::splat(700), 2, side, bytes) {
                let slots = grid.atlas(n);
                let count = u64::from(slots.x) * u64::from(slots.y) * u64::from(slots.z);
                prop_assert!(count >= 1 && count <= grid.most_slots);
                prop_assert!((slots * grid.slot_edge()).max_element() <= side);
                prop_assert!(count >= n.min(grid.most_slots) || 4 * count >= grid.most_slots);
                prop_assert!(slots.max_element() <= 1023);
            }
        }

        /// However few slots there are, every visible brick is there at some level, in no more than the slots.
        #[test]
        fn a_plan_fits_and_forgets_nothing(x in 1u32..200, y in 1u32..200, z in 1u32..90, seed: u64, slots in 1u64..60) {
            let grid = BrickGrid::new(UVec3::new(x, y, z), 1, 100, u64::MAX).unwrap();
            let wanted = wanted(&grid, seed);
            let plan = Plan::new(&grid, &wanted, slots);
            prop_assert!(plan.bricks.len() as u64 <= slots);
            for (page, level) in plan.levels.iter().enumerate() {
                prop_assert_eq!(level.is_some(), wanted.visible[page]);
                if let Some(level) = level {
                    prop_assert!(plan.bricks.contains(&brick_of(&grid, page, *level)));
                }
            }
            if wanted.count() <= slots {
                prop_assert_eq!((plan.coarsest(), plan.coarser_share()), (0, 0.0));
            }
        }
    }
}
