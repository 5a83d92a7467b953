//! From the command line and a scene file to a scene: options win over the file, the file over defaults.

mod camera;

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use cutaway_core::camera::{Camera, CameraError};
use cutaway_core::clip::{ClipShading, FlatClip};
use cutaway_core::colormaps::ColormapError;
use cutaway_core::defaults::{FramedView, Look, display_range};
use cutaway_core::glam::DVec3;
use cutaway_core::lighting::Lighting;
use cutaway_core::presets::{self, Preset};
use cutaway_core::scene::{Layer, MAX_RESOLUTION, Mode, RenderSettings, Scene, SceneError};
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::{colormaps, histogram};
use cutaway_io::limits::Limits;
use cutaway_io::scene_file::{SceneFile, read_scene};
use cutaway_io::transfer_function::{FunctionFile, TransferFunctionFile, read_transfer_function};
use cutaway_io::volume::Loaded;

use crate::args::{FunctionArgs, LightArgs, SceneArgs};
use crate::clip::{self, PreparedClip};
use crate::load::{self, LoadedVolume};
use crate::report::{Verbosity, wrong_use};
use crate::values::{shown, tip};

/// A volume in memory and every decision about its image.
pub(crate) struct Prepared {
    pub(crate) loaded: LoadedVolume,
    pub(crate) function: TransferFunction,
    pub(crate) unit_distance: Option<f64>,
    pub(crate) camera: Camera,
    /// The box that the default view frames, in voxels, if it was made for what is visible.
    pub(crate) visible: Option<[DVec3; 2]>,
    pub(crate) lighting: Lighting,
    pub(crate) settings: RenderSettings,
    pub(crate) clip: Option<PreparedClip>,
    pub(crate) clip_shading: ClipShading,
    function_notices: Vec<String>,
    origins: Origins,
}

impl Prepared {
    pub(crate) fn new(args: &SceneArgs) -> anyhow::Result<Self> {
        Self::of_loaded(args, |file| match (&args.volume, file, &args.scene) {
            (Some(name), _, _) => load::from_argument(name, &args.raw),
            (None, Some(scene), Some(path)) => load::from_scene(scene, path, &args.raw),
            _ => Err(wrong_use("give a volume or a scene file")),
        })
    }

    /// Says what there is to know of the files.
    pub(crate) fn report(&self, verbosity: Verbosity) {
        self.loaded.report(verbosity);
        self.function_notices.iter().for_each(|notice| verbosity.notice(notice));
        self.clip.iter().flat_map(|clip| &clip.notices).for_each(|notice| verbosity.notice(notice));
    }

    /// Another scene of the same volume, which is not loaded again: the volume that `args` name is not looked at.
    pub(crate) fn again(self, args: &SceneArgs) -> anyhow::Result<Self> {
        Self::of_loaded(args, |_| Ok(self.loaded))
    }

    fn of_loaded(
        args: &SceneArgs,
        load: impl FnOnce(Option<&SceneFile>) -> anyhow::Result<LoadedVolume>,
    ) -> anyhow::Result<Self> {
        let file = args.scene.as_deref().map(read_scene).transpose()?;
        let preset = args.function.preset.as_deref().map(preset).transpose()?;
        let mut origins = Origins::new(args);
        let settings = settings(args, file.as_ref(), preset)?;
        // Checked before the rest: the default camera already needs the aspect ratio.
        check_resolution(settings.resolution).map_err(|e| origins.blame(&e))?;
        let function_path = args.function.transfer_function.as_deref().filter(|_| preset.is_none());
        let given = function_path.map(read_transfer_function).transpose()?;
        let (given, function_notices) = match given {
            Some(Loaded { value, notices }) => (Some(value), notices),
            None => (None, Vec::new()),
        };
        let lighting = lighting(&args.light, file.as_ref(), preset, given.as_ref())?;
        let loaded = load(file.as_ref())?;
        origins.volume.clone_from(&loaded.name);
        let (function, unit_distance) =
            function(&args.function, file.as_ref(), preset, given, &loaded, &settings, &origins)?;
        let in_file = file.as_ref().zip(args.scene.as_deref());
        let clip = PreparedClip::new(&args.clip, in_file, loaded.lattice(), &settings)?;
        let clip_shading = clip::shading(&args.clip, file.as_ref());
        clip_shading.validate().map_err(|e| origins.blame(&e))?;
        let flat = clip.as_ref().map(|clip| FlatClip::new(&clip.clip)).transpose();
        let flat = flat.map_err(|e| origins.blame(&e.into()))?;
        let function_shown = function.with_brightness(settings.brightness);
        let look = Look {
            volume: loaded.lattice(),
            function: &function_shown,
            mode: settings.mode,
            iso: &settings.iso,
            clip: flat.as_ref(),
        };
        let FramedView { camera, visible } =
            camera::camera(&args.camera, file.as_ref(), &look, &settings, &origins)?;
        Ok(Self {
            loaded,
            function,
            unit_distance,
            camera,
            visible,
            lighting,
            settings,
            clip,
            clip_shading,
            function_notices,
            origins,
        })
    }

