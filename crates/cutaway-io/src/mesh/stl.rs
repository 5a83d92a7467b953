//! STL, text and binary: <https://www.loc.gov/preservation/digital/formats/fdd/fdd000504.shtml>.
//!
//! Normals are left out: the windings say as much, and many files have them wrong. Vertices at one place become one
//! vertex, since the format has no other way to say that triangles share it.

use std::collections::HashMap;

use cutaway_mesh::TriangleMesh;
use glam::Vec3;

use super::builder::Builder;
use super::error::MeshReadError;
use super::input::{Input, shown, words};

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

/// Merges vertices at one place as they arrive.
#[derive(Default)]
struct Places {
    builder: Builder,
    number: HashMap<[u32; 3], u32>,
}

impl Places {
    /// The number of the vertex at a place.
    fn vertex(&mut self, input: &Input<'_>, at: [f32; 3]) -> Result<u32, MeshReadError> {
        // Adding 0 turns -0 into 0, which is the same place.
        let key = at.map(|c| (c + 0.0).to_bits());
        if let Some(number) = self.number.get(&key) {
            return Ok(*number);
        }
        // More vertices than fit into u32 would take more triangles than a binary file can have.
        let number = u32::try_from(self.builder.vertices()).ok().filter(|n| *n < u32::MAX);
        let number =
            number.ok_or_else(|| input.syntax(input.byte(), "too many vertices", "fewer than 2^32"))?;
        self.number.insert(key, number);
        self.builder.vertex(input, Vec3::from_array(at))?;
        Ok(number)
    }
}

pub(super) fn read_binary(input: &mut Input<'_>) -> Result<TriangleMesh, MeshReadError> {
    let mut header = [0; HEADER as usize];
    let length = input.left();
    let whole = input.read_exact(&mut header)?;
    let Some(count) = count(&header).filter(|_| whole) else {
        return Err(input.too_short("header", length, format!("{HEADER}")));
    };
    input.check_count("triangles", u64::from(count), TRIANGLE)?;
    let mut places = Places::default();
    let mut record = [0; TRIANGLE as usize];
    for triangle in 0..count {
        let start = input.byte();
        if !input.read_exact(&mut record)? {
            let found = u64::from(triangle) * TRIANGLE;
            let expected = format!("{} for {count} of them", u64::from(count) * TRIANGLE);
            return Err(input.too_short("triangles", found, expected));
        }
        let mut corners = [0; 3];
        for (i, corner) in corners.iter_mut().enumerate() {
            let at = [0, 1, 2].map(|axis| {
                let bytes = record[12 + 12 * i + 4 * axis..].first_chunk().copied();
                f32::from_le_bytes(bytes.unwrap_or_default())
            });
            if let Some(wrong) = at.iter().find(|c| !c.is_finite()) {
                return Err(input.not_finite(start, wrong));
            }
            *corner = places.vertex(input, at)?;
        }
        places.builder.face(input, &corners, start)?;
    }
    if !input.at_end()? {
        input.notice(format!("{} goes on after its {count} triangles: the rest ignored", input.file()));
    }
    places.builder.finish(input, 0)
}

pub(super) fn read_text(input: &mut Input<'_>) -> Result<TriangleMesh, MeshReadError> {
    let mut text = Text { places: Places::default(), state: State::Outside, corners: Vec::new() };
    let mut line = Vec::new();
    while input.read_line(&mut line)? {
        text.line(input, &line)?;
    }
    if text.state != State::Outside {
        let expected = format!("{}; the file is cut short", text.state.expected());
        return Err(input.syntax(input.line(), "the end of the file", expected));
    }
    text.places.builder.finish(input, 0)
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
    places: Places,
    state: State,
    corners: Vec<u32>,
}

impl Text {
    fn line(&mut self, input: &Input<'_>, line: &[u8]) -> Result<(), MeshReadError> {
        let mut words = words(line).peekable();
        while let Some(word) = words.next() {
            let keyword = word.to_ascii_lowercase();
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
                    self.corners.push(self.places.vertex(input, at)?);
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
