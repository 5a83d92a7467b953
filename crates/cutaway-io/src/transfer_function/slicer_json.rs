//! Slicer's volume properties as JSON (`.vp.json`; volume-property-schema-v1.0.0).
//!
//! `volumeProperties` is a list, of which the first is taken, as Slicer does; so is the first of its `components`. Each function
//! is a list of `points` with midpoint and sharpness.

use serde::{Deserialize, Serialize};

use super::curves::Node;
use super::join::{self, Lists};
use super::spaces::ColorSpace;
use super::{FunctionFile, FunctionFormat, FunctionReadError};
use crate::volume::Loaded;

const SCHEMA: &str = "https://raw.githubusercontent.com/slicer/slicer/main/Modules/Loadable/VolumeRendering/Resources/Schema/volume-property-schema-v1.0.0.json#";

/// A file; what is not listed is left alone when read.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct VolumePropertyFile {
    #[serde(rename = "@schema", default, skip_deserializing)]
    schema: &'static str,
    volume_properties: Vec<Property>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Property {
    #[serde(skip_deserializing)]
    effective_range: [f64; 2],
    #[serde(skip_deserializing)]
    iso_surface_values: [f64; 0],
    #[serde(skip_deserializing)]
    independent_components: bool,
    interpolation_type: Option<String>,
    components: Vec<Component>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Component {
    #[serde(skip_deserializing)]
    component_weight: f64,
    shade: Option<bool>,
    lighting: Option<Light>,
    disable_gradient_opacity: Option<bool>,
    scalar_opacity_unit_distance: Option<f64>,
    rgb_transfer_function: Option<Points<ColorPoint>>,
    scalar_opacity: Option<Points<OpacityPoint>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gradient_opacity: Option<Points<OpacityPoint>>,
}

/// What VTK has where a file says nothing.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Light {
    diffuse: f64,
    ambient: f64,
    specular: f64,
    specular_power: f64,
}

impl Default for Light {
    fn default() -> Self {
        Self { diffuse: 0.7, ambient: 0.1, specular: 0.2, specular_power: 10.0 }
    }
}

#[derive(Debug, Serialize, Deserialize)]
struct Points<P> {
    #[serde(rename = "type", default, skip_deserializing)]
    kind: &'static str,
    points: Vec<P>,
}

#[derive(Debug, Serialize, Deserialize)]
struct ColorPoint {
    x: f64,
    color: [f64; 3],
    #[serde(default = "half")]
    midpoint: f64,
    #[serde(default)]
    sharpness: f64,
}

#[derive(Debug, Serialize, Deserialize)]
struct OpacityPoint {
    x: f64,
    y: f64,
    #[serde(default = "half")]
    midpoint: f64,
    #[serde(default)]
    sharpness: f64,
}

fn half() -> f64 {
    0.5
}

pub(super) fn parse(file: String, bytes: &[u8]) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    let read: VolumePropertyFile = match serde_json::from_slice(bytes) {
        Ok(read) => read,
        Err(error) => {
            return Err(FunctionReadError::Json { file, format: FunctionFormat::SlicerJson, error });
        }
    };
    let mut notices = Vec::new();
    let properties = read.volume_properties.len();
    let Some(property) = read.volume_properties.into_iter().next() else {
        return Err(missing(&file, "volumeProperties", "nothing", "a volume property"));
    };
    if properties > 1 {
        notices.push(format!("the file holds {properties} volume properties; the first was taken"));
    }
    if property.interpolation_type.as_deref() == Some("nearest") {
        notices.push("the file asks for the nearest voxel; values are interpolated all the same".to_owned());
    }
    let components = property.components.len();
    let Some(component) = property.components.into_iter().next() else {
        return Err(missing(&file, "components", "nothing", "a component"));
    };
    if components > 1 {
        notices.push(format!("the volume property has {components} components; the first was taken"));
    }
    let value = function(&file, component, &mut notices)?;
    Ok(Loaded { value, notices })
}

