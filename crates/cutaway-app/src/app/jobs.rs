//! Work that would make the window wait, in threads of its own: dialogs, reading and writing files.

use cutaway_core::glam::DVec3;
use cutaway_io::scene_file::{ClipFile, ClipSource, SceneFile, VolumeReference};
use cutaway_io::volume::ReadOptions;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use cutaway_io::solids::source_of_file;
use cutaway_io::transfer_function::FunctionFile;
use cutaway_io::volume::Loaded;

use crate::command::Purpose;
use crate::document::solids::LoadedSolid;
use crate::document::{OpenVolume, SceneState, Solids, ViewerNotes, scene_file};

/// What came of a job.
#[derive(Debug)]
pub(super) enum Done {
    /// A file was picked.
    Picked(Purpose, PathBuf),
    /// A volume is open, with how it is seen, the surfaces it is cut by, and the scene file it came from.
    Opened(Box<Opened>),
    /// A file holds a surface that is to cut.
    Named(ClipSource),
    /// A surface was read.
    Solid(ClipSource, LoadedSolid),
    /// A transfer function was read.
    Function(Loaded<FunctionFile>),
    /// A state was written to a scene file.
    Saved(PathBuf, Box<SceneState>),
    /// Something worth a line in the read-out.
    Said(String),
    /// Something failed: one line.
    Failed(String),
}

/// A volume that was opened.
#[derive(Debug)]
pub struct Opened {
    /// The volume.
    pub volume: Arc<OpenVolume>,
    /// How it is seen.
    pub state: SceneState,
    /// The surfaces of files.
    pub solids: Solids,
    /// The scene file.
    pub path: Option<PathBuf>,
    /// What a viewer kept in it.
    pub viewer: Option<ViewerNotes>,
    /// What was said while it was read, one line each.
    pub notices: Vec<String>,
}

/// Starts jobs and hears of their ends.
#[derive(Debug)]
pub(super) struct Jobs {
    sender: Sender<Done>,
    done: Receiver<Done>,
    wake: egui::Context,
    running: Arc<()>,
}

impl Jobs {
    /// `context` is repainted when a job is done.
    pub(super) fn new(context: &egui::Context) -> Self {
        let (sender, done) = channel();
        Self { sender, done, wake: context.clone(), running: Arc::new(()) }
    }

    /// What a finished job brought, if one is done.
    pub(super) fn next(&self) -> Option<Done> {
        self.done.try_recv().ok()
    }

    /// Whether any job is under way.
    pub(super) fn is_busy(&self) -> bool {
        Arc::strong_count(&self.running) > 1
    }

    /// Runs a job; what it brings comes out of [`Self::next`].
    pub(super) fn start(&self, job: impl FnOnce() -> Option<Done> + Send + 'static) {
        let (sender, wake, running) = (self.sender.clone(), self.wake.clone(), self.running.clone());
        let work = move || {
            if let Some(done) = job() {
                // Nobody listens once the window is closed.
                let _ = sender.send(done);
            }
            drop(running);
            wake.request_repaint();
        };
        if let Err(error) = std::thread::Builder::new().name("job".to_owned()).spawn(work) {
            let _ = self.sender.send(Done::Failed(format!("no thread could be started: {error}")));
        }
    }

    /// Opens a volume or a scene file.
    pub(super) fn open(&self, name: String, volume_index: Option<usize>) {
        self.start(move || {
            Some(open(&name, volume_index).map_or_else(Done::Failed, |opened| Done::Opened(Box::new(opened))))
        });
    }

    /// Runs a job whose failure is one line.
    pub(super) fn attempt(&self, job: impl FnOnce() -> Result<Done, String> + Send + 'static) {
        self.start(move || Some(job().unwrap_or_else(Done::Failed)));
    }

    /// Reads a surface.
    pub(super) fn read_solid(&self, source: ClipSource) {
        self.start(move || match Solids::read(&source) {
            Ok(solid) => solid.map(|solid| Done::Solid(source, solid)),
            Err(line) => Some(Done::Failed(line)),
        });
    }
}

/// The sample, with a cut in it.
pub(super) fn first_start() -> Done {
    use crate::cutting::{Content, Operand, OperandId, Operation};
    use cutaway_core::clip::{Pose, Sphere};
    let mut opened = match open("sample:mr-head", None) {
        Ok(opened) => opened,
        Err(line) => return Done::Failed(line),
    };
    // The volume's right front upper quarter, where there is brain below the skin.
    if let Ok(sphere) = Sphere::new(DVec3::ZERO, 60.0) {
        let center = cutaway_core::glam::DAffine3::from_translation(DVec3::new(-308.0, 90.0, 500.0));
        opened.state.cutting.operands.push(Operand {
            id: OperandId(1),
            name: "sphere".to_owned(),
            operation: Operation::Cut,
            visible: true,
            pose: Pose::new(center).unwrap_or(Pose::IDENTITY),
            content: Content::Object(ClipSource::Sphere(sphere)),
        });
    }
    Done::Opened(Box::new(opened))
}

