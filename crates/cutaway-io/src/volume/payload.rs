//! The voxels of a file: found, bounded, decoded.
//!
//! What enters: a [`Layout`] (what the header claims, held against the limits), a [`Payload`] (how the data are
//! encoded and where they begin) and the [`Parts`] that hold them. What leaves: the bytes of one volume. Nothing is
//! allocated that the data could not fill: uncompressed data are held against the length of their file first,
//! deflate against its largest ratio, and what no ratio bounds (bzip2) grows only as bytes arrive.

use std::cell::Cell;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

use bzip2::bufread::MultiBzDecoder;
use flate2::bufread::ZlibDecoder;

use super::Context;
use super::ascii;
use super::detached;
pub(crate) use super::encoding::{Encoding, Payload, Skip};
use super::error::{Place, ReadError};
use super::layout::{Layout, Span, bytes_exactly};
use super::source::{GzipMembers, Left, Stream, has_more_than_zeros, is_gzip};
use crate::limits::bytes_text;

/// The first growth of a buffer whose size only a header claims.
const FIRST_CHUNK: u64 = 1 << 20;

/// What holds the data.
pub(crate) enum Parts<'a> {
    /// The rest of the header's file.
    Attached(Stream<'a>),
    /// Other files, each with an equal share, and where their names stand.
    Files(Vec<String>, Place),
}

/// Reads the volume that `layout` wants.
pub(crate) fn read(
    ctx: &mut Context<'_>,
    layout: &Layout,
    payload: &Payload,
    parts: Parts<'_>,
) -> Result<Vec<u8>, ReadError> {
    let mut out = Vec::new();
    let (from, to) = (layout.from * layout.size(), (layout.from + layout.group) * layout.size());
    match parts {
        Parts::Attached(stream) => {
            let span = Span { from, len: to - from, total: layout.total_bytes() };
            read_part(ctx, stream, payload, layout, span, &mut out)?;
        }
        Parts::Files(names, place) => {
            let total = part_bytes(ctx, layout, names.len(), place)?;
            for (i, name) in names.iter().enumerate() {
                let start = total * i as u64;
                let (first, last) = (from.max(start), to.min(start + total));
                if first < last {
                    let span = Span { from: first - start, len: last - first, total };
                    let folder = ctx.folder;
                    let stream = detached::open(ctx, folder, name, place, payload.encoding)?;
                    read_part(ctx, stream, payload, layout, span, &mut out)?;
                }
            }
        }
    }
    debug_assert_eq!(out.len(), layout.bytes_read());
    layout.pick(&mut out);
    Ok(out)
}

/// Bytes in each of `files` equal parts.
fn part_bytes(ctx: &Context<'_>, layout: &Layout, files: usize, place: Place) -> Result<u64, ReadError> {
    let files = files as u64;
    let groups = files.checked_mul(layout.components).filter(|n| *n > 0);
    if groups.is_none_or(|groups| !layout.elements.is_multiple_of(groups)) {
        return Err(ReadError::Field {
            file: ctx.file.clone(),
            place,
            field: "data file",
            found: format!("a list of {files} files").into(),
            expected: format!("a number that divides {} voxels evenly", layout.elements),
            hint: "",
        });
    }
    Ok(layout.elements / files * layout.size())
}

