//! The text of a MetaImage header: `Key = value` lines up to `ElementDataFile`, and the list of files behind it.

use crate::volume::detached::MOST_FILES;
use crate::volume::error::{ReadError, quoted};
use crate::volume::fields::{Fields, Lines};
use crate::volume::source::Stream;

/// The keys that matter to a volume; others (names, colours, dates) are skipped.
const KEYS: [&str; 22] = [
    "ObjectType",
    "NDims",
    "DimSize",
    "ElementType",
    "ElementDataFile",
    "ElementSpacing",
    "ElementSize",
    "ElementNumberOfChannels",
    "ElementByteOrderMSB",
    "BinaryDataByteOrderMSB",
    "BinaryData",
    "CompressedData",
    "CompressedDataSize",
    "HeaderSize",
    "TransformMatrix",
    "Rotation",
    "Orientation",
    "Offset",
    "Position",
    "Origin",
    "ElementToIntensityFunctionSlope",
    "ElementToIntensityFunctionOffset",
];

/// A header as text.
pub(super) struct Header {
    pub fields: Fields,
    /// The lines behind `ElementDataFile = LIST`.
    pub names: Vec<String>,
}

impl Header {
    /// Reads the header and leaves the stream behind it.
    pub(super) fn read(stream: &mut Stream<'_>) -> Result<Self, ReadError> {
        let mut lines = Lines::new();
        let mut fields = Fields::new(stream.name());
        while fields.get("ElementDataFile").is_none() {
            let Some(line) = lines.next(stream)? else { break };
            parse_line(&mut fields, &line, lines.number)?;
        }
        let mut names = Vec::new();
        let list = fields.get("ElementDataFile").is_some_and(|field| field.value.starts_with("LIST"));
        while list && let Some(line) = lines.next(stream)? {
            if line.trim().is_empty() {
                continue;
            }
            if names.len() == MOST_FILES {
                return Err(ReadError::Syntax {
                    file: stream.name().to_owned(),
                    line: lines.number,
                    found: format!("more than {MOST_FILES} files"),
                    expected: "fewer",
                });
            }
            names.push(line.trim().to_owned());
        }
        Ok(Self { fields, names })
    }
}

fn parse_line(fields: &mut Fields, line: &str, number: usize) -> Result<(), ReadError> {
    if line.trim().is_empty() {
        return Ok(());
    }
    // MetaIO takes a colon for an equals sign.
    let Some((key, value)) = line.split_once(['=', ':']) else {
        // MetaIO skips words that are no key; what is not text is damage.
        if !line.chars().any(|c| c == '\u{fffd}' || (c.is_control() && c != '\t')) {
            return Ok(());
        }
        return Err(ReadError::Syntax {
            file: fields.file.clone(),
            line: number,
            found: quoted(line),
            expected: "`Key = value`, up to the key ElementDataFile",
        });
    };
    match KEYS.iter().find(|known| key.trim().eq_ignore_ascii_case(known)) {
        Some(known) => fields.add(known, value, number),
        None => Ok(()),
    }
}
