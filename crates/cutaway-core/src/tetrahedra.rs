//! Unstructured grids: points anywhere, a value at each, and tetrahedra between them.
//!
//! The field is linear in each tetrahedron, and there is none outside of them. What else has to do with a volume (a view
//! that frames it, a histogram, a clip) uses its [lattice](TetrahedralMesh::lattice), a regular grid of the same box and values.

use glam::{DAffine3, DMat3, DVec3, UVec3};

use crate::space::WorldFrame;
use crate::volume::{Geometry, NanMeaning, Rescale, Volume, VolumeError, Voxel};

/// Why points, cells and values do not make an unstructured grid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TetrahedraError {
    /// Nothing to be shown.
    #[error("an unstructured grid needs at least one tetrahedron, found none")]
    Empty,
    /// No value at any tetrahedron.
    #[error("every tetrahedron of the unstructured grid has a corner without a value (NaN)")]
    Missing,
    /// Not a value a point.
    #[error("an unstructured grid needs a value a point: {points} points, found {values} values")]
    ValueCount {
        /// Points.
        points: usize,
        /// Values.
        values: usize,
    },
    /// More points or tetrahedra than 32-bit numbers can name.
    #[error("an unstructured grid has at most 4294967295 points and tetrahedra, found {found} {what}")]
    TooMany {
        /// Of what there are too many.
        what: &'static str,
        /// How many there are.
        found: usize,
    },
    /// A corner that is no point.
    #[error("tetrahedron {cell} has point {found} as a corner; there are {points} points")]
    Corner {
        /// Which tetrahedron, from 0.
        cell: usize,
        /// The number of its corner.
        found: u32,
        /// Points.
        points: usize,
    },
    /// A coordinate that is no number, or beyond what can be computed with.
    #[error("point {index} is at {found:?}; expected numbers of at most 1e30")]
    Point {
        /// Which point, from 0.
        index: usize,
        /// Where it is.
        found: [f64; 3],
    },
    /// All points in a plane.
    #[error("the points of an unstructured grid lie in a plane: their box is {size:?}")]
    Flat {
        /// Of the box, in world units.
        size: [f64; 3],
    },
    /// The values are no field.
    #[error(transparent)]
    Values(#[from] VolumeError),
}

/// An unstructured grid, valid by construction: every corner is a point, coordinates are finite, values are numbers.
#[derive(Clone, Debug)]
pub struct TetrahedralMesh {
    points: Vec<DVec3>,
    cells: Vec<[u32; 4]>,
    values: Vec<f32>,
    bounds: [DVec3; 2],
    lattice: Volume,
}

impl TetrahedralMesh {
    /// Points in the world, corners of tetrahedra (in any order) and a value per point; values that are not finite are
    /// replaced as those of volumes are.
    pub fn new<T: Voxel>(
        points: Vec<DVec3>,
        cells: Vec<[u32; 4]>,
        values: Vec<T>,
    ) -> Result<Self, TetrahedraError> {
        Self::with_nan(points, cells, values, NanMeaning::Transparent)
    }

