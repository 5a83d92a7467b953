//! What lying mesh files make the readers allocate: next to nothing. A test binary of its own, for it watches the
//! allocator.

mod mesh_samples;

use cutaway_io::limits::Limits;
use cutaway_io::mesh::{MeshReadOptions, read_mesh_bytes};
use cutaway_io::volume::MemoryFolder;
use cutaway_mesh::{RepairOptions, TriangleMesh, repair};
use glam::Vec3;
use mesh_samples::{glb, gltf_buffer, gltf_json, gzip, stl_binary};
use peak_alloc::PeakAlloc;

#[global_allocator]
static PEAK: PeakAlloc = PeakAlloc;

/// More than any reader needs for buffers and decoders, far less than what the headers here claim.
const ALLOWED: usize = 12 << 20;

fn ply(format: &str, vertices: u64, faces: u64, rest: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uint int vertex_indices\nend_header\n"
    );
    [header.as_bytes(), rest].concat()
}

/// Small files that claim gigabytes, all below the limit.
fn liars() -> Vec<(&'static str, Vec<u8>)> {
    let some = vec![0u8; 100_000];
    let many = 1 << 33;
    let mut count = stl_binary(b"");
    count[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    // One face of four thousand million corners.
    let long_list = [&[0u8; 12][..], &u32::MAX.to_le_bytes(), &some].concat();
    vec![
        ("a.ply", ply("ascii", many, 1, b"0 0 0\n")),
        ("a.ply", ply("ascii", 1, many, b"0 0 0\n3 0 0 0\n")),
        ("a.ply", ply("binary_little_endian", many, 1, &some)),
        ("a.ply", ply("binary_big_endian", 1, u64::MAX, &some)),
        ("a.ply", ply("binary_little_endian", 1, 1, &long_list)),
        // Zeros of a compressed file, up to deflate's largest ratio.
        ("a.ply", gzip(&ply("binary_little_endian", 1_000_000, 1, &some))),
        ("a.ply", gzip(&ply("binary_little_endian", 1, 1_000_000, &some))),
        ("a.ply", gzip(&ply("binary_little_endian", 1, 1, &long_list))),
        ("a.stl", count.clone()),
        ("a.stl", gzip(&count)),
        ("a.obj", b"v 0 0 0\nf 1 1 4294967295\n".to_vec()),
        ("a.glb", glb(&gltf_json("").replace("\"count\":4", "\"count\":4000000000"), &gltf_buffer())),
        ("a.glb", glb(&gltf_json("\"uri\":\"x\",").replace(":72", ":4000000000"), &[])),
        // A line without an end.
        ("a.obj", gzip(&[b'v'; 64 << 20])),
        ("a.stl", gzip(&[&b"solid x\n"[..], &vec![b'x'; 64 << 20]].concat())),
    ]
}

#[test]
fn nothing_is_allocated_for_data_that_are_not_there() {
    let options = MeshReadOptions { limits: Limits { max_bytes: 1 << 40 }, ..MeshReadOptions::default() };
    for (i, (name, bytes)) in liars().into_iter().enumerate() {
        PEAK.reset_peak_usage();
        let before = PEAK.current_usage();
        let result = read_mesh_bytes(name, &bytes, &MemoryFolder::new(), &options);
        let used = PEAK.peak_usage() - before;
        assert!(used < ALLOWED, "liar {i} ({name}) took {used} bytes: {result:?}");
        // A closed binary STL is read whatever its header counts: many writers leave the count wrong.
        assert!(result.is_err() || name == "a.stl", "liar {i} ({name}) was read");
    }
    bombs_stop_at_the_limit();
    long_faces_stop_at_the_limit();
    repairs_take_little_more_than_the_mesh();
}

/// 64 MiB of glTF in 64 KiB.
fn bombs_stop_at_the_limit() {
    let bomb = gzip(&[&b"glTF"[..], &vec![b' '; 64 << 20]].concat());
    let options = MeshReadOptions { limits: Limits { max_bytes: 1 << 20 }, ..MeshReadOptions::default() };
    PEAK.reset_peak_usage();
    let before = PEAK.current_usage();
    let error = read_mesh_bytes("a.glb", &bomb, &MemoryFolder::new(), &options).unwrap_err().to_string();
    assert!(error.contains("limit"), "{error}");
    assert!(PEAK.peak_usage() - before < ALLOWED, "{}", PEAK.peak_usage() - before);
}

/// 64 MiB of zeros that are one face.
fn long_faces_stop_at_the_limit() {
    let mut count = (64u32 << 20).to_le_bytes().to_vec();
    let header = ply("binary_little_endian", 1, 1, &[0; 12]);
    let header = String::from_utf8(header).unwrap().replace("list uint int", "list uint uchar").into_bytes();
    count.resize(count.len() + (64 << 20), 0);
    let bomb = gzip(&[header, count].concat());
    let options = MeshReadOptions { limits: Limits { max_bytes: 1 << 20 }, ..MeshReadOptions::default() };
    PEAK.reset_peak_usage();
    let before = PEAK.current_usage();
    let error = read_mesh_bytes("a.ply", &bomb, &MemoryFolder::new(), &options).unwrap_err().to_string();
    assert!(error.contains("limit"), "{error}");
    assert!(PEAK.peak_usage() - before < ALLOWED, "{}", PEAK.peak_usage() - before);
}

/// Half a million triangles, in whatever order: at most 200 bytes for each.
fn repairs_take_little_more_than_the_mesh() {
    let n = 500;
    let at = |i: u32, j: u32| (i % n) * n + j % n;
    let vertices = (0..n * n).map(|k| {
        let [(su, cu), (sv, cv)] =
            [k / n, k % n].map(|k| (k as f32 / n as f32 * std::f32::consts::TAU).sin_cos());
        Vec3::new((2.0 + cv) * cu, (2.0 + cv) * su, sv)
    });
    let squares = (0..n * n).map(|k| (k / n, k % n));
    let triangles = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        [[a, b, c], [a, c, d]]
    });
    let mesh = TriangleMesh::new(vertices.collect(), triangles.collect()).unwrap();
    PEAK.reset_peak_usage();
    let before = PEAK.current_usage();
    let repaired = repair(&mesh, &RepairOptions::default()).unwrap();
    let used = PEAK.peak_usage() - before;
    assert_eq!(repaired.mesh.mesh().triangles().len(), mesh.triangles().len());
    assert!(used < 200 * mesh.triangles().len(), "{} bytes a triangle", used / mesh.triangles().len());
}
