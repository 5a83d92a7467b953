//! What the tests across crates share: scenes, and the tolerances that two renderings of one scene are held to.
#![forbid(unsafe_code)]

pub mod clips;
pub mod engines;
pub mod golden;
pub mod gpus;
pub mod missing;
pub mod random_scenes;
pub mod real;
pub mod scenes;
pub mod tetrahedra;
pub mod tolerances;
pub mod units;
