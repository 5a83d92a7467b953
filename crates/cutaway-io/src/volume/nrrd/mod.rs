//! NRRD, versions 1 to 5, attached (`.nrrd`) or detached (`.nhdr`).
//!
//! Specification: <https://teem.sourceforge.net/nrrd/format.html>. Read: the encodings raw, gzip, bzip2, ascii and
//! hex; every scalar type; line and byte skips; data files by name, pattern and list; spaces, directions, origins,
//! spacings; list axes in front of, between and behind the three spatial ones (one of their volumes is read). Colours,
//! vectors and tensors are refused unless a component is chosen. Not read: block types, `zrl`.
//!
//! The world: with an anatomical `space` it is RAS (LPS and LAS are converted here); otherwise its axes mean what the
//! file's author meant.

mod axes;
mod header;

use cutaway_core::volume::{Endian, Rescale, Volume, VoxelType};

use self::header::{Data, Header};
use super::Context;
use super::detached::{self, Pattern};
use super::error::{Place, ReadError};
use super::fields::{Field, Fields};
use super::layout::Layout;
use super::payload::{self, Encoding, Parts, Payload, Skip};
use super::source::Stream;

/// Reads a NRRD file from its first byte.
pub(super) fn read(ctx: &mut Context<'_>, mut stream: Stream<'_>) -> Result<Volume, ReadError> {
    let header = Header::read(&mut stream)?;
    let fields = &header.fields;
    let voxel = voxel_type(fields)?;
    let encoding = encoding(fields)?;
    let endian = endian(fields, voxel, encoding)?;
    let (lines, skip) = skips(fields)?;
    let sizes = sizes(fields)?;
    let (shape, geometry) = axes::read(ctx, fields, &sizes)?;
    let place = Place::Line(fields.required("sizes", "the number of samples along each axis")?.line);
    let layout = Layout::new(ctx, shape, voxel, "sizes", place)?;
    // Compressed data are skipped into after decompression, text and raw data before.
    let compressed = matches!(encoding, Encoding::Gzip | Encoding::Bzip2);
    let payload = match skip {
        skip_decoded if compressed => {
            Payload { encoding, lines, skip: Skip::Bytes(0), skip_decoded, compressed: None, exact: false }
        }
        skip => {
            Payload { encoding, lines, skip, skip_decoded: Skip::Bytes(0), compressed: None, exact: false }
        }
    };
    let parts = match &header.data {
        None => Parts::Attached(stream),
        Some(data) => {
            let place = Place::Line(data.field().line);
            Parts::Files(data_files(ctx, fields, data, &sizes)?, place)
        }
    };
    let bytes = payload::read(ctx, &layout, &payload, parts)?;
    ctx.finish(&layout, encoding.endian(endian), bytes, Rescale::IDENTITY, geometry)
}

fn voxel_type(fields: &Fields) -> Result<VoxelType, ReadError> {
    let field = fields.required("type", "the type of the samples, such as uint8 or short")?;
    let words: Vec<String> = field.value.split_whitespace().map(str::to_ascii_lowercase).collect();
    Ok(match words.join(" ").as_str() {
        "signed char" | "int8" | "int8_t" => VoxelType::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => VoxelType::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => VoxelType::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => VoxelType::U16,
        "int" | "signed int" | "int32" | "int32_t" => VoxelType::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => VoxelType::U32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => VoxelType::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            VoxelType::U64
        }
        "float" | "float32" => VoxelType::F32,
        "double" | "float64" => VoxelType::F64,
        "block" => {
            return Err(fields.wrong(field, "a scalar type (opaque blocks are no voxels)"));
        }
        _ => {
            let expected = "signed char, uchar, short, ushort, int, uint, longlong, ulonglong, float, double or another name of one of them";
            return Err(fields.wrong(field, expected));
        }
    })
}

fn encoding(fields: &Fields) -> Result<Encoding, ReadError> {
    let field = fields.required("encoding", "raw, gzip, bzip2, ascii or hex")?;
    Ok(match field.value.to_ascii_lowercase().as_str() {
        "raw" => Encoding::Raw,
        "gz" | "gzip" => Encoding::Gzip,
        "bz2" | "bzip2" => Encoding::Bzip2,
        "txt" | "text" | "ascii" => Encoding::Ascii,
        "hex" => Encoding::Hex,
        _ => return Err(fields.wrong(field, "raw, gzip, bzip2, ascii or hex")),
    })
}

fn endian(fields: &Fields, voxel: VoxelType, encoding: Encoding) -> Result<Endian, ReadError> {
    if let Some(field) = fields.get("endian") {
        return match field.value.to_ascii_lowercase().as_str() {
            "little" => Ok(Endian::Little),
            "big" => Ok(Endian::Big),
            _ => Err(fields.wrong(field, "little or big")),
        };
    }
    if voxel.bytes() > 1 && encoding != Encoding::Ascii {
        fields.required("endian", "little or big, as samples have more than one byte")?;
    }
    Ok(Endian::Little)
}

