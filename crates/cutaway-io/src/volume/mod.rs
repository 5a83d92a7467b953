//! Volume files: bytes in, [`Volume`] out.
//!
//! What a file is follows from its content first and from its name second. Four formats are read, each in a module of
//! its own: NIfTI, NRRD, MetaImage and raw voxels with a description (`docs/formats.md` says what of them). All of them
//! turn what the header says into a `Layout` (held against the limits), an affine (LPS becomes RAS here, once) and a
//! `Payload`, which one module decodes for all.
//!
//! No reader touches the file system but through a [`Folder`]: [`read_volume`] gives it the folder of the file,
//! [`read_volume_bytes`] whatever the caller has.
//!
//! ```
//! use cutaway_io::volume::{MemoryFolder, ReadOptions, read_volume_bytes};
//!
//! let header = b"NRRD0001\ntype: uint8\ndimension: 3\nsizes: 2 1 1\nspacings: 1 1 3\nencoding: raw\ndata file: v\n";
//! let beside = MemoryFolder::from([("v".to_owned(), vec![7, 9])]);
//! let loaded = read_volume_bytes("a.nhdr", header, &beside, &ReadOptions::default())?;
//! assert_eq!(loaded.value.value_clamped(1, 0, 0), 9.0);
//! assert_eq!(loaded.value.spacing().z, 3.0);
//! # Ok::<(), cutaway_io::volume::ReadError>(())
//! ```

mod ascii;
mod description;
mod detached;
mod encoding;
pub(crate) mod error;
mod fields;
mod format;
mod layout;
mod metaimage;
mod nifti;
mod nrrd;
mod payload;
mod raw;
pub(crate) mod source;

use std::path::Path;

use cutaway_core::volume::{Endian, Geometry, NanMeaning, Rescale, Volume, VoxelType};

pub(crate) use detached::plain_name;
pub use error::{Place, ReadError};
pub use raw::{RawOptions, UnknownVoxelType};
pub use source::{DiskFolder, Folder, MemoryFolder, OpenError, ReadSeek, Source};

use crate::limits::Limits;
use crate::text;
use format::Format;
use layout::Layout;
use source::Stream;

/// How to read a volume.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// How much memory the volume may need.
    pub limits: Limits,
    /// What raw data are, where their name or a JSON file beside them does not say it (or says it wrongly).
    pub raw: RawOptions,
    /// Which volume to take of a file that holds several (a time series, interleaved channels), from 0. Without it
    /// the first of a series is taken, with a notice; colours and vectors are refused, for one of their components
    /// alone is rarely what is meant.
    pub volume_index: Option<usize>,
    /// How voxels are shown that have no value (NaN).
    pub nan: NanMeaning,
}

/// What was read, and what its user should know about it.
#[derive(Clone, Debug)]
pub struct Loaded<T> {
    /// What was read.
    pub value: T,
    /// Remarks, one line each, lower-case: voxels replaced, volumes left out, fields repaired.
    pub notices: Vec<String>,
}

/// Reads the volume in the file at `path`.
///
/// # Errors
/// See [`ReadError`]: every message names the file, the place, what was found and what was expected.
pub fn read_volume(path: &Path, options: &ReadOptions) -> Result<Loaded<Volume>, ReadError> {
    let file = error::shown_name(&path.to_string_lossy());
    let failed = |error, hint| ReadError::Open { file: file.clone(), error, hint };
    if path.is_dir() {
        return Err(format::folder(&file));
    }
    let source = source::open_file(path).map_err(|error| failed(error, ""))?;
    let folder = DiskFolder::new(path.parent().unwrap_or(Path::new("")));
    let folder = folder.map_err(|error| failed(error, "its folder cannot be opened"))?;
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    read_source(&file, &name, source, &folder, options)
}

/// Whether the file at `path` is of a format of volumes, damaged or not; false where it cannot be opened.
pub fn recognize(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let head = source::open_file(path).and_then(|mut source| source.head(format::HEAD));
    head.is_ok_and(|(head, inside)| {
        let format = format::detect("", &name, &head, inside.as_deref(), &ReadOptions::default());
        format.is_ok_and(|format| format != Format::Json)
    })
}

/// Reads a volume from a file in memory, without a file system.
///
/// `name` is the file's name without a path (raw data are described by it), `folder` the files that it may refer to:
/// an empty [`MemoryFolder`] where there are none.
///
/// # Errors
/// As [`read_volume`].
pub fn read_volume_bytes(
    name: &str,
    bytes: &[u8],
    folder: &dyn Folder,
    options: &ReadOptions,
) -> Result<Loaded<Volume>, ReadError> {
    read_source(&error::shown_name(name), name, Source::from_slice(bytes), folder, options)
}

