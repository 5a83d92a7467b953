//! The cells of a grid that have no value, as a solid: cutting them away shows nothing there, in every engine that clips.
//!
//! Its space is that of voxels. Its surface is no surface of anything: it is neither lit nor drawn nor closed by caps.

use glam::{DVec3, UVec3};

use super::{Crossing, Event, Solid};
use crate::camera::Ray;

/// Some cells of a grid of voxels.
#[derive(Clone, Debug)]
pub struct MissingCells {
    /// Cells along x, y and z: one fewer than voxels.
    dimensions: UVec3,
    /// One bit per cell, x fastest.
    words: Vec<u64>,
}

impl MissingCells {
    /// None of the cells of a grid of so many voxels; none at all where an axis has fewer than two.
    pub(crate) fn none(voxels: UVec3) -> Option<Self> {
        if voxels.min_element() < 2 {
            return None;
        }
        let dimensions = voxels - UVec3::ONE;
        let [x, y, z] = dimensions.to_array().map(|n| n as usize);
        Some(Self { dimensions, words: vec![0; (x * y * z).div_ceil(64)] })
    }

    /// Adds the cells around a voxel.
    pub(crate) fn add_voxel(&mut self, voxel: UVec3) {
        let first = voxel.saturating_sub(UVec3::ONE);
        let last = voxel.min(self.dimensions - UVec3::ONE);
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    let index = self.index(UVec3::new(x, y, z));
                    self.words[index / 64] |= 1 << (index % 64);
                }
            }
        }
    }

    /// Cells along x, y and z.
    pub fn dimensions(&self) -> UVec3 {
        self.dimensions
    }

    /// Returns true if the cell is one of them.
    #[inline]
    pub fn contains(&self, cell: UVec3) -> bool {
        let index = self.index(cell);
        self.words[index / 64] >> (index % 64) & 1 == 1
    }

    fn index(&self, cell: UVec3) -> usize {
        let [x, y, z] = cell.to_array().map(|n| n as usize);
        (z * self.dimensions.y as usize + y) * self.dimensions.x as usize + x
    }

    /// Where the line is inside the grid.
    fn range(&self, ray: &Ray) -> Option<[f64; 2]> {
        let extent = self.dimensions.as_dvec3();
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let (o, d) = (ray.origin[axis], ray.direction[axis]);
            if d == 0.0 {
                if !(0.0..=extent[axis]).contains(&o) {
                    return None;
                }
                continue;
            }
            let (a, b) = ((0.0 - o) / d, (extent[axis] - o) / d);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near < far && near.is_finite() && far.is_finite()).then_some([near, far])
    }
}

/// The face of a cell that a line along `direction` passes, going in or out through axis `axis`; see [`Solid::normal`].
fn face(axis: usize, direction: f64, crossing: Crossing) -> u32 {
    let low = (direction > 0.0) == (crossing == Crossing::Entering);
    2 * axis as u32 + u32::from(!low)
}

impl Solid for MissingCells {
    fn events(&self, ray: &Ray, events: &mut Vec<Event>) {
        let Some([near, far]) = self.range(ray) else { return };
        let last = self.dimensions.as_dvec3() - 1.0;
        let start = (ray.origin + ray.direction * near).floor().clamp(DVec3::ZERO, last);
        let mut cell = [start.x as i64, start.y as i64, start.z as i64];
        let plane = |cell: i64, axis: usize| {
            let (o, d) = (ray.origin[axis], ray.direction[axis]);
            let at = if d > 0.0 { cell + 1 } else { cell };
            if d == 0.0 { f64::INFINITY } else { (at as f64 - o) / d }
        };
        let mut next: [f64; 3] = std::array::from_fn(|axis| plane(cell[axis], axis));
        // The axis whose plane brought the line here; at first the one along which it enters the grid.
        let entry = |axis: &usize| {
            let (o, d) = (ray.origin[*axis], ray.direction[*axis]);
            let at = if d > 0.0 { 0.0 } else { self.dimensions[*axis] as f64 };
            if d == 0.0 { f64::INFINITY } else { ((at - o) / d - near).abs() }
        };
        let mut axis = (0..3).min_by(|a, b| entry(a).total_cmp(&entry(b))).unwrap_or(0);
        let (mut t, mut inside) = (near, false);
        loop {
            let ahead = (0..3).min_by(|a, b| next[*a].total_cmp(&next[*b])).unwrap_or(0);
            let end = next[ahead].max(t);
            let now = self.contains(UVec3::new(cell[0] as u32, cell[1] as u32, cell[2] as u32));
            // A cell that the line only touches changes nothing.
            if now != inside && end > t {
                let crossing = if now { Crossing::Entering } else { Crossing::Leaving };
                events.push(Event { t, crossing, surface: face(axis, ray.direction[axis], crossing) });
                inside = now;
            }
            (axis, t) = (ahead, end);
            cell[axis] += if ray.direction[axis] > 0.0 { 1 } else { -1 };
            if !(0..i64::from(self.dimensions[axis])).contains(&cell[axis]) {
                break;
            }
            next[axis] = plane(cell[axis], axis);
        }
        if inside {
            let crossing = Crossing::Leaving;
            events.push(Event { t: far, crossing, surface: face(axis, ray.direction[axis], crossing) });
        }
    }

