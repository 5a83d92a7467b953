//! Broken shapes come back closed, with what was done to them said; what cannot be closed is refused with counts.

mod common;

use common::{Soup, cube, star, strip, torus};
use cutaway_core::glam::Vec3;
use cutaway_mesh::{RepairError, RepairNotice, RepairOptions, Repaired, Topology, TriangleMesh, repair};
use proptest::prelude::*;

fn mend(soup: &Soup) -> Result<Repaired, RepairError> {
    let repaired = repair(&soup.mesh(), &RepairOptions::default())?;
    let topology = Topology::new(repaired.mesh.mesh());
    assert!(topology.is_closed() && topology.volume > 0.0, "{topology:?}");
    assert_eq!(topology.vertices, topology.used_vertices);
    // What is closed stays as it is.
    let again = repair(repaired.mesh.mesh(), &RepairOptions::default())?;
    assert_eq!(again.mesh, repaired.mesh);
    let kept =
        |n: &RepairNotice| matches!(n, RepairNotice::Cavities { .. } | RepairNotice::NonManifoldKept { .. });
    assert!(again.notices.iter().all(kept), "{:?}", again.notices);
    Ok(repaired)
}

fn volume(repaired: &Repaired) -> f64 {
    Topology::new(repaired.mesh.mesh()).volume
}

/// A position within 1e-6, which f32 coordinates of size 1 allow for a volume of size 1.
fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-5 * b.abs().max(1.0)
}

#[test]
fn what_is_closed_is_left_alone() {
    for soup in [cube(3), torus(12), star(5, |d| 1.0 + 0.3 * d.x)] {
        let repaired = mend(&soup).unwrap();
        assert_eq!(repaired.notices, []);
        assert_eq!(repaired.mesh.mesh(), &soup.mesh());
    }
}

#[test]
fn vertices_of_their_own_are_welded() {
    let repaired = mend(&cube(2).unwelded()).unwrap();
    assert_eq!(repaired.notices, [RepairNotice::Welded { vertices: 48 * 3 - 26, within: 0.0 }]);
    assert_eq!(repaired.notices[0].to_string(), "118 vertices at the place of others welded to them");
}

#[test]
fn zero_and_minus_zero_are_one_place() {
    let mut soup = cube(1).unwelded();
    for (i, v) in soup.vertices.iter_mut().enumerate().filter(|(i, _)| i % 2 == 0) {
        *v = v.map(|c| if c == 0.0 { -0.0 } else { c });
        assert!(i < 36);
    }
    assert!(mend(&soup).is_ok());
}

#[test]
fn near_vertices_of_the_boundary_are_welded_within_the_tolerance_only() {
    let mut soup = cube(2).unwelded();
    for (i, v) in soup.vertices.iter_mut().enumerate() {
        *v += Vec3::new(1.0, -1.0, 1.0) * 1e-5 * (i % 7) as f32;
    }
    let loose = repair(&soup.mesh(), &RepairOptions { weld_tolerance: 1e-4 }).unwrap();
    let topology = Topology::new(loose.mesh.mesh());
    assert_eq!((topology.used_vertices, topology.triangles), (26, 48));
    assert!(matches!(loose.notices[..], [RepairNotice::Welded { vertices: 118, .. }]), "{:?}", loose.notices);
    assert!(repair(&soup.mesh(), &RepairOptions { weld_tolerance: 1e-9 }).is_err());
    // What is closed is not touched, however coarse the tolerance.
    let coarse = repair(&cube(20).mesh(), &RepairOptions { weld_tolerance: 0.1 }).unwrap();
    assert_eq!((coarse.notices.len(), coarse.mesh.mesh()), (0, &cube(20).mesh()));
    for wrong in [-1.0, 0.2, f64::NAN, 1e-30, f64::INFINITY] {
        let error = repair(&soup.mesh(), &RepairOptions { weld_tolerance: wrong }).unwrap_err();
        assert!(matches!(error, RepairError::Tolerance { .. }), "{wrong}");
    }
}

#[test]
fn inward_surfaces_are_turned_as_a_whole() {
    let repaired = mend(&torus(16).inward()).unwrap();
    assert_eq!(repaired.notices, [RepairNotice::TurnedOutward { shells: 1, triangles: 512 }]);
    assert!(close(volume(&repaired), Topology::new(&torus(16).mesh()).volume));
}

