//! Holes and what closes them.
//!
//! The boundary of a sum of triangles has no boundary itself: at every vertex as many boundary edges end as begin. So it
//! falls apart into loops, whatever the mesh looks like, and a cap along each of them, run the other way, closes it.

use cutaway_core::glam::{DVec2, DVec3, Vec3};

use super::{RepairError, RepairNotice, Work};
use crate::edges::{Edges, net};

/// Corners that are held against candidates for ears, in all loops together, before the rest is capped with fans;
/// under a second.
const BUDGET: usize = 50_000_000;

/// Caps every boundary loop. Edges of three triangles or more must be balanced already.
pub(super) fn cap_loops(work: &mut Work) -> Result<(), RepairError> {
    let edges = Edges::new(&work.triangles);
    let (mut boundary, mut odd, mut even, mut kept) = (Vec::new(), 0, 0, 0);
    for uses in edges.iter() {
        match uses {
            [one] => boundary.push(one.directed()),
            [_, _] => {}
            many if net(many) == 0 => kept += 1,
            many if many.len().is_multiple_of(2) => even += 1,
            _ => odd += 1,
        }
    }
    drop(edges);
    if odd + even > 0 {
        return Err(RepairError::NonManifold { odd, even, boundary: boundary.len() });
    }
    work.notice_if(kept > 0, RepairNotice::NonManifoldKept { edges: kept });
    if boundary.is_empty() {
        return Ok(());
    }
    let loops = simple_loops(boundary, work.vertices.len());
    let (before, count) = (work.triangles.len(), loops.len());
    let (mut edges, mut longest, mut fans, mut budget) = (0, 0, 0, BUDGET);
    for mut hole in loops {
        edges += hole.len();
        longest = longest.max(hole.len());
        hole.reverse();
        fans += usize::from(cap(work, hole, &mut budget)?);
    }
    let triangles = work.triangles.len() - before;
    work.notices.push(RepairNotice::Capped { loops: count, edges, longest, triangles, fans });
    Ok(())
}

/// Takes balanced directed edges apart into loops that pass no vertex twice.
fn simple_loops(mut edges: Vec<[u32; 2]>, vertices: usize) -> Vec<Vec<u32>> {
    edges.sort_unstable();
    const NOWHERE: u32 = u32::MAX;
    // The first edge from each vertex that was not taken yet, and where on the path a vertex is.
    let mut next = vec![0u32; vertices];
    for (i, [from, _]) in edges.iter().enumerate().rev() {
        next[*from as usize] = i as u32;
    }
    let mut place = vec![NOWHERE; vertices];
    let mut loops = Vec::new();
    let mut taken = vec![false; edges.len()];
    for first in 0..edges.len() {
        if taken[first] {
            continue;
        }
        let start = edges[first][0];
        let mut path = vec![start];
        place[start as usize] = 0;
        while let Some(&at) = path.last() {
            let out = next[at as usize] as usize;
            let Some([_, to]) = edges.get(out).filter(|[from, _]| *from == at).copied() else {
                // Back at the start, and nothing leads away from it any more.
                debug_assert_eq!(path, [start]);
                break;
            };
            next[at as usize] += 1;
            taken[out] = true;
            let earlier = place[to as usize];
            if earlier == NOWHERE {
                place[to as usize] = path.len() as u32;
                path.push(to);
            } else {
                let hole = path.split_off(earlier as usize);
                hole.iter().for_each(|v| place[*v as usize] = NOWHERE);
                loops.push(hole);
                place[to as usize] = earlier;
                path.push(to);
            }
        }
        path.iter().for_each(|v| place[*v as usize] = NOWHERE);
    }
    loops
}