/// Lines and bytes to skip in front of the data.
fn skips(fields: &Fields) -> Result<(u64, Skip), ReadError> {
    let lines = match fields.get("line skip") {
        Some(field) => fields.number(field, "a number of lines, at least 0")?,
        None => 0,
    };
    let Some(field) = fields.get("byte skip") else { return Ok((lines, Skip::Bytes(0))) };
    let bytes: i64 = fields.number(field, "a number of bytes, or -1")?;
    let skip = match u64::try_from(bytes) {
        Ok(n) => Skip::Bytes(n),
        Err(_) if bytes != -1 => return Err(fields.wrong(field, "a number of bytes, or -1")),
        // The specification has it for raw only, but everyone reads it for compressed data, too.
        Err(_) if matches!(encoding(fields)?, Encoding::Ascii | Encoding::Hex) => {
            return Err(fields.wrong(field, "a number of bytes (-1 is not for text)"));
        }
        Err(_) => Skip::UpToLast,
    };
    Ok((lines, skip))
}

fn sizes(fields: &Fields) -> Result<Vec<u64>, ReadError> {
    // The library that defines the format stops at 16, too.
    const MOST_AXES: usize = 16;
    let field = fields.required("dimension", "the number of axes")?;
    let dimension: usize = fields.number(field, "a number of axes from 1 to 16")?;
    if !(1..=MOST_AXES).contains(&dimension) {
        return Err(fields.wrong(field, "a number of axes from 1 to 16"));
    }
    let field = fields.required("sizes", "the number of samples along each axis")?;
    let sizes: Vec<u64> = fields.numbers(field, dimension, "sizes, as many as the dimension")?;
    if sizes.contains(&0) {
        return Err(fields.wrong(field, "sizes of at least 1"));
    }
    Ok(sizes)
}

/// The names of the data files.
fn data_files(
    ctx: &Context<'_>,
    fields: &Fields,
    data: &Data,
    sizes: &[u64],
) -> Result<Vec<String>, ReadError> {
    match data {
        Data::List { field, names } => {
            let dimension = field.value.split_whitespace().nth(1).map(str::to_owned);
            let expected = expected_files(fields, field, dimension.as_deref(), sizes)?;
            if !expected.accepts(names.len() as u64) {
                let found = format!("{} names below the header, {}", names.len(), expected.describe());
                return Err(fields.wrong(field, found));
            }
            Ok(names.clone())
        }
        // What exists under its own name is no pattern.
        Data::Named(field) => match pattern(field).filter(|_| !detached::exists(ctx.folder, &field.value)) {
            None => Ok(vec![field.value.clone()]),
            Some((pattern, range, dimension)) => {
                let expected = expected_files(fields, field, dimension, sizes)?;
                detached::names(&pattern, range, |count| expected.accepts(count)).map_err(|count| {
                    let wanted = format!("a pattern for {}", expected.describe());
                    fields.wrong(field, detached::count_text(&wanted, "for", count))
                })
            }
        },
    }
}

/// `name%03d.raw 1 10 1 [2]`: the pattern, its numbers and the dimension of each file.
fn pattern(field: &Field) -> Option<(Pattern, [i64; 3], Option<&str>)> {
    let words: Vec<&str> = field.value.split_whitespace().collect();
    let (name, numbers) = words.split_first()?;
    if !(3..=4).contains(&numbers.len()) {
        return None;
    }
    let pattern = Pattern::parse(name)?;
    let mut parsed = [0; 3];
    for (number, word) in parsed.iter_mut().zip(numbers) {
        *number = word.parse().ok()?;
    }
    Some((pattern, parsed, numbers.get(3).copied()))
}

/// How many data files there may be.
enum Files {
    /// One for each slab of the further axes.
    Exactly(u64),
    /// Slabs along the last axis, of equal thickness.
    Dividing(u64),
}

impl Files {
    fn accepts(&self, count: u64) -> bool {
        match *self {
            Self::Exactly(n) => count == n,
            Self::Dividing(n) => count > 0 && n % count == 0,
        }
    }

    fn describe(&self) -> String {
        match self {
            Self::Exactly(n) => format!("{n} files"),
            Self::Dividing(n) => format!("a number of files that divides {n}"),
        }
    }
}

/// How many files hold the data when each has `dimension` axes (one less than the whole where it does not say).
fn expected_files(
    fields: &Fields,
    field: &Field,
    dimension: Option<&str>,
    sizes: &[u64],
) -> Result<Files, ReadError> {
    let all = sizes.len();
    let each = match dimension {
        None => all - 1,
        Some(word) => word
            .parse()
            .ok()
            .filter(|d| (1..=all).contains(d))
            .ok_or_else(|| fields.wrong(field, format!("files of 1 to {all} dimensions")))?,
    };
    if each == all {
        return Ok(Files::Dividing(sizes[all - 1]));
    }
    let product = sizes[each..].iter().try_fold(1u64, |n, &size| n.checked_mul(size));
    product.map(Files::Exactly).ok_or_else(|| fields.wrong(field, "fewer files"))
}
