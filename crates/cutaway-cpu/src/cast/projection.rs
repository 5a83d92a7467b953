//! Projections: the maximum, minimum or mean of the value along a ray, classified once.

use cutaway_core::scene::{Mode, SpaceSkipping};
use fearless_simd::prelude::*;
use fearless_simd::{Select, Simd, SimdBase};

use super::{Kernel, pixel_of_lane};
use crate::packet::Packet;
use crate::sample::{Grid, LaneVoxel};
use crate::slabs::SlabWalk;
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
        Mode::Mean => mean(simd, grid, packet, tile),
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
    let (blocks0, blocks1) = (&ranges.level0, &ranges.level1);
    let bound = |[lo, hi]: [f32; 2]| if sign > 0.0 { hi } else { -lo };
    let mut best = S::f32s::splat(simd, f32::NEG_INFINITY);
    let mut at = S::f32s::splat(simd, 0.0);
    let mut walk = SlabWalk::new(packet, blocks0.dimensions);
    if kernel.scene.settings().space_skipping == SpaceSkipping::Off {
        walk = walk.without_skipping();
    }
    loop {
        let least = least_of_hit(packet, &best);
        let beats = |range| bound(range) > least;
        let stretch = walk.next(
            |r| r.any(blocks0.dimensions, |b| beats(blocks0.blocks[b])),
            |r| r.any(blocks1.dimensions, |b| beats(blocks1.blocks[b])),
        );
        let Some(stretch) = stretch else { break };
        tile.runs += 1;
        for k in stretch.begin..stretch.end {
            let (middle, length) = packet.sample(simd, k);
            let position = grid.locate(simd, packet.position(middle));
            let value = grid.value(simd, &position) * sign;
            let inside = length.simd_gt(0.0);
            tile.samples += u64::from(inside.to_bitmask().count_ones());
            let better = inside & value.simd_gt(best);
            best = better.select(value, best);
            at = better.select(middle, at);
        }
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

/// The least of the bests of the lanes that meet the volume.
#[inline(always)]
fn least_of_hit<S: Simd>(packet: &Packet<S>, best: &S::f32s) -> f32 {
    let hit = packet.lanes.iter().zip(best.as_slice()).filter(|(lane, _)| lane.total > 0.0);
    hit.fold(f32::INFINITY, |least, (_, best)| least.min(*best))
}

/// The mean stored number; the last, shorter step of a ray counts for its length.
#[inline(always)]
fn mean<S: Simd, T: LaneVoxel>(
    simd: S,
    grid: Grid<'_, T>,
    packet: &Packet<S>,
    tile: &mut Tile,
) -> Projected<S> {
    let zero = S::f32s::splat(simd, 0.0);
    let mut sum = zero;
    tile.runs += 1;
    for k in 0..packet.end() {
        let (middle, length) = packet.sample(simd, k);
        let position = grid.locate(simd, packet.position(middle));
        let value = grid.value(simd, &position);
        let inside = length.simd_gt(0.0);
        tile.samples += u64::from(inside.to_bitmask().count_ones());
        sum += inside.select(value * length, zero);
    }
    Projected { stored: sum / packet.total, k: zero }
}
