//! VTK XML files of unstructured grids: data arrays as text, as base64, or behind all tags, whole or in blocks of zlib.

use std::collections::BTreeMap;
use std::io::Read;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use cutaway_core::glam::DVec3;
use flate2::read::ZlibDecoder;

use super::error::TetrahedraReadError as Error;
use super::legacy::{add_cells, no_values};
use super::numbers::{Kind, Number};
use super::xml::{Event, Xml};
use super::{Parsed, TetrahedraReadOptions};
use crate::volume::Place;
use crate::volume::error::quoted;

/// Deflate never makes more than 1032 bytes of one.
const DEFLATE_RATIO: u64 = 1032;

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug)]
struct Encoding {
    big_endian: bool,
    /// Of lengths before data.
    header: Kind,
    zlib: bool,
}

/// An array by its tag.
#[derive(Debug)]
struct Array<'a> {
    name: String,
    kind: String,
    components: u64,
    format: String,
    offset: Option<u64>,
    text: &'a [u8],
    at: usize,
}

/// A piece of the grid: its arrays by the element that they are in.
#[derive(Debug, Default)]
struct Piece<'a> {
    points: u64,
    cells: u64,
    /// The name of the active scalars.
    scalars: Option<String>,
    arrays: BTreeMap<&'static str, Vec<Array<'a>>>,
}

/// Behind all tags: the bytes after the underscore, and whether they are base64.
struct Appended<'a> {
    bytes: &'a [u8],
    base64: bool,
}

struct Reader<'a> {
    file: &'a str,
    encoding: Encoding,
    appended: Option<Appended<'a>>,
    /// Bytes that arrays may still take.
    left: u64,
    limit: u64,
}

pub(super) fn read(file: &str, bytes: &[u8], options: &TetrahedraReadOptions) -> Result<Parsed, Error> {
    let limit = options.limits.max_bytes;
    let default = Encoding { big_endian: false, header: Kind::U32, zlib: false };
    let mut reader = Reader { file, encoding: default, appended: None, left: limit, limit };
    let pieces = reader.pieces(bytes)?;
    let mut parsed = Parsed::default();
    for piece in &pieces {
        reader.add(piece, &mut parsed, options)?;
    }
    Ok(parsed)
}

impl<'a> Reader<'a> {
    fn syntax(&self, at: usize, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let place = Place::Byte(at as u64);
        Error::Syntax { file: self.file.to_owned(), place, found: found.into(), expected: expected.into() }
    }

    fn unsupported(&self, found: String, supported: &'static str) -> Error {
        Error::Unsupported { file: self.file.to_owned(), found, supported }
    }

