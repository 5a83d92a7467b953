//! Named colour maps.
//!
//! A map is a list of points (position in 0..=1, colour), linear between them and within 1/255 of the published 256
//! colours: the maps are kept as points rather than taken from a crate because those we looked at approximate them with
//! splines through a few colours (off by up to 16/255 for viridis), and a dozen points each are smaller than any
//! dependency.

use crate::transfer_function::{TransferFunction, TransferFunctionError};

mod tables;

/// A colour and where it stands: a position or a value, and straight RGB display values in 0..=1.
pub type ColorPoint = (f64, [f64; 3]);

/// Every map, without its reverse.
pub const NAMES: &[&str] =
    &["gray", "viridis", "inferno", "magma", "plasma", "cividis", "turbo", "coolwarm", "hot", "bone"];

/// Why a colour map does not make a transfer function.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ColormapError {
    /// No map of that name.
    #[error("there is no colour map `{name}`; expected one of {}, or one of them with `_r` for its reverse", NAMES.join(", "))]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// The range has no width, or is not a range of numbers.
    #[error("the colour map's range is {lo} to {hi}; expected two finite numbers, the smaller first")]
    Range {
        /// Its lower end.
        lo: f64,
        /// Its upper end.
        hi: f64,
    },
    /// The opacities are not a function.
    #[error("the colour map's opacities: {0}")]
    Opacities(#[from] TransferFunctionError),
}

/// The points of a map, positions ascending from 0 to 1. Upper and lower case are the same; `NAME_r` is the map
/// reversed, and `grey` is `gray`.
pub fn by_name(name: &str) -> Option<Vec<ColorPoint>> {
    let name = name.to_ascii_lowercase();
    let (map, reversed) = match name.strip_suffix("_r") {
        Some(map) => (map, true),
        None => (name.as_str(), false),
    };
    let mut points: Vec<ColorPoint> =
        table(map)?.iter().map(|&(i, rgb)| (f64::from(i) / 255.0, color(rgb))).collect();
    if reversed {
        points.reverse();
        points.iter_mut().for_each(|p| p.0 = 1.0 - p.0);
    }
    Some(points)
}

/// A map stretched over the values `lo..=hi`, with opacities of its own: (value, opacity per unit distance in 0..=1),
/// ordered by value and at least one.
pub fn over_range(
    name: &str,
    lo: f64,
    hi: f64,
    opacities: &[(f64, f64)],
) -> Result<TransferFunction, ColormapError> {
    let points = by_name(name).ok_or_else(|| ColormapError::Unknown { name: name.to_owned() })?;
    if !(lo < hi && (hi - lo).is_finite()) {
        return Err(ColormapError::Range { lo, hi });
    }
    let colors: Vec<ColorPoint> = points.into_iter().map(|(p, c)| (lo + p * (hi - lo), c)).collect();
    Ok(TransferFunction::from_color_and_opacity(&colors, opacities)?)
}

fn table(name: &str) -> Option<&'static [(u8, u32)]> {
    Some(match name {
        "gray" | "grey" => tables::GRAY,
        "viridis" => tables::VIRIDIS,
        "inferno" => tables::INFERNO,
        "magma" => tables::MAGMA,
        "plasma" => tables::PLASMA,
        "cividis" => tables::CIVIDIS,
        "turbo" => tables::TURBO,
        "coolwarm" => tables::COOLWARM,
        "hot" => tables::HOT,
        "bone" => tables::BONE,
        _ => return None,
    })
}

fn color(rgb: u32) -> [f64; 3] {
    let [_, r, g, b] = rgb.to_be_bytes();
    [r, g, b].map(|c| f64::from(c) / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published maps: a name, then 16 lines of 16 colours, and so on.
    const PUBLISHED: &str = include_str!("../tests/data/colormaps.txt");

    fn published() -> Vec<(&'static str, Vec<[f64; 3]>)> {
        let mut maps: Vec<(&str, Vec<[f64; 3]>)> = Vec::new();
        for line in PUBLISHED.lines().filter(|l| !l.starts_with('#')) {
            if NAMES.contains(&line) {
                maps.push((line, Vec::new()));
            } else {
                let colors = line.split(' ').map(|c| color(u32::from_str_radix(c, 16).unwrap()));
                maps.last_mut().unwrap().1.extend(colors);
            }
        }
        maps
    }

    #[test]
    fn every_map_is_within_one_255th_of_the_published_one() {
        let maps = published();
        assert_eq!(maps.iter().map(|m| m.0).collect::<Vec<_>>(), NAMES);
        for (name, colors) in maps {
            assert_eq!(colors.len(), 256, "{name}");
            let function = over_range(name, 0.0, 255.0, &[(0.0, 1.0)]).unwrap();
            for (i, expected) in colors.iter().enumerate() {
                let (found, _) = function.evaluate(i as f64);
                let off = (0..3).map(|c| (found[c] - expected[c]).abs()).fold(0.0, f64::max);
                assert!(off <= 1.0 / 255.0 + 1e-9, "{name} at {i}: {found:?}, expected {expected:?}");
            }
        }
    }

    #[test]
    fn positions_ascend_from_0_to_1_forwards_and_in_reverse() {
        for name in NAMES.iter().flat_map(|n| [(*n).to_owned(), format!("{n}_r"), n.to_uppercase()]) {
            let points = by_name(&name).unwrap();
            assert_eq!((points[0].0, points[points.len() - 1].0), (0.0, 1.0), "{name}");
            assert!(points.windows(2).all(|w| w[0].0 < w[1].0), "{name}");
        }
        assert_eq!(by_name("viridis_r").unwrap()[0].1, by_name("Viridis").unwrap().last().unwrap().1);
        assert_eq!(by_name("rainbow"), None);
    }

    #[test]
    fn a_map_over_a_range_keeps_its_colours_and_takes_the_opacities() {
        let f = over_range("gray", -100.0, 300.0, &[(0.0, 0.0), (200.0, 0.5)]).unwrap();
        let (color, opacity) = f.evaluate(100.0);
        assert!(color.iter().all(|c| (c - 0.5).abs() < 1e-12) && (opacity - 0.25).abs() < 1e-12);
        assert_eq!(f.evaluate(-500.0), ([0.0; 3], 0.0));
    }

    #[test]
    fn what_makes_no_function_is_refused_in_words() {
        let unknown = over_range("virids", 0.0, 1.0, &[(0.0, 1.0)]).unwrap_err().to_string();
        assert!(unknown.contains("`virids`") && unknown.contains("viridis"), "{unknown}");
        for (lo, hi) in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            let error = over_range("gray", lo, hi, &[(0.0, 1.0)]);
            assert!(matches!(error, Err(ColormapError::Range { .. })), "{lo} {hi}");
        }
        let opacities = over_range("gray", 0.0, 1.0, &[(0.0, 2.0)]);
        assert!(matches!(opacities, Err(ColormapError::Opacities(_))));
    }
}
