//! What voxels are kept as on the device.
//!
//! A texel is an affine function of a stored number (see `cutaway_core::volume::Rescale`); which one depends on the format:
//! normalised formats hold stored numbers as they are, 32-bit floats the same scaled to 0..=1 (floats: their place in the
//! volume's range), 16-bit floats the distance from the middle of the range, so that the eleven bits of their fraction are
//! spent on values that occur (Termeer 4.2.3): whole numbers in a range of up to 4096, which is what 8-bit data and most CT
//! scanners have, are held exactly.
//!
//! Which format is taken depends on what the adapter's own filter makes of it ([`FilterErrors`]): the voxels' own one where
//! the filter is exact enough; else a wider one that holds them without loss and that it filters well, at two to four times
//! the memory; else the filter is not used and the shader reads eight voxels for a value, which takes two to five times as
//! long.

use std::borrow::Cow;
use std::ops::Range;

use cutaway_core::volume::{Volume, Voxels};
use cutaway_core::with_voxels;
use half::f16;
use rayon::prelude::*;
use wgpu::TextureFormat as Format;

use crate::context::{Capabilities, FilterErrors, Filtering, Gpu};

/// How a stored number stands in a texture: `stored = texel * stored_per_texel + stored_at_zero`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texels {
    /// What it is kept as.
    pub format: wgpu::TextureFormat,
    /// Stored units of one texel unit.
    pub stored_per_texel: f64,
    /// The stored number of a texel of 0.
    pub stored_at_zero: f64,
    /// How values between voxels are found.
    pub filtering: Filtering,
}

/// Whole numbers that differ by at most this from the middle of a range are held exactly by a 16-bit float.
const EXACT_IN_HALF: f64 = 2048.0;

impl Texels {
    /// The ways to hold these voxels, the best one first; the last ones may be worse than the voxels, and smaller.
    pub(crate) fn choices(volume: &Volume, gpu: &Gpu) -> Vec<Self> {
        let can = gpu.capabilities();
        let native = native(volume.voxels(), can);
        if let Some(format) = can.texel_format.filter(|f| holds(volume.voxels(), *f, can)) {
            let filters = filters(format, can) && can.filtering != Some(Filtering::Exact);
            let filtering = if filters { Filtering::Hardware } else { Filtering::Exact };
            return vec![Self::new(volume, format, filtering)];
        }
        let filter = |format| filter(format, can, gpu.filter_errors());
        let mut choices = Vec::new();
        let mut choose = |format, filtering| choices.push(Self::new(volume, format, filtering));
        if filter(native) == Filtering::Hardware {
            choose(native, Filtering::Hardware);
        } else if can.filtering.is_none() {
            for format in WIDER {
                let lossless = format != Format::R16Float || half_is_exact(volume);
                let held = format != native && holds(volume.voxels(), format, can) && lossless;
                if held && filter(format) == Filtering::Hardware {
                    choose(format, Filtering::Hardware);
                }
            }
        }
        choose(native, Filtering::Exact);
        // Half the bytes, where 32 bits do not fit.
        if native == Format::R32Float {
            choose(Format::R16Float, filter(Format::R16Float));
        }
        choices
    }

    fn new(volume: &Volume, format: Format, filtering: Filtering) -> Self {
        let [lo, hi] = volume.stored_range().map(f64::from);
        let span = if hi > lo { hi - lo } else { 1.0 };
        let (stored_per_texel, stored_at_zero) = match (format, volume.voxels()) {
            // Powers of two, so that no bit is lost.
            (Format::R16Float, Voxels::U8(_)) => (256.0, 0.0),
            (Format::R16Float, _) if half_is_exact(volume) => (EXACT_IN_HALF, (0.5 * (lo + hi)).floor()),
            (Format::R16Float, _) => (0.5 * span, 0.5 * (lo + hi)),
            (_, Voxels::U8(_)) => (255.0, 0.0),
            (_, Voxels::U16(_)) => (65535.0, 0.0),
            (_, Voxels::F32(_)) => (span, lo),
        };
        Self { format, stored_per_texel, stored_at_zero, filtering }
    }

