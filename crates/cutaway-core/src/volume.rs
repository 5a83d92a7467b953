//! A volume: voxels on a regular grid and where they lie in the world.
//!
//! What enters: dimensions, voxels of any of ten scalar types, a grid-to-world affine. What leaves: a [`Volume`] that
//! every renderer can trust. 8- and 16-bit data stay 8 and 16 bit in memory: signed voxels are stored with an offset
//! ([`Rescale`]), as are wide integers whose range fits in 16 bits. Everything else becomes f32, with an offset and a
//! factor where 32 bits need them.
//!
//! Arrays are x fastest, then y, then z. The volume occupies the box between its outermost voxel *centres*.

mod convert;
mod missing;

use std::sync::Arc;

use std::borrow::Cow;

use glam::{DAffine3, DVec3, UVec3};
use rayon::prelude::*;

pub use self::convert::StorageLoss;
use self::missing::MissingVoxels;
pub use self::missing::NanMeaning;
use crate::clip::MissingCells;
use crate::space::{WorldFrame, orientation_letters};

/// The scalar type that a file or an array had.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it")]
pub enum VoxelType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl VoxelType {
    /// Size of one voxel in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The name as open-scivis and NumPy write it: `uint8`, `int16`, `float32`, ...
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "uint8",
            Self::I8 => "int8",
            Self::U16 => "uint16",
            Self::I16 => "int16",
            Self::U32 => "uint32",
            Self::I32 => "int32",
            Self::U64 => "uint64",
            Self::I64 => "int64",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    /// Whether it holds whole numbers only.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Parses the names of [`VoxelType::name`] and the short ones (`u8`, `i16`, `f32`, ...).
    pub fn from_name(name: &str) -> Option<Self> {
        const ALL: [VoxelType; 10] = [
            VoxelType::U8,
            VoxelType::I8,
            VoxelType::U16,
            VoxelType::I16,
            VoxelType::U32,
            VoxelType::I32,
            VoxelType::U64,
            VoxelType::I64,
            VoxelType::F32,
            VoxelType::F64,
        ];
        let name = name.to_ascii_lowercase();
        ALL.into_iter().find(|t| {
            let bits = 8 * t.bytes();
            let short = format!("{}{bits}", &t.name()[..1]);
            name == t.name() || name == short
        })
    }
}

/// Byte order of voxels in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Endian {
    /// Least significant byte first.
    Little,
    /// Most significant byte first.
    Big,
}

/// How a stored number becomes a value: `value = slope * stored + intercept`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rescale {
    /// Factor; never zero, always finite.
    pub slope: f64,
    /// Offset, in units of the value.
    pub intercept: f64,
}

impl Rescale {
    /// Stored numbers are the values.
    pub const IDENTITY: Self = Self { slope: 1.0, intercept: 0.0 };

    /// The value of a stored number.
    #[inline]
    pub fn value(&self, stored: f64) -> f64 {
        self.slope * stored + self.intercept
    }

    /// The (fractional) stored number of a value.
    #[inline]
    pub fn stored(&self, value: f64) -> f64 {
        (value - self.intercept) / self.slope
    }

    /// The stored number of an isovalue: the one of exactly this value if there is one, for voxels of that value are on the
    /// surface, and rounding would leave them on either side of it.
    pub fn stored_level(&self, value: f64) -> f64 {
        let stored = self.stored(value);
        // Whatever is stored is an f32.
        let nearest = f64::from(stored as f32);
        if self.value(nearest) == value { nearest } else { stored }
    }
}

/// Where a grid lies in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Maps voxel indices (centres at integers) to world positions. May be oblique, anisotropic, left-handed, sheared.
    pub world_from_voxel: DAffine3,
    /// What the world axes mean.
    pub frame: WorldFrame,
}

impl Geometry {
    /// A grid with its axes along the world's, its first voxel at the origin. `spacing` in world units a voxel.
    pub fn from_spacing(spacing: DVec3) -> Self {
        Self { world_from_voxel: DAffine3::from_scale(spacing), frame: WorldFrame::Unknown }
    }
}

