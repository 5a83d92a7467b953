//! Mesh files as other programs write them, each of which was once refused or read wrongly. Numbers are those of the
//! reports that they come from.

mod mesh_report_support;
mod mesh_samples;

use cutaway_io::mesh::{
    MeshFormat, MeshReadOptions, MeshSpace, WrittenSpace, encode_mesh, read_mesh_bytes, rounding,
};
use cutaway_io::volume::MemoryFolder;
use cutaway_mesh::{RepairOptions, Topology, repair};
use mesh_report_support::*;
use mesh_samples::{glb, gltf_buffer, gltf_json, gzip};

/// Binary STL with any header, count, attribute field and bytes after each triangle.
fn stl_binary(header: &str, count: Option<u32>, attribute: u16, payload: usize) -> Vec<u8> {
    let (corners, faces) = cuboid([1.0, 2.0, 3.0]);
    let triangles = triangles(&faces);
    let mut bytes = header.as_bytes().to_vec();
    bytes.resize(80, 0);
    bytes.extend(count.unwrap_or(triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        triangle.iter().flat_map(|v| corners[*v]).for_each(|c| bytes.extend((c as f32).to_le_bytes()));
        bytes.extend(attribute.to_le_bytes());
        bytes.extend((0..payload).map(|i| i as u8));
    }
    bytes
}

/// A prism of height 2 over the polygon; corners that are named twice are one vertex or two.
fn prism(polygon: &[[f64; 2]], shared: bool) -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let mut places: Vec<[f64; 2]> = Vec::new();
    let corner = |p: &[f64; 2]| match places.iter().position(|q| q == p).filter(|_| shared) {
        Some(i) => i,
        None => {
            places.push(*p);
            places.len() - 1
        }
    };
    let top: Vec<usize> = polygon.iter().map(corner).collect();
    let n = places.len();
    let corners = [2.0, 0.0].iter().flat_map(|z| places.iter().map(|[x, y]| [*x, *y, *z])).collect();
    let bottom: Vec<usize> = top.iter().rev().map(|v| v + n).collect();
    let next = top.iter().cycle().skip(1);
    let sides = top.iter().zip(next).filter(|(a, b)| a != b).map(|(&a, &b)| vec![a, a + n, b + n, b]);
    let faces = [vec![top.clone(), bottom], sides.collect()].concat();
    (corners, faces)
}

