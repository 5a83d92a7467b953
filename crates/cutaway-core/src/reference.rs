//! The reference renderer: slow, obvious, f64, exactly the integral. Every other engine is held against it.
//!
//! It has no step. A ray is cut at every cell boundary; inside a cell the trilinear field along the ray is a cubic,
//! which is cut again wherever the transfer function bends. On each of the smooth pieces that remain the integral
//!
//! ```text
//! C = ∫ c(s) sigma(s) T(s) ds,     T(s) = exp(-∫ sigma ds)
//! ```
//!
//! is taken by three-point Gauss-Legendre collocation (order 6), both integrals at once, in stretches that are halved
//! until halving changes nothing. Extrema, means and crossings come from the cubic itself.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::camera::{Ray, intersect_box};
use crate::cubic::Cubic;
use crate::field;
use crate::image::Image;
use crate::scene::{Mode, Scene};
use crate::segment::Segment;
use crate::transfer_function::extinction;

/// A stretch is halved until that changes no channel by more than this; the halves are then far nearer still.
const STEP_ERROR: f64 = 2e-7;

/// No stretch is shorter than a cell's share of one part in two to this power.
const DEEPEST_HALVING: u32 = 14;

/// Transmittance below which what lies behind cannot change a 32-bit image.
const OPAQUE: f64 = 1e-9;

/// Renders a scene. Depth: see [`Image`].
pub fn render(scene: &Scene) -> Image {
    render_with_progress(scene, &|_| {})
}

/// Renders a scene; `progress` is called with the finished share of the rows, 0..=1, from any thread.
pub fn render_with_progress(scene: &Scene, progress: &(dyn Fn(f32) + Sync)) -> Image {
    let (width, height) = scene.resolution();
    let rays = scene.camera().rays(width, height);
    let caster = Caster::new(scene);
    let done = AtomicU32::new(0);
    let row = |y: u32| {
        let row: Vec<Pixel> = (0..width).map(|x| caster.cast(&rays.pixel(x, y))).collect();
        progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / height as f32);
        row
    };
    let cast: Vec<Pixel> = (0..height).into_par_iter().flat_map_iter(row).collect();
    let colors = cast.iter().map(|p| p.premultiplied.map(|c| c as f32)).collect();
    let depths = cast.iter().map(|p| p.depth as f32).collect();
    let image = Image::new(width, height, colors).and_then(|image| image.with_depth(depths));
    image.expect("one pixel a ray of a resolution that the scene has checked")
}

/// What a ray brings back.
#[derive(Clone, Copy, Debug)]
struct Pixel {
    premultiplied: [f64; 4],
    /// World distance along the ray; infinite where nothing is.
    depth: f64,
}

const NOTHING: Pixel = Pixel { premultiplied: [0.0; 4], depth: f64::INFINITY };

struct Caster<'a> {
    scene: &'a Scene<'a>,
    knots: Vec<f64>,
    vanishing: f64,
}

/// A stretch of a ray inside one cell: `t = t_near + s * length`, `s` in 0..=1.
struct CellPiece {
    segment: Segment,
    value: Cubic,
}

/// The light within one cell: its corners' gradients, and the ray's way through it.
struct CellLight {
    gradients: [DVec3; 8],
    /// Position within the cell at `s` = 0, and what `s` adds to it.
    start: DVec3,
    stride: DVec3,
    l: DVec3,
    h: DVec3,
}

impl CellLight {
    fn new(caster: &Caster, ray: &Ray, ray_in_voxel: &Ray, piece: &CellPiece) -> Self {
        let volume = caster.scene.volume();
        let t = |s: f64| piece.segment.t_near() + s * piece.segment.length();
        let at = |s: f64| ray_in_voxel.origin + ray_in_voxel.direction * t(s);
        let (cell, _) = field::cell_of(volume, at(0.5));
        let base = DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64);
        let (l, h) = caster.scene.lighting().directions(ray.direction);
        Self {
            gradients: field::corner_gradients_in_world(volume, cell),
            start: at(0.0) - base,
            stride: at(1.0) - at(0.0),
            l,
            h,
        }
    }

    /// Colour factor and white added, at `s` of the cell's stretch.
    fn at(&self, caster: &Caster, s: f64) -> (f64, f64) {
        let gradient = field::trilinear_vector(&self.gradients, self.start + self.stride * s);
        caster.scene.lighting().terms(gradient, caster.vanishing, self.l, self.h)
    }
}

