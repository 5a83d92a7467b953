//! Vertices and faces as they arrive, within the limits.

use cutaway_mesh::{EarClipper, TriangleMesh};
use glam::Vec3;

use super::error::MeshReadError;
use super::input::Input;
use crate::volume::Place;

/// A mesh that is being read.
#[derive(Default)]
pub(super) struct Builder {
    vertices: Vec<Vec3>,
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

    pub(super) fn vertex(&mut self, input: &Input<'_>, vertex: Vec3) -> Result<(), MeshReadError> {
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
        input.check_size(self.vertices.len() as u64, triangles as u64)
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
            let rest = clipper.clip(polygon, &self.vertices, &mut self.triangles);
            // What has no ears is taken as it is by everyone else, too: as a fan.
            let pairs = rest.windows(2).skip(1);
            self.triangles.extend(pairs.map(|pair| [rest[0], pair[0], pair[1]]));
        }
        TriangleMesh::new(self.vertices, self.triangles)
            .map_err(|error| MeshReadError::Mesh { file: input.file(), error })
    }
}
