//! Boxes as programs write them, and what is read of them.
#![allow(dead_code, reason = "each test file uses a part of it")]

use cutaway_io::mesh::{MeshReadError, MeshReadOptions, read_mesh_bytes};
use cutaway_io::volume::{Loaded, MemoryFolder};
use cutaway_mesh::{Topology, TriangleMesh};

use crate::mesh_samples::{glb, gzip};

pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<Loaded<TriangleMesh>, MeshReadError> {
    read_mesh_bytes(name, bytes, &MemoryFolder::new(), &MeshReadOptions::default())
}

pub(crate) fn counted(name: &str, bytes: &[u8]) -> (Topology, Vec<String>) {
    let loaded = read(name, bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
    (Topology::new(&loaded.value), loaded.notices)
}

/// Corners and outward faces of the box from 0 to `size`.
pub(crate) fn cuboid(size: [f64; 3]) -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|b| b as f64);
    let corners = (0..8).map(corner).map(|c| [0, 1, 2].map(|axis| c[axis] * size[axis])).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (corners, faces.map(|face| face.to_vec()).to_vec())
}

pub(crate) fn triangles(faces: &[Vec<usize>]) -> Vec<[usize; 3]> {
    faces.iter().flat_map(|f| (1..f.len() - 1).map(|i| [f[0], f[i], f[i + 1]])).collect()
}

pub(crate) fn obj(corners: &[[f64; 3]], faces: &[Vec<usize>]) -> String {
    let mut text = String::new();
    corners.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\n"));
    for face in faces {
        let names: Vec<String> = face.iter().map(|v| (v + 1).to_string()).collect();
        text += &format!("f {}\n", names.join(" "));
    }
    text
}

pub(crate) fn ply(corners: &[[f64; 3]], faces: &[Vec<usize>], comment: &str) -> String {
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

pub(crate) fn stl_text(corners: &[[f64; 3]], faces: &[Vec<usize>], name: &str, end: &str) -> String {
    let mut text = format!("solid {name}\n");
    for face in faces {
        text += " facet normal 0 0 0\n  outer loop\n";
        face.iter().map(|v| corners[*v]).for_each(|[x, y, z]| text += &format!("   vertex {x} {y} {z}\n"));
        text += "  endloop\n endfacet\n";
    }
    text + end
}

#[track_caller]
pub(crate) fn assert_box(t: &Topology) {
    assert!(t.is_closed(), "{t:?}");
    assert_eq!((t.used_vertices, t.triangles, t.area, t.volume), (8, 12, 22.0, 6.0));
}

/// A box as glTF: its positions are what `accessor` says, with a list of numbers and a list of positions behind the box's.
pub(crate) fn gltf_box(accessor: &str, indices: &[u16], values: &[[f32; 3]]) -> Vec<u8> {
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

/// The box that lies at x 1 to 3, y 0.5 to 3.5, z -1 to 2 in RAS, as LPS has it.
pub(crate) fn lps_box() -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let (corners, faces) = cuboid([2.0, 3.0, 3.0]);
    (shifted(&corners, [-3.0, -3.5, -1.0]), faces)
}

/// The same box in every format that names its axes, with these words in its header.
pub(crate) fn saying(words: &str) -> Vec<(&'static str, Vec<u8>)> {
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

pub(crate) fn shifted(corners: &[[f64; 3]], by: [f64; 3]) -> Vec<[f64; 3]> {
    corners.iter().map(|c| [0, 1, 2].map(|axis| c[axis] + by[axis])).collect()
}
