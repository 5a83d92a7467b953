//! Emission and absorption, front to back.

use fearless_simd::prelude::*;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat};

use super::kernel::{Kernel, PacketLight, Place, count_rays, pixel_of_lane};
use crate::bundle::{BUNDLE, Bundle, Member, Stretch};
use crate::classification::cast_piece;
use crate::packet::Packet;
use crate::rays::Frame;
use crate::sample::{Grid, LaneVoxel};
use crate::simd::LaneSource;
use crate::tiles::Tile;

/// What a packet has accumulated.
#[derive(Clone, Copy)]
pub(super) struct Accumulated<S: Simd> {
    /// Premultiplied.
    color: [S::f32s; 3],
    pub(super) transmittance: S::f32s,
    half: Half<S>,
    /// Of how many samples until now something was visible without a break.
    run: u32,
}

/// The step in which a ray's opacity passes one half: transmittance before and after it, where it begins and how long it
/// is, in steps.
#[derive(Clone, Copy)]
struct Half<S: Simd> {
    before: S::f32s,
    after: S::f32s,
    begin: S::f32s,
    length: S::f32s,
}

/// Samples after which a stretch is left if every lane is opaque.
const CHECK_EVERY: u32 = 4;

/// Voxels along the axis that rays follow from one place to the next whose voxels are asked for ahead.
const LOOK_AHEAD_EVERY: f32 = 2.5;

/// Visible samples in a row after which the next is expected to be visible, too. Asking for everything at once saves a
/// quarter of a visible sample and makes an invisible one several times dearer.
const LONG_RUN: u32 = 4;

/// How the samples of a stretch are taken.
pub(super) trait StretchCaster {
    /// By how many steps beyond its middle a step sees.
    fn margin(&self) -> u32 {
        0
    }

    /// Has the voxels of a stretch on their way before it is taken.
    fn look_ahead<S: Simd>(&self, _simd: S, _packet: &Packet<S>, _stretch: Stretch) {}

    /// Takes them; returns how many those are, and whether any ray is still open.
    fn stretch<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        sum: &mut Accumulated<S>,
        stretch: Stretch,
        pieces: u8,
    ) -> (u64, bool);
}

/// Casts the packets of a bundle and writes their pixels. Where rays are clipped they are cast piece by piece.
#[inline(always)]
pub(super) fn bundle<S: Simd>(
    simd: S,
    kernel: &Kernel,
    frame: &Frame,
    caster: &impl StretchCaster,
    bundle: &mut Bundle<S, Accumulated<S>>,
    Place { at, clip }: Place,
    tile: &mut Tile,
) {
    let zero = S::f32s::splat(simd, 0.0);
    let one = S::f32s::splat(simd, 1.0);
    let half = Half { before: one, after: one, begin: one, length: zero };
    let nothing = Accumulated { color: [zero; 3], transmittance: one, half, run: 0 };
    let ranks = clip.map_or(1, |clip| clip.most(at, BUNDLE));
    let mut sums = vec![nothing; if clip.is_some() { Bundle::<S, Accumulated<S>>::packets() } else { 0 }];
    for rank in 0..ranks {
        match clip {
            Some(clip) => bundle.fill(simd, frame, at, Some((clip, rank)), |i| sums[i]),
            None => bundle.fill(simd, frame, at, None, |_| nothing),
        }
        for member in &mut bundle.members {
            member.sum.half = half;
            if clip.is_some() {
                draw_faces(simd, kernel, member);
            } else {
                // Rays that miss the volume are closed from the start.
                member.sum.transmittance = member.packet.hits().select(one, zero);
            }
        }
        march(simd, kernel, caster, bundle, tile);
        count_rays(bundle, tile, rank == 0);
        for member in &bundle.members {
            write(simd, member, tile);
            if clip.is_some() {
                sums[member.index] = member.sum;
            }
        }
    }
}

