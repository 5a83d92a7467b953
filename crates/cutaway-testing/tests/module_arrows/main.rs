//! No module imports itself by way of others: in each of these crates the imports between files have no cycle.

mod graph;
mod scan;
mod tokens;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use graph::cycles;
use scan::{Import, imports};

/// The crates that this holds for.
const CRATES: &[&str] = &["cutaway-core", "cutaway-cpu", "cutaway-gpu", "cutaway-io"];

/// Imports, as `crate: file -> file`, that are not looked at until they are gone; a `*` stands for any characters. This list
/// only shrinks: an entry that no import of the crate matches any more fails the test.
const STILL_THERE: &[&str] = &[
    "cutaway-core: clip/shading.rs -> scene*",
    "cutaway-core: presets/* -> presets.rs",
    "cutaway-core: reference/* -> reference.rs",
    "cutaway-core: volume/* -> volume.rs",
    "cutaway-io: image/* -> image.rs",
    "cutaway-io: mesh/gltf/* -> mesh/gltf/mod.rs",
    "cutaway-io: patches/* -> patches/mod.rs",
    "cutaway-io: tetrahedra/* -> tetrahedra/mod.rs",
    "cutaway-io: transfer_function/* -> transfer_function/mod.rs",
    "cutaway-io: volume/* -> volume/mod.rs",
    "cutaway-io: volume/description.rs -> volume/raw.rs",
    "cutaway-io: volume/nifti/* -> volume/nifti/mod.rs",
];

/// Whether a line is what an entry of the list stands for.
fn matches(entry: &str, line: &str) -> bool {
    match entry.split_once('*') {
        Some((before, after)) => {
            let rest = line.strip_prefix(before).unwrap_or_default();
            line.starts_with(before) && rest.ends_with(after)
        }
        None => entry == line,
    }
}

/// The Rust files below a folder with their paths from it, `/` between folders.
fn files(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(below) = folders.pop() {
        let listed = std::fs::read_dir(folder.join(&below)).expect("a crate's sources can be listed");
        for entry in listed {
            let name = entry.expect("a folder's entries can be read").file_name();
            let path = below.join(name);
            if folder.join(&path).is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(folder.join(&path)).expect("sources are text");
                let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy().into_owned()).collect();
                found.push((parts.join("/"), text));
            }
        }
    }
    found.sort();
    found
}

/// The imports of a crate without those that [`STILL_THERE`] names, and what of that list is there no more.
fn remaining(krate: &str, imports: BTreeSet<Import>) -> (BTreeSet<Import>, Vec<String>) {
    let prefix = format!("{krate}: ");
    let listed: Vec<&str> = STILL_THERE.iter().filter_map(|entry| entry.strip_prefix(&prefix)).collect();
    let met = |entry: &str| imports.iter().any(|import| matches(entry, &import.to_string()));
    let gone = listed.iter().filter(|entry| !met(entry));
    let gone =
        gone.map(|entry| format!("{prefix}{entry} is no import any more: take it off the list")).collect();
    let is_listed = |import: &Import| listed.iter().any(|entry| matches(entry, &import.to_string()));
    (imports.iter().filter(|import| !is_listed(import)).cloned().collect(), gone)
}

