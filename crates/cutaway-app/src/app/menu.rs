//! The menu.

use cutaway_core::scene::Engine;
use egui::Ui;

use super::App;
use crate::command::{Command, Purpose};
use crate::picture::navigation::{self, StandardView};
use crate::render::DebugView;

impl App {
    pub(super) fn show_menu(&mut self, ui: &mut Ui) {
        egui::MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| self.file_menu(ui));
            ui.menu_button("Edit", |ui| self.edit_menu(ui));
            ui.menu_button("View", |ui| self.view_menu(ui));
            ui.menu_button("Engine", |ui| self.engine_menu(ui));
            ui.menu_button("Help", |ui| {
                if ui.button("Keys and pointer  ?").clicked() {
                    self.show_help = true;
                }
            });
        });
    }

    fn file_menu(&mut self, ui: &mut Ui) {
        let items = [
            ("Open a volume or a scene...", Command::PickFile(Purpose::Open)),
            ("Save the scene", Command::Save),
            ("Save the scene as...", Command::PickFile(Purpose::SaveScene)),
            ("Save a picture...", Command::PickFile(Purpose::SaveImage)),
            ("Save a turntable film...", Command::PickFile(Purpose::SaveFilm)),
            ("Copy the command line", Command::CopyCommandLine),
        ];
        for (label, command) in items {
            if ui.button(label).clicked() {
                self.ask(command);
            }
        }
        ui.menu_button("Open a sample", |ui| {
            for name in cutaway_io::samples::names() {
                let about = cutaway_io::samples::about(name).unwrap_or_default();
                if ui.button(name).on_hover_text(about).clicked() {
                    self.open(format!("sample:{name}"));
                }
            }
        });
        ui.menu_button("Open recent", |ui| {
            let recent = self.recent.clone();
            if recent.is_empty() {
                ui.weak("nothing yet");
            }
            for name in recent {
                if ui.button(&name).clicked() {
                    self.open(name);
                }
            }
        });
        if ui.button("Quit").clicked() {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    fn edit_menu(&mut self, ui: &mut Ui) {
        let Some(document) = &mut self.document else { return };
        let (undo, redo) = (document.history().can_undo(), document.history().can_redo());
        if ui.add_enabled(undo, egui::Button::new("Undo")).clicked() {
            document.undo();
        }
        if ui.add_enabled(redo, egui::Button::new("Redo")).clicked() {
            document.redo();
        }
    }

    fn view_menu(&mut self, ui: &mut Ui) {
        if ui.button("Whole volume").clicked() {
            self.reset_view();
        }
        if let Some(document) = &mut self.document {
            let frame = document.volume().lattice().geometry().frame;
            let mut chosen = None;
            for view in StandardView::ALL {
                if ui.button(view.name(frame)).clicked() {
                    chosen = Some(view);
                }
            }
            let mut orthographic = document.state().camera.orthographic.is_some();
            if ui.checkbox(&mut orthographic, "Orthographic").changed() {
                document.look(navigation::toggle_orthographic);
            }
            if let Some(view) = chosen {
                self.look_from(view);
            }
        }
        ui.separator();
        let overlays = &mut self.picture.overlays;
        ui.checkbox(&mut overlays.bounding_box, "Bounding box");
        ui.checkbox(&mut overlays.orientation_cube, "Orientation cube");
        ui.checkbox(&mut overlays.scale_bar, "Scale bar");
        ui.separator();
        for (view, name) in [(DebugView::Fetches, "Fetch counts"), (DebugView::Wireframe, "Proxy wireframe")]
        {
            let mut on = self.debug == view;
            if ui.checkbox(&mut on, name).changed() {
                self.toggle_debug(view);
            }
        }
        ui.separator();
        let mut theme = ui.ctx().options(|o| o.theme_preference);
        for (preference, name) in [
            (egui::ThemePreference::Dark, "Dark"),
            (egui::ThemePreference::Light, "Light"),
            (egui::ThemePreference::System, "As the system"),
        ] {
            if ui.radio_value(&mut theme, preference, name).clicked() {
                ui.ctx().set_theme(preference);
            }
        }
    }

    fn engine_menu(&mut self, ui: &mut Ui) {
        let Some(document) = &mut self.document else { return };
        let current = document.state().settings.engine;
        let engines =
            [Engine::Auto, Engine::Cpu, Engine::Raycast, Engine::Slices, Engine::Cells, Engine::Reference];
        for engine in engines {
            if ui.radio(current == engine, engine.name()).clicked() {
                document.edit("engine", |state| state.settings.engine = engine);
                document.settle();
            }
        }
    }
}