fn read_part(
    ctx: &mut Context<'_>,
    mut stream: Stream<'_>,
    payload: &Payload,
    layout: &Layout,
    span: Span,
    out: &mut Vec<u8>,
) -> Result<(), ReadError> {
    skip_ahead(&mut stream, payload, layout, span)?;
    let mut left = stream.left();
    if let Some(claimed) = payload.compressed {
        if left.most() < claimed {
            return Err(ReadError::TooShort {
                file: stream.name().to_owned(),
                what: "compressed data",
                found: left.most(),
                expected: bytes_exactly(claimed),
            });
        }
        left = Left::AtMost(claimed);
    }
    let encoding = payload.encoding;
    let mut task = Task {
        encoding,
        file: stream.name().to_owned(),
        position: stream.shared_position(),
        skip: payload.skip_decoded,
        layout,
        span,
    };
    let mut junk = Ok(false);
    let surplus = match encoding {
        Encoding::Raw => {
            let surplus = task.raw(&mut stream, left, out);
            junk = stream.goes_on();
            surplus
        }
        Encoding::Gzip => {
            let mut members = GzipMembers::new(stream);
            let surplus = task.decode(&mut members, left.inflated(), out);
            junk = members.goes_on();
            surplus
        }
        Encoding::Zlib => {
            let gzip = is_gzip(stream.fill_buf().map_err(|error| task.failed(error, 0))?);
            if gzip {
                task.encoding = Encoding::Gzip;
                let mut members = GzipMembers::new(stream);
                let surplus = task.decode(&mut members, left.inflated(), out);
                junk = members.goes_on();
                surplus
            } else {
                let mut decoder = ZlibDecoder::new(stream);
                let surplus = task.decode(&mut decoder, left.inflated(), out);
                if matches!(surplus, Ok(None)) && span.from + span.len == span.total {
                    junk = has_more_than_zeros(&mut decoder.into_inner());
                }
                surplus
            }
        }
        Encoding::Bzip2 => {
            let mut decoder = MultiBzDecoder::new(stream);
            task.decode(&mut decoder, Left::AtMost(u64::MAX), out)
        }
        Encoding::Hex => {
            task.decode(ascii::HexReader::new(stream), Left::AtMost(left.most().div_ceil(2)), out)
        }
        Encoding::Ascii => task.ascii(stream, left, out),
    }?;
    if payload.exact && surplus.is_some() {
        return Err(ReadError::TooLong {
            file: task.file.clone(),
            found: format!("more than {}", bytes_exactly(span.total)),
            expected: layout.describe(span),
            hint: "correct the dimensions, the type or the number of header bytes",
        });
    }
    if let Some(surplus) = surplus {
        ctx.notice(format!("{} goes on after its data: {surplus} ignored", task.file));
    } else if junk.map_err(|error| task.failed(error, span.total))? {
        let encoding = if task.encoding == Encoding::Raw { "gzip" } else { task.encoding.name() };
        ctx.notice(format!("{} goes on after its {encoding} data: the rest ignored", task.file));
    }
    Ok(())
}

/// Skips what the header says lies in front of the data.
fn skip_ahead(
    stream: &mut Stream<'_>,
    payload: &Payload,
    layout: &Layout,
    span: Span,
) -> Result<(), ReadError> {
    let failed = |stream: &Stream<'_>, error| ReadError::Io {
        file: stream.name().to_owned(),
        offset: stream.position(),
        error,
    };
    for line in 0..payload.lines {
        // `skip_until` is 0 only at the end: the loop is bounded by the file, not by the header's number.
        let skipped = stream.skip_until(b'\n');
        if skipped.map_err(|error| failed(stream, error))? == 0 {
            return Err(ReadError::TooShort {
                file: stream.name().to_owned(),
                what: "text before the data",
                found: stream.position(),
                expected: format!("{} lines to skip, but there are {line}", payload.lines),
            });
        }
    }
    let too_short = |stream: &Stream<'_>, found, expected| ReadError::TooShort {
        file: stream.name().to_owned(),
        what: "file",
        found,
        expected,
    };
    let n = match payload.skip {
        Skip::Bytes(n) => n,
        Skip::UpToLast => match stream.left() {
            Left::Exactly(left) if left >= span.total => left - span.total,
            Left::Exactly(left) => return Err(too_short(stream, left, layout.describe(span))),
            Left::AtMost(_) => {
                return Err(ReadError::Unsupported {
                    file: stream.name().to_owned(),
                    found: "data at the end of a compressed file (a skip of -1) are not supported".to_owned(),
                    hint: "decompress the file first",
                });
            }
        },
    };
    let skipped = stream.skip(n).map_err(|error| failed(stream, error))?;
    if skipped < n {
        return Err(too_short(stream, stream.position(), format!("{n} bytes to skip before the data")));
    }
    Ok(())
}

/// One part being decoded.
struct Task<'l> {
    encoding: Encoding,
    file: String,
    position: Rc<Cell<u64>>,
    skip: Skip,
    layout: &'l Layout,
    span: Span,
}

