//! Paths in scene files, which are relative to the folder of the file.

use std::path::{Component, Path, PathBuf};

use super::ClipTree;

/// A path that a scene file cannot hold, or that cannot be followed from here.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScenePathError {
    /// JSON holds text, and the name is not text.
    #[error("{}: a scene file cannot hold a name that is not Unicode; rename the file", path.display())]
    NotUnicode {
        /// The file.
        path: PathBuf,
    },
    /// The folder of the scene file has a name that is not text.
    #[error(
        "{}: the folder's name is not Unicode, so `{named}` cannot be named from here; rename the folder",
        scene.display()
    )]
    Folder {
        /// The scene file.
        scene: PathBuf,
        /// The path that it holds.
        named: String,
    },
    /// The working folder is gone.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
}

/// Returns the path that the scene file at `scene` holds for `path`: relative to its folder, with `/` between its parts, so that
/// a folder that holds both can move. Absolute if nothing but the root of the file system holds both (another drive).
///
/// # Errors
/// A name that is not Unicode; a working folder that is gone.
pub fn in_scene(path: &Path, scene: &Path) -> Result<String, ScenePathError> {
    let resolved = |path: &Path| {
        let found = std::path::absolute(path).and_then(|there| resolved_folder(&there));
        found.map_err(|error| ScenePathError::Io { path: path.to_owned(), error })
    };
    let (there, scene) = (resolved(path)?, resolved(scene)?);
    let relative = scene.parent().and_then(|folder| relative(&there, folder));
    let relative = relative.filter(|path| !path.starts_with("sample:"));
    let absolute = std::path::absolute(path).unwrap_or(there);
    let text = relative.or_else(|| absolute.to_str().map(str::to_owned));
    text.ok_or_else(|| ScenePathError::NotUnicode { path: path.to_owned() })
}

/// An absolute path whose folder is free of links and of `..`, as far as the folder exists: `..` in a path that is written
/// leads to where the system would go.
fn resolved_folder(path: &Path) -> std::io::Result<PathBuf> {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return Ok(path.to_owned()) };
    match folder.canonicalize() {
        Ok(folder) => Ok(folder.join(name)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(path.to_owned()),
        Err(error) => Err(error),
    }
}

/// The way from a folder to a file: up to the last folder that holds both, then down. None if that is the root of the file
/// system, or a part of the way is not Unicode. Both are absolute.
fn relative(file: &Path, folder: &Path) -> Option<String> {
    let (to, from): (Vec<_>, Vec<_>) = (file.components().collect(), folder.components().collect());
    let shared = to.iter().zip(&from).take_while(|(a, b)| a == b).count();
    let is_folder = |part: &Component<'_>| matches!(part, Component::Normal(_));
    if shared < from.len() && !to[..shared].iter().any(is_folder) {
        return None;
    }
    let up = from[shared..].iter().map(|_| Some(".."));
    let down = to[shared..].iter().map(|part| part.as_os_str().to_str());
    let parts: Option<Vec<&str>> = up.chain(down).collect();
    Some(parts?.join("/"))
}

/// Returns the path from here to what the scene file at `scene` calls `named`.
///
/// # Errors
/// A folder whose name is not Unicode.
pub fn from_scene(named: &str, scene: &Path) -> Result<String, ScenePathError> {
    let here = scene.parent().unwrap_or(Path::new("")).join(named).into_os_string().into_string();
    here.map_err(|_| ScenePathError::Folder { scene: scene.to_owned(), named: named.to_owned() })
}

/// Changes every path in a clip tree; stops at the first that cannot be changed.
///
/// # Errors
/// The first error of `change`.
pub fn map_paths<E>(tree: &mut ClipTree, change: &mut dyn FnMut(&str) -> Result<String, E>) -> Result<(), E> {
    let mut result = Ok(());
    tree.visit_leaves(&mut |source, _| {
        if let (Some(path), true) = (source.path_mut(), result.is_ok()) {
            match change(path) {
                Ok(changed) => *path = changed,
                Err(error) => result = Err(error),
            }
        }
    });
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn report_51_paths_are_relative_to_the_scene() {
        let root = tempfile::tempdir().unwrap();
        for folder in ["data/meshes", "scenes"] {
            std::fs::create_dir_all(root.path().join(folder)).unwrap();
        }
        let named =
            |path: &str, scene: &str| in_scene(&root.path().join(path), &root.path().join(scene)).unwrap();
        assert_eq!(named("data/meshes/bunny.ply", "data/other.json"), "meshes/bunny.ply");
        assert_eq!(named("data/ball.nrrd", "scenes/s.json"), "../data/ball.nrrd");
        assert_eq!(named("ball.nrrd", "data/meshes/s.json"), "../../ball.nrrd");
        assert_eq!(named("scenes/../data/ball.nrrd", "data/../scenes/s.json"), "../data/ball.nrrd");
        assert_eq!(named("data/ball.nrrd", "data/s.json"), "ball.nrrd");
        // A file of this name would read as a sample.
        assert!(Path::new(&named("sample:head", "scene.json")).is_absolute());
    }

    #[test]
    fn report_51_without_a_common_folder_paths_are_absolute() {
        assert_eq!(relative(Path::new("/mnt/a.nrrd"), Path::new("/home/me")), None);
        assert_eq!(relative(Path::new("/home/a.nrrd"), Path::new("/home/me")).as_deref(), Some("../a.nrrd"));
        // The scene file itself is in the root.
        assert_eq!(relative(Path::new("/mnt/a.nrrd"), Path::new("/")).as_deref(), Some("mnt/a.nrrd"));
    }

    #[cfg(unix)]
    #[test]
    fn folders_behind_links_are_named_by_where_they_are() {
        let root = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(root.path().join("far/away/scenes")).unwrap();
        std::os::unix::fs::symlink(root.path().join("far/away/scenes"), root.path().join("scenes")).unwrap();
        let (volume, scene) = (root.path().join("ball.nrrd"), root.path().join("scenes/s.json"));
        std::fs::write(&volume, "").unwrap();
        let named = in_scene(&volume, &scene).unwrap();
        assert_eq!(named, "../../../ball.nrrd");
        assert!(root.path().join("far/away/scenes").join(named).exists());
    }

    #[test]
    fn paths_of_scenes_begin_at_their_folder() {
        assert_eq!(from_scene("meshes/a.ply", Path::new("data/scene.json")).unwrap(), "data/meshes/a.ply");
        assert_eq!(from_scene("/meshes/a.ply", Path::new("data/scene.json")).unwrap(), "/meshes/a.ply");
    }
}
