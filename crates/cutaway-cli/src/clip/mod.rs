//! Clipping, from options and a scene file to a tree of solids.

mod args;
pub(crate) mod events;
mod shape;
mod solids;

use std::ffi::OsStr;
use std::path::Path;

use anyhow::{Context, anyhow};
use cutaway_core::clip::{self, Clip, ClipShading, FitError, Node, Pose};
use cutaway_core::glam::DAffine3;
use cutaway_core::scene::RenderSettings;
use cutaway_core::volume::Volume;
use cutaway_io::scene_file::{self, ClipFile, ClipSource, ClipTree, SceneFile, paths};

pub(crate) use args::{ClipArgs, Step};
use cutaway_io::mesh::MeshSpace;
use cutaway_io::solids::source_of_file;
use solids::Solids;

use crate::report::wrong_use;
use crate::values::List;

/// What is kept of a volume.
pub(crate) struct PreparedClip {
    /// As a scene file has it, but with paths that are good here.
    file: ClipTree,
    /// With its solids.
    pub(crate) clip: Clip,
    /// What was done to make closed surfaces of files.
    pub(crate) notices: Vec<String>,
}

impl PreparedClip {
    /// From the scene file (`scene` is its path) and options, which go on where the file ends; none where nothing is
    /// clipped.
    pub(crate) fn new(
        args: &ClipArgs,
        scene: Option<(&SceneFile, &Path)>,
        volume: &Volume,
        settings: &RenderSettings,
    ) -> anyhow::Result<Option<Self>> {
        let mut solids = Solids::new(events::finder(settings.clip_events));
        let in_file = match scene.and_then(|(file, path)| Some((file.clip.as_ref()?, path))) {
            Some((clip, path)) => Some(from_here(&clip.0, path)?),
            None => None,
        };
        if let (Some(clip), Some((_, path))) = (&in_file, scene) {
            // What is wrong with these is to be said of the scene file.
            resolve(clip, &mut solids).with_context(|| path.display().to_string())?;
        }
        let objects = objects(args, volume, &mut solids)?;
        if in_file.is_none() && objects.is_empty() {
            return Ok(None);
        }
        let mut file = in_file.unwrap_or_else(ClipTree::everything);
        for (operation, object) in objects {
            file = match operation {
                Operation::Cut => file.cut(object),
                Operation::Probe => file.probe(object),
            };
        }
        let clip = resolve(&file, &mut solids)?;
        Ok(Some(Self { file, clip, notices: solids.notices }))
    }

    /// As the scene file at `scene` is to have it.
    pub(crate) fn to_file(&self, scene: &Path) -> anyhow::Result<ClipFile> {
        let mut tree = self.file.clone();
        paths::map_paths(&mut tree, &mut |path| paths::in_scene(Path::new(path), scene))?;
        Ok(ClipFile(tree))
    }
}

/// What clip surfaces look like: options over the scene file over defaults.
pub(crate) fn shading(args: &ClipArgs, file: Option<&SceneFile>) -> ClipShading {
    let mut s = file.map(|f| f.clip_shading.clone()).unwrap_or_default();
    s.impregnation = args.options.impregnation.unwrap_or(s.impregnation);
    s.thickness = args.options.impregnation_thickness.unwrap_or(s.thickness);
    s.overlay = args.options.clip_intensity.unwrap_or(s.overlay);
    s.cap |= args.options.cap;
    s
}

fn resolve(clip: &ClipTree, solids: &mut Solids) -> anyhow::Result<Clip> {
    scene_file::resolve(clip, &mut |external| solids.load(external))
}

/// A scene file's tree with paths that are good here, where they were relative to its folder.
fn from_here(clip: &ClipTree, scene: &Path) -> anyhow::Result<ClipTree> {
    let mut clip = clip.clone();
    paths::map_paths(&mut clip, &mut |path| paths::from_scene(path, scene))?;
    Ok(clip)
}

#[derive(Clone, Copy)]
enum Operation {
    Cut,
    Probe,
}

