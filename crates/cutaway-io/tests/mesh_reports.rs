//! Mesh files as other programs write them, each of which was once refused or read wrongly. Numbers are those of the
//! reports that they come from.

mod mesh_samples;

use cutaway_io::limits::Limits;
use cutaway_io::mesh::{
    MeshFormat, MeshReadError, MeshReadOptions, MeshSpace, WrittenSpace, encode_mesh, read_mesh_bytes,
    rounding,
};
use cutaway_io::volume::{Loaded, MemoryFolder};
use cutaway_mesh::{RepairOptions, Topology, TriangleMesh, repair};
use mesh_samples::{glb, gltf_buffer, gltf_json, gzip};

fn read(name: &str, bytes: &[u8]) -> Result<Loaded<TriangleMesh>, MeshReadError> {
    read_mesh_bytes(name, bytes, &MemoryFolder::new(), &MeshReadOptions::default())
}

fn counted(name: &str, bytes: &[u8]) -> (Topology, Vec<String>) {
    let loaded = read(name, bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
    (Topology::new(&loaded.value), loaded.notices)
}

/// Corners and outward faces of the box from 0 to `size`.
fn cuboid(size: [f64; 3]) -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|b| b as f64);
    let corners = (0..8).map(corner).map(|c| [0, 1, 2].map(|axis| c[axis] * size[axis])).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (corners, faces.map(|face| face.to_vec()).to_vec())
}

fn triangles(faces: &[Vec<usize>]) -> Vec<[usize; 3]> {
    faces.iter().flat_map(|f| (1..f.len() - 1).map(|i| [f[0], f[i], f[i + 1]])).collect()
}

fn obj(corners: &[[f64; 3]], faces: &[Vec<usize>]) -> String {
    let mut text = String::new();
    corners.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\n"));
    for face in faces {
        let names: Vec<String> = face.iter().map(|v| (v + 1).to_string()).collect();
        text += &format!("f {}\n", names.join(" "));
    }
    text
}

fn ply(corners: &[[f64; 3]], faces: &[Vec<usize>], comment: &str) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\n{comment}element vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        corners.len(),
        faces.len()
    );
    corners.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z}\n"));
    for face in faces {
        let names: Vec<String> = face.iter().map(ToString::to_string).collect();
        text += &format!("{} {}\n", face.len(), names.join(" "));
    }
    text
}

fn stl_text(corners: &[[f64; 3]], faces: &[Vec<usize>], name: &str, end: &str) -> String {
    let mut text = format!("solid {name}\n");
    for face in faces {
        text += " facet normal 0 0 0\n  outer loop\n";
        face.iter().map(|v| corners[*v]).for_each(|[x, y, z]| text += &format!("   vertex {x} {y} {z}\n"));
        text += "  endloop\n endfacet\n";
    }
    text + end
}

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

#[track_caller]
fn assert_box(t: &Topology) {
    assert!(t.is_closed(), "{t:?}");
    assert_eq!((t.used_vertices, t.triangles, t.area, t.volume), (8, 12, 22.0, 6.0));
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

fn shifted(corners: &[[f64; 3]], by: [f64; 3]) -> Vec<[f64; 3]> {
    corners.iter().map(|c| [0, 1, 2].map(|axis| c[axis] + by[axis])).collect()
}

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

/// The box that lies at x 1 to 3, y 0.5 to 3.5, z -1 to 2 in RAS, as LPS has it.
fn lps_box() -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let (corners, faces) = cuboid([2.0, 3.0, 3.0]);
    (shifted(&corners, [-3.0, -3.5, -1.0]), faces)
}

