//! The axes of a NRRD file: which three are space, where they lie in the world, and what the others are.

use std::ops::Range;

use cutaway_core::space::{WorldFrame, ras_from_lps};
use cutaway_core::volume::Geometry;
use glam::{DAffine3, DMat3, DVec3};

use crate::volume::Context;
use crate::volume::error::{ReadError, TUPLE_HINT, quoted};
use crate::volume::fields::{Field, Fields};
use crate::volume::layout::Shape;

/// Kinds of an axis that make its samples one thing (a colour, a vector), not several volumes.
const TUPLES: [&str; 25] = [
    "complex",
    "2-vector",
    "3-color",
    "rgb-color",
    "hsv-color",
    "xyz-color",
    "4-color",
    "rgba-color",
    "3-vector",
    "3-gradient",
    "3-normal",
    "4-vector",
    "quaternion",
    "2d-symmetric-matrix",
    "2d-masked-symmetric-matrix",
    "2d-matrix",
    "2d-masked-matrix",
    "3d-symmetric-matrix",
    "3d-masked-symmetric-matrix",
    "3d-matrix",
    "3d-masked-matrix",
    "vector",
    "covariant-vector",
    "normal",
    "point",
];

/// Kinds of an axis along which separate volumes lie.
const LISTS: [&str; 4] = ["time", "list", "stub", "scalar"];

/// The space that a file lives in.
struct World {
    /// Coordinates of a vector, one of time included.
    dimension: usize,
    to_ras: Option<DAffine3>,
}

/// What lies along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Axis {
    /// Space; the step to the next sample, where the file gives it as a vector.
    Space(Option<DVec3>),
    /// Separate volumes.
    List,
    /// Parts of one sample.
    Tuple,
}

/// What the file holds and where its grid lies.
pub(super) fn read(
    ctx: &mut Context<'_>,
    fields: &Fields,
    sizes: &[u64],
) -> Result<(Shape, Geometry), ReadError> {
    let world = world(fields)?;
    let axes = classify(fields, sizes, world.as_ref())?;
    let spatial = spatial_axes(fields, &axes)?;
    if axes.iter().zip(sizes).any(|(axis, &size)| *axis == Axis::Tuple && size > 1)
        && ctx.options.volume_index.is_none()
        && let Some(field) = fields.get("kinds")
    {
        return Err(fields.wrong_with(field, "one number a voxel", TUPLE_HINT));
    }
    let product = |sizes: &[u64]| sizes.iter().try_fold(1u64, |n, &size| n.checked_mul(size));
    let (components, volumes) = (product(&sizes[..spatial.start]), product(&sizes[spatial.end..]));
    let (Some(components), Some(volumes)) = (components, volumes) else {
        let field = fields.get("sizes").expect("sizes were read from there");
        return Err(fields.wrong(field, "fewer than 2^64 samples"));
    };
    let mut dims = [1; 3];
    dims[..spatial.len()].copy_from_slice(&sizes[spatial.clone()]);
    units(ctx, fields);
    let geometry = geometry(fields, world, &axes[spatial.clone()], sizes, spatial)?;
    Ok((Shape { dims, components, volumes }, geometry))
}

fn world(fields: &Fields) -> Result<Option<World>, ReadError> {
    if let Some(field) = fields.get("space") {
        let lower = field.value.to_ascii_lowercase();
        let name = lower
            .strip_suffix("-time")
            .or_else(|| matches!(lower.as_str(), "rast" | "last" | "lpst").then(|| &lower[..3]));
        let (name, dimension) = name.map_or((lower.as_str(), 3), |name| (name, 4));
        let left = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let to_ras = match name {
            "right-anterior-superior" | "ras" => Some(DAffine3::IDENTITY),
            "left-anterior-superior" | "las" => Some(left),
            "left-posterior-superior" | "lps" => Some(ras_from_lps()),
            "scanner-xyz" | "3d-right-handed" | "3d-left-handed" => None,
            _ => {
                let expected = "right-anterior-superior (RAS), left-anterior-superior (LAS), left-posterior-superior (LPS), scanner-xyz, 3D-right-handed or 3D-left-handed, or one of them with -time";
                return Err(fields.wrong(field, expected));
            }
        };
        return Ok(Some(World { dimension, to_ras }));
    }
    let Some(field) = fields.get("space dimension") else { return Ok(None) };
    let dimension: usize = fields.number(field, "1 to 4")?;
    if !(1..=4).contains(&dimension) {
        return Err(fields.wrong(field, "1 to 4"));
    }
    Ok(Some(World { dimension, to_ras: None }))
}

