//! Scenes made of random numbers: whatever a scene can be, a renderer must draw it without a panic, an error or a NaN.
//!
//! A scene is a function of its seed, so that one that failed can be made again. Half of them are *tame*: their fields,
//! transfer functions and cameras are such that a fine step comes near to the exact integral, and are compared with it.

use std::num::NonZeroU32;
use std::sync::Arc;

use cutaway_core::camera::Camera;
use cutaway_core::clip::{
    AxisBox, BufferDepth, Clip, ClipEvents, ClipShading, Impregnation, Node, ObjectId, Plane, Pose,
    SegmentCount, Solid, Sphere,
};
use cutaway_core::glam::{DAffine3, DMat3, DVec3, EulerRot, UVec3};
use cutaway_core::lighting::{DiffuseCurve, Lighting};
use cutaway_core::scene::{
    Gradient, ImageInterpolation, Layer, Layout, Mode, RenderSettings, Sampling, Scene, SceneError,
    SpaceSkipping,
};
use cutaway_core::space::WorldFrame;
use cutaway_core::transfer_function::TransferFunction;
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_mesh::{EventFinder, MeshSolid, shapes};

use crate::scenes::point;

/// Numbers from a seed: splitmix64.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Numbers of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0..1.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Evenly between two numbers.
    pub fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }

    /// Between two numbers above 0, all orders of magnitude alike.
    pub fn magnitude(&mut self, lo: f64, hi: f64) -> f64 {
        self.between(lo.ln(), hi.ln()).exp()
    }

    /// A whole number, both ends included.
    pub fn whole(&mut self, lo: u32, hi: u32) -> u32 {
        lo + (self.next() % u64::from(hi - lo + 1)) as u32
    }

    /// True this often.
    pub fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    /// One of these.
    pub fn one_of<T: Clone>(&mut self, choices: &[T]) -> T {
        choices[(self.next() % choices.len() as u64) as usize].clone()
    }

    /// A direction, sometimes along an axis.
    pub fn direction(&mut self) -> DVec3 {
        if self.chance(0.2) {
            return self.one_of(&[DVec3::X, DVec3::Y, DVec3::Z]) * self.one_of(&[-1.0, 1.0]);
        }
        let v = DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0));
        v.try_normalize().unwrap_or(DVec3::X)
    }
}

/// A scene and what it is made of.
#[derive(Clone, Debug)]
pub struct RandomScene {
    /// What it was made from.
    pub seed: u64,
    /// Whether a fine step comes near to the exact integral.
    pub tame: bool,
    /// Its voxels.
    pub volume: Volume,
    /// Its transfer function.
    pub function: TransferFunction,
    /// The world length that opacities are for.
    pub unit_distance: Option<f64>,
    /// Its camera.
    pub camera: Camera,
    /// Its light.
    pub lighting: Lighting,
    /// How its image is made.
    pub settings: RenderSettings,
    /// What is shown of the volume, and what clip surfaces look like.
    pub clip: Option<(Clip, ClipShading)>,
}

impl RandomScene {
    /// The scene of a seed.
    pub fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let r = &mut random;
        let tame = r.chance(0.5);
        let volume = volume(r, tame);
        let function = function(r, volume.value_range(), tame);
        let spacing = volume.spacing().element_sum() / 3.0;
        let factor = if tame { r.between(0.5, 2.0) } else { r.magnitude(1e-3, 1e3) };
        let unit_distance = r.chance(0.3).then_some(spacing * factor);
        let camera = camera(r, &volume, tame);
        let lighting = lighting(r, tame);
        let settings = settings(r, &volume, tame);
        // Last, so that what a seed's scene is otherwise does not depend on it.
        let clip = r.chance(0.4).then(|| (clip(r, &volume), clip_shading(r)));
        Self { seed, tame, volume, function, unit_distance, camera, lighting, settings, clip }
    }

    /// The scene with these settings instead of its own.
    pub fn scene_with(&self, settings: RenderSettings) -> Result<Scene, SceneError> {
        let (camera, lighting) = (self.camera.clone(), self.lighting.clone());
        let scene = Scene::new(
            Layer::new(self.volume.clone(), &self.function)
                .with_unit_distance(self.unit_distance)
                .with_lighting(lighting),
            camera,
            settings,
        )?;
        match &self.clip {
            Some((clip, shading)) => scene.with_clip(clip, shading.clone()),
            None => Ok(scene),
        }
    }

    /// All but the voxels, in words.
    pub fn describe(&self) -> String {
        let Self { seed, tame, volume, function, unit_distance, camera, lighting, settings, clip } = self;
        format!(
            "seed {seed}, tame {tame}: {} {} {:?} {:?}\n{:?}\nunit distance {unit_distance:?}\n{camera:?}\n{lighting:?}\n{settings:?}\n{clip:?}",
            volume.dimensions(),
            volume.source_type().name(),
            volume.rescale(),
            volume.geometry(),
            function.points(),
        )
    }
}

