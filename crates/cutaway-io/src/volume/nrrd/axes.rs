//! The axes of a NRRD file: which three are space, where they lie in the world, and what the others are.

use cutaway_core::space::{WorldFrame, ras_from_lps};
use cutaway_core::volume::Geometry;
use glam::{DAffine3, DMat3, DVec3};

use crate::volume::Context;
use crate::volume::error::{ReadError, TUPLE_HINT, quoted};
use crate::volume::fields::{Field, Fields};
use crate::volume::layout::{Between, Shape};

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
    let (first, last) = (spatial[0], spatial[spatial.len() - 1]);
    if axes.iter().zip(sizes).any(|(axis, &size)| *axis == Axis::Tuple && size > 1)
        && ctx.options.volume_index.is_none()
        && let Some(field) = fields.get("kinds")
    {
        return Err(fields.wrong_with(field, "one number a voxel", TUPLE_HINT));
    }
    let product = |sizes: &[u64]| sizes.iter().try_fold(1u64, |n, &size| n.checked_mul(size));
    let (components, volumes) = (product(&sizes[..first]), product(&sizes[last + 1..]));
    let (Some(components), Some(volumes)) = (components, volumes) else {
        let field = fields.get("sizes").expect("sizes were read from there");
        return Err(fields.wrong(field, "fewer than 2^64 samples"));
    };
    let mut dims = [1; 3];
    for (dim, axis) in dims.iter_mut().zip(&spatial) {
        *dim = sizes[*axis];
    }
    let mut between = Vec::new();
    if last - first + 1 > spatial.len() {
        let axis = |axis: usize| Between { size: sizes[axis], space: spatial.contains(&axis) };
        between.extend((first..=last).map(axis));
    }
    let geometry = geometry(ctx, fields, world, &axes, sizes, &spatial)?;
    Ok((Shape { dims, components, volumes, between }, geometry))
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

/// The spatial axes, one to three of them, in order.
fn spatial_axes(fields: &Fields, axes: &[Axis]) -> Result<Vec<usize>, ReadError> {
    let spatial: Vec<usize> = (0..axes.len()).filter(|axis| matches!(axes[*axis], Axis::Space(_))).collect();
    let field = fields.first(&["space directions", "kinds", "sizes"]).expect("sizes were read from there");
    match spatial.len() {
        1..=3 => Ok(spatial),
        0 => Err(fields.wrong(field, "at least one spatial axis")),
        _ => Err(fields.wrong(field, "at most three spatial axes")),
    }
}

