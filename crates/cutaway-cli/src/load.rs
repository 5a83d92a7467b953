//! From what the user named to a volume in memory.

use std::ffi::OsStr;
use std::io::Read;
use std::path::Path;
use std::time::Instant;

use anyhow::anyhow;
use cutaway_core::scene::Data;
use cutaway_core::volume::{NanMeaning, Volume, VoxelType};
use cutaway_io::mesh::{identify, recognize};
use cutaway_io::named::{NamedVolume, NamedVolumeError, VolumeName, read_named};
use cutaway_io::samples::{self, SampleError};
use cutaway_io::scene_file::{SceneFile, VolumeReference, paths};
use cutaway_io::tetrahedra;
use cutaway_io::transfer_function::{self, FunctionFormat};
use cutaway_io::volume::{RawOptions, ReadError, ReadOptions};

use crate::args::RawArgs;
use crate::report::{Verbosity, wrong_use};
use crate::values::{closest, tip};

/// A volume and how it was come by.
pub(crate) struct LoadedVolume {
    /// A volume or an unstructured grid.
    pub(crate) data: Data,
    /// What the user calls it, for messages.
    pub(crate) name: String,
    pub(crate) load_ms: f64,
    pub(crate) notices: Vec<String>,
    origin: VolumeName,
    /// What was said of it, by options or a scene file.
    said: ReadOptions,
}

/// Loads what a command line names: a file or `sample:NAME`.
pub(crate) fn from_argument(name: &OsStr, raw: &RawArgs) -> anyhow::Result<LoadedVolume> {
    load(VolumeName::new(name), read_options(raw)?)
}

/// Loads what a scene file names, its paths being relative to `folder`. Options of the command line win.
pub(crate) fn from_scene(file: &SceneFile, scene: &Path, raw: &RawArgs) -> anyhow::Result<LoadedVolume> {
    let source = &file.volume;
    let mut said = read_options(raw)?;
    said.nan = raw.nan.or(file.nan).unwrap_or_default();
    // What is wrong in a scene file is no wrong use of the program.
    let in_scene = |error: anyhow::Error| anyhow!("{}: {error:#}", scene.display());
    let path = source.path();
    let described = source.read_options().map_err(|e| in_scene(unknown_voxel_type(&e.name)))?;
    said.raw = said.raw.or(described.raw);
    said.volume_index = said.volume_index.or(described.volume_index);
    if path.is_empty() {
        return Err(in_scene(anyhow!(
            "`volume` is empty; give a path, relative to the scene file, or `sample:NAME`"
        )));
    }
    let folder = scene.parent().unwrap_or(Path::new(""));
    load(VolumeName::within(folder, path), said).map_err(in_scene)
}

fn load(origin: VolumeName, said: ReadOptions) -> anyhow::Result<LoadedVolume> {
    let started = Instant::now();
    let NamedVolume { data, notices } =
        read_named(&origin, &said).map_err(|error| explained(&origin, error))?;
    let load_ms = started.elapsed().as_secs_f64() * 1e3;
    Ok(LoadedVolume { data, name: origin.to_string(), load_ms, notices, origin, said })
}

/// Why there is no such volume, in the words of the command line.
fn explained(origin: &VolumeName, error: NamedVolumeError) -> anyhow::Error {
    match (error, origin) {
        (NamedVolumeError::OnlyOne { name, what }, _) => {
            wrong_use(format!("{name} holds one {what}: leave out --volume-index"))
        }
        (error @ (NamedVolumeError::Empty | NamedVolumeError::DescribedSample { .. }), _) => {
            wrong_use(error.to_string())
        }
        (NamedVolumeError::Sample(SampleError::Unknown { name }), _) => {
            // Nobody mistypes the number.
            let base = name.split_once(':').map_or(name.as_str(), |(base, _)| base);
            let tip = tip(base, &samples::names());
            wrong_use(format!("no sample is called `{base}`{tip} (`cutaway presets` lists them)"))
        }
        (NamedVolumeError::Sample(error @ (SampleError::Size { .. } | SampleError::FixedSize { .. })), _) => {
            wrong_use(error.to_string())
        }
        (NamedVolumeError::Volume(error @ ReadError::Open { .. }), VolumeName::File(path))
            if std::fs::symlink_metadata(path).is_err() =>
        {
            anyhow!("{error}{}", meant_sample(&path.to_string_lossy()))
        }
        (NamedVolumeError::Volume(error), VolumeName::File(path)) => other_kind(path, error),
        (error, _) => error.into(),
    }
}

/// The sample that the name of a file that is not there may mean: `mr-head`, `samples:mr-head`, `sample/mr-head`.
fn meant_sample(name: &str) -> String {
    let names = samples::names();
    let bare = name.split_once([':', '/']).filter(|(first, _)| first.starts_with("sample"));
    let bare = bare.map_or(name, |(_, rest)| rest);
    let base = bare.split_once(':').map_or(bare, |(base, _)| base);
    // A name with an extension is that of a file.
    let near = closest(base, &names).filter(|_| !base.contains(['.', '/', '\\']));
    near.map_or(String::new(), |near| format!("; did you mean `sample:{near}`?"))
}

