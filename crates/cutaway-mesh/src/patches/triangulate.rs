//! Triangles of a cell on the vertices along its sides.
//!
//! A finer neighbour leaves vertices on a cell's side, so a cell is a convex polygon some of whose vertices lie on a
//! line. All of them are used, which leaves no crack, and no triangle has all corners on one line.

use cutaway_core::glam::DVec3;

use super::refine::{Place, Quad};

/// Polygons of more corners are cut from a middle vertex; clipping ears takes the third power of their number.
const MOST_FOR_EARS: usize = 12;

/// A mesh vertex as a patch sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) place: Place,
    pub(super) vertex: u32,
    /// On the patch's outer boundary, so that other patches may have it too.
    pub(super) shared: bool,
    pub(super) position: DVec3,
}

/// The vertices of a patch, sorted both ways.
#[derive(Debug)]
pub(super) struct Corners {
    by_u: Vec<Corner>,
    /// `(v, u)` and the place in `by_u`.
    by_v: Vec<(Place, u32)>,
}

impl Corners {
    /// From corners that are sorted by place and all different.
    pub(super) fn new(by_u: Vec<Corner>) -> Self {
        let turned = |(at, corner): (usize, &Corner)| ((corner.place.1, corner.place.0), at as u32);
        let mut by_v: Vec<_> = by_u.iter().enumerate().map(turned).collect();
        by_v.sort_unstable();
        Self { by_u, by_v }
    }

    /// Appends the corner at `from` and all vertices on the way to `to`, without the latter.
    fn walk(&self, from: Place, to: Place, polygon: &mut Vec<Corner>) {
        let first = polygon.len();
        let (low, high) = (from.min(to), from.max(to));
        if from.0 == to.0 {
            let start = self.by_u.partition_point(|c| c.place < low);
            polygon.extend(self.by_u[start..].iter().take_while(|c| c.place <= high));
        } else if from.1 == to.1 {
            let (low, high) = ((low.1, low.0), (high.1, high.0));
            let start = self.by_v.partition_point(|(place, _)| *place < low);
            let along = self.by_v[start..].iter().take_while(|(place, _)| *place <= high);
            polygon.extend(along.map(|&(_, at)| self.by_u[at as usize]));
        } else {
            // From corner to corner of an inset: nothing lies between.
            polygon.extend([low, high].iter().filter_map(|place| {
                let at = self.by_u.binary_search_by_key(place, |c| c.place).ok()?;
                Some(self.by_u[at])
            }));
        }
        if from > to {
            polygon[first..].reverse();
        }
        polygon.pop();
    }

    /// The polygon of a cell, counter-clockwise.
    pub(super) fn polygon(&self, quad: &Quad) -> Vec<Corner> {
        let mut polygon = Vec::with_capacity(8);
        (0..4).for_each(|k| self.walk(quad[k], quad[(k + 1) % 4], &mut polygon));
        polygon
    }
}

/// What to do with a polygon.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cut {
    /// These triangles.
    Triangles(Vec<[u32; 3]>),
    /// One triangle for each side of the polygon, to a new vertex at this place.
    Fan(Place),
}

/// Cuts a convex polygon. With `strict`, no new line joins two vertices that other patches may have, too.
pub(super) fn cut(polygon: &[Corner], strict: bool) -> Cut {
    let fan = || {
        let bounds = polygon.iter().fold([u32::MAX, u32::MAX, 0, 0], |[a, b, c, d], corner| {
            let (u, v) = corner.place;
            [a.min(u), b.min(v), c.max(u), d.max(v)]
        });
        let [u0, v0, u1, v1] = bounds;
        Cut::Fan((u0 + (u1 - u0) / 2, v0 + (v1 - v0) / 2))
    };
    if polygon.len() > MOST_FOR_EARS {
        return fan();
    }
    let mut left = polygon.to_vec();
    let mut triangles = Vec::with_capacity(left.len());
    while left.len() > 3 {
        match best_ear(&left) {
            Some((ear, bad)) if !(bad && strict) => {
                triangles.push(triangle(&left, ear));
                left.remove(ear);
            }
            _ => return fan(),
        }
    }
    if left.len() == 3 {
        triangles.push(triangle(&left, 1));
    }
    Cut::Triangles(triangles)
}

fn triangle(polygon: &[Corner], at: usize) -> [u32; 3] {
    around(polygon, at).map(|corner| corner.vertex)
}

/// A corner between its neighbours.
fn around(polygon: &[Corner], at: usize) -> [Corner; 3] {
    let n = polygon.len();
    [polygon[(at + n - 1) % n], polygon[at], polygon[(at + 1) % n]]
}

/// Twice the signed area in the parameters; exact.
fn area(corners: [Corner; 3]) -> i64 {
    let [a, b, c] = corners.map(|corner| (i64::from(corner.place.0), i64::from(corner.place.1)));
    (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
}

/// The corner to cut off: along the shortest line in space, and whether that line joins two shared vertices.
fn best_ear(polygon: &[Corner]) -> Option<(usize, bool)> {
    let ear = |at: usize| {
        let [before, _, after] = around(polygon, at);
        let length = before.position.distance_squared(after.position);
        let badness = if before.vertex == after.vertex { 2 } else { u8::from(before.shared && after.shared) };
        (at, badness, length)
    };
    let good = (0..polygon.len()).filter(|&at| area(around(polygon, at)) > 0 && leaves_area(polygon, at));
    let best = good.map(ear).min_by(|a, b| a.1.cmp(&b.1).then(a.2.total_cmp(&b.2)));
    best.map(|(at, badness, _)| (at, badness > 0))
}

/// Whether the polygon without a corner is more than a line.
fn leaves_area(polygon: &[Corner], without: usize) -> bool {
    let n = polygon.len();
    // Three in a row, the corner left out.
    let kept = |k: usize| polygon[(without + 1 + k % (n - 1)) % n];
    (0..n - 1).any(|k| area([kept(k), kept(k + 1), kept(k + 2)]) != 0)
}
