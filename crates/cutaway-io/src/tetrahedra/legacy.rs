//! VTK legacy files: lines of text that name arrays, which follow as text or big-endian bytes.

use cutaway_core::glam::DVec3;

use super::cells::Tetrahedra;
use super::error::TetrahedraReadError as Error;
use super::numbers::{Kind, Number};
use super::{Parsed, TetrahedraReadOptions};
use crate::volume::Place;
use crate::volume::error::quoted;

/// A file and how far it has been read.
struct Reader<'a> {
    file: &'a str,
    bytes: &'a [u8],
    at: usize,
    binary: bool,
    limit: u64,
}

/// Offsets or counts of cells, with the points that they name.
struct Cells {
    /// Where each cell's points begin, and the end of the last one's.
    offsets: Vec<i64>,
    points: Vec<i64>,
}

/// Point data that could be the values.
struct Candidate {
    name: String,
    values: Vec<f64>,
}

pub(super) fn read(file: &str, bytes: &[u8], options: &TetrahedraReadOptions) -> Result<Parsed, Error> {
    let mut r = Reader { file, bytes, at: 0, binary: false, limit: options.limits.max_bytes };
    // The version and a title that may be anything.
    r.line();
    r.line();
    r.binary = match r.word("`ASCII` or `BINARY`")?.to_ascii_uppercase().as_str() {
        "ASCII" => false,
        "BINARY" => true,
        other => return Err(r.syntax(quoted(other), "`ASCII` or `BINARY`")),
    };
    let mut parsed = Parsed::default();
    let (mut cells, mut kinds) = (None, None);
    let mut points = None;
    let mut candidates: Vec<Candidate> = Vec::new();
    let mut others: Vec<String> = Vec::new();
    // Data of which things the next arrays are, and how many of those there are.
    let mut of_points = false;
    let mut count = 0;
    while let Some(keyword) = r.next_word() {
        match keyword.to_ascii_uppercase().as_str() {
            "DATASET" => {
                let kind = r.word("a kind of data set")?;
                if !kind.eq_ignore_ascii_case("UNSTRUCTURED_GRID") {
                    let found = format!("the data set is of kind {}", quoted(kind));
                    return Err(Error::Unsupported {
                        file: file.to_owned(),
                        found,
                        supported: "unstructured grids",
                    });
                }
            }
            "POINTS" => {
                let n = r.count("points")?;
                let numbers = r.array::<f64>(n, 3, "points")?;
                points = Some(
                    numbers.as_chunks::<3>().0.iter().map(|p| DVec3::from_array(*p)).collect::<Vec<_>>(),
                );
            }
            "CELLS" => cells = Some(r.cells()?),
            "CELL_TYPES" => {
                let n = r.count("cell types")?;
                kinds = Some(r.numbers::<i64>(Kind::I32, n, "cell types")?);
            }
            "POINT_DATA" => {
                of_points = true;
                count = r.count("point data")?;
            }
            "CELL_DATA" => {
                of_points = false;
                count = r.count("cell data")?;
            }
            "SCALARS" => {
                let name = r.word("the name of scalars")?.to_owned();
                let kind = r.kind()?;
                let components = r.components_and_table()?;
                let values = r.numbers_of::<f64>(kind, count, components, "scalars")?;
                keep(&mut candidates, &mut others, of_points, name, components, values);
            }
            "FIELD" => {
                r.word("the name of a field")?;
                for _ in 0..r.count("arrays of a field")? {
                    let name = r.word("the name of an array")?.to_owned();
                    if name.eq_ignore_ascii_case("METADATA") {
                        r.skip_metadata();
                        continue;
                    }
                    let (components, n) = (r.count("components")?, r.count("tuples")?);
                    let kind = r.word("a type of numbers")?;
                    if kind.eq_ignore_ascii_case("string") {
                        let found = format!("an array of strings ({})", quoted(&name));
                        return Err(Error::Unsupported {
                            file: file.to_owned(),
                            found,
                            supported: "numbers",
                        });
                    }
                    let kind = r.named(kind)?;
                    let values = r.numbers_of::<f64>(kind, n, components, "an array")?;
                    keep(&mut candidates, &mut others, of_points && n == count, name, components, values);
                }
            }
            "VECTORS" | "NORMALS" | "TENSORS" | "TENSORS6" | "GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS" => {
                let components = match keyword.to_ascii_uppercase().as_str() {
                    "VECTORS" | "NORMALS" => 3,
                    "TENSORS" => 9,
                    "TENSORS6" => 6,
                    _ => 1,
                };
                r.word("the name of an array")?;
                let kind = r.kind()?;
                r.numbers_of::<f64>(kind, count, components, "an array")?;
            }
            "TEXTURE_COORDINATES" => {
                r.word("the name of an array")?;
                let components = r.count("components")?;
                let kind = r.kind()?;
                r.numbers_of::<f64>(kind, count, components, "texture coordinates")?;
            }
            "COLOR_SCALARS" => {
                r.word("the name of an array")?;
                let components = r.count("components")?;
                let kind = if r.binary { Kind::U8 } else { Kind::F32 };
                r.numbers_of::<f64>(kind, count, components, "colours")?;
            }
            "LOOKUP_TABLE" => {
                r.word("the name of a table")?;
                let n = r.count("colours")?;
                let kind = if r.binary { Kind::U8 } else { Kind::F32 };
                r.numbers_of::<f64>(kind, n, 4, "colours")?;
            }
            "METADATA" => r.skip_metadata(),
            _ => return Err(r.syntax(quoted(keyword), "a section of an unstructured grid")),
        }
    }
    parsed.points = points.ok_or_else(|| r.missing("POINTS"))?;
    let cells = cells.ok_or_else(|| r.missing("CELLS"))?;
    let kinds = kinds.ok_or_else(|| r.missing("CELL_TYPES"))?;
    add_cells(&mut parsed.cells, file, &cells.offsets, &cells.points, &kinds, parsed.points.len())?;
    parsed.values = choose(file, candidates, &others, options)?;
    Ok(parsed)
}

