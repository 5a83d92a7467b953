//! What the tests across crates share: scenes, and the tolerances that two renderings of one scene are held to.
#![forbid(unsafe_code)]

pub mod engines;
pub mod golden;
pub mod gpus;
pub mod real;
pub mod scenes;
pub mod tolerances;
