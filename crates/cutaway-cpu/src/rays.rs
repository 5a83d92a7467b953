//! The rays of a frame in voxel space, as affine functions of the pixel.
//!
//! A ray passes a plane through the middle of the volume at a point that is affine in the pixel, in a direction (of unit
//! depth) that is affine, too. Both are computed in f64 once a packet and in f32 from there on: from however far an eye,
//! neighbouring rays stay apart, and no ray of its own is set up one by one.

use cutaway_core::camera::{PixelPlane, Ray, RayGenerator};
use cutaway_core::glam::DVec3;
use cutaway_core::scene::{Mode, Sampling, Scene};
use cutaway_core::volume::Volume;

use crate::mask::Mask;

/// What all rays of a frame share.
pub(crate) struct Frame<'a> {
    pub(crate) volume: &'a Volume,
    rays: RayGenerator,
    /// Of which pixel of the image the first one here is, along x and along y, and how many further the next one is.
    first: u32,
    spacing: u32,
    /// Which pixels are wanted; all unless there is one.
    mask: Option<&'a Mask>,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// World length of a step.
    pub(crate) step_length: f64,
    voxels_per_step: f32,
    /// Points of the rays near the middle of the volume, in voxel space.
    points: PixelPlane,
    /// Directions of the rays, in voxel space, for one world unit of depth.
    directions: PixelPlane,
    /// The same in the view: across and along the image, for one unit of depth; zero for parallel rays.
    tangents: Tangents,
    /// World depth of the plane of `points` in front of the camera, 0 or more.
    depth: f64,
    /// Whether samples lie on planes of voxels.
    on_planes: bool,
}

/// How far a ray leans from the view: `(across, along)` of pixel (0, 0), and their growth a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Tangents {
    first: [f64; 2],
    per_pixel: f64,
}

/// The first pixel of a packet, and how rays change from pixel to pixel, all in voxel space.
pub(crate) struct PacketRays {
    pub(crate) point: [f32; 3],
    pub(crate) point_per_x: [f32; 3],
    pub(crate) point_per_y: [f32; 3],
    pub(crate) direction: [f32; 3],
    pub(crate) direction_per_x: [f32; 3],
    pub(crate) direction_per_y: [f32; 3],
    /// Tangents of the first pixel: across and along.
    pub(crate) tangents: [f32; 2],
    pub(crate) tangent_per_pixel: f32,
    /// World depth of the points in front of the camera.
    pub(crate) depth: f32,
    /// World length of a step.
    pub(crate) step_length: f32,
    /// Whether samples lie on planes of voxels.
    pub(crate) on_planes: bool,
    /// Voxels along each ray from sample to sample, where steps differ from ray to ray; 0 where they do not.
    pub(crate) voxels_per_step: f32,
}

