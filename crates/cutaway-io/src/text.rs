//! What all text formats share: byte order marks, encodings that are not read, and the ends of lines.
//!
//! Every reader of text, and every header of text in front of binary data, asks here, so that a file is read alike
//! whatever editor saved it:
//!
//! - the byte order mark of UTF-8 says nothing and is skipped ([`without_mark`]);
//! - UTF-16 and UTF-32, which their own marks show, are refused by name ([`foreign`]). No binary format that is read
//!   begins with those bytes; raw voxels may, so they are asked only after everything that could describe them;
//! - lines end in a line feed, in a carriage return and a line feed, or in a carriage return alone. Text without binary
//!   data is cut at any of them ([`lines`]). In front of binary data only the end that the first line has counts
//!   ([`LineEnd`]), because a byte of the data may look like another.

/// The byte order mark of UTF-8.
pub(crate) const MARK: &[u8] = b"\xef\xbb\xbf";

/// What to do about text that [`foreign`] names.
pub(crate) const SAVE_AS_UTF_8: &str = "save it as UTF-8";

/// The bytes without the byte order mark of UTF-8 in front of them, where there is one.
pub(crate) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(MARK).unwrap_or(bytes)
}

/// What text is called that begins with the mark of an encoding that is not read; none of any other file.
pub(crate) fn foreign(head: &[u8]) -> Option<&'static str> {
    match head {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => Some("text in UTF-32"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("text in UTF-16"),
        _ => None,
    }
}

/// How the lines of a header end that binary data may follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum LineEnd {
    /// A line feed, perhaps with carriage returns before it, which belong to the end.
    #[default]
    LineFeed,
    /// A carriage return alone.
    CarriageReturn,
}

impl LineEnd {
    /// The end that the first line of `head` has; a line feed where none ends.
    pub(crate) fn of(head: &[u8]) -> Self {
        let Some(first) = head.iter().position(|b| matches!(b, b'\n' | b'\r')) else { return Self::LineFeed };
        let after = head[first..].iter().find(|b| **b != b'\r');
        if head[first] == b'\r' && after != Some(&b'\n') { Self::CarriageReturn } else { Self::LineFeed }
    }

    /// The byte that ends a line.
    pub(crate) fn byte(self) -> u8 {
        match self {
            Self::LineFeed => b'\n',
            Self::CarriageReturn => b'\r',
        }
    }
}

/// The lines of a text without their ends, whichever of the three each has. An end of line at the end of the text begins
/// no further line.
pub(crate) fn lines(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let (line, after) = (!rest.is_empty()).then(|| first_line(rest))?;
        rest = after;
        Some(line)
    })
}

/// The first line of a text without its end, and what comes after it.
pub(crate) fn first_line(text: &[u8]) -> (&[u8], &[u8]) {
    let end = text.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(text.len());
    let both = text[end..].starts_with(b"\r\n");
    (&text[..end], text.get(end + 1 + usize::from(both)..).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_known_and_only_at_the_beginning() {
        assert_eq!(without_mark(b"\xef\xbb\xbfab"), b"ab");
        assert_eq!(without_mark(b"a\xef\xbb\xbf"), b"a\xef\xbb\xbf");
        assert_eq!(foreign(b"\xff\xfev\0"), Some("text in UTF-16"));
        assert_eq!(foreign(b"\xfe\xff\0v"), Some("text in UTF-16"));
        assert_eq!(foreign(b"\xff\xfe\0\0v\0\0\0"), Some("text in UTF-32"));
        assert_eq!(foreign(b"\xff"), None);
        assert_eq!(foreign(b"ply\n"), None);
    }

    #[test]
    fn lines_end_in_three_ways() {
        let all: Vec<&[u8]> = lines(b"a\nb\r\nc\rd\r\n\r\ne").collect();
        assert_eq!(all, [&b"a"[..], b"b", b"c", b"d", b"", b"e"]);
        assert_eq!(lines(b"a\r").collect::<Vec<_>>(), [b"a"]);
        assert_eq!(lines(b"").count(), 0);
    }

    #[test]
    fn the_first_line_says_how_lines_end() {
        assert_eq!(LineEnd::of(b"a\rb\n"), LineEnd::CarriageReturn);
        assert_eq!(LineEnd::of(b"a\r\nb\rc"), LineEnd::LineFeed);
        assert_eq!(LineEnd::of(b"a\r\r\nb"), LineEnd::LineFeed);
        assert_eq!(LineEnd::of(b"a\nb\r"), LineEnd::LineFeed);
        assert_eq!(LineEnd::of(b"a\r"), LineEnd::CarriageReturn);
        assert_eq!(LineEnd::of(b"a"), LineEnd::LineFeed);
    }
}
