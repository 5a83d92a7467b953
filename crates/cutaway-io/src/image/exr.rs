//! OpenEXR, <https://openexr.com/en/latest/OpenEXRFileLayout.html>: R, G, B, A and Z as 32-bit float, ZIP-compressed.
//!
//! Read: the first part that has R, G and B (or Y, a grey image) of type half or float, as scan lines or tiles; of several
//! resolution levels the finest; the data window alone. Not read: deep data, subsampled channels, unsigned-integer
//! colours, colours within named layers (`beauty.R`), and the lossy compressions but PXR24: the decoder of DWA allocates
//! whatever a file asks for and that of B44 trusts its arithmetic.

use std::io::{Cursor, Write};

use ::exr::{
    block::{self, UncompressedBlock, lines::LineRef, reader::ChunksReader, writer::ChunksWriter},
    compression::Compression,
    error::Error,
    io::Data,
    math::Vec2,
    meta::{
        BlockDescription,
        attribute::{ChannelDescription, LineOrder, SampleType, Text},
        header::{Header, LayerAttributes},
    },
    prelude::f16,
};
use cutaway_core::image::Image;

use super::{DecodeImageError, EncodeImageError, ImageFormat, ImageLimits, check_pixels};

/// Longest side of a tile; longer ones have no use and would overflow the decoder's sums.
const MAX_TILE_SIDE: usize = 1 << 16;

/// Bytes that a block, all channels together, may have when decompressed.
const MAX_BLOCK_BYTES: usize = 1 << 28;

/// More than zlib, the strongest of the compressions with a bound (PIZ has none), can make of one byte.
const MAX_EXPANSION: u64 = 1100;

/// A channel to write: its name and its sample at a pixel index.
type Plane<'a> = (&'static str, &'a dyn Fn(usize) -> f32);

pub(super) fn encode(image: &Image, write: &mut impl Write) -> Result<(), EncodeImageError> {
    let pixels = image.pixels();
    let [red, green, blue, alpha] = [0, 1, 2, 3].map(|channel| move |index: usize| pixels[index][channel]);
    let nothing = [];
    let depth = image.depth().unwrap_or(&nothing);
    let depth = |index: usize| depth[index];
    // The format wants the channels in alphabetical order.
    let planes: [Plane<'_>; 5] = [("A", &alpha), ("B", &blue), ("G", &green), ("R", &red), ("Z", &depth)];
    let count = if image.depth().is_some() { 5 } else { 4 };
    encode_planes([image.width(), image.height()], &planes[..count], write)
}

pub(super) fn encode_depth(
    size: [u32; 2],
    depth: &[f32],
    write: &mut impl Write,
) -> Result<(), EncodeImageError> {
    encode_planes(size, &[("Z", &|index| depth[index])], write)
}

/// Encodes into memory first: the format's offset table needs a writer that can seek.
fn encode_planes(
    [width, height]: [u32; 2],
    planes: &[Plane<'_>],
    write: &mut impl Write,
) -> Result<(), EncodeImageError> {
    let width = width as usize;
    let attributes = LayerAttributes { software_name: Some(Text::from("cutaway")), ..Default::default() };
    let channels = planes.iter().map(|&(name, _)| ChannelDescription::named(name, SampleType::F32)).collect();
    // ZIP over sixteen scan lines is lossless, and every reader knows it.
    let header = Header::new(Text::default(), (width, height as usize), channels)
        .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing)
        .with_attributes(attributes);
    let mut bytes = Cursor::new(Vec::new());
    let written = block::write(&mut bytes, std::iter::once(header).collect(), true, |meta, chunks| {
        let blocks = meta.collect_ordered_block_data(|index| {
            UncompressedBlock::collect_block_data_from_lines(&meta.headers[0].channels, index, |line| {
                let Vec2(x, y) = line.location.position;
                let sample = planes[line.location.channel].1;
                line.write_samples(|i| sample(y * width + x + i)).expect("a line has room for its samples");
            })
        });
        // The progress wrapper is what owns a writer that was lent.
        chunks.on_progress(|_| ()).compress_all_blocks_parallel(&meta, blocks)
    });
    written.map_err(|error| EncodeImageError::Encoder {
        format: ImageFormat::Exr,
        problem: error.to_string(),
    })?;
    Ok(write.write_all(bytes.get_ref())?)
}

pub(super) fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<Image, DecodeImageError> {
    let mut cursor = Cursor::new(bytes);
    decode_at(&mut cursor, limits).map_err(|failure| match failure {
        Failure::Decoder(error) => content(cursor.position(), error.to_string()),
        Failure::Header(problem) => content(cursor.position(), problem),
        Failure::Ours(error) => error,
    })
}

fn content(offset: u64, problem: String) -> DecodeImageError {
    DecodeImageError::Content { format: ImageFormat::Exr, offset, problem }
}

enum Failure {
    /// The decoder's, to be given a place.
    Decoder(Error),
    /// What the header asks for is not done here.
    Header(String),
    Ours(DecodeImageError),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Decoder(error)
    }
}

