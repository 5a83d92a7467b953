//! Isosurfaces: exact crossings of the trilinear field, ray by ray.
//!
//! Blocks whose range holds no isovalue are crossed in one step; within the others a ray goes from cell to cell, and
//! where a cell's corners lie on both sides of an isovalue the field along the ray, a cubic, is solved. There is no
//! sampling distance, so no crossing is missed.

use cutaway_core::camera::{Ray, intersect_box};
use cutaway_core::cubic::Cubic;
use cutaway_core::field;
use cutaway_core::glam::DVec3;
use cutaway_core::occupancy::BlockWalk;
use cutaway_core::scene::Scene;
use cutaway_core::segment::Segment;
use cutaway_core::volume::{Rescale, Volume};
use cutaway_core::with_voxels;

use super::kernel::Kernel;
use crate::clipping::{Face, Kept, TileClip};
use crate::rays::Frame;
use crate::tiles::{TILE, Tile};

pub(super) fn tile(kernel: &Kernel, frame: &Frame, clip: Option<&TileClip>, tile: &mut Tile) {
    with_voxels!(frame.volume.voxels(), voxels => {
        tile_of(kernel, frame, Cells::new(kernel.scene, voxels), clip, tile);
    });
}

fn tile_of<T: Stored>(
    kernel: &Kernel,
    frame: &Frame,
    cells: Cells<T>,
    clip: Option<&TileClip>,
    tile: &mut Tile,
) {
    let vanishing = field::vanishing_gradient(frame.volume);
    for y in 0..TILE.min(frame.height - tile.y) {
        for x in 0..TILE.min(frame.width - tile.x) {
            let (px, py) = (tile.x + x, tile.y + y);
            if !frame.wants((px, py), (1, 1)) {
                continue;
            }
            let mut surfaces = Surfaces::new(kernel, &cells, frame.ray(px, py), vanishing);
            let Ray { origin, direction } = surfaces.ray_in_voxel;
            if let Some(inside) = intersect_box(origin, direction, frame.volume.extent()) {
                match clip.map(|clip| clip.pixel((px, py))) {
                    None => {
                        tile.rays += 1;
                        surfaces.cast(kernel, inside, tile);
                    }
                    Some(pieces) => {
                        tile.rays += u64::from(!pieces.is_empty());
                        surfaces.pieces(kernel, inside, pieces, tile);
                    }
                }
                let pixel = (y * TILE + x) as usize;
                tile.colors[pixel] = surfaces.premultiplied();
                tile.depths[pixel] = surfaces.depth as f32;
            }
        }
    }
}

/// A stored voxel.
trait Stored: Copy + Into<f32> + Into<f64> {}

impl<T: Copy + Into<f32> + Into<f64>> Stored for T {}

/// The cells of a volume, and which of them an isosurface can pass.
struct Cells<'a, T> {
    voxels: &'a [T],
    rescale: Rescale,
    /// How far apart neighbours along x, y and z are; 0 along an axis of one voxel.
    strides: [usize; 3],
    /// Stored numbers of the isovalues, rounded down and up by more than a rescaled number is rounded.
    levels: Vec<[f32; 2]>,
}

impl<'a, T: Stored> Cells<'a, T> {
    fn new(scene: &Scene, voxels: &'a [T]) -> Self {
        let volume = scene.volume();
        let [x, y, z] = volume.dimensions().to_array().map(|n| n as usize);
        let stride = |n: usize, stride: usize| if n > 1 { stride } else { 0 };
        let strides = [stride(x, 1), stride(y, x), stride(z, x * y)];
        let rescale = volume.rescale();
        let bounds = |value: &f64| {
            let stored = rescale.stored(*value);
            let rounding = 1e-9 * (stored.abs() + (rescale.intercept / rescale.slope).abs());
            [((stored - rounding) as f32).next_down(), ((stored + rounding) as f32).next_up()]
        };
        let levels = scene.settings().iso.iter().map(bounds).collect();
        Self { voxels, rescale, strides, levels }
    }

    /// The stored numbers at the corners of a cell, x fastest.
    #[inline]
    fn corners(&self, cell: [i64; 3]) -> [T; 8] {
        let [sx, sy, sz] = self.strides;
        let first = cell[0] as usize * sx + cell[1] as usize * sy + cell[2] as usize * sz;
        std::array::from_fn(|c| self.voxels[first + (c & 1) * sx + (c >> 1 & 1) * sy + (c >> 2 & 1) * sz])
    }

