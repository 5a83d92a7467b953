//! Shaders as their files are now, while the program runs: for whoever writes them.
//!
//! Enters: the folder of the files. Leaves: texts that take the place of what the build linked, from the next
//! [`Shader::module`](super::Shader::module) on. All of them or none: a file that does not link, or makes a text that naga
//! refuses, is an error with the file and the line, and what was there before stays.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock};
use std::time::{Duration, Instant, SystemTime};

use naga::valid::{Capabilities, ValidationFlags, Validator};
use wesl::{Diagnostic, ModulePath};

use super::link::{SHADERS, file, linker, module};

/// Texts by the paths of their shaders.
type Texts = BTreeMap<&'static str, String>;

/// What took the place of what the build linked. One for the process, as shaders are.
static NEWER: RwLock<Texts> = RwLock::new(Texts::new());

/// How often files are looked at, at most.
const INTERVAL: Duration = Duration::from_millis(500);

/// The text of a shader, where it is not the build's any more.
pub(super) fn newer(path: &str) -> Option<String> {
    NEWER.read().unwrap_or_else(PoisonError::into_inner).get(path).cloned()
}

/// Looks at the files of this crate's shaders.
#[derive(Debug)]
pub struct ShaderWatch {
    folder: PathBuf,
    /// The files when they were last looked at; none: not yet.
    seen: Option<Vec<(PathBuf, SystemTime)>>,
    last_look: Option<Instant>,
}

impl Default for ShaderWatch {
    /// Of the folder that this crate was built from.
    fn default() -> Self {
        Self::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
    }
}

impl ShaderWatch {
    /// How long to wait between calls of [`Self::poll`].
    pub const INTERVAL: Duration = INTERVAL;

    fn new(folder: PathBuf) -> Self {
        Self { folder, seen: None, last_look: None }
    }

    /// Whether a file has changed since the last call, so that renderers made before are out of date. Cheap where no
    /// file was written, and nothing at all sooner than [`Self::INTERVAL`] after the last look.
    ///
    /// # Errors
    /// One line, said once: the file, the line, and what is wrong with it.
    pub fn poll(&mut self) -> Result<bool, String> {
        if self.last_look.is_some_and(|last| last.elapsed() < INTERVAL) {
            return Ok(false);
        }
        self.last_look = Some(Instant::now());
        let Some(texts) = self.look()? else { return Ok(false) };
        *NEWER.write().unwrap_or_else(PoisonError::into_inner) = texts;
        Ok(true)
    }

    /// All shaders, where a file was written, added or removed since the last call; the first call only notes them.
    fn look(&mut self) -> Result<Option<Texts>, String> {
        let mut files = Vec::new();
        let listed = list(&self.folder, &mut files);
        files.sort();
        let before = self.seen.replace(files);
        match (listed, before) {
            // Said at first: a build that was moved away from its source sees no change.
            (Err(e), None) => Err(format!("shaders are not watched: {}: {e}", self.folder.display())),
            // A file that is just being replaced is there the next time.
            (Err(_), before) => {
                self.seen = before;
                Ok(None)
            }
            (Ok(()), None) => Ok(None),
            (Ok(()), before) if before == self.seen => Ok(None),
            (Ok(()), _) => link_all(&self.folder).map(Some),
        }
    }
}

/// The shaders' files below a folder, and when they were written.
fn list(folder: &Path, files: &mut Vec<(PathBuf, SystemTime)>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            list(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "wgsl") {
            let written = path.metadata()?.modified()?;
            files.push((path, written));
        }
    }
    Ok(())
}

fn link_all(folder: &Path) -> Result<Texts, String> {
    let linker = linker(folder);
    let link = |path: &&'static str| {
        let root = module(path);
        let linked = linker.compile(&root).map_err(|e| of_linker(e, folder, &root))?;
        let text = linked.to_string();
        let files = linked.modules.iter().chain([&root]).map(|module| file(folder, module));
        check(&text).map_err(|fault| fault.said(folder, &text, files))?;
        Ok((*path, text))
    };
    SHADERS.iter().map(link).collect()
}

