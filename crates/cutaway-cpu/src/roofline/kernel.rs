//! The sampler at its limit: kernels of the engine in loops that do nothing else.
//!
//! Packets of parallel rays, a voxel apart, go straight through a cube of voxels in steps of one voxel. Nothing is
//! skipped, nothing ends early, no slab is looked up: what is left is the sampler itself and what follows a sample. See
//! [`crate::roofline`].

use cutaway_core::glam::{DVec3, Vec3};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, SimdBase};

use crate::cast::Shading;
use crate::packet::{Bounds, Packet, packet_shape, pixels_of_lanes};
use crate::sample::{Grid, LaneVoxel};
use crate::simd::{LaneSource, LaneWork};

/// What is done at each sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Work {
    /// The trilinear value alone.
    Sample,
    /// The value, its colour and opacity, and compositing.
    Composite,
    /// The same with a gradient and Blinn-Phong light.
    Shade,
}

impl Work {
    /// All of it, the least first.
    pub const ALL: [Self; 3] = [Self::Sample, Self::Composite, Self::Shade];

    /// A name for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sample => "sample",
            Self::Composite => "composite",
            Self::Shade => "shade",
        }
    }
}

/// Directions of view and what is up in them: along the rows of voxels, across all rows, and between. The first two are a
/// little oblique, as any view of a user is.
pub(crate) const VIEWS: [([f64; 3], [f64; 3]); 3] = [
    ([1.0, 0.02, 0.03], [0.0, 0.0, 1.0]),
    ([0.02, 0.03, 1.0], [0.0, 1.0, 0.0]),
    ([0.6, 0.5, 0.62], [0.0, 0.0, 1.0]),
];

/// Edge of a tile in pixels; a multiple of every packet's shape.
pub(crate) const TILE: u32 = 16;

/// Parallel rays through a cube.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// In voxel space, of unit length; across and along the image.
    direction: Vec3,
    across: Vec3,
    along: Vec3,
    /// Of pixel (0, 0), at step 0.
    corner: Vec3,
    /// Position of the cube's last voxels.
    last: f32,
}

impl View {
    /// A view of a cube of `edge` voxels, whose image has as many pixels a side.
    pub(crate) fn new(edge: u32, direction: [f64; 3], up: [f64; 3]) -> Self {
        let direction = DVec3::from_array(direction).normalize();
        let across = direction.cross(DVec3::from_array(up)).normalize();
        let along = across.cross(direction);
        let half = 0.5 * f64::from(edge - 1);
        let corner = DVec3::splat(half) - (across + along) * half;
        Self {
            direction: direction.as_vec3(),
            across: across.as_vec3(),
            along: along.as_vec3(),
            corner: corner.as_vec3(),
            last: (edge - 1) as f32,
        }
    }

    fn pixel(&self, x: u32, y: u32) -> Vec3 {
        self.corner + self.across * x as f32 + self.along * y as f32
    }

    /// The steps at which all rays of a packet are inside the cube. A box is convex: its corners decide.
    fn steps(&self, x: u32, y: u32) -> Option<(f32, f32)> {
        let (mut begin, mut end) = (f32::NEG_INFINITY, f32::INFINITY);
        for (x, y) in [(x, y), (x + 3, y), (x, y + 3), (x + 3, y + 3)] {
            let p = self.pixel(x, y);
            let (a, b) = (-p / self.direction, (Vec3::splat(self.last) - p) / self.direction);
            begin = begin.max(a.min(b).max_element());
            end = end.min(a.max(b).min_element());
        }
        let (begin, end) = (begin.ceil(), end.floor());
        (begin < end).then_some((begin, end))
    }
}

/// What the lanes of a tile did.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Done {
    pub(crate) samples: u64,
    /// Of what came out, so that nothing is left out as unused: for [`Work::Sample`] the sum of the sampled stored numbers.
    pub(crate) sum: f64,
}

