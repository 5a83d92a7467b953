//! Oddities that other readers of the same formats accept.

mod mesh_samples;

use cutaway_io::mesh::{MeshReadOptions, read_mesh_bytes};
use cutaway_io::volume::MemoryFolder;
use cutaway_mesh::Topology;
use mesh_samples::{glb, gltf_buffer, gltf_json, obj, ply_ascii, ply_binary, stl_text};

/// Changes a sample of the tetrahedron; what is read stays the same, without a notice.
#[track_caller]
fn assert_still_read(name: &str, bytes: &[u8], changes: &[(&str, &str)]) {
    let mut text = String::from_utf8(bytes.to_vec()).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{from} is not in {name}");
        text = text.replace(from, to);
    }
    assert_tetrahedron(name, text.as_bytes());
}

#[track_caller]
fn assert_tetrahedron(name: &str, bytes: &[u8]) {
    let loaded = read_mesh_bytes(name, bytes, &MemoryFolder::new(), &MeshReadOptions::default());
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let t = Topology::new(&loaded.value);
    let scale = if name.contains("gl") { 8.0 } else { 1.0 };
    assert!(t.is_closed() && (t.volume - scale / 6.0).abs() < 1e-9, "{name}: {t:?}");
    assert_eq!((t.triangles, loaded.notices), (4, vec![]));
}

#[test]
fn numbers_may_be_written_as_fortran_does() {
    assert_still_read("a.stl", &stl_text(), &[("1e0", "0.1D+01"), ("vertex 1 ", "vertex 1.0d0 ")]);
    assert_still_read("a.obj", &obj(), &[("v 1 0", "v 1.D0 0d0")]);
    assert_still_read("a.ply", &ply_ascii(), &[("\n1 255", "\n1.0D+00 255")]);
}

#[test]
fn whole_numbers_may_be_written_with_a_point() {
    assert_still_read("a.obj", &obj(), &[("f 1 3 2", "f 1.0 3.0 2.00")]);
    assert_still_read(
        "a.ply",
        &ply_ascii(),
        &[("element vertex 4", "element vertex 4.0"), ("3 0 2 1", "3.0 0.0 2 1")],
    );
    let json = gltf_json("");
    let changed = json
        .replace("\"count\":4", "\"count\":4.0")
        .replace("\"mesh\":0", "\"mesh\":0.0")
        .replace("\"children\":[1]", "\"children\":[1.0]")
        .replace("5126", "5126.0");
    assert_ne!(changed, json);
    assert_tetrahedron("a.glb", &glb(&changed, &gltf_buffer()));
    for wrong in ["4.5", "-4", "-4.0", "1e300"] {
        let json = json.replace("\"count\":4", &format!("\"count\":{wrong}"));
        let bytes = glb(&json, &gltf_buffer());
        let read = read_mesh_bytes("a.glb", &bytes, &MemoryFolder::new(), &MeshReadOptions::default());
        assert!(read.unwrap_err().to_string().contains("expected a whole number"), "{wrong}");
    }
}

#[test]
fn comments_may_follow_numbers_of_obj_files_at_once() {
    assert_still_read("a.obj", &obj(), &[("f 1 3 2", "f 1 3 2#first")]);
    assert_still_read("a.obj", &obj(), &[(" 1.0\n", " 1.0 # w\n")]);
    assert_still_read("a.obj", &obj(), &[("f 1 3 2", "F 1 3 2"), ("v 0 1", "V 0 1")]);
}

#[test]
fn stl_text_may_have_colours_and_comments() {
    assert_still_read(
        "a.stl",
        &stl_text(),
        &[("    endloop", "# a comment\n color 0.1 0.2 0.3\n    endloop")],
    );
}

#[test]
fn ply_files_may_have_64_bit_integers_and_version_1() {
    let changes = [("property int8 extra", "property int64 extra"), ("1.0\ncomment", "1\ncomment")];
    assert_still_read("a.ply", &ply_ascii(), &changes);
    for little in [true, false] {
        // The list of each face in numbers of eight bytes.
        let bytes = ply_binary(little);
        let from = b"property list uchar int vertex_indices";
        let at = bytes.windows(from.len()).position(|w| w == from).unwrap();
        let faces = bytes.len() - 4 * (1 + 3 * 4 + 4);
        let mut wide =
            [&bytes[..at], b"property list uchar uint64 vertex_indices", &bytes[at + from.len()..faces]]
                .concat();
        for face in bytes[faces..].chunks(17) {
            wide.push(face[0]);
            for index in face[1..13].chunks(4) {
                if little {
                    wide.extend([index, &[0; 4]].concat());
                } else {
                    wide.extend([&[0; 4], index].concat());
                }
            }
            wide.extend(&face[13..]);
        }
        assert_tetrahedron("a.ply", &wide);
    }
}

#[test]
fn glb_files_may_be_padded_with_zeros_and_have_strides_of_zero() {
    let json = gltf_json("").replace(r#""byteLength":48"#, r#""byteLength":48,"byteStride":0"#);
    assert_tetrahedron("a.glb", &glb(&format!("{json}\0\0\0"), &gltf_buffer()));
}
