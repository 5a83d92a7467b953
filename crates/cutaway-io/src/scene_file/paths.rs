//! Paths in scene files, which are relative to the folder of the file.

use std::path::{Path, PathBuf};

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

/// Returns the path that the scene file at `scene` holds for `path`: relative to its folder if the file is in that folder or
/// below, so that both can move together, otherwise absolute.
///
/// # Errors
/// A name that is not Unicode; a working folder that is gone.
pub fn in_scene(path: &Path, scene: &Path) -> Result<String, ScenePathError> {
    let absolute = |path: &Path| {
        std::path::absolute(path).map_err(|error| ScenePathError::Io { path: path.to_owned(), error })
    };
    let (there, scene) = (absolute(path)?, absolute(scene)?);
    let relative = scene.parent().and_then(|folder| there.strip_prefix(folder).ok());
    let relative = relative.filter(|path| !path.to_string_lossy().starts_with("sample:"));
    let text = relative.unwrap_or(&there).to_str().map(str::to_owned);
    text.ok_or_else(|| ScenePathError::NotUnicode { path: path.to_owned() })
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
    fn files_below_the_scene_are_relative_and_others_absolute() {
        let inside = in_scene(Path::new("data/meshes/bunny.ply"), Path::new("data/other.json")).unwrap();
        assert_eq!(inside, "meshes/bunny.ply");
        let absolute = std::path::absolute("data/bunny.ply").unwrap();
        let outside = in_scene(Path::new("data/bunny.ply"), Path::new("elsewhere/scene.json")).unwrap();
        assert_eq!(Path::new(&outside), absolute);
        // A file of this name would read as a sample.
        let sample = in_scene(Path::new("sample:head"), Path::new("scene.json")).unwrap();
        assert!(Path::new(&sample).is_absolute());
        assert_eq!(from_scene("meshes/a.ply", Path::new("data/scene.json")).unwrap(), "data/meshes/a.ply");
        assert_eq!(from_scene("/meshes/a.ply", Path::new("data/scene.json")).unwrap(), "/meshes/a.ply");
    }
}
