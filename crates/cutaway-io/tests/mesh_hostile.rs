//! Damaged and lying mesh files: every reader ends in a mesh or in one line of text, without a panic.

mod mesh_samples;

use cutaway_io::limits::Limits;
use cutaway_io::mesh::{MeshReadError, MeshReadOptions, read_mesh_bytes};
use cutaway_io::volume::{Loaded, MemoryFolder};
use cutaway_mesh::TriangleMesh;
use mesh_samples::{all, glb, gltf_json};
use proptest::prelude::*;

/// Reads, and asserts what must hold of every result.
fn read(name: &str, bytes: &[u8]) -> Result<Loaded<TriangleMesh>, MeshReadError> {
    let options = MeshReadOptions { limits: Limits { max_bytes: 1 << 20 }, ..MeshReadOptions::default() };
    let result = read_mesh_bytes(name, bytes, &MemoryFolder::new(), &options);
    match &result {
        Ok(loaded) => {
            let (vertices, triangles) = (loaded.value.vertices(), loaded.value.triangles());
            assert!(vertices.iter().all(|v| v.is_finite()), "{name}");
            assert!(triangles.iter().flatten().all(|v| (*v as usize) < vertices.len()), "{name}");
            assert!(loaded.notices.iter().all(|notice| is_one_line(notice)), "{:?}", loaded.notices);
        }
        Err(error) => assert!(is_one_line(&error.to_string()), "{name}: {error}"),
    }
    result
}

fn is_one_line(text: &str) -> bool {
    !text.is_empty() && text.len() < 1500 && !text.chars().any(char::is_control)
}

#[test]
fn files_cut_anywhere_are_errors_or_whole_meshes() {
    for (name, bytes) in all() {
        assert!(read(name, &bytes).is_ok(), "{name}");
        for length in 0..bytes.len() {
            let result = read(name, &bytes[..length]);
            // Text may lose the end of its last number, or whole lines that nothing counts.
            let text = name.contains("ascii")
                || name.contains("strips")
                || name.contains("text")
                || name.contains("obj");
            assert!(text || result.is_err(), "{name} cut to {length} of {} bytes", bytes.len());
        }
    }
}

#[test]
fn cut_text_has_all_its_rows_or_is_refused() {
    for (name, vertices, bytes) in
        [("a.ply", 4, mesh_samples::ply_ascii()), ("a.stl", 0, mesh_samples::stl_text())]
    {
        for length in 0..bytes.len() {
            if let Ok(loaded) = read(name, &bytes[..length]) {
                assert!(loaded.value.vertices().len() >= vertices, "{name} cut to {length}");
                assert!(vertices == 0 || loaded.value.triangles().len() == 4, "{name} cut to {length}");
            }
        }
    }
}

#[test]
fn every_byte_may_lie() {
    for (name, mut bytes) in all() {
        for at in 0..bytes.len() {
            let original = bytes[at];
            for lie in
                [0, 0xff, original ^ 0x80, original.wrapping_add(1), b'9', b'-', b' ', b'\n', b'e', b'"']
            {
                bytes[at] = lie;
                let _ = read(name, &bytes);
            }
            bytes[at] = original;
        }
    }
}

#[test]
fn every_word_may_be_anything() {
    let long = "9".repeat(5000);
    let lies = [
        "",
        "-1",
        "0",
        "nan",
        "inf",
        "-inf",
        "1e999",
        "1e-999",
        "4294967295",
        "4294967296",
        "9223372036854775807",
        "-9223372036854775808",
        "18446744073709551615",
        "99999999999999999999",
        "0x10",
        "1,5",
        "list",
        "vertex",
        "face",
        "end_header",
        "solid",
        "endsolid",
        "f",
        "v",
        "/",
        "//",
        "-",
        "\\",
        "\u{1b}[31m",
        "é€😀",
        "null",
        "[]",
        "{}",
        "[[[[",
        long.as_str(),
    ];
    for (name, bytes) in all().into_iter().filter(|(name, _)| !name.ends_with("gz")) {
        let is_word = |b: &u8| b.is_ascii_alphanumeric() || b"_.-+".contains(b);
        let mut at = 0;
        // In binary files what comes after the header is no words.
        while at < bytes.len().min(1500) {
            let length = bytes[at..].iter().take_while(|b| is_word(b)).count();
            if length > 0 {
                for lie in lies {
                    let changed = [&bytes[..at], lie.as_bytes(), &bytes[at + length..]].concat();
                    let _ = read(name, &changed);
                }
            }
            at += length + 1;
        }
    }
}

