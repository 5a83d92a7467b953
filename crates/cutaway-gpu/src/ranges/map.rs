//! What ranges of blocks are in: 65535ths of a range that all texels are in.

use cutaway_core::value_ranges::{BLOCK, BlockGrid, ValueRanges};
use cutaway_core::volume::{Volume, Voxels};

use super::levels::BlockLevels;
use crate::volume::Texels;

/// From texels to 65535ths: `(texel - first) * scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RangeMap {
    /// The texel of 0.
    pub(crate) first: f64,
    /// 65535ths in a unit of texels; above 0.
    pub(crate) scale: f64,
    /// Whether all texels are whole numbers of 65535ths, but for rounding.
    pub(crate) whole: bool,
    /// The largest rounding of a texel from the voxel that it stands for, in 65535ths.
    rounding: f64,
}

impl RangeMap {
    /// 8- and 16-bit numbers as they are; of others, the range that occurs.
    pub(crate) fn new(volume: &Volume, texels: &Texels) -> Self {
        let integers = !matches!(volume.voxels(), Voxels::F32(_));
        let unorm = texels.stored_at_zero == 0.0 && [255.0, 65535.0].contains(&texels.stored_per_texel);
        if integers && unorm {
            return Self { first: 0.0, scale: 65535.0, whole: true, rounding: 0.0 };
        }
        let [first, last] = volume.stored_range().map(|stored| texels.texel(f64::from(stored)));
        let scale = if last > first { 65535.0 / (last - first) } else { 1.0 };
        Self { first, scale, whole: false, rounding: 65535.0 * texels.rounding(volume) }
    }

    /// A texel in 65535ths.
    pub(crate) fn place(&self, texel: f64) -> f64 {
        (texel - self.first) * self.scale
    }

    /// A range of texels in a word, as `packed_range` in `packing.wgsl` does it.
    fn packed(&self, [lo, hi]: [f64; 2]) -> u32 {
        let (lo, hi) = (self.place(lo), self.place(hi));
        let (lo, hi) = if self.whole {
            (lo.round(), hi.round())
        } else {
            let slack = self.rounding + 1.0 / 64.0;
            ((lo - slack).floor(), if hi <= 0.0 { 0.0 } else { (hi + slack).ceil() })
        };
        // A conversion of floats to integers stops at the ends of the integers' range.
        u32::from(lo as u16) | u32::from(hi as u16) << 16
    }
}

/// Ranges that were found on the host, as words: the blocks of the host, or larger ones where those would be too many.
pub(super) fn packed_on_host(
    found: &ValueRanges,
    map: RangeMap,
    texels: &Texels,
    most_bytes: u64,
) -> (BlockLevels, Vec<u32>) {
    let (mut fine, mut coarse) = (found.level0.clone(), found.level1.clone());
    let mut edge = BLOCK;
    loop {
        let levels = BlockLevels {
            fine: fine.dimensions,
            coarse: coarse.dimensions,
            fine_edge: edge,
            coarse_edge: edge * BLOCK,
        };
        if levels.fits(most_bytes) {
            let pack = |range: &[f32; 2]| map.packed(range.map(|stored| texels.texel(f64::from(stored))));
            return (levels, fine.blocks.iter().chain(&coarse.blocks).map(pack).collect());
        }
        let larger = united(&coarse);
        (fine, coarse, edge) = (coarse, larger, edge * BLOCK);
    }
}

fn united(blocks: &BlockGrid<[f32; 2]>) -> BlockGrid<[f32; 2]> {
    blocks.coarser([f32::INFINITY, f32::NEG_INFINITY], |a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::glam::{DVec3, UVec3};
    use cutaway_core::volume::{Geometry, Rescale};

    #[test]
    fn too_many_blocks_of_the_host_are_united() {
        let d = UVec3::new(70, 33, 20);
        let voxels: Vec<u8> = (0..d.element_product()).map(|i| (i * 7 % 251) as u8).collect();
        let volume = Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE))
            .expect("a valid volume");
        let found = ValueRanges::new(&volume);
        let texels = Texels {
            format: wgpu::TextureFormat::R8Unorm,
            stored_per_texel: 255.0,
            stored_at_zero: 0.0,
            filtering: crate::context::Filtering::Exact,
        };
        let map = RangeMap::new(&volume, &texels);
        let (levels, words) = packed_on_host(&found, map, &texels, u64::MAX);
        assert_eq!((levels.fine, levels.fine_edge, levels.coarse_edge), (UVec3::new(9, 4, 3), 8, 64));
        assert_eq!(words.len() as u64 * 4, levels.range_bytes());
        assert_eq!(words.last(), Some(&((257 * 250) << 16)));
        let (levels, words) = packed_on_host(&found, map, &texels, 16);
        assert_eq!((levels.fine, levels.fine_edge, words.len()), (UVec3::new(2, 1, 1), 64, 3));
    }
}
