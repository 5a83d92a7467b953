//! The command line's grammar. Names are fixed: other tools drive the program through them.
#![allow(rustdoc::broken_intra_doc_links, reason = "doc comments are help texts here: [30] is a default")]

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use cutaway_core::defaults::View;
use cutaway_core::lighting::DiffuseCurve;
use cutaway_core::scene::{Engine, Gradient, ImageInterpolation, Layout, Mode, Sampling, SpaceSkipping};
use cutaway_core::volume::NanMeaning;
use cutaway_io::mesh::MeshSpace;

use crate::clip::ClipArgs;
use crate::values::{self, List, number, whole};

const AFTER_HELP: &str = "\
Examples:
  cutaway render sample:mr-head -o head.png
  cutaway render scan.nii.gz --preset CT-Bone --azimuth 30 -o bone.png
  cutaway render engine_256x256x128_uint8.raw --mode iso --iso 100 -o engine.png
  cutaway info scan.nrrd
  cutaway convert part.glb part.stl --repair
  cutaway compare a.png b.png

`cutaway help render` explains every option of `render`.";

/// Direct volume rendering that cuts volumes open.
#[derive(Debug, Parser)]
#[command(name = "cutaway", version, after_help = AFTER_HELP, subcommand_required = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a volume to an image
    Render(Box<RenderArgs>),
    /// Open the viewer: see a volume, cut it open, move the cut
    View(ViewArgs),
    /// Say what a volume or mesh file is: sizes, types, place, values; whether a surface is closed
    Info(InfoArgs),
    /// Convert a mesh to another format, and close it on the way
    Convert(ConvertArgs),
    /// Say how far two images are apart
    Compare(CompareArgs),
    /// List presets, colour maps and samples
    Presets(PresetsArgs),
    /// Print the JSON schema of a scene file
    Schema,
    /// Run a benchmark
    Bench(BenchArgs),
    /// Print completions for a shell
    Completions {
        /// bash, zsh, fish, elvish or powershell
        shell: clap_complete::Shell,
    },
}

/// What the viewer begins with.
#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// Volume file, scene file or `sample:NAME` [the head that comes along, with a cut in it]
    pub(crate) volume: Option<OsString>,
    /// The volume in a file of several (a time series), from 0
    #[arg(long, value_name = "I", value_parser = whole::<usize>)]
    #[cfg_attr(
        not(feature = "viewer"),
        allow(dead_code, reason = "without a window there is nothing to show it in")
    )]
    pub(crate) volume_index: Option<usize>,
    /// Scene file to begin with
    #[arg(long, value_name = "FILE", conflicts_with = "volume")]
    pub(crate) scene: Option<PathBuf>,
    /// The GPU that draws the window and serves the GPU engines, by a part of its name (`cutaway info --gpu` lists them)
    #[arg(long, value_name = "NAME")]
    #[cfg_attr(
        not(feature = "viewer"),
        allow(dead_code, reason = "without a window there is none to draw it")
    )]
    pub(crate) gpu: Option<String>,
}

const RENDER_HELP: &str = "\
Examples:
  cutaway render sample:mr-head -o head.png
      a first picture: transfer function from the histogram, shaded, framed
  cutaway render head.nii.gz --preset CT-Bone --azimuth 40 --elevation 10 -o bone.png
      a preset from another side
  cutaway render v.nrrd --colormap viridis --range 0,400 --opacity 0,0,100,0,400,0.5 -o v.png
      a colour map over a range; opacity as value,opacity pairs
  cutaway render v.raw --dims 256,256,128 --type uint8 --mode mip --window 200 --level 100 -o mip.png
      raw data whose name does not tell, as a maximum projection
  cutaway render head.nii.gz --engine reference --cut sphere:0,40,60,45 --clip-plane 1,0,0,5 -o open.png
      a ball cut away, and what lies to the right of a plane
  cutaway render --scene scene.json --resolution 1920,1080 -o still.exr
      a scene file; options beside it win";

