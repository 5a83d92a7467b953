//! Numbers that the host and the shaders hold; a test keeps them equal.

/// Pixels along a side of a tile, as `TILE` in `record.wgsl`.
pub(crate) const TILE: u32 = 8;

/// Texels of a record, as `TEXELS` there.
pub(crate) const TEXELS: u64 = 6;

/// Texels of a row of records and lists, as `ROW_BITS` there.
pub(crate) const ROW: u32 = 1 << 12;

/// Entries of a list that are drawn at once, as in `composite.wgsl`.
pub(crate) const WINDOW: u32 = 2048;

/// Parts of the list of tiles are 2 to this power, as in `composite.wgsl`.
pub(crate) const LIST_PARTS: u32 = 5;

/// Runs of a workgroup, a thread each, as in `bin.wgsl`, `mesh.wgsl` and `grid.wgsl`: few, for there are few runs, and every core
/// is to have some.
pub(crate) const RUNS_OF_GROUP: u32 = 16;

/// Bins of a volume's range, as in `pieces.wgsl`.
pub(crate) const BINS: u32 = 1024;

/// Along each side of the psi table, as in `integral.wgsl`.
pub(crate) const PSI_SIDE: usize = 128;

/// Entries of the exponential table, as in `integral.wgsl`.
pub(crate) const EXPONENTIALS: usize = 256;

/// Cells along an edge of a block, as in `select.wgsl`.
pub(crate) const EDGE: u32 = 8;

/// Words before the places of blocks in the work buffer, as in `select.wgsl`.
pub(crate) const OFFSETS: u64 = 32;
