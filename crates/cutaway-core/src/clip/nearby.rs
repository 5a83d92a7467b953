//! Finds the objects of a clip whose boxes a line meets, so that a ray through a clip of many objects asks only a few of
//! them.
//!
//! Input: boxes in the world, once per clip. Output: numbers of objects, once per ray. The boxes are in a binary tree, halved
//! at the median of their centres along the longest axis.

use glam::DVec3;

use crate::camera::Ray;

/// Clips of fewer objects have no tree: asking all of them is as fast.
const FEWEST: usize = 32;

/// Objects in a leaf of the tree.
const LEAF: usize = 4;

/// By how much boxes grow, as a share of the largest coordinate: far more than a line is rounded.
const PADDING: f64 = 1e-9;

/// A tree of boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    nodes: Vec<Node>,
    /// Objects in the order of the tree's leaves.
    order: Vec<u32>,
    /// Objects without a finite box: every line may meet them.
    endless: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// In a leaf of the tree the first object and their number; else the right child and 0. The left child comes next.
    first: u32,
    count: u32,
}

impl Boxes {
    /// Builds a tree over the boxes of objects; `None` where there are so few that none is needed.
    pub(super) fn new(boxes: &[[DVec3; 2]]) -> Option<Self> {
        if boxes.len() < FEWEST {
            return None;
        }
        let mut tree = Self::default();
        let is_finite = |object: &u32| boxes[*object as usize].iter().all(|end| end.is_finite());
        let all = 0..boxes.len() as u32;
        let mut finite;
        (finite, tree.endless) = all.partition(is_finite);
        if !finite.is_empty() {
            tree.add(boxes, &mut finite);
        }
        Some(tree)
    }

    /// Adds a node over some of the objects, with all below it.
    fn add(&mut self, boxes: &[[DVec3; 2]], objects: &mut [u32]) {
        let ends = objects.iter().map(|object| boxes[*object as usize]);
        let around = ends.reduce(|[low, high], [l, h]| [low.min(l), high.max(h)]);
        let [low, high] = around.unwrap_or_default();
        let padding = PADDING * low.abs().max(high.abs()).max_element();
        let node = self.nodes.len();
        let (first, count) = (self.order.len() as u32, objects.len() as u32);
        self.nodes.push(Node { low: low - padding, high: high + padding, first, count });
        if objects.len() <= LEAF {
            self.order.extend_from_slice(objects);
            return;
        }
        let axis = (high - low).max_position();
        let center = |object: &u32| {
            let [low, high] = boxes[*object as usize];
            low[axis] * 0.5 + high[axis] * 0.5
        };
        let half = objects.len() / 2;
        objects.select_nth_unstable_by(half, |a, b| center(a).total_cmp(&center(b)));
        let (left, right) = objects.split_at_mut(half);
        self.add(boxes, left);
        (self.nodes[node].first, self.nodes[node].count) = (self.nodes.len() as u32, 0);
        self.add(boxes, right);
    }

    /// Replaces `found` by the objects that the whole line of a ray may meet, ascending.
    pub(super) fn along(&self, ray: &Ray, stack: &mut Vec<u32>, found: &mut Vec<u32>) {
        found.clear();
        found.extend_from_slice(&self.endless);
        stack.clear();
        stack.extend((!self.nodes.is_empty()).then_some(0));
        let inverse = ray.direction.recip();
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if !node.is_met(ray, inverse) {
                continue;
            }
            if node.count > 0 {
                let first = node.first as usize;
                found.extend_from_slice(&self.order[first..first + node.count as usize]);
            } else {
                stack.extend([at + 1, node.first]);
            }
        }
        found.sort_unstable();
    }
}

impl Node {
    /// True if the line meets the box, or touches it.
    fn is_met(&self, ray: &Ray, inverse: DVec3) -> bool {
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let (low, high) = (self.low[axis] - ray.origin[axis], self.high[axis] - ray.origin[axis]);
            if inverse[axis].is_finite() {
                let (a, b) = (low * inverse[axis], high * inverse[axis]);
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            } else if low > 0.0 || high < 0.0 {
                return false;
            }
        }
        // The quotients are rounded; a line along a face must not be lost.
        near - far <= 1e-12 * near.abs().max(far.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_box_that_a_line_meets_is_found(
            boxes in prop::collection::vec((prop::array::uniform3(-9i32..9), prop::array::uniform3(0i32..4)), 32..200),
            origin in prop::array::uniform3(-9i32..9), direction in prop::array::uniform3(-3i32..=3),
        ) {
            prop_assume!(direction != [0; 3]);
            let vector = |v: [i32; 3]| DVec3::from_array(v.map(f64::from));
            let boxes: Vec<[DVec3; 2]> = boxes.iter().map(|(low, size)| [vector(*low), vector(*low) + vector(*size)])
                .chain([[DVec3::NEG_INFINITY, DVec3::INFINITY]]).collect();
            let ray = Ray { origin: vector(origin), direction: vector(direction) };
            let mut found = Vec::new();
            Boxes::new(&boxes).unwrap().along(&ray, &mut Vec::new(), &mut found);
            prop_assert!(found.is_sorted());
            prop_assert_eq!(*found.last().unwrap(), boxes.len() as u32 - 1);
            // Points of the line in steps of a twelfth of its direction: those in a box are on whole numbers' faces, too.
            for (object, [low, high]) in (0..).zip(&boxes) {
                let is_inside = |k: i32| {
                    let point = ray.origin + ray.direction * (f64::from(k) / 12.0);
                    point.cmpge(*low).all() && point.cmple(*high).all()
                };
                prop_assert!(found.binary_search(&object).is_ok() || !(-300..300).any(is_inside));
            }
        }
    }

    #[test]
    fn few_objects_have_no_tree() {
        assert!(Boxes::new(&[[DVec3::ZERO, DVec3::ONE]; 5]).is_none());
    }
}
