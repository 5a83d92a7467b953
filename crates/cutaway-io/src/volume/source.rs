//! Where bytes come from: a folder with files (on disk or in memory) and streams that know how much they can still
//! give.
//!
//! A [`Folder`] is all that a reader ever sees of the file system, so that no name from inside a file can lead out of
//! it. A `Stream` counts what was taken from it and carries a bound on what is left: exact for a plain file, the most
//! that deflate could make of it for a compressed one.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use flate2::bufread::GzDecoder;

use crate::files::open_regular;

/// Deflate never makes more than 1032 bytes of one (258 bytes from two bits).
const DEFLATE_RATIO: u64 = 1032;

/// The buffer in front of a file. Larger reads go past it.
const BUFFER: usize = 128 << 10;

/// Something that can be read and sought in.
pub trait ReadSeek: Read + Seek {}
impl<T: Read + Seek> ReadSeek for T {}

/// An opened file and its length.
pub struct Source<'a> {
    reader: Box<dyn ReadSeek + 'a>,
    len: u64,
}

impl<'a> Source<'a> {
    /// A file of `len` bytes, positioned at its start.
    pub fn new(reader: impl ReadSeek + 'a, len: u64) -> Self {
        Self { reader: Box::new(reader), len }
    }

    /// A file that is already in memory.
    pub fn from_slice(bytes: &'a [u8]) -> Self {
        Self::new(Cursor::new(bytes), bytes.len() as u64)
    }

    /// Length in bytes.
    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// The first bytes of the file, at most `n`, and, where it is gzip-compressed, the first bytes inside (none where
    /// they cannot be decoded). The position is the start again afterwards.
    pub(crate) fn head(&mut self, n: u64) -> io::Result<(Vec<u8>, Option<Vec<u8>>)> {
        let mut head = Vec::new();
        (&mut self.reader).take(n).read_to_end(&mut head)?;
        self.reader.rewind()?;
        let mut inside = None;
        if is_gzip(&head) {
            let mut bytes = Vec::new();
            let decoder = GzipMembers::new(BufReader::new(&mut self.reader));
            // A damaged stream is reported by the reader that needs it.
            let _ = decoder.take(n).read_to_end(&mut bytes);
            inside = Some(bytes);
            self.reader.rewind()?;
        }
        Ok((head, inside))
    }
}

/// Whether bytes begin as a gzip file with deflate inside does.
pub(crate) fn is_gzip(head: &[u8]) -> bool {
    head.starts_with(&[0x1f, 0x8b, 8])
}

/// Why a file of a [`Folder`] could not be opened.
#[derive(Debug)]
#[non_exhaustive]
pub enum OpenError {
    /// The system's reason.
    Io(io::Error),
    /// The name leads out of the folder (through a symbolic link, say).
    Outside,
}

impl From<io::Error> for OpenError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// The files beside a header, and the only ones that it may name.
///
/// Names are relative, with `/` between their parts, and without `..`: readers check that before they ask.
pub trait Folder {
    /// Opens the file `name`.
    fn open(&self, name: &str) -> Result<Source<'_>, OpenError>;
}

/// A folder on disk.
#[derive(Clone, Debug)]
pub struct DiskFolder {
    root: PathBuf,
}

impl DiskFolder {
    /// The folder `root`, which must exist.
    pub fn new(root: &Path) -> io::Result<Self> {
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        Ok(Self { root: root.canonicalize()? })
    }
}

impl Folder for DiskFolder {
    fn open(&self, name: &str) -> Result<Source<'_>, OpenError> {
        let path = self.root.join(name).canonicalize()?;
        if !path.starts_with(&self.root) {
            return Err(OpenError::Outside);
        }
        Ok(open_file(&path)?)
    }
}

/// Opens a regular file. Anything else (folders, pipes, devices) could block or never end.
pub(crate) fn open_file(path: &Path) -> io::Result<Source<'static>> {
    let (file, len) = open_regular(path)?;
    Ok(Source::new(file, len))
}

/// Files in memory, by name: what a browser page was given, or a test.
pub type MemoryFolder = BTreeMap<String, Vec<u8>>;