impl<'a> Frame<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        let (width, height) = scene.resolution();
        let volume = scene.volume();
        let rays = scene.camera().rays(width, height);
        // Behind the eye there is no ray to pass the plane: an eye beyond the middle has it at the eye itself.
        let depth = rays.depth_of(volume.center_in_world()).max(0.0);
        let voxel_from_world = volume.voxel_from_world();
        let in_voxels = |plane: PixelPlane, first: DVec3| PixelPlane {
            first,
            per_x: voxel_from_world.transform_vector3(plane.per_x),
            per_y: voxel_from_world.transform_vector3(plane.per_y),
        };
        let at_depth = rays.plane(depth);
        let points = in_voxels(at_depth, voxel_from_world.transform_point3(at_depth.first));
        let (directions, tangents) = match rays.eye() {
            Some(eye) => {
                let unit = rays.plane(1.0);
                let first = unit.first - eye;
                let axes = rays.axes();
                let tangents = Tangents {
                    first: [first.dot(axes.right), -first.dot(axes.up)],
                    per_pixel: unit.per_x.dot(axes.right),
                };
                (in_voxels(unit, voxel_from_world.transform_vector3(first)), tangents)
            }
            None => {
                let first = voxel_from_world.transform_vector3(rays.axes().forward);
                let directions = PixelPlane { first, per_x: DVec3::ZERO, per_y: DVec3::ZERO };
                (directions, Tangents::default())
            }
        };
        let step_length = scene.step_length();
        let (first, spacing, mask) = (0, 1, None);
        let settings = scene.settings();
        let on_planes = settings.mode == Mode::Composite && settings.sampling == Sampling::Object;
        Self {
            volume,
            rays,
            first,
            spacing,
            mask,
            width,
            height,
            step_length,
            points,
            directions,
            tangents,
            depth,
            on_planes,
            voxels_per_step: scene.voxels_per_step().unwrap_or(0.0) as f32,
        }
    }

    /// A frame whose pixels are every `spacing`-th one of this frame along x and y, from `(first, first)` on; `width` times
    /// `height` of them, be they within this frame or beyond its border. Rays are affine in the pixel: those of a lattice
    /// are the same planes with larger steps.
    pub(crate) fn lattice(&self, first: u32, spacing: u32, (width, height): (u32, u32)) -> Self {
        let every = |plane: &PixelPlane| PixelPlane {
            first: plane.at(first, first),
            per_x: plane.per_x * f64::from(spacing),
            per_y: plane.per_y * f64::from(spacing),
        };
        let Tangents { first: [across, along], per_pixel } = self.tangents;
        let offset = per_pixel * f64::from(first);
        Self {
            rays: self.rays,
            first: self.first + first * self.spacing,
            spacing: self.spacing * spacing,
            mask: None,
            width,
            height,
            points: every(&self.points),
            directions: every(&self.directions),
            tangents: Tangents {
                first: [across + offset, along + offset],
                per_pixel: per_pixel * f64::from(spacing),
            },
            ..*self
        }
    }

    /// The same frame with only the pixels of a mask.
    pub(crate) fn masked<'b>(&self, mask: &'b Mask) -> Frame<'b>
    where
        'a: 'b,
    {
        Frame { mask: Some(mask), ..*self }
    }

    /// Whether its pixels are those of the scene's image, not of a lattice.
    pub(crate) fn is_full(&self) -> bool {
        self.spacing == 1
    }

    /// Whether any pixel of a rectangle is wanted.
    #[inline]
    pub(crate) fn wants(&self, at: (u32, u32), size: (u32, u32)) -> bool {
        self.mask.is_none_or(|mask| mask.any(at, size))
    }

    /// The ray of a pixel, by itself.
    pub(crate) fn ray(&self, x: u32, y: u32) -> Ray {
        self.rays.pixel(self.first + x * self.spacing, self.first + y * self.spacing)
    }

    /// The rays from pixel `(x, y)` on.
    #[inline]
    pub(crate) fn packet_rays(&self, x: u32, y: u32) -> PacketRays {
        let f32s = |v: DVec3| v.as_vec3().to_array();
        let across = self.tangents.first[0] + self.tangents.per_pixel * f64::from(x);
        let along = self.tangents.first[1] + self.tangents.per_pixel * f64::from(y);
        PacketRays {
            point: f32s(self.points.at(x, y)),
            point_per_x: f32s(self.points.per_x),
            point_per_y: f32s(self.points.per_y),
            direction: f32s(self.directions.at(x, y)),
            direction_per_x: f32s(self.directions.per_x),
            direction_per_y: f32s(self.directions.per_y),
            tangents: [across as f32, along as f32],
            tangent_per_pixel: self.tangents.per_pixel as f32,
            depth: self.depth as f32,
            step_length: self.step_length as f32,
            on_planes: self.on_planes,
            voxels_per_step: self.voxels_per_step,
        }
    }

    /// The axis of voxel space that all rays of a rectangle of pixels follow in the same direction, leaning from it by
    /// less than three to one, and whether they ascend: along it, what is empty can be skipped for all of them at once.
    /// The rays lie within the cone of the four corner rays, and what is asked is convex: it is asked of the corners.
    pub(crate) fn common_axis(&self, x: u32, y: u32, width: u32, height: u32) -> Option<(usize, bool)> {
        let corners = [(x, y), (x + width - 1, y), (x, y + height - 1), (x + width - 1, y + height - 1)]
            .map(|(x, y)| self.directions.at(x, y));
        let forward: DVec3 = corners.iter().sum();
        let axis = forward.abs().max_position();
        let along = |d: &DVec3| d[axis] * forward[axis] > 0.0 && 3.0 * d[axis].abs() > d.abs().max_element();
        corners.iter().all(along).then_some((axis, forward[axis] > 0.0))
    }
}
