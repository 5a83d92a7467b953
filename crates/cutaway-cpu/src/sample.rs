//! The field sampler: trilinear values and gradients of many lanes at once, from voxels in x-fastest order.
//!
//! All arithmetic is in stored numbers; the caller knows the rescale. Neighbours along x are loaded together.

use cutaway_core::volume::Volume;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, SimdBase};

use crate::simd::{LaneSource, PackedVoxel};

/// A stored voxel type that lanes can be filled with.
pub(crate) trait LaneVoxel: PackedVoxel + Send + Sync + 'static {
    /// The voxels of packed pairs, as floats.
    fn unpack_pair<S: Simd>(words: [S::u32s; 2]) -> [S::f32s; 2];

    /// The voxels of packed fours, as floats.
    fn unpack_four<S: Simd>(words: [S::u32s; 4]) -> [S::f32s; 4];
}

impl LaneVoxel for u8 {
    #[inline(always)]
    fn unpack_pair<S: Simd>([w, _]: [S::u32s; 2]) -> [S::f32s; 2] {
        [to_float::<S>(w & 0xff), to_float::<S>(w >> 8)]
    }

    #[inline(always)]
    fn unpack_four<S: Simd>([w, ..]: [S::u32s; 4]) -> [S::f32s; 4] {
        let low = [to_float::<S>(w & 0xff), to_float::<S>((w >> 8) & 0xff)];
        [low[0], low[1], to_float::<S>((w >> 16) & 0xff), to_float::<S>(w >> 24)]
    }
}

impl LaneVoxel for u16 {
    #[inline(always)]
    fn unpack_pair<S: Simd>([w, _]: [S::u32s; 2]) -> [S::f32s; 2] {
        [to_float::<S>(w & 0xffff), to_float::<S>(w >> 16)]
    }

    #[inline(always)]
    fn unpack_four<S: Simd>([low, high, ..]: [S::u32s; 4]) -> [S::f32s; 4] {
        let first = [to_float::<S>(low & 0xffff), to_float::<S>(low >> 16)];
        [first[0], first[1], to_float::<S>(high & 0xffff), to_float::<S>(high >> 16)]
    }
}

impl LaneVoxel for f32 {
    #[inline(always)]
    fn unpack_pair<S: Simd>([a, b]: [S::u32s; 2]) -> [S::f32s; 2] {
        [a.bitcast(), b.bitcast()]
    }

    #[inline(always)]
    fn unpack_four<S: Simd>([a, b, c, d]: [S::u32s; 4]) -> [S::f32s; 4] {
        [a.bitcast(), b.bitcast(), c.bitcast(), d.bitcast()]
    }
}

/// Voxels of at most 16 bits as floats: the signed conversion, one instruction everywhere, is right for them.
#[inline(always)]
fn to_float<S: Simd>(v: S::u32s) -> S::f32s {
    let signed: S::i32s = v.bitcast();
    signed.to_float()
}

/// A volume's voxels and the shape that addresses them.
#[derive(Clone, Copy)]
pub(crate) struct Grid<'a, T> {
    voxels: LaneSource<'a, T>,
    /// Voxels along each axis.
    dimensions: [u32; 3],
}

/// Where lanes are: the cell's first voxel, its linear index, and the position within the cell.
#[derive(Clone, Copy)]
pub(crate) struct CellPosition<S: Simd> {
    cell: [S::u32s; 3],
    index: S::u32s,
    fraction: [S::f32s; 3],
}

impl<'a, T: LaneVoxel> Grid<'a, T> {
    pub(crate) fn new(volume: &Volume, voxels: &'a [T]) -> Self {
        Self { voxels: LaneSource::new(voxels), dimensions: volume.dimensions().to_array() }
    }

    /// The cells that hold positions in voxel space; positions outside are moved to the volume's border.
    #[inline(always)]
    pub(crate) fn locate<S: Simd>(&self, simd: S, p: [S::f32s; 3]) -> CellPosition<S> {
        let [nx, ny, nz] = self.dimensions;
        let (x, fx) = cell_along::<S>(simd, p[0], nx);
        let (y, fy) = cell_along::<S>(simd, p[1], ny);
        let (z, fz) = cell_along::<S>(simd, p[2], nz);
        CellPosition { cell: [x, y, z], index: (z * ny + y) * nx + x, fraction: [fx, fy, fz] }
    }

    /// The values along x in the rows that begin at `index`: interpolated on the cell's edge.
    #[inline(always)]
    fn edge<S: Simd>(&self, simd: S, index: S::u32s, fx: S::f32s) -> S::f32s {
        let [a, b] = T::unpack_pair::<S>(self.voxels.pairs(simd, index));
        lerp::<S>(a, b, fx)
    }