    fn normal(&self, surface: u32, _point_in_object: DVec3) -> DVec3 {
        let mut normal = DVec3::ZERO;
        normal[(surface / 2) as usize % 3] = if surface & 1 == 0 { -1.0 } else { 1.0 };
        normal
    }

    fn bounds(&self) -> [DVec3; 2] {
        [DVec3::ZERO, self.dimensions.as_dvec3()]
    }

    fn has_surface(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 4 x 4 x 4 voxels of which (0, 0, 0) and (3, 2, 1) are missing.
    fn cells() -> MissingCells {
        let mut cells = MissingCells::none(UVec3::splat(4)).unwrap();
        cells.add_voxel(UVec3::ZERO);
        cells.add_voxel(UVec3::new(3, 2, 1));
        cells
    }

    fn events(origin: DVec3, direction: DVec3) -> Vec<(f64, Crossing)> {
        let mut events = Vec::new();
        cells().events(&Ray { origin, direction }, &mut events);
        events.iter().map(|e| (e.t, e.crossing)).collect()
    }

    #[test]
    fn cells_around_missing_voxels_are_missing() {
        let cells = cells();
        let lattice = (0..27u32).map(|i| UVec3::new(i % 3, i / 3 % 3, i / 9));
        let found: Vec<UVec3> = lattice.filter(|cell| cells.contains(*cell)).collect();
        let expected = [[0, 0, 0], [2, 1, 0], [2, 2, 0], [2, 1, 1], [2, 2, 1]].map(UVec3::from_array);
        assert_eq!(found, expected);
    }

    #[test]
    fn lines_enter_and_leave() {
        use Crossing::{Entering, Leaving};
        let along_x = events(DVec3::new(-1.0, 1.5, 0.5), DVec3::X);
        assert_eq!(along_x, [(3.0, Entering), (4.0, Leaving)]);
        // Backwards, from within, and with another length.
        let back = events(DVec3::new(2.5, 1.5, 0.5), DVec3::NEG_X * 2.0);
        assert_eq!(back, [(-0.25, Entering), (0.25, Leaving)]);
        let diagonal = events(DVec3::ZERO, DVec3::ONE);
        assert_eq!(diagonal, [(0.0, Entering), (1.0, Leaving)]);
        assert_eq!(events(DVec3::new(0.5, 2.5, -3.0), DVec3::Z), []);
        assert_eq!(events(DVec3::new(9.0, 0.0, 0.0), DVec3::Y), []);
    }

    #[test]
    fn every_point_of_a_line_is_on_the_right_side() {
        let cells = cells();
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        for _ in 0..500 {
            let from = DVec3::new(random(), random(), random()) * 5.0 - 1.0;
            let ray = Ray { origin: from, direction: DVec3::new(random(), random(), random()) - 0.5 };
            let mut events = Vec::new();
            cells.events(&ray, &mut events);
            for _ in 0..50 {
                let t = random() * 20.0 - 10.0;
                let p = ray.origin + ray.direction * t;
                if events.iter().any(|e| (e.t - t).abs() < 1e-9) {
                    continue;
                }
                let depth: i32 = events
                    .iter()
                    .filter(|e| e.t < t)
                    .map(|e| if e.crossing == Crossing::Entering { 1 } else { -1 })
                    .sum();
                let inside = p.cmpge(DVec3::ZERO).all() && p.cmplt(DVec3::splat(3.0)).all();
                assert_eq!(depth == 1, inside && cells.contains(p.floor().as_uvec3()), "{p}");
            }
        }
    }
}
