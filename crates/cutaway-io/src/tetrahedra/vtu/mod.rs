//! VTK XML files of unstructured grids: pieces with data arrays, in one time step or several.

mod arrays;
mod encoded;
mod packed;

use std::collections::BTreeMap;

use cutaway_core::glam::DVec3;

use self::arrays::{Appended, Array, Decoder, Encoding};
use self::packed::Compressor;
use super::TetrahedraReadOptions;
use super::cells::{Cells, Tetrahedra};
use super::error::TetrahedraReadError as Error;
use super::grid::{ArrayInfo, On, Parsed, Role, Values, Wanted};
use super::numbers::Kind;
use super::xml::{Event, Xml};
use crate::volume::error::quoted;

/// The elements that arrays are in.
const INSIDE: [&str; 5] = ["PointData", "CellData", "Points", "Cells", "FieldData"];

/// A piece of the grid: its arrays by the element that they are in.
#[derive(Debug, Default)]
struct Piece<'a> {
    points: u64,
    cells: u64,
    /// The names of the active scalars of points and of cells.
    active: [Option<String>; 2],
    arrays: BTreeMap<&'static str, Vec<Array<'a>>>,
}

impl<'a> Piece<'a> {
    fn arrays(&self, inside: &str) -> &[Array<'a>] {
        self.arrays.get(inside).map_or(&[], Vec::as_slice)
    }

    /// The array of a name (any, where none is given) at a time step: one for that step, else the one for the step
    /// before it, else one for all steps.
    fn array(&self, inside: &str, name: Option<&str>, step: u64) -> Option<&Array<'a>> {
        let named = self.arrays(inside).iter().filter(|array| name.is_none_or(|name| array.name == name));
        let there = named.filter(|array| array.step.is_none_or(|own| own <= step));
        // The latest, and the first of several such.
        there.fold(None, |best: Option<&Array>, array| match best {
            Some(best) if best.step >= array.step => Some(best),
            _ => Some(array),
        })
    }
}

/// What the tags of a file say.
#[derive(Default)]
struct Tags<'a> {
    pieces: Vec<Piece<'a>>,
    /// The grid's own arrays.
    field: Vec<Array<'a>>,
    /// When the time steps are.
    times: Vec<f64>,
}

pub(super) fn read(
    file: &str,
    bytes: &[u8],
    options: &TetrahedraReadOptions,
    wanted: &Wanted,
) -> Result<Parsed, Error> {
    let mut decoder = Decoder::new(file, options.limits.max_bytes);
    let mut tags = Tags::read(&mut decoder, bytes)?;
    let mut parsed = Parsed::default();
    let step = choose_step(&decoder, &mut tags, options, &mut parsed)?;
    parsed.time = tags.times.get(step as usize).copied();
    if parsed.time.is_none()
        && let Some(time) = tags.field.iter().find(|array| array.name == "TimeValue" && array.components == 1)
    {
        parsed.time = decoder.numbers::<f64>(time, 1).ok().and_then(|times| times.first().copied());
    }
    let mut add = Adding { decoder, wanted, step, chosen: None };
    for piece in &tags.pieces {
        add.piece(piece, &mut parsed)?;
    }
    Ok(parsed)
}

/// The time step to read. Where VTK writes the arrays of all steps inline, each step is a further list of pieces, all of
/// them called step 0.
fn choose_step(
    decoder: &Decoder<'_>,
    tags: &mut Tags<'_>,
    options: &TetrahedraReadOptions,
    parsed: &mut Parsed,
) -> Result<u64, Error> {
    let count = tags.times.len().max(1);
    let step = options.time_step.unwrap_or(0);
    if step >= count {
        return Err(Error::TimeStep { file: decoder.file.to_owned(), index: step, steps: count });
    }
    if count > 1 {
        parsed.notices.push(format!(
            "time step {step} of {count} read (numbered from 0); choose with the volume index"
        ));
        let every = tags.pieces.iter().flat_map(|piece| piece.arrays.values().flatten());
        if tags.pieces.len().is_multiple_of(count) && every.into_iter().all(|array| array.step == Some(0)) {
            let each = tags.pieces.len() / count;
            tags.pieces = tags.pieces.drain(step * each..(step + 1) * each).collect();
        }
    }
    Ok(step as u64)
}

