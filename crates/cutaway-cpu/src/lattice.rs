//! Lattices: images of which only every so many pixels are cast, and what is between them.
//!
//! Lattice pixel `(i, j)` is pixel `(i, j) * spacing` of the image. A lattice reaches beyond the image's right and lower
//! border, so that every pixel lies in a cell with four corners. Colours between the corners are bilinear, and so are
//! depths, where all four are finite and the mode's depths are continuous; elsewhere a pixel has the depth of the nearest
//! corner, for no surface is halfway between two.

use cutaway_core::scene::Mode;
use rayon::prelude::*;

use crate::tiles::Raster;

/// How depths are filled in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DepthFill {
    Bilinear,
    /// Where an extremum lies jumps from ray to ray: a depth between two is the depth of nothing.
    Nearest,
}

impl DepthFill {
    pub(crate) fn of(mode: Mode) -> Self {
        match mode {
            Mode::Mip | Mode::Minip => Self::Nearest,
            Mode::Composite | Mode::Iso | Mode::Mean => Self::Bilinear,
        }
    }
}

/// A lattice of cast pixels.
#[derive(Clone, Debug)]
pub(crate) struct Lattice {
    pub(crate) spacing: u32,
    pub(crate) raster: Raster,
}

impl Lattice {
    /// Columns and rows of the lattice of an image; those of the image itself for a spacing of 1.
    pub(crate) fn dimensions((width, height): (u32, u32), spacing: u32) -> (u32, u32) {
        match spacing {
            1 => (width, height),
            _ => ((width - 1) / spacing + 2, (height - 1) / spacing + 2),
        }
    }

    /// The four corners of a cell, `[[top left, top right], [bottom left, bottom right]]`, as indices of the raster.
    #[inline]
    pub(crate) fn corners(&self, i: u32, j: u32) -> [usize; 4] {
        let width = self.raster.width as usize;
        let first = j as usize * width + i as usize;
        [first, first + 1, first + width, first + width + 1]
    }

    /// What this lattice makes of a finer one (or of the image itself, for a spacing of 1) of `dimensions`. The finer
    /// spacing divides this one.
    pub(crate) fn filled(&self, dimensions: (u32, u32), spacing: u32, depths: DepthFill) -> Raster {
        let mut fine = Raster::new(dimensions);
        if self.spacing == spacing {
            fine.clone_from(&self.raster);
            return fine;
        }
        let width = fine.width as usize;
        let rows = fine.colors.par_chunks_mut(width).zip(fine.depths.par_chunks_mut(width));
        rows.enumerate().for_each(|(y, (colors, row_of_depths))| {
            let (j, v) = self.cell_of(y as u32 * spacing, self.raster.height);
            for (x, (color, depth)) in colors.iter_mut().zip(row_of_depths).enumerate() {
                let (i, u) = self.cell_of(x as u32 * spacing, self.raster.width);
                let corners = self.corners(i, j);
                *color = bilinear(corners.map(|c| self.raster.colors[c]), u, v);
                *depth = blended_depth(corners.map(|c| self.raster.depths[c]), u, v, depths);
            }
        });
        fine
    }

    /// The cell of a pixel along an axis with so many lattice pixels, and where in it the pixel lies, 0..=1.
    #[inline]
    fn cell_of(&self, pixel: u32, count: u32) -> (u32, f32) {
        let cell = (pixel / self.spacing).min(count - 2);
        (cell, (pixel - cell * self.spacing) as f32 / self.spacing as f32)
    }
}

/// From `a` to `b`; exactly `a` where both are equal.
#[inline(always)]
pub(crate) fn mix(a: [f32; 4], b: [f32; 4], share: f32) -> [f32; 4] {
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share)
}

#[inline]
fn bilinear([a, b, c, d]: [[f32; 4]; 4], u: f32, v: f32) -> [f32; 4] {
    mix(mix(a, b, u), mix(c, d, u), v)
}

/// The depth between four corners.
#[inline]
pub(crate) fn blended_depth(corners: [f32; 4], u: f32, v: f32, how: DepthFill) -> f32 {
    let [a, b, c, d] = corners;
    if how == DepthFill::Bilinear && corners.iter().all(|d| d.is_finite()) {
        let (top, bottom) = (a + (b - a) * u, c + (d - c) * u);
        return top + (bottom - top) * v;
    }
    corners[usize::from(u > 0.5) + 2 * usize::from(v > 0.5)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_of_a_plane_fills_the_plane() {
        for (size, spacing, finer) in [((1, 1), 4, 2), ((67, 45), 4, 1), ((64, 33), 8, 2), ((512, 7), 32, 1)]
        {
            let value = |x: u32, y: u32| 0.25 * x as f32 - 0.5 * y as f32;
            let mut raster = Raster::new(Lattice::dimensions(size, spacing));
            for j in 0..raster.height {
                for i in 0..raster.width {
                    let at = (j * raster.width + i) as usize;
                    raster.colors[at] = [value(i * spacing, j * spacing); 4];
                    raster.depths[at] = 3.0 + value(i * spacing, j * spacing);
                }
            }
            let lattice = Lattice { spacing, raster };
            let fine = lattice.filled(Lattice::dimensions(size, finer), finer, DepthFill::Bilinear);
            for y in 0..fine.height {
                for x in 0..fine.width {
                    let at = (y * fine.width + x) as usize;
                    assert_eq!(fine.colors[at], [value(x * finer, y * finer); 4]);
                    assert_eq!(fine.depths[at], 3.0 + value(x * finer, y * finer));
                }
            }
        }
    }

    #[test]
    fn no_depth_lies_between_something_and_nothing() {
        let nothing = f32::INFINITY;
        let corners = [2.0, nothing, 4.0, nothing];
        assert_eq!(blended_depth(corners, 0.25, 0.5, DepthFill::Bilinear), 2.0);
        assert_eq!(blended_depth(corners, 0.75, 0.5, DepthFill::Bilinear), nothing);
        assert_eq!(blended_depth([1.0, 2.0, 3.0, 4.0], 0.75, 0.75, DepthFill::Nearest), 4.0);
        assert_eq!(blended_depth([1.0, 2.0, 3.0, 4.0], 0.5, 0.5, DepthFill::Bilinear), 2.5);
    }
}
