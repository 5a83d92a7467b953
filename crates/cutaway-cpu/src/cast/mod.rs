//! Casting: three kernels, one for each way a ray turns values into a colour.
//!
//! [`composite`] accumulates colour and opacity, [`projection`] keeps the maximum, minimum or mean, [`isosurface`]
//! finds exact crossings. The first two take a packet at a time, the last a ray; each writes its pixels into a tile.

pub(crate) mod ceiling;
mod composite;
mod isosurface;
mod projection;
mod refined;
mod shading;

use cutaway_core::scene::{Layout, Mode, Scene};
use cutaway_core::volume::Voxels;
use cutaway_core::with_voxels;
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd};

use crate::bundle::{BUNDLE, Bundle};
use crate::classification::Classification;
use crate::clipping::{ClipFrame, TileClip};
use crate::packet::{Packet, packet_shape};
use crate::rays::Frame;
use crate::renderer::CpuVolume;
use crate::sample::{Grid, LaneVoxel};
use crate::simd::{LaneWork, dispatch};
use crate::tiles::{TILE, Tile};
use composite::{Caster, StretchCaster};
use refined::Refined;
pub(crate) use shading::Shading;

/// Everything that the kernels need of a scene.
pub(crate) struct Kernel<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) volume: &'a CpuVolume,
    pub(crate) classification: &'a Classification,
    /// Light, where the scene is shaded.
    shading: Option<Shading>,
    /// Transmittance below which a ray ends.
    opaque_below: f32,
    /// What is kept of rays, where the scene is clipped.
    clip: Option<ClipFrame<'a>>,
    /// The voxels in bricks, where the scene asks for them.
    bricks: Option<&'a Voxels>,
}

impl<'a> Kernel<'a> {
    pub(crate) fn new(volume: &'a CpuVolume, classification: &'a Classification, scene: &'a Scene) -> Self {
        let shading = scene.is_shaded().then(|| Shading::new(scene));
        let opaque_below = (1.0 - scene.settings().early_termination) as f32;
        let bricks = match scene.settings().layout {
            Layout::Linear => None,
            Layout::Bricks => volume.bricks(scene.volume()),
        };
        Self { scene, volume, classification, shading, opaque_below, clip: ClipFrame::new(scene), bricks }
    }

    /// The light of a packet, where the scene is shaded.
    #[inline(always)]
    fn light<S: Simd>(&self, simd: S, packet: &Packet<S>) -> Option<PacketLight<'_, S>> {
        let shading = self.shading.as_ref()?;
        Some((shading, shading.packet_light(simd, packet)))
    }
}

/// A scene's light, and what of it a packet sees.
type PacketLight<'a, S> = (&'a Shading, shading::PacketLight<S>);

/// Casts a tile that nothing was cast into so far.
pub(crate) fn tile(level: Level, kernel: &Kernel, frame: &Frame, tile: &mut Tile) {
    let clip = kernel.clip.as_ref().map(|clip| clip.tile(frame, tile));
    tile.repaired = clip.as_ref().map_or(0, |clip| clip.repaired);
    let clip = clip.as_ref();
    if kernel.scene.settings().mode == Mode::Iso {
        isosurface::tile(kernel, frame, clip, tile);
    } else {
        match kernel.bricks {
            Some(bricks) => with_voxels!(bricks, voxels => {
                let grid = Grid::bricked(frame.volume, voxels);
                dispatch(level, TileBundles { kernel, frame, grid, clip, tile });
            }),
            None => with_voxels!(frame.volume.voxels(), voxels => {
                let grid = Grid::new(frame.volume, voxels);
                dispatch(level, TileBundles { kernel, frame, grid, clip, tile });
            }),
        }
    }
}

/// A tile that is cast bundle by bundle.
struct TileBundles<'a, T> {
    kernel: &'a Kernel<'a>,
    frame: &'a Frame<'a>,
    grid: Grid<'a, T>,
    clip: Option<&'a TileClip>,
    tile: &'a mut Tile,
}

impl<T: LaneVoxel> LaneWork for TileBundles<'_, T> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { kernel, frame, grid, clip, tile } = self;
        let (width, height) = (TILE.min(frame.width - tile.x), TILE.min(frame.height - tile.y));
        let corners = (0..height)
            .step_by(BUNDLE as usize)
            .flat_map(|y| (0..width).step_by(BUNDLE as usize).map(move |x| (x, y)));
        let (left, top) = (tile.x, tile.y);
        let corners = corners.filter(|&(x, y)| frame.wants((left + x, top + y), (BUNDLE, BUNDLE)));
        if kernel.scene.settings().mode != Mode::Composite {
            let mut bundle = Bundle::<S, _>::new();
            for (x, y) in corners {
                let at = (tile.x + x, tile.y + y);
                projection::bundle(simd, kernel, frame, grid, &mut bundle, Place { at, clip }, tile);
            }
        } else if refined::wanted(kernel) {
            composites(simd, kernel, frame, &Refined::new(kernel, grid), corners, clip, tile);
        } else {
            composites(simd, kernel, frame, &Caster::new(kernel, grid), corners, clip, tile);
        }
    }
}

/// A bundle's place in the frame, and what is kept of the tile's rays.
#[derive(Clone, Copy)]
struct Place<'a> {
    at: (u32, u32),
    clip: Option<&'a TileClip>,
}

#[inline(always)]
fn composites<S: Simd>(
    simd: S,
    kernel: &Kernel,
    frame: &Frame,
    caster: &impl StretchCaster,
    corners: impl Iterator<Item = (u32, u32)>,
    clip: Option<&TileClip>,
    tile: &mut Tile,
) {
    let mut bundle = Bundle::new();
    for (x, y) in corners {
        let at = (tile.x + x, tile.y + y);
        composite::bundle(simd, kernel, frame, caster, &mut bundle, Place { at, clip }, tile);
    }
}

/// Counts the rays of a bundle, if these are not further pieces of rays that were counted, and their samples.
#[inline(always)]
fn count_rays<S: Simd, T>(bundle: &Bundle<S, T>, tile: &mut Tile, first: bool) {
    for member in &bundle.members {
        let packet = &member.packet;
        if first {
            tile.rays += u64::from(packet.hits().to_bitmask().count_ones());
        }
        let samples = (packet.end - packet.first).ceil();
        tile.samples_without_skipping += samples.as_slice().iter().sum::<f32>() as u64;
    }
}

/// The index in a tile of lane `l` of a packet whose first pixel in the image is `(x, y)`.
#[inline(always)]
fn pixel_of_lane<S: Simd>(tile: &Tile, (x, y): (u32, u32), l: usize) -> usize {
    let (width, height) = packet_shape(Packet::<S>::LANES);
    let first = ((y - tile.y) * TILE + x - tile.x) as usize;
    first + l % width as usize + (l / width as usize % height as usize) * TILE as usize
}
