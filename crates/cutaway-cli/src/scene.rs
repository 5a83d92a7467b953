//! From the command line and a scene file to a scene: options win over the file, the file over defaults.

use std::path::Path;

use cutaway_core::camera::Camera;
use cutaway_core::glam::DVec3;
use cutaway_core::lighting::Lighting;
use cutaway_core::presets::{self, Preset};
use cutaway_core::scene::{Mode, RenderSettings, Scene, SceneFile, TransferFunctionFile, default_camera};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::{colormaps, histogram};
use cutaway_io::json::{read_scene, read_transfer_function};

use crate::args::{CameraArgs, FunctionArgs, LightArgs, SceneArgs, closest};
use crate::load::{self, LoadedVolume};
use crate::report::wrong_use;

/// A volume in memory and every decision about its image.
pub(crate) struct Prepared {
    pub(crate) loaded: LoadedVolume,
    pub(crate) function: TransferFunction,
    pub(crate) unit_distance: Option<f64>,
    pub(crate) camera: Camera,
    pub(crate) lighting: Lighting,
    pub(crate) settings: RenderSettings,
    /// Whether a wrong number must come from the command line, not from a file.
    only_options: bool,
}

impl Prepared {
    pub(crate) fn new(args: &SceneArgs) -> anyhow::Result<Self> {
        let file = args.scene.as_deref().map(read_scene).transpose()?;
        let loaded = match (&args.volume, &file) {
            (Some(name), _) => load::from_argument(name, &args.raw)?,
            (None, Some(scene)) => {
                let folder = args.scene.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
                load::from_scene(&scene.volume, folder, &args.raw)?
            }
            (None, None) => return Err(wrong_use("give a volume or a scene file")),
        };
        let preset = args.function.preset.as_deref().map(preset).transpose()?;
        let settings = settings(args, file.as_ref(), preset)?;
        let lighting = lighting(&args.light, file.as_ref(), preset)?;
        let (function, unit_distance) = function(&args.function, file.as_ref(), preset, &loaded, &settings)?;
        let camera = camera(&args.camera, file.as_ref(), &loaded, &settings)?;
        let only_options = args.scene.is_none();
        Ok(Self { loaded, function, unit_distance, camera, lighting, settings, only_options })
    }

    /// The scene, every number checked.
    pub(crate) fn scene(&self) -> anyhow::Result<Scene<'_>> {
        let scene = Scene::new(
            &self.loaded.volume,
            &self.function,
            self.unit_distance,
            self.camera.clone(),
            self.lighting.clone(),
            self.settings.clone(),
        );
        scene.map_err(|e| if self.only_options { wrong_use(e.to_string()) } else { e.into() })
    }

    /// What a scene file says of it.
    pub(crate) fn to_file(&self) -> anyhow::Result<SceneFile> {
        Ok(SceneFile {
            volume: self.loaded.portable_source()?,
            transfer_function: Some(TransferFunctionFile {
                unit_distance: self.unit_distance,
                points: self.function.points().to_vec(),
            }),
            camera: Some(self.camera.clone()),
            lighting: self.lighting.clone(),
            render: self.settings.clone(),
        })
    }
}

fn preset(name: &str) -> anyhow::Result<&'static Preset> {
    presets::by_name(name).ok_or_else(|| {
        let names: Vec<&str> = presets::all().iter().map(|p| p.name).collect();
        let tip = closest(name, &names).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
        wrong_use(format!("no preset is called `{name}`{tip} (`cutaway presets` lists them)"))
    })
}

fn settings(
    args: &SceneArgs,
    file: Option<&SceneFile>,
    preset: Option<&Preset>,
) -> anyhow::Result<RenderSettings> {
    let mut s = file.map(|f| f.render.clone()).unwrap_or_default();
    if let Some(preset) = preset {
        s.mode = preset.mode;
    }
    if !args.iso.is_empty() {
        s.iso.clone_from(&args.iso);
        s.mode = Mode::Iso;
    }
    s.mode = args.mode.unwrap_or(s.mode);
    s.engine = args.engine.unwrap_or(s.engine);
    s.step = args.step.unwrap_or(s.step);
    s.early_termination = args.early_termination.unwrap_or(s.early_termination);
    s.space_skipping = args.space_skipping.unwrap_or(s.space_skipping);
    s.brightness = args.function.brightness.unwrap_or(s.brightness);
    if let Some(resolution) = &args.resolution {
        s.resolution = resolution.exactly_whole("--resolution")?;
    }
    // Checked here too: the default camera already needs the aspect ratio.
    if s.resolution.contains(&0) {
        return Err(wrong_use("--resolution: each side must be at least 1"));
    }
    Ok(s)
}

fn lighting(args: &LightArgs, file: Option<&SceneFile>, preset: Option<&Preset>) -> anyhow::Result<Lighting> {
    let mut l = file.map(|f| f.lighting.clone()).unwrap_or_default();
    if let Some(preset) = preset {
        l.shade = preset.shade;
    }
    l.shade = args.shade || (l.shade && !args.no_shade);
    l.ambient = args.ambient.unwrap_or(l.ambient);
    l.diffuse = args.diffuse.unwrap_or(l.diffuse);
    l.specular = args.specular.unwrap_or(l.specular);
    l.specular_power = args.specular_power.unwrap_or(l.specular_power);
    l.diffuse_curve = args.diffuse_curve.unwrap_or(l.diffuse_curve);
    if let Some(light) = &args.light {
        l.light = Some(light.exactly("--light")?);
    }
    Ok(l)
}

