//! The surfaces of files, each read once.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use cutaway_core::clip::{Clip, ClipFile, ClipSource, ExternalSolid, Node, Solid};
use cutaway_io::mesh::{MeshReadOptions, read_mesh};
use cutaway_io::patches;
use cutaway_mesh::patches::Tessellation;
use cutaway_mesh::{EventFinder, MeshSolid, RepairOptions, repair};

/// A solid that was read from a file.
#[derive(Clone, Debug)]
pub struct LoadedSolid {
    /// Its surface.
    pub solid: Arc<dyn Solid>,
    /// What was done to make a closed surface of the file, one line each.
    pub notices: Vec<String>,
}

/// Solids by the path that names them.
#[derive(Clone, Debug, Default)]
pub struct Solids {
    loaded: HashMap<String, Arc<dyn Solid>>,
}

impl Solids {
    /// Reads the surface that a source names; none where it names no file.
    ///
    /// # Errors
    /// One line: the file, and what is wrong with it.
    pub fn read(source: &ClipSource) -> Result<Option<LoadedSolid>, String> {
        let (path, mesh, mut notices) = match source {
            ClipSource::Mesh { path } => {
                let loaded = read_mesh(Path::new(path), &MeshReadOptions::default());
                let loaded = loaded.map_err(|e| e.to_string())?;
                (path, loaded.value, loaded.notices)
            }
            ClipSource::Patches { path, tolerance } => {
                let set = patches::read(Path::new(path)).map_err(|e| e.to_string())?;
                let within = Tessellation::within(tolerance.unwrap_or_else(|| set.suggested_tolerance()));
                let made = set.tessellate(&within).map_err(|e| format!("{path}: {e}"))?;
                let notices = made.notices().iter().map(ToString::to_string).collect();
                (path, made.mesh, notices)
            }
            _ => return Ok(None),
        };
        let repaired = repair(&mesh, &RepairOptions::default()).map_err(|e| format!("{path}: {e}"))?;
        notices.extend(repaired.notices.iter().map(ToString::to_string));
        let solid = MeshSolid::new(Arc::new(repaired.mesh.into_mesh()), EventFinder::default());
        Ok(Some(LoadedSolid { solid: Arc::new(solid), notices }))
    }

    /// Keeps a solid for the path that a source names.
    pub fn insert(&mut self, source: &ClipSource, solid: Arc<dyn Solid>) {
        if let Some(path) = path_of(source) {
            self.loaded.insert(path.to_owned(), solid);
        }
    }

    /// The solid of a source; none where its file was not read yet.
    pub fn get(&self, source: &ClipSource) -> Option<Arc<dyn Solid>> {
        let shape = source.solid(&mut |external: ExternalSolid<'_>| {
            let path = match external {
                ExternalSolid::Mesh { path } | ExternalSolid::Patches { path, .. } => path,
            };
            self.loaded.get(path).cloned().ok_or(())
        });
        shape.ok()
    }

    /// A tree with solids in it; what has none is a union of nothing.
    pub fn resolve(&self, clip: &ClipFile) -> Clip {
        let present = self.present(clip);
        let resolved = present.resolve(&mut |external: ExternalSolid<'_>| {
            let path = match external {
                ExternalSolid::Mesh { path } | ExternalSolid::Patches { path, .. } => path,
            };
            self.loaded.get(path).cloned().ok_or(())
        });
        resolved.unwrap_or_else(|()| Clip::everything())
    }

    /// The tree without leaves whose file was not read.
    fn present(&self, clip: &ClipFile) -> ClipFile {
        let all = |parts: &[ClipFile]| parts.iter().map(|part| self.present(part)).collect();
        let node = match &clip.node {
            Node::Everything => Node::Everything,
            Node::Leaf(source) if self.get(source).is_none() => Node::Union(Vec::new()),
            Node::Leaf(source) => Node::Leaf(source.clone()),
            Node::Union(parts) => Node::Union(all(parts)),
            Node::Intersection(parts) => Node::Intersection(all(parts)),
            Node::Difference(parts) => Node::Difference(all(parts)),
            Node::Complement(part) => Node::Complement(Box::new(self.present(part))),
        };
        ClipFile { pose: clip.pose, node }
    }
}

/// The path that a source names.
pub fn path_of(source: &ClipSource) -> Option<&str> {
    match source {
        ClipSource::Mesh { path } | ClipSource::Patches { path, .. } => Some(path),
        _ => None,
    }
}