    /// The scene, every number checked.
    pub(crate) fn scene(&self) -> anyhow::Result<Scene> {
        let scene = Scene::new(
            Layer::new(self.loaded.data.clone(), &self.function)
                .with_unit_distance(self.unit_distance)
                .with_lighting(self.lighting.clone()),
            self.camera.clone(),
            self.settings.clone(),
        );
        let clipped = |scene: Scene| match &self.clip {
            Some(clip) => scene.with_clip(&clip.clip, self.clip_shading.clone()),
            None => Ok(scene),
        };
        scene.and_then(clipped).map_err(|e| self.origins.blame(&e))
    }

    /// What a scene file at `path` says of it.
    pub(crate) fn to_file(&self, path: &Path) -> anyhow::Result<SceneFile> {
        Ok(SceneFile {
            volume: self.loaded.source_for(path)?,
            nan: self.loaded.nan(),
            transfer_function: Some(TransferFunctionFile {
                unit_distance: self.unit_distance,
                points: self.function.points().to_vec(),
            }),
            camera: Some(self.camera.clone()),
            lighting: self.lighting.clone(),
            clip: self.clip.as_ref().map(|clip| clip.to_file(path)).transpose()?,
            clip_shading: self.clip_shading.clone(),
            render: self.settings.clone(),
            viewer: None,
        })
    }
}

/// Where the numbers of a scene came from, so that a wrong one can be laid at the right door.
struct Origins {
    /// Options given, each with what [`SceneError`] and [`CameraError`] call the field that it sets.
    options: Vec<(&'static str, &'static str)>,
    scene: Option<PathBuf>,
    volume: String,
}

impl Origins {
    fn new(args: &SceneArgs) -> Self {
        let (f, l, c) = (&args.function, &args.light, &args.camera);
        let all = [
            ("resolution", "--resolution", args.resolution.is_some()),
            ("step", "--step", args.step.is_some()),
            ("early_termination", "--early-termination", args.early_termination.is_some()),
            ("adaptive_threshold", "--adaptive-threshold", args.adaptive_threshold.is_some()),
            ("pre_integration", "--pre-integration", args.pre_integration),
            ("image_interpolation", "--image-interpolation", args.image_interpolation.is_some()),
            ("blur", "--blur", args.blur.is_some()),
            ("brick_size", "--brick-size", args.brick_size.is_some()),
            ("iso", "--iso", !args.iso.is_empty()),
            ("iso", "--mode iso", args.mode == Some(Mode::Iso)),
            ("brightness", "--brightness", f.brightness.is_some()),
            ("unit_distance", "--opacity-unit-distance", f.opacity_unit_distance.is_some()),
            ("unit_distance", "--transfer-function", f.transfer_function.is_some()),
            ("ambient", "--ambient", l.ambient.is_some()),
            ("diffuse", "--diffuse", l.diffuse.is_some()),
            ("specular", "--specular", l.specular.is_some()),
            ("specular_power", "--specular-power", l.specular_power.is_some()),
            ("light", "--light", l.light.is_some()),
            ("thickness", "--impregnation-thickness", args.clip.options.impregnation_thickness.is_some()),
            ("overlay", "--clip-intensity", args.clip.options.clip_intensity.is_some()),
            ("position", "--camera-position", c.camera_position.is_some()),
            ("focal point", "--camera-focal-point", c.camera_focal_point.is_some()),
            ("view up", "--camera-view-up", c.camera_view_up.is_some()),
            ("view angle", "--camera-view-angle", c.camera_view_angle.is_some()),
            ("view angle", "--zoom", c.zoom.is_some()),
            ("orthographic scale", "--camera-orthographic", c.camera_orthographic.is_some()),
            ("orthographic scale", "--zoom", c.zoom.is_some()),
        ];
        let options = all.into_iter().filter(|(.., given)| *given).map(|(field, option, _)| (field, option));
        Self { options: options.collect(), scene: args.scene.clone(), volume: String::new() }
    }

    /// An error with the option (wrong use) or the file that it comes from.
    fn blame(&self, error: &SceneError) -> anyhow::Error {
        let fields: &[&str] = match error {
            SceneError::Setting { field, .. } => &[field],
            SceneError::Camera(CameraError::Field { field, .. }) => &[field],
            SceneError::Camera(CameraError::NoDirection { .. }) => &["position", "focal point"],
            _ => return anyhow!("{}: {error}", self.volume),
        };
        let option = self.options.iter().find(|(field, _)| fields.contains(field));
        match (option, &self.scene) {
            (Some((_, option)), _) => wrong_use(format!("{option}: {error}")),
            (None, Some(scene)) => anyhow!("{}: {error}", scene.display()),
            (None, None) => anyhow!("{}: {error}", self.volume),
        }
    }

    /// An error of the scene file.
    fn blame_scene(&self, error: impl std::fmt::Display) -> anyhow::Error {
        match &self.scene {
            Some(scene) => anyhow!("{}: {error}", scene.display()),
            None => anyhow!("{error}"),
        }
    }
}

