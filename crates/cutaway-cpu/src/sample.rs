//! The field sampler: trilinear values and gradients of many lanes at once.
//!
//! All arithmetic is in stored numbers; the caller knows the rescale. Neighbours along x are loaded together.

use cutaway_core::volume::Volume;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, SimdBase};

use crate::bricks::BrickShape;
use crate::normals;
use crate::simd::{LaneSource, PackedVoxel};

/// A stored voxel type that lanes can be filled with: how rows of voxels along x are read.
pub(crate) trait LaneVoxel: PackedVoxel + Send + Sync + 'static {
    /// The pair of voxels that begins at `i + offset`, for each offset.
    fn pairs<S: Simd, const N: usize>(
        source: LaneSource<'_, Self>,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::f32s; 2]; N];

    /// The four voxels that begin at `i + offset`, for each offset, with one load each.
    fn fours<S: Simd, const N: usize>(
        source: LaneSource<'_, Self>,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::f32s; 4]; N];
}

impl LaneVoxel for u8 {
    #[inline(always)]
    fn pairs<S: Simd, const N: usize>(
        source: LaneSource<'_, Self>,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::f32s; 2]; N] {
        let words = source.words(simd, i, offsets);
        let mut out = [[S::f32s::splat(simd, 0.0); 2]; N];
        for (out, w) in out.iter_mut().zip(words) {
            *out = [to_float::<S>(w & 0xff), to_float::<S>((w >> 8) & 0xff)];
        }
        out
    }

    #[inline(always)]
    fn fours<S: Simd, const N: usize>(
        source: LaneSource<'_, Self>,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::f32s; 4]; N] {
        let words = source.words(simd, i, offsets);
        let mut out = [[S::f32s::splat(simd, 0.0); 4]; N];
        for (out, w) in out.iter_mut().zip(words) {
            let low = [to_float::<S>(w & 0xff), to_float::<S>((w >> 8) & 0xff)];
            *out = [low[0], low[1], to_float::<S>((w >> 16) & 0xff), to_float::<S>(w >> 24)];
        }
        out
    }
}

impl LaneVoxel for u16 {
    #[inline(always)]
    fn pairs<S: Simd, const N: usize>(
        source: LaneSource<'_, Self>,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::f32s; 2]; N] {
        let words = source.words(simd, i, offsets);
        let mut out = [[S::f32s::splat(simd, 0.0); 2]; N];
        for (out, w) in out.iter_mut().zip(words) {
            *out = [to_float::<S>(w & 0xffff), to_float::<S>(w >> 16)];
        }
        out
    }

    #[inline(always)]
    fn fours<S: Simd, const N: usize>(
        source: LaneSource<'_, Self>,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::f32s; 4]; N] {
        let words = source.long_words::<S, N, 2>(simd, i, offsets);
        let mut out = [[S::f32s::splat(simd, 0.0); 4]; N];
        for (out, [low, high]) in out.iter_mut().zip(words) {
            let first = [to_float::<S>(low & 0xffff), to_float::<S>(low >> 16)];
            *out = [first[0], first[1], to_float::<S>(high & 0xffff), to_float::<S>(high >> 16)];
        }
        out
    }
}

impl LaneVoxel for f32 {
    #[inline(always)]
    fn pairs<S: Simd, const N: usize>(
        source: LaneSource<'_, Self>,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::f32s; 2]; N] {
        let words = source.long_words::<S, N, 2>(simd, i, offsets);
        let mut out = [[S::f32s::splat(simd, 0.0); 2]; N];
        for (out, [a, b]) in out.iter_mut().zip(words) {
            *out = [a.bitcast(), b.bitcast()];
        }
        out
    }

    #[inline(always)]
    fn fours<S: Simd, const N: usize>(
        source: LaneSource<'_, Self>,
        simd: S,
        i: S::u32s,
        offsets: [u32; N],
    ) -> [[S::f32s; 4]; N] {
        let words = source.long_words::<S, N, 4>(simd, i, offsets);
        let mut out = [[S::f32s::splat(simd, 0.0); 4]; N];
        for (out, [a, b, c, d]) in out.iter_mut().zip(words) {
            *out = [a.bitcast(), b.bitcast(), c.bitcast(), d.bitcast()];
        }
        out
    }
}

/// Voxels of at most 16 bits as floats: the signed conversion, one instruction everywhere, is right for them.
#[inline(always)]
fn to_float<S: Simd>(v: S::u32s) -> S::f32s {
    let signed: S::i32s = v.bitcast();
    signed.to_float()
}

/// Bytes of voxels of which those that a view shows are likely to stay in the caches: asking ahead for 32 MiB takes more
/// time than it saves.
const NEAR: usize = 48 << 20;

/// A volume's voxels and the shape that addresses them.
#[derive(Clone, Copy)]
pub(crate) struct Grid<'a, T> {
    voxels: LaneSource<'a, T>,
    /// Voxels along each axis of the volume.
    dimensions: [u32; 3],
    /// Voxels from a row to the next, and from a plane to the next.
    strides: (u32, u32),
    /// Where the voxels are in bricks.
    bricks: Option<BrickShape>,
}

