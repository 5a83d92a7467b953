//! What a mesh is like, counted.

use cutaway_core::glam::{DVec3, Vec3};

use crate::edges::{Edges, net};
use crate::mesh::TriangleMesh;
use crate::sets::Sets;

/// Counts of a mesh as it is, before any repair.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Topology {
    /// Vertices, used or not.
    pub vertices: usize,
    /// Vertices that at least one triangle uses.
    pub used_vertices: usize,
    /// Triangles, degenerate ones included.
    pub triangles: usize,
    /// Lowest and highest coordinates of used vertices, in object units.
    pub bounds: Option<[DVec3; 2]>,
    /// Area, in object units squared.
    pub area: f64,
    /// Signed volume, in object units cubed: positive where windings are outward. It means something only where the
    /// surface is closed.
    pub volume: f64,
    /// Euler number: used vertices minus edges plus triangles, of triangles with three different corners. A closed
    /// surface in one piece without handles has 2.
    pub euler: i64,
    /// Pieces that share no edge with one another.
    pub shells: usize,
    /// Edges of one triangle.
    pub boundary_edges: usize,
    /// Pieces of the boundary that share no vertex with one another.
    pub boundary_loops: usize,
    /// Edges of three triangles or more.
    pub non_manifold_edges: usize,
    /// Edges of two triangles that run along it in the same direction: one of them is wound the wrong way.
    pub inconsistent_edges: usize,
    /// Edges that are not used as often in one direction as in the other, for whichever reason.
    pub unbalanced_edges: usize,
    /// Triangles with a repeated corner or without area.
    pub degenerate_triangles: usize,
}

impl Topology {
    /// Counts, in time and memory linear in the triangles but for one sort.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let triangles = mesh.triangles();
        let mut used = vec![false; mesh.vertices().len()];
        let mut whole_used = vec![false; mesh.vertices().len()];
        let mut sets = Sets::new(triangles.len());
        let mut degenerate_triangles = 0;
        let mut whole = 0i64;
        let reference = mesh.relative_bounds().map_or(DVec3::ZERO, |[low, high]| (low + high) / 2.0);
        let (mut area, mut volume) = (0.0, 0.0);
        for (i, corners) in triangles.iter().enumerate() {
            let repeated = has_repeated_corner(*corners);
            for &v in corners {
                used[v as usize] = true;
                whole_used[v as usize] |= !repeated;
            }
            let [a, b, c] = mesh.corners(i).map(Vec3::as_dvec3);
            let normal = (b - a).cross(c - a);
            degenerate_triangles += usize::from(repeated || normal == DVec3::ZERO);
            whole += i64::from(!repeated);
            area += normal.length() / 2.0;
            volume += (a - reference).dot(normal) / 6.0;
        }
        let mut topology = Self {
            vertices: used.len(),
            used_vertices: used.iter().filter(|u| **u).count(),
            triangles: triangles.len(),
            bounds: mesh.bounds(),
            area,
            volume,
            euler: whole_used.iter().filter(|u| **u).count() as i64 + whole,
            shells: 0,
            boundary_edges: 0,
            boundary_loops: 0,
            non_manifold_edges: 0,
            inconsistent_edges: 0,
            unbalanced_edges: 0,
            degenerate_triangles,
        };
        topology.count_edges(triangles, used.len(), &mut sets);
        let (shell_of, shells) = sets.numbered();
        let mut has_edges = vec![false; shells];
        for (corners, shell) in triangles.iter().zip(shell_of) {
            has_edges[shell as usize] |= !has_repeated_corner(*corners);
        }
        topology.shells = has_edges.iter().filter(|s| **s).count();
        topology
    }

    fn count_edges(&mut self, triangles: &[[u32; 3]], vertices: usize, sets: &mut Sets) {
        let mut boundary = Vec::new();
        for uses in Edges::new(triangles).iter() {
            self.euler -= 1;
            self.unbalanced_edges += usize::from(net(uses) != 0);
            for pair in uses.windows(2) {
                sets.join(pair[0].triangle(), pair[1].triangle(), false);
            }
            match uses {
                [one] => boundary.push(one.directed()),
                [_, _] => self.inconsistent_edges += usize::from(net(uses) != 0),
                _ => self.non_manifold_edges += 1,
            }
        }
        self.boundary_edges = boundary.len();
        let mut loops = Sets::new(if boundary.is_empty() { 0 } else { vertices });
        for [a, b] in &boundary {
            loops.join(*a as usize, *b as usize, false);
        }
        let mut roots: Vec<usize> = boundary.iter().map(|[a, _]| loops.root(*a as usize)).collect();
        roots.sort_unstable();
        roots.dedup();
        self.boundary_loops = roots.len();
    }

    /// Whether the surface is closed: every edge is used as often in one direction as in the other, so that the
    /// inside is defined. Which side is inside is another question: see [`Topology::volume`].
    pub fn is_closed(&self) -> bool {
        self.triangles > 0 && self.unbalanced_edges == 0
    }
}

/// Whether two corners are the same vertex.
pub(crate) fn has_repeated_corner([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}
