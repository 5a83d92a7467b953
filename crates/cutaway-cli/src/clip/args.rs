//! The grammar of clipping. Cuts, probes, crops, planes and poses keep the order in which they are given, across options.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use clap::{ArgMatches, Args, Command, FromArgMatches};
use cutaway_core::clip::{BufferDepth, ClipEvents, Impregnation, SegmentCount};
use cutaway_io::mesh::MeshSpace;

use super::shape;
use crate::values::{self, List, number};

/// What is cut and how that looks, option by option.
#[derive(Debug, Args)]
#[command(next_help_heading = "Clip")]
pub(crate) struct ClipOptions {
    /// Cut an object away: a file, or a shape in world units: sphere:X,Y,Z,R, box:X0,X1,Y0,Y1,Z0,Z1 or plane:NX,NY,NZ,D
    /// (the half-space below it). May be given again, like --probe, --crop and --clip-plane; all apply, in order
    #[arg(long, value_name = "FILE|SHAPE")]
    cut: Vec<OsString>,
    /// Keep only what is inside an object: a file or a shape, as for --cut
    #[arg(long, value_name = "FILE|SHAPE")]
    probe: Vec<OsString>,
    /// Keep only a box, from voxel to voxel
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", allow_hyphen_values = true)]
    crop: Vec<List>,
    /// Keep only the half-space N·x <= D, in world units
    #[arg(long, value_name = "NX,NY,NZ,D", allow_hyphen_values = true)]
    clip_plane: Vec<List>,
    /// Move the object before this: "translate X,Y,Z; rotate AX,AY,AZ,DEG; scale S", the last done first; `fit` centres
    /// it in the volume and scales it to its size
    #[arg(long, value_name = "STEPS")]
    clip_pose: Vec<String>,
    /// Axes of the meshes of --cut and --probe: lps (converted to RAS), ras, or file (what each file says, otherwise
    /// unchanged) [file]
    #[arg(long, value_name = "SPACE", value_parser = values::mesh_space)]
    pub(crate) mesh_space: Option<MeshSpace>,
    /// Segments of a ray that are used: auto (all) or a number [auto]
    #[arg(long, value_name = "N", value_parser = values::segment_count, allow_hyphen_values = true)]
    pub(crate) segments: Option<SegmentCount>,
    /// The last of a limited number of segments goes on to the backmost surface
    #[arg(long)]
    pub(crate) backmost: bool,
    /// How a mesh is asked where rays cross it: raster, bvh, octree or grid by the CPU, lists or peel by a GPU; all find
    /// the same [auto: raster, lists]
    #[arg(long, value_name = "HOW", value_parser = values::clip_events)]
    pub(crate) clip_events: Option<ClipEvents>,
    /// Bits of a number in peeled layers: 16 (half the memory, less exact) or 32 [32]
    #[arg(long, value_name = "BITS", value_parser = values::buffer_depth, allow_hyphen_values = true)]
    pub(crate) buffer_depth: Option<BufferDepth>,
    /// How the light on a cut reaches below it: none, step or linear [linear]
    #[arg(long, value_name = "HOW", value_parser = values::impregnation)]
    pub(crate) impregnation: Option<Impregnation>,
    /// How deep that goes, in voxels (the smallest spacing) [3]
    #[arg(long, value_name = "N", value_parser = number, allow_hyphen_values = true)]
    pub(crate) impregnation_thickness: Option<f64>,
    /// Draw the clip surface itself, with this opacity [0]
    #[arg(long, value_name = "OPACITY", value_parser = number, allow_hyphen_values = true)]
    pub(crate) clip_intensity: Option<f64>,
    /// Close isosurfaces where they are cut open
    #[arg(long)]
    pub(crate) cap: bool,
}

/// One of the options whose order matters, with its value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Step {
    Cut(OsString),
    Probe(OsString),
    Crop(List),
    Plane(List),
    Pose(String),
}

/// [`ClipOptions`] with the order of what is in them.
#[derive(Debug)]
pub(crate) struct ClipArgs {
    pub(crate) steps: Vec<Step>,
    pub(crate) options: ClipOptions,
}

impl ClipArgs {
    /// The files that are read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        self.steps.iter().filter_map(|step| match step {
            Step::Cut(operand) | Step::Probe(operand) if !shape::is_shape(operand) => {
                Some(Path::new(OsStr::new(operand)))
            }
            _ => None,
        })
    }
}

/// Where each value of an option stands on the command line.
fn places(matches: &ArgMatches, id: &str) -> Vec<usize> {
    matches.indices_of(id).into_iter().flatten().collect()
}

impl FromArgMatches for ClipArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Self::from_arg_matches_mut(&mut matches.clone())
    }

    fn from_arg_matches_mut(matches: &mut ArgMatches) -> Result<Self, clap::Error> {
        // Before the values are taken out.
        let at = ["cut", "probe", "crop", "clip_plane", "clip_pose"].map(|id| places(matches, id));
        let options = ClipOptions::from_arg_matches_mut(matches)?;
        let [cut, probe, crop, plane, pose] = at;
        let mut steps: Vec<(usize, Step)> = Vec::new();
        steps.extend(cut.into_iter().zip(options.cut.iter().cloned().map(Step::Cut)));
        steps.extend(probe.into_iter().zip(options.probe.iter().cloned().map(Step::Probe)));
        steps.extend(crop.into_iter().zip(options.crop.iter().cloned().map(Step::Crop)));
        steps.extend(plane.into_iter().zip(options.clip_plane.iter().cloned().map(Step::Plane)));
        steps.extend(pose.into_iter().zip(options.clip_pose.iter().cloned().map(Step::Pose)));
        steps.sort_by_key(|(place, _)| *place);
        Ok(Self { steps: steps.into_iter().map(|(_, step)| step).collect(), options })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for ClipArgs {
    fn augment_args(command: Command) -> Command {
        ClipOptions::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        ClipOptions::augment_args_for_update(command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command};
    use clap::Parser;

    #[test]
    fn order_is_kept_across_options() {
        let line = "cutaway render v.nrrd -o a.png --probe b --cut a --clip-plane 0,0,1,5 --cut=c --clip-pose fit \
                    --crop 0,1,0,1,0,1 --probe d --cap";
        let Command::Render(args) = Cli::try_parse_from(line.split_whitespace()).unwrap().command else {
            panic!("not render")
        };
        let list = |numbers: &[f64]| List(numbers.to_vec());
        let expected = [
            Step::Probe("b".into()),
            Step::Cut("a".into()),
            Step::Plane(list(&[0.0, 0.0, 1.0, 5.0])),
            Step::Cut("c".into()),
            Step::Pose("fit".into()),
            Step::Crop(list(&[0.0, 1.0, 0.0, 1.0, 0.0, 1.0])),
            Step::Probe("d".into()),
        ];
        assert_eq!(args.scene.clip.steps, expected);
        assert!(args.scene.clip.options.cap);
        assert_eq!(args.scene.clip.files().count(), 4);
    }
}
