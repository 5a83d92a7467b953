//! Directions of the gradient, computed once a volume: what the `precomputed` gradient setting reads.
//!
//! One 32-bit word a voxel, ten bits a component of the unit vector in voxel space; all bits zero where the gradient
//! vanishes. Twice the memory of 16-bit voxels. Directions, not gradients, are interpolated, so the length that weighs
//! neighbours is lost: as other renderers do, and less exact than gradients on the fly.

use cutaway_core::field::vanishing_gradient;
use cutaway_core::glam::Vec3;
use cutaway_core::volume::Volume;
use cutaway_core::with_voxels;
use rayon::prelude::*;

/// Steps from the middle of a ten-bit component to its ends.
pub(crate) const SCALE: f32 = 511.0;

/// The middle of a ten-bit component: zero.
pub(crate) const MIDDLE: u32 = 512;

/// One word a voxel, x fastest.
pub(crate) fn normals(volume: &Volume) -> Vec<u32> {
    let [nx, ny, nz] = volume.dimensions().to_array().map(|n| n as usize);
    let vanishing = (vanishing_gradient(volume) * volume.spacing().min_element()
        / volume.rescale().slope.abs().max(f64::MIN_POSITIVE)) as f32;
    let mut words = vec![0u32; nx * ny * nz];
    with_voxels!(volume.voxels(), voxels => fill(&mut words, voxels, [nx, ny, nz], vanishing));
    words
}

fn fill<T: Copy + Into<f32> + Sync>(words: &mut [u32], voxels: &[T], n: [usize; 3], vanishing: f32) {
    let [nx, ny, nz] = n;
    let at = |x: usize, y: usize, z: usize| -> f32 { voxels[(z * ny + y) * nx + x].into() };
    words.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
        let (y, z) = (row % ny, row / ny);
        for (x, word) in out.iter_mut().enumerate() {
            let gradient = Vec3::new(
                at((x + 1).min(nx - 1), y, z) - at(x.saturating_sub(1), y, z),
                at(x, (y + 1).min(ny - 1), z) - at(x, y.saturating_sub(1), z),
                at(x, y, (z + 1).min(nz - 1)) - at(x, y, z.saturating_sub(1)),
            ) * 0.5;
            *word = pack(gradient, vanishing);
        }
    });
}

fn pack(gradient: Vec3, vanishing: f32) -> u32 {
    if gradient.length() <= vanishing {
        return 0;
    }
    let component = |v: f32| ((v * SCALE).round() + MIDDLE as f32) as u32;
    let unit = gradient.normalize();
    component(unit.x) | component(unit.y) << 10 | component(unit.z) << 20
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_survive_packing_to_a_thousandth() {
        for v in [Vec3::X, Vec3::new(-3.0, 4.0, 0.5), Vec3::new(0.01, -0.02, -0.03)] {
            let word = pack(v, 1e-6);
            let component = |shift: u32| ((word >> shift & 1023) as f32 - MIDDLE as f32) / SCALE;
            let unpacked = Vec3::new(component(0), component(10), component(20));
            assert!(unpacked.distance(v.normalize()) < 2e-3, "{v} became {unpacked}");
        }
        assert_eq!(pack(Vec3::ZERO, 0.0), 0);
    }
}
