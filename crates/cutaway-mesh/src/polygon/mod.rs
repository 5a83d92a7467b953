//! Polygons, taken apart into triangles.
//!
//! Input: a polygon as a list of vertices. It may touch itself: a face with holes is one polygon that runs to each hole and
//! back along one line, so that corners are named twice, or lie at one place, and edges run along others. Output: triangles
//! that cover the polygon and nothing else, and use every edge of it once.
//!
//! A corner is cut off as an *ear* if it is convex, no edge of the polygon enters its triangle, and the polygon winds around
//! the triangle. Edges may touch the triangle or run along its sides, so that corners that are named twice are harmless. Every polygon that does not cross itself falls apart this way, once corners without area (doubled, straight,
//! at the tip of a line) are cut off where nothing else is left to cut.

mod ring;

use cutaway_core::glam::{DVec2, DVec3};
use ring::Ring;

/// Corners that are checked against candidates for ears, in all polygons together; about a second.
const BUDGET: usize = 50_000_000;

/// Largest depth, relative to the polygon's size, to which an edge may enter an ear. The first is what rounding in `f64`
/// takes. The others are for polygons that cross themselves a little because their coordinates were rounded, or because
/// they are not flat.
const SLACK: [f64; 3] = [1e-12, 1e-7, 1e-4];

/// Takes polygons apart by cutting off ears in the plane that fits each polygon best.
///
/// Cutting takes up to quadratic time. The work of all polygons of one clipper together is limited: once the limit is
/// reached, polygons are left as they are, for the caller to make fans of.
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
    /// Cuts triangles off a polygon of vertices at these positions and returns what is left of it: as a rule nothing; a polygon of four
    /// corners or more where no ear is found, as in polygons that cross themselves or are nothing but a line. All triangles
    /// run along the polygon in its direction; those that would name a vertex twice are left out, because their edges
    /// cancel.
    pub fn clip(
        &mut self,
        mut polygon: Vec<u32>,
        position: &impl Fn(u32) -> DVec3,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Vec<u32> {
        if polygon.len() > 3
            && let Some(flat) = flattened(&polygon, position)
        {
            let mut ring = Ring::new(polygon, flat);
            clip_ears(&mut ring, triangles, &mut self.budget);
            polygon = ring.into_rest();
        }
        match polygon[..] {
            [] | [_] | [_, _] => vec![],
            [a, b, c] => {
                push([a, b, c], triangles);
                vec![]
            }
            _ => polygon,
        }
    }
}

/// Adds a triangle unless it names a vertex twice.
fn push([a, b, c]: [u32; 3], triangles: &mut Vec<[u32; 3]>) {
    if a != b && b != c && c != a {
        triangles.push([a, b, c]);
    }
}

/// Returns the corners in the plane that fits the polygon best (Newell's normal), counter-clockwise, scaled to about 1;
/// `None` for a polygon without area.
fn flattened(polygon: &[u32], position: &impl Fn(u32) -> DVec3) -> Option<Vec<DVec2>> {
    let origin = position(polygon[0]);
    let at = |v: u32| position(v) - origin;
    let size = polygon.iter().map(|&v| at(v).abs().max_element()).fold(0.0, f64::max);
    let at = |v: u32| at(v) / size;
    let ends = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let normal: DVec3 = ends.map(|(&a, &b)| at(a).cross(at(b))).sum();
    // Less is nothing but rounding, and has no direction.
    const LINE: f64 = 1e-13;
    let normal = Some(normal).filter(|n| n.length() > LINE)?.try_normalize()?;
    let (x, y) = normal.any_orthonormal_pair();
    // glam does not say which way round the pair is.
    let y = if x.cross(y).dot(normal) < 0.0 { -y } else { y };
    Some(polygon.iter().map(|&v| DVec2::new(at(v).dot(x), at(v).dot(y))).collect())
}

/// Cuts corners off until a triangle is left, or no corner can be cut, or the budget is used up.
fn clip_ears(ring: &mut Ring, triangles: &mut Vec<[u32; 3]>, budget: &mut usize) {
    ring.cut_doubled_corners(triangles);
    for slack in SLACK {
        while ring.len() > 3 && *budget > 0 {
            if !ring.cut_ears(slack, triangles, budget) && !ring.cut_flat_corner(triangles) {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests;
