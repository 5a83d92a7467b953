//! Objects that lie in files: the one place where a path becomes a solid.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, anyhow};
use cutaway_core::clip::{ClipSource, ExternalSolid, Solid};
use cutaway_io::mesh::{MeshReadOptions, read_mesh};
use cutaway_io::patches;
use cutaway_mesh::patches::Tessellation;
use cutaway_mesh::{EventFinder, MeshSolid, RepairOptions, TriangleMesh, repair};

/// Solids by the file that they come from: each is read once, however often it is used.
pub(super) struct Solids {
    loaded: HashMap<(String, Option<u64>), Arc<dyn Solid>>,
    finder: EventFinder,
    /// What was done to make closed surfaces of files.
    pub(super) notices: Vec<String>,
}

impl Solids {
    /// None yet; meshes will find their events so.
    pub(super) fn new(finder: EventFinder) -> Self {
        Self { loaded: HashMap::new(), finder, notices: Vec::new() }
    }

    /// Reads a file, unless that was done already.
    pub(super) fn load(&mut self, external: ExternalSolid<'_>) -> anyhow::Result<Arc<dyn Solid>> {
        let (path, tolerance) = match external {
            ExternalSolid::Mesh { path } => (path, None),
            ExternalSolid::Patches { path, tolerance } => (path, tolerance),
        };
        let key = (path.to_owned(), tolerance.map(f64::to_bits));
        if let Some(solid) = self.loaded.get(&key) {
            return Ok(solid.clone());
        }
        std::fs::metadata(path).with_context(|| format!("{path}{}", super::shape::meant(path)))?;
        let mesh = match external {
            ExternalSolid::Mesh { .. } => {
                let loaded = read_mesh(Path::new(path), &MeshReadOptions::default())?;
                self.say(path, &loaded.notices);
                loaded.value
            }
            ExternalSolid::Patches { .. } => self.patches(path, tolerance)?,
        };
        let solid = self.closed(path, &mesh)?;
        self.loaded.insert(key, solid.clone());
        Ok(solid)
    }

    /// The surface of spline patches, within a tolerance of their own units.
    fn patches(&mut self, path: &str, tolerance: Option<f64>) -> anyhow::Result<TriangleMesh> {
        let set = patches::read(Path::new(path))?;
        let tolerance = tolerance.unwrap_or_else(|| set.suggested_tolerance());
        let made = set.tessellate(&Tessellation::within(tolerance)).map_err(|e| anyhow!("{path}: {e}"))?;
        self.say(path, &made.notices());
        Ok(made.mesh)
    }

    /// What clips is closed: whatever is not is mended, and it is said how.
    fn closed(&mut self, path: &str, mesh: &TriangleMesh) -> anyhow::Result<Arc<dyn Solid>> {
        let repaired = repair(mesh, &RepairOptions::default()).with_context(|| path.to_owned())?;
        self.say(path, &repaired.notices);
        Ok(Arc::new(MeshSolid::new(Arc::new(repaired.mesh.into_mesh()), self.finder)))
    }

    fn say<T: ToString>(&mut self, path: &str, notices: &[T]) {
        for notice in notices {
            let notice = notice.to_string();
            let named = if notice.contains(path) { notice } else { format!("{path}: {notice}") };
            self.notices.push(named);
        }
    }
}

/// What is in a file: spline patches or a mesh, by its content where it can be read.
pub(super) fn source_of_file(path: String) -> ClipSource {
    if patches::recognize(Path::new(&path)) {
        ClipSource::Patches { path, tolerance: None }
    } else {
        ClipSource::Mesh { path }
    }
}
