//! The two formats of patches: the teapot, surfaces as JSON, and what is wrong with others.

use std::collections::HashMap;
use std::io::Write;

use cutaway_core::glam::{DVec3, Vec3};
use cutaway_io::patches::{read, read_bytes, recognize, teapot};
use cutaway_mesh::TriangleMesh;
use cutaway_mesh::patches::{PatchSet, Tessellation};
use proptest::prelude::*;

const TEAPOT: &str = include_str!("../samples/teapot_bezier.txt");

fn error(bytes: &[u8]) -> String {
    let text = read_bytes("a", bytes).unwrap_err().to_string();
    assert!(text.starts_with("a: ") && !text.contains('\n'), "{text}");
    text
}

/// Undirected edges by how many triangles use them.
fn edges_by_uses(mesh: &TriangleMesh) -> HashMap<usize, usize> {
    let mut uses: HashMap<(u32, u32), usize> = HashMap::new();
    for &[a, b, c] in mesh.triangles() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *uses.entry((from.min(to), from.max(to))).or_default() += 1;
        }
    }
    uses.into_values().fold(HashMap::new(), |mut counts, n| {
        *counts.entry(n).or_default() += 1;
        counts
    })
}

/// How far a point is from the triangles.
fn distance(triangles: &[[DVec3; 3]], p: DVec3) -> f64 {
    let to_line = |s: DVec3, e: DVec3| {
        let t = ((p - s).dot(e - s) / (e - s).length_squared()).clamp(0.0, 1.0);
        p.distance(s + t * (e - s))
    };
    let to_triangle = |&[a, b, c]: &[DVec3; 3]| {
        let n = (b - a).cross(c - a);
        let inside = [(a, b), (b, c), (c, a)].iter().all(|(s, e)| (*e - *s).cross(p - *s).dot(n) >= 0.0);
        let edges = to_line(a, b).min(to_line(b, c)).min(to_line(c, a));
        if inside { edges.min((p - a).dot(n.normalize()).abs()) } else { edges }
    };
    triangles.iter().map(to_triangle).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_teapot_is_open_at_six_rims_and_nowhere_else() {
    let set = teapot().unwrap();
    assert_eq!(set.patches().len(), 32);
    assert_eq!(set.bounds(), [DVec3::new(-3.0, -2.0, 0.0), DVec3::new(3.525, 2.0, 3.15)]);
    for settings in [3.0, 0.3, 0.1, 0.01, 0.003].map(Tessellation::within) {
        let made = set.tessellate(&settings).unwrap();
        assert_eq!((made.boundary_loops.len(), made.non_manifold_edges, made.one_sided_edges), (6, 0, 0));
        let open: usize = made.boundary_loops.iter().map(Vec::len).sum();
        let counts = edges_by_uses(&made.mesh);
        assert_eq!((counts.len(), counts[&1]), (2, open));
        // The file lists all patches with their normals inwards.
        assert_eq!(made.turned_patches, 32);
    }
    // Rims of body and lid at one height, the spout's mouth at the same, and three ends that are stuck into the body.
    let made = set.tessellate(&Tessellation::within(0.01)).unwrap();
    let heights = |chain: &Vec<u32>| {
        let z = chain.iter().map(|&v| made.mesh.vertices()[v as usize].z);
        (z.clone().fold(f32::INFINITY, f32::min), z.fold(0.0, f32::max))
    };
    let mut rims: Vec<_> = made.boundary_loops.iter().map(heights).collect();
    rims.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let expected = [(0.6, 0.9), (0.6, 1.425), (2.025, 2.25), (2.4, 2.4), (2.4, 2.4), (2.4, 2.4)];
    for (found, expected) in rims.iter().zip(expected) {
        assert!((found.0 - expected.0).abs() < 1e-6 && (found.1 - expected.1).abs() < 1e-6, "{rims:?}");
    }
    assert_eq!(made.notices().len(), 2);
    assert!(made.notices()[1].starts_with("the surface is open: 6 boundary loops"), "{:?}", made.notices());
}

#[test]
fn the_teapot_keeps_its_tolerance() {
    const SAMPLES: usize = 8;
    let set = teapot().unwrap();
    for tolerance in [0.2, 0.05, 0.01] {
        let made = set.tessellate(&Tessellation::within(tolerance)).unwrap();
        assert!(made.error_bound <= tolerance);
        let corners = |t: usize| made.mesh.corners(t).map(|v| v.as_dvec3());
        let triangles: Vec<_> = (0..made.mesh.triangles().len()).map(corners).collect();
        let at = |k: usize| k as f64 / SAMPLES as f64;
        let mut worst = 0.0_f64;
        for patch in set.patches() {
            for k in 0..(SAMPLES + 1) * (SAMPLES + 1) {
                let p = patch.at(at(k / (SAMPLES + 1)), at(k % (SAMPLES + 1))).position;
                worst = worst.max(distance(&triangles, p));
            }
        }
        // Within the tolerance, and not by wasting triangles.
        assert!(worst <= tolerance && worst > 0.2 * tolerance, "{worst} for {tolerance}");
    }
}

#[test]
fn the_poles_of_the_teapot_have_normals() {
    let set = teapot().unwrap();
    let made = set.tessellate(&Tessellation::within(0.01)).unwrap();
    for normal in &made.normals {
        assert!((normal.length() - 1.0).abs() < 1e-5);
    }
    for (pole, outwards) in [(Vec3::new(0.0, 0.0, 3.15), Vec3::Z), (Vec3::ZERO, -Vec3::Z)] {
        let at = made.mesh.vertices().iter().position(|v| v.distance(pole) < 1e-6).unwrap();
        assert!(made.normals[at].distance(outwards) < 1e-6, "{}", made.normals[at]);
        // And its neighbours' normals lean the same way, on all sides.
        let beside = made.mesh.triangles().iter().filter(|triangle| triangle.contains(&(at as u32)));
        assert!(beside.clone().count() >= 8);
        assert!(beside.flatten().all(|&v| made.normals[v as usize].dot(outwards) > 0.5));
    }
    // On the patches themselves: four meet at the knob, four at the bottom, each collapsed along u = 0.
    for patch in [20, 21, 22, 23, 28, 29, 30, 31].map(|k| &set.patches()[k]) {
        for v in [0.0, 0.3, 1.0] {
            assert!(patch.at(0.0, v).dv.length() < 1e-12);
            assert!(patch.normal(0.0, v).unwrap().z.abs() > 1.0 - 1e-9);
            assert_eq!(patch.principal_curvatures(0.0, v), None);
        }
    }
}

#[test]
fn text_may_be_written_with_blanks_and_other_line_ends() {
    let plain = teapot().unwrap();
    for other in [
        TEAPOT.replace(',', " "),
        TEAPOT.replace('\n', "\r\n"),
        TEAPOT.replace('\n', "\n\n"),
        format!("\u{feff}{TEAPOT}"),
    ] {
        assert_eq!(read_bytes("a", other.as_bytes()).unwrap(), plain);
    }
    assert_eq!(read_bytes("a", TEAPOT.trim_end().as_bytes()).unwrap(), plain);
}

#[test]
fn errors_in_text_name_line_found_and_expected() {
    let line = |number: usize, text: &str| {
        let mut lines: Vec<_> = TEAPOT.lines().collect();
        lines[number - 1] = text;
        error(lines.join("\n").as_bytes())
    };
    let numbers = "16 numbers of points, from 1 (there should be 32 such lines)";
    assert_eq!(line(3, "1,2,3"), format!("a: line 3: found 3 numbers, expected {numbers}"));
    assert_eq!(line(4, "1,two"), format!("a: line 4: found \"two\", expected {numbers}"));
    assert_eq!(
        line(2, "0,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16"),
        "a: line 2: found point 0, expected points from 1 to 290"
    );
    assert_eq!(
        line(33, "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,291"),
        "a: line 33: found point 291, expected points from 1 to 290"
    );
    assert_eq!(
        line(34, "289"),
        "a: line 324: found \"1.5,-0.84,0.075\", expected the end of the file after 289 points"
    );
    assert!(
        line(34, "291")
            .starts_with("a: line 324: found the end of the file after this line, expected three coord")
    );
    assert!(line(40, "1,nan,2").contains("line 40: found [1.0, NaN, 2.0], expected coordinates from -1e30"));
    assert!(line(40, "1,2e40,2").contains("line 40"));
    // Counts that lie, in each direction: nothing is reserved for them.
    assert_eq!(line(1, "0"), "a: line 1: found \"0\", expected how many patches follow, from 1 to 262144");
    assert!(line(1, "99999999999999999999").contains("how many patches follow"));
    assert!(line(1, "262144").contains("line 34: found 1 numbers, expected 16 numbers"));
    assert!(line(34, "4194305").contains("how many points follow, from 1 to 4194304"));
}

#[test]
fn every_shortened_teapot_is_refused() {
    for (end, _) in TEAPOT.match_indices('\n').take(323) {
        error(&TEAPOT.as_bytes()[..end]);
    }
    assert_eq!(
        error(b""),
        "a: found nothing at the beginning, expected patches: a number of patches on a line (the teapot's text) or JSON"
    );
    assert!(error(b"solid teapot\n").contains("found \"solid teapot"));
    assert!(error(b"\x00\x01\x02").contains("\\0"));
}

/// A quarter of a cylinder as NURBS, and a flat Bezier patch.
const TWO: &str = r#"[
  { "kind": "nurbs", "degree": [2, 1], "rows": 3, "columns": 2, "weights": [1, 1, 0.7071067811865476, 0.7071067811865476, 1, 1],
    "knots_u": [0, 0, 0, 1, 1, 1], "knots_v": [0, 0, 1, 1],
    "points": [[1, 0, 0], [1, 0, 2], [1, 1, 0], [1, 1, 2], [0, 1, 0], [0, 1, 2]] },
  { "kind": "bezier", "patches": [[0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3]],
    "points": [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]] }
]"#;

