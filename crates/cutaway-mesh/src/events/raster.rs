//! Rasterisation into per-pixel event lists, tile by tile: Termeer 3.2 on the CPU.
//!
//! Once a frame, all vertices are projected to fixed-point pixels and the triangles that may cover a pixel centre are
//! sorted into tiles ([`RasterFrame::new`]). Then each tile, on whatever thread, goes through its triangles and asks
//! [`Line::event`] for every pixel that the projected triangle covers or nearly covers. Projection only proposes: it
//! is grown by more than it can be wrong by, so the events are those of the other finders, bit for bit. Nothing is
//! stored per pixel beyond the tile in hand.
//!
//! A line also has a part behind the eye. Perspective maps what is there onto the right pixel, mirrored, so that such
//! triangles are like any other; only those that reach through the plane of the eye have no bounded image, and go by
//! the bounds of their parts on either side ([`Projection::bounds`]).

use cutaway_core::clip::Event;
use rayon::prelude::*;

use super::projection::Projection;
use super::tile::{ObjectRays, TileEvents, TileRect, by_position};
use super::watertight::Line;
use crate::TriangleMesh;

/// Pixels along the side of a bin.
const BIN: u32 = 32;

/// Bits behind the point of a projected coordinate.
const FRACTION: u32 = 12;

/// By how much, in fixed-point units, a projected coordinate can be wrong: half by rounding, one by the side that its
/// last bit tells, and half by the projection.
const ERROR: i32 = 2;

/// Marks a vertex without an image: too far off or too near the plane of the eye.
const WILD: i32 = i32::MIN;

/// Projected coordinates of this many pixels and more are wild.
const FAR: f64 = 131_072.0;

/// Images with more columns or rows are not rasterised.
pub(super) const MAX_SIDE: u32 = 65_536;

/// Triangles that cover more bins than this are kept in a list that every tile looks through, which bounds the bins'
/// memory.
const WIDE: u32 = 16;

/// A projected vertex: `x` and `y` in fixed point, the last bit of `y` telling the side of the eye; or [`WILD`].
type Image = [i32; 2];

/// First and last bin, columns and rows, both included.
type BinRange = [u16; 4];

/// The triangles of one part of the mesh, by bin.
#[derive(Debug, Default)]
struct Part {
    /// Where each bin's triangles begin; one more than there are bins.
    offsets: Vec<u32>,
    triangles: Vec<u32>,
    wide: Vec<(u32, BinRange)>,
}

/// A mesh projected and sorted into the tiles of an image.
#[derive(Debug)]
pub(super) struct RasterFrame<'a> {
    mesh: &'a TriangleMesh,
    rays: ObjectRays,
    projection: Projection,
    size: [u32; 2],
    bins: [u32; 2],
    vertices: Vec<Image>,
    parts: Vec<Part>,
}

/// What a tile needs while it is filled.
#[derive(Debug, Default)]
pub(crate) struct TileScratch {
    /// The lines of the tile's pixels, made when the first triangle asks.
    lines: Vec<PixelLine>,
    /// Events in the order of triangles, with their pixels.
    hits: Vec<(u32, Event)>,
}

#[derive(Clone, Copy, Debug)]
enum PixelLine {
    Unasked,
    None,
    Line(Line),
}

impl TileScratch {
    pub(super) fn bytes(&self) -> usize {
        self.lines.capacity() * size_of::<PixelLine>() + self.hits.capacity() * size_of::<(u32, Event)>()
    }
}

/// Pixels, first and last, both included.
#[derive(Clone, Copy)]
struct Span {
    x0: i32,
    y0: i32,
    x1: i32,
    y1: i32,
}

impl<'a> RasterFrame<'a> {
    pub(super) fn new(
        mesh: &'a TriangleMesh,
        rays: ObjectRays,
        projection: Projection,
        width: u32,
        height: u32,
    ) -> Self {
        let vertices =
            mesh.vertices().par_iter().with_min_len(4096).map(|v| image(&projection, v.as_dvec3())).collect();
        let bins = [width.div_ceil(BIN), height.div_ceil(BIN)];
        let mut frame =
            Self { mesh, rays, projection, size: [width, height], bins, vertices, parts: Vec::new() };
        let length = (mesh.triangles().len() / (4 * rayon::current_num_threads())).max(4096);
        let parts = mesh.triangles().par_chunks(length).enumerate();
        frame.parts = parts.map(|(i, part)| frame.sort(part, (i * length) as u32)).collect();
        frame
    }

