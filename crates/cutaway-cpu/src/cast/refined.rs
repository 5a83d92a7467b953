//! Steps that are more than the value in their middle: pre-integrated, on planes of voxels, cut finer where they must be,
//! or lit by another gradient. One kernel for these settings, apart from the plain one, which they would slow down.
//!
//! - *Pre-integration*: the field is taken as linear between a step's two ends, and so is the light; a table has the
//!   integral ([`cutaway_core::preintegration`]).
//! - *Object-aligned sampling* (Termeer 4.1.1): a step is what is nearest to a plane of voxels; its opacity is that of its
//!   own length, which depends on the angle between ray and planes.
//! - *Adaptive sampling* (Termeer 4.1.2): a step whose opacity or colour differs from that of the step before or after it
//!   by more than a threshold is taken as several shorter ones. Termeer compares opacity alone, with what came before.

use cutaway_core::scene::{Gradient, Sampling};
use fearless_simd::prelude::*;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat};

use super::composite::{Accumulated, StretchCaster, composite, composite_premultiplied, lit_by, shorter};
use super::kernel::{Kernel, PacketLight};
use super::shading::Terms;
use crate::bundle::Stretch;
use crate::packet::Packet;
use crate::sample::{CellPosition, Grid, LaneVoxel, OnPlane, lerp};
use crate::simd::LaneSource;

/// Into how many shorter steps an adaptive step is cut.
const FINER: u32 = 4;

/// What every refined step needs.
pub(super) struct Refined<'a, T> {
    kernel: &'a Kernel<'a>,
    grid: Grid<'a, T>,
    /// Colour and *optical depth of a whole step*.
    depths: LaneSource<'a, [f32; 4]>,
    tables: Option<Tables<'a>>,
    normals: Option<LaneSource<'a, u32>>,
}

/// The pre-integration tables.
struct Tables<'a> {
    starts: LaneSource<'a, f32>,
    growths: LaneSource<'a, f32>,
    /// Unlit: whole entries. Lit: front weights.
    front: LaneSource<'a, [f32; 4]>,
    /// Lit: back weights.
    back: LaneSource<'a, [f32; 4]>,
    size: u32,
    index_map: (f32, f32),
    bins: u32,
}

/// What a point of a ray looks like: lit colour, and optical depth of a whole step.
#[derive(Clone, Copy)]
struct Look<S: Simd> {
    color: [S::f32s; 3],
    depth: S::f32s,
}

/// The part of a step that is inside the volume, per lane, in steps.
#[derive(Clone, Copy)]
struct Part<S: Simd> {
    begin: S::f32s,
    length: S::f32s,
}

/// One end of a pre-integrated step.
#[derive(Clone, Copy)]
struct End<S: Simd> {
    coordinate: S::f32s,
    lit: Option<Terms<S>>,
}

/// A stretch of a packet under a light.
struct Cast<'a, S: Simd, T> {
    caster: &'a Refined<'a, T>,
    packet: &'a Packet<S>,
    light: Option<PacketLight<'a, S>>,
    plane: Option<OnPlane>,
}

impl<'a, T: LaneVoxel> Refined<'a, T> {
    pub(super) fn new(kernel: &'a Kernel<'a>, grid: Grid<'a, T>) -> Self {
        let classification = kernel.classification;
        let tables = classification.preintegrated.as_ref().map(|p| Tables {
            starts: LaneSource::new(&p.starts),
            growths: LaneSource::new(&p.growths),
            front: LaneSource::new(if kernel.shading.is_some() { &p.front } else { &p.unlit }),
            back: LaneSource::new(if kernel.shading.is_some() { &p.back } else { &p.unlit }),
            size: p.size as u32,
            index_map: p.index_map,
            bins: p.starts.len() as u32,
        });
        let precomputed = kernel.scene.settings().gradient == Gradient::Precomputed;
        let normals = precomputed.then(|| LaneSource::new(kernel.volume.normals(kernel.scene.volume())));
        Self { kernel, grid, depths: LaneSource::new(&classification.depths), tables, normals }
    }
}

