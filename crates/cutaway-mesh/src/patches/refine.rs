//! Where a patch is cut into cells: a k-d tree over its parameters, and edges cut by their own curve alone.
//!
//! An edge is halved until each piece, by its control points, stays within half the tolerance of its chord. Nothing else
//! is asked, so every patch beside the edge, walking it forwards or backwards, gets the same vertices, and no other vertex
//! ever lies on the edge. Parameters are whole numbers of `1/unit`, so that turning round (`unit - k`) is exact.
//!
//! A patch is halved across the parameter in which it bends more, until each cell is within the tolerance by
//! [`BezierPatch::flatness`]. A cell at the outer boundary may be halved only where the edge has a vertex; otherwise it is
//! halved the other way, which makes it thinner, and a cell thin enough is as flat as the edge. Where both ways are
//! blocked (a corner of a twisted patch with straight edges) the cell becomes an inner rectangle, free on all sides, and
//! strips between it and the boundary, thin enough in the same sense, of one piece for each piece of the edge. So cells are convex, with sides along the
//! parameters or from corner to corner; the bound covers any triangulation of them on the vertices at hand.

use super::BezierPatch;
use super::topology::{Edge, Side, SideOfPatch, Topology};

/// Denominator of parameters in adaptive tessellation: a patch can be halved 27 times each way, far more than single
/// precision can show.
pub(super) const UNIT: u32 = 1 << 30;

/// A cell is never smaller than this, so that whole numbers have room inside.
const SMALLEST: u32 = 8;

/// A place in a patch: u and v as multiples of `1/unit`.
pub(super) type Place = (u32, u32);

/// Four corners, counter-clockwise (u to the right, v up).
pub(super) type Quad = [Place; 4];

/// Where an edge is cut, from 0 to `unit`; `None` if there are more than `most` pieces.
pub(super) fn cut_edge(edge: &Edge, tolerance: f64, most: u64) -> Option<Vec<u32>> {
    let mut cuts = vec![0];
    if edge.collapsed() {
        cuts.push(UNIT);
        return Some(cuts);
    }
    // A curve that ends where it begins would otherwise lie within any tolerance of its chord, if that is large.
    let closed = edge.points[0] == edge.points[edge.points.len() - 1];
    let widest = if closed { UNIT / 4 } else { UNIT };
    let mut stack = vec![(0, UNIT, edge.curve.clone())];
    while let Some((from, to, curve)) = stack.pop() {
        let flat = curve.flatness() <= 0.5 * tolerance && to - from <= widest;
        if flat || to - from <= SMALLEST {
            cuts.push(to);
            if cuts.len() as u64 > most {
                return None;
            }
            continue;
        }
        let middle = from + (to - from) / 2;
        let [before, after] = curve.split_u(0.5);
        stack.push((middle, to, after));
        stack.push((from, middle, before));
    }
    Some(cuts)
}

/// About how many cells a patch needs: bounds after a few halvings, and a formula from there on.
pub(super) fn estimated_cells(patch: &BezierPatch, tolerance: f64, halvings: u32) -> f64 {
    let bounds = patch.second_derivatives();
    if bounds.deviation() <= tolerance {
        return 1.0;
    }
    if halvings > 0 {
        let halves = if bounds.uu >= bounds.vv { patch.split_u(0.5) } else { patch.split_v(0.5) };
        return halves.iter().map(|half| estimated_cells(half, tolerance, halvings - 1)).sum();
    }
    // Fewest m x n with (uu / m² + 2 uv / m n + vv / n²) / 8 = tolerance, by the best ratio of m to n.
    let both = ((bounds.uu * bounds.vv).sqrt() + bounds.uv) / (4.0 * tolerance);
    let one = (bounds.uu.max(bounds.vv) / (8.0 * tolerance)).sqrt();
    both.max(one).max(1.0)
}

/// Cuts of an edge as a patch beside it sees them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boundary<'a> {
    cuts: &'a [u32],
    reversed: bool,
    collapsed: bool,
    unit: u32,
}

impl<'a> Boundary<'a> {
    pub(super) fn new(topology: &Topology, side: SideOfPatch, cuts: &'a [Vec<u32>], unit: u32) -> Self {
        let collapsed = topology.edges[side.edge].collapsed();
        Self { cuts: &cuts[side.edge], reversed: side.reversed, collapsed, unit }
    }

