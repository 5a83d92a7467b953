//! Volumes that ship with the program: small real ones, and made ones of any size.

use cutaway_core::analytic::AnalyticField;
use cutaway_core::angiography::{angiography, angiography_dimensions};
use cutaway_core::volume::Volume;

use crate::volume::{Loaded, MemoryFolder, ReadError, ReadOptions, read_volume_bytes};

/// A real sample: name, what it is, its NIfTI file.
struct Real {
    name: &'static str,
    about: &'static str,
    file: &'static [u8],
}

const REAL: [Real; 2] = [
    Real {
        name: "mr-head",
        about: "T1-weighted MR of a head, 160 x 232 x 160 (Scientific Computing and Imaging Institute, MIT)",
        file: include_bytes!("../samples/mr-head.nii.gz"),
    },
    Real {
        name: "bonsai",
        about: "CT of a bonsai tree, 256 x 256 x 256 (Stefan Roettger, MIT)",
        file: include_bytes!("../samples/bonsai.nii.gz"),
    },
];

/// The synthetic vessels.
const ANGIOGRAPHY: &str = "angiography";

/// Voxels along x of these unless their name says otherwise.
const ANGIOGRAPHY_SIZE: u32 = 256;

/// Voxels a side of an analytic sample unless its name says otherwise.
const DEFAULT_SIZE: u32 = 64;

/// Voxels a side of the largest analytic sample: 4 GiB of f32.
const LARGEST_SIZE: u32 = 1024;

/// Why there is no such sample.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The name is none of the samples.
    #[error("no sample is called `{name}`; there are {}", names().join(", "))]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// The size of a made sample is not a number in range.
    #[error("sample:{name}:{found}: expected a size of 2 to {LARGEST_SIZE} voxels a side")]
    Size {
        /// The sample.
        name: String,
        /// The size asked for.
        found: String,
    },
    /// An analytic sample that needs more memory than is allowed.
    #[error(
        "sample:{name}:{size} needs {needed} bytes, more than the limit of {limit}; choose a smaller size"
    )]
    TooLarge {
        /// The sample.
        name: String,
        /// Voxels a side.
        size: u32,
        /// Bytes it would take.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// A real sample has a size already.
    #[error("sample:{name} is measured data and has one size; leave out `:{found}`")]
    FixedSize {
        /// The sample.
        name: &'static str,
        /// The size asked for.
        found: String,
    },
    /// The bundled file could not be read under the limits given.
    #[error(transparent)]
    Read(#[from] ReadError),
}

/// Names of all samples, the real ones first.
pub fn names() -> Vec<&'static str> {
    REAL.iter().map(|r| r.name).chain(AnalyticField::NAMES).chain([ANGIOGRAPHY]).collect()
}

/// What a sample is, in a line.
pub fn about(name: &str) -> Option<&'static str> {
    if name == ANGIOGRAPHY {
        return Some(
            "synthetic vessels of a head, three sixteenths as deep as wide; `:SIZE` sets its voxels along x",
        );
    }
    let real = REAL.iter().find(|r| r.name == name).map(|r| r.about);
    real.or_else(|| AnalyticField::from_name(name).map(|_| "analytic field; `:SIZE` sets its voxels a side"))
}

/// The sample of a name, `NAME` or `NAME:SIZE` for analytic ones.
pub fn read_sample(name: &str, options: &ReadOptions) -> Result<Loaded<Volume>, SampleError> {
    let (base, size) = name.split_once(':').map_or((name, None), |(base, size)| (base, Some(size)));
    if let Some(real) = REAL.iter().find(|r| r.name == base) {
        return match size {
            Some(found) => Err(SampleError::FixedSize { name: real.name, found: found.to_owned() }),
            None => Ok(read_volume_bytes("sample.nii.gz", real.file, &MemoryFolder::default(), options)?),
        };
    }
    let made = match AnalyticField::from_name(base) {
        Some(field) => Made::Field(field),
        None if base == ANGIOGRAPHY => Made::Angiography,
        None => return Err(SampleError::Unknown { name: base.to_owned() }),
    };
    let size = match size {
        None => made.default_size(),
        Some(text) => text
            .parse()
            .ok()
            .filter(|n| (2..=LARGEST_SIZE).contains(n))
            .ok_or_else(|| SampleError::Size { name: base.to_owned(), found: text.to_owned() })?,
    };
    let (needed, limit) = (made.bytes(size), options.limits.max_bytes);
    if needed > limit {
        return Err(SampleError::TooLarge { name: base.to_owned(), size, needed, limit });
    }
    Ok(Loaded { value: made.volume(size), notices: Vec::new() })
}

/// A sample that is made on demand.
enum Made {
    Field(AnalyticField),
    Angiography,
}

impl Made {
    fn default_size(&self) -> u32 {
        match self {
            Self::Field(_) => DEFAULT_SIZE,
            Self::Angiography => ANGIOGRAPHY_SIZE,
        }
    }

    /// Twice what the voxels take: they are made, then stored.
    fn bytes(&self, size: u32) -> u64 {
        match self {
            Self::Field(_) => 8 * u64::from(size).pow(3),
            Self::Angiography => {
                4 * angiography_dimensions(size).to_array().map(u64::from).iter().product::<u64>()
            }
        }
    }

    fn volume(&self, size: u32) -> Volume {
        match self {
            Self::Field(field) => field.volume(size),
            Self::Angiography => angiography(size),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_can_be_read_and_says_what_it_is() {
        for name in names() {
            let loaded = read_sample(name, &ReadOptions::default()).unwrap();
            assert!(loaded.value.voxels().len() > 1000 && about(name).is_some(), "{name}");
        }
        let head = read_sample("mr-head", &ReadOptions::default()).unwrap().value;
        assert_eq!(head.dimensions().to_array(), [160, 232, 160]);
    }

    #[test]
    fn sizes_are_for_analytic_samples_and_bounded() {
        let size = |name: &str| read_sample(name, &ReadOptions::default()).map(|l| l.value.dimensions().x);
        assert_eq!(size("sphere:17").unwrap(), 17);
        assert_eq!(size("angiography:32").unwrap(), 32);
        let limits = crate::limits::Limits { max_bytes: 1 << 20 };
        let small = ReadOptions { limits, ..ReadOptions::default() };
        assert!(matches!(
            read_sample("sphere:64", &small),
            Err(SampleError::TooLarge { needed: 2_097_152, .. })
        ));
        for bad in ["sphere:1", "sphere:99999", "sphere:x", "sphere:", "bonsai:64", "nobody"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }
}
