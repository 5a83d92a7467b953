//! Triangles must cover a polygon and nothing else, wherever its holes and bridges are.

use std::collections::HashMap;

use cutaway_core::glam::{DMat3, DQuat, Vec3};
use proptest::prelude::*;

use super::*;

/// The triangles of a polygon in a plane through space; fails where a fan would be needed.
fn triangulated(polygon: &[DVec2], to_space: DMat3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // Corners at one place are one vertex.
    let (mut vertices, mut number) = (Vec::new(), HashMap::new());
    let corners = polygon.iter().map(|p| {
        *number.entry([p.x.to_bits(), p.y.to_bits()]).or_insert_with(|| {
            vertices.push((to_space * p.extend(0.25)).as_vec3());
            vertices.len() as u32 - 1
        })
    });
    let corners: Vec<u32> = corners.collect();
    let mut triangles = Vec::new();
    let rest =
        EarClipper::default().clip(corners.clone(), &|v| vertices[v as usize].as_dvec3(), &mut triangles);
    assert_eq!(rest, [0; 0], "corners without ears in {polygon:?}");
    assert_eq!(boundary(&triangles), boundary_of(&corners), "every edge once");
    (vertices, triangles)
}

/// How often each edge is used forward more than backward.
fn boundary(triangles: &[[u32; 3]]) -> HashMap<[u32; 2], i32> {
    let mut net = HashMap::new();
    triangles.iter().for_each(|t| add_edges(t, &mut net));
    net.retain(|_, n| *n != 0);
    net
}

fn boundary_of(corners: &[u32]) -> HashMap<[u32; 2], i32> {
    let mut net = HashMap::new();
    add_edges(corners, &mut net);
    net.retain(|_, n| *n != 0);
    net
}

fn add_edges(corners: &[u32], net: &mut HashMap<[u32; 2], i32>) {
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        if a != b {
            *net.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
        }
    }
}

/// Sum of the triangles' areas, whichever way they are wound.
fn area(vertices: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| vertices[v as usize].as_dvec3());
        (b - a).cross(c - a).length() / 2.0
    };
    triangles.iter().map(area).sum()
}

fn shoelace(polygon: &[DVec2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>() / 2.0
}

fn points(list: &[[f64; 2]]) -> Vec<DVec2> {
    list.iter().map(|p| DVec2::from_array(*p)).collect()
}

#[track_caller]
fn assert_covered(polygon: &[[f64; 2]], expected: f64) {
    let polygon = points(polygon);
    assert!((shoelace(&polygon) - expected).abs() < 1e-9, "the polygon's own area");
    // From every corner on, and from below.
    for first in 0..polygon.len() {
        let turned: Vec<DVec2> = polygon.iter().cycle().skip(first).take(polygon.len()).copied().collect();
        for flip in [1.0, -1.0] {
            let to_space = DMat3::from_diagonal(DVec3::new(1.0, 1.0, flip));
            let (vertices, triangles) = triangulated(&turned, to_space);
            assert!((area(&vertices, &triangles) - expected).abs() < 1e-5 * expected, "{turned:?}");
        }
    }
}

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];

#[test]
fn report_21_a_keyhole_is_a_square_with_a_hole() {
    let [a, b, c, d] = SQUARE;
    let (h, i, j, k) = ([1.0, 1.0], [1.0, 3.0], [3.0, 3.0], [3.0, 1.0]);
    assert_covered(&[a, b, c, d, a, h, i, j, k, h], 12.0);
    // The hole begins at each of its corners.
    assert_covered(&[a, b, c, d, a, k, h, i, j, k], 12.0);
    // The bridge meets the middle of a side.
    assert_covered(&[[2.0, 0.0], b, c, d, a, [2.0, 0.0], k, h, i, j, k], 12.0);
}

