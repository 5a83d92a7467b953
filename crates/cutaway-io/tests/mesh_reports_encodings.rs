//! Text of meshes in other encodings, and glTF files that were once refused or read wrongly. Numbers are those of the
//! reports that they come from.

mod mesh_report_support;
mod mesh_samples;

use cutaway_io::limits::Limits;
use cutaway_io::mesh::{MeshReadError, MeshReadOptions, read_mesh_bytes};
use cutaway_io::volume::MemoryFolder;
use mesh_report_support::*;
use mesh_samples::gzip;

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
