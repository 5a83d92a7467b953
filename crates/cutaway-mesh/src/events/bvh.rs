//! A bounding volume hierarchy from the crate `obvhs`, walked along the whole line.
//!
//! `obvhs` (MIT or Apache 2.0) computes on the glam that is here already; `bvh` brings nalgebra, `rtbvh` crossbeam and
//! num. Its own traversals have stacks of a depth that is fixed or guessed, hence the loop here.

use std::time::Duration;

use cutaway_core::glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::ray::Ray;
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;

use super::lines::UnitSpace;
use crate::TriangleMesh;

/// By how much boxes are grown in unit space: four times what f32 rounds in a line (coordinates up to 4, four
/// roundings of 6e-8 each).
const BOX_PADDING: f32 = 4e-6;

/// A line starts this many directions before its point nearest to the mesh's centre: outside, as the mesh reaches 0.87.
const BEFORE: f64 = 2.0;

/// Triangles in one tree, at least; the builder takes time that grows with the square of their number, and goes as deep,
/// where all boxes lie in one another.
const TREE_TRIANGLES: usize = 1024;

/// The hierarchy, in unit space: trees of neighbouring triangles, and a tree of those trees.
pub(super) struct Bvh {
    top: Bvh2,
    trees: Vec<Tree>,
}

/// A hierarchy over some of the triangles.
struct Tree {
    tree: Bvh2,
    /// The mesh's triangles in the order of the tree's leaves.
    triangles: Vec<u32>,
}

impl std::fmt::Debug for Bvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bvh").field("trees", &self.trees.len()).finish_non_exhaustive()
    }
}

/// A box that the builder asks for.
#[derive(Clone, Copy)]
struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    pub(super) fn new(mesh: &TriangleMesh, space: &UnitSpace) -> Self {
        let count = mesh.triangles().len();
        let bounds = |triangle: u32| {
            let [a, b, c] = space.corners(mesh, triangle as usize).map(|c| c.as_vec3a());
            Bounds(Aabb::new(a.min(b).min(c) - BOX_PADDING, a.max(b).max(c) + BOX_PADDING))
        };
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.par_sort_by_cached_key(|&triangle| {
            let Bounds(around) = bounds(triangle);
            morton((around.min + around.max) * 0.5)
        });
        let length = TREE_TRIANGLES.max(count.isqrt());
        let trees: Vec<Tree> = order
            .par_chunks(length)
            .map(|triangles| {
                let boxes: Vec<Bounds> = triangles.iter().map(|&triangle| bounds(triangle)).collect();
                let mut tree = build(&boxes);
                let triangles = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
                tree.primitive_indices = Vec::new();
                Tree { tree, triangles }
            })
            .collect();
        let boxes: Vec<Bounds> = trees.iter().map(|tree| Bounds(*tree.tree.nodes[0].aabb())).collect();
        Self { top: build(&boxes), trees }
    }

    pub(super) fn bytes(&self) -> usize {
        let nodes = |tree: &Bvh2| tree.nodes.capacity() * size_of::<Bvh2Node>();
        let tree = |tree: &Tree| {
            nodes(&tree.tree) + tree.triangles.capacity() * size_of::<u32>() + size_of::<Tree>()
        };
        nodes(&self.top) + self.trees.iter().map(tree).sum::<usize>()
    }

    /// Visits the triangles of all leaves that a line meets, each once.
    pub(super) fn walk(
        &self,
        point: DVec3,
        direction: DVec3,
        stack: &mut Vec<u32>,
        mut visit: impl FnMut(u32),
    ) {
        let origin: Vec3A = (point - direction * BEFORE).as_vec3a();
        let ray = Ray::new_inf(origin, direction.as_vec3a());
        walk_tree(&self.top, &ray, stack, |first, count, stack| {
            for &tree in &self.top.primitive_indices[first..first + count] {
                let Tree { tree, triangles } = &self.trees[tree as usize];
                walk_tree(tree, &ray, stack, |first, count, _| {
                    triangles[first..first + count].iter().for_each(|&triangle| visit(triangle));
                });
            }
        });
    }
}

fn build(boxes: &[Bounds]) -> Bvh2 {
    let parameters =
        BvhBuildParams { pre_split: false, max_prims_per_leaf: 8, ..BvhBuildParams::fast_build() };
    let mut tree = build_bvh2(boxes, parameters, &mut Duration::default());
    tree.parents = Vec::new();
    tree.primitives_to_nodes = Vec::new();
    tree.nodes.shrink_to_fit();
    tree.primitive_indices.shrink_to_fit();
    tree
}

/// Calls `leaf` with the range of primitives of each leaf that a ray meets. What is on the stack already stays there.
#[inline(always)]
fn walk_tree(
    tree: &Bvh2,
    ray: &Ray,
    stack: &mut Vec<u32>,
    mut leaf: impl FnMut(usize, usize, &mut Vec<u32>),
) {
    let bottom = stack.len();
    let nodes = &tree.nodes;
    let met = |node: u32| nodes[node as usize].aabb().intersect_ray(ray) < f32::INFINITY;
    if met(0) {
        stack.push(0);
    }
    while stack.len() > bottom {
        let Some(at) = stack.pop() else { return };
        let node = &nodes[at as usize];
        let first = node.first_index;
        if node.is_leaf() {
            leaf(first as usize, node.prim_count as usize, stack);
        } else {
            stack.extend([first, first + 1].into_iter().filter(|&child| met(child)));
        }
    }
}

/// Where a point of unit space is along a Morton curve, with 10 bits an axis.
fn morton(point: Vec3A) -> u32 {
    let spread = |v: f32| {
        let v = ((v + 0.5) * 1024.0).clamp(0.0, 1023.0) as u32;
        (0..10).fold(0, |code, bit| code | (v >> bit & 1) << (3 * bit))
    };
    spread(point.x) | spread(point.y) << 1 | spread(point.z) << 2
}
