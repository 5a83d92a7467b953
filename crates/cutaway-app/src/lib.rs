//! The viewer: see a volume, cut it open, move the cut.
//!
//! | module | what it is |
//! |---|---|
//! | [`document`] | what is open: volume, state, undo; no drawing |
//! | [`cutting`] | the list of cuts within the state |
//! | [`command`] | what panels ask of the window |
//!
//! Data flow: panels and the picture edit the [`document::Document`]; its state goes to the render thread as a request
//! whenever it differs from the last; images come back and are shown. Nothing that is drawn is kept anywhere else.
#![forbid(unsafe_code)]

pub mod command;
pub mod cutting;
pub mod document;
