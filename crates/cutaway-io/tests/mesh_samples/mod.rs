//! Small files of every format that show one tetrahedron, unless their name says otherwise.
#![allow(dead_code, reason = "each test file uses a part of it")]

use std::io::Write;

use flate2::{Compression, write::GzEncoder};

/// Corners of the tetrahedron, and its triangles, outward.
pub(crate) const CORNERS: [[f32; 3]; 4] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
pub(crate) const TRIANGLES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// Text with properties and elements that nobody asked for, and a blank line.
pub(crate) fn ply_ascii() -> Vec<u8> {
    let mut text = "ply\nformat ascii 1.0\ncomment a tetrahedron\nobj_info none\nelement vertex 4\nproperty float x\n\
        property uchar red\nproperty double y\nproperty float z\nproperty list uchar float uv\nelement cloud 2\n\
        property list int short scan\nproperty int64_t_is_no_type_here extra\nelement face 4\n\
        property list uchar int vertex_indices\nproperty float quality\nelement nothing 7\nend_header\n"
        .replace("property int64_t_is_no_type_here extra\n", "property int8 extra\n");
    for [x, y, z] in CORNERS {
        text += &format!("{x} 255 {y} {z} 2 0.5 1e-3\n");
    }
    text += "3 1 2 3 -1\n\n0 7\n";
    for [a, b, c] in TRIANGLES {
        text += &format!("3 {a} {b} {c} 0.25\n");
    }
    text.into_bytes()
}

/// The same in binary.
pub(crate) fn ply_binary(little: bool) -> Vec<u8> {
    let text = ply_ascii();
    let end = text.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(text[..end].to_vec()).unwrap();
    let name = if little { "binary_little_endian" } else { "binary_big_endian" };
    let mut bytes = header.replace("ascii", name).into_bytes();
    let mut put = |mut number: Vec<u8>| {
        if !little {
            number.reverse();
        }
        bytes.extend(number);
    };
    for [x, y, z] in CORNERS {
        put(x.to_le_bytes().to_vec());
        put(vec![255]);
        put(f64::from(y).to_le_bytes().to_vec());
        put(z.to_le_bytes().to_vec());
        put(vec![2]);
        put(0.5f32.to_le_bytes().to_vec());
        put(1e-3f32.to_le_bytes().to_vec());
    }
    for scan in [&[1i16, 2, 3][..], &[]] {
        put((scan.len() as i32).to_le_bytes().to_vec());
        scan.iter().for_each(|s| put(s.to_le_bytes().to_vec()));
        put(vec![255]);
    }
    for triangle in TRIANGLES {
        put(vec![3]);
        triangle.iter().for_each(|v| put(v.to_le_bytes().to_vec()));
        put(0.25f32.to_le_bytes().to_vec());
    }
    bytes
}

/// Vertices after faces, one strip after another.
pub(crate) fn ply_strips() -> Vec<u8> {
    // 0 2 1 3 is 021 and 123 (turned); the other strip likewise.
    "ply\nformat ascii 1.0\nelement tristrips 1\nproperty list int int vertex_indices\nelement vertex 4\n\
     property float x\nproperty float y\nproperty float z\nend_header\n9 0 2 1 3 -1 1 3 0 2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
        .into()
}

pub(crate) fn stl_text() -> Vec<u8> {
    let mut text = String::new();
    for (i, half) in TRIANGLES.chunks(2).enumerate() {
        text += &format!("{} part {i} of facet\n", if i == 0 { "solid" } else { "SOLID" });
        for triangle in half {
            text += "  facet normal nan 0 0\n    Outer Loop\n";
            for v in triangle {
                let [x, y, z] = CORNERS[*v as usize];
                text += &format!("      vertex {x} {y:e} -{z}\n").replace("-0", "-0.0").replace("-1", "1");
            }
            text += "    endloop\r\n  ENDFACET\n";
        }
        text += "endsolid part\n\n";
    }
    text.into_bytes()
}

/// Binary, with a header of one's choice.
pub(crate) fn stl_binary(header: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend(4u32.to_le_bytes());
    for triangle in TRIANGLES {
        bytes.extend([0; 12]);
        for v in triangle {
            CORNERS[v as usize].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
        }
        bytes.extend([0xff; 2]);
    }
    bytes
}

pub(crate) fn obj() -> Vec<u8> {
    let mut text = "# a tetrahedron\r\nmtllib none.mtl\no tetra\nvt 0 0\nvn 0 0 1\n".to_owned();
    for [x, y, z] in CORNERS {
        text += &format!("v {x} {y} \\\n {z} 1.0\n");
    }
    // Each way to name a corner.
    text += "usemtl none\ns off\nf 1 3 2\nf 1/1 2/1 4/1 # a comment\nf 1//1 4//1 3//1\nf -3/-1/-1 -2/-1/-1 -1/-1/-1\nl 1 2\n";
    text.into_bytes()
}

/// Positions of all corners, then 16-bit indices.
pub(crate) fn gltf_buffer() -> Vec<u8> {
    let mut bytes: Vec<u8> = CORNERS.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    bytes.extend(TRIANGLES.iter().flatten().flat_map(|v| (*v as u16).to_le_bytes()));
    bytes
}

/// The JSON, with the buffer's `uri` field, or nothing, in it.
pub(crate) fn gltf_json(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"children":[1],"scale":[2,2,2]}},
        {{"mesh":0,"translation":[1,0,0],"rotation":[0,0,0,1]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,
        "NORMAL":99}},"indices":1}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}],"bufferViews":[{{"buffer":0,"byteLength":48}},
        {{"buffer":0,"byteOffset":48,"byteLength":24}}],"buffers":[{{{uri}"byteLength":72}}]}}"#
    )
}

pub(crate) fn gltf_embedded() -> Vec<u8> {
    let data = base64::Engine::encode(&base64::engine::general_purpose::STANDARD_NO_PAD, gltf_buffer());
    gltf_json(&format!(r#""uri":"data:application/octet-stream;base64,{data}","#)).into_bytes()
}

/// A GLB file of any JSON and binary chunk.
pub(crate) fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((12 + 8 + json.len() as u32 + 8 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.as_slice()), (b"BIN\0", binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// Every sample, by a name that says its format.
pub(crate) fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("ascii.ply", ply_ascii()),
        ("little.ply", ply_binary(true)),
        ("big.ply", ply_binary(false)),
        ("strips.ply", ply_strips()),
        ("text.stl", stl_text()),
        ("binary.stl", stl_binary(b"made by hand")),
        ("solid.stl", stl_binary(b"solid as a rock, facet by facet")),
        ("a.obj", obj()),
        ("embedded.gltf", gltf_embedded()),
        ("a.glb", glb(&gltf_json(""), &gltf_buffer())),
        ("a.ply.gz", gzip(&ply_binary(true))),
        ("text.stl.gz", gzip(&stl_text())),
        ("a.obj.gz", gzip(&obj())),
        ("a.glb.gz", gzip(&glb(&gltf_json(""), &gltf_buffer()))),
    ]
}