#[derive(Debug, Args)]
#[command(after_help = RENDER_HELP)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,

    /// Image to write: .png, .exr or .npy (float32 [height, width, 4], premultiplied); `-` is PNG on standard output
    #[arg(short, long, value_name = "FILE", help_heading = "Picture")]
    pub(crate) output: PathBuf,
    /// Bits a channel of a PNG
    #[arg(long, value_enum, value_name = "BITS", default_value = "8", help_heading = "Picture")]
    pub(crate) bit_depth: Bits,
    /// Colour behind the volume, 0 to 1 each; transparent unless given
    #[arg(long, value_name = "R,G,B[,A]", allow_hyphen_values = true, help_heading = "Picture")]
    pub(crate) background: Option<List>,
    /// Also write the distance to the first visible point: .npy, .exr or .png
    #[arg(long, value_name = "FILE", help_heading = "Picture")]
    pub(crate) depth_output: Option<PathBuf>,
    /// Show how the raycast engine works: fetches (values taken a pixel, dark blue for none to yellow for the most) or
    /// wireframe (the proxy geometry that rays begin and end at, over the image)
    #[arg(long, value_enum, value_name = "WHAT", help_heading = "Picture")]
    pub(crate) debug: Option<DebugView>,

    /// Write timings and counts as JSON; `-` is standard error
    #[arg(long, value_name = "FILE", help_heading = "Report")]
    pub(crate) stats: Option<PathBuf>,
    /// Write the scene as a JSON file that `--scene` reads
    #[arg(long, value_name = "FILE", help_heading = "Report")]
    pub(crate) save_scene: Option<PathBuf>,
    /// No progress bar, no notices
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Report")]
    pub(crate) quiet: bool,
    /// Say what was chosen: view, transfer function, timings
    #[arg(short, long, help_heading = "Report")]
    pub(crate) verbose: bool,
}

/// What is shown instead of a plain image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum DebugView {
    Fetches,
    Wireframe,
}