/// Voxels as they lie in memory, x fastest. Stored numbers, not values: see [`Rescale`].
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Voxels {
    U8(Vec<u8>),
    U16(Vec<u16>),
    F32(Vec<f32>),
}

impl Voxels {
    /// Number of voxels.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U16(v) => v.len(),
            Self::F32(v) => v.len(),
        }
    }

    /// Whether there is no voxel at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::U16(v) => 2 * v.len(),
            Self::F32(v) => 4 * v.len(),
        }
    }

    /// The stored number at a linear index.
    #[inline]
    pub fn get(&self, index: usize) -> f32 {
        match self {
            Self::U8(v) => f32::from(v[index]),
            Self::U16(v) => f32::from(v[index]),
            Self::F32(v) => v[index],
        }
    }
}

/// Runs `$body` with `$voxels` bound to the typed slice of a [`Voxels`].
#[macro_export]
macro_rules! with_voxels {
    ($source:expr, $voxels:ident => $body:expr) => {
        match $source {
            $crate::volume::Voxels::U8($voxels) => $body,
            $crate::volume::Voxels::U16($voxels) => $body,
            $crate::volume::Voxels::F32($voxels) => $body,
        }
    };
}

/// Why a volume could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// The buffer length and the dimensions disagree.
    #[error("expected {expected} voxels for {}, found {found}", times(dimensions))]
    VoxelCount {
        /// Voxels along x, y, z.
        dimensions: UVec3,
        /// Their product.
        expected: usize,
        /// Voxels in the buffer.
        found: usize,
    },
    /// A dimension is zero, or the product does not fit in memory's address range.
    #[error(
        "dimensions {} are not a volume: each must be at least 1 and their product must fit in memory",
        times(dimensions)
    )]
    Dimensions {
        /// Voxels along x, y, z.
        dimensions: UVec3,
    },
    /// The affine cannot be inverted or is not finite.
    #[error("the voxel-to-world transform is {what}; its columns are {columns:?}")]
    Geometry {
        /// `not finite` or `singular`.
        what: &'static str,
        /// Columns of the linear part.
        columns: [[f64; 3]; 3],
    },
    /// Slope zero, NaN or infinite.
    #[error(
        "value = {slope} * stored + {intercept} is not a rescale: the slope must be finite and not zero, the intercept finite"
    )]
    Rescale {
        /// Factor found.
        slope: f64,
        /// Offset found.
        intercept: f64,
    },
    /// Stored numbers are finite, and their values are not.
    #[error("the values go from {:e} to {:e}; expected numbers and differences that 64 bits hold, up to 1.8e308", range[0], range[1])]
    Range {
        /// Smallest and largest value.
        range: [f64; 2],
    },
}

fn times(d: &UVec3) -> String {
    format!("{} x {} x {}", d.x, d.y, d.z)
}

/// A scalar that a volume can be made of.
pub trait Voxel: Copy + Send + Sync + 'static {
    /// Its type tag.
    const TYPE: VoxelType;
    /// Zero.
    const ZERO: Self;
    /// The scalar from its bytes in native order; `bytes.len()` is the size of the type.
    fn from_ne(bytes: &[u8]) -> Self;
    /// The scalar as f64 (64-bit integers round).
    fn to_f64(self) -> f64;
    /// `self - other`; exact for integers whose difference an f64 holds, whatever they are themselves.
    fn minus(self, other: Self) -> f64;
}

macro_rules! voxel {
    ($($t:ty => $tag:ident, $wide:ty);*) => {$(
        impl Voxel for $t {
            const TYPE: VoxelType = VoxelType::$tag;
            const ZERO: Self = 0 as $t;
            #[inline]
            fn from_ne(bytes: &[u8]) -> Self {
                <$t>::from_ne_bytes(bytes.try_into().expect("callers pass one voxel"))
            }
            #[inline]
            fn to_f64(self) -> f64 { self as f64 }
            #[inline]
            fn minus(self, other: Self) -> f64 { (self as $wide - other as $wide) as f64 }
        }
    )*};
}
voxel!(u8 => U8, i64; i8 => I8, i64; u16 => U16, i64; i16 => I16, i64; u32 => U32, i64; i32 => I32, i64;
    u64 => U64, i128; i64 => I64, i128; f32 => F32, f64; f64 => F64, f64);

