//! Casting: three kernels, one for each way a ray turns values into a colour.
//!
//! [`composite`] accumulates colour and opacity, [`projection`] keeps the maximum, minimum or mean, [`isosurface`]
//! finds exact crossings. The first two take a packet at a time, the last a ray; each writes its pixels into a tile.

pub(crate) mod ceiling;
mod composite;
mod isosurface;
mod projection;
mod shading;

use cutaway_core::scene::{Mode, Scene};
use cutaway_core::with_voxels;
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd};

use crate::bundle::{BUNDLE, Bundle};
use crate::classification::Classification;
use crate::packet::{Packet, packet_shape};
use crate::rays::Frame;
use crate::renderer::CpuVolume;
use crate::sample::{Grid, LaneVoxel};
use crate::simd::{LaneWork, dispatch};
use crate::tiles::{TILE, Tile};
pub(crate) use shading::Shading;

/// Everything that the kernels need of a scene.
pub(crate) struct Kernel<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) volume: &'a CpuVolume,
    pub(crate) classification: &'a Classification,
    /// Light, where the scene is shaded.
    shading: Option<Shading>,
    /// Transmittance below which a ray ends.
    opaque_below: f32,
}

impl<'a> Kernel<'a> {
    pub(crate) fn new(
        volume: &'a CpuVolume,
        classification: &'a Classification,
        scene: &'a Scene<'a>,
    ) -> Self {
        let shading = scene.is_shaded().then(|| Shading::new(scene));
        let opaque_below = (1.0 - scene.settings().early_termination) as f32;
        Self { scene, volume, classification, shading, opaque_below }
    }
}

/// Casts the tile whose top left pixel is `(x, y)`.
pub(crate) fn tile(level: Level, kernel: &Kernel, frame: &Frame, x: u32, y: u32) -> Tile {
    let mut tile = Tile::new(x, y);
    if kernel.scene.settings().mode == Mode::Iso {
        isosurface::tile(kernel, frame, &mut tile);
    } else {
        with_voxels!(frame.volume.voxels(), voxels => {
            let grid = Grid::new(frame.volume, voxels);
            dispatch(level, TileBundles { kernel, frame, grid, tile: &mut tile });
        });
    }
    tile
}

/// A tile that is cast bundle by bundle.
struct TileBundles<'a, T> {
    kernel: &'a Kernel<'a>,
    frame: &'a Frame<'a>,
    grid: Grid<'a, T>,
    tile: &'a mut Tile,
}

impl<T: LaneVoxel> LaneWork for TileBundles<'_, T> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { kernel, frame, grid, tile } = self;
        let (width, height) = (TILE.min(frame.width - tile.x), TILE.min(frame.height - tile.y));
        let corners = (0..height)
            .step_by(BUNDLE as usize)
            .flat_map(|y| (0..width).step_by(BUNDLE as usize).map(move |x| (x, y)));
        if kernel.scene.settings().mode == Mode::Composite {
            let mut bundle = Bundle::<S, _>::new();
            for (x, y) in corners {
                let at = (tile.x + x, tile.y + y);
                composite::bundle(simd, kernel, frame, grid, &mut bundle, at, tile);
                count_rays(&bundle, tile);
            }
        } else {
            let mut bundle = Bundle::<S, _>::new();
            for (x, y) in corners {
                let at = (tile.x + x, tile.y + y);
                projection::bundle(simd, kernel, frame, grid, &mut bundle, at, tile);
                count_rays(&bundle, tile);
            }
        }
    }
}

#[inline(always)]
fn count_rays<S: Simd, T>(bundle: &Bundle<S, T>, tile: &mut Tile) {
    for member in &bundle.members {
        let packet = &member.packet;
        tile.rays += u64::from(packet.hits().to_bitmask().count_ones());
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
