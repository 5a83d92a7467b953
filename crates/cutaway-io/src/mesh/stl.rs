//! STL, text and binary: <https://www.loc.gov/preservation/digital/formats/fdd/fdd000504.shtml>.
//!
//! Normals are left out: the windings say as much, and many files have them wrong. Vertices at one place become one
//! vertex, since the format has no other way to say that triangles share it.

use std::collections::HashMap;
use std::hash::Hash;

use cutaway_mesh::{Topology, TriangleMesh};
use glam::{DVec3, Vec3};

use super::builder::Builder;
use super::error::MeshReadError;
use super::input::{Input, shown, words};
use crate::volume::Place;

/// Bytes of a binary header, its count included, and of a triangle.
const HEADER: u64 = 84;
const TRIANGLE: u64 = 50;

/// Whether a file that begins so is text. Binary files, too, may begin with `solid`, but their counts have zeros.
pub(super) fn is_text(head: &[u8]) -> bool {
    let word = head.trim_ascii_start();
    word.get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid")) && !head.contains(&0)
}

/// Whether a file that begins so and has this length is a binary one.
pub(super) fn fits_binary(head: &[u8], length: u64) -> bool {
    count(head).is_some_and(|count| length == HEADER + TRIANGLE * u64::from(count))
}

fn count(head: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(head.get(80..84)?.try_into().ok()?))
}

/// Merges vertices at one place as they arrive. `K` is what a place is known by.
struct Places<K> {
    builder: Builder,
    number: HashMap<K, u32>,
}

impl<K: Eq + Hash> Places<K> {
    fn new() -> Self {
        Self { builder: Builder::default(), number: HashMap::new() }
    }

    /// The number of the vertex at a place.
    fn vertex(&mut self, input: &Input<'_>, key: K, at: DVec3) -> Result<u32, MeshReadError> {
        if let Some(number) = self.number.get(&key) {
            return Ok(*number);
        }
        // More vertices than fit into u32 would take more triangles than a binary file can have.
        let number = u32::try_from(self.builder.vertices()).ok().filter(|n| *n < u32::MAX);
        let number =
            number.ok_or_else(|| input.syntax(input.byte(), "too many vertices", "fewer than 2^32"))?;
        self.number.insert(key, number);
        self.builder.vertex(input, at)?;
        Ok(number)
    }
}

impl Places<[u32; 3]> {
    /// Adds the triangle in 50 bytes of a binary file.
    fn triangle(&mut self, input: &Input<'_>, record: &[u8], start: Place) -> Result<(), MeshReadError> {
        let mut corners = [0; 3];
        for (i, corner) in corners.iter_mut().enumerate() {
            let at = [0, 1, 2].map(|axis| {
                let bytes = record.get(12 + 12 * i + 4 * axis..).and_then(|rest| rest.first_chunk().copied());
                f32::from_le_bytes(bytes.unwrap_or_default())
            });
            if let Some(wrong) = at.iter().find(|c| !c.is_finite()) {
                return Err(input.not_finite(start, wrong));
            }
            // Adding 0 turns -0 into 0, which is the same place.
            let key = at.map(|c| (c + 0.0).to_bits());
            *corner = self.vertex(input, key, Vec3::from_array(at).as_dvec3())?;
        }
        self.builder.face(input, &corners, start)
    }
}

/// Reads a binary file. Its length decides where its count is wrong, and what follows each triangle.
pub(super) fn read_binary(input: &mut Input<'_>) -> Result<TriangleMesh, MeshReadError> {
    let mut header = [0; HEADER as usize];
    let length = input.left();
    let whole = input.read_exact(&mut header)?;
    let Some(count) = count(&header).filter(|_| whole) else {
        return Err(input.too_short("header", length, format!("{HEADER}")));
    };
    if input.left_exactly() == Some(u64::from(count) * TRIANGLE) {
        return read_records(input, u64::from(count));
    }
    let records = input.read_all()?;
    let layout = Layout::of(input, count, &records)?;
    let mut places = Places::new();
    for (at, record) in layout.records(&records) {
        places.triangle(input, record, Place::Byte(HEADER + at as u64))?;
    }
    let mesh = places.builder.finish(input, 0)?;
    layout.explain(input, count, &records, &mesh)?;
    Ok(mesh)
}