/// A reader's error; where the file is one of the other kinds that cutaway has to do with, what it is.
fn other_kind(path: &Path, error: ReadError) -> anyhow::Error {
    if !matches!(error, ReadError::Unsupported { .. } | ReadError::UnknownFormat { .. }) {
        return error.into();
    }
    let file = path.display();
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "ply" | "stl" | "obj" | "glb" | "gltf" => match identify(path) {
            Ok(_) => {
                anyhow!(
                    "{file}: this is a mesh, not a volume; `cutaway info` and `cutaway convert` read meshes"
                )
            }
            Err(error) => error.into(),
        },
        "json" | "vp" if transfer_function::recognize(path).is_some() => {
            anyhow!(
                "{file}: this is a transfer function, not a volume; `cutaway render` takes it as --transfer-function"
            )
        }
        "json" if is_scene(path) => {
            anyhow!("{file}: this is a scene file, not a volume; `cutaway render --scene {file}` renders it")
        }
        "png" | "exr" => {
            anyhow!("{file}: this is an image, not a volume; `cutaway compare` reads images")
        }
        _ => error.into(),
    }
}

/// Whether an argument names a mesh file. What is described as raw data is none.
pub(crate) fn is_mesh(name: &OsStr, raw: &RawArgs) -> bool {
    !is_volume(name, raw) && recognize(Path::new(name)).is_some()
}

/// Whether an argument names a file of an unstructured grid. What is described as raw data is none.
pub(crate) fn is_grid(name: &OsStr, raw: &RawArgs) -> bool {
    // Of a grid, the volume index means a time step.
    let raw = RawArgs { volume_index: None, ..raw.clone() };
    !is_volume(name, &raw) && tetrahedra::recognize(Path::new(name))
}

/// What kind of transfer function an argument names, if it names one. What is described as raw data is none.
pub(crate) fn function_format(name: &OsStr, raw: &RawArgs) -> Option<FunctionFormat> {
    if is_volume(name, raw) { None } else { transfer_function::recognize(Path::new(name)) }
}

/// Whether an argument is said to be a volume, whatever it holds.
fn is_volume(name: &OsStr, raw: &RawArgs) -> bool {
    let RawArgs { dims, voxel_type, spacing, big_endian, header_bytes, volume_index, nan: _ } = raw;
    let described = dims.is_some() || voxel_type.is_some() || spacing.is_some() || *big_endian;
    let described = described || header_bytes.is_some() || volume_index.is_some();
    described || name.to_str().is_some_and(|name| name.starts_with("sample:"))
}

/// Whether a JSON file is a scene by its keys, whether or not the rest of it is right.
fn is_scene(path: &Path) -> bool {
    const MOST_BYTES: u64 = 64 << 20;
    let read = || {
        let mut text = Vec::new();
        std::fs::File::open(path).ok()?.take(MOST_BYTES).read_to_end(&mut text).ok()?;
        serde_json::from_slice::<serde_json::Value>(&text).ok()
    };
    read().is_some_and(|value| value.get("volume").is_some())
}

impl LoadedVolume {
    /// The regular grid that places the data in the world and holds its values.
    pub(crate) fn lattice(&self) -> &Volume {
        self.data.lattice()
    }

    /// Tells the user what the reader had to say.
    pub(crate) fn report(&self, verbosity: Verbosity) {
        for notice in &self.notices {
            verbosity.notice(notice);
        }
    }

    /// How a scene file shows voxels without a value; none: by default.
    pub(crate) fn nan(&self) -> Option<NanMeaning> {
        Some(self.said.nan).filter(|nan| *nan != NanMeaning::default())
    }

    /// The source as a scene file at `scene` names it: relative to its folder where the volume lies in or below that,
    /// so that both can move together, else absolute.
    pub(crate) fn source_for(&self, scene: &Path) -> anyhow::Result<VolumeReference> {
        let path = match &self.origin {
            VolumeName::Sample(name) => return Ok(VolumeReference::Path(format!("sample:{name}"))),
            VolumeName::File(path) => paths::in_scene(path, scene)?,
        };
        Ok(VolumeReference::with_options(path, &self.said))
    }
}

fn read_options(raw: &RawArgs) -> anyhow::Result<ReadOptions> {
    let dims = raw.dims.as_ref().map(|l| l.exactly_whole::<3>("--dims")).transpose()?;
    let spacing = raw.spacing.as_ref().map(|l| l.exactly::<3>("--spacing")).transpose()?;
    let voxel_type = raw.voxel_type.as_deref().map(voxel_type).transpose()?;
    let raw_options = RawOptions {
        dims,
        voxel_type,
        spacing,
        big_endian: raw.big_endian.then_some(true),
        header_bytes: raw.header_bytes,
    };
    Ok(ReadOptions {
        raw: raw_options,
        volume_index: raw.volume_index,
        nan: raw.nan.unwrap_or_default(),
        ..ReadOptions::default()
    })
}

fn voxel_type(name: &str) -> anyhow::Result<VoxelType> {
    VoxelType::from_name(name).ok_or_else(|| unknown_voxel_type(name))
}

fn unknown_voxel_type(name: &str) -> anyhow::Error {
    const NAMES: [&str; 10] =
        ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64"];
    wrong_use(format!("`{name}` is no voxel type; choose from {}{}", NAMES.join(", "), tip(name, &NAMES)))
}
