//! Raw voxels: no header, so something else must say what they are.
//!
//! In order: [`RawOptions`]; a JSON file beside the data (`foot_256x256x256_uint8.json` or `foot.json` for
//! `foot_256x256x256_uint8.raw`) with `size` or `dims`, `type`, `spacing`, `big_endian`, `header_bytes`; the name
//! itself, as the [open-scivis-datasets](https://klacansky.com/open-scivis-datasets/) write it. The world is voxel
//! times spacing. Nothing checks a raw file but its length, so the length must fit exactly.

use cutaway_core::volume::{Endian, Geometry, Rescale, Volume, VoxelType};
use glam::DVec3;

use super::Context;
use super::description;
use super::error::{Place, ReadError, number};
use super::layout::{Layout, Shape};
use super::payload::{self, Encoding, Parts, Payload, Skip};
use super::source::{Source, Stream};

const DESCRIBE: &str = "name the file like name_256x256x128_uint8.raw, put a .json file with \"dims\" and \"type\" beside it, or give dimensions and type as options";

/// What raw data are. Whatever is `None` is taken from the JSON file beside the data or from their name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawOptions {
    /// Voxels along x, y, z (x is fastest in the file).
    pub dims: Option<[u32; 3]>,
    /// Type of a voxel.
    pub voxel_type: Option<VoxelType>,
    /// World units a voxel along x, y, z; 1 where nothing says otherwise.
    pub spacing: Option<[f64; 3]>,
    /// Whether the most significant byte comes first; little-endian where nothing says otherwise.
    pub big_endian: Option<bool>,
    /// Bytes before the first voxel; none where nothing says otherwise.
    pub header_bytes: Option<u64>,
}

/// No voxel type is called what was asked for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{name}` is no voxel type; expected `uint8`, `int16`, `float32` or the like")]
pub struct UnknownVoxelType {
    /// The name asked for.
    pub name: String,
}

impl RawOptions {
    /// Whether these options alone turn any file into a volume.
    pub(crate) fn is_described(&self) -> bool {
        self.dims.is_some() && self.voxel_type.is_some()
    }

    /// These options, completed by others.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            dims: self.dims.or(other.dims),
            voxel_type: self.voxel_type.or(other.voxel_type),
            spacing: self.spacing.or(other.spacing),
            big_endian: self.big_endian.or(other.big_endian),
            header_bytes: self.header_bytes.or(other.header_bytes),
        }
    }
}

/// Whether the name says all that is needed.
pub(crate) fn is_described_by_name(name: &str) -> bool {
    from_name(name).is_some_and(|(_, options)| options.is_described())
}

/// Reads raw voxels, gzip-compressed or not.
pub(crate) fn read(ctx: &mut Context<'_>, mut source: Source<'_>, name: &str) -> Result<Volume, ReadError> {
    let options = describe(ctx, name)?;
    let (Some(dims), Some(voxel)) = (options.dims, options.voxel_type) else {
        let field = if options.dims.is_none() { "dims" } else { "type" };
        let found = "not known".into();
        let expected = "a description of the raw data".to_owned();
        let file = ctx.file.clone();
        return Err(ReadError::Field { file, place: Place::Whole, field, found, expected, hint: DESCRIBE });
    };
    let spacing = DVec3::from_array(options.spacing.unwrap_or([1.0; 3]));
    check_spacing(ctx, spacing)?;
    let endian = if options.big_endian == Some(true) { Endian::Big } else { Endian::Little };
    let header = options.header_bytes.unwrap_or(0);
    let shape = Shape { dims: dims.map(u64::from), components: 1, volumes: 1, between: Vec::new() };
    let layout = Layout::new(ctx, shape, voxel, "dims", Place::Whole)?;
    let expected = layout.total_bytes().saturating_add(header);
    let failed = |error| ReadError::Io { file: ctx.file.clone(), offset: 0, error };
    // A file of exactly the right length is not compressed, whatever its first voxels look like.
    let zipped = source.len() != expected && source.head(3).map_err(failed)?.1.is_some();
    if !zipped && source.len() > expected {
        let [x, y, z] = dims;
        return Err(ReadError::TooLong {
            file: ctx.file.clone(),
            found: format!("{} bytes", source.len()),
            expected: format!("{expected} ({x} x {y} x {z} {} and {header} bytes of header)", voxel.name()),
            hint: "correct the dimensions, the type or the number of header bytes",
        });
    }
    let stream = if zipped { Stream::gunzip(&ctx.file, source) } else { Stream::plain(&ctx.file, source) };
    let payload = Payload {
        encoding: Encoding::Raw,
        lines: 0,
        skip: Skip::Bytes(header),
        skip_decoded: Skip::Bytes(0),
        compressed: None,
        exact: true,
    };
    let bytes = payload::read(ctx, &layout, &payload, Parts::Attached(stream))?;
    ctx.finish(&layout, endian, bytes, Rescale::IDENTITY, Geometry::from_spacing(spacing))
}

