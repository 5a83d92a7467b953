//! Bases, evaluation, conversion, normals and curvatures of patches, by property.

mod patch_support;

use cutaway_core::glam::DVec3;
use cutaway_mesh::patches::{
    Basis, BezierPatch, BicubicPatch, MAX_CONTROL_POINTS, Nurbs, NurbsSurface, PatchError, PatchSet,
    SurfacePoint,
};
use patch_support::{W, revolution, sphere};
use proptest::array::uniform16;
use proptest::prelude::*;

const BASES: [Basis; 4] = [Basis::Bezier, Basis::BSpline, Basis::CatmullRom, Basis::Hermite];

fn point() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

fn basis() -> impl Strategy<Value = Basis> {
    proptest::sample::select(&BASES[..])
}

/// A rational patch of some degree.
fn rational() -> impl Strategy<Value = BezierPatch> {
    (1_usize..=5, 1_usize..=5).prop_flat_map(|(p, q)| {
        let count = (p + 1) * (q + 1);
        let points = proptest::collection::vec(point(), count);
        let weights = proptest::collection::vec(0.3..3.0, count);
        (points, weights).prop_map(move |(points, w)| BezierPatch::new([p, q], &points, Some(&w)).unwrap())
    })
}

fn curve(basis: Basis, points: &[DVec3], t: f64, derivative: usize) -> DVec3 {
    let weights = match derivative {
        0 => basis.weights(t),
        1 => basis.first_derivatives(t),
        _ => basis.second_derivatives(t),
    };
    points.iter().zip(weights).map(|(p, w)| *p * w).sum()
}

fn assert_near(a: DVec3, b: DVec3, tolerance: f64) {
    assert!(a.distance(b) <= tolerance, "{a} and {b} are {} apart", a.distance(b));
}

/// Derivatives against central differences of an evaluator.
fn assert_derivatives(at: &dyn Fn(f64, f64) -> SurfacePoint, u: f64, v: f64, size: f64) {
    const H: f64 = 1e-5;
    let p = at(u, v);
    let by_u = |f: &dyn Fn(SurfacePoint) -> DVec3| (f(at(u + H, v)) - f(at(u - H, v))) / (2.0 * H);
    let by_v = |f: &dyn Fn(SurfacePoint) -> DVec3| (f(at(u, v + H)) - f(at(u, v - H))) / (2.0 * H);
    // Differences are good to H² times a third derivative; those of the rational test patches stay below 1e4.
    let tolerance = 1e-5 * size;
    assert_near(by_u(&|q| q.position), p.du, tolerance);
    assert_near(by_v(&|q| q.position), p.dv, tolerance);
    assert_near(by_u(&|q| q.du), p.duu, tolerance);
    assert_near(by_u(&|q| q.dv), p.duv, tolerance);
    assert_near(by_v(&|q| q.dv), p.dvv, tolerance);
}

