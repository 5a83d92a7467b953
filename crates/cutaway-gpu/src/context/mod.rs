//! The device: which adapter, what it can do, and what becomes of its errors.
//!
//! Enters: options. Leaves: a [`Gpu`], on which everything else is made. Optional features of the adapter are probed once
//! ([`Capabilities`]); whatever can be missing has a substitute, and [`Fallbacks`] pretends that it is missing, so that
//! tests on one machine see all of them.

mod adapter;
mod arrival;
mod capabilities;
pub(crate) mod filter;
mod filter_errors;
mod gpu;
mod open;
mod options;
mod stopwatch;

pub use adapter::{AdapterChoice, AdapterSummary, adapters};
pub(crate) use arrival::Arrival;
#[cfg(test)]
pub(crate) use capabilities::all_capabilities;
pub use capabilities::{Capabilities, Fallbacks, Filtering};
pub use filter_errors::FilterErrors;
pub use gpu::Gpu;
pub use options::{GpuOptions, Oversize};
pub(crate) use stopwatch::{PendingTime, Stopwatch};
