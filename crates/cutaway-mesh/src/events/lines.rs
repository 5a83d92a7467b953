//! Finding the events of one line after another: what grid, octree and hierarchy share.
//!
//! Structures are built and walked in *unit space*, in which the mesh's bounding box is centred at 0 and its longest
//! side is 1. A structure only proposes triangles; [`Line::event`] decides. Proposals must therefore never miss one
//! that the decision takes: each structure grows its cells or boxes by more than what is rounded on the way.

use cutaway_core::clip::Event;
use cutaway_core::glam::DVec3;

use super::tile::by_position;
use super::watertight::Line;
use super::{EventFinder, bvh::Bvh, grid::Grid, octree::Octree};
use crate::TriangleMesh;

/// By how much cells are grown in unit space: far above what f64 rounds, far below a cell.
pub(super) const PADDING: f64 = 1e-6;

/// Half the diagonal of the unit cube, and what is rounded.
const REACH: f64 = 0.8661;

/// From mesh space (object space, relative to the mesh's origin) to unit space.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnitSpace {
    pub(super) center: DVec3,
    pub(super) scale: f64,
    /// Sides of the bounding box; the longest is 1, or 0 for a mesh that is a point.
    pub(super) extent: DVec3,
}

impl UnitSpace {
    /// `None` for a mesh without triangles.
    pub(super) fn of(mesh: &TriangleMesh) -> Option<Self> {
        let [low, high] = mesh.relative_bounds()?;
        let longest = (high - low).max_element();
        let scale = if longest > 0.0 { 1.0 / longest } else { 1.0 };
        Some(Self { center: (low + high) * 0.5, scale, extent: (high - low) * scale })
    }

    /// The corners of a triangle.
    pub(super) fn corners(&self, mesh: &TriangleMesh, triangle: usize) -> [DVec3; 3] {
        mesh.corners(triangle).map(|c| (c.as_dvec3() - self.center) * self.scale)
    }
}

/// What walking needs beside the structure; reused from line to line.
#[derive(Debug)]
pub(crate) struct LineScratch {
    /// Which triangles this line was tested against, as far as they fit: `stamp << 32 | triangle` at `triangle % 64`.
    mailbox: [u64; 64],
    stamp: u32,
    pub(super) stack: Vec<u32>,
}

impl Default for LineScratch {
    fn default() -> Self {
        Self { mailbox: [0; 64], stamp: 0, stack: Vec::new() }
    }
}

impl LineScratch {
    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>() + self.stack.capacity() * size_of::<u32>()
    }

    fn next_line(&mut self) {
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            self.mailbox = [0; 64];
            self.stamp = 1;
        }
    }
}

/// A structure over the triangles of a mesh.
#[derive(Debug)]
enum Structure {
    Grid(Grid),
    Octree(Octree),
    Bvh(Bvh),
}

/// Finds the events of single lines.
#[derive(Debug)]
pub(super) struct LineFinder {
    space: UnitSpace,
    structure: Structure,
}

impl LineFinder {
    /// `None` for a mesh without triangles. Rasterisation has no structure of its own; its single lines go through the
    /// hierarchy.
    pub(super) fn new(mesh: &TriangleMesh, finder: EventFinder) -> Option<Self> {
        let space = UnitSpace::of(mesh)?;
        let structure = match finder {
            EventFinder::Grid => Structure::Grid(Grid::new(mesh, &space)),
            EventFinder::Octree => Structure::Octree(Octree::new(mesh, &space)),
            EventFinder::Bvh | EventFinder::Raster => Structure::Bvh(Bvh::new(mesh, &space)),
        };
        Some(Self { space, structure })
    }

    pub(super) fn bytes(&self) -> usize {
        match &self.structure {
            Structure::Grid(grid) => grid.bytes(),
            Structure::Octree(octree) => octree.bytes(),
            Structure::Bvh(bvh) => bvh.bytes(),
        }
    }

    /// Appends the events of a line, sorted.
    pub(super) fn events(
        &self,
        mesh: &TriangleMesh,
        line: &Line,
        scratch: &mut LineScratch,
        events: &mut Vec<Event>,
    ) {
        let (point, direction) = line.near(self.space.center);
        let point = (point - self.space.center) * self.space.scale;
        // A NaN of overflowing lengths misses, too.
        if point.length_squared().partial_cmp(&(REACH * REACH)).is_none_or(|order| order.is_gt()) {
            return;
        }
        let start = events.len();
        match &self.structure {
            Structure::Bvh(bvh) => bvh.walk(point, direction, &mut scratch.stack, |triangle| {
                events.extend(line.event(mesh.corners(triangle as usize), triangle));
            }),
            Structure::Grid(grid) => {
                grid.walk(
                    point,
                    direction,
                    &mut once(scratch, |triangle| {
                        events.extend(line.event(mesh.corners(triangle as usize), triangle));
                    }),
                );
            }
            Structure::Octree(octree) => {
                octree.walk(
                    point,
                    direction,
                    &mut once(scratch, |triangle| {
                        events.extend(line.event(mesh.corners(triangle as usize), triangle));
                    }),
                );
            }
        }
        if events.len() - start > 1 {
            events[start..].sort_unstable_by(by_position);
            remove_doubles(events, start);
        }
    }
}

/// Passes a triangle on unless the mailbox knows it: cells share triangles.
fn once(scratch: &mut LineScratch, mut test: impl FnMut(u32)) -> impl FnMut(u32) {
    scratch.next_line();
    move |triangle| {
        let letter = u64::from(scratch.stamp) << 32 | u64::from(triangle);
        let slot = &mut scratch.mailbox[triangle as usize % 64];
        if *slot != letter {
            *slot = letter;
            test(triangle);
        }
    }
}

/// What the mailbox had forgotten comes twice, with the same `t`, hence side by side.
fn remove_doubles(events: &mut Vec<Event>, start: usize) {
    let mut kept = start + 1;
    for i in start + 1..events.len() {
        if events[i].surface != events[kept - 1].surface {
            events[kept] = events[i];
            kept += 1;
        }
    }
    events.truncate(kept);
}