fn geometry(r: &mut Random, tame: bool) -> Geometry {
    let unit = if tame || r.chance(0.7) { 1.0 } else { r.magnitude(1e-6, 1e6) };
    let reach: f64 = if tame { 1.5 } else { 8.0 };
    let mut spacing = || r.magnitude(1.0 / reach, reach) * unit;
    let mut columns = DMat3::from_diagonal(DVec3::new(spacing(), spacing(), spacing()));
    if r.chance(0.3) {
        // Sheared, along one axis; the grid stays far from flat.
        columns.y_axis.x += r.between(-0.6, 0.6) * columns.x_axis.x;
    }
    if r.chance(0.3) {
        columns.x_axis = -columns.x_axis;
    }
    if r.chance(0.6) {
        let angles = [r.between(-3.0, 3.0), r.between(-1.5, 1.5), r.between(-3.0, 3.0)];
        columns = DMat3::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]) * columns;
    }
    let far = if tame { 100.0 } else { r.one_of(&[0.0, 10.0, 1e4]) };
    let translation = r.direction() * far * unit;
    Geometry { world_from_voxel: DAffine3 { matrix3: columns, translation }, frame: WorldFrame::Unknown }
}

fn volume(r: &mut Random, tame: bool) -> Volume {
    let most = if tame { 24 } else { 40 };
    let mut side = || if r.chance(0.2) { r.whole(2, 4) } else { r.whole(2, most) };
    let dimensions = UVec3::new(side(), side(), side());
    let count = dimensions.element_product();
    let kind = if tame { 0 } else { r.whole(0, 4) };
    let waves: Vec<(DVec3, f64)> =
        (0..4).map(|_| (r.direction() * r.between(0.05, 0.7), r.between(0.0, 6.3))).collect();
    let constant = r.unit();
    let value = |r: &mut Random, i: u32| -> f64 {
        let p =
            UVec3::new(i % dimensions.x, i / dimensions.x % dimensions.y, i / (dimensions.x * dimensions.y));
        let p = p.as_dvec3();
        match kind {
            0 => 0.5 + 0.125 * waves.iter().map(|(w, phase)| (w.dot(p) + phase).sin()).sum::<f64>(),
            // Noise, labels, one value, one voxel.
            1 => r.unit(),
            2 => f64::from(u8::from((p - dimensions.as_dvec3() * 0.5).length() < 0.3 * f64::from(most))),
            3 => constant,
            _ => f64::from(u8::from(i == count / 2)),
        }
    };
    let values: Vec<f64> = (0..count).map(|i| value(r, i).clamp(0.0, 1.0)).collect();
    let slope = r.one_of(&[1.0, 1.0, -0.25, 1e-3, if tame { 2.0 } else { 1e6 }]);
    let rescale = Rescale { slope, intercept: r.one_of(&[0.0, 0.0, -1024.0 * slope, 3.0]) };
    let geometry = geometry(r, tame);
    // Of the whole range, of a small part of it, and of what no integer holds.
    let range = r.one_of(&[1.0, 1.0, 0.05]);
    let made = match r.whole(0, 6) {
        0 => Volume::new(dimensions, map(&values, |v| (v * range * 255.0) as u8), rescale, geometry),
        1 => Volume::new(dimensions, map(&values, |v| (v * range * 255.0 - 128.0) as i8), rescale, geometry),
        2 => Volume::new(dimensions, map(&values, |v| (v * range * 65535.0) as u16), rescale, geometry),
        3 => {
            Volume::new(dimensions, map(&values, |v| (v * range * 4095.0 - 1024.0) as i16), rescale, geometry)
        }
        4 => Volume::new(dimensions, map(&values, |v| (v * 1e9) as i32), rescale, geometry),
        5 => {
            let scale = if tame { 1.0 } else { r.magnitude(1e-20, 1e20) };
            Volume::new(dimensions, map(&values, |v| (v * scale) as f32), rescale, geometry)
        }
        _ => Volume::new(dimensions, map(&values, |v| v * 3.0 - 1.0), rescale, geometry),
    };
    made.expect("a valid volume")
}

fn map<T>(values: &[f64], f: impl Fn(f64) -> T) -> Vec<T> {
    values.iter().map(|v| f(*v)).collect()
}

