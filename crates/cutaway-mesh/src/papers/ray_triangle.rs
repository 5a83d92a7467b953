//! The seven ray-triangle intersections of Termeer's table 3.1, timed beside ours.
//!
//! Each stores of a triangle whatever it can use, as the thesis did, works in f64, takes both sides of a triangle and
//! the whole line. None of them is watertight: at an edge, rounding may lose or double a hit. Where the published code
//! compares the determinant with 1e-6, these compare it with 0, as that bound depends on the size of the mesh.

use std::hint::black_box;
use std::time::{Duration, Instant};

use cutaway_core::camera::Ray;
use cutaway_core::glam::DVec3;

use crate::TriangleMesh;
use crate::events::watertight::Line;

/// A row of table 3.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Algorithm {
    /// Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", Journal of Graphics Tools 2(1), 1997.
    MollerTrumbore,
    /// Variant 1 of Möller 2000, "Practical analysis of optimized ray-triangle intersection": tests by the sign of the
    /// determinant, division at the end.
    MollerTrumbore1,
    /// Variant 2: as 1, the division begun before the tests, so that it runs beside them.
    MollerTrumbore2,
    /// Variant 3: as 2, with one cross product moved in front of the tests.
    MollerTrumbore3,
    /// Variant 4. The thesis does not say what it is and Möller's code ends at 3; this is the form with a stored
    /// normal, which does away with one of the two cross products.
    MollerTrumbore4,
    /// Sunday, "Intersections of rays and triangles", 2001: the plane, then barycentric coordinates by dot products.
    Sunday,
    /// Badouel, "An efficient ray-polygon intersection", Graphics Gems, 1990: the plane, then a projected triangle.
    Badouel,
    /// Ours: see the module `events`. Not in the thesis.
    Watertight,
}

impl Algorithm {
    /// The table's seven in its order, then ours.
    pub const ALL: [Self; 8] = [
        Self::MollerTrumbore,
        Self::MollerTrumbore1,
        Self::MollerTrumbore2,
        Self::MollerTrumbore3,
        Self::MollerTrumbore4,
        Self::Sunday,
        Self::Badouel,
        Self::Watertight,
    ];

    /// The name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::MollerTrumbore => "Möller-Trumbore (original)",
            Self::MollerTrumbore1 => "Möller-Trumbore (variant 1)",
            Self::MollerTrumbore2 => "Möller-Trumbore (variant 2)",
            Self::MollerTrumbore3 => "Möller-Trumbore (variant 3)",
            Self::MollerTrumbore4 => "Möller-Trumbore (variant 4)",
            Self::Sunday => "Dan Sunday",
            Self::Badouel => "Badouel",
            Self::Watertight => "watertight (ours)",
        }
    }

    /// The speed in table 3.1, where variant 2 is 1.
    pub fn paper(self) -> Option<f64> {
        match self {
            Self::MollerTrumbore => Some(0.81),
            Self::MollerTrumbore1 => Some(0.91),
            Self::MollerTrumbore2 => Some(1.0),
            Self::MollerTrumbore3 => Some(0.91),
            Self::MollerTrumbore4 | Self::Sunday => Some(0.87),
            Self::Badouel => Some(0.58),
            Self::Watertight => None,
        }
    }

    /// Where the line of a ray crosses a triangle; for tests, as the stored values are computed anew each time.
    pub fn intersect(self, ray: &Ray, corners: [DVec3; 3]) -> Option<f64> {
        match self {
            Self::MollerTrumbore => moller_trumbore(ray, &Edges::new(corners)),
            Self::MollerTrumbore1 => moller_trumbore_1(ray, &Edges::new(corners)),
            Self::MollerTrumbore2 => moller_trumbore_2(ray, &Edges::new(corners)),
            Self::MollerTrumbore3 => moller_trumbore_3(ray, &Edges::new(corners)),
            Self::MollerTrumbore4 => moller_trumbore_4(ray, &EdgesAndNormal::new(corners)),
            Self::Sunday => sunday(ray, &Products::new(corners)),
            Self::Badouel => badouel(ray, &Projected::new(corners)),
            Self::Watertight => Line::new(ray)?.crossing(corners.map(|c| c.as_vec3())).map(|hit| hit.0),
        }
    }
}

