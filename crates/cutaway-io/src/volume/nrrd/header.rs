//! The text of a NRRD header: magic, fields, comments, key-value pairs, and the list of data files at its end.

use crate::volume::detached::MOST_FILES;
use crate::volume::error::{Place, ReadError, quoted};
use crate::volume::fields::{Field, Fields, Lines};
use crate::volume::source::Stream;

/// Fields and their other spellings. Fields that say nothing about the grid are known so that a misspelt one shows.
const NAMES: [(&str, &[&str]); 30] = [
    ("dimension", &[]),
    ("type", &[]),
    ("sizes", &[]),
    ("encoding", &[]),
    ("endian", &[]),
    ("block size", &["blocksize"]),
    ("data file", &["datafile"]),
    ("line skip", &["lineskip"]),
    ("byte skip", &["byteskip"]),
    ("space", &[]),
    ("space dimension", &[]),
    ("space units", &[]),
    ("space origin", &[]),
    ("space directions", &[]),
    ("measurement frame", &[]),
    ("spacings", &[]),
    ("thicknesses", &[]),
    ("axis mins", &["axismins"]),
    ("axis maxs", &["axismaxs"]),
    ("centers", &["centerings"]),
    ("kinds", &[]),
    ("labels", &[]),
    ("units", &[]),
    ("content", &[]),
    ("number", &[]),
    ("min", &[]),
    ("max", &[]),
    ("old min", &["oldmin"]),
    ("old max", &["oldmax"]),
    ("sample units", &["sampleunits"]),
];

/// Where the data are, if not behind the header.
#[derive(Debug)]
pub(super) enum Data {
    /// A file or a pattern.
    Named(Field),
    /// The names that follow the header.
    List { field: Field, names: Vec<String> },
}

impl Data {
    pub(super) fn field(&self) -> &Field {
        match self {
            Self::Named(field) | Self::List { field, .. } => field,
        }
    }
}

/// A header as text.
pub(super) struct Header {
    pub fields: Fields,
    pub data: Option<Data>,
}

impl Header {
    /// Reads the header and leaves the stream behind it.
    pub(super) fn read(stream: &mut Stream<'_>) -> Result<Self, ReadError> {
        let mut lines = Lines::new();
        magic(stream, &mut lines)?;
        let mut fields = Fields::new(stream.name());
        let mut ended = false;
        while let Some(line) = lines.next(stream)? {
            if line.is_empty() {
                ended = true;
                break;
            }
            parse_line(&mut fields, &line, lines.number)?;
            if is_list(fields.get("data file")) {
                break;
            }
        }
        let data = match fields.get("data file") {
            None if !ended => {
                return Err(ReadError::TooShort {
                    file: stream.name().to_owned(),
                    what: "header",
                    found: stream.position(),
                    expected: "an empty line and the data, or a field `data file`".to_owned(),
                });
            }
            None => None,
            Some(field) if is_list(Some(field)) => {
                let field = field.clone();
                Some(Data::List { names: list(stream, &mut lines, &field)?, field })
            }
            Some(field) => Some(Data::Named(field.clone())),
        };
        Ok(Self { fields, data })
    }
}

fn magic(stream: &mut Stream<'_>, lines: &mut Lines) -> Result<(), ReadError> {
    let line = lines.next(stream)?.unwrap_or_default();
    if matches!(line.strip_prefix("NRRD000"), Some("1" | "2" | "3" | "4" | "5")) {
        return Ok(());
    }
    // The magic of before the first version, which Teem still reads.
    if line == "NRRD00.01" {
        return Ok(());
    }
    Err(ReadError::Field {
        file: stream.name().to_owned(),
        place: Place::Line(1),
        field: "magic",
        found: quoted(&line).into(),
        expected: "NRRD0001 to NRRD0005".to_owned(),
        hint: "",
    })
}

/// `field: value`, `key:=value` or `# comment`.
fn parse_line(fields: &mut Fields, line: &str, number: usize) -> Result<(), ReadError> {
    if line.starts_with('#') {
        return Ok(());
    }
    let Some((name, value)) = line.split_once(':') else {
        return Err(ReadError::Syntax {
            file: fields.file.clone(),
            line: number,
            found: quoted(line),
            expected: "`field: value`, `key:=value` or `# comment`",
        });
    };
    // Keys are anyone's; but `field: =value` is a field.
    if value.starts_with('=') {
        return Ok(());
    }
    let lower = name.trim().to_ascii_lowercase();
    let known = NAMES.iter().find(|(known, others)| *known == lower || others.contains(&lower.as_str()));
    match known {
        Some((known, _)) => fields.add(known, value, number),
        // A field of a later version, or a misspelt one that the required fields will miss.
        None => Ok(()),
    }
}

fn is_list(field: Option<&Field>) -> bool {
    field.is_some_and(|field| {
        field.value.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("list"))
    })
}

fn list(stream: &mut Stream<'_>, lines: &mut Lines, field: &Field) -> Result<Vec<String>, ReadError> {
    let mut names = Vec::new();
    while let Some(line) = lines.next(stream)? {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        if names.len() == MOST_FILES {
            return Err(ReadError::Syntax {
                file: stream.name().to_owned(),
                line: lines.number,
                found: format!("more than {MOST_FILES} files of `{}`", field.name),
                expected: "fewer",
            });
        }
        names.push(line.trim().to_owned());
    }
    Ok(names)
}