    /// Reads all tags; no array is decoded yet.
    fn pieces(&mut self, bytes: &'a [u8]) -> Result<Vec<Piece<'a>>, Error> {
        let mut xml = Xml::new(bytes);
        let mut pieces: Vec<Piece> = Vec::new();
        let mut inside = "";
        loop {
            let event =
                xml.next().map_err(|expected| self.syntax(xml.position(), "something else", expected))?;
            let (name, mut attributes, closed) = match event {
                None => return Ok(pieces),
                Some(Event::End { name }) => {
                    if matches!(name, "PointData" | "CellData" | "Points" | "Cells") {
                        inside = "";
                    }
                    continue;
                }
                Some(Event::Begin { name, attributes, closed }) => (name, attributes, closed),
            };
            let at = xml.position();
            match name {
                "VTKFile" => self.encoding = self.encoding(&attributes)?,
                "Piece" => {
                    let count = |key: &str| match attributes.get(key).map(|text| (text, text.trim().parse()))
                    {
                        Some((_, Ok(count))) => Ok(count),
                        Some((text, Err(_))) => {
                            Err(self.syntax(at, quoted(text), format!("a number as `{key}`")))
                        }
                        None => Err(self.syntax(at, "none", format!("`{key}` of a piece"))),
                    };
                    let (points, cells) = (count("NumberOfPoints")?, count("NumberOfCells")?);
                    pieces.push(Piece { points, cells, ..Piece::default() });
                }
                "PointData" | "CellData" | "Points" | "Cells" if !closed => {
                    inside = match name {
                        "PointData" => "PointData",
                        "CellData" => "CellData",
                        "Points" => "Points",
                        _ => "Cells",
                    };
                    if let ("PointData", Some(piece)) = (name, pieces.last_mut()) {
                        piece.scalars = attributes.remove("Scalars");
                    }
                }
                "DataArray" => {
                    let array = self.array(attributes, if closed { &[] } else { xml.text() }, at)?;
                    if let Some(piece) = pieces.last_mut().filter(|_| !inside.is_empty()) {
                        piece.arrays.entry(inside).or_default().push(array);
                    }
                }
                "AppendedData" => {
                    let base64 = match attributes.get("encoding").map(String::as_str) {
                        Some("base64") => true,
                        Some("raw") | None => false,
                        Some(other) => {
                            return Err(self.unsupported(
                                format!("the appended data are {}", quoted(other)),
                                "raw, base64",
                            ));
                        }
                    };
                    let rest = xml.rest();
                    let begin = rest.iter().position(|b| *b == b'_');
                    let begin =
                        begin.ok_or_else(|| self.syntax(at, "none", "`_` before the appended data"))?;
                    self.appended = Some(Appended { bytes: &rest[begin + 1..], base64 });
                    // What follows may look like anything.
                    return Ok(pieces);
                }
                _ => {}
            }
        }
    }

    fn encoding(&self, attributes: &BTreeMap<&str, String>) -> Result<Encoding, Error> {
        let get = |key: &str| attributes.get(key).map(String::as_str);
        if let Some(other) = get("type").filter(|kind| *kind != "UnstructuredGrid") {
            return Err(
                self.unsupported(format!("the file is of type {}", quoted(other)), "unstructured grids")
            );
        }
        let big_endian = match get("byte_order") {
            None | Some("LittleEndian") => false,
            Some("BigEndian") => true,
            Some(other) => {
                return Err(self
                    .unsupported(format!("the byte order is {}", quoted(other)), "LittleEndian, BigEndian"));
            }
        };
        let header = match get("header_type") {
            None | Some("UInt32") => Kind::U32,
            Some("UInt64") => Kind::U64,
            Some(other) => {
                return Err(
                    self.unsupported(format!("the header type is {}", quoted(other)), "UInt32, UInt64")
                );
            }
        };
        let zlib = match get("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                return Err(
                    self.unsupported(format!("the compressor is {}", quoted(other)), "vtkZLibDataCompressor")
                );
            }
        };
        Ok(Encoding { big_endian, header, zlib })
    }

    fn array(
        &self,
        mut attributes: BTreeMap<&str, String>,
        text: &'a [u8],
        at: usize,
    ) -> Result<Array<'a>, Error> {
        let mut take = |key: &str| attributes.remove(key);
        let number = |key: &str, text: Option<String>| match text.map(|text| (text.trim().parse(), text)) {
            None => Ok(None),
            Some((Ok(number), _)) => Ok(Some(number)),
            Some((Err(_), text)) => Err(self.syntax(at, quoted(&text), format!("a number as `{key}`"))),
        };
        Ok(Array {
            name: take("Name").unwrap_or_default(),
            kind: take("type").unwrap_or_default(),
            components: number("NumberOfComponents", take("NumberOfComponents"))?.unwrap_or(1),
            format: take("format").unwrap_or_else(|| "ascii".to_owned()),
            offset: number("offset", take("offset"))?,
            text,
            at,
        })
    }

    fn add(
        &mut self,
        piece: &Piece,
        parsed: &mut Parsed,
        options: &TetrahedraReadOptions,
    ) -> Result<(), Error> {
        let arrays = |inside: &str| piece.arrays.get(inside).map_or(&[][..], Vec::as_slice);
        let missing = |what: &str| self.syntax(0, "none", format!("the array {what}"));
        let first = parsed.points.len();
        let points = arrays("Points").first().ok_or_else(|| missing("of points"))?;
        let numbers = piece.points.saturating_mul(3);
        let points: Vec<f64> = self.numbers(points, numbers)?;
        parsed.points.extend(points.as_chunks::<3>().0.iter().map(|p| DVec3::from_array(*p)));
        let cells = |name: &str| arrays("Cells").iter().find(|a| a.name == name);
        let missing = |what: &str| self.syntax(0, "none", format!("the array `{what}` of cells"));
        let (names, ends, kinds) = (
            cells("connectivity").ok_or_else(|| missing("connectivity"))?,
            cells("offsets").ok_or_else(|| missing("offsets"))?,
            cells("types").ok_or_else(|| missing("types"))?,
        );
        let ends: Vec<i64> = self.numbers(ends, piece.cells)?;
        let kinds: Vec<i64> = self.numbers(kinds, piece.cells)?;
        let mut offsets = vec![0];
        offsets.extend(ends);
        let last = u64::try_from(offsets[offsets.len() - 1]).unwrap_or(u64::MAX);
        // What is cut into tetrahedra grows.
        self.take(last.saturating_mul(16))?;
        let names: Vec<i64> = self.numbers(names, last)?;
        let shift = first as i64;
        let count = parsed.points.len() - first;
        let mut own = super::cells::Tetrahedra::default();
        add_cells(&mut own, self.file, &offsets, &names, &kinds, count)?;
        parsed.cells.append(own, shift as u32);
        let array = self.values(piece, options)?;
        let values: Vec<f64> = self.numbers(array, piece.points)?;
        parsed.values.extend(values);
        Ok(())
    }

    fn values<'b>(
        &self,
        piece: &'b Piece<'a>,
        options: &TetrahedraReadOptions,
    ) -> Result<&'b Array<'a>, Error> {
        let arrays = piece.arrays.get("PointData").map_or(&[][..], Vec::as_slice);
        let scalar = || arrays.iter().filter(|a| a.components == 1);
        let found = match &options.array {
            Some(name) => scalar().find(|a| a.name == *name),
            None => scalar().find(|a| Some(&a.name) == piece.scalars.as_ref()).or_else(|| scalar().next()),
        };
        found.ok_or_else(|| {
            let shown = |a: &Array, what: &str| {
                format!("{} ({what} of {} components)", quoted(&a.name), a.components)
            };
            let cell_data = piece.arrays.get("CellData").map_or(&[][..], Vec::as_slice);
            let names = arrays.iter().map(|a| shown(a, "point data"));
            let names: Vec<String> = names.chain(cell_data.iter().map(|a| shown(a, "cell data"))).collect();
            no_values(self.file, &names, options)
        })
    }

    /// Counts bytes against the limit.
    fn take(&mut self, bytes: u64) -> Result<(), Error> {
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => {
                let needed = (self.limit - self.left).saturating_add(bytes);
                Err(Error::TooLarge {
                    file: self.file.to_owned(),
                    what: "its arrays",
                    needed,
                    limit: self.limit,
                })
            }
        }
    }

    /// The numbers of an array, of which there are so many.
    fn numbers<T: Number>(&mut self, array: &Array, count: u64) -> Result<Vec<T>, Error> {
        let kind = Kind::named(&array.kind).filter(|kind| *kind != Kind::Bit);
        let kind = kind
            .ok_or_else(|| self.syntax(array.at, quoted(&array.kind), "a type of numbers, as `Float32`"))?;
        let needed = kind.bytes_of(count).unwrap_or(u64::MAX);
        let short = |found: u64| Error::TooShort {
            file: self.file.to_owned(),
            what: format!("the array {}", quoted(&array.name)),
            found,
            expected: format!("{needed} for {count} numbers"),
        };
        if array.format == "ascii" {
            if count > array.text.len() as u64 {
                return Err(short(array.text.len() as u64));
            }
            self.take(count.saturating_mul(8))?;
            return self.text(array, count);
        }
        let (source, base64) = match (array.format.as_str(), &self.appended) {
            ("binary", _) => (array.text.trim_ascii(), true),
            ("appended", Some(appended)) => {
                let offset = array.offset.and_then(|offset| usize::try_from(offset).ok());
                let rest = offset.and_then(|offset| appended.bytes.get(offset..));
                (rest.ok_or_else(|| short(0))?, appended.base64)
            }
            ("appended", None) => return Err(self.syntax(array.at, "none", "appended data")),
            (other, _) => {
                return Err(
                    self.unsupported(format!("an array is {}", quoted(other)), "ascii, binary, appended")
                );
            }
        };
        // Before anything is made: what there is cannot become more than this.
        let ratio = if self.encoding.zlib { DEFLATE_RATIO } else { 1 };
        if needed > (source.len() as u64).saturating_mul(ratio) {
            return Err(short(source.len() as u64));
        }
        self.take(needed.saturating_add(count.saturating_mul(8)))?;
        let mut stream = Bytes { source, base64, at: 0 };
        let bytes = if self.encoding.zlib {
            self.inflated(&mut stream, needed, array)?
        } else {
            let found = self.header(&mut stream, array)?;
            if found < needed {
                return Err(short(found));
            }
            stream.take(needed).ok_or_else(|| short(source.len() as u64))?
        };
        Ok(kind.decode(&bytes, self.encoding.big_endian))
    }

    fn text<T: Number>(&self, array: &Array, count: u64) -> Result<Vec<T>, Error> {
        let words = array.text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let mut numbers = Vec::with_capacity(count as usize);
        for word in words.take(count as usize) {
            let word = std::str::from_utf8(word).unwrap_or("\u{fffd}");
            let number = T::of_text(word);
            numbers.push(number.ok_or_else(|| {
                self.syntax(array.at, quoted(word), format!("a number in the array {}", quoted(&array.name)))
            })?);
        }
        if numbers.len() as u64 == count {
            return Ok(numbers);
        }
        let found = format!("{} numbers in the array {}", numbers.len(), quoted(&array.name));
        Err(self.syntax(array.at, found, format!("{count}")))
    }

    /// A number of the type that headers have.
    fn header(&self, stream: &mut Bytes, array: &Array) -> Result<u64, Error> {
        let kind = self.encoding.header;
        let bytes = stream.take(kind.size() as u64);
        let numbers: Vec<i64> =
            bytes.map_or_else(Vec::new, |bytes| kind.decode(&bytes, self.encoding.big_endian));
        let number = numbers.first().and_then(|n| u64::try_from(*n).ok());
        number.ok_or_else(|| {
            self.syntax(array.at, "no length", format!("the length of the array {}", quoted(&array.name)))
        })
    }

    /// Blocks of zlib: their number, the size of one, that of the last one, and how long each is compressed; then they.
    fn inflated(&self, stream: &mut Bytes, needed: u64, array: &Array) -> Result<Vec<u8>, Error> {
        let wrong = |found: String, expected: &str| {
            self.syntax(array.at, found, format!("{expected} of the array {}", quoted(&array.name)))
        };
        let (blocks, size, last) =
            (self.header(stream, array)?, self.header(stream, array)?, self.header(stream, array)?);
        if blocks.saturating_mul(self.encoding.header.size() as u64) > stream.source.len() as u64 {
            return Err(wrong(format!("{blocks} blocks"), "as many blocks as there are bytes for"));
        }
        let lengths: Vec<u64> = (0..blocks).map(|_| self.header(stream, array)).collect::<Result<_, _>>()?;
        // Base64 begins anew after the header.
        stream.restart();
        let mut all = Vec::new();
        for (k, length) in lengths.iter().enumerate() {
            let expected = if k as u64 + 1 == blocks && last > 0 { last } else { size };
            let packed = stream
                .take(*length)
                .ok_or_else(|| wrong(format!("block {k} of {length} bytes"), "a whole block"))?;
            let left = needed.saturating_sub(all.len() as u64);
            let before = all.len() as u64;
            let read = ZlibDecoder::new(&packed[..]).take(expected.min(left)).read_to_end(&mut all);
            if let Err(error) = read {
                return Err(wrong(format!("block {k}: {error}"), "zlib data"));
            }
            if (all.len() as u64 - before) < expected.min(left) {
                return Err(wrong(
                    format!("block {k} of {} bytes", all.len() as u64 - before),
                    "whole blocks",
                ));
            }
        }
        if (all.len() as u64) < needed {
            return Err(wrong(format!("{} bytes", all.len()), &format!("{needed} bytes")));
        }
        Ok(all)
    }
}

