//! Shapes and poses as text.

use std::ffi::OsStr;

use cutaway_core::clip::{AxisBox, Node, Plane, Pose, ShapeError, Sphere};
use cutaway_core::glam::{DAffine3, DQuat, DVec3};
use cutaway_io::scene_file::{ClipSource, ClipTree};

use crate::values::{List, shown, tip};

/// Shapes with their numbers, as help and errors show them.
const SHAPES: [(&str, &str); 3] =
    [("sphere", "X,Y,Z,R"), ("box", "X0,X1,Y0,Y1,Z0,Z1"), ("plane", "NX,NY,NZ,D")];

/// The shape's name and its numbers, if an operand begins like one.
fn split(operand: &OsStr) -> Option<(&str, &str)> {
    operand.to_str()?.split_once(':').filter(|(name, _)| SHAPES.iter().any(|(shape, _)| shape == name))
}

/// Whether an operand is a shape rather than a file.
pub(super) fn is_shape(operand: &OsStr) -> bool {
    split(operand).is_some()
}

/// What to say of a file that is not there: the shape that was meant, or the shapes that there are.
pub(super) fn meant(operand: &str) -> String {
    let names = SHAPES.map(|(name, _)| name);
    let shapes =
        || format!("; shapes are {}", SHAPES.map(|(name, takes)| format!("{name}:{takes}")).join(", "));
    match operand.split_once(':') {
        // A letter before a colon is a drive.
        Some((name, numbers)) if name.len() > 1 && !name.contains(['/', '\\']) => {
            let tip = if numbers.parse::<List>().is_ok() { tip(name, &names) } else { String::new() };
            if tip.is_empty() { shapes() } else { tip }
        }
        None if names.contains(&operand) => shapes(),
        _ => String::new(),
    }
}

/// The shape that an operand names; none where it is a file.
pub(super) fn parse(operand: &OsStr) -> Option<Result<ClipTree, String>> {
    let (name, numbers) = split(operand)?;
    Some(numbers.parse::<List>().and_then(|list| of_numbers(name, &list)))
}

/// A shape from its numbers.
pub(super) fn of_numbers(name: &str, List(numbers): &List) -> Result<ClipTree, String> {
    let shape = |source: Result<ClipSource, ShapeError>| {
        source.map(|source| Node::Leaf(source).into()).map_err(|e| format!("{name}: {e}"))
    };
    match (name, &numbers[..]) {
        ("sphere", &[x, y, z, r]) => shape(Sphere::new(DVec3::new(x, y, z), r).map(ClipSource::Sphere)),
        ("box", &[x0, x1, y0, y1, z0, z1]) => {
            let (min, max) = (DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1));
            shape(AxisBox::new(min, max).map(ClipSource::Box))
        }
        ("plane", &[x, y, z, d]) => shape(Plane::new(DVec3::new(x, y, z), d).map(ClipSource::Plane)),
        _ => {
            let takes = SHAPES.iter().find(|(shape, _)| *shape == name).map_or("", |(_, takes)| takes);
            let (n, found) = (takes.split(',').count(), numbers.len());
            Err(format!("{name} takes {n} numbers, {takes}; found {found}"))
        }
    }
}

/// What a pose does: steps as they are written, the last done first. `fit` gives the transform of that step for an object
/// to which the steps behind it have been done.
pub(super) fn pose(
    text: &str,
    fit: &mut dyn FnMut(&DAffine3) -> anyhow::Result<DAffine3>,
) -> anyhow::Result<Result<Pose, String>> {
    let steps: Vec<&str> = text.split(';').map(str::trim).filter(|step| !step.is_empty()).collect();
    if steps.is_empty() {
        return Ok(Err(
            "says nothing; expected steps such as `translate 1,2,3; scale 2`, or `fit`".to_owned()
        ));
    }
    let mut whole = DAffine3::IDENTITY;
    for step in steps.into_iter().rev() {
        let step = if step == "fit" {
            fit(&whole)?
        } else {
            match pose_step(step) {
                Ok(step) => step,
                Err(error) => return Ok(Err(error)),
            }
        };
        whole = step * whole;
    }
    Ok(Pose::new(whole).map_err(|e| e.to_string()))
}

