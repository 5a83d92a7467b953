//! `cutaway render`: one image.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use cutaway_core::clip::{ClipEvents, box_corners, extremes};
use cutaway_core::defaults::display_range;
use cutaway_core::image::Image;
use cutaway_core::scene::Mode;
use cutaway_io::atomic::write_atomically;
use cutaway_io::image::{BitDepth, ImageFormat, encode_image, write_depth, write_image};

use super::empty;
use super::session::Session;
use crate::args::{Bits, RenderArgs};
use crate::outputs::Outputs;
use crate::report::{self, Verbosity, wrong_use};
use crate::scene::Prepared;
use crate::values::{List, shown, shown_vector};

pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let verbosity = Verbosity::new(args.quiet, args.verbose);
    // What cannot be written is refused before anything is loaded or rendered.
    check_outputs(args)?;
    let background = args.background.as_ref().map(background).transpose()?;
    let prepared = Prepared::new(&args.scene)?;
    prepared.report(verbosity);
    describe(&prepared, verbosity);
    if !args.scene.iso.is_empty() && prepared.settings.mode != Mode::Iso {
        verbosity.notice(&format!("--iso has no effect in {} mode", prepared.settings.mode.name()));
    }
    let mut session = Session::new(&prepared, &args.scene, verbosity)?;
    let (abilities, mode) = (session.abilities()?, prepared.settings.mode);
    if args.depth_output.is_some() && !abilities.has_depth(mode) {
        let (engine, mode) = (abilities.name, mode.name());
        return Err(wrong_use(format!(
            "--depth-output: images of the {engine} engine have no depth in {mode} mode; use --engine cpu or raycast"
        )));
    }
    notice_clip_options(args, &prepared, verbosity);
    let scene_file = args.save_scene.as_deref().map(|path| scene_text(&prepared, path)).transpose()?;
    let progress = verbosity.progress("rendering");
    if let Some(view) = args.debug {
        session.set_debug(view)?;
    }
    let frame = session.frame(&|share| progress.set(share))?;
    drop(progress);
    let (statistics, frame_ms) = (frame.statistics, frame.frame_ms);
    let image = frame.picture.into_image().context("the image stayed on the GPU")?;
    let visible_fraction = empty::visible_fraction(&image);
    if visible_fraction == 0.0 && args.debug.is_none() {
        empty::explain(&prepared, &args.scene, verbosity)?;
    }
    let image = match background {
        Some(color) => image.over_background(color),
        None => image,
    };
    let mut statistics = session.statistics(statistics, vec![frame_ms]);
    statistics.visible_fraction = Some(visible_fraction);
    verbosity.detail(|| statistics.summary());
    if let (Some(path), Some(text)) = (&args.save_scene, scene_file) {
        write_atomically(path, |w| w.write_all(text.as_bytes())).context("could not write the scene")?;
    }
    write(args, &image)?;
    match &args.stats {
        Some(path) => statistics.write(path),
        None => Ok(()),
    }
}

/// Says which options of clipping do nothing.
fn notice_clip_options(args: &RenderArgs, prepared: &Prepared, verbosity: Verbosity) {
    let o = &args.scene.clip.options;
    let given = [
        ("--segments", o.segments.is_some()),
        ("--backmost", o.backmost),
        ("--clip-events", o.clip_events.is_some()),
        ("--buffer-depth", o.buffer_depth.is_some()),
        ("--impregnation", o.impregnation.is_some()),
        ("--impregnation-thickness", o.impregnation_thickness.is_some()),
        ("--clip-intensity", o.clip_intensity.is_some()),
        ("--cap", o.cap),
    ];
    let (mode, unclipped) = (prepared.settings.mode, prepared.clip.is_none());
    for (option, _) in given.into_iter().filter(|(_, given)| *given) {
        let impregnates = option.starts_with("--impregnation");
        if unclipped {
            verbosity.notice(&format!("{option} has no effect: nothing is clipped"));
        } else if (option == "--cap" && mode != Mode::Iso) || (impregnates && mode != Mode::Composite) {
            verbosity.notice(&format!("{option} has no effect in {} mode", mode.name()));
        }
    }
    let peels = prepared.settings.clip_events == ClipEvents::Peel;
    if !unclipped && o.buffer_depth.is_some() && !peels {
        verbosity.notice("--buffer-depth has no effect: it applies only to --clip-events peel on a GPU");
    }
}

