//! Pictures of the bundled samples, as they were when somebody looked at them.

use cutaway_core::glam::DVec3;
use cutaway_core::histogram::default_for_mode;
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::presets;
use cutaway_core::reference;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene, default_camera};
use cutaway_core::volume::Volume;
use cutaway_cpu::SimdChoice;
use cutaway_io::samples::read_sample;
use cutaway_io::volume::ReadOptions;
use cutaway_testing::engines::cpu;
use cutaway_testing::golden::assert_golden;

/// Width and height: odd, so that no tile or packet is full at the border.
const SIZE: [u32; 2] = [101, 67];

fn sample(name: &str) -> Volume {
    read_sample(name, &ReadOptions::default()).unwrap().value
}

fn settings(mode: Mode) -> RenderSettings {
    RenderSettings { mode, resolution: SIZE, ..RenderSettings::default() }
}

fn scene(volume: &Volume, settings: RenderSettings, lighting: Lighting) -> Scene {
    let function = default_for_mode(volume, settings.mode);
    let camera = default_camera(volume, f64::from(SIZE[0]) / f64::from(SIZE[1]));
    Scene::new(Layer::new(volume.clone(), &function).with_lighting(lighting), camera, settings).unwrap()
}

#[test]
fn first_pictures() {
    for name in ["mr-head", "bonsai", "marschner-lobb"] {
        let volume = sample(name);
        let scene = scene(&volume, settings(Mode::Composite), Lighting::default());
        assert_golden(&format!("{name}-default"), &cpu(&scene, SimdChoice::Auto, 0).0);
    }
}

#[test]
fn modes() {
    let volume = sample("mr-head");
    for mode in [Mode::Mip, Mode::Minip, Mode::Mean] {
        let scene = scene(&volume, settings(mode), Lighting::default());
        assert_golden(&format!("mr-head-{}", mode.name()), &cpu(&scene, SimdChoice::Auto, 0).0);
    }
    let settings = RenderSettings { iso: vec![120.0], ..settings(Mode::Iso) };
    let scene = scene(&volume, settings, Lighting::default());
    assert_golden("mr-head-iso", &cpu(&scene, SimdChoice::Auto, 0).0);
}

#[test]
fn lights_and_views() {
    let volume = sample("bonsai");
    let lighting = Lighting {
        diffuse_curve: DiffuseCurve::Wrapped,
        light: Some([-1.0, -1.0, 1.0]),
        ..Lighting::default()
    };
    let mut scene = scene(&volume, settings(Mode::Composite), lighting);
    assert_golden("bonsai-wrapped-light", &cpu(&scene, SimdChoice::Auto, 0).0);
    let mut camera = scene.camera().clone();
    camera.orthographic = Some(90.0);
    camera.azimuth(1.0);
    camera.elevation(0.5);
    scene.set_camera(camera).unwrap();
    assert_golden("bonsai-orthographic", &cpu(&scene, SimdChoice::Auto, 0).0);
    // The eye inside the volume: the near side is cut away by the eye itself.
    let mut camera = scene.camera().clone();
    camera.orthographic = None;
    camera.view_angle = 60.0;
    camera.position = (volume.center_in_world() + DVec3::new(0.0, -40.0, 20.0)).to_array();
    camera.focal_point = volume.center_in_world().to_array();
    camera.view_up = [0.0, 0.0, 1.0];
    scene.set_camera(camera).unwrap();
    assert_golden("bonsai-inside", &cpu(&scene, SimdChoice::Auto, 0).0);
}

#[test]
fn presets_and_the_reference() {
    let volume = sample("mr-head");
    let preset = presets::by_name("MR-Default").unwrap();
    let function = preset.transfer_function(&volume);
    let lighting = Lighting { shade: preset.shade, ..Lighting::default() };
    let camera = default_camera(&volume, f64::from(SIZE[0]) / f64::from(SIZE[1]));
    let settings = settings(preset.mode);
    let scene = Scene::new(
        Layer::new(volume.clone(), &function)
            .with_unit_distance(preset.unit_distance())
            .with_lighting(lighting),
        camera,
        settings,
    )
    .unwrap();
    assert_golden("mr-head-preset-mr-default", &reference::render(&scene));
}
