//! How far two images are apart.
//!
//! What enters: two images of one size. What leaves: a [`Comparison`], numbers that serialize to JSON, or a picture of the
//! difference. Differences are taken between premultiplied values, channel by channel, `a - b`.
//!
//! A pixel with a NaN or an infinity in either image has no difference that means anything: it is counted in
//! [`Comparison::non_finite_pixels`] and left out of every other number. A comparison with such pixels never passes
//! [`Comparison::exceeds`], so that an image of NaN cannot hide.

use std::fmt;

use serde::Serialize;

use super::Image;
use super::ssim::{self, finite};

/// The largest channel difference of a pixel that is not an outlier: two steps of 8 bits.
pub const OUTLIER_THRESHOLD: f32 = 2.0 / 255.0;

/// The two images are not of one size.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the images differ in size: {} x {} and {} x {} pixels; only images of one size can be compared",
    a[0], a[1], b[0], b[1]
)]
pub struct SizeMismatch {
    /// Width and height of the first image.
    pub a: [u32; 2],
    /// Width and height of the second image.
    pub b: [u32; 2],
}

/// A channel of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Place {
    /// Column, from the left.
    pub x: u32,
    /// Row, from the top.
    pub y: u32,
    /// 0 red, 1 green, 2 blue, 3 alpha.
    pub channel: u8,
}

/// The numbers of a comparison of `a` with `b`; N is the number of pixels that are finite in both.
///
/// In JSON what is not finite (a PSNR of equal images, means over no pixel) is `null`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Largest `|a - b|` over all pixels and channels.
    pub largest_difference: f64,
    /// The first place, row by row, with the largest difference; `None` where there is no difference.
    pub largest_at: Option<Place>,
    /// Mean of `|a - b|` over pixels and channels (4 N values).
    pub mean_absolute_difference: f64,
    /// Root mean square error: `sqrt(sum (a - b)^2 / (4 N))`, over pixels and all four premultiplied channels.
    pub rmse: f64,
    /// Mean of `a - b` over pixels, per channel: what a systematic brightening or darkening leaves.
    pub bias: [f64; 4],
    /// Peak signal-to-noise ratio in dB, `-20 log10(rmse)` (the peak is 1); infinite for equal images.
    pub psnr: f64,
    /// Mean structural similarity (Wang et al. 2004), 1 for equal images; of the luma of the images over mid grey.
    ///
    /// The window is an 11 x 11 Gaussian of sigma 1.5, moved over all places where it fits. Along a side shorter than
    /// 11 pixels it is the largest odd number that fits. Non-finite pixels are mid grey in both images.
    pub ssim: f64,
    /// The share of the N pixels whose largest channel difference exceeds [`Comparison::outlier_threshold`].
    pub outlier_share: f64,
    /// What makes a pixel an outlier.
    pub outlier_threshold: f32,
    /// Pixels with a NaN or an infinity in either image; in no other number.
    pub non_finite_pixels: u64,
}

impl Comparison {
    /// Whether the images are the same in every finite pixel, and every pixel is finite.
    pub fn is_equal(&self) -> bool {
        self.non_finite_pixels == 0 && self.largest_at.is_none()
    }

    /// Whether the images are further apart than a limit on the RMSE allows; non-finite pixels always are.
    pub fn exceeds(&self, rmse_limit: f64) -> bool {
        self.non_finite_pixels > 0 || self.rmse.is_nan() || self.rmse > rmse_limit
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "largest difference {:.6}", self.largest_difference)?;
        if let Some(Place { x, y, channel }) = self.largest_at {
            let name = ["red", "green", "blue", "alpha"][usize::from(channel)];
            write!(f, " ({name} at {x}, {y})")?;
        }
        write!(
            f,
            ", mean {:.6}, rmse {:.6}, bias {:+.6} {:+.6} {:+.6} {:+.6}, psnr {:.2} dB, ssim {:.6}, {:.3} % of pixels off by more than {:.4}",
            self.mean_absolute_difference,
            self.rmse,
            self.bias[0],
            self.bias[1],
            self.bias[2],
            self.bias[3],
            self.psnr,
            self.ssim,
            100.0 * self.outlier_share,
            self.outlier_threshold,
        )?;
        if self.non_finite_pixels > 0 {
            write!(f, "; {} pixels are NaN or infinite and left out", self.non_finite_pixels)?;
        }
        Ok(())
    }
}

