//! Pictures and films written to files, at full quality, beside the window's own rendering.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cutaway_io::image::{BitDepth, write_image};
use egui::Ui;

use super::jobs::{Done, Jobs};
use crate::film::{is_pictures, write_film};
use crate::render::Request;
use crate::render::engines::{Engines, Interrupt};

/// A file that is being made.
#[derive(Debug)]
pub(super) struct Export {
    path: PathBuf,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    /// Thousandths that are done.
    progress: AtomicU32,
    cancel: AtomicBool,
    finished: AtomicBool,
}

impl Export {
    /// Begins to make a picture, or a film of so many frames in which the camera turns once about the volume.
    pub(super) fn start(request: Request, film: Option<u32>, path: PathBuf, jobs: &Jobs) -> Self {
        let shared = Arc::new(Shared::default());
        let (of_thread, file) = (shared.clone(), path.clone());
        jobs.start(move || {
            let made = match film {
                Some(frames) => make_film(request, frames, &file, &of_thread),
                None => make_picture(&request, &file, &of_thread),
            };
            of_thread.finished.store(true, Ordering::Relaxed);
            match made {
                Ok(()) => Some(Done::Said(format!("saved {}", file.display()))),
                Err(Interrupt::Overtaken) => {
                    let left = if is_pictures(&file) { "finished frames stay" } else { "not written" };
                    Some(Done::Said(format!("{}: cancelled, {left}", file.display())))
                }
                Err(Interrupt::Failed(line)) => Some(Done::Failed(line)),
            }
        });
        Self { path, shared }
    }

    /// Whether it is done, or was cancelled.
    pub(super) fn is_finished(&self) -> bool {
        self.shared.finished.load(Ordering::Relaxed)
    }

    /// Draws how far it is.
    pub(super) fn show(&self, ui: &mut Ui) {
        let share = self.shared.progress.load(Ordering::Relaxed) as f32 / 1000.0;
        let name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        ui.horizontal(|ui| {
            ui.add(egui::ProgressBar::new(share).desired_width(160.0).text(name));
            if ui.button("Cancel").clicked() {
                self.shared.cancel.store(true, Ordering::Relaxed);
            }
        });
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(100));
    }
}

impl Shared {
    fn note(&self, share: f32) {
        self.progress.store((share * 1000.0) as u32, Ordering::Relaxed);
    }

    fn check(&self) -> Result<(), Interrupt> {
        if self.cancel.load(Ordering::Relaxed) { Err(Interrupt::Overtaken) } else { Ok(()) }
    }
}

fn make_picture(request: &Request, path: &Path, shared: &Shared) -> Result<(), Interrupt> {
    let image = Engines::default().still(request, &|share| shared.note(share))?;
    shared.check()?;
    Ok(write_image(path, &image, BitDepth::Eight)?)
}

fn make_film(mut request: Request, frames: u32, path: &Path, shared: &Shared) -> Result<(), Interrupt> {
    let mut engines = Engines::default();
    write_film(path, request.size, frames, &mut |index| {
        shared.check()?;
        let image = engines.still(&request, &|share| shared.note((index as f32 + share) / frames as f32))?;
        shared.check()?;
        request.state.camera.azimuth(TAU / f64::from(frames));
        Ok(image)
    })
}
