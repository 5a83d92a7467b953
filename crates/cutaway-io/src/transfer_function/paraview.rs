//! ParaView's colour maps: what its preset dialog exports and imports (vtkSMTransferFunctionPresets).
//!
//! A list of objects, each with `RGBPoints` (value, red, green, blue, ...), perhaps `Points` (value, opacity, midpoint,
//! sharpness, ...), and the `ColorSpace` that colours are mixed in. `NanColor`, annotations and colours beyond the range have
//! no meaning here; colours for categories (`IndexedColors`) are no function of a value.

use serde::{Deserialize, Serialize};

use super::curves::Node;
use super::join::{self, Lists};
use super::spaces::ColorSpace;
use super::{FunctionFile, FunctionFormat, FunctionReadError, lenient};
use crate::volume::Loaded;
use crate::volume::error::quoted;

/// A map as the file has it; what is not listed is left alone.
#[derive(Debug, Deserialize)]
struct Map {
    #[serde(rename = "Name")]
    name: Option<String>,
    #[serde(rename = "ColorSpace")]
    space: Option<String>,
    #[serde(rename = "HSVWrap")]
    wrap: Option<Flag>,
    #[serde(rename = "UseLogScale")]
    log: Option<Flag>,
    #[serde(rename = "RGBPoints")]
    colors: Option<Vec<f64>>,
    #[serde(rename = "Points")]
    opacities: Option<Vec<f64>>,
    #[serde(rename = "IndexedColors")]
    indexed: Option<Vec<f64>>,
    #[serde(rename = "ScalarOpacityUnitDistance")]
    unit_distance: Option<f64>,
}

/// ParaView writes truth as `true` or as 1.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged, expecting = "expected true, false, 1 or 0")]
enum Flag {
    Bool(bool),
    Number(f64),
}

impl Flag {
    fn is_set(flag: Option<Self>) -> bool {
        matches!(flag, Some(Self::Bool(true))) || matches!(flag, Some(Self::Number(number)) if number != 0.0)
    }
}

/// What a map is called in messages.
fn called(map: &Map) -> String {
    quoted(map.name.as_deref().unwrap_or(""))
}

/// The map of a name, in any case where none is spelt alike; the first that has colours by value where none is asked for.
fn choose(file: &str, maps: Vec<Map>, wanted: Option<&str>) -> Result<Map, FunctionReadError> {
    const SHOWN: usize = 12;
    let mut maps: Vec<Map> = maps.into_iter().filter(|map| map.colors.is_some()).collect();
    let Some(wanted) = wanted else {
        return maps.into_iter().next().ok_or_else(|| FunctionReadError::Field {
            file: file.to_owned(),
            field: "RGBPoints".to_owned(),
            found: "only colours for categories".to_owned(),
            expected: "a map with colours by value".to_owned(),
        });
    };
    let name = |map: &Map| map.name.clone().unwrap_or_default();
    let found = maps.iter().position(|map| name(map) == wanted);
    let found =
        found.or_else(|| maps.iter().position(|map| name(map).to_lowercase() == wanted.to_lowercase()));
    if let Some(found) = found {
        return Ok(maps.swap_remove(found));
    }
    let known: Vec<String> = maps.iter().take(SHOWN).map(called).collect();
    let more = if maps.len() > SHOWN { format!(" and {} more", maps.len() - SHOWN) } else { String::new() };
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") + &more };
    Err(FunctionReadError::NoMap { file: file.to_owned(), name: quoted(wanted), known })
}

pub(super) fn parse(
    file: String,
    bytes: &[u8],
    wanted: Option<&str>,
) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    // An untagged enum of the two would forget where an error is.
    let list = lenient::begin(bytes).first() == Some(&b'[');
    let bytes = &lenient::strict(bytes);
    let maps: Result<Vec<Map>, _> =
        if list { serde_json::from_slice(bytes) } else { serde_json::from_slice(bytes).map(|one| vec![one]) };
    let maps = match maps {
        Ok(maps) => maps,
        Err(error) => return Err(FunctionReadError::Json { file, format: FunctionFormat::ParaView, error }),
    };
    let count = maps.len();
    let mut notices = Vec::new();
    let map = choose(&file, maps, wanted)?;
    if count > 1 && wanted.is_none() {
        notices.push(format!(
            "the file holds {count} colour maps; {} was read; a colon and a name after the file's name choose another",
            called(&map)
        ));
    }
    if map.indexed.as_ref().is_some_and(|colors| !colors.is_empty()) {
        notices.push("colours for categories (IndexedColors) were left out".to_owned());
    }
    let value = function(&file, map, &mut notices)?;
    Ok(Loaded { value, notices })
}

