//! The header of NIfTI-1 (348 bytes) and NIfTI-2 (540 bytes), and the grid that it describes.

use cutaway_core::space::WorldFrame;
use cutaway_core::volume::{Endian, Geometry, Rescale, VoxelType};
use glam::{DAffine3, DMat3, DQuat, DVec3, DVec4};

use super::{field_error, shown_magic};
use crate::volume::Context;
use crate::volume::error::{ReadError, TUPLE_HINT, number};

pub(crate) const LENGTH_1: usize = 348;
pub(crate) const LENGTH_2: usize = 540;

/// Where the fields lie that both versions have.
struct Offsets {
    length: usize,
    magic: usize,
    dim: usize,
    intent: usize,
    datatype: usize,
    bitpix: usize,
    pixdim: usize,
    vox_offset: usize,
    slope: usize,
    intercept: usize,
    units: usize,
    qform_code: usize,
    sform_code: usize,
    quatern: usize,
    qoffset: usize,
    srow: usize,
}

const VERSION_1: Offsets = Offsets {
    length: LENGTH_1,
    magic: 344,
    dim: 40,
    intent: 68,
    datatype: 70,
    bitpix: 72,
    pixdim: 76,
    vox_offset: 108,
    slope: 112,
    intercept: 116,
    units: 123,
    qform_code: 252,
    sform_code: 254,
    quatern: 256,
    qoffset: 268,
    srow: 280,
};

const VERSION_2: Offsets = Offsets {
    length: LENGTH_2,
    magic: 4,
    dim: 16,
    intent: 504,
    datatype: 12,
    bitpix: 14,
    pixdim: 104,
    vox_offset: 168,
    slope: 176,
    intercept: 184,
    units: 500,
    qform_code: 344,
    sform_code: 348,
    quatern: 352,
    qoffset: 376,
    srow: 400,
};

/// What the header says, checked.
#[derive(Debug)]
pub(super) struct Header {
    /// The voxels lie in another file.
    pub pair: bool,
    pub endian: Endian,
    pub dims: [u64; 3],
    /// Where the dimensions stand, for errors.
    pub dim_offset: u64,
    pub volumes: u64,
    pub voxel: VoxelType,
    /// Bytes in front of the voxels in their file.
    pub offset: u64,
    pub rescale: Rescale,
    pub geometry: Geometry,
}

/// Whether bytes begin as NIfTI does.
pub(crate) fn has_magic(head: &[u8]) -> bool {
    let one = matches!(head.get(344..348), Some(b"n+1\0" | b"ni1\0"));
    let two = matches!(head.get(4..8), Some(b"n+2\0" | b"ni2\0"));
    match length_field(head) {
        Some((LENGTH_1, _)) => one,
        Some(_) => two,
        None => false,
    }
}

pub(super) fn is_version_2(head: &[u8]) -> bool {
    length_field(head).is_some_and(|(length, _)| length == LENGTH_2)
}

/// The header's first field, its own length, which tells the version and the byte order.
fn length_field(head: &[u8]) -> Option<(usize, Endian)> {
    let field: [u8; 4] = head.get(..4)?.try_into().ok()?;
    let stated = [LENGTH_1, LENGTH_2].into_iter().find_map(|length| {
        let little = u32::from_le_bytes(field) as usize == length;
        let big = u32::from_be_bytes(field) as usize == length;
        (little || big).then_some((length, if little { Endian::Little } else { Endian::Big }))
    });
    stated.or_else(|| Some((LENGTH_1, unstated_order(head)?)))
}

/// The byte order of a header of the first version that has its magic, but not its own length in front, as some writers
/// leave it: the order in which the number of dimensions makes sense.
fn unstated_order(head: &[u8]) -> Option<Endian> {
    if !matches!(head.get(344..348), Some(b"n+1\0" | b"ni1\0")) {
        return None;
    }
    match head.get(40..42) {
        Some([1..=7, 0]) => Some(Endian::Little),
        Some([0, 1..=7]) => Some(Endian::Big),
        _ => None,
    }
}

/// The header's bytes, read in its byte order.
struct Raw<'b> {
    bytes: &'b [u8],
    endian: Endian,
    at: &'static Offsets,
}