impl<'a> Tags<'a> {
    /// Reads all tags; no array is decoded yet.
    fn read(decoder: &mut Decoder<'a>, bytes: &'a [u8]) -> Result<Self, Error> {
        let mut xml = Xml::new(bytes);
        let mut tags = Self::default();
        let mut inside = "";
        loop {
            let event =
                xml.next().map_err(|expected| decoder.syntax(xml.position(), "something else", expected))?;
            let (name, attributes, closed) = match event {
                None => return Ok(tags),
                Some(Event::End { name }) => {
                    if INSIDE.contains(&name) {
                        inside = "";
                    }
                    continue;
                }
                Some(Event::Begin { name, attributes, closed }) => (name, attributes, closed),
            };
            let at = xml.position();
            match name {
                "VTKFile" => decoder.encoding = encoding(decoder, &attributes)?,
                "UnstructuredGrid" => {
                    let times = attributes.get("TimeValues").map_or("", String::as_str);
                    let times = times.split_whitespace().map(|time| time.parse().unwrap_or(f64::NAN));
                    tags.times = times.collect();
                }
                "Piece" => tags.pieces.push(piece(decoder, &attributes, at)?),
                "AppendedData" => {
                    decoder.appended = Some(appended(decoder, &attributes, xml.rest(), at)?);
                    // What follows may look like anything.
                    return Ok(tags);
                }
                "DataArray" | "Array" => {
                    let array = array(decoder, attributes, if closed { &[] } else { xml.text() }, at)?;
                    tags.keep(array, inside, name == "Array");
                }
                name if !closed => {
                    if let Some(known) = INSIDE.iter().find(|known| **known == name) {
                        inside = known;
                        tags.activate(known, attributes);
                    }
                }
                _ => {}
            }
        }
    }

    fn activate(&mut self, inside: &str, mut attributes: BTreeMap<&str, String>) {
        let on = ["PointData", "CellData"].iter().position(|name| *name == inside);
        if let (Some(on), Some(piece)) = (on, self.pieces.last_mut()) {
            piece.active[on] = attributes.remove("Scalars");
        }
    }

    /// Keeps an array where it belongs; one of text has no components.
    fn keep(&mut self, mut array: Array<'a>, inside: &'static str, text: bool) {
        if text || array.kind.eq_ignore_ascii_case("string") {
            array.components = 0;
        }
        match self.pieces.last_mut() {
            _ if inside == "FieldData" => self.field.push(array),
            Some(piece) if !inside.is_empty() => piece.arrays.entry(inside).or_default().push(array),
            _ => {}
        }
    }
}

fn piece<'a>(
    decoder: &Decoder<'_>,
    attributes: &BTreeMap<&str, String>,
    at: usize,
) -> Result<Piece<'a>, Error> {
    let count = |key: &str| match attributes.get(key).map(|text| (text, text.trim().parse())) {
        Some((_, Ok(count))) => Ok(count),
        Some((text, Err(_))) => Err(decoder.syntax(at, quoted(text), format!("a number as `{key}`"))),
        None => Err(decoder.syntax(at, "none", format!("`{key}` of a piece"))),
    };
    Ok(Piece { points: count("NumberOfPoints")?, cells: count("NumberOfCells")?, ..Piece::default() })
}

fn appended<'a>(
    decoder: &Decoder<'_>,
    attributes: &BTreeMap<&str, String>,
    rest: &'a [u8],
    at: usize,
) -> Result<Appended<'a>, Error> {
    let base64 = match attributes.get("encoding").map(String::as_str) {
        Some("base64") => true,
        Some("raw") | None => false,
        Some(other) => {
            let found = format!("the appended data are {}", quoted(other));
            return Err(decoder.unsupported(found, "raw, base64"));
        }
    };
    let begin = rest.iter().position(|b| *b == b'_');
    let begin = begin.ok_or_else(|| decoder.syntax(at, "none", "`_` before the appended data"))?;
    Ok(Appended { bytes: &rest[begin + 1..], base64 })
}

fn encoding(decoder: &Decoder<'_>, attributes: &BTreeMap<&str, String>) -> Result<Encoding, Error> {
    let get = |key: &str| attributes.get(key).map(String::as_str);
    let refused = |what: &str, found: &str, supported| {
        Err(decoder.unsupported(format!("the {what} is {}", quoted(found)), supported))
    };
    if let Some(other) = get("type").filter(|kind| *kind != "UnstructuredGrid") {
        return Err(
            decoder.unsupported(format!("the file is of type {}", quoted(other)), "unstructured grids")
        );
    }
    let big_endian = match get("byte_order") {
        None | Some("LittleEndian") => false,
        Some("BigEndian") => true,
        Some(other) => return refused("byte order", other, "LittleEndian, BigEndian"),
    };
    let header = match get("header_type") {
        None | Some("UInt32") => Kind::U32,
        Some("UInt64") => Kind::U64,
        Some(other) => return refused("header type", other, "UInt32, UInt64"),
    };
    let compressor = match get("compressor") {
        None | Some("") => None,
        Some(name) => match Compressor::named(name) {
            Some(compressor) => Some(compressor),
            None => {
                let known = "vtkZLibDataCompressor, vtkLZ4DataCompressor, vtkLZMADataCompressor";
                return refused("compressor", name, known);
            }
        },
    };
    Ok(Encoding { big_endian, header, compressor })
}

fn array<'a>(
    decoder: &Decoder<'_>,
    mut attributes: BTreeMap<&str, String>,
    text: &'a [u8],
    at: usize,
) -> Result<Array<'a>, Error> {
    let mut take = |key: &str| attributes.remove(key);
    let number = |key: &str, text: Option<String>| match text.map(|text| (text.trim().parse(), text)) {
        None => Ok(None),
        Some((Ok(number), _)) => Ok(Some(number)),
        Some((Err(_), text)) => Err(decoder.syntax(at, quoted(&text), format!("a number as `{key}`"))),
    };
    Ok(Array {
        name: take("Name").unwrap_or_default(),
        kind: take("type").unwrap_or_default(),
        // VTK 5 wrote 0 for one.
        components: number("NumberOfComponents", take("NumberOfComponents"))?.unwrap_or(1).max(1),
        format: take("format").unwrap_or_else(|| "ascii".to_owned()),
        offset: number("offset", take("offset"))?,
        step: number("TimeStep", take("TimeStep"))?,
        text,
        at,
    })
}

