//! Structural similarity: Z. Wang, A. Bovik, H. Sheikh, E. Simoncelli, "Image quality assessment: from error visibility to
//! structural similarity", IEEE TIP 13(4), 2004.
//!
//! What enters: two images of one size. What leaves: the mean of equation 13 over all places of the window,
//!
//! ```text
//! SSIM = (2 mu_a mu_b + C1) (2 sigma_ab + C2) / ((mu_a^2 + mu_b^2 + C1) (sigma_a^2 + sigma_b^2 + C2))
//! ```
//!
//! with Gaussian-weighted moments (eq. 14 to 16), C1 = 0.01^2, C2 = 0.03^2 and values within 0..1. The Gaussian is
//! separable: each row is filtered once and eleven filtered rows are kept, whatever the height of the image.

use rayon::prelude::*;

use super::Image;

const WINDOW: usize = 11;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;
/// What the images are composited over, and what a non-finite pixel counts as.
const MID_GREY: f64 = 0.5;
/// Rows of places that one task works through.
const STRIP: usize = 64;

/// Weighted sums of a, b, a², b² and ab.
type Moments = [f64; 5];

/// Mean SSIM of the luma of two images of one size.
pub(super) fn mean_ssim(a: &Image, b: &Image) -> f64 {
    let (width, height) = (a.width() as usize, a.height() as usize);
    let (across, down) = (gaussian(window(width)), gaussian(window(height)));
    let (columns, rows) = (width + 1 - across.len(), height + 1 - down.len());
    // The strips do not depend on the number of threads, and their sums are added in order: so the result does not.
    let sums: Vec<f64> = (0..rows.div_ceil(STRIP))
        .into_par_iter()
        .map(|strip| strip_sum(a, b, &across, &down, strip * STRIP..rows.min((strip + 1) * STRIP)))
        .collect();
    sums.iter().sum::<f64>() / (columns as f64 * rows as f64)
}

/// The sum of SSIM over the places whose windows begin in `rows`.
fn strip_sum(a: &Image, b: &Image, across: &[f64], down: &[f64], rows: std::ops::Range<usize>) -> f64 {
    let size = down.len();
    // Filtered rows, each in the slot of its number modulo the window.
    let mut filtered: Vec<Vec<Moments>> = vec![Vec::new(); size];
    let mut sum = 0.0;
    for y in rows.start..rows.end + size - 1 {
        filtered[y % size] = filter_row(&luma_row(a, b, y), across);
        let Some(top) = (y + 1).checked_sub(size).filter(|&top| top >= rows.start) else { continue };
        let place = |x: usize| {
            let mut moments = [0.0; 5];
            for (i, weight) in down.iter().enumerate() {
                let row = &filtered[(top + i) % size][x];
                (0..5).for_each(|m| moments[m] += weight * row[m]);
            }
            ssim(moments)
        };
        sum += (0..filtered[0].len()).map(place).sum::<f64>();
    }
    sum
}

/// Equation 13 of the paper.
fn ssim([mean_a, mean_b, square_a, square_b, product]: Moments) -> f64 {
    let variance_a = square_a - mean_a * mean_a;
    let variance_b = square_b - mean_b * mean_b;
    let covariance = product - mean_a * mean_b;
    let luminance = (2.0 * mean_a * mean_b + C1) / (mean_a * mean_a + mean_b * mean_b + C1);
    luminance * (2.0 * covariance + C2) / (variance_a + variance_b + C2)
}

/// The luma of row `y` of both images over mid grey.
fn luma_row(a: &Image, b: &Image, y: usize) -> Vec<[f64; 2]> {
    let width = a.width() as usize;
    let row = y * width..(y + 1) * width;
    let both = a.pixels()[row.clone()].iter().zip(&b.pixels()[row]);
    both.map(|(a, b)| if finite(a) && finite(b) { [luma(a), luma(b)] } else { [MID_GREY; 2] }).collect()
}

/// Rec. 709 luma of a premultiplied pixel over mid grey; colours are display values, so it is no linear luminance.
fn luma(&[red, green, blue, alpha]: &[f32; 4]) -> f64 {
    let colour = 0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue);
    colour + (1.0 - f64::from(alpha)) * MID_GREY
}