impl<T: LaneVoxel> StretchCaster for Refined<'_, T> {
    fn margin(&self) -> u32 {
        1
    }

    #[inline(always)]
    fn stretch<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        sum: &mut Accumulated<S>,
        stretch: Stretch,
        _: u8,
    ) -> (u64, bool) {
        let light = self.kernel.light(simd, packet);
        let on_planes = self.kernel.scene.settings().sampling == Sampling::Object;
        let plane = packet.axis.filter(|_| on_planes).map(|(axis, _)| OnPlane { axis });
        let cast = Cast { caster: self, packet, light, plane };
        let samples = if self.tables.is_some() {
            cast.preintegrated(simd, sum, stretch)
        } else {
            cast.steps(simd, sum, stretch)
        };
        let open = packet.not_ended(stretch.end) & sum.transmittance.simd_ge(self.kernel.opaque_below);
        (samples, open.any_true())
    }
}

impl<S: Simd, T: LaneVoxel> Cast<'_, S, T> {
    /// What of step `j` is inside the volume.
    #[inline(always)]
    fn part(&self, simd: S, j: u32) -> Part<S> {
        let begin = self.packet.first.max(j as f32);
        let end = self.packet.end.min((j + 1) as f32);
        Part { begin, length: (end - begin).max(S::f32s::splat(simd, 0.0)) }
    }

    #[inline(always)]
    fn open(&self, simd: S, sum: &Accumulated<S>, part: &Part<S>) -> <S::f32s as SimdBase<S>>::Mask {
        let _ = simd;
        part.length.simd_gt(0.0) & sum.transmittance.simd_ge(self.caster.kernel.opaque_below)
    }

    /// Steps by the value in their middle, cut finer where the settings ask for it.
    #[inline(always)]
    fn steps(&self, simd: S, sum: &mut Accumulated<S>, stretch: Stretch) -> u64 {
        let threshold = self.caster.kernel.scene.settings().adaptive_threshold;
        let mut samples = 0;
        // Neighbours count even where they lie beyond the stretch: what a step is must not depend on what is skipped.
        let zero = S::f32s::splat(simd, 0.0);
        let nothing = Look { color: [zero; 3], depth: zero };
        let mut before = nothing;
        if threshold.is_some() && stretch.begin > 0 {
            before = self.look_at_step(simd, stretch.begin - 1);
        }
        let mut now = self.look_at_step(simd, stretch.begin);
        for j in stretch.begin..stretch.end {
            let part = self.part(simd, j);
            let open = self.open(simd, sum, &part);
            samples += u64::from(open.to_bitmask().count_ones());
            if !open.any_true() && j >= self.packet.bounds.whole[0] {
                break;
            }
            let Some(threshold) = threshold else {
                self.add(simd, sum, &now, &part, open);
                if j + 1 < stretch.end {
                    now = self.look_at_step(simd, j + 1);
                }
                continue;
            };
            let after = self.look_at_step(simd, j + 1);
            let uneven = open
                & (self.differ(simd, &now, &before, threshold as f32)
                    | self.differ(simd, &now, &after, threshold as f32));
            self.add(simd, sum, &now, &part, open & !uneven);
            if uneven.any_true() {
                for k in 0..FINER {
                    let length = part.length * (1.0 / FINER as f32);
                    let finer = Part { begin: length.mul_add(k as f32, part.begin), length };
                    let look = self.look(simd, length.mul_add(0.5, finer.begin), None);
                    self.add(simd, sum, &look, &finer, uneven);
                    samples += u64::from(uneven.to_bitmask().count_ones());
                }
            }
            (before, now) = (now, after);
        }
        samples
    }

    /// What step `j` looks like: on its plane, or in the middle of what is inside of it.
    #[inline(always)]
    fn look_at_step(&self, simd: S, j: u32) -> Look<S> {
        if self.plane.is_some() {
            return self.look(simd, S::f32s::splat(simd, j as f32 + 0.5), self.plane);
        }
        let part = self.part(simd, j);
        let look = self.look(simd, part.length.mul_add(0.5, part.begin), None);
        // Before its entry and after its end a ray meets nothing.
        let inside = part.length.simd_gt(0.0);
        Look { depth: inside.select(look.depth, S::f32s::splat(simd, 0.0)), ..look }
    }

    #[inline(always)]
    fn differ(&self, simd: S, a: &Look<S>, b: &Look<S>, threshold: f32) -> <S::f32s as SimdBase<S>>::Mask {
        let (alpha_a, alpha_b) = (opacity(simd, a.depth), opacity(simd, b.depth));
        let mut differ = (alpha_a - alpha_b).abs().simd_gt(threshold);
        for c in 0..3 {
            differ |= (alpha_a * a.color[c] - alpha_b * b.color[c]).abs().simd_gt(threshold);
        }
        differ
    }

    #[inline(always)]
    fn look(&self, simd: S, j: S::f32s, plane: Option<OnPlane>) -> Look<S> {
        let at = self.caster.grid.locate(simd, self.packet.position(j));
        let (value, lit) = self.value_and_light(simd, &at, plane);
        let lit = self.impregnated(simd, j, lit);
        let index = self.caster.kernel.classification.table_index(simd, value);
        let [r, g, b, depth] = self.caster.depths.columns(simd, index);
        Look { color: lit_by::<S>([r, g, b], lit), depth }
    }

    /// Light at step `j` of each ray, with that of the clip surface it began at.
    #[inline(always)]
    fn impregnated(&self, simd: S, j: S::f32s, lit: Option<Terms<S>>) -> Option<Terms<S>> {
        let (Some(face), Some(terms)) = (&self.packet.face, lit) else { return lit };
        let kind = self.caster.kernel.scene.clip_shading().impregnation;
        let steps = (j - self.packet.first) * self.packet.opacity_scale;
        Some(face.impregnate(simd, kind, steps, terms))
    }

    /// Kept as one function of its own: written out wherever it is called it would take minutes to compile.
    #[inline(always)]
    fn value_and_light(
        &self,
        simd: S,
        at: &CellPosition<S>,
        plane: Option<OnPlane>,
    ) -> (S::f32s, Option<Terms<S>>) {
        simd.vectorize(
            #[inline(always)]
            || self.value_and_light_of(simd, at, plane),
        )
    }

    #[inline(always)]
    fn value_and_light_of(
        &self,
        simd: S,
        at: &CellPosition<S>,
        plane: Option<OnPlane>,
    ) -> (S::f32s, Option<Terms<S>>) {
        let grid = &self.caster.grid;
        let Some((shading, light)) = &self.light else {
            let value = match plane {
                Some(plane) => grid.value_on_plane(simd, at, plane),
                None => grid.value(simd, at),
            };
            return (value, None);
        };
        let (value, gradient) = match (self.caster.kernel.scene.settings().gradient, self.caster.normals) {
            (Gradient::Sobel, _) => (grid.value(simd, at), grid.sobel(simd, at)),
            (Gradient::Precomputed, Some(normals)) => {
                let [x, y, z] = grid.direction(simd, at, normals);
                // As long as gradients come: what counts as vanishing is a part of the value range.
                let [lo, hi] = self.caster.kernel.scene.volume().stored_range();
                let length = (hi - lo).max(1.0);
                (grid.value(simd, at), [x * length, y * length, z * length])
            }
            _ => grid.value_and_gradient(simd, at),
        };
        (value, Some(shading.terms(simd, light, gradient)))
    }

    /// Adds a part of a step.
    #[inline(always)]
    fn add(
        &self,
        simd: S,
        sum: &mut Accumulated<S>,
        look: &Look<S>,
        part: &Part<S>,
        open: <S::f32s as SimdBase<S>>::Mask,
    ) {
        let depth = look.depth * part.length * self.packet.opacity_scale;
        let alpha = open.select(opacity(simd, depth), S::f32s::splat(simd, 0.0));
        if alpha.simd_gt(0.0).any_true() {
            composite(simd, sum, look.color, alpha, part.begin, part.length);
        }
    }

    /// Steps by the integral between their ends.
    #[inline(always)]
    fn preintegrated(&self, simd: S, sum: &mut Accumulated<S>, stretch: Stretch) -> u64 {
        let Some(tables) = &self.caster.tables else { return 0 };
        let mut samples = 0;
        for j in stretch.begin..stretch.end {
            let part = self.part(simd, j);
            let open = self.open(simd, sum, &part);
            samples += 2 * u64::from(open.to_bitmask().count_ones());
            if !open.any_true() && j >= self.packet.bounds.whole[0] {
                break;
            }
            let (front, back) = self.ends(simd, tables, &part);
            let [r, g, b, alpha] = self.integral(simd, tables, &front, &back);
            let mut alpha_of_part = open.select(alpha, S::f32s::splat(simd, 0.0));
            if alpha_of_part.simd_gt(0.0).any_true() {
                let mut color = [r, g, b];
                let steps = part.length * self.packet.opacity_scale;
                let other = open & (steps.simd_lt(1.0) | steps.simd_gt(1.0));
                if other.any_true() {
                    alpha_of_part = shorter(simd, alpha_of_part, steps);
                    let share = alpha_of_part / alpha.max(1e-30);
                    color = [r * share, g * share, b * share];
                }
                for c in &mut color {
                    *c = open.select(*c, S::f32s::splat(simd, 0.0));
                }
                composite_premultiplied(simd, sum, color, alpha_of_part, part.begin, part.length);
            }
        }
        samples
    }

    /// The ends of the straight line that stands for the field along a part of a step, and for the light.
    ///
    /// It is the line through the two Gauss points: its integral is that of the field up to cubics, which the field is
    /// along a ray within a cell; the line through the field's values at the ends would be off by its curvature.
    #[inline(always)]
    fn ends(&self, simd: S, tables: &Tables, part: &Part<S>) -> (End<S>, End<S>) {
        // (1 - 1/√3) / 2, and by how much the ends are beyond the points, in distances of the points.
        const POINT: f32 = 0.211_324_87;
        const BEYOND: f32 = 0.366_025_4;
        let mut values = [part.begin; 2];
        let mut lights = [None; 2];
        for k in 0..2 {
            let share = if k == 0 { POINT } else { 1.0 - POINT };
            let j = part.length.mul_add(share, part.begin);
            let at = self.caster.grid.locate(simd, self.packet.position(j));
            let (value, lit) = self.value_and_light(simd, &at, None);
            (values[k], lights[k]) = (value, self.impregnated(simd, j, lit));
        }
        let line = |a: S::f32s, b: S::f32s| {
            let beyond = (b - a) * BEYOND;
            [a - beyond, b + beyond]
        };
        let [v0, v1] = line(values[0], values[1]);
        let (lit0, lit1) = match (lights[0], lights[1]) {
            (Some((f0, w0)), Some((f1, w1))) => {
                // Light is no less than none, wherever the line goes.
                let ([f0, f1], [w0, w1]) = (line(f0, f1), line(w0, w1));
                let [f0, f1, w0, w1] = [f0.max(0.0), f1.max(0.0), w0.max(0.0), w1.max(0.0)];
                (Some((f0, w0)), Some((f1, w1)))
            }
            _ => (None, None),
        };
        let end = |value: S::f32s, lit| End { coordinate: self.coordinate(simd, tables, value), lit };
        (end(v0, lit0), end(v1, lit1))
    }

    #[inline(always)]
    fn coordinate(&self, simd: S, tables: &Tables, value: S::f32s) -> S::f32s {
        let (origin, scale) = tables.index_map;
        let x = ((value - origin) * scale).max(0.0).min((tables.bins - 1) as f32);
        let (bin, share) = whole_and_fraction::<S>(x);
        let growth = tables.growths.floats(simd, bin);
        growth.mul_add(share, tables.starts.floats(simd, bin))
    }

    /// Premultiplied colour and opacity of whole steps between two ends.
    #[inline(always)]
    fn integral(&self, simd: S, tables: &Tables, front: &End<S>, back: &End<S>) -> [S::f32s; 4] {
        let last = tables.size - 2;
        let node = |c: S::f32s| {
            let (whole, _) = whole_and_fraction::<S>(c);
            let whole = whole.min(S::u32s::splat(simd, last));
            (whole, c - to_float::<S>(whole))
        };
        let ((row, w_front), (column, w_back)) = (node(front.coordinate), node(back.coordinate));
        let i = row * tables.size + column;
        let at = Corners { i, size: tables.size, w_front, w_back };
        let first = at.entry(simd, tables.front);
        let (Some((f0, w0)), Some((f1, w1))) = (front.lit, back.lit) else { return first };
        let second = at.entry(simd, tables.back);
        let mut out = first;
        for c in 0..3 {
            out[c] = first[c].mul_add(f0, second[c] * f1) + first[3].mul_add(w0, second[3] * w1);
        }
        out[3] = first[3] + second[3];
        out
    }
}