/// Everything that makes a scene, for `render` and `bench frame`.
#[derive(Debug, Args)]
pub(crate) struct SceneArgs {
    /// Volume file (.nii, .nrrd, .mhd, .raw, ...), or `sample:NAME` (see `cutaway presets`)
    #[arg(value_name = "VOLUME", required_unless_present = "scene")]
    pub(crate) volume: Option<OsString>,
    /// Scene file; options given beside it win
    #[arg(long, value_name = "FILE", help_heading = "Scene")]
    pub(crate) scene: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) raw: RawArgs,

    /// Width and height in pixels [512,512]
    #[arg(long, value_name = "W,H", allow_hyphen_values = true, help_heading = "Picture")]
    pub(crate) resolution: Option<List>,

    /// Renderer: cpu; raycast, slices or cells (on a GPU); reference (slow and exact); or auto: cells for an unstructured
    /// grid, else raycast where there is a real GPU, else cpu
    /// [auto]
    #[arg(long, value_parser = values::engine, value_name = "ENGINE", help_heading = "Engine")]
    pub(crate) engine: Option<Engine>,
    /// Threads of the cpu engine; 0 is one a core
    #[arg(long, value_name = "N", default_value = "0", hide_default_value = true, value_parser = values::threads, allow_hyphen_values = true, help_heading = "Engine")]
    pub(crate) threads: usize,
    /// GPU of the raycast, slices and cells engines, by a part of its name (`cutaway info --gpu` lists them) [the fastest]
    #[arg(long, value_name = "NAME", help_heading = "Engine")]
    pub(crate) gpu: Option<String>,
    /// Instructions of the cpu engine
    #[arg(long, value_enum, value_name = "SET", default_value = "auto", help_heading = "Engine")]
    pub(crate) simd: Simd,

    /// What a ray makes of the values along it: composite, iso, mip, minip or mean [composite; iso with --iso]
    #[arg(long, value_parser = values::mode, value_name = "MODE", help_heading = "Mode")]
    pub(crate) mode: Option<Mode>,
    /// Value of an isosurface; give it again for another one
    #[arg(long, value_name = "VALUE", value_parser = number, allow_hyphen_values = true, help_heading = "Mode")]
    pub(crate) iso: Vec<f64>,

    #[command(flatten)]
    pub(crate) function: FunctionArgs,
    #[command(flatten)]
    pub(crate) light: LightArgs,
    #[command(flatten)]
    pub(crate) camera: CameraArgs,

    /// Distance between samples, in voxels along the ray [0.5]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true, help_heading = "Sampling")]
    pub(crate) step: Option<f64>,
    /// Accumulated opacity at which a ray ends [0.999]
    #[arg(long, value_name = "A", value_parser = number, allow_hyphen_values = true, help_heading = "Sampling")]
    pub(crate) early_termination: Option<f64>,
    /// How to skip what is invisible: off, cells, fitted, boundary, contour, fitted-contour or auto; the image is the same [auto]
    #[arg(long, value_parser = values::space_skipping, value_name = "HOW", help_heading = "Sampling")]
    pub(crate) space_skipping: Option<SpaceSkipping>,
    /// Cells along an edge of the bricks that the slices engine draws or skips: 8, 16, 32, ...; 0 for a single one [16]
    #[arg(long, value_parser = whole::<u32>, value_name = "N", allow_hyphen_values = true, help_heading = "Sampling")]
    pub(crate) brick_size: Option<u32>,
    /// Where samples lie: view (a step apart along the ray) or object (on planes of voxels) [view]
    #[arg(long, value_parser = values::sampling, value_name = "HOW", help_heading = "Sampling")]
    pub(crate) sampling: Option<Sampling>,
    /// Cut steps finer where opacity or colour differ by more than T (0 to 1) from one to the next [never]
    #[arg(long, value_name = "T", value_parser = number, allow_hyphen_values = true, help_heading = "Sampling")]
    pub(crate) adaptive_threshold: Option<f64>,
    /// Let a step stand for the integral between its ends, not for the value in its middle
    #[arg(long, help_heading = "Sampling")]
    pub(crate) pre_integration: bool,
    /// Gradient for lighting: central, sobel (smoother) or precomputed (4 bytes a voxel) [central]
    #[arg(long, value_parser = values::gradient, value_name = "KIND", help_heading = "Sampling")]
    pub(crate) gradient: Option<Gradient>,
    /// Voxels in memory: linear (as they came) or bricks (1.2 to 1.4 times the volume again) [linear]
    #[arg(long, value_parser = values::layout, value_name = "HOW", help_heading = "Sampling")]
    pub(crate) layout: Option<Layout>,

    #[command(flatten)]
    pub(crate) clip: ClipArgs,
    /// Pixels that the cpu engine fills in between cast ones: off, adaptive (where nothing is lost) or all but every N-th
    /// along x and y, 2 to 16 [off]
    #[arg(long, value_parser = values::image_interpolation, value_name = "HOW", allow_hyphen_values = true, help_heading = "Sampling")]
    pub(crate) image_interpolation: Option<ImageInterpolation>,
    /// Let steps begin at shares of a step that differ from pixel to pixel: noise instead of rings (GPU engines)
    #[arg(long, help_heading = "Sampling")]
    pub(crate) jitter: bool,
    /// Blur the finished image by a Gaussian of sigma S pixels, up to 64 [0: not at all]
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true, help_heading = "Sampling")]
    pub(crate) blur: Option<f64>,
}

/// What raw data are, where neither their name nor a JSON file beside them tells.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Volume file")]
pub(crate) struct RawArgs {
    /// Voxels along x, y, z of raw data
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) dims: Option<List>,
    /// Voxel type of raw data: uint8, int16, float32, ...
    #[arg(long = "type", value_name = "TYPE")]
    pub(crate) voxel_type: Option<String>,
    /// Distance of voxels of raw data along x, y, z
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) spacing: Option<List>,
    /// Raw data have their most significant byte first
    #[arg(long)]
    pub(crate) big_endian: bool,
    /// Bytes before the first voxel of raw data
    #[arg(long, value_name = "N", value_parser = whole::<u64>, allow_hyphen_values = true)]
    pub(crate) header_bytes: Option<u64>,
    /// Which volume of a file that holds several, from 0
    #[arg(long, value_name = "I", value_parser = whole::<usize>, allow_hyphen_values = true)]
    pub(crate) volume_index: Option<usize>,
    /// How voxels without a value (NaN) are shown: transparent, lowest or highest [transparent: cells that touch them show
    /// nothing]
    #[arg(long, value_name = "MEANING", value_parser = values::nan)]
    pub(crate) nan: Option<NanMeaning>,
}

