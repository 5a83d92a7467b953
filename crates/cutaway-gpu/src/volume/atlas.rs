//! Bricks on the device: the atlas, a 3D texture of slots, and the page table that says what is in which.

use std::collections::HashMap;

use cutaway_core::glam::UVec3;
use cutaway_core::voxel_source::{Region, SourceError, VoxelSource, gather};
use rayon::prelude::*;

use super::bricks::{Brick, BrickGrid, Plan, brick_of};
use super::texels::Texels;
use super::texture::texture_3d;
use crate::context::Gpu;
use crate::error::GpuError;

/// Bytes that are handed to the queue before it is told to go: it keeps a copy of all that it has not sent.
pub(super) const BYTES_AT_ONCE: usize = 32 << 20;

/// Slots and what is in them.
#[derive(Debug)]
pub(super) struct Atlas {
    grid: BrickGrid,
    texels: Texels,
    /// Slots along x, y, z.
    slots: UVec3,
    texture: wgpu::Texture,
    pages: wgpu::Texture,
    /// The slot of every brick that is there, wanted or not.
    resident: HashMap<Brick, u32>,
    /// Bricks uploaded since the start.
    uploads: u64,
}

impl Atlas {
    /// Room for `wanted` bricks, or as many as there may be.
    pub(super) fn new(gpu: &Gpu, grid: BrickGrid, texels: Texels, wanted: u64) -> Result<Self, GpuError> {
        let slots = grid.atlas(wanted);
        let size = slots * grid.slot_edge();
        let texture =
            gpu.checked("the volume's bricks", || texture_3d(gpu, "bricks", size, texels.format))?;
        let pages = gpu.checked("the bricks' page table", || {
            texture_3d(gpu, "pages", grid.pages, wgpu::TextureFormat::Rg32Uint)
        })?;
        Ok(Self { grid, texels, slots, texture, pages, resident: HashMap::new(), uploads: 0 })
    }

    pub(super) fn capacity(&self) -> u64 {
        u64::from(self.slots.x) * u64::from(self.slots.y) * u64::from(self.slots.z)
    }

    pub(super) fn uploads(&self) -> u64 {
        self.uploads
    }

    pub(super) fn bytes(&self) -> u64 {
        self.capacity() * slot_bytes(&self.grid, &self.texels) + self.grid.page_count() as u64 * 8
    }

    pub(super) fn views(&self) -> [wgpu::TextureView; 2] {
        [&self.texture, &self.pages].map(|t| t.create_view(&wgpu::TextureViewDescriptor::default()))
    }

    /// Uploads what a plan has and the atlas has not, over what the plan has not, and writes the page table.
    pub(super) fn follow(
        &mut self,
        gpu: &Gpu,
        source: &dyn VoxelSource,
        plan: &Plan,
    ) -> Result<(), GpuError> {
        let missing = self.make_room(plan);
        let at_once = (BYTES_AT_ONCE as u64 / slot_bytes(&self.grid, &self.texels)).max(1) as usize;
        for some in missing.chunks(at_once) {
            let encoded =
                |(brick, _): &(Brick, u32)| Ok(self.texels.encoded(&voxels_of(source, &self.grid, brick)?));
            let bytes: Vec<Vec<u8>> =
                some.par_iter().map(encoded).collect::<Result<_, SourceError>>().map_err(unread)?;
            gpu.checked("uploading bricks", || {
                for ((_, slot), bytes) in some.iter().zip(&bytes) {
                    self.write(gpu, *slot, bytes);
                }
                gpu.queue().submit([]);
            })?;
            gpu.finish()?;
            // Only what has arrived is there: an upload that fails is repeated by whoever tries again.
            self.resident.extend(some.iter().copied());
            self.uploads += some.len() as u64;
        }
        self.write_pages(gpu, source, plan)
    }

    /// Slots for the bricks that are missing: free ones first, then those of bricks that are not wanted.
    fn make_room(&mut self, plan: &Plan) -> Vec<(Brick, u32)> {
        let mut taken = vec![false; self.capacity() as usize];
        let mut unwanted = Vec::new();
        for (brick, slot) in &self.resident {
            taken[*slot as usize] = true;
            if plan.bricks.binary_search(brick).is_err() {
                unwanted.push((*brick, *slot));
            }
        }
        let free = (0..taken.len()).filter(|s| !taken[*s]).map(|s| (None, s as u32));
        let mut room = free.chain(unwanted.into_iter().map(|(brick, slot)| (Some(brick), slot)));
        let missing: Vec<Brick> =
            plan.bricks.iter().filter(|b| !self.resident.contains_key(b)).copied().collect();
        let placed: Vec<(Brick, Option<Brick>, u32)> =
            missing.into_iter().zip(&mut room).map(|(brick, (old, slot))| (brick, old, slot)).collect();
        for (_, old, _) in &placed {
            old.map(|old| self.resident.remove(&old));
        }
        placed.into_iter().map(|(brick, _, slot)| (brick, slot)).collect()
    }

