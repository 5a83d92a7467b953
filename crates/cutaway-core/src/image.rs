//! An image: what a renderer makes of a volume.
//!
//! What enters: premultiplied RGBA f32 pixels, top row first, and a depth per pixel where the renderer knows one. What
//! leaves: the same, composited over a background, or as straight (un-premultiplied) 8- and 16-bit integers for files
//! and windows. [`compare`](mod@compare) says how far two images are apart.
//!
//! **Colours are display values.** They are composited, stored and written as the transfer function states them; nothing
//! here converts to or from sRGB or any other encoding. A colour channel may exceed its alpha (a highlight adds light
//! without opacity); only the integer forms clamp.

pub mod blur;
pub mod compare;
mod ssim;

use crate::compositing::over;

/// Why an image could not be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// A side is zero, or the pixels do not fit in memory's address range.
    #[error(
        "{width} x {height} is not an image: each side must be at least 1 and the pixels must fit in memory"
    )]
    Dimensions {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A buffer length and the dimensions disagree.
    #[error("expected {expected} {what} for {width} x {height}, found {found}")]
    Count {
        /// `pixels` or `depths`.
        what: &'static str,
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Their product.
        expected: usize,
        /// Length of the buffer.
        found: usize,
    },
}

/// A picture: `width * height` pixels, row by row, the top row first.
///
/// A pixel is `[red, green, blue, alpha]`, premultiplied, nominally within 0..1, display values. The depth, where there
/// is one, is the world distance along the pixel's ray from the eye to the first visible sample (for composite modes: to
/// where the accumulated opacity passes one half), and `INFINITY` where the ray met nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    pixels: Vec<[f32; 4]>,
    depth: Option<Vec<f32>>,
}

