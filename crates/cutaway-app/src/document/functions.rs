//! Transfer functions of files, in and out of a document.

use std::path::Path;

use cutaway_core::lighting::Lighting;
use cutaway_core::scene::default_unit_distance;
use cutaway_io::transfer_function::{
    FunctionFile, FunctionFormat, read_transfer_function, write_transfer_function,
};

use cutaway_io::volume::Loaded;

use super::Document;
use crate::function;

impl Document {
    /// Takes the function of a file, in one step: its points, unit distance and light where it has them. A colour map without
    /// opacities is laid over the window of the present function, whose opacities stay. Returns what there is to know of the
    /// file, one line each.
    pub fn take_function(&mut self, loaded: Loaded<FunctionFile>) -> Vec<String> {
        let (file, mut notices) = (loaded.value, loaded.notices);
        let range = self.volume().lattice().value_range();
        self.settle();
        if file.has_opacities {
            self.edit("function: open", |s| {
                s.function = file.function;
                s.unit_distance = file.unit_distance;
                if let Some(light) = file.lighting {
                    // Files know no direction and no curve.
                    let Lighting { diffuse_curve, wrap_power, light: towards, .. } = s.lighting.clone();
                    s.lighting = Lighting { diffuse_curve, wrap_power, light: towards, ..light };
                }
            });
        } else if let Some(colored) = function::with_colors_of(&self.state().function, &file.function, range)
        {
            notices.retain(|notice| !notice.contains("no opacities"));
            self.edit("function: open", |s| s.function = colored);
        }
        self.settle();
        notices
    }

    /// Returns the function as a file of this name holds it, with its light where the format has one.
    pub fn function_file(&self, path: &Path) -> FunctionFile {
        let state = self.state();
        let name = path.file_name().and_then(|name| name.to_str());
        let stem = name.and_then(|name| name.split('.').next()).filter(|stem| !stem.is_empty());
        let other = FunctionFormat::of_name(path) != Some(FunctionFormat::Cutaway);
        // Other programs do not know this volume's spacing.
        let of_volume = other.then(|| default_unit_distance(self.volume().lattice()));
        FunctionFile {
            // ParaView's maps have no light, and nobody asked to be told.
            lighting: (FunctionFormat::of_name(path) != Some(FunctionFormat::ParaView) && other)
                .then(|| state.lighting.clone()),
            name: stem.map(str::to_owned),
            ..FunctionFile::new(state.function.clone(), state.unit_distance.or(of_volume))
        }
    }
}

/// Reads a transfer function.
///
/// # Errors
/// One line: the file, the place, what is wrong.
pub fn read(path: &Path) -> Result<Loaded<FunctionFile>, String> {
    read_transfer_function(path).map_err(|e| e.to_string())
}

/// Writes a transfer function in the format that the file's name asks for. Returns what the format cannot hold, one line each.
///
/// # Errors
/// One line: the file, and why it was not written.
pub fn write(path: &Path, file: &FunctionFile) -> Result<Vec<String>, String> {
    write_transfer_function(path, file).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::{OpenVolume, SceneState, Solids};
    use super::*;
    use std::sync::Arc;

    fn document() -> Document {
        let volume = Arc::new(OpenVolume::read("sample:sphere:16").unwrap());
        let state = SceneState::of_volume(volume.lattice());
        Document::new(volume, state, Solids::default(), None)
    }

    #[test]
    fn what_is_saved_is_opened_again_in_one_step() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.json", "a.pv.json", "a.vp", "a.vp.json"] {
            let path = folder.path().join(name);
            let saved = document();
            write(&path, &saved.function_file(&path)).unwrap();
            let mut opened = document();
            opened.edit("x", |s| {
                s.function = function::shifted(&s.function, 7.0);
                s.lighting.ambient = 0.5;
            });
            let before = opened.state().clone();
            opened.take_function(read(&path).unwrap());
            let (points, expected) = (opened.state().function.points(), saved.state().function.points());
            assert_eq!(points.len(), expected.len(), "{name}");
            assert!(points.iter().zip(expected).all(|(a, b)| a.value == b.value && a.color == b.color));
            let light = if name.contains("vp") { 0.1 } else { 0.5 };
            assert_eq!(opened.state().lighting.ambient, light, "{name}");
            assert!(opened.undo());
            assert_eq!(opened.state(), &before);
        }
        let path = folder.path().join("a.txt");
        assert!(write(&path, &document().function_file(&path)).unwrap_err().contains(".vp"));
        let error = read(&folder.path().join("none.vp")).unwrap_err();
        assert!(error.contains("none.vp") && !error.contains('\n'), "{error}");
    }

    #[test]
    fn a_map_without_opacities_colours_what_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.json");
        std::fs::write(&path, r#"[{"Name": "m", "RGBPoints": [0, 1, 0, 0, 1, 0, 0, 1]}]"#).unwrap();
        let mut document = document();
        let before = document.state().function.clone();
        assert!(document.take_function(read(&path).unwrap()).is_empty());
        let [lo, hi] = function::window(&before);
        let after = &document.state().function;
        assert_eq!((after.evaluate(lo).0, after.evaluate(hi).0), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
        for value in [lo, 0.3 * lo + 0.7 * hi, hi] {
            assert!((after.evaluate(value).1 - before.evaluate(value).1).abs() < 1e-9);
        }
    }
}
