//! Packets: a few neighbouring pixels whose rays are cast together, one a SIMD lane.
//!
//! A ray is kept in voxel space and in *steps*. The rays of a packet go in step: `position(j) = origin + j * stride` with
//! one `j` for all of them, and each ray is inside the volume for `j` in `first..end`. `first` is a whole number, the
//! steps by which a ray enters later than the first of its packet, so that rays that enter through a face at a slant are
//! level with their neighbours once they are inside. Sample `j` stands for the stretch `j..j + 1`, or `j..end` if that is
//! shorter, and lies in its middle.

use cutaway_core::clip::Impregnation;
use fearless_simd::prelude::*;
use fearless_simd::{Select, Simd, SimdBase, SimdFloat};

use crate::clipping::KeptLanes;
use crate::rays::{Frame, PacketRays};
use crate::simd::MAX_LANES;

/// Width and height in pixels of a packet of this many lanes.
pub(crate) const fn packet_shape(lanes: usize) -> (u32, u32) {
    match lanes {
        16 => (4, 4),
        8 => (4, 2),
        4 => (2, 2),
        _ => (1, 1),
    }
}

/// Components of a stride below this many voxels count as none: such a ray does not come to a plane of that axis.
const NO_STRIDE: f32 = 1e-9;

/// The rays of a packet.
#[derive(Clone, Copy)]
pub(crate) struct Packet<S: Simd> {
    /// Where each ray is at step 0 of the packet, in voxel space; may lie before its entry.
    pub(crate) origin: [S::f32s; 3],
    /// Voxels a step.
    pub(crate) stride: [S::f32s; 3],
    /// Steps of the packet at which each ray enters, whole, and leaves the volume. Both 0 for rays that miss it.
    pub(crate) first: S::f32s,
    pub(crate) end: S::f32s,
    /// World distance of each ray's step 0 from its own beginning.
    pub(crate) t_origin: S::f32s,
    /// World length of a step of each ray, and how many steps of the scene that is: what optical depths are multiplied by.
    pub(crate) world_step: S::f32s,
    pub(crate) opacity_scale: S::f32s,
    /// The axis that all rays follow, if there is one.
    pub(crate) axis: Axis,
    /// Where rays begin at a clip surface.
    pub(crate) face: Option<FaceLanes<S>>,
    /// All rays, whether they meet the volume or not, seen from the common axis.
    pub(crate) bounds: Bounds,
}

/// The clip surfaces that the rays of a packet begin at.
#[derive(Clone, Copy)]
pub(crate) struct FaceLanes<S: Simd> {
    /// Of a colour: the light's factor, and white that is added.
    pub(crate) terms: (S::f32s, S::f32s),
    /// By how much a step brings a ray deeper, in parts of the depth to which the surface lights samples.
    pub(crate) depth_per_step: S::f32s,
    /// 1 where there is a surface, else 0.
    pub(crate) present: S::f32s,
}

/// What a packet covers, along the axis that its rays follow and across it. Positions along a descending axis are
/// negated, so that every axis ascends here.
#[derive(Clone, Copy, Default)]
pub(crate) struct Bounds {
    /// Of the rays that meet the volume: least and greatest position along the axis at step 0, and growth a step.
    pub(crate) origin: [f32; 2],
    pub(crate) stride: [f32; 2],
    /// Least and greatest position along the axis inside the volume.
    pub(crate) inside: [f32; 2],
    /// The first and the last step at which a ray leaves the volume.
    pub(crate) end: [f32; 2],
    /// Per other axis: least and greatest position where the axis is at 0, and growth a voxel along it.
    pub(crate) across: [[f32; 2]; 2],
    pub(crate) slope: [[f32; 2]; 2],
    /// Steps at which every ray that meets the volume is inside, with a whole step before it.
    pub(crate) whole: [u32; 2],
    /// Whether any ray meets the volume.
    pub(crate) hits: bool,
}

/// The axis that the rays of a packet follow: its number, and whether they ascend.
pub(crate) type Axis = Option<(usize, bool)>;

impl<S: Simd> Packet<S> {
    /// Lanes in use.
    pub(crate) const LANES: usize = S::f32s::LEN;