/// The same box in every format that names its axes, with these words in its header.
fn saying(words: &str) -> Vec<(&'static str, Vec<u8>)> {
    let (corners, faces) = lps_box();
    let of_triangles: Vec<Vec<usize>> = triangles(&faces).iter().map(|t| t.to_vec()).collect();
    let mut binary = words.as_bytes().to_vec();
    binary.resize(80, 0);
    binary.extend(12u32.to_le_bytes());
    for face in &of_triangles {
        binary.extend([0; 12]);
        face.iter().flat_map(|v| corners[*v]).for_each(|c| binary.extend((c as f32).to_le_bytes()));
        binary.extend([0; 2]);
    }
    let obj = format!("# {words}\n{}", obj(&corners, &faces));
    vec![
        ("text.stl", stl_text(&corners, &of_triangles, words, "endsolid\n").into_bytes()),
        ("text.ply", ply(&corners, &faces, &format!("comment {words}\n")).into_bytes()),
        ("a.obj.gz", gzip(obj.as_bytes())),
        ("a.obj", obj.into_bytes()),
        ("binary.stl", binary),
    ]
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

#[test]
fn report_85_gltf_of_version_1_is_called_so_wherever_it_says_it() {
    let rest = r#""scene":"all","scenes":{"all":{"nodes":["a"]}},"nodes":{"a":{"meshes":["m"]}},"meshes":{"m":{"primitives":[]}}"#;
    let asset = r#""asset":{"version":"1.0"}"#;
    for text in [
        format!("{{{asset},{rest}}}"),
        format!("{{{rest},{asset}}}"),
        format!("{{{rest}}}"),
        format!("{{{rest},\"asset\":{{\"version\":1.0}}}}"),
        r#"{"asset":{"version":"1.0"}}"#.to_owned(),
    ] {
        let error = read("a.gltf", text.as_bytes()).unwrap_err().to_string();
        assert!(
            error.contains("version 1.0 of glTF is not read; convert the file to glTF 2.0"),
            "{text}: {error}"
        );
    }
    let error = read("a.gltf", br#"{"meshes":[]}"#).unwrap_err().to_string();
    assert!(error.contains("`asset.version` is missing"), "{error}");
    assert!(read("a.gltf", br#"{"asset":{"version":"2.1"}}"#).is_ok());
}

/// A box as glTF: its positions are what `accessor` says, with a list of numbers and a list of positions behind the box's.
fn gltf_box(accessor: &str, indices: &[u16], values: &[[f32; 3]]) -> Vec<u8> {
    let (corners, faces) = cuboid([1.0, 2.0, 3.0]);
    let mut data: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    let mut add = |bytes: Vec<u8>| {
        views.push(format!(r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#, data.len(), bytes.len()));
        data.extend(bytes);
        data.resize(data.len().next_multiple_of(4), 0);
    };
    add(corners.iter().flatten().flat_map(|c| (*c as f32).to_le_bytes()).collect());
    add(triangles(&faces).iter().flatten().flat_map(|v| (*v as u16).to_le_bytes()).collect());
    add(indices.iter().flat_map(|v| v.to_le_bytes()).collect());
    add(values.iter().flatten().flat_map(|c| c.to_le_bytes()).collect());
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"componentType":5126,"count":8,"type":"VEC3"{accessor}}},
        {{"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]}}"#,
        views.join(","),
        data.len()
    );
    glb(&json, &data)
}

#[test]
fn report_86_accessors_without_a_view_are_zeros_and_sparse_ones_are_read() {
    let sparse = |count: usize| {
        format!(
            r#","sparse":{{"count":{count},"indices":{{"bufferView":2,"componentType":5123}},"values":{{"bufferView":3}}}}"#
        )
    };
    let (t, notices) = counted("a.glb", &gltf_box("", &[], &[]));
    assert_eq!((t.triangles, t.area, t.degenerate_triangles), (12, 0.0, 12));
    assert_eq!(notices, ["`accessors[0]` has no buffer view: all its values are 0"]);
    // The four upper corners are moved up.
    let top = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 2.0, 5.0], [1.0, 2.0, 5.0]];
    let accessor = format!(r#","bufferView":0{}"#, sparse(4));
    let (t, notices) = counted("a.glb", &gltf_box(&accessor, &[4, 5, 6, 7], &top));
    assert_eq!((t.area, t.volume, notices), (34.0, 10.0, vec![]));
    // All but the first.
    let (corners, _) = cuboid([1.0, 2.0, 3.0]);
    let others: Vec<[f32; 3]> = corners[1..].iter().map(|c| c.map(|x| x as f32)).collect();
    let (t, _) = counted("a.glb", &gltf_box(&sparse(7), &[1, 2, 3, 4, 5, 6, 7], &others));
    assert_box(&t);
    // Not ascending, and beyond the end.
    for indices in [[4, 6, 5, 7], [4, 5, 6, 8]] {
        let error = read("a.glb", &gltf_box(&accessor, &indices, &top)).unwrap_err().to_string();
        assert!(error.contains("accessors[0].sparse.indices"), "{error}");
    }
    // What only looks like zeros.
    let compressed = String::from_utf8_lossy(&gltf_box("", &[], &[]))
        .replace(r#""indices":1}"#, r#""indices":1,"extensions":{"KHR_draco_mesh_compression":{}}}"#);
    let json = compressed.split_once('{').unwrap().1;
    let json = format!("{{{}", &json[..json.rfind('}').unwrap() + 1]);
    let error = read("a.gltf", json.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("is compressed by KHR_draco_mesh_compression"), "{error}");
}

#[test]
fn report_b3_what_nodes_show_is_counted_before_it_is_made() {
    let nodes = vec![r#"{"mesh":0,"translation":[0.1,0.2,0.3]}"#; 300_000].join(",");
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"componentType":5126,"count":90000,"type":"VEC3"}}]}}"#
    );
    let options = MeshReadOptions { limits: Limits { max_bytes: 2 << 30 }, ..MeshReadOptions::default() };
    let error = read_mesh_bytes("a.gltf", json.as_bytes(), &MemoryFolder::new(), &options).unwrap_err();
    let MeshReadError::TooLarge { what, .. } = error else { panic!("{error}") };
    assert_eq!(what, "27000000000 vertices and 9000000000 triangles");
}