/// What Möller and Trumbore's original and its first three variants store: a corner and two edges.
struct Edges {
    corner: DVec3,
    edge1: DVec3,
    edge2: DVec3,
}

impl Edges {
    fn new([a, b, c]: [DVec3; 3]) -> Self {
        Self { corner: a, edge1: b - a, edge2: c - a }
    }
}

#[inline(always)]
fn moller_trumbore(ray: &Ray, triangle: &Edges) -> Option<f64> {
    let p = ray.direction.cross(triangle.edge2);
    let determinant = triangle.edge1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let inverse = 1.0 / determinant;
    let s = ray.origin - triangle.corner;
    let u = s.dot(p) * inverse;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let q = s.cross(triangle.edge1);
    let v = ray.direction.dot(q) * inverse;
    (v >= 0.0 && u + v <= 1.0).then(|| triangle.edge2.dot(q) * inverse)
}

#[inline(always)]
fn moller_trumbore_1(ray: &Ray, triangle: &Edges) -> Option<f64> {
    let p = ray.direction.cross(triangle.edge2);
    let determinant = triangle.edge1.dot(p);
    let s = ray.origin - triangle.corner;
    let u = s.dot(p);
    let q;
    if determinant > 0.0 {
        if u < 0.0 || u > determinant {
            return None;
        }
        q = s.cross(triangle.edge1);
        let v = ray.direction.dot(q);
        if v < 0.0 || u + v > determinant {
            return None;
        }
    } else if determinant < 0.0 {
        if u > 0.0 || u < determinant {
            return None;
        }
        q = s.cross(triangle.edge1);
        let v = ray.direction.dot(q);
        if v > 0.0 || u + v < determinant {
            return None;
        }
    } else {
        return None;
    }
    Some(triangle.edge2.dot(q) / determinant)
}

#[inline(always)]
fn moller_trumbore_2(ray: &Ray, triangle: &Edges) -> Option<f64> {
    let p = ray.direction.cross(triangle.edge2);
    let determinant = triangle.edge1.dot(p);
    let s = ray.origin - triangle.corner;
    let inverse = 1.0 / determinant;
    let u = s.dot(p);
    let q;
    if determinant > 0.0 {
        if u < 0.0 || u > determinant {
            return None;
        }
        q = s.cross(triangle.edge1);
        let v = ray.direction.dot(q);
        if v < 0.0 || u + v > determinant {
            return None;
        }
    } else if determinant < 0.0 {
        if u > 0.0 || u < determinant {
            return None;
        }
        q = s.cross(triangle.edge1);
        let v = ray.direction.dot(q);
        if v > 0.0 || u + v < determinant {
            return None;
        }
    } else {
        return None;
    }
    Some(triangle.edge2.dot(q) * inverse)
}

#[inline(always)]
fn moller_trumbore_3(ray: &Ray, triangle: &Edges) -> Option<f64> {
    let p = ray.direction.cross(triangle.edge2);
    let determinant = triangle.edge1.dot(p);
    let s = ray.origin - triangle.corner;
    let inverse = 1.0 / determinant;
    let q = s.cross(triangle.edge1);
    let (u, v) = (s.dot(p), ray.direction.dot(q));
    if determinant > 0.0 {
        if u < 0.0 || u > determinant || v < 0.0 || u + v > determinant {
            return None;
        }
    } else if determinant < 0.0 {
        if u > 0.0 || u < determinant || v > 0.0 || u + v < determinant {
            return None;
        }
    } else {
        return None;
    }
    Some(triangle.edge2.dot(q) * inverse)
}

