//! MetaImage: a text header (`.mhd`) with its data in other files, or both in one file (`.mha`).
//!
//! Documentation: <https://itk.org/Wiki/ITK/MetaIO/Documentation>. Read: binary, zlib-compressed and ASCII data,
//! local, in one file, in a list or a pattern of files, all scalar types, two to ten dimensions (of more than three, one
//! volume is read). Several channels are refused unless one is chosen.
//!
//! The world of MetaImage is LPS (as ITK reads and writes it, whatever `AnatomicalOrientation` says) and becomes RAS
//! here. Row `i` of `TransformMatrix` is the direction of axis `i`.

mod header;

use cutaway_core::space::{WorldFrame, ras_from_lps};
use cutaway_core::volume::{Endian, Geometry, Rescale, Volume, VoxelType};
use glam::{DAffine3, DMat3, DVec3};

use self::header::Header;
use super::Context;
use super::detached::{self, Pattern};
use super::error::{Place, ReadError, TUPLE_HINT};
use super::fields::{Field, Fields, words};
use super::layout::{Layout, Shape};
use super::payload::{self, Encoding, Parts, Payload, Skip};
use super::source::Stream;

/// Reads a MetaImage file from its first byte.
pub(super) fn read(ctx: &mut Context<'_>, mut stream: Stream<'_>) -> Result<Volume, ReadError> {
    let Header { fields, names } = Header::read(&mut stream)?;
    check_object(&fields)?;
    let components = channels(ctx, &fields)?;
    let sizes = sizes(&fields)?;
    let voxel = voxel_type(&fields)?;
    let geometry = geometry(ctx, &fields, sizes.len())?;
    let mut dims = [1; 3];
    let n = sizes.len().min(3);
    dims[..n].copy_from_slice(&sizes[..n]);
    let volumes = sizes[n..].iter().try_fold(1u64, |all, size| all.checked_mul(*size));
    let shape = Shape { dims, components, volumes: volumes.unwrap_or(u64::MAX), between: Vec::new() };
    let place = fields.get("DimSize").map_or(Place::Whole, |field| Place::Line(field.line));
    let layout = Layout::new(ctx, shape, voxel, "DimSize", place)?;
    let data = fields.required("ElementDataFile", "LOCAL, LIST or the name of the data file")?;
    let local = data.value.eq_ignore_ascii_case("local");
    let payload = payload(&fields, local, stream.position())?;
    let endian = endian(&fields)?;
    let parts = if local {
        Parts::Attached(stream)
    } else {
        Parts::Files(data_files(ctx, &fields, data, names, &sizes)?, Place::Line(data.line))
    };
    let bytes = payload::read(ctx, &layout, &payload, parts)?;
    intensity(ctx, &fields);
    ctx.finish(&layout, payload.encoding.endian(endian), bytes, Rescale::IDENTITY, geometry)
}

fn check_object(fields: &Fields) -> Result<(), ReadError> {
    if let Some(field) = fields.get("ObjectType")
        && !field.value.eq_ignore_ascii_case("image")
    {
        return Err(fields.wrong(field, "Image (meshes, tubes and other objects are no volumes)"));
    }
    Ok(())
}

fn channels(ctx: &Context<'_>, fields: &Fields) -> Result<u64, ReadError> {
    let Some(field) = fields.get("ElementNumberOfChannels") else { return Ok(1) };
    let channels: u64 = fields.number(field, "a number of channels, at least 1")?;
    if channels == 0 {
        return Err(fields.wrong(field, "a number of channels, at least 1"));
    }
    if channels > 1 && ctx.options.volume_index.is_none() {
        return Err(fields.wrong_with(field, "1 (no colours or vectors)", TUPLE_HINT));
    }
    Ok(channels)
}

fn sizes(fields: &Fields) -> Result<Vec<u64>, ReadError> {
    let field = fields.required("NDims", "the number of dimensions")?;
    let count: usize = fields.number(field, "2 to 10")?;
    // MetaIO has ten at most.
    if !(2..=10).contains(&count) {
        return Err(fields.wrong(field, "2 to 10"));
    }
    let field = fields.required("DimSize", "the number of voxels along each axis")?;
    let sizes: Vec<u64> = fields.numbers(field, count, "sizes, as many as NDims")?;
    if sizes.contains(&0) {
        return Err(fields.wrong(field, "sizes of at least 1"));
    }
    Ok(sizes)
}