fn keep(
    candidates: &mut Vec<Candidate>,
    others: &mut Vec<String>,
    of_points: bool,
    name: String,
    components: u64,
    values: Vec<f64>,
) {
    if of_points && components == 1 {
        candidates.push(Candidate { name, values });
    } else {
        let what = if of_points {
            format!("point data of {components} components")
        } else {
            "other data".to_owned()
        };
        others.push(format!("{} ({what})", quoted(&name)));
    }
}

/// The values: those asked for by name, else the first.
fn choose(
    file: &str,
    candidates: Vec<Candidate>,
    others: &[String],
    options: &TetrahedraReadOptions,
) -> Result<Vec<f64>, Error> {
    let names: Vec<String> =
        candidates.iter().map(|c| quoted(&c.name)).chain(others.iter().cloned()).collect();
    let wanted = |c: &Candidate| options.array.as_ref().is_none_or(|name| c.name == *name);
    if let Some(found) = candidates.into_iter().find(wanted) {
        return Ok(found.values);
    }
    Err(no_values(file, &names, options))
}

pub(super) fn no_values(file: &str, names: &[String], options: &TetrahedraReadOptions) -> Error {
    let found = if names.is_empty() {
        "no data".to_owned()
    } else {
        names.iter().take(16).cloned().collect::<Vec<_>>().join(", ")
    };
    let wanted = match &options.array {
        Some(name) => format!("{} of one component", quoted(name)),
        None => "of one component".to_owned(),
    };
    Error::NoValues { file: file.to_owned(), found, wanted }
}