fn decode_at(cursor: &mut Cursor<&[u8]>, limits: &ImageLimits) -> Result<Image, Failure> {
    let file_bytes = cursor.get_ref().len() as u64;
    let reader = block::read(cursor, false)?;
    let parts = reader.headers();
    // Every part passes through the decoder's checks of the offset tables, so all must be sound.
    parts.iter().try_for_each(check_part).map_err(Failure::Header)?;
    let (part, roles) = choose_part(parts).map_err(Failure::Header)?;
    let header = parts[part].clone();
    let Vec2(width, height) = header.layer_size;
    let count = check_pixels(width as u64, height as u64, limits).map_err(Failure::Ours)?;
    check_channels(&header, file_bytes).map_err(Failure::Header)?;

    // Zeros take no memory until they are written over, which a file that is not as long as it says never does.
    let mut pixels = vec![[0.0; 4]; count];
    let mut depth = roles.contains(&Some(Role::Depth)).then(|| vec![0.0; count]);
    let chunks = reader
        .filter_chunks(true, |_, tile, block| block.layer == part && tile.is_largest_resolution_level())?;
    let mut filled = 0;
    chunks.decompress_sequential(true, |_, block| {
        filled += block.index.pixel_size.area();
        if block.data.len() != block.index.pixel_size.area() * header.channels.bytes_per_pixel {
            return Err(Error::Invalid("a block's size is not that of its pixels".into()));
        }
        for line in block.lines(&header.channels) {
            let Some(role) = roles[line.location.channel] else { continue };
            let Vec2(x, y) = line.location.position;
            let at = y * width + x..y * width + x + line.location.sample_count;
            let depth = depth.as_deref_mut().map(|depth| &mut depth[at.clone()]);
            match header.channels.list[line.location.channel].sample_type {
                SampleType::F16 => place::<f16>(role, &line, &mut pixels[at], depth)?,
                SampleType::F32 => place::<f32>(role, &line, &mut pixels[at], depth)?,
                SampleType::U32 => {}
            }
        }
        Ok(())
    })?;
    if filled != count {
        let problem = format!("the blocks hold {filled} pixels, expected {count}; the file is incomplete");
        return Err(Failure::Decoder(Error::Invalid(problem.into())));
    }
    if !roles.contains(&Some(Role::Channel(3))) {
        pixels.iter_mut().for_each(|pixel| pixel[3] = 1.0);
    }
    image_of([width, height], pixels, depth).map_err(Failure::Ours)
}

fn image_of(
    [width, height]: [usize; 2],
    pixels: Vec<[f32; 4]>,
    depth: Option<Vec<f32>>,
) -> Result<Image, DecodeImageError> {
    // The data window's sides are 32-bit integers.
    let image = Image::new(width as u32, height as u32, pixels)?;
    Ok(match depth {
        Some(depth) => image.with_depth(depth)?,
        None => image,
    })
}

/// What a channel of a file is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Red, green, blue or alpha, by its place in a pixel.
    Channel(usize),
    /// Red, green and blue alike.
    Grey,
    Depth,
}

/// Puts a line's samples where they belong.
fn place<T: Data + Into<f32>>(
    role: Role,
    line: &LineRef<'_>,
    pixels: &mut [[f32; 4]],
    depth: Option<&mut [f32]>,
) -> Result<(), Error> {
    let samples = line.read_samples::<T>().map(|sample| sample.map(Into::into));
    match role {
        Role::Channel(channel) => {
            for (pixel, sample) in pixels.iter_mut().zip(samples) {
                pixel[channel] = sample?;
            }
        }
        Role::Grey => {
            for (pixel, sample) in pixels.iter_mut().zip(samples) {
                pixel[..3].fill(sample?);
            }
        }
        Role::Depth => {
            for (depth, sample) in depth.into_iter().flatten().zip(samples) {
                *depth = sample?;
            }
        }
    }
    Ok(())
}

