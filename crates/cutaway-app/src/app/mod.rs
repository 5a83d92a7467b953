//! The window: panels around a picture, and what happens between them.
//!
//! Every frame: finished jobs and rendered frames are taken in, panels and the picture edit the document, what they ask
//! for is done, and a new picture is asked for where the document is not as it was.

mod commands;
mod export;
mod jobs;
mod keys;
mod menu;
mod readout;

use std::sync::Arc;
use std::time::{Duration, Instant};

use cutaway_core::camera::Ray;
use cutaway_core::glam::DVec3;
use cutaway_core::scene::Mode;
use cutaway_gpu::context::AdapterSummary;
use cutaway_gpu::{Gpu, GpuOptions};
use cutaway_io::scene_file::ClipSource;
use eframe::egui_wgpu::RenderState;
use egui::{Color32, Context, Ui};

use crate::command::Command;
use crate::document::{Document, OpenVolume, SceneState};
use crate::panels::Panels;
use crate::picture::{self, Picture, Projection, navigation};
use crate::render::{Answer, DebugView, RenderService, Request};
use crate::slices;
use jobs::{Done, Jobs, first_start};
use readout::Readout;

pub use jobs::{Opened, open};

/// What the window begins with.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// A volume or a scene file; none: the sample, with a cut in it.
    pub open: Option<String>,
    /// Index of the volume, from 0, where a file holds several.
    pub volume_index: Option<usize>,
    /// The GPU that window and engines use, by a part of its name; none: the best, and engines leave it to the window if it
    /// is a processor that plays GPU.
    pub gpu: Option<String>,
}

/// The window.
pub struct App {
    document: Option<Document>,
    render: RenderService,
    jobs: Jobs,
    picture: Picture,
    panels: Panels,
    readout: Readout,
    /// What the picture that was asked for last is of.
    asked: Option<Asked>,
    debug: DebugView,
    commands: Vec<Command>,
    /// Lines that stand until they are dismissed.
    errors: Vec<String>,
    show_help: bool,
    dialogs: bool,
    /// Whether a window draws this, and clears it to the colour of panels before.
    has_window: bool,
    /// Whether window and engines have the same processor.
    takes_turns: bool,
    /// The request that this drawing of the window made.
    awaited: Option<u64>,
    /// Files opened before, the newest first.
    recent: Vec<String>,
    exports: Vec<export::Export>,
    /// Files of surfaces that are read, or were, or cannot be.
    reading: Vec<ClipSource>,
}

/// How long drawing the window waits for a picture at most: some more than a first one is to take.
const TURN: Duration = Duration::from_millis(50);

/// Where recent files are kept.
const RECENT: &str = "recent";

/// Everything that a picture depends on.
#[derive(Debug)]
struct Asked {
    volume: *const OpenVolume,
    state: SceneState,
    size: [u32; 2],
    debug: DebugView,
    solids: usize,
}

impl Asked {
    /// Whether it is of what is open, as it is now. Asked of every frame of the window.
    fn is_of(&self, document: &Document) -> bool {
        let same_volume = std::ptr::eq(self.volume, Arc::as_ptr(document.volume()));
        same_volume && self.solids == document.solids.len() && self.state == *document.state()
    }
}

impl App {
    /// A window that begins with what `start` says.
    pub fn new(context: &Context, start: &Start) -> Self {
        let wake = context.clone();
        let mut app = Self {
            document: None,
            render: RenderService::new(move || wake.request_repaint()),
            jobs: Jobs::new(context),
            picture: Picture::default(),
            panels: Panels::default(),
            readout: Readout::default(),
            asked: None,
            debug: DebugView::Off,
            commands: Vec::new(),
            errors: Vec::new(),
            show_help: false,
            dialogs: true,
            has_window: false,
            takes_turns: false,
            awaited: None,
            recent: Vec::new(),
            exports: Vec::new(),
            reading: Vec::new(),
        };
        match &start.open {
            Some(name) => app.open_volume(name.clone(), start.volume_index),
            None => app.jobs.start(|| Some(first_start())),
        }
        app
    }