/// Where lanes are: the cell's first voxel, its index in the layout, and the position within the cell.
#[derive(Clone, Copy)]
pub(crate) struct CellPosition<S: Simd> {
    cell: [S::u32s; 3],
    index: S::u32s,
    fraction: [S::f32s; 3],
}

impl<S: Simd> CellPosition<S> {
    /// The position within each cell.
    #[inline(always)]
    pub(crate) fn fraction(&self) -> [S::f32s; 3] {
        self.fraction
    }
}

impl<'a, T: LaneVoxel> Grid<'a, T> {
    /// The volume's own voxels.
    pub(crate) fn new(volume: &Volume, voxels: &'a [T]) -> Self {
        let [nx, ny, nz] = volume.dimensions().to_array();
        let voxels = LaneSource::new(voxels);
        Self { voxels, dimensions: [nx, ny, nz], strides: (nx, nx * ny), bricks: None }
    }

    /// The volume's voxels in bricks.
    pub(crate) fn bricked(volume: &Volume, bricks: &'a [T]) -> Self {
        let shape = BrickShape::new(volume.dimensions());
        let strides = shape.strides();
        Self { voxels: LaneSource::new(bricks), strides, bricks: Some(shape), ..Self::new(volume, bricks) }
    }

    /// The cells that hold positions in voxel space; positions outside are moved to the volume's border.
    #[inline(always)]
    pub(crate) fn locate<S: Simd>(&self, simd: S, p: [S::f32s; 3]) -> CellPosition<S> {
        let [nx, ny, nz] = self.dimensions;
        let (x, fx) = cell_along::<S>(p[0], nx);
        let (y, fy) = cell_along::<S>(p[1], ny);
        let (z, fz) = cell_along::<S>(p[2], nz);
        let cell = [x, y, z];
        let index = match &self.bricks {
            None => self.linear_index::<S>(cell),
            Some(shape) => index_in_bricks::<S>(simd, shape, cell),
        };
        CellPosition { cell, index, fraction: [fx, fy, fz] }
    }

    /// Where the first voxel of cells is among the volume's own voxels.
    #[inline(always)]
    fn linear_index<S: Simd>(&self, [x, y, z]: [S::u32s; 3]) -> S::u32s {
        let [nx, ny, _] = self.dimensions;
        (z * ny + y) * nx + x
    }

    fn strides(&self) -> (u32, u32) {
        self.strides
    }

    /// Whether the voxels are more than stay in a processor's caches from frame to frame.
    pub(crate) fn is_far(&self) -> bool {
        self.voxels.bytes() > NEAR
    }

    /// Has what samples at located positions read on its way to the caches.
    #[inline(always)]
    pub(crate) fn prefetch<S: Simd>(&self, simd: S, at: &CellPosition<S>) {
        let (row, plane) = self.strides();
        let i = at.index - (plane + row);
        self.voxels.prefetch(simd, i, [row, plane, 2 * plane + 2 * row, 2 * plane + 3 * row]);
    }

    /// The field at located positions.
    #[inline(always)]
    pub(crate) fn value<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> S::f32s {
        let [fx, fy, fz] = at.fraction;
        let (row, plane) = self.strides();
        let [e00, e10, e01, e11] = T::pairs(self.voxels, simd, at.index, [0, row, plane, plane + row]);
        let near = lerp::<S>(edge::<S>(e00, fx), edge::<S>(e10, fx), fy);
        let far = lerp::<S>(edge::<S>(e01, fx), edge::<S>(e11, fx), fy);
        lerp::<S>(near, far, fz)
    }