/// Fills a loop with triangles that run along it in its direction; true where it took a fan.
fn cap(work: &mut Work, mut polygon: Vec<u32>, budget: &mut usize) -> Result<bool, RepairError> {
    if let Some(mut flat) = flattened(&polygon, &work.vertices) {
        clip_ears(&mut polygon, &mut flat, &mut work.triangles, budget);
    }
    if let [a, b, c] = polygon[..] {
        work.triangles.push([a, b, c]);
        return Ok(false);
    }
    let sum: DVec3 = polygon.iter().map(|&v| work.vertices[v as usize].as_dvec3()).sum();
    let middle = u32::try_from(work.vertices.len()).ok().filter(|v| *v < u32::MAX);
    let middle = middle.ok_or(RepairError::TooManyVertices)?;
    work.vertices.push((sum / polygon.len() as f64).as_vec3());
    let ends = polygon.iter().zip(polygon.iter().cycle().skip(1));
    work.triangles.extend(ends.map(|(&a, &b)| [a, b, middle]));
    Ok(true)
}

/// The loop in the plane that fits it best (Newell's normal), counter-clockwise, scaled to about 1.
fn flattened(polygon: &[u32], vertices: &[Vec3]) -> Option<Vec<DVec2>> {
    let origin = vertices[polygon[0] as usize].as_dvec3();
    let at = |v: u32| vertices[v as usize].as_dvec3() - origin;
    let size = polygon.iter().map(|&v| at(v).abs().max_element()).fold(0.0, f64::max);
    let at = |v: u32| at(v) / size;
    let ends = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let normal: DVec3 = ends.map(|(&a, &b)| at(a).cross(at(b))).sum();
    let normal = normal.try_normalize()?;
    let (x, y) = normal.any_orthonormal_pair();
    // glam does not say which way round the pair is.
    let y = if x.cross(y).dot(normal) < 0.0 { -y } else { y };
    Some(polygon.iter().map(|&v| DVec2::new(at(v).dot(x), at(v).dot(y))).collect())
}

/// Cuts ears off until a triangle is left, or no ear is found, or the budget is used up.
fn clip_ears(
    polygon: &mut Vec<u32>,
    flat: &mut Vec<DVec2>,
    triangles: &mut Vec<[u32; 3]>,
    budget: &mut usize,
) {
    while polygon.len() > 3 && *budget > 0 {
        // One round: neighbours of a cut ear wait for the next one, or all would be cut into slivers from one corner.
        let n = polygon.len();
        let mut keep = vec![true; n];
        let (mut last, mut left) = (n - 1, n);
        let mut i = 0;
        while i < n && left > 3 && *budget > 0 {
            let next = (i + 1) % n;
            let fresh = keep[last] && keep[next];
            if fresh && is_ear(flat, &keep, [last, i, next], budget) {
                triangles.push([polygon[last], polygon[i], polygon[next]]);
                keep[i] = false;
                left -= 1;
                // The next vertex is the ear's neighbour.
                last = next;
                i += 2;
            } else {
                last = i;
                i += 1;
            }
        }
        if left == n {
            return;
        }
        let mut kept = keep.iter();
        polygon.retain(|_| kept.next().is_some_and(|keep| *keep));
        let mut kept = keep.iter();
        flat.retain(|_| kept.next().is_some_and(|keep| *keep));
    }
}

/// Whether the corner in the middle is convex and no other vertex that is left lies in its triangle or on its edge.
fn is_ear(flat: &[DVec2], keep: &[bool], [last, i, next]: [usize; 3], budget: &mut usize) -> bool {
    let [a, b, c] = [flat[last], flat[i], flat[next]];
    let side = |a: DVec2, b: DVec2, p: DVec2| (b - a).perp_dot(p - a);
    // Flatter than this the corner is straight, as far as rounding can tell.
    const STRAIGHT: f64 = 1e-12;
    if side(a, b, c) <= STRAIGHT * (b - a).length() * (c - b).length() {
        return false;
    }
    *budget = budget.saturating_sub(flat.len());
    let others = (0..flat.len()).filter(|j| keep[*j] && ![last, i, next].contains(j));
    !others.map(|j| flat[j]).any(|p| side(a, b, p) >= 0.0 && side(b, c, p) >= 0.0 && side(c, a, p) >= 0.0)
}
