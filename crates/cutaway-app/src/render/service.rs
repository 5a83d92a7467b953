//! The thread that renders, and the slot through which it is asked.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
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
    /// The next request; none when nobody will ask again.
    fn next(&self) -> Option<(u64, Box<Request>)> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if waiting.closed {
                return None;
            }
            if let Some(request) = waiting.request.take() {
                self.overtaken.store(false, Ordering::Relaxed);
                return Some(request);
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

fn serve(slot: &Slot, answers: &Sender<Answer>, wake: &dyn Fn()) {
    let mut engines = Engines::default();
    while let Some((serial, request)) = slot.next() {
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
