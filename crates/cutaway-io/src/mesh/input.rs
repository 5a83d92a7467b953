//! A mesh file as its reader takes it: by lines, by words or by bytes, always knowing where it is.

use std::io::{self, BufRead, Read};

use super::error::MeshReadError;
use crate::limits::Limits;
use crate::text::LineEnd;
use crate::volume::Place;
use crate::volume::error::quoted;
use crate::volume::source::{Left, Stream};

/// Longest line of text, in bytes. A polygon of ten thousand corners takes a tenth of it.
const LONGEST_LINE: usize = 1 << 20;

/// How lines end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ends {
    /// In a line feed, a carriage return, or both: in text without binary data.
    Any,
    /// As the first line does: in front of binary data.
    AsFirst(LineEnd),
}

/// A file, its limits, and what there is to say about it.
pub(super) struct Input<'a> {
    stream: Stream<'a>,
    limits: Limits,
    ends: Ends,
    line: usize,
    notices: Vec<String>,
}

impl<'a> Input<'a> {
    pub(super) fn new(stream: Stream<'a>, limits: Limits) -> Self {
        Self { stream, limits, ends: Ends::Any, line: 0, notices: Vec::new() }
    }

    /// From here on lines end as the first line of the file does, since binary data may follow.
    pub(super) fn set_line_end(&mut self, end: LineEnd) {
        self.ends = Ends::AsFirst(end);
    }

    /// From here on there is only text.
    pub(super) fn set_text(&mut self) {
        self.ends = Ends::Any;
    }

    pub(super) fn file(&self) -> String {
        self.stream.name().to_owned()
    }

    pub(super) fn limit(&self) -> u64 {
        self.limits.max_bytes
    }

    /// The line read last, as a place.
    pub(super) fn line(&self) -> Place {
        Place::Line(self.line)
    }

    /// The next byte, as a place.
    pub(super) fn byte(&self) -> Place {
        Place::Byte(self.stream.position())
    }

    /// The most bytes there can be from here on.
    pub(super) fn left(&self) -> u64 {
        self.stream.left().most()
    }

    /// How many bytes there are from here on, where that is known: not of a compressed file.
    pub(super) fn left_exactly(&self) -> Option<u64> {
        match self.stream.left() {
            Left::Exactly(left) => Some(left),
            Left::AtMost(_) => None,
        }
    }

    /// Something that the user should know.
    /// A file with a thousand oddities is not allowed a thousand notices.
    pub(super) fn notice(&mut self, text: impl Into<String>) {
        const MOST: usize = 16;
        if self.notices.len() < MOST {
            self.notices.push(text.into());
        } else if self.notices.len() == MOST {
            self.notices.push("more of the like left out".to_owned());
        }
    }

    pub(super) fn into_notices(self) -> Vec<String> {
        self.notices
    }

    fn io(&self, error: io::Error) -> MeshReadError {
        MeshReadError::Io { file: self.file(), offset: self.stream.position(), error }
    }

    pub(super) fn syntax(
        &self,
        place: Place,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> MeshReadError {
        MeshReadError::Syntax { file: self.file(), place, found: found.into(), expected: expected.into() }
    }

    pub(super) fn too_short(&self, what: &str, found: u64, expected: impl Into<String>) -> MeshReadError {
        MeshReadError::TooShort { file: self.file(), what: what.to_owned(), found, expected: expected.into() }
    }

    pub(super) fn not_finite(&self, place: Place, found: impl std::fmt::Display) -> MeshReadError {
        MeshReadError::NotFinite { file: self.file(), place, found: found.to_string() }
    }

    /// Refuses a count of things that take at least `least` bytes each and for which the file is too short.
    pub(super) fn check_count(&self, what: &str, count: u64, least: u64) -> Result<(), MeshReadError> {
        let (needed, left) = (u128::from(count) * u128::from(least), self.left());
        if needed <= u128::from(left) {
            return Ok(());
        }
        Err(self.too_short(what, left, format!("at least {needed} for {count} of them")))
    }

    /// Refuses a mesh of this size where it is larger than the limit.
    pub(super) fn check_size(&self, vertices: u64, triangles: u64) -> Result<(), MeshReadError> {
        self.check_memory(vertices, triangles, 12)
    }

    /// As [`Self::check_size`], for vertices that take this many bytes each while they are read.
    pub(super) fn check_memory(
        &self,
        vertices: u64,
        triangles: u64,
        bytes: u64,
    ) -> Result<(), MeshReadError> {
        let needed = vertices.saturating_mul(bytes).saturating_add(triangles.saturating_mul(12));
        if needed <= self.limit() {
            return Ok(());
        }
        let what = format!("{vertices} vertices and {triangles} triangles");
        Err(MeshReadError::TooLarge { file: self.file(), what, needed, limit: self.limit() })
    }

    /// Reads the next line into `line`, without its end; false where there is none.
    pub(super) fn read_line(&mut self, line: &mut Vec<u8>) -> Result<bool, MeshReadError> {
        line.clear();
        let read = match self.ends {
            Ends::Any => read_any_line(&mut self.stream, line),
            Ends::AsFirst(end) => {
                (&mut self.stream).take(LONGEST_LINE as u64 + 1).read_until(end.byte(), line)
            }
        };
        let read = read.map_err(|error| self.io(error))?;
        self.line += usize::from(read > 0);
        if line.len() > LONGEST_LINE && !line.ends_with(b"\n") {
            let found = format!("a line of more than {LONGEST_LINE} bytes");
            return Err(self.syntax(self.line(), found, "lines of text"));
        }
        if line.ends_with(b"\n") {
            line.pop();
        }
        if line.ends_with(b"\r") {
            line.pop();
        }
        Ok(read > 0)
    }

    /// Fills `into`; false where the file ends before.
    pub(super) fn read_exact(&mut self, into: &mut [u8]) -> Result<bool, MeshReadError> {
        match self.stream.read_exact(into) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            Err(error) => Err(self.io(error)),
        }
    }

