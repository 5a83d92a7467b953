//! Events: where lines cross a mesh.
//!
//! Enters: a [`TriangleMesh`] and, each frame, a camera and a pose. Leaves: the [`Event`]s of a line, or of the pixels
//! of a tile. One watertight function decides which triangles a line crosses (module `watertight`); what differs
//! between the finders is which triangles they ask about:
//!
//! | finder | structure | a pose change costs |
//! |---|---|---|
//! | [`EventFinder::Grid`] | uniform grid, 3D-DDA | nothing |
//! | [`EventFinder::Octree`] | octree, parametric traversal | nothing |
//! | [`EventFinder::Bvh`] | bounding volume hierarchy | nothing |
//! | [`EventFinder::Raster`] | none; vertices projected and triangles sorted into tiles each frame | the frame's sorting |
//!
//! The default is rasterisation. Milliseconds for all pixels of 512 x 512, shortest of 15 runs with two threads of an AMD
//! EPYC (Zen 5) that other work shared, and bytes a triangle of the structure over the bunny, as
//! `cargo bench -p cutaway-mesh --bench events -- --table` gave them:
//!
//! | finder | bunny, 69,451 | sphere, 1,310,720 | bytes |
//! |---|---|---|---|
//! | grid | 70 | 193 | 27 |
//! | octree | 50 | 110 | 34 |
//! | hierarchy | 29 | 71 | 19 |
//! | rasterisation | 4.5 | 16 | none; a frame takes 8 |
//!
//! Lifetimes: [`MeshEvents`] belongs to a mesh and is built once; [`FrameEvents`] belongs to one camera, pose and image
//! size; [`TileEvents`] belongs to a thread.

mod bvh;
mod grid;
mod lines;
mod octree;
mod overlap;
mod projection;
mod raster;
mod tile;
pub(crate) mod watertight;

use std::sync::{Arc, OnceLock};

use cutaway_core::camera::{Ray, RayGenerator};
use cutaway_core::clip::Event;
use cutaway_core::glam::{DAffine3, DVec3};

use crate::TriangleMesh;
use lines::{LineFinder, LineScratch};
use projection::Projection;
use raster::RasterFrame;
use tile::by_position;
pub use tile::{ObjectRays, PixelEvents, SolidFrame, TileEvents, TileRect};
use watertight::Line;

/// How events of a mesh are found. All give the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum EventFinder {
    /// A uniform grid, walked by 3D-DDA (Termeer 3.1.2).
    Grid,
    /// An octree, walked by Revelles' parametric algorithm (Termeer 3.1.2).
    Octree,
    /// A bounding volume hierarchy.
    Bvh,
    /// Rasterisation into per-pixel lists (Termeer 3.2). Single lines go through a hierarchy, built when the first one
    /// is asked for.
    #[default]
    Raster,
}

impl EventFinder {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Grid, Self::Octree, Self::Bvh, Self::Raster];

    /// The name at the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grid => "grid",
            Self::Octree => "octree",
            Self::Bvh => "bvh",
            Self::Raster => "raster",
        }
    }
}

/// A mesh with what finds its events.
#[derive(Debug)]
pub struct MeshEvents {
    mesh: Arc<TriangleMesh>,
    finder: EventFinder,
    /// Relative to the mesh's origin.
    bounds: Option<[DVec3; 2]>,
    /// `None` inside for a mesh without triangles.
    lines: OnceLock<Option<LineFinder>>,
}

impl MeshEvents {
    /// Builds what the finder needs of the mesh.
    pub fn new(mesh: Arc<TriangleMesh>, finder: EventFinder) -> Self {
        let bounds = mesh.relative_bounds();
        let events = Self { mesh, finder, bounds, lines: OnceLock::new() };
        if finder != EventFinder::Raster {
            events.lines();
        }
        events
    }

    /// The mesh.
    pub fn mesh(&self) -> &Arc<TriangleMesh> {
        &self.mesh
    }

    /// Which finder it is.
    pub fn finder(&self) -> EventFinder {
        self.finder
    }