/// Where pre-integrated steps are in their table: the entry of their lower nodes, and how far beyond those they are.
struct Corners<S: Simd> {
    i: S::u32s,
    size: u32,
    w_front: S::f32s,
    w_back: S::f32s,
}

impl<S: Simd> Corners<S> {
    /// Entries interpolated among four. One function of its own, for the same reason.
    #[inline(always)]
    fn entry(&self, simd: S, source: LaneSource<'_, [f32; 4]>) -> [S::f32s; 4] {
        simd.vectorize(
            #[inline(always)]
            || {
                let (e00, e01) = (source.columns(simd, self.i), source.columns(simd, self.i + 1));
                let next = self.i + self.size;
                let (e10, e11) = (source.columns(simd, next), source.columns(simd, next + 1));
                let mut out = e00;
                for c in 0..4 {
                    let near = lerp::<S>(e00[c], e01[c], self.w_back);
                    let far = lerp::<S>(e10[c], e11[c], self.w_back);
                    out[c] = lerp::<S>(near, far, self.w_front);
                }
                out
            },
        )
    }
}

/// A number of 0 or more as a whole one and what is left.
#[inline(always)]
fn whole_and_fraction<S: Simd>(x: S::f32s) -> (S::u32s, S::f32s) {
    let whole: S::i32s = x.to_int();
    let low: S::f32s = whole.to_float();
    (whole.bitcast(), x - low)
}

