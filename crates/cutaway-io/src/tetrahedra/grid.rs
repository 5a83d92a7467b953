//! A grid as its file has it: what readers gather, and what becomes of it.

use cutaway_core::glam::DVec3;
use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_core::volume::NanMeaning;

use super::TetrahedraReadOptions;
use super::cells::Tetrahedra;
use super::error::TetrahedraReadError as Error;
use crate::limits::Limits;
use crate::volume::error::quoted;
use crate::volume::{Loaded, Place, loss_notice, nan_notice};

/// The most arrays that are remembered for messages.
const MOST_ARRAYS: usize = 1000;

/// What the values of an array are on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum On {
    /// A value per point; linear in between.
    Points,
    /// A value per cell, the same all over it.
    Cells,
}

impl On {
    /// The word for it: `point` or `cell`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Points => "point",
            Self::Cells => "cell",
        }
    }
}

/// An array of data that a grid's file has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArrayInfo {
    /// What the file calls it.
    pub name: String,
    /// What it is on.
    pub on: On,
    /// Numbers per point or cell; 0: it is text.
    pub components: u64,
}

impl ArrayInfo {
    fn shown(&self) -> String {
        let Self { name, on, components } = self;
        match components {
            0 => format!("{} ({} data of text)", quoted(name), on.name()),
            1 => format!("{} ({} data)", quoted(name), on.name()),
            _ => format!("{} ({} data of {components} components)", quoted(name), on.name()),
        }
    }
}

/// Values of a grid.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Values {
    pub(super) name: String,
    pub(super) on: On,
    pub(super) numbers: Vec<f64>,
}

/// Which array's values are wanted: one of a name, else the one that is most likely meant.
#[derive(Clone, Debug, Default)]
pub(super) struct Wanted {
    name: Option<String>,
}

/// What an array is for, the most wanted first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The active scalars.
    Active,
    Plain,
    /// Numbers and flags of points or cells.
    Bookkeeping,
}

/// Arrays that VTK's filters add to say where points and cells come from.
const BOOKKEEPING: [&str; 6] = [
    "vtkOriginalPointIds",
    "vtkOriginalCellIds",
    "vtkGhostType",
    "vtkGhostLevels",
    "GlobalNodeId",
    "GlobalElementId",
];

impl Wanted {
    pub(super) fn new(name: Option<String>) -> Self {
        Self { name }
    }

    /// How much an array is wanted, the lower the more; none: not at all. Points come before cells, the active scalars
    /// before others, and those before arrays that only keep numbers of points and cells.
    pub(super) fn rank(&self, array: &ArrayInfo, role: Role) -> Option<u8> {
        if array.components != 1 {
            return None;
        }
        let on = if array.on == On::Points { 0 } else { 3 };
        match &self.name {
            Some(name) => (*name == array.name).then_some(on),
            None if BOOKKEEPING.contains(&array.name.as_str()) => Some(on + Role::Bookkeeping as u8),
            None => Some(on + role as u8),
        }
    }

    /// Why none of the arrays will do.
    pub(super) fn missing(&self, file: &str, arrays: &[ArrayInfo]) -> Error {
        let shown: Vec<String> = arrays.iter().take(16).map(ArrayInfo::shown).collect();
        let found = if shown.is_empty() { "no values".to_owned() } else { shown.join(", ") };
        let wanted = match &self.name {
            Some(name) => format!("{} of one component", quoted(name)),
            None => "point or cell data of one component".to_owned(),
        };
        Error::NoValues { file: file.to_owned(), found, wanted }
    }
}

/// What a reader gathers.
#[derive(Debug, Default)]
pub(super) struct Parsed {
    pub(super) points: Vec<DVec3>,
    pub(super) cells: Tetrahedra,
    pub(super) values: Option<Values>,
    pub(super) arrays: Vec<ArrayInfo>,
    pub(super) time: Option<f64>,
    pub(super) notices: Vec<String>,
}

impl Parsed {
    /// Refuses values that are not as many as what they are on.
    pub(super) fn check_values(&self, file: &str, cells: usize) -> Result<(), Error> {
        let Some(values) = &self.values else { return Ok(()) };
        let expected = if values.on == On::Points { self.points.len() } else { cells };
        if values.numbers.len() == expected {
            return Ok(());
        }
        let on = values.on.name();
        let found = format!("{} values of the {on} data {}", values.numbers.len(), quoted(&values.name));
        let expected = format!("{expected}, one per {on}");
        Err(Error::Syntax { file: file.to_owned(), place: Place::Whole, found, expected })
    }

