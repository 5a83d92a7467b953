//! Tessellation of patches: how far off, and whether anything is open that should not be.

mod patch_support;

use std::collections::{BTreeSet, HashMap};

use cutaway_core::glam::{DVec3, Vec3};
use cutaway_mesh::patches::{Basis, BezierPatch, PatchSet, Tessellated, Tessellation, TessellationError};
use patch_support::{assert_no_cracks, distance, euler, revolution, sphere, volume};
use proptest::prelude::*;

/// One of the eight ways to write down the same 16 points of a patch.
fn turned(indices: [u32; 16], way: u8) -> [u32; 16] {
    std::array::from_fn(|k| {
        let (mut i, mut j) = (k / 4, k % 4);
        if way & 1 != 0 {
            i = 3 - i;
        }
        if way & 2 != 0 {
            j = 3 - j;
        }
        if way & 4 != 0 {
            (i, j) = (j, i);
        }
        indices[4 * i + j]
    })
}

/// The surface of the 4 x 4 x 4 grid of a cube, each point moved: six Bezier patches that are closed.
fn pillow(moves: &[DVec3], ways: [u8; 6]) -> PatchSet {
    let mut points = Vec::new();
    let mut numbers = HashMap::new();
    let mut patches = Vec::new();
    for (face, way) in ways.into_iter().enumerate() {
        let (axis, end) = (face / 2, 3 * (face % 2));
        let indices = std::array::from_fn(|k| {
            let mut at = [0; 3];
            at[axis] = end;
            at[(axis + 1) % 3] = k / 4;
            at[(axis + 2) % 3] = k % 4;
            *numbers.entry(at).or_insert_with(|| {
                let place = DVec3::from_array(at.map(|x| x as f64 / 1.5 - 1.0));
                points.push(place + moves[points.len() % moves.len()]);
                points.len() as u32 - 1
            })
        });
        patches.push(turned(indices, way));
    }
    PatchSet::bicubic(Basis::Bezier, &points, &patches).unwrap()
}

/// A closed B-spline torus of `n` x `n` patches.
fn torus(n: u32, basis: Basis) -> PatchSet {
    let angle = |k: u32| f64::from(k) * std::f64::consts::TAU / f64::from(n);
    let point = |i: u32, j: u32| {
        let r = 3.0 + angle(j).cos();
        DVec3::new(r * angle(i).cos(), r * angle(i).sin(), angle(j).sin())
    };
    let points: Vec<_> = (0..n * n).map(|k| point(k / n, k % n)).collect();
    let patch =
        |i: u32, j: u32| std::array::from_fn(|k| ((i + k as u32 / 4) % n) * n + (j + k as u32 % 4) % n);
    let patches: Vec<_> = (0..n * n).map(|k| patch(k / n, k % n)).collect();
    PatchSet::bicubic(basis, &points, &patches).unwrap()
}

/// Samples of the surface against the mesh, and of the mesh's triangles against the surface's samples' bound.
fn worst(set: &PatchSet, made: &Tessellated, samples: usize) -> f64 {
    let at = |k: usize| k as f64 / samples as f64;
    let mut worst = 0.0_f64;
    for patch in set.patches() {
        for k in 0..=samples {
            for l in 0..=samples {
                worst = worst.max(distance(&made.mesh, patch.at(at(k), at(l)).position));
            }
        }
    }
    worst
}

fn assert_closed(made: &Tessellated, characteristic: i64) {
    assert_no_cracks(&made.mesh, 0);
    assert_eq!((made.boundary_loops.len(), made.non_manifold_edges, made.one_sided_edges), (0, 0, 0));
    assert_eq!(euler(&made.mesh), characteristic);
    assert!(volume(&made.mesh) > 0.0);
    assert_eq!(made.normals.len(), made.mesh.vertices().len());
}

