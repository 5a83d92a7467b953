//! Vertices and faces as they arrive, within the limits.

use cutaway_mesh::{EarClipper, MeshError, TriangleMesh};
use glam::{DVec3, Vec3};

use super::error::MeshReadError;
use super::input::Input;
use crate::volume::Place;

/// Vertices as they arrive: in single precision as long as that loses nothing.
pub(super) enum Positions {
    Single(Vec<Vec3>),
    Double(Vec<DVec3>),
}

impl Default for Positions {
    fn default() -> Self {
        Self::Single(Vec::new())
    }
}

impl Positions {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Single(list) => list.len(),
            Self::Double(list) => list.len(),
        }
    }

    pub(super) fn push(&mut self, position: DVec3) {
        let single = position.as_vec3();
        if let Self::Single(list) = self
            && single.as_dvec3() != position
        {
            *self = Self::Double(list.iter().map(|v| v.as_dvec3()).collect());
        }
        match self {
            Self::Single(list) => list.push(single),
            Self::Double(list) => list.push(position),
        }
    }

    fn get(&self, vertex: u32) -> DVec3 {
        match self {
            Self::Single(list) => list[vertex as usize].as_dvec3(),
            Self::Double(list) => list[vertex as usize],
        }
    }

    /// The most bytes per vertex that are needed until the mesh is made.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            Self::Single(_) => 12,
            Self::Double(_) => 36,
        }
    }

    pub(super) fn into_mesh(self, triangles: Vec<[u32; 3]>) -> Result<TriangleMesh, MeshError> {
        match self {
            Self::Single(list) => TriangleMesh::new(list, triangles),
            Self::Double(list) => TriangleMesh::from_positions(&list, triangles),
        }
    }
}

/// A mesh that is being read.
#[derive(Default)]
pub(super) struct Builder {
    vertices: Positions,
    triangles: Vec<[u32; 3]>,
    /// Corners of polygons of four corners or more, one after the other, and where each ends. They become triangles once all
    /// vertices are known.
    corners: Vec<u32>,
    ends: Vec<usize>,
    /// The highest vertex that a face names, and where.
    highest: Option<(u32, Place)>,
}

impl Builder {
    pub(super) fn vertices(&self) -> usize {
        self.vertices.len()
    }

    pub(super) fn vertex(&mut self, input: &Input<'_>, vertex: DVec3) -> Result<(), MeshReadError> {
        self.vertices.push(vertex);
        self.check_growth(input)
    }

    /// A face of any number of corners; fewer than three are no face and left out. Vertices may come later.
    pub(super) fn face(
        &mut self,
        input: &Input<'_>,
        face: &[u32],
        place: Place,
    ) -> Result<(), MeshReadError> {
        let Some(&highest) = face.iter().max() else { return Ok(()) };
        if self.highest.is_none_or(|(so_far, _)| highest > so_far) {
            self.highest = Some((highest, place));
        }
        match *face {
            [] | [_] | [_, _] => return Ok(()),
            [a, b, c] => self.triangles.push([a, b, c]),
            _ => {
                self.corners.extend_from_slice(face);
                self.ends.push(self.corners.len());
            }
        }
        self.check_growth(input)
    }

    /// Holds what arrived so far against the limit, now and then.
    fn check_growth(&self, input: &Input<'_>) -> Result<(), MeshReadError> {
        if (self.vertices.len() + self.triangles.len() + self.ends.len()).is_multiple_of(4096) {
            return self.check_size(input);
        }
        Ok(())
    }

    fn check_size(&self, input: &Input<'_>) -> Result<(), MeshReadError> {
        let triangles = self.triangles.len() + self.corners.len() - 2 * self.ends.len();
        input.check_memory(self.vertices.len() as u64, triangles as u64, self.vertices.bytes())
    }

    /// The mesh. `first` is the number that the file's first vertex has, for messages.
    pub(super) fn finish(mut self, input: &Input<'_>, first: u32) -> Result<TriangleMesh, MeshReadError> {
        self.check_size(input)?;
        if let Some((highest, place)) = self.highest.filter(|(v, _)| *v as usize >= self.vertices.len()) {
            let found = i64::from(highest) + i64::from(first);
            let vertices = self.vertices.len() as u64;
            return Err(MeshReadError::Index { file: input.file(), place, found, vertices, first });
        }
        let (mut clipper, mut start) = (EarClipper::default(), 0);
        for end in self.ends {
            let polygon = self.corners[start..end].to_vec();
            start = end;
            let rest = clipper.clip(polygon, &|v| self.vertices.get(v), &mut self.triangles);
            // What has no ears is taken as it is by everyone else, too: as a fan.
            let pairs = rest.windows(2).skip(1);
            self.triangles.extend(pairs.map(|pair| [rest[0], pair[0], pair[1]]));
        }
        let mesh = self.vertices.into_mesh(self.triangles);
        mesh.map_err(|error| MeshReadError::Mesh { file: input.file(), error })
    }
}