fn voxel_type(fields: &Fields) -> Result<VoxelType, ReadError> {
    let field = fields.required("ElementType", "the type of a voxel, such as MET_SHORT")?;
    let name = field.value.to_ascii_uppercase();
    // MetaIO takes the names of its arrays, too.
    Ok(match name.strip_suffix("_ARRAY").unwrap_or(&name) {
        "MET_CHAR" => VoxelType::I8,
        "MET_UCHAR" => VoxelType::U8,
        "MET_SHORT" => VoxelType::I16,
        "MET_USHORT" => VoxelType::U16,
        // MetaIO's long has four bytes on every system.
        "MET_INT" | "MET_LONG" => VoxelType::I32,
        "MET_UINT" | "MET_ULONG" => VoxelType::U32,
        "MET_LONG_LONG" => VoxelType::I64,
        "MET_ULONG_LONG" => VoxelType::U64,
        "MET_FLOAT" => VoxelType::F32,
        "MET_DOUBLE" => VoxelType::F64,
        _ => {
            let expected = "MET_CHAR, MET_UCHAR, MET_SHORT, MET_USHORT, MET_INT, MET_UINT, MET_LONG, MET_ULONG, MET_LONG_LONG, MET_ULONG_LONG, MET_FLOAT or MET_DOUBLE";
            return Err(fields.wrong(field, expected));
        }
    })
}

/// MetaIO takes anything that begins like True for true.
fn flag(fields: &Fields, names: &[&str], default: bool) -> Result<bool, ReadError> {
    let Some(field) = fields.first(names) else { return Ok(default) };
    match field.value.as_bytes().first() {
        Some(b't' | b'T' | b'1') => Ok(true),
        Some(b'f' | b'F' | b'0') => Ok(false),
        _ => Err(fields.wrong(field, "True or False")),
    }
}

fn endian(fields: &Fields) -> Result<Endian, ReadError> {
    let big = flag(fields, &["BinaryDataByteOrderMSB", "ElementByteOrderMSB"], false)?;
    Ok(if big { Endian::Big } else { Endian::Little })
}

/// How the data are encoded and where they begin; `position` is the end of the header.
fn payload(fields: &Fields, local: bool, position: u64) -> Result<Payload, ReadError> {
    let compressed = flag(fields, &["CompressedData"], false)?;
    let encoding = match (flag(fields, &["BinaryData"], true)?, compressed) {
        (true, true) => Encoding::Zlib,
        (true, false) => Encoding::Raw,
        (false, _) => Encoding::Ascii,
    };
    let skip = match fields.get("HeaderSize") {
        None => Skip::Bytes(0),
        Some(field) => match fields.number::<i64>(field, "a number of bytes, or -1")? {
            // From the start of the file, even if that is the header itself; zero is what writers put by default.
            n if n > 0 => {
                let n = (n as u64).checked_sub(if local { position } else { 0 });
                Skip::Bytes(
                    n.ok_or_else(|| fields.wrong(field, format!("at least {position}, the header's end")))?,
                )
            }
            0 => Skip::Bytes(0),
            -1 if encoding == Encoding::Raw => Skip::UpToLast,
            -1 => {
                return Err(
                    fields.wrong(field, "a number of bytes (-1 is for uncompressed binary data only)")
                );
            }
            _ => return Err(fields.wrong(field, "a number of bytes, or -1")),
        },
    };
    let size = match fields.get("CompressedDataSize") {
        Some(field) if encoding == Encoding::Zlib => {
            let size: u64 = fields.number(field, "a number of bytes")?;
            // MetaIO: zero means that nobody counted.
            (size > 0).then_some(size)
        }
        _ => None,
    };
    Ok(Payload { encoding, lines: 0, skip, skip_decoded: Skip::Bytes(0), compressed: size, exact: false })
}

fn geometry(ctx: &mut Context<'_>, fields: &Fields, count: usize) -> Result<Geometry, ReadError> {
    let n = count.min(3);
    let mut spacing = DVec3::ONE;
    if let Some(field) = fields.first(&["ElementSpacing", "ElementSize"]) {
        let numbers = leading(ctx, fields, field, count, "distances, as many as NDims")?;
        if numbers[..n].iter().any(|d| *d == 0.0 || !d.is_finite()) {
            return Err(fields.wrong(field, "finite distances that are not 0"));
        }
        spacing = padded(&numbers[..n], 1.0);
    }
    let mut axes = DMat3::IDENTITY;
    if let Some(field) = fields.first(&["TransformMatrix", "Rotation", "Orientation"]) {
        let numbers: Vec<f64> =
            fields.numbers(field, count * count, "numbers, the rows of a square matrix")?;
        for i in 0..n {
            *axes.col_mut(i) = padded(&numbers[i * count..i * count + n], 0.0);
        }
        if !axes.is_finite() || axes.determinant().abs() < 1e-9 {
            return Err(fields.wrong(field, "the directions of the axes, finite and independent"));
        }
    }
    let mut origin = DVec3::ZERO;
    if let Some(field) = fields.first(&["Offset", "Position", "Origin"]) {
        let numbers = leading(ctx, fields, field, count, "coordinates, as many as NDims")?;
        origin = padded(&numbers[..n], 0.0);
        if !origin.is_finite() {
            return Err(fields.wrong(field, "finite coordinates"));
        }
    }
    let affine = DAffine3::from_mat3_translation(axes * DMat3::from_diagonal(spacing), origin);
    Ok(Geometry { world_from_voxel: ras_from_lps() * affine, frame: WorldFrame::Ras })
}

