//! The header of a PLY file.

use super::super::error::MeshReadError;
use super::super::input::{Input, shown, whole_number, words};
use crate::volume::Place;

/// Most elements, and most properties of one: far more than anyone writes.
const MOST: usize = 1024;

/// How the data after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

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
}

impl Kind {
    fn from_name(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"int64" | b"longlong" => Self::I64,
            b"uint64" | b"ulonglong" => Self::U64,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a number in binary data.
    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// What an element has.
#[derive(Clone, Debug)]
pub(super) enum Property {
    Scalar { name: String, kind: Kind },
    List { name: String, count: Kind, item: Kind },
}

/// Rows of properties.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    /// Where the header names it.
    pub(super) place: Place,
}

impl Element {
    /// The fewest bytes that a row can take.
    pub(super) fn least_bytes(&self, encoding: Encoding) -> u64 {
        let least = |property: &Property| match (encoding, property) {
            // A digit and a blank or the end of the line.
            (Encoding::Ascii, _) => 2,
            (_, Property::Scalar { kind, .. }) => kind.bytes(),
            (_, Property::List { count, .. }) => count.bytes(),
        };
        self.properties.iter().map(least).sum()
    }
}

pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
}

pub(super) fn read(input: &mut Input<'_>) -> Result<Header, MeshReadError> {
    let mut line = Vec::new();
    input.read_line(&mut line)?;
    if line.trim_ascii_end() != b"ply" {
        return Err(input.syntax(input.line(), shown(&line), "`ply`"));
    }
    let (mut encoding, mut elements) = (None, Vec::<Element>::new());
    loop {
        if !input.read_line(&mut line)? {
            return Err(input.syntax(
                input.line(),
                "the end of the file",
                "`end_header`; the file is cut short",
            ));
        }
        let wrong = |expected: &str| input.syntax(input.line(), shown(&line), expected);
        let mut words = words(&line);
        match words.next() {
            Some(b"end_header") => break,
            None | Some(b"comment" | b"obj_info") => {}
            Some(b"format") => encoding = Some(format(words).map_err(wrong)?),
            Some(b"element") => {
                let element = element(words, input.line()).map_err(wrong)?;
                if elements.len() == MOST || elements.iter().any(|e| e.name == element.name) {
                    return Err(wrong("each element once, and at most 1024 of them"));
                }
                elements.push(element);
            }
            Some(b"property") => {
                let property = property(words).map_err(wrong)?;
                match elements.last_mut().filter(|element| element.properties.len() < MOST) {
                    Some(element) => element.properties.push(property),
                    None => return Err(wrong("`element` before, and at most 1024 properties after it")),
                }
            }
            Some(_) => {
                return Err(wrong("`format`, `comment`, `element`, `property` or `end_header`"));
            }
        }
    }
    match encoding {
        Some(encoding) => Ok(Header { encoding, elements }),
        None => {
            Err(input.syntax(input.line(), "a header without `format`", "`format ascii 1.0` or a binary one"))
        }
    }
}

fn format<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<Encoding, &'static str> {
    let encoding = match words.next() {
        Some(b"ascii") => Encoding::Ascii,
        Some(b"binary_little_endian") => Encoding::LittleEndian,
        Some(b"binary_big_endian") => Encoding::BigEndian,
        _ => {
            return Err(
                "`format ascii 1.0`, `format binary_little_endian 1.0` or `format binary_big_endian 1.0`",
            );
        }
    };
    if matches!(words.next(), Some(b"1.0" | b"1")) { Ok(encoding) } else { Err("version 1.0") }
}

fn element<'a>(mut words: impl Iterator<Item = &'a [u8]>, place: Place) -> Result<Element, &'static str> {
    const EXPECTED: &str = "`element NAME COUNT`";
    let name = text(words.next()).ok_or(EXPECTED)?;
    let count = words.next().and_then(|count| {
        let text = std::str::from_utf8(count).ok()?;
        text.parse().ok().or_else(|| u64::try_from(whole_number(count)?).ok())
    });
    let count = count.ok_or(EXPECTED)?;
    Ok(Element { name, count, properties: Vec::new(), place })
}

fn property<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<Property, &'static str> {
    const EXPECTED: &str =
        "`property TYPE NAME` or `property list TYPE TYPE NAME`, with types such as uchar, int and float";
    let first = words.next().ok_or(EXPECTED)?;
    if first != b"list" {
        let kind = Kind::from_name(first).ok_or(EXPECTED)?;
        return Ok(Property::Scalar { name: text(words.next()).ok_or(EXPECTED)?, kind });
    }
    let mut kind = || words.next().and_then(Kind::from_name);
    let (count, item) = (kind().ok_or(EXPECTED)?, kind().ok_or(EXPECTED)?);
    if !count.is_whole() {
        return Err("a list whose length is of a whole type, such as uchar");
    }
    Ok(Property::List { name: text(words.next()).ok_or(EXPECTED)?, count, item })
}

fn text(word: Option<&[u8]>) -> Option<String> {
    word.map(|word| crate::volume::error::shown_name(&String::from_utf8_lossy(word)))
}