/// `(1,0,0) none (0, 1, 0)`: the spatial parts of vectors, none where there is no direction in space.
fn vectors(fields: &Fields, field: &Field, dimension: usize) -> Result<Vec<Option<DVec3>>, ReadError> {
    let wrong =
        || fields.wrong(field, format!("vectors like ({}) or `none`", vec!["1"; dimension].join(",")));
    let mut rest = field.value.trim_start();
    let mut list = Vec::new();
    while !rest.is_empty() {
        if rest.get(..4).is_some_and(|word| word.eq_ignore_ascii_case("none")) {
            list.push(None);
            rest = rest[4..].trim_start();
            continue;
        }
        let (inside, after) =
            rest.strip_prefix('(').and_then(|rest| rest.split_once(')')).ok_or_else(wrong)?;
        let words = inside.split([',', ' ', '\t']).filter(|word| !word.is_empty());
        let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
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

/// The grid of the axes `spatial`, in millimetres.
fn geometry(
    ctx: &mut Context<'_>,
    fields: &Fields,
    world: Option<World>,
    axes: &[Axis],
    sizes: &[u64],
    spatial: &[usize],
) -> Result<Geometry, ReadError> {
    let steps = spatial.iter().map(|axis| if let Axis::Space(step) = axes[*axis] { step } else { None });
    let known: Option<Vec<DVec3>> = steps.collect();
    let Some(steps) = known else { return spaced(ctx, fields, spatial, sizes) };
    let world = world.expect("directions are read only with a space");
    if let Some(field) = fields.get("space directions") {
        check_steps(fields, field, &steps)?;
    }
    let origin = origin(ctx, fields, world.dimension)?;
    let in_mm = units(ctx, fields, "space units", &[0, 1, 2]);
    // The steps that a flat image gets out of its plane have the length of one unit.
    let affine = DAffine3::from_scale(in_mm) * DAffine3::from_mat3_translation(completed(&steps), origin);
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

fn origin(ctx: &mut Context<'_>, fields: &Fields, dimension: usize) -> Result<DVec3, ReadError> {
    let Some(field) = fields.get("space origin") else { return Ok(DVec3::ZERO) };
    match vectors(fields, field, dimension)?[..] {
        [Some(origin)] if origin.is_finite() => Ok(origin),
        // `none` and all-NaN mean that the writer did not know; at time alone means the spatial origin.
        [None] => {
            if field.value.to_ascii_lowercase().contains("nan") {
                ctx.notice("`space origin` is not a number: 0 is used".to_owned());
            }
            Ok(DVec3::ZERO)
        }
        _ => Err(fields.wrong(field, "one finite vector")),
    }
}

/// Axes along the world's, by spacings and axis minima.
fn spaced(
    ctx: &mut Context<'_>,
    fields: &Fields,
    spatial: &[usize],
    sizes: &[u64],
) -> Result<Geometry, ReadError> {
    let per_axis = |name: &str| match fields.get(name) {
        None => Ok(None),
        Some(field) => {
            let all: Vec<f64> = fields.numbers(field, sizes.len(), "numbers, one an axis")?;
            Ok(Some((field, spatial.iter().map(|axis| all[*axis]).collect())))
        }
    };
    let (spacings, mins, maxs) = (per_axis("spacings")?, per_axis("axis mins")?, per_axis("axis maxs")?);
    let node = node_centred(fields, sizes.len())?;
    let in_mm = units(ctx, fields, "units", spatial);
    let finite = |list: &Option<(&Field, Vec<f64>)>, i: usize| {
        list.as_ref().map(|(_, all)| all[i]).filter(|value| value.is_finite())
    };
    let (mut spacing, mut origin) = (DVec3::ONE, DVec3::ZERO);
    for (i, &axis) in spatial.iter().enumerate() {
        let intervals = sizes[axis] as f64 - if node[axis] { 1.0 } else { 0.0 };
        let (min, max) = (finite(&mins, i), finite(&maxs, i));
        let from_range = min.zip(max).filter(|_| intervals > 0.0).map(|(min, max)| (max - min) / intervals);
        spacing[i] = finite(&spacings, i).or(from_range).unwrap_or(1.0);
        // The format writes NaN where a number is not known.
        for (list, used) in [(&spacings, spacing[i]), (&mins, min.unwrap_or(0.0))] {
            if let Some((field, all)) = list
                && !all[i].is_finite()
            {
                ctx.notice(format!("`{}` of axis {axis} is {}: {used} is used", field.name, all[i]));
            }
        }
        if spacing[i] == 0.0 || !spacing[i].is_finite() {
            let field = fields.first(&["spacings", "axis mins"]).expect("a spacing of 1 is neither");
            return Err(fields.wrong(field, "distances between samples that are not 0"));
        }
        // Samples of cell-centred axes lie in the middle of their cells.
        let half = if node[axis] { 0.0 } else { 0.5 * spacing[i] };
        origin[i] = min.map_or(0.0, |min| min + half);
    }
    let (spacing, origin) = (spacing * in_mm, origin * in_mm);
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

/// Millimetres of the units that a field gives the axes, 1 where it says nothing of an axis. Units that are not of length
/// are said in a notice.
fn units(ctx: &mut Context<'_>, fields: &Fields, name: &str, axes: &[usize]) -> DVec3 {
    let mut in_mm = DVec3::ONE;
    let Some(field) = fields.get(name) else { return in_mm };
    // Units stand in quotes; some writers leave them out.
    let quotes = field.value.contains('"');
    let units: Vec<&str> = match quotes {
        true => field.value.split('"').skip(1).step_by(2).collect(),
        false => field.value.split_whitespace().collect(),
    };
    for (i, &axis) in axes.iter().enumerate() {
        let unit = units.get(axis).map_or("", |unit| unit.trim());
        match millimetres(unit) {
            Some(factor) => in_mm[i] = factor,
            None => ctx.notice(format!("`{name}` has {}: lengths are used as they are", quoted(unit))),
        }
    }
    in_mm
}

/// The millimetres of a unit of length; none of anything else.
fn millimetres(unit: &str) -> Option<f64> {
    let long = unit.to_lowercase();
    let long = long.strip_suffix('s').unwrap_or(&long).replace("metre", "meter");
    Some(match (unit, long.as_str()) {
        ("" | "mm" | "MM" | "???", _) | (_, "millimeter") => 1.0,
        ("um" | "\u{b5}m" | "\u{3bc}m" | "UM", _) | (_, "micron" | "micrometer") => 1e-3,
        ("nm" | "NM", _) | (_, "nanometer") => 1e-6,
        ("pm", _) | (_, "picometer") => 1e-9,
        ("A" | "\u{c5}" | "\u{212b}", _) | (_, "angstrom") => 1e-7,
        ("cm" | "CM", _) | (_, "centimeter") => 10.0,
        ("dm", _) | (_, "decimeter") => 100.0,
        ("m" | "M", _) | (_, "meter") => 1e3,
        ("km" | "KM", _) | (_, "kilometer") => 1e6,
        ("in", _) | (_, "inch" | "inche") => 25.4,
        ("ft", _) | (_, "foot" | "feet") => 304.8,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_length_are_known_in_several_spellings() {
        for (unit, expected) in [
            ("um", 1e-3),
            ("\u{b5}m", 1e-3),
            ("microns", 1e-3),
            ("Micrometres", 1e-3),
            ("nm", 1e-6),
            ("cm", 10.0),
            ("m", 1e3),
            ("meters", 1e3),
            ("inches", 25.4),
            ("", 1.0),
        ] {
            assert_eq!(millimetres(unit), Some(expected), "{unit}");
        }
        assert_eq!(millimetres("pixel"), None);
        assert_eq!(millimetres("s"), None);
    }
}
