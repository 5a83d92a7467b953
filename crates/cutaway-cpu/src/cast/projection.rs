//! Projections: the maximum, minimum or mean of the value along a ray, classified once.

use cutaway_core::glam::UVec3;
use cutaway_core::occupancy::{BlockState, BlockWalk};
use cutaway_core::scene::{Mode, SpaceSkipping};
use cutaway_core::value_ranges::BLOCK;
use fearless_simd::prelude::*;
use fearless_simd::{Select, Simd, SimdBase};

use super::{Kernel, pixel_of_lane};
use crate::packet::{Packet, Runs};
use crate::sample::{Grid, LaneVoxel};
use crate::simd::MAX_LANES;
use crate::tiles::{Frame, Tile};

#[inline(always)]
pub(super) fn packet<S: Simd, T: LaneVoxel>(
    simd: S,
    kernel: &Kernel,
    frame: &Frame,
    grid: Grid<'_, T>,
    packet: &Packet<S>,
    tile: &mut Tile,
    out: usize,
) {
    let rescale = frame.volume.rescale();
    let projected = match kernel.scene.settings().mode {
        Mode::Mean => mean(simd, kernel, grid, packet, tile),
        mode => {
            // A falling rescale turns the greatest value into the least stored number.
            let greatest = (mode == Mode::Mip) == (rescale.slope > 0.0);
            extremum(simd, kernel, grid, packet, tile, if greatest { 1.0 } else { -1.0 })
        }
    };
    for l in 0..Packet::<S>::LANES {
        let lane = &packet.lanes[l];
        if lane.total > 0.0 {
            let (stored, k) = (projected.stored[l], projected.k[l]);
            let ([r, g, b], a) = kernel.scene.transfer_function().evaluate(rescale.value(f64::from(stored)));
            let pixel = pixel_of_lane::<S>(out, l);
            tile.colors[pixel] = [r * a, g * a, b * a, a].map(|c| c as f32);
            if a > 0.0 {
                tile.depths[pixel] = (lane.t_entry + f64::from(k) * frame.step_length) as f32;
            }
        }
    }
}

/// Per lane: the projected stored number, and where along the ray it stands, in steps.
struct Projected<S: Simd> {
    stored: S::f32s,
    k: S::f32s,
}

/// The greatest (`sign` 1) or least (`sign` -1) stored number. Blocks that cannot beat a lane's best are not sampled.
#[inline(always)]
fn extremum<S: Simd, T: LaneVoxel>(
    simd: S,
    kernel: &Kernel,
    grid: Grid<'_, T>,
    packet: &Packet<S>,
    tile: &mut Tile,
    sign: f32,
) -> Projected<S> {
    let ranges = kernel.volume.ranges();
    let level1_index = |[x, y, z]: [i32; 3]| {
        let b = UVec3::new(x as u32, y as u32, z as u32) / BLOCK;
        ranges.level1.index(b)
    };
    let skip = kernel.scene.settings().space_skipping == SpaceSkipping::Auto;
    let bound = |[lo, hi]: [f32; 2]| if sign > 0.0 { hi } else { -lo };
    let mut best = S::f32s::splat(simd, f32::NEG_INFINITY);
    let mut at = S::f32s::splat(simd, 0.0);
    let mut runs = Runs::new(packet, ranges.level0.dimensions);
    let mut k = 0;
    loop {
        let mut bests = [f32::NEG_INFINITY; MAX_LANES];
        for (l, b) in bests[..Packet::<S>::LANES].iter_mut().enumerate() {
            *b = best[l];
        }
        let next_run = |l: usize, walk: &mut BlockWalk| {
            let beats = |range| !skip || bound(range) > bests[l];
            walk.next_run(|index, block| {
                if beats(ranges.level0.blocks[index]) {
                    BlockState::Occupied
                } else if beats(ranges.level1.blocks[level1_index(block)]) {
                    BlockState::Empty
                } else {
                    BlockState::EmptyLevel1
                }
            })
        };
        let Some(stretch) = runs.next(k, next_run) else { break };
        tile.runs += 1;
        let here = <S::f32s as SimdBase<S>>::Mask::from_bitmask(simd, u64::from(stretch.lanes));
        tile.samples += u64::from(stretch.lanes.count_ones()) * u64::from(stretch.end - stretch.begin);
        for k in stretch.begin..stretch.end {
            let (middle, _) = packet.sample(simd, k);
            let position = grid.locate(simd, packet.position(middle));
            let value = grid.value(simd, &position) * sign;
            let better = here & value.simd_gt(best);
            best = better.select(value, best);
            at = better.select(middle, at);
        }
        k = stretch.end;
    }
    // The extremum lies between samples: close in on it from the best one.
    for reach in [0.5, 0.25, 0.125, 0.0625] {
        let center = at;
        for offset in [-reach, reach] {
            let k = (center + offset).max(0.0).min(packet.total);
            let position = grid.locate(simd, packet.position(k));
            let value = grid.value(simd, &position) * sign;
            let better = value.simd_gt(best);
            best = better.select(value, best);
            at = better.select(k, at);
        }
    }
    Projected { stored: best * sign, k: at }
}

/// The mean stored number; the last, shorter step of a ray counts for its length.
#[inline(always)]
fn mean<S: Simd, T: LaneVoxel>(
    simd: S,
    kernel: &Kernel,
    grid: Grid<'_, T>,
    packet: &Packet<S>,
    tile: &mut Tile,
) -> Projected<S> {
    let zero = S::f32s::splat(simd, 0.0);
    let mut sum = zero;
    let mut runs = Runs::new(packet, kernel.classification.occupancy.dimensions());
    let mut k = 0;
    while let Some(stretch) = runs.next(k, |_, walk| kernel.classification.occupancy.next_run(walk)) {
        tile.runs += 1;
        tile.samples += u64::from(stretch.lanes.count_ones()) * u64::from(stretch.end - stretch.begin);
        let here = <S::f32s as SimdBase<S>>::Mask::from_bitmask(simd, u64::from(stretch.lanes));
        for k in stretch.begin..stretch.end {
            let (middle, length) = packet.sample(simd, k);
            let position = grid.locate(simd, packet.position(middle));
            let value = grid.value(simd, &position);
            sum += here.select(value * length, zero);
        }
        k = stretch.end;
    }
    Projected { stored: sum / packet.total, k: zero }
}