    /// The same, drawn in this window; with its device for the engines, so that their pictures need not be copied to be shown,
    /// where it is a real GPU, or `always`. A processor that plays GPU would let the window wait behind every picture.
    #[must_use]
    pub fn drawn_in(mut self, window: Option<&RenderState>, always: bool) -> Self {
        let Some(window) = window else { return self };
        self.picture.draw_in(window.clone());
        self.has_window = true;
        self.takes_turns = AdapterSummary::of(&window.adapter).software;
        if self.takes_turns && !always {
            return self;
        }
        let (device, queue) = (window.device.clone(), window.queue.clone());
        // Engines that find the device wanting open one of their own, or say why not.
        if let Ok(gpu) = Gpu::sharing(&window.adapter, device, queue, &GpuOptions::default()) {
            self.render.share(gpu);
        }
        self
    }

    /// The same, with what an earlier window remembered.
    #[must_use]
    pub fn remembering(mut self, storage: Option<&dyn eframe::Storage>) -> Self {
        let recent: Option<Vec<String>> = storage.and_then(|storage| eframe::get_value(storage, RECENT));
        for name in recent.unwrap_or_default() {
            if !self.recent.contains(&name) {
                self.recent.push(name);
            }
        }
        self
    }

    /// The same, without dialogs: what would be picked in one is not picked.
    #[must_use]
    pub fn without_dialogs(mut self) -> Self {
        self.dialogs = false;
        self
    }

    /// How large pictures are, and how many frames a film has.
    pub fn export_size(&mut self, size: [u32; 2], frames: u32) {
        (self.panels.export.size, self.panels.export.frames) = (size, frames);
    }

    /// Slices, and what points at them.
    pub fn slices(&self) -> &slices::Slices {
        &self.panels.slices
    }

    /// What is open.
    pub fn document(&self) -> Option<&Document> {
        self.document.as_ref()
    }

    /// What is open, to be edited.
    pub fn document_mut(&mut self) -> Option<&mut Document> {
        self.document.as_mut()
    }

    /// Errors that stand in the window.
    pub fn errors(&self) -> &[String] {
        &self.errors
    }

    /// Whether the picture is complete and nothing is under way.
    pub fn is_idle(&self) -> bool {
        let pictured = self.document.is_none() || self.readout.is_done();
        !self.jobs.is_busy() && self.commands.is_empty() && pictured
    }

    /// Asks for something as a panel would.
    pub fn ask(&mut self, command: Command) {
        self.commands.push(command);
    }

    /// Takes in what jobs and the render thread have brought.
    fn take_in(&mut self, context: &Context) {
        while let Some(done) = self.jobs.next() {
            match done {
                Done::Opened(opened) => self.opened(*opened),
                Done::Solid(source, loaded) => {
                    self.readout.notices.extend(loaded.notices);
                    if let Some(document) = &mut self.document {
                        document.solids.insert(&source, loaded.solid);
                        self.asked = None;
                    }
                }
                Done::Named(source) => self.add_solid(source),
                Done::Function(loaded) => {
                    if let Some(document) = &mut self.document {
                        self.readout.notices.extend(document.take_function(loaded));
                    }
                }
                Done::Saved(path, state) => {
                    self.readout.notices = vec![format!("saved {}", path.display())];
                    if let Some(document) = &mut self.document {
                        document.saved_to(path, *state);
                    }
                }
                Done::Picked(purpose, path) => self.commands.push(Command::UseFile(purpose, path)),
                Done::Said(line) => self.readout.notices.push(line),
                Done::Failed(line) => self.errors.push(line),
            }
        }
        while let Some(answer) = self.render.answer() {
            self.take(context, answer);
        }
    }

    fn take(&mut self, context: &Context, answer: Answer) {
        match answer {
            Ok(frame) => {
                self.picture.take(context, &frame);
                self.readout.take(&frame);
            }
            Err(line) => {
                self.readout.failed();
                if !self.errors.contains(&line) {
                    self.errors.push(line);
                }
            }
        }
    }

    /// Waits a moment for the first frame of what was just asked for, where the processor that renders it also draws the
    /// window: it would otherwise draw, and draw again as the pointer moves, what nobody needs, and be late with both. The
    /// frame is still shown in this drawing of the window, together with what lies over it.
    fn take_turns(&mut self, context: &Context) {
        let Some(serial) = self.awaited.take().filter(|_| self.takes_turns) else { return };
        let deadline = Instant::now() + TURN;
        while let Some(answer) = self.render.answer_before(deadline) {
            let is_late = matches!(&answer, Ok(frame) if frame.serial < serial);
            self.take(context, answer);
            if !is_late {
                return;
            }
        }
    }