    pub(super) fn bytes(&self) -> usize {
        let part = |part: &Part| {
            (part.offsets.capacity() + part.triangles.capacity()) * size_of::<u32>()
                + part.wide.capacity() * size_of::<(u32, BinRange)>()
        };
        self.vertices.capacity() * size_of::<Image>() + self.parts.iter().map(part).sum::<usize>()
    }

    /// Sorts a part of the triangles into bins.
    fn sort(&self, triangles: &[[u32; 3]], first: u32) -> Part {
        let mut part =
            Part { offsets: vec![0; self.bins[0] as usize * self.bins[1] as usize + 1], ..Part::default() };
        let mut entries: Vec<(u32, BinRange)> = Vec::with_capacity(triangles.len());
        let whole = self.whole();
        for (i, &corners) in triangles.iter().enumerate() {
            let triangle = first + i as u32;
            let images = corners.map(|v| self.vertices[v as usize]);
            let regular = is_regular(images);
            let span = if regular { covered(images, whole) } else { self.wild_span(triangle, whole) };
            let Some(span) = span else { continue };
            let bin = |pixel: i32| (pixel as u32 / BIN) as u16;
            let range = [bin(span.x0), bin(span.y0), bin(span.x1), bin(span.y1)];
            let cover = u32::from(range[2] - range[0] + 1) * u32::from(range[3] - range[1] + 1);
            if cover > WIDE {
                part.wide.push((triangle, range));
            } else {
                self.for_bins(range, |bin| part.offsets[bin] += 1);
                entries.push((triangle, range));
            }
        }
        let mut end = 0;
        for offset in &mut part.offsets {
            end += *offset;
            *offset = end;
        }
        part.triangles = vec![0; end as usize];
        // Backwards, each bin from its end, so that offsets end up at the bins' beginnings.
        for &(triangle, range) in entries.iter().rev() {
            self.for_bins(range, |bin| {
                part.offsets[bin] -= 1;
                part.triangles[part.offsets[bin] as usize] = triangle;
            });
        }
        part
    }

    #[inline(always)]
    fn for_bins(&self, range: BinRange, mut visit: impl FnMut(usize)) {
        for y in range[1]..=range[3] {
            for x in range[0]..=range[2] {
                visit(usize::from(y) * self.bins[0] as usize + usize::from(x));
            }
        }
    }

    fn whole(&self) -> Span {
        Span { x0: 0, y0: 0, x1: self.size[0] as i32 - 1, y1: self.size[1] as i32 - 1 }
    }

    /// The pixels that a triangle without a bounded image may cover.
    #[cold]
    fn wild_span(&self, triangle: u32, within: Span) -> Option<Span> {
        let corners = self.mesh.corners(triangle as usize).map(|c| c.as_dvec3());
        let size = self.size.map(f64::from);
        let [x0, y0, x1, y1] = self.projection.bounds(corners, size)?;
        let span = Span {
            x0: (x0.floor() as i32).max(within.x0),
            y0: (y0.floor() as i32).max(within.y0),
            x1: (x1.ceil() as i32).min(within.x1),
            y1: (y1.ceil() as i32).min(within.y1),
        };
        (span.x0 <= span.x1 && span.y0 <= span.y1).then_some(span)
    }

