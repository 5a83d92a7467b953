//! Polygons, taken apart into triangles.

use cutaway_core::glam::{DVec2, DVec3, Vec3};

/// Corners that are held against candidates for ears, in all polygons together; under a second.
const BUDGET: usize = 50_000_000;

/// Takes polygons apart by cutting off ears in the plane that fits each best.
///
/// Cutting takes up to quadratic time. What all polygons of one clipper may take together is limited: once that is used
/// up, polygons are left as they are, for the caller to make fans of.
#[derive(Debug)]
pub struct EarClipper {
    budget: usize,
}

impl Default for EarClipper {
    fn default() -> Self {
        Self { budget: BUDGET }
    }
}

impl EarClipper {
    /// Cuts triangles off a polygon of vertices and gives back what is left of it: nothing as a rule; a polygon of four
    /// corners or more where no ear is found, as in polygons that cross themselves or are nothing but a line. All triangles
    /// run along the polygon in its direction.
    pub fn clip(
        &mut self,
        mut polygon: Vec<u32>,
        vertices: &[Vec3],
        triangles: &mut Vec<[u32; 3]>,
    ) -> Vec<u32> {
        if polygon.len() > 3
            && let Some(mut flat) = flattened(&polygon, vertices)
        {
            clip_ears(&mut polygon, &mut flat, triangles, &mut self.budget);
        }
        match polygon[..] {
            [] | [_] | [_, _] => vec![],
            [a, b, c] => {
                triangles.push([a, b, c]);
                vec![]
            }
            _ => polygon,
        }
    }
}

/// The loop in the plane that fits it best (Newell's normal), counter-clockwise, scaled to about 1.
fn flattened(polygon: &[u32], vertices: &[Vec3]) -> Option<Vec<DVec2>> {
    let origin = vertices[polygon[0] as usize].as_dvec3();
    let at = |v: u32| vertices[v as usize].as_dvec3() - origin;
    let size = polygon.iter().map(|&v| at(v).abs().max_element()).fold(0.0, f64::max);
    let at = |v: u32| at(v) / size;
    let ends = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let normal: DVec3 = ends.map(|(&a, &b)| at(a).cross(at(b))).sum();
    let normal = normal.try_normalize()?;
    let (x, y) = normal.any_orthonormal_pair();
    // glam does not say which way round the pair is.
    let y = if x.cross(y).dot(normal) < 0.0 { -y } else { y };
    Some(polygon.iter().map(|&v| DVec2::new(at(v).dot(x), at(v).dot(y))).collect())
}

/// Cuts ears off until a triangle is left, or no ear is found, or the budget is used up.
fn clip_ears(
    polygon: &mut Vec<u32>,
    flat: &mut Vec<DVec2>,
    triangles: &mut Vec<[u32; 3]>,
    budget: &mut usize,
) {
    while polygon.len() > 3 && *budget > 0 {
        // One round: neighbours of a cut ear wait for the next one, or all would be cut into slivers from one corner.
        let n = polygon.len();
        let mut keep = vec![true; n];
        let (mut last, mut left) = (n - 1, n);
        let mut i = 0;
        while i < n && left > 3 && *budget > 0 {
            let next = (i + 1) % n;
            let fresh = keep[last] && keep[next];
            if fresh && is_ear(flat, &keep, [last, i, next], budget) {
                triangles.push([polygon[last], polygon[i], polygon[next]]);
                keep[i] = false;
                left -= 1;
                // The next vertex is the ear's neighbour.
                last = next;
                i += 2;
            } else {
                last = i;
                i += 1;
            }
        }
        if left == n {
            return;
        }
        let mut kept = keep.iter();
        polygon.retain(|_| kept.next().is_some_and(|keep| *keep));
        let mut kept = keep.iter();
        flat.retain(|_| kept.next().is_some_and(|keep| *keep));
    }
}

/// Whether the corner in the middle is convex and no other vertex that is left lies in its triangle or on its edge.
fn is_ear(flat: &[DVec2], keep: &[bool], [last, i, next]: [usize; 3], budget: &mut usize) -> bool {
    let [a, b, c] = [flat[last], flat[i], flat[next]];
    let side = |a: DVec2, b: DVec2, p: DVec2| (b - a).perp_dot(p - a);
    // Flatter than this the corner is straight, as far as rounding can tell.
    const STRAIGHT: f64 = 1e-12;
    if side(a, b, c) <= STRAIGHT * (b - a).length() * (c - b).length() {
        return false;
    }
    *budget = budget.saturating_sub(flat.len());
    let others = (0..flat.len()).filter(|j| keep[*j] && ![last, i, next].contains(j));
    !others.map(|j| flat[j]).any(|p| side(a, b, p) >= 0.0 && side(b, c, p) >= 0.0 && side(c, a, p) >= 0.0)
}
