//! Casting: three kernels, one for each way a ray turns values into a colour.
//!
//! [`composite`] accumulates colour and opacity, [`projection`] keeps the maximum, minimum or mean, [`isosurface`]
//! finds exact crossings. The first two take a packet at a time, the last a ray; each writes its pixels into a tile.

mod composite;
mod isosurface;
mod projection;
mod shading;

use cutaway_core::scene::{Mode, Scene};
use cutaway_core::with_voxels;
use fearless_simd::{Level, Simd};

use crate::classification::Classification;
use crate::packet::{Packet, packet_shape};
use crate::renderer::CpuVolume;
use crate::sample::{Grid, LaneVoxel};
use crate::simd::{LaneWork, dispatch};
use crate::tiles::{Frame, TILE, Tile};
use shading::Shading;

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
            dispatch(level, TilePackets { kernel, frame, grid, tile: &mut tile });
        });
    }
    tile
}

/// A tile that is cast packet by packet.
struct TilePackets<'a, T> {
    kernel: &'a Kernel<'a>,
    frame: &'a Frame<'a>,
    grid: Grid<'a, T>,
    tile: &'a mut Tile,
}

impl<T: LaneVoxel> LaneWork for TilePackets<'_, T> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { kernel, frame, grid, tile } = self;
        let (width, height) = packet_shape(Packet::<S>::LANES);
        for y in (0..TILE.min(frame.height - tile.y)).step_by(height as usize) {
            for x in (0..TILE.min(frame.width - tile.x)).step_by(width as usize) {
                let packet = Packet::<S>::new(simd, frame, tile.x + x, tile.y + y);
                for lane in packet.lanes.iter().filter(|l| l.total > 0.0) {
                    tile.rays += 1;
                    tile.samples_without_skipping += lane.total.ceil() as u64;
                }
                let out = (y * TILE + x) as usize;
                if kernel.scene.settings().mode == Mode::Composite {
                    composite::packet(simd, kernel, frame, grid, &packet, tile, out);
                } else {
                    projection::packet(simd, kernel, frame, grid, &packet, tile, out);
                }
            }
        }
    }
}

/// The index in a tile of lane `l` of a packet whose first pixel is `out`.
#[inline(always)]
fn pixel_of_lane<S: Simd>(out: usize, l: usize) -> usize {
    let (width, height) = packet_shape(Packet::<S>::LANES);
    out + l % width as usize + (l / width as usize % height as usize) * TILE as usize
}
