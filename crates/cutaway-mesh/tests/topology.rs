//! Counts of shapes whose counts are known.

mod common;

use common::{cube, star, strip, torus};
use cutaway_core::glam::{DVec3, Vec3};
use cutaway_mesh::{ClosedMesh, MeshError, NotClosed, Topology, TriangleMesh};

#[test]
fn a_cube_is_closed_and_has_its_volume_and_area() {
    for n in [1, 4] {
        let t = Topology::new(&cube(n).mesh());
        let quads = 6 * n as usize * n as usize;
        assert_eq!((t.triangles, t.used_vertices, t.vertices), (2 * quads, quads + 2, quads + 2));
        assert_eq!((t.euler, t.shells, t.boundary_edges, t.non_manifold_edges), (2, 1, 0, 0));
        assert!(t.is_closed());
        // Coordinates are multiples of a quarter: exact but for the sum.
        assert!((t.volume - 1.0).abs() < 1e-12 && (t.area - 6.0).abs() < 1e-12, "{t:?}");
        assert_eq!(t.bounds, Some([DVec3::ZERO, DVec3::ONE]));
    }
}

#[test]
fn handles_lower_the_euler_number() {
    let t = Topology::new(&torus(64).mesh());
    assert!(t.is_closed());
    assert_eq!((t.euler, t.shells), (0, 1));
    // 2 pi^2 R r^2; a polygon of 64 corners has 0.9984 of the circle's area.
    let exact = 2.0 * std::f64::consts::PI.powi(2) * 2.0;
    assert!((t.volume / exact - 1.0).abs() < 0.005, "{}", t.volume);
}

#[test]
fn boundaries_are_counted_in_edges_and_loops() {
    let mut open = cube(4);
    // Two holes on opposite sides.
    open.triangles.remove(open.triangles.len() - 1);
    open.triangles.remove(0);
    let t = Topology::new(&open.mesh());
    assert_eq!((t.boundary_edges, t.boundary_loops, t.euler), (6, 2, 0));
    assert!(!t.is_closed());
    let t = Topology::new(&strip(10, false).mesh());
    assert_eq!((t.boundary_edges, t.boundary_loops, t.euler), (20, 2, 0));
    let t = Topology::new(&strip(10, true).mesh());
    assert_eq!((t.boundary_edges, t.boundary_loops, t.euler), (20, 1, 0));
    assert_eq!(t.inconsistent_edges, 1);
}

#[test]
fn a_turned_triangle_leaves_three_inconsistent_edges() {
    let mut soup = star(3, |_| 1.0);
    soup.triangles[7].swap(0, 1);
    let t = Topology::new(&soup.mesh());
    assert_eq!((t.inconsistent_edges, t.unbalanced_edges, t.boundary_edges), (3, 3, 0));
}

#[test]
fn degenerate_triangles_have_no_edges_unless_their_corners_differ() {
    let mut soup = cube(1);
    soup.triangles.extend([[0, 0, 1], [2, 2, 2]]);
    let t = Topology::new(&soup.mesh());
    assert_eq!((t.degenerate_triangles, t.euler, t.shells), (2, 2, 1));
    assert!(t.is_closed());
    soup.vertices.push((soup.vertices[0] + soup.vertices[1]) / 2.0);
    soup.triangles.push([0, 1, soup.vertices.len() as u32 - 1]);
    let t = Topology::new(&soup.mesh());
    assert_eq!((t.degenerate_triangles, t.boundary_edges, t.non_manifold_edges), (3, 2, 1));
}

#[test]
fn nothing_has_nothing() {
    let t = Topology::new(&TriangleMesh::new(vec![Vec3::ONE], vec![]).unwrap());
    assert_eq!((t.vertices, t.used_vertices, t.euler, t.shells, t.bounds), (1, 0, 0, 0, None));
    assert!(!t.is_closed());
}

#[test]
fn what_is_no_mesh_is_refused() {
    let wrong = TriangleMesh::new(vec![Vec3::ZERO], vec![[0, 0, 1]]).unwrap_err();
    assert_eq!(wrong, MeshError::Index { triangle: 0, vertex: 1, vertices: 1 });
    let wrong = TriangleMesh::new(vec![Vec3::ZERO, Vec3::NAN], vec![]).unwrap_err();
    assert!(matches!(wrong, MeshError::NotFinite { vertex: 1, .. }));
}

#[test]
fn only_what_is_closed_and_outward_is_a_closed_mesh() {
    assert!(ClosedMesh::new(cube(2).mesh()).is_ok());
    let error = ClosedMesh::new(cube(2).inward().mesh()).unwrap_err();
    assert!(matches!(error, NotClosed::Volume { volume } if (volume + 1.0).abs() < 1e-9), "{error}");
    let mut open = cube(2);
    open.triangles.pop();
    let error = ClosedMesh::new(open.mesh()).unwrap_err();
    assert_eq!(error, NotClosed::Open { boundary: 3, non_manifold: 0, inconsistent: 0 });
}
