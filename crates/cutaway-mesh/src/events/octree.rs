//! An octree over the triangles, walked by the parametric algorithm of Revelles, Ureña and Lastra, "An efficient
//! parametric algorithm for octree traversal", WSCG 2000: Termeer 3.1.2.

use std::collections::VecDeque;

use cutaway_core::glam::DVec3;

use super::lines::{PADDING, UnitSpace};
use super::overlap::triangle_meets_box;
use crate::TriangleMesh;

/// Cells with at most so many triangles stay whole.
const LEAF_TRIANGLES: usize = 8;

/// Levels below the root: cells of 1/1024 of the mesh.
const DEPTH: u32 = 10;

/// Entries per triangle; when there are more, what is not yet divided stays whole.
const ENTRIES_PER_TRIANGLE: usize = 6;

/// Half the side of the root cube in unit space.
const HALF: f64 = 0.5 + PADDING;

/// A child without triangles.
const EMPTY: u32 = u32::MAX;

/// Set in a child that is a leaf.
const LEAF: u32 = 1 << 31;

/// The octree, in unit space. Bit 0 of a child's number says whether it is the upper one in x, bit 1 in y, bit 2 in z.
#[derive(Debug)]
pub(super) struct Octree {
    /// Children of the inner nodes, the root first: [`EMPTY`], a leaf with [`LEAF`], or an inner node.
    nodes: Vec<[u32; 8]>,
    /// Where the triangles of each leaf begin; one more than there are leaves.
    offsets: Vec<u32>,
    triangles: Vec<u32>,
}

/// A cube of triangles that is still to be entered in its parent.
struct Pending {
    /// The parent and which child of it this is.
    parent: u32,
    child: usize,
    center: DVec3,
    half: f64,
    depth: u32,
    triangles: Vec<u32>,
}

impl Octree {
    pub(super) fn new(mesh: &TriangleMesh, space: &UnitSpace) -> Self {
        let count = mesh.triangles().len();
        let mut tree = Self { nodes: vec![[EMPTY; 8]], offsets: vec![0], triangles: Vec::new() };
        let mut pending = VecDeque::new();
        divide(
            mesh,
            space,
            &(0..count as u32).collect::<Vec<_>>(),
            (DVec3::ZERO, HALF),
            |child, cube, triangles| {
                pending.push_back(Pending {
                    parent: 0,
                    child,
                    center: cube.0,
                    half: cube.1,
                    depth: 1,
                    triangles,
                });
            },
        );
        // Level by level, so that a budget that runs out leaves cells of one size.
        let mut entries: usize = pending.iter().map(|p| p.triangles.len()).sum();
        let limit = ENTRIES_PER_TRIANGLE * count + 4096;
        while let Some(Pending { parent, child, center, half, depth, triangles }) = pending.pop_front() {
            let whole = triangles.len() <= LEAF_TRIANGLES || depth >= DEPTH || entries > limit;
            tree.nodes[parent as usize][child] = if whole {
                tree.leaf(&triangles)
            } else {
                let node = tree.nodes.len() as u32;
                tree.nodes.push([EMPTY; 8]);
                entries -= triangles.len();
                divide(mesh, space, &triangles, (center, half), |child, (center, half), triangles| {
                    entries += triangles.len();
                    pending.push_back(Pending {
                        parent: node,
                        child,
                        center,
                        half,
                        depth: depth + 1,
                        triangles,
                    });
                });
                node
            };
        }
        tree.nodes.shrink_to_fit();
        tree.offsets.shrink_to_fit();
        tree.triangles.shrink_to_fit();
        tree
    }

    fn leaf(&mut self, triangles: &[u32]) -> u32 {
        self.triangles.extend_from_slice(triangles);
        self.offsets.push(self.triangles.len() as u32);
        LEAF | (self.offsets.len() - 2) as u32
    }

