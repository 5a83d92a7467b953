//! Events of the pixels of a tile, and what gives them.

use cutaway_core::camera::{Ray, RayGenerator};
use cutaway_core::clip::{Event, Solid};
use cutaway_core::glam::{DAffine3, DVec3};

use super::lines::LineScratch;
use super::raster::TileScratch;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileRect {
    /// The left column.
    pub x: u32,
    /// The top row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl TileRect {
    /// How many pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// The events of each pixel of a tile, sorted along its ray. Made once a thread and filled for tile after tile, so that
/// its memory is reused.
#[derive(Debug, Default)]
pub struct TileEvents {
    /// Where each pixel's events begin, row by row; one more than there are pixels.
    pub(super) offsets: Vec<u32>,
    pub(super) events: Vec<Event>,
    pub(super) rect: Option<TileRect>,
    pub(super) line: LineScratch,
    pub(super) raster: TileScratch,
}

impl TileEvents {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// The rectangle that was asked for last.
    pub fn rect(&self) -> Option<TileRect> {
        self.rect
    }

    /// The events of a pixel, counted from the tile's corner, by `t`, then by triangle; of the whole line: `t` may be
    /// negative. Empty outside the tile.
    #[inline]
    pub fn pixel(&self, column: u32, row: u32) -> &[Event] {
        match self.rect {
            Some(rect) if column < rect.width && row < rect.height => {
                let at = row as usize * rect.width as usize + column as usize;
                &self.events[self.offsets[at] as usize..self.offsets[at + 1] as usize]
            }
            _ => &[],
        }
    }

    /// The events of all pixels, row by row.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Whether no pixel of the tile has an event.
    pub fn is_empty(&self) -> bool {
        self.events.is_empty()
    }

    /// What it holds, in bytes, kept for the next tile.
    pub fn bytes(&self) -> usize {
        self.offsets.capacity() * size_of::<u32>()
            + self.events.capacity() * size_of::<Event>()
            + self.raster.bytes()
            + self.line.bytes()
    }

    /// Fills the tile pixel by pixel; `append` puts the sorted events of a pixel of the image behind those there are.
    pub(super) fn fill(
        &mut self,
        rect: TileRect,
        mut append: impl FnMut(u32, u32, &mut LineScratch, &mut Vec<Event>),
    ) {
        self.rect = Some(rect);
        self.offsets.clear();
        self.events.clear();
        self.offsets.push(0);
        for y in rect.y..rect.y + rect.height {
            for x in rect.x..rect.x + rect.width {
                append(x, y, &mut self.line, &mut self.events);
                self.offsets.push(self.events.len() as u32);
            }
        }
    }
}

/// Gives the events of the pixels of one frame, tile by tile, from several threads at once.
pub trait PixelEvents: Sync {
    /// Replaces what `tile` holds by the events of this rectangle of pixels.
    fn tile(&self, rect: TileRect, tile: &mut TileEvents);
}

/// The rays of an image, in the object space of a solid.
#[derive(Clone, Copy, Debug)]
pub struct ObjectRays {
    rays: RayGenerator,
    object_from_world: DAffine3,
    /// Subtracted from the rays' origins: that of a mesh.
    origin: DVec3,
}

impl ObjectRays {
    /// Rays of `rays`, seen from an object whose pose is the inverse of `object_from_world`.
    pub fn new(rays: RayGenerator, object_from_world: DAffine3) -> Self {
        Self { rays, object_from_world, origin: DVec3::ZERO }
    }

    /// The same rays, relative to a point in object space.
    pub(super) fn around(self, origin: DVec3) -> Self {
        Self { origin, ..self }
    }

    /// The ray of a pixel; its `t` is the same as in the world, its direction need not have unit length.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> Ray {
        let ray = self.rays.pixel(x, y);
        Ray {
            origin: self.object_from_world.transform_point3(ray.origin) - self.origin,
            direction: self.object_from_world.transform_vector3(ray.direction),
        }
    }

    pub(super) fn object_from_world(&self) -> &DAffine3 {
        &self.object_from_world
    }

    pub(super) fn in_world(&self) -> &RayGenerator {
        &self.rays
    }
}

/// A frame of any [`Solid`], one line a pixel: for shapes with events in closed form.
#[derive(Clone, Copy, Debug)]
pub struct SolidFrame<'a> {
    solid: &'a dyn Solid,
    rays: ObjectRays,
}

impl<'a> SolidFrame<'a> {
    /// The frame of a solid under these rays.
    pub fn new(solid: &'a dyn Solid, rays: ObjectRays) -> Self {
        Self { solid, rays }
    }
}

impl PixelEvents for SolidFrame<'_> {
    fn tile(&self, rect: TileRect, tile: &mut TileEvents) {
        tile.fill(rect, |x, y, _, events| {
            let start = events.len();
            self.solid.events(&self.rays.pixel(x, y), events);
            events[start..].sort_unstable_by(by_position);
        });
    }
}

/// The order of events in a pixel.
pub(super) fn by_position(a: &Event, b: &Event) -> std::cmp::Ordering {
    a.t.total_cmp(&b.t).then(a.surface.cmp(&b.surface))
}
