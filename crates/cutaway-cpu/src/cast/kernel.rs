//! What the casting kernels share: a scene made ready, places of bundles, and the way into a tile.

use cutaway_core::scene::{Layout, Scene};
use cutaway_core::volume::Voxels;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::shading::{self, Shading};
use crate::bundle::Bundle;
use crate::classification::Classification;
use crate::clipping::{ClipFrame, TileClip};
use crate::packet::{Packet, packet_shape};
use crate::prepared::CpuVolume;
use crate::tiles::{TILE, Tile};

/// Everything that the kernels need of a scene.
pub(crate) struct Kernel<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) volume: &'a CpuVolume,
    pub(crate) classification: &'a Classification,
    /// Light, where the scene is shaded.
    pub(super) shading: Option<Shading>,
    /// Transmittance below which a ray ends.
    pub(super) opaque_below: f32,
    /// What is kept of rays, where the scene is clipped.
    pub(super) clip: Option<ClipFrame<'a>>,
    /// The voxels in bricks, where the scene asks for them.
    pub(super) bricks: Option<&'a Voxels>,
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
    pub(super) fn light<S: Simd>(&self, simd: S, packet: &Packet<S>) -> Option<PacketLight<'_, S>> {
        let shading = self.shading.as_ref()?;
        Some((shading, shading.packet_light(simd, packet)))
    }
}

/// A scene's light, and what of it a packet sees.
pub(super) type PacketLight<'a, S> = (&'a Shading, shading::PacketLight<S>);

/// A bundle's place in the frame, and what is kept of the tile's rays.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) at: (u32, u32),
    pub(super) clip: Option<&'a TileClip>,
}

/// Counts the rays of a bundle, if these are not further pieces of rays that were counted, and their samples.
#[inline(always)]
pub(super) fn count_rays<S: Simd, T>(bundle: &Bundle<S, T>, tile: &mut Tile, first: bool) {
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
pub(super) fn pixel_of_lane<S: Simd>(tile: &Tile, (x, y): (u32, u32), l: usize) -> usize {
    let (width, height) = packet_shape(Packet::<S>::LANES);
    let first = ((y - tile.y) * TILE + x - tile.x) as usize;
    first + l % width as usize + (l / width as usize % height as usize) * TILE as usize
}
