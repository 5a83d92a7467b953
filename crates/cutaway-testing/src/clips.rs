//! Clipped scenes, for every engine the same.

use std::sync::Arc;

use cutaway_core::clip::{AxisBox, Clip, ClipShading, Node, ObjectId, Plane, Pose, Solid, Sphere};
use cutaway_core::glam::{DAffine3, DVec3};
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Mode, RenderSettings, Scene};
use cutaway_core::volume::Volume;
use cutaway_mesh::{EventFinder, MeshSolid, shapes};

use crate::scenes::{SMALL, framed, soft};

/// A leaf of a clip tree.
pub fn object(id: u32, solid: impl Solid) -> Clip {
    Clip::object(ObjectId(id), Arc::new(solid))
}

/// Where a volume is, and a length of its size.
pub fn middle(volume: &Volume) -> (DVec3, f64) {
    let [first, .., last] = volume.corners_in_world();
    (volume.center_in_world(), 0.5 * first.distance(last))
}

/// A ball, as a mesh of many triangles, finer with each level.
///
/// # Panics
/// If the radius is none.
pub fn ball(center: DVec3, radius: f64, level: u32, finder: EventFinder) -> Clip {
    let mesh = MeshSolid::new(Arc::new(shapes::icosphere(level)), finder);
    let pose = DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(radius));
    object(7, mesh).with_pose(Pose::new(pose).unwrap())
}

/// Clips of every kind, so placed that they cut a volume.
///
/// # Panics
/// If the volume has no size.
pub fn clips(volume: &Volume) -> Vec<(&'static str, Clip)> {
    let (center, r) = middle(volume);
    let towards = DVec3::new(-0.4, -0.8, 0.3);
    let sphere =
        |offset: f64, radius: f64| object(1, Sphere::new(center + towards * offset * r, radius * r).unwrap());
    let (half, edge) = (DVec3::splat(0.3 * r), AxisBox::new);
    let cube = object(2, edge(center - half, center + half).unwrap());
    let normal = DVec3::new(-1.0, -0.5, 0.2).normalize();
    let plane = object(3, Plane::new(normal, normal.dot(center) + 0.1 * r).unwrap());
    let turned = cube.clone().with_pose(
        Pose::new(
            DAffine3::from_translation(center)
                * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7)
                * DAffine3::from_translation(-center),
        )
        .unwrap(),
    );
    let union: Clip = Node::Union(vec![sphere(0.4, 0.25), turned.clone()]).into();
    vec![
        ("cut by a sphere", Clip::everything().cut(sphere(0.4, 0.4))),
        ("probed by a sphere around the middle", Clip::everything().probe(sphere(0.0, 0.4))),
        ("cut by a plane", Clip::everything().cut(plane.clone())),
        ("probed by a turned box, then cut", Clip::everything().probe(turned).cut(sphere(0.3, 0.2))),
        ("in several pieces", Clip::everything().cut(union).cut(plane)),
        (
            "cut by a mesh",
            Clip::everything().cut(ball(center + towards * 0.4 * r, 0.4 * r, 3, EventFinder::Raster)),
        ),
        ("probed by a mesh", Clip::everything().probe(ball(center, 0.4 * r, 2, EventFinder::Bvh))),
    ]
}

/// A small image at a quarter of a voxel; in isosurface mode two surfaces, not opaque.
pub fn settings(mode: Mode, volume: &Volume) -> RenderSettings {
    let [lo, hi] = volume.value_range();
    RenderSettings {
        mode,
        step: 0.25,
        resolution: SMALL,
        iso: if mode == Mode::Iso { vec![lo + 0.55 * (hi - lo), lo + 0.8 * (hi - lo)] } else { vec![] },
        iso_opacity: if mode == Mode::Iso { 0.7 } else { 1.0 },
        early_termination: if mode == Mode::Iso { 1.0 } else { 0.999 },
        ..RenderSettings::default()
    }
}

/// A volume framed and clipped.
///
/// # Panics
/// If settings are out of range.
pub fn scene(volume: &Volume, clip: &Clip, shading: ClipShading, settings: RenderSettings) -> Scene {
    let scene = framed(volume, &soft(volume.value_range()), Lighting::default(), settings);
    scene.with_clip(clip, shading).unwrap()
}