    /// As [`Self::new`], with a meaning of values that are NaN: tetrahedra that touch such a point are left out, or the point
    /// has the lowest or the highest value.
    ///
    /// # Errors
    /// Whatever makes these no grid.
    pub fn with_nan<T: Voxel>(
        points: Vec<DVec3>,
        mut cells: Vec<[u32; 4]>,
        values: Vec<T>,
        nan: NanMeaning,
    ) -> Result<Self, TetrahedraError> {
        if cells.is_empty() {
            return Err(TetrahedraError::Empty);
        }
        if points.len() != values.len() {
            return Err(TetrahedraError::ValueCount { points: points.len(), values: values.len() });
        }
        for (what, found) in [("points", points.len()), ("tetrahedra", cells.len())] {
            if u32::try_from(found).is_err() {
                return Err(TetrahedraError::TooMany { what, found });
            }
        }
        let corners = || cells.iter().enumerate().flat_map(|(cell, four)| four.map(|c| (cell, c)));
        if let Some((cell, found)) = corners().find(|(_, c)| *c as usize >= points.len()) {
            return Err(TetrahedraError::Corner { cell, found, points: points.len() });
        }
        let far = |p: &DVec3| !p.is_finite() || p.abs().max_element() > 1e30;
        if let Some(index) = points.iter().position(far) {
            return Err(TetrahedraError::Point { index, found: points[index].to_array() });
        }
        if nan == NanMeaning::Transparent {
            cells.retain(|four| four.iter().all(|corner| !values[*corner as usize].to_f64().is_nan()));
            if cells.is_empty() {
                return Err(TetrahedraError::Missing);
            }
        }
        let corners = || cells.iter().enumerate().flat_map(|(cell, four)| four.map(|c| (cell, c)));
        // Points that no tetrahedron has do not count.
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for (_, corner) in corners() {
            let p = points[corner as usize];
            bounds = [bounds[0].min(p), bounds[1].max(p)];
        }
        let meaning = if nan == NanMeaning::Highest { nan } else { NanMeaning::Lowest };
        let lattice = lattice(bounds, &values)?.with_nan(meaning);
        let values = (0..points.len()).map(|i| lattice.voxels().get(i)).collect();
        Ok(Self { points, cells, values, bounds, lattice })
    }

    /// Points in the world.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The numbers of each tetrahedron's points.
    pub fn cells(&self) -> &[[u32; 4]] {
        &self.cells
    }

    /// A number per point, all finite: its value as the [lattice](Self::lattice) stores it, see
    /// [`Volume::rescale`].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The corners of the box that all tetrahedra are in, in the world.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// A grid over the same box that holds the points' values, in no order that means anything, some of them twice: for
    /// whatever asks a volume where it is, how fine it is, or which values it has.
    pub fn lattice(&self) -> &Volume {
        &self.lattice
    }

    /// The gradient of the field in a tetrahedron, stored number per world unit; none where it has no volume.
    pub fn gradient(&self, cell: usize) -> Option<DVec3> {
        let four = self.cells[cell].map(|c| c as usize);
        let [p, a, b, c] = four.map(|i| self.points[i]);
        let [v, va, vb, vc] = four.map(|i| f64::from(self.values[i]));
        let edges = DMat3::from_cols(a - p, b - p, c - p);
        let longest = edges.x_axis.length().max(edges.y_axis.length()).max(edges.z_axis.length());
        // Flatter than rounding of the coordinates.
        if edges.determinant().abs() <= 1e-12 * longest.powi(3) {
            return None;
        }
        Some(edges.transpose().inverse() * DVec3::new(va - v, vb - v, vc - v))
    }

    /// The gradient at each point: the mean of those in the tetrahedra around it, by their volumes.
    pub fn point_gradients(&self) -> Vec<DVec3> {
        let mut sums = vec![(DVec3::ZERO, 0.0); self.points.len()];
        for (index, cell) in self.cells.iter().enumerate() {
            let Some(gradient) = self.gradient(index) else { continue };
            let [p, a, b, c] = cell.map(|i| self.points[i as usize]);
            let volume = (a - p).cross(b - p).dot(c - p).abs();
            for corner in cell {
                let (sum, weight) = &mut sums[*corner as usize];
                *sum += gradient * volume;
                *weight += volume;
            }
        }
        sums.into_iter().map(|(sum, weight)| if weight > 0.0 { sum / weight } else { DVec3::ZERO }).collect()
    }