    /// Fills a tile, which must be inside the image.
    pub(super) fn tile(&self, rect: TileRect, tile: &mut TileEvents) {
        let scratch = &mut tile.raster;
        scratch.hits.clear();
        scratch.lines.clear();
        scratch.lines.resize(rect.pixels(), PixelLine::Unasked);
        let bins =
            [rect.x / BIN, rect.y / BIN, (rect.x + rect.width - 1) / BIN, (rect.y + rect.height - 1) / BIN];
        let all = span_of(rect);
        for (column, row) in (bins[1]..=bins[3]).flat_map(|y| (bins[0]..=bins[2]).map(move |x| (x, y))) {
            let within = Span {
                x0: all.x0.max((column * BIN) as i32),
                y0: all.y0.max((row * BIN) as i32),
                x1: all.x1.min((column * BIN + BIN - 1) as i32),
                y1: all.y1.min((row * BIN + BIN - 1) as i32),
            };
            let bin = (row * self.bins[0] + column) as usize;
            for part in &self.parts {
                for &triangle in &part.triangles[part.offsets[bin] as usize..part.offsets[bin + 1] as usize] {
                    self.triangle(triangle, within, rect, scratch);
                }
            }
        }
        for &(triangle, [x0, y0, x1, y1]) in self.parts.iter().flat_map(|part| &part.wide) {
            let meets = u32::from(x0) <= bins[2]
                && u32::from(x1) >= bins[0]
                && u32::from(y0) <= bins[3]
                && u32::from(y1) >= bins[1];
            if meets {
                self.triangle(triangle, all, rect, scratch);
            }
        }
        collect(rect, tile);
    }

    /// Finds the events of a triangle in the pixels of `within`.
    #[inline]
    fn triangle(&self, triangle: u32, within: Span, rect: TileRect, scratch: &mut TileScratch) {
        let images = self.mesh.triangles()[triangle as usize].map(|v| self.vertices[v as usize]);
        if is_regular(images) {
            let Some(span) = covered(images, within) else { return };
            let filter = Filter::new(images, span);
            let corners = self.mesh.corners(triangle as usize);
            for y in span.y0..=span.y1 {
                for x in span.x0..=span.x1 {
                    if filter.passes((x - span.x0) as f32, (y - span.y0) as f32) {
                        self.test(x, y, triangle, corners, rect, scratch);
                    }
                }
            }
        } else if let Some(span) = self.wild_span(triangle, within) {
            let corners = self.mesh.corners(triangle as usize);
            for y in span.y0..=span.y1 {
                for x in span.x0..=span.x1 {
                    self.test(x, y, triangle, corners, rect, scratch);
                }
            }
        }
    }

    /// Asks whether the line of a pixel crosses a triangle.
    #[inline(always)]
    fn test(
        &self,
        x: i32,
        y: i32,
        triangle: u32,
        corners: [cutaway_core::glam::Vec3; 3],
        rect: TileRect,
        scratch: &mut TileScratch,
    ) {
        let pixel = (y as u32 - rect.y) * rect.width + (x as u32 - rect.x);
        let line = &mut scratch.lines[pixel as usize];
        if let PixelLine::Unasked = line {
            *line = Line::new(&self.rays.pixel(x as u32, y as u32)).map_or(PixelLine::None, PixelLine::Line);
        }
        if let PixelLine::Line(line) = line
            && let Some(event) = line.event(corners, triangle)
        {
            scratch.hits.push((pixel, event));
        }
    }
}

fn span_of(rect: TileRect) -> Span {
    let (x0, y0) = (rect.x as i32, rect.y as i32);
    Span { x0, y0, x1: x0 + rect.width as i32 - 1, y1: y0 + rect.height as i32 - 1 }
}

/// Sorts the hits of a tile by pixel, and in each pixel along the ray.
fn collect(rect: TileRect, tile: &mut TileEvents) {
    let hits = &tile.raster.hits;
    let offsets = &mut tile.offsets;
    offsets.clear();
    offsets.resize(rect.pixels() + 1, 0);
    for (pixel, _) in hits {
        offsets[*pixel as usize] += 1;
    }
    let mut end = 0;
    for offset in offsets.iter_mut() {
        end += *offset;
        *offset = end;
    }
    let nothing = Event { t: 0.0, crossing: cutaway_core::clip::Crossing::Entering, surface: 0 };
    tile.events.clear();
    tile.events.resize(hits.len(), nothing);
    for (pixel, event) in hits.iter().rev() {
        let offset = &mut offsets[*pixel as usize];
        *offset -= 1;
        tile.events[*offset as usize] = *event;
    }
    for pixel in offsets.windows(2) {
        if pixel[1] - pixel[0] > 1 {
            tile.events[pixel[0] as usize..pixel[1] as usize].sort_unstable_by(by_position);
        }
    }
    tile.rect = Some(rect);
}