impl<'a> Caster<'a> {
    fn new(scene: &'a Scene<'a>) -> Self {
        let vanishing = field::vanishing_gradient(scene.volume());
        Self { scene, knots: scene.transfer_function().knots(), vanishing }
    }

    fn cast(&self, ray: &Ray) -> Pixel {
        let volume = self.scene.volume();
        let origin = volume.voxel_from_world().transform_point3(ray.origin);
        let direction = volume.voxel_from_world().transform_vector3(ray.direction);
        let Some(bounds) = intersect_box(origin, direction, volume.extent()) else { return NOTHING };
        let ray_in_voxel = Ray { origin, direction };
        let cells = self.cells(&ray_in_voxel, bounds);
        match self.scene.settings().mode {
            Mode::Composite => self.composite(ray, &ray_in_voxel, cells),
            Mode::Iso => self.isosurfaces(ray, &ray_in_voxel, cells),
            Mode::Mip => self.extremum(cells, 1.0),
            Mode::Minip => self.extremum(cells, -1.0),
            Mode::Mean => self.mean(cells),
        }
    }

    /// The ray's way through the volume, cell by cell.
    fn cells(&self, ray: &Ray, bounds: Segment) -> impl Iterator<Item = CellPiece> + use<'_, 'a> {
        let mut ends = vec![bounds.t_near(), bounds.t_far()];
        for axis in 0..3 {
            let (o, d) = (ray.origin[axis], ray.direction[axis]);
            let (a, b) = (o + d * bounds.t_near(), o + d * bounds.t_far());
            let planes = a.min(b).ceil() as i64..=a.max(b).floor() as i64;
            // A ray that runs along an axis plane never crosses it.
            ends.extend(planes.filter(|_| d != 0.0).map(|plane| (plane as f64 - o) / d));
        }
        ends.retain(|t| (bounds.t_near()..=bounds.t_far()).contains(t));
        ends.sort_by(f64::total_cmp);
        let ray = *ray;
        let pieces: Vec<Segment> = ends.windows(2).filter_map(|w| Segment::new(w[0], w[1])).collect();
        pieces.into_iter().map(move |segment| CellPiece { value: self.cubic(&ray, segment), segment })
    }