/// Reads `source`, shown as `file` in messages, whose name in `folder` is `name`.
fn read_source(
    file: &str,
    name: &str,
    mut source: Source<'_>,
    folder: &dyn Folder,
    options: &ReadOptions,
) -> Result<Loaded<Volume>, ReadError> {
    let mut ctx = Context { file: file.to_owned(), folder, options, notices: Vec::new() };
    let head = source.head(format::HEAD);
    let (head, inside) = head.map_err(|error| ReadError::Io { file: file.to_owned(), offset: 0, error })?;
    let format = format::detect(file, name, &head, inside.as_deref(), options)?;
    if format != Format::Raw && options.raw != RawOptions::default() {
        let notice = "this file says itself what it holds: what was said of raw data (dims, type, spacing, ...) is not used";
        ctx.notices.push(notice.to_owned());
    }
    let stream = |source| {
        if inside.is_some() { Stream::gunzip(file, source) } else { Stream::plain(file, source) }
    };
    // The text of a header may begin with a mark that says nothing.
    let text = |source| {
        let mut stream = stream(source);
        let marked = inside.as_deref().unwrap_or(&head).starts_with(text::MARK);
        let skipped = stream.skip(if marked { text::MARK.len() as u64 } else { 0 });
        skipped.map(|_| stream).map_err(|error| ReadError::Io { file: file.to_owned(), offset: 0, error })
    };
    let value = match format {
        Format::Nifti => nifti::read(&mut ctx, stream(source), name),
        Format::NiftiPair => nifti::read_pair(&mut ctx, stream(source), name),
        Format::Nrrd => nrrd::read(&mut ctx, text(source)?),
        Format::MetaImage => metaimage::read(&mut ctx, text(source)?),
        Format::Raw => raw::read(&mut ctx, source, name),
        Format::Json => Err(description::refused(file, source)),
    }?;
    Ok(Loaded { value, notices: ctx.notices })
}

/// What every reader carries: the file's name for messages, the folder beside it, the options, the notices so far.
struct Context<'a> {
    file: String,
    folder: &'a dyn Folder,
    options: &'a ReadOptions,
    notices: Vec<String>,
}

impl Context<'_> {
    /// Adds a notice. A file with a thousand slices is not allowed a thousand of them.
    fn notice(&mut self, text: String) {
        const MOST: usize = 16;
        if self.notices.len() < MOST {
            self.notices.push(text);
        } else if self.notices.len() == MOST {
            self.notices.push("more of the like left out".to_owned());
        }
    }

    /// The path of a file beside this one, for messages.
    fn beside(&self, name: &str) -> String {
        let path = match self.file.rfind(['/', '\\']) {
            Some(end) => format!("{}{name}", &self.file[..=end]),
            None => name.to_owned(),
        };
        error::shown_name(&path)
    }

    fn too_large(&self, [x, y, z]: [u64; 3], voxel: VoxelType, needed: u64) -> ReadError {
        ReadError::TooLarge {
            file: self.file.clone(),
            what: format!("{x} x {y} x {z} {} voxels", voxel.name()),
            needed,
            limit: self.options.limits.max_bytes,
        }
    }

    /// The component and the volume that the options' index means, with a notice where there was a choice.
    fn choose(&mut self, components: u64, volumes: u64) -> Result<(u64, u64), ReadError> {
        let index = self.options.volume_index.unwrap_or(0);
        let count = components.saturating_mul(volumes);
        let wanted = index as u64;
        if wanted >= count {
            return Err(ReadError::VolumeIndex { file: self.file.clone(), index, volumes: count });
        }
        if count > 1 {
            self.notice(format!(
                "volume {index} of {count} taken (numbered from 0); choose with the volume index"
            ));
        }
        Ok((wanted % components, wanted / components))
    }

    /// The volume, checked by the core.
    fn finish(
        &mut self,
        layout: &Layout,
        endian: Endian,
        bytes: Vec<u8>,
        rescale: Rescale,
        geometry: Geometry,
    ) -> Result<Volume, ReadError> {
        let volume = Volume::from_bytes(layout.dims, layout.voxel, endian, bytes, rescale, geometry)
            .map_err(|error| ReadError::Volume { file: self.file.clone(), error: Box::new(error) })?;
        let missing = volume.missing();
        let infinite = volume.replaced() - missing;
        let [low, high] = volume.value_range().map(shortest);
        if missing > 0 {
            self.notice(nan_notice(missing, self.options.nan, &volume));
        }
        if infinite > 0 {
            self.notice(format!(
                "{infinite} voxels that are infinite, or out of all proportion to the others, replaced by {low} or {high}"
            ));
        }
        if let Some(notice) = loss_notice(&volume) {
            self.notice(notice);
        }
        Ok(volume.with_nan(self.options.nan))
    }
}

/// Says how so many NaN values are shown.
pub(crate) fn nan_notice(count: usize, meaning: NanMeaning, volume: &Volume) -> String {
    let [low, high] = volume.value_range().map(shortest);
    match meaning {
        NanMeaning::Transparent => format!("{count} values are NaN: cells that touch them show nothing"),
        NanMeaning::Lowest => format!("{count} values are NaN, shown as the lowest value, {low}"),
        NanMeaning::Highest => format!("{count} values are NaN, shown as the highest value, {high}"),
    }
}

/// Says what storing a volume's values as 32-bit floats lost.
pub(crate) fn loss_notice(volume: &Volume) -> Option<String> {
    let loss = volume.loss()?;
    let [low, high] = volume.value_range().map(shortest);
    let off = shortest(loss.largest);
    Some(format!(
        "values from {low} to {high} are more than 32-bit floats hold: they are off by up to {off}, and smaller \
         differences are lost"
    ))
}

/// A number with the digits that tell it from all others, and an exponent where it would be long.
fn shortest(v: f64) -> String {
    if v != 0.0 && !(1e-4..1e16).contains(&v.abs()) { format!("{v:e}") } else { v.to_string() }
}
