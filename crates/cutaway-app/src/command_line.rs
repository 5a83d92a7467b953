//! The command that renders the same picture.

use std::path::Path;

use crate::document::{Document, scene_file};

/// The command line that renders what is open, as it would be typed into a shell: of a scene file, where there is one that
/// has all of it, else of the scene itself, which the shell hands over.
///
/// # Errors
/// A path that a scene file cannot hold.
pub fn command_line(document: &Document) -> Result<String, String> {
    if let (Some(path), false) = (&document.path, document.is_changed()) {
        return Ok(format!("cutaway render --scene {} -o picture.png", quoted(&path.to_string_lossy())));
    }
    let input = Path::new("/dev/stdin");
    let scene = scene_file::file_of(document, input)?;
    let scene = serde_json::to_string(&scene).map_err(|e| e.to_string())?;
    // A line of its own ends the scene: JSON on one line has no such line in it.
    Ok(format!("cutaway render --scene {} -o picture.png <<'SCENE'\n{scene}\nSCENE", input.display()))
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_quoted_where_a_shell_needs_it() {
        assert_eq!(quoted("/a/b-c.json"), "/a/b-c.json");
        assert_eq!(quoted("my head's.json"), r"'my head'\''s.json'");
    }
}