    /// Whether an isosurface may pass between these corners.
    #[inline]
    fn may_be_crossed(&self, corners: &[T; 8]) -> bool {
        let stored = corners.map(|v| -> f32 { v.into() });
        let lo = stored.iter().copied().fold(f32::INFINITY, f32::min);
        let hi = stored.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        self.levels.iter().any(|[below, above]| lo <= *above && hi >= *below)
    }

    /// Values of corners.
    #[inline]
    fn values(&self, corners: &[T; 8]) -> [f64; 8] {
        corners.map(|v| self.rescale.value(v.into()))
    }
}

/// The surfaces that one ray has met.
struct Surfaces<'a, T> {
    scene: &'a Scene,
    volume: &'a Volume,
    cells: &'a Cells<'a, T>,
    ray: Ray,
    ray_in_voxel: Ray,
    vanishing: f64,
    /// Per isovalue: whether the field was at or above it where the ray was last looked at.
    above: Vec<bool>,
    color: [f64; 3],
    transmittance: f64,
    /// World distance to the first surface.
    depth: f64,
}

impl<'a, T: Stored> Surfaces<'a, T> {
    fn new(kernel: &Kernel<'a>, cells: &'a Cells<'a, T>, ray: Ray, vanishing: f64) -> Self {
        let volume = kernel.scene.volume();
        let ray_in_voxel = Ray {
            origin: volume.voxel_from_world().transform_point3(ray.origin),
            direction: volume.voxel_from_world().transform_vector3(ray.direction),
        };
        Self {
            scene: kernel.scene,
            volume,
            cells,
            ray,
            ray_in_voxel,
            vanishing,
            above: Vec::new(),
            color: [0.0; 3],
            transmittance: 1.0,
            depth: f64::INFINITY,
        }
    }

    fn premultiplied(&self) -> [f32; 4] {
        let [r, g, b] = self.color;
        [r, g, b, 1.0 - self.transmittance].map(|c| c as f32)
    }

    /// Casts what is kept of a ray, piece by piece.
    fn pieces(&mut self, kernel: &Kernel, inside: Segment, pieces: &[Kept], tile: &mut Tile) {
        for piece in pieces {
            let segment = piece.segment.unwrap_or(inside);
            self.above.clear();
            if let Some(face) = &piece.face {
                self.face(face, segment.t_near());
            }
            if self.is_opaque() || self.cast(kernel, segment, tile) {
                return;
            }
        }
    }

    /// Draws the clip surface that a piece begins at, and what it closes: of what is cut open, the innermost isosurface
    /// shows on the cut.
    fn face(&mut self, face: &Face, t: f64) {
        let shading = self.scene.clip_shading();
        let terms = (f64::from(face.terms.0), f64::from(face.terms.1));
        if shading.overlay > 0.0 {
            self.add([1.0; 3], terms, shading.overlay, t);
        }
        if shading.cap {
            let Ray { origin, direction } = self.ray_in_voxel;
            let p = (origin + direction * t).clamp(DVec3::ZERO, self.volume.extent());
            let (cell, within) = field::cell_of(self.volume, p);
            let value = field::trilinear(&field::corner_values(self.volume, cell), within);
            let settings = self.scene.settings();
            let level = settings.iso.iter().copied().filter(|level| value >= *level).reduce(f64::max);
            if let Some(level) = level {
                let (color, _) = self.scene.transfer_function().evaluate(level);
                self.add(color, terms, settings.iso_opacity, t);
            }
        }
    }

    /// Adds a surface behind those there are.
    fn add(&mut self, color: [f64; 3], (factor, white): (f64, f64), opacity: f64, t: f64) {
        let weight = self.transmittance * opacity;
        for (sum, color) in self.color.iter_mut().zip(color) {
            *sum += weight * (color * factor + white);
        }
        self.transmittance -= weight;
        self.depth = self.depth.min(t);
    }

    fn is_opaque(&self) -> bool {
        1.0 - self.transmittance >= self.scene.settings().early_termination
    }