impl Raw<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut field: [u8; N] = self.bytes[at..at + N].try_into().expect("the header's length was checked");
        if self.endian == Endian::Big {
            field.reverse();
        }
        field
    }

    fn second_version(&self) -> bool {
        self.at.length == LENGTH_2
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.bytes(at))
    }

    /// The `i`-th of a list of reals: f32 in the first version, f64 in the second.
    fn real(&self, at: usize, i: usize) -> f64 {
        if self.second_version() {
            f64::from_le_bytes(self.bytes(at + 8 * i))
        } else {
            f64::from(f32::from_le_bytes(self.bytes(at + 4 * i)))
        }
    }

    fn reals(&self, at: usize, first: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|i| self.real(at, first + i)))
    }

    fn code(&self, at: usize) -> i32 {
        if self.second_version() { i32::from_le_bytes(self.bytes(at)) } else { i32::from(self.i16(at)) }
    }

    fn dim(&self, i: usize) -> i64 {
        if self.second_version() {
            i64::from_le_bytes(self.bytes(self.at.dim + 8 * i))
        } else {
            i64::from(self.i16(self.at.dim + 2 * i))
        }
    }
}

impl Header {
    /// Parses and checks the header at the start of `bytes`.
    pub(super) fn parse(ctx: &mut Context<'_>, bytes: &[u8]) -> Result<Self, ReadError> {
        let raw = recognise(ctx, bytes)?;
        let magic = &bytes[raw.at.magic..raw.at.magic + 4];
        let pair = match magic {
            b"n+1\0" | b"n+2\0" => false,
            b"ni1\0" | b"ni2\0" => true,
            _ => {
                let expected =
                    "\"n+1\", \"ni1\", \"n+2\" or \"ni2\" (Analyze 7.5 files, which have none, are not read)";
                return Err(field_error(ctx, raw.at.magic as u64, "magic", shown_magic(magic), expected));
            }
        };
        check_intent(ctx, &raw)?;
        let (dims, volumes) = dimensions(ctx, &raw)?;
        let voxel = voxel_type(ctx, &raw)?;
        Ok(Self {
            pair,
            endian: raw.endian,
            dims,
            dim_offset: raw.at.dim as u64,
            volumes,
            voxel,
            offset: data_offset(ctx, &raw, pair)?,
            rescale: rescale(ctx, &raw),
            geometry: geometry(ctx, &raw),
        })
    }
}

fn recognise<'b>(ctx: &Context<'_>, bytes: &'b [u8]) -> Result<Raw<'b>, ReadError> {
    let too_short = |expected: usize| ReadError::TooShort {
        file: ctx.file.clone(),
        what: "header",
        found: bytes.len() as u64,
        expected: format!("{expected} bytes"),
    };
    if bytes.len() < 4 {
        return Err(too_short(LENGTH_1));
    }
    let Some((length, endian)) = length_field(bytes) else {
        let found = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]).to_string();
        return Err(field_error(ctx, 0, "sizeof_hdr", found, "348 (NIfTI-1) or 540 (NIfTI-2)"));
    };
    if bytes.len() < length {
        return Err(too_short(length));
    }
    let at = if length == LENGTH_1 { &VERSION_1 } else { &VERSION_2 };
    Ok(Raw { bytes, endian, at })
}

/// Refuses what is no volume of numbers, by its intent code.
fn check_intent(ctx: &Context<'_>, raw: &Raw<'_>) -> Result<(), ReadError> {
    let code = raw.code(raw.at.intent);
    let refused = |what: &str, hint| {
        let (file, found) = (ctx.file.clone(), format!("the intent code is {code}: {what}"));
        Err(ReadError::Unsupported { file, found, hint })
    };
    let not_here = "a volume has its values in voxels; convert the file, or give the scan that it belongs to";
    match code {
        3000..=3099 => refused("values on a surface or between regions (CIFTI), not a volume", not_here),
        1008 => refused("points of a surface, not a volume", not_here),
        1009 => refused("triangles of a surface, not a volume", not_here),
        1004 | 1005 | 1006 | 1007 | 1010 | 2003 | 2004 if ctx.options.volume_index.is_none() => {
            let what = match code {
                1004 | 1005 => "a matrix per voxel",
                1006 => "a displacement per voxel",
                1007 => "a vector per voxel",
                1010 => "a quaternion per voxel",
                _ => "a colour per voxel",
            };
            refused(what, TUPLE_HINT)
        }
        _ => Ok(()),
    }
}

