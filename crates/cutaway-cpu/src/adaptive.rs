//! Adaptive image interpolation: cast a coarse lattice of pixels, fill where they agree, cast the rest (Termeer 4.1.1).
//!
//! What enters: a frame and a kernel. What leaves: an image of which only a part of the pixels was cast.
//!
//! Every [`SPACING`]-th pixel along x and y is cast first. Where the corners of a cell differ by no more than
//! [`LARGEST_RANGE`], its middle is cast, too: there, what lies between the corners is *measured* against what they say.
//! A cell is filled if its middle is within [`LARGEST_ERROR`] of the mean of its corners (and its depth within
//! [`DEPTH_ERROR`]), if the middles of the cell and its eight neighbours are within [`MEAN_ERROR`] as a root mean square,
//! and if none of those neighbours is an edge, a cell whose cast pixels differ by more than [`LARGEST_RANGE`]: what one cell
//! sees, the next one may have missed. It is filled bilinearly plus a bubble that is the measured error in the middle and
//! nothing at the edges, within the range of its five cast pixels. All other cells are cast in full. A cell is 4 x 4 pixels,
//! one packet of 16 lanes, and pixels that are cast have the very bits that they have without interpolation.
//!
//! **Error.** Where the image keeps, within a cell, between the least and the greatest of the five cast pixels, a filled
//! pixel is off by at most [`LARGEST_RANGE`] in any channel. Over many cells the middles are a sample of what filling is off
//! by before the bubble mends it: their root mean square, kept to 1 % around every filled cell, estimates that of the filled
//! part of the image from above where the image is smooth, and as it is where it is noise. Measured over whole images it
//! is 0.001 to 0.005.
//!
//! **Cost.** Where nothing can be filled (light on noise: neighbouring pixels truly differ) the lattice and the middles are
//! cast for nothing: an eighth more rays, which lie wider apart and are dearer.
//!
//! **What can be missed** is what neither a corner nor a middle of the cell and of its neighbours sees: a dot, or a line
//! thinner than the distance of cast pixels, which is `4 / sqrt(2)`, 2.8 pixels. A line that ends or bends is seen by some
//! cell, and cast in that one and the eight around it. Before an empty background all are kept: a cell whose five
//! pixels are transparent is not filled but cast, which costs little, for rays through nothing leap.

use rayon::prelude::*;

use crate::cast::Kernel;
use crate::lattice::{DepthFill, Lattice, blended_depth, mix};
use crate::mask::Mask;
use crate::rays::Frame;
use crate::tiles::{Raster, TILE, Tile};

/// Pixels from one lattice pixel to the next; the edge of a cell.
pub(crate) const SPACING: u32 = 4;

/// Binary logarithm of [`SPACING`].
pub(crate) const SHIFT: u32 = SPACING.trailing_zeros();

/// The most by which the five cast pixels of a filled cell differ, in any premultiplied channel.
const LARGEST_RANGE: f32 = 0.25;

/// The most by which the middle of a filled cell is off from the mean of its corners, in any premultiplied channel: twice
/// what all are off by in the mean. A smooth cell is off most in its middle.
const LARGEST_ERROR: f32 = 0.02;

/// The most by which the middles of a cell and its neighbours are off, as a root mean square: the bound on that of the
/// image, taken where it can be measured.
const MEAN_ERROR: f32 = 0.01;

/// The most by which the depth of the middle of a filled cell is off from the mean of its corners, in voxels (of the
/// smallest spacing).
const DEPTH_ERROR: f32 = 2.0;

/// The share of the visible cells whose corners must agree for the others to be looked at: with fewer, hardly any has
/// eight neighbours that agree, too.
const LEAST_AGREEING: f64 = 0.25;

/// The cast pixels of a cell: four corners, and the middle.
struct Cell {
    corners: [[f32; 4]; 4],
    middle: [f32; 4],
    corner_depths: [f32; 4],
    middle_depth: f32,
}

/// The lattice of an image and the middles of its cells.
pub(crate) struct Cells {
    lattice: Lattice,
    /// One pixel a cell.
    middles: Raster,
    depths: DepthFill,
}

