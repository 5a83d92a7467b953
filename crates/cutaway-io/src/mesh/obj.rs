//! Wavefront OBJ: <https://paulbourke.net/dataformats/obj/>.
//!
//! Read are vertices (`v`) and faces (`f`), with positive numbers and numbers from the end. Lines of numbers are continued
//! with `\`; comments and names end where their line ends.
//! Texture coordinates, normals, groups, materials, points and lines are of no use here; curves and surfaces are left
//! out with a notice.

use cutaway_mesh::TriangleMesh;
use glam::DVec3;

use super::builder::Builder;
use super::error::MeshReadError;
use super::input::{Input, number, shown, whole_number, words};

pub(super) fn read(input: &mut Input<'_>) -> Result<TriangleMesh, MeshReadError> {
    let mut builder = Builder::default();
    let (mut line, mut next, mut face) = (Vec::new(), Vec::new(), Vec::new());
    let (mut free_form, mut stray) = (0, None);
    while input.read_line(&mut line)? {
        // Comments and names may end in a backslash that means nothing, as in `# made in C:\parts\`.
        while line.last() == Some(&b'\\') && is_continued(&line) {
            line.pop();
            if !input.read_line(&mut next)? {
                break;
            }
            line.push(b' ');
            line.extend_from_slice(&next);
            if line.len() > 1 << 24 {
                return Err(input.syntax(
                    input.line(),
                    "a continued line of more than 16 MiB",
                    "shorter lines",
                ));
            }
        }
        let mut words = words(&line).map_while(uncommented);
        match words.next() {
            Some(b"v" | b"V") => {
                let mut coordinate = || match words.next() {
                    Some(word) => input.coordinate(word),
                    None => Err(input.syntax(input.line(), shown(&line), "three coordinates after `v`")),
                };
                let vertex = DVec3::new(coordinate()?, coordinate()?, coordinate()?);
                builder.vertex(input, vertex)?;
            }
            Some(b"f" | b"F" | b"fo") => {
                face.clear();
                for word in words {
                    face.push(corner(input, word, builder.vertices())?);
                }
                if face.len() < 3 {
                    return Err(input.syntax(input.line(), shown(&line), "three vertices or more after `f`"));
                }
                builder.face(input, &face, input.line())?;
            }
            Some(b"curv" | b"curv2" | b"surf") => free_form += 1,
            Some(word) if number(word).is_some() => {
                stray = stray.or(Some(input.line()));
            }
            _ => {}
        }
    }
    if builder.vertices() == 0 {
        return Err(input.syntax(input.line(), "no vertices up to the end", "lines such as `v 0 0 1`"));
    }
    if free_form > 0 {
        input.notice(format!("{free_form} free-form curves and surfaces left out: only faces are read"));
    }
    if let Some(place) = stray {
        input.notice(format!(
            "{}: {place}found numbers without a keyword such as `v`; ignored them",
            input.file()
        ));
    }
    builder.finish(input, 1)
}

/// A word up to the beginning of a comment; `None` where the comment begins with it.
fn uncommented(word: &[u8]) -> Option<&[u8]> {
    word.split(|b| *b == b'#').next().filter(|word| !word.is_empty())
}

/// True if a line that ends in a backslash goes on in the next line: one with numbers does, outside comments.
fn is_continued(line: &[u8]) -> bool {
    const OF_NUMBERS: [&[u8]; 26] = [
        b"V", b"F", b"v", b"vt", b"vn", b"vp", b"f", b"fo", b"l", b"p", b"curv", b"curv2", b"surf", b"parm",
        b"trim", b"hole", b"scrv", b"sp", b"con", b"deg", b"bmat", b"step", b"cstype", b"end", b"ctech",
        b"stech",
    ];
    let mut words = words(&line[..line.len() - 1]);
    words.next().is_some_and(|keyword| OF_NUMBERS.contains(&keyword))
        && !words.any(|word| word.starts_with(b"#"))
}

/// The vertex that a corner such as `7`, `7/1`, `7//3` or `-1/-1/-1` names, from 0.
fn corner(input: &Input<'_>, word: &[u8], vertices: usize) -> Result<u32, MeshReadError> {
    let digits = word.split(|b| *b == b'/').next().unwrap_or_default();
    let Some(number) = whole_number(digits) else {
        return Err(input.syntax(input.line(), shown(word), "the number of a vertex"));
    };
    let from_start = match number {
        1.. => Some(number - 1),
        0 => None,
        _ => (vertices as i64).checked_add(number),
    };
    // The highest number is kept free, so that one can be added.
    from_start.and_then(|v| u32::try_from(v).ok()).filter(|v| *v < u32::MAX).ok_or_else(|| {
        MeshReadError::Index {
            file: input.file(),
            place: input.line(),
            found: number,
            vertices: vertices as u64,
            first: 1,
        }
    })
}