    /// The packet whose first pixel is `(x, y)`. Pixels beyond the image miss the volume.
    #[inline(always)]
    pub(crate) fn new(
        simd: S,
        frame: &Frame,
        axis: Axis,
        (x, y): (u32, u32),
        kept: Option<&KeptLanes>,
    ) -> Self {
        let (column, row) = pixels_of_lanes(simd);
        let rays = frame.packet_rays(x, y);
        let beyond_x = column.simd_ge(frame.width.saturating_sub(x) as f32);
        let beyond_y = row.simd_ge(frame.height.saturating_sub(y) as f32);
        let extent = frame.volume.extent().as_vec3().to_array();
        Self::of(simd, &rays, extent, axis, (column, row), beyond_x | beyond_y, kept)
    }

    #[inline(always)]
    fn of(
        simd: S,
        rays: &PacketRays,
        extent: [f32; 3],
        axis: Axis,
        (column, row): (S::f32s, S::f32s),
        left_out: <S::f32s as SimdBase<S>>::Mask,
        kept: Option<&KeptLanes>,
    ) -> Self {
        let zero = S::f32s::splat(simd, 0.0);
        let across = column.mul_add(rays.tangent_per_pixel, rays.tangents[0]);
        let along = row.mul_add(rays.tangent_per_pixel, rays.tangents[1]);
        let length = across.mul_add(across, along.mul_add(along, S::f32s::splat(simd, 1.0))).sqrt();
        let per_depth = S::f32s::splat(simd, rays.step_length) / length;
        let (mut point, mut stride) = ([zero; 3], [zero; 3]);
        // Not before the eye: the steps from there to the point.
        let world_of_point = length * rays.depth;
        let mut near = world_of_point * (-1.0 / rays.step_length);
        let mut far = S::f32s::splat(simd, f32::INFINITY);
        for a in 0..3 {
            let in_row = column.mul_add(rays.point_per_x[a], rays.point[a]);
            point[a] = row.mul_add(rays.point_per_y[a], in_row);
            let in_row = column.mul_add(rays.direction_per_x[a], rays.direction[a]);
            stride[a] = row.mul_add(rays.direction_per_y[a], in_row) * per_depth;
            let inverse = S::f32s::splat(simd, 1.0) / stride[a];
            let (at_low, at_high) = ((zero - point[a]) * inverse, (zero - point[a] + extent[a]) * inverse);
            let within = point[a].simd_ge(0.0) & point[a].simd_le(extent[a]);
            let infinity = S::f32s::splat(simd, f32::INFINITY);
            let parallel = stride[a].abs().simd_lt(NO_STRIDE);
            let low = parallel.select(within.select(zero - infinity, infinity), at_low.min(at_high));
            let high = parallel.select(within.select(infinity, zero - infinity), at_low.max(at_high));
            near = near.max(low);
            far = far.min(high);
        }
        if let Some(kept) = kept {
            let n = S::f32s::LEN;
            let end = near + S::f32s::from_slice(simd, &kept.end[..n]);
            near += S::f32s::from_slice(simd, &kept.begin[..n]);
            far = far.min(end);
        }
        let hits = near.simd_lt(far) & !left_out;
        let (near, total) = (hits.select(near, zero), hits.select(far - near, zero));
        let mut origin = [zero; 3];
        for a in 0..3 {
            origin[a] = stride[a].mul_add(near, point[a]);
        }
        let t_entry = near.mul_add(rays.step_length, world_of_point);
        let mut packet = Self {
            origin,
            stride,
            first: zero,
            end: total,
            t_origin: t_entry,
            world_step: S::f32s::splat(simd, rays.step_length),
            opacity_scale: S::f32s::splat(simd, 1.0),
            axis,
            face: kept.map(
                #[inline(always)]
                |kept| FaceLanes::new(simd, kept),
            ),
            bounds: Bounds::default(),
        };
        packet.bounds.hits = hits.any_true();
        if rays.voxels_per_step > 0.0 && !(rays.on_planes && axis.is_some()) {
            packet.in_voxels(rays.voxels_per_step);
        }
        if let (Some(axis), true) = (axis, packet.bounds.hits) {
            if rays.on_planes {
                packet.onto_planes(simd, axis, hits);
            } else {
                packet.delay(simd, axis, hits);
            }
            packet.bound(simd, axis, hits);
        }
        let ends = packet.end;
        let infinity = S::f32s::splat(simd, f32::INFINITY);
        packet.bounds.end = [hits.select(ends, infinity).reduce_min(), ends.reduce_max()];
        packet.bounds.whole = [packet.first.reduce_max().ceil() as u32, packet.bounds.end[0] as u32];
        if kept.is_some() && !hits.all_true() {
            // Rays that have nothing here may have more elsewhere: they are not closed but left out, step by step.
            packet.bounds.whole = [u32::MAX, 0];
        }
        packet
    }

