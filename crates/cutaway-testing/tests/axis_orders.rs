//! One object, stored in each of the 48 ways in which voxel axes can lie along world axes: one picture.

use cutaway_core::glam::{DAffine3, DMat3, DVec3, UVec3};
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene, default_camera};
use cutaway_core::space::{WorldFrame, orientation_letters};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_cpu::SimdChoice;
use cutaway_testing::engines::cpu;
use cutaway_testing::scenes::{SMALL, soft};
use cutaway_testing::tolerances::{Tolerance, assert_close};

/// Voxels along world x, y, z, and their spacing: all different, so that no two orders can be confused.
const SIZE: [u32; 3] = [13, 17, 21];
const SPACING: [f64; 3] = [1.5, 1.0, 0.8];

/// A field without any symmetry, as 8-bit voxels.
fn value(world: [u32; 3]) -> u8 {
    let [x, y, z] = world.map(f64::from);
    let ball = |c: [f64; 3], r: f64| (1.0 - DVec3::new(x - c[0], y - c[1], z - c[2]).length() / r).max(0.0);
    let sum =
        ball([4.0, 5.0, 6.0], 5.0) + 0.8 * ball([9.0, 11.0, 9.0], 4.0) + 0.6 * ball([5.0, 12.0, 16.0], 4.0);
    (sum.min(1.0) * 255.0) as u8
}

/// The object with voxel axis `a` along world axis `order[a]`, backwards where `flip[a]`.
fn stored(order: [usize; 3], flip: [bool; 3]) -> Volume {
    let dimensions = UVec3::from_array(order.map(|w| SIZE[w]));
    let mut voxels = Vec::new();
    for k in 0..dimensions.z {
        for j in 0..dimensions.y {
            for i in 0..dimensions.x {
                let mut world = [0; 3];
                for (a, v) in [i, j, k].into_iter().enumerate() {
                    world[order[a]] = if flip[a] { SIZE[order[a]] - 1 - v } else { v };
                }
                voxels.push(value(world));
            }
        }
    }
    let mut columns = [DVec3::ZERO; 3];
    let mut translation = DVec3::ZERO;
    for a in 0..3 {
        let w = order[a];
        columns[a][w] = if flip[a] { -SPACING[w] } else { SPACING[w] };
        translation[w] = if flip[a] { SPACING[w] * f64::from(SIZE[w] - 1) } else { 0.0 };
    }
    let matrix3 = DMat3::from_cols(columns[0], columns[1], columns[2]);
    let geometry = Geometry { world_from_voxel: DAffine3 { matrix3, translation }, frame: WorldFrame::Ras };
    Volume::new(dimensions, voxels, Rescale::IDENTITY, geometry).unwrap()
}

#[test]
fn every_axis_order_gives_the_same_picture_and_its_own_letters() {
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut seen = std::collections::HashSet::new();
    for mode in [Mode::Composite, Mode::Mip] {
        let mut expected = None;
        for order in orders {
            for bits in 0..8 {
                let flip = [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0];
                let volume = stored(order, flip);
                let letters = orientation_letters(volume.world_from_voxel());
                let ends = [['R', 'L'], ['A', 'P'], ['S', 'I']];
                assert_eq!(letters, [0, 1, 2].map(|a| ends[order[a]][usize::from(flip[a])]));
                seen.insert(letters);
                let settings = RenderSettings { mode, resolution: SMALL, ..RenderSettings::default() };
                let camera = default_camera(&volume, f64::from(SMALL[0]) / f64::from(SMALL[1]));
                let function = soft([0.0, 255.0]);
                let scene = Scene::new(Layer::new(volume.clone(), &function), camera, settings).unwrap();
                let image = cpu(&scene, SimdChoice::Auto, 0).0;
                // Rounding alone; a sample may fall to the next entry of the classification table.
                let tolerance = Tolerance { rmse: 2e-4, bias: 5e-5, outliers: 0.0 };
                let expected = expected.get_or_insert_with(|| image.clone());
                assert_close(&format!("{letters:?} {}", mode.name()), expected, &image, tolerance);
            }
        }
    }
    assert_eq!(seen.len(), 48);
}
