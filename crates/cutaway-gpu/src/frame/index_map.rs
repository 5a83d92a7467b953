//! The map from texels to the entries of a table.

use cutaway_core::transfer_function::ClassificationTable;

use crate::volume::Texels;

/// From texels to entries of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct IndexMap {
    pub(crate) offset: f32,
    pub(crate) scale: f32,
    pub(crate) last: u32,
}

impl IndexMap {
    /// In f64 and from the range itself: entries per stored unit alone may be more than f32 holds.
    pub(crate) fn new(table: &ClassificationTable, stored_range: [f32; 2], texels: &Texels) -> Self {
        let [lo, hi] = stored_range.map(|stored| texels.texel(f64::from(stored)));
        let last = table.entries().len() as u32 - 1;
        let scale = if hi > lo { f64::from(last) / (hi - lo) } else { 0.0 };
        Self { offset: lo as f32, scale: scale as f32, last }
    }
}
