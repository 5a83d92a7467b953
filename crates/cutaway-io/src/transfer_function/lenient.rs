//! JSON as ParaView reads it: jsoncpp takes comments, and a comma before a closing bracket. ParaView's own files end with
//! such a comma.

use std::borrow::Cow;

/// The same JSON with blanks where comments and such commas are, so that every line and column stays.
pub(super) fn strict(json: &[u8]) -> Cow<'_, [u8]> {
    let mut strict = Cow::Borrowed(json);
    let mut blank = |range: std::ops::Range<usize>| {
        let bytes = &mut strict.to_mut()[range];
        bytes.iter_mut().filter(|b| !matches!(b, b'\n' | b'\r')).for_each(|b| *b = b' ');
    };
    // The last comma that nothing but blanks and comments has followed.
    let mut comma = None;
    let mut at = 0;
    while let Some(&byte) = json.get(at) {
        match byte {
            b'"' => {
                comma = None;
                at += string(&json[at..]);
            }
            b'/' => {
                let length = comment(&json[at..]);
                if length == 0 {
                    comma = None;
                }
                blank(at..at + length);
                at += length.max(1);
            }
            _ => {
                match byte {
                    b',' => comma = Some(at),
                    b']' | b'}' => {
                        if let Some(comma) = comma.take() {
                            blank(comma..comma + 1);
                        }
                    }
                    _ if byte.is_ascii_whitespace() => {}
                    _ => comma = None,
                }
                at += 1;
            }
        }
    }
    strict
}

/// What comes after blanks and comments.
pub(super) fn begin(json: &[u8]) -> &[u8] {
    let mut rest = json.trim_ascii_start();
    loop {
        let length = if rest.first() == Some(&b'/') { comment(rest) } else { 0 };
        if length == 0 {
            return rest;
        }
        rest = rest[length..].trim_ascii_start();
    }
}

/// The length of the string that begins here, its quotes included.
fn string(json: &[u8]) -> usize {
    let mut at = 1;
    while let Some(&byte) = json.get(at) {
        match byte {
            b'"' => return at + 1,
            b'\\' => at += 2,
            _ => at += 1,
        }
    }
    json.len()
}

/// The length of the comment that begins here; 0 where none does, or where it has no end.
fn comment(json: &[u8]) -> usize {
    match json.get(1) {
        Some(b'/') => json.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(json.len()),
        Some(b'*') => json[2..].windows(2).position(|end| end == b"*/").map_or(0, |end| end + 4),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_last_commas_become_blanks() {
        let says = |json: &str| String::from_utf8(strict(json.as_bytes()).into_owned()).unwrap();
        assert_eq!(says("[1, 2,\n]"), "[1, 2 \n]");
        assert_eq!(says("// a\n{\"a\": [1 /* b, */ ,],}"), "    \n{\"a\": [1           ] }");
        let kept = "{\"a // b\": \"/* c */ ,]\\\",}\", \"d\": [1, 2]}";
        assert_eq!(says(kept), kept);
        // Two commas, and one before nothing, stay wrong.
        for wrong in ["[1,,2]", "[,1]", "/* no end", "[1, /2]"] {
            assert!(
                serde_json::from_slice::<serde_json::Value>(&strict(wrong.as_bytes())).is_err(),
                "{wrong}"
            );
        }
    }
}
