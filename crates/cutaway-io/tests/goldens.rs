//! Every fixture and every real volume against what independent libraries read from it: one test a file.
//!
//! `tests/golden/README.md` says where the values come from. The real volumes are found through `CUTAWAY_DATA` or in
//! `../shared/data` beside the workspace; where they are not, their tests show as ignored.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use cutaway_core::space::{WorldFrame, orientation_letters};
use cutaway_core::volume::{NanMeaning, Volume};
use cutaway_io::tetrahedra::{TetrahedraReadOptions, read_grid};
use cutaway_io::volume::{ReadOptions, read_volume};
use libtest_mimic::{Arguments, Failed, Trial};
use serde::Deserialize;

#[derive(Clone, Deserialize)]
struct Golden {
    file: Option<String>,
    data: Option<String>,
    dims: [u32; 3],
    #[serde(rename = "type")]
    voxel_type: String,
    affine_ras: [[f64; 4]; 4],
    orientation: [char; 3],
    oriented: bool,
    range: [f64; 2],
    mean: f64,
    samples: Vec<[f64; 4]>,
    #[serde(default)]
    replaced: usize,
}

/// Fixtures of vectors, which are read only where a component is chosen.
const COMPONENTS: [&str; 3] = ["components_first.nrrd", "components_spacings.nrrd", "channels.mha"];

