//! Image files: PNG, OpenEXR and NumPy arrays, in and out.
//!
//! What enters: an [`Image`] and a path or a writer; or a path or bytes, trusted in nothing. What leaves: a file that appears
//! whole or not at all ([`crate::atomic`]); or an [`Image`]. The extension chooses the format:
//!
//! | format | colour | depth |
//! |---|---|---|
//! | `.png` | straight alpha, 8 or 16 bit | 16 bit grey, 0 nearest, 65534 farthest, 65535 nothing; the range in text chunks |
//! | `.exr` | premultiplied R, G, B, A as 32-bit float, and Z where the image has depth | Z as 32-bit float |
//! | `.npy` | premultiplied float32 `[height, width, 4]` | float32 `[height, width]` |
//!
//! All have the top row first, and all values are display values: no colour space is converted, neither here nor
//! anywhere in this program. EXR files nominally hold linear light; ours hold what the PNG shows.
//!
//! Sizes are checked against [`ImageLimits`] before anything of that size is allocated.

mod exr;
mod npy;
mod png;
#[cfg(test)]
mod tests;

use std::{
    ffi::OsStr,
    fmt,
    io::{self, Read, Write},
    path::{Path, PathBuf},
};

use cutaway_core::image::{Image, ImageError};

use crate::atomic::{AtomicWriteError, write_atomically};
use crate::files::open_once;

/// A kind of image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageFormat {
    /// Portable Network Graphics, `.png`.
    Png,
    /// OpenEXR, `.exr`.
    Exr,
    /// A NumPy array, `.npy`.
    Npy,
}

impl ImageFormat {
    /// Every format, in the order that messages name them.
    pub const ALL: [Self; 3] = [Self::Png, Self::Exr, Self::Npy];

    /// The format that a file name's extension stands for, in upper or lower case.
    pub fn from_path(path: &Path) -> Result<Self, UnknownImageFormat> {
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
        let format = Self::ALL.into_iter().find(|format| format.extension() == extension);
        format.ok_or_else(|| UnknownImageFormat { path: path.to_owned() })
    }

    /// The extension of its file names, without the dot, in lower case.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
            Self::Npy => "npy",
        }
    }

    /// The bytes that each of its files begins with.
    fn signature(self) -> &'static [u8] {
        match self {
            Self::Png => b"\x89PNG\r\n\x1a\n",
            Self::Exr => b"\x76\x2f\x31\x01",
            Self::Npy => b"\x93NUMPY",
        }
    }
}

impl fmt::Display for ImageFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Exr => "OpenEXR",
            Self::Npy => "NPY",
        })
    }
}

/// A file name without an extension that names an image format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{}': {} is not an image format; known are .png, .exr and .npy", path.display(), extension_of(path))]
pub struct UnknownImageFormat {
    /// The path as given.
    pub path: PathBuf,
}

fn extension_of(path: &Path) -> String {
    path.extension().map_or("a name without an extension".into(), |e| format!("'.{}'", e.display()))
}

/// Bits per channel of a PNG file; the other formats have their own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BitDepth {
    /// 0 to 255.
    #[default]
    Eight,
    /// 0 to 65535.
    Sixteen,
}

/// What a file may ask for before it is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageLimits {
    /// Pixels of an image; one takes 16 bytes in memory, and up to 32 more while it is decoded.
    pub pixels: u64,
    /// Bytes of a file.
    pub file_bytes: u64,
}

impl Default for ImageLimits {
    /// 2^27 pixels (16384 x 8192) and 4 GiB.
    fn default() -> Self {
        Self { pixels: 1 << 27, file_bytes: 1 << 32 }
    }
}

/// Why bytes are not an image.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeImageError {
    /// The first bytes are not those of the format.
    #[error(
        "not {} {format} file: it begins with [{}], expected [{}]",
        article(*format), hex(found), hex(format.signature())
    )]
    Signature {
        /// The format expected.
        format: ImageFormat,
        /// The first bytes, at most as many as the signature has.
        found: Vec<u8>,
    },
    /// There are more pixels than the limit allows.
    #[error("{width} x {height} pixels exceed the limit of {limit} pixels")]
    TooManyPixels {
        /// Pixels in a row.
        width: u64,
        /// Rows.
        height: u64,
        /// [`ImageLimits::pixels`].
        limit: u64,
    },
    /// The file breaks its format or uses a part of it that is not read.
    #[error("{format} at byte {offset}: {problem}")]
    Content {
        /// The format.
        format: ImageFormat,
        /// Where reading stopped: the fault is there or just before.
        offset: u64,
        /// The field, what was found and what was expected.
        problem: String,
    },
    /// What was decoded is no image.
    #[error(transparent)]
    Image(#[from] ImageError),
}

fn article(format: ImageFormat) -> &'static str {
    if format == ImageFormat::Png { "a" } else { "an" }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ")
}