#[test]
fn report_21_faces_that_name_a_corner_twice_are_covered_once() {
    let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
    let hole = |x: f64| [[x, 1.0], [x, 3.0], [x + 2.0, 3.0], [x + 2.0, 1.0], [x, 1.0]];
    let wide = [[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
    let bridged = [&square[..], &hole(1.0)[..]].concat();
    let two = [&wide[..], &hole(1.0)[..], &wide[..1], &hole(5.0)[..]].concat();
    let l = [[0.0, 0.0], [0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]];
    let triangle = [&square[..], &[[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [1.0, 1.0]]].concat();
    let touching = [&square[..], &[[1.0, 2.0], [2.0, 1.0]]].concat();
    let cases = [
        ("keyhole", bridged, 12.0),
        ("two holes", two, 24.0),
        ("doubled corners", l.to_vec(), 7.0),
        ("triangle", triangle, 15.5),
        ("touching", touching, 14.5),
    ];
    for (what, polygon, end) in cases {
        for shared in [true, false] {
            let (corners, faces) = prism(&polygon, shared);
            let (ends, _walls) = faces.split_at(2);
            for (name, text) in [("a.obj", obj(&corners, ends)), ("a.ply", ply(&corners, ends, ""))] {
                let (t, _) = counted(name, text.as_bytes());
                assert!((t.area - 2.0 * end).abs() < 1e-5, "{what} {name}: {} for {}", t.area, 2.0 * end);
            }
            let (t, _) = counted("a.obj", obj(&corners, &faces).as_bytes());
            assert!(!shared || t.unbalanced_edges == 0, "{what}: {t:?}");
            let (t, _) = counted("a.stl", stl_text(&corners, &faces, "part", "endsolid\n").as_bytes());
            assert!((t.volume - 2.0 * end).abs() < 1e-5, "{what}: {}", t.volume);
        }
    }
}

#[test]
fn report_22_comments_and_names_end_at_their_line_end() {
    let (corners, faces) = cuboid([1.0, 2.0, 3.0]);
    let text = obj(&corners, &faces);
    for line in [
        "# made in C:\\parts\\",
        "g part\\",
        "o C:\\",
        "usemtl steel\\",
        "mtllib C:\\a\\",
        "s off\\",
        "#\\",
        "xyz \\",
    ] {
        let (t, notices) = counted("a.obj", format!("{line}\n{text}").as_bytes());
        assert_box(&t);
        assert_eq!(notices, [""; 0], "{line}");
        // Between the lines, and behind a face.
        let (t, _) = counted("a.obj", text.replacen("f ", &format!("{line}\nf "), 1).as_bytes());
        assert_box(&t);
    }
    assert_box(&counted("a.obj", text.replace("\nf", " # C:\\\nf").as_bytes()).0);
    // What has numbers goes on.
    let continued = text.replace("v 1", "v \\\n 1").replace("f 1 ", "f 1\\\n").replace('\n', "\r\n");
    assert_box(&counted("a.obj", continued.as_bytes()).0);
    let (_, notices) = counted("a.obj", format!("1 2 3\n{text}").as_bytes());
    assert!(notices[0].contains("line 1: found numbers without a keyword"), "{notices:?}");
}

#[test]
fn report_24_text_may_end_with_two_words_or_none() {
    let (corners, faces) = cuboid([1.0, 2.0, 3.0]);
    let faces: Vec<Vec<usize>> = triangles(&faces).iter().map(|t| t.to_vec()).collect();
    for end in ["end solid\n", "End Solid part\n", "endsolid", "end solid part"] {
        let (t, notices) = counted("a.stl", stl_text(&corners, &faces, "part", end).as_bytes());
        assert_box(&t);
        assert_eq!(notices, [""; 0], "{end}");
    }
    let spaced = stl_text(&corners, &faces, "part", "end solid");
    let spaced = spaced.replace("endloop", "end loop").replace("endfacet", "END FACET");
    assert_box(&counted("a.stl", spaced.as_bytes()).0);
    let (t, notices) = counted("a.stl", stl_text(&corners, &faces, "part", "").as_bytes());
    assert_box(&t);
    assert!(notices[0].contains("does not end with `endsolid`"), "{notices:?}");
    // With a triangle missing nobody knows what else is.
    let error =
        read("a.stl", stl_text(&corners, &faces[1..], "part", "").as_bytes()).unwrap_err().to_string();
    assert!(error.contains("cut short"), "{error}");
}

#[test]
fn report_24_the_length_of_a_binary_file_decides_about_its_count() {
    for count in [0, 1, 11, 13, 1000, u32::MAX] {
        for attribute in [0, 0x7fff] {
            let bytes = stl_binary("any header", Some(count), attribute, 0);
            for (name, bytes) in [("a.stl", bytes.clone()), ("a.stl.gz", gzip(&bytes))] {
                let (t, notices) = counted(name, &bytes);
                assert_box(&t);
                let says = format!("says {count} triangles, but the file holds 12");
                assert!(notices[0].contains(&says), "{notices:?}");
            }
        }
    }
    // Cut short at the end of a triangle.
    let bytes = stl_binary("any header", None, 0, 0);
    let error = read("a.stl", &bytes[..bytes.len() - 50]).unwrap_err().to_string();
    assert!(error.contains("found 550 bytes of triangles, expected 600 for 12"), "{error}");
}

#[test]
fn report_65_attributes_are_skipped_or_refused_but_never_read_as_triangles() {
    for payload in [1u16, 2, 7, 50, 100, 300] {
        let bytes = stl_binary("attributes", None, payload, usize::from(payload));
        for (name, bytes) in [("a.stl", bytes.clone()), ("a.stl.gz", gzip(&bytes))] {
            let (t, notices) = counted(name, &bytes);
            assert_box(&t);
            let says = format!("has {} bytes of attributes", 12 * u32::from(payload));
            assert!(notices[0].contains(&says), "{notices:?}");
        }
        // A count that is not the length of what follows.
        let error = read("a.stl", &[bytes, vec![7; 3]].concat()).unwrap_err().to_string();
        let says = format!("{} bytes more than they take", 12 * u32::from(payload) + 3);
        assert!(error.contains(&says), "{error}");
    }
    for colour in [1, 0x7fff, 0xffff] {
        let (t, notices) = counted("a.stl", &stl_binary("COLOR=", None, colour, 0));
        assert_box(&t);
        assert_eq!(notices, [""; 0]);
    }
    let (t, notices) = counted("a.stl", &[stl_binary("plain", None, 0, 0), vec![b'\n'; 3]].concat());
    assert_box(&t);
    assert!(notices[0].contains("has 3 extra bytes after its 12 triangles; ignored them"), "{notices:?}");
}

/// Where a survey in UTM coordinates is.
const UTM: [f64; 3] = [500_000.0, 5_400_000.0, 250.0];

#[test]
fn report_40_meshes_far_from_the_origin_keep_their_shape() {
    let (corners, faces) = cuboid([1.3, 1.7, 0.2]);
    let (near, _) = counted("a.obj", obj(&corners, &faces).as_bytes());
    let far = shifted(&corners, [UTM[0] + 1.35, UTM[1] + 1.15, UTM[2] + 1.9]);
    let of_triangles: Vec<Vec<usize>> = triangles(&faces).iter().map(|t| t.to_vec()).collect();
    let text = stl_text(&far, &of_triangles, "part", "endsolid\n");
    for (name, text) in [("a.obj", obj(&far, &faces)), ("a.ply", ply(&far, &faces, "")), ("a.stl", text)] {
        let mesh = read(name, text.as_bytes()).unwrap().value;
        let t = Topology::new(&mesh);
        assert!((t.area - near.area).abs() < 1e-6 && (t.volume - near.volume).abs() < 1e-6, "{name}: {t:?}");
        let [low, high] = t.bounds.unwrap();
        assert!(
            low.distance(far[0].into()) < 2e-7 && high.distance(far[7].into()) < 2e-7,
            "{name}: {low} {high}"
        );
        assert!(repair(&mesh, &RepairOptions::default()).unwrap().notices.is_empty(), "{name}");
        // What is written is as exact; STL cannot be.
        for format in [MeshFormat::Obj, MeshFormat::Ply] {
            let mut bytes = Vec::new();
            encode_mesh(&mesh, format, WrittenSpace::Unsaid, &mut bytes).unwrap();
            assert_eq!(read(&format!("b.{}", format.name()), &bytes).unwrap().value, mesh, "{name}");
        }
        assert!(rounding(&mesh) > 0.1, "{name}");
    }
}

#[test]
fn report_40_a_node_far_away_shows_its_mesh_as_it_is() {
    let far =
        gltf_json("").replace(r#""translation":[1,0,0]"#, r#""translation":[500000.3,5400000.7,250.1]"#);
    assert_ne!(far, gltf_json(""));
    // The node above scales by 2.
    let (t, _) = counted("a.glb", &glb(&far, &gltf_buffer()));
    assert!((t.volume - 8.0 / 6.0).abs() < 1e-6 && t.is_closed(), "{t:?}");
    let [low, _] = t.bounds.unwrap();
    assert!(low.distance(glam::DVec3::new(1_000_000.6, 10_800_001.4, 500.2)) < 1e-6, "{low}");
}

#[test]
fn report_26_meshes_in_lps_are_converted_to_ras() {
    let bounds = |name: &str, bytes: &[u8], space: MeshSpace| {
        let options = MeshReadOptions { space, ..MeshReadOptions::default() };
        let loaded = read_mesh_bytes(name, bytes, &MemoryFolder::new(), &options).unwrap();
        let t = Topology::new(&loaded.value);
        assert!(t.is_closed() && t.volume == 18.0, "{name}: {t:?}");
        (t.bounds.unwrap().map(|v| v.to_array()), loaded.notices)
    };
    let (as_stored, in_ras) = ([[-3.0, -3.5, -1.0], [-1.0, -0.5, 2.0]], [[1.0, 0.5, -1.0], [3.0, 3.5, 2.0]]);
    for words in ["3D Slicer output. SPACE=LPS", "space = lps", "SPACE=left-posterior-superior"] {
        for (name, bytes) in saying(words) {
            let (found, notices) = bounds(name, &bytes, MeshSpace::File);
            assert_eq!(found, in_ras, "{name} {words}");
            assert!(notices.len() == 1 && notices[0].contains("LPS"), "{name} {words}: {notices:?}");
            let (found, notices) = bounds(name, &bytes, MeshSpace::Ras);
            assert_eq!(found, as_stored, "{name} {words}");
            assert!(notices[0].contains("used unchanged"), "{name} {words}: {notices:?}");
            assert_eq!(bounds(name, &bytes, MeshSpace::Lps), (in_ras, vec![]), "{name} {words}");
        }
    }
    for words in ["SPACE=RAS", "nothing", "COLORSPACE=LPS"] {
        for (name, bytes) in saying(words) {
            assert_eq!(bounds(name, &bytes, MeshSpace::File), (as_stored, vec![]), "{name} {words}");
            assert_eq!(bounds(name, &bytes, MeshSpace::Lps).0, in_ras, "{name} {words}");
        }
    }
    for (name, bytes) in saying("SPACE=LAI") {
        let (found, notices) = bounds(name, &bytes, MeshSpace::File);
        assert_eq!(found, as_stored, "{name}");
        assert!(notices[0].contains("neither RAS nor LPS"), "{name}: {notices:?}");
    }
}

#[test]
fn report_26_what_is_written_in_ras_says_so() {
    let (name, bytes) = saying("SPACE=LPS").remove(0);
    let mesh = read(name, &bytes).unwrap().value;
    for format in [MeshFormat::Ply, MeshFormat::Obj, MeshFormat::Stl] {
        let mut bytes = Vec::new();
        encode_mesh(&mesh, format, WrittenSpace::Ras, &mut bytes).unwrap();
        assert!(String::from_utf8_lossy(&bytes).contains("SPACE=RAS"));
        let again = read(&format!("b.{}", format.name()), &bytes).unwrap();
        assert_eq!((again.value.bounds(), again.notices), (mesh.bounds(), vec![]));
    }
}