/// What values look like.
#[derive(Debug, Args)]
#[command(next_help_heading = "Transfer function")]
pub(crate) struct FunctionArgs {
    /// A named look: CT-Bone, MR-Default, ... (see `cutaway presets`)
    #[arg(long, value_name = "NAME", conflicts_with_all = ["transfer_function", "colormap", "window"])]
    pub(crate) preset: Option<String>,
    /// File of points: JSON ({"points": [{"value", "color", "opacity"}, ...]}), a ParaView colour map (JSON), or a Slicer volume
    /// property (.vp, .vp.json), whose light is taken, too
    #[arg(long, value_name = "FILE", conflicts_with_all = ["colormap", "window"])]
    pub(crate) transfer_function: Option<PathBuf>,
    /// A named colour map (see `cutaway presets`)
    #[arg(long, value_name = "NAME", conflicts_with = "window")]
    pub(crate) colormap: Option<String>,
    /// Values at the ends of the colour map [the volume's range]
    #[arg(long, value_name = "LO,HI", allow_hyphen_values = true, requires = "colormap")]
    pub(crate) range: Option<List>,
    /// Opacity over value, as pairs [0 at LO to 0.5 at HI]
    #[arg(long, value_name = "V,A,V,A,...", allow_hyphen_values = true, requires = "colormap")]
    pub(crate) opacity: Option<List>,
    /// Width of a grey ramp of values; with --level
    #[arg(long, value_name = "W", value_parser = number, allow_hyphen_values = true, requires = "level")]
    pub(crate) window: Option<f64>,
    /// Middle of the grey ramp
    #[arg(long, value_name = "L", value_parser = number, allow_hyphen_values = true, requires = "window")]
    pub(crate) level: Option<f64>,
    /// World length that opacities are for [mean voxel spacing; 1 for CT presets]
    #[arg(long, value_name = "D", value_parser = number, allow_hyphen_values = true)]
    pub(crate) opacity_unit_distance: Option<f64>,
    /// Factor of every opacity
    #[arg(long, value_name = "F", value_parser = number, allow_hyphen_values = true)]
    pub(crate) brightness: Option<f64>,
}

/// Light and material.
#[derive(Debug, Args)]
#[command(next_help_heading = "Light")]
pub(crate) struct LightArgs {
    /// Light samples by their gradient [yes; no in some presets]
    #[arg(long, overrides_with = "no_shade")]
    pub(crate) shade: bool,
    /// Colours as they are
    #[arg(long, overrides_with = "shade")]
    pub(crate) no_shade: bool,
    /// Share of the colour that needs no light [0.1]
    #[arg(long, value_name = "F", value_parser = number, allow_hyphen_values = true)]
    pub(crate) ambient: Option<f64>,
    /// Factor of the diffuse term [0.9]
    #[arg(long, value_name = "F", value_parser = number, allow_hyphen_values = true)]
    pub(crate) diffuse: Option<f64>,
    /// Factor of the specular term [0.2]
    #[arg(long, value_name = "F", value_parser = number, allow_hyphen_values = true)]
    pub(crate) specular: Option<f64>,
    /// Exponent of the specular term [10]
    #[arg(long, value_name = "P", value_parser = number, allow_hyphen_values = true)]
    pub(crate) specular_power: Option<f64>,
    /// Falloff of light with its angle: clamped, two-sided or wrapped [two-sided]
    #[arg(long, value_parser = values::diffuse_curve, value_name = "CURVE")]
    pub(crate) diffuse_curve: Option<DiffuseCurve>,
    /// World direction towards the light [along each ray]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) light: Option<List>,
}

