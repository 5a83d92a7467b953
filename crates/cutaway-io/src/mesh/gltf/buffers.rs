//! The bytes behind a glTF file: its binary chunk, `data:` URIs, and files beside it.

use std::collections::HashMap;
use std::rc::Rc;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use super::super::error::MeshReadError;
use super::super::input::Input;
use super::document::{Buffer, Document};
use super::entry;
use crate::volume::error::{quoted, shown_name};
use crate::volume::plain_name;
use crate::volume::source::{Folder, OpenError, Stream};

/// Padding is there or not: both are common.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// A buffer's bytes.
pub(super) enum Bytes<'d> {
    Chunk(&'d [u8]),
    Owned(Vec<u8>),
}

impl Bytes<'_> {
    pub(super) fn as_slice(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::Owned(bytes) => bytes,
        }
    }
}

/// Buffers, read when they are needed and kept.
pub(super) struct Buffers<'d> {
    folder: &'d dyn Folder,
    chunk: Option<&'d [u8]>,
    read: HashMap<u64, Rc<Bytes<'d>>>,
    /// Bytes of all buffers that were read.
    total: u64,
}

impl<'d> Buffers<'d> {
    pub(super) fn new(folder: &'d dyn Folder, chunk: Option<&'d [u8]>) -> Self {
        Self { folder, chunk, read: HashMap::new(), total: 0 }
    }

    /// The buffer that `field` names.
    pub(super) fn get(
        &mut self,
        input: &Input<'_>,
        document: &Document,
        index: u64,
        field: &str,
    ) -> Result<Rc<Bytes<'d>>, MeshReadError> {
        if let Some(bytes) = self.read.get(&index) {
            return Ok(Rc::clone(bytes));
        }
        let buffer = entry(input, &document.buffers, "buffers", index, field)?;
        let field = format!("buffers[{index}]");
        let bytes = match (&buffer.uri, self.chunk) {
            (Some(uri), _) if is_data(uri) => Bytes::Owned(decode(input, uri, &field)?),
            (Some(uri), _) => Bytes::Owned(self.open(input, buffer, uri, &format!("{field}.uri"))?),
            (None, Some(chunk)) if index == 0 => Bytes::Chunk(chunk),
            (None, _) => {
                return Err(MeshReadError::Field {
                    file: input.file(),
                    field: format!("{field}.uri"),
                    found: "missing".into(),
                    expected: "the name of a file, a `data:` URI, or a binary chunk for buffer 0".into(),
                });
            }
        };
        let found = bytes.as_slice().len() as u64;
        if found < buffer.byte_length {
            return Err(input.too_short(&format!("`{field}`"), found, buffer.byte_length.to_string()));
        }
        let bytes = Rc::new(bytes);
        self.read.insert(index, Rc::clone(&bytes));
        Ok(bytes)
    }

    /// Reads a file beside this one.
    fn open(
        &mut self,
        input: &Input<'_>,
        buffer: &Buffer,
        uri: &str,
        field: &str,
    ) -> Result<Vec<u8>, MeshReadError> {
        let outside = |why| MeshReadError::Outside {
            file: input.file(),
            field: field.to_owned(),
            name: quoted(uri),
            why,
        };
        let name = percent_decoded(uri).ok_or_else(|| outside("is not Unicode when decoded"))?;
        if name.split('/').next().is_some_and(|scheme| scheme.ends_with(':')) {
            return Err(outside("is somewhere else"));
        }
        let name = plain_name(&name).map_err(outside)?;
        let shown = shown_name(&name);
        let source = self.folder.open(&name).map_err(|error| match error {
            OpenError::Outside => outside("is a link that leads out of the file's folder"),
            OpenError::Io(error) => MeshReadError::Open {
                file: shown.clone(),
                error,
                hint: "the glTF file names it as its buffer: put it beside that file",
            },
        })?;
        self.total = self.total.saturating_add(buffer.byte_length);
        if self.total > input.limit() {
            let (what, needed, limit) = ("buffers".to_owned(), self.total, input.limit());
            return Err(MeshReadError::TooLarge { file: input.file(), what, needed, limit });
        }
        let mut bytes = Vec::new();
        let mut stream = Stream::plain(&shown, source);
        let read = stream.read_onto(buffer.byte_length, &mut bytes);
        read.map_err(|error| MeshReadError::Io { file: shown.clone(), offset: stream.position(), error })?;
        Ok(bytes)
    }
}

fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// The bytes of a `data:` URI. They take less memory than their text, which is there already.
fn decode(input: &Input<'_>, uri: &str, field: &str) -> Result<Vec<u8>, MeshReadError> {
    let wrong = |found: String| MeshReadError::Field {
        file: input.file(),
        field: format!("{field}.uri"),
        found,
        expected: "`data:application/octet-stream;base64,` and base64".into(),
    };
    let (kind, text) = uri.split_once(',').ok_or_else(|| wrong(quoted(uri)))?;
    if !kind.to_ascii_lowercase().ends_with(";base64") {
        return Err(wrong(quoted(kind)));
    }
    BASE64.decode(text).map_err(|error| wrong(format!("damaged base64 ({error})")))
}

/// The name with `%20` and the like replaced; `None` where that is no Unicode.
fn percent_decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        rest = after;
        let digit = |b: &u8| char::from(*b).to_digit(16);
        match (first, after) {
            (b'%', [high, low, after @ ..]) if digit(high).is_some() && digit(low).is_some() => {
                bytes.push((digit(high)? * 16 + digit(low)?) as u8);
                rest = after;
            }
            _ => bytes.push(*first),
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_uris_are_decoded() {
        assert_eq!(percent_decoded("a%20b%2e.bin").as_deref(), Some("a b..bin"));
        assert_eq!(percent_decoded("100%").as_deref(), Some("100%"));
        assert_eq!(percent_decoded("%zz%2").as_deref(), Some("%zz%2"));
        assert_eq!(percent_decoded("%ff"), None);
    }
}
