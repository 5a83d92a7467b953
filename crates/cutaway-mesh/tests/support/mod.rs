//! What the tests and benches of events share. The readers here read the few files that they are used on, no others:
//! they panic where a file is not what it should be.
#![allow(dead_code, reason = "each target uses a part of it")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use cutaway_core::camera::{Camera, Ray, RayGenerator};
use cutaway_core::clip::{Crossing, Event};
use cutaway_core::glam::{DAffine3, DQuat, DVec3, Vec3};
use cutaway_mesh::TriangleMesh;

/// The folder of meshes: beside `CUTAWAY_DATA`'s volumes, or in `../shared/data` beside the repository.
pub(crate) fn mesh_folder() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    std::env::var_os("CUTAWAY_DATA").map_or_else(beside, PathBuf::from).join("meshes")
}

/// An ascii PLY of triangles, a binary STL, or an OBJ.
pub(crate) fn load(path: &Path) -> TriangleMesh {
    let bytes = std::fs::read(path).expect("a readable mesh");
    match path.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase().as_str() {
        "ply" => ply(std::str::from_utf8(&bytes).expect("an ascii PLY")),
        "obj" => obj(std::str::from_utf8(&bytes).expect("an OBJ")),
        _ => stl(&bytes),
    }
}

fn ply(text: &str) -> TriangleMesh {
    let count = |element: &str| {
        let line = text.lines().find(|line| line.starts_with(element)).expect("an element");
        line.split_whitespace().nth(2).and_then(|n| n.parse().ok()).expect("a count")
    };
    let (vertices, faces): (usize, usize) = (count("element vertex"), count("element face"));
    let mut lines = text.lines().skip_while(|line| *line != "end_header").skip(1);
    let numbers =
        |line: &str| line.split_whitespace().map(|n| n.parse().expect("a number")).collect::<Vec<f32>>();
    let vertices = (&mut lines).take(vertices).map(|line| Vec3::from_slice(&numbers(line))).collect();
    let triangles = lines.take(faces).map(|line| [1, 2, 3].map(|i| numbers(line)[i] as u32)).collect();
    TriangleMesh::new(vertices, triangles).expect("a mesh")
}

fn obj(text: &str) -> TriangleMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        if fields.first() == Some(&"v") {
            vertices.push(Vec3::from_array([1, 2, 3].map(|i| fields[i].parse().expect("a number"))));
        } else if fields.first() == Some(&"f") {
            let index =
                |f: &str| f.split('/').next().and_then(|n| n.parse::<u32>().ok()).expect("an index") - 1;
            triangles.extend(
                (2..fields.len() - 1).map(|i| [index(fields[1]), index(fields[i]), index(fields[i + 1])]),
            );
        }
    }
    TriangleMesh::new(vertices, triangles).expect("a mesh")
}

/// Corners within a millionth of the largest coordinate are one vertex: as numbers, they often differ in the last digit.
fn stl(bytes: &[u8]) -> TriangleMesh {
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let count = u32::from_le_bytes(bytes[80..84].try_into().expect("four bytes"));
    let corner = |i: u32| {
        let at = 84 + (i / 3) as usize * 50 + 12 + (i % 3) as usize * 12;
        Vec3::new(float(at), float(at + 4), float(at + 8))
    };
    let largest = (0..3 * count).map(|i| corner(i).abs().max_element()).fold(0.0, f32::max);
    let (mut vertices, mut numbers) = (Vec::new(), HashMap::new());
    let mut index = |i: u32| {
        let cell = (corner(i).as_dvec3() / (1e-6 * f64::from(largest))).round().as_ivec3();
        *numbers.entry(cell).or_insert_with(|| {
            vertices.push(corner(i));
            (vertices.len() - 1) as u32
        })
    };
    let triangles = (0..count).map(|t| [0, 1, 2].map(|k| index(3 * t + k))).collect();
    TriangleMesh::new(vertices, triangles).expect("a mesh")
}

/// Corners of the box around a mesh.
pub(crate) fn bounds(mesh: &TriangleMesh) -> [DVec3; 2] {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for vertex in 0..mesh.vertices().len() as u32 {
        low = low.min(mesh.position(vertex));
        high = high.max(mesh.position(vertex));
    }
    [low, high]
}

/// A camera that looks at the mesh's box, filling most of an image, and its rays.
pub(crate) fn view(mesh: &TriangleMesh, forward: DVec3, size: [u32; 2], orthographic: bool) -> RayGenerator {
    let [low, high] = bounds(mesh);
    let corners: Vec<DVec3> = (0..8)
        .map(|i| DVec3::select(cutaway_core::glam::BVec3::new(i & 1 == 1, i & 2 == 2, i & 4 == 4), high, low))
        .collect();
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let mut camera = Camera::framing(&corners, forward, DVec3::Z, aspect, 1.05);
    if orthographic {
        camera.orthographic = Some((high - low).length() * 0.5);
    }
    camera.rays(size[0], size[1])
}

/// Numbers by SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Between 0 and 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In the cube between -1 and 1.
    pub(crate) fn cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.cube();
            if (1e-3..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    pub(crate) fn index(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    pub(crate) fn pose(&mut self) -> DAffine3 {
        let axis = self.direction();
        let rotation = DQuat::from_axis_angle(axis, self.unit() * 6.0);
        let scale = DVec3::new(self.unit(), self.unit(), self.unit()) + 0.5;
        DAffine3::from_scale_rotation_translation(scale, rotation, self.cube())
    }

    /// A ray towards a point, from near or far, before or behind.
    pub(crate) fn towards(&mut self, target: DVec3, size: f64) -> Ray {
        let direction = self.direction() * (0.1 + self.unit());
        Ray { origin: target - direction * (self.unit() * 8.0 - 2.0) * size, direction }
    }
}

/// What is wrong with the events of a line through a closed surface: not as many ways in as out, or, where the surface
/// does not meet itself, not in, out, in, out. Events closer than `tolerance` may come in either order.
pub(crate) fn fault(events: &[Event], tolerance: f64, alternate: bool) -> Option<String> {
    let step = |e: &Event| if e.crossing == Crossing::Entering { 1 } else { -1 };
    if events.iter().map(step).sum::<i32>() != 0 {
        return Some(format!("unbalanced: {events:?}"));
    }
    let mut inside = 0;
    for (i, event) in events.iter().enumerate() {
        inside += step(event);
        let together = events.get(i + 1).is_some_and(|next| next.t - event.t <= tolerance);
        if alternate && !together && !(0..=1).contains(&inside) {
            return Some(format!("{inside} deep after {i}: {events:?}"));
        }
    }
    None
}
