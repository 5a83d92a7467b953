//! The teapot's text: numbers of points in lines of 16, coordinates in lines of three, each list after its length.

use std::borrow::Cow;

use cutaway_core::glam::DVec3;
use cutaway_mesh::patches::{Basis, MAX_CONTROL_POINTS, MAX_COORDINATE, PatchSet};

use super::PatchReadError;
use crate::text;
use crate::volume::error::quoted;

/// Lines that are not blank, with their numbers.
struct Lines<'a> {
    file: String,
    /// What has not been read yet.
    rest: &'a [u8],
    /// The last line that was read, counted from 1.
    line: usize,
}

pub(super) fn parse(file: String, bytes: &[u8]) -> Result<PatchSet, PatchReadError> {
    let mut lines = Lines { file, rest: bytes, line: 0 };
    let count = lines.count("patches", MAX_CONTROL_POINTS / 16)?;
    // Lists grow as lines come: what the file claims reserves nothing.
    let mut patches = Vec::new();
    let mut places = Vec::new();
    for _ in 0..count {
        let numbers = "16 numbers of points, from 1";
        patches.push(lines.numbers::<u32, 16>(|| format!("{numbers} (there should be {count} such lines)"))?);
        places.push(lines.line);
    }
    let count = lines.count("points", MAX_CONTROL_POINTS)?;
    let mut points = Vec::new();
    for _ in 0..count {
        let expected = || format!("three coordinates (there should be {count} such lines)");
        let point = lines.numbers::<f64, 3>(expected)?;
        if !point.iter().all(|x| x.abs() <= MAX_COORDINATE) {
            return Err(lines.wrong(format!("{point:?}"), "coordinates from -1e30 to 1e30".to_owned()));
        }
        points.push(DVec3::from_array(point));
    }
    if let Some(text) = lines.next() {
        return Err(lines.wrong(quoted(text.trim()), format!("the end of the file after {count} points")));
    }
    for (indices, line) in patches.iter_mut().zip(places) {
        for index in indices {
            if !(1..=count).contains(&(*index as usize)) {
                lines.line = line;
                return Err(lines.wrong(format!("point {index}"), format!("points from 1 to {count}")));
            }
            *index -= 1;
        }
    }
    let file = lines.file;
    PatchSet::bicubic(Basis::Bezier, &points, &patches).map_err(|error| PatchReadError::Patches {
        file,
        surface: None,
        error,
    })
}

impl<'a> Lines<'a> {
    /// The next line that is not blank. What is not text is shown as such in messages and is no number.
    fn next(&mut self) -> Option<Cow<'a, str>> {
        while !self.rest.is_empty() {
            let (line, rest) = text::first_line(self.rest);
            self.rest = rest;
            self.line += 1;
            if !line.trim_ascii().is_empty() {
                return Some(String::from_utf8_lossy(line));
            }
        }
        None
    }

    fn wrong(&self, found: String, expected: String) -> PatchReadError {
        PatchReadError::Text { file: self.file.clone(), line: self.line, found, expected }
    }

    fn expect(&mut self, expected: impl Fn() -> String) -> Result<Cow<'a, str>, PatchReadError> {
        if let Some(line) = self.next() {
            return Ok(line);
        }
        Err(self.wrong("the end of the file after this line".to_owned(), expected()))
    }

    fn count(&mut self, what: &str, most: usize) -> Result<usize, PatchReadError> {
        let expected = || format!("how many {what} follow, from 1 to {most}");
        let line = self.expect(expected)?;
        let count = line.trim().parse().ok().filter(|count| (1..=most).contains(count));
        count.ok_or_else(|| self.wrong(quoted(line.trim()), expected()))
    }

    /// As many numbers as are wanted, between commas or blanks.
    fn numbers<T: std::str::FromStr + Copy + Default, const N: usize>(
        &mut self,
        expected: impl Fn() -> String,
    ) -> Result<[T; N], PatchReadError> {
        let line = self.expect(&expected)?;
        let mut numbers = [T::default(); N];
        let mut found = 0;
        for word in line.split([',', ' ', '\t', '\r']).filter(|word| !word.is_empty()) {
            let number = word.parse().map_err(|_| self.wrong(quoted(word), expected()))?;
            if let Some(place) = numbers.get_mut(found) {
                *place = number;
            }
            found += 1;
        }
        if found != N {
            return Err(self.wrong(format!("{found} numbers"), expected()));
        }
        Ok(numbers)
    }
}