fn function(r: &mut Random, [lo, hi]: [f64; 2], tame: bool) -> TransferFunction {
    let count = if tame { r.whole(3, 5) } else { r.whole(1, 12) };
    let mut values: Vec<f64> = (0..count)
        .map(|i| match tame {
            // Evenly, so that no ramp is steep.
            true => lo + (hi - lo) * f64::from(i) / f64::from(count - 1),
            false => lo + (hi - lo) * r.between(-0.2, 1.2),
        })
        .collect();
    values.sort_by(f64::total_cmp);
    if !tame && r.chance(0.4) {
        // A step; and a wall where both opacities come so.
        let at = r.whole(0, count - 1) as usize;
        values.insert(at, values[at]);
    }
    let most = if tame { 0.4 } else { 1.0 };
    let points = values.into_iter().map(|value| {
        let color = [r.unit(), r.unit(), r.unit()];
        let opacity = match r.whole(0, 3) {
            0 => 0.0,
            1 if !tame => 1.0,
            _ => r.between(0.0, most),
        };
        point(value, color, opacity)
    });
    TransferFunction::new(points.collect()).expect("ordered points")
}

fn camera(r: &mut Random, volume: &Volume, tame: bool) -> Camera {
    let corners = volume.corners_in_world();
    let radius = 0.5 * corners[0].distance(corners[7]).max(corners[1].distance(corners[6]));
    let center = volume.center_in_world();
    let mut aim = center + r.direction() * radius * r.between(0.0, 0.4);
    let distance = match r.whole(0, 5) {
        // Inside, near, far; and so far that f32 has no room for both distance and volume.
        0 => radius * r.between(0.01, 0.5),
        1 | 2 => radius * r.between(1.0, 4.0),
        3 => radius * r.between(0.5, 1.5),
        _ if tame => radius * r.between(1.5, 8.0),
        _ => radius * r.magnitude(1.0, 1e7),
    };
    let position = aim - r.direction() * distance;
    if !tame && r.chance(0.1) {
        // Looking past it, or away.
        aim = position + r.direction() * radius;
    }
    let fitting = 2.0 * (1.3 * radius / distance).atan().to_degrees();
    let view_angle = match r.whole(0, 3) {
        0 if !tame => r.magnitude(1e-4, 179.9),
        _ => fitting.clamp(1e-6, if tame { 80.0 } else { 179.0 }),
    };
    Camera {
        position: position.to_array(),
        focal_point: aim.to_array(),
        view_up: r.direction().to_array(),
        view_angle,
        orthographic: r
            .chance(0.25)
            .then(|| radius * if tame { r.between(0.5, 1.5) } else { r.magnitude(1e-3, 1e3) }),
    }
}

fn lighting(r: &mut Random, tame: bool) -> Lighting {
    let mut factor = || if tame { r.unit() } else { r.one_of(&[0.0, 0.5, 1.0, 1e6]) };
    let (ambient, diffuse, specular) = (factor(), factor(), factor());
    Lighting {
        shade: r.chance(0.6),
        ambient,
        diffuse,
        specular,
        specular_power: if tame { r.between(1.0, 20.0) } else { r.one_of(&[0.0, 1.0, 10.0, 1e6]) },
        diffuse_curve: if r.chance(0.8) {
            DiffuseCurve::TwoSided
        } else {
            r.one_of(&[DiffuseCurve::Clamped, DiffuseCurve::Wrapped])
        },
        wrap_power: if tame { r.between(0.5, 3.0) } else { r.magnitude(1e-3, 1e3) },
        light: r
            .chance(0.5)
            .then(|| (r.direction() * if tame { 1.0 } else { r.magnitude(1e-9, 1e9) }).to_array()),
    }
}

/// Steps of a ray through a volume at most: scenes are many.
const MOST_STEPS: f64 = 3000.0;