/// What variant 4 stores.
struct EdgesAndNormal {
    edges: Edges,
    /// `edge1 x edge2`, not normalised.
    normal: DVec3,
}

impl EdgesAndNormal {
    fn new(corners: [DVec3; 3]) -> Self {
        let edges = Edges::new(corners);
        Self { normal: edges.edge1.cross(edges.edge2), edges }
    }
}

#[inline(always)]
fn moller_trumbore_4(ray: &Ray, triangle: &EdgesAndNormal) -> Option<f64> {
    let determinant = -ray.direction.dot(triangle.normal);
    if determinant == 0.0 {
        return None;
    }
    let inverse = 1.0 / determinant;
    let s = ray.origin - triangle.edges.corner;
    let q = s.cross(ray.direction);
    let u = triangle.edges.edge2.dot(q) * inverse;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let v = -triangle.edges.edge1.dot(q) * inverse;
    (v >= 0.0 && u + v <= 1.0).then(|| s.dot(triangle.normal) * inverse)
}

/// What Sunday's algorithm stores.
struct Products {
    edges: EdgesAndNormal,
    uu: f64,
    uv: f64,
    vv: f64,
    /// `1 / (uv^2 - uu vv)`.
    inverse: f64,
}

impl Products {
    fn new(corners: [DVec3; 3]) -> Self {
        let edges = EdgesAndNormal::new(corners);
        let (u, v) = (edges.edges.edge1, edges.edges.edge2);
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        Self { edges, uu, uv, vv, inverse: 1.0 / (uv * uv - uu * vv) }
    }
}

#[inline(always)]
fn sunday(ray: &Ray, triangle: &Products) -> Option<f64> {
    let EdgesAndNormal { edges, normal } = &triangle.edges;
    let towards = normal.dot(ray.direction);
    if towards == 0.0 {
        return None;
    }
    let t = normal.dot(edges.corner - ray.origin) / towards;
    let w = ray.origin + ray.direction * t - edges.corner;
    let (wu, wv) = (w.dot(edges.edge1), w.dot(edges.edge2));
    let s = (triangle.uv * wv - triangle.vv * wu) * triangle.inverse;
    if !(0.0..=1.0).contains(&s) {
        return None;
    }
    let r = (triangle.uv * wu - triangle.uu * wv) * triangle.inverse;
    (r >= 0.0 && s + r <= 1.0).then_some(t)
}

/// What Badouel's algorithm stores.
struct Projected {
    normal: DVec3,
    /// The plane is `normal . x = distance`.
    distance: f64,
    /// The two axes that the triangle is projected on, across the largest component of the normal.
    axes: [usize; 2],
    corner: [f64; 2],
    edge1: [f64; 2],
    edge2: [f64; 2],
}

impl Projected {
    fn new([a, b, c]: [DVec3; 3]) -> Self {
        let normal = (b - a).cross(c - a);
        let largest = normal.abs().max_position();
        let axes = [(largest + 1) % 3, (largest + 2) % 3];
        let plane = |v: DVec3| axes.map(|axis| v[axis]);
        let (corner, edge1, edge2) = (plane(a), plane(b - a), plane(c - a));
        Self { normal, distance: normal.dot(a), axes, corner, edge1, edge2 }
    }
}

#[inline(always)]
fn badouel(ray: &Ray, triangle: &Projected) -> Option<f64> {
    let towards = triangle.normal.dot(ray.direction);
    if towards == 0.0 {
        return None;
    }
    let t = (triangle.distance - triangle.normal.dot(ray.origin)) / towards;
    let at = |i: usize| {
        let axis = triangle.axes[i];
        ray.origin[axis] + ray.direction[axis] * t - triangle.corner[i]
    };
    let ([u0, v0], [u1, v1], [u2, v2]) = ([at(0), at(1)], triangle.edge1, triangle.edge2);
    let inside = |beta: f64| (0.0..=1.0).contains(&beta);
    let (alpha, beta);
    if u1 == 0.0 {
        beta = u0 / u2;
        if !inside(beta) {
            return None;
        }
        alpha = (v0 - beta * v2) / v1;
    } else {
        beta = (v0 * u1 - u0 * v1) / (v2 * u1 - u2 * v1);
        if !inside(beta) {
            return None;
        }
        alpha = (u0 - beta * u2) / u1;
    }
    (alpha >= 0.0 && alpha + beta <= 1.0).then_some(t)
}

