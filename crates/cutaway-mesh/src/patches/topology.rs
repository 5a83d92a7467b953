//! Which patches share which boundary curve.
//!
//! Control points that single precision could not tell apart become one. After that, two boundary curves are the same
//! if they have the same control points, forwards or backwards: a question of numbers, not of distances. Each is kept
//! once, in a direction of its own, and whatever is asked of it has one answer for all patches beside it.

use std::collections::HashMap;

use cutaway_core::glam::DVec3;

use super::{BezierPatch, PatchSet};

/// Distance below which control points are one, as a part of the largest coordinate: half a unit in the last place of
/// single precision, which is what the mesh will have.
const WELD: f64 = 1.0 / (1 << 24) as f64;

/// Relative difference below which weights are equal: they differ by the rounding of two ways of computing them.
const WEIGHTS: f64 = 1e-9;

/// A side of a patch's unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// u = 0, along v.
    ULow,
    /// u = 1, along v.
    UHigh,
    /// v = 0, along u.
    VLow,
    /// v = 1, along u.
    VHigh,
}

impl Side {
    pub(super) const ALL: [Self; 4] = [Self::ULow, Self::UHigh, Self::VLow, Self::VHigh];

    /// Whether walking round the square with its inside to the left (u to the right, v up) goes along the side's
    /// parameter, not against it.
    pub(super) fn with_the_walk(self) -> bool {
        matches!(self, Self::VLow | Self::UHigh)
    }
}

/// A side of a patch, as seen from its edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Use {
    pub(super) patch: usize,
    pub(super) side: Side,
    pub(super) reversed: bool,
}

/// A boundary curve of one or more patches.
#[derive(Debug)]
pub(super) struct Edge {
    /// The curve: a patch whose second degree is zero.
    pub(super) curve: BezierPatch,
    /// Numbers of its control points.
    pub(super) points: Vec<u32>,
    pub(super) uses: Vec<Use>,
}

impl Edge {
    /// All control points are one: a pole.
    pub(super) fn collapsed(&self) -> bool {
        self.points.iter().all(|&p| p == self.points[0])
    }
}

/// A side of a patch: which edge it is, and whether the edge's parameter runs the other way.
#[derive(Clone, Copy, Debug)]
pub(super) struct SideOfPatch {
    pub(super) edge: usize,
    pub(super) reversed: bool,
}

/// The patches with welded control points, and the edges between them.
#[derive(Debug)]
pub(super) struct Topology {
    pub(super) patches: Vec<BezierPatch>,
    /// In the order of [`Side::ALL`].
    pub(super) sides: Vec<[SideOfPatch; 4]>,
    pub(super) edges: Vec<Edge>,
    /// Positions of the welded control points.
    pub(super) points: Vec<DVec3>,
}

impl Topology {
    pub(super) fn new(set: &PatchSet, largest_coordinate: f64) -> Self {
        let mut welder = Welder::new(largest_coordinate * WELD);
        let mut edges = Edges::default();
        let mut patches = set.patches().to_vec();
        let mut sides = Vec::with_capacity(patches.len());
        for (number, patch) in patches.iter_mut().enumerate() {
            let names: Vec<u32> = patch.points().map(|p| welder.name(p)).collect();
            patch.set_points(names.iter().map(|&name| welder.points[name as usize]));
            sides.push(Side::ALL.map(|side| edges.add(patch, &names, number, side)));
        }
        Self { patches, sides, edges: edges.list, points: welder.points }
    }
}

/// Gives points that are close to each other one name.
struct Welder {
    distance: f64,
    points: Vec<DVec3>,
    /// Named points by cell. Cells are larger than the distance, so that few have to be looked into.
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Welder {
    fn new(distance: f64) -> Self {
        Self { distance, points: Vec::new(), cells: HashMap::new() }
    }

    fn cell(&self, p: DVec3) -> [i64; 3] {
        // Where all points are at the origin the distance is zero; then one cell is enough.
        let width = if self.distance > 0.0 { 8.0 * self.distance } else { 1.0 };
        (p / width).floor().to_array().map(|x| x as i64)
    }

    fn name(&mut self, p: DVec3) -> u32 {
        let (low, high) = (self.cell(p - self.distance), self.cell(p + self.distance));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let near = self.cells.get(&[x, y, z]).into_iter().flatten().copied();
                    let mut near = near.filter(|&n| self.points[n as usize].distance(p) <= self.distance);
                    if let Some(name) = near.next() {
                        return name;
                    }
                }
            }
        }
        let name = self.points.len() as u32;
        self.points.push(p);
        self.cells.entry(self.cell(p)).or_default().push(name);
        name
    }
}

#[derive(Default)]
struct Edges {
    list: Vec<Edge>,
    /// By control points in the edge's direction; those with the same points differ in their weights.
    by_points: HashMap<Vec<u32>, Vec<usize>>,
}

impl Edges {
    fn add(&mut self, patch: &BezierPatch, names: &[u32], number: usize, side: Side) -> SideOfPatch {
        let [p, q] = patch.degree();
        let (first, step, count) = match side {
            Side::ULow => (0, 1, q + 1),
            Side::UHigh => (p * (q + 1), 1, q + 1),
            Side::VLow => (0, q + 1, p + 1),
            Side::VHigh => (q, q + 1, p + 1),
        };
        let mut at: Vec<usize> = (0..count).map(|k| first + k * step).collect();
        let mut points: Vec<u32> = at.iter().map(|&k| names[k]).collect();
        let reversed = points.iter().rev().lt(points.iter());
        if reversed {
            at.reverse();
            points.reverse();
        }
        let mut net: Vec<_> = at.iter().map(|&k| patch.net()[k]).collect();
        // A common factor of the weights changes nothing.
        let most = net.iter().map(|p| p.w).fold(0.0, f64::max);
        net.iter_mut().for_each(|p| *p /= most);
        let same = |edge: &Edge| {
            let pairs = edge.curve.net().iter().zip(&net);
            pairs.into_iter().all(|(a, b)| (a.w - b.w).abs() <= WEIGHTS)
        };
        let known = self.by_points.entry(points.clone()).or_default();
        let edge = known.iter().copied().find(|&k| same(&self.list[k])).unwrap_or_else(|| {
            known.push(self.list.len());
            let curve = BezierPatch::from_net([count - 1, 0], net);
            self.list.push(Edge { curve, points, uses: Vec::new() });
            self.list.len() - 1
        });
        self.list[edge].uses.push(Use { patch: number, side, reversed });
        SideOfPatch { edge, reversed }
    }
}
