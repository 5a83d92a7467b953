//! Shapes to break and to mend.
#![allow(dead_code, reason = "each test file uses some of them")]

use cutaway_core::glam::Vec3;
use cutaway_mesh::TriangleMesh;

/// Vertices and triangles, free to be wrong.
#[derive(Clone, Debug, Default)]
pub(crate) struct Soup {
    pub(crate) vertices: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Soup {
    pub(crate) fn mesh(&self) -> TriangleMesh {
        TriangleMesh::new(self.vertices.clone(), self.triangles.clone()).expect("indices in range")
    }

    /// Two soups in one.
    pub(crate) fn with(mut self, other: &Soup) -> Self {
        let start = self.vertices.len() as u32;
        self.vertices.extend(&other.vertices);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + start)));
        self
    }

    /// Wound the other way.
    pub(crate) fn inward(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        self
    }

    pub(crate) fn moved(mut self, by: Vec3) -> Self {
        self.vertices.iter_mut().for_each(|v| *v += by);
        self
    }

    pub(crate) fn scaled(mut self, by: f32) -> Self {
        self.vertices.iter_mut().for_each(|v| *v *= by);
        self
    }

    /// Every triangle with vertices of its own.
    pub(crate) fn unwelded(self) -> Self {
        let vertices: Vec<Vec3> =
            self.triangles.iter().flatten().map(|v| self.vertices[*v as usize]).collect();
        let triangles = (0..self.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Self { vertices, triangles }
    }
}

/// The cube from 0 to 1 with `n` squares along an edge, outward.
pub(crate) fn cube(n: u32) -> Soup {
    let mut soup = Soup::default();
    let mut numbers = std::collections::HashMap::new();
    for axis in 0..3 {
        for side in [0, n] {
            for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                let mut corner = |i: u32, j: u32| {
                    let mut at = [0; 3];
                    at[axis] = side;
                    at[(axis + 1) % 3] = i;
                    at[(axis + 2) % 3] = j;
                    *numbers.entry(at).or_insert_with(|| {
                        soup.vertices.push(Vec3::from_array(at.map(|c| c as f32 / n as f32)));
                        soup.vertices.len() as u32 - 1
                    })
                };
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                let quad = if side == n { [a, b, c, d] } else { [d, c, b, a] };
                soup.triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
        }
    }
    soup
}

/// A cube with its grid blown up to a sphere around 0 whose radius is `radius` of the direction.
pub(crate) fn star(n: u32, radius: impl Fn(Vec3) -> f32) -> Soup {
    let mut soup = cube(n);
    for v in &mut soup.vertices {
        let direction = (*v - Vec3::splat(0.5)).normalize();
        *v = direction * radius(direction);
    }
    soup
}

/// A torus of radii 2 and 1, outward.
pub(crate) fn torus(n: u32) -> Soup {
    let mut soup = Soup::default();
    for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
        let [(su, cu), (sv, cv)] = [i, j].map(|k| (k as f32 / n as f32 * std::f32::consts::TAU).sin_cos());
        soup.vertices.push(Vec3::new((2.0 + cv) * cu, (2.0 + cv) * su, sv));
        let at = |i: u32, j: u32| i % n * n + j % n;
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        soup.triangles.extend([[a, b, c], [a, c, d]]);
    }
    soup
}

/// A strip of `n` quads with half a turn in it, or none.
pub(crate) fn strip(n: u32, half_turn: bool) -> Soup {
    let mut soup = Soup::default();
    for i in 0..n {
        let (s, c) = (i as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
        let tilt = if half_turn { i as f32 / n as f32 * std::f32::consts::PI } else { 0.0 };
        for side in [-0.3, 0.3] {
            let r = 1.0 + side * tilt.sin();
            soup.vertices.push(Vec3::new(r * c, r * s, side * tilt.cos()));
        }
        let [a, b] = [2 * i, 2 * i + 1];
        let [mut c, mut d] = [2 * ((i + 1) % n), 2 * ((i + 1) % n) + 1];
        if half_turn && i + 1 == n {
            std::mem::swap(&mut c, &mut d);
        }
        soup.triangles.extend([[a, c, b], [b, c, d]]);
    }
    soup
}
