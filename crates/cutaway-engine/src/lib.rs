//! The engines of cutaway behind one door.
//!
//! Input: a [`Scene`](cutaway_core::scene::Scene). Output: [`Frame`]s. A [`Renderer`] chooses the engine, starts it, makes
//! data and transfer functions ready when their keys change, and renders whole frames or refines them from coarse to fine.
//!
//! ```text
//!   Scene ─► Renderer ─► Slot<E> ─► Engine::prepare    once per data          (PrepareKey)
//!            choice,        │        Engine::classify   once per function      (ClassifyKey)
//!            fallback       └──────► Engine::render     once per frame ─► Frame
//! ```
//!
//! | module | holds |
//! |---|---|
//! | [`engine`](Engine) | the trait, and [`Slot`], which keeps what an engine has ready |
//! | [`engines`] | the engines, one file each, and the one list of them |
//! | [`Abilities`] | what an engine can do; refusals and notices follow from it |
//! | [`Renderer`] | the choice of the engine, the fallback to the CPU, frames |
//!
//! Lifetimes: a renderer keeps one engine at a time, and an engine one volume at a time. A frame borrows nothing.
#![forbid(unsafe_code)]

mod abilities;
mod clock;
mod engine;
pub mod engines;
mod error;
mod frame;
mod key;
mod notice;
mod refine;
mod renderer;
mod request;
mod setting;

pub use abilities::{ALL_MODES, Abilities, COMPOSITE};
pub use engine::{AnyEngine, Engine, HandOver, Ready, ReadyTimes, Slot};
pub use engines::{ENGINES, Entry, Start};
pub use error::EngineError;
pub use frame::{About, Frame, FrameStatistics, Machine, Picture, Rendered};
pub use notice::Notice;
pub use refine::{Pace, Partial, Refinement};
pub use renderer::{Renderer, Setup};
pub use request::{DebugView, Progress, Request};
pub use setting::Setting;
