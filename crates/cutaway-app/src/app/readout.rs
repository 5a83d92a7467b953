//! The line below the picture: how fast it is made, of how much, and what was said on the way.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use egui::Ui;

use crate::document::Document;
use crate::render::{Frame, Took};
use crate::slices::{self, Probe};

/// What the line says.
#[derive(Debug, Default)]
pub(super) struct Readout {
    took: Took,
    /// When first frames came, of the last second.
    arrivals: VecDeque<Instant>,
    asked: u64,
    answered: u64,
    done: bool,
    /// What readers and engines had to say.
    pub(super) notices: Vec<String>,
    memory: Memory,
}

impl Readout {
    /// Notes that a picture was asked for.
    pub(super) fn asked(&mut self) {
        self.asked += 1;
        self.done = false;
    }

    /// Notes that there will be no picture.
    pub(super) fn failed(&mut self) {
        self.done = true;
        self.answered = self.asked;
    }

    /// Notes a frame.
    pub(super) fn take(&mut self, frame: &Frame) {
        let now = Instant::now();
        if frame.serial != self.answered {
            self.arrivals.push_back(now);
        }
        self.answered = frame.serial;
        self.done = frame.done && frame.serial == self.asked;
        self.took = frame.took.clone();
    }

    /// Whether the picture is complete.
    pub(super) fn is_done(&self) -> bool {
        self.done
    }

    /// Draws the line.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        document: Option<&Document>,
        hover: Option<Probe>,
        busy: bool,
    ) {
        let now = Instant::now();
        while self.arrivals.front().is_some_and(|t| now - *t > Duration::from_secs(1)) {
            self.arrivals.pop_front();
        }
        ui.horizontal(|ui| {
            let Some(document) = document else {
                ui.label("Opening …");
                return;
            };
            let dims = document.volume().lattice().dimensions();
            ui.label(format!("{}  {} x {} x {}", document.volume().name(), dims.x, dims.y, dims.z));
            ui.separator();
            let Took { engine, milliseconds, samples, gpu_bytes, adapter, .. } = &self.took;
            let made = ui.label(format!("{engine}  {milliseconds:.0} ms"));
            if let Some(adapter) = adapter {
                made.on_hover_text(adapter);
            }
            if !self.done && self.arrivals.len() > 1 {
                ui.label(format!("{} frames/s", self.arrivals.len()));
            }
            if *samples > 0 {
                ui.label(format!("{:.1} M samples", *samples as f64 / 1e6));
            }
            if let Some(bytes) = self.memory.resident() {
                ui.label(format!("{} MB", bytes / 1_000_000));
            }
            if *gpu_bytes > 0 {
                ui.label(format!("{} MB on the GPU", gpu_bytes / 1_000_000));
            }
            // Nothing that moves: it would have the whole window drawn again all the time, and where there is no GPU the
            // processor that draws it has a picture to render.
            if busy || !self.done {
                ui.label("…").on_hover_text("at work");
            }
            if let Some(probe) = hover {
                ui.separator();
                ui.monospace(probe.text(slices::unit(document.volume().lattice().geometry().frame)));
            }
            for notice in self.notices.iter().chain(&self.took.notices) {
                ui.separator();
                ui.weak(notice);
            }
        });
    }
}

/// Memory of the process, asked for twice a second at most.
#[derive(Debug, Default)]
struct Memory {
    asked: Option<Instant>,
    resident: Option<u64>,
}

impl Memory {
    /// Bytes in use, where the system tells as Linux does.
    fn resident(&mut self) -> Option<u64> {
        let now = Instant::now();
        if self.asked.is_none_or(|t| now - t > Duration::from_millis(500)) {
            self.asked = Some(now);
            self.resident = resident();
        }
        self.resident
    }
}

fn resident() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}