    fn slot(&self, slot: u32) -> UVec3 {
        let UVec3 { x, y, .. } = self.slots;
        UVec3::new(slot % x, slot / x % y, slot / (x * y))
    }

    fn write(&self, gpu: &Gpu, slot: u32, bytes: &[u8]) {
        let edge = self.grid.slot_edge();
        let at = self.slot(slot) * edge;
        let target = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: at.x, y: at.y, z: at.z },
            ..self.texture.as_image_copy()
        };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(edge * self.texels.bytes_per_voxel()),
            rows_per_image: Some(edge),
        };
        let size = wgpu::Extent3d { width: edge, height: edge, depth_or_array_layers: edge };
        gpu.queue().write_texture(target, bytes, layout, size);
    }

    /// See `shared/bricks.wgsl`.
    fn write_pages(&self, gpu: &Gpu, source: &dyn VoxelSource, plan: &Plan) -> Result<(), GpuError> {
        let entries: Vec<[u32; 2]> = (0..self.grid.page_count())
            .into_par_iter()
            .map(|page| {
                if let Some(level) = plan.levels[page]
                    && let Some(slot) = self.resident.get(&brick_of(&self.grid, page, level))
                {
                    let at = self.slot(*slot);
                    return Ok([1 << 31 | at.z << 20 | at.y << 10 | at.x, level]);
                }
                // Any value that occurs in a brick of which nothing is visible is invisible.
                let corner = UVec3::from_array(brick_of(&self.grid, page, 0).at) * self.grid.edge;
                let min = corner.min(self.grid.dimensions - UVec3::ONE);
                let stored = gather(source, &finest(min, min + UVec3::ONE))?[0];
                Ok([0, (self.texels.texel(f64::from(stored)) as f32).to_bits()])
            })
            .collect::<Result<_, SourceError>>()
            .map_err(unread)?;
        let UVec3 { x, y, z } = self.grid.pages;
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(x * 8), rows_per_image: Some(y) };
        let size = wgpu::Extent3d { width: x, height: y, depth_or_array_layers: z };
        gpu.checked("the bricks' page table", || {
            gpu.queue().write_texture(
                self.pages.as_image_copy(),
                bytemuck::cast_slice(&entries),
                layout,
                size,
            );
        })
    }
}

/// Bytes of a slot.
pub(super) fn slot_bytes(grid: &BrickGrid, texels: &Texels) -> u64 {
    u64::from(grid.slot_edge()).pow(3) * u64::from(texels.bytes_per_voxel())
}

/// A region of the finest level.
fn finest(min: UVec3, max: UVec3) -> Region {
    Region { level: 0, channel: 0, time: 0, min, max }
}

fn unread(error: SourceError) -> GpuError {
    GpuError::Source { reason: error.to_string() }
}

/// The stored numbers of a brick with its border, x fastest; outside the volume its nearest voxel's.
fn voxels_of(source: &dyn VoxelSource, grid: &BrickGrid, brick: &Brick) -> Result<Vec<f32>, SourceError> {
    let stride = 1i64 << brick.level;
    let corner = brick.at.map(|c| i64::from(c) * i64::from(grid.edge) * stride - stride);
    let reach = i64::from(grid.slot_edge() - 1) * stride;
    let read = Patch::read(source, grid.dimensions, corner, reach, stride / 2)?;
    let places = |axis: usize| -> Vec<i64> {
        (0..i64::from(grid.slot_edge())).map(|i| corner[axis] + i * stride).collect()
    };
    let [xs, ys, zs] = [0, 1, 2].map(places);
    let mut stored = Vec::with_capacity(xs.len().pow(3));
    for z in &zs {
        for y in &ys {
            let one = |x: &i64| match stride {
                1 => read.clamped([*x, *y, *z]),
                _ => read.averaged([*x, *y, *z], stride),
            };
            stored.extend(xs.iter().map(one));
        }
    }
    Ok(stored)
}

