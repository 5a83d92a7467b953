//! Panels: what is at the sides of the picture. They draw and edit the document, and hold no part of it.

pub mod function;
pub mod light;
mod numbers;