/// Why an image file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadImageError {
    /// The extension names no format.
    #[error(transparent)]
    UnknownFormat(#[from] UnknownImageFormat),
    /// The file system refused.
    #[error("cannot read '{}': {error}", path.display())]
    Io {
        /// The path as given.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// The file is longer than the limit allows.
    #[error("cannot read '{}': it is longer than the limit of {limit} bytes", path.display())]
    FileTooLarge {
        /// The path as given.
        path: PathBuf,
        /// [`ImageLimits::file_bytes`].
        limit: u64,
    },
    /// The content is not an image.
    #[error("cannot read '{}': {error}", path.display())]
    Decode {
        /// The path as given.
        path: PathBuf,
        /// What is wrong with it.
        error: DecodeImageError,
    },
}

/// Why an image could not be turned into a file's bytes.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeImageError {
    /// The image has no depth to write.
    #[error("the image has no depth")]
    NoDepth,
    /// The format cannot hold so large an image.
    #[error("{width} x {height} pixels are too many for {format}, whose sides end at 2147483647; write .npy")]
    TooLarge {
        /// The format.
        format: ImageFormat,
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The encoder refused.
    #[error("{format}: {problem}")]
    Encoder {
        /// The format.
        format: ImageFormat,
        /// What it said.
        problem: String,
    },
    /// The bytes could not be written.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Why an image file could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteImageError {
    /// The extension names no format.
    #[error(transparent)]
    UnknownFormat(#[from] UnknownImageFormat),
    /// The file could not be written.
    #[error(transparent)]
    File(#[from] AtomicWriteError<EncodeImageError>),
}

/// Writes an image in a format. The bit depth is for PNG alone.
pub fn encode_image(
    image: &Image,
    format: ImageFormat,
    bit_depth: BitDepth,
    write: &mut impl Write,
) -> Result<(), EncodeImageError> {
    check_sides(image, format)?;
    match format {
        ImageFormat::Png => png::encode(image, bit_depth, write),
        ImageFormat::Exr => exr::encode(image, write),
        ImageFormat::Npy => Ok(npy::encode(image, write)?),
    }
}

/// Writes the depth of an image in a format, as the table at the top of this module says.
pub fn encode_depth(
    image: &Image,
    format: ImageFormat,
    write: &mut impl Write,
) -> Result<(), EncodeImageError> {
    let depth = image.depth().ok_or(EncodeImageError::NoDepth)?;
    check_sides(image, format)?;
    let size = [image.width(), image.height()];
    match format {
        ImageFormat::Png => png::encode_depth(size, depth, write),
        ImageFormat::Exr => exr::encode_depth(size, depth, write),
        ImageFormat::Npy => Ok(npy::encode_depth(size, depth, write)?),
    }
}

/// Writes an image file, whole or not at all, in the format of its extension. The bit depth is for PNG alone.
pub fn write_image(path: &Path, image: &Image, bit_depth: BitDepth) -> Result<(), WriteImageError> {
    let format = ImageFormat::from_path(path)?;
    Ok(write_atomically(path, |write| encode_image(image, format, bit_depth, write))?)
}

/// Writes the depth of an image to a file, whole or not at all, in the format of its extension.
pub fn write_depth(path: &Path, image: &Image) -> Result<(), WriteImageError> {
    let format = ImageFormat::from_path(path)?;
    Ok(write_atomically(path, |write| encode_depth(image, format, write))?)
}

/// Reads an image file in the format of its extension, within the default limits.
pub fn read_image(path: &Path) -> Result<Image, ReadImageError> {
    read_image_within(path, &ImageLimits::default())
}

/// Reads an image file in the format of its extension.
pub fn read_image_within(path: &Path, limits: &ImageLimits) -> Result<Image, ReadImageError> {
    let format = ImageFormat::from_path(path)?;
    let io = |error| ReadImageError::Io { path: path.to_owned(), error };
    let file = open_once(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    let too_large = || ReadImageError::FileTooLarge { path: path.to_owned(), limit: limits.file_bytes };
    if length > limits.file_bytes {
        return Err(too_large());
    }
    // A pipe has no length, and a file may grow: the limit holds for what is read, too.
    let mut bytes = Vec::new();
    file.take(limits.file_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > limits.file_bytes {
        return Err(too_large());
    }
    decode_image(&bytes, format, limits)
        .map_err(|error| ReadImageError::Decode { path: path.to_owned(), error })
}

/// Reads an image from the bytes of a file.
///
/// PNG: any kind (for an animation, its default image); alpha is straight and becomes premultiplied. OpenEXR: the first
/// part with R, G and B, or Y, of half or float, scan lines or the finest level of tiles; A and Z are taken where they
/// are. NPY: float32 or float64, little endian, C order, `[height, width, 4]` premultiplied, `[height, width, 3]` or
/// `[height, width]` opaque.
pub fn decode_image(
    bytes: &[u8],
    format: ImageFormat,
    limits: &ImageLimits,
) -> Result<Image, DecodeImageError> {
    let signature = format.signature();
    if !bytes.starts_with(signature) {
        let found = bytes[..bytes.len().min(signature.len())].to_vec();
        return Err(DecodeImageError::Signature { format, found });
    }
    match format {
        ImageFormat::Png => png::decode(bytes, limits),
        ImageFormat::Exr => exr::decode(bytes, limits),
        ImageFormat::Npy => npy::decode(bytes, limits),
    }
}

/// Checks a size found in a file; returns the number of pixels.
fn check_pixels(width: u64, height: u64, limits: &ImageLimits) -> Result<usize, DecodeImageError> {
    let count = width.checked_mul(height).filter(|&count| count <= limits.pixels);
    count.and_then(|count| usize::try_from(count).ok()).ok_or(DecodeImageError::TooManyPixels {
        width,
        height,
        limit: limits.pixels,
    })
}

/// Checks that the sides fit the signed 32-bit fields of PNG and OpenEXR.
fn check_sides(image: &Image, format: ImageFormat) -> Result<(), EncodeImageError> {
    let (width, height) = (image.width(), image.height());
    if format != ImageFormat::Npy && width.max(height) > i32::MAX as u32 {
        return Err(EncodeImageError::TooLarge { format, width, height });
    }
    Ok(())
}
