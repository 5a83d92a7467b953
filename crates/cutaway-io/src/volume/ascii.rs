//! Voxels written as text: decimal numbers between white space or commas, or pairs of hexadecimal digits.

use std::io::{self, BufRead, Read};

use cutaway_core::volume::VoxelType;

use super::error::quoted;

/// The longest number that is believed to be one.
const LONGEST: usize = 1024;

/// Which numbers of a text are wanted: after `skip`, `take` of them, and of those every `step`-th from `offset`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Numbers {
    pub skip: u64,
    pub take: u64,
    pub step: u64,
    pub offset: u64,
}

/// Why a text could not be read.
pub(crate) enum AsciiError {
    Io(io::Error),
    /// Something that is no number of the type.
    Number {
        offset: u64,
        found: String,
    },
}

/// Appends the wanted numbers as little-endian bytes and says how many numbers (wanted or not) were there.
pub(crate) fn read(
    reader: &mut super::source::Stream<'_>,
    voxel: VoxelType,
    wanted: Numbers,
    out: &mut Vec<u8>,
) -> Result<u64, AsciiError> {
    match voxel {
        VoxelType::U8 => read_as::<u8>(reader, wanted, out),
        VoxelType::I8 => read_as::<i8>(reader, wanted, out),
        VoxelType::U16 => read_as::<u16>(reader, wanted, out),
        VoxelType::I16 => read_as::<i16>(reader, wanted, out),
        VoxelType::U32 => read_as::<u32>(reader, wanted, out),
        VoxelType::I32 => read_as::<i32>(reader, wanted, out),
        VoxelType::U64 => read_as::<u64>(reader, wanted, out),
        VoxelType::I64 => read_as::<i64>(reader, wanted, out),
        VoxelType::F32 => read_as::<f32>(reader, wanted, out),
        VoxelType::F64 => read_as::<f64>(reader, wanted, out),
    }
}

/// Whether anything but separators follows.
pub(crate) fn has_more(reader: &mut impl BufRead) -> io::Result<bool> {
    loop {
        let buffer = reader.fill_buf()?;
        if buffer.is_empty() {
            return Ok(false);
        }
        if !buffer.iter().all(|&b| is_separator(b)) {
            return Ok(true);
        }
        let n = buffer.len();
        reader.consume(n);
    }
}

fn is_separator(byte: u8) -> bool {
    byte.is_ascii_whitespace() || byte == b',' || byte == 0x0b
}

trait Number: Sized {
    fn parse(text: &str) -> Option<Self>;
    fn push(self, out: &mut Vec<u8>);
}

macro_rules! integer {
    ($($t:ty),*) => {$(
        impl Number for $t {
            fn parse(text: &str) -> Option<Self> {
                // Some writers put integers as `3.0` or `1e3`.
                text.parse().ok().or_else(|| {
                    let value: f64 = text.parse().ok()?;
                    let integer = value as Self;
                    (integer as f64 == value).then_some(integer)
                })
            }
            fn push(self, out: &mut Vec<u8>) { out.extend_from_slice(&self.to_le_bytes()); }
        }
    )*};
}
integer!(u8, i8, u16, i16, u32, i32, u64, i64);

macro_rules! float {
    ($($t:ty),*) => {$(
        impl Number for $t {
            fn parse(text: &str) -> Option<Self> { text.parse().ok() }
            fn push(self, out: &mut Vec<u8>) { out.extend_from_slice(&self.to_le_bytes()); }
        }
    )*};
}
float!(f32, f64);

fn read_as<T: Number>(
    reader: &mut super::source::Stream<'_>,
    wanted: Numbers,
    out: &mut Vec<u8>,
) -> Result<u64, AsciiError> {
    let end = wanted.skip + wanted.take;
    let mut found = 0;
    let mut number = |text: &[u8], offset: u64| {
        let index = found;
        found += 1;
        if index < wanted.skip || (index - wanted.skip) % wanted.step != wanted.offset {
            return Ok(found);
        }
        let parsed = std::str::from_utf8(text).ok().and_then(T::parse);
        let Some(value) = parsed else {
            return Err(AsciiError::Number { offset, found: quoted(&String::from_utf8_lossy(text)) });
        };
        value.push(out);
        Ok(found)
    };
    // A number that is cut by the end of the buffer waits here.
    let mut pending: Vec<u8> = Vec::new();
    loop {
        let position = reader.position();
        let buffer = reader.fill_buf().map_err(AsciiError::Io)?;
        if buffer.is_empty() {
            if pending.is_empty() {
                // The closure is asked only when there is a number: an empty text has none.
                return Ok(found);
            }
            return number(&pending, position - pending.len() as u64);
        }
        let mut at = 0;
        while at < buffer.len() {
            if is_separator(buffer[at]) && pending.is_empty() {
                at += 1;
                continue;
            }
            let length = buffer[at..].iter().position(|&b| is_separator(b));
            let text = &buffer[at..length.map_or(buffer.len(), |n| at + n)];
            if pending.len() + text.len() > LONGEST {
                let shown = quoted(&String::from_utf8_lossy(&text[..text.len().min(LONGEST)]));
                return Err(AsciiError::Number { offset: position + at as u64, found: shown });
            }
            let offset = position + at as u64 - pending.len() as u64;
            at += text.len();
            if length.is_none() {
                pending.extend_from_slice(text);
                continue;
            }
            let count = if pending.is_empty() {
                number(text, offset)?
            } else {
                pending.extend_from_slice(text);
                let count = number(&pending, offset)?;
                pending.clear();
                count
            };
            if count == end {
                reader.consume(at);
                return Ok(count);
            }
        }
        let n = buffer.len();
        reader.consume(n);
    }
}

