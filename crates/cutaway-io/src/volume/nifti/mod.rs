//! NIfTI-1 and NIfTI-2: a binary header and voxels, in one file (`.nii`) or two (`.hdr` and `.img`), gzip-compressed
//! or not.
//!
//! Specifications: <https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h> and
//! <https://nifti.nimh.nih.gov/pub/dist/doc/nifti2.h>. Read: both byte orders, all scalar types but 128-bit floats,
//! one volume of several. Not read: complex and colour voxels, bits, Analyze 7.5 (it has no orientation). Extensions
//! behind the header are skipped.
//!
//! This is our own code rather than the `nifti` crate because that reads NIfTI-1 only, rescales in the output's type
//! (so that an integer type loses fractions), takes a NaN slope at its word, and bounds no allocation.

mod header;

use std::io::{self, Read};

use cutaway_core::volume::Volume;

use self::header::Header;
pub(super) use self::header::has_magic;
use super::Context;
use super::error::{Place, ReadError, quoted};
use super::layout::{Layout, Shape};
use super::payload::{self, Encoding, Parts, Payload, Skip};
use super::source::{OpenError, Stream};

/// Reads `.nii`, or `.hdr` with the voxels beside it.
pub(super) fn read(ctx: &mut Context<'_>, mut stream: Stream<'_>, name: &str) -> Result<Volume, ReadError> {
    let bytes = header_bytes(&mut stream)?;
    let header = Header::parse(ctx, &bytes)?;
    if !header.pair {
        return read_voxels(ctx, &header, stream, &bytes);
    }
    let folder = ctx.folder;
    let image = open_half(ctx, name, [".img", ".img.gz", ".IMG"]);
    let shown = ctx.beside(&image);
    let source = folder.open(&image).map_err(|error| half_error(shown.clone(), error))?;
    let stream = sniffed(&shown, source)?;
    read_voxels(ctx, &header, stream, &[])
}

/// Reads the pair whose `.img` was given.
pub(super) fn read_pair(ctx: &mut Context<'_>, image: Stream<'_>, name: &str) -> Result<Volume, ReadError> {
    let folder = ctx.folder;
    let header_name = open_half(ctx, name, [".hdr", ".hdr.gz", ".HDR"]);
    let shown = ctx.beside(&header_name);
    let source = folder.open(&header_name).map_err(|error| half_error(shown.clone(), error))?;
    let bytes = header_bytes(&mut sniffed(&shown, source)?)?;
    let image_name = std::mem::replace(&mut ctx.file, shown);
    let header = Header::parse(ctx, &bytes);
    ctx.file = image_name;
    read_voxels(ctx, &header?, image, &[])
}

/// The name of the other half of a pair: the first candidate that can be opened, or the first.
fn open_half(ctx: &Context<'_>, name: &str, endings: [&str; 3]) -> String {
    let lower = name.to_ascii_lowercase();
    let stem = lower.strip_suffix(".gz").unwrap_or(&lower);
    let stem = stem.strip_suffix(".hdr").or_else(|| stem.strip_suffix(".img")).unwrap_or(stem);
    // ASCII lower case keeps lengths, so the stem can be cut from the name as it is.
    let candidates = endings.map(|ending| format!("{}{ending}", &name[..stem.len()]));
    let found = candidates.iter().find(|name| !matches!(ctx.folder.open(name), Err(OpenError::Io(_))));
    found.unwrap_or(&candidates[0]).clone()
}

fn half_error(file: String, error: OpenError) -> ReadError {
    let error = match error {
        OpenError::Io(error) => error,
        OpenError::Outside => {
            io::Error::new(io::ErrorKind::PermissionDenied, "it is a link that leads out of the folder")
        }
    };
    ReadError::Open { file, error, hint: "a NIfTI pair is a .hdr and an .img file of one name, side by side" }
}

fn sniffed<'a>(file: &str, mut source: super::source::Source<'a>) -> Result<Stream<'a>, ReadError> {
    let head = source.head(3);
    let (_, inside) = head.map_err(|error| ReadError::Io { file: file.to_owned(), offset: 0, error })?;
    Ok(if inside.is_some() { Stream::gunzip(file, source) } else { Stream::plain(file, source) })
}

/// The first bytes of the file: as many as the larger header has, or as there are.
fn header_bytes(stream: &mut Stream<'_>) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    let read = stream.by_ref().take(header::LENGTH_1 as u64).read_to_end(&mut bytes);
    let read = read.and_then(|n| {
        let more = (header::LENGTH_2 - header::LENGTH_1) as u64;
        let second = n == header::LENGTH_1 && header::is_version_2(&bytes);
        if second { stream.by_ref().take(more).read_to_end(&mut bytes) } else { Ok(0) }
    });
    match read {
        Ok(_) => Ok(bytes),
        // What a damaged gzip file still gave is too short for a header, and the header says so.
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(bytes),
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData) => {
            Err(ReadError::Decode {
                file: stream.name().to_owned(),
                offset: stream.position(),
                encoding: "gzip",
                reason: error.to_string(),
            })
        }
        Err(error) => Err(ReadError::Io { file: stream.name().to_owned(), offset: stream.position(), error }),
    }
}

/// Reads the voxels from `stream`, of which `taken` has already been read.
fn read_voxels(
    ctx: &mut Context<'_>,
    header: &Header,
    stream: Stream<'_>,
    taken: &[u8],
) -> Result<Volume, ReadError> {
    let shape = Shape { dims: header.dims, components: 1, volumes: header.volumes, between: Vec::new() };
    let layout = Layout::new(ctx, shape, header.voxel, "dim", Place::Byte(header.dim_offset))?;
    let payload = Payload {
        encoding: Encoding::Raw,
        lines: 0,
        skip: Skip::Bytes(header.offset - taken.len() as u64),
        skip_decoded: Skip::Bytes(0),
        compressed: None,
        exact: false,
    };
    let bytes = payload::read(ctx, &layout, &payload, Parts::Attached(stream))?;
    ctx.finish(&layout, header.endian, bytes, header.rescale, header.geometry)
}

/// An error about a field of the header.
fn field_error(
    ctx: &Context<'_>,
    offset: u64,
    field: &'static str,
    found: String,
    expected: impl Into<String>,
) -> ReadError {
    let (file, place) = (ctx.file.clone(), Place::Byte(offset));
    ReadError::Field { file, place, field, found: found.into(), expected: expected.into(), hint: "" }
}

/// The bytes of a magic, for messages.
fn shown_magic(bytes: &[u8]) -> String {
    quoted(&bytes.iter().map(|&b| char::from(b)).collect::<String>())
}