#[test]
fn surfaces_of_all_kinds_are_read_from_json() {
    let set = read_bytes("a", TWO.as_bytes()).unwrap();
    assert_eq!(set.patches().len(), 2);
    let p = set.patches()[0].at(0.3, 0.5).position;
    assert!((p.x.hypot(p.y) - 1.0).abs() < 1e-15 && (p.z - 1.0).abs() < 1e-15);

    let points: Vec<_> = (0..25).map(|k| format!("[{}, {}, {}]", k / 5, k % 5, k % 3)).collect();
    let grid = |kind: &str, n: usize| {
        let points = points.iter().take(n * n).cloned().collect::<Vec<_>>().join(",");
        let json = format!(r#"{{"kind": "{kind}", "rows": {n}, "columns": {n}, "points": [{points}]}}"#);
        read_bytes("a", json.as_bytes()).map(|set: PatchSet| set.patches().len())
    };
    assert_eq!(grid("b-spline", 5).unwrap(), 4);
    assert_eq!(grid("catmull-rom", 5).unwrap(), 4);
    assert_eq!(grid("bezier", 4).unwrap(), 1);
    assert_eq!(grid("hermite", 4).unwrap(), 1);
    assert_eq!(
        grid("bezier", 5).unwrap_err().to_string(),
        "a: surface 0: found 5 points along u, expected 4, 7, 10 or another multiple of 3, plus 1"
    );
}

#[test]
fn errors_in_json_name_field_or_line() {
    let changed = |from: &str, to: &str| {
        assert!(TWO.contains(from));
        error(TWO.replace(from, to).as_bytes())
    };
    let cases = [
        (changed("\"bezier\"", "\"bezzier\""), "unknown variant `bezzier`"),
        (changed("\"bezier\"", "\"bezzier\""), "line 5 column"),
        (changed("\"rows\"", "\"rouws\""), "unknown field `rouws`"),
        (
            changed("3, 3, 3, 3]]", "3, 3, 3, 4]]"),
            "surface 1: entry 15 of patch 0 is point 4; there are 4 points",
        ),
        (changed("3, 3, 3, 3]]", "3, 3, 3]]"), "found a list of 15, expected a list of 16"),
        (
            changed("3, 3, 3, 3]]", "3, 3, 3, -3]]"),
            "found the number `-3`, expected a whole number of at least 0",
        ),
        (changed("\"rows\": 3", "\"rows\": 4"), "surface 0: found 6 knots along u, expected 7"),
        (changed("\"rows\": 3, ", ""), "surface 0: `rows` is missing; the kind \"nurbs\" needs it"),
        (changed("\"degree\": [2, 1]", "\"degree\": \"two\""), "expected a degree, or a list of two"),
        (changed("[2, 1]", "[2, 16]"), "the degree along v is 16; degrees from 1 to 15 are supported"),
        (changed("1, 1, 0.7071067811865476", "0, 1, 0.7071067811865476"), "weight 0 (counted from 0) is 0"),
        (changed("[0, 0, 1, 1]", "[0, 1, 0, 1]"), "knot 2 (counted from 0) along v is 0"),
        (changed("[3, 0, 0]", "[3e300, 0, 0]"), "surface 1: point 3 (counted from 0) is"),
        (changed("[3, 0, 0]", "[3e999, 0, 0]"), "number out of range"),
        (changed("\"bezier\", ", "\"bezier\", \"degree\": 3, "), "`degree` belongs to the kind \"nurbs\""),
        (changed("\"bezier\", ", "\"bezier\", \"rows\": 3, "), "`patches` or else both `rows` and `columns`"),
        (error(b"[]"), "there are no patches"),
        (error(b"{}"), "missing field `kind`"),
        (error(b"[[[[[[[["), "line 1 column"),
    ];
    for (found, expected) in cases {
        assert!(found.contains(expected), "{found}: {expected}");
    }
    // Names from the file are shown without control characters, and not at any length.
    let name = format!("a\u{1b}[31m{}", "b".repeat(1000));
    let found = changed("\"rows\"", &format!("\"{name}\"").replace('\u{1b}', "\\u001b"));
    assert!(
        found.len() < 400 && !found.contains('\u{1b}') && found.contains("... at line 2 column"),
        "{found}"
    );
    for end in 0..TWO.len() {
        error(&TWO.as_bytes()[..end]);
    }
}

#[test]
fn files_are_told_from_others() {
    let written = |text: &[u8]| {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text).unwrap();
        file
    };
    for (text, expected) in [
        (TEAPOT.as_bytes(), true),
        (TWO.as_bytes(), true),
        (b"{\"asset\": {\"version\": \"2.0\"}, \"meshes\": []}", false),
        (b"{\"volume\": \"a\", \"clip\": {\"patches\": \"teapot.txt\"}}", false),
        (b"{\"points\": [{\"value\": 1}]}", false),
        (b"solid a\n", false),
        (b"ply\n", false),
        (b"", false),
    ] {
        assert_eq!(recognize(written(text).path()), expected);
    }
    assert!(!recognize(std::path::Path::new("/nowhere/at/all")));
    let file = written(TEAPOT.as_bytes());
    assert_eq!(read(file.path()).unwrap(), teapot().unwrap());
    let missing = read(&file.path().with_extension("not")).unwrap_err().to_string();
    assert!(missing.starts_with("cannot read ") && missing.contains("no such file"), "{missing}");
    // One byte more than is read.
    let large = tempfile::NamedTempFile::new().unwrap();
    large.as_file().set_len((64 << 20) + 1).unwrap();
    assert!(read(large.path()).unwrap_err().to_string().contains("larger than 67108864 bytes"));
}

proptest! {
    /// Whatever a byte becomes, the file is read or refused in a line; what is read can be cut into triangles or not,
    /// but never brings anything down.
    #[test]
    fn damage_is_refused_in_one_line(
        json in any::<bool>(), changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = if json { TWO.as_bytes().to_vec() } else { TEAPOT.as_bytes().to_vec() };
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        match read_bytes("a", &bytes) {
            Err(error) => prop_assert!(!error.to_string().chars().any(char::is_control), "{}", error),
            Ok(set) => {
                let settings = Tessellation { max_triangles: 10_000, ..Tessellation::within(set.suggested_tolerance()) };
                if let Ok(made) = set.tessellate(&settings) {
                    prop_assert!(made.mesh.triangles().len() <= 10_000);
                    prop_assert!(made.normals.iter().all(|n| n.is_finite()));
                }
            }
        }
    }
}