/// Where from.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub(crate) struct CameraArgs {
    /// Look at what is visible from a side of the body: front, back, left, right, above or below
    #[arg(long, value_name = "SIDE", value_parser = values::view)]
    pub(crate) view: Option<View>,
    /// The eye, in world units
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) camera_position: Option<List>,
    /// The point in the middle of the image
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) camera_focal_point: Option<List>,
    /// The direction that is up in the image
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) camera_view_up: Option<List>,
    /// Vertical angle of view [30]
    #[arg(long, value_name = "DEG", value_parser = number, allow_hyphen_values = true)]
    pub(crate) camera_view_angle: Option<f64>,
    /// Parallel rays; half the height of the image in world units
    #[arg(long, value_name = "SCALE", value_parser = number, allow_hyphen_values = true)]
    pub(crate) camera_orthographic: Option<f64>,
    /// Turn the view around its up direction, from --view or the default view
    #[arg(long, value_name = "DEG", value_parser = number, allow_hyphen_values = true)]
    pub(crate) azimuth: Option<f64>,
    /// Raise the view
    #[arg(long, value_name = "DEG", value_parser = number, allow_hyphen_values = true)]
    pub(crate) elevation: Option<f64>,
    /// Turn the image
    #[arg(long, value_name = "DEG", value_parser = number, allow_hyphen_values = true)]
    pub(crate) roll: Option<f64>,
    /// Narrow the view
    #[arg(long, value_name = "F", value_parser = number, allow_hyphen_values = true)]
    pub(crate) zoom: Option<f64>,
}

const INFO_HELP: &str = "\
Examples:
  cutaway info scan.nii.gz
      size, type, spacing, place and values of a volume
  cutaway info engine.raw --dims 256,256,128 --type uint8 --json
      raw data, as JSON
  cutaway info bunny.ply
      counts of a mesh, whether its surface is closed, and what closing it would take
  cutaway info bones.vp
      points of a transfer function: cutaway's, ParaView's or Slicer's";