#[test]
fn triangles_wound_against_their_neighbours_are_turned() {
    let mut soup = cube(3);
    for t in [0, 5, 6, 50] {
        soup.triangles[t].swap(0, 2);
    }
    let repaired = mend(&soup).unwrap();
    assert_eq!(repaired.notices, [RepairNotice::Rewound { triangles: 4, patches: 1 }]);
    assert!(close(volume(&repaired), 1.0));
}

#[test]
fn a_cavity_is_kept_and_a_part_is_kept() {
    let inner = || cube(2).scaled(0.5).moved(Vec3::splat(0.25));
    let hollow = mend(&cube(3).with(&inner().inward())).unwrap();
    assert_eq!(hollow.notices, [RepairNotice::Cavities { shells: 1 }]);
    assert!(close(volume(&hollow), 1.0 - 0.125));
    let part = mend(&cube(3).with(&inner())).unwrap();
    assert_eq!(part.notices, []);
    // Turned inside out, with its cavity: both come back.
    let inside_out = mend(&cube(3).inward().with(&inner())).unwrap();
    let turned = RepairNotice::TurnedOutward { shells: 2, triangles: 108 + 48 };
    assert_eq!(inside_out.notices, [turned, RepairNotice::Cavities { shells: 1 }]);
    assert!(close(volume(&inside_out), 1.0 - 0.125));
}

#[test]
fn shells_beside_one_another_are_turned_one_by_one() {
    let soup = cube(2).with(&cube(2).inward().moved(Vec3::X * 3.0)).with(&cube(2).moved(Vec3::Y * 3.0));
    let repaired = mend(&soup).unwrap();
    assert_eq!(repaired.notices, [RepairNotice::TurnedOutward { shells: 1, triangles: 48 }]);
    assert!(close(volume(&repaired), 3.0));
}

#[test]
fn shells_that_overlap_are_not_taken_for_cavities() {
    let soup = cube(2).with(&cube(2).inward().moved(Vec3::splat(0.4)));
    assert!(close(volume(&mend(&soup).unwrap()), 2.0));
}

#[test]
fn many_shells_take_little_time() {
    let mut soup = Soup::default();
    for i in 0..20_000 {
        let at = Vec3::new((i % 30) as f32, (i / 30 % 30) as f32, (i / 900) as f32) * 2.0;
        let one = cube(1).moved(at);
        soup = Soup { ..soup }.with(&if i % 2 == 0 { one } else { one.inward() });
    }
    let repaired = repair(&soup.mesh(), &RepairOptions::default()).unwrap();
    assert_eq!(repaired.notices, [RepairNotice::TurnedOutward { shells: 10_000, triangles: 120_000 }]);
    // In one another, all of them.
    let mut soup = Soup::default();
    for i in 0..5_000 {
        soup = soup.with(&cube(1).inward().moved(Vec3::splat(-0.5)).scaled(1.0 + i as f32));
    }
    let repaired = repair(&soup.mesh(), &RepairOptions::default()).unwrap();
    assert_eq!(repaired.notices, [RepairNotice::TurnedOutward { shells: 5_000, triangles: 60_000 }]);
}

#[test]
fn holes_are_capped_in_their_plane() {
    // A box without its top: the cap is the top.
    let mut soup = cube(6);
    soup.triangles.retain(|t| t.iter().any(|v| soup.vertices[*v as usize].z < 1.0));
    let repaired = mend(&soup).unwrap();
    let capped = RepairNotice::Capped { loops: 1, edges: 24, longest: 24, triangles: 22, fans: 0 };
    assert_eq!(repaired.notices, [capped]);
    assert!(close(volume(&repaired), 1.0));
    assert!((Topology::new(repaired.mesh.mesh()).area - 6.0).abs() < 1e-5);
    assert_eq!(capped.to_string(), "1 hole of 24 edges capped with 22 triangles");
    // A tube: two caps.
    let tube = mend(&strip(20, false)).unwrap();
    assert!(matches!(tube.notices[..], [RepairNotice::Capped { loops: 2, edges: 40, fans: 0, .. }]));
}

#[test]
fn an_l_shaped_hole_is_capped_without_a_fan() {
    let mut soup = cube(4);
    soup.triangles.retain(|t| {
        let middle = t.iter().map(|v| soup.vertices[*v as usize]).sum::<Vec3>() / 3.0;
        middle.z < 0.999 || (middle.x > 0.5 && middle.y > 0.5)
    });
    let repaired = mend(&soup).unwrap();
    assert!(matches!(repaired.notices[..], [RepairNotice::Capped { loops: 1, fans: 0, .. }]));
    assert!(close(volume(&repaired), 1.0));
    assert!((Topology::new(repaired.mesh.mesh()).area - 6.0).abs() < 1e-5);
}