/// Compares two images; pixels off by more than [`OUTLIER_THRESHOLD`] are outliers.
pub fn compare(a: &Image, b: &Image) -> Result<Comparison, SizeMismatch> {
    compare_with(a, b, OUTLIER_THRESHOLD)
}

/// Compares two images; pixels with a channel off by more than `outlier_threshold` are outliers.
pub fn compare_with(a: &Image, b: &Image, outlier_threshold: f32) -> Result<Comparison, SizeMismatch> {
    same_size(a, b)?;
    let mut sums = Sums::default();
    for (index, (&pa, &pb)) in a.pixels().iter().zip(b.pixels()).enumerate() {
        sums.add(index, pa, pb, outlier_threshold);
    }
    let width = a.width() as usize;
    let finite = sums.finite as f64;
    let rmse = (sums.squared / (4.0 * finite)).sqrt();
    Ok(Comparison {
        width: a.width(),
        height: a.height(),
        largest_difference: sums.largest,
        largest_at: sums.largest_at.map(|(i, channel)| Place {
            x: (i % width) as u32,
            y: (i / width) as u32,
            channel,
        }),
        mean_absolute_difference: sums.absolute / (4.0 * finite),
        rmse,
        bias: sums.signed.map(|s| s / finite),
        psnr: -20.0 * rmse.log10(),
        ssim: ssim::mean_ssim(a, b),
        outlier_share: sums.outliers as f64 / finite,
        outlier_threshold,
        non_finite_pixels: a.pixels().len() as u64 - sums.finite,
    })
}

/// A picture of where two images differ: black where they agree.
///
/// Opaque; a colour channel is `gain` times the larger of its own difference and that of alpha, clamped to 0..1.
/// Pixels with a NaN or an infinity are magenta.
pub fn difference_image(a: &Image, b: &Image, gain: f32) -> Result<Image, SizeMismatch> {
    same_size(a, b)?;
    let difference = |(pa, pb): (&[f32; 4], &[f32; 4])| {
        if !finite(pa) || !finite(pb) {
            return [1.0, 0.0, 1.0, 1.0];
        }
        let channel = |c: usize| (pa[c] - pb[c]).abs().max((pa[3] - pb[3]).abs());
        let [red, green, blue] = [0, 1, 2].map(|c| (gain * channel(c)).clamp(0.0, 1.0));
        [red, green, blue, 1.0]
    };
    let pixels = a.pixels().iter().zip(b.pixels()).map(difference).collect();
    Ok(Image { width: a.width(), height: a.height(), pixels, depth: None })
}

fn same_size(a: &Image, b: &Image) -> Result<(), SizeMismatch> {
    let (a, b) = ([a.width(), a.height()], [b.width(), b.height()]);
    if a == b { Ok(()) } else { Err(SizeMismatch { a, b }) }
}

#[derive(Default)]
struct Sums {
    finite: u64,
    outliers: u64,
    largest: f64,
    largest_at: Option<(usize, u8)>,
    absolute: f64,
    squared: f64,
    signed: [f64; 4],
}

impl Sums {
    fn add(&mut self, index: usize, a: [f32; 4], b: [f32; 4], outlier_threshold: f32) {
        if !finite(&a) || !finite(&b) {
            return;
        }
        self.finite += 1;
        let mut largest_here = 0.0f64;
        for channel in 0..4 {
            let difference = f64::from(a[channel]) - f64::from(b[channel]);
            let size = difference.abs();
            self.signed[channel] += difference;
            self.absolute += size;
            self.squared += size * size;
            largest_here = largest_here.max(size);
            if size > self.largest {
                self.largest = size;
                self.largest_at = Some((index, channel as u8));
            }
        }
        self.outliers += u64::from(largest_here > f64::from(outlier_threshold));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, pixels: &[[f32; 4]]) -> Image {
        Image::new(width, height, pixels.to_vec()).unwrap()
    }

