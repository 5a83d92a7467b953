//! VTK legacy files: lines of text that name arrays, which follow as text or big-endian bytes.

mod words;

use cutaway_core::glam::DVec3;

use self::words::Reader;
use super::TetrahedraReadOptions;
use super::cells::{Cells, Tetrahedra};
use super::error::TetrahedraReadError as Error;
use super::grid::{ArrayInfo, On, Parsed, Role, Values, Wanted};
use super::numbers::Kind;
use crate::volume::error::quoted;

pub(super) fn read(
    file: &str,
    bytes: &[u8],
    options: &TetrahedraReadOptions,
    wanted: &Wanted,
) -> Result<Parsed, Error> {
    if let Some(index) = options.time_step.filter(|step| *step > 0) {
        return Err(Error::TimeStep { file: file.to_owned(), index, steps: 1 });
    }
    let mut r = Reader::new(file, bytes, options.limits.max_bytes);
    // The version and a title that may be anything.
    r.line();
    r.line();
    r.binary = match r.word("`ASCII` or `BINARY`")?.to_ascii_uppercase().as_str() {
        "ASCII" => false,
        "BINARY" => true,
        other => return Err(r.syntax(quoted(other), "`ASCII` or `BINARY`")),
    };
    let mut sections = Sections::new(wanted);
    while let Some(keyword) = r.next_word() {
        sections.read(&mut r, keyword)?;
    }
    sections.finish(&r)
}

/// What the sections read so far have given.
struct Sections<'w> {
    wanted: &'w Wanted,
    parsed: Parsed,
    points: Option<Vec<DVec3>>,
    cells: Option<Cells>,
    kinds: Option<Vec<i64>>,
    /// Of what the next arrays are data, and how many of those there are; none: of the grid as a whole.
    on: Option<(On, u64)>,
    /// How much the values that are kept are wanted.
    rank: u8,
    /// The cells that [`Tetrahedra::hides`] is about.
    ghosts: Vec<f64>,
}

impl<'w> Sections<'w> {
    fn new(wanted: &'w Wanted) -> Self {
        let parsed = Parsed::default();
        let (points, cells, kinds, on) = (None, None, None, None);
        Self { wanted, parsed, points, cells, kinds, on, rank: u8::MAX, ghosts: Vec::new() }
    }

    fn read(&mut self, r: &mut Reader<'_>, keyword: &str) -> Result<(), Error> {
        let count = self.on.map_or(0, |(_, count)| count);
        match keyword.to_ascii_uppercase().as_str() {
            "DATASET" => check_kind(r)?,
            "POINTS" => {
                let n = r.count("points")?;
                let numbers = r.array::<f64>(n, 3, "points")?;
                let points = numbers.as_chunks::<3>().0;
                self.points = Some(points.iter().map(|p| DVec3::from_array(*p)).collect());
            }
            "CELLS" => self.cells = Some(cells(r)?),
            "CELL_TYPES" => {
                let n = r.count("cell types")?;
                self.kinds = Some(r.numbers::<i64>(Kind::I32, n, "cell types")?);
            }
            "POINT_DATA" => self.on = Some((On::Points, r.count("point data")?)),
            "CELL_DATA" => self.on = Some((On::Cells, r.count("cell data")?)),
            "SCALARS" => {
                let name = r.name("the name of scalars")?;
                let kind = r.kind()?;
                let components = r.components_and_table()?;
                self.array(r, Array { name, kind, count, components, role: Role::Active })?;
            }
            "FIELD" => self.field(r)?,
            attribute @ ("VECTORS" | "NORMALS" | "TENSORS" | "TENSORS6" | "GLOBAL_IDS" | "PEDIGREE_IDS"
            | "EDGE_FLAGS") => {
                let components = match attribute {
                    "VECTORS" | "NORMALS" => 3,
                    "TENSORS" => 9,
                    "TENSORS6" => 6,
                    _ => 1,
                };
                let name = r.name("the name of an array")?;
                let kind = r.word("a type of numbers")?;
                if is_text(kind) {
                    return self.strings(r, name, count);
                }
                let kind = r.named(kind)?;
                // One component: numbers and flags of points and cells.
                let role = if components == 1 { Role::Bookkeeping } else { Role::Plain };
                self.array(r, Array { name, kind, count, components, role })?;
            }
            "TEXTURE_COORDINATES" => {
                let name = r.name("the name of an array")?;
                let components = r.count("components")?;
                let kind = r.kind()?;
                self.array(r, Array { name, kind, count, components, role: Role::Plain })?;
            }
            "COLOR_SCALARS" => {
                let name = r.name("the name of an array")?;
                let components = r.count("components")?;
                let kind = if r.binary { Kind::U8 } else { Kind::F32 };
                self.array(r, Array { name, kind, count, components, role: Role::Plain })?;
            }
            "LOOKUP_TABLE" => {
                r.word("the name of a table")?;
                let n = r.count("colours")?;
                let kind = if r.binary { Kind::U8 } else { Kind::F32 };
                r.numbers_of::<f64>(kind, n, 4, "colours")?;
            }
            "METADATA" => r.skip_metadata(),
            _ => return Err(r.syntax(quoted(keyword), "a section of an unstructured grid")),
        }
        Ok(())
    }

