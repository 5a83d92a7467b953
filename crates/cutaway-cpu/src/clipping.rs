//! Clipping: what is kept of the rays of a tile.
//!
//! What enters: a scene's clip. What leaves, tile by tile: for each pixel the segments of its ray that are kept, from
//! core's sweep over the events of all objects, each with the light of the surface that it begins at. Meshes give the
//! events of a tile at once, by rasterisation; everything else is asked ray by ray. Nothing is stored for the whole image,
//! and no voxel is looked at, so moving an object costs the next frame nothing.

use std::any::Any;

use cutaway_core::camera::{Ray, intersect_box};
use cutaway_core::clip::{ClipSegment, FlatClip, Impregnation, Sweep};
use cutaway_core::glam::DVec3;
use cutaway_core::scene::Scene;
use cutaway_core::segment::Segment;
use cutaway_mesh::MeshSolid;
use cutaway_mesh::events::{ObjectRays, PixelEvents, SolidFrame, TileEvents, TileRect};

use crate::rays::Frame;
use crate::simd::MAX_LANES;
use crate::tiles::{TILE, Tile};

/// Most objects whose events are found for all pixels of a tile at once. Of more, each ray asks those that are near it:
/// time and memory for all objects in every tile would grow with their product.
const MOST_TOGETHER: usize = 64;

/// A clip under the camera of a frame.
pub(crate) struct ClipFrame<'a> {
    scene: &'a Scene,
    clip: &'a FlatClip,
    /// One per leaf of the clip; none where there are too many.
    leaves: Vec<Box<dyn PixelEvents + Send + 'a>>,
    /// How deep below a surface its normal lights samples, in world units; 0: not at all.
    depth: f64,
}

/// A piece of a ray that is kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kept {
    /// World distances from the ray's beginning.
    pub(crate) segment: Option<Segment>,
    /// Steps from where the ray enters the volume; infinite where it goes on to the other side.
    pub(crate) begin: f32,
    pub(crate) end: f32,
    /// The surface at its beginning, if there is one.
    pub(crate) face: Option<Face>,
}

/// The light of a clip surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Of a colour: its factor, and white that is added.
    pub(crate) terms: (f32, f32),
    /// By how much a step of the scene brings the ray deeper, in parts of the depth to which the surface lights samples;
    /// infinite where it lights none.
    pub(crate) depth_per_step: f32,
}

/// The kept pieces of all rays of a tile.
pub(crate) struct TileClip {
    /// Where each pixel's pieces begin, rows of [`TILE`]; one more than there are pixels.
    offsets: Vec<u32>,
    pieces: Vec<Kept>,
    /// The tile's first pixel.
    corner: (u32, u32),
    /// Lines that had to be repaired.
    pub(crate) repaired: u64,
}

/// The pieces of one rank of a packet's rays, lane by lane.
#[derive(Clone, Copy)]
pub(crate) struct KeptLanes {
    pub(crate) begin: [f32; MAX_LANES],
    /// Not after `begin` in lanes without a piece.
    pub(crate) end: [f32; MAX_LANES],
    /// Surfaces: factor, white, depth a step. Infinite depth in lanes without one.
    pub(crate) face: [[f32; MAX_LANES]; 3],
    /// 1 in lanes that begin at a surface, else 0.
    pub(crate) has_face: [f32; MAX_LANES],
}

impl<'a> ClipFrame<'a> {
    /// The clip of a scene, if it has one.
    pub(crate) fn new(scene: &'a Scene) -> Option<Self> {
        let clip = scene.clip()?;
        let (width, height) = scene.resolution();
        let rays = scene.camera().rays(width, height);
        let leaf = |leaf: &'a cutaway_core::clip::FlatLeaf| -> Box<dyn PixelEvents + Send + 'a> {
            let solid = leaf.solid.as_ref();
            match (solid as &dyn Any).downcast_ref::<MeshSolid>() {
                Some(mesh) => Box::new(mesh.frame(&rays, leaf.object_from_world(), width, height)),
                None => Box::new(SolidFrame::new(solid, ObjectRays::new(rays, *leaf.object_from_world()))),
            }
        };
        let few = clip.leaves().len() <= MOST_TOGETHER;
        let leaves = if few { clip.leaves().iter().map(leaf).collect() } else { Vec::new() };
        let depth = scene.impregnation_depth().unwrap_or(0.0);
        Some(Self { scene, clip, leaves, depth })
    }

