//! From what the user named to a volume in memory.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use cutaway_core::scene::VolumeSource;
use cutaway_core::volume::{Volume, VoxelType};
use cutaway_io::samples::read_sample;
use cutaway_io::volume::{RawOptions, ReadOptions, read_volume};

use crate::args::RawArgs;
use crate::report::{Verbosity, wrong_use};

/// A volume and how it was come by.
pub(crate) struct LoadedVolume {
    pub(crate) volume: Volume,
    /// What a scene file calls it.
    pub(crate) source: VolumeSource,
    pub(crate) load_ms: f64,
    pub(crate) notices: Vec<String>,
}

/// Loads what a command line names: a file or `sample:NAME`.
pub(crate) fn from_argument(name: &str, raw: &RawArgs) -> anyhow::Result<LoadedVolume> {
    let options = read_options(raw)?;
    load(name, &options, None)
}

/// Loads what a scene file names, its paths being relative to `folder`. Options of the command line win.
pub(crate) fn from_scene(
    source: &VolumeSource,
    folder: &Path,
    raw: &RawArgs,
) -> anyhow::Result<LoadedVolume> {
    let mut options = read_options(raw)?;
    let path = match source {
        VolumeSource::Path(path) => path,
        VolumeSource::Described(d) => {
            let voxel_type = d.voxel_type.as_deref().map(voxel_type).transpose()?;
            let said = &mut options.raw;
            said.dims = said.dims.or(d.dims);
            said.voxel_type = said.voxel_type.or(voxel_type);
            said.spacing = said.spacing.or(d.spacing);
            said.big_endian = said.big_endian.or(d.big_endian);
            said.header_bytes = said.header_bytes.or(d.header_bytes);
            &d.path
        }
    };
    load(path, &options, Some((folder, source)))
}

fn load(
    name: &str,
    options: &ReadOptions,
    scene: Option<(&Path, &VolumeSource)>,
) -> anyhow::Result<LoadedVolume> {
    let started = Instant::now();
    let (loaded, source) = if let Some(sample) = name.strip_prefix("sample:") {
        (read_sample(sample, options)?, VolumeSource::Path(name.to_owned()))
    } else {
        let path = scene.map_or_else(|| PathBuf::from(name), |(folder, _)| folder.join(name));
        let source = match scene {
            Some((_, source @ VolumeSource::Described(_))) => source.clone(),
            _ => VolumeSource::Path(path.to_string_lossy().into_owned()),
        };
        (read_volume(&path, options)?, source)
    };
    let load_ms = started.elapsed().as_secs_f64() * 1e3;
    Ok(LoadedVolume { volume: loaded.value, source, load_ms, notices: loaded.notices })
}

impl LoadedVolume {
    /// Tells the user what the reader had to say.
    pub(crate) fn report(&self, verbosity: Verbosity) {
        for notice in &self.notices {
            verbosity.notice(notice);
        }
    }

    /// The source as a scene file elsewhere can use it: paths made absolute.
    pub(crate) fn portable_source(&self) -> anyhow::Result<VolumeSource> {
        let absolute = |path: &str| -> anyhow::Result<String> {
            if path.starts_with("sample:") {
                return Ok(path.to_owned());
            }
            let path = std::path::absolute(path).with_context(|| path.to_owned())?;
            Ok(path.to_string_lossy().into_owned())
        };
        Ok(match &self.source {
            VolumeSource::Path(path) => VolumeSource::Path(absolute(path)?),
            VolumeSource::Described(d) => {
                let mut d = d.clone();
                d.path = absolute(&d.path)?;
                VolumeSource::Described(d)
            }
        })
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
    Ok(ReadOptions { raw: raw_options, volume_index: raw.volume_index, ..ReadOptions::default() })
}

fn voxel_type(name: &str) -> anyhow::Result<VoxelType> {
    VoxelType::from_name(name).ok_or_else(|| {
        wrong_use(format!("`{name}` is no voxel type; use uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64"))
    })
}
