//! Events of lines through generated closed meshes: watertight, and the same from every finder.

mod support;

use std::sync::Arc;

use cutaway_core::camera::Ray;
use cutaway_core::glam::{DAffine3, DVec3};
use cutaway_mesh::events::{EventFinder, MeshEvents, ObjectRays, SolidFrame};
use cutaway_mesh::shapes::{cube, icosphere, torus};
use cutaway_mesh::{MeshSolid, PixelEvents, TileEvents, TileRect, TriangleMesh};
use support::{Random, fault, view};

fn all_finders(mesh: &Arc<TriangleMesh>) -> Vec<MeshEvents> {
    EventFinder::ALL.iter().map(|&finder| MeshEvents::new(Arc::clone(mesh), finder)).collect()
}

fn assert_watertight(finder: &MeshEvents, ray: &Ray, exhaustive: bool) {
    let mut events = Vec::new();
    finder.line(ray, &mut events);
    if let Some(fault) = fault(&events, 1e-9, true) {
        panic!("{ray:?}: {fault}");
    }
    if exhaustive {
        let mut all = Vec::new();
        finder.line_exhaustive(ray, &mut all);
        assert_eq!(events, all, "{:?} {ray:?}", finder.finder());
    }
}

/// 520,000 random lines on each of two meshes, and 30,000 through vertices and edges of each.
#[test]
fn a_million_lines_through_closed_meshes_go_in_as_often_as_out() {
    for (seed, mesh) in [(1, icosphere(2)), (2, torus(0.4, 24, 12))] {
        let mesh = Arc::new(mesh);
        let finder = MeshEvents::new(Arc::clone(&mesh), EventFinder::Bvh);
        let mut random = Random(seed);
        for i in 0..520_000 {
            let target = random.cube() * 1.4;
            let ray = random.towards(target, 1.0);
            assert_watertight(&finder, &ray, i % 4 == 0);
        }
        for _ in 0..30_000 {
            let ray = aimed_at_a_feature(&mesh, &mut random);
            assert_watertight(&finder, &ray, true);
        }
    }
}

/// A ray whose line passes exactly, as far as f64 goes, through a vertex or the middle of an edge; every third along
/// an axis, where it really is exact.
fn aimed_at_a_feature(mesh: &TriangleMesh, random: &mut Random) -> Ray {
    let corners = mesh.corners(random.index(mesh.triangles().len())).map(|c| mesh.origin() + c.as_dvec3());
    let target = if random.bits() & 1 == 0 { corners[0] } else { (corners[0] + corners[1]) * 0.5 };
    let mut ray = random.towards(target, 1.0);
    match random.index(3) {
        0 => {
            let axis = DVec3::AXES[random.index(3)];
            ray = Ray { origin: target - axis * (random.index(5) as f64 - 1.0), direction: axis };
        }
        1 => {
            // Through two vertices: along edges and diagonals.
            let other = mesh.origin() + mesh.corners(random.index(mesh.triangles().len()))[1].as_dvec3();
            ray = Ray { origin: other, direction: target - other };
        }
        _ => {}
    }
    ray
}

#[test]
fn axis_parallel_lines_in_the_faces_and_edges_of_a_cube_balance() {
    let mesh = Arc::new(cube());
    for finder in all_finders(&mesh) {
        for axis in 0..3 {
            for (i, j) in (-6..=6).flat_map(|i| (-6..=6).map(move |j| (i, j))) {
                let mut origin = DVec3::splat(-3.0);
                origin[(axis + 1) % 3] = f64::from(i) * 0.25;
                origin[(axis + 2) % 3] = f64::from(j) * 0.25;
                for direction in
                    [DVec3::AXES[axis], -2.0 * DVec3::AXES[axis], DVec3::ONE, DVec3::new(1.0, 1.0, 0.0)]
                {
                    assert_watertight(&finder, &Ray { origin, direction }, true);
                }
            }
        }
    }
}

