//! What panels, menus and keys ask for, done.

use std::path::{Path, PathBuf};

use super::App;
use super::export::Export;
use super::jobs::{self, Done, solid_source};
use crate::command::{Command, Purpose};
use crate::command_line::command_line;
use crate::document::{functions, scene_file};
use cutaway_io::scene_file::ClipSource;

/// How many recent files are remembered.
const MOST_RECENT: usize = 12;

impl App {
    /// Does everything that was asked for since the last frame.
    pub(super) fn do_commands(&mut self, context: &egui::Context) {
        for command in std::mem::take(&mut self.commands) {
            match command {
                Command::PickFile(purpose) => self.pick(purpose),
                Command::UseFile(purpose, path) => self.use_file(purpose, &path),
                Command::Report(line) => self.errors.push(line),
                Command::Save => match self.document.as_ref().and_then(|d| d.path.clone()) {
                    Some(path) => self.save_scene(&path),
                    None => self.pick(Purpose::SaveScene),
                },
                Command::CopyCommandLine => self.copy_command_line(context),
            }
        }
    }

    fn pick(&mut self, purpose: Purpose) {
        if !self.dialogs {
            return;
        }
        let folder = self.folder();
        self.jobs
            .start(move || jobs::pick(purpose, folder.as_deref()).map(|path| Done::Picked(purpose, path)));
    }

    /// Where dialogs begin: beside what is open.
    fn folder(&self) -> Option<PathBuf> {
        let document = self.document.as_ref()?;
        let volume = document.volume().source.path();
        let file = document.path.as_deref().unwrap_or(Path::new(volume));
        file.parent().filter(|folder| folder.is_absolute()).map(Path::to_owned)
    }

    fn use_file(&mut self, purpose: Purpose, path: &Path) {
        match purpose {
            Purpose::Open => match path.to_str() {
                Some(name) => self.open(name.to_owned()),
                None => self.errors.push(format!(
                    "{}: a scene file cannot hold a name that is not Unicode; rename the file",
                    path.display()
                )),
            },
            Purpose::AddSolid => {
                let path = path.to_owned();
                self.jobs.attempt(move || solid_source(&path).map(Done::Named));
            }
            Purpose::SaveScene => self.save_scene(path),
            Purpose::SaveImage | Purpose::SaveFilm => self.export(purpose, path),
            Purpose::OpenFunction => {
                let path = path.to_owned();
                self.jobs.attempt(move || functions::read(&path).map(Done::Function));
            }
            Purpose::SaveFunction => self.save_function(path),
        }
    }

    /// Adds an operand that cuts with a surface.
    pub(super) fn add_solid(&mut self, source: ClipSource) {
        // Once more, if it could not be read before.
        self.reading.retain(|other| *other != source);
        if let Some(document) = &mut self.document {
            self.panels.add_solid(document, source);
        }
    }

    fn save_function(&mut self, path: &Path) {
        let Some(document) = &self.document else { return };
        let (path, file) = (path.to_owned(), document.function_file(path));
        self.jobs.attempt(move || {
            let notices = functions::write(&path, &file)?;
            let saved = format!("saved {}", path.display());
            Ok(Done::Said(std::iter::once(saved).chain(notices).collect::<Vec<_>>().join("; ")))
        });
    }

    /// Opens a volume or a scene, and remembers it.
    pub(super) fn open(&mut self, name: String) {
        self.open_volume(name, None);
    }

    /// The same, of a volume in a file of several.
    pub(super) fn open_volume(&mut self, name: String, volume_index: Option<usize>) {
        if !name.starts_with("sample:") {
            let name =
                std::path::absolute(&name).map(|p| p.to_string_lossy().into_owned()).unwrap_or(name.clone());
            self.recent.retain(|other| *other != name);
            self.recent.insert(0, name);
            self.recent.truncate(MOST_RECENT);
        }
        self.jobs.open(name, volume_index);
    }

    /// What was dropped on the window: a surface cuts, anything else is opened.
    pub(super) fn dropped(&mut self, path: &Path) {
        let (path, has_document) = (path.to_owned(), self.document.is_some());
        self.jobs.start(move || {
            let solid =
                || cutaway_io::mesh::recognize(&path).is_some() || cutaway_io::patches::recognize(&path);
            let purpose = if has_document && solid() { Purpose::AddSolid } else { Purpose::Open };
            Some(Done::Picked(purpose, path))
        });
    }

    fn save_scene(&mut self, path: &Path) {
        let Some(document) = &self.document else { return };
        let notes = self.panels.notes(self.picture.overlays);
        let (path, state) = (path.to_owned(), Box::new(document.state().clone()));
        match scene_file::text_of(document, &path, notes.to_value()) {
            Ok(text) => self.jobs.attempt(move || {
                scene_file::write(&path, &text)?;
                Ok(Done::Saved(path, state))
            }),
            Err(line) => self.errors.push(line),
        }
    }

    fn copy_command_line(&mut self, context: &egui::Context) {
        let Some(document) = &self.document else { return };
        match command_line(document) {
            Ok(line) => {
                self.readout.notices = vec!["copied the command line".to_owned()];
                context.copy_text(line);
            }
            Err(line) => self.errors.push(line),
        }
    }

    fn export(&mut self, purpose: Purpose, path: &Path) {
        let Some(document) = &self.document else { return };
        let request = self.panels.export.request(document, self.debug);
        let film = (purpose == Purpose::SaveFilm).then_some(self.panels.export.frames);
        self.exports.push(Export::start(request, film, path.to_owned(), &self.jobs));
    }
}
