//! The corners of a polygon that are left, in order, with a grid to find those near a triangle.

use std::cell::Cell;

use cutaway_core::glam::DVec2;

use super::push;

/// Sine of the angle below which a corner is straight, as far as rounding can tell.
const STRAIGHT: f64 = 1e-12;

/// A polygon that is being taken apart. Corners that were cut off keep their numbers until [`Ring::compact`].
pub(super) struct Ring {
    /// Vertex and place of each corner.
    vertex: Vec<u32>,
    at: Vec<DVec2>,
    /// Neighbours of each corner.
    last: Vec<u32>,
    next: Vec<u32>,
    alive: Vec<bool>,
    /// Number of corners that are left.
    left: usize,
    grid: Grid,
}

impl Ring {
    pub(super) fn new(vertex: Vec<u32>, at: Vec<DVec2>) -> Self {
        let left = vertex.len();
        let mut ring =
            Self { vertex, at, last: vec![], next: vec![], alive: vec![], left, grid: Grid::default() };
        ring.number();
        ring
    }

    /// Number of corners that are left.
    pub(super) fn len(&self) -> usize {
        self.left
    }

    /// Returns the vertices of the corners that are left.
    pub(super) fn into_rest(mut self) -> Vec<u32> {
        self.compact();
        self.vertex
    }

    /// Links all corners to their neighbours and sorts them into the grid.
    fn number(&mut self) {
        let n = self.at.len() as u32;
        self.last = (0..n).map(|i| (i + n - 1) % n).collect();
        self.next = (0..n).map(|i| (i + 1) % n).collect();
        self.alive = vec![true; n as usize];
        self.grid = Grid::new(&self.at);
    }

    /// Forgets the corners that were cut off.
    fn compact(&mut self) {
        let mut alive = self.alive.iter();
        self.vertex.retain(|_| alive.next().is_some_and(|alive| *alive));
        let mut alive = self.alive.iter();
        self.at.retain(|_| alive.next().is_some_and(|alive| *alive));
        if self.left > 0 {
            self.number();
        }
    }

    /// Cuts off a corner.
    fn cut(&mut self, corner: usize, triangles: &mut Vec<[u32; 3]>) {
        let (last, next) = (self.last[corner], self.next[corner]);
        push([last, corner as u32, next].map(|c| self.vertex[c as usize]), triangles);
        self.next[last as usize] = next;
        self.last[next as usize] = last;
        self.alive[corner] = false;
        self.left -= 1;
    }

    /// The places of a corner's last neighbour, of itself and of its next neighbour.
    fn around(&self, corner: usize) -> [DVec2; 3] {
        [self.last[corner] as usize, corner, self.next[corner] as usize].map(|c| self.at[c])
    }

    /// Cuts off corners at the place of the next one.
    pub(super) fn cut_doubled_corners(&mut self, triangles: &mut Vec<[u32; 3]>) {
        for corner in 0..self.at.len() {
            if self.left > 3 && self.at[corner] == self.at[self.next[corner] as usize] {
                self.cut(corner, triangles);
            }
        }
        self.compact();
    }

    /// Goes around once and cuts off ears; true where there was one. Neighbours of an ear wait for the next round:
    /// otherwise all triangles would be slivers from one corner.
    pub(super) fn cut_ears(&mut self, slack: f64, triangles: &mut Vec<[u32; 3]>, budget: &mut usize) -> bool {
        let before = self.left;
        let mut waits = vec![false; self.at.len()];
        for corner in 0..self.at.len() {
            if self.left == 3 || *budget == 0 {
                break;
            }
            if !waits[corner] && self.is_ear(corner, slack, budget) {
                waits[self.last[corner] as usize] = true;
                waits[self.next[corner] as usize] = true;
                self.cut(corner, triangles);
            }
        }
        self.compact();
        self.left < before
    }

    /// Cuts off a corner without area, rather one at a tip than a straight one; false where there is none.
    pub(super) fn cut_flat_corner(&mut self, triangles: &mut Vec<[u32; 3]>) -> bool {
        let mut straight = None;
        for corner in 0..self.at.len() {
            let [a, b, c] = self.around(corner);
            if turn(a, b, c).abs() > STRAIGHT * (b - a).length() * (c - b).length() {
                continue;
            }
            straight = Some(corner);
            if (b - a).dot(c - b) <= 0.0 {
                break;
            }
        }
        let Some(corner) = straight else { return false };
        self.cut(corner, triangles);
        self.compact();
        true
    }

