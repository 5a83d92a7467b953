//! Replays the saved corpora of the fuzz targets on the stable toolchain.

use std::fs;
use std::path::Path;

#[path = "../../../fuzz/bodies.rs"]
mod bodies;

fn replay(target: &str, body: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target);
    let mut replayed = 0;
    for entry in fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.unwrap().path();
        let input = fs::read(&path).unwrap();
        println!("{}", path.display());
        body(&input);
        replayed += 1;
    }
    assert!(replayed > 0, "{} is empty", folder.display());
}

#[test]
fn nifti() {
    replay("nifti", bodies::nifti);
}

#[test]
fn nrrd() {
    replay("nrrd", bodies::nrrd);
}

#[test]
fn metaimage() {
    replay("metaimage", bodies::metaimage);
}

#[test]
fn raw() {
    replay("raw", bodies::raw);
}

#[test]
fn mesh() {
    replay("mesh", bodies::mesh);
}

#[test]
fn patches() {
    replay("patches", bodies::patches);
}

#[test]
fn tetrahedra() {
    replay("tetrahedra", bodies::tetrahedra);
}

#[test]
fn transfer_function() {
    replay("transfer_function", bodies::transfer_function);
}