    /// The texel of a stored number.
    pub fn texel(&self, stored: f64) -> f64 {
        (stored - self.stored_at_zero) / self.stored_per_texel
    }

    /// Whether the device can filter the texture; else only single voxels can be read.
    pub(crate) fn filterable(&self, capabilities: &Capabilities) -> bool {
        filters(self.format, capabilities)
    }

    /// Bytes of a texel.
    pub fn bytes_per_voxel(&self) -> u32 {
        self.format.block_copy_size(None).unwrap_or(4)
    }

    /// The largest rounding of these voxels, as a share of their range; 0 where none is rounded (by more than f32 is).
    pub(crate) fn rounding(&self, volume: &Volume) -> f64 {
        // Half of the last of eleven bits, of a half range.
        if self.format == Format::R16Float && !half_is_exact(volume) { 0.5f64.powi(13) } else { 0.0 }
    }

    /// The bytes of some voxels, by linear index, as a texture takes them.
    pub(crate) fn bytes<'a>(&self, voxels: &'a Voxels, range: Range<usize>) -> Cow<'a, [u8]> {
        match (voxels, self.format) {
            (Voxels::U8(v), Format::R8Unorm) => Cow::Borrowed(&v[range]),
            (Voxels::U16(v), Format::R16Unorm) => Cow::Borrowed(bytemuck::cast_slice(&v[range])),
            _ => with_voxels!(voxels, v => Cow::Owned(self.encoded(&v[range]))),
        }
    }

    /// The bytes of stored numbers, fractional ones too.
    pub(crate) fn encoded<T: Copy + Into<f32> + Sync>(&self, stored: &[T]) -> Vec<u8> {
        let (at_zero, per_texel) = (self.stored_at_zero, self.stored_per_texel);
        let texel = |v: &T| ((f64::from((*v).into()) - at_zero) / per_texel) as f32;
        // Rounded to the nearest step.
        let step = |v: &T, greatest: f32| (texel(v) * greatest + 0.5).clamp(0.0, greatest);
        match self.format {
            Format::R8Unorm => stored.par_iter().map(|v| step(v, 255.0) as u8).collect(),
            Format::R16Unorm => bytes_of(stored.par_iter().map(|v| step(v, 65535.0) as u16).collect()),
            Format::R16Float => {
                bytes_of(stored.par_iter().map(|v| f16::from_f32(texel(v)).to_bits()).collect())
            }
            _ => bytes_of(stored.par_iter().map(texel).collect()),
        }
    }
}

/// Formats that voxels can be widened to, the fastest one first. Measured on llvmpipe, whose filter rounds `R8Unorm` to
/// steps of 256 and nothing else: the bonsai at 512 by 512, maximum projection, nanoseconds a sample, and root mean square
/// from the exact image: `R8Unorm` filtered 7.4 and 0.0007, `R16Float` 6.4 and 0.0004, `R16Unorm` 6.1 and 0.0004, eight
/// voxels in the shader 36 and 0.0004; shaded compositing 0.0009 as `R8Unorm`, 0.0002 as all others.
const WIDER: [Format; 3] = [Format::R16Float, Format::R16Unorm, Format::R32Float];

fn bytes_of<T: bytemuck::NoUninit>(texels: Vec<T>) -> Vec<u8> {
    bytemuck::cast_slice(&texels).to_vec()
}

/// The format of the voxels' own type, or the next that the device has.
fn native(voxels: &Voxels, can: &Capabilities) -> Format {
    match voxels {
        Voxels::U8(_) => Format::R8Unorm,
        Voxels::U16(_) if can.norm16 => Format::R16Unorm,
        Voxels::U16(_) | Voxels::F32(_) => Format::R32Float,
    }
}

/// Whether the device has a format, and it is made for such voxels.
fn holds(voxels: &Voxels, format: Format, can: &Capabilities) -> bool {
    match format {
        Format::R8Unorm => matches!(voxels, Voxels::U8(_)),
        Format::R16Unorm => can.norm16 && !matches!(voxels, Voxels::F32(_)),
        Format::R16Float | Format::R32Float => true,
        _ => false,
    }
}