/// Adds cells, each from one offset to the next, checked.
pub(super) fn add_cells(
    into: &mut Tetrahedra,
    file: &str,
    offsets: &[i64],
    names: &[i64],
    kinds: &[i64],
    points: usize,
) -> Result<(), Error> {
    let wrong = |cell: usize, found: String, expected: &str| Error::Cell {
        file: file.to_owned(),
        cell,
        found,
        expected: expected.to_owned(),
    };
    if offsets.len() != kinds.len() + 1 {
        let found = format!("{} cells and {} cell types", offsets.len().saturating_sub(1), kinds.len());
        return Err(wrong(0, found, "a type a cell"));
    }
    let mut own = Vec::new();
    for (cell, (ends, kind)) in offsets.windows(2).zip(kinds).enumerate() {
        let range = usize::try_from(ends[0]).ok().zip(usize::try_from(ends[1]).ok());
        let range = range.and_then(|(begin, end)| names.get(begin..end));
        let Some(range) = range else {
            let found = format!("offsets {} to {}", ends[0], ends[1]);
            return Err(wrong(cell, found, &format!("ascending offsets of up to {}", names.len())));
        };
        own.clear();
        for name in range {
            match u32::try_from(*name) {
                Ok(name) if (name as usize) < points => own.push(name),
                _ => {
                    return Err(wrong(
                        cell,
                        format!("point {name}"),
                        &format!("points from 0 to {}", points.saturating_sub(1)),
                    ));
                }
            }
        }
        let kind =
            u8::try_from(*kind).map_err(|_| wrong(cell, format!("cell type {kind}"), "VTK's cell types"))?;
        into.add(kind, &own)
            .map_err(|found| wrong(cell, found, "tetrahedra, voxels, hexahedra, wedges or pyramids"))?;
    }
    Ok(())
}

impl<'a> Reader<'a> {
    fn syntax(&self, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let place = Place::Byte(self.at as u64);
        Error::Syntax { file: self.file.to_owned(), place, found: found.into(), expected: expected.into() }
    }

    fn missing(&self, section: &str) -> Error {
        self.syntax("the end of the file", format!("a section `{section}`"))
    }