/// Voxels on a regular grid, their meaning and their place in the world. Cloning shares the voxels.
#[derive(Clone, Debug)]
pub struct Volume {
    dimensions: UVec3,
    voxels: Arc<Voxels>,
    rescale: Rescale,
    geometry: Geometry,
    voxel_from_world: DAffine3,
    source_type: VoxelType,
    stored_range: [f32; 2],
    value_range: [f64; 2],
    replaced: usize,
    loss: Option<StorageLoss>,
    missing: Option<Arc<Missing>>,
}

/// Voxels without a value, and the cells that show nothing because of them.
#[derive(Clone, Debug)]
struct Missing {
    voxels: MissingVoxels,
    cells: Option<Arc<MissingCells>>,
}

impl Volume {
    /// A volume from voxels in memory.
    ///
    /// `dimensions`: voxels along x, y, z; `voxels`: their product, x fastest; `rescale`: what a stored number means.
    /// NaN voxels are missing (see [`Volume::missing`] and [`Volume::with_nan`]), infinite ones are replaced by the nearest
    /// finite extreme; [`Volume::replaced`] counts both.
    pub fn new<T: Voxel>(
        dimensions: UVec3,
        voxels: Vec<T>,
        rescale: Rescale,
        geometry: Geometry,
    ) -> Result<Self, VolumeError> {
        let expected = voxel_count(dimensions)?;
        if voxels.len() != expected {
            return Err(VolumeError::VoxelCount { dimensions, expected, found: voxels.len() });
        }
        let stored = store(voxels);
        Self::from_stored(dimensions, stored, rescale, geometry, T::TYPE)
    }

    /// A volume from a file's bytes: `bytes.len()` must be the voxel count times the size of `voxel_type`.
    /// 8-bit data are taken over without a copy, 16-bit data are copied once.
    pub fn from_bytes(
        dimensions: UVec3,
        voxel_type: VoxelType,
        endian: Endian,
        mut bytes: Vec<u8>,
        rescale: Rescale,
        geometry: Geometry,
    ) -> Result<Self, VolumeError> {
        let expected = voxel_count(dimensions)?;
        let size = voxel_type.bytes();
        if bytes.len() / size != expected || !bytes.len().is_multiple_of(size) {
            return Err(VolumeError::VoxelCount { dimensions, expected, found: bytes.len() / size });
        }
        let native = if cfg!(target_endian = "little") { Endian::Little } else { Endian::Big };
        if endian != native && size > 2 {
            bytes
                .par_chunks_mut(CHUNK * size)
                .for_each(|c| c.chunks_exact_mut(size).for_each(<[u8]>::reverse));
        }
        let stored = match voxel_type {
            VoxelType::U8 => Stored::exact(Voxels::U8(bytes), 0.0),
            VoxelType::I8 => {
                bytes.par_chunks_mut(CHUNK).for_each(|c| c.iter_mut().for_each(|b| *b ^= 0x80));
                Stored::exact(Voxels::U8(bytes), I8_OFFSET)
            }
            VoxelType::U16 => Stored::exact(Voxels::U16(words(bytes, endian, 0)), 0.0),
            VoxelType::I16 => Stored::exact(Voxels::U16(words(bytes, endian, 0x8000)), I16_OFFSET),
            VoxelType::U32 => store::<u32>(typed(&bytes)),
            VoxelType::I32 => store::<i32>(typed(&bytes)),
            VoxelType::U64 => store::<u64>(typed(&bytes)),
            VoxelType::I64 => store::<i64>(typed(&bytes)),
            VoxelType::F32 => store::<f32>(typed(&bytes)),
            VoxelType::F64 => store::<f64>(typed(&bytes)),
        };
        Self::from_stored(dimensions, stored, rescale, geometry, voxel_type)
    }

