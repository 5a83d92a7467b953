//! Objects that lie in files: the one place where a path becomes a solid.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail};
use cutaway_core::clip::{ClipSource, ExternalSolid, Solid};

/// Solids by the file that they come from: each is read once, however often it is used.
#[derive(Default)]
pub(super) struct Solids {
    loaded: HashMap<(String, Option<u64>), Arc<dyn Solid>>,
}

impl Solids {
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
        let solid = read(external)?;
        self.loaded.insert(key, solid.clone());
        Ok(solid)
    }
}

/// What the name of a file says of what is in it: patches are text, meshes have formats of their own.
pub(super) fn source_of_file(path: String) -> ClipSource {
    let extension = Path::new(&path).extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("txt" | "json") => ClipSource::Patches { path, tolerance: None },
        _ => ClipSource::Mesh { path },
    }
}

fn read(external: ExternalSolid<'_>) -> anyhow::Result<Arc<dyn Solid>> {
    let (path, what) = match external {
        ExternalSolid::Mesh { path } => (path, "meshes"),
        ExternalSolid::Patches { path, .. } => (path, "spline patches"),
    };
    std::fs::metadata(path).with_context(|| format!("{path}{}", super::shape::meant(path)))?;
    bail!("{path}: {what} do not exist in this version of cutaway; clip with sphere:, box: and plane:")
}