    /// Casts a stretch of the ray; true once nothing behind can be seen.
    fn cast(&mut self, kernel: &Kernel, inside: Segment, tile: &mut Tile) -> bool {
        let Some(occupancy) = &kernel.classification.occupancy else { return true };
        let Ray { origin, direction } = self.ray_in_voxel;
        // The walk's own distances begin at the volume: from a far eye, f32 would not tell cells apart.
        let (t_entry, t_exit) = (inside.t_near(), inside.t_far());
        let entry = (origin + direction * t_entry).as_vec3();
        let length = inside.length() as f32;
        let mut walk = BlockWalk::new(entry, direction.as_vec3(), length, occupancy.dimensions());
        // A thousandth of a voxel more on both sides: rounding must not lose a cell's sliver between two runs.
        let sliver = 1e-3 / direction.abs().max_element();
        let mut reached = t_entry;
        while let Some((begin, end)) = occupancy.next_run(&mut walk) {
            tile.runs += 1;
            let t0 = (t_entry + f64::from(begin) - sliver).max(reached);
            let t1 = (t_entry + f64::from(end) + sliver).min(t_exit);
            if self.cells(t0, t1, tile) {
                return true;
            }
            reached = t1.max(reached);
        }
        false
    }

    /// Goes through the cells between two distances; true once nothing behind can be seen.
    fn cells(&mut self, t0: f64, t1: f64, tile: &mut Tile) -> bool {
        let Ray { origin, direction } = self.ray_in_voxel;
        let middle = |t: f64, t_next: f64| origin + direction * (0.5 * (t + t_next));
        let mut t = t0;
        // The next plane along each axis; -1 or 1 a cell further each time one is crossed.
        let start = origin + direction * t0;
        let mut plane: [f64; 3] = std::array::from_fn(|a| {
            if direction[a] > 0.0 { (start[a] + 1e-9).floor() + 1.0 } else { (start[a] - 1e-9).ceil() - 1.0 }
        });
        let along = direction.recip();
        let distance = |plane: f64, a: usize| {
            if direction[a] == 0.0 { f64::INFINITY } else { (plane - origin[a]) * along[a] }
        };
        while t < t1 {
            let ends: [f64; 3] = std::array::from_fn(|a| distance(plane[a], a));
            let axis = if ends[0] <= ends[1].min(ends[2]) {
                0
            } else if ends[1] <= ends[2] {
                1
            } else {
                2
            };
            let t_next = ends[axis].min(t1);
            plane[axis] += direction[axis].signum();
            if t_next <= t {
                continue;
            }
            tile.samples += 1;
            let (cell, _) = field::cell_of(self.volume, middle(t, t_next));
            if self.cell(cell, t, t_next) {
                return true;
            }
            t = t_next;
        }
        false
    }

    /// Looks for crossings in a cell that the ray is in between `t` and `t_next`.
    fn cell(&mut self, cell: [i64; 3], t: f64, t_next: f64) -> bool {
        let corners = self.cells.corners(cell);
        if !self.above.is_empty() && !self.cells.may_be_crossed(&corners) {
            return false;
        }
        self.crossed_cell(self.cells.values(&corners), cell, t, t_next)
    }

    /// Looks for crossings in a cell with these values at its corners.
    fn crossed_cell(&mut self, corners: [f64; 8], cell: [i64; 3], t: f64, t_next: f64) -> bool {
        let settings = self.scene.settings();
        let base = DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64);
        let Ray { origin, direction } = self.ray_in_voxel;
        let value = |s: f64| field::trilinear(&corners, origin + direction * (t + s * (t_next - t)) - base);
        let cubic = Cubic::through([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(value));
        let range =
            corners.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(*v), hi.max(*v)]);
        if self.above.is_empty() {
            self.above = settings.iso.iter().map(|level| cubic.starts_above(*level, range)).collect();
        }
        let mut hits: Vec<(f64, f64)> = Vec::new();
        for (&level, above) in settings.iso.iter().zip(&mut self.above) {
            *above = cubic.passes(level, range, *above, |s| hits.push((s, level)));
        }
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        hits.into_iter().any(|(s, level)| self.hit(t + s * (t_next - t), level))
    }

    /// Adds a surface; true once nothing behind it can be seen.
    fn hit(&mut self, t: f64, level: f64) -> bool {
        let (color, _) = self.scene.transfer_function().evaluate(level);
        let (factor, white) = self.light(t);
        self.add(color, (factor, white), self.scene.settings().iso_opacity, t);
        self.is_opaque()
    }

    fn light(&self, t: f64) -> (f64, f64) {
        if !self.scene.is_shaded() {
            return (1.0, 0.0);
        }
        let p = self.ray_in_voxel.origin + self.ray_in_voxel.direction * t;
        let gradient = field::gradient_in_world(self.volume, p.clamp(DVec3::ZERO, self.volume.extent()));
        let (l, h) = self.scene.lighting().directions(self.ray.direction);
        self.scene.lighting().terms(gradient, self.vanishing, l, h)
    }
}