/// Pieces being added to one grid.
struct Adding<'d, 'w> {
    decoder: Decoder<'d>,
    wanted: &'w Wanted,
    step: u64,
    /// The array that the first piece with any points has as its values.
    chosen: Option<(String, On)>,
}

impl<'d> Adding<'d, '_> {
    fn piece(&mut self, piece: &Piece<'d>, parsed: &mut Parsed) -> Result<(), Error> {
        if piece.points == 0 && piece.cells == 0 {
            return Ok(());
        }
        let first = parsed.points.len();
        let points = piece.array("Points", None, self.step);
        let points = points.ok_or_else(|| self.decoder.syntax(0, "none", "the array of points"))?;
        let points: Vec<f64> = self.decoder.numbers(points, piece.points.saturating_mul(3))?;
        parsed.points.extend(points.as_chunks::<3>().0.iter().map(|p| DVec3::from_array(*p)));
        let (cells, kinds) = self.cells(piece)?;
        let ghosts = self.ghosts(piece)?;
        let hidden = |cell: usize| ghosts.get(cell).is_some_and(|flags| Tetrahedra::hides(*flags));
        let mut own = Tetrahedra::default();
        own.add_all(self.decoder.file, &cells, &kinds, parsed.points.len() - first, hidden)?;
        let shift =
            u32::try_from(first).map_err(|_| self.decoder.syntax(0, "too many points", "fewer than 2^32"))?;
        parsed.cells.append(own, shift);
        self.values(piece, parsed, first == 0)
    }

    fn cells(&mut self, piece: &Piece<'d>) -> Result<(Cells, Vec<i64>), Error> {
        if piece.cells == 0 {
            return Ok((Cells { offsets: vec![0], points: Vec::new() }, Vec::new()));
        }
        let array = |name: &str| {
            let found = piece.array("Cells", Some(name), self.step);
            found.ok_or_else(|| self.decoder.syntax(0, "none", format!("the array `{name}` of cells")))
        };
        let (names, ends, kinds) = (array("connectivity")?, array("offsets")?, array("types")?);
        let ends: Vec<i64> = self.decoder.numbers(ends, piece.cells)?;
        let kinds: Vec<i64> = self.decoder.numbers(kinds, piece.cells)?;
        let mut offsets = vec![0];
        offsets.extend(ends);
        let last = u64::try_from(offsets[offsets.len() - 1]).unwrap_or(u64::MAX);
        // What is cut into tetrahedra grows.
        self.decoder.take(Tetrahedra::most_bytes(last))?;
        Ok((Cells { offsets, points: self.decoder.numbers(names, last)? }, kinds))
    }

    fn ghosts(&mut self, piece: &Piece<'d>) -> Result<Vec<f64>, Error> {
        match piece.array("CellData", Some(super::GHOSTS), self.step).filter(|array| array.components == 1) {
            Some(array) => self.decoder.numbers(array, piece.cells),
            None => Ok(Vec::new()),
        }
    }

    fn values(&mut self, piece: &Piece<'d>, parsed: &mut Parsed, first: bool) -> Result<(), Error> {
        if first {
            self.choose(piece, parsed);
        }
        let Some((name, on)) = self.chosen.clone() else { return Ok(()) };
        let (inside, count) = match on {
            On::Points => ("PointData", piece.points),
            On::Cells => ("CellData", piece.cells),
        };
        let array = piece.array(inside, Some(&name), self.step).filter(|array| array.components == 1);
        let array = array.ok_or_else(|| {
            self.decoder.syntax(0, "none", format!("the array {} in every piece", quoted(&name)))
        })?;
        let numbers: Vec<f64> = self.decoder.numbers(array, count)?;
        let values = parsed.values.get_or_insert_with(|| Values { name, on, numbers: Vec::new() });
        values.numbers.extend(numbers);
        Ok(())
    }

    /// Chooses the array that is wanted most.
    fn choose(&mut self, piece: &Piece<'d>, parsed: &mut Parsed) {
        let mut best = u8::MAX;
        for (k, (inside, on)) in [("PointData", On::Points), ("CellData", On::Cells)].into_iter().enumerate()
        {
            for array in piece.arrays(inside) {
                let info = ArrayInfo { name: array.name.clone(), on, components: array.components };
                let active = piece.active[k].as_ref() == Some(&array.name);
                let role = if active { Role::Active } else { Role::Plain };
                if let Some(rank) = self.wanted.rank(&info, role).filter(|rank| *rank < best) {
                    best = rank;
                    self.chosen = Some((info.name.clone(), on));
                }
                parsed.remember(info);
            }
        }
    }
}
