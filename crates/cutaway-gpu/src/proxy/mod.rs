//! Proxy geometry: rays begin and end where something can be visible (Termeer 4.2.4 with figure 4.8; Haferburg,
//! "Object-order empty space skipping").
//!
//! Enters: the occupancy of a classification, on the device. Leaves: for each pixel the nearest and the farthest distance at
//! which its ray meets a cell that can be visible. In between the ray caster crosses empty blocks one by one, so a proxy
//! changes how much is done, never the image: samples lie where they would lie without it.
//!
//! | object | made | when |
//! |---|---|---|
//! | `ProxyGeometry` | boxes of cells, then quads and the arguments of their draw, on the device | once an occupancy and flavour |
//! | range targets | distances a pixel | for another size |
//! | a pass over the quads | nearest, farthest | each frame |
//!
//! **No visible sample is lost**, for every stretch found is a little too long:
//! - Quads are moved outward by a *margin* of an eighth of a pixel (at the far end of the volume) and a hundredth of a voxel.
//!   Rasterisers snap vertices to a 16th of a pixel or better, so a pixel whose ray passes through a cell lies safely inside
//!   the outline of what is drawn for it.
//! - What is drawn is closed: faces that meet share their corners, computed from the same numbers, so that the rules of
//!   rasterisation leave no pixel between them. Glued boxes move their corners together (see `corner_code` in cells.wgsl);
//!   where that cannot be outward for all faces, the cell's box is drawn besides.
//! - Distances are those of the points that were drawn, at which a closed surface is entered or left in the snapped image
//!   too, and are then widened by a *slack*, a hundredth of a voxel, which covers the rounding of f32.
//! - Faces behind the eye are not drawn. A ray that begins inside leaves one solid more than it enters; counted as +1 for a
//!   back face and -1 for a front face, whatever overlaps, that tells inside from outside. (Haferburg's test, whether the
//!   closest back face is nearer than the closest front face, holds for disjoint solids only; these overlap by the margin.)
//!
//! Which flavour `auto` takes was measured; see `Flavour::automatic`.

mod geometry;
mod pipelines;
mod ranges;
mod uniforms;
mod wireframe;

use crate::shaders::{Shader, shader};
use cutaway_core::scene::{Mode, Scene, SpaceSkipping};

pub use geometry::ProxyCounts;
pub(crate) use geometry::ProxyGeometry;
pub(crate) use pipelines::ProxyPipelines;
pub(crate) use ranges::{RangeInputs, RangeTargets};
pub(crate) use uniforms::ProxyViewUniforms;
#[cfg(test)]
pub(crate) use uniforms::{BuildUniforms, LimitsUniforms};
pub(crate) use wireframe::draw as draw_wireframe;

/// The linked shaders.
pub(crate) const CELLS_SHADER: Shader = shader!(proxy::cells);
pub(crate) const VIEW_SHADER: Shader = shader!(proxy::view);
pub(crate) const RANGE_SHADER: Shader = shader!(proxy::range);

/// How proxies are made and used. The default is right for rendering; the rest is for measurements and tests.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProxyOptions {
    /// Fine blocks of occupancy along an edge of a proxy cell; none: what was measured to be best.
    pub cell_blocks: Option<u32>,
    /// Quads at most, if that is less than `(6 + 10) n²`; with more, the box of all cells is drawn.
    pub most_quads: Option<u32>,
    /// Whether rays skip empty blocks between the two ends that the proxy gives them.
    pub image_order: bool,
}

impl Default for ProxyOptions {
    fn default() -> Self {
        Self { cell_blocks: None, most_quads: None, image_order: true }
    }
}

/// What the quads of a proxy are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Flavour {
    /// Boxes shrink to what is occupied in their cells.
    pub(crate) fitted: bool,
    /// Faces that two boxes share are left out.
    pub(crate) glued: bool,
    /// Cells amid occupied ones are left out.
    pub(crate) boundary: bool,
}

impl Flavour {
    /// The flavour of a scene; none: rays begin at the volume's box.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        // Of projections every value counts.
        if !matches!(scene.settings().mode, Mode::Composite | Mode::Iso) {
            return None;
        }
        let (fitted, glued, boundary) = match scene.settings().space_skipping {
            SpaceSkipping::Off => return None,
            SpaceSkipping::Auto => return Self::automatic(),
            SpaceSkipping::Cells => (false, false, false),
            SpaceSkipping::Fitted => (true, false, false),
            SpaceSkipping::Boundary => (false, false, true),
            SpaceSkipping::Contour => (false, true, false),
            SpaceSkipping::FittedContour => (true, true, false),
        };
        Some(Self { fitted, glued, boundary })
    }

    /// What `auto` takes: no proxy, for crossing empty blocks along the rays does as well without the passes over quads.
    ///
    /// Measured on a software adapter (llvmpipe on two cores, both busy with other work: processor time a frame, so that
    /// only the ratios mean something) with bonsai, 512 x 512, shaded composite at half a voxel: from the box 2470 ms; blocks
    /// skipped 245 ms; that and a contour of 8-voxel cells 258 ms, of 16-voxel cells 248 ms, boundary cells 280 ms and
    /// 268 ms, fitted 32-voxel cells 278 ms. Samples are the same in all but the first, 2.9 million of 47 million. Of foot,
    /// in that order: 2180, 362, 358, 373, 392, 357 and 365 ms. Isosurfaces of bonsai: 5830, 903, 770, 737, 763, 825 and
    /// 955 ms, with the same samples too: what differs between the last six is within what such times scatter. On
    /// adapters where a step from block to block costs more than a fragment of a quad, `contour` can win: to be measured.
    fn automatic() -> Option<Self> {
        None
    }
}
