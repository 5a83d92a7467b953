//! The threads that readers and engines share, which must be there before anything asks for them: rayon panics where it
//! cannot start its own.

use std::sync::Mutex;
use std::sync::mpsc::{Sender, channel};

use rayon::{ThreadBuilder, ThreadPoolBuilder};

/// Starts one thread per core, or as many as can be had; with none at all, the calling thread does the work.
pub(crate) fn start() {
    let wanted = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let waiting = waiting_threads(wanted);
    let builder = ThreadPoolBuilder::new().num_threads(waiting.len().max(1));
    // An error means that the pool is there already.
    let _ = if waiting.is_empty() {
        builder.use_current_thread().build_global()
    } else {
        let waiting = Mutex::new(waiting);
        builder
            .spawn_handler(move |thread| {
                let next = waiting.lock().ok().and_then(|mut waiting| waiting.pop());
                let sent = next.is_some_and(|next| next.send(thread).is_ok());
                if sent { Ok(()) } else { Err(std::io::Error::other("no thread is waiting")) }
            })
            .build_global()
    };
}

/// Threads that wait for work, `wanted` or fewer.
fn waiting_threads(wanted: usize) -> Vec<Sender<ThreadBuilder>> {
    let mut waiting = Vec::new();
    for index in 0..wanted {
        let (sender, receiver) = channel::<ThreadBuilder>();
        let work = move || {
            if let Ok(thread) = receiver.recv() {
                thread.run();
            }
        };
        match std::thread::Builder::new().name(format!("worker {index}")).spawn(work) {
            Ok(_) => waiting.push(sender),
            Err(_) => break,
        }
    }
    waiting
}
