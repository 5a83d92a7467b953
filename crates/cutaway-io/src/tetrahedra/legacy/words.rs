//! The words, lines and numbers of a legacy file.

use super::super::error::TetrahedraReadError as Error;
use super::super::numbers::{Kind, Number};
use crate::text::{self, LineEnd};
use crate::volume::Place;
use crate::volume::error::quoted;

/// A file and how far it has been read.
pub(super) struct Reader<'a> {
    pub(super) file: &'a str,
    pub(super) binary: bool,
    bytes: &'a [u8],
    at: usize,
    /// As the first line ends.
    line_end: LineEnd,
    limit: u64,
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &'a str, bytes: &'a [u8], limit: u64) -> Self {
        // The mark of an encoding says nothing.
        let at = bytes.len() - text::without_mark(bytes).len();
        Self { file, binary: false, bytes, at, line_end: LineEnd::of(bytes), limit }
    }

    pub(super) fn syntax(&self, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let place = Place::Byte(self.at as u64);
        Error::Syntax { file: self.file.to_owned(), place, found: found.into(), expected: expected.into() }
    }

    fn too_short(&self, what: &str, found: u64, expected: String) -> Error {
        Error::TooShort { file: self.file.to_owned(), what: what.to_owned(), found, expected }
    }

    /// Refuses what would take more than the limit.
    pub(super) fn check_memory(&self, what: &'static str, needed: u64) -> Result<(), Error> {
        if needed <= self.limit {
            return Ok(());
        }
        Err(Error::TooLarge { file: self.file.to_owned(), what, needed, limit: self.limit })
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    pub(super) fn line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let end = rest.iter().position(|b| *b == self.line_end.byte()).unwrap_or(rest.len());
        self.at = (self.at + end + 1).min(self.bytes.len());
        &rest[..end]
    }

    pub(super) fn next_word(&mut self) -> Option<&'a str> {
        let rest = self.rest();
        let begin = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let word = &rest[begin..];
        let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.at += begin + end;
        // What is not text is no keyword and no number.
        Some(std::str::from_utf8(&word[..end.min(400)]).unwrap_or("\u{fffd}"))
    }

    /// Takes the next word where it is this one, in any case.
    pub(super) fn takes(&mut self, expected: &str) -> bool {
        let before = self.at;
        let found = self.next_word().is_some_and(|word| word.eq_ignore_ascii_case(expected));
        if !found {
            self.at = before;
        }
        found
    }

    pub(super) fn word(&mut self, expected: &str) -> Result<&'a str, Error> {
        self.next_word().ok_or_else(|| self.syntax("the end of the file", expected))
    }

    /// A name, in which VTK writes blanks and other signs as `%20`.
    pub(super) fn name(&mut self, expected: &str) -> Result<String, Error> {
        self.word(expected).map(decoded)
    }

    pub(super) fn count(&mut self, what: &str) -> Result<u64, Error> {
        let word = self.word(&format!("the number of {what}"))?;
        let count = word.parse().ok().filter(|count| *count <= u64::from(u32::MAX) * 16);
        count.ok_or_else(|| self.syntax(quoted(word), format!("the number of {what}")))
    }

    pub(super) fn kind(&mut self) -> Result<Kind, Error> {
        let word = self.word("a type of numbers")?;
        self.named(word)
    }

    pub(super) fn named(&self, word: &str) -> Result<Kind, Error> {
        Kind::of_legacy(word).ok_or_else(|| self.syntax(quoted(word), "a type of numbers, as `float`"))
    }

    /// After the type of scalars: how many components, where that is said, and the name of a table, where there is one.
    pub(super) fn components_and_table(&mut self) -> Result<u64, Error> {
        let line = self.line();
        let text = std::str::from_utf8(line).unwrap_or("\u{fffd}").trim();
        let components = match text {
            "" => 1,
            text => text.parse().map_err(|_| self.syntax(quoted(text), "a number of components"))?,
        };
        if self.takes("LOOKUP_TABLE") {
            self.word("the name of a table")?;
        }
        Ok(components)
    }

    /// Numbers of a type that comes first.
    pub(super) fn array<T: Number>(
        &mut self,
        count: u64,
        components: u64,
        what: &str,
    ) -> Result<Vec<T>, Error> {
        let kind = self.kind()?;
        self.numbers_of(kind, count, components, what)
    }

    pub(super) fn numbers_of<T: Number>(
        &mut self,
        kind: Kind,
        count: u64,
        components: u64,
        what: &str,
    ) -> Result<Vec<T>, Error> {
        let numbers = count.checked_mul(components);
        let numbers = numbers
            .ok_or_else(|| self.syntax(format!("{count} times {components}"), "a number of numbers"))?;
        self.numbers(kind, numbers, what)
    }

    pub(super) fn numbers<T: Number>(&mut self, kind: Kind, count: u64, what: &str) -> Result<Vec<T>, Error> {
        // A number of text takes two bytes, a blank among them.
        let left = self.rest().len() as u64;
        let needed = if self.binary {
            kind.bytes_of(count)
        } else {
            count.checked_mul(2).map(|n| n.saturating_sub(1))
        };
        let needed = needed.unwrap_or(u64::MAX);
        if needed > left {
            return Err(self.too_short(what, left, format!("at least {needed} for {count} numbers")));
        }
        self.check_memory("its arrays", count.saturating_mul(8))?;
        if self.binary {
            self.numbers_in_binary(kind, count, needed, what)
        } else {
            self.numbers_in_text(count, what)
        }
    }

    fn numbers_in_text<T: Number>(&mut self, count: u64, what: &str) -> Result<Vec<T>, Error> {
        let mut numbers = Vec::with_capacity(count as usize);
        for _ in 0..count {
            let word = self.word(what)?;
            let number = T::of_text(word);
            numbers.push(number.ok_or_else(|| self.syntax(quoted(word), format!("a number ({what})")))?);
        }
        Ok(numbers)
    }

    fn numbers_in_binary<T: Number>(
        &mut self,
        kind: Kind,
        count: u64,
        needed: u64,
        what: &str,
    ) -> Result<Vec<T>, Error> {
        // The line's end; then bytes, whatever they look like.
        self.line();
        let Some(bytes) = self.rest().get(..needed as usize) else {
            let found = self.rest().len() as u64;
            return Err(self.too_short(what, found, format!("{needed} for {count} numbers")));
        };
        self.at += needed as usize;
        let mut numbers = kind.decode(bytes, true);
        numbers.truncate(count as usize);
        Ok(numbers)
    }

    /// Skips strings: a line for each in text; in binary their bytes after their length, whose first two bits say how
    /// many bytes the length has (vtkDataWriter::WriteArray).
    pub(super) fn skip_strings(&mut self, count: u64) -> Result<(), Error> {
        self.line();
        for _ in 0..count {
            if self.rest().is_empty() {
                return Err(self.syntax("the end of the file", format!("{count} strings")));
            }
            if !self.binary {
                self.line();
                continue;
            }
            let size = 8 >> (self.rest()[0] >> 6);
            let bytes = self.rest().get(..size).unwrap_or_default();
            let length = bytes.iter().fold(0u64, |length, byte| length << 8 | u64::from(*byte));
            let length = length & (u64::MAX >> (64 - 8 * size as u32 + 2));
            let end = length.checked_add(size as u64).filter(|end| *end <= self.rest().len() as u64);
            let end = end
                .ok_or_else(|| self.syntax(format!("a string of {length} bytes"), "strings within the file"));
            self.at += end? as usize;
        }
        Ok(())
    }

    /// Skips what VTK says of an array behind it, up to a blank line.
    pub(super) fn skip_metadata(&mut self) {
        self.line();
        while self.at < self.bytes.len() && !self.line().trim_ascii().is_empty() {}
    }
}

/// A word with `%20` and the like as the bytes that they stand for (vtkDataReader::DecodeString).
fn decoded(word: &str) -> String {
    let bytes = word.as_bytes();
    let mut plain = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let code = bytes
            .get(at + 1..at + 3)
            .filter(|_| byte == b'%')
            .and_then(|code| std::str::from_utf8(code).ok());
        match code.and_then(|code| u8::from_str_radix(code, 16).ok()) {
            Some(code) => {
                plain.push(code);
                at += 3;
            }
            None => {
                plain.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&plain).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_decoded() {
        assert_eq!(decoded("a%20velocity,%20100%20%25"), "a velocity, 100 %");
        assert_eq!(decoded("gr%c3%b6%C3%9fe"), "größe");
        assert_eq!(decoded("50%"), "50%");
        assert_eq!(decoded("50%2"), "50%2");
        assert_eq!(decoded("%é0"), "%é0");
    }
}
