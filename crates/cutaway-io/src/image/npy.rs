//! NPY, <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>: one NumPy array.
//!
//! Written: version 1.0, little-endian float32, C order, data aligned to 64 bytes. Read: versions 1.0 to 3.0, `<f4` and
//! `<f8`, C order, `[height, width, 4]`, `[height, width, 3]` or `[height, width]`. Not read: other types, big endian,
//! Fortran order, structured and pickled arrays.

use std::io::{self, Write};

use cutaway_core::image::Image;

use super::{DecodeImageError, ImageFormat, ImageLimits, check_pixels};

/// The magic, the version and the header's length come before the header.
const PREAMBLE: usize = 10;
const ALIGNMENT: usize = 64;

pub(super) fn encode(image: &Image, write: &mut impl Write) -> io::Result<()> {
    let shape = format!("({}, {}, 4)", image.height(), image.width());
    write_array(&shape, image.pixels().as_flattened(), write)
}

pub(super) fn encode_depth(
    [width, height]: [u32; 2],
    depth: &[f32],
    write: &mut impl Write,
) -> io::Result<()> {
    write_array(&format!("({height}, {width})"), depth, write)
}

fn write_array(shape: &str, values: &[f32], write: &mut impl Write) -> io::Result<()> {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    // Spaces and a newline bring the data to the alignment.
    let length = (PREAMBLE + header.len() + 1).next_multiple_of(ALIGNMENT) - PREAMBLE;
    write.write_all(ImageFormat::Npy.signature())?;
    write.write_all(&[1, 0])?;
    write.write_all(&(length as u16).to_le_bytes())?;
    writeln!(write, "{header:<width$}", width = length - 1)?;
    let mut bytes = Vec::new();
    for part in values.chunks(1 << 12) {
        bytes.clear();
        bytes.extend(part.iter().flat_map(|value| value.to_le_bytes()));
        write.write_all(&bytes)?;
    }
    Ok(())
}

/// What the header says.
struct Header {
    /// Bytes of a number: 4 or 8.
    bytes: usize,
    width: u64,
    height: u64,
    /// Numbers of a pixel: 1, 3 or 4.
    channels: usize,
}

/// A fault and the byte it is at.
type Fault = (usize, String);

pub(super) fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<Image, DecodeImageError> {
    let content = |(offset, problem): Fault| DecodeImageError::Content {
        format: ImageFormat::Npy,
        offset: offset as u64,
        problem,
    };
    let (text, at) = header_text(bytes).map_err(content)?;
    let header = parse_header(text, at).map_err(content)?;
    let count = check_pixels(header.width, header.height, limits)?;
    let start = at + text.len();
    let data = &bytes[start..];
    let expected = count.checked_mul(header.channels * header.bytes);
    if expected != Some(data.len()) {
        let Header { width, height, channels, bytes } = header;
        let expected = expected.map_or("more than fit in memory".into(), |n| n.to_string());
        let problem = format!(
            "found {} bytes of data, expected {expected} ({height} x {width} x {channels} numbers of {bytes} bytes)",
            data.len()
        );
        return Err(content((start, problem)));
    }
    let pixels = match header.bytes {
        4 => pixels_of(data.as_chunks().0, header.channels, f32::from_le_bytes),
        _ => pixels_of(data.as_chunks().0, header.channels, |b| f64::from_le_bytes(b) as f32),
    };
    // A side that does not fit has no other side but zero, which is refused here too.
    let side = |length: u64| u32::try_from(length).unwrap_or(0);
    Ok(Image::new(side(header.width), side(header.height), pixels)?)
}

/// Pixels from numbers of `N` bytes, 1, 3 or 4 of them a pixel.
fn pixels_of<const N: usize>(
    data: &[[u8; N]],
    channels: usize,
    number: impl Fn([u8; N]) -> f32,
) -> Vec<[f32; 4]> {
    match channels {
        4 => data.as_chunks::<4>().0.iter().map(|pixel| pixel.map(&number)).collect(),
        3 => {
            let opaque = |[r, g, b]: [f32; 3]| [r, g, b, 1.0];
            data.as_chunks::<3>().0.iter().map(|pixel| opaque(pixel.map(&number))).collect()
        }
        _ => data.iter().map(|&grey| number(grey)).map(|v| [v, v, v, 1.0]).collect(),
    }
}

/// The header's text and the byte that it begins at.
fn header_text(bytes: &[u8]) -> Result<(&[u8], usize), Fault> {
    let at = ImageFormat::Npy.signature().len();
    let cut_off = || (bytes.len(), "the file ends within the header".to_owned());
    let (&[major, minor], rest) = bytes[at..].split_first_chunk().ok_or_else(cut_off)?;
    let (length, rest, start) = match (major, minor) {
        (1, 0) => {
            let (length, rest) = rest.split_first_chunk().ok_or_else(cut_off)?;
            (u32::from(u16::from_le_bytes(*length)), rest, PREAMBLE)
        }
        (2 | 3, 0) => {
            let (length, rest) = rest.split_first_chunk().ok_or_else(cut_off)?;
            (u32::from_le_bytes(*length), rest, PREAMBLE + 2)
        }
        _ => return Err((at, format!("found version {major}.{minor}, expected 1.0, 2.0 or 3.0"))),
    };
    let text = usize::try_from(length).ok().and_then(|length| rest.get(..length)).ok_or_else(cut_off)?;
    Ok((text, start))
}

