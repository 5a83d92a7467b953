//! Projections: the maximum, minimum or mean of the value along a ray, classified once.

use cutaway_core::scene::{Mode, SpaceSkipping};
use fearless_simd::prelude::*;
use fearless_simd::{Select, Simd, SimdBase};

use super::kernel::{Kernel, Place, count_rays, pixel_of_lane};
use crate::bundle::{BUNDLE, Bundle, Member, Stretch};
use crate::packet::Packet;
use crate::rays::Frame;
use crate::sample::{Grid, LaneVoxel};
use crate::tiles::Tile;

/// What a packet has accumulated.
#[derive(Clone, Copy)]
pub(super) struct Projected<S: Simd> {
    /// Extrema: the stored number, times the sign. Mean: the sum of stored numbers times lengths.
    stored: S::f32s,
    /// Where the extremum stands along the piece of the ray at hand, in steps; below 0 where it was found elsewhere.
    at: S::f32s,
    /// Mean: the length so far, in steps.
    length: S::f32s,
    /// World distance of the extremum, or of where the mean begins.
    depth: S::f32s,
    /// The clip surfaces that are drawn: their white, premultiplied, and how much shows of what is behind them.
    overlay: (S::f32s, S::f32s),
}

/// Casts the packets of a bundle and writes their pixels. Where rays are clipped they are cast piece by piece.
#[inline(always)]
pub(super) fn bundle<S: Simd, T: LaneVoxel>(
    simd: S,
    kernel: &Kernel,
    frame: &Frame,
    grid: Grid<'_, T>,
    bundle: &mut Bundle<S, Projected<S>>,
    Place { at, clip }: Place,
    tile: &mut Tile,
) {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let mode = kernel.scene.settings().mode;
    // A falling rescale turns the greatest value into the least stored number.
    let greatest = (mode == Mode::Mip) == (frame.volume.rescale().slope > 0.0);
    let sign = if greatest || mode == Mode::Mean { 1.0 } else { -1.0 };
    let nothing = Projected {
        stored: splat(if mode == Mode::Mean { 0.0 } else { f32::NEG_INFINITY }),
        at: splat(-1.0),
        length: splat(0.0),
        depth: splat(f32::INFINITY),
        overlay: (splat(0.0), splat(1.0)),
    };
    let ranks = clip.map_or(1, |clip| clip.most(at, BUNDLE));
    let mut sums = vec![nothing; if clip.is_some() { Bundle::<S, Projected<S>>::packets() } else { 0 }];
    for rank in 0..ranks {
        match clip {
            Some(clip) => bundle.fill(simd, frame, at, Some((clip, rank)), |i| sums[i]),
            None => bundle.fill(simd, frame, at, None, |_| nothing),
        }
        for member in &mut bundle.members {
            member.sum.at = splat(-1.0);
            draw_faces(simd, kernel, member);
        }
        if mode == Mode::Mean {
            for member in &mut bundle.members {
                mean(simd, grid, member, tile);
            }
        } else {
            extremum(simd, kernel, grid, bundle, tile, sign);
        }
        count_rays(bundle, tile, rank == 0);
        for member in &bundle.members {
            write(kernel, frame, member, tile, sign);
            if clip.is_some() {
                sums[member.index] = member.sum;
            }
        }
    }
}

/// Draws the clip surfaces that rays begin at. A projection has no front and back: they lie before it.
#[inline(always)]
fn draw_faces<S: Simd>(simd: S, kernel: &Kernel, member: &mut Member<S, Projected<S>>) {
    let opacity = kernel.scene.clip_shading().overlay as f32;
    if let (Some(face), true) = (&member.packet.face, opacity > 0.0) {
        let alpha = member.packet.hits().select(face.present * opacity, S::f32s::splat(simd, 0.0));
        let (white, left) = &mut member.sum.overlay;
        let weight = *left * alpha;
        *white = weight.mul_add(face.terms.0 + face.terms.1, *white);
        *left -= weight;
    }
}