    /// The field at located positions.
    #[inline(always)]
    pub(crate) fn value<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> S::f32s {
        let [fx, fy, fz] = at.fraction;
        let row = self.dimensions[0];
        let plane = row * self.dimensions[1];
        let i = at.index;
        let [e0, e1, e2, e3] = self.voxels.pairs_at(simd, i, [0, row, plane, plane + row]);
        let near = lerp::<S>(on_edge::<S, T>(e0, fx), on_edge::<S, T>(e1, fx), fy);
        let far = lerp::<S>(on_edge::<S, T>(e2, fx), on_edge::<S, T>(e3, fx), fy);
        lerp::<S>(near, far, fz)
    }

    /// An edge of the cell along x: the value on it, and the difference along x (twice the derivative).
    #[inline(always)]
    fn long_edge<S: Simd>(&self, simd: S, index: S::u32s, x: S::u32s, fx: S::f32s) -> (S::f32s, S::f32s) {
        let last = self.dimensions[0] - 2;
        let inside = x.simd_gt(0) & x.simd_lt(last);
        let [before, a, b, after] = if inside.all_true() {
            T::unpack_four::<S>(self.voxels.fours(simd, index - 1))
        } else {
            // At the border the border's voxels repeat.
            let [a, b] = T::unpack_pair::<S>(self.voxels.pairs(simd, index));
            let [before, _] = T::unpack_pair::<S>(self.voxels.pairs(simd, index - down::<S>(simd, x, 1)));
            let [_, after] = T::unpack_pair::<S>(self.voxels.pairs(simd, index + up::<S>(simd, x, last, 1)));
            [before, a, b, after]
        };
        (lerp::<S>(a, b, fx), lerp::<S>(b - before, after - a, fx))
    }

    /// Twice the field's gradient in voxel space (stored numbers a voxel): central differences of the voxels,
    /// interpolated; beyond the border the border's voxels repeat.
    #[inline(always)]
    pub(crate) fn gradient<S: Simd>(&self, simd: S, at: &CellPosition<S>) -> [S::f32s; 3] {
        let [nx, ny, nz] = self.dimensions;
        let [fx, fy, fz] = at.fraction;
        let [x, y, z] = at.cell;
        let (row, plane) = (nx, nx * ny);
        // Distances to the voxel before the cell and to the one after it, 0 at the border.
        let (down_y, up_y) = (down::<S>(simd, y, row), up::<S>(simd, y, ny - 2, row));
        let (down_z, up_z) = (down::<S>(simd, z, plane), up::<S>(simd, z, nz - 2, plane));
        let (i00, i10) = (at.index, at.index + row);
        let (i01, i11) = (at.index + plane, at.index + (plane + row));
        let (v00, x00) = self.long_edge(simd, i00, x, fx);
        let (v10, x10) = self.long_edge(simd, i10, x, fx);
        let (v01, x01) = self.long_edge(simd, i01, x, fx);
        let (v11, x11) = self.long_edge(simd, i11, x, fx);
        let gx = lerp::<S>(lerp::<S>(x00, x10, fy), lerp::<S>(x01, x11, fy), fz);
        // Along y: rows y-1 and y+2 beside the cell's own, on both planes.
        let y0 =
            lerp::<S>(v10 - self.edge(simd, i00 - down_y, fx), self.edge(simd, i10 + up_y, fx) - v00, fy);
        let y1 =
            lerp::<S>(v11 - self.edge(simd, i01 - down_y, fx), self.edge(simd, i11 + up_y, fx) - v01, fy);
        let gy = lerp::<S>(y0, y1, fz);
        // Along z: planes z-1 and z+2 beside the cell's own.
        let before = lerp::<S>(self.edge(simd, i00 - down_z, fx), self.edge(simd, i10 - down_z, fx), fy);
        let after = lerp::<S>(self.edge(simd, i01 + up_z, fx), self.edge(simd, i11 + up_z, fx), fy);
        let (near, far) = (lerp::<S>(v00, v10, fy), lerp::<S>(v01, v11, fy));
        let gz = lerp::<S>(far - before, after - near, fz);
        [gx, gy, gz]
    }
}

/// The value on an edge along x, from its packed ends.
#[inline(always)]
fn on_edge<S: Simd, T: LaneVoxel>(words: [S::u32s; 2], fx: S::f32s) -> S::f32s {
    let [a, b] = T::unpack_pair::<S>(words);
    lerp::<S>(a, b, fx)
}

/// The cell of positions along an axis of `n` voxels, and where within it they lie.
#[inline(always)]
fn cell_along<S: Simd>(simd: S, p: S::f32s, n: u32) -> (S::u32s, S::f32s) {
    let p = p.max(0.0).min((n - 1) as f32);
    let cell: S::i32s = p.to_int();
    // Bounded once more as a whole number: whatever a NaN became is a cell, too.
    let cell = cell.max(S::i32s::splat(simd, 0)).min(S::i32s::splat(simd, n as i32 - 2));
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