    pub(super) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<[u32; 8]>()
            + (self.offsets.capacity() + self.triangles.capacity()) * size_of::<u32>()
    }

    /// Visits the triangles of all leaves along a line, some of them repeatedly.
    pub(super) fn walk(&self, point: DVec3, direction: DVec3, visit: &mut impl FnMut(u32)) {
        let (mut enter, mut leave, mut mirror) = ([0.0; 3], [0.0; 3], 0);
        for axis in 0..3 {
            // The root is symmetric: a line towards -x in a mirror is one towards +x. A line across an axis is taken
            // for one that leans by less than is ever rounded, so that no parameter is infinite.
            let (mut at, mut along) = (point[axis], direction[axis]);
            if along < 0.0 {
                (at, along, mirror) = (-at, -along, mirror | 1 << axis);
            }
            let along = along.max(1e-30);
            enter[axis] = (-HALF - at) / along;
            leave[axis] = (HALF - at) / along;
        }
        if max(enter) <= min(leave) {
            self.walk_node(0, enter, leave, mirror, visit);
        }
    }

    /// Visits a child entry; `enter` and `leave` are where the line crosses the lower and upper planes of its cube.
    fn walk_node(
        &self,
        entry: u32,
        enter: [f64; 3],
        leave: [f64; 3],
        mirror: usize,
        visit: &mut impl FnMut(u32),
    ) {
        if entry == EMPTY {
            return;
        }
        if entry & LEAF != 0 {
            let leaf = (entry & !LEAF) as usize;
            let (start, end) = (self.offsets[leaf] as usize, self.offsets[leaf + 1] as usize);
            self.triangles[start..end].iter().for_each(|&triangle| visit(triangle));
            return;
        }
        let middle: [f64; 3] = std::array::from_fn(|axis| 0.5 * (enter[axis] + leave[axis]));
        // The line is in the upper half of an axis when it has passed its middle plane on entry (Revelles' table 1).
        let start = max(enter);
        let mut child = (0..3).fold(0, |child, axis| child | usize::from(middle[axis] < start) << axis);
        loop {
            let upper = |axis: usize| child >> axis & 1 == 1;
            let child_enter =
                std::array::from_fn(|axis| if upper(axis) { middle[axis] } else { enter[axis] });
            let child_leave: [f64; 3] =
                std::array::from_fn(|axis| if upper(axis) { leave[axis] } else { middle[axis] });
            let child_entry = self.nodes[entry as usize][child ^ mirror];
            self.walk_node(child_entry, child_enter, child_leave, mirror, visit);
            // It leaves through the nearest plane; out of the cube where that is the upper one (table 3).
            let out = min(child_leave);
            let axis = (0..3).find(|&axis| child_leave[axis] == out).unwrap_or(2);
            if upper(axis) {
                return;
            }
            child |= 1 << axis;
        }
    }
}

/// Hands out the parts of a cube, given by its centre and half its side, that hold triangles.
fn divide(
    mesh: &TriangleMesh,
    space: &UnitSpace,
    triangles: &[u32],
    (center, half): (DVec3, f64),
    mut part: impl FnMut(usize, (DVec3, f64), Vec<u32>),
) {
    for child in 0..8 {
        let side = |axis: usize| if child >> axis & 1 == 1 { 0.5 } else { -0.5 };
        let (center, half) = (center + DVec3::new(side(0), side(1), side(2)) * half, half * 0.5);
        let inside = overlapping(mesh, space, triangles, center, half);
        if !inside.is_empty() {
            part(child, (center, half), inside);
        }
    }
}

/// Those of the triangles that overlap a cube, or nearly.
fn overlapping(
    mesh: &TriangleMesh,
    space: &UnitSpace,
    triangles: &[u32],
    center: DVec3,
    half: f64,
) -> Vec<u32> {
    let half = DVec3::splat(half + PADDING);
    let meets = |&triangle: &u32| {
        let corners = space.corners(mesh, triangle as usize);
        let (low, high) =
            (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
        if low.cmpgt(center + half).any() || high.cmplt(center - half).any() {
            return false;
        }
        let inside = low.cmpge(center - half).all() && high.cmple(center + half).all();
        inside || triangle_meets_box(&corners, center, half)
    };
    triangles.iter().copied().filter(meets).collect()
}

fn max(t: [f64; 3]) -> f64 {
    t[0].max(t[1]).max(t[2])
}

fn min(t: [f64; 3]) -> f64 {
    t[0].min(t[1]).min(t[2])
}