/// The part of the finest level that a brick is made of.
struct Patch {
    stored: Vec<f32>,
    min: [i64; 3],
    size: [i64; 3],
}

impl Patch {
    /// Reads from `half` before `corner` to `half` behind `corner + reach`, as far as there are voxels.
    fn read(
        source: &dyn VoxelSource,
        dimensions: UVec3,
        corner: [i64; 3],
        reach: i64,
        half: i64,
    ) -> Result<Self, SourceError> {
        let last = dimensions.to_array().map(|n| i64::from(n) - 1);
        let clamped = |at: i64, axis: usize| at.clamp(0, last[axis]);
        let min = std::array::from_fn(|axis| clamped(corner[axis] - half, axis));
        let max: [i64; 3] = std::array::from_fn(|axis| clamped(corner[axis] + reach + half, axis) + 1);
        let size = std::array::from_fn(|axis| max[axis] - min[axis]);
        let [lo, hi] = [min, max].map(|at| UVec3::from_array(at.map(|v| v as u32)));
        Ok(Self { stored: gather(source, &finest(lo, hi))?, min, size })
    }

    /// The voxel of a place, or the nearest one that there is.
    fn clamped(&self, at: [i64; 3]) -> f32 {
        let [x, y, z] = std::array::from_fn(|axis| (at[axis] - self.min[axis]).clamp(0, self.size[axis] - 1));
        self.stored[((z * self.size[1] + y) * self.size[0] + x) as usize]
    }

    /// The mean around a voxel over a coarser voxel's cell, `stride` wide: the trapezoidal rule, so that it lies in the middle.
    fn averaged(&self, at: [i64; 3], stride: i64) -> f32 {
        let half = stride / 2;
        let weight = |d: i64| if d.abs() == half { 0.5 } else { 1.0f32 };
        let mut sum = 0.0f32;
        for dz in -half..=half {
            for dy in -half..=half {
                let one = |dx: i64| weight(dx) * self.clamped([at[0] + dx, at[1] + dy, at[2] + dz]);
                let row: f32 = (-half..=half).map(one).sum();
                sum += weight(dz) * weight(dy) * row;
            }
        }
        sum / (stride * stride * stride) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::glam::DVec3;
    use cutaway_core::volume::{Geometry, Rescale, Volume};

    fn ramp(d: UVec3) -> Volume {
        let mut voxels = Vec::new();
        for z in 0..d.z {
            for y in 0..d.y {
                voxels.extend((0..d.x).map(|x| (x + 2 * y + 3 * z) as f32));
            }
        }
        Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    #[test]
    fn a_brick_has_its_voxels_and_their_neighbours() {
        let volume = ramp(UVec3::new(20, 12, 12));
        let grid = BrickGrid { edge: 8, ..BrickGrid::new(UVec3::new(20, 12, 12), 4, 64, u64::MAX).unwrap() };
        let stored = voxels_of(&volume, &grid, &Brick { level: 0, at: [1, 0, 0] }).unwrap();
        assert_eq!(stored.len(), 11 * 11 * 11);
        // The first row lies a voxel outside in y and z, where values repeat, and starts a voxel before the brick.
        assert_eq!(&stored[..11], [7., 8., 9., 10., 11., 12., 13., 14., 15., 16., 17.]);
        assert_eq!(stored[11 * 11 * 2 + 11 * 3], 7.0 + 2.0 * 2.0 + 3.0);
        let last = voxels_of(&volume, &grid, &Brick { level: 0, at: [2, 1, 1] }).unwrap();
        assert_eq!(last[11 * 11 * 11 - 1], 19.0 + 22.0 + 33.0);
    }

    #[test]
    fn coarser_voxels_are_means_around_their_place() {
        let volume = ramp(UVec3::splat(40));
        let grid = BrickGrid { edge: 8, ..BrickGrid::new(UVec3::splat(40), 4, 64, u64::MAX).unwrap() };
        for level in [1, 2] {
            let stored = voxels_of(&volume, &grid, &Brick { level, at: [0, 0, 0] }).unwrap();
            // A linear field's mean is what it is in the middle; the third texel is two coarser voxels from the corner's.
            let at = 2.0 * f32::from(1u8 << level);
            assert_eq!(stored[3 + 11 * 3 + 121 * 3], 6.0 * at);
        }
    }
}