/// `file:line`, from the folder on.
fn place(folder: &Path, file: &Path, line: usize) -> String {
    format!("{}:{line}", file.strip_prefix(folder).unwrap_or(file).display())
}

/// What the linker says, in a line.
fn of_linker(error: wesl::Error, folder: &Path, root: &ModulePath) -> String {
    let diagnostic = Diagnostic::from(error);
    let detail = diagnostic.detail;
    let file = file(folder, detail.module_path.as_ref().unwrap_or(root));
    let text = std::fs::read_to_string(&file).unwrap_or_default();
    let said = match *diagnostic.error {
        // Its own text begins with a range of characters.
        wesl::Error::ParseError(e) => e.error.to_string(),
        error => error.to_string(),
    };
    // Where it tells no place, it names what it has not found.
    let named = said.split('`').nth(1).and_then(|name| text.find(name));
    let begin = detail.span.map(|span| span.range().start).or(named).unwrap_or(0).min(text.len());
    let line = 1 + text.as_bytes()[..begin].iter().filter(|byte| **byte == b'\n').count();
    format!("{}: {}", place(folder, &file, line), one_line(&said))
}

/// What naga has against a linked text.
struct Fault {
    /// Its line there, from 1; none where it is about the whole.
    line: Option<usize>,
    said: String,
}

fn check(text: &str) -> Result<(), Fault> {
    let module = naga::front::wgsl::parse_str(text).map_err(|e| Fault {
        line: e.location(text).map(|at| at.line_number as usize),
        said: e.message().to_owned(),
    })?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
    validator.validate(&module).map(|_| ()).map_err(|e| {
        let line = e.location(text).map(|at| at.line_number as usize);
        let mut said = e.as_inner().to_string();
        let mut source = std::error::Error::source(e.as_inner());
        while let Some(cause) = source {
            said = format!("{said}: {cause}");
            source = cause.source();
        }
        Fault { line, said }
    })
}

impl Fault {
    /// In a line, with its place in the one of `files` that it comes from. Linked texts are printed anew: what has the same
    /// words within the same declaration is the same line; else it is the declaration's first.
    fn said(&self, folder: &Path, text: &str, files: impl Iterator<Item = PathBuf>) -> String {
        let said = one_line(&self.said);
        let lines: Vec<&str> = text.lines().collect();
        let Some(faulty) = self.line.and_then(|line| lines.get(..line)) else { return said };
        let Some(declaration) = faulty.iter().rev().find_map(|line| declared(line)) else { return said };
        let words = faulty.last().map(|line| words(line)).unwrap_or_default();
        for file in files {
            let source = std::fs::read_to_string(&file).unwrap_or_default();
            let lines: Vec<&str> = source.lines().collect();
            let Some(first) = lines.iter().position(|line| declared(line) == Some(declaration)) else {
                continue;
            };
            let within = lines[first..].iter().skip(1).take_while(|line| declared(line).is_none());
            let same =
                std::iter::once(&lines[first]).chain(within).position(|line| self::words(line) == words);
            return format!("{}: {said}", place(folder, &file, first + same.unwrap_or(0) + 1));
        }
        said
    }
}

/// The kind and the name of what a line begins to declare for the whole shader.
fn declared(line: &str) -> Option<(&str, &str)> {
    const KINDS: [&str; 6] = ["fn", "struct", "const", "override", "var", "alias"];
    if line.starts_with([' ', '\t', '/']) {
        return None;
    }
    let mut words = line.split(' ');
    // Attributes come first.
    let (kind, word) = words.find_map(|word| {
        let kind = word.split('<').next().unwrap_or_default();
        KINDS.contains(&kind).then_some((kind, word))
    })?;
    if word.contains('<') && !word.contains('>') {
        words.find(|word| word.ends_with('>'))?;
    }
    let name = words.next()?.split(|c: char| !(c.is_alphanumeric() || c == '_')).next()?;
    Some((kind, name))
}

