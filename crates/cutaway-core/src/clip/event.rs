//! Events: where a line crosses the surface of a solid.

use glam::DVec3;

use crate::camera::Ray;

/// Which way a line goes through a surface, along its direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Crossing {
    /// Into the solid: against the outward normal.
    Entering,
    /// Out of it.
    Leaving,
}

/// A crossing of a line and a solid's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Where along the line, in units of the direction's length; may be negative: behind the ray's origin.
    pub t: f64,
    /// Into the solid or out of it.
    pub crossing: Crossing,
    /// Which part of the solid's surface, for [`Solid::normal`]: the triangle of a mesh, the face of a box.
    pub surface: u32,
}

/// A closed surface and its inside.
///
/// Lines are given in the solid's own *object* space, where their direction need not have unit length: `t` is the same
/// as on the line in the world.
///
/// [`Any`](std::any::Any): an engine may know a faster way to the events of a kind of solid than line by line.
pub trait Solid: std::any::Any + Send + Sync + std::fmt::Debug {
    /// Appends all events along the whole line of `ray_in_object`, before its origin too, in any order. Every crossing
    /// comes exactly once: a line through an edge that two triangles share crosses one of them.
    fn events(&self, ray_in_object: &Ray, events: &mut Vec<Event>);

    /// The unit normal in object space, outward, of a part of the surface at a point on it.
    fn normal(&self, surface: u32, point_in_object: DVec3) -> DVec3;

    /// Returns true if its surface is to be seen: lit, drawn and closed by caps where a segment begins at it. Otherwise it
    /// only takes away.
    fn has_surface(&self) -> bool {
        true
    }

    /// Corners of a box in object space that holds the whole surface; infinite for a half-space.
    fn bounds(&self) -> [DVec3; 2];
}
