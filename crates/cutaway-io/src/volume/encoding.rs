//! How data are encoded in a file, and where in it they begin.

use cutaway_core::volume::Endian;

/// How data are written in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Raw,
    Gzip,
    /// Zlib, or gzip where the data begin like that.
    Zlib,
    Bzip2,
    Ascii,
    Hex,
}

impl Encoding {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Gzip => "gzip",
            Self::Zlib => "zlib",
            Self::Bzip2 => "bzip2",
            Self::Ascii => "text",
            Self::Hex => "hexadecimal",
        }
    }

    /// Byte order of what is read, where the header says `endian`.
    pub(crate) fn endian(self, endian: Endian) -> Endian {
        if self == Self::Ascii { Endian::Little } else { endian }
    }
}

/// What to skip in front of the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Skip {
    Bytes(u64),
    /// The data are the last bytes of what there is.
    UpToLast,
}

/// How each part holds its data.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Payload {
    pub encoding: Encoding,
    /// Lines to skip, first of all.
    pub lines: u64,
    /// Bytes to skip next, before decoding.
    pub skip: Skip,
    /// Bytes to skip after decoding; nothing for raw data, which need none.
    pub skip_decoded: Skip,
    /// Length of the compressed data, where the header tells.
    pub compressed: Option<u64>,
    /// Whether data that go on are an error: of raw voxels, nothing but their length can be checked.
    pub exact: bool,
}