fn function(file: &str, map: Map, notices: &mut Vec<String>) -> Result<FunctionFile, FunctionReadError> {
    let space = space(file, &map, notices)?;
    if Flag::is_set(map.log) {
        notices.push("the map asks for a logarithmic scale; its points were taken as they are".to_owned());
    }
    let unit = map.unit_distance;
    let unit_distance = unit.map(|unit| join::unit_distance(file, "ScalarOpacityUnitDistance", unit));
    let fours = |field, numbers: Vec<f64>| fours(file, field, numbers);
    let color = |[x, r, g, b]: [f64; 4]| Node::straight(x, [r, g, b]);
    let opacity = |[x, y, midpoint, sharpness]: [f64; 4]| Node { x, y: [y], midpoint, sharpness };
    let colors = fours("RGBPoints", map.colors.unwrap_or_default())?;
    let opacities = map.opacities.map(|numbers| fours("Points", numbers)).transpose()?;
    // An empty list is how a map without opacities may be written.
    let opacities = opacities.filter(|points| !points.is_empty());
    let has_opacities = opacities.is_some();
    let lists = Lists {
        colors_name: "RGBPoints",
        colors: colors.into_iter().map(color).collect(),
        space,
        opacities_name: "Points",
        opacities: opacities.map(|points| points.into_iter().map(opacity).collect()),
    };
    let (function, sampled) = lists.joined(file)?;
    if !has_opacities {
        notices.push("the map has no opacities; they rise from 0 to 0.5 over its range".to_owned());
    }
    if sampled {
        notices
            .push("curves of the map were sampled: linear between points, off by less than 1/255".to_owned());
    }
    let unit_distance = unit_distance.transpose()?;
    Ok(FunctionFile { function, unit_distance, lighting: None, name: map.name, has_opacities })
}

fn space(file: &str, map: &Map, notices: &mut Vec<String>) -> Result<ColorSpace, FunctionReadError> {
    Ok(match map.space.as_deref() {
        None | Some("RGB") => ColorSpace::Rgb,
        Some("HSV") => ColorSpace::Hsv { wrap: Flag::is_set(map.wrap) },
        Some("HSVWrap" | "Wrapped") => ColorSpace::Hsv { wrap: true },
        Some("Lab" | "LAB" | "CIELAB") => ColorSpace::Lab,
        Some("Diverging") => ColorSpace::Diverging,
        Some("Step") => ColorSpace::Step,
        Some(close @ ("Lab/CIEDE2000" | "LabCIEDE2000" | "Prolab" | "ProLab")) => {
            notices.push(format!("colours are mixed in Lab, near to the map's {close}"));
            ColorSpace::Lab
        }
        Some(other) => {
            return Err(FunctionReadError::Field {
                file: file.to_owned(),
                field: "ColorSpace".to_owned(),
                found: quoted(other),
                expected: "RGB, HSV, Lab, Diverging or Step".to_owned(),
            });
        }
    })
}

fn fours(file: &str, field: &str, numbers: Vec<f64>) -> Result<Vec<[f64; 4]>, FunctionReadError> {
    let (fours, rest) = numbers.as_chunks::<4>();
    if rest.is_empty() {
        return Ok(fours.to_vec());
    }
    Err(FunctionReadError::Field {
        file: file.to_owned(),
        field: field.to_owned(),
        found: format!("{} numbers", numbers.len()),
        expected: "four a point".to_owned(),
    })
}

/// A map as we write it.
#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
struct Written<'a> {
    color_space: &'static str,
    name: &'a str,
    #[serde(rename = "RGBPoints")]
    colors: Vec<f64>,
    #[serde(rename = "Points")]
    opacities: Vec<f64>,
    /// ParaView passes over it: it keeps the unit distance with the volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    scalar_opacity_unit_distance: Option<f64>,
}

pub(super) fn text(file: &FunctionFile) -> String {
    let points = join::distinct(&file.function);
    let color = points.iter().flat_map(|p| [p.value, p.color[0], p.color[1], p.color[2]]);
    let opacity = points.iter().flat_map(|p| [p.value, p.opacity, 0.5, 0.0]);
    let written = Written {
        color_space: "RGB",
        name: file.name.as_deref().unwrap_or("cutaway"),
        colors: color.collect(),
        opacities: opacity.collect(),
        scalar_opacity_unit_distance: file.unit_distance,
    };
    let text = serde_json::to_string_pretty(&[written]);
    text.expect("numbers and words are always JSON") + "\n"
}