    /// Skips `count` bytes; false where the file ends before.
    pub(super) fn skip(&mut self, count: u64) -> Result<bool, MeshReadError> {
        let skipped = self.stream.skip(count).map_err(|error| self.io(error))?;
        Ok(skipped == count)
    }

    /// Everything from here on, within the limit.
    pub(super) fn read_all(&mut self) -> Result<Vec<u8>, MeshReadError> {
        let (mut all, limit) = (Vec::new(), self.limit());
        let read =
            self.stream.read_onto(limit.saturating_add(1), &mut all).map_err(|error| self.io(error))?;
        if read <= limit {
            return Ok(all);
        }
        Err(MeshReadError::TooLarge { file: self.file(), what: "its contents".into(), needed: read, limit })
    }

    /// Whether nothing but blanks is left.
    pub(super) fn at_end(&mut self) -> Result<bool, MeshReadError> {
        loop {
            let buffer = match self.stream.fill_buf() {
                Ok(buffer) => buffer,
                Err(error) => return Err(self.io(error)),
            };
            if buffer.is_empty() {
                return Ok(true);
            }
            let blanks = buffer.iter().take_while(|b| b.is_ascii_whitespace()).count();
            let all = blanks == buffer.len();
            self.stream.consume(blanks);
            if !all {
                return Ok(false);
            }
        }
    }

    /// A coordinate in text.
    pub(super) fn coordinate(&self, word: &[u8]) -> Result<f64, MeshReadError> {
        match number(word) {
            Some(number) if is_coordinate(number) => Ok(number),
            Some(_) => Err(self.not_finite(self.line(), shown(word))),
            None => Err(self.syntax(self.line(), shown(word), "a number")),
        }
    }
}

/// Reads a line with its end, whichever of the three it has, or a little more than the longest line; returns how many bytes
/// were read.
fn read_any_line(stream: &mut Stream<'_>, line: &mut Vec<u8>) -> io::Result<usize> {
    while line.len() <= LONGEST_LINE {
        let buffer = stream.fill_buf()?;
        let Some(end) = buffer.iter().position(|b| matches!(b, b'\n' | b'\r')) else {
            let all = buffer.len().min(LONGEST_LINE + 1 - line.len());
            if all == 0 {
                break;
            }
            line.extend_from_slice(&buffer[..all]);
            stream.consume(all);
            continue;
        };
        let end = (end + 1).min(LONGEST_LINE + 1 - line.len());
        line.extend_from_slice(&buffer[..end]);
        stream.consume(end);
        if line.ends_with(b"\r") && stream.fill_buf()?.first() == Some(&b'\n') {
            stream.consume(1);
            line.push(b'\n');
        }
        if matches!(line.last(), Some(b'\n' | b'\r')) {
            break;
        }
    }
    Ok(line.len())
}

/// A number in text. Fortran writes exponents with `D`.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| {
        let is_fortran = text.bytes().all(|b| b.is_ascii_digit() || b"+-.dD".contains(&b));
        is_fortran.then(|| text.replace(['d', 'D'], "e").parse().ok())?
    })
}

/// A whole number in text, which may be written `8.0`.
pub(super) fn whole_number(word: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| {
        let number: f64 = text.parse().ok()?;
        (number.fract() == 0.0 && number.abs() < 2f64.powi(53)).then_some(number as i64)
    })
}

/// True for numbers that single precision has room for: meshes cannot be larger than that.
pub(super) fn is_coordinate(number: f64) -> bool {
    (number as f32).is_finite()
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A word as messages show it.
pub(super) fn shown(word: &[u8]) -> String {
    quoted(&String::from_utf8_lossy(&word[..word.len().min(400)]))
}