/// Voxels along x, y, z, and how many volumes the further dimensions make.
fn dimensions(ctx: &Context<'_>, raw: &Raw<'_>) -> Result<([u64; 3], u64), ReadError> {
    let at = raw.at.dim as u64;
    let count = raw.dim(0);
    if !(1..=7).contains(&count) {
        return Err(field_error(ctx, at, "dim[0]", count.to_string(), "a number of dimensions from 1 to 7"));
    }
    let mut dims = [1; 3];
    let mut volumes = 1u64;
    for i in 1..=count as usize {
        const NAMES: [&str; 4] = ["dim", "dim[1]", "dim[2]", "dim[3]"];
        let size = raw.dim(i);
        let offset = at + i as u64 * if raw.second_version() { 8 } else { 2 };
        match u64::try_from(size) {
            // Writers leave zeros in the dimensions that a volume does not have.
            _ if i > 3 && size <= 0 => {}
            Ok(size) if size > 0 && i <= 3 => dims[i - 1] = size,
            Ok(size) if size > 0 => {
                volumes = volumes.checked_mul(size).ok_or_else(|| {
                    field_error(ctx, offset, "dim", size.to_string(), "fewer than 2^64 volumes")
                })?;
            }
            _ => return Err(field_error(ctx, offset, NAMES[i], size.to_string(), "at least 1")),
        }
    }
    Ok((dims, volumes))
}

fn voxel_type(ctx: &mut Context<'_>, raw: &Raw<'_>) -> Result<VoxelType, ReadError> {
    let code = raw.i16(raw.at.datatype);
    let refused = match code {
        2 => Ok(VoxelType::U8),
        4 => Ok(VoxelType::I16),
        8 => Ok(VoxelType::I32),
        16 => Ok(VoxelType::F32),
        64 => Ok(VoxelType::F64),
        256 => Ok(VoxelType::I8),
        512 => Ok(VoxelType::U16),
        768 => Ok(VoxelType::U32),
        1024 => Ok(VoxelType::I64),
        1280 => Ok(VoxelType::U64),
        1 => Err("1 (bits)"),
        32 => Err("32 (complex64)"),
        128 => Err("128 (RGB colours)"),
        1536 => Err("1536 (float128)"),
        1792 => Err("1792 (complex128)"),
        2048 => Err("2048 (complex256)"),
        2304 => Err("2304 (RGBA colours)"),
        _ => Err(""),
    };
    let voxel = refused.map_err(|name| {
        let found = if name.is_empty() { code.to_string() } else { name.to_owned() };
        let expected = "the code of a scalar type: 2, 4, 8, 16, 64, 256, 512, 768, 1024 or 1280";
        field_error(ctx, raw.at.datatype as u64, "datatype", found, expected)
    })?;
    let bits = i64::from(raw.i16(raw.at.bitpix));
    if bits != 8 * voxel.bytes() as i64 {
        ctx.notice(format!("bitpix is {bits}, though voxels are {}: the type is believed", voxel.name()));
    }
    Ok(voxel)
}

/// Bytes in front of the voxels.
fn data_offset(ctx: &mut Context<'_>, raw: &Raw<'_>, pair: bool) -> Result<u64, ReadError> {
    let at = raw.at.vox_offset as u64;
    // Four bytes after the header say whether extensions follow.
    let least = if pair { 0 } else { raw.at.length as u64 + 4 };
    let (offset, found) = if raw.second_version() {
        let value = i64::from_le_bytes(raw.bytes(raw.at.vox_offset));
        (u64::try_from(value).ok(), value.to_string())
    } else {
        let value = raw.real(raw.at.vox_offset, 0);
        if value.fract() != 0.0 && value >= least as f64 {
            ctx.notice(format!("vox_offset is {value}: {} is used", value.floor()));
        }
        let whole = (0.0..9.0e15).contains(&value);
        (whole.then_some(value as u64), number(value))
    };
    match offset {
        Some(0) if !pair => {
            ctx.notice(format!("vox_offset is 0, which would be inside the header: {least} taken"));
            Ok(least)
        }
        Some(offset) if offset >= least => Ok(offset),
        _ => Err(field_error(ctx, at, "vox_offset", found, format!("a whole number of at least {least}"))),
    }
}

fn rescale(ctx: &mut Context<'_>, raw: &Raw<'_>) -> Rescale {
    let (slope, intercept) = (raw.real(raw.at.slope, 0), raw.real(raw.at.intercept, 0));
    // The specification: a slope of zero means that there is no rescaling. Writers use NaN for the same.
    if slope == 0.0 || !slope.is_finite() {
        if slope.is_infinite() {
            ctx.notice("scl_slope is infinite: values are taken as stored".to_owned());
        }
        return Rescale::IDENTITY;
    }
    if !intercept.is_finite() {
        ctx.notice(format!("scl_inter is {intercept}: 0 taken"));
        return Rescale { slope, intercept: 0.0 };
    }
    Rescale { slope, intercept }
}

