//! Between a document and a scene file.
//!
//! Paths in a file are relative to its folder where what they name lies in or below that, so that all of it can be moved
//! together, else absolute; in a document they are absolute.

use std::path::Path;

use cutaway_core::defaults::{Look, default_view};
use cutaway_core::scene::Data;
use cutaway_core::transfer_function::TransferFunction;
use cutaway_io::scene_file::{ClipFile, SceneFile, paths, read_scene};
use cutaway_io::transfer_function::TransferFunctionFile;

use super::{Document, SceneState};
use crate::cutting::notes::CuttingNotes;

/// Where what is kept for a viewer has the list of operands.
const CUTTING: &str = "cutting";

/// A scene file with paths that are good from anywhere.
///
/// # Errors
/// One line: the file, the place, what is wrong.
pub fn read(path: &Path) -> Result<SceneFile, String> {
    let mut file = read_scene(path).map_err(|e| e.to_string())?;
    let scene = std::path::absolute(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let from_here = |named: &str| paths::from_scene(named, &scene).map_err(|e| e.to_string());
    if !file.volume.is_sample() {
        if file.volume.path().is_empty() {
            let name = path.display();
            return Err(format!(
                "{name}: `volume` is empty; give a path, relative to the scene file, or `sample:NAME`"
            ));
        }
        file.volume = file.volume.with_path(from_here(file.volume.path())?);
    }
    if let Some(ClipFile(clip)) = &mut file.clip {
        paths::map_paths(clip, &mut |named| from_here(named))?;
    }
    if let Some(mut notes) = cutting_notes(&file) {
        map_noted_paths(&mut notes, &mut |named| from_here(named))?;
        note_cutting(&mut file.viewer, &notes);
    }
    Ok(file)
}

/// The state that a scene file asks for, of its volume. The file's paths must be good from here.
///
/// # Errors
/// What is wrong with it, in a line.
pub fn state_of(file: &SceneFile, data: &Data) -> Result<SceneState, String> {
    let volume = data.lattice();
    let mut state = SceneState::of_volume(volume);
    if let Some(function) = &file.transfer_function {
        state.function = TransferFunction::new(function.points.clone()).map_err(|e| e.to_string())?;
        state.unit_distance = function.unit_distance;
    } else {
        state.function = cutaway_core::histogram::default_for_mode(volume, file.render.mode);
    }
    let render = &file.render;
    if let Some(camera) = &file.camera {
        camera.validate().map_err(|e| e.to_string())?;
        state.camera = camera.clone();
    } else {
        let (function, mode) = (&state.function, render.mode);
        let look = Look { volume, function, mode, iso: &render.iso, clip: None };
        state.camera = default_view(&look, None, 1.0).camera;
    }
    state.lighting = file.lighting.clone();
    state.settings = file.render.clone();
    // Without notes, or where somebody has changed the tree beside them, the tree is all there is.
    let notes = cutting_notes(file).unwrap_or_default();
    state.cutting =
        notes.restore(file.clip.as_ref().map(|ClipFile(tree)| tree), volume, file.clip_shading.clone());
    // Every number is checked where a scene is made of it.
    state.scene(data, None, [1, 1]).map_err(|e| e.to_string())?;
    Ok(state)
}

/// The document as the scene file at `path` is to have it.
///
/// # Errors
/// A path that a scene file cannot hold.
pub fn file_of(document: &Document, path: &Path) -> Result<SceneFile, String> {
    let (state, open) = (document.state(), document.volume());
    let mut clip = state.cutting.to_clip(open.lattice());
    if let Some(clip) = &mut clip {
        paths::map_paths(clip, &mut |named| relative(named, path))?;
    }
    let source = if open.source.is_sample() {
        open.source.clone()
    } else {
        open.source.with_path(relative(open.source.path(), path)?)
    };
    Ok(SceneFile {
        volume: source,
        nan: open.nan,
        transfer_function: Some(TransferFunctionFile {
            unit_distance: state.unit_distance,
            points: state.function.points().to_vec(),
        }),
        camera: Some(state.camera.clone()),
        lighting: state.lighting.clone(),
        clip: clip.map(ClipFile),
        clip_shading: state.cutting.shading.clone(),
        render: state.settings.clone(),
        viewer: None,
    })
}

/// Returns the text of the document's scene file at `path`, with what a viewer keeps in it.
///
/// # Errors
/// One line: the file, and what is wrong.
pub fn text_of(
    document: &Document,
    path: &Path,
    viewer: Option<serde_json::Value>,
) -> Result<String, String> {
    let mut file = SceneFile { viewer, ..file_of(document, path)? };
    let mut notes = CuttingNotes::new(&document.state().cutting);
    if !notes.is_empty() {
        map_noted_paths(&mut notes, &mut |named| relative(named, path))?;
        note_cutting(&mut file.viewer, &notes);
    }
    let mut text = serde_json::to_string_pretty(&file).map_err(|e| format!("{}: {e}", path.display()))?;
    text.push('\n');
    Ok(text)
}

/// Writes the text of a scene file: whole, or not at all.
///
/// # Errors
/// One line: the file, and what is wrong.
pub fn write(path: &Path, text: &str) -> Result<(), String> {
    use std::io::Write;
    cutaway_io::atomic::write_atomically(path, |out| out.write_all(text.as_bytes()))
        .map_err(|e| e.to_string())
}

/// The list of operands that is kept for a viewer; none where there is none, or another program's.
fn cutting_notes(file: &SceneFile) -> Option<CuttingNotes> {
    serde_json::from_value(file.viewer.as_ref()?.get(CUTTING)?.clone()).ok()
}

fn note_cutting(viewer: &mut Option<serde_json::Value>, notes: &CuttingNotes) {
    let viewer = viewer.get_or_insert_with(|| serde_json::json!({}));
    if let (Some(fields), Ok(notes)) = (viewer.as_object_mut(), serde_json::to_value(notes)) {
        fields.insert(CUTTING.to_owned(), notes);
    }
}

fn map_noted_paths(
    notes: &mut CuttingNotes,
    change: &mut dyn FnMut(&str) -> Result<String, String>,
) -> Result<(), String> {
    let mut result = Ok(());
    notes.visit_paths(&mut |path| match change(path) {
        Ok(changed) => *path = changed,
        Err(error) => result = Err(error),
    });
    result
}

fn relative(named: &str, scene: &Path) -> Result<String, String> {
    paths::in_scene(Path::new(named), scene).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use cutaway_core::volume::Volume;
    use cutaway_io::scene_file::{ClipSource, ClipTree};

    use super::*;
    use crate::cutting::Cutting;
    use crate::cutting::defaults::Shape;
    use crate::cutting::edit::Place;
    use crate::cutting::{Content, Operation};
    use crate::testing::document;

    /// The document's list as a scene file brings it back, after `change` was done to that.
    fn reopened(document: &mut Document, change: impl FnOnce(&mut SceneFile)) -> Cutting {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.json");
        let text = text_of(document, &path, Some(serde_json::json!({ "overlays": {} }))).unwrap();
        write(&path, &text).unwrap();
        document.saved_to(path.clone(), document.state().clone());
        let mut file = read(&path).unwrap();
        assert!(file.viewer.as_ref().is_some_and(|viewer| viewer.get("overlays").is_some()));
        change(&mut file);
        state_of(&file, &document.volume().data).unwrap().cutting
    }

    /// A named group of a mesh and a ball that is hidden, beside a box that is alone.
    fn edited() -> Document {
        let mut document = document();
        let group = document.add_operand(Content::Group(Vec::new())).unwrap();
        document.add_solid(ClipSource::Mesh {
            path: "/data/bunny.ply".to_owned(),
            space: cutaway_io::mesh::MeshSpace::Lps,
        });
        let ball = document.add_shape(Shape::Sphere).unwrap().unwrap();
        document.cut("edit", |cutting| {
            cutting.get_mut(group).unwrap().name = "head".to_owned();
            cutting.get_mut(ball).unwrap().visible = false;
            let cube = Shape::Box.for_volume(&document_volume(), cutaway_core::glam::DVec3::Z).unwrap();
            cutting.solo = Some(cutting.add(Content::Object(cube), Operation::Keep, Place::END));
        });
        document
    }

    fn document_volume() -> Volume {
        document().volume().lattice().clone()
    }

    #[test]
    fn names_groups_hidden_operands_and_solo_are_in_a_scene_file() {
        let mut document = edited();
        let before = CuttingNotes::new(&document.state().cutting);
        let again = reopened(&mut document, |_| {});
        assert_eq!(CuttingNotes::new(&again), before);
        assert_eq!(again.objects().len(), 3);
        assert!(!document.is_changed());
    }

    #[test]
    fn a_tree_that_was_changed_beside_the_notes_counts() {
        let other = Shape::Sphere.for_volume(&document_volume(), cutaway_core::glam::DVec3::X).unwrap();
        let clip = ClipTree::from(cutaway_core::clip::Node::Leaf(other));
        let again = reopened(&mut edited(), |file| file.clip = Some(ClipFile(clip.clone())));
        assert_eq!(again.to_clip(&document_volume()), Some(clip));
        let again = reopened(&mut edited(), |file| file.viewer = None);
        assert_eq!(again.operands.len(), 1, "only the one that is alone is in the tree: {again:?}");
    }

    #[test]
    fn notes_of_another_program_are_left_alone() {
        let mut document = edited();
        let clip = document.state().cutting.to_clip(&document_volume());
        let again = reopened(&mut document, |file| {
            file.viewer = Some(serde_json::json!({ "cutting": [1, 2, 3] }));
        });
        assert_eq!(again.to_clip(&document_volume()), clip);
    }
}
