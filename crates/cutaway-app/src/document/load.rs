//! From what the user named to a volume in memory.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use cutaway_core::histogram::Histogram;
use cutaway_core::scene::{RawVolumeSource, VolumeSource};
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_core::volume::Volume;
use cutaway_io::named::{NamedVolume, VolumeName, read_named};
use cutaway_io::volume::{RawOptions, ReadOptions};

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
        let mut options = ReadOptions::default();
        if let VolumeSource::Described(described) = source {
            options.raw = RawOptions::described(described).map_err(|e| e.to_string())?;
        }
        let name = VolumeName::new(path_of(source).as_ref());
        let NamedVolume { volume, mesh, notices } = read_named(&name, &options).map_err(|e| e.to_string())?;
        let source = match &name {
            VolumeName::Sample(_) => source.clone(),
            VolumeName::File(path) => with_path(source, &absolute(path)?),
        };
        Ok(Self { mesh, notices, ..Self::new(volume, source) })
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