    /// What is kept of the rays of a tile of a frame.
    pub(crate) fn tile(&self, frame: &Frame, tile: &Tile) -> TileClip {
        let (width, height) = (TILE.min(frame.width - tile.x), TILE.min(frame.height - tile.y));
        // A lattice's pixels are not neighbours: its rays are asked one by one.
        let together = frame.is_full() && self.leaves.len() == self.clip.leaves().len();
        let events: Vec<TileEvents> = self
            .leaves
            .iter()
            .map(|leaf| {
                let mut events = TileEvents::new();
                if together {
                    leaf.tile(TileRect { x: tile.x, y: tile.y, width, height }, &mut events);
                }
                events
            })
            .collect();
        let mut sweep = Sweep::new();
        let mut offsets = vec![0];
        let mut pieces = Vec::new();
        for (row, column) in (0..TILE).flat_map(|y| (0..TILE).map(move |x| (y, x))) {
            if column < width && row < height {
                let (x, y) = (tile.x + column, tile.y + row);
                if together && events.iter().all(|e| e.pixel(column, row).is_empty()) {
                    pieces.extend(self.clip.keeps_outside().then_some(Kept::WHOLE));
                } else if frame.wants((x, y), (1, 1)) {
                    let of_pixel = |leaf: usize| events[leaf].pixel(column, row);
                    self.ray(frame, (x, y), together.then_some(&of_pixel), &mut sweep, &mut pieces);
                }
            }
            offsets.push(pieces.len() as u32);
        }
        TileClip { offsets, pieces, corner: (tile.x, tile.y), repaired: sweep.repaired() }
    }

    /// Appends what is kept of the ray of a pixel.
    fn ray<'e>(
        &self,
        frame: &Frame,
        (x, y): (u32, u32),
        events: Option<&dyn Fn(usize) -> &'e [cutaway_core::clip::Event]>,
        sweep: &mut Sweep,
        pieces: &mut Vec<Kept>,
    ) {
        let ray = frame.ray(x, y);
        let voxel_from_world = frame.volume.voxel_from_world();
        let origin = voxel_from_world.transform_point3(ray.origin);
        let direction = voxel_from_world.transform_vector3(ray.direction);
        let Some(range) = intersect_box(origin, direction, frame.volume.extent()) else { return };
        let limit = self.scene.segment_limit();
        let kept = match events {
            Some(events) => {
                sweep.segments(self.clip, |leaf, out| out.extend_from_slice(events(leaf)), range, limit)
            }
            None => sweep.cast(self.clip, &ray, range, limit),
        };
        let steps = |t: f64| ((t - range.t_near()) / frame.step_length) as f32;
        pieces.extend(kept.iter().map(|kept| Kept {
            segment: Some(kept.segment),
            begin: steps(kept.segment.t_near()),
            // Up to the very end of the volume, whatever rounding makes of its distance.
            end: if kept.far.is_some() { steps(kept.segment.t_far()) } else { f32::INFINITY },
            face: self.face(&ray, kept, frame.step_length),
        }));
    }

    fn face(&self, ray: &Ray, kept: &ClipSegment, step_length: f64) -> Option<Face> {
        let normal: DVec3 = kept.near_normal(self.clip, ray)?;
        let lighting = self.scene.lighting();
        let terms = if lighting.shade {
            let (l, h) = lighting.directions(ray.direction);
            // The normal of a gradient is against it.
            lighting.terms(-normal, 0.0, l, h)
        } else {
            (1.0, 0.0)
        };
        let cosine = normal.dot(ray.direction).abs().max(Impregnation::LEAST_COSINE);
        let depth_per_step = if self.depth > 0.0 { step_length * cosine / self.depth } else { f64::INFINITY };
        Some(Face { terms: (terms.0 as f32, terms.1 as f32), depth_per_step: depth_per_step as f32 })
    }
}

impl Kept {
    /// All of a ray.
    const WHOLE: Self = Self { segment: None, begin: 0.0, end: f32::INFINITY, face: None };
}

impl TileClip {
    /// The kept pieces of a pixel of the frame, near ones first.
    pub(crate) fn pixel(&self, (x, y): (u32, u32)) -> &[Kept] {
        let (column, row) = (x - self.corner.0, y - self.corner.1);
        if column >= TILE || row >= TILE {
            return &[];
        }
        let at = (row * TILE + column) as usize;
        &self.pieces[self.offsets[at] as usize..self.offsets[at + 1] as usize]
    }

    /// The most pieces that any pixel of a rectangle has.
    pub(crate) fn most(&self, (x, y): (u32, u32), edge: u32) -> usize {
        let pixels = (0..edge).flat_map(|j| (0..edge).map(move |i| (x + i, y + j)));
        pixels.map(|at| self.pixel(at).len()).max().unwrap_or(0)
    }

    /// The pieces of a rank of a packet's pixels.
    pub(crate) fn lanes(&self, (x, y): (u32, u32), (width, height): (u32, u32), rank: usize) -> KeptLanes {
        let mut lanes = KeptLanes {
            begin: [0.0; MAX_LANES],
            end: [0.0; MAX_LANES],
            face: [[0.0; MAX_LANES], [0.0; MAX_LANES], [f32::INFINITY; MAX_LANES]],
            has_face: [0.0; MAX_LANES],
        };
        for l in 0..width * height {
            if let Some(kept) = self.pixel((x + l % width, y + l / width)).get(rank) {
                let l = l as usize;
                (lanes.begin[l], lanes.end[l]) = (kept.begin, kept.end);
                if let Some(face) = kept.face {
                    lanes.face[0][l] = face.terms.0;
                    lanes.face[1][l] = face.terms.1;
                    lanes.face[2][l] = face.depth_per_step;
                    lanes.has_face[l] = 1.0;
                }
            }
        }
        lanes
    }
}