/// The first `count` numbers of a field that may have more of them, as ITK reads it.
fn leading(
    ctx: &mut Context<'_>,
    fields: &Fields,
    field: &Field,
    count: usize,
    what: &str,
) -> Result<Vec<f64>, ReadError> {
    let found = words(&field.value).count();
    if found <= count {
        return fields.numbers(field, count, what);
    }
    let mut numbers = fields.numbers(field, found, what)?;
    numbers.truncate(count);
    ctx.notice(format!("`{}` has {found} numbers for {count} axes: the first {count} are used", field.name));
    Ok(numbers)
}

/// Three numbers from two or three.
fn padded(numbers: &[f64], rest: f64) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|i| numbers.get(i).copied().unwrap_or(rest)))
}

/// The names of the data files.
fn data_files(
    ctx: &Context<'_>,
    fields: &Fields,
    data: &Field,
    names: Vec<String>,
    sizes: &[u64],
) -> Result<Vec<String>, ReadError> {
    let words: Vec<&str> = data.value.split_whitespace().collect();
    if words.first() == Some(&"LIST") {
        // `LIST 2D`: files of two dimensions. Otherwise, and where it makes no sense, of one less than the image.
        let each = words.get(1).and_then(|word| word.trim_end_matches(['D', 'd']).parse().ok());
        let each = each.filter(|each| (1..=sizes.len()).contains(each)).unwrap_or(sizes.len() - 1);
        let expected = sizes[each..].iter().try_fold(1u64, |n, &size| n.checked_mul(size));
        if expected != Some(names.len() as u64) {
            let expected = expected.map_or("fewer".to_owned(), |n| n.to_string());
            return Err(fields.wrong(data, format!("{expected} names below it, found {}", names.len())));
        }
        return Ok(names);
    }
    let slices = sizes[sizes.len() - 1];
    // What exists under its own name is no pattern, whatever signs are in it; nor is what has no `%d` in it.
    let there = detached::exists(ctx.folder, &data.value);
    let Some((pattern, range)) = pattern(data, slices).filter(|_| !there) else {
        return Ok(vec![data.value.clone()]);
    };
    detached::names(&pattern, range, |count| count == slices).map_err(|count| {
        let wanted = format!("a range of {slices} numbers, one for each slice");
        fields.wrong(data, detached::count_text(&wanted, "of", count))
    })
}

/// `name%03d.raw [min [max [step]]]`; the name may contain spaces where all three numbers follow.
fn pattern(data: &Field, slices: u64) -> Option<(Pattern, [i64; 3])> {
    let words: Vec<&str> = data.value.split_whitespace().collect();
    let numbers: Vec<i64> = words.iter().rev().take(3).map_while(|word| word.parse().ok()).collect();
    let name = words[..words.len() - numbers.len()].join(" ");
    let intervals = i64::try_from(slices).ok()? - 1;
    // `numbers` runs backwards.
    let range = match numbers[..] {
        [] => [1, 1i64.checked_add(intervals)?, 1],
        [min] => [min, min.checked_add(intervals)?, 1],
        [max, min] => [min, max, max.checked_sub(min)?.checked_div(intervals).unwrap_or(1).max(1)],
        [step, max, min, ..] => [min, max, step],
    };
    Some((Pattern::parse(&name)?, range))
}

/// Says so where the header asks for a rescaling, which ITK does not apply either.
fn intensity(ctx: &mut Context<'_>, fields: &Fields) {
    let differs =
        |name: &str, identity: f64| fields.get(name).is_some_and(|field| field.value.parse() != Ok(identity));
    if differs("ElementToIntensityFunctionSlope", 1.0) || differs("ElementToIntensityFunctionOffset", 0.0) {
        ctx.notice(
            "ElementToIntensityFunction is ignored, as ITK does: values are taken as stored".to_owned(),
        );
    }
}