    /// Which cut lies at a parameter of the side. A collapsed edge has one vertex, wherever it is asked for.
    pub(super) fn cut_at(&self, at: u32) -> Option<usize> {
        if self.collapsed {
            return Some(0);
        }
        self.cuts.binary_search(&if self.reversed { self.unit - at } else { at }).ok()
    }

    /// Parameters of all vertices, in no particular order.
    pub(super) fn parameters(&self) -> impl Iterator<Item = u32> + 'a {
        let (reversed, unit) = (self.reversed, self.unit);
        self.cuts.iter().map(move |&cut| if reversed { unit - cut } else { cut })
    }
}

/// Cells of a patch.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub(super) quads: Vec<Quad>,
    /// Largest bound of the distance between a cell and its triangles.
    pub(super) deviation: f64,
}

struct Cell {
    /// Low and high, along u and v.
    range: [[u32; 2]; 2],
    surface: BezierPatch,
}

impl Cell {
    fn width(&self, axis: usize) -> u32 {
        self.range[axis][1] - self.range[axis][0]
    }

    fn corners(&self) -> Quad {
        let [[u0, u1], [v0, v1]] = self.range;
        [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]
    }
}

/// Cuts a patch into cells.
pub(super) struct Refiner<'a> {
    /// In the order of [`Side::ALL`](super::topology::Side::ALL).
    pub(super) boundary: [Boundary<'a>; 4],
    pub(super) tolerance: f64,
    /// No cell may reach from one side of the patch to the other.
    pub(super) at_least_halved: bool,
    /// Most cells.
    pub(super) most: u64,
}

impl Refiner<'_> {
    /// `None` if there would be more cells than allowed.
    pub(super) fn cells(&self, patch: &BezierPatch) -> Option<Cells> {
        let mut cells = Cells::default();
        let mut stack = vec![Cell { range: [[0, UNIT]; 2], surface: patch.clone() }];
        while let Some(cell) = stack.pop() {
            if cells.quads.len() as u64 >= self.most {
                return None;
            }
            let bounds = cell.surface.second_derivatives();
            let across = (0..2).find(|&axis| self.at_least_halved && cell.width(axis) == UNIT);
            if across.is_none() && bounds.deviation() <= self.tolerance {
                cells.deviation = cells.deviation.max(bounds.deviation());
                cells.quads.push(cell.corners());
                continue;
            }
            let bent = usize::from(bounds.vv > bounds.uu);
            let order = across.map_or([bent, 1 - bent], |axis| [axis, axis]);
            match order.into_iter().find(|&axis| self.may_halve(&cell, axis)) {
                Some(axis) => stack.extend(halve(cell, axis)),
                None if cell.width(0).min(cell.width(1)) > 2 * SMALLEST => {
                    self.inset(cell, &mut cells, &mut stack)
                }
                // Finer than single precision; how far off it is stays known.
                None => {
                    cells.deviation = cells.deviation.max(bounds.deviation());
                    cells.quads.push(cell.corners());
                }
            }
        }
        Some(cells)
    }

    /// Whether a cell reaches a side on which there are vertices to be kept to.
    fn at_side(&self, cell: &Cell, side: usize) -> bool {
        let [axis, end] = [side / 2, side % 2];
        cell.range[axis][end] == [0, UNIT][end] && !self.boundary[side].collapsed
    }

    /// Halving along u puts vertices on the two sides along u (v = 0 and v = 1), and the other way round.
    fn may_halve(&self, cell: &Cell, axis: usize) -> bool {
        let middle = cell.range[axis][0] + cell.width(axis) / 2;
        let sides = if axis == 0 { [2, 3] } else { [0, 1] };
        let free = |side: usize| !self.at_side(cell, side) || self.boundary[side].cut_at(middle).is_some();
        cell.width(axis) > SMALLEST && sides.into_iter().all(free)
    }

    /// Strips along the sides that lie on the outer boundary, and what is left inside.
    fn inset(&self, cell: Cell, cells: &mut Cells, stack: &mut Vec<Cell>) {
        // The vertices on those sides, the cell's corners included, rising.
        let vertices: [Vec<u32>; 4] = std::array::from_fn(|side| {
            let [low, high] = cell.range[1 - side / 2];
            let along = self.boundary[side].parameters().filter(|at| (low..=high).contains(at));
            let mut along: Vec<_> = if self.at_side(&cell, side) { along.collect() } else { Vec::new() };
            along.sort_unstable();
            along
        });
        let mut inner = cell.range;
        for side in (0..4).filter(|&side| !vertices[side].is_empty()) {
            let (width, deviation) = self.strip(&cell, side, &vertices);
            cells.deviation = cells.deviation.max(deviation);
            let [axis, end] = [side / 2, side % 2];
            inner[axis][end] = if end == 0 { inner[axis][0] + width } else { inner[axis][1] - width };
        }
        for (side, along) in Side::ALL.into_iter().zip(&vertices) {
            cells.quads.extend(pieces(side, along, &cell.range, &inner));
        }
        let surface = part(&cell, inner);
        stack.push(Cell { range: inner, surface });
    }

    /// How wide a strip along a side of a cell may be, so that each piece of it is flat, and how flat they are then. At
    /// most a quarter of the cell, and half-way to the first vertex on the sides next to it, so that no piece
    /// is longer than the piece of the edge that it lies at: in the limit it is as flat as that.
    fn strip(&self, cell: &Cell, side: usize, vertices: &[Vec<u32>; 4]) -> (u32, f64) {
        let [axis, end] = [side / 2, side % 2];
        let beside =
            [2 * (1 - axis), 2 * (1 - axis) + 1].into_iter().filter_map(|next| match vertices[next][..] {
                [first, second, ..] if end == 0 => Some((second - first) / 2),
                [.., second, last] => Some((last - second) / 2),
                _ => None,
            });
        let mut width = beside.fold(cell.width(axis) / 4, u32::min);
        loop {
            let deviation = vertices[side].windows(2).map(|piece| {
                let mut range = cell.range;
                range[1 - axis] = [piece[0], piece[1]];
                range[axis][1 - end] = if end == 0 { range[axis][0] + width } else { range[axis][1] - width };
                part(cell, range).flatness()
            });
            let deviation = deviation.fold(0.0, f64::max);
            if deviation <= self.tolerance || width / 2 < SMALLEST / 2 {
                return (width, deviation);
            }
            width /= 2;
        }
    }
}

