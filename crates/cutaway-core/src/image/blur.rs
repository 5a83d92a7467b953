//! Gaussian blur of a finished image: against the grain of jittered rays and the cells of filled pixels.
//!
//! Premultiplied colours are averaged, so that what is transparent adds no colour of its own; depths stay, for no surface
//! lies between two. The kernel ends at three sigmas and sums to one; beyond the image its border repeats. Along x, then
//! along y: the same sums as engines that blur on a device take, in the same order.

use rayon::prelude::*;

use super::Image;

/// The largest sigma, in pixels.
pub const LARGEST_SIGMA: f64 = 64.0;

/// Weights of a Gaussian at 0, 1, 2, ... pixels from its middle, where both sides together sum to one.
pub fn gaussian_weights(sigma: f64) -> Vec<f32> {
    let radius = (3.0 * sigma).ceil() as usize;
    let raw: Vec<f64> = (0..=radius).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let sum = raw[0] + 2.0 * raw[1..].iter().sum::<f64>();
    raw.iter().map(|w| (w / sum) as f32).collect()
}

impl Image {
    /// The image blurred by a Gaussian of `sigma` pixels (up to [`LARGEST_SIGMA`]); the same where that is not above 0.
    #[must_use]
    pub fn blurred(mut self, sigma: f64) -> Self {
        // Not-a-numbers are not above 0, either.
        if sigma.is_nan() || sigma <= 0.0 {
            return self;
        }
        let weights = gaussian_weights(sigma.min(LARGEST_SIGMA));
        let (width, height) = (self.width as usize, self.height as usize);
        let mut along_x = vec![[0.0; 4]; self.pixels.len()];
        along_x.par_chunks_mut(width).zip(self.pixels.par_chunks(width)).for_each(|(out, row)| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = weighted(&weights, |d| row[moved(x, d, width)]);
            }
        });
        self.pixels.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = weighted(&weights, |d| along_x[moved(y, d, height) * width + x]);
            }
        });
        self
    }
}

/// `d` pixels from pixel `x` of `count`; the border repeats.
fn moved(x: usize, d: isize, count: usize) -> usize {
    x.saturating_add_signed(d).min(count - 1)
}

fn weighted(weights: &[f32], pixel: impl Fn(isize) -> [f32; 4]) -> [f32; 4] {
    let mut sum = pixel(0).map(|c| c * weights[0]);
    for (d, w) in (1..).zip(&weights[1..]) {
        let (before, after) = (pixel(-d), pixel(d));
        for c in 0..4 {
            sum[c] += (before[c] + after[c]) * w;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_image_stays_and_its_depths_do() {
        let depths: Vec<f32> = (0..35).map(|i| i as f32).collect();
        let image = Image::filled(7, 5, [0.25, 0.5, 0.75, 1.0]).unwrap().with_depth(depths).unwrap();
        for sigma in [0.0, f64::NAN, -1.0, 0.01, 0.7, 3.0, 64.0, 1e9] {
            let blurred = image.clone().blurred(sigma);
            assert_eq!(blurred.depth(), image.depth());
            let off = |p: &[f32; 4]| (p[0] - 0.25).abs().max((p[3] - 1.0).abs());
            assert!(blurred.pixels().iter().all(|p| off(p) < 2e-6), "{sigma}");
        }
    }

    #[test]
    fn a_dot_becomes_the_gaussian_of_its_sigma() {
        let mut image = Image::filled(41, 41, [0.0; 4]).unwrap();
        image.pixels_mut()[20 * 41 + 20] = [1.0; 4];
        let sigma = 2.5;
        let blurred = image.blurred(sigma);
        let (mut mass, mut variance) = (0.0, 0.0);
        for y in 0..41i32 {
            for x in 0..41i32 {
                let v = f64::from(blurred.pixel(x as u32, y as u32).unwrap()[0]);
                mass += v;
                variance += v * f64::from((x - 20).pow(2));
            }
        }
        // Eight pixels are 3.2 sigmas: beyond lie 0.14 % of the mass and about 1 % of the variance.
        assert!((mass - 1.0).abs() < 1e-5, "{mass}");
        assert!((variance / (sigma * sigma) - 0.99).abs() < 0.005, "{variance}");
    }
}