fn moved(most: f64) -> impl Strategy<Value = Vec<DVec3>> {
    let x = || -most..most;
    proptest::collection::vec((x(), x(), x()).prop_map(|(x, y, z)| DVec3::new(x, y, z)), 56)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn closed_patches_make_closed_meshes_within_the_tolerance(
        moves in moved(0.25), ways in proptest::array::uniform6(0_u8..8), exponent in -2.5..0.5_f64,
    ) {
        let set = pillow(&moves, ways);
        let tolerance = 10_f64.powf(exponent);
        let made = set.tessellate(&Tessellation::within(tolerance)).unwrap();
        assert_closed(&made, 2);
        prop_assert!(made.error_bound <= tolerance);
        prop_assert!(worst(&set, &made, 6) <= tolerance);
    }

    #[test]
    fn uniform_meshes_are_closed_and_keep_their_bound(
        moves in moved(0.25), ways in proptest::array::uniform6(0_u8..8), segments in 1_u32..9,
    ) {
        let set = pillow(&moves, ways);
        let made = set.tessellate(&Tessellation::uniform(segments)).unwrap();
        assert_closed(&made, 2);
        prop_assert!(worst(&set, &made, 6) <= made.error_bound);
        prop_assert_eq!(made.mesh.triangles().len() as u32, if segments > 1 { 12 * segments * segments } else { made.mesh.triangles().len() as u32 });
    }

    /// An edge knows nothing of the patches beside it: alone or with its neighbours, whichever way it is walked, a patch
    /// has the same vertices on it.
    #[test]
    fn edges_are_cut_by_their_own_curve_alone(
        moves in moved(0.25), ways in proptest::array::uniform6(0_u8..8), face in 0_usize..6,
    ) {
        let set = pillow(&moves, ways);
        let settings = Tessellation::within(0.003);
        let whole = set.tessellate(&settings).unwrap();
        let alone = PatchSet::new(vec![set.patches()[face].clone()]).unwrap().tessellate(&settings).unwrap();
        let bits = |v: &Vec3| v.to_array().map(f32::to_bits);
        let known: BTreeSet<_> = whole.mesh.vertices().iter().map(bits).collect();
        prop_assert_eq!(alone.boundary_loops.len(), 1);
        for &v in &alone.boundary_loops[0] {
            prop_assert!(known.contains(&bits(&alone.mesh.vertices()[v as usize])));
        }
        // The boundary of the patch alone is made of lines of the whole.
        let place = |mesh: &cutaway_mesh::TriangleMesh, v: u32| bits(&mesh.vertices()[v as usize]);
        let lines: BTreeSet<_> = patch_support::edge_uses(&whole.mesh).into_keys()
            .flat_map(|(a, b)| [(a, b), (b, a)]).map(|(a, b)| (place(&whole.mesh, a), place(&whole.mesh, b))).collect();
        let chain = &alone.boundary_loops[0];
        for k in 0..chain.len() {
            let line = (place(&alone.mesh, chain[k]), place(&alone.mesh, chain[(k + 1) % chain.len()]));
            prop_assert!(lines.contains(&line));
        }
    }

    /// Straight edges, twisted inside: the edges stay one line each, however fine the inside must be.
    #[test]
    fn twisted_patches_with_straight_edges_are_met_by_insets(
        heights in proptest::array::uniform4(-1.0..1.0_f64), exponent in -3.0..-1.0_f64,
    ) {
        let corner = |k: usize| DVec3::new((k / 2) as f64, (k % 2) as f64, heights[k]);
        let patch = BezierPatch::new([1, 1], &[corner(0), corner(1), corner(2), corner(3)], None).unwrap();
        let set = PatchSet::new(vec![patch]).unwrap();
        let tolerance = 10_f64.powf(exponent);
        let made = set.tessellate(&Tessellation::within(tolerance)).unwrap();
        prop_assert_eq!(made.boundary_loops.len(), 1);
        prop_assert_eq!(made.boundary_loops[0].len(), 4);
        assert_no_cracks(&made.mesh, 4);
        prop_assert!(made.error_bound <= tolerance);
        prop_assert!(worst(&set, &made, 20) <= tolerance);
    }

    /// Curved inside, straight or curved at the edges, with weights.
    #[test]
    fn rational_sheets_keep_their_tolerance(
        points in proptest::collection::vec((-0.3..0.3_f64, 0.4..2.5_f64), 49), exponent in -2.5..-1.0_f64,
    ) {
        let knots = [0.0, 0.0, 0.0, 0.0, 0.3, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0];
        let positions: Vec<_> = points.iter().enumerate()
            .map(|(k, p)| DVec3::new((k / 7) as f64 / 3.0, (k % 7) as f64 / 3.0, 3.0 * p.0)).collect();
        let weights: Vec<_> = points.iter().map(|p| p.1).collect();
        let surface = cutaway_mesh::patches::NurbsSurface::new(&cutaway_mesh::patches::Nurbs {
            degree: [3, 3], rows: 7, columns: 7, points: &positions, weights: Some(&weights), knots_u: &knots, knots_v: &knots,
        }).unwrap();
        let set = surface.into_patches().unwrap();
        let tolerance = 10_f64.powf(exponent);
        let made = set.tessellate(&Tessellation::within(tolerance)).unwrap();
        prop_assert_eq!((made.boundary_loops.len(), made.non_manifold_edges), (1, 0));
        assert_no_cracks(&made.mesh, made.boundary_loops[0].len());
        prop_assert_eq!(euler(&made.mesh), 1);
        prop_assert!(made.error_bound <= tolerance);
        prop_assert!(worst(&set, &made, 4) <= tolerance);
    }
}

