//! From what the user named to a volume in memory.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use cutaway_core::histogram::Histogram;
use cutaway_core::scene::Data;
use cutaway_core::volume::{NanMeaning, Volume};
use cutaway_io::named::{NamedVolume, VolumeName, read_named};
use cutaway_io::scene_file::VolumeReference;

/// A volume in memory, and where it came from.
#[derive(Debug)]
pub struct OpenVolume {
    /// A volume or an unstructured grid.
    pub data: Data,
    /// As a scene file names it; paths are absolute.
    pub source: VolumeReference,
    /// How voxels without a value are shown; none: by default.
    pub nan: Option<NanMeaning>,
    /// What the reader had to say, one line each.
    pub notices: Vec<String>,
    histogram: OnceLock<Histogram>,
}

/// Bins of the histogram that the editor of transfer functions shows.
const BINS: usize = 512;

impl OpenVolume {
    /// A volume with the source it is known by.
    pub fn new(data: impl Into<Data>, source: VolumeReference) -> Self {
        Self { data: data.into(), source, nan: None, notices: Vec::new(), histogram: OnceLock::new() }
    }

    /// The regular grid that places the data in the world and holds its values.
    pub fn lattice(&self) -> &Volume {
        self.data.lattice()
    }

    /// Reads what the user named: a file, or `sample:NAME`.
    ///
    /// # Errors
    /// One line: the file, the place, what is wrong.
    pub fn read(name: &str) -> Result<Self, String> {
        Self::read_source(&VolumeReference::Path(name.to_owned()), None)
    }

    /// Reads what a scene file names, and how it shows voxels without a value; paths must be good here.
    ///
    /// # Errors
    /// One line: the file, the place, what is wrong.
    pub fn read_source(source: &VolumeReference, nan: Option<NanMeaning>) -> Result<Self, String> {
        let mut options = source.read_options().map_err(|e| e.to_string())?;
        options.nan = nan.unwrap_or_default();
        let name = VolumeName::new(source.path().as_ref());
        let NamedVolume { data, notices } = read_named(&name, &options).map_err(|e| e.to_string())?;
        let source = match &name {
            VolumeName::Sample(_) => source.clone(),
            VolumeName::File(path) => source.with_path(absolute(path)?),
        };
        Ok(Self { notices, nan, ..Self::new(data, source) })
    }

    /// What the user calls it.
    pub fn name(&self) -> &str {
        let path = self.source.path();
        let file = Path::new(path).file_name().and_then(|name| name.to_str());
        file.filter(|_| !path.starts_with("sample:")).unwrap_or(path)
    }

    /// How many voxels have which value; counted when first asked for.
    pub fn histogram(&self) -> &Histogram {
        self.histogram.get_or_init(|| Histogram::new(self.lattice(), BINS))
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