fn check_outputs(args: &RenderArgs) -> anyhow::Result<()> {
    let mut outputs = Outputs::default();
    if args.output != Path::new("-") {
        outputs.image("--output", &args.output)?;
    }
    if let Some(path) = &args.depth_output {
        outputs.image("--depth-output", path)?;
    }
    if let Some(path) = &args.save_scene {
        outputs.file("--save-scene", path)?;
    }
    if let Some(path) = args.stats.as_ref().filter(|path| *path != Path::new("-")) {
        outputs.file("--stats", path)?;
    }
    let scene = args.scene.scene.as_ref().filter(|scene| Some(*scene) != args.save_scene.as_ref());
    let volume = args.scene.volume.as_ref().map(Path::new);
    let inputs = [volume, scene.map(|p| p.as_path()), args.scene.function.transfer_function.as_deref()];
    inputs.into_iter().flatten().for_each(|path| outputs.input(path));
    args.scene.clip.files().for_each(|path| outputs.input(path));
    outputs.check()
}

fn scene_text(prepared: &Prepared, path: &Path) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(&prepared.to_file(path)?)? + "\n")
}

fn write(args: &RenderArgs, image: &Image) -> anyhow::Result<()> {
    let depth = match args.bit_depth {
        Bits::Eight => BitDepth::Eight,
        Bits::Sixteen => BitDepth::Sixteen,
    };
    // The one output that cannot be taken back comes last.
    if let Some(path) = &args.depth_output {
        write_depth(path, image)?;
    }
    if args.output != Path::new("-") {
        return Ok(write_image(&args.output, image, depth)?);
    }
    let mut bytes = Vec::new();
    encode_image(image, ImageFormat::Png, depth, &mut bytes)?;
    report::print_bytes(&bytes)
}

/// A straight colour of three or four numbers in 0..=1.
fn background(list: &List) -> anyhow::Result<[f32; 4]> {
    let color = match list.0[..] {
        [r, g, b] => [r, g, b, 1.0],
        [r, g, b, a] => [r, g, b, a],
        _ => {
            return Err(wrong_use(format!(
                "--background takes R,G,B or R,G,B,A; found {} numbers",
                list.0.len()
            )));
        }
    };
    match color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        Some(c) => Err(wrong_use(format!("--background: {} is not within 0 to 1", shown(*c)))),
        None => Ok(color.map(|c| c as f32)),
    }
}

fn describe(prepared: &Prepared, verbosity: Verbosity) {
    verbosity.detail(|| {
        let volume = prepared.loaded.lattice();
        let [lo, hi] = volume.value_range().map(shown);
        let (d, kind) = (volume.dimensions(), volume.source_type().name());
        let [from, to] = display_range(volume).map(shown);
        format!(
            "volume: {}, {} x {} x {} {kind}, values {lo} to {hi}; defaults are for {from} to {to} (up to 0.02 % of the \
             voxels at each end left out)",
            prepared.loaded.name, d.x, d.y, d.z
        )
    });
    if let Some(corners) = prepared.visible {
        verbosity.detail(|| {
            let to_world = prepared.loaded.lattice().world_from_voxel();
            let corners = box_corners(corners).map(|corner| to_world.transform_point3(corner));
            let [least, most] = extremes(&corners).map(|corner| shown_vector(corner.to_array()));
            format!("visible: between ({least}) and ({most}), which the view frames")
        });
    }
    verbosity.detail(|| {
        let c = &prepared.camera;
        let [at, to, up] = [c.position, c.focal_point, c.view_up].map(shown_vector);
        let lens = match c.orthographic {
            Some(half) => format!("orthographic, half height {}", shown(half)),
            None => format!("view angle {}", shown(c.view_angle)),
        };
        format!("camera: at {at}, looking at {to}, up {up}, {lens}")
    });
    verbosity.detail(|| {
        let points = prepared.function.points().iter();
        let points = points.map(|p| format!("{} at {}", shown(p.opacity), shown(p.value)));
        format!("opacity: {}", points.collect::<Vec<_>>().join(", "))
    });
    verbosity.detail(|| {
        let s = &prepared.settings;
        let iso: Vec<String> = s.iso.iter().map(|v| shown(*v)).collect();
        let iso = if s.mode == Mode::Iso { format!(" at {}", iso.join(", ")) } else { String::new() };
        let light = if prepared.lighting.shade { "shaded" } else { "unshaded" };
        format!("mode: {}{iso}, {light}, step {}", s.mode.name(), shown(s.step))
    });
}