impl Folder for MemoryFolder {
    fn open(&self, name: &str) -> Result<Source<'_>, OpenError> {
        let found = self.get(name).map(|bytes| Source::from_slice(bytes));
        found.ok_or_else(|| OpenError::Io(io::Error::new(io::ErrorKind::NotFound, "no such file")))
    }
}

/// The members of a gzip file, one after the other, as gzip's own tool reads them. Bytes after the last member that
/// do not begin another one are left alone; [`GzipMembers::goes_on`] says whether there are any.
pub(crate) struct GzipMembers<R> {
    member: Option<GzDecoder<R>>,
    rest: Option<R>,
}

impl<R: BufRead> GzipMembers<R> {
    pub(crate) fn new(reader: R) -> Self {
        Self { member: Some(GzDecoder::new(reader)), rest: None }
    }

    /// Whether there is more behind the last member, once that has been read to its end. Zeros do not count: gzip lets
    /// them pass, as padding of tapes.
    pub(crate) fn goes_on(&mut self) -> io::Result<bool> {
        self.rest.as_mut().map_or(Ok(false), has_more_than_zeros)
    }
}

impl<R: BufRead> Read for GzipMembers<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while let Some(mut member) = self.member.take() {
            let n = member.read(buffer);
            if !matches!(n, Ok(0)) || buffer.is_empty() {
                self.member = Some(member);
                return n;
            }
            let mut rest = member.into_inner();
            let next = rest.fill_buf()?;
            // A buffer may end within the three bytes that tell.
            if next.first() == Some(&0x1f) && (next.len() < 3 || is_gzip(next)) {
                self.member = Some(GzDecoder::new(rest));
            } else {
                self.rest = Some(rest);
            }
        }
        Ok(0)
    }
}

/// Whether anything but zeros is left.
pub(crate) fn has_more_than_zeros(reader: &mut impl BufRead) -> io::Result<bool> {
    loop {
        let buffer = reader.fill_buf()?;
        if buffer.is_empty() {
            return Ok(false);
        }
        if buffer.iter().any(|byte| *byte != 0) {
            return Ok(true);
        }
        let n = buffer.len();
        reader.consume(n);
    }
}

/// How many bytes a stream can still give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Left {
    Exactly(u64),
    AtMost(u64),
}

impl Left {
    pub(crate) fn most(self) -> u64 {
        match self {
            Self::Exactly(n) | Self::AtMost(n) => n,
        }
    }

    /// The most that deflate could make of it.
    pub(crate) fn inflated(self) -> Self {
        Self::AtMost(self.most().saturating_mul(DEFLATE_RATIO))
    }
}

type Plain<'a> = BufReader<Box<dyn ReadSeek + 'a>>;

enum Inner<'a> {
    Plain(Plain<'a>),
    Gzip(Box<BufReader<GzipMembers<Plain<'a>>>>),
}

/// A file as a reader takes it, from its start to its end.
pub(crate) struct Stream<'a> {
    name: String,
    inner: Inner<'a>,
    /// Length of the file: exact, or the bound for a compressed one.
    total: Left,
    /// Shared, because decoders take the stream over while errors still want to tell how far they came.
    position: Rc<Cell<u64>>,
}

impl<'a> Stream<'a> {
    pub(crate) fn plain(name: &str, source: Source<'a>) -> Self {
        let Source { reader, len } = source;
        let inner = Inner::Plain(BufReader::with_capacity(BUFFER, reader));
        Self { name: name.to_owned(), inner, total: Left::Exactly(len), position: Rc::default() }
    }

    /// The file inside a gzip file.
    pub(crate) fn gunzip(name: &str, source: Source<'a>) -> Self {
        let Source { reader, len } = source;
        let members = GzipMembers::new(BufReader::with_capacity(BUFFER, reader));
        let inner = Inner::Gzip(Box::new(BufReader::with_capacity(BUFFER, members)));
        Self { name: name.to_owned(), inner, total: Left::Exactly(len).inflated(), position: Rc::default() }
    }

    /// Name for messages.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Bytes taken so far.
    pub(crate) fn position(&self) -> u64 {
        self.position.get()
    }

