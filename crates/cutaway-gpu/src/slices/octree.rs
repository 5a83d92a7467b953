//! The octree over a volume's blocks: what is visible, and bricks back to front (Rezk-Salama and Kolb 2005, section 6).
//!
//! A node of level `l` is a cube of `BLOCK << l` cells. Its children are the up to eight nodes of the next level below; the
//! leaves are bricks, of the size that the scene asks for. Visibility is that of the smallest blocks, each asked once a
//! transfer function by its least and greatest value; no voxel is read.

use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::value_ranges::{BLOCK, BlockGrid, ValueRanges};
use rayon::prelude::*;

/// Bricks at the most, drawn or not: of volumes with more, bricks are larger than asked for.
const MOST_BRICKS: usize = 1 << 20;

/// A cube of cells that is drawn at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Brick {
    /// Its first voxel.
    pub(super) origin: UVec3,
    /// Cells along an edge; there may be less where the volume ends.
    pub(super) edge: u32,
}

/// Where bricks are seen from, in voxel space.
#[derive(Clone, Copy, Debug)]
pub(super) enum Viewpoint {
    /// The eye.
    Eye(DVec3),
    /// Rays are parallel, and go this way.
    Direction(DVec3),
}

impl Viewpoint {
    /// The octant around a point that is nearest: bit `axis` is set where that is the upper side.
    fn nearest_octant(&self, split: DVec3) -> u32 {
        let upper = match self {
            Self::Eye(eye) => eye.cmpge(split),
            Self::Direction(direction) => direction.cmplt(DVec3::ZERO),
        };
        upper.bitmask()
    }
}

/// What of a volume's nodes is visible, from the level of bricks upward.
#[derive(Debug)]
pub(super) struct Octree {
    /// Voxels of the volume.
    dimensions: UVec3,
    /// Cells along an edge of a brick; none: the whole volume is one.
    brick: Option<u32>,
    /// By level, the bricks first. Nodes in which something is visible, and in which every brick is drawn.
    levels: Vec<BlockGrid<Seen>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Seen {
    any: bool,
    all: bool,
}

impl Octree {
    /// `brick`: cells along an edge, a power of two of at least [`BLOCK`], or 0 for a single brick. `visible`: whether stored
    /// numbers between two are. `reach`: whether what lies up to a block beside a visible one is drawn as well.
    pub(super) fn new(
        dimensions: UVec3,
        ranges: &ValueRanges,
        brick: u32,
        visible: impl Fn(f32, f32) -> bool + Sync,
        reach: bool,
    ) -> Self {
        if brick == 0 {
            return Self::whole(dimensions);
        }
        let blocks = &ranges.level0;
        let mut occupied = BlockGrid {
            dimensions: blocks.dimensions,
            blocks: blocks.blocks.par_iter().map(|&[lo, hi]| visible(lo, hi)).collect(),
        };
        if reach {
            occupied = grown(&occupied);
        }
        let mut edge = BLOCK;
        let mut nodes = BlockGrid {
            dimensions: occupied.dimensions,
            blocks: occupied.blocks.iter().map(|&any| Seen { any, all: any }).collect(),
        };
        while edge < brick || nodes.blocks.len() > MOST_BRICKS {
            nodes = halved(&nodes);
            // A brick is drawn whole.
            nodes.blocks.iter_mut().for_each(|seen| seen.all = seen.any);
            edge *= 2;
        }
        let mut levels = vec![nodes];
        while let Some(top) = levels.last().filter(|top| top.dimensions != UVec3::ONE) {
            levels.push(halved(top));
        }
        Self { dimensions, brick: Some(edge), levels }
    }

    /// The volume as a single brick, visible or not.
    pub(super) fn whole(dimensions: UVec3) -> Self {
        Self { dimensions, brick: None, levels: Vec::new() }
    }

    /// Bricks that there are, visible or not.
    pub(super) fn brick_count(&self) -> u64 {
        self.levels.first().map_or(1, |bricks| bricks.blocks.len() as u64)
    }

    /// Bricks of which something is visible.
    pub(super) fn visible_count(&self) -> u64 {
        self.levels.first().map_or(1, |bricks| bricks.blocks.iter().filter(|seen| seen.any).count() as u64)
    }

    /// The visible bricks, the farthest first. Where all of a node's bricks are visible they come as one.
    pub(super) fn back_to_front(&self, viewpoint: &Viewpoint) -> Vec<Brick> {
        let Some(edge) = self.brick else {
            return vec![Brick { origin: UVec3::ZERO, edge: self.dimensions.max_element() }];
        };
        let mut bricks = Vec::new();
        self.visit(self.levels.len() - 1, UVec3::ZERO, edge, viewpoint, &mut bricks);
        bricks
    }

