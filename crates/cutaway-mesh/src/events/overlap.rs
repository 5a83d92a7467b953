//! Whether a triangle and a box overlap: separating axes, after Akenine-Möller, "Fast 3D triangle-box overlap
//! testing", Journal of Graphics Tools 6(1), 2001.

use cutaway_core::glam::DVec3;

/// Whether the triangle and the box with this centre and these half sides share a point; a touch counts.
pub(super) fn triangle_meets_box(corners: &[DVec3; 3], center: DVec3, half: DVec3) -> bool {
    let [a, b, c] = corners.map(|corner| corner - center);
    if a.min(b).min(c).cmpgt(half).any() || a.max(b).max(c).cmplt(-half).any() {
        return false;
    }
    let edges = [b - a, c - b, a - c];
    let normal = edges[0].cross(edges[1]);
    if normal.dot(a).abs() > normal.abs().dot(half) {
        return false;
    }
    edges.iter().all(|edge| {
        [DVec3::X, DVec3::Y, DVec3::Z].iter().all(|axis| {
            let across = axis.cross(*edge);
            let reach = across.abs().dot(half);
            let [p, q, r] = [across.dot(a), across.dot(b), across.dot(c)];
            p.min(q).min(r) <= reach && p.max(q).max(r) >= -reach
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_point_of_the_triangle_in_the_box_is_an_overlap(
            v in prop::array::uniform9(-3f64..3.0), u in 0f64..1.0, w in 0f64..1.0,
        ) {
            let corners = [DVec3::from_slice(&v[0..3]), DVec3::from_slice(&v[3..6]), DVec3::from_slice(&v[6..9])];
            let (u, w) = if u + w > 1.0 { (1.0 - u, 1.0 - w) } else { (u, w) };
            let point = corners[0] * (1.0 - u - w) + corners[1] * u + corners[2] * w;
            if point.abs().max_element() <= 1.0 {
                prop_assert!(triangle_meets_box(&corners, DVec3::ZERO, DVec3::splat(1.0 + 1e-12)));
            }
        }
    }

    #[test]
    fn a_triangle_across_a_corner_does_not_meet_the_box() {
        // Its bounding box overlaps; its plane x + y + z = 3.3 passes the corner (1, 1, 1) outside.
        let corners = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * 3.3);
        assert!(!triangle_meets_box(&corners, DVec3::ZERO, DVec3::ONE));
        assert!(triangle_meets_box(&corners.map(|c| c * 0.9), DVec3::ZERO, DVec3::ONE));
    }
}