/// A measured row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Which algorithm.
    pub algorithm: Algorithm,
    /// The mean time of a test in nanoseconds, in the fastest pass.
    pub nanoseconds: f64,
    /// The speed; variant 2 is 1, as in the table.
    pub relative: f64,
    /// The speed in the thesis.
    pub paper: Option<f64>,
}

/// Pairs of a ray and a triangle that are measured in one pass.
const PAIRS: usize = 1 << 14;

/// Measures table 3.1 on triangles of a mesh, all algorithms by turns until about `time` has passed.
///
/// Each ray is aimed at a random point around its triangle, which two in nine hit: about what a grid or a tree leaves to
/// test. Empty for a mesh without triangles of any area.
pub fn table_3_1(mesh: &TriangleMesh, time: Duration) -> Vec<Row> {
    let (rays, corners) = pairs(mesh);
    if rays.is_empty() {
        return Vec::new();
    }
    let lines: Vec<Option<Line>> = rays.iter().map(Line::new).collect();
    let short: Vec<_> = corners.iter().map(|c| c.map(|c| c.as_vec3())).collect();
    let stored = Stored::new(&corners);
    let mut shortest = [f64::INFINITY; 8];
    let end = Instant::now() + time;
    loop {
        for (algorithm, shortest) in Algorithm::ALL.into_iter().zip(&mut shortest) {
            let start = Instant::now();
            match algorithm {
                Algorithm::MollerTrumbore => pass(&rays, &stored.edges, moller_trumbore),
                Algorithm::MollerTrumbore1 => pass(&rays, &stored.edges, moller_trumbore_1),
                Algorithm::MollerTrumbore2 => pass(&rays, &stored.edges, moller_trumbore_2),
                Algorithm::MollerTrumbore3 => pass(&rays, &stored.edges, moller_trumbore_3),
                Algorithm::MollerTrumbore4 => pass(&rays, &stored.normals, moller_trumbore_4),
                Algorithm::Sunday => pass(&rays, &stored.products, sunday),
                Algorithm::Badouel => pass(&rays, &stored.projected, badouel),
                Algorithm::Watertight => {
                    pass(&lines, &short, |line, corners| line.as_ref()?.crossing(*corners).map(|hit| hit.0));
                }
            }
            *shortest = shortest.min(start.elapsed().as_secs_f64() * 1e9 / rays.len() as f64);
        }
        if Instant::now() >= end {
            break;
        }
    }
    let unit = shortest[Algorithm::MollerTrumbore2 as usize];
    let row = |(algorithm, nanoseconds): (Algorithm, f64)| Row {
        algorithm,
        nanoseconds,
        relative: unit / nanoseconds,
        paper: algorithm.paper(),
    };
    Algorithm::ALL.into_iter().zip(shortest).map(row).collect()
}

/// What the algorithms store, of all triangles.
struct Stored {
    edges: Vec<Edges>,
    normals: Vec<EdgesAndNormal>,
    products: Vec<Products>,
    projected: Vec<Projected>,
}

impl Stored {
    fn new(corners: &[[DVec3; 3]]) -> Self {
        let corners = corners.iter().copied();
        Self {
            edges: corners.clone().map(Edges::new).collect(),
            normals: corners.clone().map(EdgesAndNormal::new).collect(),
            products: corners.clone().map(Products::new).collect(),
            projected: corners.map(Projected::new).collect(),
        }
    }
}

fn pass<R, T>(rays: &[R], triangles: &[T], test: impl Fn(&R, &T) -> Option<f64>) {
    let hits = rays.iter().zip(triangles).filter_map(|(ray, triangle)| test(ray, triangle));
    black_box(hits.sum::<f64>());
}

