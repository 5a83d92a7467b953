//! What the readers of other programs' files have in common: lists of colours and opacities become one function, and back.

use cutaway_core::lighting::Lighting;
use cutaway_core::transfer_function::{ControlPoint, TransferFunction};

use super::curves::{self, Node, Polyline};
use super::spaces::ColorSpace;
use super::{FunctionReadError, MAX_POINTS};
use crate::volume::error::number;

/// Factors of light beyond this are refused, as in a scene.
const LARGEST_FACTOR: f64 = 1e6;

/// How far a colour or an opacity may be outside 0 to 1: other programs round.
const SLACK: f64 = 1e-4;

/// Colours and opacities of a file.
pub(super) struct Lists {
    /// What the file calls the colours.
    pub(super) colors_name: &'static str,
    pub(super) colors: Vec<Node<3>>,
    pub(super) space: ColorSpace,
    /// What the file calls the opacities.
    pub(super) opacities_name: &'static str,
    /// None at all: they rise from 0 to one half over the colours.
    pub(super) opacities: Option<Vec<Node<1>>>,
}

impl Lists {
    /// The function, and whether any of its curves had to be sampled.
    pub(super) fn joined(self, file: &str) -> Result<(TransferFunction, bool), FunctionReadError> {
        let too_many = || FunctionReadError::TooManyPoints { file: file.to_owned() };
        let colors = checked(file, self.colors_name, self.colors)?;
        let [lo, hi] = [f64::min, f64::max]
            .map(|pick| colors.iter().map(|node| node.x).reduce(pick).expect("checked: not empty"));
        let colors = curves::colors(colors, self.space, MAX_POINTS).ok_or_else(too_many)?;
        let opacities = match self.opacities {
            Some(nodes) => checked(file, self.opacities_name, nodes)?,
            None => vec![Node::straight(lo, [0.0]), Node::straight(hi, [0.5])],
        };
        let opacities = curves::opacities(opacities, MAX_POINTS).ok_or_else(too_many)?;
        let sampled = colors.sampled || opacities.sampled;
        let function = join(&colors, &opacities).map_err(|error| FunctionReadError::Function {
            file: file.to_owned(),
            list: "",
            error,
        })?;
        if function.points().len() > MAX_POINTS {
            return Err(too_many());
        }
        Ok((function, sampled))
    }
}

/// Two lists with points at the same values are one list: nothing is lost, not even points that cannot be seen.
fn join(
    colors: &Polyline<3>,
    opacities: &Polyline<1>,
) -> Result<TransferFunction, cutaway_core::transfer_function::TransferFunctionError> {
    let (c, o) = (&colors.points, &opacities.points);
    if c.len() == o.len() && c.iter().zip(o).all(|(c, o)| c.0 == o.0) {
        let pairs = c.iter().zip(o);
        let points = pairs.map(|((value, color), (_, [opacity]))| ControlPoint {
            value: *value,
            color: *color,
            opacity: *opacity,
        });
        return TransferFunction::new(points.collect());
    }
    let o: Vec<(f64, f64)> = o.iter().map(|&(value, [opacity])| (value, opacity)).collect();
    TransferFunction::from_color_and_opacity(c, &o)
}

/// Nodes whose numbers can be trusted: at least one, not too many, all within their ranges.
fn checked<const N: usize>(
    file: &str,
    list: &str,
    mut nodes: Vec<Node<N>>,
) -> Result<Vec<Node<N>>, FunctionReadError> {
    let field = |field: String, found: String, expected: &str| {
        let expected = expected.to_owned();
        Err(FunctionReadError::Field { file: file.to_owned(), field, found, expected })
    };
    if nodes.is_empty() {
        return field(list.to_owned(), "no points".to_owned(), "at least one");
    }
    if nodes.len() > MAX_POINTS {
        return Err(FunctionReadError::TooManyPoints { file: file.to_owned() });
    }
    for (index, node) in nodes.iter_mut().enumerate() {
        let at = |what: &str| format!("{list}, point {index}, {what}");
        if !node.x.is_finite() {
            return field(at("value"), number(node.x), "a finite number");
        }
        for y in &mut node.y {
            if !(-SLACK..=1.0 + SLACK).contains(y) {
                let what = if N == 1 { "opacity" } else { "color" };
                return field(at(what), number(*y), "0 to 1");
            }
            *y = y.clamp(0.0, 1.0);
        }
        for (what, share) in [("midpoint", node.midpoint), ("sharpness", node.sharpness)] {
            if !(0.0..=1.0).contains(&share) {
                return field(at(what), number(share), "0 to 1");
            }
        }
    }
    Ok(nodes)
}

/// A unit distance that rendering can work with.
pub(super) fn unit_distance(file: &str, field: &str, found: f64) -> Result<f64, FunctionReadError> {
    if (1e-30..=1e30).contains(&found) {
        return Ok(found);
    }
    Err(FunctionReadError::Field {
        file: file.to_owned(),
        field: field.to_owned(),
        found: number(found),
        expected: "a length above 0, of 1e-30 to 1e30".to_owned(),
    })
}

/// Light of factors that a scene takes; `names` as the file has them, in the order ambient, diffuse, specular, power.
pub(super) fn lighting(
    file: &str,
    shade: bool,
    names: [&str; 4],
    factors: [f64; 4],
) -> Result<Lighting, FunctionReadError> {
    for (name, factor) in names.into_iter().zip(factors) {
        if !(0.0..=LARGEST_FACTOR).contains(&factor) {
            return Err(FunctionReadError::Field {
                file: file.to_owned(),
                field: name.to_owned(),
                found: number(factor),
                expected: "0 to 1000000".to_owned(),
            });
        }
    }
    let [ambient, diffuse, specular, specular_power] = factors;
    Ok(Lighting { shade, ambient, diffuse, specular, specular_power, ..Lighting::default() })
}

/// The points with no two at one value, as VTK must have them: each of a step is one step of a float above the last.
pub(super) fn distinct(function: &TransferFunction) -> Vec<ControlPoint> {
    let mut points = function.points().to_vec();
    for i in 1..points.len() {
        let above = points[i - 1].value.next_up();
        // There is no number above the largest; our own reader takes points at one value, too.
        if points[i].value < above && above.is_finite() {
            points[i].value = above;
        }
    }
    points
}