/// The pieces of a strip between a side of a cell and the same side of the inner rectangle: one for each two vertices on
/// the side; the first and the last are slanted at the cell's corners.
fn pieces(side: Side, along: &[u32], outer: &[[u32; 2]; 2], inner: &[[u32; 2]; 2]) -> Vec<Quad> {
    let (axis, end) = match side {
        Side::ULow => (0, 0),
        Side::UHigh => (0, 1),
        Side::VLow => (1, 0),
        Side::VHigh => (1, 1),
    };
    let place = |across: u32, along: u32| if axis == 0 { (across, along) } else { (along, across) };
    let [low, high] = inner[1 - axis];
    let last = along.len().saturating_sub(1);
    let inside = |k: usize| {
        let at = match k {
            0 => low,
            k if k == last => high,
            k => along[k],
        };
        place(inner[axis][end], at)
    };
    let outside = |k: usize| place(outer[axis][end], along[k]);
    let quads = (0..last).map(|k| {
        let mut quad = [outside(k), outside(k + 1), inside(k + 1), inside(k)];
        if !side.with_the_walk() {
            quad.reverse();
        }
        quad
    });
    quads.collect()
}

fn halve(cell: Cell, axis: usize) -> [Cell; 2] {
    let middle = cell.range[axis][0] + cell.width(axis) / 2;
    let [before, after] = if axis == 0 { cell.surface.split_u(0.5) } else { cell.surface.split_v(0.5) };
    let mut ranges = [cell.range; 2];
    ranges[0][axis][1] = middle;
    ranges[1][axis][0] = middle;
    let [first, second] = ranges;
    [Cell { range: first, surface: before }, Cell { range: second, surface: after }]
}

/// The surface over a part of a cell's range.
fn part(cell: &Cell, range: [[u32; 2]; 2]) -> BezierPatch {
    let mut surface = cell.surface.clone();
    for (axis, ([low, high], [from, to])) in cell.range.into_iter().zip(range).enumerate() {
        let split =
            |surface: &BezierPatch, at| if axis == 0 { surface.split_u(at) } else { surface.split_v(at) };
        if to < high {
            [surface, _] = split(&surface, f64::from(to - low) / f64::from(high - low));
        }
        if from > low {
            [_, surface] = split(&surface, f64::from(from - low) / f64::from(to - low));
        }
    }
    surface
}
