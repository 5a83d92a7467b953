//! Vertices at one place become one vertex.

use std::collections::HashMap;

use cutaway_core::glam::{DVec3, Vec3};

use super::{RepairNotice, Work};
use crate::edges::Edges;
use crate::mesh::TriangleMesh;

/// Fills in the vertices of `work` and renumbers its triangles.
pub(super) fn weld(work: &mut Work, mesh: &TriangleMesh, tolerance: f64) {
    let (vertices, number) = weld_exactly(mesh.vertices());
    let mut welded = mesh.vertices().len() - vertices.len();
    work.triangles.iter_mut().flatten().for_each(|v| *v = number[*v as usize]);
    work.vertices = vertices;
    let within = if tolerance > 0.0 { weld_boundary(work, tolerance, &mut welded) } else { 0.0 };
    work.notice_if(welded > 0, RepairNotice::Welded { vertices: welded, within });
}

/// Welds vertices on the boundary to one another, and gives the distance back where that changed anything. What is closed
/// already keeps its finest details.
fn weld_boundary(work: &mut Work, tolerance: f64, welded: &mut usize) -> f64 {
    let mut open: Vec<u32> = Vec::new();
    for uses in Edges::new(&work.triangles).iter() {
        if let [one] = uses {
            open.extend(one.directed());
        }
    }
    open.sort_unstable();
    open.dedup();
    let places: Vec<Vec3> = open.iter().map(|v| work.vertices[*v as usize]).collect();
    let bounds = |vertices: &[Vec3]| {
        let first = vertices.first()?;
        Some(vertices.iter().fold([*first; 2], |[low, high], v| [low.min(*v), high.max(*v)]))
    };
    let (Some([low, high]), Some([open_low, _])) = (bounds(&work.vertices), bounds(&places)) else {
        return 0.0;
    };
    let within = tolerance * low.as_dvec3().distance(high.as_dvec3());
    if within == 0.0 {
        return 0.0;
    }
    let (kept, number) = weld_within(&places, open_low.as_dvec3(), within);
    if kept.len() == places.len() {
        return 0.0;
    }
    *welded += places.len() - kept.len();
    // Each takes the vertex of the first one at its place.
    let mut first = vec![u32::MAX; kept.len()];
    let mut to: Vec<u32> = (0..work.vertices.len() as u32).collect();
    for (&vertex, &place) in open.iter().zip(&number) {
        if first[place as usize] == u32::MAX {
            first[place as usize] = vertex;
        }
        to[vertex as usize] = first[place as usize];
    }
    work.triangles.iter_mut().flatten().for_each(|v| *v = to[*v as usize]);
    within
}

/// The different places, in order of appearance, and for every vertex the number of its place.
fn weld_exactly(vertices: &[Vec3]) -> (Vec<Vec3>, Vec<u32>) {
    // Adding 0 turns -0 into 0, which is the same place.
    let mut order: Vec<([u32; 3], u32)> =
        vertices.iter().zip(0..).map(|(v, i)| (v.to_array().map(|c| (c + 0.0).to_bits()), i)).collect();
    order.sort_unstable();
    let mut first = vec![0; vertices.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        same.iter().for_each(|(_, i)| first[*i as usize] = same[0].1);
    }
    drop(order);
    let mut number = first;
    let mut places = Vec::new();
    for i in 0..number.len() {
        // The first one of a place comes first, and has its number by the time the others ask.
        let first = number[i] as usize;
        number[i] = if first == i {
            places.push(vertices[i]);
            places.len() as u32 - 1
        } else {
            number[first]
        };
    }
    (places, number)
}

/// As [`weld_exactly`], for places at most `within` apart: a vertex takes the number of the first place that near it.
/// Cells are counted from `low`.
fn weld_within(vertices: &[Vec3], low: DVec3, within: f64) -> (Vec<Vec3>, Vec<u32>) {
    let cell = |v: DVec3| ((v - low) / within).floor().to_array().map(|c| c as i64);
    // Kept places are further apart than a cell is wide, so that few of them fit into one.
    let mut kept: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut places: Vec<Vec3> = Vec::new();
    let mut number = Vec::with_capacity(vertices.len());
    for &vertex in vertices {
        let v = vertex.as_dvec3();
        let [x, y, z] = cell(v);
        let around = (0..27i64).map(|i| {
            [x.saturating_add(i % 3 - 1), y.saturating_add(i / 3 % 3 - 1), z.saturating_add(i / 9 - 1)]
        });
        let near = around.filter_map(|cell| kept.get(&cell)).flatten().copied();
        let near = near.filter(|&p| places[p as usize].as_dvec3().distance(v) <= within).min();
        number.push(near.unwrap_or_else(|| {
            let new = places.len() as u32;
            places.push(vertex);
            kept.entry([x, y, z]).or_default().push(new);
            new
        }));
    }
    (places, number)
}