/// Reads as many triangles as there are bytes for.
fn read_records(input: &mut Input<'_>, count: u64) -> Result<TriangleMesh, MeshReadError> {
    let mut places = Places::new();
    let mut record = [0; TRIANGLE as usize];
    for triangle in 0..count {
        let start = input.byte();
        if !input.read_exact(&mut record)? {
            let expected = format!("{} for {count} of them", count * TRIANGLE);
            return Err(input.too_short("triangles", triangle * TRIANGLE, expected));
        }
        places.triangle(input, &record, start)?;
    }
    places.builder.finish(input, 0)
}

/// Where the triangles of a binary file are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layout {
    /// This many triangles, one after the other; more bytes may follow.
    Plain(usize),
    /// Each triangle is followed by as many bytes as its attribute field says.
    Attributes(usize),
}

impl Layout {
    /// Finds out how a file whose header says `count` triangles is written.
    fn of(input: &Input<'_>, count: u32, records: &[u8]) -> Result<Self, MeshReadError> {
        let claimed = count as usize;
        let (held, surplus) = (records.len() / TRIANGLE as usize, records.len() % TRIANGLE as usize);
        if surplus == 0 && held == claimed {
            return Ok(Self::Plain(held));
        }
        let attributes = Self::Attributes(claimed);
        let ends = attributes.records(records).map(|(at, record)| at + record.len() + attribute(record));
        if claimed <= held && ends.enumerate().last() == Some((claimed.wrapping_sub(1), records.len())) {
            return Ok(attributes);
        }
        if surplus == 0 {
            return Ok(Self::Plain(held));
        }
        if claimed > held {
            let expected = format!("{} for {count} of them", u64::from(count) * TRIANGLE);
            return Err(input.too_short("triangles", records.len() as u64, expected));
        }
        let plain = Self::Plain(claimed);
        if claimed > 0 && plain.records(records).all(|(_, record)| attribute(record) == 0) {
            return Ok(plain);
        }
        let more = records.len() - claimed * TRIANGLE as usize;
        Err(input.syntax(
            Place::Byte(80),
            format!("a count of {count} triangles, and {more} bytes more than they take"),
            "50 bytes per triangle, or as many bytes after each triangle as its attribute field says; export the \
             file again without attributes",
        ))
    }

    /// The 50 bytes of each triangle that is there, and where they are.
    fn records(self, bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
        let (count, walks) = match self {
            Self::Plain(count) => (count, false),
            Self::Attributes(count) => (count, true),
        };
        let mut at = 0;
        (0..count).map_while(move |_| {
            let (start, record) = (at, bytes.get(at..at + TRIANGLE as usize)?);
            at += record.len() + if walks { attribute(record) } else { 0 };
            Some((start, record))
        })
    }

    /// Says what is unusual about the file. A file that is shorter than its count says may be cut short: its surface is
    /// believed only if it is closed.
    fn explain(
        self,
        input: &mut Input<'_>,
        count: u32,
        records: &[u8],
        mesh: &TriangleMesh,
    ) -> Result<(), MeshReadError> {
        let file = input.file();
        match self {
            Self::Attributes(_) => {
                let more = records.len() as u64 - u64::from(count) * TRIANGLE;
                input.notice(format!(
                    "{file} has {more} bytes of attributes after its triangles; ignored them"
                ));
            }
            Self::Plain(held) if held as u64 * TRIANGLE < records.len() as u64 => {
                let more = records.len() as u64 - held as u64 * TRIANGLE;
                input.notice(format!(
                    "{file} has {more} extra bytes after its {held} triangles; ignored them"
                ));
            }
            Self::Plain(held) if held < count as usize && !Topology::new(mesh).is_closed() => {
                let expected = format!("{} for {count} of them", u64::from(count) * TRIANGLE);
                return Err(input.too_short("triangles", records.len() as u64, expected));
            }
            Self::Plain(held) if held != count as usize => input.notice(format!(
                "the header of {file} says {count} triangles, but the file holds {held}; read all of them"
            )),
            Self::Plain(_) => {}
        }
        Ok(())
    }
}

/// The attribute field of a triangle: a colour, nothing in particular, or a number of bytes.
fn attribute(record: &[u8]) -> usize {
    record.last_chunk().map_or(0, |bytes| usize::from(u16::from_le_bytes(*bytes)))
}