    #[test]
    fn equal_images_are_equal() {
        let a = image(2, 1, &[[0.1, 0.2, 0.3, 0.4], [1.0; 4]]);
        let c = compare(&a, &a).unwrap();
        assert!(c.is_equal() && !c.exceeds(0.0));
        assert_eq!((c.largest_difference, c.largest_at, c.rmse, c.bias), (0.0, None, 0.0, [0.0; 4]));
        assert_eq!((c.psnr, c.ssim, c.outlier_share), (f64::INFINITY, 1.0, 0.0));
        let json = serde_json::to_value(&c).unwrap();
        assert!(json["psnr"].is_null() && json["rmse"] == 0.0 && json["non_finite_pixels"] == 0);
    }

    /// Four pixels, 16 values; differences 0.5 (red), -0.25 (green), 0.125 (alpha): all exact in binary.
    #[test]
    fn numbers_are_those_computed_by_hand() {
        let a = image(2, 2, &[[0.0; 4], [0.5, 0.25, 0.0, 1.0], [0.0; 4], [0.0, 0.0, 0.0, 0.625]]);
        let b = image(2, 2, &[[0.0; 4], [0.0, 0.5, 0.0, 1.0], [0.0; 4], [0.0, 0.0, 0.0, 0.5]]);
        let c = compare_with(&a, &b, 0.2).unwrap();
        assert_eq!(c.largest_difference, 0.5);
        assert_eq!(c.largest_at, Some(Place { x: 1, y: 0, channel: 0 }));
        assert_eq!(c.mean_absolute_difference, 0.875 / 16.0);
        // 0.25 + 0.0625 + 0.015625 = 0.328125; / 16 = 0.0205078125.
        assert!((c.rmse - 0.020_507_812_5_f64.sqrt()).abs() < 1e-15);
        assert_eq!(c.bias, [0.125, -0.0625, 0.0, 0.03125]);
        // 10 log10(1 / 0.0205078125) = 16.8808066...
        assert!((c.psnr - 16.880_806_619_058_927).abs() < 1e-12);
        assert_eq!(c.outlier_share, 0.25);
        assert!(c.exceeds(0.1) && !c.exceeds(0.15) && !c.is_equal());
    }

    #[test]
    fn non_finite_pixels_are_counted_and_left_out() {
        let a = image(2, 2, &[[f32::NAN, 0.0, 0.0, 1.0], [0.5; 4], [f32::INFINITY; 4], [0.5; 4]]);
        let b = image(2, 2, &[[0.0; 4], [0.5; 4], [f32::INFINITY; 4], [0.25, 0.5, 0.5, 0.5]]);
        let c = compare(&a, &b).unwrap();
        assert_eq!((c.non_finite_pixels, c.largest_difference), (2, 0.25));
        assert_eq!(c.bias, [0.125, 0.0, 0.0, 0.0]);
        assert!(c.exceeds(f64::INFINITY) && c.ssim.is_finite());
        assert!(c.to_string().contains("2 pixels are NaN or infinite"), "{c}");

        let none = image(1, 1, &[[f32::NAN; 4]]);
        let c = compare(&none, &none).unwrap();
        assert!(c.rmse.is_nan() && c.exceeds(1.0) && !c.is_equal());
        assert!(serde_json::to_value(&c).unwrap()["rmse"].is_null());
    }

    #[test]
    fn sizes_must_agree() {
        let (a, b) = (image(2, 1, &[[0.0; 4]; 2]), image(1, 2, &[[0.0; 4]; 2]));
        let refused = compare(&a, &b).unwrap_err();
        assert_eq!(refused, SizeMismatch { a: [2, 1], b: [1, 2] });
        assert!(refused.to_string().contains("2 x 1 and 1 x 2"));
        assert!(difference_image(&a, &b, 1.0).is_err());
    }

    #[test]
    fn difference_image_shows_colour_alpha_and_nan() {
        let a = image(3, 1, &[[0.5, 0.25, 0.0, 1.0], [0.0, 0.0, 0.0, 0.5], [f32::NAN; 4]]);
        let b = image(3, 1, &[[0.25, 0.5, 0.0, 1.0], [0.0; 4], [0.0; 4]]);
        let d = difference_image(&a, &b, 3.0).unwrap();
        assert_eq!(d.pixels(), [[0.75, 0.75, 0.0, 1.0], [1.0; 4], [1.0, 0.0, 1.0, 1.0]]);
    }
}
