//! Notices: what an engine does otherwise than asked, typed, for whoever shows them to the user.

use std::fmt;

use cutaway_core::scene::Mode;

use crate::setting::Setting;

/// A notice about a frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Notice {
    /// A setting that has no effect.
    NoEffect {
        /// The setting.
        setting: Setting,
        /// Its value, as a scene file has it.
        value: String,
        /// The engine.
        engine: &'static str,
        /// The mode, where the engine has the setting in other modes.
        mode: Option<Mode>,
    },
    /// Something about the data on the device: precision, or coarser bricks.
    Data(String),
    /// Another engine renders than the one that was chosen automatically.
    Replaced {
        /// Why the chosen engine does not render.
        reason: String,
        /// The engine that does.
        engine: &'static str,
    },
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoEffect { setting, value, engine, mode: None } => {
                write!(f, "{} {value} has no effect with the {engine} engine", setting.field())
            }
            Self::NoEffect { setting, value, engine, mode: Some(mode) } => {
                let (field, mode) = (setting.field(), mode.name());
                write!(f, "{field} {value} has no effect in {mode} mode with the {engine} engine")
            }
            Self::Data(text) => f.write_str(text),
            Self::Replaced { reason, engine } => write!(f, "{reason}; the {engine} engine renders instead"),
        }
    }
}
