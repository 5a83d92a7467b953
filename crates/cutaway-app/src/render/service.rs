//! The thread that renders, and the slot through which it is asked.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use cutaway_gpu::Gpu;

use super::engines::{Engines, Interrupt};
use super::{Frame, Request};

/// What comes back: a frame, or why there is none, in a line.
pub type Answer = Result<Frame, String>;

/// A thread that renders the newest request.
#[derive(Debug)]
pub struct RenderService {
    slot: Arc<Slot>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
}

/// Where requests wait: there is room for one.
#[derive(Debug, Default)]
struct Slot {
    waiting: Mutex<Waiting>,
    changed: Condvar,
    /// Set while a request waits: what is in hand is not worth finishing.
    overtaken: AtomicBool,
}

#[derive(Debug, Default)]
struct Waiting {
    request: Option<(u64, Box<Request>)>,
    last: u64,
    closed: bool,
    /// A device that the engines are to use from now on.
    shared: Option<Gpu>,
}

impl RenderService {
    /// Starts the thread; `wake` is called from it whenever an answer is there.
    pub fn new(wake: impl Fn() + Send + 'static) -> Self {
        let slot = Arc::new(Slot::default());
        let (sender, answers) = channel();
        let of_thread = slot.clone();
        let thread = std::thread::Builder::new()
            .name("render".to_owned())
            .spawn(move || serve(&of_thread, &sender, &wake))
            .ok();
        Self { slot, answers, thread }
    }

    /// Asks for a picture, in place of whatever was asked for before; its serial number.
    pub fn request(&self, request: Request) -> u64 {
        let mut waiting = self.slot.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        waiting.last += 1;
        let serial = waiting.last;
        waiting.request = Some((serial, Box::new(request)));
        self.slot.overtaken.store(true, Ordering::Relaxed);
        self.slot.changed.notify_one();
        serial
    }

    /// Has the engines use a device that the window is drawn with, and leave pictures there.
    pub fn share(&self, gpu: Gpu) {
        self.slot.waiting.lock().unwrap_or_else(PoisonError::into_inner).shared = Some(gpu);
    }

    /// The next answer, if one is there.
    pub fn answer(&self) -> Option<Answer> {
        self.answers.try_recv().ok()
    }

    /// The next answer, if one comes in time.
    pub fn answer_before(&self, deadline: Instant) -> Option<Answer> {
        self.answers.recv_timeout(deadline.saturating_duration_since(Instant::now())).ok()
    }
}

impl Drop for RenderService {
    fn drop(&mut self) {
        self.slot.waiting.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        self.slot.overtaken.store(true, Ordering::Relaxed);
        self.slot.changed.notify_one();
        if let Some(thread) = self.thread.take() {
            // A panic there was reported there.
            let _ = thread.join();
        }
    }
}

impl Slot {
    /// Waits, and takes the request that has come, if that is why the wait ended; none when nobody will ask again.
    fn next(&self) -> Option<Option<(u64, Box<Request>)>> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        if waiting.request.is_none() && !waiting.closed {
            waiting = self.wait(waiting);
        }
        if waiting.closed {
            return None;
        }
        let request = waiting.request.take();
        if request.is_some() {
            self.overtaken.store(false, Ordering::Relaxed);
        }
        Some(request)
    }

    #[cfg(not(feature = "watch-shaders"))]
    fn wait<'a>(&self, waiting: MutexGuard<'a, Waiting>) -> MutexGuard<'a, Waiting> {
        self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner)
    }

    /// Not for long: the shaders' files want to be looked at.
    #[cfg(feature = "watch-shaders")]
    fn wait<'a>(&self, waiting: MutexGuard<'a, Waiting>) -> MutexGuard<'a, Waiting> {
        let interval = cutaway_gpu::ShaderWatch::INTERVAL;
        self.changed.wait_timeout(waiting, interval).unwrap_or_else(PoisonError::into_inner).0
    }
}

fn serve(slot: &Slot, answers: &Sender<Answer>, wake: &dyn Fn()) {
    let mut engines = Engines::default();
    #[cfg(feature = "watch-shaders")]
    let mut shaders = super::watch::Shaders::default();
    while let Some(next) = slot.next() {
        #[cfg(feature = "watch-shaders")]
        let next = shaders.look(next, &mut engines, &mut |line| {
            // Nobody listens once the window is closed.
            let _ = answers.send(Err(line));
            wake();
        });
        let Some((serial, request)) = next else { continue };
        let shared = slot.waiting.lock().unwrap_or_else(PoisonError::into_inner).shared.take();
        if let Some(gpu) = shared {
            engines = Engines::sharing(gpu);
        }
        let mut hand_over = |frame: Frame| {
            let sent = answers.send(Ok(Frame { serial, ..frame })).is_ok();
            wake();
            if sent { Ok(()) } else { Err(Interrupt::Overtaken) }
        };
        match engines.render(&request, &slot.overtaken, &mut hand_over) {
            Ok(()) | Err(Interrupt::Overtaken) => {}
            Err(Interrupt::Failed(line)) => {
                if answers.send(Err(line)).is_err() {
                    return;
                }
                wake();
            }
        }
    }
}
