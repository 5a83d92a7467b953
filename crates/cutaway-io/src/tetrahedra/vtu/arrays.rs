//! Data arrays: the numbers of a tag, as text, in base64 or behind all tags, whole or in compressed blocks.

use super::encoded::Encoded;
use super::packed::Compressor;
use crate::tetrahedra::error::TetrahedraReadError as Error;
use crate::tetrahedra::numbers::{Kind, Number};
use crate::volume::Place;
use crate::volume::error::quoted;

/// The largest block that is unpacked though less of it is wanted; VTK's have 32 KiB.
const MOST_SURPLUS: u64 = 1 << 20;

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Encoding {
    pub(super) big_endian: bool,
    /// Of lengths before data.
    pub(super) header: Kind,
    pub(super) compressor: Option<Compressor>,
}

/// An array by its tag.
#[derive(Debug)]
pub(super) struct Array<'a> {
    pub(super) name: String,
    pub(super) kind: String,
    pub(super) components: u64,
    pub(super) format: String,
    pub(super) offset: Option<u64>,
    /// The time step that it is for; none: every one.
    pub(super) step: Option<u64>,
    pub(super) text: &'a [u8],
    /// The byte that its tag ends at.
    pub(super) at: usize,
}

/// Behind all tags: the bytes after the underscore, and whether they are base64.
pub(super) struct Appended<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) base64: bool,
}

/// Decodes arrays, and counts the bytes that they take.
pub(super) struct Decoder<'a> {
    pub(super) file: &'a str,
    pub(super) encoding: Encoding,
    pub(super) appended: Option<Appended<'a>>,
    /// Bytes that arrays may still take.
    left: u64,
    limit: u64,
}

impl<'a> Decoder<'a> {
    pub(super) fn new(file: &'a str, limit: u64) -> Self {
        let encoding = Encoding { big_endian: false, header: Kind::U32, compressor: None };
        Self { file, encoding, appended: None, left: limit, limit }
    }

    pub(super) fn syntax(&self, at: usize, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let place = Place::Byte(at as u64);
        Error::Syntax { file: self.file.to_owned(), place, found: found.into(), expected: expected.into() }
    }

    pub(super) fn unsupported(&self, found: String, supported: &'static str) -> Error {
        Error::Unsupported { file: self.file.to_owned(), found, supported }
    }

    /// Counts bytes against the limit.
    pub(super) fn take(&mut self, bytes: u64) -> Result<(), Error> {
        if let Some(left) = self.left.checked_sub(bytes) {
            self.left = left;
            return Ok(());
        }
        let needed = (self.limit - self.left).saturating_add(bytes);
        Err(Error::TooLarge { file: self.file.to_owned(), what: "its arrays", needed, limit: self.limit })
    }

