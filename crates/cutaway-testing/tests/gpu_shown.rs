//! Frames that stay on the device for a window to show: read back, they are what `render` returns. And frames that nobody
//! wants any more, which leave the renderer as it was.

use std::sync::atomic::AtomicBool;

use cutaway_core::glam::UVec3;
use cutaway_core::image::Image;
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{ImageInterpolation, RenderSettings, Scene};
use cutaway_gpu::{
    CellOptions, CellRenderer, Extras, Gpu, GpuError, Pending, RaycastRenderer, ShownFrame, SliceRenderer,
};
use cutaway_testing::gpus::{self, there_is_an_adapter};
use cutaway_testing::scenes::{SMALL, framed, oblique_noise, soft};
use libtest_mimic::{Arguments, Failed, Trial};

/// Rounding to 8 bits, which the device may do either way near a half.
const LARGEST_DIFFERENCE: f32 = 0.5 / 255.0 + 1e-4;

/// Begins to render a scene for nobody, then renders it both ways.
type Engine = fn(&Gpu, &Scene) -> Result<(Image, ShownFrame), GpuError>;

fn main() {
    let arguments = Arguments::from_args();
    let there = there_is_an_adapter();
    let engines: [(&str, Engine); 3] = [("raycast", raycast), ("slices", slices), ("cells", cells)];
    let mut trials: Vec<Trial> = Vec::new();
    trials.extend(engines.map(|(name, engine)| {
        let test = move || every_finish(name, engine);
        Trial::test(format!("{name}_shows_what_it_renders"), test).with_ignored_flag(!there)
    }));
    trials.push(Trial::test("submitted_frames_wait_for_nobody", submitted).with_ignored_flag(!there));
    libtest_mimic::run(&arguments, trials).exit();
}

/// Two frames are submitted before the outcome of either is learnt, the later one's first; both are what `render` returns.
fn submitted() -> Result<(), Failed> {
    let gpu = gpus::best()?.gpu().clone();
    let volume = oblique_noise(UVec3::new(21, 17, 13), 3);
    let function = soft(volume.value_range());
    let settings = RenderSettings { resolution: SMALL, ..RenderSettings::default() };
    let lights = [Lighting::default(), Lighting { shade: false, ..Lighting::default() }];
    let scenes = lights.map(|light| framed(&volume, &function, light, settings.clone()));
    let quiet = &|_: f32| {};

    let engine = RaycastRenderer::new(&gpu)?;
    let prepared = engine.prepare(&volume)?;
    let classes = engine.classify(&prepared, &scenes[0])?;
    let submit = |scene: &Scene| engine.submit(&prepared, &classes, scene, &Extras::default(), quiet);
    outcomes("raycast", &scenes, submit, |scene| engine.render(&prepared, &classes, scene, quiet))?;

    let engine = SliceRenderer::new(&gpu)?;
    let prepared = engine.prepare(&volume)?;
    let classes = engine.classify(&prepared, &scenes[0])?;
    let submit = |scene: &Scene| engine.submit(&prepared, &classes, scene, None, quiet);
    outcomes("slices", &scenes, submit, |scene| engine.render(&prepared, &classes, scene, quiet))?;

    let engine = CellRenderer::new(&gpu, CellOptions::default())?;
    let prepared = engine.prepare(&volume)?;
    let classes = engine.classify(&prepared, &scenes[0])?;
    let submit = |scene: &Scene| engine.submit(&prepared, &classes, scene, None, quiet);
    outcomes("cells", &scenes, submit, |scene| engine.render(&prepared, &classes, scene, quiet))
}

fn outcomes<S>(
    name: &str,
    scenes: &[Scene; 2],
    submit: impl Fn(&Scene) -> Result<Pending<S>, GpuError>,
    render: impl Fn(&Scene) -> Result<(Image, S), GpuError>,
) -> Result<(), Failed> {
    let [first, second] = [submit(&scenes[0])?, submit(&scenes[1])?];
    let second = second.outcome()?.0;
    // The device works in order.
    if !first.is_there()? {
        return Err(format!("{name}: the first frame is not there, and the second one is").into());
    }
    let first = first.outcome()?.0;
    if first.pixels() == second.pixels() {
        return Err(format!("{name}: both scenes look alike").into());
    }
    for (scene, found) in scenes.iter().zip([&first, &second]) {
        if render(scene)?.0.pixels() != found.pixels() {
            return Err(format!("{name}: a submitted frame is not what is rendered").into());
        }
    }
    Ok(())
}

