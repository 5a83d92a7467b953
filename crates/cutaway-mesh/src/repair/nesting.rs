//! Shells: which enclose something, which lie inside which, and which way out is.

use std::cmp::Ordering;

use cutaway_core::glam::{DVec3, Vec3};

use super::{RepairError, RepairNotice, Work};
use crate::edges::{Edges, net};
use crate::sets::Sets;

/// Triangles that are held against points, for all shells together, before the rest is taken to lie in nothing; a
/// few seconds.
const BUDGET: usize = 100_000_000;

/// A shell whose volume is below this share of its area times its size is flat.
const FLAT: f64 = 1e-12;

/// A closed piece of the surface.
#[derive(Clone, Copy)]
struct Shell {
    /// Where its triangles are in the order of shells.
    triangles: [usize; 2],
    low: Vec3,
    high: Vec3,
    volume: f64,
    area: f64,
}

impl Shell {
    fn is_flat(&self) -> bool {
        let size = self.low.as_dvec3().distance(self.high.as_dvec3());
        self.volume.abs() <= FLAT * self.area * size
    }

    /// Whether the bounds hold those of another.
    fn may_hold(&self, other: &Self) -> bool {
        self.low.cmple(other.low).all() && self.high.cmpge(other.high).all()
    }

    fn count(&self) -> usize {
        self.triangles[1] - self.triangles[0]
    }
}

/// Drops flat shells, and turns the outermost ones outward with everything inside them.
pub(super) fn settle_shells(work: &mut Work) -> Result<(), RepairError> {
    let mut shells = collect(work);
    let found = work.triangles.len();
    let flat: Vec<Shell> = shells.iter().copied().filter(Shell::is_flat).collect();
    if !flat.is_empty() {
        shells.retain(|shell| !shell.is_flat());
        if shells.is_empty() {
            return Err(RepairError::Flat { triangles: found });
        }
        let mut keep = vec![true; found];
        flat.iter().for_each(|shell| keep[shell.triangles[0]..shell.triangles[1]].fill(false));
        let triangles = work.retain(&keep);
        work.notices.push(RepairNotice::EmptyShellsDropped { shells: flat.len(), triangles });
        close_gaps(&mut shells);
    }
    if shells.iter().all(|shell| shell.volume > 0.0) {
        return Ok(());
    }
    let outermost = find_outermost(work, &shells);
    let (mut turned, mut triangles, mut cavities) = (0, 0, 0);
    for (i, shell) in shells.iter().enumerate() {
        let outer = &shells[outermost[i]];
        if outer.volume < 0.0 {
            work.triangles[shell.triangles[0]..shell.triangles[1]].iter_mut().for_each(|t| t.swap(1, 2));
            turned += 1;
            triangles += shell.count();
        }
        cavities += usize::from(outermost[i] != i && outer.volume * shell.volume < 0.0);
    }
    work.notice_if(turned > 0, RepairNotice::TurnedOutward { shells: turned, triangles });
    work.notice_if(cavities > 0, RepairNotice::Cavities { shells: cavities });
    Ok(())
}

/// Joins triangles to shells that are closed each by itself. Where solids touch along an edge, those of them that are
/// closed without the others stay apart.
fn join(work: &Work) -> Sets {
    let mut sets = Sets::new(work.triangles.len());
    let edges = Edges::new(&work.triangles);
    for uses in edges.iter() {
        if let [a, b] = uses {
            sets.join(a.triangle(), b.triangle(), false);
        }
    }
    for uses in edges.iter().filter(|uses| uses.len() > 2) {
        let mut by_set: Vec<_> = uses.iter().map(|used| (sets.root(used.triangle()), *used)).collect();
        by_set.sort_unstable();
        let mut open: Option<usize> = None;
        for same in by_set.chunk_by(|a, b| a.0 == b.0) {
            let uses: Vec<_> = same.iter().map(|(_, used)| *used).collect();
            if net(&uses) != 0 {
                let first = *open.get_or_insert(same[0].0);
                sets.join(first, same[0].0, false);
            }
        }
    }
    sets
}

/// Sorts the triangles by shell and measures the shells.
fn collect(work: &mut Work) -> Vec<Shell> {
    let (shell_of, count) = join(work).numbered();
    if count > 1 {
        let mut order: Vec<(u32, usize)> = shell_of.iter().copied().zip(0..).collect();
        order.sort_unstable();
        work.triangles = order.iter().map(|(_, t)| work.triangles[*t]).collect();
    }
    let mut sizes = vec![0; count];
    shell_of.iter().for_each(|shell| sizes[*shell as usize] += 1);
    let mut start = 0;
    let measured = sizes.into_iter().map(|size| {
        start += size;
        measure(work, [start - size, start])
    });
    measured.collect()
}

fn measure(work: &Work, triangles: [usize; 2]) -> Shell {
    let first = work.corners(triangles[0])[0];
    let mut shell = Shell { triangles, low: first, high: first, volume: 0.0, area: 0.0 };
    for t in triangles[0]..triangles[1] {
        let corners = work.corners(t);
        for v in corners {
            shell.low = shell.low.min(v);
            shell.high = shell.high.max(v);
        }
        // From a point of its own: small shells far from the origin have a volume, too.
        let [a, b, c] = corners.map(|v| v.as_dvec3() - first.as_dvec3());
        let normal = (b - a).cross(c - a);
        shell.volume += a.dot(normal) / 6.0;
        shell.area += normal.length() / 2.0;
    }
    shell
}