#[derive(Debug, Args)]
#[command(after_help = INFO_HELP)]
pub(crate) struct InfoArgs {
    /// Volume file, `sample:NAME`, mesh file (.ply, .stl, .obj, .gltf, .glb), or transfer function (.json, .vp)
    #[arg(required_unless_present = "gpu")]
    pub(crate) file: Option<OsString>,
    /// Axes of a mesh: lps (converted to RAS), ras, or file (what the file says, otherwise unchanged) [file]
    #[arg(long, value_name = "SPACE", value_parser = values::mesh_space)]
    pub(crate) mesh_space: Option<MeshSpace>,
    /// List the GPUs of this machine instead, the one that is taken first
    #[arg(long, conflicts_with = "file")]
    pub(crate) gpu: bool,
    #[command(flatten)]
    pub(crate) raw: RawArgs,
    /// As JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

const CONVERT_HELP: &str = "\
Examples:
  cutaway convert part.glb part.ply
      another format; the extension of OUT says which
  cutaway convert scan.stl.gz closed.obj --repair
      closed: holes capped, windings outward, duplicates and degenerate triangles dropped
  cutaway convert rough.stl closed.stl --repair --weld-tolerance 1e-4
      vertices on the boundary up to 1/10000 of the size apart are welded before
  cutaway convert bones.vp bones.json
      a transfer function: .json (cutaway), .pv.json (ParaView), .vp or .vp.json (Slicer)";

#[derive(Debug, Args)]
#[command(after_help = CONVERT_HELP)]
pub(crate) struct ConvertArgs {
    /// Mesh file: .ply, .stl, .obj, .gltf or .glb, gzip-compressed or not; spline patches: .txt or .json; or a
    /// transfer function: .json of cutaway, ParaView or Slicer, or .vp
    #[arg(value_name = "IN")]
    pub(crate) input: PathBuf,
    /// Mesh file to write: .ply, .stl or .obj; or transfer function: .json, .pv.json, .vp or .vp.json
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Write a closed surface, or nothing where the mesh cannot be closed
    #[arg(long)]
    pub(crate) repair: bool,
    /// How far apart vertices on the boundary are welded, as a share of the mesh's size; 0 for the same place only [1e-6]
    #[arg(long, value_name = "F", value_parser = number, allow_hyphen_values = true, requires = "repair")]
    pub(crate) weld_tolerance: Option<f64>,
    /// Axes of the mesh: lps (converted to RAS), ras, or file (what the file says, otherwise unchanged) [file]
    #[arg(long, value_name = "SPACE", value_parser = values::mesh_space)]
    pub(crate) mesh_space: Option<MeshSpace>,
    /// How far the triangles of spline patches may be off the surface, in its own units [a thousandth of its size]
    #[arg(long, value_name = "D", value_parser = number, allow_hyphen_values = true)]
    pub(crate) tolerance: Option<f64>,
    /// No notices
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Image: .png, .exr or .npy
    pub(crate) a: PathBuf,
    /// Another image of the same size
    pub(crate) b: PathBuf,
    /// As JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Exit with 1 if the root mean square error is above this
    #[arg(long, value_name = "RMSE", value_parser = number, allow_hyphen_values = true)]
    pub(crate) fail_above: Option<f64>,
    /// Write an image of the differences
    #[arg(long, value_name = "FILE")]
    pub(crate) difference: Option<PathBuf>,
    /// Factor of the differences in that image
    #[arg(long, value_name = "F", allow_hyphen_values = true, value_parser = values::gain, default_value_t = 10.0, requires = "difference")]
    pub(crate) gain: f32,
}

#[derive(Debug, Args)]
pub(crate) struct PresetsArgs {
    /// As JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    pub(crate) bench: Bench,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Bench {
    /// Render frames of an orbiting camera, after three warm-up frames; prints statistics as JSON
    Frame(Box<BenchFrameArgs>),
    /// Measure how many samples a second this processor can take at most, and how near to that frames come
    Roofline(BenchRooflineArgs),
    /// Measure what papers on volume rendering tell of their renderers, and print it beside their figures
    Papers(BenchPapersArgs),
}

#[derive(Debug, Args)]
pub(crate) struct BenchRooflineArgs {
    /// As JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Small and short: whether it runs, not how fast
    #[arg(long, hide = true)]
    pub(crate) quick: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BenchPapersArgs {
    /// Sections to measure; all unless given
    #[arg(value_enum, value_name = "SECTION")]
    pub(crate) sections: Vec<PaperSection>,
    /// Frames to measure, of an orbit around the volume
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: u32,
    /// As JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Small and short: whether it runs, not how fast
    #[arg(long, hide = true)]
    pub(crate) quick: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BenchFrameArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Frames to measure
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) frames: u32,
    /// Degrees of the orbit, around the view-up direction
    #[arg(long, value_name = "DEG", value_parser = number, default_value_t = 360.0, allow_hyphen_values = true)]
    pub(crate) orbit: f64,
    /// Write the first frame to an image
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Write the statistics to a file instead of standard output
    #[arg(long, value_name = "FILE")]
    pub(crate) stats: Option<PathBuf>,
    /// As JSON (always; for symmetry with other commands)
    #[arg(long)]
    pub(crate) json: bool,
}

/// Tables and figures of papers that can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PaperSection {
    /// Termeer 2005, section 4.1.5: frames a second of a software ray caster
    TermeerSoftware,
    /// Termeer 2005, figure 4.18: frames a second over image size, CPU against GPU
    TermeerImageSize,
    /// Haferburg: texture fetches from the volume's box against those from its proxy geometry
    HaferburgFetches,
    /// Rezk-Salama and Kolb 2005, figures 4 and 5: frames a second of slices over the size of bricks
    #[value(name = "rezk-salama-bricks")]
    Bricks,
    /// Termeer 2005, table 3.1: relative speed of ray-triangle tests
    #[value(name = "termeer-ray-triangle")]
    RayTriangle,
    /// Maximo 2007, tables 1 and 2: tetrahedra a second of regular grids
    MaximoRegular,
    /// The same of meshes of tetrahedra
    MaximoUnstructured,
}

/// Bits a channel.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Bits {
    #[value(name = "8")]
    Eight,
    #[value(name = "16")]
    Sixteen,
}

/// Instructions of the cpu engine.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Simd {
    Auto,
    Scalar,
    Avx2,
    Avx512,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_is_sound() {
        Cli::command().debug_assert();
    }
}
