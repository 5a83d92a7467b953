//! Emission and absorption, front to back.

use fearless_simd::prelude::*;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat};

use super::{Kernel, pixel_of_lane};
use crate::packet::Packet;
use crate::sample::{Grid, LaneVoxel};
use crate::simd::{LaneSource, MAX_LANES};
use crate::slabs::SlabWalk;
use crate::tiles::{Frame, Tile};

/// What a packet has accumulated.
struct Accumulated<S: Simd> {
    /// Premultiplied.
    color: [S::f32s; 3],
    transmittance: S::f32s,
    /// Where the opacity passes one half, in steps.
    depth: S::f32s,
}

/// Samples after which a stretch is left if every lane is opaque.
const CHECK_EVERY: u32 = 4;

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
    let zero = S::f32s::splat(simd, 0.0);
    let mut sum = Accumulated::<S> {
        color: [zero; 3],
        transmittance: S::f32s::splat(simd, 1.0),
        depth: S::f32s::splat(simd, f32::INFINITY),
    };
    let caster = Caster::new(simd, kernel, grid, packet);
    let occupancy = &kernel.classification.occupancy;
    let mut walk = SlabWalk::new(packet, occupancy.dimensions());
    let (dimensions0, dimensions1) = (occupancy.dimensions(), occupancy.level1_dimensions());
    while let Some(stretch) = walk.next(
        |r| r.any(dimensions0, |b| occupancy.level0(b)),
        |r| r.any(dimensions1, |b| occupancy.level1(b)),
    ) {
        tile.runs += 1;
        let mut k = stretch.begin;
        while k < stretch.end {
            let until = stretch.end.min(k + CHECK_EVERY);
            let open = (packet.not_ended(k) & sum.transmittance.simd_ge(kernel.opaque_below)).to_bitmask();
            if open == 0 {
                break;
            }
            for k in k..until {
                tile.samples += u64::from(caster.sample(simd, &mut sum, k));
            }
            k = until;
        }
        if !sum.transmittance.simd_ge(kernel.opaque_below).any_true() {
            break;
        }
    }
    write(simd, frame, packet, &sum, tile, out);
}

/// What every sample of a packet needs.
struct Caster<'a, S: Simd, T> {
    kernel: &'a Kernel<'a>,
    grid: Grid<'a, T>,
    packet: &'a Packet<S>,
    opacities: LaneSource<'a, f32>,
    colors: LaneSource<'a, [f32; 4]>,
    light: Option<(&'a super::Shading, super::shading::PacketLight<S>)>,
}

impl<'a, S: Simd, T: LaneVoxel> Caster<'a, S, T> {
    #[inline(always)]
    fn new(simd: S, kernel: &'a Kernel<'a>, grid: Grid<'a, T>, packet: &'a Packet<S>) -> Self {
        let light = kernel.shading.as_ref().map(|s| (s, s.packet_light(simd, packet)));
        let opacities = LaneSource::new(&kernel.classification.opacities);
        let colors = LaneSource::new(&kernel.classification.colors);
        Self { kernel, grid, packet, opacities, colors, light }
    }

    /// Takes the samples of step `k` of the lanes that are still open; returns how many those are.
    #[inline(always)]
    fn sample(&self, simd: S, sum: &mut Accumulated<S>, k: u32) -> u32 {
        let (middle, length) = self.packet.sample(simd, k);
        let at = self.grid.locate(simd, self.packet.position(middle));
        let index = self.table_index(simd, self.grid.value(simd, &at));
        let alpha = S::f32s::from_slice(simd, &self.opacities.singles(simd, index)[..S::f32s::LEN]);
        let open = length.simd_gt(0.0) & sum.transmittance.simd_ge(self.kernel.opaque_below);
        let taken = open.to_bitmask().count_ones();
        let mut alpha = open.select(alpha, S::f32s::splat(simd, 0.0));
        if !alpha.simd_gt(0.0).any_true() {
            return taken;
        }
        if length.simd_lt(1.0).any_true() {
            alpha = shorter(simd, alpha, length);
        }
        let [mut r, mut g, mut b] = columns(simd, &self.colors.singles(simd, index));
        if let Some((shading, light)) = &self.light {
            let (factor, white) = shading.terms(simd, light, self.grid.gradient(simd, &at));
            r = r.mul_add(factor, white);
            g = g.mul_add(factor, white);
            b = b.mul_add(factor, white);
        }
        let weight = sum.transmittance * alpha;
        let after = sum.transmittance - weight;
        let passes_half = after.simd_le(0.5) & sum.transmittance.simd_gt(0.5);
        if passes_half.any_true() {
            sum.depth =
                passes_half.select(half_way(simd, middle, length, sum.transmittance, after), sum.depth);
        }
        let [sum_r, sum_g, sum_b] = sum.color;
        sum.color = [weight.mul_add(r, sum_r), weight.mul_add(g, sum_g), weight.mul_add(b, sum_b)];
        sum.transmittance = after;
        taken
    }

    #[inline(always)]
    fn table_index(&self, simd: S, value: S::f32s) -> S::u32s {
        let (lo, scale) = self.kernel.classification.index_map;
        let last = self.kernel.classification.opacities.len() as i32 - 1;
        let index: S::i32s = ((value - lo) * scale + 0.5).to_int();
        index.max(S::i32s::splat(simd, 0)).min(S::i32s::splat(simd, last)).bitcast()
    }
}

/// Red, green and blue of many lanes.
#[inline(always)]
fn columns<S: Simd>(simd: S, colors: &[[f32; 4]; MAX_LANES]) -> [S::f32s; 3] {
    let n = S::f32s::LEN;
    [
        S::f32s::from_slice(simd, &colors.map(|c| c[0])[..n]),
        S::f32s::from_slice(simd, &colors.map(|c| c[1])[..n]),
        S::f32s::from_slice(simd, &colors.map(|c| c[2])[..n]),
    ]
}

/// Opacity of `length` steps (at most one) where that of a whole step is `alpha`: the last stretch of a ray is short.
#[inline(always)]
fn shorter<S: Simd>(simd: S, alpha: S::f32s, length: S::f32s) -> S::f32s {
    S::f32s::from_fn(simd, |l| {
        if length[l] >= 1.0 {
            alpha[l]
        } else if length[l] <= 0.0 {
            0.0
        } else {
            -f32::exp_m1(length[l] * f32::ln_1p(-alpha[l]))
        }
    })
}

/// Where within its stretch a sample takes the transmittance through one half, in steps.
#[inline(always)]
fn half_way<S: Simd>(simd: S, middle: S::f32s, length: S::f32s, before: S::f32s, after: S::f32s) -> S::f32s {
    S::f32s::from_fn(simd, |l| {
        let share = (before[l] / 0.5).ln() / (before[l] / after[l].max(1e-30)).ln();
        middle[l] + length[l] * (share - 0.5)
    })
}

#[inline(always)]
fn write<S: Simd>(
    _simd: S,
    frame: &Frame,
    packet: &Packet<S>,
    sum: &Accumulated<S>,
    tile: &mut Tile,
    out: usize,
) {
    for l in 0..Packet::<S>::LANES {
        let lane = &packet.lanes[l];
        if lane.total > 0.0 {
            let pixel = pixel_of_lane::<S>(out, l);
            let [r, g, b] = [sum.color[0][l], sum.color[1][l], sum.color[2][l]];
            tile.colors[pixel] = [r, g, b, 1.0 - sum.transmittance[l]];
            tile.depths[pixel] = (lane.t_entry + f64::from(sum.depth[l]) * frame.step_length) as f32;
        }
    }
}
