//! Every engine through the one door: `cutaway-engine`. Engines of a graphics device show as ignored without an adapter.

#[path = "engines/flat.rs"]
mod flat;

use cutaway_core::camera::Camera;
use cutaway_core::clip::{AxisBox, BufferDepth, Clip, ClipEvents, ClipShading, ObjectId};
use cutaway_core::glam::{DVec3, UVec3};
use cutaway_core::image::{Image, compare::compare};
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{
    Data, Engine, Gradient, ImageInterpolation, Layer, Layout, Mode, RenderSettings, Sampling, Scene,
    SpaceSkipping,
};
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_engine::{ENGINES, EngineError, Entry, Frame, Notice, Renderer, Request, Setting};
use cutaway_testing::gpus;
use cutaway_testing::scenes::{SMALL, oblique_noise, soft};
use libtest_mimic::{Arguments, Failed, Trial};

/// Engines that need a graphics adapter.
const ON_DEVICE: [&str; 3] = ["raycast", "slices", "cells"];

/// Root mean square error against the reference at the default step: half a voxel, and linear cells, cost this much.
const TOLERANCE: f64 = 0.02;

/// A test of one engine, by its name.
type EngineTest = fn(&'static str) -> Result<(), Failed>;

fn layer(data: &Data) -> Layer {
    let lighting = Lighting { shade: true, ..Lighting::default() };
    Layer::new(data, &soft(data.lattice().value_range())).with_lighting(lighting)
}

fn scene(data: &Data, settings: RenderSettings) -> Scene {
    let aspect = f64::from(SMALL[0]) / f64::from(SMALL[1]);
    let camera = cutaway_core::scene::default_camera(data.lattice(), aspect);
    let settings = RenderSettings { resolution: SMALL, ..settings };
    Scene::new(layer(data), camera, settings).expect("a valid scene")
}

fn noise() -> Data {
    oblique_noise(UVec3::new(21, 17, 13), 7).into()
}

fn rendered(renderer: &mut Renderer, scene: &Scene) -> Result<Frame, Failed> {
    Ok(renderer.render(scene, &Request::default())?)
}

fn image(frame: Frame) -> Result<Image, Failed> {
    frame.picture.into_image().ok_or_else(|| Failed::from("the image is on a device"))
}

/// An engine's image is that of the reference, within what its default step costs.
fn agrees_with_the_reference(engine: &'static str) -> Result<(), Failed> {
    let scene = scene(&noise(), RenderSettings::default());
    let truth = image(rendered(&mut Renderer::default().with_choice("reference"), &scene)?)?;
    let found = image(rendered(&mut Renderer::default().with_choice(engine), &scene)?)?;
    let rmse = compare(&truth, &found)?.rmse;
    if rmse <= TOLERANCE { Ok(()) } else { Err(format!("{engine}: RMSE {rmse}").into()) }
}

/// What does not decide a preparation or a classification makes neither again.
fn keys_are_exact(engine: &'static str) -> Result<(), Failed> {
    let mut renderer = Renderer::default().with_choice(engine);
    let data = noise();
    let first = rendered(&mut renderer, &scene(&data, RenderSettings::default()))?;
    if first.about.classify_ms == 0.0 {
        return Err("the first frame classified nothing".into());
    }
    let interpolation = ImageInterpolation::Factor(2);
    let same = [
        scene(&data, RenderSettings::default()),
        scene(&data, RenderSettings { image_interpolation: interpolation, ..RenderSettings::default() }),
        scene(&data, RenderSettings { early_termination: 0.9, ..RenderSettings::default() }),
        scene(&data, RenderSettings::default()).resized([31, 22])?,
    ];
    for scene in &same {
        let about = rendered(&mut renderer, scene)?.about;
        if (about.prepare_ms, about.classify_ms) != (0.0, 0.0) {
            return Err(format!("made ready again: {about:?}").into());
        }
    }
    let dim = Lighting { shade: true, ambient: 0.4, diffuse: 0.3, ..Lighting::default() };
    let camera = cutaway_core::scene::default_camera(data.lattice(), 1.5);
    let settings = RenderSettings { resolution: SMALL, ..RenderSettings::default() };
    let lit = Scene::new(layer(&data).with_lighting(dim), camera.clone(), settings.clone())?;
    let about = rendered(&mut renderer, &lit)?.about;
    if about.classify_ms != 0.0 {
        return Err("light made it classify again".into());
    }
    let [lo, hi] = data.lattice().value_range();
    let other = Layer::new(&data, &soft([lo, 0.5 * (lo + hi)]));
    let about = rendered(&mut renderer, &Scene::new(other, camera, settings)?)?.about;
    if about.classify_ms == 0.0 || about.prepare_ms != 0.0 {
        return Err(format!("another function: {about:?}").into());
    }
    let about = rendered(&mut renderer, &scene(&noise(), RenderSettings::default()))?.about;
    if about.prepare_ms == 0.0 { Err("other data were not prepared".into()) } else { Ok(()) }
}

/// A scene in which a setting is not the default.
fn set(setting: Setting) -> RenderSettings {
    let mut s = RenderSettings::default();
    match setting {
        Setting::Step => s.step = 1.7,
        Setting::EarlyTermination => s.early_termination = 0.3,
        Setting::SpaceSkipping => s.space_skipping = SpaceSkipping::Off,
        Setting::ProxyGeometry => s.space_skipping = SpaceSkipping::Fitted,
        Setting::InterpolationFactor => s.image_interpolation = ImageInterpolation::Factor(4),
        Setting::AdaptiveInterpolation => s.image_interpolation = ImageInterpolation::Adaptive,
        Setting::ObjectSampling => s.sampling = Sampling::Object,
        Setting::AdaptiveThreshold => s.adaptive_threshold = Some(0.01),
        Setting::PreIntegration => s.pre_integration = true,
        Setting::Gradient => s.gradient = Gradient::Sobel,
        Setting::Layout => s.layout = Layout::Bricks,
        Setting::Jitter => s.jitter = true,
        Setting::BrickSize => s.brick_size = 0,
        Setting::ProcessorEvents => s.clip_events = ClipEvents::Bvh,
        Setting::DeviceEvents => s.clip_events = ClipEvents::Peel,
        Setting::BufferDepth => (s.clip_events, s.buffer_depth) = (ClipEvents::Peel, BufferDepth::Half),
        other => panic!("no example of {other:?}"),
    }
    s
}

/// Settings that decide how an image is made and not what it shows: their effect is on time and memory. (Adaptive
/// interpolation fills nothing in an image as full of edges as this one.)
fn is_of_speed(setting: Setting) -> bool {
    matches!(
        setting,
        Setting::SpaceSkipping
            | Setting::AdaptiveInterpolation
            | Setting::ProxyGeometry
            | Setting::Layout
            | Setting::BrickSize
            | Setting::ProcessorEvents
            | Setting::DeviceEvents
            | Setting::BufferDepth
    )
}

/// Every setting on an engine changes the image or is of speed alone, or there is a notice; never both.
fn settings_have_an_effect_or_a_notice(engine: &'static str) -> Result<(), Failed> {
    let data = noise();
    let [lo, hi] = data
        .lattice()
        .corners_in_world()
        .into_iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lo, hi], p| [lo.min(p), hi.max(p)]);
    let half = AxisBox::new(lo, 0.5 * (lo + hi))?;
    let clip = Clip::everything().cut(Clip::object(ObjectId(0), std::sync::Arc::new(half)));
    let clipped = |settings| scene(&data, settings).with_clip(&clip, ClipShading::default());
    let mut renderer = Renderer::default().with_choice(engine);
    let plain = image(rendered(&mut renderer, &clipped(RenderSettings::default())?)?)?;
    for setting in Setting::ALL {
        let frame = rendered(&mut renderer, &clipped(set(setting))?)?;
        let noticed = frame
            .about
            .notices
            .iter()
            .any(|notice| matches!(notice, Notice::NoEffect { setting: of, .. } if *of == setting));
        let rmse = compare(&plain, &image(frame)?)?.rmse;
        // Shifted samples may round otherwise where a setting is of speed alone.
        let changed = rmse > 1e-7;
        if noticed && changed {
            return Err(format!("{setting:?} is said to have no effect and has one: {rmse}").into());
        }
        if !noticed && !changed && !is_of_speed(setting) {
            return Err(format!("{setting:?} has no effect, and no notice says so").into());
        }
    }
    Ok(())
}