/// Rays, and the triangles that they are aimed at or beside.
fn pairs(mesh: &TriangleMesh) -> (Vec<Ray>, Vec<[DVec3; 3]>) {
    let mut state = 1u64;
    let mut random = move || {
        // Knuth's MMIX generator; its upper half is random enough to aim with.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 32) as f64 / f64::from(u32::MAX)
    };
    let count = mesh.triangles().len();
    let step = (count / PAIRS).max(1);
    let corners =
        (0..PAIRS * usize::from(count > 0)).map(|i| mesh.corners(i * step % count).map(|c| c.as_dvec3()));
    let has_area = |c: &[DVec3; 3]| (c[1] - c[0]).cross(c[2] - c[0]).length_squared() > 0.0;
    let aimed = corners.filter(has_area).map(|[a, b, c]| {
        let (u, v) = (random() * 1.5 - 0.25, random() * 1.5 - 0.25);
        let target = a + (b - a) * u + (c - a) * v;
        let size = (b - a).length() * 100.0;
        let away = DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * size;
        let origin = target + away;
        (Ray { origin, direction: (target - origin).normalize_or(DVec3::Z) }, [a, b, c])
    });
    aimed.unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{cube, icosphere};

    #[test]
    fn all_agree_with_the_watertight_one_away_from_edges() {
        for mesh in [icosphere(3), cube()] {
            let (rays, triangles) = pairs(&mesh);
            let mut hits = 0;
            for (ray, corners) in rays.iter().zip(&triangles) {
                // Moving the ray's target by a thousandth of the triangle tells whether it is near an edge.
                let [a, b, c] = *corners;
                let ours = |offset: DVec3| {
                    let moved = Ray { origin: ray.origin + offset, ..*ray };
                    Algorithm::Watertight.intersect(&moved, *corners)
                };
                let around = [b - a, c - a, a - b, a - c, b - c, c - b].map(|e| ours(e * 1e-3).is_some());
                if around.iter().any(|&hit| hit != around[0]) {
                    continue;
                }
                let expected = ours(DVec3::ZERO);
                hits += usize::from(expected.is_some());
                for algorithm in Algorithm::ALL {
                    let found = algorithm.intersect(ray, *corners);
                    let agrees = match (found, expected) {
                        (Some(found), Some(expected)) => (found - expected).abs() <= 1e-6 * expected.abs(),
                        (found, expected) => found.is_none() && expected.is_none(),
                    };
                    assert!(agrees, "{algorithm:?} {ray:?} {corners:?}: {found:?}, not {expected:?}");
                }
            }
            let fraction = hits as f64 / rays.len() as f64;
            assert!((0.18..0.26).contains(&fraction), "two in nine should hit: {fraction}");
        }
    }

    #[test]
    fn parallel_rays_and_triangles_without_area_are_missed() {
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let along = Ray { origin: DVec3::new(-1.0, 0.2, 0.0), direction: DVec3::X };
        let line = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        let down = Ray { origin: DVec3::new(0.5, 0.0, 1.0), direction: -DVec3::Z };
        for algorithm in Algorithm::ALL {
            assert_eq!(algorithm.intersect(&along, flat), None, "{algorithm:?}");
            assert_eq!(algorithm.intersect(&down, line), None, "{algorithm:?}");
        }
    }

    #[test]
    fn the_table_has_a_row_for_each_with_variant_2_as_the_unit() {
        let rows = table_3_1(&icosphere(2), Duration::from_millis(5));
        assert_eq!(rows.len(), 8);
        assert_eq!(rows[2].relative, 1.0);
        assert!(rows.iter().all(|row| row.nanoseconds > 0.0 && row.relative > 0.0));
        assert!(table_3_1(&TriangleMesh::new(vec![], vec![]).unwrap(), Duration::ZERO).is_empty());
    }
}