#[test]
fn every_finder_gives_the_events_of_asking_every_triangle() {
    let flat = TriangleMesh::new(
        vec![[0.0, 0.0, 1.0].into(), [1.0, 0.0, 1.0].into(), [0.0, 1.0, 1.0].into()],
        vec![[0, 1, 2], [0, 2, 1]],
    );
    let far = icosphere(2).vertices().iter().map(|&v| v * 0.01 + 1000.0).collect();
    let far = TriangleMesh::new(far, icosphere(2).triangles().to_vec());
    let meshes = [icosphere(0), icosphere(4), torus(0.1, 200, 3), cube(), flat.unwrap(), far.unwrap()];
    for (seed, mesh) in meshes.into_iter().enumerate() {
        let mesh = Arc::new(mesh);
        let [low, high] = support::bounds(&mesh);
        let finders = all_finders(&mesh);
        let mut random = Random(seed as u64);
        for i in 0..3000 {
            let target = low + (random.cube() * 0.6 + 0.5) * (high - low);
            let ray = if i % 2 == 0 {
                random.towards(target, (high - low).length())
            } else {
                aimed_at_a_feature(&mesh, &mut random)
            };
            let mut expected = Vec::new();
            finders[0].line_exhaustive(&ray, &mut expected);
            for finder in &finders {
                let mut events = Vec::new();
                finder.line(&ray, &mut events);
                assert_eq!(events, expected, "{:?} {ray:?}", finder.finder());
            }
        }
    }
}

/// All tiles of a frame against single lines; the tile size does not matter.
fn assert_frame(
    mesh: &Arc<TriangleMesh>,
    rays: &cutaway_core::camera::RayGenerator,
    pose: &DAffine3,
    size: [u32; 2],
) {
    let finders = all_finders(mesh);
    let object_rays = ObjectRays::new(*rays, *pose);
    let mut tile = TileEvents::new();
    for side in [32, 27] {
        for finder in &finders {
            let frame = finder.frame(rays, pose, size[0], size[1]);
            for (x, y) in
                (0..size[1]).step_by(side).flat_map(|y| (0..size[0]).step_by(side).map(move |x| (x, y)))
            {
                frame.tile(TileRect { x, y, width: side as u32, height: side as u32 }, &mut tile);
                let rect = tile.rect().expect("a tile");
                for (row, column) in (0..rect.height).flat_map(|r| (0..rect.width).map(move |c| (r, c))) {
                    let ray = object_rays.pixel(x + column, y + row);
                    let mut expected = Vec::new();
                    finder.line_exhaustive(&ray, &mut expected);
                    let found = tile.pixel(column, row);
                    assert_eq!(found, expected, "{:?} at {x}+{column}, {y}+{row}", finder.finder());
                }
            }
        }
    }
}

#[test]
fn frames_have_the_events_of_their_lines_under_any_camera_and_pose() {
    let mut random = Random(7);
    for i in 0..12 {
        let mesh = Arc::new([icosphere(2), torus(0.4, 24, 12), cube()][i % 3].clone());
        let size = [[67, 45], [33, 64], [1, 1]][i % 3];
        let rays = view(&mesh, random.direction(), size, i % 2 == 1);
        let pose = if i < 3 { DAffine3::IDENTITY } else { random.pose() };
        assert_frame(&mesh, &rays, &pose, size);
    }
}

#[test]
fn frames_from_inside_the_mesh_have_all_events_before_and_behind_the_eye() {
    let mut random = Random(8);
    for i in 0..12 {
        let mesh = Arc::new([torus(0.4, 24, 12), icosphere(2), cube()][i % 3].clone());
        let camera = cutaway_core::camera::Camera {
            // Every fourth eye is exactly at a vertex.
            position: if i % 4 == 0 { mesh.vertices()[i % 8].as_dvec3() } else { random.cube() }.to_array(),
            focal_point: (random.cube() * 5.0).to_array(),
            view_up: [0.0, 0.0, 1.0],
            view_angle: [30.0, 120.0, 175.0][i % 3],
            orthographic: None,
        };
        assert_frame(&mesh, &camera.rays(45, 38), &DAffine3::IDENTITY, [45, 38]);
    }
}

