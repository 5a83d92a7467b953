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
//!
//! A clipped ray is the sum of its segments, each of which is treated so: nothing is sampled, so nothing is off by a
//! part of a step at a cut.

mod integral;
mod light;

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use self::integral::{GAUSS_NODES, Integral};
use self::light::{CellLight, Face, Layer, Terms, lit};
use crate::camera::{Ray, intersect_box};
use crate::clip::{ClipSegment, FlatClip, Sweep};
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

/// What a clip surface that is drawn is made of.
const OVERLAY_COLOR: [f64; 3] = [1.0; 3];

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Rays that met the volume.
    pub rays: u64,
    /// Segments of them: one a ray where nothing is clipped.
    pub segments: u64,
    /// Lines through objects whose events did not balance; see [`Sweep`].
    pub repaired: u64,
}

impl std::ops::Add for Statistics {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            segments: self.segments + other.segments,
            repaired: self.repaired + other.repaired,
        }
    }
}

/// Renders a scene. Depth: see [`Image`].
pub fn render(scene: &Scene) -> Image {
    render_with_progress(scene, &|_| {}).0
}

/// Renders a scene; `progress` is called with the finished share of the rows, 0..=1, from any thread.
pub fn render_with_progress(scene: &Scene, progress: &(dyn Fn(f32) + Sync)) -> (Image, Statistics) {
    let scene = &*scene.normalised();
    let (width, height) = scene.resolution();
    let rays = scene.camera().rays(width, height);
    let caster = Caster::new(scene);
    let done = AtomicU32::new(0);
    let row = |y: u32| {
        let mut scratch = Scratch::default();
        let row: Vec<Pixel> = (0..width).map(|x| caster.cast(&rays.pixel(x, y), &mut scratch)).collect();
        progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / height as f32);
        (row, Statistics { repaired: scratch.sweep.repaired(), ..scratch.statistics })
    };
    let rows: Vec<(Vec<Pixel>, Statistics)> = (0..height).into_par_iter().map(row).collect();
    let statistics = rows.iter().fold(Statistics::default(), |sum, (_, row)| sum + *row);
    let cast = || rows.iter().flat_map(|(row, _)| row);
    let colors = cast().map(|p| p.premultiplied.map(|c| c as f32)).collect();
    let depths = cast().map(|p| p.depth as f32).collect();
    let image = Image::new(width, height, colors).and_then(|image| image.with_depth(depths));
    let image = image.expect("one pixel a ray of a resolution that the scene has checked");
    (image.blurred(scene.settings().blur).with_depth_unit(scene.space().unit), statistics)
}

/// What a row of rays shares.
#[derive(Default)]
struct Scratch {
    sweep: Sweep,
    statistics: Statistics,
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
    scene: &'a Scene,
    knots: Vec<f64>,
    vanishing: f64,
}

/// A stretch of a ray inside one cell: `t = t_near + s * length`, `s` in 0..=1.
struct CellPiece {
    segment: Segment,
    value: Cubic,
    /// Smallest and largest value at the cell's corners.
    corners: [f64; 2],
}

/// A ray, in both spaces, and what is kept of it.
struct CastRay<'a> {
    ray: &'a Ray,
    ray_in_voxel: Ray,
    segments: &'a [ClipSegment],
}

impl<'a> Caster<'a> {
    fn new(scene: &'a Scene) -> Self {
        let vanishing = field::vanishing_gradient(scene.volume());
        Self { scene, knots: scene.transfer_function().knots(), vanishing }
    }

    fn cast(&self, ray: &Ray, scratch: &mut Scratch) -> Pixel {
        let volume = self.scene.volume();
        let origin = volume.voxel_from_world().transform_point3(ray.origin);
        let direction = volume.voxel_from_world().transform_vector3(ray.direction);
        let Some(bounds) = intersect_box(origin, direction, volume.extent()) else { return NOTHING };
        let whole = [ClipSegment { segment: bounds, near: None, far: None }];
        let segments = match self.scene.clip() {
            Some(clip) => scratch.sweep.cast(clip, ray, bounds, self.scene.segment_limit()),
            None => &whole,
        };
        scratch.statistics.rays += 1;
        scratch.statistics.segments += segments.len() as u64;
        let cast = CastRay { ray, ray_in_voxel: Ray { origin, direction }, segments };
        match self.scene.settings().mode {
            Mode::Composite => self.composite(&cast),
            Mode::Iso => self.isosurfaces(&cast),
            Mode::Mip => self.with_overlay(&cast, self.extremum(self.all_cells(&cast), 1.0)),
            Mode::Minip => self.with_overlay(&cast, self.extremum(self.all_cells(&cast), -1.0)),
            Mode::Mean => self.with_overlay(&cast, self.mean(self.all_cells(&cast))),
        }
    }