fn write<S: Simd>(
    kernel: &Kernel,
    frame: &Frame,
    member: &Member<S, Projected<S>>,
    tile: &mut Tile,
    sign: f32,
) {
    let Member { packet, sum, pixel, .. } = member;
    let rescale = frame.volume.rescale();
    let hits = packet.hits().to_bitmask();
    let of_lane = |v: &S::f32s, l: usize| f64::from(v.as_slice()[l]);
    for l in 0..Packet::<S>::LANES {
        if hits >> l & 1 == 1 {
            let stored = match kernel.scene.settings().mode {
                Mode::Mean => of_lane(&sum.stored, l) / of_lane(&sum.length, l),
                _ => of_lane(&sum.stored, l) * f64::from(sign),
            };
            let ([r, g, b], a) = kernel.scene.transfer_function().evaluate(rescale.value(stored));
            let (white, left) = (of_lane(&sum.overlay.0, l), of_lane(&sum.overlay.1, l));
            let pixel = pixel_of_lane::<S>(tile, *pixel, l);
            let color = [r, g, b].map(|c| (white + left * c * a) as f32);
            tile.colors[pixel] = [color[0], color[1], color[2], (1.0 - left + left * a) as f32];
            if a > 0.0 {
                tile.depths[pixel] = sum.depth[l];
            } else if left < 1.0 {
                // Of what is drawn, the nearest surface.
                tile.depths[pixel] = tile.depths[pixel].min(packet.entry()[l]);
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
        let Member { packet, sum, .. } = member;
        let found_here = sum.at.simd_ge(0.0);
        sum.depth = found_here.select(sum.at.mul_add(packet.world_step, packet.t_origin), sum.depth);
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
    let mut best = (sum.stored, sum.at);
    let mut samples = 0;
    let [whole_from, whole_to] = packet.bounds.whole;
    if whole_from <= stretch.begin && stretch.end <= whole_to {
        // Rays that miss the volume come along and are not written.
        for j in stretch.begin..stretch.end {
            let middle = S::f32s::splat(simd, j as f32 + 0.5);
            best = better::<S>(best, (value_at(simd, grid, packet, middle, sign), middle));
        }
        samples += u64::from(packet.hits().to_bitmask().count_ones() * (stretch.end - stretch.begin));
    } else {
        let (nothing, nowhere) =
            (S::f32s::splat(simd, f32::NEG_INFINITY), S::f32s::splat(simd, f32::INFINITY));
        for j in stretch.begin..stretch.end {
            let (middle, length) = packet.sample(simd, j);
            let inside = length.simd_gt(0.0);
            samples += u64::from(inside.to_bitmask().count_ones());
            best = better::<S>(
                best,
                (
                    inside.select(value_at(simd, grid, packet, middle, sign), nothing),
                    inside.select(middle, nowhere),
                ),
            );
        }
    }
    (sum.stored, sum.at) = best;
    samples
}

/// The stored number at a step of each ray, times the sign.
#[inline(always)]
fn value_at<S: Simd, T: LaneVoxel>(
    simd: S,
    grid: Grid<'_, T>,
    packet: &Packet<S>,
    middle: S::f32s,
    sign: f32,
) -> S::f32s {
    let position = grid.locate(simd, packet.position(middle));
    grid.value(simd, &position) * sign
}

/// The greater of two extrema, each with its place; of equal ones the nearer, in whatever order they come.
#[inline(always)]
fn better<S: Simd>(
    (best, at): (S::f32s, S::f32s),
    (value, middle): (S::f32s, S::f32s),
) -> (S::f32s, S::f32s) {
    let better = value.simd_gt(best) | (value.simd_eq(best) & middle.simd_lt(at));
    (better.select(value, best), better.select(middle, at))
}

/// Of the lanes that meet the volume: the least of their bests, and the farthest place of one.
#[inline(always)]
fn least_of_hit<S: Simd>(simd: S, packet: &Packet<S>, sum: &Projected<S>) -> (f32, f32) {
    let splat = |v: f32| S::f32s::splat(simd, v);
    let hits = packet.hits();
    let least = hits.select(sum.stored, splat(f32::INFINITY)).reduce_min();
    (least, hits.select(sum.at, splat(0.0)).reduce_max())
}

/// The extremum lies between samples: closes in on it from the best one, where that was found in this piece of a ray.
#[inline(always)]
fn close_in<S: Simd, T: LaneVoxel>(
    simd: S,
    grid: Grid<'_, T>,
    member: &mut Member<S, Projected<S>>,
    sign: f32,
) {
    let Member { packet, sum, .. } = member;
    let found_here = sum.at.simd_ge(0.0);
    for reach in [0.5, 0.25, 0.125, 0.0625] {
        let center = sum.at;
        for offset in [-reach, reach] {
            let j = (center + offset).max(packet.first).min(packet.end);
            let value = value_at(simd, grid, packet, j, sign);
            let better = found_here & value.simd_gt(sum.stored);
            sum.stored = better.select(value, sum.stored);
            sum.at = better.select(j, sum.at);
        }
    }
}

/// The mean stored number; the last, shorter step of a piece counts for its length.
#[inline(always)]
fn mean<S: Simd, T: LaneVoxel>(
    simd: S,
    grid: Grid<'_, T>,
    member: &mut Member<S, Projected<S>>,
    tile: &mut Tile,
) {
    let Member { packet, sum, .. } = member;
    let zero = S::f32s::splat(simd, 0.0);
    tile.runs += 1;
    for j in 0..packet.bounds.end[1].ceil() as u32 {
        let (middle, length) = packet.sample(simd, j);
        let position = grid.locate(simd, packet.position(middle));
        let value = grid.value(simd, &position);
        let inside = length.simd_gt(0.0);
        tile.samples += u64::from(inside.to_bitmask().count_ones());
        sum.stored += inside.select(value * length, zero);
        sum.length += inside.select(length, zero);
    }
    sum.depth = sum.depth.min(packet.hits().select(packet.entry(), sum.depth));
}