/// Decodes pairs of hexadecimal digits, white space anywhere between digits.
pub(crate) struct HexReader<R> {
    reader: R,
    high: Option<u8>,
}

impl<R: BufRead> HexReader<R> {
    pub(crate) fn new(reader: R) -> Self {
        Self { reader, high: None }
    }
}

impl<R: BufRead> Read for HexReader<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut written = 0;
        while written < out.len() {
            let buffer = self.reader.fill_buf()?;
            if buffer.is_empty() {
                break;
            }
            let mut used = 0;
            for &byte in buffer {
                used += 1;
                if byte.is_ascii_whitespace() {
                    continue;
                }
                let digit = (byte as char).to_digit(16).ok_or_else(|| {
                    let found = quoted(&(byte as char).to_string());
                    io::Error::new(
                        io::ErrorKind::InvalidData,
                        format!("found {found}, expected 0-9, a-f or A-F"),
                    )
                })? as u8;
                match self.high.take() {
                    None => self.high = Some(digit),
                    Some(high) => {
                        out[written] = high << 4 | digit;
                        written += 1;
                        if written == out.len() {
                            break;
                        }
                    }
                }
            }
            self.reader.consume(used);
            if written > 0 {
                break;
            }
        }
        Ok(written)
    }
}

#[cfg(test)]
mod tests {
    use super::super::source::{Source, Stream};
    use super::*;

    fn numbers(text: &str, voxel: VoxelType, wanted: Numbers) -> Result<(u64, Vec<u8>), String> {
        let mut stream = Stream::plain("t", Source::from_slice(text.as_bytes()));
        let mut out = Vec::new();
        match read(&mut stream, voxel, wanted, &mut out) {
            Ok(n) => Ok((n, out)),
            Err(AsciiError::Number { offset, found }) => Err(format!("{found} at {offset}")),
            Err(AsciiError::Io(error)) => Err(error.to_string()),
        }
    }

    const FOUR: Numbers = Numbers { skip: 0, take: 4, step: 1, offset: 0 };

    #[test]
    fn numbers_may_be_separated_by_anything_white_or_commas() {
        assert_eq!(numbers(" 1,\t2\r\n3, 255 9", VoxelType::U8, FOUR), Ok((4, vec![1, 2, 3, 255])));
        assert_eq!(numbers("1 2.0 3e0 +4", VoxelType::U8, FOUR), Ok((4, vec![1, 2, 3, 4])));
        assert_eq!(numbers("1 2 3", VoxelType::U8, FOUR), Ok((3, vec![1, 2, 3])));
        assert_eq!(numbers("", VoxelType::U8, FOUR), Ok((0, vec![])));
    }

    #[test]
    fn what_is_no_number_of_the_type_is_refused_with_its_offset() {
        assert_eq!(numbers("1 256 3 4", VoxelType::U8, FOUR), Err("\"256\" at 2".to_owned()));
        assert_eq!(numbers("1 2 x\u{1b} 4", VoxelType::U8, FOUR), Err("\"x\\u{1b}\" at 4".to_owned()));
        assert_eq!(numbers("1 2.5 3 4", VoxelType::I16, FOUR), Err("\"2.5\" at 2".to_owned()));
        assert!(numbers(&"1".repeat(5000), VoxelType::F32, FOUR).is_err());
    }

    #[test]
    fn numbers_that_straddle_buffers_stay_whole() {
        // 50,000 numbers of 7 bytes are more than two buffers, and 7 does not divide the buffer.
        let text: String = (100_000..150_000).map(|n| format!("{n} ")).collect();
        let all = Numbers { take: 50_000, ..FOUR };
        let (n, bytes) = numbers(&text, VoxelType::U32, all).unwrap();
        assert_eq!(n, 50_000);
        let values = bytes.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap()));
        assert!(values.eq(100_000..150_000));
    }

    #[test]
    fn interleaved_numbers_are_picked() {
        let second = Numbers { skip: 2, take: 4, step: 2, offset: 1 };
        assert_eq!(numbers("0 1 2 3 4 5 6", VoxelType::U8, second), Ok((6, vec![3, 5])));
    }

    #[test]
    fn hexadecimal_digits_pair_across_white_space() {
        let mut out = Vec::new();
        HexReader::new("0aF\nf 1 0".as_bytes()).read_to_end(&mut out).unwrap();
        assert_eq!(out, [0x0a, 0xff, 0x10]);
        assert!(HexReader::new("0g".as_bytes()).read_to_end(&mut out).is_err());
    }
}