    /// The tetrahedra of a grid of points, each cell in five, mirrored from cell to cell so that faces match: what the cell
    /// renderer makes of a volume.
    pub fn from_volume(volume: &Volume) -> Result<Self, TetrahedraError> {
        let n = volume.dimensions();
        let index = |p: UVec3| (p.z * n.y + p.y) * n.x + p.x;
        let lattice = |n: UVec3| {
            (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))))
        };
        let points = lattice(n).map(|p| volume.world_from_voxel().transform_point3(p.as_dvec3())).collect();
        let rescale = volume.rescale();
        let value = |i| rescale.value(f64::from(volume.voxels().get(i)));
        let values: Vec<f64> = (0..volume.voxels().len()).map(value).collect();
        let mut cells = Vec::new();
        for cell in lattice(n.saturating_sub(UVec3::ONE)) {
            let parity = cell.element_sum() & 1;
            for corners in five_of_a_cell(parity) {
                cells.push(corners.map(|c| index(cell + UVec3::new(c & 1, c >> 1 & 1, c >> 2))));
            }
        }
        Self::new(points, cells, values)
    }
}

/// Corners (x + 2 y + 4 z) of the five tetrahedra of a cell; of parity 1 they are mirrored.
pub fn five_of_a_cell(parity: u32) -> [[u32; 4]; 5] {
    let apex = |a: u32| [a, a ^ 1, a ^ 2, a ^ 4];
    [apex(0), apex(3), apex(5), apex(6), [1, 2, 4, 7]].map(|four| four.map(|c| c ^ parity))
}

