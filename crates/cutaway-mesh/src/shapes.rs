//! Closed meshes to test and measure with.

use std::collections::HashMap;
use std::f32::consts::TAU;

use cutaway_core::glam::Vec3;

use crate::TriangleMesh;

/// A unit sphere: an icosahedron whose triangles are divided into four, `levels` times; `20 * 4^levels` triangles.
/// `levels` is at most 10 (21 million triangles); more is taken as 10.
pub fn icosphere(levels: u32) -> TriangleMesh {
    let phi = (1.0 + 5f32.sqrt()) / 2.0;
    let mut vertices: Vec<Vec3> = Vec::new();
    for (a, b) in [(-1.0, phi), (1.0, phi), (-1.0, -phi), (1.0, -phi)] {
        vertices.extend([Vec3::new(a, b, 0.0), Vec3::new(0.0, a, b), Vec3::new(b, 0.0, a)]);
    }
    for vertex in &mut vertices {
        *vertex = vertex.normalize();
    }
    let mut triangles = hull(&vertices);
    for _ in 0..levels.min(10) {
        triangles = subdivide(&mut vertices, &triangles);
    }
    mesh(vertices, triangles)
}

/// The faces of an icosahedron: all triples of vertices at the shortest distance from each other, turned outward.
fn hull(vertices: &[Vec3]) -> Vec<[u32; 3]> {
    let near = |a: usize, b: usize| vertices[a].distance(vertices[b]) < 1.06;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = vertices[a].dot(vertices[b].cross(vertices[c])) > 0.0;
                    let face = if outward { [a, b, c] } else { [a, c, b] };
                    faces.push(face.map(|v| v as u32));
                }
            }
        }
    }
    faces
}

fn subdivide(vertices: &mut Vec<Vec3>, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middles = HashMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
            (vertices.len() - 1) as u32
        })
    };
    let mut fine = Vec::with_capacity(4 * triangles.len());
    for &[a, b, c] in triangles {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        fine.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    fine
}

/// A torus around the z axis, its tube's centre at distance 1, of `2 * around * across` triangles; both at least 3.
pub fn torus(tube_radius: f32, around: u32, across: u32) -> TriangleMesh {
    let (around, across) = (around.max(3), across.max(3));
    let vertex = |i: u32, j: u32| {
        let (u, v) = (i as f32 / around as f32 * TAU, j as f32 / across as f32 * TAU);
        let r = 1.0 + tube_radius * v.cos();
        Vec3::new(r * u.cos(), r * u.sin(), tube_radius * v.sin())
    };
    let vertices = (0..around).flat_map(|i| (0..across).map(move |j| vertex(i, j))).collect();
    let index = |i: u32, j: u32| (i % around) * across + j % across;
    let quads = (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    mesh(vertices, triangles.collect())
}

/// The cube between -1 and 1.
pub fn cube() -> TriangleMesh {
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    mesh((0..8).map(corner).collect(), triangles.collect())
}

fn mesh(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> TriangleMesh {
    TriangleMesh::new(vertices, triangles).unwrap_or_else(|error| unreachable!("a generated mesh: {error}"))
}
