//! A synthetic angiography of a head: a tree of vessels in noisy tissue, the same every time.

use glam::{DVec3, UVec3};

use crate::volume::{Geometry, Rescale, Volume};

/// The greatest value, as of scanners with twelve bits.
pub const ANGIOGRAPHY_WHITE: f32 = 4095.0;

/// Voxels along x, y and z of [`angiography`], two at the least.
pub fn angiography_dimensions(size: u32) -> UVec3 {
    let deep = (u64::from(size) * 96 / 512) as u32;
    UVec3::new(size, size, deep).max(UVec3::splat(2))
}

/// Noisy tissue below a third of the range in an ellipsoid, with patches of denser tissue below a half, and in it a tree of
/// vessels up to the greatest value; 16 bits, spacings as of a scanner: as that of Rezk Salama and Kolb (2005), of 512 x 512 x 96
/// voxels where `size` is 512.
pub fn angiography(size: u32) -> Volume {
    let dimensions = angiography_dimensions(size);
    let mut random = Random(20_050_512);
    let size = dimensions.as_dvec3();
    let mut voxels = Vec::with_capacity(dimensions.element_product() as usize);
    for z in 0..dimensions.z {
        for y in 0..dimensions.y {
            for x in 0..dimensions.x {
                let p = (UVec3::new(x, y, z).as_dvec3() / (size - 1.0)) * 2.0 - 1.0;
                let inside = p.x * p.x + p.y * p.y < 0.85;
                let noise = random.next();
                let tissue = if inside { 0.16 + 0.12 * noise } else { 0.03 * noise };
                voxels.push((tissue * f64::from(ANGIOGRAPHY_WHITE)) as u16);
            }
        }
    }
    let mut canvas = Canvas { dimensions, voxels, scale: size.x / 512.0 };
    for _ in 0..40 {
        let middle = DVec3::new(random.signed() * 0.6, random.signed() * 0.6, random.signed() * 0.9);
        let middle = (middle * 0.5 + 0.5) * size;
        canvas.blob(middle, (8.0 + 10.0 * random.next()) * canvas.scale, 0.38 + 0.08 * random.next());
    }
    for trunk in 0..6 {
        let angle = f64::from(trunk) * 1.05;
        let foot = DVec3::new(0.5 + 0.16 * angle.cos(), 0.5 + 0.16 * angle.sin(), 0.02) * size;
        let way = DVec3::new(0.3 * random.signed(), 0.3 * random.signed(), 0.35);
        canvas.vessel(&mut random, foot, way, 4.5, 4);
    }
    let geometry = Geometry::from_spacing(DVec3::new(0.45, 0.45, 1.0));
    Volume::new(dimensions, canvas.voxels, Rescale::IDENTITY, geometry)
        .expect("as many voxels as the dimensions say")
}

/// Random numbers of 0 to 1 that are the same every time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn signed(&mut self) -> f64 {
        2.0 * self.next() - 1.0
    }
}

/// Voxels that vessels are painted into.
struct Canvas {
    dimensions: UVec3,
    voxels: Vec<u16>,
    /// Voxels along x of one of the full size.
    scale: f64,
}

impl Canvas {
    /// A ball of a radius in voxels along x, of a share of the greatest value, with an edge of a voxel's width.
    fn blob(&mut self, middle: DVec3, radius: f64, share: f64) {
        // Slices lie about twice as far apart as voxels within them.
        let stretch = DVec3::new(1.0, 1.0, 1.0 / 0.45);
        let reach = (radius + 1.0) / stretch;
        let last = self.dimensions.as_dvec3() - 1.0;
        let lo = (middle - reach).clamp(DVec3::ZERO, last).as_uvec3();
        let hi = (middle + reach).clamp(DVec3::ZERO, last).as_uvec3();
        for z in lo.z..=hi.z {
            for y in lo.y..=hi.y {
                for x in lo.x..=hi.x {
                    let away = ((UVec3::new(x, y, z).as_dvec3() - middle) * stretch).length();
                    let value =
                        (share * (radius + 0.5 - away).clamp(0.0, 1.0) * f64::from(ANGIOGRAPHY_WHITE)) as u16;
                    let d = self.dimensions;
                    let voxel = &mut self.voxels[((z * d.y + y) * d.x + x) as usize];
                    *voxel = value.max(*voxel);
                }
            }
        }
    }

    /// A vessel that winds, narrows and forks.
    fn vessel(&mut self, random: &mut Random, foot: DVec3, way: DVec3, radius: f64, forks: u32) {
        let (mut at, mut way) = (foot, way.normalize());
        let steps = (40.0 + 50.0 * random.next()) as u32;
        for step in 0..steps {
            let narrowed = radius * (1.0 - 0.35 * f64::from(step) / f64::from(steps));
            self.blob(at, narrowed * self.scale, 0.55 + 0.1 * radius.min(4.5));
            let turn = DVec3::new(random.signed(), random.signed(), random.signed());
            way = (way + 0.25 * turn).normalize();
            at += way * DVec3::new(1.0, 1.0, 0.45) * (narrowed * self.scale).max(0.7);
        }
        if forks > 0 {
            for _ in 0..2 {
                let turn = DVec3::new(random.signed(), random.signed(), random.signed());
                self.vessel(random, at, way + 0.8 * turn, 0.65 * radius, forks - 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_sparse_and_the_same_every_time() {
        let volume = angiography(128);
        assert_eq!(volume.dimensions(), UVec3::new(128, 128, 24));
        let count = volume.voxels().len();
        let above = |share: f32| {
            let level = share * ANGIOGRAPHY_WHITE;
            (0..count).filter(|i| volume.voxels().get(*i) > level).count() as f64 / count as f64
        };
        // Tissue is below a third; above a half there are vessels alone.
        let [third, half] = [1.0 / 3.0, 0.5].map(above);
        assert!(third < 0.1 && half < 0.5 * third && half > 0.001, "{third} {half}");
        let again = angiography(128);
        assert!((0..count).all(|i| volume.voxels().get(i) == again.voxels().get(i)));
    }

    #[test]
    fn the_smallest_has_a_cell() {
        assert_eq!(angiography(2).dimensions(), UVec3::splat(2));
    }
}