    /// True if the corner is convex, no edge enters its triangle deeper than `slack`, and the triangle is inside.
    fn is_ear(&self, corner: usize, slack: f64, budget: &mut usize) -> bool {
        let [a, b, c] = self.around(corner);
        if turn(a, b, c) <= STRAIGHT * (b - a).length() * (c - b).length() {
            return false;
        }
        let sides = [Side::new(a, b), Side::new(b, c), Side::new(c, a)];
        let own = [self.last[corner] as usize, corner, self.next[corner] as usize];
        let touched = Cell::new(false);
        // An edge that enters the triangle ends inside it or on its border, unless the polygon crosses itself.
        let free = self.grid.all_near([a.min(b).min(c), a.max(b).max(c)], budget, |other| {
            !self.alive[other] || {
                let [p, q, r] = self.around(other);
                let touches = !own.contains(&other) && sides.iter().all(|side| side.distance(q) >= -slack);
                touched.set(touched.get() || touches);
                !enters(&sides, p, q, slack) && !enters(&sides, q, r, slack)
            }
        });
        // Where the polygon touches the triangle, the triangle can be a hole whose edges run along the corner's.
        free && (!touched.get() || self.winds_around((a + b + c) / 3.0, budget))
    }

    /// True if the polygon that is left winds around a point, counter-clockwise.
    fn winds_around(&self, point: DVec2, budget: &mut usize) -> bool {
        *budget = budget.saturating_sub(self.at.len());
        let crossing = |corner: usize| {
            let (p, q) = (self.at[corner], self.at[self.next[corner] as usize]);
            match (p.y <= point.y, q.y <= point.y) {
                (true, false) if turn(p, q, point) > 0.0 => 1,
                (false, true) if turn(p, q, point) < 0.0 => -1,
                _ => 0,
            }
        };
        (0..self.at.len()).filter(|corner| self.alive[*corner]).map(crossing).sum::<i64>() > 0
    }
}

/// Twice the area of a triangle; positive where it turns left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

/// The line along a side of a triangle.
struct Side {
    start: DVec2,
    inward: DVec2,
}

impl Side {
    fn new(start: DVec2, end: DVec2) -> Self {
        Self { start, inward: (end - start).perp().normalize_or_zero() }
    }

    /// Distance from the line, positive inside the triangle.
    fn distance(&self, point: DVec2) -> f64 {
        self.inward.dot(point - self.start)
    }
}

/// True if a part of the edge from `p` to `q` lies deeper than `slack` in a triangle.
fn enters(sides: &[Side; 3], p: DVec2, q: DVec2, slack: f64) -> bool {
    let (mut first, mut end) = (0f64, 1f64);
    for side in sides {
        let (at_p, at_q) = (side.distance(p) - slack, side.distance(q) - slack);
        match (at_p > 0.0, at_q > 0.0) {
            (false, false) => return false,
            (false, true) => first = first.max(at_p / (at_p - at_q)),
            (true, false) => end = end.min(at_p / (at_p - at_q)),
            (true, true) => {}
        }
    }
    first < end
}

/// Corners by the cell of a square grid that they are in.
#[derive(Default)]
struct Grid {
    low: DVec2,
    /// Cells per unit of length, for each axis.
    scale: DVec2,
    /// Cells along each axis.
    cells: usize,
    /// First of each cell's `corners`, and the end of the last one's.
    starts: Vec<u32>,
    corners: Vec<u32>,
}

impl Grid {
    fn new(at: &[DVec2]) -> Self {
        let low = at.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = at.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let cells = (at.len() as f64).sqrt().ceil().max(1.0);
        let scale = (high - low).to_array().map(|size| if size > 0.0 { cells / size } else { 0.0 });
        let mut grid = Self { low, scale: scale.into(), cells: cells as usize, ..Self::default() };
        grid.starts = vec![0; grid.cells * grid.cells + 1];
        for &p in at {
            let [x, y] = grid.cell(p);
            grid.starts[y * grid.cells + x + 1] += 1;
        }
        for i in 1..grid.starts.len() {
            grid.starts[i] += grid.starts[i - 1];
        }
        let mut free = grid.starts.clone();
        grid.corners = vec![0; at.len()];
        for (&p, corner) in at.iter().zip(0..) {
            let [x, y] = grid.cell(p);
            let place = &mut free[y * grid.cells + x];
            grid.corners[*place as usize] = corner;
            *place += 1;
        }
        grid
    }

    fn cell(&self, p: DVec2) -> [usize; 2] {
        let cell = (p - self.low) * self.scale;
        // Casts saturate.
        [cell.x, cell.y].map(|c| (c as usize).min(self.cells - 1))
    }

    /// True if `test` holds for all corners in the cells that a box meets. The budget pays for cells and corners.
    fn all_near(&self, [low, high]: [DVec2; 2], budget: &mut usize, test: impl Fn(usize) -> bool) -> bool {
        let ([x0, y0], [x1, y1]) = (self.cell(low), self.cell(high));
        for y in y0..=y1 {
            let row = y * self.cells;
            let corners = self.starts[row + x0] as usize..self.starts[row + x1 + 1] as usize;
            *budget = budget.saturating_sub(1 + corners.len());
            if !self.corners[corners].iter().all(|corner| test(*corner as usize)) {
                return false;
            }
        }
        true
    }
}
