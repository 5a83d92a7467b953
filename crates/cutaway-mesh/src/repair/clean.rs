//! Triangles that are no part of a surface.

use cutaway_core::glam::{DVec3, Vec3};

use super::{RepairNotice, Work};
use crate::edges::Edges;
use crate::sets::Sets;
use crate::topology::has_repeated_corner;

/// Drops triangles with a repeated corner. The edges of each cancel, so that this opens nothing.
pub(super) fn drop_repeated_corners(work: &mut Work) {
    let before = work.triangles.len();
    work.triangles.retain(|t| !has_repeated_corner(*t));
    let triangles = before - work.triangles.len();
    work.notice_if(triangles > 0, RepairNotice::DegenerateDropped { triangles });
}

/// Of triangles with the same corners keeps one, wound as most of them are; then drops walls.
///
/// Where two solids touch, the faces between them are there twice, once in each direction. One of each would leave
/// edges of three triangles around the wall; without any, the two solids are one. Elsewhere (surfaces whose every face
/// is there from both sides) one of each is the surface.
pub(super) fn drop_duplicates(work: &mut Work) {
    let mut order: Vec<([u32; 3], bool, usize)> =
        work.triangles.iter().enumerate().map(|(i, t)| sorted(*t, i)).collect();
    order.sort_unstable_by_key(|(corners, _, i)| (*corners, *i));
    let mut keep = vec![true; work.triangles.len()];
    let mut cancel = vec![false; work.triangles.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        let even = same.iter().filter(|(_, even, _)| *even).count();
        let majority = 2 * even >= same.len();
        let kept = same.iter().find(|(_, even, _)| *even == majority).map_or(same[0].2, |(_, _, i)| *i);
        same.iter().for_each(|(_, _, i)| keep[*i] = *i == kept);
        cancel[kept] = 2 * even == same.len();
    }
    drop(order);
    let mut kept = keep.iter();
    cancel.retain(|_| kept.next().is_some_and(|keep| *keep));
    let triangles = work.retain(&keep);
    work.notice_if(triangles > 0, RepairNotice::DuplicatesDropped { triangles });
    if cancel.contains(&true) {
        drop_walls(work, &cancel);
    }
}

/// Drops triangles that are there once in each direction, pair by pair: whatever is closed stays closed.
pub(super) fn cancel_opposites(work: &mut Work) {
    let mut order: Vec<([u32; 3], bool, usize)> =
        work.triangles.iter().enumerate().map(|(i, t)| sorted(*t, i)).collect();
    order.sort_unstable();
    let mut keep = vec![true; work.triangles.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        let odd = same.partition_point(|(_, even, _)| !even);
        let pairs = odd.min(same.len() - odd);
        same[..pairs].iter().chain(&same[odd..odd + pairs]).for_each(|(_, _, i)| keep[*i] = false);
    }
    let triangles = work.retain(&keep);
    work.notice_if(triangles > 0, RepairNotice::WallsDropped { triangles });
}

/// A triangle's corners in ascending order, and whether that is an even permutation of them.
fn sorted([a, b, c]: [u32; 3], triangle: usize) -> ([u32; 3], bool, usize) {
    let mut corners = [a, b, c];
    corners.sort_unstable();
    let even = [[a, b, c], [b, c, a], [c, a, b]].contains(&corners);
    (corners, even, triangle)
}

/// Of the triangles that `cancel` drops those in pieces with an edge of three, five, ... triangles.
fn drop_walls(work: &mut Work, cancel: &[bool]) {
    let edges = Edges::new(&work.triangles);
    let mut pieces = Sets::new(work.triangles.len());
    for uses in edges.iter() {
        if let [a, b] = uses
            && cancel[a.triangle()]
            && cancel[b.triangle()]
        {
            pieces.join(a.triangle(), b.triangle(), false);
        }
    }
    let mut wall = vec![false; work.triangles.len()];
    for uses in edges.iter().filter(|uses| uses.len() > 1 && !uses.len().is_multiple_of(2)) {
        for used in uses.iter().filter(|u| cancel[u.triangle()]) {
            wall[pieces.root(used.triangle())] = true;
        }
    }
    let keep: Vec<bool> = (0..cancel.len()).map(|t| !(cancel[t] && wall[pieces.root(t)])).collect();
    let triangles = work.retain(&keep);
    work.notice_if(triangles > 0, RepairNotice::WallsDropped { triangles });
}

/// Drops triangles without area of which two edges or three have an odd number of triangles: fewer such edges are left
/// without it. The others hold their neighbours together.
pub(super) fn drop_fins(work: &mut Work) {
    let flat: Vec<bool> = (0..work.triangles.len()).map(|t| has_no_area(work.corners(t))).collect();
    if !flat.contains(&true) {
        return;
    }
    let edges = Edges::new(&work.triangles);
    let uses: Vec<_> = edges.iter().collect();
    let mut count: Vec<usize> = uses.iter().map(|uses| uses.len()).collect();
    // Edges of flat triangles, by triangle.
    let mut sides: Vec<(usize, usize)> = Vec::new();
    for (edge, uses) in uses.iter().enumerate() {
        sides.extend(uses.iter().filter(|u| flat[u.triangle()]).map(|u| (u.triangle(), edge)));
    }
    sides.sort_unstable();
    let sides_of = |triangle: usize| {
        let first = sides.partition_point(|(t, _)| *t < triangle);
        [0, 1, 2].map(|i| sides[first + i].1)
    };
    let mut keep = vec![true; work.triangles.len()];
    let mut waiting: Vec<usize> = (0..flat.len()).rev().filter(|t| flat[*t]).collect();
    while let Some(triangle) = waiting.pop() {
        let sides = sides_of(triangle);
        let odd = sides.iter().filter(|side| !count[**side].is_multiple_of(2)).count();
        if !keep[triangle] || odd < 2 {
            continue;
        }
        keep[triangle] = false;
        for side in sides {
            count[side] -= 1;
            // Others may follow. Edges of many triangles are not asked again and again: that could take forever.
            const MANY: usize = 16;
            if uses[side].len() <= MANY {
                waiting.extend(uses[side].iter().map(|u| u.triangle()).filter(|t| flat[*t] && keep[*t]));
            }
        }
    }
    drop(uses);
    let triangles = work.retain(&keep);
    work.notice_if(triangles > 0, RepairNotice::DegenerateDropped { triangles });
}

/// Whether the corners lie on a line. Differences of f32 and their products are exact in f64 but for extreme exponents.
fn has_no_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a) == DVec3::ZERO
}
