//! Classification: what stored numbers look like to the kernels, and what there is to see in which blocks.
//!
//! Rebuilt on a change of transfer function, mode or step, in time proportional to the number of blocks; no voxel is read.

use cutaway_core::compositing::segment_opacity;
use cutaway_core::glam::UVec3;
use cutaway_core::occupancy::Occupancy;
use cutaway_core::preintegration::Preintegration;
use cutaway_core::scene::{Mode, Scene, SpaceSkipping};
use cutaway_core::transfer_function::{ClassificationTable, extinction};
use cutaway_core::value_ranges::BlockGrid;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, SimdBase};
use rayon::prelude::*;

use crate::prepared::CpuVolume;

/// What there is to see in a block, as bits; of several blocks together, either's.
pub(crate) mod cast_piece {
    /// Something in it may be visible. A block without this bit is never sampled.
    pub(crate) const VISIBLE: u8 = 1;
    /// Something in it may be transparent: opacity is looked up first, and colour where it is needed. Without this bit
    /// colour and opacity come in one look-up.
    pub(crate) const PARTLY: u8 = 2;
}

/// What is in the blocks of a volume, in three levels: bits of [`cast_piece`], 0 where nothing can be seen.
#[derive(Clone, Debug)]
pub(crate) struct BlockMap {
    /// Blocks of half the edge. Where a block of `fine` is without [`cast_piece::PARTLY`] these are not looked at.
    pub(crate) halves: BlockGrid<u8>,
    pub(crate) fine: BlockGrid<u8>,
    pub(crate) coarse: BlockGrid<u8>,
}

impl BlockMap {
    fn new(volume: &CpuVolume, piece: impl Fn(f32, f32) -> u8 + Sync) -> Self {
        let level0 = &volume.ranges().level0;
        let blocks = level0.blocks.par_iter().map(|&[lo, hi]| piece(lo, hi)).collect();
        let fine = BlockGrid { dimensions: level0.dimensions, blocks };
        let coarse = fine.coarser(0, |any, b| any | b);
        Self { halves: Self::halves(volume.halves(), &fine, piece), fine, coarse }
    }

    /// Blocks of half the edge; asked where what is in the whole block does not tell.
    fn halves(
        ranges: &BlockGrid<[f32; 2]>,
        fine: &BlockGrid<u8>,
        piece: impl Fn(f32, f32) -> u8 + Sync,
    ) -> BlockGrid<u8> {
        let dimensions = ranges.dimensions;
        let mut blocks = vec![0; ranges.blocks.len()];
        blocks.par_chunks_mut(dimensions.x as usize).enumerate().for_each(|(row, out)| {
            let (y, z) = (row as u32 % dimensions.y, row as u32 / dimensions.y);
            let wholes = &fine.blocks[fine.index(UVec3::new(0, y / 2, z / 2))..];
            let ranges = &ranges.blocks[row * dimensions.x as usize..];
            for ((out, ranges), whole) in out.chunks_mut(2).zip(ranges.chunks(2)).zip(wholes) {
                for (out, &[lo, hi]) in out.iter_mut().zip(ranges) {
                    *out = if whole & cast_piece::PARTLY == 0 { *whole } else { piece(lo, hi) };
                }
            }
        });
        BlockGrid { dimensions, blocks }
    }
}

/// Pre-integration tables as kernels read them: see [`Preintegration`].
#[derive(Clone, Debug)]
pub(crate) struct Preintegrated {
    /// Of each bin, the coordinate at its start and its growth.
    pub(crate) starts: Vec<f32>,
    pub(crate) growths: Vec<f32>,
    /// Weights of a step's front and back, and both together.
    pub(crate) front: Vec<[f32; 4]>,
    pub(crate) back: Vec<[f32; 4]>,
    pub(crate) unlit: Vec<[f32; 4]>,
    /// Nodes along a side.
    pub(crate) size: usize,
    pub(crate) index_map: (f32, f32),
}

