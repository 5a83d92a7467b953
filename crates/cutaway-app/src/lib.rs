//! The viewer: see a volume, cut it open, move the cut.
//!
//! | module | what it is |
//! |---|---|
//! | [`document`] | what is open: volume, state, undo; no drawing |
//! | [`cutting`] | the list of cuts within the state |
//! | [`function`] | edits of a transfer function; no drawing |
//! | [`handles`] | what is dragged in the picture: gizmo, crop box, rectangle |
//! | [`render`] | pictures of the state, made in a thread of their own |
//! | [`picture`] | the picture in the window, the camera, what lies over both |
//! | [`slices`] | slices beside it, values under the pointer |
//! | [`panels`] | the controls beside it |
//! | [`app`] | the window |
//!
//! Data flow: panels and the picture edit the [`document::Document`]; its state goes to [`render`] as a request whenever it
//! differs from the last; images come back and are shown. Nothing that is drawn is kept anywhere else. Whatever needs
//! files, dialogs or threads is a [`command::Command`].
#![forbid(unsafe_code)]

pub mod app;
pub mod command;
pub mod command_line;
pub mod cutting;
pub mod document;
pub mod film;
pub mod function;
pub mod handles;
pub mod panels;
pub mod picture;
pub mod render;
pub mod slices;
#[cfg(test)]
mod testing;
mod window;
mod words;

pub use app::{App, Start};
pub use window::{WindowError, run};