    /// The field and twice its gradient in voxel space (stored numbers a voxel): central differences of the voxels,
    /// interpolated; beyond the border the border's voxels repeat.
    ///
    /// Both come from the same 32 voxels, the 4 x 4 x 4 around the cell without its edges, each read once.
    #[inline(always)]
    pub(crate) fn value_and_gradient<S: Simd>(
        &self,
        simd: S,
        at: &CellPosition<S>,
    ) -> (S::f32s, [S::f32s; 3]) {
        let rows = self.rows(simd, at);
        (rows.value(at.fraction), self.gradient(simd, at, &rows))
    }

    /// The cell's four edges along x, longer by a voxel at both ends: what the field depends on, and with it most of what
    /// its gradient does.
    #[inline(always)]
    pub(crate) fn rows<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> Rows<S> {
        let [nx, ny, nz] = self.dimensions;
        let [x, y, z] = at.cell;
        let interior = |c: S::u32s, n: u32| (c - 1).simd_lt(n.saturating_sub(3));
        // Bricks hold what lies beyond the border.
        let inside =
            self.bricks.is_some() || (interior(x, nx) & interior(y, ny) & interior(z, nz)).all_true();
        let voxels = if inside { self.rows_inside(simd, at) } else { self.rows_at_border(simd, at) };
        Rows { voxels, inside }
    }

    /// Twice the gradient where rows were read.
    #[inline(always)]
    pub(crate) fn gradient<S: Simd>(&self, simd: S, at: &CellPosition<S>, rows: &Rows<S>) -> [S::f32s; 3] {
        let beside = if rows.inside { self.beside_inside(simd, at) } else { self.beside_at_border(simd, at) };
        rows.gradient(&beside, at.fraction)
    }

    #[inline(always)]
    fn rows_inside<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> [[S::f32s; 4]; 4] {
        let (row, plane) = self.strides();
        T::fours(self.voxels, simd, at.index - 1, [0, row, plane, plane + row])
    }

    #[inline(always)]
    fn beside_inside<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> [[S::f32s; 2]; 8] {
        let (row, plane) = self.strides();
        // Offsets are from the voxel a plane and a row before the cell's first.
        let core = plane + row;
        let offsets = [
            core - row,
            core + 2 * row,
            core + plane - row,
            core + plane + 2 * row,
            core - plane,
            core - plane + row,
            core + 2 * plane,
            core + 2 * plane + row,
        ];
        T::pairs(self.voxels, simd, at.index - core, offsets)
    }

    /// The rows where some lane's cell touches the border: the voxels outside are those of the border.
    #[inline(always)]
    fn rows_at_border<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> [[S::f32s; 4]; 4] {
        let (nx, x) = (self.dimensions[0], at.cell[0]);
        let (row, plane) = self.strides();
        // Distances to the voxel before the cell and to the one after it, 0 at the border.
        let (down_x, up_x) = (down::<S>(simd, x, 1), up::<S>(simd, x, nx - 2, 1));
        let mut rows = [[S::f32s::splat(simd, 0.0); 4]; 4];
        for (out, offset) in rows.iter_mut().zip([0, row, plane, plane + row]) {
            let i = at.index + offset;
            let ([before, _], [a, b], [_, after]) =
                (self.pair(simd, i - down_x), self.pair(simd, i), self.pair(simd, i + up_x));
            *out = [before, a, b, after];
        }
        rows
    }

    /// What is beside the rows where some lane's cell touches the border.
    #[inline(always)]
    fn beside_at_border<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> [[S::f32s; 2]; 8] {
        let [_, ny, nz] = self.dimensions;
        let [_, y, z] = at.cell;
        let (row, plane) = self.strides();
        let (down_y, up_y) = (down::<S>(simd, y, row), up::<S>(simd, y, ny - 2, row));
        let (down_z, up_z) = (down::<S>(simd, z, plane), up::<S>(simd, z, nz - 2, plane));
        let (i00, i10) = (at.index, at.index + row);
        let (i01, i11) = (at.index + plane, at.index + (plane + row));
        [
            self.pair(simd, i00 - down_y),
            self.pair(simd, i10 + up_y),
            self.pair(simd, i01 - down_y),
            self.pair(simd, i11 + up_y),
            self.pair(simd, i00 - down_z),
            self.pair(simd, i10 - down_z),
            self.pair(simd, i01 + up_z),
            self.pair(simd, i11 + up_z),
        ]
    }