#[test]
fn nodes_that_show_a_mesh_again_and_again_are_refused() {
    // Each of 1000 nodes shows 2000 primitives.
    let primitive = r#"{"attributes":{}}"#;
    let primitives = vec![primitive; 2000].join(",");
    let nodes = vec![r#"{"mesh":0}"#; 1000].join(",");
    let roots: Vec<String> = (0..1000).map(|i| i.to_string()).collect();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{}]}}],"nodes":[{nodes}],"meshes":[{{"primitives":[{primitives}]}}]}}"#,
        roots.join(",")
    );
    let options = MeshReadOptions { limits: Limits { max_bytes: 1 << 24 }, ..MeshReadOptions::default() };
    let error =
        read_mesh_bytes("a.glb", &glb(&json, &[]), &MemoryFolder::new(), &options).unwrap_err().to_string();
    assert!(error.contains("primitives so far, expected at most"), "{error}");
    // The tetrahedron a hundred thousand times: above the limit of memory.
    let nodes = vec![r#"{"mesh":0}"#; 100_000].join(",");
    let json = gltf_json("").replace(r#""scene":0,"scenes":[{"nodes":[0]}],"#, "");
    let start = json.find(r#""nodes":["#).unwrap();
    let end = json.find(r#""meshes""#).unwrap();
    let json = format!("{}\"nodes\":[{nodes}],{}", &json[..start], &json[end..]);
    let options = MeshReadOptions { limits: Limits { max_bytes: 60 << 20 }, ..MeshReadOptions::default() };
    let many = glb(&json, &mesh_samples::gltf_buffer());
    assert_eq!(
        read_mesh_bytes("a.glb", &many, &MemoryFolder::new(), &options).unwrap().value.triangles().len(),
        400_000
    );
    let options = MeshReadOptions { limits: Limits { max_bytes: 5 << 20 }, ..MeshReadOptions::default() };
    let error = read_mesh_bytes("a.glb", &many, &MemoryFolder::new(), &options).unwrap_err();
    assert!(matches!(error, MeshReadError::TooLarge { .. }), "{error}");
}

#[test]
fn deep_nesting_is_an_error() {
    let json = format!(r#"{{"asset":{{"version":"2.0"}},"extras":{}}}"#, "[".repeat(100_000));
    assert!(read("a.gltf", json.as_bytes()).is_err());
    // A chain of a thousand nodes is only long.
    let nodes: Vec<String> = (1..1000).map(|i| format!(r#"{{"children":[{i}]}}"#)).collect();
    let nodes = nodes.join(",") + r#",{"mesh":0}"#;
    let json = gltf_json("");
    let start = json.find(r#""nodes":[{"children""#).unwrap();
    let end = json.find(r#""meshes""#).unwrap();
    let json = format!("{}\"nodes\":[{nodes}],{}", &json[..start], &json[end..]);
    assert_eq!(read("a.glb", &glb(&json, &mesh_samples::gltf_buffer())).unwrap().value.triangles().len(), 4);
}

proptest! {
    #[test]
    fn random_bytes_are_no_mesh(bytes in prop::collection::vec(any::<u8>(), 0..2000), start in 0usize..8) {
        let starts: [&[u8]; 8] = [
            b"", b"ply\nformat ascii 1.0\nelement vertex 3\n", b"solid x\nfacet ", b"glTF\x02\0\0\0", b"\x1f\x8b\x08\0",
            b"v 1 2 3\nf ", b"{\"asset\":{\"version\":\"2.0\"},",
            b"ply\nformat binary_big_endian 1.0\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n",
        ];
        let bytes = [starts[start], &bytes].concat();
        for name in ["a.ply", "a.stl", "a.obj", "a.gltf", "a"] {
            let _ = read(name, &bytes);
        }
    }
}