impl Task<'_> {
    /// Uncompressed data. The result is how much there is beyond them, if anything.
    fn raw(
        &self,
        stream: &mut Stream<'_>,
        left: Left,
        out: &mut Vec<u8>,
    ) -> Result<Option<String>, ReadError> {
        let total = self.span.total;
        if left.most() < total {
            return Err(self.too_short(left.most()));
        }
        let Left::Exactly(left) = left else {
            return self.decode(stream, left, out);
        };
        if self.layout.components > 1 {
            self.decode(stream, Left::Exactly(left), out)?;
        } else {
            self.reserve(out, self.span.len)?;
            stream.skip(self.span.from).map_err(|error| self.failed(error, 0))?;
            let read = stream.read_onto(self.span.len, out).map_err(|error| self.failed(error, 0))?;
            if read < self.span.len {
                return Err(self.too_short(self.span.from + read));
            }
        }
        Ok((left > total).then(|| bytes_exactly(left - total)))
    }

    /// Data that a decoder gives, of which there are at most `left` bytes.
    fn decode(
        &self,
        mut reader: impl Read,
        left: Left,
        out: &mut Vec<u8>,
    ) -> Result<Option<String>, ReadError> {
        let Span { from, len, total } = self.span;
        let before_data = match self.skip {
            Skip::Bytes(n) => n,
            Skip::UpToLast => {
                let last = self.last_bytes(reader)?;
                let data = Task {
                    skip: Skip::Bytes(0),
                    file: self.file.clone(),
                    position: Rc::clone(&self.position),
                    ..*self
                };
                return data.decode(last.as_slice(), Left::Exactly(total), out);
            }
        };
        if left.most() < total.saturating_add(before_data) {
            return Err(ReadError::Decode {
                file: self.file.clone(),
                offset: self.position.get(),
                encoding: self.encoding.name(),
                reason: format!(
                    "what the file has left of them cannot hold the {} that its header claims",
                    bytes_text(total)
                ),
            });
        }
        let skip = before_data.saturating_add(from);
        let skipped = io::copy(&mut (&mut reader).take(skip), &mut io::sink());
        let skipped = skipped.map_err(|error| self.failed(error, 0))?;
        if skipped < skip {
            return Err(self.too_short(skipped.saturating_sub(before_data)));
        }
        let before = out.len();
        let read = if self.layout.components > 1 {
            self.gather(&mut reader, out)
        } else {
            self.grow(&mut reader, len, out)
        };
        let found = from + (out.len() - before) as u64;
        let complete = read.map_err(|error| match error {
            Failure::Memory => self.no_memory(),
            Failure::Io(error) => self.failed(error, found),
        })?;
        if !complete {
            return Err(self.too_short(found));
        }
        if matches!(left, Left::Exactly(_)) || from + len < total {
            return Ok(None);
        }
        // The byte past the end also makes a decoder check its checksum.
        let mut one = [0];
        let n = reader.read(&mut one).map_err(|error| self.failed(error, found))?;
        Ok((n > 0).then(|| "the rest".to_owned()))
    }

    /// The last bytes that a decoder gives, as many as the part holds. It never keeps more than twice as many.
    fn last_bytes(&self, mut reader: impl Read) -> Result<Vec<u8>, ReadError> {
        let total = self.span.total as usize;
        let chunk = self.span.total.max(FIRST_CHUNK);
        let mut last = Vec::new();
        loop {
            let found = last.len() as u64;
            let read = reader.by_ref().take(chunk).read_to_end(&mut last);
            if read.map_err(|error| self.failed(error, found))? == 0 {
                break;
            }
            last.drain(..last.len().saturating_sub(total));
        }
        if last.len() < total { Err(self.too_short(last.len() as u64)) } else { Ok(last) }
    }

    /// Reads `n` bytes, allocating as they arrive. False where there are fewer.
    fn grow(&self, reader: &mut impl Read, n: u64, out: &mut Vec<u8>) -> Result<bool, Failure> {
        let mut missing = n;
        while missing > 0 {
            let chunk = missing.min(FIRST_CHUNK.max(out.len() as u64));
            self.reserve(out, chunk).map_err(|_| Failure::Memory)?;
            let read = reader.by_ref().take(chunk).read_to_end(out).map_err(Failure::Io)? as u64;
            if read < chunk {
                return Ok(false);
            }
            missing -= read;
        }
        Ok(true)
    }

    /// Reads the span and keeps one component of each group of interleaved ones. False where there is less.
    fn gather(&self, reader: &mut impl Read, out: &mut Vec<u8>) -> Result<bool, Failure> {
        let size = self.layout.voxel.bytes();
        let stride = self.layout.components * self.layout.size();
        let offset = self.layout.component * self.layout.size();
        let mut groups = self.span.len / stride;
        if stride > FIRST_CHUNK {
            // So many components that a group does not fit in the buffer: element by element.
            while groups > 0 {
                let skipped = io::copy(&mut reader.by_ref().take(offset), &mut io::sink());
                skipped.map_err(Failure::Io)?;
                if reader.by_ref().take(size as u64).read_to_end(out).map_err(Failure::Io)? < size {
                    return Ok(false);
                }
                let rest = stride - offset - size as u64;
                if io::copy(&mut reader.by_ref().take(rest), &mut io::sink()).map_err(Failure::Io)? < rest {
                    return Ok(false);
                }
                groups -= 1;
            }
            return Ok(true);
        }
        let per_chunk = FIRST_CHUNK / stride;
        let mut buffer = Vec::new();
        while groups > 0 {
            let chunk = groups.min(per_chunk);
            buffer.clear();
            reader.by_ref().take(chunk * stride).read_to_end(&mut buffer).map_err(Failure::Io)?;
            self.reserve(out, chunk * size as u64).map_err(|_| Failure::Memory)?;
            for group in buffer.chunks_exact(stride as usize) {
                out.extend_from_slice(&group[offset as usize..offset as usize + size]);
            }
            if (buffer.len() as u64) < chunk * stride {
                return Ok(false);
            }
            groups -= chunk;
        }
        Ok(true)
    }

    /// Numbers as text, turned into little-endian bytes.
    fn ascii(
        &self,
        mut stream: Stream<'_>,
        left: Left,
        out: &mut Vec<u8>,
    ) -> Result<Option<String>, ReadError> {
        let size = self.layout.size();
        let total = self.span.total / size;
        // Each number but the last takes a digit and a separator.
        if left.most().div_ceil(2) < total {
            return Err(self.too_short(left.most().div_ceil(2) * size));
        }
        let numbers = ascii::Numbers {
            skip: self.span.from / size,
            take: self.span.len / size,
            step: self.layout.components,
            offset: self.layout.component,
        };
        let read = ascii::read(&mut stream, self.layout.voxel, numbers, out);
        let found = read.map_err(|error| match error {
            ascii::AsciiError::Io(error) => self.failed(error, 0),
            ascii::AsciiError::Number { offset, found } => ReadError::Decode {
                file: self.file.clone(),
                offset,
                encoding: self.encoding.name(),
                reason: format!("{found} is no {}", self.layout.voxel.name()),
            },
        })?;
        if found < numbers.skip + numbers.take {
            return Err(self.too_short(found * size));
        }
        let ends_here = self.span.from + self.span.len == self.span.total;
        let more = ends_here && ascii::has_more(&mut stream).map_err(|error| self.failed(error, 0))?;
        Ok(more.then(|| "the rest".to_owned()))
    }

    fn reserve(&self, out: &mut Vec<u8>, n: u64) -> Result<(), ReadError> {
        let n = usize::try_from(n).unwrap_or(usize::MAX);
        // Doubling, but never beyond the volume.
        let n = n.max(out.len().min(self.layout.bytes_read().saturating_sub(out.len())));
        if out.capacity() - out.len() >= n {
            return Ok(());
        }
        out.try_reserve_exact(n).map_err(|_| self.no_memory())
    }

    fn no_memory(&self) -> ReadError {
        ReadError::NoMemory { file: self.file.clone(), needed: self.layout.bytes_read() as u64 }
    }

    fn too_short(&self, found: u64) -> ReadError {
        ReadError::TooShort {
            file: self.file.clone(),
            what: "data",
            found,
            expected: self.layout.describe(self.span),
        }
    }

    /// An error of a decoder, or of the file below it, after `found` bytes.
    fn failed(&self, error: io::Error, found: u64) -> ReadError {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => self.too_short(found),
            io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData => ReadError::Decode {
                file: self.file.clone(),
                offset: self.position.get(),
                encoding: self.encoding.name(),
                reason: error.to_string(),
            },
            _ => ReadError::Io { file: self.file.clone(), offset: self.position.get(), error },
        }
    }
}

enum Failure {
    Io(io::Error),
    Memory,
}
