//! As much of XML as VTK writes: tags with attributes, and the text between them. No entities but the five, no DTD.

use std::collections::BTreeMap;

/// A tag, or what comes of it.
#[derive(Debug, PartialEq)]
pub(super) enum Event<'a> {
    /// `<name attribute="value">`; `closed` where it ends in `/>`.
    Begin { name: &'a str, attributes: BTreeMap<&'a str, String>, closed: bool },
    /// `</name>`.
    End { name: &'a str },
}

/// A file and how far it has been read.
pub(super) struct Xml<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Xml<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub(super) fn position(&self) -> usize {
        self.at
    }

    /// What comes after the tag that was read last.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The text up to the next tag.
    pub(super) fn text(&self) -> &'a [u8] {
        let rest = self.rest();
        &rest[..rest.iter().position(|b| *b == b'<').unwrap_or(rest.len())]
    }

    /// The next tag; none at the end of the file. An error says what was expected.
    pub(super) fn next(&mut self) -> Result<Option<Event<'a>>, &'static str> {
        loop {
            let Some(begin) = self.rest().iter().position(|b| *b == b'<') else { return Ok(None) };
            self.at += begin + 1;
            let rest = self.rest();
            let skipped = if rest.starts_with(b"!--") {
                self.skip_past(b"-->")
            } else if rest.starts_with(b"?") {
                self.skip_past(b"?>")
            } else if rest.starts_with(b"!") {
                return Err("no document type and no CDATA");
            } else {
                return self.tag().map(Some);
            };
            if !skipped {
                return Err("the end of a comment");
            }
        }
    }

    fn skip_past(&mut self, end: &[u8]) -> bool {
        match self.rest().windows(end.len()).position(|window| window == end) {
            Some(at) => {
                self.at += at + end.len();
                true
            }
            None => false,
        }
    }

    fn tag(&mut self) -> Result<Event<'a>, &'static str> {
        let end = self.rest().first() == Some(&b'/');
        self.at += usize::from(end);
        let name = self.name()?;
        let mut attributes = BTreeMap::new();
        loop {
            self.blanks();
            match self.rest() {
                [b'>', ..] => {
                    self.at += 1;
                    let closed = false;
                    return Ok(if end {
                        Event::End { name }
                    } else {
                        Event::Begin { name, attributes, closed }
                    });
                }
                [b'/', b'>', ..] if !end => {
                    self.at += 2;
                    return Ok(Event::Begin { name, attributes, closed: true });
                }
                _ if end => return Err("`>` after the name of an end tag"),
                _ => {}
            }
            let attribute = self.name()?;
            self.blanks();
            if self.rest().first() != Some(&b'=') {
                return Err("`=` after the name of an attribute");
            }
            self.at += 1;
            self.blanks();
            let Some(quote) = self.rest().first().copied().filter(|b| matches!(b, b'"' | b'\'')) else {
                return Err("a quoted value of an attribute");
            };
            self.at += 1;
            let rest = self.rest();
            let Some(length) = rest.iter().position(|b| *b == quote) else {
                return Err("the end of an attribute's value");
            };
            self.at += length + 1;
            let value = std::str::from_utf8(&rest[..length]).map_err(|_| "an attribute in UTF-8")?;
            attributes.insert(attribute, unescaped(value));
        }
    }

    fn blanks(&mut self) {
        self.at += self.rest().iter().take_while(|b| b.is_ascii_whitespace()).count();
    }

    fn name(&mut self) -> Result<&'a str, &'static str> {
        let rest = self.rest();
        let of_name = |b: &&u8| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-' | b':' | b'.');
        let length = rest.iter().take_while(of_name).count();
        if length == 0 || length > 200 {
            return Err("a name of up to 200 letters");
        }
        self.at += length;
        std::str::from_utf8(&rest[..length]).map_err(|_| "a name")
    }
}

fn unescaped(text: &str) -> String {
    [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")]
        .iter()
        .fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}
