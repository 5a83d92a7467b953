//! The basis cell: under parallel rays all cells of a grid look alike, so one is projected, on the host, once a frame (Maximo,
//! section 4.1). The vertex shader puts it at every cell's place.

use bytemuck::{Pod, Zeroable};
use cutaway_core::glam::{DVec3, DVec4};
use cutaway_core::tetrahedra::five_of_a_cell;

use super::options::Split;
use super::view::CellCamera;

/// As `Basis` in `draw.wgsl`; a test holds the two against each other.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct BasisTetrahedron {
    pub(crate) thick: [f32; 4],
    pub(crate) near: [f32; 4],
    pub(crate) far: [f32; 4],
    pub(crate) ring: [u32; 4],
}

/// The tetrahedra of a cell of parity 0 and of one of parity 1, six places each.
pub(crate) fn basis(view: &CellCamera, split: Split) -> [BasisTetrahedron; 12] {
    std::array::from_fn(|i| {
        let (parity, tet) = (i as u32 / 6, i % 6);
        match split {
            Split::Five if tet < 5 => project(view, five_of_a_cell(parity)[tet]),
            Split::Six => project(view, six_of_a_cell()[tet]),
            Split::Five => BasisTetrahedron::zeroed(),
        }
    })
}

/// Corners of the six tetrahedra around a cell's diagonal, in the order of `path` in `lattice.wgsl`.
fn six_of_a_cell() -> [[u32; 4]; 6] {
    [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]]
        .map(|[a, b]: [u32; 2]| [0, 1 << a, (1 << a) | (1 << b), 7])
}

/// The projection of one tetrahedron, as `project.wgsl` does it, which also says why.
fn project(view: &CellCamera, corners: [u32; 4]) -> BasisTetrahedron {
    let p = corners.map(|c| {
        let at = DVec3::new(f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2));
        // From the cell's first corner: without the rows' constants.
        DVec3::from_array(view.rows.map(|row| row.truncate().dot(at)))
    });
    let orientation = |a: DVec3, b: DVec3, c: DVec3| (b - a).truncate().perp_dot((c - a).truncate());
    let a = DVec4::new(
        orientation(p[1], p[2], p[3]),
        -orientation(p[0], p[2], p[3]),
        orientation(p[0], p[1], p[3]),
        -orientation(p[0], p[1], p[2]),
    );
    // What is edge-on but for rounding.
    let size = p.iter().map(|q| q.truncate().length_squared()).fold(0.0, f64::max);
    let a = DVec4::from_array(a.to_array().map(|v| if v.abs() < 1e-12 * size { 0.0 } else { v }));
    let (plus, minus) = (a.max(DVec4::ZERO), (-a).max(DVec4::ZERO));
    let (plus_sum, minus_sum) = (plus.element_sum(), minus.element_sum());
    if plus_sum.min(minus_sum) <= 0.0 {
        return BasisTetrahedron::zeroed();
    }
    let (mut near, mut far) = (plus / plus_sum, minus / minus_sum);
    let place = |weights: DVec4| (0..4).map(|k| p[k] * weights[k]).sum::<DVec3>();
    if place(near).z > place(far).z {
        (near, far) = (far, near);
    }
    let positive = (0..4).filter(|k| a[*k] >= 0.0).fold(0, |bits, k| bits | 1 << k);
    let single = |v: DVec4| v.as_vec4().to_array();
    let thick = place(near);
    BasisTetrahedron {
        thick: [thick.x as f32, thick.y as f32, thick.z as f32, place(far).z as f32],
        near: single(near),
        far: single(far),
        ring: ring(positive),
    }
}

/// The border's points in order, by which ones are positive.
fn ring(positive: u32) -> [u32; 4] {
    match positive.min(15 - positive) {
        1 => [1, 2, 3, 3],
        2 => [0, 2, 3, 3],
        4 => [0, 1, 3, 3],
        7 => [0, 1, 2, 2],
        3 => [0, 2, 1, 3],
        5 => [0, 1, 2, 3],
        _ => [0, 1, 3, 2],
    }
}