/// The box of 1 x 2 x 3 in every text format.
fn texts() -> Vec<(&'static str, String)> {
    let (corners, faces) = cuboid([1.0, 2.0, 3.0]);
    let of_triangles: Vec<Vec<usize>> = triangles(&faces).iter().map(|t| t.to_vec()).collect();
    let glb = gltf_box(r#","bufferView":0"#, &[], &[]);
    let length = u32::from_le_bytes(*glb[12..].first_chunk().unwrap()) as usize;
    let json = std::str::from_utf8(&glb[20..20 + length]).unwrap().trim_end();
    let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, &glb[28 + length..]);
    let buffer = format!(r#""buffers":[{{"uri":"data:;base64,{data}","#);
    vec![
        ("a.obj", obj(&corners, &faces)),
        ("a.ply", ply(&corners, &faces, "comment a\n")),
        ("a.stl", stl_text(&corners, &of_triangles, "part", "endsolid\n")),
        ("a.gltf", json.replace(r#""buffers":[{"#, &buffer)),
    ]
}

#[test]
fn report_64_a_byte_order_mark_says_nothing() {
    for (name, text) in texts() {
        let marked = [b"\xef\xbb\xbf", text.as_bytes()].concat();
        let packed = gzip(&marked);
        for (name, bytes) in [(name, &marked), (&*format!("{name}.gz"), &packed)] {
            let (t, notices) = counted(name, bytes);
            assert_box(&t);
            assert_eq!(notices, [""; 0], "{name}");
        }
        // Where only the content says what it is.
        assert!(name == "a.obj" || name == "a.gltf" || read("a", &marked).is_ok(), "{name}");
    }
    for (name, bytes) in saying("SPACE=LPS").into_iter().filter(|(name, _)| name.starts_with("text")) {
        let (t, _) = counted(name, &[b"\xef\xbb\xbf", bytes.as_slice()].concat());
        assert_eq!(t.bounds.unwrap()[0].x, 1.0, "{name}");
    }
}

#[test]
fn report_64_lines_may_end_in_a_carriage_return() {
    for (name, text) in texts() {
        for end in ["\r", "\r\n"] {
            assert_box(&counted(name, text.replace('\n', end).as_bytes()).0);
        }
        let mut ends = ["\n", "\r", "\r\n"].into_iter().cycle();
        let mixed: String = text
            .split_inclusive('\n')
            .map(|l| l.trim_end_matches('\n').to_owned() + ends.next().unwrap())
            .collect();
        if name != "a.ply" {
            assert_box(&counted(name, mixed.as_bytes()).0);
        }
        let lines = text.lines().count();
        assert!(name == "a.gltf" || lines > 10, "{name}");
    }
    // In front of binary data, which may begin with a byte that looks like a line feed.
    let (corners, faces) = cuboid([1.0, 2.0, 3.0]);
    for end in ["\n", "\r", "\r\n"] {
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty uchar ten\nproperty float x\nproperty float y\n\
             property float z\nelement face 6\nproperty list uchar uchar vertex_index\nend_header\n";
        let mut bytes = header.replace('\n', end).into_bytes();
        for corner in &corners {
            bytes.push(b'\n');
            corner.iter().for_each(|c| bytes.extend((*c as f32).to_le_bytes()));
        }
        for face in &faces {
            bytes.push(4);
            bytes.extend(face.iter().map(|v| *v as u8));
        }
        assert_box(&counted("a.ply", &bytes).0);
    }
}

#[test]
fn report_81_text_in_utf_16_is_called_so() {
    for (name, text) in texts() {
        for little in [true, false] {
            let units = [0xfeff].into_iter().chain(text.encode_utf16());
            let bytes: Vec<u8> =
                units.flat_map(|u| if little { u.to_le_bytes() } else { u.to_be_bytes() }).collect();
            for (name, bytes) in [(name.to_owned(), bytes.clone()), (format!("{name}.gz"), gzip(&bytes))] {
                let error = read(&name, &bytes).unwrap_err().to_string();
                assert!(error.ends_with("this is text in UTF-16; save it as UTF-8"), "{error}");
            }
        }
    }
}