/// Draws the clip surfaces that rays begin at, white and lit, with the opacity of the overlay.
#[inline(always)]
fn draw_faces<S: Simd>(simd: S, kernel: &Kernel, member: &mut Member<S, Accumulated<S>>) {
    let opacity = kernel.scene.clip_shading().overlay as f32;
    if let (Some(face), true) = (&member.packet.face, opacity > 0.0) {
        let open = member.packet.hits() & member.sum.transmittance.simd_ge(kernel.opaque_below);
        let alpha = open.select(face.present * opacity, S::f32s::splat(simd, 0.0));
        let white = face.terms.0 + face.terms.1;
        let length = S::f32s::splat(simd, 1e-6);
        composite(simd, &mut member.sum, [white; 3], alpha, member.packet.first, length);
    }
}

/// Casts the packets that a bundle holds.
#[inline(always)]
fn march<S: Simd>(
    simd: S,
    kernel: &Kernel,
    caster: &impl StretchCaster,
    bundle: &mut Bundle<S, Accumulated<S>>,
    tile: &mut Tile,
) {
    let (mut samples, mut runs) = (0, 0);
    bundle.march(
        &kernel.classification.blocks,
        caster.margin(),
        #[inline(always)]
        |packet, stretch| caster.look_ahead(simd, packet, stretch),
        #[inline(always)]
        |packet, sum, stretch, pieces| {
            runs += 1;
            let (taken, open) = caster.stretch(simd, packet, sum, stretch, pieces);
            samples += taken;
            open
        },
    );
    tile.samples += samples;
    tile.runs += runs;
}

/// Plain steps: the value in the middle stands for each.
pub(super) struct Caster<'a, T> {
    kernel: &'a Kernel<'a>,
    grid: Grid<'a, T>,
    opacities: LaneSource<'a, f32>,
    colors: LaneSource<'a, [f32; 4]>,
}

impl<'a, T: LaneVoxel> Caster<'a, T> {
    pub(super) fn new(kernel: &'a Kernel<'a>, grid: Grid<'a, T>) -> Self {
        let opacities = LaneSource::new(&kernel.classification.opacities);
        Self { kernel, grid, opacities, colors: LaneSource::new(&kernel.classification.colors) }
    }
}

impl<T: LaneVoxel> StretchCaster for Caster<'_, T> {
    #[inline(always)]
    fn look_ahead<S: Simd>(&self, simd: S, packet: &Packet<S>, stretch: Stretch) {
        if self.grid.is_far() {
            let every = (LOOK_AHEAD_EVERY / packet.bounds.stride[1]).max(1.0) as usize;
            for j in (stretch.begin..stretch.end).step_by(every) {
                let at = self.grid.locate(simd, packet.position(S::f32s::splat(simd, j as f32 + 0.5)));
                self.grid.prefetch(simd, &at);
            }
        }
    }

    #[inline(always)]
    fn stretch<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        sum: &mut Accumulated<S>,
        stretch: Stretch,
        pieces: u8,
    ) -> (u64, bool) {
        let light = self.kernel.light(simd, packet);
        let cast = Cast { caster: self, packet, light };
        let mut local = *sum;
        let mut samples = 0;
        // Where every ray is inside with a whole step before it, none has a length of its own.
        let [whole_from, whole_to] = packet.bounds.whole;
        if pieces & cast_piece::PARTLY == 0 {
            local.run = LONG_RUN;
        }
        let mut j = stretch.begin;
        while j < stretch.end {
            let open = packet.not_ended(j) & local.transmittance.simd_ge(self.kernel.opaque_below);
            if !open.any_true() {
                break;
            }
            let until = stretch.end.min(j + CHECK_EVERY);
            let whole = whole_from <= j && until <= whole_to;
            for j in j..until {
                samples += u64::from(cast.sample(simd, &mut local, j, whole));
            }
            j = until;
        }
        *sum = local;
        let open = packet.not_ended(j) & local.transmittance.simd_ge(self.kernel.opaque_below);
        (samples, open.any_true())
    }
}