#[inline(always)]
fn to_float<S: Simd>(v: S::u32s) -> S::f32s {
    let signed: S::i32s = v.bitcast();
    signed.to_float()
}

/// `1 - exp(-depth)` for depths of 0 or more, to 2e-7: a power of two and a polynomial around it.
#[inline(always)]
fn opacity<S: Simd>(simd: S, depth: S::f32s) -> S::f32s {
    let exponent = (depth * -std::f32::consts::LOG2_E).max(-126.0);
    let whole = exponent.round_ties_even();
    let f = exponent - whole;
    let mut p = S::f32s::splat(simd, 1.540_353e-4);
    for c in [1.333_355_8e-3, 9.618_129e-3, 5.550_411e-2, 2.402_265e-1, 6.931_472e-1, 1.0f32] {
        p = p.mul_add(f, S::f32s::splat(simd, c));
    }
    let whole: S::i32s = whole.to_int();
    let bits: S::u32s = (whole + 127).bitcast();
    let scale: S::f32s = (bits << 23).bitcast();
    S::f32s::splat(simd, 1.0) - p * scale
}

/// Whether settings ask for more than plain steps.
pub(super) fn wanted(kernel: &Kernel) -> bool {
    let s = kernel.scene.settings();
    let gradient = kernel.shading.is_some() && s.gradient != Gradient::Central;
    // Steps of other lengths than the tables'.
    let uneven = kernel.scene.voxels_per_step().is_some();
    s.pre_integration
        || s.adaptive_threshold.is_some()
        || s.sampling == Sampling::Object
        || gradient
        || uneven
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LaneWork, SimdChoice, dispatch};

    struct Opacities;

    impl LaneWork for Opacities {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            for i in 0..4000 {
                let x = (i as f32 * 0.01).exp2() * 1e-7;
                let found = opacity(simd, S::f32s::splat(simd, x))[0];
                assert!((f64::from(found) + (-f64::from(x)).exp_m1()).abs() < 2e-7, "{x}: {found}");
            }
        }
    }

    #[test]
    fn opacity_is_one_minus_the_exponential() {
        for choice in [SimdChoice::Scalar, SimdChoice::Auto] {
            dispatch(choice.level().unwrap(), Opacities);
        }
    }
}