    /// Remembers that there is an array.
    pub(super) fn remember(&mut self, array: ArrayInfo) {
        if self.arrays.len() < MOST_ARRAYS && !self.arrays.contains(&array) {
            self.arrays.push(array);
        }
    }
}

/// An unstructured grid, with values or without, cut into tetrahedra.
#[derive(Debug)]
pub struct Grid {
    file: String,
    parsed: Parsed,
    wanted: Wanted,
    limits: Limits,
    nan: NanMeaning,
}

impl Grid {
    pub(super) fn new(file: String, parsed: Parsed, wanted: Wanted, options: &TetrahedraReadOptions) -> Self {
        Self { file, parsed, wanted, limits: options.limits, nan: options.nan }
    }

    /// Points of the file.
    pub fn points(&self) -> &[DVec3] {
        &self.parsed.points
    }

    /// The tetrahedra that its cells are cut into, by the numbers of their points.
    pub fn tetrahedra(&self) -> &[[u32; 4]] {
        &self.parsed.cells.corners
    }

    /// The arrays of its points and cells, at most a thousand of them.
    pub fn arrays(&self) -> &[ArrayInfo] {
        &self.parsed.arrays
    }

    /// The array whose values it has; none where no array has one number per point or cell.
    pub fn values(&self) -> Option<(&str, On)> {
        self.parsed.values.as_ref().map(|values| (values.name.as_str(), values.on))
    }

    /// The time that the file states.
    pub fn time(&self) -> Option<f64> {
        self.parsed.time
    }

    /// What its user should know, one line each.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = self.parsed.notices.clone();
        notices.extend(self.parsed.cells.notices());
        if let Some(values) = &self.parsed.values {
            if values.on == On::Cells {
                notices.push(format!(
                    "the values are cell data ({}): each tetrahedron has the value of its cell all over",
                    quoted(&values.name)
                ));
            }
            let replaced = values.numbers.iter().filter(|value| value.is_infinite()).count();
            if replaced > 0 {
                notices.push(format!("{replaced} values are infinite and are replaced"));
            }
        }
        notices
    }

    /// The grid as it is rendered, and what its user should know.
    ///
    /// # Errors
    /// As [`Grid::into_mesh`].
    pub fn into_loaded(self) -> Result<Loaded<TetrahedralMesh>, Error> {
        let mut notices = self.notices();
        let numbers = self.parsed.values.iter().flat_map(|values| &values.numbers);
        let (missing, nan) = (numbers.filter(|value| value.is_nan()).count(), self.nan);
        let value = self.into_mesh()?;
        notices.extend((missing > 0).then(|| nan_notice(missing, nan, value.lattice())));
        notices.extend(loss_notice(value.lattice()));
        Ok(Loaded { value, notices })
    }

    /// The grid as it is rendered. Values on cells become values on points that no two tetrahedra share.
    ///
    /// # Errors
    /// No values, no tetrahedra, or numbers that make no grid.
    pub fn into_mesh(self) -> Result<TetrahedralMesh, Error> {
        let Self { file, parsed, wanted, limits, nan } = self;
        let Some(values) = parsed.values else { return Err(wanted.missing(&file, &parsed.arrays)) };
        let Tetrahedra { corners, owners, .. } = parsed.cells;
        let mesh = match values.on {
            On::Points => TetrahedralMesh::with_nan(parsed.points, corners, values.numbers, nan),
            On::Cells => {
                let needed = (corners.len() as u64).saturating_mul(4 * 36 + 16);
                if needed > limits.max_bytes || corners.len() > (u32::MAX / 4) as usize {
                    let (what, limit) = ("its cells with a value each", limits.max_bytes);
                    return Err(Error::TooLarge { file, what, needed, limit });
                }
                let points = corners.iter().flatten().map(|c| parsed.points[*c as usize]).collect();
                let own =
                    (0..corners.len() as u32).map(|k| [4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3]).collect();
                let numbers = owners.iter().flat_map(|cell| [values.numbers[*cell as usize]; 4]).collect();
                TetrahedralMesh::with_nan(points, own, numbers, nan)
            }
        };
        mesh.map_err(|error| Error::Mesh { file, error })
    }
}