/// A line without its blanks, parentheses, last commas and comment, which printing changes.
fn words(line: &str) -> String {
    let code = line.split("//").next().unwrap_or_default().trim().trim_end_matches(',');
    code.chars().filter(|c| !c.is_whitespace() && !"()".contains(*c)).collect()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A copy of all shaders.
    fn copy() -> tempfile::TempDir {
        let copy = tempfile::tempdir().unwrap();
        let from = ShaderWatch::default().folder;
        let mut files = Vec::new();
        list(&from, &mut files).unwrap();
        for (file, _) in files {
            let to = copy.path().join(file.strip_prefix(&from).unwrap());
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::copy(&file, to).unwrap();
        }
        copy
    }

    /// The lines of a linked text, whose declarations come in any order.
    fn lines(text: &str) -> Vec<&str> {
        let mut lines: Vec<&str> = text.lines().collect();
        lines.sort_unstable();
        lines
    }

    /// Changes a file so that its time is another, whatever the file system's clock.
    fn edit(folder: &Path, file: &str, from: &str, to: &str) {
        let path = folder.join(file);
        let before = path.metadata().unwrap().modified().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{file} has no `{from}`");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        file.set_modified(before + Duration::from_secs(1)).unwrap();
    }

    #[test]
    fn linking_now_gives_what_the_build_linked() {
        let texts = link_all(&ShaderWatch::default().folder).unwrap();
        assert_eq!(texts.len(), SHADERS.len());
        let raycast = crate::raycast::SHADER;
        assert_eq!(lines(&texts[raycast.path]), lines(raycast.linked));
    }

    const BLUR: &str = "frame/finish/blur.wgsl";

    #[test]
    fn a_changed_file_changes_its_shader_and_no_other() {
        let folder = copy();
        let mut watch = ShaderWatch::new(folder.path().to_owned());
        assert_eq!(watch.look(), Ok(None), "nothing has changed at first");
        assert_eq!(watch.look(), Ok(None));
        let built = link_all(folder.path()).unwrap();
        edit(folder.path(), BLUR, "* weights[0]", "* weights[0] * 0.4375");
        let changed = watch.look().unwrap().expect("a file was written");
        for (path, text) in &changed {
            assert_eq!(lines(text) != lines(&built[path]), *path == "frame::finish::blur", "{path}");
        }
        assert!(changed["frame::finish::blur"].contains("0.4375"));
        assert_eq!(watch.look(), Ok(None));
    }

    /// What is said of a file once it has been edited, and the place of the edit.
    fn broken(file: &str, from: &str, to: &str) -> (String, String) {
        let folder = copy();
        let mut watch = ShaderWatch::new(folder.path().to_owned());
        assert_eq!(watch.look(), Ok(None));
        edit(folder.path(), file, from, to);
        let error = watch.look().unwrap_err();
        assert!(!error.contains('\n'), "{error}");
        assert_eq!(watch.look(), Ok(None), "it is said once");
        let source = std::fs::read_to_string(folder.path().join(file)).unwrap();
        let line = 1 + source.lines().position(|line| line.contains(to)).unwrap();
        (error, format!("{file}:{line}: "))
    }

    #[test]
    fn a_broken_file_is_an_error_with_its_line() {
        // No WGSL at all; an unknown name; a wrong type; one that there is not, in what others import.
        for (file, from, to) in [
            (BLUR, "for (", "for for ("),
            (BLUR, "var sum =", "var sum = unknown_to_all +"),
            (BLUR, "var sum =", "var sum = vec2f(1.0) +"),
            ("shared/ray.wgsl", "fn ray_of(", "fn ray_of(unknown: Nothing, "),
        ] {
            let (error, place) = broken(file, from, to);
            println!("{error}");
            assert!(error.starts_with(&place), "{error}, expected {place}");
        }
    }

    #[test]
    fn a_folder_that_is_not_there_is_said_once() {
        let mut watch = ShaderWatch::new(PathBuf::from("/nowhere/at/all"));
        assert!(watch.look().unwrap_err().contains("/nowhere/at/all"));
        assert_eq!(watch.look(), Ok(None));
    }
}