impl Image {
    /// An image from `width * height` premultiplied pixels, top row first.
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 4]>) -> Result<Self, ImageError> {
        let expected = pixel_count(width, height)?;
        if pixels.len() != expected {
            let found = pixels.len();
            return Err(ImageError::Count { what: "pixels", width, height, expected, found });
        }
        Ok(Self { width, height, pixels, depth: None })
    }

    /// The image with its depths in another unit of length, `unit` times as long as the new one.
    #[must_use]
    pub fn with_depth_unit(mut self, unit: f64) -> Self {
        if unit != 1.0 {
            let depths = self.depth.iter_mut().flatten();
            depths.for_each(|depth| *depth = (f64::from(*depth) * unit) as f32);
        }
        self
    }

    /// An image of one premultiplied colour.
    pub fn filled(width: u32, height: u32, color: [f32; 4]) -> Result<Self, ImageError> {
        let pixels = vec![color; pixel_count(width, height)?];
        Ok(Self { width, height, pixels, depth: None })
    }

    /// The image with a depth per pixel (world distance along the ray, `INFINITY` where nothing), top row first.
    pub fn with_depth(mut self, depth: Vec<f32>) -> Result<Self, ImageError> {
        let (expected, found) = (self.pixels.len(), depth.len());
        if found != expected {
            let Self { width, height, .. } = self;
            return Err(ImageError::Count { what: "depths", width, height, expected, found });
        }
        self.depth = Some(depth);
        Ok(self)
    }

    /// The image without depths, where they would say nothing true.
    #[must_use]
    pub fn without_depth(self) -> Self {
        Self { depth: None, ..self }
    }

    /// An image from straight (un-premultiplied) 8-bit pixels, top row first.
    pub fn from_straight_u8(width: u32, height: u32, pixels: &[[u8; 4]]) -> Result<Self, ImageError> {
        let premultiply = |p: &[u8; 4]| premultiplied(p.map(|c| f32::from(c) / 255.0));
        Self::new(width, height, pixels.iter().map(premultiply).collect())
    }

    /// An image from straight (un-premultiplied) 16-bit pixels, top row first.
    pub fn from_straight_u16(width: u32, height: u32, pixels: &[[u16; 4]]) -> Result<Self, ImageError> {
        let premultiply = |p: &[u16; 4]| premultiplied(p.map(|c| f32::from(c) / 65535.0));
        Self::new(width, height, pixels.iter().map(premultiply).collect())
    }

    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The premultiplied pixels, top row first.
    pub fn pixels(&self) -> &[[f32; 4]] {
        &self.pixels
    }

    /// The premultiplied pixels, to be written in place.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 4]] {
        &mut self.pixels
    }

    /// The depths, top row first, where the image has them.
    pub fn depth(&self) -> Option<&[f32]> {
        self.depth.as_deref()
    }

    /// The premultiplied pixel in column `x` (from the left) of row `y` (from the top), `None` outside the image.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[f32; 4]> {
        self.index(x, y).map(|i| self.pixels[i])
    }

    /// The depth in column `x` of row `y`; `None` outside the image and where the image has no depths.
    pub fn depth_at(&self, x: u32, y: u32) -> Option<f32> {
        self.depth.as_ref().zip(self.index(x, y)).map(|(depth, i)| depth[i])
    }

    /// The pixels and the depths.
    pub fn into_parts(self) -> (Vec<[f32; 4]>, Option<Vec<f32>>) {
        (self.pixels, self.depth)
    }

    /// The image in front of a straight (un-premultiplied) colour. Depths stay.
    #[must_use]
    pub fn over_background(mut self, background: [f32; 4]) -> Self {
        let back = premultiplied(background);
        for pixel in &mut self.pixels {
            *pixel = over(*pixel, back);
        }
        self
    }

    /// The pixels as straight (un-premultiplied) 8-bit values, rounded and clamped, top row first.
    ///
    /// Where the alpha rounds to zero the whole pixel is zero. NaN becomes zero.
    pub fn to_straight_u8(&self) -> Vec<[u8; 4]> {
        // The float is an integer within 0..=255 (or NaN, which the cast makes 0).
        self.pixels.iter().map(|&p| straight(p, 255.0).map(|c| c as u8)).collect()
    }

    /// The pixels as straight (un-premultiplied) 16-bit values; as [`Image::to_straight_u8`] otherwise.
    pub fn to_straight_u16(&self) -> Vec<[u16; 4]> {
        self.pixels.iter().map(|&p| straight(p, 65535.0).map(|c| c as u16)).collect()
    }

    fn index(&self, x: u32, y: u32) -> Option<usize> {
        // The product fits: the pixels are in memory.
        (x < self.width && y < self.height).then(|| y as usize * self.width as usize + x as usize)
    }
}

/// The premultiplied form of a straight colour.
fn premultiplied([red, green, blue, alpha]: [f32; 4]) -> [f32; 4] {
    [red * alpha, green * alpha, blue * alpha, alpha]
}

/// A premultiplied pixel as straight integers within `0..=largest`, all zero where the alpha rounds to zero.
///
/// Colours are divided by the alpha itself, not by the rounded one: an 8-bit file then holds the colour as exactly as
/// 8 bits can, and premultiplying it again is off by at most half a step in colour and half a step in alpha.
fn straight(pixel: [f32; 4], largest: f32) -> [f32; 4] {
    let quantised = |value: f32| (value.clamp(0.0, 1.0) * largest).round();
    let alpha = quantised(pixel[3]);
    // A NaN alpha is nothing to divide by either.
    if alpha.is_nan() || alpha == 0.0 {
        return [0.0; 4];
    }
    let scale = pixel[3].min(1.0);
    [quantised(pixel[0] / scale), quantised(pixel[1] / scale), quantised(pixel[2] / scale), alpha]
}