#[test]
fn the_sphere_is_closed_and_converges_at_second_order() {
    let set = sphere().into_patches().unwrap();
    let exact = 4.0 / 3.0 * std::f64::consts::PI;
    let mut last: Option<f64> = None;
    for tolerance in [0.1, 0.01, 0.001, 0.0001] {
        let made = set.tessellate(&Tessellation::within(tolerance)).unwrap();
        assert_closed(&made, 2);
        for (vertex, normal) in made.mesh.vertices().iter().zip(&made.normals) {
            assert!((vertex.length() - 1.0).abs() < 1e-6);
            assert!(vertex.distance(*normal) < 1e-5, "{vertex} {normal}");
        }
        // Every triangle is within the tolerance of the sphere: its middle lies no deeper than that.
        for t in 0..made.mesh.triangles().len() {
            let [a, b, c] = made.mesh.corners(t);
            assert!(f64::from(((a + b + c) / 3.0).length()) >= 1.0 - tolerance);
        }
        let missing = exact - volume(&made.mesh);
        // The volume is missing a layer of at most the tolerance.
        assert!(missing > 0.0 && missing < 4.0 * std::f64::consts::PI * tolerance);
        if let Some(last) = last {
            assert!(missing < 0.25 * last);
        }
        last = Some(missing);
    }
}

#[test]
fn splines_round_a_torus_are_closed() {
    for basis in [Basis::BSpline, Basis::CatmullRom] {
        for tolerance in [1.0, 0.1, 0.01, 0.001] {
            let made = torus(6, basis).tessellate(&Tessellation::within(tolerance)).unwrap();
            assert_closed(&made, 0);
            assert_eq!(made.notices(), torus_notices(made.turned_patches));
        }
        let made = torus(6, basis).tessellate(&Tessellation::uniform(4)).unwrap();
        assert_closed(&made, 0);
        assert_eq!(made.mesh.triangles().len(), 36 * 32);
    }
}

/// All patches are written down alike: either all face outwards or none does.
fn torus_notices(turned: usize) -> Vec<String> {
    assert!(turned == 0 || turned == 36);
    if turned == 0 {
        Vec::new()
    } else {
        vec!["36 of 36 patches faced inwards or unlike their neighbours and were turned".to_owned()]
    }
}