/// Bytes that a pixel takes while it is rendered, at most: measured as 39 for the cpu engine, 62 for the reference.
const BYTES_A_PIXEL: u64 = 64;

/// Whether an image of this size can be held. What a scene allows is checked again with everything else.
fn check_resolution([width, height]: [u32; 2]) -> Result<(), SceneError> {
    let error = |expected| {
        let found = format!("{width} x {height}");
        Err(SceneError::Setting { field: "resolution", found, expected })
    };
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 {
        return error("at least 1 pixel a side");
    }
    let (most_side, most_pixels) = MAX_RESOLUTION;
    let allowed = width.max(height) <= most_side && pixels <= most_pixels;
    if allowed && pixels * BYTES_A_PIXEL > Limits::default().max_bytes {
        return error("an image that this machine has the memory for, at 64 bytes a pixel");
    }
    Ok(())
}

fn preset(name: &str) -> anyhow::Result<&'static Preset> {
    presets::by_name(name).ok_or_else(|| {
        let names: Vec<&str> = presets::all().iter().map(|p| p.name).collect();
        let tip = tip(name, &names);
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
    s.segments = args.clip.options.segments.unwrap_or(s.segments);
    s.backmost |= args.clip.options.backmost;
    s.clip_events = args.clip.options.clip_events.unwrap_or(s.clip_events);
    s.buffer_depth = args.clip.options.buffer_depth.unwrap_or(s.buffer_depth);
    s.space_skipping = args.space_skipping.unwrap_or(s.space_skipping);
    s.brick_size = args.brick_size.unwrap_or(s.brick_size);
    s.sampling = args.sampling.unwrap_or(s.sampling);
    s.adaptive_threshold = args.adaptive_threshold.or(s.adaptive_threshold);
    s.pre_integration |= args.pre_integration;
    s.gradient = args.gradient.unwrap_or(s.gradient);
    s.layout = args.layout.unwrap_or(s.layout);
    s.image_interpolation = args.image_interpolation.unwrap_or(s.image_interpolation);
    s.jitter |= args.jitter;
    s.blur = args.blur.unwrap_or(s.blur);
    s.brightness = args.function.brightness.unwrap_or(s.brightness);
    if let Some(resolution) = &args.resolution {
        s.resolution = resolution.exactly_whole("--resolution")?;
    }
    Ok(s)
}

/// Light and material; the light that a file of a transfer function holds has no direction and no curve.
fn lighting(
    args: &LightArgs,
    file: Option<&SceneFile>,
    preset: Option<&Preset>,
    given: Option<&FunctionFile>,
) -> anyhow::Result<Lighting> {
    let mut l = file.map(|f| f.lighting.clone()).unwrap_or_default();
    if let Some(of_function) = given.and_then(|given| given.lighting.clone()) {
        l = Lighting {
            diffuse_curve: l.diffuse_curve,
            wrap_power: l.wrap_power,
            light: l.light,
            ..of_function
        };
    }
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
    given: Option<FunctionFile>,
    loaded: &LoadedVolume,
    settings: &RenderSettings,
    origins: &Origins,
) -> anyhow::Result<(TransferFunction, Option<f64>)> {
    let volume = loaded.lattice();
    let projection = matches!(settings.mode, Mode::Mip | Mode::Minip | Mode::Mean);
    let (function, unit) = if let Some(preset) = preset {
        (preset.transfer_function(volume), preset.unit_distance())
    } else if let Some(given) = given {
        (given.function, given.unit_distance)
    } else if let Some(name) = &args.colormap {
        (colormap(name, args, || display_range(volume))?, None)
    } else if let (Some(window), Some(level)) = (args.window, args.level) {
        if window <= 0.0 {
            return Err(wrong_use(format!("--window is {}; expected a width above 0", shown(window))));
        }
        let range = [level - 0.5 * window, level + 0.5 * window];
        (if projection { histogram::gray_ramp(range) } else { histogram::translucent_ramp(range) }, None)
    } else if let Some(f) = file.and_then(|f| f.transfer_function.as_ref()) {
        (TransferFunction::new(f.points.clone()).map_err(|e| origins.blame_scene(e))?, f.unit_distance)
    } else {
        (histogram::default_for_mode(volume, settings.mode), None)
    };
    Ok((function, args.opacity_unit_distance.or(unit)))
}

/// A colour map over the range of the options, or over `default`, which is a range.
fn colormap(
    name: &str,
    args: &FunctionArgs,
    default: impl FnOnce() -> [f64; 2],
) -> anyhow::Result<TransferFunction> {
    let [lo, hi] = args.range.as_ref().map_or_else(|| Ok(default()), |r| r.exactly("--range"))?;
    if lo >= hi {
        let [lo, hi] = [lo, hi].map(shown);
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
    colormaps::over_range(name, lo, hi, &opacities).map_err(|error| match error {
        ColormapError::Unknown { .. } => {
            let tip = tip(name, colormaps::NAMES);
            wrong_use(format!("no colour map is called `{name}`{tip} (`cutaway presets` lists them)"))
        }
        error => wrong_use(format!("--opacity: {error}")),
    })
}