    /// The numbers of an array, of which there are this many.
    pub(super) fn numbers<T: Number>(&mut self, array: &Array, count: u64) -> Result<Vec<T>, Error> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let kind = Kind::of_xml(&array.kind);
        let kind = kind
            .ok_or_else(|| self.syntax(array.at, quoted(&array.kind), "a type of numbers, as `Float32`"))?;
        let needed = kind.bytes_of(count).unwrap_or(u64::MAX);
        if array.format == "ascii" {
            if count > array.text.len() as u64 {
                return Err(self.short(array, array.text.len() as u64, needed, count));
            }
            self.take(count.saturating_mul(8))?;
            return self.text(array, count);
        }
        let mut stream = self.stream(array, needed, count)?;
        // Before anything is made: what there is cannot become more than this.
        let most = self.encoding.compressor.map_or(stream.left(), |by| by.most(stream.left()));
        if needed > most {
            return Err(self.short(array, stream.left(), needed, count));
        }
        self.take(needed.saturating_add(count.saturating_mul(8)))?;
        let bytes = match self.encoding.compressor {
            Some(by) => self.unpacked(by, &mut stream, needed, array)?,
            None => {
                let found = self.length(&mut stream, array)?;
                if found < needed {
                    return Err(self.short(array, found, needed, count));
                }
                let left = stream.left();
                stream.take(needed).ok_or_else(|| self.short(array, left, needed, count))?
            }
        };
        let mut numbers = kind.decode(&bytes, self.encoding.big_endian);
        numbers.truncate(count as usize);
        Ok(numbers)
    }

    /// Where an array's bytes begin.
    fn stream(&self, array: &Array<'a>, needed: u64, count: u64) -> Result<Encoded<'a>, Error> {
        match (array.format.as_str(), &self.appended) {
            ("binary", _) => Ok(Encoded::new(array.text, true)),
            ("appended", Some(appended)) => {
                let offset = array.offset.and_then(|offset| usize::try_from(offset).ok());
                let rest = offset.and_then(|offset| appended.bytes.get(offset..));
                let rest = rest.ok_or_else(|| self.short(array, 0, needed, count))?;
                Ok(Encoded::new(rest, appended.base64))
            }
            ("appended", None) => Err(self.syntax(array.at, "none", "appended data")),
            (other, _) => {
                Err(self.unsupported(format!("an array is {}", quoted(other)), "ascii, binary, appended"))
            }
        }
    }

    fn short(&self, array: &Array, found: u64, needed: u64, count: u64) -> Error {
        Error::TooShort {
            file: self.file.to_owned(),
            what: format!("the array {}", quoted(&array.name)),
            found,
            expected: format!("{needed} for {count} numbers"),
        }
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
    fn length(&self, stream: &mut Encoded, array: &Array) -> Result<u64, Error> {
        let kind = self.encoding.header;
        let bytes = stream.take(kind.size() as u64);
        let numbers: Vec<i64> =
            bytes.map_or_else(Vec::new, |bytes| kind.decode(&bytes, self.encoding.big_endian));
        let number = numbers.first().and_then(|n| u64::try_from(*n).ok());
        number.ok_or_else(|| {
            self.syntax(array.at, "no length", format!("the length of the array {}", quoted(&array.name)))
        })
    }

    /// Compressed blocks: their number, the size of one, that of the last one (0: as the others), and how long each is
    /// compressed; then the blocks.
    fn unpacked(
        &self,
        by: Compressor,
        stream: &mut Encoded,
        needed: u64,
        array: &Array,
    ) -> Result<Vec<u8>, Error> {
        let wrong = |found: String, expected: &str| {
            self.syntax(array.at, found, format!("{expected} of the array {}", quoted(&array.name)))
        };
        let blocks = self.length(stream, array)?;
        let [size, last] =
            if blocks == 0 { [0, 0] } else { [self.length(stream, array)?, self.length(stream, array)?] };
        if blocks.saturating_mul(self.encoding.header.size() as u64) > stream.left() {
            return Err(wrong(format!("{blocks} blocks"), "as many blocks as there are bytes for"));
        }
        let lengths: Vec<u64> = (0..blocks).map(|_| self.length(stream, array)).collect::<Result<_, _>>()?;
        let mut all = Vec::new();
        for (k, length) in lengths.iter().enumerate() {
            let missing = needed - all.len() as u64;
            if missing == 0 {
                break;
            }
            let expected = if k as u64 + 1 == blocks && last > 0 { last } else { size };
            let packed = stream
                .take(*length)
                .ok_or_else(|| wrong(format!("block {k} of {length} bytes"), "a whole block"))?;
            // A block may hold a little more than what is wanted of it: its end is left out.
            let most = expected.min(missing.max(MOST_SURPLUS));
            let block = by.unpack(&packed, usize::try_from(most).unwrap_or(usize::MAX));
            let block = block.map_err(|error| wrong(format!("block {k}: {error}"), "undamaged data"))?;
            if (block.len() as u64) < expected.min(missing) {
                return Err(wrong(format!("block {k} of {} bytes", block.len()), "whole blocks"));
            }
            let wanted = block.len().min(usize::try_from(missing).unwrap_or(usize::MAX));
            all.extend_from_slice(&block[..wanted]);
        }
        if (all.len() as u64) < needed {
            return Err(wrong(format!("{} bytes", all.len()), &format!("{needed} bytes")));
        }
        Ok(all)
    }
}
