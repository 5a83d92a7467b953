//! Holes and what closes them.
//!
//! The boundary of a sum of triangles has no boundary itself: at every vertex as many boundary edges end as begin. So it
//! falls apart into loops, whatever the mesh looks like, and a cap along each of them, run the other way, closes it.

use cutaway_core::glam::DVec3;

use super::{RepairError, RepairNotice, Work};
use crate::edges::{Edges, net};
use crate::polygon::EarClipper;

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
    let (mut edges, mut longest, mut fans, mut clipper) = (0, 0, 0, EarClipper::default());
    for mut hole in loops {
        edges += hole.len();
        longest = longest.max(hole.len());
        hole.reverse();
        fans += usize::from(cap(work, hole, &mut clipper)?);
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
fn cap(work: &mut Work, polygon: Vec<u32>, clipper: &mut EarClipper) -> Result<bool, RepairError> {
    let Work { vertices, triangles, .. } = work;
    let rest = clipper.clip(polygon, &|v| vertices[v as usize].as_dvec3(), triangles);
    if rest.is_empty() {
        return Ok(false);
    }
    let sum: DVec3 = rest.iter().map(|&v| work.vertices[v as usize].as_dvec3()).sum();
    let middle = u32::try_from(work.vertices.len()).ok().filter(|v| *v < u32::MAX);
    let middle = middle.ok_or(RepairError::TooManyVertices)?;
    work.vertices.push((sum / rest.len() as f64).as_vec3());
    let ends = rest.iter().zip(rest.iter().cycle().skip(1));
    work.triangles.extend(ends.map(|(&a, &b)| [a, b, middle]));
    Ok(true)
}