#[test]
fn holes_that_meet_in_a_vertex_are_two() {
    let mut soup = cube(4);
    // Two squares of the top with one corner in common.
    soup.triangles.retain(|t| {
        let middle = t.iter().map(|v| soup.vertices[*v as usize]).sum::<Vec3>() / 3.0;
        let hole = |low: f32| [middle.x, middle.y].into_iter().all(|c| (low..low + 0.25).contains(&c));
        middle.z < 0.999 || !(hole(0.25) || hole(0.5))
    });
    let repaired = mend(&soup).unwrap();
    let capped = RepairNotice::Capped { loops: 2, edges: 8, longest: 4, triangles: 4, fans: 0 };
    assert_eq!(repaired.notices, [capped]);
    assert!(close(volume(&repaired), 1.0));
}

#[test]
fn duplicates_and_degenerates_are_dropped() {
    let mut soup = cube(2);
    soup.triangles.extend([[0, 0, 1], [3, 3, 3]]);
    let [a, b, c] = soup.triangles[9];
    soup.triangles.extend([[b, c, a], [a, b, c], [b, a, c]]);
    let repaired = mend(&soup).unwrap();
    let expected =
        [RepairNotice::DegenerateDropped { triangles: 2 }, RepairNotice::DuplicatesDropped { triangles: 3 }];
    assert_eq!(repaired.notices, expected);
    assert_eq!(repaired.mesh.mesh(), &cube(2).mesh());
}

#[test]
fn fins_without_area_are_dropped_and_seams_without_area_are_kept() {
    let mut soup = cube(1);
    soup.vertices.push((soup.vertices[0] + soup.vertices[1]) / 2.0);
    let middle = soup.vertices.len() as u32 - 1;
    soup.triangles.push([0, 1, middle]);
    let repaired = mend(&soup).unwrap();
    assert_eq!(repaired.notices, [RepairNotice::DegenerateDropped { triangles: 1 }]);
    // The middle of an edge on one side of it only: what holds the two sides together has no area.
    let mut soup = cube(1);
    let at = soup.triangles.iter().position(|t| t.contains(&0) && t.contains(&1)).unwrap();
    let [a, b, c] = soup.triangles.remove(at);
    let (from, to, third) = match [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|t| t[0] < 2 && t[1] < 2)
    {
        Some([from, to, third]) => (from, to, third),
        None => panic!("two corners are 0 and 1"),
    };
    soup.vertices.push((soup.vertices[0] + soup.vertices[1]) / 2.0);
    soup.triangles.extend([[from, middle, third], [middle, to, third], [from, to, middle]]);
    assert_eq!(mend(&soup).unwrap().notices, []);
}

#[test]
fn a_wall_between_touching_solids_goes() {
    // Mirrored, so that the diagonals of the wall match.
    let mut other = cube(2).inward();
    other.vertices.iter_mut().for_each(|v| v.x = 2.0 - v.x);
    let soup = cube(2).with(&other);
    let repaired = mend(&soup).unwrap();
    let expected = [
        RepairNotice::Welded { vertices: 9, within: 0.0 },
        RepairNotice::DuplicatesDropped { triangles: 8 },
        RepairNotice::WallsDropped { triangles: 8 },
    ];
    assert_eq!(repaired.notices, expected);
    assert!(close(volume(&repaired), 2.0));
}

#[test]
fn what_is_closed_is_not_opened_by_dropping_duplicates() {
    // A cube that is there twice is one.
    let soup = cube(2).with(&cube(2)).with(&cube(1).moved(Vec3::X * 3.0));
    let repaired = mend(&soup).unwrap();
    assert!(close(volume(&repaired), 2.0), "{:?}", repaired.notices);
    // Two pairs of opposite triangles on one edge: with one of each the mesh would be open.
    let mut soup = cube(1);
    soup.vertices.extend([Vec3::splat(3.0), Vec3::splat(-3.0)]);
    soup.triangles.extend([[0, 1, 8], [1, 0, 8], [0, 1, 9], [9, 1, 0]]);
    let repaired = mend(&soup).unwrap();
    assert_eq!(repaired.notices, [RepairNotice::WallsDropped { triangles: 4 }]);
    assert_eq!(repaired.mesh.mesh(), &cube(1).mesh());
}