    /// Corners of the box around all triangles, in object space; `None` without triangles.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        self.bounds.map(|ends| ends.map(|end| self.mesh.origin() + end))
    }

    /// What the structure over the mesh holds, in bytes, the mesh itself not counted; 0 before it is built.
    pub fn bytes(&self) -> usize {
        self.lines.get().and_then(Option::as_ref).map_or(0, LineFinder::bytes)
    }

    fn lines(&self) -> Option<&LineFinder> {
        self.lines.get_or_init(|| LineFinder::new(&self.mesh, self.finder)).as_ref()
    }

    /// Appends the events along the whole line of a ray in object space, by `t`, then by triangle. A ray that is none
    /// (direction zero, or a number not finite) has none.
    pub fn line(&self, ray_in_object: &Ray, events: &mut Vec<Event>) {
        if let (Some(lines), Some(line)) = (self.lines(), self.line_of(ray_in_object)) {
            lines.events(&self.mesh, &line, &mut LineScratch::default(), events);
        }
    }

    /// The line of a ray, relative to the mesh's origin.
    fn line_of(&self, ray_in_object: &Ray) -> Option<Line> {
        Line::new(&Ray { origin: ray_in_object.origin - self.mesh.origin(), ..*ray_in_object })
    }

    /// What [`Self::line`] does, by asking every triangle: slow and obvious, to hold the others against.
    pub fn line_exhaustive(&self, ray_in_object: &Ray, events: &mut Vec<Event>) {
        let Some(line) = self.line_of(ray_in_object) else { return };
        let start = events.len();
        let ask = |triangle: usize| line.event(self.mesh.corners(triangle), triangle as u32);
        events.extend((0..self.mesh.triangles().len()).filter_map(ask));
        events[start..].sort_unstable_by(by_position);
    }

    /// Prepares the events of all pixels of an image: `rays` of the camera, and the pose of the mesh, inverted.
    pub fn frame(
        &self,
        rays: &RayGenerator,
        object_from_world: &DAffine3,
        width: u32,
        height: u32,
    ) -> FrameEvents<'_> {
        let rays = ObjectRays::new(*rays, *object_from_world).around(self.mesh.origin());
        let raster = if self.finder == EventFinder::Raster { self.raster(rays, width, height) } else { None };
        let way = match raster {
            Some(raster) => Way::Raster(raster),
            None => Way::Lines { mesh: &self.mesh, lines: self.lines(), rays },
        };
        FrameEvents { size: [width, height], way }
    }

    /// `None` where the image cannot be rasterised; its lines still have their events.
    fn raster(&self, rays: ObjectRays, width: u32, height: u32) -> Option<RasterFrame<'_>> {
        if width > raster::MAX_SIDE || height > raster::MAX_SIDE {
            return None;
        }
        let projection = Projection::new(&rays, width, height, self.bounds?)?;
        Some(RasterFrame::new(&self.mesh, rays, projection, width, height))
    }
}

/// The events of the pixels of one image: of one mesh, camera and pose.
#[derive(Debug)]
pub struct FrameEvents<'a> {
    size: [u32; 2],
    way: Way<'a>,
}

#[derive(Debug)]
enum Way<'a> {
    Lines { mesh: &'a TriangleMesh, lines: Option<&'a LineFinder>, rays: ObjectRays },
    Raster(RasterFrame<'a>),
}

impl FrameEvents<'_> {
    /// What was prepared for this frame, in bytes: nothing for finders of lines.
    pub fn bytes(&self) -> usize {
        match &self.way {
            Way::Lines { .. } => 0,
            Way::Raster(frame) => frame.bytes(),
        }
    }
}

impl PixelEvents for FrameEvents<'_> {
    /// The part of the rectangle that is outside the image is cut off. Tiles of 32 x 32 pixels at multiples of 32 are
    /// what rasterisation sorts by.
    fn tile(&self, rect: TileRect, tile: &mut TileEvents) {
        let [width, height] = self.size;
        let (x, y) = (rect.x.min(width), rect.y.min(height));
        let rect = TileRect { x, y, width: rect.width.min(width - x), height: rect.height.min(height - y) };
        match &self.way {
            Way::Raster(frame) if rect.pixels() > 0 => frame.tile(rect, tile),
            Way::Lines { mesh, lines: Some(lines), rays } => tile.fill(rect, |x, y, scratch, events| {
                if let Some(line) = Line::new(&rays.pixel(x, y)) {
                    lines.events(mesh, &line, scratch, events);
                }
            }),
            _ => tile.fill(rect, |_, _, _, _| {}),
        }
    }
}