#[test]
fn no_module_imports_itself_by_way_of_others() {
    let mut wrong = Vec::new();
    for krate in CRATES {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(krate).join("src");
        let files = files(&folder);
        assert!(files.len() > 10, "{krate} has {} files below src", files.len());
        let imports = imports(&files);
        assert!(imports.len() > files.len() / 2, "{krate}: only {} imports were found", imports.len());
        let (kept, gone) = remaining(krate, imports);
        wrong.extend(gone);
        wrong.extend(cycles(&kept).into_iter().map(|cycle| format!("{krate}: {cycle}")));
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// A crate's imports as lines.
fn lines(files: &[(&str, &str)]) -> Vec<String> {
    let files: Vec<_> = files.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
    imports(&files).iter().map(Import::to_string).collect()
}

#[test]
fn each_way_to_import_is_seen() {
    let lib = ("lib.rs", "mod a; pub mod b; pub use b::deep::Thing;");
    let b = ("b/mod.rs", "pub mod deep; pub(crate) use deep::Other; pub const LIMIT: u32 = 1;");
    let deep = ("b/deep.rs", "pub struct Thing; pub struct Other; pub fn made() {}");
    let of_a = |text| lines(&[lib, b, deep, ("a.rs", text)]);
    for text in [
        "use crate::b::deep::Thing;",
        // By a name that a parent hands on, once or twice.
        "use crate::b::Other;",
        "use crate::Thing as T;",
        "use super::b::{LIMIT as L, deep::{self, made}};",
        // In the middle of an expression, after `self`, through a module's name, and through all of a module.
        "fn f() -> bool { g::<crate::b::deep::Thing>(1 < 2) }",
        "use crate::b::deep; fn f() { deep::made(); }",
        "use crate::b::deep as other; fn f() { other::made(); }",
        "mod within { use super::super::b::deep::made; }",
        "use crate::b::deep::*;",
        // Macros use what they are written with.
        "macro_rules! m { () => { $crate::b::deep::made() } }",
    ] {
        assert!(of_a(text).contains(&"a.rs -> b/deep.rs".to_owned()), "{text}: {:?}", of_a(text));
    }
    assert_eq!(of_a("use crate::b::LIMIT;"), ["a.rs -> b/mod.rs"]);
    // What a parent uses of a child is an import, in whatever form.
    for text in ["mod c; use c::X;", "mod c; fn f() { c::x() }", "mod c; pub use c::X; fn f(x: X) {}"] {
        assert_eq!(lines(&[("lib.rs", text), ("c.rs", "pub struct X; pub fn x() {}")]), ["lib.rs -> c.rs"]);
    }
}

#[test]
fn what_is_no_import_is_not_seen() {
    for text in [
        "// use crate::b::X;\n/* crate::b /* x */ crate::b::X */ /// [`crate::b::X`]\nfn f() {}",
        "const S: &str = \"crate::b::X\"; const R: &str = r#\"\"crate::b::X\"#; const C: char = '\"';",
        "pub(in crate::b) fn f<'b>(x: &'b u32) {}",
        "#[cfg(test)] mod tests { use crate::b::X; fn f() { if true { crate::b::x() } } }",
        "#[cfg(test)]\nuse crate::b::X;\n#[cfg(test)] pub(crate) fn f() { crate::b::x(); }",
        "fn b() {} fn g() { b(); let b = 1; other::b::f(b); }",
        "use crate::b;",
    ] {
        let found =
            lines(&[("lib.rs", "mod a; mod b;"), ("a.rs", text), ("b.rs", "pub struct X; pub fn x() {}")]);
        assert_eq!(found, [""; 0], "{text}");
    }
    let with_tests =
        [("lib.rs", "mod a; #[cfg(test)] mod tests;"), ("a.rs", ""), ("tests.rs", "use crate::a::X;")];
    assert_eq!(lines(&with_tests), [""; 0]);
    // A parent that only hands names on does not import them.
    assert_eq!(lines(&[("lib.rs", "mod a; pub use a::X;"), ("a.rs", "pub struct X;")]), [""; 0]);
}

#[test]
fn cycles_are_found_and_named() {
    let text = [
        ("lib.rs", "mod a; mod b; mod c; mod d;"),
        ("a.rs", "use crate::b::B; pub struct A;"),
        ("b.rs", "use crate::c::C; pub struct B;"),
        ("c.rs", "use crate::a::A; use crate::d::D; pub struct C;"),
        ("d.rs", "pub struct D;"),
    ];
    let files: Vec<_> = text.map(|(path, text)| (path.to_owned(), text.to_owned())).into();
    assert_eq!(cycles(&imports(&files)), ["a.rs -> b.rs -> c.rs -> a.rs"]);
    let parent = [
        ("lib.rs", "mod p;"),
        ("p/mod.rs", "mod child; pub const N: u32 = 1; fn f() { child::g() }"),
        ("p/child.rs", "use super::N; pub fn g() {}"),
    ];
    let files: Vec<_> = parent.map(|(path, text)| (path.to_owned(), text.to_owned())).into();
    assert_eq!(cycles(&imports(&files)), ["p/child.rs -> p/mod.rs -> p/child.rs"]);
}