fn classify(fields: &Fields, sizes: &[u64], world: Option<&World>) -> Result<Vec<Axis>, ReadError> {
    let kinds = kinds(fields, sizes.len())?;
    if let Some(field) = fields.get("space directions") {
        let Some(world) = world else {
            return Err(fields.wrong(field, "a field `space` or `space dimension` beside it"));
        };
        let directions = vectors(fields, field, world.dimension)?;
        if directions.len() != sizes.len() {
            return Err(fields.wrong(field, format!("{} vectors or `none`, one an axis", sizes.len())));
        }
        let axis = |(direction, kind): (Option<DVec3>, Axis)| match (direction, kind) {
            (Some(step), _) => Axis::Space(Some(step)),
            (None, Axis::Space(_)) => Axis::List,
            (None, other) => other,
        };
        return Ok(directions.into_iter().zip(kinds).map(axis).collect());
    }
    let mut space = 0;
    let axes = kinds.into_iter().map(|kind| match kind {
        Axis::Space(_) if space == 3 => Axis::List,
        Axis::Space(_) => {
            space += 1;
            kind
        }
        other => other,
    });
    Ok(axes.collect())
}

fn kinds(fields: &Fields, count: usize) -> Result<Vec<Axis>, ReadError> {
    let Some(field) = fields.get("kinds") else { return Ok(vec![Axis::Space(None); count]) };
    let kinds: Vec<Axis> = field
        .value
        .split_whitespace()
        .map(|word| {
            let word = word.to_ascii_lowercase();
            match word.as_str() {
                word if TUPLES.contains(&word) => Axis::Tuple,
                word if LISTS.contains(&word) => Axis::List,
                _ => Axis::Space(None),
            }
        })
        .collect();
    if kinds.len() != count {
        return Err(fields.wrong(field, format!("{count} kinds, one an axis")));
    }
    Ok(kinds)
}

/// The spatial axes, which must lie side by side.
fn spatial_axes(fields: &Fields, axes: &[Axis]) -> Result<Range<usize>, ReadError> {
    let is_space = |axis: &Axis| matches!(axis, Axis::Space(_));
    let first = axes.iter().position(is_space);
    let count = axes.iter().filter(|axis| is_space(axis)).count();
    let field = fields.first(&["space directions", "kinds", "sizes"]).expect("sizes were read from there");
    match first {
        Some(first) if count <= 3 && axes[first..first + count].iter().all(is_space) => {
            Ok(first..first + count)
        }
        Some(_) if count > 3 => Err(fields.wrong(field, "at most three spatial axes")),
        Some(_) => Err(fields.wrong_with(
            field,
            "spatial axes side by side",
            "permute the axes so that the others come first or last",
        )),
        None => Err(fields.wrong(field, "at least one spatial axis")),
    }
}

/// `(1,0,0) none (0, 1, 0)`: the spatial parts of vectors, none where there is no direction in space.
fn vectors(fields: &Fields, field: &Field, dimension: usize) -> Result<Vec<Option<DVec3>>, ReadError> {
    let wrong =
        || fields.wrong(field, format!("vectors like ({}) or `none`", vec!["1"; dimension].join(",")));
    let mut rest = field.value.trim_start();
    let mut list = Vec::new();
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            list.push(None);
            rest = after.trim_start();
            continue;
        }
        let (inside, after) =
            rest.strip_prefix('(').and_then(|rest| rest.split_once(')')).ok_or_else(wrong)?;
        let numbers: Option<Vec<f64>> = inside.split(',').map(|word| word.trim().parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == dimension).ok_or_else(wrong)?;
        let mut spatial = [0.0; 3];
        let n = dimension.min(3);
        spatial[..n].copy_from_slice(&numbers[..n]);
        let spatial = DVec3::from_array(spatial);
        let in_time = dimension == 4 && spatial == DVec3::ZERO;
        let unknown = numbers.iter().all(|number| number.is_nan());
        list.push((!in_time && !unknown).then_some(spatial));
        rest = after.trim_start();
    }
    Ok(list)
}

/// The grid of the axes in the range `spatial`, `axes` being those alone.
fn geometry(
    fields: &Fields,
    world: Option<World>,
    axes: &[Axis],
    sizes: &[u64],
    spatial: Range<usize>,
) -> Result<Geometry, ReadError> {
    let steps = axes.iter().map(|axis| if let Axis::Space(step) = axis { *step } else { None });
    let known: Option<Vec<DVec3>> = steps.collect();
    let Some(steps) = known else { return spaced(fields, spatial, sizes) };
    let world = world.expect("directions are read only with a space");
    if let Some(field) = fields.get("space directions") {
        check_steps(fields, field, &steps)?;
    }
    let origin = origin(fields, world.dimension)?;
    let affine = DAffine3::from_mat3_translation(completed(&steps), origin);
    Ok(match world.to_ras {
        Some(to_ras) => Geometry { world_from_voxel: to_ras * affine, frame: WorldFrame::Ras },
        None => Geometry { world_from_voxel: affine, frame: WorldFrame::Unknown },
    })
}