    /// Makes each step so many voxels along its own ray, whatever that is in the world.
    #[inline(always)]
    fn in_voxels(&mut self, voxels: f32) {
        let [x, y, z] = self.stride;
        let per_step = x.mul_add(x, y.mul_add(y, z * z)).sqrt() * (1.0 / voxels);
        for a in 0..3 {
            self.stride[a] /= per_step;
        }
        self.end *= per_step;
        self.world_step /= per_step;
        self.opacity_scale /= per_step;
    }

    /// Brings the rays in step along an axis.
    #[inline(always)]
    fn delay(&mut self, simd: S, (axis, ascending): (usize, bool), hits: <S::f32s as SimdBase<S>>::Mask) {
        let sign = if ascending { 1.0 } else { -1.0 };
        let zero = S::f32s::splat(simd, 0.0);
        let along = self.origin[axis] * sign;
        let foremost = hits.select(along, S::f32s::splat(simd, f32::INFINITY)).reduce_min();
        let steps = ((along - foremost) / (self.stride[axis] * sign)).floor();
        self.first = hits.select(steps.max(0.0), zero);
        self.end += self.first;
        for a in 0..3 {
            self.origin[a] -= self.stride[a] * self.first;
        }
        self.t_origin -= self.first * self.world_step;
    }

    /// Makes a step of what is nearest to a plane of voxels across an axis: the planes are at `j + 1/2`. Rays then enter
    /// and leave anywhere within a step.
    #[inline(always)]
    fn onto_planes(
        &mut self,
        simd: S,
        (axis, ascending): (usize, bool),
        hits: <S::f32s as SimdBase<S>>::Mask,
    ) {
        let sign = if ascending { 1.0 } else { -1.0 };
        let zero = S::f32s::splat(simd, 0.0);
        let along = self.origin[axis] * sign;
        let foremost = hits.select(along, S::f32s::splat(simd, f32::INFINITY)).reduce_min();
        let begin = foremost.round() - 0.5;
        let per_step = (self.stride[axis] * sign).max(NO_STRIDE);
        let first = along - begin;
        self.first = hits.select(first.max(0.0), zero);
        self.end = hits.select(self.end.mul_add(per_step, self.first), zero);
        for a in 0..3 {
            self.stride[a] /= per_step;
            self.origin[a] -= self.stride[a] * first;
        }
        self.world_step /= per_step;
        self.opacity_scale /= per_step;
        self.t_origin -= self.world_step * first;
    }

    #[inline(always)]
    fn bound(&mut self, simd: S, (axis, ascending): (usize, bool), hits: <S::f32s as SimdBase<S>>::Mask) {
        let sign = if ascending { 1.0 } else { -1.0 };
        let (origin, stride) = (self.origin[axis] * sign, self.stride[axis] * sign);
        self.bounds.origin = range_of::<S>(simd, hits, origin);
        self.bounds.stride = range_of::<S>(simd, hits, stride);
        let entry = range_of::<S>(simd, hits, stride.mul_add(self.first, origin))[0];
        let exit = range_of::<S>(simd, hits, stride.mul_add(self.end, origin))[1];
        self.bounds.inside = [entry, exit];
        for (k, other) in [(axis + 1) % 3, (axis + 2) % 3].into_iter().enumerate() {
            // Along each ray the other position is linear in that along the axis. The least of several linear functions
            // is concave, the greatest convex: between two places the straight line through their bounds bounds it.
            let slope = self.stride[other] / stride;
            let (near, far) = (entry, exit.max(entry + 1.0));
            let (at_near, at_far) = (
                range_of::<S>(simd, hits, slope.mul_add((origin - near) * -1.0, self.origin[other])),
                range_of::<S>(simd, hits, slope.mul_add((origin - far) * -1.0, self.origin[other])),
            );
            for side in 0..2 {
                let growth = (at_far[side] - at_near[side]) / (far - near);
                self.bounds.slope[k][side] = growth;
                self.bounds.across[k][side] = at_near[side] - growth * near;
            }
        }
    }

