//! The surface of missing cells as a mesh, for engines that clip by meshes only.

use std::collections::HashMap;

use cutaway_core::clip::MissingCells;
use cutaway_core::glam::{IVec3, UVec3, Vec3};

use crate::TriangleMesh;

/// Returns the faces between missing cells and others, in voxel space, two triangles each, closed and outward.
///
/// # Panics
/// Never: the triangles name vertices that exist.
pub fn missing_cells(cells: &MissingCells) -> TriangleMesh {
    let size = cells.dimensions();
    let is_missing = |cell: IVec3| {
        cell.cmpge(IVec3::ZERO).all() && cell.cmplt(size.as_ivec3()).all() && cells.contains(cell.as_uvec3())
    };
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let mut numbers: HashMap<UVec3, u32> = HashMap::new();
    let mut number = |p: IVec3| {
        let p = p.as_uvec3();
        *numbers.entry(p).or_insert_with(|| {
            vertices.push(p.as_vec3());
            vertices.len() as u32 - 1
        })
    };
    let axes = [IVec3::X, IVec3::Y, IVec3::Z];
    for z in 0..size.z {
        for y in 0..size.y {
            for x in 0..size.x {
                let cell = UVec3::new(x, y, z).as_ivec3();
                if !is_missing(cell) {
                    continue;
                }
                for axis in 0..3 {
                    let [out, u, v] = [axes[axis], axes[(axis + 1) % 3], axes[(axis + 2) % 3]];
                    if !is_missing(cell + out) {
                        let [a, b, c, d] = [out, out + u, out + u + v, out + v].map(|p| number(cell + p));
                        triangles.extend([[a, b, c], [a, c, d]]);
                    }
                    if !is_missing(cell - out) {
                        let [a, b, c, d] = [IVec3::ZERO, v, u + v, u].map(|p| number(cell + p));
                        triangles.extend([[a, b, c], [a, c, d]]);
                    }
                }
            }
        }
    }
    let vertices: Vec<Vec3> = vertices;
    TriangleMesh::new(vertices, triangles).expect("triangles of vertices that were made for them")
}
