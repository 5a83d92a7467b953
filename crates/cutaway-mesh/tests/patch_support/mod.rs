//! Surfaces and checks that the tests of patches share.
#![allow(dead_code, reason = "each test file uses some of them")]

use std::collections::HashMap;

use cutaway_core::glam::DVec3;
use cutaway_mesh::TriangleMesh;
use cutaway_mesh::patches::{Nurbs, NurbsSurface};

/// Half the square root of two: the weight in the middle of a quarter of a circle.
pub(crate) const W: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The unit sphere as a surface of revolution: biquadratic, five points from pole to pole, nine around.
pub(crate) fn sphere() -> NurbsSurface {
    let profile = [(0.0, -1.0, 1.0), (1.0, -1.0, W), (1.0, 0.0, 1.0), (1.0, 1.0, W), (0.0, 1.0, 1.0)];
    revolution(&profile, &[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0])
}

/// Turns a quadratic profile of `(radius, height, weight)` about the z axis.
pub(crate) fn revolution(profile: &[(f64, f64, f64)], knots: &[f64]) -> NurbsSurface {
    let circle = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
    let mut points = Vec::new();
    let mut weights = Vec::new();
    for &(radius, height, weight) in profile {
        for (k, &(x, y)) in circle.iter().enumerate() {
            points.push(DVec3::new(radius * f64::from(x), radius * f64::from(y), height));
            weights.push(weight * if k % 2 == 1 { W } else { 1.0 });
        }
    }
    let around = [0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0];
    let nurbs = Nurbs {
        degree: [2, 2],
        rows: profile.len(),
        columns: circle.len(),
        points: &points,
        weights: Some(&weights),
        knots_u: knots,
        knots_v: &around,
    };
    NurbsSurface::new(&nurbs).unwrap()
}

/// How often each edge is used, forwards and backwards.
pub(crate) fn edge_uses(mesh: &TriangleMesh) -> HashMap<(u32, u32), [usize; 2]> {
    let mut uses: HashMap<_, [usize; 2]> = HashMap::new();
    for &[a, b, c] in mesh.triangles() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            uses.entry((from.min(to), from.max(to))).or_default()[usize::from(from > to)] += 1;
        }
    }
    uses
}

/// Asserts that each edge is used once each way, or once only if it is one of so many boundary edges.
pub(crate) fn assert_no_cracks(mesh: &TriangleMesh, boundary: usize) {
    let uses = edge_uses(mesh);
    let open = uses.values().filter(|uses| uses.iter().sum::<usize>() == 1).count();
    let shared = uses.values().filter(|uses| **uses == [1, 1]).count();
    assert_eq!((open, shared + open), (boundary, uses.len()));
}

/// Vertices in use minus edges plus triangles.
pub(crate) fn euler(mesh: &TriangleMesh) -> i64 {
    let used: std::collections::HashSet<_> = mesh.triangles().iter().flatten().collect();
    used.len() as i64 - edge_uses(mesh).len() as i64 + mesh.triangles().len() as i64
}

/// The volume that a closed mesh encloses.
pub(crate) fn volume(mesh: &TriangleMesh) -> f64 {
    let corners = (0..mesh.triangles().len()).map(|t| mesh.corners(t).map(|v| mesh.origin() + v.as_dvec3()));
    corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

/// How far a point is from a mesh.
pub(crate) fn distance(mesh: &TriangleMesh, p: DVec3) -> f64 {
    let distances = (0..mesh.triangles().len())
        .map(|t| to_triangle(p, mesh.corners(t).map(|v| mesh.origin() + v.as_dvec3())));
    distances.fold(f64::INFINITY, f64::min)
}

/// How far a point is from a triangle.
pub(crate) fn to_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let n = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(s, e)| (*e - *s).cross(p - *s).dot(n) >= 0.0);
    if inside && n.length() > 0.0 {
        return (p - a).dot(n.normalize()).abs();
    }
    let to_line = |s: DVec3, e: DVec3| {
        let d = e - s;
        let t = if d.length_squared() > 0.0 {
            ((p - s).dot(d) / d.length_squared()).clamp(0.0, 1.0)
        } else {
            0.0
        };
        p.distance(s + t * d)
    };
    to_line(a, b).min(to_line(b, c)).min(to_line(c, a))
}