/// A tile of a view, with the work that is done at each sample.
pub(crate) struct CeilingTile<'a, T> {
    pub(crate) work: Work,
    pub(crate) grid: Grid<'a, T>,
    pub(crate) looks: &'a Looks,
    pub(crate) view: &'a View,
    /// Its first pixel.
    pub(crate) at: (u32, u32),
    pub(crate) done: &'a mut Done,
}

/// What stored numbers look like: a table as large as a usual classification's, and light.
pub(crate) struct Looks {
    /// Straight colour and opacity.
    pub(crate) colors: Vec<[f32; 4]>,
    /// Stored number of entry 0, entries per stored unit.
    pub(crate) index_map: (f32, f32),
    pub(crate) shading: Shading,
}

impl Looks {
    /// A ramp of faint opacities over a range of stored numbers: no ray comes near to being opaque.
    pub(crate) fn new([lo, hi]: [f32; 2], entries: usize, shading: Shading) -> Self {
        let last = (entries - 1) as f32;
        let entry = |i: usize| {
            let t = i as f32 / last;
            [t, 1.0 - t, 0.5, 1e-4 + 1e-3 * t]
        };
        Self { colors: (0..entries).map(entry).collect(), index_map: (lo, last / (hi - lo)), shading }
    }

    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, colors: LaneSource<'_, [f32; 4]>, value: S::f32s) -> [S::f32s; 4] {
        let (lo, scale) = self.index_map;
        let index: S::i32s = ((value - lo) * scale + 0.5).to_int();
        let last = S::i32s::splat(simd, self.colors.len() as i32 - 1);
        colors.columns(simd, index.max(S::i32s::splat(simd, 0)).min(last).bitcast())
    }
}

impl<T: LaneVoxel> LaneWork for CeilingTile<'_, T> {
    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        // The choice is made once a tile, so that each loop holds its own work alone.
        match self.work {
            Work::Sample => self.packets(
                simd,
                #[inline(always)]
                |tile, packet, steps| tile.sample(simd, packet, steps),
            ),
            Work::Composite => self.packets(
                simd,
                #[inline(always)]
                |tile, packet, steps| tile.composite(simd, packet, steps),
            ),
            Work::Shade => self.packets(
                simd,
                #[inline(always)]
                |tile, packet, steps| tile.shade(simd, packet, steps),
            ),
        }
    }
}