/// The objects of the command line in their order, posed, with what is done with them.
fn objects(
    args: &ClipArgs,
    volume: &Volume,
    solids: &mut Solids,
) -> anyhow::Result<Vec<(Operation, ClipTree)>> {
    let mut objects: Vec<(Operation, ClipTree)> = Vec::new();
    let space = args.options.mesh_space.unwrap_or_default();
    for step in &args.steps {
        let object = match step {
            Step::Cut(name) => (Operation::Cut, operand("--cut", name, space)?),
            Step::Probe(name) => (Operation::Probe, operand("--probe", name, space)?),
            Step::Crop(list) => (Operation::Probe, crop(list, volume)?),
            Step::Plane(list) => (Operation::Probe, numbers("--clip-plane", "plane", list)?),
            Step::Pose(text) => {
                let Some((_, last)) = objects.last_mut() else {
                    return Err(wrong_use(
                        "--clip-pose moves the object that is given before it; put it behind a --cut, --probe, --crop or \
                         --clip-plane",
                    ));
                };
                last.pose = moved(last, text, volume, solids)?;
                continue;
            }
        };
        objects.push(object);
    }
    Ok(objects)
}

fn operand(option: &str, name: &OsStr, space: MeshSpace) -> anyhow::Result<ClipTree> {
    if let Some(shape) = shape::parse(name) {
        return shape.map_err(|e| wrong_use(format!("{option}: {e}")));
    }
    match name.to_str() {
        Some("") => Err(wrong_use(format!("{option} is empty; give a file or a shape"))),
        Some(path) => {
            let mut source = source_of_file(path.to_owned());
            if let ClipSource::Mesh { space: of_mesh, .. } = &mut source {
                *of_mesh = space;
            }
            Ok(Node::Leaf(source).into())
        }
        None => {
            let name = name.display();
            Err(anyhow!("{name}: clip expressions hold names in Unicode only; rename the file"))
        }
    }
}

fn numbers(option: &str, name: &str, list: &List) -> anyhow::Result<ClipTree> {
    shape::of_numbers(name, list).map_err(|e| wrong_use(format!("{option}: {e}")))
}

/// A box in voxel space.
fn crop(list: &List, volume: &Volume) -> anyhow::Result<ClipTree> {
    Ok(numbers("--crop", "box", list)?.with_pose(Pose::new(*volume.world_from_voxel())?))
}

/// The pose of an object after another `--clip-pose`.
fn moved(object: &ClipTree, text: &str, volume: &Volume, solids: &mut Solids) -> anyhow::Result<Pose> {
    let mut fit = |done: &DAffine3| fit(object, done, volume, solids);
    let blame = |e: String| wrong_use(format!("--clip-pose: {e}"));
    let pose = shape::pose(text, &mut fit)?.map_err(blame)?;
    pose.after(&object.pose).map_err(|e| blame(e.to_string()))
}

/// Centres an object, as it is after what has been `done` to it, in the volume and scales it, the same along all axes, as
/// large as it can be within the volume's box.
fn fit(object: &ClipTree, done: &DAffine3, volume: &Volume, solids: &mut Solids) -> anyhow::Result<DAffine3> {
    let Node::Leaf(source) = &object.node else { return Ok(DAffine3::IDENTITY) };
    let bounds = source.solid(&mut |external| solids.load(external))?.bounds();
    let posed = *done * *object.pose.world_from_object();
    let points = clip::box_corners(bounds).map(|p| posed.transform_point3(p));
    clip::fit(&points, &volume.corners_in_world()).map_err(|error| {
        let message = format!("--clip-pose: {error}; leave out `fit`");
        // Wrong use where no file or volume could make it right.
        if error == FitError::Endless { wrong_use(message) } else { anyhow!(message) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_io::scene_file::ClipSource;

    /// The path of the only object.
    fn path(clip: &ClipTree) -> String {
        let mut found = String::new();
        clip.clone().visit_leaves(&mut |source, _| found = source.path_mut().unwrap().clone());
        found
    }

    #[test]
    fn paths_are_relative_to_the_scene_file() {
        let mesh: ClipTree =
            Node::Leaf(ClipSource::Mesh { path: "meshes/bunny.ply".to_owned(), space: MeshSpace::Lps })
                .into();
        let here = from_here(&mesh, Path::new("data/scene.json")).unwrap();
        assert_eq!(path(&here), "data/meshes/bunny.ply");
        let prepared = PreparedClip { file: here, clip: Clip::everything(), notices: Vec::new() };
        let saved = |scene: &str| path(&prepared.to_file(Path::new(scene)).unwrap().0);
        assert_eq!(saved("data/other.json"), "meshes/bunny.ply");
        assert_eq!(saved("scene.json"), "data/meshes/bunny.ply");
        assert_eq!(saved("elsewhere/scene.json"), "../data/meshes/bunny.ply");
    }
}
