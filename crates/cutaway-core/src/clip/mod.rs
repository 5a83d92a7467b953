//! Clipping: which part of a volume is kept, as a tree of solids, and the segments that it leaves of a ray.
//!
//! A solid tells where the *line* of a ray crosses its surface, as [`Event`]s.

mod event;

pub use event::{Crossing, Event, Solid};