/// Modes that an engine does not have are refused by name, and the others give an image.
fn modes_are_rendered_or_refused(engine: &'static str) -> Result<(), Failed> {
    let data = noise();
    let [lo, hi] = data.lattice().value_range();
    let mut renderer = Renderer::default().with_choice(engine);
    for mode in Mode::ALL {
        let iso = if mode == Mode::Iso { vec![0.5 * (lo + hi)] } else { Vec::new() };
        let scene = scene(&data, RenderSettings { mode, iso, ..RenderSettings::default() });
        let has = renderer.abilities(&scene, Default::default())?.modes.contains(&mode);
        match (renderer.render(&scene, &Request::default()), has) {
            (Ok(_), true) => {}
            (Err(EngineError::Mode { engine: by, mode: of }), false) if by == engine && of == mode.name() => {
            }
            (other, _) => return Err(format!("{mode:?}: {other:?}").into()),
        }
    }
    Ok(())
}

/// A ball of one value in another: every interpolated value is between them, and at them on plateaus.
fn mask(outside: f32, inside: f32) -> Data {
    let d = UVec3::splat(20);
    let at = |i: u32| UVec3::new(i % 20, i / 20 % 20, i / 400).as_dvec3() - DVec3::splat(9.5);
    let voxels: Vec<f32> = (0..8000).map(|i| if at(i).length() < 6.0 { inside } else { outside }).collect();
    let geometry = Geometry::from_spacing(DVec3::ONE);
    Volume::new(d, voxels, Rescale::IDENTITY, geometry).expect("a valid volume").into()
}

