//! Objects that lie in files, as the command line names them.

use std::io::ErrorKind;
use std::sync::Arc;

use anyhow::bail;
use cutaway_core::clip::Solid;
use cutaway_io::scene_file::ExternalSolid;
use cutaway_io::solids::{SolidCache, read_solid};
use cutaway_mesh::EventFinder;

/// Solids by the file that they come from: each is read once, however often it is used.
pub(super) struct Solids {
    cache: SolidCache,
    finder: EventFinder,
    /// What was done to make closed surfaces of files.
    pub(super) notices: Vec<String>,
}

impl Solids {
    /// None yet; meshes will find their events so.
    pub(super) fn new(finder: EventFinder) -> Self {
        Self { cache: SolidCache::default(), finder, notices: Vec::new() }
    }

    /// Reads a file, unless that was done already.
    pub(super) fn load(&mut self, external: ExternalSolid<'_>) -> anyhow::Result<Arc<dyn Solid>> {
        if let Some(solid) = self.cache.get(external) {
            return Ok(solid);
        }
        let path = external.path();
        if std::fs::symlink_metadata(path).is_err_and(|error| error.kind() == ErrorKind::NotFound) {
            bail!("cannot open {path}: no such file{}", super::shape::meant(path));
        }
        let loaded = read_solid(external, self.finder)?;
        self.notices.extend(loaded.notices);
        self.cache.insert(external, loaded.solid.clone());
        Ok(loaded.solid)
    }
}