    fn opened(&mut self, opened: Opened) {
        let Opened { volume, state, solids, path, viewer, notices } = opened;
        self.document = Some(Document::new(volume, state, solids, path));
        self.picture.clear();
        self.panels.opened(viewer.as_ref());
        if let Some(notes) = viewer {
            self.picture.overlays = notes.overlays;
        }
        self.readout.notices = notices;
        self.asked = None;
    }

    /// The picture and what lies over it.
    fn show_picture(&mut self, ui: &mut Ui) {
        let dark = ui.visuals().dark_mode;
        let (background, ink) = if dark {
            (Color32::from_gray(18), Color32::from_gray(220))
        } else {
            (Color32::from_gray(235), Color32::from_gray(40))
        };
        let Some(document) = &mut self.document else {
            self.picture.show(ui, background);
            return;
        };
        let response = self.picture.show(ui, background);
        let projection = Projection::new(&document.state().camera, response.rect);
        let taken = self.panels.in_picture(ui, &response, &projection, document, &mut self.commands);
        if !taken {
            let clicked = response.clicked().then(|| response.interact_pointer_pos()).flatten();
            let face = clicked.filter(|_| self.picture.overlays.orientation_cube);
            let face = face.and_then(|at| picture::cube_face(&projection, at));
            if let Some(direction) = face {
                look_from(document, direction, response.rect.aspect_ratio());
            } else if let Some(at) = clicked.filter(|_| !self.panels.slices.measuring) {
                select(document, &projection.ray(at));
            }
            let mut camera = document.state().camera.clone();
            if picture::navigate(ui, &response, &mut camera) == picture::Moved::Yes {
                document.look(|c| *c = camera);
            }
        }
        let state = document.state();
        let projection = Projection::new(&state.camera, response.rect);
        let focal = DVec3::from_array(state.camera.focal_point);
        let painter = ui.painter_at(response.rect);
        self.picture.overlays.paint(&painter, &projection, document.volume().lattice(), focal, ink);
        let place = |p| projection.point(p);
        let unit = slices::unit(document.volume().lattice().geometry().frame);
        self.panels.slices.draw_measure(&painter, &place, unit);
        if self.panels.slices.visible {
            self.panels.slices.draw_crosshair(&painter, &place, document.volume().lattice());
        }
        self.point(ui, &response, &projection);
        self.request(&response, ui.ctx().pixels_per_point());
    }

    /// What the pointer finds in the picture: the value under it, and the points that it measures between.
    fn point(&mut self, ui: &Ui, response: &egui::Response, projection: &Projection) {
        let Some(document) = &self.document else { return };
        let slices = &mut self.panels.slices;
        let moved = ui.input(|i| i.pointer.delta() != egui::Vec2::ZERO && !i.pointer.any_down());
        if let Some(at) = response.hover_pos().filter(|_| moved) {
            let found = slices::pick(document, &projection.ray(at));
            slices.hover = found.and_then(|p| slices::Probe::at(document.volume().lattice(), p));
        }
        let clicked = (response.clicked() && slices.measuring) || response.double_clicked();
        if let Some(at) = response.interact_pointer_pos().filter(|_| clicked)
            && let Some(point) = slices::pick(document, &projection.ray(at))
        {
            if slices.measuring {
                slices.measure.take(point);
            } else {
                slices.crosshair = Some(point);
            }
        }
    }

    /// Asks for a picture where the last one is not of what is open now.
    fn request(&mut self, response: &egui::Response, scale: f32) {
        let Some(document) = &self.document else { return };
        let pixels = |points: f32| ((points * scale).round() as u32).clamp(1, 8192);
        let size = [pixels(response.rect.width()), pixels(response.rect.height())];
        let same = |asked: &Asked| asked.size == size && asked.debug == self.debug && asked.is_of(document);
        if self.asked.as_ref().is_some_and(same) {
            return;
        }
        let asked = Asked {
            volume: Arc::as_ptr(document.volume()),
            state: document.state().clone(),
            size,
            debug: self.debug,
            solids: document.solids.len(),
        };
        let request = Request {
            volume: document.volume().clone(),
            state: asked.state.clone(),
            clip: document.clip(),
            size,
            debug: self.debug,
        };
        self.readout.asked();
        self.awaited = Some(self.render.request(request));
        self.asked = Some(asked);
    }