/// Adds a step of straight colour and opacity that begins at `begin` and is `length` long, in steps.
#[inline(always)]
pub(super) fn composite<S: Simd>(
    simd: S,
    sum: &mut Accumulated<S>,
    [r, g, b]: [S::f32s; 3],
    alpha: S::f32s,
    begin: S::f32s,
    length: S::f32s,
) {
    let weight = sum.transmittance * alpha;
    let [sum_r, sum_g, sum_b] = sum.color;
    sum.color = [weight.mul_add(r, sum_r), weight.mul_add(g, sum_g), weight.mul_add(b, sum_b)];
    pass(simd, sum, weight, begin, length);
}

/// As [`composite`], with a premultiplied colour.
#[inline(always)]
pub(super) fn composite_premultiplied<S: Simd>(
    simd: S,
    sum: &mut Accumulated<S>,
    [r, g, b]: [S::f32s; 3],
    alpha: S::f32s,
    begin: S::f32s,
    length: S::f32s,
) {
    let t = sum.transmittance;
    let [sum_r, sum_g, sum_b] = sum.color;
    sum.color = [t.mul_add(r, sum_r), t.mul_add(g, sum_g), t.mul_add(b, sum_b)];
    pass(simd, sum, t * alpha, begin, length);
}

/// Takes what a step absorbs off the transmittance, and remembers the step in which that passes one half.
#[inline(always)]
fn pass<S: Simd>(simd: S, sum: &mut Accumulated<S>, absorbed: S::f32s, begin: S::f32s, length: S::f32s) {
    let after = sum.transmittance - absorbed;
    let half = S::f32s::splat(simd, 0.5);
    let passes_half = after.simd_le(half) & sum.transmittance.simd_gt(half);
    if passes_half.any_true() {
        let half = &mut sum.half;
        half.before = passes_half.select(sum.transmittance, half.before);
        half.after = passes_half.select(after, half.after);
        half.begin = passes_half.select(begin, half.begin);
        half.length = passes_half.select(length, half.length);
    }
    sum.transmittance = after;
}

/// Colours under a light: times its factor, plus its white.
#[inline(always)]
pub(super) fn lit_by<S: Simd>([r, g, b]: [S::f32s; 3], lit: Option<(S::f32s, S::f32s)>) -> [S::f32s; 3] {
    match lit {
        Some((factor, white)) => {
            [r.mul_add(factor, white), g.mul_add(factor, white), b.mul_add(factor, white)]
        }
        None => [r, g, b],
    }
}

/// A stretch of a packet under a light.
struct Cast<'a, S: Simd, T> {
    caster: &'a Caster<'a, T>,
    packet: &'a Packet<S>,
    light: Option<PacketLight<'a, S>>,
}

