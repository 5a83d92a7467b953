//! Casting: three kernels, one for each way a ray turns values into a colour.
//!
//! [`composite`] accumulates colour and opacity, [`projection`] keeps the maximum, minimum or mean, [`isosurface`]
//! finds exact crossings. The first two take a packet at a time, the last a ray; each writes its pixels into a tile.

mod composite;
mod isosurface;
mod kernel;
mod projection;
mod refined;
mod shading;

use cutaway_core::scene::Mode;
use cutaway_core::with_voxels;
use fearless_simd::{Level, Simd};

use crate::bundle::{BUNDLE, Bundle};
use crate::clipping::TileClip;
use crate::rays::Frame;
use crate::sample::{Grid, LaneVoxel};
use crate::simd::{LaneWork, dispatch};
use crate::tiles::{TILE, Tile};
use composite::{Caster, StretchCaster};
pub(crate) use kernel::Kernel;
use kernel::Place;
use refined::Refined;
pub(crate) use shading::Shading;

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