/// The first part with colours, and the role of each of its channels.
fn choose_part(parts: &[Header]) -> Result<(usize, Vec<Option<Role>>), String> {
    for (index, part) in parts.iter().enumerate() {
        let has = |name: &str| part.channels.list.iter().any(|channel| channel.name.eq(name));
        let colored = has("R") && has("G") && has("B");
        if !colored && !has("Y") {
            continue;
        }
        let role = |channel: &ChannelDescription| match channel.name.to_string().as_str() {
            "R" if colored => Some(Role::Channel(0)),
            "G" if colored => Some(Role::Channel(1)),
            "B" if colored => Some(Role::Channel(2)),
            "A" => Some(Role::Channel(3)),
            "Y" if !colored => Some(Role::Grey),
            "Z" => Some(Role::Depth),
            _ => None,
        };
        let roles: Vec<_> = part.channels.list.iter().map(role).collect();
        let wanted = part.channels.list.iter().zip(&roles).filter(|(_, role)| role.is_some());
        if let Some((channel, _)) = wanted.into_iter().find(|(c, _)| c.sample_type == SampleType::U32) {
            return Err(format!("channel {} is of type uint, expected half or float", channel.name));
        }
        return Ok((index, roles));
    }
    let names = parts.iter().flat_map(|part| &part.channels.list).map(|channel| channel.name.to_string());
    let mut found = names.clone().take(12).collect::<Vec<_>>().join(", ");
    if names.count() > 12 {
        found.push_str(", ...");
    }
    Err(format!("found the channels {found}; expected R, G and B, or Y"))
}

/// Refuses what the decoder does not do, or does only at any cost.
fn check_part(part: &Header) -> Result<(), String> {
    if part.deep {
        return Err("deep data are not read; expected a flat image".into());
    }
    if let BlockDescription::Tiles(tiles) = part.blocks {
        let Vec2(width, height) = tiles.tile_size;
        if !(1..=MAX_TILE_SIDE).contains(&width) || !(1..=MAX_TILE_SIDE).contains(&height) {
            return Err(format!(
                "tiles of {width} x {height} pixels, expected sides of 1 to {MAX_TILE_SIDE}"
            ));
        }
    }
    Ok(())
}

/// Checks the part that is decoded, in a file of `file_bytes`.
fn check_channels(part: &Header, file_bytes: u64) -> Result<(), String> {
    if let Some(channel) = part.channels.list.iter().find(|channel| channel.sampling != Vec2(1, 1)) {
        let Vec2(x, y) = channel.sampling;
        return Err(format!("channel {} is subsampled by {x} x {y}, expected 1 x 1", channel.name));
    }
    use Compression::{PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    if !matches!(part.compression, Uncompressed | RLE | ZIP1 | ZIP16 | PIZ | PXR24) {
        return Err(format!("found {}, expected none, RLE, ZIP, PIZ or PXR24", part.compression));
    }
    let Vec2(width, height) = part.layer_size;
    let all =
        (width as u64).saturating_mul(height as u64).saturating_mul(part.channels.bytes_per_pixel as u64);
    if part.compression != PIZ && all / MAX_EXPANSION > file_bytes {
        return Err(format!(
            "{all} bytes of {width} x {height} pixels cannot be in a file of {file_bytes} bytes"
        ));
    }
    let pixels = match part.blocks {
        BlockDescription::ScanLines => width.checked_mul(part.compression.scan_lines_per_block().min(height)),
        BlockDescription::Tiles(tiles) => {
            tiles.tile_size.width().min(width).checked_mul(tiles.tile_size.height().min(height))
        }
    };
    let bytes = pixels.and_then(|pixels| pixels.checked_mul(part.channels.bytes_per_pixel));
    match bytes {
        Some(bytes) if bytes <= MAX_BLOCK_BYTES => Ok(()),
        _ => Err(format!(
            "{} channels and {width} x {height} pixels make blocks of more than {MAX_BLOCK_BYTES} bytes",
            part.channels.list.len()
        )),
    }
}
