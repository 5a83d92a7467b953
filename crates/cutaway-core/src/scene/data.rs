//! The data that a layer shows: a volume or an unstructured grid, shared and never copied.

use std::sync::Arc;

use crate::tetrahedra::TetrahedralMesh;
use crate::volume::Volume;

/// Data of a layer. Cloning shares the voxels.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Data {
    /// Voxels on a regular grid.
    Volume(Arc<Volume>),
    /// Tetrahedra between points. Only the cells engine renders them.
    Grid(Arc<TetrahedralMesh>),
}

impl Data {
    /// Returns the regular grid that places the data in the world and holds its values: the volume, or a grid over the box
    /// of an unstructured grid (see [`TetrahedralMesh::lattice`]).
    pub fn lattice(&self) -> &Volume {
        match self {
            Self::Volume(volume) => volume,
            Self::Grid(grid) => grid.lattice(),
        }
    }

    /// Returns the volume; none for an unstructured grid.
    pub fn volume(&self) -> Option<&Arc<Volume>> {
        match self {
            Self::Volume(volume) => Some(volume),
            Self::Grid(_) => None,
        }
    }

    /// Returns the unstructured grid; none for a volume.
    pub fn grid(&self) -> Option<&Arc<TetrahedralMesh>> {
        match self {
            Self::Volume(_) => None,
            Self::Grid(grid) => Some(grid),
        }
    }

    /// Returns true if both are the same data in memory, so that what was prepared for one serves the other.
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Volume(a), Self::Volume(b)) => Arc::ptr_eq(a, b),
            (Self::Grid(a), Self::Grid(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// Returns the name of the kind of data, for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Volume(_) => "volume",
            Self::Grid(_) => "unstructured grid",
        }
    }
}

impl From<Volume> for Data {
    fn from(volume: Volume) -> Self {
        Self::Volume(Arc::new(volume))
    }
}

impl From<Arc<Volume>> for Data {
    fn from(volume: Arc<Volume>) -> Self {
        Self::Volume(volume)
    }
}

impl From<&Arc<Volume>> for Data {
    fn from(volume: &Arc<Volume>) -> Self {
        Self::Volume(volume.clone())
    }
}

impl From<TetrahedralMesh> for Data {
    fn from(grid: TetrahedralMesh) -> Self {
        Self::Grid(Arc::new(grid))
    }
}

impl From<Arc<TetrahedralMesh>> for Data {
    fn from(grid: Arc<TetrahedralMesh>) -> Self {
        Self::Grid(grid)
    }
}

impl From<&Self> for Data {
    fn from(data: &Self) -> Self {
        data.clone()
    }
}