impl Preintegrated {
    fn new(scene: &Scene) -> Self {
        let volume = scene.volume();
        let table = Preintegration::new(
            scene.transfer_function(),
            scene.unit_distance(),
            scene.step_length(),
            volume.rescale(),
            volume.stored_range(),
        );
        let half = |from: usize| move |e: &[f32; 8]| std::array::from_fn(|c| e[from + c]);
        Self {
            starts: table.bins().iter().map(|b| b[0]).collect(),
            growths: table.bins().iter().map(|b| b[1]).collect(),
            front: table.entries().iter().map(half(0)).collect(),
            back: table.entries().iter().map(half(4)).collect(),
            unlit: table.unlit_entries(),
            size: table.size(),
            index_map: table.index_map(),
        }
    }
}

/// Tables and blocks of one scene's transfer function, mode and step.
#[derive(Clone, Debug)]
pub struct Classification {
    /// *Opacity of a whole step* of each entry: what is looked up where much is transparent.
    pub(crate) opacities: Vec<f32>,
    /// Straight colour and *opacity of a whole step* of each entry.
    pub(crate) colors: Vec<[f32; 4]>,
    /// Straight colour and *optical depth of a whole step* of each entry, for steps of other lengths.
    pub(crate) depths: Vec<[f32; 4]>,
    /// Where the scene asks for it.
    pub(crate) preintegrated: Option<Preintegrated>,
    /// Stored number of entry 0, entries per stored unit.
    pub(crate) index_map: (f32, f32),
    pub(crate) blocks: BlockMap,
    /// For rays that go block by block: isosurfaces.
    pub(crate) occupancy: Option<Occupancy>,
}

impl Classification {
    /// Classifies a volume's blocks for a scene.
    pub fn new(volume: &CpuVolume, scene: &Scene) -> Self {
        let source = scene.volume();
        let table =
            ClassificationTable::new(scene.transfer_function(), source.rescale(), source.stored_range());
        let (unit, step) = (scene.unit_distance(), scene.step_length());
        let opacity_of_step =
            |opacity: f32| segment_opacity(extinction(f64::from(opacity), unit), step) as f32;
        let colors: Vec<[f32; 4]> =
            table.entries().iter().map(|&[r, g, b, a]| [r, g, b, opacity_of_step(a)]).collect();
        let opacities = colors.iter().map(|e| e[3]).collect();
        let depth = |opacity: f32| (extinction(f64::from(opacity), unit) * step) as f32;
        let depths = table.entries().iter().map(|&[r, g, b, a]| [r, g, b, depth(a)]).collect();
        let preintegrated = scene.settings().pre_integration.then(|| Preintegrated::new(scene));
        let settings = scene.settings();
        let ranges = volume.ranges();
        let isovalues: Vec<f64> = settings.iso.iter().map(|v| source.rescale().stored_level(*v)).collect();
        let skipping = settings.space_skipping != SpaceSkipping::Off;
        let blocks = BlockMap::new(volume, |lo, hi| match settings.mode {
            Mode::Composite if skipping && !table.visible(lo, hi) => 0,
            Mode::Composite if table.all_visible(lo, hi) => cast_piece::VISIBLE,
            _ => cast_piece::VISIBLE | cast_piece::PARTLY,
        });
        let occupancy = (settings.mode == Mode::Iso).then(|| {
            let met =
                |lo: f32, hi: f32| isovalues.iter().any(|v| (f64::from(lo)..=f64::from(hi)).contains(v));
            if skipping { Occupancy::new(ranges, met) } else { Occupancy::full(ranges) }
        });
        Self { opacities, colors, depths, preintegrated, index_map: table.index_map(), blocks, occupancy }
    }

    /// The entries of stored numbers.
    #[inline(always)]
    pub(crate) fn table_index<S: Simd>(&self, simd: S, stored: S::f32s) -> S::u32s {
        let (lo, scale) = self.index_map;
        let last = self.opacities.len() as i32 - 1;
        let index: S::i32s = (stored - lo).mul_add(scale, 0.5).to_int();
        index.max(S::i32s::splat(simd, 0)).min(S::i32s::splat(simd, last)).bitcast()
    }

    /// The share of blocks that can be visible, 0..=1.
    pub fn occupied_fraction(&self) -> f64 {
        match &self.occupancy {
            Some(occupancy) => occupancy.occupied_fraction(),
            None => {
                let blocks = &self.blocks.fine.blocks;
                blocks.iter().filter(|b| **b != 0).count() as f64 / blocks.len().max(1) as f64
            }
        }
    }
}