/// Pixels that an isosurface covers, from a direction.
fn covered(engine: &'static str, data: &Data, level: f64, turn: f64) -> Result<usize, Failed> {
    let settings =
        RenderSettings { mode: Mode::Iso, iso: vec![level], resolution: SMALL, ..RenderSettings::default() };
    let aspect = f64::from(SMALL[0]) / f64::from(SMALL[1]);
    let mut camera = cutaway_core::scene::default_camera(data.lattice(), aspect);
    camera.azimuth(turn);
    camera.elevation(0.3 * turn);
    let layer =
        Layer::new(data, &soft([0.0, 1.0])).with_lighting(Lighting { shade: false, ..Lighting::default() });
    let scene = Scene::new(layer, camera, settings)?;
    let image = image(rendered(&mut Renderer::default().with_choice(engine), &scene)?)?;
    Ok(image.pixels().iter().filter(|p| p[3] > 0.5).count())
}

/// Report 62: an isosurface at the value of the background has no crossing, and one at the greatest value is whole, from any
/// direction, for values that f32 cannot hold, too.
fn report_62_plateaus_at_the_isovalue(engine: &'static str) -> Result<(), Failed> {
    for (outside, inside) in [(-1000.0, 40.0), (0.0, 1.0), (0.1, 0.7)] {
        let data = mask(outside, inside);
        let [lowest, highest] = data.lattice().value_range();
        for turn in [0.0, 0.37, 1.1, 2.9] {
            let what = format!("{outside} and {inside} from {turn}");
            let background = covered(engine, &data, lowest, turn)?;
            if background != 0 {
                return Err(format!("{what}: {background} pixels of a surface that is not there").into());
            }
            let just_below = highest - 1e-4 * (highest - lowest);
            let [top, below] =
                [covered(engine, &data, highest, turn)?, covered(engine, &data, just_below, turn)?];
            if below == 0 || top.abs_diff(below) > 4 {
                return Err(format!("{what}: {top} pixels at the greatest value, {below} just below").into());
            }
        }
    }
    Ok(())
}

/// A soft ball on a grid whose spacing along z is `ratio` times that along x and y, seen so that only the scale differs.
fn stretched(ratio: f64, turn: f64, step: f64) -> Result<Scene, Failed> {
    let d = UVec3::new(33, 33, 17);
    let at = |i: u32| UVec3::new(i % 33, i / 33 % 33, i / (33 * 33)).as_dvec3() - DVec3::new(16.0, 16.0, 8.0);
    let soft_ball = |p: DVec3| (1.0 - (p * DVec3::new(1.0, 1.0, 2.0)).length() / 16.0).max(0.0) as f32;
    let voxels: Vec<f32> = (0..33 * 33 * 17).map(|i| soft_ball(at(i))).collect();
    let geometry = Geometry::from_spacing(DVec3::new(1.0, 1.0, ratio));
    let volume = Volume::new(d, voxels, Rescale::IDENTITY, geometry)?;
    let function = TransferFunction::new(vec![
        ControlPoint { value: 0.1, color: [0.9, 0.3, 0.1], opacity: 0.0 },
        ControlPoint { value: 1.0, color: [0.2, 0.6, 0.9], opacity: 0.2 },
    ])?;
    // The way through the ball has the same depth at every ratio.
    let layer = Layer::new(volume, &function).with_unit_distance(Some(ratio.max(1.0)));
    let mut camera = Camera {
        position: [16.0, 16.0, 8.0 * ratio + 60.0 * ratio.max(1.0)],
        focal_point: [16.0, 16.0, 8.0 * ratio],
        view_up: [0.0, 1.0, 0.0],
        view_angle: 30.0,
        orthographic: None,
    };
    if turn == 0.0 {
        camera.orthographic = Some(17.0);
    } else {
        camera = cutaway_core::scene::default_camera(layer.data().lattice(), 1.5);
        camera.azimuth(turn);
    }
    let layer = layer.with_lighting(Lighting { shade: turn != 0.0, ..Lighting::default() });
    Ok(Scene::new(layer, camera, RenderSettings { resolution: SMALL, step, ..RenderSettings::default() })?)
}

