//! Data files that a header names: one name, a pattern with a number in it, or a list.
//!
//! A name is believed only as far as the header's folder: relative, without `..`, and after following symbolic links
//! still inside (the [`Folder`] checks that).

use std::io;

use super::Context;
use super::error::{Place, ReadError, quoted};
use super::payload::Encoding;
use super::source::{Folder, OpenError, Stream, is_gzip};

/// Most data files that a header may have; a stack of slices is far smaller.
pub(crate) const MOST_FILES: usize = 1 << 20;

/// What to do about a data file that cannot be opened.
const HINT: &str = "the header names it as its data file: put it beside the header";

/// Opens the data file `name`, or `name.gz` where that is there instead (as MetaImage's own library does).
pub(crate) fn open<'f>(
    ctx: &mut Context<'_>,
    folder: &'f dyn Folder,
    name: &str,
    place: Place,
    encoding: Encoding,
) -> Result<Stream<'f>, ReadError> {
    let outside = |why| ReadError::Outside { file: ctx.file.clone(), place, name: quoted(name), why };
    let mut plain = plain_name(name).map_err(outside)?;
    let mut opened = folder.open(&plain);
    if matches!(&opened, Err(OpenError::Io(error)) if error.kind() == io::ErrorKind::NotFound) {
        let zipped = format!("{plain}.gz");
        if let Ok(source) = folder.open(&zipped) {
            opened = Ok(source);
            plain = zipped;
        }
    }
    let shown = ctx.beside(&plain);
    let mut source = opened.map_err(|error| match error {
        OpenError::Outside => outside("is a link that leads out of the header's folder"),
        OpenError::Io(error) => ReadError::Open { file: shown.clone(), error, hint: HINT },
    })?;
    if encoding == Encoding::Raw && plain.ends_with(".gz") {
        let (head, _) =
            source.head(3).map_err(|error| ReadError::Io { file: shown.clone(), offset: 0, error })?;
        if is_gzip(&head) {
            return Ok(Stream::gunzip(&shown, source));
        }
    }
    Ok(Stream::plain(&shown, source))
}

/// Whether the folder has a file of exactly this name.
pub(crate) fn exists(folder: &dyn Folder, name: &str) -> bool {
    plain_name(name).is_ok_and(|name| folder.open(&name).is_ok())
}

/// What is expected of a pattern that stands for `count` files.
pub(crate) fn count_text(wanted: &str, of: &str, count: u64) -> String {
    if count > MOST_FILES as u64 {
        format!("{wanted}, and at most {MOST_FILES} files, not {of} {count}")
    } else {
        format!("{wanted}, not {of} {count}")
    }
}

/// The name with `/` between its parts and no `.` among them, or what is wrong with it.
pub(crate) fn plain_name(name: &str) -> Result<String, &'static str> {
    if name.contains('\0') {
        return Err("contains a zero byte");
    }
    // Far below what file systems allow for a path, far above what anyone writes.
    if name.len() > 1024 {
        return Err("has a name of more than 1024 bytes");
    }
    let drive = name.as_bytes().get(1) == Some(&b':');
    if name.starts_with(['/', '\\']) || drive {
        return Err("is an absolute path");
    }
    let parts: Vec<&str> = name.split(['/', '\\']).filter(|part| !part.is_empty() && *part != ".").collect();
    if parts.contains(&"..") {
        return Err("leads out of the header's folder");
    }
    if parts.is_empty() {
        return Err("is empty");
    }
    Ok(parts.join("/"))
}

/// A file name with one number in it, as `printf` writes: `slice%03d.raw`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Pattern {
    before: String,
    width: usize,
    zeros: bool,
    after: String,
}

impl Pattern {
    /// Parses a pattern: exactly one `%d` (`%i`, `%u`), with an optional `0` and width; `%%` is a per cent sign.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        const WIDEST: usize = 32;
        let mut parts = vec![String::new()];
        let (mut width, mut zeros) = (0, false);
        let mut chars = text.chars().peekable();
        while let Some(c) = chars.next() {
            if c != '%' {
                parts.last_mut()?.push(c);
                continue;
            }
            if chars.next_if_eq(&'%').is_some() {
                parts.last_mut()?.push('%');
                continue;
            }
            zeros = chars.next_if_eq(&'0').is_some();
            while let Some(digit) = chars.peek().and_then(|c| c.to_digit(10)) {
                width = width * 10 + digit as usize;
                chars.next();
                if width > WIDEST {
                    return None;
                }
            }
            if !matches!(chars.next(), Some('d' | 'i' | 'u')) || parts.len() > 1 {
                return None;
            }
            parts.push(String::new());
        }
        let [before, after] = <[String; 2]>::try_from(parts).ok()?;
        Some(Self { before, width, zeros, after })
    }

    /// The name for a number.
    fn name(&self, number: i64) -> String {
        let Self { before, width, zeros, after } = self;
        if *zeros {
            format!("{before}{number:0width$}{after}")
        } else {
            format!("{before}{number:width$}{after}")
        }
    }
}

/// The names of a pattern for the numbers `min, min + step, ...` up to `max`, or how many there would be where that is
/// more than [`MOST_FILES`] or not what `accepts` wants.
pub(crate) fn names(
    pattern: &Pattern,
    [min, max, step]: [i64; 3],
    accepts: impl Fn(u64) -> bool,
) -> Result<Vec<String>, u64> {
    let count = count(min, max, step);
    if count > MOST_FILES as u64 || !accepts(count) {
        return Err(count);
    }
    Ok((0..count as i64).map(|i| pattern.name(min + i * step)).collect())
}

/// How many numbers `min, min + step, ...` up to `max` there are; none where the step leads nowhere.
fn count(min: i64, max: i64, step: i64) -> u64 {
    let (min, max, step) = (i128::from(min), i128::from(max), i128::from(step));
    if step == 0 || (max - min).signum() == -step.signum() {
        return 0;
    }
    u64::try_from((max - min) / step + 1).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_the_folder() {
        assert_eq!(plain_name("./a.raw").as_deref(), Ok("a.raw"));
        assert_eq!(plain_name("sub\\a.raw").as_deref(), Ok("sub/a.raw"));
        assert_eq!(plain_name("a..b").as_deref(), Ok("a..b"));
        for bad in ["/etc/passwd", "\\\\host\\x", "C:\\x", "../x", "a/../../x", "a\\..\\x", "", "./", "a\0b"]
        {
            assert!(plain_name(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn patterns_write_numbers_as_printf_does() {
        let name = |pattern: &str, n| Pattern::parse(pattern).map(|p| p.name(n));
        assert_eq!(name("s%03d.raw", 7).as_deref(), Some("s007.raw"));
        assert_eq!(name("s%d.raw", 7).as_deref(), Some("s7.raw"));
        assert_eq!(name("s%3d%%.raw", 7).as_deref(), Some("s  7%.raw"));
        assert_eq!(name("s%03d.raw", -7).as_deref(), Some("s-07.raw"));
        for bad in ["s.raw", "%s", "%d%d", "%", "%99999999999999d", "%n", "%05"] {
            assert_eq!(Pattern::parse(bad), None, "{bad}");
        }
    }

    #[test]
    fn numbers_of_a_pattern_are_counted_without_overflow() {
        assert_eq!(count(1, 10, 1), 10);
        assert_eq!(count(10, 1, -3), 4);
        assert_eq!(count(5, 5, 7), 1);
        assert_eq!(count(1, 10, -1), 0);
        assert_eq!(count(1, 10, 0), 0);
        assert_eq!(count(i64::MIN, i64::MAX, 1), u64::MAX);
    }
}