    #[inline(always)]
    fn pair<S: Simd>(&self, simd: S, i: S::u32s) -> [S::f32s; 2] {
        T::pairs(self.voxels, simd, i, [0])[0]
    }
}

/// Where the first voxel of cells is in bricks.
#[inline(always)]
fn index_in_bricks<S: Simd>(simd: S, shape: &BrickShape, cell: [S::u32s; 3]) -> S::u32s {
    let (row, plane) = shape.strides();
    let strides = [1, row, plane];
    let bricks = [1, shape.bricks[0], shape.bricks[0] * shape.bricks[1]];
    let mut brick = S::u32s::splat(simd, 0);
    let mut within = S::u32s::splat(simd, shape.margin());
    for a in 0..3 {
        // Cells are whole numbers: a half more keeps the division exact.
        let c = to_float::<S>(cell[a]);
        let b: S::i32s = ((c + 0.5) * (1.0 / shape.cells[a] as f32)).to_int();
        let b: S::u32s = b.bitcast();
        brick += b * bricks[a];
        within += (cell[a] - b * shape.cells[a]) * strides[a];
    }
    brick * shape.brick_len() + within
}

/// The plane of voxels that all positions lie on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OnPlane {
    /// The axis across the plane.
    pub(crate) axis: usize,
}