/// The moments of each place along a row, weighted across only.
fn filter_row(row: &[[f64; 2]], weights: &[f64]) -> Vec<Moments> {
    row.windows(weights.len())
        .map(|window| {
            let mut moments = [0.0; 5];
            for (&[a, b], w) in window.iter().zip(weights) {
                let values = [a, b, a * a, b * b, a * b];
                (0..5).for_each(|m| moments[m] += w * values[m]);
            }
            moments
        })
        .collect()
}

/// The window along a side of `length` pixels: 11, or the largest odd number that fits.
fn window(length: usize) -> usize {
    WINDOW.min(length - (length + 1) % 2)
}

/// Normalised Gaussian weights of an odd number of pixels.
fn gaussian(size: usize) -> Vec<f64> {
    let middle = (size / 2) as f64;
    let weights: Vec<f64> = (0..size).map(|i| (-0.5 * ((i as f64 - middle) / SIGMA).powi(2)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}

/// Whether every channel is neither NaN nor infinite.
pub(super) fn finite(pixel: &[f32; 4]) -> bool {
    pixel.iter().all(|c| c.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Image {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels = pixels.map(|(x, y)| value(x, y)).map(|v| [v, v, v, 1.0]).collect();
        Image::new(width, height, pixels).unwrap()
    }

    fn noise_a(x: u32, y: u32) -> f32 {
        ((x * 37 + y * 101 + x * y * 7) % 256) as f32 / 255.0
    }

    fn noise_b(x: u32, y: u32) -> f32 {
        ((x * 37 + y * 101 + x * y * 7 + (x * x + 3 * y) % 23 * 4) % 256) as f32 / 255.0
    }

    fn translucent(shift: u32) -> Image {
        let pixel = |(x, y): (u32, u32)| {
            let alpha = ((x * 5 + y * 3 + shift) % 16 + 1) as f32 / 16.0;
            let red = alpha * ((x + shift) % 8) as f32 / 8.0;
            let green = alpha * ((y + 2 * shift) % 4) as f32 / 4.0;
            [red, green, alpha * ((x + y) % 2) as f32, alpha]
        };
        let pixels = (0..23).flat_map(|y| (0..29).map(move |x| (x, y))).map(pixel).collect();
        Image::new(29, 23, pixels).unwrap()
    }

    fn assert_close(found: f64, expected: f64) {
        // Both are f64 throughout; the order of summation differs.
        assert!((found - expected).abs() < 1e-9, "found {found}, expected {expected}");
    }

    /// From scikit-image 0.26: `structural_similarity(a, b, gaussian_weights=True, sigma=1.5,
    /// use_sample_covariance=False, data_range=1.0)` of the float32 values of the same formulas.
    #[test]
    fn agrees_with_scikit_image() {
        let (a, b) = (grey(29, 23, noise_a), grey(29, 23, noise_b));
        let ramp = grey(29, 23, |x, _| x as f32 / 28.0);
        let tilted = grey(29, 23, |x, y| x as f32 / 28.0 * 0.75 + y as f32 / 92.0);
        assert_close(mean_ssim(&a, &b), 0.301_633_930_722_635_95);
        assert_close(mean_ssim(&ramp, &tilted), 0.909_742_958_686_427_4);
        assert_close(mean_ssim(&a, &ramp), 0.010_131_494_224_007_18);
        assert_close(mean_ssim(&translucent(0), &translucent(3)), -0.366_066_089_091_754_1);
    }

    /// From a direct two-dimensional sum in NumPy over windows of 7 x 5 and of one pixel.
    #[test]
    fn small_images_shrink_the_window() {
        assert_close(mean_ssim(&grey(7, 6, noise_a), &grey(7, 6, noise_b)), 0.061_876_336_017_368_25);
        let (black, other) = (grey(1, 1, noise_a), grey(1, 1, |_, _| noise_b(2, 2)));
        // One pixel has no variance: C1 / (0.345...² + C1).
        assert_close(mean_ssim(&black, &other), 0.000_838_977_814_967_675_7);
    }

    #[test]
    fn strips_join_without_a_seam() {
        let (a, b) = (grey(13, 163, noise_a), grey(13, 163, noise_b));
        let (across, down) = (gaussian(11), gaussian(11));
        let whole = strip_sum(&a, &b, &across, &down, 0..153) / (3.0 * 153.0);
        assert_close(mean_ssim(&a, &b), whole);
    }
}