    fn visit(&self, level: usize, at: UVec3, edge: u32, viewpoint: &Viewpoint, found: &mut Vec<Brick>) {
        let seen = self.levels[level].get(at);
        if !seen.any {
            return;
        }
        let side = edge << level;
        if level == 0 || seen.all {
            found.push(Brick { origin: at * side, edge: side });
            return;
        }
        let below = self.levels[level - 1].dimensions;
        let nearest = viewpoint.nearest_octant((at * side + side / 2).as_dvec3());
        // From the octant that is on the far side of all three planes through the middle to the one on the near side: an
        // octant is only ever hidden by those that differ from the nearest one in fewer axes, whose numbers are less.
        for octant in (0..8).rev().map(|i: u32| i ^ nearest) {
            let child = at * 2 + UVec3::new(octant & 1, octant >> 1 & 1, octant >> 2);
            if child.cmplt(below).all() {
                self.visit(level - 1, child, edge, viewpoint, found);
            }
        }
    }
}

/// The grid one level up. What lies outside the volume hinders no merging.
fn halved(nodes: &BlockGrid<Seen>) -> BlockGrid<Seen> {
    let dimensions = (nodes.dimensions + 1) / 2;
    let mut blocks = vec![Seen { any: false, all: true }; dimensions.element_product() as usize];
    let of = |b: UVec3| ((b.z * dimensions.y + b.y) * dimensions.x + b.x) as usize;
    for (i, seen) in nodes.blocks.iter().enumerate() {
        let up = &mut blocks[of(place(i, nodes.dimensions) / 2)];
        *up = Seen { any: up.any || seen.any, all: up.all && seen.all };
    }
    BlockGrid { dimensions, blocks }
}

/// With the neighbours of what is set.
fn grown(occupied: &BlockGrid<bool>) -> BlockGrid<bool> {
    let last = occupied.dimensions - 1;
    let beside = |i: usize| {
        let at = place(i, occupied.dimensions);
        let (lo, hi) = (at.saturating_sub(UVec3::ONE), (at + 1).min(last));
        (lo.z..=hi.z).any(|z| (lo.y..=hi.y).any(|y| (lo.x..=hi.x).any(|x| occupied.get(UVec3::new(x, y, z)))))
    };
    let blocks = (0..occupied.blocks.len()).into_par_iter().map(beside).collect();
    BlockGrid { dimensions: occupied.dimensions, blocks }
}

fn place(index: usize, dimensions: UVec3) -> UVec3 {
    let (x, y) = (dimensions.x as usize, dimensions.y as usize);
    UVec3::new((index % x) as u32, (index / x % y) as u32, (index / (x * y)) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::volume::{Geometry, Rescale, Volume};

    fn volume(dimensions: UVec3, value: impl Fn(UVec3) -> u8) -> Volume {
        let count = dimensions.element_product() as usize;
        let voxels: Vec<u8> = (0..count).map(|i| value(place(i, dimensions))).collect();
        Volume::new(dimensions, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    /// Every way to look at bricks of every size: no brick is hidden by one that was drawn before it, and together they are
    /// the visible ones, each once.
    #[test]
    fn nearer_bricks_come_later() {
        let dimensions = UVec3::new(70, 41, 23);
        let volume = volume(dimensions, |p| ((p.x / 9 + p.y / 7 * 3 + p.z / 5 * 5) % 4) as u8);
        let ranges = ValueRanges::new(&volume);
        let points =
            [DVec3::new(-90.0, 10.0, 4.0), DVec3::new(33.0, 17.0, 11.0), DVec3::new(300.0, -200.0, 90.0)];
        let views = points.iter().flat_map(|p| [Viewpoint::Eye(*p), Viewpoint::Direction(*p)]);
        for view in views {
            for edge in [8, 16, 32, 64, 128] {
                let tree = Octree::new(dimensions, &ranges, edge, |_, hi| hi > 2.5, false);
                let bricks = tree.back_to_front(&view);
                let cells: u64 = bricks.iter().map(|b| u64::from(b.edge / edge).pow(3)).sum();
                assert!(cells >= tree.visible_count(), "{view:?}, {edge}");
                assert!(tree.visible_count() < tree.brick_count() || edge > 8);
                for (i, a) in bricks.iter().enumerate() {
                    for b in &bricks[..i] {
                        assert!(!hides(&view, b, a), "{view:?}: {b:?} hides {a:?}, which comes after it");
                    }
                }
            }
        }
    }

    /// Whether a ray may go through `a` first and then through `b`: not if along some axis `b` comes first, or lies on the
    /// other side of the eye.
    fn hides(view: &Viewpoint, a: &Brick, b: &Brick) -> bool {
        (0..3).all(|axis| {
            let (a_lo, b_lo) = (f64::from(a.origin[axis]), f64::from(b.origin[axis]));
            let (a_hi, b_hi) = (a_lo + f64::from(a.edge), b_lo + f64::from(b.edge));
            let b_is_nearer = match view {
                Viewpoint::Eye(eye) => {
                    (b_hi <= a_lo && eye[axis] <= a_lo) || (a_hi <= b_lo && eye[axis] >= a_hi)
                }
                Viewpoint::Direction(d) => (b_hi <= a_lo && d[axis] > 0.0) || (a_hi <= b_lo && d[axis] < 0.0),
            };
            !b_is_nearer
        }) && a != b
    }

    #[test]
    fn bricks_are_empty_or_together_as_the_transfer_function_has_it() {
        let dimensions = UVec3::splat(65);
        let volume = volume(dimensions, |p| u8::from(p.x > 40) * 9);
        let ranges = ValueRanges::new(&volume);
        let view = Viewpoint::Direction(DVec3::X);
        let bricks = |edge, least: f32| {
            Octree::new(dimensions, &ranges, edge, |_, hi| hi >= least, false).back_to_front(&view)
        };
        assert_eq!(bricks(16, 0.0), [Brick { origin: UVec3::ZERO, edge: 64 }]);
        assert_eq!(bricks(16, 10.0), []);
        // Half of it, in nodes of 32; of those at 32 to 64, all bricks of 16 have a visible block.
        assert!(bricks(16, 5.0).iter().all(|b| b.edge == 32 && b.origin.x == 32));
        assert_eq!(bricks(0, 10.0).len(), 1);
        // Blocks from 40 on are visible; with what is beside them, from 32 on.
        let least = |reach| {
            let tree = Octree::new(dimensions, &ranges, 8, |_, hi| hi >= 5.0, reach);
            tree.back_to_front(&view).iter().map(|b| b.origin.x).min()
        };
        assert_eq!((least(false), least(true)), (Some(40), Some(32)));
    }
}