#[test]
fn odd_poses_and_meshes_give_events_or_none_but_no_panic() {
    let empty = TriangleMesh::new(vec![], vec![]).unwrap();
    let point = TriangleMesh::new(vec![[1.0, 2.0, 3.0].into()], vec![[0, 0, 0]; 100]).unwrap();
    let huge = icosphere(1).vertices().iter().map(|&v| v * 3e38).collect();
    let huge = TriangleMesh::new(huge, icosphere(1).triangles().to_vec()).unwrap();
    let tiny = icosphere(1).vertices().iter().map(|&v| v * 1e-44).collect();
    let tiny = TriangleMesh::new(tiny, icosphere(1).triangles().to_vec()).unwrap();
    let poses = [
        DAffine3::IDENTITY,
        DAffine3::ZERO,
        DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0)),
        DAffine3::from_scale(DVec3::new(1.0, 1e-9, 1e9)),
        DAffine3::from_scale(DVec3::splat(1e-300)),
        DAffine3::from_scale(DVec3::splat(1e300)),
        DAffine3::from_translation(DVec3::splat(1e12)),
        DAffine3::from_translation(DVec3::NAN),
    ];
    let rays = view(&icosphere(1), DVec3::new(0.3, 1.0, 0.2), [19, 17], false);
    for mesh in [empty, point, huge, tiny, icosphere(2)] {
        for pose in &poses {
            assert_frame(&Arc::new(mesh.clone()), &rays, pose, [19, 17]);
        }
    }
}

#[test]
fn very_many_large_triangles_in_one_place_stay_within_memory() {
    // Each of them would be in most cells of a grid.
    let corners = [[-1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [0.0, 1.0, 1.0]].map(Into::into);
    let mesh = Arc::new(TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]; 200_000]).unwrap());
    for finder in all_finders(&mesh) {
        let mut events = Vec::new();
        finder.line(
            &Ray { origin: DVec3::new(0.0, 0.5, 0.0), direction: DVec3::new(1.0, -1.0, 0.1) },
            &mut events,
        );
        assert_eq!(events.len(), 200_000, "{:?}", finder.finder());
        assert!(finder.bytes() < 100 * 200_000, "{:?}: {}", finder.finder(), finder.bytes());
    }
}

#[test]
fn a_default_mesh_costs_less_than_a_hundred_bytes_a_triangle() {
    let mesh = Arc::new(icosphere(6));
    let count = mesh.triangles().len();
    let rays = view(&mesh, DVec3::Y, [512, 512], false);
    let of_mesh = size_of_val(mesh.vertices()) + size_of_val(mesh.triangles());
    for finder in EventFinder::ALL {
        let solid = MeshSolid::new(Arc::clone(&mesh), finder);
        // Single lines too: rasterisation builds their structure late.
        solid.mesh_events().line(&rays.pixel(256, 256), &mut Vec::new());
        let frame = solid.frame(&rays, &DAffine3::IDENTITY, 512, 512);
        let bytes = |bytes: usize| bytes as f64 / count as f64;
        let (mesh, structure, frame) = (bytes(of_mesh), bytes(solid.bytes()), bytes(frame.bytes()));
        println!(
            "{finder:?}: mesh {mesh:.1}, structure and normals {structure:.1}, frame {frame:.1} bytes a triangle"
        );
        assert!(mesh + structure + frame < 100.0, "{finder:?}");
    }
}

#[test]
fn any_solid_has_frames() {
    let mesh = Arc::new(torus(0.3, 20, 10));
    let solid = MeshSolid::new(Arc::clone(&mesh), EventFinder::Grid);
    let rays = view(&mesh, DVec3::new(0.2, 0.5, -1.0), [40, 40], false);
    let frame = solid.frame(&rays, &DAffine3::IDENTITY, 40, 40);
    let general = SolidFrame::new(&solid, ObjectRays::new(rays, DAffine3::IDENTITY));
    let (mut a, mut b) = (TileEvents::new(), TileEvents::new());
    let rect = TileRect { x: 8, y: 4, width: 32, height: 32 };
    frame.tile(rect, &mut a);
    general.tile(rect, &mut b);
    assert!(!a.is_empty());
    assert_eq!(a.events(), b.events());
}