/// Renumbers the triangles of shells after others have gone.
fn close_gaps(shells: &mut [Shell]) {
    let mut start = 0;
    for shell in shells {
        let count = shell.count();
        shell.triangles = [start, start + count];
        start += count;
    }
}

/// For every shell the outermost one that it lies in: itself where there is none.
fn find_outermost(work: &mut Work, shells: &[Shell]) -> Vec<usize> {
    let mut outermost: Vec<usize> = (0..shells.len()).collect();
    // What holds another is larger: taken from the largest on, the outermost ones are known by then.
    let size = |i: usize| (shells[i].high.as_dvec3() - shells[i].low.as_dvec3()).element_sum();
    let mut order = outermost.clone();
    order.sort_unstable_by(|&a, &b| size(b).total_cmp(&size(a)).then(a.cmp(&b)));
    let tree = Boxes::new(shells);
    let (mut budget, mut unknown) = (BUDGET, 0);
    for &i in &order {
        let mut found = None;
        tree.for_each_at(shells[i].low, &mut budget, &mut |j, budget| {
            let candidate = j != i && outermost[j] == j && (size(j), i) > (size(i), j);
            if found.is_none()
                && candidate
                && shells[j].may_hold(&shells[i])
                && holds(work, &shells[j], &shells[i], budget)
            {
                found = Some(j);
            }
        });
        outermost[i] = found.unwrap_or(i);
        unknown += usize::from(found.is_none() && budget == 0);
    }
    work.notice_if(unknown > 0, RepairNotice::NestingUnknown { shells: unknown });
    outermost
}

/// Whether a few points of `inner` all lie inside `outer`.
fn holds(work: &Work, outer: &Shell, inner: &Shell, budget: &mut usize) -> bool {
    let [first, end] = inner.triangles;
    let steps = [0, 1, 2].map(|i| first + (end - first - 1) * i / 2);
    steps.into_iter().all(|t| {
        *budget = budget.saturating_sub(outer.count());
        if *budget == 0 {
            return false;
        }
        let [a, b, c] = work.corners(t).map(Vec3::as_dvec3);
        winding_number(work, outer, (a + b + c) / 3.0).abs() > 0.5
    })
}

/// How often a shell winds around a point: the sum of the solid angles of its triangles (van Oosterom and Strackee,
/// "The Solid Angle of a Plane Triangle", IEEE Trans. Biomed. Eng. 30, 1983) over that of the sphere.
fn winding_number(work: &Work, shell: &Shell, point: DVec3) -> f64 {
    let angle = |t: usize| {
        let [a, b, c] = work.corners(t).map(|v| v.as_dvec3() - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    (shell.triangles[0]..shell.triangles[1]).map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Bounds of shells in a balanced tree, each node with the bounds of all below it.
struct Boxes {
    /// Shells by leaf.
    order: Vec<usize>,
    /// Bounds of leaves `[first, end)` as a binary heap: node `n` has `2 n + 1` and `2 n + 2` below it.
    nodes: Vec<[Vec3; 2]>,
}

impl Boxes {
    fn new(shells: &[Shell]) -> Self {
        let leaves = shells.len().next_power_of_two();
        let mut boxes = Self {
            order: (0..shells.len()).collect(),
            nodes: vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; 2 * leaves - 1],
        };
        let mut order = std::mem::take(&mut boxes.order);
        boxes.fill(shells, 0, leaves, &mut order);
        boxes.order = order;
        boxes
    }

    /// Bounds node `node`, which has room for `room` leaves, of the shells in `order`.
    fn fill(&mut self, shells: &[Shell], node: usize, room: usize, order: &mut [usize]) {
        for &shell in order.iter() {
            let [low, high] = self.nodes[node];
            self.nodes[node] = [low.min(shells[shell].low), high.max(shells[shell].high)];
        }
        if room > 1 && !order.is_empty() {
            let half = room / 2;
            let [low, high] = self.nodes[node];
            let axis = (high - low).max_position();
            let by_place =
                |a: &usize, b: &usize| -> Ordering { shells[*a].low[axis].total_cmp(&shells[*b].low[axis]) };
            // The left child is filled first, so that leaf i is shell order[i].
            let left = half.min(order.len());
            if left < order.len() {
                order.select_nth_unstable_by(left, by_place);
            }
            let (left, right) = order.split_at_mut(left);
            self.fill(shells, 2 * node + 1, half, left);
            self.fill(shells, 2 * node + 2, half, right);
        }
    }

    /// Calls `visit` for every shell whose bounds hold a point, until the budget is used up.
    fn for_each_at(&self, point: Vec3, budget: &mut usize, visit: &mut impl FnMut(usize, &mut usize)) {
        let first_leaf = self.nodes.len() / 2;
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop() {
            *budget = budget.saturating_sub(1);
            let [low, high] = self.nodes[node];
            if *budget == 0 || !(low.cmple(point).all() && high.cmpge(point).all()) {
                continue;
            }
            match node.checked_sub(first_leaf) {
                Some(leaf) => visit(self.order[leaf], budget),
                None => waiting.extend([2 * node + 1, 2 * node + 2]),
            }
        }
    }
}
