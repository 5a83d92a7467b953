//! From what the user named to a volume in memory.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use cutaway_core::histogram::Histogram;
use cutaway_core::scene::{RawVolumeSource, VolumeSource};
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_core::volume::{Volume, VoxelType};
use cutaway_io::samples::read_sample;
use cutaway_io::tetrahedra::{self, TetrahedraReadOptions, read_tetrahedra};
use cutaway_io::volume::{ReadOptions, read_volume};

/// A volume in memory, and where it came from.
#[derive(Debug)]
pub struct OpenVolume {
    /// The voxels; of an unstructured grid, what stands in for it.
    pub volume: Volume,
    /// An unstructured grid.
    pub mesh: Option<TetrahedralMesh>,
    /// As a scene file names it; paths are absolute.
    pub source: VolumeSource,
    /// What the reader had to say, one line each.
    pub notices: Vec<String>,
    histogram: OnceLock<Histogram>,
}

/// Bins of the histogram that the editor of transfer functions shows.
const BINS: usize = 512;

impl OpenVolume {
    /// A volume with the source it is known by.
    pub fn new(volume: Volume, source: VolumeSource) -> Self {
        Self { volume, mesh: None, source, notices: Vec::new(), histogram: OnceLock::new() }
    }

    /// Reads what the user named: a file, or `sample:NAME`.
    ///
    /// # Errors
    /// One line: the file, the place, what is wrong.
    pub fn read(name: &str) -> Result<Self, String> {
        Self::read_source(&VolumeSource::Path(name.to_owned()))
    }

    /// Reads what a scene file names; paths must be good here.
    ///
    /// # Errors
    /// One line: the file, the place, what is wrong.
    pub fn read_source(source: &VolumeSource) -> Result<Self, String> {
        let (name, options) = options_of(source)?;
        if let Some(sample) = name.strip_prefix("sample:") {
            let loaded = read_sample(sample, &options).map_err(|e| e.to_string())?;
            return Ok(Self { notices: loaded.notices, ..Self::new(loaded.value, source.clone()) });
        }
        let path = Path::new(name);
        let source = with_path(source, &absolute(path)?);
        if matches!(source, VolumeSource::Path(_)) && tetrahedra::recognize(path) {
            let loaded =
                read_tetrahedra(path, &TetrahedraReadOptions::default()).map_err(|e| e.to_string())?;
            let volume = loaded.value.stand_in().clone();
            let mesh = Some(loaded.value);
            return Ok(Self { mesh, notices: loaded.notices, ..Self::new(volume, source) });
        }
        let loaded = read_volume(path, &options).map_err(|e| e.to_string())?;
        Ok(Self { notices: loaded.notices, ..Self::new(loaded.value, source) })
    }

    /// What the user calls it.
    pub fn name(&self) -> &str {
        let path = path_of(&self.source);
        let file = Path::new(path).file_name().and_then(|name| name.to_str());
        file.filter(|_| !path.starts_with("sample:")).unwrap_or(path)
    }

    /// How many voxels have which value; counted when first asked for.
    pub fn histogram(&self) -> &Histogram {
        self.histogram.get_or_init(|| Histogram::new(&self.volume, BINS))
    }
}

/// The path in a source.
pub fn path_of(source: &VolumeSource) -> &str {
    match source {
        VolumeSource::Path(path) => path,
        VolumeSource::Described(described) => &described.path,
    }
}

/// The same source at another path.
pub fn with_path(source: &VolumeSource, path: &str) -> VolumeSource {
    match source {
        VolumeSource::Path(_) => VolumeSource::Path(path.to_owned()),
        VolumeSource::Described(described) => {
            VolumeSource::Described(RawVolumeSource { path: path.to_owned(), ..described.clone() })
        }
    }
}

fn absolute(path: &Path) -> Result<String, String> {
    let name = path.display();
    let absolute: PathBuf = std::path::absolute(path).map_err(|e| format!("{name}: {e}"))?;
    absolute
        .into_os_string()
        .into_string()
        .map_err(|_| format!("{name}: a scene file cannot hold a name that is not Unicode; rename the file"))
}

fn options_of(source: &VolumeSource) -> Result<(&str, ReadOptions), String> {
    let mut options = ReadOptions::default();
    let VolumeSource::Described(described) = source else { return Ok((path_of(source), options)) };
    let unknown = |name: &String| {
        format!("`{name}` is no voxel type; expected `uint8`, `int16`, `float32` or the like")
    };
    let voxel_type = described.voxel_type.as_ref();
    let voxel_type =
        voxel_type.map(|name| VoxelType::from_name(name).ok_or_else(|| unknown(name))).transpose()?;
    options.raw.dims = described.dims;
    options.raw.spacing = described.spacing;
    options.raw.big_endian = described.big_endian;
    options.raw.header_bytes = described.header_bytes;
    options.raw.voxel_type = voxel_type;
    Ok((&described.path, options))
}