    fn from_stored(
        dimensions: UVec3,
        mut stored: Stored,
        rescale: Rescale,
        geometry: Geometry,
        source_type: VoxelType,
    ) -> Result<Self, VolumeError> {
        if !(rescale.slope.is_finite() && rescale.slope != 0.0 && rescale.intercept.is_finite()) {
            return Err(VolumeError::Rescale { slope: rescale.slope, intercept: rescale.intercept });
        }
        let voxel_from_world = invert(&geometry.world_from_voxel)?;
        let [a, b] = stored.numbers.map(|number| rescale.value(number));
        let loss = stored.loss.map(|loss| StorageLoss { largest: loss.largest * rescale.slope.abs() });
        let rescale = Rescale {
            slope: rescale.slope * stored.scale,
            intercept: rescale.intercept + rescale.slope * stored.offset,
        };
        let held = rescale.slope.is_finite() && rescale.slope != 0.0 && rescale.intercept.is_finite();
        if !(held && (b - a).is_finite()) {
            return Err(VolumeError::Range { range: [a, b] });
        }
        let missing = stored.missing.map(|voxels| {
            if let Voxels::F32(floats) = &mut stored.voxels {
                voxels.fill(dimensions, floats);
            }
            let cells = voxels.cells(dimensions);
            Arc::new(Missing { voxels, cells })
        });
        Ok(Self {
            dimensions,
            voxels: Arc::new(stored.voxels),
            rescale,
            geometry,
            voxel_from_world,
            source_type,
            stored_range: stored.range,
            value_range: [a.min(b), a.max(b)],
            replaced: stored.replaced,
            loss,
            missing,
        })
    }

    /// Returns the volume with another meaning of voxels without a value: at first they are
    /// [transparent](NanMeaning::Transparent), and once they have values they keep them.
    #[must_use]
    pub fn with_nan(mut self, meaning: NanMeaning) -> Self {
        if meaning == NanMeaning::Transparent {
            return self;
        }
        let Some(missing) = self.missing.take() else { return self };
        let highest = (meaning == NanMeaning::Highest) == (self.rescale.slope > 0.0);
        let number = self.stored_range[usize::from(highest)];
        if let Voxels::F32(floats) = Arc::make_mut(&mut self.voxels) {
            missing.voxels.indices().for_each(|index| floats[index] = number);
        }
        self
    }

    /// The cells that show nothing because a voxel around them has no value; none: there are no such voxels, or they have
    /// been given values.
    pub fn missing_cells(&self) -> Option<&Arc<MissingCells>> {
        self.missing.as_ref().and_then(|missing| missing.cells.as_ref())
    }

    /// How many voxels are missing: NaN, and not given a value by [`Self::with_nan`].
    pub fn missing(&self) -> usize {
        self.missing.as_ref().map_or(0, |missing| missing.voxels.count)
    }