#[test]
fn surfaces_of_several_kinds_join_where_their_curves_are_the_same() {
    // A cylinder with flat lids: each lid a disc whose pole is a point, its rim the circle of the cylinder.
    let knots = [0.0, 0.0, 1.0, 1.0];
    let ring = |r0: f64, z0: f64, r1: f64, z1: f64| {
        let profile = [(r0, z0, 1.0), ((r0 + r1) / 2.0, (z0 + z1) / 2.0, 1.0), (r1, z1, 1.0)];
        revolution(&profile, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]).into_patches().unwrap()
    };
    assert_eq!(knots.len(), 4);
    let sets = [ring(0.0, 0.0, 1.0, 0.0), ring(1.0, 2.0, 1.0, 0.0), ring(0.0, 2.0, 1.0, 2.0)];
    let set = PatchSet::joined(sets).unwrap();
    let made = set.tessellate(&Tessellation::within(1e-3)).unwrap();
    assert_closed(&made, 2);
    assert!((volume(&made.mesh) - std::f64::consts::TAU).abs() < 2e-2);
    // The lid does not face as the mantle does: something had to be turned, and is said.
    assert!(made.turned_patches > 0 && made.notices().len() == 1);
    // The pole of a flat lid looks along the axis.
    let pole = made.mesh.vertices().iter().position(|v| *v == Vec3::new(0.0, 0.0, 2.0)).unwrap();
    assert!(made.normals[pole].distance(Vec3::Z) < 1e-6);
}

#[test]
fn adaptive_takes_fewer_triangles_than_uniform_for_the_same_error() {
    // A sheet that is flat but for one corner.
    let points: Vec<_> = (0..49)
        .map(|k| DVec3::new((k / 7) as f64, (k % 7) as f64, if k % 7 < 3 && k < 21 { 1.0 } else { 0.0 }))
        .collect();
    let set = PatchSet::grid(Basis::Bezier, &points, 7, 7).unwrap();
    let adaptive = set.tessellate(&Tessellation::within(0.01)).unwrap();
    let uniform = (1..).map(|n| set.tessellate(&Tessellation::uniform(n)).unwrap());
    let uniform = uniform.take(100).find(|made| made.error_bound <= 0.01).unwrap();
    let [a, u] = [&adaptive, &uniform].map(|made| made.mesh.triangles().len());
    assert!(2 * a < u, "{a} {u}");
}

#[test]
fn a_one_sided_band_is_told() {
    // A Moebius band of eight Bezier pieces.
    let n = 8_u32;
    let point = |k: u32, j: u32| {
        let (a, s) = (f64::from(k) * std::f64::consts::TAU / f64::from(3 * n), f64::from(j) / 3.0 - 0.5);
        let r = 2.0 + s * (a / 2.0).cos();
        DVec3::new(r * a.cos(), r * a.sin(), s * (a / 2.0).sin())
    };
    let points: Vec<_> = (0..12 * n).map(|k| point(k / 4, k % 4)).collect();
    let index = |k: u32, j: u32| if k < 3 * n { 4 * k + j } else { 3 - j };
    let patches: Vec<_> =
        (0..n).map(|i| std::array::from_fn(|k| index(3 * i + k as u32 / 4, k as u32 % 4))).collect();
    let made = PatchSet::bicubic(Basis::Bezier, &points, &patches).unwrap();
    let made = made.tessellate(&Tessellation::within(0.05)).unwrap();
    assert_eq!((made.one_sided_edges, made.non_manifold_edges), (1, 0));
    assert!(made.notices().iter().any(|notice| notice.contains("only one side")));
}

