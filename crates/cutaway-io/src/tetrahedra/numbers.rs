//! Numbers in text and in bytes, of the types that VTK has.

/// A type of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
    /// Eight to a byte.
    Bit,
}

impl Kind {
    /// By its name in an XML file.
    pub(super) fn of_xml(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "vtkidtype" => Self::I64,
            name => Self::named(name)?,
        })
    }

    /// By its name in a legacy file, where the numbers of points and cells have four bytes whatever they have in memory.
    pub(super) fn of_legacy(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "vtkidtype" => Self::I32,
            name => Self::named(name)?,
        })
    }

    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "signed_char" | "vtktypeint8" | "int8" => Self::I8,
            "unsigned_char" | "vtktypeuint8" | "uint8" => Self::U8,
            "short" | "vtktypeint16" | "int16" => Self::I16,
            "unsigned_short" | "vtktypeuint16" | "uint16" => Self::U16,
            "int" | "vtktypeint32" | "int32" => Self::I32,
            "unsigned_int" | "vtktypeuint32" | "uint32" => Self::U32,
            "long" | "long_long" | "vtktypeint64" | "int64" => Self::I64,
            "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" | "uint64" => Self::U64,
            "float" | "vtktypefloat32" | "float32" => Self::F32,
            "double" | "vtktypefloat64" | "float64" => Self::F64,
            "bit" => Self::Bit,
            _ => return None,
        })
    }

    /// Bytes of so many; none where the product is beyond 64 bits.
    pub(super) fn bytes_of(self, count: u64) -> Option<u64> {
        match self {
            Self::Bit => Some(count.div_ceil(8)),
            _ => count.checked_mul(self.size() as u64),
        }
    }

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 | Self::Bit => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Decodes numbers from bytes of either order.
    pub(super) fn decode<T: Number>(self, bytes: &[u8], big_endian: bool) -> Vec<T> {
        fn map<const N: usize, T>(bytes: &[u8], big: bool, from: impl Fn([u8; N]) -> T) -> Vec<T> {
            let ordered = |chunk: &[u8; N]| {
                let mut own = *chunk;
                if big {
                    own.reverse();
                }
                from(own)
            };
            bytes.as_chunks::<N>().0.iter().map(ordered).collect()
        }
        let big = big_endian;
        match self {
            Self::I8 => map(bytes, big, |b| T::of_integer(i8::from_le_bytes(b).into())),
            Self::U8 => map(bytes, big, |b| T::of_integer(u8::from_le_bytes(b).into())),
            Self::I16 => map(bytes, big, |b| T::of_integer(i16::from_le_bytes(b).into())),
            Self::U16 => map(bytes, big, |b| T::of_integer(u16::from_le_bytes(b).into())),
            Self::I32 => map(bytes, big, |b| T::of_integer(i32::from_le_bytes(b).into())),
            Self::U32 => map(bytes, big, |b| T::of_integer(u32::from_le_bytes(b).into())),
            Self::I64 => map(bytes, big, |b| T::of_integer(i64::from_le_bytes(b).into())),
            Self::U64 => map(bytes, big, |b| T::of_integer(u64::from_le_bytes(b).into())),
            Self::F32 => map(bytes, big, |b| T::of_float(f32::from_le_bytes(b).into())),
            Self::F64 => map(bytes, big, |b| T::of_float(f64::from_le_bytes(b))),
            Self::Bit => {
                let bits = bytes.iter().flat_map(|byte| (0..8).rev().map(move |k| i128::from(byte >> k & 1)));
                bits.map(T::of_integer).collect()
            }
        }
    }
}

/// What numbers are wanted as: coordinates and values, or indices.
pub(super) trait Number: Sized {
    fn of_integer(value: i128) -> Self;
    fn of_float(value: f64) -> Self;
    fn of_text(text: &str) -> Option<Self>;
}

impl Number for f64 {
    fn of_integer(value: i128) -> Self {
        value as f64
    }

    fn of_float(value: f64) -> Self {
        value
    }

    fn of_text(text: &str) -> Option<Self> {
        text.parse().ok()
    }
}

impl Number for f32 {
    fn of_integer(value: i128) -> Self {
        value as f32
    }

    fn of_float(value: f64) -> Self {
        value as f32
    }

    fn of_text(text: &str) -> Option<Self> {
        text.parse().ok()
    }
}

/// Indices; -1 stands for what no index can be.
impl Number for i64 {
    fn of_integer(value: i128) -> Self {
        value.try_into().unwrap_or(-1)
    }

    fn of_float(value: f64) -> Self {
        if value.fract() == 0.0 && value.abs() < 9e15 { value as i64 } else { -1 }
    }

    fn of_text(text: &str) -> Option<Self> {
        // Some writers put whole numbers as `8.0`.
        text.parse().ok().or_else(|| text.parse().ok().map(Self::of_float).filter(|index| *index >= 0))
    }
}