fn check_spacing(ctx: &Context<'_>, spacing: DVec3) -> Result<(), ReadError> {
    if spacing.is_finite() && spacing.cmpgt(DVec3::ZERO).all() {
        return Ok(());
    }
    Err(ReadError::Field {
        file: ctx.file.clone(),
        place: Place::Whole,
        field: "spacing",
        found: spacing.to_array().map(number).join(" ").into(),
        expected: "three positive numbers".to_owned(),
        hint: "",
    })
}

/// All that is known about raw data of this name.
fn describe(ctx: &mut Context<'_>, name: &str) -> Result<RawOptions, ReadError> {
    let given = ctx.options.raw.clone();
    let (dataset, named) = from_name(name).unwrap_or((stem(name), RawOptions::default()));
    if let Some(beside) = description::read(ctx, &format!("{}.json", stem(name)))? {
        return Ok(given.or(beside).or(named));
    }
    // `foot_zfp8_256x256x256_uint8.raw` may be a variant of `foot`: what foot.json says counts if it agrees with the
    // name on what the name says.
    let mut parent = Some(dataset);
    while let Some(candidate) = parent.filter(|candidate| *candidate != stem(name) && !candidate.is_empty()) {
        if let Some(beside) = description::read(ctx, &format!("{candidate}.json"))? {
            let agrees = beside.dims == named.dims && beside.voxel_type == named.voxel_type;
            if agrees {
                return Ok(given.or(beside).or(named));
            }
        }
        parent = candidate.rsplit_once('_').map(|(shorter, _)| shorter);
    }
    Ok(given.or(named))
}

/// A file's name without `.raw`, `.raw.gz` or another extension.
fn stem(name: &str) -> &str {
    let name = name.strip_suffix(".gz").unwrap_or(name);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// The name of the data set, its dimensions and type, from `foot_256x256x256_uint8.raw`.
fn from_name(name: &str) -> Option<(&str, RawOptions)> {
    let stem = stem(name);
    let (front, last) = stem.rsplit_once('_')?;
    let (dataset, dims) = front.rsplit_once('_').unwrap_or(("", front));
    let dims = parse_dims(dims)?;
    let voxel_type = VoxelType::from_name(last)?;
    let options = RawOptions { dims: Some(dims), voxel_type: Some(voxel_type), ..RawOptions::default() };
    Some((dataset, options))
}

/// `256x256x128`.
fn parse_dims(text: &str) -> Option<[u32; 3]> {
    let dims: Option<Vec<u32>> = text
        .split(['x', 'X'])
        .map(|word| word.parse().ok().filter(|_| word.bytes().all(|b| b.is_ascii_digit())))
        .collect();
    dims?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_as_open_scivis_writes_them_describe_the_data() {
        let (dataset, options) = from_name("hydrogen_atom_128x64x32_float32.raw").unwrap();
        assert_eq!(dataset, "hydrogen_atom");
        assert_eq!(options.dims, Some([128, 64, 32]));
        assert_eq!(options.voxel_type, Some(VoxelType::F32));
        assert!(is_described_by_name("x_1x2x3_u16.raw.gz"));
        for other in [
            "foot.raw",
            "a_1x2_uint8.raw",
            "a_1x2x3_thing.raw",
            "a_+1x2x3_uint8.raw",
            "a_1x2x99999999999_uint8.raw",
        ] {
            assert!(!is_described_by_name(other), "{other}");
        }
    }
}