#[test]
fn what_cannot_be_is_refused_before_memory_is_taken() {
    let set = torus(6, Basis::BSpline);
    let refused = |settings: &Tessellation| set.tessellate(settings).unwrap_err();
    assert!(matches!(refused(&Tessellation::within(0.0)), TessellationError::Tolerance { .. }));
    assert!(matches!(refused(&Tessellation::within(f64::NAN)), TessellationError::Tolerance { .. }));
    assert!(matches!(refused(&Tessellation::within(1e-7)), TessellationError::TooFine { .. }));
    assert!(matches!(refused(&Tessellation::uniform(0)), TessellationError::Segments { .. }));
    assert!(matches!(refused(&Tessellation::uniform(u32::MAX)), TessellationError::Segments { .. }));
    let error = refused(&Tessellation::uniform(10_000));
    assert_eq!(
        error.to_string(),
        "this would need about 7200000000 triangles, more than the limit of 16777216; take fewer segments or raise the limit"
    );
    let tight = Tessellation { max_triangles: 100, ..Tessellation::within(1e-3) };
    let TessellationError::TooMany { about, limit: 100, .. } = refused(&tight) else { panic!() };
    let whole = set.tessellate(&Tessellation::within(1e-3)).unwrap().mesh.triangles().len() as f64;
    assert!((0.4..2.5).contains(&(about as f64 / whole)), "{about} {whole}");
    // Near the limit the estimate is not trusted; the count itself stops.
    let near = Tessellation { max_triangles: (whole * 0.9) as u64, ..Tessellation::within(1e-3) };
    assert!(matches!(refused(&near), TessellationError::TooMany { .. }));
    let enough = Tessellation { max_triangles: whole as u64, ..Tessellation::within(1e-3) };
    assert!(set.tessellate(&enough).is_ok());
}

#[test]
fn points_and_lines_have_no_area() {
    let line = (0..16).map(|k| DVec3::X * f64::from(k % 4)).collect();
    for points in [vec![DVec3::ZERO; 16], vec![DVec3::ONE; 16], line] {
        let set = PatchSet::grid(Basis::Bezier, &points, 4, 4).unwrap();
        assert_eq!(set.tessellate(&Tessellation::within(0.1)), Err(TessellationError::NoArea));
        assert_eq!(set.tessellate(&Tessellation::uniform(3)), Err(TessellationError::NoArea));
    }
}

#[test]
fn extreme_sizes_are_met() {
    for scale in [1e-38, 1e-12, 1e12, 1e29] {
        let points: Vec<_> = (0..16)
            .map(|k| scale * DVec3::new((k / 4) as f64, (k % 4) as f64, f64::from(u8::from(k == 5))))
            .collect();
        let set = PatchSet::grid(Basis::Bezier, &points, 4, 4).unwrap();
        let made = set.tessellate(&Tessellation::within(1e-3 * scale)).unwrap();
        assert!(made.error_bound <= 1e-3 * scale && made.mesh.triangles().len() > 10);
    }
}

/// Where an edge without inner vertices meets one with many, the strips of an inset are cut where the latter is.
#[test]
fn corners_between_straight_and_curved_edges_keep_the_tolerance() {
    let height = |k: usize| match (k / 4, k % 4) {
        (3, 1 | 2) => 1.0,
        (1 | 2, j @ (1 | 2)) => {
            if j == 1 {
                3.0
            } else {
                -3.0
            }
        }
        _ => 0.0,
    };
    let points: Vec<_> = (0..16).map(|k| DVec3::new((k / 4) as f64, (k % 4) as f64, height(k))).collect();
    let set = PatchSet::grid(Basis::Bezier, &points, 4, 4).unwrap();
    for tolerance in [0.5, 0.1, 0.02, 0.004] {
        let made = set.tessellate(&Tessellation::within(tolerance)).unwrap();
        assert!(made.error_bound <= tolerance && worst(&set, &made, 15) <= tolerance);
        assert_no_cracks(&made.mesh, made.boundary_loops[0].len());
    }
}
