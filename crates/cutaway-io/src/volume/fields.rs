//! Text headers: fields with the line they stand on, and what every reader asks of them.

use std::io::BufRead;

use super::error::{Place, ReadError, quoted};
use super::source::Stream;
use crate::text::{self, LineEnd};

/// Longest text header that is believed to be one (long lists of files included).
const LONGEST_HEADER: usize = 16 << 20;

/// A text header being read line by line.
pub(crate) struct Lines {
    /// Number of the line read last, from 1.
    pub number: usize,
    left: usize,
    /// As the first line ends.
    end: Option<LineEnd>,
}

impl Lines {
    pub(crate) fn new() -> Self {
        Self { number: 0, left: LONGEST_HEADER, end: None }
    }

    /// The next line without its end, or none where the file is over.
    pub(crate) fn next(&mut self, stream: &mut Stream<'_>) -> Result<Option<String>, ReadError> {
        let mut line = Vec::new();
        loop {
            let buffer = match stream.fill_buf() {
                Ok(buffer) => buffer,
                Err(error) => return Err(header_error(stream.name(), stream.position(), error)),
            };
            if buffer.is_empty() {
                break;
            }
            // The first line is told by the stream's first buffer, which holds more than any header's first line.
            let ends = self.end.get_or_insert_with(|| LineEnd::of(buffer));
            let end = buffer.iter().position(|&b| b == ends.byte());
            let n = end.map_or(buffer.len(), |end| end + 1);
            if n > self.left {
                return Err(ReadError::Syntax {
                    file: stream.name().to_owned(),
                    line: self.number + 1,
                    found: "16 MiB of header".to_owned(),
                    expected: "its end before that",
                });
            }
            self.left -= n;
            line.extend_from_slice(&buffer[..n]);
            stream.consume(n);
            if end.is_some() {
                break;
            }
        }
        if line.is_empty() {
            return Ok(None);
        }
        self.number += 1;
        let text = String::from_utf8_lossy(&line);
        Ok(Some(text.trim_end_matches(['\n', '\r']).to_owned()))
    }
}

/// An error in a compressed header is damage, in a plain one the system's.
fn header_error(file: &str, offset: u64, error: std::io::Error) -> ReadError {
    use std::io::ErrorKind::{InvalidData, InvalidInput, UnexpectedEof};
    match error.kind() {
        UnexpectedEof => ReadError::TooShort {
            file: file.to_owned(),
            what: "header",
            found: offset,
            expected: "more".to_owned(),
        },
        InvalidData | InvalidInput => {
            ReadError::Decode { file: file.to_owned(), offset, encoding: "gzip", reason: error.to_string() }
        }
        _ => ReadError::Io { file: file.to_owned(), offset, error },
    }
}

/// A field of a text header.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    /// Its name as the format's documentation writes it.
    pub name: &'static str,
    pub value: String,
    pub line: usize,
}

/// The known fields of a text header.
#[derive(Debug, Default)]
pub(crate) struct Fields {
    pub file: String,
    list: Vec<Field>,
}

impl Fields {
    pub(crate) fn new(file: &str) -> Self {
        Self { file: file.to_owned(), list: Vec::new() }
    }

    /// Adds a field; a second one of its name with another value is an error, because one of the two is wrong.
    pub(crate) fn add(&mut self, name: &'static str, value: &str, line: usize) -> Result<(), ReadError> {
        if let Some(first) = self.get(name) {
            if first.value == value.trim() {
                return Ok(());
            }
            return Err(ReadError::Field {
                file: self.file.clone(),
                place: Place::Line(line),
                field: name,
                found: "there a second time".into(),
                expected: format!("once only (first on line {})", first.line),
                hint: "remove one",
            });
        }
        self.list.push(Field { name, value: value.trim().to_owned(), line });
        Ok(())
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Field> {
        self.list.iter().find(|field| field.name == name)
    }

    /// The first of several names for one thing.
    pub(crate) fn first(&self, names: &[&str]) -> Option<&Field> {
        names.iter().find_map(|name| self.get(name))
    }

    pub(crate) fn required(&self, name: &'static str, expected: &'static str) -> Result<&Field, ReadError> {
        self.get(name).ok_or_else(|| ReadError::MissingField {
            file: self.file.clone(),
            field: name,
            expected,
        })
    }

    /// An error about a field's value.
    pub(crate) fn wrong(&self, field: &Field, expected: impl Into<String>) -> ReadError {
        self.wrong_with(field, expected, "")
    }

    pub(crate) fn wrong_with(
        &self,
        field: &Field,
        expected: impl Into<String>,
        hint: &'static str,
    ) -> ReadError {
        ReadError::Field {
            file: self.file.clone(),
            place: Place::Line(field.line),
            field: field.name,
            found: quoted(&field.value).into(),
            expected: expected.into(),
            hint,
        }
    }

    /// A value that is one number.
    pub(crate) fn number<T: HeaderNumber>(&self, field: &Field, expected: &str) -> Result<T, ReadError> {
        T::of_text(&field.value).ok_or_else(|| self.wrong(field, expected))
    }

    /// A value that is `count` numbers between white space.
    pub(crate) fn numbers<T: HeaderNumber>(
        &self,
        field: &Field,
        count: usize,
        what: &str,
    ) -> Result<Vec<T>, ReadError> {
        let parsed: Option<Vec<T>> = words(&field.value).map(T::of_text).collect();
        parsed.filter(|list| list.len() == count).ok_or_else(|| self.wrong(field, format!("{count} {what}")))
    }
}

/// The words of a value, between blanks or commas.
pub(crate) fn words(value: &str) -> impl Iterator<Item = &str> {
    value.split([' ', '\t', ',']).filter(|word| !word.is_empty())
}

/// A number of a text header. Whole numbers may be written `8.0`, as other readers of these formats take them.
pub(crate) trait HeaderNumber: Sized {
    fn of_text(text: &str) -> Option<Self>;
}

impl HeaderNumber for f64 {
    fn of_text(text: &str) -> Option<Self> {
        text.parse().ok()
    }
}

macro_rules! whole {
    ($($t:ty),*) => {$(
        impl HeaderNumber for $t {
            fn of_text(text: &str) -> Option<Self> {
                text.parse().ok().or_else(|| {
                    // Beyond 2^53 doubles skip whole numbers.
                    let value: f64 = text.parse().ok().filter(|value: &f64| value.abs() < 9e15)?;
                    let whole = value as Self;
                    (whole as f64 == value).then_some(whole)
                })
            }
        }
    )*};
}
whole!(u64, i64, usize);

/// Keys that may begin a MetaImage header.
const FIRST_KEYS: [&str; 5] = ["ObjectType", "NDims", "Comment", "ObjectSubType", "TransformType"];

/// Whether a file begins as MetaImage headers do: `Key = value` with one of the usual keys.
pub(crate) fn begins_like_metaimage(content: &[u8]) -> bool {
    let line = text::lines(content).next().unwrap_or_default();
    let Some(end) = line.iter().position(|&b| b == b'=') else { return false };
    let key = line[..end].trim_ascii();
    FIRST_KEYS.iter().any(|known| key.eq_ignore_ascii_case(known.as_bytes()))
}
