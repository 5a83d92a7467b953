//! Projections: the maximum, minimum or mean of the value along a ray, classified once.

use cutaway_core::scene::{Mode, SpaceSkipping};
use fearless_simd::prelude::*;
use fearless_simd::{Select, Simd, SimdBase};

use super::{Kernel, pixel_of_lane};
use crate::bundle::{Bundle, Member, Stretch};
use crate::packet::Packet;
use crate::rays::Frame;
use crate::sample::{Grid, LaneVoxel};
use crate::tiles::Tile;

/// Per lane: the projected stored number so far, and where along the ray it stands, in steps.
#[derive(Clone, Copy)]
pub(super) struct Projected<S: Simd> {
    stored: S::f32s,
    at: S::f32s,
}

/// Casts the packets of a bundle and writes their pixels.
#[inline(always)]
pub(super) fn bundle<S: Simd, T: LaneVoxel>(
    simd: S,
    kernel: &Kernel,
    frame: &Frame,
    grid: Grid<'_, T>,
    bundle: &mut Bundle<S, Projected<S>>,
    at: (u32, u32),
    tile: &mut Tile,
) {
    let rescale = frame.volume.rescale();
    let zero = S::f32s::splat(simd, 0.0);
    if kernel.scene.settings().mode == Mode::Mean {
        bundle.fill(simd, frame, at, Projected { stored: zero, at: zero });
        for member in &mut bundle.members {
            mean(simd, grid, member, tile);
        }
    } else {
        // A falling rescale turns the greatest value into the least stored number.
        let greatest = (kernel.scene.settings().mode == Mode::Mip) == (rescale.slope > 0.0);
        let none = S::f32s::splat(simd, f32::NEG_INFINITY);
        bundle.fill(simd, frame, at, Projected { stored: none, at: zero });
        extremum(simd, kernel, grid, bundle, tile, if greatest { 1.0 } else { -1.0 });
    }
    for member in &bundle.members {
        write(kernel, frame, member, tile);
    }
}

fn write<S: Simd>(kernel: &Kernel, frame: &Frame, member: &Member<S, Projected<S>>, tile: &mut Tile) {
    let Member { packet, sum, pixel, .. } = member;
    let rescale = frame.volume.rescale();
    let hits = packet.hits().to_bitmask();
    for l in 0..Packet::<S>::LANES {
        if hits >> l & 1 == 1 {
            let value = rescale.value(f64::from(sum.stored[l]));
            let ([r, g, b], a) = kernel.scene.transfer_function().evaluate(value);
            let pixel = pixel_of_lane::<S>(tile, *pixel, l);
            tile.colors[pixel] = [r * a, g * a, b * a, a].map(|c| c as f32);
            if a > 0.0 {
                tile.depths[pixel] = packet.t_origin[l] + sum.at[l] * packet.world_step[l];
            }
        }
    }
}

/// The greatest (`sign` 1) or least (`sign` -1) stored number. Where the bound of a slab's blocks is greatest the
/// extremum is likeliest: those slabs come first, and those that cannot beat any lane's best are not sampled.
#[inline(always)]
fn extremum<S: Simd, T: LaneVoxel>(
    simd: S,
    kernel: &Kernel,
    grid: Grid<'_, T>,
    bundle: &mut Bundle<S, Projected<S>>,
    tile: &mut Tile,
    sign: f32,
) {
    let ranges = kernel.volume.ranges();
    let skipping = kernel.scene.settings().space_skipping != SpaceSkipping::Off;
    let bound = |b: usize| {
        let [lo, hi] = ranges.level0.blocks[b];
        if !skipping {
            f32::INFINITY
        } else if sign > 0.0 {
            hi
        } else {
            -lo
        }
    };
    let (mut samples, mut runs) = (0, 0);
    bundle.march_best_first(
        ranges.level0.dimensions,
        bound,
        #[inline(always)]
        |packet, sum, stretch| {
            runs += 1;
            samples += greatest_of_stretch(simd, grid, packet, sum, stretch, sign);
            least_of_hit(simd, packet, sum)
        },
    );
    for member in &mut bundle.members {
        close_in(simd, grid, member, sign);
    }
    tile.samples += samples;
    tile.runs += runs;
}

/// Takes the samples of a stretch; returns how many those are.
#[inline(always)]
fn greatest_of_stretch<S: Simd, T: LaneVoxel>(
    simd: S,
    grid: Grid<'_, T>,
    packet: &Packet<S>,
    sum: &mut Projected<S>,
    stretch: Stretch,
    sign: f32,
) -> u64 {
    let (mut best, mut at) = (sum.stored, sum.at);
    let mut samples = 0;
    for j in stretch.begin..stretch.end {
        let (middle, length) = packet.sample(simd, j);
        let position = grid.locate(simd, packet.position(middle));
        let value = grid.value(simd, &position) * sign;
        let inside = length.simd_gt(0.0);
        samples += u64::from(inside.to_bitmask().count_ones());
        // Of equal ones the nearest, in whatever order they come.
        let better = inside & (value.simd_gt(best) | (value.simd_eq(best) & middle.simd_lt(at)));
        best = better.select(value, best);
        at = better.select(middle, at);
    }
    *sum = Projected { stored: best, at };
    samples
}

/// Of the lanes that meet the volume: the least of their bests, and the farthest place of one.
#[inline(always)]
fn least_of_hit<S: Simd>(simd: S, packet: &Packet<S>, sum: &Projected<S>) -> (f32, f32) {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let hits = packet.hits();
    let least = hits.select(sum.stored, splat(f32::INFINITY)).reduce_min();
    (least, hits.select(sum.at, splat(0.0)).reduce_max())
}

/// The extremum lies between samples: closes in on it from the best one.
#[inline(always)]
fn close_in<S: Simd, T: LaneVoxel>(
    simd: S,
    grid: Grid<'_, T>,
    member: &mut Member<S, Projected<S>>,
    sign: f32,
) {
    let Member { packet, sum, .. } = member;
    for reach in [0.5, 0.25, 0.125, 0.0625] {
        let center = sum.at;
        for offset in [-reach, reach] {
            let j = (center + offset).max(packet.first).min(packet.end);
            let position = grid.locate(simd, packet.position(j));
            let value = grid.value(simd, &position) * sign;
            let better = value.simd_gt(sum.stored);
            sum.stored = better.select(value, sum.stored);
            sum.at = better.select(j, sum.at);
        }
    }
    sum.stored *= sign;
}

/// The mean stored number; the last, shorter step of a ray counts for its length.
#[inline(always)]
fn mean<S: Simd, T: LaneVoxel>(
    simd: S,
    grid: Grid<'_, T>,
    member: &mut Member<S, Projected<S>>,
    tile: &mut Tile,
) {
    let packet = &member.packet;
    let zero = S::f32s::splat(simd, 0.0);
    let mut sum = zero;
    tile.runs += 1;
    for j in 0..packet.bounds.end[1].ceil() as u32 {
        let (middle, length) = packet.sample(simd, j);
        let position = grid.locate(simd, packet.position(middle));
        let value = grid.value(simd, &position);
        let inside = length.simd_gt(0.0);
        tile.samples += u64::from(inside.to_bitmask().count_ones());
        sum += inside.select(value * length, zero);
    }
    member.sum = Projected { stored: sum / (packet.end - packet.first), at: packet.first };
}