    /// Stored numbers of missing voxels, which stand for nothing: for whatever counts values.
    pub(crate) fn missing_numbers(&self) -> impl Iterator<Item = f32> + '_ {
        let indices = self.missing.iter().flat_map(|missing| missing.voxels.indices());
        indices.map(|index| self.voxels.get(index))
    }

    /// The same voxels with another meaning and in another place.
    pub(crate) fn placed(&self, rescale: Rescale, world_from_voxel: DAffine3) -> Result<Self, VolumeError> {
        let geometry = Geometry { world_from_voxel, ..self.geometry };
        let voxel_from_world = invert(&geometry.world_from_voxel)?;
        let [a, b] = self.stored_range.map(|stored| rescale.value(f64::from(stored)));
        let value_range = [a.min(b), a.max(b)];
        Ok(Self { rescale, geometry, voxel_from_world, value_range, ..self.clone() })
    }

    /// Voxels along x, y, z.
    pub fn dimensions(&self) -> UVec3 {
        self.dimensions
    }

    /// The stored numbers.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// What a stored number means.
    pub fn rescale(&self) -> Rescale {
        self.rescale
    }

    /// Where the grid lies.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// World position of a voxel position.
    pub fn world_from_voxel(&self) -> &DAffine3 {
        &self.geometry.world_from_voxel
    }

    /// Voxel position of a world position.
    pub fn voxel_from_world(&self) -> &DAffine3 {
        &self.voxel_from_world
    }

    /// The scalar type the data had before they were stored here.
    pub fn source_type(&self) -> VoxelType {
        self.source_type
    }

    /// How many NaN or infinite voxels were replaced.
    pub fn replaced(&self) -> usize {
        self.replaced
    }

    /// Smallest and largest stored number.
    pub fn stored_range(&self) -> [f32; 2] {
        self.stored_range
    }

    /// What storing the values as 32-bit floats lost; none: nothing that can be noticed.
    pub fn loss(&self) -> Option<StorageLoss> {
        self.loss
    }

    /// Smallest and largest value, as the file has them.
    pub fn value_range(&self) -> [f64; 2] {
        self.value_range
    }

    /// World distance between neighbouring voxel centres along i, j and k.
    pub fn spacing(&self) -> DVec3 {
        let m = &self.geometry.world_from_voxel.matrix3;
        DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length())
    }

    /// The anatomical direction of each voxel axis, where the file tells: see [`orientation_letters`].
    pub fn orientation(&self) -> Option<[char; 3]> {
        (self.geometry.frame == WorldFrame::Ras).then(|| orientation_letters(&self.geometry.world_from_voxel))
    }

    /// The far corner of the volume's box in voxel space: `dimensions - 1`.
    pub fn extent(&self) -> DVec3 {
        (self.dimensions - UVec3::ONE).as_dvec3()
    }

    /// Corners of the volume's box in the world, x fastest.
    pub fn corners_in_world(&self) -> [DVec3; 8] {
        std::array::from_fn(|c| {
            let pick = DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2 & 1) as f64);
            self.geometry.world_from_voxel.transform_point3(pick * self.extent())
        })
    }

    /// Centre of the volume's box in the world.
    pub fn center_in_world(&self) -> DVec3 {
        self.geometry.world_from_voxel.transform_point3(self.extent() * 0.5)
    }

    /// Linear index of a voxel; indices beyond the volume are clamped to it.
    #[inline]
    pub fn index_clamped(&self, i: i64, j: i64, k: i64) -> usize {
        let d = self.dimensions;
        let clamp = |v: i64, n: u32| v.clamp(0, i64::from(n) - 1) as usize;
        (clamp(k, d.z) * d.y as usize + clamp(j, d.y)) * d.x as usize + clamp(i, d.x)
    }

    /// The value at a voxel; indices beyond the volume are clamped to it.
    #[inline]
    pub fn value_clamped(&self, i: i64, j: i64, k: i64) -> f64 {
        self.rescale.value(f64::from(self.voxels.get(self.index_clamped(i, j, k))))
    }
}

fn voxel_count(dimensions: UVec3) -> Result<usize, VolumeError> {
    let [x, y, z] = dimensions.to_array().map(|n| n as usize);
    x.checked_mul(y)
        .and_then(|n| n.checked_mul(z))
        // Sixteen bytes a voxel is more than any stage needs: products beyond it overflow somewhere.
        .filter(|n| *n > 0 && n.checked_mul(16).is_some())
        .ok_or(VolumeError::Dimensions { dimensions })
}

fn invert(world_from_voxel: &DAffine3) -> Result<DAffine3, VolumeError> {
    let m = world_from_voxel.matrix3;
    let columns = [m.x_axis.to_array(), m.y_axis.to_array(), m.z_axis.to_array()];
    if !world_from_voxel.is_finite() {
        return Err(VolumeError::Geometry { what: "not finite", columns });
    }
    // The determinant relative to the column lengths is the grid's skewness: independent of the unit of length.
    let skewness = m.determinant() / (m.x_axis.length() * m.y_axis.length() * m.z_axis.length());
    if skewness.is_nan() || skewness.abs() < 1e-6 {
        return Err(VolumeError::Geometry { what: "singular", columns });
    }
    let inverse = world_from_voxel.inverse();
    if inverse.is_finite() { Ok(inverse) } else { Err(VolumeError::Geometry { what: "singular", columns }) }
}

fn typed<T: Voxel>(bytes: &[u8]) -> Vec<T> {
    bytes.chunks_exact(size_of::<T>()).map(T::from_ne).collect()
}

