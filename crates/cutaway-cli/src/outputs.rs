//! Where results go, checked before any work: a render of minutes should not end in a missing folder, nor leave one of
//! two files behind.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::bail;
use cutaway_io::image::ImageFormat;

use crate::report::wrong_use;

/// Extensions of films, which the interface names and later versions will write.
const FILMS: [&str; 8] = ["mp4", "gif", "webm", "mov", "mkv", "avi", "apng", "ogv"];

/// Files that a command is going to write, by the option that names them, and files that it reads.
#[derive(Default)]
pub(crate) struct Outputs<'a> {
    files: Vec<(&'static str, &'a Path)>,
    inputs: Vec<&'a Path>,
}

impl<'a> Outputs<'a> {
    /// A file to write.
    pub(crate) fn file(&mut self, option: &'static str, path: &'a Path) -> anyhow::Result<()> {
        if path.as_os_str().is_empty() {
            return Err(wrong_use(format!("{option} is empty; give a file name")));
        }
        if path == Path::new("-") {
            return Err(wrong_use(format!("{option} cannot be `-`; give a file name")));
        }
        self.files.push((option, path));
        Ok(())
    }

    /// An image to write, in a format that this version has.
    pub(crate) fn image(&mut self, option: &'static str, path: &'a Path) -> anyhow::Result<()> {
        self.file(option, path)?;
        image_format(option, path)
    }

    /// A file that is read and must not be overwritten.
    pub(crate) fn input(&mut self, path: &'a Path) {
        self.inputs.push(path);
    }

    /// Whether all files can be written, as far as can be told beforehand.
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        let mut places: Vec<(&str, PathBuf)> = Vec::new();
        for (option, path) in &self.files {
            let place = place(path)?;
            if place.exists() && !place.is_file() {
                // A device or a pipe takes whatever comes.
                continue;
            }
            if let Some((other, _)) = places.iter().find(|(_, there)| *there == place) {
                return Err(wrong_use(format!(
                    "{other} and {option} both write '{}'; give them different names",
                    path.display()
                )));
            }
            if self.inputs.iter().any(|input| input.canonicalize().is_ok_and(|input| input == place)) {
                return Err(wrong_use(format!(
                    "{option} would overwrite '{}', which is read; give another name",
                    path.display()
                )));
            }
            places.push((option, place));
        }
        Ok(())
    }
}

fn image_format(option: &str, path: &Path) -> anyhow::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if name.contains("{frame") {
        return Err(wrong_use(format!(
            "{option} '{}': names with {{frame}} are for --turntable, which does not exist in this version of cutaway; \
             give the name of one image",
            path.display()
        )));
    }
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
    if FILMS.contains(&extension.as_str()) {
        return Err(wrong_use(format!(
            "{option} '{}': films do not exist in this version of cutaway; write .png, .exr or .npy",
            path.display()
        )));
    }
    ImageFormat::from_path(path).map(drop).map_err(|e| wrong_use(format!("{option} {e}")))
}

/// The path with its folder's links resolved. The folder must exist, and a file be possible under that name.
fn place(path: &Path) -> anyhow::Result<PathBuf> {
    let shown = path.display();
    let slash_last =
        path.as_os_str().as_encoded_bytes().last().is_some_and(|&b| std::path::is_separator(b.into()));
    let (Some(name), Some(parent), false) = (path.file_name(), path.parent(), path.is_dir() || slash_last)
    else {
        bail!("cannot write '{shown}': it is a folder; give the name of a file in it");
    };
    let folder = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    match folder.canonicalize() {
        Ok(folder) if folder.is_dir() => {
            let file = folder.join(name);
            // A link and what it names are one file.
            let file = file.canonicalize().unwrap_or(file);
            if file.exists() && !file.is_file() {
                return Ok(file);
            }
            if file.metadata().is_ok_and(|found| found.is_file() && found.permissions().readonly()) {
                bail!("cannot write '{shown}': the file that is there is read-only");
            }
            // A file without a name, gone at once: only trying tells about permissions and read-only disks.
            if let Err(error) = tempfile::tempfile_in(&folder) {
                bail!("cannot write '{shown}': no new file in its folder: {}", error.kind());
            }
            Ok(file)
        }
        Ok(_) => bail!("cannot write '{shown}': '{}' is not a folder", folder.display()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            bail!("cannot write '{shown}': the folder '{}' does not exist; create it first", folder.display())
        }
        Err(error) => bail!("cannot write '{shown}': looking for its folder: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_options_cannot_name_one_file() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a.png"), folder.path().join(".").join("a.png"));
        let mut outputs = Outputs::default();
        outputs.image("--output", &a).unwrap();
        outputs.check().unwrap();
        outputs.image("--depth-output", &b).unwrap();
        assert!(outputs.check().unwrap_err().to_string().contains("--output and --depth-output both write"));
    }

    #[test]
    fn devices_may_be_written() {
        let mut outputs = Outputs::default();
        outputs.file("--stats", Path::new("/dev/null")).unwrap();
        if cfg!(unix) {
            outputs.check().unwrap();
        }
    }

    #[test]
    fn what_later_versions_write_is_refused_by_name() {
        for (name, says) in [
            ("spin.MP4", "films"),
            ("frame_{frame:04}.png", "--turntable"),
            ("a.jpg", "'.jpg'"),
            ("-", "`-`"),
        ] {
            let error = Outputs::default().image("--output", Path::new(name)).unwrap_err();
            assert!(error.to_string().contains(says), "{error}");
        }
    }
}