impl<T: LaneVoxel> Grid<'_, T> {
    /// The field at positions on a plane of voxels: bilinear, half the voxels of [`Grid::value`].
    #[inline(always)]
    pub(crate) fn value_on_plane<S: Simd>(
        &self,
        simd: S,
        at: &CellPosition<S>,
        OnPlane { axis }: OnPlane,
    ) -> S::f32s {
        let [fx, fy, fz] = at.fraction;
        let (row, plane) = self.strides();
        // A plane's own cell begins or ends on it, whichever rounding chose.
        match axis {
            0 => {
                let [e00, e10, e01, e11] =
                    T::pairs(self.voxels, simd, at.index, [0, row, plane, plane + row]);
                let near = fx.simd_lt(0.5);
                let pick = |[a, b]: [S::f32s; 2]| near.select(a, b);
                lerp::<S>(lerp::<S>(pick(e00), pick(e10), fy), lerp::<S>(pick(e01), pick(e11), fy), fz)
            }
            1 => {
                let up = fy.simd_lt(0.5).select(S::u32s::splat(simd, 0), S::u32s::splat(simd, row));
                let [near, far] = T::pairs(self.voxels, simd, at.index + up, [0, plane]);
                lerp::<S>(edge::<S>(near, fx), edge::<S>(far, fx), fz)
            }
            _ => {
                let up = fz.simd_lt(0.5).select(S::u32s::splat(simd, 0), S::u32s::splat(simd, plane));
                let [near, far] = T::pairs(self.voxels, simd, at.index + up, [0, row]);
                lerp::<S>(edge::<S>(near, fx), edge::<S>(far, fx), fy)
            }
        }
    }

    /// Twice the gradient by Sobel's kernel (differences along one axis, smoothed 1 2 1 along the others) at the cell's
    /// corners, interpolated: all 64 voxels around the cell.
    #[inline(always)]
    pub(crate) fn sobel<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> [S::f32s; 3] {
        let taps = [taps::<S>(at.fraction[0]), taps::<S>(at.fraction[1]), taps::<S>(at.fraction[2])];
        let zero = S::f32s::splat(simd, 0.0);
        let mut gradient = [zero; 3];
        for k in 0..4 {
            // Of a plane: smoothed along both axes, and differences along each, smoothed along the other.
            let (mut smooth, mut dx, mut dy) = (zero, zero, zero);
            for j in 0..4 {
                let voxels = self.row_around(simd, at, j, k);
                let (mut row_smooth, mut row_difference) = (zero, zero);
                for (i, v) in voxels.into_iter().enumerate() {
                    row_smooth = v.mul_add(taps[0].smooth[i], row_smooth);
                    row_difference = v.mul_add(taps[0].difference[i], row_difference);
                }
                smooth = row_smooth.mul_add(taps[1].smooth[j], smooth);
                dx = row_difference.mul_add(taps[1].smooth[j], dx);
                dy = row_smooth.mul_add(taps[1].difference[j], dy);
            }
            gradient[0] = dx.mul_add(taps[2].smooth[k], gradient[0]);
            gradient[1] = dy.mul_add(taps[2].smooth[k], gradient[1]);
            gradient[2] = smooth.mul_add(taps[2].difference[k], gradient[2]);
        }
        gradient
    }

    /// Voxels x - 1 to x + 2 of row `j` (0 to 3: y - 1 to y + 2) of plane `k` around a cell. A function of its own: sixteen
    /// copies of it would take long to compile.
    #[inline(always)]
    fn row_around<S: Simd>(&self, simd: S, at: &CellPosition<S>, j: usize, k: usize) -> [S::f32s; 4] {
        simd.vectorize(
            #[inline(always)]
            || self.row_around_of(simd, at, j, k),
        )
    }

    #[inline(always)]
    fn row_around_of<S: Simd>(&self, simd: S, at: &CellPosition<S>, j: usize, k: usize) -> [S::f32s; 4] {
        let (row, plane) = self.strides();
        if self.bricks.is_some() {
            let i = at.index - (plane + row + 1);
            return T::fours(self.voxels, simd, i, [k as u32 * plane + j as u32 * row])[0];
        }
        let [nx, ny, nz] = self.dimensions;
        let [x, y, z] = at.cell;
        let clamped = |c: S::u32s, k: usize, n: u32| {
            let up: S::i32s = c.bitcast();
            let moved =
                (up + k as i32 - 1).max(S::i32s::splat(simd, 0)).min(S::i32s::splat(simd, n as i32 - 1));
            let moved: S::u32s = moved.bitcast();
            moved
        };
        let base = clamped(z, k, nz) * plane + clamped(y, j, ny) * row;
        let pair = |i: S::u32s| T::pairs(self.voxels, simd, i, [0])[0];
        let [a, b] = pair(base + x);
        let [before, _] = pair(base + x - down::<S>(simd, x, 1));
        let [_, after] = pair(base + x + up::<S>(simd, x, nx - 2, 1));
        [before, a, b, after]
    }

    /// The gradient's direction from words of [`crate::normals`], interpolated; of any length.
    #[inline(always)]
    pub(crate) fn direction<S: Simd>(
        &self,
        simd: S,
        at: &CellPosition<S>,
        normals: LaneSource<'_, u32>,
    ) -> [S::f32s; 3] {
        let [fx, fy, fz] = at.fraction;
        let [nx, ny, _] = self.dimensions;
        let (row, plane) = (nx, nx * ny);
        let i = self.linear_index::<S>(at.cell);
        let words =
            normals.words(simd, i, [0, row, plane, plane + row, 1, row + 1, plane + 1, plane + row + 1]);
        let mut out = [fx; 3];
        for (component, out) in out.iter_mut().enumerate() {
            let mut v = [fx; 8];
            for (v, word) in v.iter_mut().zip(words) {
                let bits = (word >> (10 * component as u32)) & 1023;
                // An empty word has no direction: zero, not the far end.
                let none = word.simd_eq(0);
                *v = none.select(S::f32s::splat(simd, 0.0), to_float::<S>(bits) - normals::MIDDLE as f32);
            }
            let along = |k: usize| lerp::<S>(v[k], v[k + 4], fx);
            let near = lerp::<S>(along(0), along(1), fy);
            let far = lerp::<S>(along(2), along(3), fy);
            *out = lerp::<S>(near, far, fz) * (1.0 / normals::SCALE);
        }
        out
    }
}

/// Weights of the four voxels around a position along an axis: smoothed 1 2 1 and differences, at the two nearest voxels,
/// interpolated.
struct Taps<S: Simd> {
    smooth: [S::f32s; 4],
    difference: [S::f32s; 4],
}

#[inline(always)]
fn taps<S: Simd>(f: S::f32s) -> Taps<S> {
    let g = f * -1.0 + 1.0;
    Taps {
        smooth: [g * 0.25, (g * 2.0 + f) * 0.25, (f * 2.0 + g) * 0.25, f * 0.25],
        difference: [g * -1.0, f * -1.0, g, f],
    }
}