    /// Has surfaces read that are named but not there: of hidden operands, of another tolerance, of what was undone.
    fn read_solids(&mut self) {
        let Some(document) = &self.document else { return };
        for (_, source) in document.state().cutting.objects() {
            if document.solids.get(source).is_none() && !self.reading.contains(source) {
                self.reading.push(source.clone());
                self.jobs.read_solid(source.clone());
            }
        }
    }

    fn show_errors(&mut self, ui: &mut Ui) {
        let mut dismissed = None;
        for (index, line) in self.errors.iter().enumerate() {
            ui.horizontal_wrapped(|ui| {
                ui.colored_label(ui.visuals().error_fg_color, line);
                if ui.button("Dismiss").clicked() {
                    dismissed = Some(index);
                }
            });
        }
        if let Some(index) = dismissed {
            self.errors.remove(index);
        }
    }
}

/// Looks at the whole volume along `-direction`.
fn look_from(document: &mut Document, direction: DVec3, aspect: f32) {
    let views = navigation::StandardView::ALL;
    let volume = document.volume().clone();
    let along = |view: &navigation::StandardView| {
        let camera = view.camera(volume.lattice(), 1.0, &document.state().camera);
        camera.axes().forward.dot(-direction)
    };
    let nearest = views.into_iter().max_by(|a, b| along(a).total_cmp(&along(b)));
    if let Some(view) = nearest {
        let camera = view.camera(volume.lattice(), f64::from(aspect), &document.state().camera);
        document.look(|c| *c = camera);
    }
}

/// Selects the object that is seen along a ray, if there is one.
fn select(document: &mut Document, ray: &Ray) {
    // Projections have no front: whatever cuts is as good as seen.
    let hides = matches!(document.state().settings.mode, Mode::Composite | Mode::Iso);
    let opaque = if hides { slices::pick(document, ray) } else { None };
    document.select_along(ray, opaque);
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, RECENT, &self.recent);
    }
}

impl App {
    /// The frame of panels. A window has their colour where nothing is drawn: to fill them as well takes time.
    fn panel_frame(&self, style: &egui::Style) -> egui::Frame {
        let frame = egui::Frame::side_top_panel(style);
        if self.has_window { frame.fill(Color32::TRANSPARENT) } else { frame }
    }

    /// Draws the window and does what it is asked for.
    pub fn show(&mut self, ui: &mut Ui) {
        let context = ui.ctx().clone();
        self.take_in(&context);
        self.keys(&context);
        for file in context.input(|i| i.raw.dropped_files.clone()) {
            self.dropped(file.path());
        }
        let frame = self.panel_frame(ui.style());
        egui::Panel::top("menu").frame(frame).show(ui, |ui| self.show_menu(ui));
        if !self.errors.is_empty() {
            egui::Panel::top("errors").frame(frame).show(ui, |ui| self.show_errors(ui));
        }
        egui::Panel::bottom("read-out").frame(frame).show(ui, |ui| {
            self.exports.retain(|export| !export.is_finished());
            self.exports.iter().for_each(|export| export.show(ui));
            let hover = self.panels.slices.hover;
            self.readout.show(ui, self.document.as_ref(), hover, self.jobs.is_busy());
        });
        if let Some(document) = &mut self.document {
            let panel = egui::Panel::right("panels").frame(frame).default_size(330.0).resizable(true);
            panel.show(ui, |ui| self.panels.show(ui, document, &mut self.commands));
        }
        if let Some(document) = self.document.as_ref().filter(|_| self.panels.slices.visible) {
            let panel = egui::Panel::right("slices").frame(frame).default_size(330.0).resizable(true);
            panel.show(ui, |ui| self.panels.slices.show(ui, document));
        }
        egui::CentralPanel::no_frame().show(ui, |ui| self.show_picture(ui));
        if self.show_help {
            keys::show_help(&context, &mut self.show_help);
        }
        self.do_commands(&context);
        self.take_turns(&context);
        if !context.input(|i| i.pointer.any_down()) {
            self.read_solids();
        }
        if context.input(|i| i.pointer.any_released())
            && let Some(document) = &mut self.document
        {
            document.settle();
        }
    }
}
