//! How cells are drawn.

/// How a cell of a grid is cut into tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Split {
    /// Five, mirrored from cell to cell so that faces match.
    #[default]
    Five,
    /// Six around a diagonal, alike in every cell.
    Six,
}

impl Split {
    /// Tetrahedra of a cell.
    pub fn count(self) -> u32 {
        match self {
            Self::Five => 5,
            Self::Six => 6,
        }
    }
}

/// What a fragment makes of the stretch of its ray in a tetrahedron.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CellIntegral {
    /// Colour and extinction of the mean value.
    Average,
    /// Partial pre-integration (Moreland and Angel): colour and extinction linear between those at the ends.
    Partial,
    /// Cut where the transfer function bends, then integrated.
    #[default]
    Exact,
}

/// Who fills the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CellDrawing {
    /// [`Tiles`](Self::Tiles) on software adapters, and where cells reach behind the eye; else
    /// [`Triangles`](Self::Triangles).
    #[default]
    Auto,
    /// The rasteriser: a fan of triangles a tetrahedron, blended.
    Triangles,
    /// Compute shaders: lists of tetrahedra a tile, composited from front to back. Where that is not made (lit scenes, cut
    /// ones, integrals that are not exact) triangles are drawn.
    Tiles,
}

/// How cells are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct CellOptions {
    /// How a cell of a grid is cut.
    pub split: Split,
    /// What a fragment makes of a stretch.
    pub integral: CellIntegral,
    /// Whether e^-u comes from a table, for all but [`CellIntegral::Exact`].
    pub exponential_table: bool,
    /// Who fills the pixels.
    pub drawing: CellDrawing,
    /// Whether setting up and drawing are timed apart, which waits between them.
    pub timed: bool,
}
