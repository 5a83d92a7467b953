//! Links the shaders: see `src/shaders/link.rs`.

#[path = "src/shaders/link.rs"]
mod link;

use std::path::{Path, PathBuf};

fn main() {
    let folder = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("set by cargo")).join("src");
    let linker = link::linker(&folder);
    for path in link::SHADERS {
        let root = link::module(path);
        let linked = match linker.compile(&root) {
            Ok(linked) => linked,
            Err(error) => {
                eprintln!("the shader `{path}` does not link:\n{error}");
                std::process::exit(1);
            }
        };
        linked.write_artifact(&path.replace("::", "_"));
        for module in linked.modules.iter().chain([&root]) {
            rerun_if_changed(&link::file(&folder, module));
        }
    }
    rerun_if_changed(Path::new("build.rs"));
    rerun_if_changed(Path::new("src/shaders/link.rs"));
}

/// Cargo takes a file that does not exist for one that has changed, and would build again every time.
fn rerun_if_changed(file: &Path) {
    assert!(file.exists(), "{} does not exist", file.display());
    println!("cargo::rerun-if-changed={}", file.display());
}