/// What is to become of a cell.
#[derive(Clone, Copy, PartialEq)]
enum Verdict {
    /// Filled, if its neighbours do not tell otherwise; by how much its middle is off from the mean of its corners.
    Fill(f32),
    /// Cast, for its middle is off by so much, or its depths are.
    Wrong(f32),
    /// All that was seen is transparent: cast, for it costs nothing.
    Empty,
    /// Cast, and so are its neighbours: something ends here, and may show in them, too.
    Edge,
}

/// Whether a cell and its neighbours, of which it is one, are to be believed: none is an edge, and all together are off by no
/// more than [`MEAN_ERROR`].
fn agree<'a>(near: impl Iterator<Item = &'a Verdict>) -> bool {
    let (mut squares, mut count) = (0.0, 0.0);
    for verdict in near {
        match verdict {
            Verdict::Edge => return false,
            Verdict::Empty => {}
            Verdict::Fill(error) | Verdict::Wrong(error) => {
                squares += error * error;
                count += 1.0;
            }
        }
    }
    squares <= MEAN_ERROR * MEAN_ERROR * count
}

/// Columns and rows of the cells of an image.
pub(crate) fn cells_of(frame: &Frame) -> (u32, u32) {
    (frame.width.div_ceil(SPACING), frame.height.div_ceil(SPACING))
}

/// The cells whose middle is worth casting: their corners agree. At the spacing of one pixel a cell. None where so few of
/// the cells that show anything agree that casting all of them is sooner done.
pub(crate) fn agreeing_corners(lattice: &Lattice, (columns, rows): (u32, u32)) -> Option<Mask> {
    let raster = &lattice.raster;
    let (mut visible, mut visible_and_agreeing) = (0u64, 0u64);
    let mut agree = |i: u32, j: u32| {
        let corners = lattice.corners(i, j);
        let finite = corners.map(|c| raster.depths[c].is_finite());
        let colors = corners.map(|c| raster.colors[c]);
        let agree = finite == [finite[0]; 4] && range(&colors) <= LARGEST_RANGE;
        if colors != [[0.0; 4]; 4] {
            visible += 1;
            visible_and_agreeing += u64::from(agree);
        }
        agree
    };
    let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let cells = cells.map(|(i, j)| agree(i, j)).collect();
    let worth_it = visible_and_agreeing as f64 >= LEAST_AGREEING * visible as f64;
    worth_it.then(|| Mask::new((columns, rows), 0, cells))
}

/// The greatest difference of colours in any channel.
fn range(colors: &[[f32; 4]]) -> f32 {
    let bounds = |c: usize| colors.iter().fold([f32::MAX, f32::MIN], |[a, b], v| [a.min(v[c]), b.max(v[c])]);
    (0..4).map(bounds).fold(0.0, |most, [lo, hi]| most.max(hi - lo))
}

impl Cells {
    pub(crate) fn new(lattice: Lattice, middles: Raster, depths: DepthFill) -> Self {
        Self { lattice, middles, depths }
    }

    fn cell(&self, i: u32, j: u32) -> Cell {
        let corners = self.lattice.corners(i, j);
        let middle = j as usize * self.middles.width as usize + i as usize;
        Cell {
            corners: corners.map(|c| self.lattice.raster.colors[c]),
            middle: self.middles.colors[middle],
            corner_depths: corners.map(|c| self.lattice.raster.depths[c]),
            middle_depth: self.middles.depths[middle],
        }
    }

