//! The surfaces of files, each read once.

use std::sync::Arc;

use cutaway_core::clip::{Clip, Node, Solid};
use cutaway_io::scene_file::{self, ClipSource, ClipTree, ExternalSolid};
pub use cutaway_io::solids::LoadedSolid;
use cutaway_io::solids::{SolidCache, read_solid};
use cutaway_mesh::EventFinder;

/// Solids by the path that names them.
#[derive(Clone, Debug, Default)]
pub struct Solids {
    cache: SolidCache,
}

impl Solids {
    /// Reads the surface that a source names; none where it names no file.
    ///
    /// # Errors
    /// One line: the file, and what is wrong with it.
    pub fn read(source: &ClipSource) -> Result<Option<LoadedSolid>, String> {
        let read = |external| read_solid(external, EventFinder::default()).map_err(|e| e.to_string());
        source.external().map(read).transpose()
    }

    /// Keeps a solid for the path that a source names.
    pub fn insert(&mut self, source: &ClipSource, solid: Arc<dyn Solid>) {
        if let Some(external) = source.external() {
            self.cache.insert(external, solid);
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.cache.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.cache.is_empty()
    }

    /// The solid of a source; none where its file was not read yet.
    pub fn get(&self, source: &ClipSource) -> Option<Arc<dyn Solid>> {
        source.solid(&mut |external| self.cached(external)).ok()
    }

    /// A tree with solids in it; what has none is a union of nothing.
    pub fn resolve(&self, clip: &ClipTree) -> Clip {
        let resolved = scene_file::resolve(&self.present(clip), &mut |external| self.cached(external));
        resolved.unwrap_or_else(|()| Clip::everything())
    }

    fn cached(&self, external: ExternalSolid<'_>) -> Result<Arc<dyn Solid>, ()> {
        self.cache.get(external).ok_or(())
    }

    /// The tree without leaves whose file was not read.
    fn present(&self, clip: &ClipTree) -> ClipTree {
        let all = |parts: &[ClipTree]| parts.iter().map(|part| self.present(part)).collect();
        let node = match &clip.node {
            Node::Everything => Node::Everything,
            Node::Leaf(source) if self.get(source).is_none() => Node::Union(Vec::new()),
            Node::Leaf(source) => Node::Leaf(source.clone()),
            Node::Union(parts) => Node::Union(all(parts)),
            Node::Intersection(parts) => Node::Intersection(all(parts)),
            Node::Difference(parts) => Node::Difference(all(parts)),
            Node::Complement(part) => Node::Complement(Box::new(self.present(part))),
        };
        ClipTree { pose: clip.pose, node }
    }
}
