//! The core of cutaway: what a volume, a transfer function, a segment and a scene are, and what image they make.
//!
//! No I/O, no GPU. Data flows `Volume` → classification → segments → renderer → `Image`; see the repository's
//! `docs/ARCHITECTURE.md` for the integral that every renderer approximates.
#![forbid(unsafe_code)]

pub mod space;
pub mod volume;