/// Reads `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }`, a Python literal with the keys in any order.
fn parse_header(text: &[u8], start: usize) -> Result<Header, Fault> {
    let mut parser = Parser { text, at: 0 };
    let header = parser.dictionary();
    header.map_err(|problem| (start + parser.at.min(text.len()), format!("header: {problem}")))
}

struct Parser<'a> {
    text: &'a [u8],
    at: usize,
}

impl Parser<'_> {
    fn dictionary(&mut self) -> Result<Header, String> {
        let (mut bytes, mut in_c_order, mut shape) = (None, None, None);
        self.expect(b'{')?;
        while !self.skip(b'}') {
            let key = self.string()?;
            self.expect(b':')?;
            let before = match key.as_str() {
                "descr" => bytes.replace(self.number_type()?).is_some(),
                "fortran_order" => in_c_order.replace(self.c_order()?).is_some(),
                "shape" => shape.replace(self.shape()?).is_some(),
                _ => return Err(format!("found the key '{key}', expected descr, fortran_order and shape")),
            };
            if before {
                return Err(format!("the key '{key}' is there twice"));
            }
            if !self.skip(b',') {
                self.expect(b'}')?;
                break;
            }
        }
        self.space();
        if self.at < self.text.len() {
            return Err(format!("found {} after the dictionary, expected its end", self.found()));
        }
        let missing = |key: &str| format!("the key '{key}' is missing");
        in_c_order.ok_or_else(|| missing("fortran_order"))?;
        let bytes = bytes.ok_or_else(|| missing("descr"))?;
        let (height, width, channels) = shape.ok_or_else(|| missing("shape"))?;
        Ok(Header { bytes, width, height, channels })
    }

    /// The size of `<f4` or `<f8`.
    fn number_type(&mut self) -> Result<usize, String> {
        match self.string().map_err(|problem| format!("descr: {problem}"))?.as_str() {
            "<f4" => Ok(4),
            "<f8" => Ok(8),
            other => Err(format!("descr: found '{other}', expected '<f4' or '<f8'; use array.astype('<f4')")),
        }
    }

    fn c_order(&mut self) -> Result<(), String> {
        self.space();
        let rest = &self.text[self.at..];
        if rest.starts_with(b"False") {
            self.at += b"False".len();
            return Ok(());
        }
        if rest.starts_with(b"True") {
            return Err(
                "fortran_order: found True, expected False; use numpy.ascontiguousarray(array)".into()
            );
        }
        Err(format!("fortran_order: found {}, expected False", self.found()))
    }

    /// Height, width and channels.
    fn shape(&mut self) -> Result<(u64, u64, usize), String> {
        let mut lengths = Vec::new();
        self.expect(b'(')?;
        while !self.skip(b')') {
            // A scalar and an array of a hundred axes are refused alike, the latter without reading it all.
            if lengths.len() == 4 {
                return Err(
                    "shape: more than three axes, expected (height, width, 4), (.., 3) or (.., ..)".into()
                );
            }
            lengths.push(self.number().map_err(|problem| format!("shape: {problem}"))?);
            if !self.skip(b',') {
                self.expect(b')')?;
                break;
            }
        }
        match lengths[..] {
            [height, width] => Ok((height, width, 1)),
            [height, width, channels @ (3 | 4)] => Ok((height, width, channels as usize)),
            _ => Err(format!(
                "shape: found {lengths:?}, expected [height, width, 4], [height, width, 3] or [height, width]"
            )),
        }
    }

    fn number(&mut self) -> Result<u64, String> {
        self.space();
        let digits = self.text[self.at..].iter().take_while(|c| c.is_ascii_digit()).count();
        let digits = &self.text[self.at..self.at + digits];
        if digits.is_empty() {
            return Err(format!("found {}, expected a number", self.found()));
        }
        let value = digits
            .iter()
            .try_fold(0u64, |value, digit| value.checked_mul(10)?.checked_add(u64::from(digit - b'0')));
        let value = value.ok_or("found a number of more than 64 bits")?;
        self.at += digits.len();
        Ok(value)
    }

    /// A quoted string; no key and no type that we read has an escape in it.
    fn string(&mut self) -> Result<String, String> {
        self.space();
        let quote = self.text.get(self.at).copied().filter(|q| matches!(q, b'\'' | b'"'));
        let quote = quote.ok_or_else(|| format!("found {}, expected a string", self.found()))?;
        let rest = &self.text[self.at + 1..];
        // Long ones are nothing that we read, and would make a long message.
        let length = rest.iter().take(64).position(|&c| c == quote).ok_or("found a string without an end")?;
        self.at += length + 2;
        Ok(rest[..length].escape_ascii().to_string())
    }

    fn expect(&mut self, token: u8) -> Result<(), String> {
        if self.skip(token) {
            return Ok(());
        }
        Err(format!("found {}, expected '{}'", self.found(), char::from(token)))
    }

    /// Passes over `token` if it is next.
    fn skip(&mut self, token: u8) -> bool {
        self.space();
        let next = self.text.get(self.at) == Some(&token);
        self.at += usize::from(next);
        next
    }

    fn space(&mut self) {
        self.at += self.text[self.at..].iter().take_while(|c| c.is_ascii_whitespace()).count();
    }

    /// What is next, for a message.
    fn found(&self) -> String {
        self.text.get(self.at).map_or("the end".into(), |c| format!("'{}'", c.escape_ascii()))
    }
}