/// A cell's four edges along x, each with the voxel before and after it: `(y, z)` 00, 10, 01, 11.
pub(crate) struct Rows<S: Simd> {
    voxels: [[S::f32s; 4]; 4],
    /// Whether no lane's cell touches the border.
    inside: bool,
}

impl<S: Simd> Rows<S> {
    /// The values on the cell's edges along x.
    #[inline(always)]
    fn on_edges(&self, fx: S::f32s) -> [S::f32s; 4] {
        let mut values = [fx; 4];
        for (value, [_, a, b, _]) in values.iter_mut().zip(self.voxels) {
            *value = lerp::<S>(a, b, fx);
        }
        values
    }

    /// The field.
    #[inline(always)]
    pub(crate) fn value(&self, [fx, fy, fz]: [S::f32s; 3]) -> S::f32s {
        let [v00, v10, v01, v11] = self.on_edges(fx);
        lerp::<S>(lerp::<S>(v00, v10, fy), lerp::<S>(v01, v11, fy), fz)
    }

    /// Twice its gradient, with the edges beside these: before and after the cell along y, for z 0 and 1; before it along z,
    /// for y 0 and 1; after it.
    #[inline(always)]
    fn gradient(&self, beside: &[[S::f32s; 2]; 8], [fx, fy, fz]: [S::f32s; 3]) -> [S::f32s; 3] {
        let along = |[before, a, b, after]: [S::f32s; 4]| lerp::<S>(b - before, after - a, fx);
        let [l00, l10, l01, l11] = self.voxels;
        let [v00, v10, v01, v11] = self.on_edges(fx);
        let gx = lerp::<S>(lerp::<S>(along(l00), along(l10), fy), lerp::<S>(along(l01), along(l11), fy), fz);
        let [before_0, after_0, before_1, after_1, under_0, under_1, over_0, over_1] = *beside;
        let y0 = lerp::<S>(v10 - edge::<S>(before_0, fx), edge::<S>(after_0, fx) - v00, fy);
        let y1 = lerp::<S>(v11 - edge::<S>(before_1, fx), edge::<S>(after_1, fx) - v01, fy);
        let gy = lerp::<S>(y0, y1, fz);
        let under = lerp::<S>(edge::<S>(under_0, fx), edge::<S>(under_1, fx), fy);
        let over = lerp::<S>(edge::<S>(over_0, fx), edge::<S>(over_1, fx), fy);
        let (near, far) = (lerp::<S>(v00, v10, fy), lerp::<S>(v01, v11, fy));
        let gz = lerp::<S>(far - under, over - near, fz);
        [gx, gy, gz]
    }
}

/// The value on an edge along x, from its ends.
#[inline(always)]
fn edge<S: Simd>([a, b]: [S::f32s; 2], fx: S::f32s) -> S::f32s {
    lerp::<S>(a, b, fx)
}

/// The cell of positions along an axis of `n` voxels, and where within it they lie.
#[inline(always)]
fn cell_along<S: Simd>(p: S::f32s, n: u32) -> (S::u32s, S::f32s) {
    // The greatest number below the last voxel: its cell is the last one, and no position needs moving to it as a whole
    // number. Whatever a NaN became, the sampler's loads are bounded.
    let p = p.max(0.0).min(((n - 1) as f32).next_down());
    let cell: S::i32s = p.to_int();
    let low: S::f32s = cell.to_float();
    (cell.bitcast(), p - low)
}

/// `size` where there is a voxel before cell `c` of an axis, else 0.
#[inline(always)]
fn down<S: Simd>(simd: S, c: S::u32s, size: u32) -> S::u32s {
    c.simd_gt(0).select(S::u32s::splat(simd, size), S::u32s::splat(simd, 0))
}

/// `size` where there is a voxel after cell `c` of an axis whose last cell is `last`, else 0.
#[inline(always)]
fn up<S: Simd>(simd: S, c: S::u32s, last: u32, size: u32) -> S::u32s {
    c.simd_lt(last).select(S::u32s::splat(simd, size), S::u32s::splat(simd, 0))
}

/// `a + (b - a) * w`.
#[inline(always)]
pub(crate) fn lerp<S: Simd>(a: S::f32s, b: S::f32s, w: S::f32s) -> S::f32s {
    (b - a).mul_add(w, a)
}
