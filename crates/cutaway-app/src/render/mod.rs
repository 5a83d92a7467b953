//! Pictures, made in threads.

pub mod thumbnails;