/// Opens what the user named: a scene file, a volume, or `sample:NAME`.
///
/// # Errors
/// One line: the file, the place, what is wrong.
pub fn open(name: &str, volume_index: Option<usize>) -> Result<Opened, String> {
    let is_scene = !name.starts_with("sample:") && Path::new(name).extension().is_some_and(|e| e == "json");
    if is_scene {
        let path = std::path::absolute(name).map_err(|e| format!("{name}: {e}"))?;
        let mut file = scene_file::read(&path)?;
        if volume_index.is_some() {
            file.volume = file.volume.with_volume_index(volume_index);
        }
        return open_scene(&file, &path);
    }
    let options = ReadOptions { volume_index, ..ReadOptions::default() };
    let volume = OpenVolume::read_source(&VolumeReference::with_options(name.to_owned(), &options), None)?;
    check(&volume, name)?;
    let state = SceneState::of_volume(volume.lattice());
    let notices = volume.notices.clone();
    let volume = Arc::new(volume);
    Ok(Opened { volume, state, solids: Solids::default(), path: None, viewer: None, notices })
}

fn open_scene(file: &SceneFile, path: &Path) -> Result<Opened, String> {
    let at = |line: String| format!("{}: {line}", path.display());
    let volume = OpenVolume::read_source(&file.volume, file.nan).map_err(at)?;
    let state = scene_file::state_of(file, &volume.data).map_err(at)?;
    let mut notices = volume.notices.clone();
    let mut solids = Solids::default();
    let mut failed = None;
    if let Some(ClipFile(mut clip)) = file.clip.clone() {
        clip.visit_leaves(&mut |source, _| {
            if failed.is_some() || solids.get(source).is_some() {
                return;
            }
            match Solids::read(source) {
                Ok(Some(loaded)) => {
                    notices.extend(loaded.notices);
                    solids.insert(source, loaded.solid);
                }
                Ok(None) => {}
                Err(line) => failed = Some(at(line)),
            }
        });
    }
    if let Some(line) = failed {
        return Err(line);
    }
    let (volume, path) = (Arc::new(volume), Some(path.to_owned()));
    Ok(Opened {
        volume,
        state,
        solids,
        path,
        viewer: file.viewer.as_ref().map(|value| ViewerNotes::of(Some(value))),
        notices,
    })
}

/// Whether a volume can be rendered at all: what cannot is said now, by the name of its file.
fn check(open: &OpenVolume, name: &str) -> Result<(), String> {
    let state = SceneState::of_volume(open.lattice());
    state.scene(&open.data, None, [1, 1]).map(|_| ()).map_err(|e| format!("{name}: {e}"))
}

/// What is in a file that cuts: spline patches or a mesh, by its content where it can be read.
///
/// # Errors
/// A name that a scene file cannot hold.
pub(super) fn solid_source(path: &Path) -> Result<ClipSource, String> {
    let name = path.display();
    let absolute = std::path::absolute(path).map_err(|e| format!("{name}: {e}"))?;
    let path = absolute
        .into_os_string()
        .into_string()
        .map_err(|_| format!("{name}: clip expressions hold names in Unicode only; rename the file"))?;
    Ok(source_of_file(path))
}

/// Shows a file dialog and waits for it; none where it is dismissed.
pub(super) fn pick(purpose: Purpose, folder: Option<&Path>) -> Option<PathBuf> {
    let mut dialog = rfd::FileDialog::new().set_title(title(purpose));
    if let Some(folder) = folder {
        dialog = dialog.set_directory(folder);
    }
    match purpose {
        Purpose::Open | Purpose::AddSolid | Purpose::OpenFunction => dialog.pick_file(),
        Purpose::SaveFunction => dialog.set_file_name("transfer-function.json").save_file(),
        Purpose::SaveScene => dialog.set_file_name("scene.json").save_file(),
        Purpose::SaveImage => dialog.set_file_name("picture.png").save_file(),
        Purpose::SaveFilm => dialog.set_file_name("turntable.gif").save_file(),
    }
}

fn title(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::Open => "Open a volume or a scene",
        Purpose::AddSolid => "Add a surface that cuts",
        Purpose::OpenFunction => "Open a transfer function",
        Purpose::SaveFunction => "Save the transfer function",
        Purpose::SaveScene => "Save the scene",
        Purpose::SaveImage => "Save a picture",
        Purpose::SaveFilm => "Save a film",
    }
}