proptest! {
    #[test]
    fn weights_are_a_partition_of_unity(basis in basis(), t in 0.0..1.0_f64) {
        // In a Hermite basis the last two belong to derivatives.
        let points = if basis == Basis::Hermite { 2 } else { 4 };
        let sum = |weights: [f64; 4]| weights[..points].iter().sum::<f64>();
        prop_assert!((sum(basis.weights(t)) - 1.0).abs() < 1e-14);
        prop_assert!(sum(basis.first_derivatives(t)).abs() < 1e-13);
        prop_assert!(sum(basis.second_derivatives(t)).abs() < 1e-13);
    }

    #[test]
    fn ends_are_what_each_basis_says(p in proptest::array::uniform4(point())) {
        let ends = |basis| [curve(basis, &p, 0.0, 0), curve(basis, &p, 1.0, 0)];
        let slopes = |basis| [curve(basis, &p, 0.0, 1), curve(basis, &p, 1.0, 1)];
        let near = |a: [DVec3; 2], b: [DVec3; 2]| a.iter().zip(b).all(|(a, b)| a.distance(b) < 1e-14);
        prop_assert!(near(ends(Basis::Bezier), [p[0], p[3]]));
        prop_assert!(near(slopes(Basis::Bezier), [3.0 * (p[1] - p[0]), 3.0 * (p[3] - p[2])]));
        prop_assert!(near(ends(Basis::CatmullRom), [p[1], p[2]]));
        prop_assert!(near(slopes(Basis::CatmullRom), [(p[2] - p[0]) / 2.0, (p[3] - p[1]) / 2.0]));
        prop_assert!(near(ends(Basis::Hermite), [p[0], p[1]]));
        prop_assert!(near(slopes(Basis::Hermite), [p[2], p[3]]));
        let knot = |k: usize| (p[k] + 4.0 * p[k + 1] + p[k + 2]) / 6.0;
        prop_assert!(near(ends(Basis::BSpline), [knot(0), knot(1)]));
    }

    #[test]
    fn segments_join_as_smoothly_as_they_should(p in proptest::collection::vec(point(), 5)) {
        for (basis, continuity) in [(Basis::BSpline, 2), (Basis::CatmullRom, 1)] {
            for derivative in 0..=continuity {
                let left = curve(basis, &p[..4], 1.0, derivative);
                assert_near(left, curve(basis, &p[1..], 0.0, derivative), 1e-13);
            }
        }
        // And no smoother: a Catmull-Rom curve through points in general position has a jump in its curvature.
        let zigzag = [0.0, 0.0, 1.0, 0.0, 1.0].map(|y| DVec3::new(0.0, y, 0.0));
        let [left, right] = [(&zigzag[..4], 1.0), (&zigzag[1..], 0.0)].map(|(p, t)| curve(Basis::CatmullRom, p, t, 2));
        prop_assert!(left.distance(right) > 0.5);
    }

    #[test]
    fn conversion_to_bezier_keeps_every_point_and_derivative(
        basis in basis(), points in uniform16(point()), u in 0.0..1.0, v in 0.0..1.0,
    ) {
        let patch = BicubicPatch { basis, points };
        let (a, b) = (patch.at(u, v), BezierPatch::from(&patch).at(u, v));
        for (a, b) in [(a.position, b.position), (a.du, b.du), (a.dv, b.dv), (a.duu, b.duu), (a.duv, b.duv), (a.dvv, b.dvv)] {
            assert_near(a, b, 1e-12);
        }
        assert_derivatives(&|u, v| patch.at(u, v), u, v, 10.0);
    }

    /// The closed form of the conversion is the solution of `bezier * K = basis`, here multiplied out.
    #[test]
    fn conversion_solves_the_matrix_equation(basis in basis(), k in 0_usize..4) {
        let mut unit = [DVec3::ZERO; 4];
        unit[k] = DVec3::X;
        let converted = basis.to_bezier(unit);
        for row in 0..4 {
            let product: f64 = (0..4).map(|j| Basis::Bezier.matrix()[row][j] * converted[j].x).sum();
            prop_assert!((product - basis.matrix()[row][k]).abs() < 1e-15);
        }
    }

    #[test]
    fn patches_lie_in_the_convex_hull_of_their_points(
        points in uniform16(point()), direction in point(), u in 0.0..1.0, v in 0.0..1.0,
    ) {
        for basis in [Basis::Bezier, Basis::BSpline] {
            let reach = points.iter().map(|p| p.dot(direction)).fold(f64::NEG_INFINITY, f64::max);
            let patch = BicubicPatch { basis, points };
            prop_assert!(patch.at(u, v).position.dot(direction) <= reach + 1e-14);
        }
    }

    #[test]
    fn rational_patches_lie_in_the_hull_and_have_their_derivatives(
        patch in rational(), direction in point(), u in 0.0..1.0, v in 0.0..1.0,
    ) {
        let reach = patch.points().map(|p| p.dot(direction)).fold(f64::NEG_INFINITY, f64::max);
        prop_assert!(patch.at(u, v).position.dot(direction) <= reach + 1e-13);
        assert_derivatives(&|u, v| patch.at(u, v), u, v, 1e3);
    }

    #[test]
    fn halves_are_the_patch(patch in rational(), at in 0.1..0.9, u in 0.0..1.0, v in 0.0..1.0) {
        let [low, high] = patch.split_u(at);
        assert_near(low.at(u, v).position, patch.at(at * u, v).position, 1e-12);
        assert_near(high.at(u, v).position, patch.at(at + (1.0 - at) * u, v).position, 1e-12);
        let [low, high] = patch.split_v(at);
        assert_near(low.at(u, v).position, patch.at(u, at * v).position, 1e-12);
        assert_near(high.at(u, v).position, patch.at(u, at + (1.0 - at) * v).position, 1e-12);
    }

    /// The bound that tessellation relies on, for triangles anywhere in the unit square.
    #[test]
    fn no_triangle_is_farther_than_the_flatness(
        patch in rational(), corners in proptest::array::uniform3((0.0..=1.0, 0.0..=1.0)), l in 0.0..1.0, m in 0.0..1.0,
    ) {
        let weights = [l * m, l * (1.0 - m), 1.0 - l];
        let place = |f: fn((f64, f64)) -> f64| corners.iter().zip(weights).map(|(c, w)| w * f(*c)).sum::<f64>();
        let on_surface = patch.at(place(|c| c.0), place(|c| c.1)).position;
        let on_triangle: DVec3 = corners.iter().zip(weights).map(|(c, w)| w * patch.at(c.0, c.1).position).sum();
        prop_assert!(on_surface.distance(on_triangle) <= patch.flatness() * (1.0 + 1e-12));
    }

    #[test]
    fn flatness_falls_to_a_quarter_as_both_sides_are_halved(patch in rational()) {
        let part = |n: u32| (0..n).fold(patch.clone(), |p, _| { let [p, _] = p.split_u(0.5); let [p, _] = p.split_v(0.5); p });
        let [coarse, fine] = [part(8).flatness(), part(9).flatness()];
        prop_assert!(fine < 0.3 * coarse, "{coarse} {fine}");
    }

    /// De Boor's recursion (Termeer 2005, A.1 to A.4) summed as it stands, against the Bezier pieces.
    #[test]
    fn nurbs_are_what_the_recursion_says(
        degree in (1_usize..=4, 1_usize..=4),
        points in proptest::collection::vec((point(), 0.2..5.0), 42),
        steps in proptest::collection::vec(prop_oneof![Just(0.0), 0.2..2.0], 24),
        s in 0.0..0.999, t in 0.0..0.999,
    ) {
        let ([p, q], [rows, columns]) = ([degree.0, degree.1], [6, 7]);
        let knots = |degree: usize, points: usize, steps: &[f64]| {
            let steps = steps.iter().take(points + degree + 1);
            // One step is never zero, in the middle of the domain.
            let mut sum = 0.0;
            steps.enumerate().map(|(k, step)| { sum += if k == points { step + 0.5 } else { *step }; sum }).collect::<Vec<_>>()
        };
        let (knots_u, knots_v) = (knots(p, rows, &steps[..12]), knots(q, columns, &steps[12..]));
        let (points, weights): (Vec<_>, Vec<_>) = points.into_iter().unzip();
        let nurbs = Nurbs {
            degree: [p, q], rows, columns, points: &points, weights: Some(&weights), knots_u: &knots_u, knots_v: &knots_v,
        };
        let surface = NurbsSurface::new(&nurbs).unwrap();
        let [[u0, u1], [v0, v1]] = surface.domain();
        prop_assert_eq!([u0, u1], [knots_u[p], knots_u[rows]]);
        let (u, v) = (u0 + s * (u1 - u0), v0 + t * (v1 - v0));
        let mut sum = DVec3::ZERO.extend(0.0);
        for k in 0..rows * columns {
            let b = de_boor(&knots_u, k / columns, p, u) * de_boor(&knots_v, k % columns, q, v);
            sum += b * weights[k] * points[k].extend(1.0);
        }
        assert_near(surface.at(u, v).position, sum.truncate() / sum.w, 1e-11);
    }

    #[test]
    fn a_circle_of_revolution_is_round(s in 0.0..2.0, t in 0.0..4.0) {
        let p = sphere().at(s, t);
        prop_assert!((p.position.length() - 1.0).abs() < 1e-14);
        // A cylinder, for the circle alone.
        let cylinder = revolution(&[(2.0, 0.0, 1.0), (2.0, 1.0, 1.0), (2.0, 5.0, 1.0)], &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        let q = cylinder.at(s / 2.0, t).position;
        prop_assert!((q.x.hypot(q.y) - 2.0).abs() < 1e-14);
    }

    #[test]
    fn curvatures_are_those_of_sphere_cylinder_and_saddle(u in 0.05..0.95, v in 0.05..0.95) {
        for patch in sphere().patches() {
            let at = patch.at(u, v).position;
            let inwards = -patch.normal(u, v).unwrap().dot(at);
            prop_assert!((inwards.abs() - 1.0).abs() < 1e-12);
            for curvature in patch.principal_curvatures(u, v).unwrap() {
                prop_assert!((curvature * inwards - 1.0).abs() < 1e-6, "{}", curvature);
            }
        }
        let knots = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        for patch in revolution(&[(2.0, 0.0, 1.0), (2.0, 1.0, 1.0), (2.0, 5.0, 1.0)], &knots).patches() {
            let mut found = patch.principal_curvatures(u, v).unwrap().map(f64::abs);
            found.sort_by(f64::total_cmp);
            prop_assert!(found[0] < 1e-7 && (found[1] - 0.5).abs() < 1e-7, "{:?}", found);
        }
        // z = x y has curvatures ±1/(1 + r²)^(3/2) on its diagonals... at the origin exactly 1 and -1.
        let corners = [(-1.0, -1.0, 1.0), (-1.0, 1.0, -1.0), (1.0, -1.0, -1.0), (1.0, 1.0, 1.0)];
        let saddle = BezierPatch::new([1, 1], &corners.map(|(x, y, z)| DVec3::new(x, y, z)), None).unwrap();
        let [larger, smaller] = saddle.principal_curvatures(0.5, 0.5).unwrap();
        prop_assert!((larger - 1.0).abs() < 1e-14 && (smaller + 1.0).abs() < 1e-14);
    }

    /// Near a pole the normal tends to the one that is given there.
    #[test]
    fn normals_at_poles_are_limits(v in 0.0..1.0) {
        let surface = sphere();
        for patch in surface.patches() {
            for (pole, inside) in [(0.0, 1e-4), (1.0, 1.0 - 1e-4)] {
                let at = patch.at(pole, v).position;
                let normal = patch.normal(pole, v).unwrap();
                // Equal to the regular normal at the equator, and the direction of the axis at the pole.
                prop_assert!(normal.distance(patch.normal(inside, v).unwrap()) < 1e-3);
                prop_assert!((normal.dot(at).abs() - 1.0).abs() < 1e-12);
            }
        }
    }
}

/// Equations A.2 and A.3; a quotient with an empty interval counts as zero.
fn de_boor(knots: &[f64], i: usize, p: usize, t: f64) -> f64 {
    if p == 0 {
        return f64::from(u8::from(knots[i] <= t && t < knots[i + 1]));
    }
    let part =
        |over: f64, under: f64, i| if under > 0.0 { over / under * de_boor(knots, i, p - 1, t) } else { 0.0 };
    part(t - knots[i], knots[i + p] - knots[i], i)
        + part(knots[i + p + 1] - t, knots[i + p + 1] - knots[i + 1], i + 1)
}

#[test]
fn degenerate_corners_and_flat_poles_have_normals() {
    // Both edges at a corner leave it in one direction: the second derivatives decide.
    let mut points: Vec<_> = (0..16).map(|k| DVec3::new((k / 4) as f64, (k % 4) as f64, 0.0)).collect();
    points[1] = DVec3::new(1.0, 1.0, 0.0);
    points[4] = DVec3::new(1.0, 1.0, 0.0);
    let patch = BezierPatch::new([3, 3], &points, None).unwrap();
    assert!((patch.normal(0.0, 0.0).unwrap().z.abs() - 1.0).abs() < 1e-12);
    // First and second derivatives vanish at the corner: found from inside.
    for k in [1, 2, 4, 5, 6, 8, 9, 10] {
        points[k] = points[0];
    }
    let patch = BezierPatch::new([3, 3], &points, None).unwrap();
    assert!((patch.normal(0.0, 0.0).unwrap().z.abs() - 1.0).abs() < 1e-12);
    // A point has none, nor has a line.
    let line: Vec<_> = (0..16).map(|k| DVec3::X * f64::from(k)).collect();
    assert_eq!(BezierPatch::new([3, 3], &line, None).unwrap().normal(0.3, 0.4), None);
    assert_eq!(BezierPatch::new([3, 3], &[DVec3::ONE; 16], None).unwrap().normal(0.0, 0.0), None);
}

#[test]
fn what_is_wrong_is_said() {
    let points = vec![DVec3::ZERO; 16];
    let indices = |k| [k; 16];
    let error = PatchSet::bicubic(Basis::Bezier, &points, &[indices(3), indices(16)]).unwrap_err();
    assert_eq!(error.to_string(), "entry 0 of patch 1 is point 16; there are 16 points (all counted from 0)");
    for (bad, shown) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (1e31, "1e31")] {
        let mut points = points.clone();
        points[7].y = bad;
        let error = PatchSet::bicubic(Basis::Bezier, &points, &[indices(0)]).unwrap_err().to_string();
        assert!(error.contains("point 7") && error.contains(shown), "{error}");
    }
    assert_eq!(PatchSet::bicubic(Basis::Bezier, &points, &[]), Err(PatchError::Empty));
    let many = vec![indices(0); MAX_CONTROL_POINTS / 16 + 1];
    assert!(matches!(PatchSet::bicubic(Basis::Bezier, &points, &many), Err(PatchError::TooMany { .. })));
    assert!(matches!(PatchSet::grid(Basis::Bezier, &points, 8, 2), Err(PatchError::Grid { axis: "u", .. })));
    assert!(matches!(PatchSet::grid(Basis::BSpline, &points, 3, 5), Err(PatchError::Count { .. })));
    assert!(matches!(
        BezierPatch::new([0, 3], &points, None),
        Err(PatchError::Degree { axis: "u", found: 0 })
    ));
    let weights =
        |w| BezierPatch::new([3, 3], &points, Some(&[vec![1.0; 15], vec![w]].concat())).unwrap_err();
    assert!(matches!(weights(0.0), PatchError::Weight { weight: 15, .. }));
    assert!(matches!(weights(1e7), PatchError::WeightRatio { .. }));
}