/// A grid over a box with about as many voxels as there are values.
fn lattice<T: Voxel>([lo, hi]: [DVec3; 2], values: &[T]) -> Result<Volume, TetrahedraError> {
    let size = hi - lo;
    if size.min_element() <= 1e-9 * size.max_element() {
        return Err(TetrahedraError::Flat { size: size.to_array() });
    }
    let side = ((values.len() as f64).cbrt().ceil() as u32).max(2);
    let layers = values.len().div_ceil((side * side) as usize).max(2) as u32;
    let dimensions = UVec3::new(side, side, layers);
    let count = side as usize * side as usize * layers as usize;
    let voxels: Vec<T> = values.iter().copied().cycle().take(count).collect();
    let spacing = size / (dimensions - UVec3::ONE).as_dvec3();
    let world_from_voxel = DAffine3 { matrix3: DMat3::from_diagonal(spacing), translation: lo };
    let geometry = Geometry { world_from_voxel, frame: WorldFrame::Unknown };
    Ok(Volume::new(dimensions, voxels, Rescale::IDENTITY, geometry)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner() -> (Vec<DVec3>, Vec<[u32; 4]>) {
        (vec![DVec3::ZERO, DVec3::X, DVec3::Y * 2.0, DVec3::Z * 4.0], vec![[0, 1, 2, 3]])
    }

    #[test]
    fn a_linear_field_has_its_gradient() {
        let (points, cells) = corner();
        let slope = DVec3::new(3.0, -1.0, 0.5);
        let values: Vec<f32> = points.iter().map(|p| (p.dot(slope) + 7.0) as f32).collect();
        let mesh = TetrahedralMesh::new(points, cells, values).unwrap();
        assert!((mesh.gradient(0).unwrap() - slope).length() < 1e-6);
        assert!(mesh.point_gradients().iter().all(|g| (*g - slope).length() < 1e-6));
        assert_eq!(mesh.bounds(), [DVec3::ZERO, DVec3::new(1.0, 2.0, 4.0)]);
        assert_eq!(mesh.lattice().value_range(), [5.0, 10.0]);
        assert_eq!(mesh.lattice().corners_in_world()[7], DVec3::new(1.0, 2.0, 4.0));
    }

    #[test]
    fn report_61_values_on_a_large_offset_keep_their_differences() {
        let (points, cells) = corner();
        let values: Vec<f64> = (0..4).map(|i| 101_325.0 + 0.001 * f64::from(i)).collect();
        let mesh = TetrahedralMesh::new(points, cells, values.clone()).unwrap();
        let rescale = mesh.lattice().rescale();
        for (stored, value) in mesh.values().iter().zip(values) {
            assert!((rescale.value(f64::from(*stored)) - value).abs() < 1e-9);
        }
    }

    #[test]
    fn report_34_tetrahedra_that_touch_a_point_without_value_are_left_out() {
        let (mut points, mut cells) = corner();
        points.push(DVec3::ONE * 3.0);
        cells.push([1, 2, 3, 4]);
        let values = vec![0.0, 1.0, 2.0, 3.0, f64::NAN];
        let made =
            |nan| TetrahedralMesh::with_nan(points.clone(), cells.clone(), values.clone(), nan).unwrap();
        let mesh = made(NanMeaning::Transparent);
        assert_eq!((mesh.cells(), mesh.lattice().value_range()), (&[[0, 1, 2, 3]][..], [0.0, 3.0]));
        assert!(mesh.lattice().missing_cells().is_none());
        assert_eq!(made(NanMeaning::Highest).values()[4], 3.0);
        assert_eq!(made(NanMeaning::Lowest).values()[4], 0.0);
        let nothing = TetrahedralMesh::new(points.clone(), cells.clone(), vec![f64::NAN; 5]);
        assert!(matches!(nothing, Err(TetrahedraError::Missing)));
    }

    #[test]
    fn nonsense_is_refused() {
        let (points, cells) = corner();
        let make = |points: &[DVec3], cells: &[[u32; 4]], values: Vec<f32>| {
            TetrahedralMesh::new(points.to_vec(), cells.to_vec(), values).map(|_| ()).unwrap_err()
        };
        assert_eq!(make(&points, &[], vec![0.0; 4]), TetrahedraError::Empty);
        let count = TetrahedraError::ValueCount { points: 4, values: 3 };
        assert_eq!(make(&points, &cells, vec![0.0; 3]), count);
        let corner = TetrahedraError::Corner { cell: 1, found: 4, points: 4 };
        assert_eq!(make(&points, &[[0, 1, 2, 3], [0, 1, 2, 4]], vec![0.0; 4]), corner);
        let mut lost = points.clone();
        lost[2].x = f64::NAN;
        assert!(matches!(make(&lost, &cells, vec![0.0; 4]), TetrahedraError::Point { index: 2, .. }));
        let flat: Vec<DVec3> = points.iter().map(|p| p.with_z(0.0)).collect();
        assert!(matches!(make(&flat, &cells, vec![0.0; 4]), TetrahedraError::Flat { .. }));
    }

    #[test]
    fn the_five_fill_a_cell_and_match_their_neighbours() {
        let at = |c: u32| UVec3::new(c & 1, c >> 1 & 1, c >> 2).as_dvec3();
        for parity in [0, 1] {
            let volume =
                |[a, b, c, d]: [u32; 4]| (at(b) - at(a)).cross(at(c) - at(a)).dot(at(d) - at(a)).abs() / 6.0;
            let sum: f64 = five_of_a_cell(parity).into_iter().map(volume).sum();
            assert!((sum - 1.0).abs() < 1e-12);
        }
        let d = UVec3::new(4, 3, 5);
        let voxels: Vec<u8> = (0..60).collect();
        let volume = Volume::new(d, voxels, Rescale::IDENTITY, Geometry::from_spacing(DVec3::ONE)).unwrap();
        let mesh = TetrahedralMesh::from_volume(&volume).unwrap();
        assert_eq!(mesh.cells().len(), 3 * 2 * 4 * 5);
        // Every face is in two tetrahedra, or in one on the border.
        let mut faces = std::collections::HashMap::new();
        for cell in mesh.cells() {
            for left_out in 0..4 {
                let mut face: Vec<u32> = (0..4).filter(|k| *k != left_out).map(|k| cell[k]).collect();
                face.sort_unstable();
                *faces.entry(face).or_insert(0) += 1;
            }
        }
        let border = faces.values().filter(|n| **n == 1).count();
        assert!(faces.values().all(|n| *n <= 2));
        assert_eq!(border, 2 * 2 * (3 * 2 + 3 * 4 + 2 * 4));
    }
}
