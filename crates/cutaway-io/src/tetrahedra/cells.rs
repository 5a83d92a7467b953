//! From cells of many kinds to tetrahedra.
//!
//! A convex cell is the cone from its lowest-numbered corner over those of its faces that do not have that corner. Faces of
//! four corners are cut from their own lowest-numbered corner; that is also how the cone cuts those that it begins at, so two
//! cells cut the face between them alike (Dompierre et al., "How to subdivide pyramids, prisms and hexahedra into
//! tetrahedra", 1999).

use std::collections::BTreeMap;

/// Tetrahedra, and what could not become one.
#[derive(Debug, Default)]
pub(super) struct Tetrahedra {
    pub(super) corners: Vec<[u32; 4]>,
    /// By VTK's number of their kind.
    left_out: BTreeMap<u8, usize>,
    cut: usize,
    quadratic: usize,
}

const HEXAHEDRON: &[&[usize]] =
    &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];
/// As the hexahedron, its corners in the order of a lattice.
const VOXEL: &[&[usize]] =
    &[&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[1, 3, 7, 5], &[3, 2, 6, 7], &[2, 0, 4, 6]];
const WEDGE: &[&[usize]] = &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]];
const PYRAMID: &[&[usize]] = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];

/// How a kind of cells becomes tetrahedra.
enum Shape {
    Tetrahedron,
    Faces(usize, &'static [&'static [usize]]),
    /// A point, a line or a surface.
    NoVolume,
}

impl Tetrahedra {
    /// Adds a cell of VTK's kind with these points; an error says what is wrong with it.
    pub(super) fn add(&mut self, kind: u8, points: &[u32]) -> Result<(), String> {
        let shape = match kind {
            10 | 24 => Shape::Tetrahedron,
            11 => Shape::Faces(8, VOXEL),
            12 | 25 | 29 | 33 => Shape::Faces(8, HEXAHEDRON),
            13 | 26 | 31 | 32 => Shape::Faces(6, WEDGE),
            14 | 27 | 37 => Shape::Faces(5, PYRAMID),
            0..=9 | 21..=23 | 28 | 30 | 34..=36 => Shape::NoVolume,
            _ => return Err(format!("a cell of type {kind}")),
        };
        let corners = match shape {
            Shape::Tetrahedron => 4,
            Shape::Faces(corners, _) => corners,
            Shape::NoVolume => 0,
        };
        self.quadratic += usize::from(kind > 14 && corners > 0);
        if points.len() < corners || (kind <= 14 && corners > 0 && points.len() != corners) {
            return Err(format!("a cell of type {kind} with {} points", points.len()));
        }
        match shape {
            Shape::Tetrahedron => self.corners.push([points[0], points[1], points[2], points[3]]),
            Shape::Faces(_, faces) => {
                self.cut += 1;
                self.cone(points, faces);
            }
            Shape::NoVolume => *self.left_out.entry(kind).or_default() += 1,
        }
        Ok(())
    }

    fn cone(&mut self, points: &[u32], faces: &[&[usize]]) {
        let lowest = |face: &[usize]| (0..face.len()).min_by_key(|k| points[face[*k]]).unwrap_or(0);
        let corners = faces.iter().flat_map(|face| face.iter());
        let apex = corners.map(|corner| points[*corner]).min().unwrap_or(0);
        for face in faces {
            if face.iter().any(|corner| points[*corner] == apex) {
                continue;
            }
            let first = lowest(face);
            let at = |k: usize| points[face[(first + k) % face.len()]];
            for k in 1..face.len() - 1 {
                self.corners.push([apex, at(0), at(k), at(k + 1)]);
            }
        }
    }

    /// Adds those of another piece, whose points come `shift` later.
    pub(super) fn append(&mut self, other: Self, shift: u32) {
        self.corners.extend(other.corners.iter().map(|four| four.map(|corner| corner.saturating_add(shift))));
        self.cut += other.cut;
        self.quadratic += other.quadratic;
        for (kind, count) in other.left_out {
            *self.left_out.entry(kind).or_default() += count;
        }
    }

    /// What the user should know.
    pub(super) fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        if self.cut > 0 {
            notices.push(format!("{} cells of more than four corners are cut into tetrahedra", self.cut));
        }
        if self.quadratic > 0 {
            notices.push(format!("{} quadratic cells are taken by their corners", self.quadratic));
        }
        if !self.left_out.is_empty() {
            let count: usize = self.left_out.values().sum();
            notices.push(format!("{count} cells without volume (points, lines, surfaces) are left out"));
        }
        notices
    }

    /// The most bytes that so many numbers of points in cells can become: a hexahedron's eight are six tetrahedra.
    pub(super) fn most_bytes(connectivity: u64) -> u64 {
        connectivity.saturating_mul(16)
    }
}