fn check_steps(fields: &Fields, field: &Field, steps: &[DVec3]) -> Result<(), ReadError> {
    let usable = |step: &DVec3| step.is_finite() && step.length() > 0.0;
    if steps.iter().all(usable) {
        Ok(())
    } else {
        Err(fields.wrong(field, "vectors of finite length, not 0"))
    }
}

/// Three columns from one, two or three: a flat image gets unit steps out of its plane.
fn completed(steps: &[DVec3]) -> DMat3 {
    match *steps {
        [x, y, z, ..] => DMat3::from_cols(x, y, z),
        [x, y] => DMat3::from_cols(x, y, x.cross(y).normalize_or_zero()),
        [x] => {
            let (y, z) = x.normalize().any_orthonormal_pair();
            DMat3::from_cols(x, y, z)
        }
        [] => DMat3::IDENTITY,
    }
}

fn origin(fields: &Fields, dimension: usize) -> Result<DVec3, ReadError> {
    let Some(field) = fields.get("space origin") else { return Ok(DVec3::ZERO) };
    match vectors(fields, field, dimension)?[..] {
        [Some(origin)] if origin.is_finite() => Ok(origin),
        // All-NaN means that the writer did not know; at time alone means the spatial origin.
        [None] => Ok(DVec3::ZERO),
        _ => Err(fields.wrong(field, "one finite vector")),
    }
}

/// Axes along the world's, by spacings and axis minima.
fn spaced(fields: &Fields, spatial: Range<usize>, sizes: &[u64]) -> Result<Geometry, ReadError> {
    let per_axis = |name: &str| match fields.get(name) {
        None => Ok(None),
        Some(field) => {
            let all: Vec<f64> = fields.numbers(field, sizes.len(), "numbers, one an axis")?;
            Ok(Some((field, all[spatial.clone()].to_vec())))
        }
    };
    let (spacings, mins, maxs) = (per_axis("spacings")?, per_axis("axis mins")?, per_axis("axis maxs")?);
    let node = node_centred(fields, sizes.len())?;
    let finite = |list: &Option<(&Field, Vec<f64>)>, i: usize| {
        list.as_ref().map(|(_, all)| all[i]).filter(|value| value.is_finite())
    };
    let (mut spacing, mut origin) = (DVec3::ONE, DVec3::ZERO);
    for (i, axis) in spatial.enumerate() {
        let intervals = sizes[axis] as f64 - if node[axis] { 1.0 } else { 0.0 };
        let (min, max) = (finite(&mins, i), finite(&maxs, i));
        let from_range = min.zip(max).filter(|_| intervals > 0.0).map(|(min, max)| (max - min) / intervals);
        spacing[i] = finite(&spacings, i).or(from_range).unwrap_or(1.0);
        if spacing[i] == 0.0 || !spacing[i].is_finite() {
            let field = fields.first(&["spacings", "axis mins"]).expect("a spacing of 1 is neither");
            return Err(fields.wrong(field, "distances between samples that are not 0"));
        }
        // Samples of cell-centred axes lie in the middle of their cells.
        let half = if node[axis] { 0.0 } else { 0.5 * spacing[i] };
        origin[i] = min.map_or(0.0, |min| min + half);
    }
    let world_from_voxel = DAffine3::from_mat3_translation(DMat3::from_diagonal(spacing), origin);
    Ok(Geometry { world_from_voxel, frame: WorldFrame::Unknown })
}

/// Which axes have their samples on nodes, not in the middle of cells.
fn node_centred(fields: &Fields, count: usize) -> Result<Vec<bool>, ReadError> {
    let Some(field) = fields.get("centers") else { return Ok(vec![false; count]) };
    let node: Vec<bool> =
        field.value.split_whitespace().map(|word| word.eq_ignore_ascii_case("node")).collect();
    if node.len() == count {
        Ok(node)
    } else {
        Err(fields.wrong(field, format!("{count} words, one an axis")))
    }
}

/// Says so where the file's unit of length is another than ours.
fn units(ctx: &mut Context<'_>, fields: &Fields) {
    let Some(field) = fields.get("space units") else { return };
    let other = field.value.split('"').skip(1).step_by(2).find(|unit| !matches!(*unit, "" | "mm"));
    if let Some(unit) = other {
        ctx.notice(format!("space units are {}: lengths are taken as they stand", quoted(unit)));
    }
}