struct Stored {
    voxels: Voxels,
    /// `scale * stored + offset` is what the file held.
    offset: f64,
    scale: f64,
    range: [f32; 2],
    /// Smallest and largest number that the file held.
    numbers: [f64; 2],
    replaced: usize,
    loss: Option<StorageLoss>,
    missing: Option<MissingVoxels>,
}

impl Stored {
    fn exact(voxels: Voxels, offset: f64) -> Self {
        let range = with_voxels!(&voxels, v => {
            let (lo, hi) = minmax(v);
            [lo.to_f64() as f32, hi.to_f64() as f32]
        });
        let numbers = range.map(|stored| f64::from(stored) + offset);
        Self { voxels, offset, scale: 1.0, range, numbers, replaced: 0, loss: None, missing: None }
    }
}

/// Elements that a thread works on at a time.
const CHUNK: usize = 1 << 18;

/// Elements of which two copies are in memory at a time.
const PIECE: usize = 1 << 23;

/// What is added to the stored number of a signed voxel: flipping its highest bit made it unsigned.
const I8_OFFSET: f64 = -128.0;
const I16_OFFSET: f64 = -32768.0;

/// 16-bit voxels from a file's bytes, `flip` exclusive-ored to each.
fn words(mut bytes: Vec<u8>, endian: Endian, flip: u16) -> Vec<u16> {
    let mut words = vec![0u16; bytes.len() / 2];
    // From the end on, giving back what was read: the two are hardly ever in memory together, for the zeros of `words` take
    // none before they are written.
    let mut end = words.len();
    while end > 0 {
        let begin = end.saturating_sub(PIECE);
        let piece = words[begin..end].par_chunks_mut(CHUNK).zip(bytes[2 * begin..].par_chunks(2 * CHUNK));
        piece.for_each(|(words, bytes)| {
            let pairs = words.iter_mut().zip(bytes.chunks_exact(2));
            match endian {
                Endian::Little => pairs.for_each(|(w, b)| *w = u16::from_le_bytes([b[0], b[1]]) ^ flip),
                Endian::Big => pairs.for_each(|(w, b)| *w = u16::from_be_bytes([b[0], b[1]]) ^ flip),
            }
        });
        bytes.truncate(2 * begin);
        bytes.shrink_to_fit();
        end = begin;
    }
    words
}

/// Smallest and largest of a non-empty slice without NaN.
fn minmax<T: Copy + PartialOrd + Send + Sync>(values: &[T]) -> (T, T) {
    let widen = |(lo, hi): (T, T), (a, b): (T, T)| (if a < lo { a } else { lo }, if b > hi { b } else { hi });
    let first = (values[0], values[0]);
    let chunk = |c: &[T]| c.iter().fold((c[0], c[0]), |range, &v| widen(range, (v, v)));
    values.par_chunks(CHUNK).map(chunk).reduce(|| first, widen)
}

fn store<T: Voxel>(voxels: Vec<T>) -> Stored {
    // One of these casts is the identity for each T: a vector that is stored as it is need not be copied.
    let any: &dyn std::any::Any = &voxels;
    if any.is::<Vec<u8>>() {
        let any: Box<dyn std::any::Any> = Box::new(voxels);
        let v = any.downcast::<Vec<u8>>().expect("checked just above");
        return Stored::exact(Voxels::U8(*v), 0.0);
    }
    if any.is::<Vec<u16>>() {
        let any: Box<dyn std::any::Any> = Box::new(voxels);
        let v = any.downcast::<Vec<u16>>().expect("checked just above");
        return Stored::exact(Voxels::U16(*v), 0.0);
    }
    match T::TYPE {
        VoxelType::I8 => Stored::exact(
            Voxels::U8(voxels.iter().map(|v| (v.to_f64() - I8_OFFSET) as u8).collect()),
            I8_OFFSET,
        ),
        VoxelType::I16 => Stored::exact(
            Voxels::U16(voxels.iter().map(|v| (v.to_f64() - I16_OFFSET) as u16).collect()),
            I16_OFFSET,
        ),
        VoxelType::F32 | VoxelType::F64 => convert::to_floats(Cow::Owned(voxels)),
        _ => store_wide_integer(&voxels),
    }
}