    /// Arrays of any length, each perhaps with METADATA behind it.
    fn field(&mut self, r: &mut Reader<'_>) -> Result<(), Error> {
        r.word("the name of a field")?;
        for _ in 0..r.count("arrays of a field")? {
            let name = r.name("the name of an array")?;
            if name == "NULL_ARRAY" {
                continue;
            }
            let (components, count) = (r.count("components")?, r.count("tuples")?);
            let kind = r.word("a type of numbers")?;
            if is_text(kind) {
                self.strings(r, name, count.saturating_mul(components))?;
            } else {
                let kind = r.named(kind)?;
                self.array(r, Array { name, kind, count, components, role: Role::Plain })?;
            }
            if r.takes("METADATA") {
                r.skip_metadata();
            }
        }
        Ok(())
    }

    fn strings(&mut self, r: &mut Reader<'_>, name: String, count: u64) -> Result<(), Error> {
        if let Some((on, _)) = self.on {
            self.parsed.remember(ArrayInfo { name, on, components: 0 });
        }
        r.skip_strings(count)
    }

    /// Reads an array and keeps what is wanted of it.
    fn array(&mut self, r: &mut Reader<'_>, array: Array) -> Result<(), Error> {
        let Array { name, kind, count, components, role } = array;
        let Some((on, expected)) = self.on else {
            let numbers = r.numbers_of::<f64>(kind, count, components, "an array")?;
            if name == "TimeValue" {
                self.parsed.time = numbers.first().copied().filter(|time| time.is_finite());
            }
            return Ok(());
        };
        let numbers = r.numbers_of::<f64>(kind, count, components, "an array")?;
        let info = ArrayInfo { name, on, components };
        if count == expected {
            let rank = self.wanted.rank(&info, role);
            if on == On::Cells && components == 1 && info.name == super::GHOSTS {
                self.ghosts.clone_from(&numbers);
            }
            if rank.is_some_and(|rank| rank < self.rank) {
                self.rank = rank.unwrap_or(u8::MAX);
                self.parsed.values = Some(Values { name: info.name.clone(), on, numbers });
            }
        }
        self.parsed.remember(info);
        Ok(())
    }

    fn finish(self, r: &Reader<'_>) -> Result<Parsed, Error> {
        let missing = |section: &str| r.syntax("the end of the file", format!("a section `{section}`"));
        let mut parsed = self.parsed;
        parsed.points = self.points.ok_or_else(|| missing("POINTS"))?;
        if parsed.points.is_empty() && self.cells.is_none() {
            // As VTK writes a grid with nothing in it.
            return Ok(parsed);
        }
        let cells = self.cells.ok_or_else(|| missing("CELLS"))?;
        let kinds = self.kinds.ok_or_else(|| missing("CELL_TYPES"))?;
        let hidden = |cell: usize| self.ghosts.get(cell).is_some_and(|flags| Tetrahedra::hides(*flags));
        parsed.cells.add_all(r.file, &cells, &kinds, parsed.points.len(), hidden)?;
        parsed.check_values(r.file, kinds.len())?;
        Ok(parsed)
    }
}

/// An array by what its section says.
struct Array {
    name: String,
    kind: Kind,
    /// Tuples.
    count: u64,
    components: u64,
    role: Role,
}

fn is_text(kind: &str) -> bool {
    kind.eq_ignore_ascii_case("string") || kind.eq_ignore_ascii_case("utf8_string")
}

fn check_kind(r: &mut Reader<'_>) -> Result<(), Error> {
    let kind = r.word("a kind of data set")?;
    if kind.eq_ignore_ascii_case("UNSTRUCTURED_GRID") {
        return Ok(());
    }
    let found = format!("the data set is of kind {}", quoted(kind));
    Err(Error::Unsupported { file: r.file.to_owned(), found, supported: "unstructured grids" })
}

/// Since version 5.1 offsets and names of points; before, each cell's points after their number.
fn cells(r: &mut Reader<'_>) -> Result<Cells, Error> {
    let (cells, numbers) = (r.count("cells")?, r.count("numbers of points")?);
    r.check_memory("its cells", Tetrahedra::most_bytes(numbers))?;
    if r.takes("OFFSETS") {
        let offsets = r.array(cells, 1, "offsets of cells")?;
        let word = r.word("`CONNECTIVITY`")?;
        if !word.eq_ignore_ascii_case("CONNECTIVITY") {
            return Err(r.syntax(quoted(word), "`CONNECTIVITY`"));
        }
        return Ok(Cells { offsets, points: r.array(numbers, 1, "points of cells")? });
    }
    let all: Vec<i64> = r.numbers(Kind::I32, numbers, "points of cells")?;
    let (mut offsets, mut points) = (vec![0], Vec::with_capacity(all.len()));
    let mut rest = &all[..];
    while let Some((count, names)) = rest.split_first() {
        let own = usize::try_from(*count).ok().and_then(|count| names.split_at_checked(count));
        let Some((own, after)) = own else {
            let found = format!("a cell of {count} points with {} numbers left", names.len());
            return Err(r.syntax(found, "each cell's points after their number"));
        };
        points.extend_from_slice(own);
        offsets.push(points.len() as i64);
        rest = after;
    }
    Ok(Cells { offsets, points })
}
