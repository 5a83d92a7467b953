//! Signals that end the program: what is half-written is removed first, and the exit status still tells of the signal.
//!
//! Running out of memory ends a Rust program by SIGABRT, after the runtime has said so on standard error. The program then
//! fails as on any other error: exit code 1.

/// Has SIGINT, SIGTERM and SIGHUP remove unfinished files before they end the program. A signal that whoever started the
/// program told it to ignore (`nohup`) stays ignored. Where no thread can be had, signals end the program at once.
#[cfg(unix)]
pub(crate) fn clean_up() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    const STACK: usize = 64 << 10;
    let watched: Vec<i32> =
        [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal)).collect();
    let watch = move || {
        let Ok(mut signals) = Signals::new(watched) else { return };
        if let Some(signal) = signals.forever().next() {
            cutaway_io::atomic::remove_unfinished();
            // Ends the process as the signal would have done.
            let _ = emulate_default_handler(signal);
        }
    };
    // Without the thread there are no handlers either: the program ends as if this were not here.
    let _ = std::thread::Builder::new().name("signals".to_owned()).stack_size(STACK).spawn(watch);
}

#[cfg(not(unix))]
pub(crate) fn clean_up() {}

/// Turns the abort of the allocator into exit code 1.
#[cfg(unix)]
pub(crate) fn fail_without_memory() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    let always = Arc::new(AtomicBool::new(true));
    // Where it is refused, an abort stays an abort.
    let _ = signal_hook::flag::register_conditional_shutdown(signal_hook::consts::SIGABRT, 1, always);
}

#[cfg(not(unix))]
pub(crate) fn fail_without_memory() {}

/// True if the program was started with this signal ignored, as far as the system tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    match std::fs::read_to_string("/proc/self/status") {
        Ok(status) => mask_of_ignored(&status).is_some_and(|mask| mask >> (signal - 1) & 1 == 1),
        // Elsewhere only `nohup` is common: a signal that may have to stay ignored is left alone.
        Err(_) => signal == signal_hook::consts::SIGHUP,
    }
}

#[cfg(unix)]
fn mask_of_ignored(status: &str) -> Option<u64> {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

#[cfg(all(test, unix))]
mod tests {
    use super::mask_of_ignored;

    #[test]
    fn the_mask_of_ignored_signals_is_read_as_linux_writes_it() {
        assert_eq!(mask_of_ignored("SigBlk:\t0\nSigIgn:\t0000000000001001\nSigCgt:\t2\n"), Some(0x1001));
        assert_eq!(mask_of_ignored("SigIgn: nothing\n"), None);
    }
}