/// 32- and 64-bit integers: 8 or 16 bits where their range fits (label maps, most simulations), f32 otherwise.
fn store_wide_integer<T: Voxel>(voxels: &[T]) -> Stored {
    let least = |a: T, b: T| if b.minus(a) < 0.0 { b } else { a };
    let most = |a: T, b: T| if b.minus(a) > 0.0 { b } else { a };
    let (lo, hi) = voxels.iter().fold((voxels[0], voxels[0]), |(lo, hi), &v| (least(lo, v), most(hi, v)));
    let width = hi.minus(lo);
    let (offset, above) = (lo.to_f64(), |v: &T| v.minus(lo));
    // Beyond 2^53 an f64, which values are, no longer tells neighbouring integers apart: said as a loss.
    if lo.to_f64().abs().max(hi.to_f64().abs()) > 9.0e15 {
        return convert::to_floats(Cow::Borrowed(voxels));
    }
    if width <= 255.0 {
        return Stored::exact(Voxels::U8(voxels.iter().map(|v| above(v) as u8).collect()), offset);
    }
    if width <= 65535.0 {
        return Stored::exact(Voxels::U16(voxels.iter().map(|v| above(v) as u16).collect()), offset);
    }
    convert::to_floats(Cow::Borrowed(voxels))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit() -> Geometry {
        Geometry::from_spacing(DVec3::ONE)
    }

    #[test]
    fn sixteen_bit_signed_voxels_stay_sixteen_bit_and_keep_their_values() {
        let v = Volume::new(UVec3::new(4, 1, 1), vec![-1024i16, 0, 3071, -32768], Rescale::IDENTITY, unit())
            .unwrap();
        assert!(matches!(v.voxels(), Voxels::U16(_)));
        assert_eq!([0, 1, 2, 3].map(|i| v.value_clamped(i, 0, 0)), [-1024.0, 0.0, 3071.0, -32768.0]);
        assert_eq!(v.value_range(), [-32768.0, 3071.0]);
    }

    #[test]
    fn narrow_wide_integers_are_stored_narrow_and_exactly() {
        let big = 1_000_000_000_000i64;
        let v = Volume::new(UVec3::new(2, 1, 1), vec![big, big + 60_000], Rescale::IDENTITY, unit()).unwrap();
        assert!(matches!(v.voxels(), Voxels::U16(_)));
        assert_eq!(v.value_clamped(1, 0, 0), 1_000_000_060_000.0);
        let v = Volume::new(UVec3::new(2, 1, 1), vec![-3i32, 250], Rescale::IDENTITY, unit()).unwrap();
        assert!(matches!(v.voxels(), Voxels::U8(_)));
        assert_eq!(v.value_clamped(0, 0, 0), -3.0);
    }

    #[test]
    fn non_finite_voxels_are_replaced_and_counted() {
        let data = vec![f32::NAN, 1.0, f32::INFINITY, f32::NEG_INFINITY, 5.0, 2.0];
        let v = Volume::new(UVec3::new(6, 1, 1), data, Rescale::IDENTITY, unit()).unwrap();
        assert_eq!(v.replaced(), 3);
        assert_eq!([0, 2, 3].map(|i| v.value_clamped(i, 0, 0)), [1.0, 5.0, 1.0]);
        assert_eq!((v.missing(), v.clone().with_nan(NanMeaning::Lowest).missing()), (1, 0));
        assert_eq!(v.clone().with_nan(NanMeaning::Highest).value_clamped(0, 0, 0), 5.0);
        assert_eq!(v.value_range(), [1.0, 5.0]);
    }

    #[test]
    fn report_34_missing_voxels_make_up_no_gradient() {
        let values = vec![f32::NAN, f32::NAN, 3.0, 4.0, f32::NAN, 6.0, f32::NAN, f32::NAN];
        let v = Volume::new(UVec3::new(8, 1, 1), values, Rescale::IDENTITY, unit()).unwrap();
        assert_eq!([1, 4, 6].map(|i| v.value_clamped(i, 0, 0)), [3.0, 5.0, 6.0]);
        // Where an axis has one voxel there is no cell.
        assert!(v.missing_cells().is_none() && v.missing() == 5);
        let mut values = vec![1.0; 64];
        values[21] = f64::NAN;
        let v = Volume::new(UVec3::splat(4), values, Rescale::IDENTITY, unit()).unwrap();
        let cells = v.missing_cells().unwrap();
        let count = (0..27u32).filter(|i| cells.contains(UVec3::new(i % 3, i / 3 % 3, i / 9))).count();
        assert_eq!((count, v.value_range()), (8, [1.0, 1.0]));
    }

    #[test]
    fn bytes_of_either_order_give_the_same_values() {
        let little = Volume::from_bytes(
            UVec3::new(2, 1, 1),
            VoxelType::I16,
            Endian::Little,
            vec![0x18, 0xfc, 0x02, 0x01],
            Rescale::IDENTITY,
            unit(),
        );
        let big = Volume::from_bytes(
            UVec3::new(2, 1, 1),
            VoxelType::I16,
            Endian::Big,
            vec![0xfc, 0x18, 0x01, 0x02],
            Rescale::IDENTITY,
            unit(),
        );
        for v in [little.unwrap(), big.unwrap()] {
            assert_eq!([v.value_clamped(0, 0, 0), v.value_clamped(1, 0, 0)], [-1000.0, 258.0]);
        }
    }

    #[test]
    fn words_of_many_pieces_are_all_there() {
        let expected: Vec<u16> = (0..PIECE + CHUNK + 3).map(|i| (i * 40_503 % 65_536) as u16).collect();
        let bytes: Vec<u8> = expected.iter().flat_map(|w| (w ^ 0x8000).to_be_bytes()).collect();
        assert!(words(bytes, Endian::Big, 0x8000) == expected);
        assert!(words(Vec::new(), Endian::Little, 0).is_empty());
    }

    #[test]
    fn lies_are_refused() {
        let count = Volume::new(UVec3::new(2, 2, 2), vec![0u8; 7], Rescale::IDENTITY, unit());
        assert!(matches!(count, Err(VolumeError::VoxelCount { expected: 8, found: 7, .. })));
        let huge = Volume::new(UVec3::splat(u32::MAX), vec![0u8; 7], Rescale::IDENTITY, unit());
        assert!(matches!(huge, Err(VolumeError::Dimensions { .. })));
        let flat = Geometry::from_spacing(DVec3::new(1.0, 0.0, 1.0));
        let singular = Volume::new(UVec3::ONE, vec![0u8], Rescale::IDENTITY, flat);
        assert!(matches!(singular, Err(VolumeError::Geometry { what: "singular", .. })));
        let slope = Rescale { slope: f64::NAN, intercept: 0.0 };
        assert!(matches!(
            Volume::new(UVec3::ONE, vec![0u8], slope, unit()),
            Err(VolumeError::Rescale { .. })
        ));
    }

    #[test]
    fn the_level_of_a_voxels_value_is_the_voxel() {
        // Not all of these come back from their values: (0.1 * 1 - 3 + 3) / 0.1 is a little more than 1.
        for rescale in [Rescale { slope: 0.1, intercept: -3.0 }, Rescale { slope: -0.3, intercept: 1024.0 }] {
            let stored = (0..4096u32).map(f64::from);
            assert!(stored.clone().any(|s| rescale.stored(rescale.value(s)) != s));
            stored.for_each(|s| assert_eq!(rescale.stored_level(rescale.value(s)), s));
            // Others stay where they are.
            let between = rescale.value(7.3);
            assert_eq!(rescale.stored_level(between), rescale.stored(between));
        }
    }

    #[test]
    fn names_of_types_round_trip() {
        for name in
            ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64"]
        {
            assert_eq!(VoxelType::from_name(name).unwrap().name(), name);
        }
        assert_eq!(VoxelType::from_name("u16"), Some(VoxelType::U16));
        assert_eq!(VoxelType::from_name("f64"), Some(VoxelType::F64));
        assert_eq!(VoxelType::from_name("complex"), None);
    }
}
