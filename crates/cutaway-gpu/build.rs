//! Links the shaders: see `src/shaders/link.rs`.

#[path = "src/shaders/link.rs"]
mod link;

fn main() {
    let linker = link::linker("src".as_ref());
    for path in link::SHADERS {
        linker.build_artifact(&link::module(path), &path.replace("::", "_"));
    }
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/shaders/link.rs");
}