#[test]
fn wrong_nurbs_are_refused() {
    let points = vec![DVec3::ZERO; 12];
    let good = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let nurbs = Nurbs {
        degree: [2, 2],
        rows: 3,
        columns: 4,
        points: &points,
        weights: None,
        knots_u: &good,
        knots_v: &[0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0],
    };
    assert_eq!(NurbsSurface::new(&nurbs).unwrap().patches().len(), 2);
    let message = |nurbs: Nurbs<'_>| NurbsSurface::new(&nurbs).unwrap_err().to_string();
    let text = message(Nurbs { knots_u: &good[1..], ..nurbs });
    assert_eq!(text, "found 5 knots along u, expected 6");
    let text = message(Nurbs { knots_u: &[0.0, 0.0, 0.0, 1.0, 0.9, 1.0], ..nurbs });
    assert_eq!(text, "knot 4 (counted from 0) along u is 0.9, expected no less than the knot before");
    let text = message(Nurbs { knots_u: &[0.0; 6], ..nurbs });
    assert!(text.contains("expected a knot that is larger"), "{text}");
    let text = message(Nurbs { degree: [3, 2], ..nurbs });
    assert_eq!(text, "found 3 points along u, expected at least 4 for degree 3");
    let text = message(Nurbs { degree: [2, 99], ..nurbs });
    assert!(text.contains("degree along v is 99"), "{text}");
    let text = message(Nurbs { rows: usize::MAX, ..nurbs });
    assert!(text.contains("knots along u"), "{text}");
    let text = message(Nurbs { weights: Some(&[W; 11]), ..nurbs });
    assert_eq!(text, "found 11 weights, expected 12");
}

#[test]
fn grids_are_cut_into_windows() {
    let points = |n: usize| vec![DVec3::X; n];
    let count = |basis, rows, columns| {
        PatchSet::grid(basis, &points(rows * columns), rows, columns).unwrap().patches().len()
    };
    assert_eq!(count(Basis::Bezier, 7, 4), 2);
    assert_eq!(count(Basis::BSpline, 5, 6), 6);
    assert_eq!(count(Basis::CatmullRom, 4, 4), 1);
    assert_eq!(count(Basis::Hermite, 8, 4), 2);
}