pub(super) fn read_text(input: &mut Input<'_>) -> Result<TriangleMesh, MeshReadError> {
    let mut text = Text { places: Places::new(), state: State::Outside, corners: Vec::new() };
    let mut line = Vec::new();
    while input.read_line(&mut line)? {
        text.line(input, &line)?;
    }
    let state = text.state;
    let cut_short = |input: &Input<'_>| {
        let expected = format!("{}; the file is cut short", state.expected());
        input.syntax(input.line(), "the end of the file", expected)
    };
    if !matches!(state, State::Outside | State::Solid) {
        return Err(cut_short(input));
    }
    let mesh = text.places.builder.finish(input, 0)?;
    if state == State::Solid {
        // Some programs leave out the last line. A file that is cut short has holes.
        if !Topology::new(&mesh).is_closed() {
            return Err(cut_short(input));
        }
        input.notice(format!("{} does not end with `endsolid`", input.file()));
    }
    Ok(mesh)
}

/// Where in a text file the reader is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Outside,
    Solid,
    Facet,
    Loop,
    Looped,
}

impl State {
    fn expected(self) -> &'static str {
        match self {
            Self::Outside => "`solid`",
            Self::Solid => "`facet` or `endsolid`",
            Self::Facet => "`outer loop`",
            Self::Loop => "`vertex` or `endloop`",
            Self::Looped => "`endfacet`",
        }
    }
}

/// A text file while it is read. Keywords are in any case, and line breaks matter only after names of solids.
struct Text {
    places: Places<[u64; 3]>,
    state: State,
    corners: Vec<u32>,
}

impl Text {
    fn line(&mut self, input: &Input<'_>, line: &[u8]) -> Result<(), MeshReadError> {
        // Colours of some programs, and comments, which only a line of its own can be.
        if words(line)
            .next()
            .is_some_and(|word| word.eq_ignore_ascii_case(b"color") || word.starts_with(b"#"))
        {
            return Ok(());
        }
        let mut words = words(line).peekable();
        while let Some(word) = words.next() {
            let mut keyword = word.to_ascii_lowercase();
            // `end solid`, `end facet`, `end loop`.
            if keyword == b"end"
                && let Some(what) = words.next()
            {
                keyword.extend(what.to_ascii_lowercase());
            }
            self.state = match (self.state, keyword.as_slice()) {
                // The rest of the line is a name. A solid may begin where the last one does not say that it ended.
                (State::Outside | State::Solid, b"solid") => {
                    self.state = State::Solid;
                    return Ok(());
                }
                (State::Solid, b"endsolid") => {
                    self.state = State::Outside;
                    return Ok(());
                }
                (State::Solid, b"facet") => {
                    // A normal, which may well be `nan nan nan`.
                    while words.next_if(|word| !word.eq_ignore_ascii_case(b"outer")).is_some() {}
                    State::Facet
                }
                (State::Facet, b"outer") => {
                    if !words.next().is_some_and(|word| word.eq_ignore_ascii_case(b"loop")) {
                        return Err(input.syntax(input.line(), shown(line), "`outer loop`"));
                    }
                    self.corners.clear();
                    State::Loop
                }
                (State::Loop, b"vertex") => {
                    let mut coordinate = || match words.next() {
                        Some(word) => input.coordinate(word),
                        None => {
                            Err(input.syntax(input.line(), shown(line), "three coordinates after `vertex`"))
                        }
                    };
                    let at = [coordinate()?, coordinate()?, coordinate()?];
                    let key = at.map(|c: f64| (c + 0.0).to_bits());
                    self.corners.push(self.places.vertex(input, key, DVec3::from_array(at))?);
                    State::Loop
                }
                (State::Loop, b"endloop") => {
                    if self.corners.len() < 3 {
                        let found = format!("a facet of {} vertices", self.corners.len());
                        return Err(input.syntax(input.line(), found, "three"));
                    }
                    self.places.builder.face(input, &self.corners, input.line())?;
                    State::Looped
                }
                (State::Looped, b"endfacet") => State::Solid,
                (state, _) => return Err(input.syntax(input.line(), shown(word), state.expected())),
            };
        }
        Ok(())
    }
}