fn missing(file: &str, field: &str, found: &str, expected: &str) -> FunctionReadError {
    let [field, found, expected] = [field, found, expected].map(str::to_owned);
    FunctionReadError::Field { file: file.to_owned(), field, found, expected }
}

fn function(
    file: &str,
    component: Component,
    notices: &mut Vec<String>,
) -> Result<FunctionFile, FunctionReadError> {
    let gradient = component.gradient_opacity.filter(|_| component.disable_gradient_opacity != Some(true));
    if gradient.is_some_and(|gradient| gradient.points.iter().any(|point| point.y != 1.0)) {
        notices.push("opacity by the gradient was left out: cutaway has none".to_owned());
    }
    let need = |field| missing(file, field, "nothing", "a function");
    let colors = component.rgb_transfer_function.ok_or_else(|| need("rgbTransferFunction"))?;
    let opacities = component.scalar_opacity.ok_or_else(|| need("scalarOpacity"))?;
    let color = |p: ColorPoint| Node { x: p.x, y: p.color, midpoint: p.midpoint, sharpness: p.sharpness };
    let opacity = |p: OpacityPoint| Node { x: p.x, y: [p.y], midpoint: p.midpoint, sharpness: p.sharpness };
    let lists = Lists {
        colors_name: "rgbTransferFunction",
        colors: colors.points.into_iter().map(color).collect(),
        space: ColorSpace::Rgb,
        opacities_name: "scalarOpacity",
        opacities: Some(opacities.points.into_iter().map(opacity).collect()),
    };
    let (function, sampled) = lists.joined(file)?;
    if sampled {
        notices.push("curves were sampled: linear between points, off by less than 1/255".to_owned());
    }
    let unit = component.scalar_opacity_unit_distance.unwrap_or(1.0);
    let unit_distance = Some(join::unit_distance(file, "scalarOpacityUnitDistance", unit)?);
    let lighting = if component.lighting.is_none() && component.shade.is_none() {
        None
    } else {
        let light = component.lighting.unwrap_or_default();
        let factors = [light.ambient, light.diffuse, light.specular, light.specular_power];
        let names = ["ambient", "diffuse", "specular", "specularPower"];
        Some(join::lighting(file, component.shade.unwrap_or(true), names, factors)?)
    };
    Ok(FunctionFile { function, unit_distance, lighting, name: None, has_opacities: true })
}

pub(super) fn text(file: &FunctionFile) -> (String, Vec<String>) {
    let mut notices = Vec::new();
    if file.unit_distance.is_none() {
        notices.push("opacities for the mean voxel spacing were written as those for 1 mm".to_owned());
    }
    let points = join::distinct(&file.function);
    let color =
        points.iter().map(|p| ColorPoint { x: p.value, color: p.color, midpoint: 0.5, sharpness: 0.0 });
    let opacity =
        points.iter().map(|p| OpacityPoint { x: p.value, y: p.opacity, midpoint: 0.5, sharpness: 0.0 });
    let light = file.lighting.clone().unwrap_or_default();
    let component = Component {
        component_weight: 1.0,
        shade: Some(light.shade),
        lighting: Some(Light {
            diffuse: light.diffuse,
            ambient: light.ambient,
            specular: light.specular,
            specular_power: light.specular_power,
        }),
        disable_gradient_opacity: Some(true),
        scalar_opacity_unit_distance: Some(file.unit_distance.unwrap_or(1.0)),
        rgb_transfer_function: Some(Points { kind: "colorTransferFunction", points: color.collect() }),
        scalar_opacity: Some(Points { kind: "piecewiseLinearFunction", points: opacity.collect() }),
        gradient_opacity: None,
    };
    let (first, last) = (&points[0], &points[points.len() - 1]);
    let written = VolumePropertyFile {
        schema: SCHEMA,
        volume_properties: vec![Property {
            effective_range: [first.value, last.value],
            iso_surface_values: [],
            independent_components: true,
            interpolation_type: Some("linear".to_owned()),
            components: vec![component],
        }],
    };
    let text = serde_json::to_string_pretty(&written);
    (text.expect("numbers and words are always JSON") + "\n", notices)
}