    fn line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        self.at = (self.at + end + 1).min(self.bytes.len());
        &rest[..end]
    }

    fn next_word(&mut self) -> Option<&'a str> {
        let rest = &self.bytes[self.at..];
        let begin = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let word = &rest[begin..];
        let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.at += begin + end;
        // What is not text is no keyword and no number.
        Some(std::str::from_utf8(&word[..end.min(400)]).unwrap_or("\u{fffd}"))
    }

    fn word(&mut self, expected: &str) -> Result<&'a str, Error> {
        self.next_word().ok_or_else(|| self.syntax("the end of the file", expected))
    }

    fn count(&mut self, what: &str) -> Result<u64, Error> {
        let word = self.word(&format!("the number of {what}"))?;
        let count = word.parse().ok().filter(|count| *count <= u64::from(u32::MAX) * 16);
        count.ok_or_else(|| self.syntax(quoted(word), format!("the number of {what}")))
    }

    fn kind(&mut self) -> Result<Kind, Error> {
        let word = self.word("a type of numbers")?;
        self.named(word)
    }

    fn named(&self, word: &str) -> Result<Kind, Error> {
        Kind::named(word).ok_or_else(|| self.syntax(quoted(word), "a type of numbers, as `float`"))
    }

    /// After the type of scalars: how many components, where that is said, and the name of a table, where there is one.
    fn components_and_table(&mut self) -> Result<u64, Error> {
        let line = self.line();
        let text = std::str::from_utf8(line).unwrap_or("\u{fffd}").trim();
        let components = match text {
            "" => 1,
            text => text.parse().map_err(|_| self.syntax(quoted(text), "a number of components"))?,
        };
        let before = self.at;
        match self.next_word() {
            Some(word) if word.eq_ignore_ascii_case("LOOKUP_TABLE") => {
                self.word("the name of a table")?;
            }
            _ => self.at = before,
        }
        Ok(components)
    }

    /// Numbers of a type that comes first.
    fn array<T: Number>(&mut self, count: u64, components: u64, what: &str) -> Result<Vec<T>, Error> {
        let kind = self.kind()?;
        self.numbers_of(kind, count, components, what)
    }

    fn numbers_of<T: Number>(
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

    fn numbers<T: Number>(&mut self, kind: Kind, count: u64, what: &str) -> Result<Vec<T>, Error> {
        // A number of text takes two bytes, a blank among them.
        let left = (self.bytes.len() - self.at) as u64;
        let needed = if self.binary {
            kind.bytes_of(count)
        } else {
            count.checked_mul(2).map(|n| n.saturating_sub(1))
        };
        let needed = needed.unwrap_or(u64::MAX);
        if needed > left {
            let expected = format!("at least {needed} for {count} numbers");
            return Err(Error::TooShort {
                file: self.file.to_owned(),
                what: what.to_owned(),
                found: left,
                expected,
            });
        }
        let memory = count.saturating_mul(8);
        if memory > self.limit {
            let file = self.file.to_owned();
            return Err(Error::TooLarge { file, what: "its arrays", needed: memory, limit: self.limit });
        }
        if !self.binary {
            let mut numbers = Vec::with_capacity(count as usize);
            for _ in 0..count {
                let word = self.word(what)?;
                numbers.push(
                    T::of_text(word)
                        .ok_or_else(|| self.syntax(quoted(word), format!("a number ({what})")))?,
                );
            }
            return Ok(numbers);
        }
        // The line's end; then bytes, whatever they look like.
        self.line();
        let bytes = self.bytes.get(self.at..).and_then(|rest| rest.get(..needed as usize));
        let Some(bytes) = bytes else {
            let expected = format!("{needed} for {count} numbers");
            let found = (self.bytes.len() - self.at) as u64;
            return Err(Error::TooShort {
                file: self.file.to_owned(),
                what: what.to_owned(),
                found,
                expected,
            });
        };
        self.at += needed as usize;
        let mut numbers = kind.decode(bytes, true);
        numbers.truncate(count as usize);
        Ok(numbers)
    }

    /// Since version 5.1 offsets and names of points; before, each cell's points after their number.
    fn cells(&mut self) -> Result<Cells, Error> {
        let (cells, numbers) = (self.count("cells")?, self.count("numbers of points")?);
        let memory = Tetrahedra::most_bytes(numbers);
        if memory > self.limit {
            let file = self.file.to_owned();
            return Err(Error::TooLarge { file, what: "its cells", needed: memory, limit: self.limit });
        }
        let before = self.at;
        if self.next_word().is_some_and(|word| word.eq_ignore_ascii_case("OFFSETS")) {
            let offsets = self.array(cells, 1, "offsets of cells")?;
            let word = self.word("`CONNECTIVITY`")?;
            if !word.eq_ignore_ascii_case("CONNECTIVITY") {
                return Err(self.syntax(quoted(word), "`CONNECTIVITY`"));
            }
            return Ok(Cells { offsets, points: self.array(numbers, 1, "points of cells")? });
        }
        self.at = before;
        let all: Vec<i64> = self.numbers(Kind::I32, numbers, "points of cells")?;
        let (mut offsets, mut points) = (vec![0], Vec::with_capacity(all.len()));
        let mut rest = &all[..];
        while let Some((count, names)) = rest.split_first() {
            let own = usize::try_from(*count).ok().and_then(|count| names.split_at_checked(count));
            let Some((own, after)) = own else {
                let found = format!("a cell of {count} points with {} numbers left", names.len());
                return Err(self.syntax(found, "each cell's points after their number"));
            };
            points.extend_from_slice(own);
            offsets.push(points.len() as i64);
            rest = after;
        }
        Ok(Cells { offsets, points })
    }

    /// Up to a blank line.
    fn skip_metadata(&mut self) {
        self.line();
        while self.at < self.bytes.len() && !self.line().trim_ascii().is_empty() {}
    }
}
