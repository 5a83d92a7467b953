//! How a device is chosen and used.

use super::adapter::AdapterChoice;
use super::capabilities::Fallbacks;

/// What is done with a volume of which not everything visible fits on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Oversize {
    /// Parts of it are kept at coarser levels, and a notice says so.
    #[default]
    Coarsen,
    /// It is refused.
    Refuse,
}

/// How a device is chosen and used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GpuOptions {
    /// Which adapter.
    pub adapter: AdapterChoice,
    /// Features that are to be treated as missing.
    pub fallbacks: Fallbacks,
    /// What becomes of volumes that do not fit.
    pub oversize: Oversize,
}