/// Whole images, and those that are filled in or blurred before they are shown.
fn every_finish(name: &str, engine: Engine) -> Result<(), Failed> {
    let gpu = gpus::best()?.gpu().clone();
    let volume = oblique_noise(UVec3::new(21, 17, 13), 3);
    let function = soft(volume.value_range());
    let plain = RenderSettings { resolution: SMALL, ..RenderSettings::default() };
    let cases = [
        ("plain", plain.clone()),
        ("filled in", RenderSettings { image_interpolation: ImageInterpolation::Factor(3), ..plain.clone() }),
        ("blurred", RenderSettings { blur: 1.5, ..plain }),
    ];
    for (case, settings) in cases {
        let scene = framed(&volume, &function, Lighting::default(), settings);
        let (image, shown) = engine(&gpu, &scene)?;
        same(&format!("{name}, {case}"), &image, &read(&gpu, &shown)?)?;
    }
    Ok(())
}

fn raycast(gpu: &Gpu, scene: &Scene) -> Result<(Image, ShownFrame), GpuError> {
    let renderer = RaycastRenderer::new(gpu)?;
    let volume = renderer.prepare(scene.volume())?;
    let classification = renderer.classify(&volume, scene)?;
    let cancelled = Extras { cancel: Some(&CANCELLED), ..Extras::default() };
    given_up(renderer.render_with(&volume, &classification, scene, &cancelled, &|_| {}));
    given_up(renderer.show(&volume, &classification, scene, &cancelled));
    let (image, _) = renderer.render(&volume, &classification, scene, &|_| {})?;
    Ok((image, renderer.show(&volume, &classification, scene, &Extras::default())?))
}

fn slices(gpu: &Gpu, scene: &Scene) -> Result<(Image, ShownFrame), GpuError> {
    let renderer = SliceRenderer::new(gpu)?;
    let volume = renderer.prepare(scene.volume())?;
    let classification = renderer.classify(&volume, scene)?;
    given_up(renderer.render_with(&volume, &classification, scene, Some(&CANCELLED), &|_| {}));
    given_up(renderer.show(&volume, &classification, scene, Some(&CANCELLED)));
    let cancel = AtomicBool::new(false);
    let (image, _) = renderer.render_with(&volume, &classification, scene, Some(&cancel), &|_| {})?;
    Ok((image, renderer.show(&volume, &classification, scene, Some(&cancel))?))
}

fn cells(gpu: &Gpu, scene: &Scene) -> Result<(Image, ShownFrame), GpuError> {
    let renderer = CellRenderer::new(gpu, CellOptions::default())?;
    let cells = renderer.prepare(scene.volume())?;
    let classification = renderer.classify(&cells, scene)?;
    given_up(renderer.render_with(&cells, &classification, scene, Some(&CANCELLED), &|_| {}));
    given_up(renderer.show(&cells, &classification, scene, Some(&CANCELLED)));
    let cancel = AtomicBool::new(false);
    let (image, _) = renderer.render_with(&cells, &classification, scene, Some(&cancel), &|_| {})?;
    Ok((image, renderer.show(&cells, &classification, scene, Some(&cancel))?))
}

/// Set before the frame begins.
static CANCELLED: AtomicBool = AtomicBool::new(true);

#[track_caller]
fn given_up<T>(rendered: Result<T, GpuError>) {
    assert_eq!(rendered.err(), Some(GpuError::Cancelled));
}

fn same(what: &str, image: &Image, shown: &[[u8; 4]]) -> Result<(), Failed> {
    let seen = image.pixels().iter().filter(|pixel| pixel[3] > 0.1).count();
    if shown.len() != image.pixels().len() || seen < shown.len() / 20 {
        return Err(format!("{what}: {} pixels, {seen} of {} seen", shown.len(), image.pixels().len()).into());
    }
    for (i, (expected, found)) in image.pixels().iter().zip(shown).enumerate() {
        let off = |c: usize| (expected[c].clamp(0.0, 1.0) - f32::from(found[c]) / 255.0).abs();
        let worst = (0..4).map(off).fold(0.0, f32::max);
        if worst > LARGEST_DIFFERENCE {
            return Err(format!("{what}: pixel {i} is {found:?}, of {expected:?}").into());
        }
    }
    Ok(())
}

/// A shown frame's pixels, row by row from the top.
fn read(gpu: &Gpu, shown: &ShownFrame) -> Result<Vec<[u8; 4]>, Failed> {
    let size = shown.texture.size();
    let row = (4 * size.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(shown.texture.as_image_copy(), to, size);
    gpu.queue().submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.device().poll(wgpu::PollType::wait_indefinitely())?;
    let mapped = buffer.get_mapped_range(..)?;
    let rows = mapped.chunks(row as usize).map(|row| &row[..4 * size.width as usize]);
    Ok(rows.flat_map(|row| row.as_chunks::<4>().0.to_vec()).collect())
}