fn function(
    args: &FunctionArgs,
    file: Option<&SceneFile>,
    preset: Option<&Preset>,
    loaded: &LoadedVolume,
    settings: &RenderSettings,
) -> anyhow::Result<(TransferFunction, Option<f64>)> {
    let volume = &loaded.volume;
    let projection = matches!(settings.mode, Mode::Mip | Mode::Minip | Mode::Mean);
    let (function, unit) = if let Some(preset) = preset {
        (preset.transfer_function(volume), preset.unit_distance())
    } else if let Some(path) = &args.transfer_function {
        read_transfer_function(path)?
    } else if let Some(name) = &args.colormap {
        (colormap(name, args, volume.value_range())?, None)
    } else if let (Some(window), Some(level)) = (args.window, args.level) {
        if !(window > 0.0 && window.is_finite() && level.is_finite()) {
            return Err(wrong_use(format!(
                "--window is {window}, --level {level}; expected a width above 0 and a value"
            )));
        }
        let range = [level - 0.5 * window, level + 0.5 * window];
        (if projection { histogram::gray_ramp(range) } else { histogram::translucent_ramp(range) }, None)
    } else if let Some(f) = file.and_then(|f| f.transfer_function.as_ref()) {
        (TransferFunction::new(f.points.clone())?, f.unit_distance)
    } else {
        (histogram::default_for_mode(volume, settings.mode), None)
    };
    Ok((function, args.opacity_unit_distance.or(unit)))
}

fn colormap(name: &str, args: &FunctionArgs, [lo, hi]: [f64; 2]) -> anyhow::Result<TransferFunction> {
    let [lo, hi] = args.range.as_ref().map_or(Ok([lo, hi]), |r| r.exactly("--range"))?;
    if lo >= hi {
        return Err(wrong_use(format!("--range is {lo},{hi}; the first value must be less than the second")));
    }
    let opacities = match &args.opacity {
        None => vec![(lo, 0.0), (hi, 0.5)],
        Some(list) if list.0.len() % 2 == 0 => list.0.chunks(2).map(|pair| (pair[0], pair[1])).collect(),
        Some(list) => {
            let n = list.0.len();
            return Err(wrong_use(format!(
                "--opacity takes value,opacity pairs; {n} numbers cannot be paired"
            )));
        }
    };
    let Some(points) = colormaps::by_name(name) else {
        let tip = closest(name, colormaps::NAMES).map_or(String::new(), |n| format!("; did you mean `{n}`?"));
        return Err(wrong_use(format!(
            "no colour map is called `{name}`{tip} (`cutaway presets` lists them)"
        )));
    };
    let colors: Vec<_> = points.into_iter().map(|(at, color)| (lo + at * (hi - lo), color)).collect();
    TransferFunction::from_color_and_opacity(&colors, &opacities)
        .map_err(|e| wrong_use(format!("--opacity: {e}")))
}

fn camera(
    args: &CameraArgs,
    file: Option<&SceneFile>,
    loaded: &LoadedVolume,
    settings: &RenderSettings,
) -> anyhow::Result<Camera> {
    let aspect = f64::from(settings.resolution[0]) / f64::from(settings.resolution[1]);
    let mut camera =
        file.and_then(|f| f.camera.clone()).unwrap_or_else(|| default_camera(&loaded.volume, aspect));
    if let Some(p) = &args.camera_position {
        camera.position = p.exactly("--camera-position")?;
    }
    if let Some(p) = &args.camera_focal_point {
        camera.focal_point = p.exactly("--camera-focal-point")?;
    }
    if let Some(p) = &args.camera_view_up {
        camera.view_up = p.exactly("--camera-view-up")?;
    }
    camera.view_angle = args.camera_view_angle.unwrap_or(camera.view_angle);
    camera.orthographic = args.camera_orthographic.or(camera.orthographic);
    let moved = [args.azimuth, args.elevation, args.roll, args.zoom].iter().any(Option::is_some);
    if moved {
        // Turning a camera without a direction would make NaN of it.
        camera.validate().map_err(|e| wrong_use(e.to_string()))?;
        camera.azimuth(args.azimuth.unwrap_or(0.0).to_radians());
        camera.elevation(args.elevation.unwrap_or(0.0).to_radians());
        camera.roll(args.roll.unwrap_or(0.0).to_radians());
        let zoom = args.zoom.unwrap_or(1.0);
        if !(zoom > 0.0 && zoom.is_finite()) {
            return Err(wrong_use(format!("--zoom is {zoom}; expected a factor above 0")));
        }
        camera.zoom(zoom);
    }
    Ok(camera)
}

/// A vector as people write it.
pub(crate) fn show(v: [f64; 3]) -> String {
    let v = DVec3::from_array(v);
    format!("{:.4}, {:.4}, {:.4}", v.x, v.y, v.z)
}