/// Where the grid lies: by the sform where there is one, else by the qform, else by the voxel sizes alone.
fn geometry(ctx: &mut Context<'_>, raw: &Raw<'_>) -> Geometry {
    let to_mm = DAffine3::from_scale(DVec3::splat(unit_in_mm(raw)));
    let placed = |affine| Geometry { world_from_voxel: to_mm * affine, frame: WorldFrame::Ras };
    if raw.code(raw.at.sform_code) > 0 {
        let affine = sform(raw);
        if is_invertible(&affine) {
            return placed(affine);
        }
        ctx.notice("the sform is singular or not finite: it is ignored".to_owned());
    }
    let spacing = spacing(ctx, raw);
    if raw.code(raw.at.qform_code) > 0 {
        let affine = qform(ctx, raw, spacing);
        if is_invertible(&affine) {
            return placed(affine);
        }
        ctx.notice("the qform is singular or not finite: it is ignored".to_owned());
    }
    Geometry::from_spacing(spacing * unit_in_mm(raw))
}

fn unit_in_mm(raw: &Raw<'_>) -> f64 {
    let code = if raw.second_version() { raw.code(raw.at.units) } else { i32::from(raw.bytes[raw.at.units]) };
    match code & 7 {
        1 => 1000.0,
        3 => 0.001,
        _ => 1.0,
    }
}

fn is_invertible(affine: &DAffine3) -> bool {
    let m = &affine.matrix3;
    let skewness = m.determinant() / (m.x_axis.length() * m.y_axis.length() * m.z_axis.length());
    // The core asks for 1e-6.
    affine.is_finite() && affine.inverse().is_finite() && skewness.abs() > 1e-6
}

fn sform(raw: &Raw<'_>) -> DAffine3 {
    let row = |r: usize| {
        let at = 4 * r;
        DVec4::from_array([0, 1, 2, 3].map(|i| raw.real(raw.at.srow, at + i)))
    };
    let (x, y, z) = (row(0), row(1), row(2));
    let rows = DMat3::from_cols(x.truncate(), y.truncate(), z.truncate());
    DAffine3::from_mat3_translation(rows.transpose(), DVec3::new(x.w, y.w, z.w))
}

fn qform(ctx: &mut Context<'_>, raw: &Raw<'_>, spacing: DVec3) -> DAffine3 {
    let v = raw.reals(raw.at.quatern, 0);
    if !v.is_finite() {
        // Not invertible: the caller says that it is ignored.
        return DAffine3::from_scale(DVec3::NAN);
    }
    // b, c, d are the vector part of a unit quaternion. Where they are of unit length but for rounding, the rotation
    // is by half a turn; the root would make a visible angle of the rounding error.
    let epsilon = if raw.second_version() { f64::EPSILON } else { f64::from(f32::EPSILON) };
    let rest = 1.0 - v.length_squared();
    if rest < -10.0 * epsilon {
        let square = number(v.length_squared());
        ctx.notice(format!(
            "quatern_b, _c and _d of the qform have squares that sum to {square}, more than 1: made a unit quaternion"
        ));
    }
    let rotation = if rest > 3.0 * epsilon {
        DQuat::from_xyzw(v.x, v.y, v.z, rest.sqrt())
    } else {
        let n = v.normalize_or_zero();
        DQuat::from_xyzw(n.x, n.y, n.z, 0.0)
    };
    // pixdim[0] is the handedness: -1 flips the third axis.
    let handedness = if raw.real(raw.at.pixdim, 0) < 0.0 { -1.0 } else { 1.0 };
    let scale = DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, handedness));
    DAffine3::from_mat3_translation(DMat3::from_quat(rotation) * scale, raw.reals(raw.at.qoffset, 0))
}

/// Voxel sizes, made usable: no sign, and 1 where a size is zero or no number.
fn spacing(ctx: &mut Context<'_>, raw: &Raw<'_>) -> DVec3 {
    let found = raw.reals(raw.at.pixdim, 1);
    let usable = |size: f64| if size.is_finite() && size != 0.0 { size.abs() } else { 1.0 };
    let repaired = DVec3::from_array(found.to_array().map(usable));
    let needed = raw.dim(0).clamp(1, 3) as usize;
    if found.to_array()[..needed] != repaired.to_array()[..needed] {
        ctx.notice(format!(
            "voxel sizes (pixdim) are {}: {} used",
            found.to_array().map(number).join(" x "),
            repaired.to_array().map(number).join(" x ")
        ));
    }
    repaired
}