impl<T: LaneVoxel> CeilingTile<'_, T> {
    #[inline(always)]
    fn packets<S: Simd>(&mut self, simd: S, cast: impl Fn(&Self, &Packet<S>, u32) -> S::f32s) {
        let (columns, rows) = pixels_of_lanes(simd);
        let (width, height) = packet_shape(S::f32s::LEN);
        let zero = S::f32s::splat(simd, 0.0);
        for y in (self.at.1..self.at.1 + TILE).step_by(height as usize) {
            for x in (self.at.0..self.at.0 + TILE).step_by(width as usize) {
                // The packet of 4 x 4 pixels that it is a part of, so that every instruction set takes the same samples.
                let Some((begin, end)) = self.view.steps(x / 4 * 4, y / 4 * 4) else { continue };
                let first = self.view.pixel(x, y) + self.view.direction * begin;
                let (mut origin, mut stride) = ([zero; 3], [zero; 3]);
                for a in 0..3 {
                    let in_row = columns.mul_add(self.view.across[a], S::f32s::splat(simd, first[a]));
                    origin[a] = rows.mul_add(self.view.along[a], in_row);
                    stride[a] = S::f32s::splat(simd, self.view.direction[a]);
                }
                let bounds = Bounds::default();
                let packet = Packet {
                    origin,
                    stride,
                    first: zero,
                    end: zero,
                    t_origin: zero,
                    world_step: S::f32s::splat(simd, 1.0),
                    opacity_scale: S::f32s::splat(simd, 1.0),
                    axis: None,
                    face: None,
                    bounds,
                };
                let steps = (end - begin) as u32;
                let out = cast(self, &packet, steps);
                self.done.samples += u64::from(steps) * S::f32s::LEN as u64;
                self.done.sum += out.as_slice().iter().map(|v| f64::from(*v)).sum::<f64>();
            }
        }
    }

    #[inline(always)]
    fn sample<S: Simd>(&self, simd: S, packet: &Packet<S>, steps: u32) -> S::f32s {
        let mut sum = S::f32s::splat(simd, 0.0);
        for j in 0..steps {
            let at = self.grid.locate(simd, packet.position(S::f32s::splat(simd, j as f32)));
            sum += self.grid.value(simd, &at);
        }
        sum
    }

    #[inline(always)]
    fn composite<S: Simd>(&self, simd: S, packet: &Packet<S>, steps: u32) -> S::f32s {
        let colors = LaneSource::new(&self.looks.colors);
        let mut sum = Sum::new(simd);
        for j in 0..steps {
            let at = self.grid.locate(simd, packet.position(S::f32s::splat(simd, j as f32)));
            let [r, g, b, alpha] = self.looks.at(simd, colors, self.grid.value(simd, &at));
            sum.add([r, g, b], alpha);
        }
        sum.total()
    }

    #[inline(always)]
    fn shade<S: Simd>(&self, simd: S, packet: &Packet<S>, steps: u32) -> S::f32s {
        let colors = LaneSource::new(&self.looks.colors);
        let light = self.looks.shading.packet_light(simd, packet);
        let mut sum = Sum::new(simd);
        for j in 0..steps {
            let at = self.grid.locate(simd, packet.position(S::f32s::splat(simd, j as f32)));
            let (value, gradient) = self.grid.value_and_gradient(simd, &at);
            let [r, g, b, alpha] = self.looks.at(simd, colors, value);
            let (factor, white) = self.looks.shading.terms(simd, &light, gradient);
            sum.add([r, g, b].map(|c| c.mul_add(factor, white)), alpha);
        }
        sum.total()
    }
}

/// What a packet accumulates, front to back.
struct Sum<S: Simd> {
    color: [S::f32s; 3],
    transmittance: S::f32s,
}

impl<S: Simd> Sum<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self { color: [S::f32s::splat(simd, 0.0); 3], transmittance: S::f32s::splat(simd, 1.0) }
    }

    #[inline(always)]
    fn add(&mut self, color: [S::f32s; 3], alpha: S::f32s) {
        let weight = self.transmittance * alpha;
        for (sum, color) in self.color.iter_mut().zip(color) {
            *sum = weight.mul_add(color, *sum);
        }
        self.transmittance -= weight;
    }

    #[inline(always)]
    fn total(&self) -> S::f32s {
        let [r, g, b] = self.color;
        r + g + b + self.transmittance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_fill_the_cube_and_do_not_leave_it() {
        let edge = 64;
        for (direction, up) in crate::roofline::VIEWS {
            let view = View::new(edge, direction, up);
            let mut samples = 0.0;
            for (x, y) in (0..edge).step_by(4).flat_map(|y| (0..edge).step_by(4).map(move |x| (x, y))) {
                let Some((begin, end)) = view.steps(x, y) else { continue };
                samples += 16.0 * (end - begin);
                for (j, (dx, dy)) in [(begin, (0, 0)), (end, (3, 0)), (begin, (3, 3)), (end, (0, 3))] {
                    let p = view.pixel(x + dx, y + dy) + view.direction * j;
                    let inside = p.min_element() > -1e-3 && p.max_element() < view.last + 1e-3;
                    assert!(inside, "{direction:?}: {p}");
                }
            }
            // A sample stands for a cubic voxel; what is missing are the rims, of packets that are partly outside, and the
            // corners beyond the image.
            let share = samples / view.last.powi(3);
            assert!((0.7..=1.02).contains(&share), "{direction:?}: {share}");
        }
    }
}
