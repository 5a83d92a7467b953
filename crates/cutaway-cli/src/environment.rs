//! What is set in the process's environment before anything else runs.
#![expect(unsafe_code, reason = "Rust has no other way to tell the loader of Vulkan to leave a layer out")]

use std::env;

/// Leaves out the layer with which Mesa asks the desktop for its preferred device where there is no desktop: it would
/// print a line of its own on standard error, on every look at the adapters. `cutaway` chooses the adapter itself.
pub(crate) fn quiet_vulkan_layers() {
    if env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: called first in `main`: no other thread runs that could read the environment meanwhile.
        unsafe { env::set_var("NODEVICE_SELECT", "1") };
    }
}