fn settings(r: &mut Random, volume: &Volume, tame: bool) -> RenderSettings {
    let [lo, hi] = volume.value_range();
    let levels = r.whole(1, 3);
    let extent = if tame { (0.1, 0.9) } else { (-0.1, 1.1) };
    let mut iso: Vec<f64> = (0..levels).map(|_| lo + (hi - lo) * r.between(extent.0, extent.1)).collect();
    if !tame && r.chance(0.5) {
        // Exactly a voxel's value.
        iso[0] = volume.value_clamped(i64::from(r.whole(0, 40)), i64::from(r.whole(0, 40)), 0);
    }
    let corners = volume.corners_in_world();
    let steps = corners[0].distance(corners[7]) / volume.spacing().min_element();
    // Each way of sampling is a shader of its own, and compiling one takes longer than ten scenes: most share one.
    let plain = r.chance(0.75);
    let sampling = if plain { Sampling::View } else { r.one_of(&[Sampling::View, Sampling::Object]) };
    let coarsest = if r.chance(0.1) { 1e6 } else { 4.0 };
    let pre_integration = sampling == Sampling::View && !plain && r.chance(0.4);
    RenderSettings {
        mode: r.one_of(&Mode::ALL),
        iso,
        iso_opacity: r.between(0.05, 1.0),
        step: r.magnitude(0.05, coarsest).max(steps / MOST_STEPS),
        resolution: [r.whole(1, 40), r.whole(1, 40)],
        early_termination: r.one_of(&[1.0, 0.999, 0.9, 1e-6]),
        space_skipping: if plain { SpaceSkipping::Auto } else { r.one_of(&SpaceSkipping::ALL) },
        image_interpolation: r.one_of(&[
            ImageInterpolation::Off,
            ImageInterpolation::Adaptive,
            ImageInterpolation::Factor(3),
        ]),
        brightness: if tame { 1.0 } else { r.one_of(&[0.0, 0.5, 1.0, 1e6]) },
        sampling,
        pre_integration,
        adaptive_threshold: (!pre_integration && !plain && r.chance(0.4)).then(|| r.unit()),
        gradient: if plain { Gradient::Central } else { r.one_of(&[Gradient::Sobel, Gradient::Precomputed]) },
        layout: r.one_of(&[Layout::Linear, Layout::Bricks]),
        segments: if r.chance(0.8) {
            SegmentCount::Auto
        } else {
            SegmentCount::AtMost(NonZeroU32::MIN.saturating_add(r.whole(0, 3)))
        },
        backmost: r.chance(0.3),
        jitter: !plain && r.chance(0.5),
        blur: if r.chance(0.8) { 0.0 } else { r.between(0.0, 64.0) },
        clip_events: r.one_of(&[ClipEvents::Auto, ClipEvents::Lists, ClipEvents::Peel]),
        buffer_depth: r.one_of(&[BufferDepth::Half, BufferDepth::Single]),
        ..RenderSettings::default()
    }
}

/// A tree of solids about the volume, of up to three levels.
fn clip(r: &mut Random, volume: &Volume) -> Clip {
    let corners = volume.corners_in_world();
    let radius = 0.5 * corners[0].distance(corners[7]);
    let mut objects = 0;
    tree(r, volume.center_in_world(), radius, 3, &mut objects)
}

fn tree(r: &mut Random, center: DVec3, radius: f64, levels: u32, objects: &mut u32) -> Clip {
    if levels == 0 || r.chance(0.3) {
        *objects += 1;
        return solid(r, center, radius, *objects);
    }
    let mut parts = |r: &mut Random| -> Vec<Clip> {
        (0..r.whole(1, 3)).map(|_| tree(r, center, radius, levels - 1, objects)).collect()
    };
    let node = match r.whole(0, 4) {
        0 => Node::Union(parts(r)),
        1 => Node::Intersection(parts(r)),
        2 => Node::Difference(parts(r)),
        3 => Node::Complement(Box::new(tree(r, center, radius, levels - 1, objects))),
        _ => {
            let mut all = vec![Clip::everything()];
            all.extend(parts(r));
            Node::Difference(all)
        }
    };
    node.into()
}

fn solid(r: &mut Random, center: DVec3, radius: f64, id: u32) -> Clip {
    let place = center + r.direction() * radius * r.between(0.0, 0.8);
    let size = radius * r.between(0.1, 0.9);
    let unit: Arc<dyn Solid> = match r.whole(0, 5) {
        0 => Arc::new(Plane::new(r.direction(), 0.0).expect("a direction")),
        1 => Arc::new(AxisBox::new(DVec3::splat(-0.6), DVec3::new(0.9, 0.5, 0.7)).expect("a box")),
        2 => Arc::new(Sphere::new(DVec3::ZERO, 1.0).expect("a radius")),
        3 => Arc::new(MeshSolid::new(Arc::new(shapes::cube()), EventFinder::Bvh)),
        4 => Arc::new(MeshSolid::new(Arc::new(shapes::torus(0.4, 12, 8)), EventFinder::Grid)),
        _ => Arc::new(MeshSolid::new(Arc::new(shapes::icosphere(2)), EventFinder::Raster)),
    };
    let turn = DAffine3::from_axis_angle(r.direction(), r.between(-3.0, 3.0));
    let stretch = DVec3::new(1.0, r.between(0.5, 2.0), 1.0) * size;
    let pose = DAffine3::from_translation(place) * turn * DAffine3::from_scale(stretch);
    Clip::object(ObjectId(id), unit).with_pose(Pose::new(pose).expect("a pose that can be undone"))
}

fn clip_shading(r: &mut Random) -> ClipShading {
    ClipShading {
        impregnation: r.one_of(&[Impregnation::None, Impregnation::Step, Impregnation::Linear]),
        thickness: r.one_of(&[0.0, 1.0, 3.0, 1e6]),
        overlay: r.one_of(&[0.0, 0.0, 0.3, 1.0]),
        cap: r.chance(0.5),
    }
}