#[test]
fn faces_drawn_from_both_sides_are_one_surface() {
    let repaired = mend(&cube(2).with(&cube(2).inward())).unwrap();
    assert_eq!(repaired.notices[1], RepairNotice::DuplicatesDropped { triangles: 48 });
    assert!(close(volume(&repaired), 1.0));
}

#[test]
fn solids_that_touch_along_an_edge_stay_two() {
    let soup = cube(1).with(&cube(1).moved(Vec3::new(1.0, 1.0, 0.0)).inward());
    let repaired = mend(&soup).unwrap();
    let expected =
        [RepairNotice::Welded { vertices: 2, within: 0.0 }, RepairNotice::NonManifoldKept { edges: 1 }];
    assert_eq!(repaired.notices[..2], expected);
    assert!(close(volume(&repaired), 2.0), "{:?}", repaired.notices);
}

#[test]
fn what_cannot_be_closed_is_refused_with_counts() {
    // An inner sheet: a box in two rooms.
    let mut rooms = cube(1).with(&cube(1).moved(Vec3::X));
    rooms.triangles.retain(|t| {
        let corners = t.map(|v| rooms.vertices[v as usize]);
        t[0] < 8 || corners.iter().any(|c| c.x > 1.0)
    });
    let error = mend(&rooms).unwrap_err();
    assert_eq!(error, RepairError::NonManifold { odd: 4, even: 0, boundary: 0 });
    assert!(error.to_string().contains("4 edges have an odd number of triangles"), "{error}");
    assert_eq!(mend(&strip(12, true)).unwrap_err(), RepairError::OneSided { patches: 1, triangles: 24 });
    assert_eq!(mend(&Soup::default()).unwrap_err(), RepairError::Empty);
    let sheet = Soup {
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.5), Vec3::new(0.0, 1.0, 0.5)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    assert!(matches!(mend(&sheet).unwrap_err(), RepairError::Flat { .. }));
}

#[test]
fn stray_triangles_go() {
    let stray =
        Soup { vertices: vec![Vec3::X * 5.0, Vec3::Y * 5.0, Vec3::Z * 5.0], triangles: vec![[0, 1, 2]] };
    let repaired = mend(&cube(2).with(&stray)).unwrap();
    let dropped = RepairNotice::EmptyShellsDropped { shells: 1, triangles: 2 };
    assert_eq!(repaired.notices[1], dropped);
    assert_eq!(repaired.mesh.mesh(), &cube(2).mesh());
}

#[test]
fn a_million_degenerate_triangles_are_an_error_in_no_time() {
    let vertices: Vec<Vec3> = (0..1000).map(|i| Vec3::X * i as f32).collect();
    let at = |i: u32, step: u32| i.wrapping_mul(step) % 1000;
    for triangles in [
        (0..1_000_000).map(|_| [5, 5, 5]).collect::<Vec<_>>(),
        (0..1_000_000).map(|i| [at(i, 1), at(i, 7), at(i, 1)]).collect(),
        // On one line, with corners that differ, most of them on one edge.
        (0..1_000_000).map(|i| [at(i, 1), at(i, 7919), at(i / 1000, 1)]).collect(),
        (0..1_000_000).map(|i| [0, 1, at(i, 1)]).collect(),
    ] {
        let mesh = TriangleMesh::new(vertices.clone(), triangles).unwrap();
        assert!(repair(&mesh, &RepairOptions::default()).is_err());
    }
}

