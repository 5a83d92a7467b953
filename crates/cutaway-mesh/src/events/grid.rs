//! A uniform grid over the triangles, walked by 3D-DDA (Amanatides and Woo, "A fast voxel traversal algorithm for ray
//! tracing", Eurographics 1987): Termeer 3.1.2.

use cutaway_core::glam::{DVec3, IVec3};

use super::lines::{PADDING, UnitSpace};
use super::overlap::triangle_meets_box;
use crate::TriangleMesh;

/// Cells per triangle: more cost memory and steps, fewer cost tests. Of 2, 4, 8 and 16,
/// 4 was fastest on the bunny.
const CELLS_PER_TRIANGLE: f64 = 4.0;

/// Entries per triangle, at most; a grid that needs more is made coarser.
const ENTRIES_PER_TRIANGLE: usize = 6;

/// The grid, in unit space.
#[derive(Debug)]
pub(super) struct Grid {
    low: DVec3,
    cell: DVec3,
    size: IVec3,
    /// Where the triangles of each cell begin; one more than there are cells.
    offsets: Vec<u32>,
    triangles: Vec<u32>,
}

impl Grid {
    pub(super) fn new(mesh: &TriangleMesh, space: &UnitSpace) -> Self {
        let count = mesh.triangles().len();
        // A flat mesh has a grid of one layer.
        let extent = space.extent.max(DVec3::splat(1e-3));
        let mut side = (extent.element_product() / (CELLS_PER_TRIANGLE * count as f64)).cbrt();
        loop {
            let mut grid = Self::empty(extent, side);
            if grid.size == IVec3::ONE || grid.count(mesh, space, ENTRIES_PER_TRIANGLE * count + 4096) {
                grid.insert(mesh, space);
                return grid;
            }
            side *= 1.5;
        }
    }

    fn empty(extent: DVec3, side: f64) -> Self {
        let size = (extent / side).ceil().as_ivec3().clamp(IVec3::ONE, IVec3::splat(1024));
        let extent = extent + 2.0 * PADDING;
        let cells = size.x as usize * size.y as usize * size.z as usize;
        Self {
            low: extent * -0.5,
            cell: extent / size.as_dvec3(),
            size,
            offsets: vec![0; cells + 1],
            triangles: Vec::new(),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        (self.offsets.capacity() + self.triangles.capacity()) * size_of::<u32>()
    }

    fn index(&self, cell: IVec3) -> usize {
        cell.x as usize + self.size.x as usize * (cell.y as usize + self.size.y as usize * cell.z as usize)
    }

    /// Counts entries per cell; false as soon as there are more than `limit`.
    fn count(&mut self, mesh: &TriangleMesh, space: &UnitSpace, limit: usize) -> bool {
        let mut offsets = std::mem::take(&mut self.offsets);
        let mut entries = 0;
        for triangle in 0..mesh.triangles().len() {
            self.for_cells(&space.corners(mesh, triangle), |cell| {
                offsets[cell] += 1;
                entries += 1;
            });
            if entries > limit {
                return false;
            }
        }
        self.offsets = offsets;
        true
    }

    /// Turns counts into offsets and enters the triangles; a grid of one cell needs no counts.
    fn insert(&mut self, mesh: &TriangleMesh, space: &UnitSpace) {
        let count = mesh.triangles().len();
        if self.size == IVec3::ONE {
            self.offsets = vec![0, count as u32];
            self.triangles = (0..count as u32).collect();
            return;
        }
        let mut offsets = std::mem::take(&mut self.offsets);
        let mut end = 0;
        for offset in &mut offsets {
            end += *offset;
            *offset = end;
        }
        let mut triangles = vec![0u32; end as usize];
        // From the last triangle to the first, each cell filled from its end: offsets end up at the cells' beginnings.
        for triangle in (0..count).rev() {
            self.for_cells(&space.corners(mesh, triangle), |cell| {
                offsets[cell] -= 1;
                triangles[offsets[cell] as usize] = triangle as u32;
            });
        }
        (self.offsets, self.triangles) = (offsets, triangles);
    }

    /// The cells that a triangle overlaps, or nearly.
    fn for_cells(&self, corners: &[DVec3; 3], mut enter: impl FnMut(usize)) {
        let [a, b, c] = *corners;
        let to_cell =
            |p: DVec3| ((p - self.low) / self.cell).floor().as_ivec3().clamp(IVec3::ZERO, self.size - 1);
        let (low, high) = (to_cell(a.min(b).min(c) - PADDING), to_cell(a.max(b).max(c) + PADDING));
        // A row of cells is met everywhere by what spans it.
        let row = (high - low).cmpgt(IVec3::ZERO).bitmask().count_ones() <= 1;
        let half = self.cell * 0.5 + PADDING;
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let cell = IVec3::new(x, y, z);
                    let center = self.low + (cell.as_dvec3() + 0.5) * self.cell;
                    if row || triangle_meets_box(corners, center, half) {
                        enter(self.index(cell));
                    }
                }
            }
        }
    }

    /// Visits the triangles of all cells along a line, some of them repeatedly.
    pub(super) fn walk(&self, point: DVec3, direction: DVec3, visit: &mut impl FnMut(u32)) {
        let Some(t) = self.enter(point, direction) else { return };
        let at = ((point + direction * t - self.low) / self.cell).floor().as_ivec3();
        let mut cell = at.clamp(IVec3::ZERO, self.size - 1).to_array();
        let inverse = direction.recip();
        let mut step = [0i32; 3];
        let mut next = [f64::INFINITY; 3];
        let wall = |axis: usize, cell: i32, step: i32| {
            let wall = self.low[axis] + f64::from(cell + i32::from(step > 0)) * self.cell[axis];
            (wall - point[axis]) * inverse[axis]
        };
        for axis in 0..3 {
            if direction[axis].abs() > 1e-30 {
                step[axis] = if direction[axis] > 0.0 { 1 } else { -1 };
                next[axis] = wall(axis, cell[axis], step[axis]);
            }
        }
        loop {
            let index = self.index(IVec3::from_array(cell));
            let (start, end) = (self.offsets[index] as usize, self.offsets[index + 1] as usize);
            self.triangles[start..end].iter().for_each(|&triangle| visit(triangle));
            let axis = if next[0] <= next[1] && next[0] <= next[2] {
                0
            } else if next[1] <= next[2] {
                1
            } else {
                2
            };
            cell[axis] += step[axis];
            if step[axis] == 0 || cell[axis] < 0 || cell[axis] >= self.size[axis] {
                return;
            }
            next[axis] = wall(axis, cell[axis], step[axis]);
        }
    }

    /// Where a line enters the grid.
    fn enter(&self, point: DVec3, direction: DVec3) -> Option<f64> {
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let (low, high) = (self.low[axis] - point[axis], -self.low[axis] - point[axis]);
            if direction[axis].abs() > 1e-30 {
                let (a, b) = (low / direction[axis], high / direction[axis]);
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            } else if low > 0.0 || high < 0.0 {
                return None;
            }
        }
        (near <= far).then_some(near)
    }
}