/// Report 63: a step is so many voxels along the ray, so that samples do not grow with the ratio of the spacings, and images
/// stay as near to the reference, along the axis and aslant.
fn report_63_spacings_of_any_ratio(engine: &'static str) -> Result<(), Failed> {
    let frame = |scene: &Scene| rendered(&mut Renderer::default().with_choice(engine), scene);
    let even = frame(&stretched(1.0, 0.0, 0.5)?)?;
    for ratio in [0.01, 1.7, 20.0, 1000.0] {
        let along = stretched(ratio, 0.0, 0.5)?;
        let found = frame(&along)?;
        let (samples, of_even) = (found.statistics.samples, even.statistics.samples);
        if let (Some(found), Some(even)) = (samples, of_even)
            && found > 4 * even
        {
            return Err(format!("ratio {ratio}: {found} samples, {even} with equal spacings").into());
        }
        for scene in [along, stretched(ratio, 0.4, 0.25)?] {
            let truth = image(rendered(&mut Renderer::default().with_choice("reference"), &scene)?)?;
            let rmse = compare(&truth, &image(frame(&scene)?)?)?.rmse;
            if rmse > 0.005 {
                return Err(format!("ratio {ratio}: RMSE {rmse}").into());
            }
        }
    }
    Ok(())
}

/// A sixth engine: one file, and one line here.
fn a_sixth_engine_renders() -> Result<(), Failed> {
    let entry = Entry { name: "flat", start: flat::start };
    let mut renderer = Renderer::default().with_engine(entry).with_choice("flat");
    let scene = scene(&noise(), RenderSettings { jitter: true, ..RenderSettings::default() });
    let frame = rendered(&mut renderer, &scene)?;
    let said: Vec<String> = frame.about.notices.iter().map(ToString::to_string).collect();
    if said != ["jitter true has no effect with the flat engine"] {
        return Err(format!("{said:?}").into());
    }
    let expected = Image::filled(SMALL[0], SMALL[1], flat::COLOR)?;
    if image(frame)? == expected { Ok(()) } else { Err("another image".into()) }
}

/// Volumes go to the cpu or to a GPU by themselves, and unknown names are refused.
fn the_choice_is_made_in_one_place() -> Result<(), Failed> {
    let scene = scene(&noise(), RenderSettings { engine: Engine::Auto, ..RenderSettings::default() });
    let engine = rendered(&mut Renderer::default(), &scene)?.about.engine;
    if !["cpu", "raycast"].contains(&engine) {
        return Err(format!("a volume went to {engine}").into());
    }
    match Renderer::default().with_choice("nothing").prepare(&scene) {
        Err(EngineError::Unknown { .. }) => Ok(()),
        other => Err(format!("{other:?}").into()),
    }
}

fn main() {
    let args = Arguments::from_args();
    let no_adapter = !gpus::there_is_an_adapter();
    let tests: [(&str, EngineTest); 4] = [
        ("agrees_with_the_reference", agrees_with_the_reference),
        ("keys_are_exact", keys_are_exact),
        ("settings_have_an_effect_or_a_notice", settings_have_an_effect_or_a_notice),
        ("modes_are_rendered_or_refused", modes_are_rendered_or_refused),
    ];
    let mut trials = Vec::new();
    for engine in ENGINES.iter().map(|entry| entry.name) {
        for (name, test) in tests {
            // The reference prepares nothing, and so has no times to tell.
            if engine == "reference" && name == "keys_are_exact" {
                continue;
            }
            let ignored = no_adapter && ON_DEVICE.contains(&engine);
            let trial = Trial::test(format!("{engine}::{name}"), move || test(engine));
            trials.push(trial.with_ignored_flag(ignored));
        }
    }
    for engine in ["reference", "cpu", "raycast"] {
        let name = format!("{engine}::report_62_plateaus_at_the_isovalue");
        let trial = Trial::test(name, move || report_62_plateaus_at_the_isovalue(engine));
        trials.push(trial.with_ignored_flag(no_adapter && ON_DEVICE.contains(&engine)));
    }
    for engine in ["cpu", "raycast", "slices"] {
        let name = format!("{engine}::report_63_spacings_of_any_ratio");
        let trial = Trial::test(name, move || report_63_spacings_of_any_ratio(engine));
        trials.push(trial.with_ignored_flag(no_adapter && ON_DEVICE.contains(&engine)));
    }
    trials.push(Trial::test("a_sixth_engine_renders", a_sixth_engine_renders));
    trials.push(Trial::test("the_choice_is_made_in_one_place", the_choice_is_made_in_one_place));
    libtest_mimic::run(&args, trials).exit();
}
