//! Between a document and a scene file.
//!
//! Paths in a file are relative to its folder where what they name lies in or below that, so that all of it can be moved
//! together, else absolute; in a document they are absolute.

use std::path::Path;

use cutaway_core::clip::ClipFile;
use cutaway_core::scene::{SceneFile, TransferFunctionFile};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::Volume;
use cutaway_io::json::read_scene;

use super::load::{path_of, with_path};
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
    let folder = path.parent().unwrap_or(Path::new(""));
    let folder = std::path::absolute(folder).map_err(|e| format!("{}: {e}", path.display()))?;
    let from_here = |named: &str| {
        let here = folder.join(named).into_os_string().into_string();
        here.map_err(|_| format!("{}: the folder's name is not Unicode; rename the folder", path.display()))
    };
    if !path_of(&file.volume).starts_with("sample:") {
        if path_of(&file.volume).is_empty() {
            let name = path.display();
            return Err(format!(
                "{name}: `volume` is empty; give a path, relative to the scene file, or `sample:NAME`"
            ));
        }
        file.volume = with_path(&file.volume, &from_here(path_of(&file.volume))?);
    }
    if let Some(clip) = &mut file.clip {
        map_paths(clip, &mut |named| from_here(named))?;
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
pub fn state_of(file: &SceneFile, volume: &Volume) -> Result<SceneState, String> {
    let mut state = SceneState::of_volume(volume);
    if let Some(function) = &file.transfer_function {
        state.function = TransferFunction::new(function.points.clone()).map_err(|e| e.to_string())?;
        state.unit_distance = function.unit_distance;
    } else {
        state.function = cutaway_core::histogram::default_for_mode(volume, file.render.mode);
    }
    if let Some(camera) = &file.camera {
        camera.validate().map_err(|e| e.to_string())?;
        state.camera = camera.clone();
    }
    state.lighting = file.lighting.clone();
    state.settings = file.render.clone();
    // Without notes, or where somebody has changed the tree beside them, the tree is all there is.
    let notes = cutting_notes(file).unwrap_or_default();
    state.cutting = notes.restore(file.clip.as_ref(), volume, file.clip_shading.clone());
    // Every number is checked where a scene is made of it.
    state.scene(volume, None, [1, 1]).map_err(|e| e.to_string())?;
    Ok(state)
}

/// The document as the scene file at `path` is to have it.
///
/// # Errors
/// A path that a scene file cannot hold.
pub fn file_of(document: &Document, path: &Path) -> Result<SceneFile, String> {
    let (state, open) = (document.state(), document.volume());
    let mut clip = state.cutting.to_clip(&open.volume);
    if let Some(clip) = &mut clip {
        map_paths(clip, &mut |named| relative(named, path))?;
    }
    let source = match path_of(&open.source) {
        sample if sample.starts_with("sample:") => open.source.clone(),
        named => with_path(&open.source, &relative(named, path)?),
    };
    Ok(SceneFile {
        volume: source,
        transfer_function: Some(TransferFunctionFile {
            unit_distance: state.unit_distance,
            points: state.function.points().to_vec(),
        }),
        camera: Some(state.camera.clone()),
        lighting: state.lighting.clone(),
        clip,
        clip_shading: state.cutting.shading.clone(),
        render: state.settings.clone(),
        viewer: None,
    })
}

/// Writes the document as a scene file, with what a viewer keeps beside it: whole, or not at all.
///
/// # Errors
/// One line: the file, and what is wrong.
pub fn write(document: &mut Document, path: &Path, viewer: Option<serde_json::Value>) -> Result<(), String> {
    use std::io::Write;
    let mut file = SceneFile { viewer, ..file_of(document, path)? };
    let mut notes = CuttingNotes::new(&document.state().cutting);
    if !notes.is_empty() {
        map_noted_paths(&mut notes, &mut |named| relative(named, path))?;
        note_cutting(&mut file.viewer, &notes);
    }
    let mut text = serde_json::to_string_pretty(&file).map_err(|e| format!("{}: {e}", path.display()))?;
    text.push('\n');
    cutaway_io::atomic::write_atomically(path, |out| out.write_all(text.as_bytes()))
        .map_err(|e| e.to_string())?;
    document.saved_to(path.to_owned());
    Ok(())
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

fn map_paths(
    clip: &mut ClipFile,
    change: &mut dyn FnMut(&str) -> Result<String, String>,
) -> Result<(), String> {
    let mut result = Ok(());
    clip.visit_leaves(&mut |source, _| {
        if let (Some(path), true) = (source.path_mut(), result.is_ok()) {
            match change(path) {
                Ok(changed) => *path = changed,
                Err(error) => result = Err(error),
            }
        }
    });
    result
}

/// An absolute path as the scene file at `scene` names it.
fn relative(named: &str, scene: &Path) -> Result<String, String> {
    let scene = std::path::absolute(scene).map_err(|e| format!("{}: {e}", scene.display()))?;
    let below = scene.parent().and_then(|folder| Path::new(named).strip_prefix(folder).ok());
    let below = below.and_then(Path::to_str).filter(|path| !path.starts_with("sample:"));
    Ok(below.unwrap_or(named).to_owned())
}

#[cfg(test)]
mod tests {
    use cutaway_core::clip::ClipSource;

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
        write(document, &path, Some(serde_json::json!({ "overlays": {} }))).unwrap();
        let mut file = read(&path).unwrap();
        assert!(file.viewer.as_ref().is_some_and(|viewer| viewer.get("overlays").is_some()));
        change(&mut file);
        state_of(&file, &document.volume().volume).unwrap().cutting
    }

    /// A named group of a mesh and a ball that is hidden, beside a box that is alone.
    fn edited() -> Document {
        let mut document = document();
        let group = document.add_operand(Content::Group(Vec::new())).unwrap();
        document.add_solid(ClipSource::Mesh { path: "/data/bunny.ply".to_owned() });
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
        document().volume().volume.clone()
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
        let clip = ClipFile::from(cutaway_core::clip::Node::Leaf(other));
        let again = reopened(&mut edited(), |file| file.clip = Some(clip.clone()));
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
