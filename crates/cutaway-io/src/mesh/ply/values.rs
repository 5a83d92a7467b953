//! The numbers of a PLY file, whichever way they are written.

use super::super::error::MeshReadError;
use super::super::input::{Input, number, shown, words};
use super::header::{Element, Encoding, Kind, Property};
use crate::volume::Place;

/// Reads one row after the other.
pub(super) struct Values {
    encoding: Encoding,
    /// The row, of text.
    line: Vec<u8>,
    /// How much of it was read.
    at: usize,
    /// What is being read, for messages.
    element: String,
    row: u64,
    count: u64,
    surplus: u64,
}

impl Values {
    pub(super) fn new(encoding: Encoding) -> Self {
        Self { encoding, line: Vec::new(), at: 0, element: String::new(), row: 0, count: 0, surplus: 0 }
    }

    /// Begins a row: in text, the next line that is not blank.
    pub(super) fn begin(
        &mut self,
        input: &mut Input<'_>,
        element: &Element,
        row: u64,
    ) -> Result<(), MeshReadError> {
        if row == 0 {
            self.element.clone_from(&element.name);
            self.count = element.count;
        }
        self.row = row;
        self.at = 0;
        if self.encoding == Encoding::Ascii && !element.properties.is_empty() {
            while input.read_line(&mut self.line)? {
                if !self.line.trim_ascii().is_empty() {
                    return Ok(());
                }
            }
            return Err(self.cut_short(input));
        }
        Ok(())
    }

    /// Ends a row. In text more may follow: writers are known that put more into rows than into the header.
    pub(super) fn end(&mut self) {
        if self.encoding == Encoding::Ascii {
            self.surplus += u64::from(words(&self.line[self.at..]).next().is_some());
        }
    }

    /// Rows with more numbers than the header says.
    pub(super) fn surplus(&self) -> u64 {
        self.surplus
    }

    /// Where the next number is.
    pub(super) fn place(&self, input: &Input<'_>) -> Place {
        if self.encoding == Encoding::Ascii { input.line() } else { input.byte() }
    }

    fn cut_short(&self, input: &Input<'_>) -> MeshReadError {
        let (element, row, count) = (&self.element, self.row, self.count);
        let expected = format!("{count} rows of `{element}`; the file is cut short or its header is wrong");
        input.syntax(self.place(input), format!("the end of the file in row {row} of `{element}`"), expected)
    }

    fn word(&mut self, input: &Input<'_>) -> Result<&[u8], MeshReadError> {
        let rest = &self.line[self.at..];
        let Some(blanks) = rest.iter().position(|b| !b.is_ascii_whitespace()) else {
            let expected = format!("more numbers for `{}`", self.element);
            return Err(input.syntax(input.line(), "the end of the line", expected));
        };
        let length = rest[blanks..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - blanks);
        let start = self.at + blanks;
        self.at = start + length;
        Ok(&self.line[start..self.at])
    }

    /// A number.
    pub(super) fn scalar(&mut self, input: &mut Input<'_>, kind: Kind) -> Result<f64, MeshReadError> {
        if self.encoding == Encoding::Ascii {
            let word = self.word(input)?;
            return number(word).ok_or_else(|| input.syntax(input.line(), shown(word), "a number"));
        }
        let mut bytes = [0; 8];
        let size = kind.bytes() as usize;
        if !input.read_exact(&mut bytes[..size])? {
            return Err(self.cut_short(input));
        }
        if self.encoding == Encoding::BigEndian {
            bytes[..size].reverse();
        }
        let [a, b, c, d, ..] = bytes;
        Ok(match kind {
            Kind::I8 => f64::from(a as i8),
            Kind::U8 => f64::from(a),
            Kind::I16 => f64::from(i16::from_le_bytes([a, b])),
            Kind::U16 => f64::from(u16::from_le_bytes([a, b])),
            Kind::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Kind::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Kind::I64 => i64::from_le_bytes(bytes) as f64,
            Kind::U64 => u64::from_le_bytes(bytes) as f64,
            Kind::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Kind::F64 => f64::from_le_bytes(bytes),
        })
    }

    /// A whole number.
    pub(super) fn whole(&mut self, input: &mut Input<'_>, kind: Kind) -> Result<i64, MeshReadError> {
        let place = self.place(input);
        let number = self.scalar(input, kind)?;
        // Numbers beyond are no vertices either; where f64 counts by more than one, they would not be whole any more.
        if number.fract() == 0.0 && number.abs() < 2f64.powi(53) {
            return Ok(number as i64);
        }
        Err(input.syntax(place, number.to_string(), "a whole number"))
    }

    /// The length of a list, which the rest of the file is long enough for.
    pub(super) fn count(
        &mut self,
        input: &mut Input<'_>,
        count: Kind,
        item: Kind,
    ) -> Result<u64, MeshReadError> {
        let place = self.place(input);
        let found = self.whole(input, count)?;
        let Ok(found) = u64::try_from(found) else {
            return Err(input.syntax(place, found.to_string(), "the length of a list"));
        };
        let (left, least) = match self.encoding {
            Encoding::Ascii => ((self.line.len() - self.at) as u64 / 2, 1),
            _ => (input.left(), item.bytes()),
        };
        if found.saturating_mul(least) > left {
            let expected = format!("the length of a list of `{}` that is there", self.element);
            return Err(input.syntax(place, found.to_string(), expected));
        }
        Ok(found)
    }

    /// Skips a property.
    pub(super) fn skip(&mut self, input: &mut Input<'_>, property: &Property) -> Result<(), MeshReadError> {
        let (items, kind) = match property {
            Property::Scalar { kind, .. } => (1, *kind),
            Property::List { count, item, .. } => (self.count(input, *count, *item)?, *item),
        };
        if self.encoding == Encoding::Ascii {
            for _ in 0..items {
                self.word(input)?;
            }
        } else if !input.skip(items * kind.bytes())? {
            return Err(self.cut_short(input));
        }
        Ok(())
    }
}