impl<S: Simd, T: LaneVoxel> Cast<'_, S, T> {
    /// Takes the samples of step `j` of the lanes that are still open; returns how many those are. `whole`: every ray that
    /// meets the volume has a whole step here.
    #[inline(always)]
    fn sample(&self, simd: S, sum: &mut Accumulated<S>, j: u32, whole: bool) -> u32 {
        let zero = S::f32s::splat(simd, 0.0);
        let open = sum.transmittance.simd_ge(self.caster.kernel.opaque_below);
        let (middle, length, open) = if whole {
            (S::f32s::splat(simd, j as f32 + 0.5), S::f32s::splat(simd, 1.0), open)
        } else {
            let (middle, length) = self.packet.sample(simd, j);
            (middle, length, open & length.simd_gt(0.0))
        };
        let taken = open.to_bitmask().count_ones();
        if taken == 0 {
            return 0;
        }
        let Some((color, alpha)) = self.looks(simd, middle, open, sum.run >= LONG_RUN) else {
            sum.run = 0;
            return taken;
        };
        let mut alpha = open.select(alpha, zero);
        if !alpha.simd_gt(0.0).any_true() {
            sum.run = 0;
            return taken;
        }
        sum.run += 1;
        if !whole {
            let short = open & length.simd_lt(1.0);
            if short.any_true() {
                alpha = shorter(simd, alpha, length);
            }
        }
        composite(simd, sum, color, alpha, S::f32s::splat(simd, j as f32), length);
        taken
    }

    /// Lit colour and opacity of a whole step at `middle` steps along each ray; nothing where the open rays see nothing.
    ///
    /// Where something visible is likely it comes at once: colour and opacity share their look-up. Elsewhere opacity is asked
    /// first. Either way there is one piece of code for what is visible: twice of it would not fit the processor's nearest
    /// memory for code.
    #[inline(always)]
    fn looks(
        &self,
        simd: S,
        middle: S::f32s,
        open: <S::f32s as SimdBase<S>>::Mask,
        likely: bool,
    ) -> Option<([S::f32s; 3], S::f32s)> {
        let Caster { kernel, grid, colors, .. } = self.caster;
        let at = grid.locate(simd, self.packet.position(middle));
        let Some((shading, light)) = &self.light else {
            let index = kernel.classification.table_index(simd, grid.value(simd, &at));
            if !likely && self.unseen(simd, open, index) {
                return None;
            }
            let [r, g, b, alpha] = colors.columns(simd, index);
            return Some(([r, g, b], alpha));
        };
        // The field's voxels are most of the gradient's: they are read once, with what the gradient needs of their rows.
        let rows = grid.rows(simd, &at);
        let index = kernel.classification.table_index(simd, rows.value(at.fraction()));
        if !likely && self.unseen(simd, open, index) {
            return None;
        }
        let mut terms = shading.terms(simd, light, grid.gradient(simd, &at, &rows));
        if let Some(face) = &self.packet.face {
            let kind = kernel.scene.clip_shading().impregnation;
            terms = face.impregnate(simd, kind, middle - self.packet.first, terms);
        }
        let [r, g, b, alpha] = colors.columns(simd, index);
        Some((lit_by::<S>([r, g, b], Some(terms)), alpha))
    }

    /// Whether none of the open rays sees anything of these entries.
    #[inline(always)]
    fn unseen(&self, simd: S, open: <S::f32s as SimdBase<S>>::Mask, index: S::u32s) -> bool {
        let visible = self.caster.opacities.floats(simd, index).simd_gt(0.0);
        !(open & visible).any_true()
    }
}

/// Opacity of `length` steps (at most one) where that of a whole step is `alpha`: the last stretch of a ray is short.
#[inline(always)]
pub(super) fn shorter<S: Simd>(simd: S, alpha: S::f32s, length: S::f32s) -> S::f32s {
    let mut out = alpha;
    for l in 0..S::f32s::LEN {
        if length[l] < 1.0 {
            let whole = alpha[l];
            out.as_mut_slice()[l] =
                if length[l] <= 0.0 { 0.0 } else { -f32::exp_m1(length[l] * f32::ln_1p(-whole)) };
        }
    }
    let _ = simd;
    out
}

#[inline(always)]
fn write<S: Simd>(simd: S, member: &Member<S, Accumulated<S>>, tile: &mut Tile) {
    let Member { packet, sum, pixel, .. } = member;
    let alpha = S::f32s::splat(simd, 1.0) - sum.transmittance;
    let hits = packet.hits().to_bitmask();
    for l in 0..Packet::<S>::LANES {
        if hits >> l & 1 == 1 {
            let pixel = pixel_of_lane::<S>(tile, *pixel, l);
            tile.colors[pixel] = [sum.color[0][l], sum.color[1][l], sum.color[2][l], alpha[l]];
            if sum.half.length[l] > 0.0 {
                // Opacity grows exponentially within a step of constant extinction.
                let (before, after) = (sum.half.before[l], sum.half.after[l].max(1e-30));
                let share = (before * 2.0).ln() / (before / after).ln();
                let j = sum.half.begin[l] + sum.half.length[l] * share;
                tile.depths[pixel] = packet.t_origin[l] + j * packet.world_step[l];
            }
        }
    }
}