/// Projects a vertex.
#[inline]
fn image(projection: &Projection, vertex: cutaway_core::glam::DVec3) -> Image {
    let [xw, yw, w] = projection.homogeneous(vertex);
    let (x, y) = (xw / w, yw / w);
    // Also false for NaN.
    if !(w.abs() > projection.grazing(vertex) && x.abs() < FAR && y.abs() < FAR) {
        return [WILD; 2];
    }
    // Truncation rounds a number made positive to the nearest.
    let fixed = |v: f64| ((v + FAR) * f64::from(1 << FRACTION) + 0.5) as i64 as i32 - (1 << (17 + FRACTION));
    [fixed(x), fixed(y) & !1 | i32::from(w < 0.0)]
}

/// Whether all corners have an image and are on one side of the eye.
#[inline(always)]
fn is_regular([a, b, c]: [Image; 3]) -> bool {
    a[0] != WILD && b[0] != WILD && c[0] != WILD && ((a[1] ^ b[1]) | (a[1] ^ c[1])) & 1 == 0
}

/// The pixels in the bounding box of a projected triangle, if there are any.
#[inline(always)]
fn covered([a, b, c]: [Image; 3], within: Span) -> Option<Span> {
    let first = |low: i32| (low - ERROR + (1 << FRACTION) - 1) >> FRACTION;
    let last = |high: i32| (high + ERROR) >> FRACTION;
    let span = Span {
        x0: first(a[0].min(b[0]).min(c[0])).max(within.x0),
        y0: first(a[1].min(b[1]).min(c[1])).max(within.y0),
        x1: last(a[0].max(b[0]).max(c[0])).min(within.x1),
        y1: last(a[1].max(b[1]).max(c[1])).min(within.y1),
    };
    (span.x0 <= span.x1 && span.y0 <= span.y1).then_some(span)
}

/// Edge functions of a projected triangle, relative to a pixel; a pixel that they reject is certainly not covered.
struct Filter {
    /// `value + dx * x + dy * y` of each edge.
    value: [f32; 3],
    dx: [f32; 3],
    dy: [f32; 3],
    margin: f32,
}

impl Filter {
    #[inline(always)]
    fn new(images: [Image; 3], span: Span) -> Self {
        const UNIT: f32 = 1.0 / (1 << FRACTION) as f32;
        let relative = |v: Image| {
            [(v[0] - (span.x0 << FRACTION)) as f32 * UNIT, (v[1] - (span.y0 << FRACTION)) as f32 * UNIT]
        };
        let [a, b, c] = images.map(relative);
        let edge = |p: [f32; 2], q: [f32; 2]| (p[0] * q[1] - p[1] * q[0], p[1] - q[1], q[0] - p[0]);
        let (ab, bc, ca) = (edge(a, b), edge(b, c), edge(c, a));
        // A corner that is off by an error e moves an edge function by at most 2 e times the way from the pixel to
        // the other corner. The second term is what f32 rounds in products of that length.
        let reach = [a, b, c].iter().map(|v| v[0].abs() + v[1].abs()).fold(64.0, f32::max);
        let size = ab.1.abs().max(bc.1.abs()).max(ca.1.abs()) + ab.2.abs().max(bc.2.abs()).max(ca.2.abs());
        let margin = 2.0 * (ERROR as f32 * UNIT) * (size + 1.0) + size * reach * f32::EPSILON * 8.0;
        Self { value: [ab.0, bc.0, ca.0], dx: [ab.1, bc.1, ca.1], dy: [ab.2, bc.2, ca.2], margin }
    }

    #[inline(always)]
    fn passes(&self, x: f32, y: f32) -> bool {
        let at = |i: usize| self.value[i] + self.dx[i] * x + self.dy[i] * y;
        let (p, q, r) = (at(0), at(1), at(2));
        p.min(q).min(r) >= -self.margin || p.max(q).max(r) <= self.margin
    }
}
