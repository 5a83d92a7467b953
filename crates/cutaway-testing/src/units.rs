//! One scene in many units: of its values and of length. None of them may change its image.

use std::sync::Arc;

use cutaway_core::camera::Camera;
use cutaway_core::clip::{Clip, ClipShading, ObjectId, Pose, Sphere};
use cutaway_core::glam::{DAffine3, DVec3, UVec3};
use cutaway_core::lighting::Lighting;
use cutaway_core::scene::{Layer, Mode, RenderSettings, Scene, default_camera};
use cutaway_core::space::WorldFrame;
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_mesh::EventFinder;

use crate::clips::ball;
use crate::scenes::soft;

/// Voxels along a side.
const SIDE: u32 = 13;

/// Units that a scene is in.
#[derive(Clone, Copy, Debug)]
pub struct Units {
    /// Values are multiplied by this, after `offset` was added to them (they vary by 1).
    pub value: f64,
    /// What is added to values.
    pub offset: f64,
    /// World units per voxel.
    pub length: f64,
    /// Where the volume is, in voxels.
    pub place: DVec3,
}

impl Units {
    /// Values of 0 to 1, voxels of size 1, at the origin.
    pub const ONE: Self = Self { value: 1.0, offset: 0.0, length: 1.0, place: DVec3::ZERO };

    fn value_of(&self, share: f64) -> f64 {
        (share + self.offset) * self.value
    }

    fn volume(&self) -> Volume {
        let middle = 0.5 * f64::from(SIDE - 1);
        let field = |i: u32| {
            let p = (UVec3::new(i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)).as_dvec3() - middle) / middle;
            // A blob with a bump; from 0 to 1.
            let blob = (1.0 - 0.8 * p.length()).max(0.0);
            (blob + 0.1 * (5.0 * p.x + 3.0 * p.y).sin() * blob).clamp(0.0, 1.0)
        };
        let voxels: Vec<f64> = (0..SIDE.pow(3)).map(|i| self.value_of(field(i))).collect();
        let world_from_voxel =
            DAffine3::from_scale(DVec3::splat(self.length)) * DAffine3::from_translation(self.place);
        let geometry = Geometry { world_from_voxel, frame: WorldFrame::Unknown };
        Volume::new(UVec3::splat(SIDE), voxels, Rescale::IDENTITY, geometry).expect("a valid volume")
    }

    fn function(&self) -> TransferFunction {
        let unit = soft([0.0, 1.0]);
        let point = |p: &ControlPoint| ControlPoint { value: self.value_of(p.value), ..*p };
        TransferFunction::new(unit.points().iter().map(point).collect()).expect("ordered points")
    }

    fn camera(&self, volume: &Volume, resolution: [u32; 2]) -> Camera {
        default_camera(volume, f64::from(resolution[0]) / f64::from(resolution[1]))
    }

    /// The scene in these units: lit, seen with the default camera, cut by `cut`.
    ///
    /// # Panics
    /// If these units make no scene.
    pub fn scene(&self, mode: Mode, cut: Cut) -> Scene {
        let volume = self.volume();
        let resolution = [41, 33];
        let iso = if mode == Mode::Iso { vec![self.value_of(0.43)] } else { Vec::new() };
        let settings = RenderSettings { mode, iso, resolution, ..RenderSettings::default() };
        let camera = self.camera(&volume, resolution);
        let center = volume.center_in_world();
        let at = center + DVec3::new(-2.0, -5.0, 2.0) * self.length;
        let radius = 4.3 * self.length;
        let layer = Layer::new(volume, &self.function()).with_lighting(Lighting::default());
        let scene = Scene::new(layer, camera, settings).expect("a valid scene");
        let object = match cut {
            Cut::Nothing => return scene,
            Cut::Sphere => {
                let pose = DAffine3::from_translation(at) * DAffine3::from_scale(DVec3::splat(radius));
                let sphere = Arc::new(Sphere::new(DVec3::ZERO, 1.0).expect("a sphere"));
                Clip::object(ObjectId(1), sphere).with_pose(Pose::new(pose).expect("a pose"))
            }
            Cut::Mesh => ball(at, radius, 2, EventFinder::Raster),
        };
        scene.with_clip(&Clip::everything().cut(object), ClipShading::default()).expect("a valid clip")
    }
}

/// What is cut away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Cut {
    Nothing,
    Sphere,
    Mesh,
}