#[test]
fn a_hole_of_a_hundred_thousand_edges_is_capped() {
    // A cone without its base, its rim jagged.
    let n = 100_000;
    let mut soup = Soup { vertices: vec![Vec3::Z], triangles: vec![] };
    for i in 0..n {
        let (s, c) = (i as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
        let r = if i % 2 == 0 { 1.0 } else { 0.9 };
        soup.vertices.push(Vec3::new(r * c, r * s, 0.0));
        soup.triangles.push([0, i + 1, (i + 1) % n + 1]);
    }
    let repaired = repair(&soup.mesh(), &RepairOptions::default()).unwrap();
    assert!(matches!(repaired.notices[..], [RepairNotice::Capped { loops: 1, longest: 100_000, .. }]));
    // A third of the base times the height; the base's corners lie between the radii.
    let v = volume(&repaired);
    assert!((0.84..1.05).contains(&v), "{v}");
}

/// What is done to a mesh.
#[derive(Clone, Debug)]
struct Damage {
    inward: bool,
    unweld: bool,
    flipped: Vec<prop::sample::Index>,
    doubled: Vec<prop::sample::Index>,
    removed: Vec<prop::sample::Index>,
}

fn damage(holes: usize) -> impl Strategy<Value = Damage> {
    let some = |n| prop::collection::vec(any::<prop::sample::Index>(), 0..=n);
    (any::<bool>(), any::<bool>(), some(60), some(20), some(holes)).prop_map(
        |(inward, unweld, flipped, doubled, removed)| Damage { inward, unweld, flipped, doubled, removed },
    )
}

/// The damaged mesh, and the area that is missing.
fn damaged(whole: &Soup, damage: &Damage) -> (Soup, f64) {
    let mut soup = whole.clone();
    let mut gone = Soup { vertices: soup.vertices.clone(), triangles: vec![] };
    for at in &damage.removed {
        gone.triangles.push(soup.triangles.swap_remove(at.index(soup.triangles.len())));
    }
    for at in &damage.doubled {
        let t = at.index(soup.triangles.len());
        soup.triangles.push(soup.triangles[t]);
    }
    for at in &damage.flipped {
        let t = at.index(soup.triangles.len());
        // Not its copy: two that differ are no duplicate but two sides.
        let same = soup.triangles[t];
        soup.triangles.iter_mut().filter(|t| **t == same).for_each(|t| t.swap(0, 1));
    }
    if damage.inward {
        soup = soup.inward();
    }
    if damage.unweld {
        soup = soup.unwelded();
    }
    (soup, Topology::new(&gone.mesh()).area)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Without holes everything is undone: the same triangles, the same volume.
    #[test]
    fn damage_without_holes_is_undone(bumps in prop::array::uniform4(-0.2f32..0.2), damage in damage(0)) {
        let whole = star(6, |d| 1.0 + bumps[0] * d.x + bumps[1] * d.y * d.z + bumps[2] * (5.0 * d.z).sin() + bumps[3] * d.x * d.x);
        let (soup, _) = damaged(&whole, &damage);
        let repaired = mend(&soup).unwrap();
        let (before, after) = (Topology::new(&whole.mesh()), Topology::new(repaired.mesh.mesh()));
        prop_assert_eq!((before.triangles, before.used_vertices, before.euler), (after.triangles, after.used_vertices, after.euler));
        prop_assert!(close(after.volume, before.volume));
    }

    /// With holes the volume changes by less than what lies between caps and what was there: the missing area, counted
    /// for the caps as well, times the width of the holes.
    #[test]
    fn damage_with_holes_comes_back_closed(bumps in prop::array::uniform4(-0.2f32..0.2), damage in damage(8)) {
        let whole = star(8, |d| 1.0 + bumps[0] * d.x + bumps[1] * d.y * d.z + bumps[2] * (5.0 * d.z).sin() + bumps[3] * d.x * d.x);
        let (soup, missing) = damaged(&whole, &damage);
        let repaired = mend(&soup).unwrap();
        let before = Topology::new(&whole.mesh());
        let longest = whole.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| whole.vertices[v as usize]);
            a.distance(b).max(b.distance(c)).max(c.distance(a))
        }).fold(0.0, f32::max);
        let width = f64::from(longest) * damage.removed.len() as f64;
        let off = (volume(&repaired) - before.volume).abs();
        prop_assert!(off <= 2.0 * missing * width + 1e-5, "{off} with {missing} missing");
    }

    /// Whatever the triangles: no panic, and what is not refused is closed.
    #[test]
    fn any_triangles_are_closed_or_refused(
        points in prop::collection::vec(prop::array::uniform3(0u8..4), 1..30),
        corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..60),
        tolerance in prop_oneof![Just(0.0), 1e-9..0.1],
    ) {
        let vertices: Vec<Vec3> = points.iter().map(|p| Vec3::from_array(p.map(f32::from))).collect();
        let triangles = corners.iter().map(|t| t.map(|i| i.index(vertices.len()) as u32)).collect();
        let mesh = TriangleMesh::new(vertices, triangles).unwrap();
        match repair(&mesh, &RepairOptions { weld_tolerance: tolerance }) {
            Ok(repaired) => {
                let topology = Topology::new(repaired.mesh.mesh());
                prop_assert!(topology.is_closed());
            }
            Err(error) => prop_assert!(!error.to_string().contains('\n')),
        }
    }
}