    /// A view of [`Stream::position`] that outlives a move of the stream.
    pub(crate) fn shared_position(&self) -> Rc<Cell<u64>> {
        Rc::clone(&self.position)
    }

    pub(crate) fn left(&self) -> Left {
        match self.total {
            Left::Exactly(n) => Left::Exactly(n.saturating_sub(self.position())),
            Left::AtMost(n) => Left::AtMost(n.saturating_sub(self.position())),
        }
    }

    /// Skips `n` bytes, or as many as there are, and says how many.
    pub(crate) fn skip(&mut self, n: u64) -> io::Result<u64> {
        let skipped = match &mut self.inner {
            Inner::Plain(reader) => {
                let n = n.min(self.total.most().saturating_sub(self.position.get()));
                // Lengths of files fit in i64 on every system.
                reader.seek_relative(n as i64)?;
                n
            }
            Inner::Gzip(reader) => io::copy(&mut reader.take(n), &mut io::sink())?,
        };
        self.advance(skipped);
        Ok(skipped)
    }

    /// Reads at most `n` bytes onto the end of `into`, past the buffer where that is faster, and says how many. The
    /// caller has bounded `n`.
    pub(crate) fn read_onto(&mut self, n: u64, into: &mut Vec<u8>) -> io::Result<u64> {
        let read = match &mut self.inner {
            Inner::Plain(reader) => reader.take(n).read_to_end(into)?,
            Inner::Gzip(reader) => reader.take(n).read_to_end(into)?,
        } as u64;
        self.advance(read);
        Ok(read)
    }

    /// Whether a compressed file has more behind its compressed data, once those have been read to their end.
    pub(crate) fn goes_on(&mut self) -> io::Result<bool> {
        match &mut self.inner {
            Inner::Plain(_) => Ok(false),
            Inner::Gzip(reader) => reader.get_mut().goes_on(),
        }
    }

    fn advance(&self, n: u64) {
        self.position.set(self.position.get() + n);
    }
}

impl Read for Stream<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = match &mut self.inner {
            Inner::Plain(reader) => reader.read(buffer)?,
            Inner::Gzip(reader) => reader.read(buffer)?,
        };
        self.advance(n as u64);
        Ok(n)
    }
}

impl BufRead for Stream<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        match &mut self.inner {
            Inner::Plain(reader) => reader.fill_buf(),
            Inner::Gzip(reader) => reader.fill_buf(),
        }
    }

    fn consume(&mut self, n: usize) {
        match &mut self.inner {
            Inner::Plain(reader) => reader.consume(n),
            Inner::Gzip(reader) => reader.consume(n),
        }
        self.advance(n as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn members_of_a_gzip_file_are_read_in_order_and_junk_after_them_is_left() {
        let mut file = [gzip(b"one "), gzip(b""), gzip(b"two")].concat();
        file.extend_from_slice(&[0; 512]);
        let mut stream = Stream::gunzip("f", Source::from_slice(&file));
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        assert_eq!(text, "one two");
        assert_eq!(stream.position(), 7);
    }

    #[test]
    fn a_wrong_checksum_is_an_error() {
        let mut file = gzip(b"some text");
        let crc = file.len() - 8;
        file[crc] ^= 1;
        let mut text = Vec::new();
        assert!(Stream::gunzip("f", Source::from_slice(&file)).read_to_end(&mut text).is_err());
    }

    #[test]
    fn skipping_counts_what_is_there() {
        let bytes: Vec<u8> = (0..100).collect();
        let packed = gzip(&bytes);
        let plain = Stream::plain("f", Source::from_slice(&bytes));
        let zipped = Stream::gunzip("f", Source::from_slice(&packed));
        for mut stream in [plain, zipped] {
            assert_eq!(stream.skip(40).unwrap(), 40);
            let mut two = [0; 2];
            stream.read_exact(&mut two).unwrap();
            assert_eq!(two, [40, 41]);
            assert_eq!(stream.skip(1000).unwrap(), 58);
            assert_eq!(stream.position(), 100);
        }
    }
}
