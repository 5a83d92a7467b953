//! From a file to a solid that can clip: triangle meshes and spline patches, mended where they are not closed.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use cutaway_core::clip::Solid;
use cutaway_mesh::patches::{Tessellation, TessellationError};
use cutaway_mesh::{EventFinder, MeshSolid, RepairError, RepairOptions, TriangleMesh, repair};

use crate::mesh::{MeshReadError, MeshReadOptions, MeshSpace, read_mesh};
use crate::patches::{self, PatchReadError};
use crate::scene_file::{ClipSource, ExternalSolid};

/// Why a file is no solid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolidReadError {
    /// The mesh could not be read.
    #[error(transparent)]
    Mesh(#[from] MeshReadError),
    /// The patches could not be read.
    #[error(transparent)]
    Patches(#[from] PatchReadError),
    /// The patches make no surface.
    #[error("{file}: {error}")]
    Tessellation {
        /// The path as given.
        file: String,
        /// Why not.
        error: TessellationError,
    },
    /// The surface cannot be closed.
    #[error("{file}: {error}")]
    Repair {
        /// The path as given.
        file: String,
        /// Why not.
        error: RepairError,
    },
}

/// A solid that was read from a file.
#[derive(Clone, Debug)]
pub struct LoadedSolid {
    /// Its surface.
    pub solid: Arc<dyn Solid>,
    /// What was done to make a closed surface of the file, one line each; each names the file.
    pub notices: Vec<String>,
}

/// Reads the surface in a file; what is not closed is mended, and it is said how. Lines of it will be asked for their
/// events in the way of `finder`.
pub fn read_solid(external: ExternalSolid<'_>, finder: EventFinder) -> Result<LoadedSolid, SolidReadError> {
    let path = external.path();
    let (mesh, mut notices) = match external {
        ExternalSolid::Mesh { space, .. } => {
            let options = MeshReadOptions { space, ..MeshReadOptions::default() };
            let loaded = read_mesh(Path::new(path), &options)?;
            (loaded.value, loaded.notices)
        }
        ExternalSolid::Patches { tolerance, .. } => surface_of_patches(path, tolerance)?,
    };
    let repaired = repair(&mesh, &RepairOptions::default())
        .map_err(|error| SolidReadError::Repair { file: path.to_owned(), error })?;
    notices.extend(repaired.notices.iter().map(ToString::to_string));
    let notices = notices
        .into_iter()
        .map(|notice| if notice.contains(path) { notice } else { format!("{path}: {notice}") });
    let solid = Arc::new(MeshSolid::new(Arc::new(repaired.mesh.into_mesh()), finder));
    Ok(LoadedSolid { solid, notices: notices.collect() })
}

/// The surface of spline patches, within a tolerance of their own units.
fn surface_of_patches(
    path: &str,
    tolerance: Option<f64>,
) -> Result<(TriangleMesh, Vec<String>), SolidReadError> {
    let set = patches::read(Path::new(path))?;
    let tolerance = tolerance.unwrap_or_else(|| set.suggested_tolerance());
    let made = set
        .tessellate(&Tessellation::within(tolerance))
        .map_err(|error| SolidReadError::Tessellation { file: path.to_owned(), error })?;
    let notices = made.notices().iter().map(ToString::to_string).collect();
    Ok((made.mesh, notices))
}

/// What is in a file: spline patches or a mesh, by its content where it can be read.
pub fn source_of_file(path: String) -> ClipSource {
    if patches::recognize(Path::new(&path)) {
        ClipSource::Patches { path, tolerance: None }
    } else {
        ClipSource::Mesh { path, space: MeshSpace::File }
    }
}

/// Solids by the file that they come from: each is read once, however often it is used.
#[derive(Clone, Debug, Default)]
pub struct SolidCache {
    loaded: HashMap<Key, Arc<dyn Solid>>,
}

impl SolidCache {
    /// What was kept for a file.
    pub fn get(&self, external: ExternalSolid<'_>) -> Option<Arc<dyn Solid>> {
        self.loaded.get(&key(external)).cloned()
    }

    /// How many are kept.
    pub fn len(&self) -> usize {
        self.loaded.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.loaded.is_empty()
    }

    /// Keeps what was read from a file.
    pub fn insert(&mut self, external: ExternalSolid<'_>, solid: Arc<dyn Solid>) {
        self.loaded.insert(key(external), solid);
    }
}

/// A path, a tolerance in bits, and axes: the same patches within another tolerance are another solid, and so is the same
/// mesh along other axes.
type Key = (String, Option<u64>, MeshSpace);

fn key(external: ExternalSolid<'_>) -> Key {
    let path = external.path().to_owned();
    match external {
        ExternalSolid::Patches { tolerance, .. } => (path, tolerance.map(f64::to_bits), MeshSpace::File),
        ExternalSolid::Mesh { space, .. } => (path, None, space),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

    #[test]
    fn a_mesh_becomes_a_solid_and_what_was_mended_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("open.obj");
        // Without its last face it is open.
        std::fs::write(&path, TETRAHEDRON.trim_end().rsplit_once('\n').unwrap().0).unwrap();
        let path = path.to_str().unwrap();
        let source = source_of_file(path.to_owned());
        assert_eq!(source, ClipSource::Mesh { path: path.to_owned(), space: MeshSpace::File });
        let loaded = read_solid(source.external().unwrap(), EventFinder::default()).unwrap();
        assert_eq!(loaded.solid.bounds()[1], cutaway_core::glam::DVec3::ONE);
        assert!(!loaded.notices.is_empty());
        assert!(loaded.notices.iter().all(|notice| notice.contains(path)), "{:?}", loaded.notices);
    }

    #[test]
    fn what_is_wrong_names_the_file() {
        let missing = ExternalSolid::Mesh { path: "no-such.ply", space: MeshSpace::File };
        let error = read_solid(missing, EventFinder::default()).unwrap_err().to_string();
        assert!(error.contains("no-such.ply"), "{error}");
        let missing = ExternalSolid::Patches { path: "no-such.json", tolerance: None };
        let error = read_solid(missing, EventFinder::default()).unwrap_err().to_string();
        assert!(error.contains("no-such.json"), "{error}");
    }

    #[test]
    fn another_tolerance_is_another_solid() {
        let ball = cutaway_core::clip::Sphere::new(cutaway_core::glam::DVec3::ZERO, 1.0).unwrap();
        let fine = ExternalSolid::Patches { path: "a", tolerance: Some(0.1) };
        let mut cache = SolidCache::default();
        cache.insert(fine, Arc::new(ball));
        assert!(cache.get(fine).is_some());
        assert!(cache.get(ExternalSolid::Patches { path: "a", tolerance: None }).is_none());
    }
}
