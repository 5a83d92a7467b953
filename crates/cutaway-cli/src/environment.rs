//! What surrounds the process, before anything else runs: its environment is set, its standard streams are looked at.
#![expect(unsafe_code, reason = "Rust has no other way to do either")]

use std::env;
use std::sync::atomic::{AtomicBool, Ordering};

/// Leaves out the layer with which Mesa asks the desktop for its preferred device where there is no desktop: it would
/// print a line of its own on standard error, on every look at the adapters. `cutaway` chooses the adapter itself.
pub(crate) fn quiet_vulkan_layers() {
    if env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: called first in `main`: no other thread runs that could read the environment meanwhile.
        unsafe { env::set_var("NODEVICE_SELECT", "1") };
    }
}

/// If true, the standard stream of that descriptor (0, 1, 2) was closed when the program began.
static CLOSED: [AtomicBool; 3] = [const { AtomicBool::new(false) }; 3];

/// True if this standard stream (0, 1, 2) was closed when the program began. False where the system does not tell.
pub(crate) fn was_closed(descriptor: usize) -> bool {
    CLOSED.get(descriptor).is_some_and(|closed| closed.load(Ordering::Relaxed))
}

/// Runs before the runtime does, which opens `/dev/null` in place of each closed stream.
// SAFETY: the linker's section holds functions without arguments that are called once, before `main`, by one thread.
#[cfg(any(target_os = "linux", target_os = "macos"))]
#[used]
#[cfg_attr(target_os = "linux", unsafe(link_section = ".init_array"))]
#[cfg_attr(target_os = "macos", unsafe(link_section = "__DATA,__mod_init_func"))]
static LOOK: extern "C" fn() = look_at_streams;

/// Asks for the metadata of each descriptor by its name. No memory is allocated and nothing is opened.
#[cfg(any(target_os = "linux", target_os = "macos"))]
extern "C" fn look_at_streams() {
    const NAMES: [&str; 3] = if cfg!(target_os = "linux") {
        ["/proc/self/fd/0", "/proc/self/fd/1", "/proc/self/fd/2"]
    } else {
        ["/dev/fd/0", "/dev/fd/1", "/dev/fd/2"]
    };
    const FOLDER: &str = if cfg!(target_os = "linux") { "/proc/self/fd" } else { "/dev/fd" };
    if std::fs::symlink_metadata(FOLDER).is_err() {
        return;
    }
    for (name, closed) in NAMES.into_iter().zip(&CLOSED) {
        let missing = |error: std::io::Error| error.kind() == std::io::ErrorKind::NotFound;
        closed.store(std::fs::symlink_metadata(name).is_err_and(missing), Ordering::Relaxed);
    }
}
