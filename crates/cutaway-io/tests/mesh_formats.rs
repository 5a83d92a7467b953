//! What mesh readers make of small files of every format, and that what is written is read again.

mod mesh_samples;

use cutaway_io::limits::Limits;
use cutaway_io::mesh::{
    MeshFormat, MeshReadError, MeshReadOptions, MeshWriteError, WrittenSpace, encode_mesh, read_mesh,
    read_mesh_bytes, write_mesh,
};
use cutaway_io::volume::{Loaded, MemoryFolder};
use cutaway_mesh::{Topology, TriangleMesh};
use glam::{DVec3, Vec3};
use mesh_samples::{CORNERS, TRIANGLES, all, glb, gltf_buffer, gltf_json, gzip, ply_ascii};
use proptest::prelude::*;

fn read(name: &str, bytes: &[u8]) -> Result<Loaded<TriangleMesh>, MeshReadError> {
    read_mesh_bytes(name, bytes, &MemoryFolder::new(), &MeshReadOptions::default())
}

fn tetrahedron() -> TriangleMesh {
    TriangleMesh::new(CORNERS.map(Vec3::from_array).to_vec(), TRIANGLES.to_vec()).unwrap()
}

#[test]
fn every_sample_is_the_tetrahedron() {
    for (name, bytes) in all() {
        let loaded = read(name, &bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(loaded.notices, [""; 0], "{name}");
        let mesh = loaded.value;
        let scale = if name.contains("gl") { 2.0f64 } else { 1.0 };
        let t = Topology::new(&mesh);
        assert_eq!((t.vertices, t.triangles, t.euler), (4, 4, 2), "{name}");
        assert!(t.is_closed(), "{name}: {t:?}");
        assert!((t.volume - scale * scale * scale / 6.0).abs() < 1e-6, "{name}: {}", t.volume);
        let shift = if name.contains("gl") { DVec3::X * 2.0 } else { DVec3::ZERO };
        assert_eq!(t.bounds, Some([shift, shift + DVec3::splat(scale)]), "{name}");
        if !name.contains("stl") && !name.contains("strips") {
            assert_eq!(mesh.triangles(), TRIANGLES, "{name}");
        }
    }
}

#[test]
fn content_comes_before_the_name() {
    for (name, bytes) in all() {
        // OBJ has nothing to know it by.
        if !name.contains("obj")
            && !name.contains("binary")
            && !name.contains("solid")
            && !name.contains("gltf")
        {
            assert_eq!(read("wrong.obj", &bytes).unwrap().value.triangles().len(), 4, "{name}");
            assert!(read("nothing", &bytes).is_ok(), "{name}");
        }
    }
    let binary = mesh_samples::stl_binary(b"x");
    assert!(read("without_extension", &binary).is_ok());
    assert!(matches!(read("a.nii", &binary), Err(MeshReadError::UnknownFormat { .. })));
}

#[test]
fn polygons_become_triangles_that_cover_them_once() {
    // An arrow head, concave at its fourth corner; from its first corner a fan would cover more.
    let arrow = "v 0 1 0\nv -2 -1 0\nv 0 -0.5 0\nv 2 -1 0\nf 2 3 4 1\n";
    let mesh = read("a.obj", arrow.as_bytes()).unwrap().value;
    // The shoelace formula: two triangles of height 2 and base 1.5.
    assert!((Topology::new(&mesh).area - 3.0).abs() < 1e-6);
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 3\nproperty list uchar int vertex_index\nend_header\n0 1 0\n-2 -1 0\n0 -0.5 0\n2 -1 0\n4 1 2 3 0\n2 0 1\n0\n";
    let mesh = read("a.ply", ply.as_bytes()).unwrap().value;
    assert_eq!(mesh.triangles().len(), 2);
    assert!((Topology::new(&mesh).area - 3.0).abs() < 1e-6);
    // All corners on one line: whatever it is, it is triangles.
    let line = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\nf 1 2 3 4 5\n";
    assert_eq!(read("a.obj", line.as_bytes()).unwrap().value.triangles().len(), 3);
}

#[test]
fn rows_of_text_with_more_than_the_header_says_are_read_with_a_notice() {
    let text = String::from_utf8(ply_ascii()).unwrap().replace("0.25\n", "0.25 9 1 1\n");
    let loaded = read("a.ply", text.as_bytes()).unwrap();
    assert_eq!(loaded.value, tetrahedron());
    assert_eq!(loaded.notices, ["4 rows have more numbers than the header says: the surplus ignored"]);
}

#[test]
fn a_point_cloud_is_a_mesh_without_triangles() {
    let text = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nend_header\n1 2 3";
    let loaded = read("a.ply", text).unwrap();
    assert_eq!(
        (loaded.value.vertices(), loaded.value.triangles().len()),
        (&[Vec3::new(1.0, 2.0, 3.0)][..], 0)
    );
    assert_eq!(loaded.notices, ["the file has no faces (vertices: 1)"]);
}

#[test]
fn errors_say_where_and_what() {
    let ply =
        |from: &str, to: &str| String::from_utf8(ply_ascii()).unwrap().replacen(from, to, 1).into_bytes();
    let mut nan = mesh_samples::stl_binary(b"");
    nan[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        (
            "a.ply",
            ply("3 0 2 1", "3 0 2 4"),
            "a.ply: line 26: a face names vertex 4, but the file has 4, numbered from 0",
        ),
        ("a.ply", ply("3 0 2 1", "3 0 2 -1"), "a.ply: line 26: a face names vertex -1"),
        ("a.ply", ply("3 0 2 1", "3 0 x 1"), "a.ply: line 26: found \"x\", expected a number"),
        ("a.ply", ply("3 0 2 1", "3 0 1.5 1"), "a.ply: line 26: found 1.5, expected a whole number"),
        ("a.ply", ply("3 0 2 1", "99 0 2 1"), "a.ply: line 26: found 99, expected the length of a list"),
        ("a.ply", ply("1 255 0 0", "nan 255 0 0"), "a.ply: line 20: a coordinate is NaN, expected a finite"),
        ("a.ply", ply("1 255 0 0", "1e39 255 0 0"), "a.ply: line 20: a coordinate is 1"),
        (
            "a.ply",
            ply("property float z", "property float w"),
            "line 5: found the element `vertex` without a number `z`",
        ),
        (
            "a.ply",
            ply("vertex_indices", "corners"),
            "found the element `face` without a list `vertex_indices`",
        ),
        ("a.ply", ply("double", "quad"), "line 8: found \"property quad y\", expected `property TYPE NAME`"),
        ("a.ply", ply("1.0", "2.0"), "line 2: found \"format ascii 2.0\", expected version 1.0"),
        ("a.ply", ply("element vertex 4", "element vertex -4"), "line 5: found \"element vertex -4\""),
        ("a.ply", ply("element vertex 4", "element vertex 400000"), "bytes of vertex, expected at least"),
        ("a.stl", nan, "a.stl: byte 134: a coordinate is NaN, expected a finite 32-bit number"),
        (
            "a.stl",
            b"solid\nfacet\nouter loop\nvertex 1 2\n".to_vec(),
            "line 4: found \"vertex 1 2\", expected three",
        ),
        ("a.stl", b"solid\nfacet\nouter loop\nvertex 1 2 inf\n".to_vec(), "line 4: a coordinate is \"inf\""),
        (
            "a.stl",
            b"solid\nfacet\n".to_vec(),
            "line 2: found the end of the file, expected `outer loop`; the file is cut",
        ),
        (
            "a.stl",
            b"solid\nvertex 1 2 3\n".to_vec(),
            "line 2: found \"vertex\", expected `facet` or `endsolid`",
        ),
        (
            "a.obj",
            b"v 0 0 0\nf 1 1 2\n".to_vec(),
            "a.obj: line 2: a face names vertex 2, but the file has 1, numbered from 1",
        ),
        (
            "a.obj",
            b"v 0 0 0\nf 1 1 -2\n".to_vec(),
            "a.obj: line 2: a face names vertex -2, but the file has 1",
        ),
        ("a.obj", b"v 0 0 0\nf 1 1 0\n".to_vec(), "a.obj: line 2: a face names vertex 0, but the file has 1"),
        (
            "a.obj",
            b"v 0 0 0\nf 1 1\n".to_vec(),
            "a.obj: line 2: found \"f 1 1\", expected three vertices or more",
        ),
        ("a.obj", b"v 0 0\n".to_vec(), "a.obj: line 1: found \"v 0 0\", expected three coordinates"),
        ("a.obj", b"hello\n".to_vec(), "a.obj: line 1: found no vertices up to the end"),
        ("a.obj", b"\x64\x86\0\0".to_vec(), "a.obj: not a mesh: the file begins with \"d\\u{86}\\0\\0\""),
        ("a.xyz", b"1 2 3".to_vec(), "a.xyz: not a mesh: the file begins with \"1 2 3\"; supported are PLY"),
        ("a.ply", b"".to_vec(), "a.ply: not a mesh: the file begins with nothing (it is empty)"),
    ];
    for (name, bytes, says) in cases {
        let error = read(name, &bytes).expect_err(says).to_string();
        assert!(error.contains(says), "{says}\n{error}");
    }
}

mod gltf {
    use super::*;

    fn json(from: &str, to: &str) -> Vec<u8> {
        let json = gltf_json("");
        assert!(json.contains(from), "{from}");
        glb(&json.replacen(from, to, 1), &gltf_buffer())
    }

    #[test]
    fn errors_name_the_field() {
        let cases = [
            (r#""mesh":0"#, r#""mesh":5"#, "`nodes[1].mesh` is 5, expected one of 1 meshes, numbered from 0"),
            (r#""nodes":[0]"#, r#""nodes":[7]"#, "`nodes` is 7, expected one of 2 nodes"),
            (
                r#""children":[1]"#,
                r#""children":[0]"#,
                "`nodes[0]` is reached twice, expected a tree of nodes",
            ),
            (r#""children":[1]"#, r#""children":[1,1]"#, "`nodes[1]` is reached twice"),
            (r#""scene":0"#, r#""scene":1"#, "`scene` is 1, expected one of 1 scenes"),
            (
                r#""POSITION":0"#,
                r#""POSITION":9"#,
                "primitives[0].attributes.POSITION` is 9, expected one of 2 accessors",
            ),
            (r#""POSITION":0"#, r#""POSITION":1"#, "`accessors[1]` is SCALAR of type 5123, expected VEC3"),
            (r#""indices":1"#, r#""indices":0"#, "`accessors[0]` is VEC3 of type 5126, expected SCALAR"),
            (r#""indices":1"#, r#""indices":1,"mode":9"#, "mode` is 9, expected 0 to 6"),
            (
                "\"count\":4",
                "\"count\":5",
                "`accessors[0].count` is 5, expected no more than fit into the 48 bytes",
            ),
            ("\"count\":4", "\"count\":18446744073709551615", "`accessors[0].count` is 18446744073709551615"),
            ("\"count\":4", "\"count\":3", "indices` is 3 in element 5, expected one of 3 vertices"),
            ("5126", "5124", "`accessors[0].componentType` is 5124"),
            ("VEC3", "VEC9", "`accessors[0].type` is \"VEC9\""),
            (
                r#""byteLength":48"#,
                r#""byteLength":99"#,
                "`bufferViews[0].byteLength` is 99 at offset 0, expected no more",
            ),
            (
                r#""byteOffset":48"#,
                r#""byteOffset":18446744073709551615"#,
                "`bufferViews[1].byteLength` is 24 at offset 18446",
            ),
            (
                r#""byteLength":48"#,
                r#""byteLength":48,"byteStride":4"#,
                "`bufferViews[0].byteStride` is 4, expected 12 to 252",
            ),
            (r#""byteLength":72"#, r#""byteLength":9999"#, "found 72 bytes of `buffers[0]`, expected 9999"),
            (r#""buffer":0,"#, r#""buffer":3,"#, "`bufferViews[0].buffer` is 3, expected one of 1 buffers"),
            (r#""rotation":[0,0,0,1]"#, r#""rotation":[0,0,0,0]"#, "`nodes[1].rotation` is of length 0"),
            (r#""scale":[2,2,2]"#, r#""scale":[1e300,1e300,1e300]"#, "a coordinate is"),
            (
                r#""bufferView":0,"componentType":5126"#,
                r#""sparse":{"count":3,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}},"componentType":5126"#,
                "`accessors[0].sparse.indices` is 1 in element 2, expected ascending numbers below the count of 4",
            ),
            (
                r#""bufferView":0,"componentType":5126"#,
                r#""sparse":{"count":99,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}},"componentType":5126"#,
                "`accessors[0].sparse.count` is 99, expected no more than fit",
            ),
            (r#""version":"2.0""#, r#""version":"1.0""#, "version 1.0 of glTF is not read"),
            (
                r#""scene":0"#,
                r#""extensionsRequired":["KHR_draco_mesh_compression"]"#,
                "KHR_draco_mesh_compression is not read",
            ),
            (
                r#""scene":0"#,
                r#""scene":"x""#,
                "not glTF: invalid type: string \"x\", expected a whole number at line 1",
            ),
        ];
        for (from, to, says) in cases {
            let error = read("a.glb", &json(from, to)).expect_err(says).to_string();
            assert!(error.contains(says), "{says}\n{error}");
        }
    }

    #[test]
    fn mirroring_nodes_turn_windings() {
        let mesh = read("a.glb", &json("[2,2,2]", "[-2,2,2]")).unwrap().value;
        assert!((Topology::new(&mesh).volume - 8.0 / 6.0).abs() < 1e-6);
        let matrix = r#""matrix":[0,2,0,0, 2,0,0,0, 0,0,2,0, 5,6,7,1]"#;
        let t = Topology::new(&read("a.glb", &json(r#""scale":[2,2,2]"#, matrix)).unwrap().value);
        assert!((t.volume - 8.0 / 6.0).abs() < 1e-6);
        // x and y change places and grow twofold; the child's shift of 1 along x becomes 2 along y.
        assert_eq!(t.bounds, Some([DVec3::new(5.0, 8.0, 7.0), DVec3::new(7.0, 10.0, 9.0)]));
    }

    #[test]
    fn nodes_may_share_a_mesh_and_scenes_may_be_missing() {
        let two = json(r#""children":[1],"#, r#""mesh":0,"children":[1],"#);
        assert_eq!(read("a.glb", &two).unwrap().value.triangles().len(), 8);
        let none = json(r#""scene":0,"scenes":[{"nodes":[0]}],"#, "");
        assert_eq!(read("a.glb", &none).unwrap().value.triangles(), TRIANGLES);
    }

    #[test]
    fn strips_fans_and_quantised_positions_are_read() {
        let document = |mode: u32, kind: u32, normalized: bool, count: usize, length: usize| {
            format!(
                r#"{{"asset":{{"version":"2.0"}},"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":{mode}}}]}}],
                "accessors":[{{"bufferView":0,"componentType":{kind},"normalized":{normalized},"count":{count},"type":"VEC3"}}],
                "bufferViews":[{{"buffer":0,"byteLength":{length},"byteStride":4}}],"buffers":[{{"byteLength":{length}}}]}}"#
            )
        };
        // A square, as a strip and as a fan: both with the same winding.
        let (strip, fan) = (
            [0, 0, 0, 9, 127, 0, 0, 9, 0, 127, 0, 9, 127, 127, 0, 9],
            [0, 0, 0, 9, 127, 0, 0, 9, 127, 127, 0, 9, 0, 127, 0, 9],
        );
        for (mode, bytes) in [(5, strip), (6, fan)] {
            let mesh = read("a.glb", &glb(&document(mode, 5120, true, 4, 16), &bytes)).unwrap().value;
            let t = Topology::new(&mesh);
            assert_eq!((t.triangles, t.boundary_edges, t.inconsistent_edges), (2, 4, 0));
            assert_eq!((t.area, t.bounds), (1.0, Some([DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)])));
            let [a, b, c] = mesh.corners(0);
            assert!((b - a).cross(c - a).z > 0.0);
        }
        let whole = read("a.glb", &glb(&document(5, 5121, false, 4, 16), &strip)).unwrap().value;
        assert_eq!(Topology::new(&whole).area, 127.0 * 127.0);
        let odd = read("a.glb", &glb(&document(4, 5121, false, 4, 16), &strip)).unwrap();
        assert_eq!((odd.value.triangles().len(), odd.notices.len()), (1, 1), "{:?}", odd.notices);
        let lines = read("a.glb", &glb(&document(1, 5121, false, 4, 16), &strip)).unwrap();
        assert_eq!(lines.notices[0], "1 primitives of points and lines left out");
    }

    #[test]
    fn buffers_are_read_from_the_folder_of_the_file_only() {
        let folder = MemoryFolder::from([
            ("a b.bin".to_owned(), gltf_buffer()),
            ("sub/c.bin".to_owned(), gltf_buffer()),
        ]);
        let named = |uri: &str| {
            let json = gltf_json(&format!("\"uri\":\"{uri}\","));
            read_mesh_bytes("a.gltf", json.as_bytes(), &folder, &MeshReadOptions::default())
        };
        for good in ["a%20b.bin", "a b.bin", "./sub/c.bin"] {
            assert_eq!(named(good).unwrap().value.triangles(), TRIANGLES, "{good}");
        }
        for bad in [
            "/etc/passwd",
            "../a.bin",
            "sub/../../a.bin",
            "%2e%2e/a.bin",
            "%2fetc/passwd",
            "C:/a.bin",
            "file:///etc/passwd",
            "https://example.org/a.bin",
            "",
        ] {
            let error = named(bad).unwrap_err();
            assert!(matches!(error, MeshReadError::Outside { .. }), "{bad}: {error}");
        }
        let error = named("missing.bin").unwrap_err().to_string();
        assert!(error.contains("cannot open missing.bin") && error.contains("beside"), "{error}");
        let error = named("data:;base64,????").unwrap_err().to_string();
        assert!(error.contains("`buffers[0].uri` is damaged base64"), "{error}");
        let error = named("data:,abc").unwrap_err().to_string();
        assert!(error.contains("base64"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn links_that_lead_out_are_not_followed() {
        let root = tempfile::tempdir().unwrap();
        let inside = root.path().join("in");
        std::fs::create_dir(&inside).unwrap();
        std::fs::write(root.path().join("secret.bin"), gltf_buffer()).unwrap();
        std::fs::write(inside.join("good.bin"), gltf_buffer()).unwrap();
        std::os::unix::fs::symlink("../secret.bin", inside.join("link.bin")).unwrap();
        for (name, good) in [("good.bin", true), ("link.bin", false)] {
            let path = inside.join("a.gltf");
            std::fs::write(&path, gltf_json(&format!("\"uri\":\"{name}\","))).unwrap();
            let result = read_mesh(&path, &MeshReadOptions::default());
            assert_eq!(result.is_ok(), good, "{name}");
            assert!(good || matches!(result, Err(MeshReadError::Outside { .. })));
        }
    }
}

#[test]
fn files_are_written_whole_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.ply", "a.STL", "a.obj"] {
        let path = folder.path().join(name);
        write_mesh(&path, &tetrahedron(), WrittenSpace::Unsaid).unwrap();
        let loaded = read_mesh(&path, &MeshReadOptions::default()).unwrap();
        let t = Topology::new(&loaded.value);
        assert!(t.is_closed() && (t.volume - 1.0 / 6.0).abs() < 1e-6, "{name}");
        assert!(
            read("x.gz", &gzip(&std::fs::read(&path).unwrap())).is_ok() || name == "a.obj" || name == "a.STL"
        );
    }
    let error = write_mesh(&folder.path().join("a.glb"), &tetrahedron(), WrittenSpace::Unsaid).unwrap_err();
    assert!(matches!(error, MeshWriteError::Format(_)));
    let error = write_mesh(&folder.path().join("no/a.ply"), &tetrahedron(), WrittenSpace::Unsaid)
        .unwrap_err()
        .to_string();
    assert!(error.contains("no/a.ply") && error.contains("does not exist"), "{error}");
    assert!(encode_mesh(&tetrahedron(), MeshFormat::Gltf, WrittenSpace::Unsaid, &mut Vec::new()).is_err());
}

#[test]
fn meshes_above_the_limit_are_refused() {
    let options = MeshReadOptions { limits: Limits { max_bytes: 90 }, ..MeshReadOptions::default() };
    for (name, bytes) in all() {
        let error = read_mesh_bytes(name, &bytes, &MemoryFolder::new(), &options).unwrap_err();
        assert!(matches!(error, MeshReadError::TooLarge { limit: 90, .. }), "{name}: {error}");
    }
}

proptest! {
    /// Vertices and triangles come back as they were: all of them from PLY and OBJ, the corners from STL.
    #[test]
    fn what_is_written_is_read(
        vertices in prop::collection::vec(prop::array::uniform3(-1e30f32..1e30), 1..40),
        corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..40),
    ) {
        let triangles: Vec<[u32; 3]> = corners.iter().map(|t| t.map(|i| i.index(vertices.len()) as u32)).collect();
        let mesh = TriangleMesh::new(vertices.into_iter().map(Vec3::from_array).collect(), triangles).unwrap();
        for format in [MeshFormat::Ply, MeshFormat::Obj, MeshFormat::Stl] {
            let mut bytes = Vec::new();
            encode_mesh(&mesh, format, WrittenSpace::Unsaid, &mut bytes).unwrap();
            let name = format!("a.{}", format.name());
            let again = read(&name, &bytes).unwrap().value;
            if format == MeshFormat::Stl {
                prop_assert_eq!(again.triangles().len(), mesh.triangles().len());
                for t in 0..mesh.triangles().len() {
                    let at = |mesh: &TriangleMesh| mesh.triangles()[t].map(|v| mesh.position(v));
                    prop_assert_eq!(at(&again), at(&mesh));
                }
            } else {
                prop_assert_eq!(&again, &mesh);
            }
        }
    }
}