#[test]
fn report_21_two_holes_with_a_bridge_each() {
    let outer = [[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0]];
    let hole = |x: f64| [[x, 1.0], [x, 3.0], [x + 2.0, 3.0], [x + 2.0, 1.0], [x, 1.0]];
    let from_one_corner = [&outer[..], &outer[..1], &hole(1.0)[..], &outer[..1], &hole(5.0)[..]].concat();
    assert_covered(&from_one_corner, 24.0);
    let [a, b, c, d] = outer;
    let right = [[7.0, 1.0], [5.0, 1.0], [5.0, 3.0], [7.0, 3.0], [7.0, 1.0]];
    assert_covered(&[&[a], &hole(1.0)[..], &[a, b], &right[..], &[b, c, d]].concat(), 24.0);
    // From hole to hole.
    let [p, q, r, s, _] = hole(5.0);
    let [t, u, v, w, _] = hole(1.0);
    assert_covered(&[a, b, c, d, a, t, u, v, w, p, q, r, s, p, w, t], 24.0);
}

#[test]
fn report_21_doubled_corners_and_holes_that_touch() {
    let l = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]];
    let [a, b, c, d, e, f] = l;
    assert_covered(&[a, a, b, c, d, d, d, e, f], 7.0);
    let [a, b, c, d] = SQUARE;
    // A triangle whose edge goes on along the bridge.
    assert_covered(&[a, b, c, d, a, [1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [1.0, 1.0]], 15.5);
    // A hole at the first corner.
    assert_covered(&[a, b, c, d, a, [1.0, 2.0], [2.0, 1.0]], 14.5);
    // A hole that touches a side with a corner, and one that fills a quarter.
    assert_covered(&[a, [2.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 1.0], [2.0, 0.0], b, c, d], 14.0);
    assert_covered(&[a, b, c, d, [0.0, 2.0], [2.0, 2.0], [2.0, 0.0], [0.0, 0.0], [0.0, 2.0]], 12.0);
    // A hole that is the triangle of a corner, with its bridge elsewhere.
    let (e, f) = ([2.0, 0.0], [0.0, 2.0]);
    assert_covered(&[a, e, b, c, e, a, f, e, c, d, f], 14.0);
}

#[test]
fn lines_that_go_out_and_back_have_no_area() {
    let [a, b, c, d] = SQUARE;
    assert_covered(&[a, [2.0, 0.0], [2.0, 2.0], [2.0, 0.0], b, c, d], 16.0);
    assert_covered(&[a, [2.0, 0.0], [2.0, -2.0], [2.0, 0.0], b, c, d], 16.0);
    assert_covered(&[a, b, [6.0, 0.0], b, c, d, [0.0, 2.0]], 16.0);
    assert_covered(&[a, [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], b, c, d, [0.0, 3.0], [0.0, 1.0]], 16.0);
}

#[test]
fn what_has_no_ears_is_left() {
    let mut triangles = Vec::new();
    let line: Vec<Vec3> = (0..5).map(|i| Vec3::splat(i as f32)).collect();
    let rest =
        EarClipper::default().clip(vec![0, 1, 2, 3, 4], &|v| line[v as usize].as_dvec3(), &mut triangles);
    assert_eq!((rest.len(), triangles.len()), (5, 0));
    // Once around and across: both loops of a figure of eight.
    let eight = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
    let rest =
        EarClipper::default().clip(vec![0, 1, 2, 3], &|v| eight[v as usize].as_dvec3(), &mut triangles);
    assert_eq!(rest.len() + triangles.len(), 4, "{rest:?} {triangles:?}");
}

/// A star around `middle` with `n` corners at distances between `least` and 1 times `size`.
fn star(middle: DVec2, size: f64, radii: &[f64], clockwise: bool) -> Vec<DVec2> {
    let turn = std::f64::consts::TAU / radii.len() as f64;
    let at = |(i, r): (usize, &f64)| middle + DVec2::from_angle(turn * (i as f64 + 0.1)) * size * *r;
    let mut corners: Vec<DVec2> = radii.iter().enumerate().map(at).collect();
    if clockwise {
        corners.reverse();
    }
    corners
}

