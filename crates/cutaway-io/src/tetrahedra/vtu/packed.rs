//! Compressed blocks, as VTK's three compressors write them. What a block becomes is bounded before it is unpacked.

use std::io::{Cursor, Read};

use flate2::read::ZlibDecoder;

/// Deflate never makes more than 1032 bytes of one, LZ4 no more than 255.
const DEFLATE_RATIO: u64 = 1032;
const LZ4_RATIO: u64 = 255;

/// How blocks are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compressor {
    Zlib,
    Lz4,
    Lzma,
}

impl Compressor {
    /// By VTK's name of it.
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "vtkZLibDataCompressor" => Self::Zlib,
            "vtkLZ4DataCompressor" => Self::Lz4,
            "vtkLZMADataCompressor" => Self::Lzma,
            _ => return None,
        })
    }

    /// The most bytes that this many can become.
    pub(super) fn most(self, bytes: u64) -> u64 {
        match self {
            Self::Zlib => bytes.saturating_mul(DEFLATE_RATIO),
            Self::Lz4 => bytes.saturating_mul(LZ4_RATIO),
            // A chunk of six bytes can say that it becomes two mebibytes.
            Self::Lzma => bytes.saturating_mul(1 << 19),
        }
    }

    /// Unpacks a block that becomes at most `size` bytes, and gives them, or says what is wrong.
    pub(super) fn unpack(self, packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
        match self {
            Self::Zlib => {
                let mut bytes = Vec::new();
                let read = ZlibDecoder::new(packed).take(size as u64).read_to_end(&mut bytes);
                read.map(|_| bytes).map_err(|error| error.to_string())
            }
            Self::Lz4 => {
                if size as u64 > self.most(packed.len() as u64) {
                    return Err("fewer bytes than its size asks for".to_owned());
                }
                let mut bytes = vec![0; size];
                let found = lz4_flex::block::decompress_into(packed, &mut bytes);
                bytes.truncate(found.map_err(|error| error.to_string())?);
                Ok(bytes)
            }
            Self::Lzma => {
                let claimed = xz_size(packed).ok_or("not an .xz stream of one block of LZMA2")?;
                if claimed > size as u64 {
                    return Err(format!("{claimed} bytes where {size} are expected"));
                }
                let mut bytes = Vec::with_capacity(claimed as usize);
                let unpacked = lzma_rs::xz_decompress(&mut Cursor::new(packed), &mut bytes);
                unpacked.map(|()| bytes).map_err(|error| format!("{error:?}"))
            }
        }
    }
}

/// How many bytes an .xz stream (<https://tukaani.org/xz/xz-file-format.txt>) becomes, by its LZMA2 chunks, each of which
/// begins with its lengths. None where it does not have one block, which has no filter but LZMA2.
fn xz_size(stream: &[u8]) -> Option<u64> {
    let block = stream.strip_prefix(b"\xfd7zXZ\0")?.get(6..)?;
    let header = 4 * (usize::from(*block.first()?) + 1);
    // No second filter.
    let flags = *block.get(1)?;
    if header == 4 || flags & 3 != 0 {
        return None;
    }
    let mut chunks = block.get(header..)?;
    let mut size = 0u64;
    loop {
        let two = |at: usize| Some(u64::from(*chunks.get(at)?) << 8 | u64::from(*chunks.get(at + 1)?));
        let (length, unpacked) = match *chunks.first()? {
            0 => break,
            1 | 2 => (3 + two(1)? + 1, two(1)? + 1),
            control @ 0x80.. => {
                let unpacked = (u64::from(control & 0x1f) << 16) + two(1)? + 1;
                let properties = u64::from(control >= 0xc0);
                (5 + properties + two(3)? + 1, unpacked)
            }
            _ => return None,
        };
        size += unpacked;
        chunks = chunks.get(length as usize..)?;
    }
    // Behind the block, padded to four bytes, and its check comes the index, which begins with a zero: no further block.
    let check = match *stream.get(7)? & 0xf {
        0 => 0,
        1 => 4,
        4 => 8,
        _ => return None,
    };
    let used = stream.len() - 12 - header - (chunks.len() - 1);
    let after = chunks.get(1 + used.wrapping_neg() % 4 + check..)?;
    (after.first() == Some(&0)).then_some(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn xz(bytes: &[u8]) -> Vec<u8> {
        let mut packed = Vec::new();
        lzma_rs::xz_compress(&mut Cursor::new(bytes), &mut packed).unwrap();
        packed
    }

    #[test]
    fn the_size_of_xz_is_known_before_it_is_unpacked() {
        for size in [1, 3, 20, 70_000, 200_000] {
            let bytes: Vec<u8> = (0..size).map(|n| ((n * n) >> 7) as u8).collect();
            let packed = xz(&bytes);
            assert_eq!(xz_size(&packed), Some(size as u64));
            assert_eq!(Compressor::Lzma.unpack(&packed, size), Ok(bytes));
            assert!(Compressor::Lzma.unpack(&packed, size - 1).is_err());
        }
    }

    #[test]
    fn damaged_blocks_are_errors() {
        let bytes = vec![7; 1000];
        for (compressor, packed) in
            [(Compressor::Lzma, xz(&bytes)), (Compressor::Lz4, vec![0x1f, 7, 1, 0, 255, 255, 255, 200])]
        {
            for at in 0..packed.len() {
                for other in [0, 1, 0x7f, 0xff] {
                    let mut damaged = packed.clone();
                    damaged[at] = other;
                    let _ = compressor.unpack(&damaged, 1000);
                    let _ = compressor.unpack(&packed[..at], 1000);
                }
            }
        }
    }
}
