//! A closed mesh as a solid to clip with.

use std::sync::Arc;

use cutaway_core::camera::{Ray, RayGenerator};
use cutaway_core::clip::{Event, Solid};
use cutaway_core::glam::{DAffine3, DVec3, Vec3};

use crate::TriangleMesh;
use crate::events::{EventFinder, FrameEvents, MeshEvents};
use crate::normals::SmoothNormals;

/// A mesh, what finds its events, and its smooth normals. Moving it costs nothing: lines come in its own space.
///
/// A line goes in as often as out where the mesh is closed and all triangles are wound alike; this type does not check
/// it.
#[derive(Debug)]
pub struct MeshSolid {
    events: MeshEvents,
    normals: SmoothNormals,
}

impl MeshSolid {
    /// Builds the finder's structure and the normals, once a mesh.
    pub fn new(mesh: Arc<TriangleMesh>, finder: EventFinder) -> Self {
        let normals = SmoothNormals::new(&mesh);
        Self { events: MeshEvents::new(mesh, finder), normals }
    }

    /// The mesh.
    pub fn mesh(&self) -> &Arc<TriangleMesh> {
        self.events.mesh()
    }

    /// What finds its events.
    pub fn mesh_events(&self) -> &MeshEvents {
        &self.events
    }

    /// The events of all pixels of an image, tile by tile; see [`MeshEvents::frame`].
    pub fn frame(
        &self,
        rays: &RayGenerator,
        object_from_world: &DAffine3,
        width: u32,
        height: u32,
    ) -> FrameEvents<'_> {
        self.events.frame(rays, object_from_world, width, height)
    }

    /// The unit normals at the corners of a triangle, which [`Solid::normal`] interpolates between; in object space.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn corner_normals(&self, triangle: usize) -> [Vec3; 3] {
        self.normals.of_corners(self.mesh(), triangle)
    }

    /// What it holds beside the mesh, in bytes: the finder's structure and the normals.
    pub fn bytes(&self) -> usize {
        self.events.bytes() + self.normals.bytes()
    }
}

impl Solid for MeshSolid {
    fn events(&self, ray_in_object: &Ray, events: &mut Vec<Event>) {
        self.events.line(ray_in_object, events);
    }

    /// Interpolated between the corners of the triangle, whose normals are means over the faces around them that meet
    /// at up to 60 degrees; across sharper creases faces are shaded apart. Zero for a triangle that is not there.
    fn normal(&self, surface: u32, point_in_object: DVec3) -> DVec3 {
        if (surface as usize) < self.mesh().triangles().len() {
            self.normals.at(self.mesh(), surface as usize, point_in_object - self.mesh().origin())
        } else {
            DVec3::ZERO
        }
    }

    /// Around all triangles; corners at 0 for a mesh without any.
    fn bounds(&self) -> [DVec3; 2] {
        self.events.bounds().unwrap_or_default()
    }
}