    /// The cells that are to be cast in full. `with_middle`: those whose middle has been cast.
    pub(crate) fn to_cast(&self, with_middle: &Mask, kernel: &Kernel) -> Mask {
        let (columns, rows) = (self.middles.width, self.middles.height);
        let largest_depth_error = DEPTH_ERROR * kernel.scene.volume().spacing().min_element() as f32;
        let verdict = |i: u32, j: u32| match with_middle.cell(i, j) {
            true => self.cell(i, j).verdict(self.depths, largest_depth_error),
            false if range(&self.cell(i, j).corners) <= LARGEST_RANGE => Verdict::Wrong(0.0),
            false => Verdict::Edge,
        };
        let verdicts: Vec<Vec<Verdict>> =
            (0..rows).into_par_iter().map(|j| (0..columns).map(|i| verdict(i, j)).collect()).collect();
        let wanted = |i: usize, j: usize| match verdicts[j][i] {
            Verdict::Wrong(_) | Verdict::Edge | Verdict::Empty => true,
            Verdict::Fill(_) => {
                let rows = &verdicts[j.saturating_sub(1)..(j + 2).min(verdicts.len())];
                let near = rows.iter().flat_map(|row| &row[i.saturating_sub(1)..(i + 2).min(row.len())]);
                !agree(near)
            }
        };
        let cells = (0..rows as usize).into_par_iter();
        let cells = cells.flat_map_iter(|j| (0..columns as usize).map(move |i| (i, j)));
        Mask::new((columns, rows), SHIFT, cells.map(|(i, j)| wanted(i, j)).collect())
    }

    /// Fills the cells of a tile that were not cast.
    pub(crate) fn fill(&self, cast: &Mask, frame: &Frame, tile: &mut Tile) {
        for j in (tile.y..frame.height.min(tile.y + TILE)).step_by(SPACING as usize) {
            for i in (tile.x..frame.width.min(tile.x + TILE)).step_by(SPACING as usize) {
                let (column, row) = (i / SPACING, j / SPACING);
                if !cast.cell(column, row) {
                    let first = ((j - tile.y) * TILE + i - tile.x) as usize;
                    self.cell(column, row).fill(self.depths, first, tile);
                }
            }
        }
    }
}

impl Cell {
    fn mean_of_corners(&self) -> [f32; 4] {
        let [a, b, c, d] = self.corners;
        mix(mix(a, b, 0.5), mix(c, d, 0.5), 0.5)
    }

    fn verdict(&self, depths: DepthFill, largest_depth_error: f32) -> Verdict {
        let [a, b, c, d] = self.corners;
        let all = [a, b, c, d, self.middle];
        if all.iter().all(|color| *color == [0.0; 4]) {
            return Verdict::Empty;
        }
        let mean = self.mean_of_corners();
        let error = range(&[mean, self.middle]);
        let finite = self.middle_depth.is_finite();
        let mut same = finite == self.corner_depths[0].is_finite();
        if same && finite && depths == DepthFill::Bilinear {
            let expected = blended_depth(self.corner_depths, 0.5, 0.5, depths);
            same = (expected - self.middle_depth).abs() <= largest_depth_error;
        }
        if range(&all) > LARGEST_RANGE {
            Verdict::Edge
        } else if same && error <= LARGEST_ERROR {
            Verdict::Fill(error)
        } else {
            Verdict::Wrong(error)
        }
    }

    /// Fills the cell's pixels in a tile from the pixel of index `first` on.
    fn fill(&self, depths: DepthFill, first: usize, tile: &mut Tile) {
        let [a, b, c, d] = self.corners;
        let mean = self.mean_of_corners();
        let error: [f32; 4] = std::array::from_fn(|k| self.middle[k] - mean[k]);
        let of_all = |pick: fn(f32, f32) -> f32| -> [f32; 4] {
            std::array::from_fn(|k| [b, c, d, self.middle].iter().fold(a[k], |v, color| pick(v, color[k])))
        };
        let (least, greatest) = (of_all(f32::min), of_all(f32::max));
        for y in 0..SPACING as usize {
            let v = y as f32 / SPACING as f32;
            let (left, right) = (mix(a, c, v), mix(b, d, v));
            for x in 0..SPACING as usize {
                let u = x as f32 / SPACING as f32;
                let bubble = 16.0 * u * (1.0 - u) * v * (1.0 - v);
                let between = mix(left, right, u);
                let pixel = first + y * TILE as usize + x;
                tile.colors[pixel] =
                    std::array::from_fn(|k| (between[k] + bubble * error[k]).max(least[k]).min(greatest[k]));
                tile.depths[pixel] = blended_depth(self.corner_depths, u, v, depths);
            }
        }
    }
}