/// True if the segment touches no edge of the polygon but at its own ends.
fn sees(a: DVec2, b: DVec2, polygon: &[DVec2]) -> bool {
    (0..polygon.len()).all(|i| {
        let (p, q) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let side = |a: DVec2, b: DVec2, p: DVec2| (b - a).perp_dot(p - a);
        let (s, t) = (side(a, b, p) * side(a, b, q), side(p, q, a) * side(p, q, b));
        let ends = [p, q].iter().filter(|end| **end == a || **end == b).count();
        match ends {
            0 => s > 1e-9 || t > 1e-9,
            1 => side(a, b, p).abs() + side(a, b, q).abs() > 1e-6,
            _ => p == q,
        }
    })
}

/// Joins a hole to a polygon by a bridge between the first two corners that see each other, in an order that the numbers
/// choose.
fn bridge(polygon: &[DVec2], hole: &[DVec2], others: &[Vec<DVec2>], choose: usize) -> Option<Vec<DVec2>> {
    let pairs = polygon.len() * hole.len();
    (0..pairs).map(|k| (k * 7919 + choose) % pairs).map(|k| (k / hole.len(), k % hole.len())).find_map(
        |(i, j)| {
            let (a, b) = (polygon[i], hole[j]);
            // At corners that are named twice the bridge must leave between the right two edges.
            let (last, next) =
                (polygon[(i + polygon.len() - 1) % polygon.len()], polygon[(i + 1) % polygon.len()]);
            let angle = |v: DVec2| (next - a).angle_to(v - a).rem_euclid(std::f64::consts::TAU);
            let inside = angle(b) > 1e-6 && angle(b) < angle(last) - 1e-6;
            let free =
                inside && sees(a, b, polygon) && sees(a, b, hole) && others.iter().all(|o| sees(a, b, o));
            let around = hole.iter().cycle().skip(j).take(hole.len() + 1);
            free.then(|| polygon[..=i].iter().chain(around).chain(&polygon[i..]).copied().collect())
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn report_21_polygons_with_holes_are_covered_once(
        outline in prop::collection::vec(0.75f64..1.0, 5..40),
        holes in prop::collection::vec((prop::collection::vec(0.3f64..1.0, 3..12), any::<u16>(), any::<bool>()), 0..9),
        axis in prop::array::uniform3(-1f64..1.0), angle in 0f64..6.3, scale in -6i32..6,
        doubled in prop::collection::vec(any::<prop::sample::Index>(), 0..4),
    ) {
        let outer = star(DVec2::ZERO, 10.0, &outline, false);
        let places = (0..9).map(|i| DVec2::new(f64::from(i % 3 - 1) * 3.0, f64::from(i / 3 - 1) * 3.0));
        let holes: Vec<_> = holes.iter().zip(places)
            .filter(|(_, place)| place.length() < 4.0)
            .map(|((radii, choose, touches), place)| {
                // Two neighbours may touch in a corner.
                let size = if *touches { 1.4 } else { 0.9 };
                (star(place, size, radii, true), usize::from(*choose))
            }).collect();
        let mut polygon = outer.clone();
        let mut expected = shoelace(&outer);
        for (i, (hole, choose)) in holes.iter().enumerate() {
            let others: Vec<Vec<DVec2>> = holes[i + 1..].iter().map(|(hole, _)| hole.clone()).collect();
            if let Some(joined) = bridge(&polygon, hole, &others, *choose) {
                polygon = joined;
                expected += shoelace(hole);
            }
        }
        for place in doubled {
            let i = place.index(polygon.len());
            polygon.insert(i, polygon[i]);
        }
        let axis = DVec3::from_array(axis).try_normalize().unwrap_or(DVec3::Z);
        let to_space = DMat3::from_quat(DQuat::from_axis_angle(axis, angle)) * 10f64.powi(scale);
        let (vertices, triangles) = triangulated(&polygon, to_space);
        let found = area(&vertices, &triangles) / 10f64.powi(2 * scale);
        prop_assert!((found - expected).abs() < 1e-5 * expected, "{found} for {expected}");
    }
}