fn pose_step(step: &str) -> Result<DAffine3, String> {
    let (name, numbers) = step.split_once(char::is_whitespace).unwrap_or((step, ""));
    const NAMES: [&str; 4] = ["translate", "rotate", "scale", "fit"];
    if !NAMES.contains(&name) {
        return Err(format!(
            "there is no step `{name}`; choose from {}{}",
            NAMES.join(", "),
            tip(name, &NAMES)
        ));
    }
    let List(numbers) = numbers.parse().map_err(|e: String| format!("{name}: {e}"))?;
    match (name, &numbers[..]) {
        ("translate", &[x, y, z]) => Ok(DAffine3::from_translation(DVec3::new(x, y, z))),
        ("rotate", &[x, y, z, degrees]) => match DVec3::new(x, y, z).try_normalize() {
            Some(axis) => Ok(DAffine3::from_quat(DQuat::from_axis_angle(axis, degrees.to_radians()))),
            None => Err("rotate: the axis is 0,0,0; expected a direction".to_owned()),
        },
        ("scale", &[s]) => scale(DVec3::splat(s)),
        ("scale", &[x, y, z]) => scale(DVec3::new(x, y, z)),
        _ => {
            let takes = match name {
                "translate" => "X,Y,Z",
                "rotate" => "AX,AY,AZ,DEG",
                "scale" => "S or SX,SY,SZ",
                _ => "no numbers",
            };
            Err(format!("{name} takes {takes}; found {} numbers", numbers.len()))
        }
    }
}

fn scale(factors: DVec3) -> Result<DAffine3, String> {
    match factors.to_array().into_iter().find(|f| *f == 0.0) {
        Some(f) => Err(format!("scale is {}; expected a factor other than 0", shown(f))),
        None => Ok(DAffine3::from_scale(factors)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cutaway_io::scene_file::ClipFile;

    fn parsed(text: &str) -> Option<Result<ClipTree, String>> {
        parse(OsStr::new(text))
    }

    #[test]
    fn operands_are_shapes_or_files() {
        let json = |text: &str| serde_json::to_value(ClipFile(parsed(text).unwrap().unwrap())).unwrap();
        assert_eq!(json("box:0,1,-2,3,4,5")["box"]["min"], serde_json::json!([0.0, -2.0, 4.0]));
        assert_eq!(json("plane:0,0,2,6")["plane"]["distance"], 6.0);
        for file in ["bunny.ply", "sphere", "C:\\bunny.ply", "shpere:1,2,3,4"] {
            assert_eq!(parsed(file), None, "{file}");
        }
        for (wrong, says) in [
            ("sphere:1,2,3", "takes 4 numbers, X,Y,Z,R; found 3"),
            ("sphere:1,2,3,-4", "radius is -4"),
            ("box:1,0,0,1,0,1", "max is"),
            ("plane:0,0,0,1", "normal is"),
            ("plane:0,0,x,1", "`x` is not a number"),
        ] {
            let error = parsed(wrong).unwrap().unwrap_err();
            assert!(error.contains(says), "{wrong}: {error}");
        }
        assert!(meant("shpere:1,2,3,4").contains("`sphere`") && meant("C:\\x").is_empty());
        // report_b6: the shapes that there are, where no name is like it.
        for operand in ["blob:1", "blob:1,2", "ball:a", "box"] {
            assert!(meant(operand).contains("sphere:X,Y,Z,R, box:X0,X1"), "{operand}: {}", meant(operand));
        }
        assert!(meant("bunny.ply").is_empty());
    }

    fn posed(text: &str) -> Result<Pose, String> {
        pose(text, &mut |_: &DAffine3| Ok(DAffine3::from_scale(DVec3::splat(10.0)))).unwrap()
    }

    #[test]
    fn the_last_step_of_a_pose_is_done_first() {
        let pose = posed("translate 1,0,0; rotate 0,0,2,90; scale 3").unwrap();
        let p = pose.world_from_object().transform_point3(DVec3::new(1.0, 0.0, 0.0));
        assert!((p - DVec3::new(1.0, 3.0, 0.0)).length() < 1e-12, "{p}");
        let fitted = posed("translate 0,0,5; fit;").unwrap();
        let p = fitted.world_from_object().transform_point3(DVec3::ONE);
        assert_eq!(p, DVec3::new(10.0, 10.0, 15.0));
    }

    #[test]
    fn wrong_steps_are_refused() {
        for (wrong, says) in [
            ("", "says nothing"),
            (";", "says nothing"),
            ("translte 1,2,3", "did you mean `translate`?"),
            ("translate 1,2", "translate takes X,Y,Z; found 2"),
            ("translate", "translate: `` is not a number"),
            ("rotate 0,0,0,5", "axis"),
            ("scale 0", "scale is 0"),
            ("scale 1e-200", "pose"),
            ("fit 3", "fit takes no numbers"),
        ] {
            let error = posed(wrong).unwrap_err();
            assert!(error.contains(says), "{wrong}: {error}");
        }
    }
}