fn main() {
    let arguments = Arguments::from_args();
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut trials = refusals(&data_folder(here));
    trials.extend(grids(&data_folder(here)));
    for format in ["nifti", "nrrd", "metaimage", "raw"] {
        let text = fs::read_to_string(here.join(format!("tests/golden/{format}.json")));
        let goldens: Vec<Golden> =
            serde_json::from_str(&text.expect("golden values are there")).expect(format);
        trials.extend(goldens.into_iter().map(|golden| trial(here, golden)));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

fn data_folder(here: &Path) -> PathBuf {
    let beside = || here.join("../../../shared/data");
    std::env::var_os("CUTAWAY_DATA").map_or_else(beside, PathBuf::from)
}

fn trial(here: &Path, golden: Golden) -> Trial {
    let (name, path, optional) = match (&golden.file, &golden.data) {
        (Some(file), _) => (file.clone(), here.join("tests/fixtures").join(file), false),
        (None, Some(data)) => (format!("data/{data}"), find(&data_folder(here), data), true),
        (None, None) => panic!("a golden entry names neither a fixture nor a real file"),
    };
    let missing = optional && !path.exists();
    Trial::test(name, move || check(&path, &golden)).with_ignored_flag(missing)
}

/// A real volume by its name, below the folder or in one of its subfolders.
fn find(folder: &Path, name: &str) -> PathBuf {
    let direct = folder.join(name);
    if direct.exists() { direct } else { folder.join("volumes").join(name) }
}

fn check(path: &Path, golden: &Golden) -> Result<(), Failed> {
    let chosen = COMPONENTS.iter().any(|name| path.ends_with(name)).then_some(0);
    // As the other reader counts: a voxel without a value has the lowest one.
    let options = ReadOptions { volume_index: chosen, nan: NanMeaning::Lowest, ..ReadOptions::default() };
    let loaded = read_volume(path, &options)?;
    let volume = loaded.value;
    same("dims", volume.dimensions().to_array(), golden.dims)?;
    same("type", volume.source_type().name(), golden.voxel_type.as_str())?;
    same("oriented", volume.geometry().frame == WorldFrame::Ras, golden.oriented)?;
    same("replaced", volume.replaced(), golden.replaced)?;
    let affine = volume.world_from_voxel();
    for row in 0..3 {
        for column in 0..4 {
            let found = if column < 3 { affine.matrix3.col(column)[row] } else { affine.translation[row] };
            near(&format!("affine[{row}][{column}]"), found, golden.affine_ras[row][column], 1e-5)?;
        }
    }
    if golden.oriented {
        same("orientation", orientation_letters(affine), golden.orientation)?;
    }
    check_values(&volume, golden)
}

/// Volumes keep floats and wide integers as f32: values agree to its precision.
fn check_values(volume: &Volume, golden: &Golden) -> Result<(), Failed> {
    let scale = golden.range[0].abs().max(golden.range[1].abs());
    let tolerance = 1e-6 * scale.max(1e-30);
    let [low, high] = volume.value_range();
    near("smallest value", low, golden.range[0], tolerance)?;
    near("largest value", high, golden.range[1], tolerance)?;
    let voxels = volume.voxels();
    let sum: f64 = (0..voxels.len()).map(|i| volume.rescale().value(f64::from(voxels.get(i)))).sum();
    near("mean", sum / voxels.len() as f64, golden.mean, tolerance)?;
    for &[i, j, k, value] in &golden.samples {
        let found = volume.value_clamped(i as i64, j as i64, k as i64);
        near(&format!("value at {i} {j} {k}"), found, value, tolerance)?;
    }
    Ok(())
}

fn same<T: PartialEq + std::fmt::Debug>(what: &str, found: T, expected: T) -> Result<(), Failed> {
    if found == expected {
        return Ok(());
    }
    Err(format!("{what}: found {found:?}, expected {expected:?}").into())
}

fn near(what: &str, found: f64, expected: f64, tolerance: f64) -> Result<(), Failed> {
    if (found - expected).abs() <= tolerance {
        return Ok(());
    }
    Err(format!("{what}: found {found}, expected {expected} within {tolerance}").into())
}

/// Real files of formats that are not read yet must say so.
fn refusals(data: &Path) -> Vec<Trial> {
    let files = [
        "dicom_abdomen_ct_64",
        "cthead_tiff",
        "cthead_tiff/cthead-8bit001.tif",
        "hydrogen.vti",
        "brain1_v2.ome.zarr.tar.gz",
    ];
    let trial = |name: &str| {
        let path = data.join("volumes").join(name);
        let missing = !path.exists();
        let test = move || match read_volume(&path, &ReadOptions::default()) {
            Ok(_) => Err("it was read".into()),
            Err(error) if error.to_string().contains("not supported yet") => Ok(()),
            Err(error) => Err(error.to_string().into()),
        };
        Trial::test(format!("refused/{name}"), test).with_ignored_flag(missing)
    };
    files.into_iter().map(trial).collect()
}

/// What another reader found in an unstructured grid.
#[derive(Clone, Deserialize)]
struct GridCase {
    select: BTreeMap<String, String>,
    points: usize,
    tetrahedra: usize,
    range: [f64; 2],
}

/// Unstructured grids by other writers, with what VTK read from them beside each.
fn grids(data: &Path) -> Vec<Trial> {
    #[derive(Deserialize)]
    struct Reference {
        unstructured: Vec<GridCase>,
    }
    let trial = |name: &str| {
        let path = data.join("formats/vtk").join(name);
        let missing = !path.exists();
        let test = move || {
            let reference = fs::read_to_string(path.with_added_extension("ref.json"))?;
            let reference: Reference = serde_json::from_str(&reference)?;
            reference.unstructured.iter().try_for_each(|case| check_grid(&path, case))
        };
        Trial::test(format!("grid/{name}"), test).with_ignored_flag(missing)
    };
    ["cells_lz4.vtu", "points_zlib.vtu", "two_arrays_lzma.vtu"].into_iter().map(trial).collect()
}

fn check_grid(path: &Path, case: &GridCase) -> Result<(), Failed> {
    let array = case.select.get("array").cloned();
    let grid = read_grid(path, &TetrahedraReadOptions { array, ..TetrahedraReadOptions::default() })?;
    same("points", grid.points().len(), case.points)?;
    same("tetrahedra", grid.tetrahedra().len(), case.tetrahedra)?;
    let [low, high] = grid.into_mesh()?.lattice().value_range();
    near("smallest value", low, case.range[0], 1e-5)?;
    near("largest value", high, case.range[1], 1e-5)
}