/// The number of pixels, if such an image can be in memory at all.
fn pixel_count(width: u32, height: u32) -> Result<usize, ImageError> {
    let refused = ImageError::Dimensions { width, height };
    let count = u64::from(width) * u64::from(height);
    let bytes = count.checked_mul(size_of::<[f32; 4]>() as u64);
    match bytes {
        Some(bytes) if count > 0 && isize::try_from(bytes).is_ok() => Ok(count as usize),
        _ => Err(refused),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn sizes_are_checked() {
        assert!(matches!(Image::new(0, 3, vec![]), Err(ImageError::Dimensions { .. })));
        assert!(matches!(Image::filled(u32::MAX, u32::MAX, [0.0; 4]), Err(ImageError::Dimensions { .. })));
        let wrong = Image::new(2, 2, vec![[0.0; 4]; 3]).unwrap_err();
        assert_eq!(wrong.to_string(), "expected 4 pixels for 2 x 2, found 3");
        let wrong = Image::filled(2, 1, [0.0; 4]).unwrap().with_depth(vec![1.0]).unwrap_err();
        assert_eq!(wrong.to_string(), "expected 2 depths for 2 x 1, found 1");
    }

    #[test]
    fn pixels_are_row_by_row() {
        let pixels = (0..6).map(|i| [i as f32, 0.0, 0.0, 1.0]).collect();
        let image = Image::new(3, 2, pixels).unwrap().with_depth(vec![9., 8., 7., 6., 5., 4.]).unwrap();
        assert_eq!(image.pixel(1, 1), Some([4.0, 0.0, 0.0, 1.0]));
        assert_eq!(image.depth_at(2, 0), Some(7.0));
        assert_eq!((image.pixel(3, 0), image.pixel(0, 2), image.depth_at(3, 1)), (None, None, None));
    }

    #[test]
    fn background_shows_through_what_is_left() {
        let image = Image::filled(1, 1, [0.25, 0.0, 0.5, 0.5]).unwrap();
        let over_white = image.clone().over_background([1.0, 1.0, 1.0, 1.0]);
        assert_eq!(over_white.pixels(), [[0.75, 0.5, 1.0, 1.0]]);
        let over_half_red = image.clone().over_background([1.0, 0.0, 0.0, 0.5]);
        assert_eq!(over_half_red.pixels(), [[0.5, 0.0, 0.5, 0.75]]);
        assert_eq!(image.clone().over_background([0.3, 0.2, 0.1, 0.0]), image);
    }

    #[test]
    fn straight_values_are_rounded_and_clamped() {
        let pixels = vec![
            [0.25, 0.1, 0.0, 0.5],      // 0.5, 0.2, 0, 0.5
            [2.0, -1.0, 1.0, 1.0],      // beyond the range
            [0.3, 0.2, 0.1, 0.0],       // light without opacity has no straight form
            [0.0015, 0.0, 0.0, 0.0015], // rounds to no opacity in 8 bits, to 98 in 16
            [f32::NAN, 0.5, 0.5, 1.0],
            [0.5, 0.5, 0.5, f32::NAN],
        ];
        let image = Image::new(6, 1, pixels).unwrap();
        let bytes = image.to_straight_u8();
        assert_eq!(bytes[0], [128, 51, 0, 128]);
        assert_eq!(bytes[1], [255, 0, 255, 255]);
        assert_eq!(bytes[2..4], [[0; 4]; 2]);
        assert_eq!(bytes[4], [0, 128, 128, 255]);
        assert_eq!(bytes[5], [0; 4]);
        assert_eq!(image.to_straight_u16()[0], [32768, 13107, 0, 32768]);
        assert_eq!(image.to_straight_u16()[3], [65535, 0, 0, 98]);
    }

    proptest! {
        #[test]
        fn straight_integers_survive_premultiplying(p: [u8; 4], q: [u16; 4]) {
            let eight = Image::from_straight_u8(1, 1, &[p]).unwrap().to_straight_u8()[0];
            prop_assert_eq!(eight, if p[3] == 0 { [0; 4] } else { p });
            let sixteen = Image::from_straight_u16(1, 1, &[q]).unwrap().to_straight_u16()[0];
            prop_assert_eq!(sixteen, if q[3] == 0 { [0; 4] } else { q });
        }
    }
}
