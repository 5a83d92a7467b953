//! PNG, <https://www.w3.org/TR/png-3/>: straight alpha, 8 or 16 bit; and depth as 16-bit grey.
//!
//! Gamma, chromaticities and colour profiles of a file are passed over: its values are display values.

use std::io::{Cursor, Write};

use ::png::{ColorType, Decoder, DecodingError, Encoder, EncodingError, Transformations};
use cutaway_core::image::Image;

use super::{BitDepth, DecodeImageError, EncodeImageError, ImageFormat, ImageLimits, check_pixels};

/// The sample that stands for "the ray met nothing" in a depth file; the depths themselves end one below.
pub(super) const NO_DEPTH: u16 = u16::MAX;

/// What the decoder may allocate beside the image and some rows of it: ancillary chunks that we do not ask for.
const DECODER_BYTES: usize = 64 << 20;

pub(super) fn encode(
    image: &Image,
    bit_depth: BitDepth,
    write: &mut impl Write,
) -> Result<(), EncodeImageError> {
    let size = [image.width(), image.height()];
    match bit_depth {
        BitDepth::Eight => {
            let data = image.to_straight_u8();
            encode_samples(size, ColorType::Rgba, ::png::BitDepth::Eight, &[], data.as_flattened(), write)
        }
        BitDepth::Sixteen => {
            let data: Vec<[u8; 8]> = image.to_straight_u16().into_iter().map(big_endian).collect();
            encode_samples(size, ColorType::Rgba, ::png::BitDepth::Sixteen, &[], data.as_flattened(), write)
        }
    }
}

/// Writes depth as 16-bit grey: 0 is the smallest finite depth, 65534 the largest, 65535 is no depth.
pub(super) fn encode_depth(
    size: [u32; 2],
    depth: &[f32],
    write: &mut impl Write,
) -> Result<(), EncodeImageError> {
    let finite = depth.iter().copied().filter(|d| d.is_finite());
    let (minimum, maximum) =
        finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), d| (a.min(d), b.max(d)));
    let data: Vec<[u8; 2]> = depth.iter().map(|&d| depth_sample(d, minimum, maximum).to_be_bytes()).collect();
    let mut text = vec![(
        "Comment",
        "depth = DepthMinimum + sample / 65534 * (DepthMaximum - DepthMinimum), world units; 65535: nothing"
            .to_owned(),
    )];
    if minimum <= maximum {
        text.push(("DepthMinimum", minimum.to_string()));
        text.push(("DepthMaximum", maximum.to_string()));
    }
    let depth = ::png::BitDepth::Sixteen;
    encode_samples(size, ColorType::Grayscale, depth, &text, data.as_flattened(), write)
}

/// The sample of a depth; `minimum` and `maximum` are finite if any depth is.
fn depth_sample(depth: f32, minimum: f32, maximum: f32) -> u16 {
    if !depth.is_finite() {
        return NO_DEPTH;
    }
    // In f64 because the difference of two finite f32 may be infinite.
    let range = f64::from(maximum) - f64::from(minimum);
    let part = if range > 0.0 { (f64::from(depth) - f64::from(minimum)) / range } else { 0.0 };
    (part * f64::from(NO_DEPTH - 1)).round() as u16
}

fn encode_samples(
    [width, height]: [u32; 2],
    color: ColorType,
    depth: ::png::BitDepth,
    text: &[(&str, String)],
    data: &[u8],
    write: &mut impl Write,
) -> Result<(), EncodeImageError> {
    let mut encoder = Encoder::new(write, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.add_text_chunk("Software".into(), "cutaway".into()).map_err(encode_error)?;
    for (keyword, value) in text {
        encoder.add_text_chunk((*keyword).into(), value.clone()).map_err(encode_error)?;
    }
    let mut writer = encoder.write_header().map_err(encode_error)?;
    writer.write_image_data(data).map_err(encode_error)?;
    writer.finish().map_err(encode_error)
}

fn encode_error(error: EncodingError) -> EncodeImageError {
    match error {
        EncodingError::IoError(error) => EncodeImageError::Io(error),
        other => EncodeImageError::Encoder { format: ImageFormat::Png, problem: other.to_string() },
    }
}

pub(super) fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<Image, DecodeImageError> {
    let mut cursor = Cursor::new(bytes);
    match decode_at(&mut cursor, limits) {
        Ok(image) => image,
        Err(error) => {
            let problem = match error {
                DecodingError::LimitsExceeded => {
                    format!("decoding takes more than the {DECODER_BYTES} bytes allowed beside the pixels")
                }
                other => other.to_string(),
            };
            Err(DecodeImageError::Content { format: ImageFormat::Png, offset: cursor.position(), problem })
        }
    }
}

/// Outer error: the decoder's, to be given a place; inner: ours.
fn decode_at(
    cursor: &mut Cursor<&[u8]>,
    limits: &ImageLimits,
) -> Result<Result<Image, DecodeImageError>, DecodingError> {
    let mut decoder = Decoder::new_with_limits(cursor, ::png::Limits { bytes: DECODER_BYTES });
    // Palettes, transparent colours and samples of fewer than 8 bits become what is left below.
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let (width, height) = decoder.read_header_info()?.size();
    if let Err(refused) = check_pixels(width.into(), height.into(), limits) {
        return Ok(Err(refused));
    }
    // A few rows of at most 8 bytes a pixel are kept.
    decoder.set_limits(::png::Limits { bytes: DECODER_BYTES.saturating_add(width as usize * 32) });
    let mut reader = decoder.read_info()?;
    let size = reader.output_buffer_size().ok_or(DecodingError::LimitsExceeded)?;
    let mut samples = vec![0; size];
    let info = reader.next_frame(&mut samples)?;
    // The chunks after the pixels: without them the file was cut off.
    reader.finish()?;
    samples.truncate(info.buffer_size());
    Ok(image_of(width, height, info.color_type, info.bit_depth, &samples))
}

fn image_of(
    width: u32,
    height: u32,
    color: ColorType,
    depth: ::png::BitDepth,
    samples: &[u8],
) -> Result<Image, DecodeImageError> {
    let image = if depth == ::png::BitDepth::Sixteen {
        let samples: Vec<u16> = samples.as_chunks().0.iter().map(|&s| u16::from_be_bytes(s)).collect();
        Image::from_straight_u16(width, height, &rgba(color, &samples, u16::MAX))
    } else {
        Image::from_straight_u8(width, height, &rgba(color, samples, u8::MAX))
    };
    Ok(image?)
}

/// The samples as RGBA.
fn rgba<T: Copy>(color: ColorType, samples: &[T], opaque: T) -> Vec<[T; 4]> {
    match color {
        ColorType::Rgba => samples.as_chunks().0.to_vec(),
        ColorType::Rgb => samples.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, opaque]).collect(),
        ColorType::GrayscaleAlpha => samples.as_chunks().0.iter().map(|&[v, a]| [v, v, v, a]).collect(),
        // Palettes have been expanded: what is left is grey.
        ColorType::Grayscale | ColorType::Indexed => samples.iter().map(|&v| [v, v, v, opaque]).collect(),
    }
}

fn big_endian(pixel: [u16; 4]) -> [u8; 8] {
    let [[a, b], [c, d], [e, f], [g, h]] = pixel.map(u16::to_be_bytes);
    [a, b, c, d, e, f, g, h]
}