/// Whether 16-bit floats hold the voxels as they are.
fn half_is_exact(volume: &Volume) -> bool {
    let [lo, hi] = volume.stored_range().map(f64::from);
    !matches!(volume.voxels(), Voxels::F32(_)) && hi - lo <= 2.0 * EXACT_IN_HALF
}

/// Whether the device filters a format at all.
fn filters(format: Format, can: &Capabilities) -> bool {
    match format {
        Format::R16Unorm => can.norm16,
        Format::R32Float => can.float_filtering,
        _ => true,
    }
}

/// How values of a format are found: as was asked for; else by the adapter if its filter is good.
fn filter(format: Format, can: &Capabilities, errors: &FilterErrors) -> Filtering {
    let hardware = match can.filtering {
        Some(filtering) => filtering == Filtering::Hardware,
        None => errors.is_exact_enough(format),
    };
    if hardware && filters(format, can) { Filtering::Hardware } else { Filtering::Exact }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_core::glam::{DVec3, UVec3};
    use cutaway_core::volume::{Geometry, Rescale, Voxel};

    fn volume<T: Voxel>(voxels: Vec<T>) -> Volume {
        let d = UVec3::new(voxels.len() as u32 / 4, 2, 2);
        Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap()
    }

    fn decoded(texels: &Texels, bytes: &[u8]) -> Vec<f64> {
        let texel: Vec<f64> = match texels.format {
            Format::R8Unorm => bytes.iter().map(|b| f64::from(*b) / 255.0).collect(),
            Format::R16Unorm => {
                bytemuck::cast_slice::<u8, u16>(bytes).iter().map(|v| f64::from(*v) / 65535.0).collect()
            }
            Format::R16Float => bytemuck::cast_slice::<u8, u16>(bytes)
                .iter()
                .map(|v| f64::from(f16::from_bits(*v).to_f32()))
                .collect(),
            _ => bytemuck::cast_slice::<u8, f32>(bytes).iter().map(|v| f64::from(*v)).collect(),
        };
        texel.iter().map(|t| t * texels.stored_per_texel + texels.stored_at_zero).collect()
    }

    /// Every format and type: what is held is what was stored, up to f32's own rounding and the rounding that is told.
    #[test]
    fn texels_are_what_was_stored() {
        let bytes: Vec<u8> = (0..=255).collect();
        let scanner: Vec<u16> = (31_000..31_000 + 4096).collect();
        let wide: Vec<u16> = (0..65_536u32).map(|v| v as u16).collect();
        let floats: Vec<f32> = (0..4096).map(|i| (i as f32 * 0.37).sin() * 1e6 - 3e5).collect();
        let formats = [Format::R8Unorm, Format::R16Unorm, Format::R16Float, Format::R32Float];
        for volume in [volume(bytes), volume(scanner), volume(wide), volume(floats)] {
            let can = crate::context::all_capabilities();
            for format in formats.into_iter().filter(|f| holds(volume.voxels(), *f, &can)) {
                let texels = Texels::new(&volume, format, Filtering::Exact);
                let n = volume.voxels().len();
                let held = decoded(&texels, &texels.bytes(volume.voxels(), 0..n));
                let [lo, hi] = volume.stored_range().map(f64::from);
                let bound = (hi - lo) * texels.rounding(&volume) + hi.abs().max(lo.abs()).max(hi - lo) * 2e-7;
                for (i, found) in held.iter().enumerate() {
                    let stored = f64::from(volume.voxels().get(i));
                    assert!((found - stored).abs() <= bound, "{format:?}: {found} for {stored}");
                }
                // As a brick, whose numbers come as floats, they are the same.
                let stored: Vec<f32> = (0..n).map(|i| volume.voxels().get(i)).collect();
                assert_eq!(texels.encoded(&stored), texels.bytes(volume.voxels(), 0..n).as_ref());
            }
        }
    }
}
