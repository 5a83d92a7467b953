//! From cells of many kinds to tetrahedra.
//!
//! A convex cell is the cone from its lowest-numbered corner over those of its faces that do not have that corner. Faces of
//! four corners are cut from their own lowest-numbered corner; that is also how the cone cuts those that it begins at, so two
//! cells cut the face between them alike (Dompierre et al., "How to subdivide pyramids, prisms and hexahedra into
//! tetrahedra", 1999).

use std::collections::BTreeMap;

use super::error::TetrahedraReadError as Error;

/// Cells as a file has them: the points of one after those of another.
pub(super) struct Cells {
    /// Where each cell's points begin, and the end of the last one's.
    pub(super) offsets: Vec<i64>,
    /// The numbers of points.
    pub(super) points: Vec<i64>,
}

/// Tetrahedra, and what could not become one.
#[derive(Debug, Default)]
pub(super) struct Tetrahedra {
    pub(super) corners: Vec<[u32; 4]>,
    /// The cell that each comes from.
    pub(super) owners: Vec<u32>,
    /// Cells that were looked at, all kinds of them.
    count: u32,
    /// Cells that others own, or that are blanked.
    hidden: usize,
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
const PENTAGONAL_PRISM: &[&[usize]] = &[
    &[0, 4, 3, 2, 1],
    &[5, 6, 7, 8, 9],
    &[0, 1, 6, 5],
    &[1, 2, 7, 6],
    &[2, 3, 8, 7],
    &[3, 4, 9, 8],
    &[4, 0, 5, 9],
];
const HEXAGONAL_PRISM: &[&[usize]] = &[
    &[0, 5, 4, 3, 2, 1],
    &[6, 7, 8, 9, 10, 11],
    &[0, 1, 7, 6],
    &[1, 2, 8, 7],
    &[2, 3, 9, 8],
    &[3, 4, 10, 9],
    &[4, 5, 11, 10],
    &[5, 0, 6, 11],
];

/// How a kind of cells becomes tetrahedra.
enum Shape {
    Tetrahedron,
    Faces(usize, &'static [&'static [usize]]),
    /// A point, a line or a surface.
    NoVolume,
}

impl Tetrahedra {
    /// Whether the flags of `vtkGhostType` say that a cell is another piece's (1) or hidden (32).
    pub(super) fn hides(flags: f64) -> bool {
        flags as u32 & (1 | 32) != 0
    }

    /// Adds cells, each from one offset to the next, checked. Their points are numbered from 0 to `points`.
    pub(super) fn add_all(
        &mut self,
        file: &str,
        cells: &Cells,
        kinds: &[i64],
        points: usize,
        hidden: impl Fn(usize) -> bool,
    ) -> Result<(), Error> {
        let Cells { offsets, points: names } = cells;
        let wrong = |cell: usize, found: String, expected: &str| Error::Cell {
            file: file.to_owned(),
            cell,
            found,
            expected: expected.to_owned(),
        };
        if offsets.len().saturating_sub(1) != kinds.len() || u32::try_from(kinds.len()).is_err() {
            let found = format!("{} cells and {} cell types", offsets.len().saturating_sub(1), kinds.len());
            return Err(wrong(0, found, "a type per cell"));
        }
        let mut own = Vec::new();
        for (cell, (ends, kind)) in offsets.windows(2).zip(kinds).enumerate() {
            let range = usize::try_from(ends[0]).ok().zip(usize::try_from(ends[1]).ok());
            let range = range.and_then(|(begin, end)| names.get(begin..end));
            let Some(range) = range else {
                let found = format!("offsets {} to {}", ends[0], ends[1]);
                return Err(wrong(cell, found, &format!("ascending offsets of up to {}", names.len())));
            };
            own.clear();
            for name in range {
                match u32::try_from(*name) {
                    Ok(name) if (name as usize) < points => own.push(name),
                    _ => {
                        let expected = format!("points from 0 to {}", points.saturating_sub(1));
                        return Err(wrong(cell, format!("point {name}"), &expected));
                    }
                }
            }
            let kind = u8::try_from(*kind)
                .map_err(|_| wrong(cell, format!("cell type {kind}"), "VTK's cell types"))?;
            if hidden(cell) {
                self.hidden += 1;
            } else {
                let expected = "tetrahedra, voxels, hexahedra, wedges, pyramids or prisms";
                self.add(kind, &own).map_err(|found| wrong(cell, found, expected))?;
            }
            self.count += 1;
            self.owners.resize(self.corners.len(), self.count - 1);
        }
        Ok(())
    }

    /// Adds a cell of VTK's kind with these points; an error says what is wrong with it.
    fn add(&mut self, kind: u8, points: &[u32]) -> Result<(), String> {
        let shape = match kind {
            10 | 24 | 71 | 78 => Shape::Tetrahedron,
            11 => Shape::Faces(8, VOXEL),
            12 | 25 | 29 | 33 | 72 | 79 => Shape::Faces(8, HEXAHEDRON),
            13 | 26 | 31 | 32 | 73 | 80 => Shape::Faces(6, WEDGE),
            14 | 27 | 37 | 74 | 81 => Shape::Faces(5, PYRAMID),
            15 => Shape::Faces(10, PENTAGONAL_PRISM),
            16 => Shape::Faces(12, HEXAGONAL_PRISM),
            0..=9 | 21..=23 | 28 | 30 | 34..=36 | 68..=70 | 75..=77 => Shape::NoVolume,
            _ => return Err(format!("a cell of type {kind}")),
        };
        let corners = match shape {
            Shape::Tetrahedron => 4,
            Shape::Faces(corners, _) => corners,
            Shape::NoVolume => 0,
        };
        self.quadratic += usize::from(kind > 16 && corners > 0);
        if points.len() < corners || (kind <= 16 && corners > 0 && points.len() != corners) {
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
        self.owners.extend(other.owners.iter().map(|cell| cell.saturating_add(self.count)));
        self.count = self.count.saturating_add(other.count);
        self.hidden += other.hidden;
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
            notices.push(format!("{} quadratic cells are reduced to their corners", self.quadratic));
        }
        if !self.left_out.is_empty() {
            let count: usize = self.left_out.values().sum();
            notices.push(format!("{count} cells without volume (points, lines, surfaces) are left out"));
        }
        if self.hidden > 0 {
            notices.push(format!(
                "{} cells that vtkGhostType calls copies of another piece's, or hidden, are left out",
                self.hidden
            ));
        }
        notices
    }

    /// The most bytes that the cells of this many numbers of points can become: a hexahedron's eight are six tetrahedra of
    /// 20 bytes, a hexagonal prism's twelve are twelve.
    pub(super) fn most_bytes(connectivity: u64) -> u64 {
        connectivity.saturating_mul(24)
    }
}
