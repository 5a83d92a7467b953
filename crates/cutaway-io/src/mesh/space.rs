//! The axes that a mesh file's coordinates are along, where the file says so.
//!
//! 3D Slicer writes meshes in LPS (x to the left, y to the back) and says `SPACE=LPS` in the header: in the 80 bytes or in the
//! name of the solid of STL, in a comment at the top of OBJ, in a `comment` line of PLY. Volumes are in RAS here (x to the
//! right, y to the front), and so are meshes: <https://www.slicer.org/wiki/Coordinate_systems>.

use std::path::Path;

use cutaway_mesh::TriangleMesh;

use super::format::{MeshFormat, examine};
use super::input::{shown, words};
use super::stl;
use crate::text;

/// The anatomical axes that the coordinates of a mesh file are along.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MeshSpace {
    /// The axes that the file names; coordinates of a file that names none are used unchanged.
    #[default]
    File,
    /// Right, anterior, superior, whatever the file says: coordinates are used unchanged.
    Ras,
    /// Left, posterior, superior, whatever the file says: x and y change their signs.
    Lps,
}

impl MeshSpace {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Lps, Self::Ras, Self::File];

    /// The name at the command line and in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::File => "file",
            Self::Ras => "ras",
            Self::Lps => "lps",
        }
    }

    /// Returns the space of that name, in lower case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|space| space.name() == name)
    }
}

/// What a file says of its axes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Stated {
    Nothing,
    Ras,
    Lps,
    /// Something else: as messages show it.
    Other(String),
}

/// Finds what a file of this format says in its first bytes.
pub(super) fn stated(format: MeshFormat, head: &[u8]) -> Stated {
    let lines = || text::lines(head);
    let of_comment = |line: &&[u8]| matches!(words(line).next(), Some(b"comment" | b"obj_info"));
    let found = match format {
        MeshFormat::Stl if stl::is_text(head) => {
            lines().find(|line| !line.trim_ascii().is_empty()).and_then(space_in)
        }
        MeshFormat::Stl => head.get(..80).and_then(space_in),
        MeshFormat::Obj => {
            let is_top =
                |line: &&[u8]| line.trim_ascii().is_empty() || line.trim_ascii_start().starts_with(b"#");
            lines().take_while(is_top).find_map(space_in)
        }
        MeshFormat::Ply => {
            let header = lines().take_while(|line| line.trim_ascii() != b"end_header");
            header.filter(of_comment).find_map(space_in)
        }
        MeshFormat::Gltf => None,
    };
    match found.map(<[u8]>::to_ascii_lowercase).as_deref() {
        None => Stated::Nothing,
        Some(b"ras" | b"right-anterior-superior") => Stated::Ras,
        Some(b"lps" | b"left-posterior-superior") => Stated::Lps,
        Some(other) => Stated::Other(shown(other)),
    }
}

/// The word after `SPACE=` in a line, in any case.
fn space_in(line: &[u8]) -> Option<&[u8]> {
    const KEY: &[u8] = b"space";
    let is_word = |b: &u8| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'_');
    (0..line.len().saturating_sub(KEY.len())).find_map(|start| {
        let (before, rest) = line.split_at(start);
        let starts = rest[..KEY.len()].eq_ignore_ascii_case(KEY) && !before.last().is_some_and(is_word);
        let value = rest[KEY.len()..].trim_ascii_start().strip_prefix(b"=")?.trim_ascii_start();
        let length = value.iter().take_while(|b| is_word(b)).count();
        (starts && length > 0).then(|| &value[..length])
    })
}

/// Brings a mesh into RAS, and explains what was done.
pub(super) fn into_ras(
    mesh: TriangleMesh,
    file: &str,
    stated: &Stated,
    space: MeshSpace,
) -> (TriangleMesh, Option<String>) {
    match (space, stated) {
        (MeshSpace::File, Stated::Lps) => {
            let notice = format!("{file} says SPACE=LPS: converted to RAS (x and y changed their signs)");
            (mesh.turned_around_z(), Some(notice))
        }
        (MeshSpace::File, Stated::Other(other)) => {
            let notice = format!(
                "{file} says SPACE={other}, which is neither RAS nor LPS: used its coordinates unchanged"
            );
            (mesh, Some(notice))
        }
        (MeshSpace::File, Stated::Ras | Stated::Nothing) => (mesh, None),
        (MeshSpace::Lps, stated) => {
            let notice = (*stated == Stated::Ras).then(|| {
                format!(
                    "{file} says SPACE=RAS: converted from LPS nevertheless, as the mesh space is set to lps"
                )
            });
            (mesh.turned_around_z(), notice)
        }
        (MeshSpace::Ras, stated) => {
            let notice = (*stated == Stated::Lps)
                .then(|| format!("{file} says SPACE=LPS: used unchanged, as the mesh space is set to ras"));
            (mesh, notice)
        }
    }
}

/// True if the file at `path` says that its coordinates are along RAS or LPS axes.
pub fn states_its_space(path: &Path) -> bool {
    let stated = examine(path).map(|(format, head)| stated(format, &head));
    matches!(stated, Ok(Stated::Ras | Stated::Lps))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_word_after_the_key_counts() {
        let found =
            |line: &'static str| space_in(line.as_bytes()).map(|word| std::str::from_utf8(word).unwrap());
        assert_eq!(found("3D Slicer output. SPACE=LPS"), Some("LPS"));
        assert_eq!(found("# space = ras, units mm"), Some("ras"));
        assert_eq!(found("SPACE=left-posterior-superior;"), Some("left-posterior-superior"));
        assert_eq!(found("in space, SPACE=LPS"), Some("LPS"));
        for none in ["COLORSPACE=LPS", "SPACE", "SPACE=", "SPACE = ", "SPACER=LPS", "", "space"] {
            assert_eq!(found(none), None, "{none}");
        }
    }

    #[test]
    fn only_headers_count() {
        let stated = |format, head: &str| stated(format, head.as_bytes());
        assert_eq!(stated(MeshFormat::Obj, "\n# a\n# SPACE=LPS\nv 0 0 0\n"), Stated::Lps);
        assert_eq!(stated(MeshFormat::Obj, "v 0 0 0\n# SPACE=LPS\n"), Stated::Nothing);
        assert_eq!(stated(MeshFormat::Ply, "ply\r\ncomment SPACE=RAS\r\nend_header\r\n"), Stated::Ras);
        assert_eq!(
            stated(MeshFormat::Ply, "ply\nelement SPACE=RAS\nend_header\ncomment SPACE=LPS\n"),
            Stated::Nothing
        );
        assert_eq!(stated(MeshFormat::Stl, "solid part SPACE=LPS\nfacet"), Stated::Lps);
        assert_eq!(stated(MeshFormat::Stl, "solid part\nfacet SPACE=LPS"), Stated::Nothing);
        assert_eq!(stated(MeshFormat::Obj, "# SPACE=LAS"), Stated::Other("\"las\"".to_owned()));
    }
}