/// Bytes as they are or in base64, from the front.
struct Bytes<'a> {
    source: &'a [u8],
    base64: bool,
    /// How many have been taken: decoded ones since the last restart.
    at: u64,
}

impl Bytes<'_> {
    /// Base64 that begins here begins with a new group of four letters.
    fn restart(&mut self) {
        if self.base64 {
            let groups = self.at.div_ceil(3) * 4;
            self.source = self.source.get(groups as usize..).unwrap_or_default();
            self.at = 0;
        }
    }

    /// The next bytes; none where there are not so many.
    fn take(&mut self, count: u64) -> Option<Vec<u8>> {
        let end = self.at.checked_add(count)?;
        if !self.base64 {
            let bytes = self.source.get(usize::try_from(self.at).ok()?..usize::try_from(end).ok()?)?;
            self.at = end;
            return Some(bytes.to_vec());
        }
        let (first, groups) = (self.at / 3, end.div_ceil(3));
        let letters =
            usize::try_from(first.checked_mul(4)?).ok()?..usize::try_from(groups.checked_mul(4)?).ok()?;
        let decoded = STANDARD.decode(self.source.get(letters)?);
        let mut decoded = match decoded {
            Ok(decoded) => decoded,
            // Padding in the middle: a header that was encoded by itself.
            Err(_) => self.decoded_in_parts(end)?,
        };
        let skip = (self.at - 3 * first) as usize;
        if decoded.len() < skip + count as usize {
            decoded = self.decoded_in_parts(end)?.split_off(3 * first as usize);
        }
        self.at = end;
        Some(decoded.get(skip..skip + count as usize)?.to_vec())
    }

    /// The first bytes of base64 that was encoded in several parts, each with its own padding.
    fn decoded_in_parts(&self, end: u64) -> Option<Vec<u8>> {
        let mut all = Vec::new();
        for group in self.source.chunks(4) {
            if all.len() as u64 >= end {
                break;
            }
            all.extend(STANDARD.decode(group).ok()?);
        }
        Some(all)
    }
}
