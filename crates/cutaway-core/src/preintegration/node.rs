//! A node of the table of pre-integrated steps.

/// A node of the table: an edge of the index, from above or from below. A step has a node for either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Node {
    pub(super) edge: u32,
    pub(super) upper: bool,
}