    /// The surface that a segment begins at.
    fn face(&self, cast: &CastRay, segment: &ClipSegment) -> Option<Face> {
        let clip: &FlatClip = self.scene.clip()?;
        Face::new(self, clip, cast.ray, segment)
    }

    /// A clip surface as it is drawn: its colour, where it is to be drawn at all.
    fn overlay(&self, face: Option<&Face>) -> Option<([f64; 3], f64)> {
        let opacity = self.scene.clip_shading().overlay;
        let face = face.filter(|_| opacity > 0.0)?;
        Some((lit(OVERLAY_COLOR, face.terms), opacity))
    }

    /// The cells of all segments.
    fn all_cells(&self, cast: &CastRay) -> impl Iterator<Item = CellPiece> {
        cast.segments.iter().flat_map(|s| self.cells(&cast.ray_in_voxel, s.segment))
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
        pieces.into_iter().map(move |segment| {
            let (value, corners) = self.cubic(&ray, segment);
            CellPiece { segment, value, corners }
        })
    }

    /// The field along a stretch in one cell, with the smallest and largest value at the cell's corners.
    fn cubic(&self, ray: &Ray, segment: Segment) -> (Cubic, [f64; 2]) {
        let volume = self.scene.volume();
        let at = |s: f64| ray.origin + ray.direction * (segment.t_near() + s * segment.length());
        let (cell, _) = field::cell_of(volume, at(0.5));
        let corners = field::corner_values(volume, cell);
        let base = DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64);
        let values = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|s| field::trilinear(&corners, at(s) - base));
        let range =
            corners.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(*v), hi.max(*v)]);
        (Cubic::through(values), range)
    }

    /// The light on an isosurface at `t` along the ray.
    fn light(&self, cast: &CastRay, t: f64) -> Terms {
        if !self.scene.is_shaded() {
            return (1.0, 0.0);
        }
        let p = cast.ray_in_voxel.origin + cast.ray_in_voxel.direction * t;
        let p = p.clamp(DVec3::ZERO, self.scene.volume().extent());
        let gradient = field::gradient_in_world(self.scene.volume(), p);
        let (l, h) = self.scene.lighting().directions(cast.ray.direction);
        self.scene.lighting().terms(gradient, self.vanishing, l, h)
    }

    fn composite(&self, cast: &CastRay) -> Pixel {
        let mut state = Integral::START;
        for segment in cast.segments {
            let face = self.face(cast, segment);
            if let Some((color, opacity)) = self.overlay(face.as_ref()) {
                state.add_surface(color, opacity, segment.segment.t_near());
            }
            let layer = face.and_then(|face| Layer::new(self, &face));
            state = self.composite_segment(state, cast, segment.segment, layer);
            if state.transmittance < OPAQUE {
                break;
            }
        }
        let [r, g, b] = state.color;
        Pixel { premultiplied: [r, g, b, 1.0 - state.transmittance], depth: state.depth }
    }

    fn composite_segment(
        &self,
        mut state: Integral,
        cast: &CastRay,
        segment: Segment,
        layer: Option<Layer>,
    ) -> Integral {
        for cell in self.cells(&cast.ray_in_voxel, segment) {
            if state.transmittance < OPAQUE {
                break;
            }
            // The light bends where a layer ends.
            let bend = layer.map(|layer| (layer.t_far() - cell.segment.t_near()) / cell.segment.length());
            let pieces = self.smooth_pieces(&cell.value, bend);
            if pieces.is_empty() {
                continue;
            }
            let light = self.scene.is_shaded().then(|| CellLight::new(self, cast, layer, &cell));
            for (from, to) in pieces {
                state = self.integrate(state, &cell, light.as_ref(), from, to, 0);
            }
        }
        state
    }

    /// The parts of a cell's stretch on which the transfer function of the value is smooth and somewhere visible; also
    /// cut at `bend`, if that is inside.
    fn smooth_pieces(&self, value: &Cubic, bend: Option<f64>) -> Vec<(f64, f64)> {
        let (lo, hi, _) = value.range();
        let function = self.scene.transfer_function();
        if function.max_opacity(lo, hi) == 0.0 {
            return Vec::new();
        }
        let mut ends = vec![0.0, 1.0];
        ends.extend(bend.filter(|s| (0.0..1.0).contains(s)));
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
        light: Option<&CellLight<'_>>,
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
        light: Option<&CellLight<'_>>,
        from: f64,
        to: f64,
    ) -> Integral {
        let function = self.scene.transfer_function();
        let samples = GAUSS_NODES.map(|u| from + (to - from) * u).map(|s| {
            let (color, opacity) = function.evaluate(cell.value.at(s));
            let terms = light.map_or((1.0, 0.0), |light| light.at(self, s));
            (lit(color, terms), extinction(opacity, self.scene.unit_distance()))
        });
        let t_start = cell.segment.t_near() + from * cell.segment.length();
        state.add(&samples, t_start, (to - from) * cell.segment.length());
        state
    }

    fn isosurfaces(&self, cast: &CastRay) -> Pixel {
        let mut stack = SurfaceStack::default();
        for segment in cast.segments {
            self.isosurfaces_of_segment(cast, segment, &mut stack);
            if stack.is_opaque() {
                break;
            }
        }
        stack.pixel()
    }

    fn isosurfaces_of_segment(&self, cast: &CastRay, segment: &ClipSegment, stack: &mut SurfaceStack) {
        let settings = self.scene.settings();
        let face = self.face(cast, segment);
        if let Some((color, opacity)) = self.overlay(face.as_ref()) {
            stack.add(color, opacity, segment.segment.t_near());
        }
        let color_of = |level: f64| self.scene.transfer_function().evaluate(level).0;
        // On which side of each isovalue the ray is.
        let mut sides: Option<Vec<bool>> = None;
        for cell in self.cells(&cast.ray_in_voxel, segment.segment) {
            let at_start = cell.value.at(0.0);
            if sides.is_none() {
                // What is cut open is closed by the cut: of nested surfaces, the innermost shows.
                let cap = face.filter(|_| self.scene.clip_shading().cap);
                let level = settings.iso.iter().copied().filter(|level| at_start >= *level).reduce(f64::max);
                if let (Some(cap), Some(level)) = (cap, level) {
                    stack.add(lit(color_of(level), cap.terms), settings.iso_opacity, cap.t);
                }
            }
            let starts_above = |level: &f64| cell.value.starts_above(*level, cell.corners);
            let sides = sides.get_or_insert_with(|| settings.iso.iter().map(starts_above).collect());
            let mut hits: Vec<(f64, f64)> = Vec::new();
            for (&level, side) in settings.iso.iter().zip(sides) {
                *side = cell.value.passes(level, cell.corners, *side, |s| hits.push((s, level)));
            }
            hits.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (s, level) in hits {
                if stack.is_opaque() {
                    return;
                }
                let t = cell.segment.t_near() + s * cell.segment.length();
                stack.add(lit(color_of(level), self.light(cast, t)), settings.iso_opacity, t);
            }
        }
    }

    /// A projection has no front and back: clip surfaces that are drawn lie before it.
    fn with_overlay(&self, cast: &CastRay, projected: Pixel) -> Pixel {
        let mut stack = SurfaceStack::default();
        for segment in cast.segments {
            if let Some((color, opacity)) = self.overlay(self.face(cast, segment).as_ref()) {
                stack.add(color, opacity, segment.segment.t_near());
            }
        }
        let mut pixel = stack.pixel();
        for (front, back) in pixel.premultiplied.iter_mut().zip(projected.premultiplied) {
            *front += stack.transmittance * back;
        }
        if projected.depth.is_finite() {
            pixel.depth = projected.depth;
        }
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

/// Surfaces, front to back.
struct SurfaceStack {
    color: [f64; 3],
    transmittance: f64,
    /// Of the first.
    depth: f64,
}

impl Default for SurfaceStack {
    fn default() -> Self {
        Self { color: [0.0; 3], transmittance: 1.0, depth: f64::INFINITY }
    }
}

impl SurfaceStack {
    /// One behind the others, of a colour that is already lit.
    fn add(&mut self, color: [f64; 3], opacity: f64, t: f64) {
        let weight = self.transmittance * opacity;
        for (sum, color) in self.color.iter_mut().zip(color) {
            *sum += weight * color;
        }
        self.transmittance -= weight;
        if self.depth.is_infinite() {
            self.depth = t;
        }
    }

    fn is_opaque(&self) -> bool {
        self.transmittance < OPAQUE
    }

    fn pixel(&self) -> Pixel {
        let [r, g, b] = self.color;
        let transmittance = if self.is_opaque() { 0.0 } else { self.transmittance };
        Pixel { premultiplied: [r, g, b, 1.0 - transmittance], depth: self.depth }
    }
}