    /// Where each ray's sample `j` lies, in steps, and the length it stands for, in steps: at most one, and not above zero
    /// where the ray has not begun or has ended.
    #[inline(always)]
    pub(crate) fn sample(&self, simd: S, j: u32) -> (S::f32s, S::f32s) {
        let j = S::f32s::splat(simd, j as f32);
        let middle = (j + 0.5).min((j + self.end) * 0.5);
        let length = (self.end - j).min(1.0);
        (middle, j.simd_ge(self.first).select(length, S::f32s::splat(simd, 0.0)))
    }

    /// Rays that have samples at or after step `j`.
    #[inline(always)]
    pub(crate) fn not_ended(&self, j: u32) -> <S::f32s as SimdBase<S>>::Mask {
        self.end.simd_gt(j as f32)
    }

    /// Position in voxel space at step `j` of each ray.
    #[inline(always)]
    pub(crate) fn position(&self, j: S::f32s) -> [S::f32s; 3] {
        let ([ox, oy, oz], [sx, sy, sz]) = (self.origin, self.stride);
        [sx.mul_add(j, ox), sy.mul_add(j, oy), sz.mul_add(j, oz)]
    }

    /// World distance of where each ray enters.
    #[inline(always)]
    pub(crate) fn entry(&self) -> S::f32s {
        self.first.mul_add(self.world_step, self.t_origin)
    }

    /// Rays that meet the volume.
    #[inline(always)]
    pub(crate) fn hits(&self) -> <S::f32s as SimdBase<S>>::Mask {
        self.end.simd_gt(0.0)
    }
}

impl<S: Simd> FaceLanes<S> {
    #[inline(always)]
    fn new(simd: S, kept: &KeptLanes) -> Self {
        let n = S::f32s::LEN;
        let [factor, white, depth] = &kept.face;
        Self {
            terms: (S::f32s::from_slice(simd, &factor[..n]), S::f32s::from_slice(simd, &white[..n])),
            depth_per_step: S::f32s::from_slice(simd, &depth[..n]),
            present: S::f32s::from_slice(simd, &kept.has_face[..n]),
        }
    }

    /// Light at `steps` of the scene behind the surfaces, where the volume's own is `terms`: see [`Impregnation`].
    #[inline(always)]
    pub(crate) fn impregnate(
        &self,
        simd: S,
        kind: Impregnation,
        steps: S::f32s,
        (factor, white): (S::f32s, S::f32s),
    ) -> (S::f32s, S::f32s) {
        let (zero, one) = (S::f32s::splat(simd, 0.0), S::f32s::splat(simd, 1.0));
        // An infinite depth at no distance is no number: where there is no surface there is no weight.
        let depth = (steps * self.depth_per_step).min(1.0).max(0.0);
        let weight = match kind {
            Impregnation::Linear => one - depth,
            Impregnation::Step => depth.simd_lt(1.0).select(one, zero),
            Impregnation::None => zero,
        };
        let weight = self.present.simd_gt(0.0).select(weight, zero);
        let (of_face, white_of_face) = self.terms;
        (weight.mul_add(of_face - factor, factor), weight.mul_add(white_of_face - white, white))
    }
}

/// The least and the greatest in the lanes of a mask.
#[inline(always)]
fn range_of<S: Simd>(simd: S, mask: <S::f32s as SimdBase<S>>::Mask, v: S::f32s) -> [f32; 2] {
    let (most, least) = (S::f32s::splat(simd, f32::INFINITY), S::f32s::splat(simd, f32::NEG_INFINITY));
    [mask.select(v, most).reduce_min(), mask.select(v, least).reduce_max()]
}

/// Column and row of each lane's pixel within its packet.
#[inline(always)]
pub(crate) fn pixels_of_lanes<S: Simd>(simd: S) -> (S::f32s, S::f32s) {
    let (width, height) = packet_shape(S::f32s::LEN);
    let (mut column, mut row) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
    for l in 0..S::f32s::LEN {
        column[l] = (l as u32 % width) as f32;
        row[l] = (l as u32 / width % height) as f32;
    }
    let n = S::f32s::LEN;
    (S::f32s::from_slice(simd, &column[..n]), S::f32s::from_slice(simd, &row[..n]))
}