    fn cubic(&self, ray: &Ray, segment: Segment) -> Cubic {
        let volume = self.scene.volume();
        let at = |s: f64| ray.origin + ray.direction * (segment.t_near() + s * segment.length());
        let (cell, _) = field::cell_of(volume, at(0.5));
        let corners = field::corner_values(volume, cell);
        let base = DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64);
        Cubic::through([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|s| field::trilinear(&corners, at(s) - base)))
    }

    /// Colour factor and white added by the light on a surface at `t` along the ray.
    fn light(&self, ray: &Ray, ray_in_voxel: &Ray, t: f64) -> (f64, f64) {
        if !self.scene.is_shaded() {
            return (1.0, 0.0);
        }
        let p = ray_in_voxel.origin + ray_in_voxel.direction * t;
        let p = p.clamp(DVec3::ZERO, self.scene.volume().extent());
        let gradient = field::gradient_in_world(self.scene.volume(), p);
        let (l, h) = self.scene.lighting().directions(ray.direction);
        self.scene.lighting().terms(gradient, self.vanishing, l, h)
    }

    fn composite(&self, ray: &Ray, ray_in_voxel: &Ray, cells: impl Iterator<Item = CellPiece>) -> Pixel {
        let mut state = Integral { color: [0.0; 3], transmittance: 1.0, depth: f64::INFINITY };
        for cell in cells {
            let pieces = self.smooth_pieces(&cell.value);
            if pieces.is_empty() {
                continue;
            }
            let light = self.scene.is_shaded().then(|| CellLight::new(self, ray, ray_in_voxel, &cell));
            for (from, to) in pieces {
                state = self.integrate(state, &cell, light.as_ref(), from, to, 0);
            }
            if state.transmittance < OPAQUE {
                break;
            }
        }
        let [r, g, b] = state.color;
        Pixel { premultiplied: [r, g, b, 1.0 - state.transmittance], depth: state.depth }
    }

    /// The parts of a cell's stretch on which the transfer function of the value is smooth and somewhere visible.
    fn smooth_pieces(&self, value: &Cubic) -> Vec<(f64, f64)> {
        let (lo, hi, _) = value.range();
        let function = self.scene.transfer_function();
        if function.max_opacity(lo, hi) == 0.0 {
            return Vec::new();
        }
        let mut ends = vec![0.0, 1.0];
        for &knot in self.knots.iter().filter(|k| (lo..=hi).contains(*k)) {
            value.crossings(knot, |s| ends.push(s));
        }
        ends.sort_by(f64::total_cmp);
        let visible = |w: &(f64, f64)| {
            [0.1, 0.5, 0.9].iter().any(|u| function.evaluate(value.at(w.0 + u * (w.1 - w.0))).1 > 0.0)
        };
        ends.windows(2).map(|w| (w[0], w[1])).filter(|w| w.0 < w.1).filter(visible).collect()
    }

    /// The integral over the part `from..to` of a cell's stretch, added behind `state`. The part is halved until
    /// halving changes nothing: light is not smooth where a surface is seen edge-on or its normal turns over.
    fn integrate(
        &self,
        state: Integral,
        cell: &CellPiece,
        light: Option<&CellLight>,
        from: f64,
        to: f64,
        level: u32,
    ) -> Integral {
        if state.transmittance < OPAQUE {
            return state;
        }
        let middle = 0.5 * (from + to);
        let whole = self.step(state, cell, light, from, to);
        let first = self.step(state, cell, light, from, middle);
        let halves = self.step(first, cell, light, middle, to);
        // Three nodes alone may agree by chance, and do in a stretch so dense that all of them are behind a wall.
        let dense = halves.transmittance < 0.6 * state.transmittance;
        let settled = level > 0 && !dense && whole.difference(&halves) < STEP_ERROR;
        if settled || level == DEEPEST_HALVING {
            return halves;
        }
        let state = self.integrate(state, cell, light, from, middle, level + 1);
        self.integrate(state, cell, light, middle, to, level + 1)
    }

    /// One stretch of three Gauss nodes.
    fn step(
        &self,
        mut state: Integral,
        cell: &CellPiece,
        light: Option<&CellLight>,
        from: f64,
        to: f64,
    ) -> Integral {
        let function = self.scene.transfer_function();
        let samples = GAUSS_NODES.map(|u| from + (to - from) * u).map(|s| {
            let (color, opacity) = function.evaluate(cell.value.at(s));
            let (factor, white) = light.map_or((1.0, 0.0), |light| light.at(self, s));
            (color.map(|c| c * factor + white), extinction(opacity, self.scene.unit_distance()))
        });
        let t_start = cell.segment.t_near() + from * cell.segment.length();
        state.add(&samples, t_start, (to - from) * cell.segment.length());
        state
    }

    fn isosurfaces(&self, ray: &Ray, ray_in_voxel: &Ray, cells: impl Iterator<Item = CellPiece>) -> Pixel {
        let settings = self.scene.settings();
        let mut pixel = NOTHING;
        let mut transmittance = 1.0;
        let mut above: Option<Vec<bool>> = None;
        for cell in cells {
            let mut hits: Vec<(f64, f64)> = Vec::new();
            let sides =
                above.get_or_insert_with(|| settings.iso.iter().map(|v| cell.value.at(0.0) >= *v).collect());
            for (&level, side) in settings.iso.iter().zip(sides) {
                // Rounding may put a crossing between two cells: the side the ray was on decides.
                if (cell.value.at(0.0) >= level) != *side {
                    hits.push((0.0, level));
                }
                cell.value.crossings(level, |s| hits.push((s, level)));
                *side = cell.value.at(1.0) >= level;
            }
            hits.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (s, level) in hits {
                let t = cell.segment.t_near() + s * cell.segment.length();
                let (color, _) = self.scene.transfer_function().evaluate(level);
                let (factor, white) = self.light(ray, ray_in_voxel, t);
                let weight = transmittance * settings.iso_opacity;
                for (sum, color) in pixel.premultiplied.iter_mut().zip(color) {
                    *sum += weight * (color * factor + white);
                }
                transmittance -= weight;
                if pixel.depth.is_infinite() {
                    pixel.depth = t;
                }
                if transmittance < OPAQUE {
                    pixel.premultiplied[3] = 1.0;
                    return pixel;
                }
            }
        }
        pixel.premultiplied[3] = 1.0 - transmittance;
        pixel
    }

    /// Maximum (`sign` 1) or minimum (`sign` -1) of the value, classified once.
    fn extremum(&self, cells: impl Iterator<Item = CellPiece>, sign: f64) -> Pixel {
        let mut best = (f64::NEG_INFINITY, f64::INFINITY);
        for cell in cells {
            let signed = Cubic { c: cell.value.c.map(|c| sign * c) };
            let (_, most, at) = signed.range();
            if most > best.0 {
                best = (most, cell.segment.t_near() + at * cell.segment.length());
            }
        }
        if best.0 == f64::NEG_INFINITY { NOTHING } else { self.classified(sign * best.0, best.1) }
    }

    fn mean(&self, cells: impl Iterator<Item = CellPiece>) -> Pixel {
        let (mut sum, mut length, mut start) = (0.0, 0.0, f64::INFINITY);
        for cell in cells {
            let [a, b, c, d] = cell.value.c;
            sum += (a + b / 2.0 + c / 3.0 + d / 4.0) * cell.segment.length();
            length += cell.segment.length();
            start = start.min(cell.segment.t_near());
        }
        if length > 0.0 { self.classified(sum / length, start) } else { NOTHING }
    }

    /// A projected value: its opacity is used as it is.
    fn classified(&self, value: f64, depth: f64) -> Pixel {
        let ([r, g, b], a) = self.scene.transfer_function().evaluate(value);
        Pixel { premultiplied: [r * a, g * a, b * a, a], depth: if a > 0.0 { depth } else { f64::INFINITY } }
    }
}

