//! What the fuzz targets do with their input. The replay of the saved corpora, which runs with the ordinary tests on
//! the stable toolchain (`crates/cutaway-io/tests/fuzz_corpus.rs`), does the same.
#![allow(dead_code, reason = "each target uses one of the functions")]

use cutaway_io::limits::Limits;
use cutaway_io::mesh::{MeshReadOptions, MeshSpace, read_mesh_bytes};
use cutaway_io::tetrahedra::{TetrahedraReadOptions, read_tetrahedra_bytes};
use cutaway_io::transfer_function::{FunctionFormat, function_text, read_transfer_function_bytes};
use cutaway_io::volume::{MemoryFolder, ReadOptions, read_volume_bytes};
use cutaway_mesh::patches::Tessellation;
use cutaway_mesh::{RepairOptions, Topology, TriangleMesh, repair};

/// NIfTI: the input is a `.nii` file, compressed or not; a `.hdr` finds voxels beside it.
pub(crate) fn nifti(data: &[u8]) {
    read("a.nii", data, &voxels("a.img"));
}

/// NRRD: the input is an attached or detached header; `voxels` is there to be named.
pub(crate) fn nrrd(data: &[u8]) {
    read("a.nrrd", data, &voxels("voxels"));
}

/// MetaImage: as NRRD.
pub(crate) fn metaimage(data: &[u8]) {
    read("a.mha", data, &voxels("voxels"));
}

/// Raw data: the input is a name, a line break, a JSON side file, a zero byte and the data.
pub(crate) fn raw(data: &[u8]) {
    let (description, voxels) = split(data, 0);
    let (name, json) = split(description, b'\n');
    let name = format!("{}.raw", String::from_utf8_lossy(name));
    let mut folder = MemoryFolder::new();
    if !json.is_empty() {
        folder.insert(name.replace(".raw", ".json"), json.to_vec());
    }
    read(&name, voxels, &folder);
}

/// Meshes: the input is a file of any format, which a name may decide; `buffer` is there to be named by glTF. What is
/// read is repaired.
pub(crate) fn mesh(data: &[u8]) {
    let names = ["a.ply", "a.stl", "a.obj", "a.gltf"];
    for (name, space) in names.into_iter().zip(MeshSpace::ALL.into_iter().cycle()) {
        let options = MeshReadOptions { limits: Limits { max_bytes: 1 << 20 }, space };
        match read_mesh_bytes(name, data, &voxels("buffer"), &options) {
            Ok(loaded) => {
                loaded.notices.iter().for_each(|notice| assert_one_line(notice));
                mend(&loaded.value);
            }
            Err(error) => assert_one_line(&error.to_string()),
        }
    }
}

fn mend(mesh: &TriangleMesh) {
    for weld_tolerance in [0.0, 1e-3] {
        match repair(mesh, &RepairOptions { weld_tolerance }) {
            Ok(repaired) => {
                assert!(Topology::new(repaired.mesh.mesh()).is_closed());
                repaired.notices.iter().for_each(|notice| assert_one_line(&notice.to_string()));
            }
            Err(error) => assert_one_line(&error.to_string()),
        }
    }
}

/// Patches: the input is a file of either format; what it holds is cut into a few triangles.
pub(crate) fn patches(data: &[u8]) {
    match cutaway_io::patches::read_bytes("a", data) {
        Ok(set) => {
            let tolerance = set.suggested_tolerance();
            let settings = Tessellation { max_triangles: 1 << 12, ..Tessellation::within(tolerance) };
            match set.tessellate(&settings) {
                Ok(made) => {
                    assert!(made.mesh.triangles().len() <= 1 << 12 && made.error_bound <= tolerance);
                    assert!(made.normals.iter().all(|normal| normal.is_finite()));
                    made.notices().iter().for_each(|notice| assert_one_line(notice));
                }
                Err(error) => assert_one_line(&error.to_string()),
            }
        }
        Err(error) => assert_one_line(&error.to_string()),
    }
}

/// Unstructured grids: the input is a file of either format.
pub(crate) fn tetrahedra(data: &[u8]) {
    let options = TetrahedraReadOptions {
        limits: Limits { max_bytes: 1 << 20 },
        array: None,
        time_step: None,
        ..TetrahedraReadOptions::default()
    };
    match read_tetrahedra_bytes("a", data, &options) {
        Ok(loaded) => {
            let mesh = loaded.value;
            assert!(mesh.cells().as_flattened().iter().all(|c| (*c as usize) < mesh.points().len()));
            assert!(
                mesh.values().len() == mesh.points().len() && mesh.values().iter().all(|v| v.is_finite())
            );
            assert!(mesh.point_gradients().len() == mesh.points().len());
            loaded.notices.iter().for_each(|notice| assert_one_line(notice));
        }
        Err(error) => assert_one_line(&error.to_string()),
    }
}

/// Transfer functions: the input is a file of any format; what is read can be written in every format and read again.
pub(crate) fn transfer_function(data: &[u8]) {
    match read_transfer_function_bytes("a", data) {
        Ok(loaded) => {
            loaded.notices.iter().for_each(|notice| assert_one_line(notice));
            let formats = [FunctionFormat::Cutaway, FunctionFormat::ParaView, FunctionFormat::SlicerJson];
            for format in formats.into_iter().chain([FunctionFormat::Slicer]) {
                let (text, notices) = function_text(&loaded.value, format);
                notices.iter().for_each(|notice| assert_one_line(notice));
                let again =
                    read_transfer_function_bytes("a", text.as_bytes()).expect("what we write is read");
                let [points, expected] =
                    [&again.value, &loaded.value].map(|file| file.function.points().len());
                assert_eq!(points, expected, "{format:?}");
            }
        }
        Err(error) => assert_one_line(&error.to_string()),
    }
}

fn split(data: &[u8], separator: u8) -> (&[u8], &[u8]) {
    match data.iter().position(|&b| b == separator) {
        Some(at) => (&data[..at], &data[at + 1..]),
        None => (data, &[]),
    }
}

fn voxels(name: &str) -> MemoryFolder {
    MemoryFolder::from([(name.to_owned(), (0..=255).cycle().take(480).collect())])
}

/// Reads as a user would, and with a volume chosen; what comes out must be whole.
fn read(name: &str, data: &[u8], folder: &MemoryFolder) {
    for volume_index in [None, Some(1)] {
        let options =
            ReadOptions { limits: Limits { max_bytes: 1 << 20 }, volume_index, ..ReadOptions::default() };
        match read_volume_bytes(name, data, folder, &options) {
            Ok(loaded) => {
                let volume = loaded.value;
                let [x, y, z] = volume.dimensions().to_array().map(|n| n as usize);
                assert_eq!(volume.voxels().len(), x * y * z);
                let [low, high] = volume.stored_range();
                assert!(low.is_finite() && high.is_finite() && low <= high);
                assert!(volume.voxel_from_world().is_finite());
                loaded.notices.iter().for_each(|notice| assert_one_line(notice));
            }
            Err(error) => assert_one_line(&error.to_string()),
        }
    }
}

fn assert_one_line(text: &str) {
    assert!(!text.is_empty() && !text.chars().any(char::is_control), "{text:?}");
}
