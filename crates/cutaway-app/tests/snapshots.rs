//! What panels look like: a few small pictures, drawn by a software adapter where there is one. They show as ignored where
//! there is no adapter at all. CONTRIBUTING.md says how they are renewed.

use std::sync::Arc;

use cutaway_app::cutting::Content;
use cutaway_app::cutting::defaults::Shape;
use cutaway_app::document::{Document, OpenVolume, SceneState, Solids};
use cutaway_app::panels::{CuttingPanel, FunctionPanel, LightPanel};
use cutaway_app::slices::Slices;
use cutaway_core::glam::DVec3;
use cutaway_gpu::context::adapters;
use egui::Ui;
use egui_kittest::{Harness, SnapshotOptions};
use libtest_mimic::{Arguments, Failed, Trial};

/// Pixels that may be off: rasterisers round the ends of slanted lines differently.
const MOST_OFF: usize = 12;

/// A picture to compare.
type Case = fn() -> Result<(), Failed>;

fn main() {
    let arguments = Arguments::from_args();
    let there = !adapters().is_empty();
    if !there {
        eprintln!(
            "no GPU adapter: pictures of panels are not compared (a software one: mesa-vulkan-drivers)"
        );
    }
    let cases: [(&str, Case); 4] = [
        ("transfer_function", transfer_function),
        ("cutting", cutting),
        ("light", light),
        ("slices", slices),
    ];
    let trials = cases.map(|(name, test)| Trial::test(name, test).with_ignored_flag(!there));
    libtest_mimic::run(&arguments, trials.into()).exit();
}

fn document() -> Document {
    let volume = Arc::new(OpenVolume::read("sample:sphere:24").expect("a sample"));
    let state = SceneState::of_volume(volume.lattice());
    Document::new(volume, state, Solids::default(), None)
}

/// Holds what `show` draws against `tests/snapshots/NAME.png`.
fn looks_as_before(
    name: &str,
    size: [f32; 2],
    document: Document,
    mut show: impl FnMut(&mut Ui, &mut Document),
) -> Result<(), Failed> {
    let builder = Harness::builder().with_size(size).with_theme(egui::Theme::Dark).wgpu();
    let mut harness = builder.build_ui_state(move |ui, document| show(ui, document), document);
    // The first frames measure what later ones place.
    harness.run_steps(4);
    let options = SnapshotOptions::new().max_failed_pixels(MOST_OFF);
    Ok(harness.try_snapshot_options(name, &options)?)
}

fn transfer_function() -> Result<(), Failed> {
    let (mut panel, mut commands) = (FunctionPanel::default(), Vec::new());
    looks_as_before("transfer_function", [330.0, 400.0], document(), move |ui, document| {
        panel.show(ui, document, &mut commands);
    })
}

fn cutting() -> Result<(), Failed> {
    let mut document = document();
    document.add_operand(Content::Group(Vec::new()));
    for shape in [Shape::Sphere, Shape::Box] {
        document.add_shape(shape)?;
    }
    let (mut panel, mut commands) = (CuttingPanel::default(), Vec::new());
    looks_as_before("cutting", [330.0, 440.0], document, move |ui, document| {
        panel.show(ui, document, &mut commands);
    })
}

fn light() -> Result<(), Failed> {
    let (mut panel, mut commands) = (LightPanel::default(), Vec::new());
    looks_as_before("light", [330.0, 240.0], document(), move |ui, document| {
        panel.show(ui, document, &mut commands);
    })
}

fn slices() -> Result<(), Failed> {
    let mut document = document();
    document.add_shape(Shape::Sphere)?;
    let center = document.volume().lattice().center_in_world();
    let mut slices = Slices::default();
    slices.crosshair = Some(center + DVec3::new(2.0, 1.0, -1.0));
    looks_as_before("slices", [220.0, 420.0], document, move |ui, document| slices.show(ui, document))
}