/// Nodes, weights and integration matrix of three-point Gauss-Legendre collocation on 0..1.
const ROOT15: f64 = 3.872_983_346_207_417;
const GAUSS_NODES: [f64; 3] = [0.5 - ROOT15 / 10.0, 0.5, 0.5 + ROOT15 / 10.0];
const GAUSS_WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
const GAUSS_PARTIAL: [[f64; 3]; 3] = [
    [5.0 / 36.0, 2.0 / 9.0 - ROOT15 / 15.0, 5.0 / 36.0 - ROOT15 / 30.0],
    [5.0 / 36.0 + ROOT15 / 24.0, 2.0 / 9.0, 5.0 / 36.0 - ROOT15 / 24.0],
    [5.0 / 36.0 + ROOT15 / 30.0, 2.0 / 9.0 + ROOT15 / 15.0, 5.0 / 36.0],
];

/// What a ray has gathered so far.
#[derive(Clone, Copy)]
struct Integral {
    color: [f64; 3],
    transmittance: f64,
    /// Where the opacity passes one half.
    depth: f64,
}

impl Integral {
    /// Adds a stretch of `length` from three samples (colour, extinction) at its Gauss nodes.
    fn add(&mut self, samples: &[([f64; 3], f64); 3], t_start: f64, length: f64) {
        for i in 0..3 {
            let depth_to_node: f64 = (0..3).map(|j| GAUSS_PARTIAL[i][j] * samples[j].1).sum::<f64>() * length;
            let weight =
                self.transmittance * (-depth_to_node).exp() * GAUSS_WEIGHTS[i] * samples[i].1 * length;
            for (sum, color) in self.color.iter_mut().zip(samples[i].0) {
                *sum += weight * color;
            }
        }
        let depth: f64 = (0..3).map(|i| GAUSS_WEIGHTS[i] * samples[i].1).sum::<f64>() * length;
        let after = self.transmittance * (-depth).exp();
        if self.depth.is_infinite() && after <= 0.5 && depth > 0.0 {
            self.depth = t_start + length * (self.transmittance / 0.5).ln() / depth;
        }
        self.transmittance = after;
    }

    /// The largest difference of any channel.
    fn difference(&self, other: &Self) -> f64 {
        let color = self.color.iter().zip(other.color).map(|(a, b)| (a - b).abs());
        color.fold((self.transmittance - other.transmittance).abs(), f64::max)
    }
}
