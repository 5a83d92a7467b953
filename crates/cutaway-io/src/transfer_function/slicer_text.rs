//! Slicer's volume properties as text (`.vp`; vtkMRMLVolumePropertyStorageNode).
//!
//! Nine lines: interpolation (0 nearest, 1 linear), shading (0 or 1), diffuse, ambient, specular, specular power; then three
//! lists, each a number of numbers and the numbers: scalar opacity (value, opacity), gradient opacity (gradient, opacity),
//! colour (value, red, green, blue). Opacities are for one millimetre: the format has no place for another unit.

use std::borrow::Cow;
use std::fmt::Write;

use cutaway_core::transfer_function::ControlPoint;

use super::curves::Node;
use super::join::{self, Lists};
use super::spaces::ColorSpace;
use super::{FunctionFile, FunctionReadError, MAX_POINTS};
use crate::text;
use crate::volume::Loaded;
use crate::volume::error::quoted;

/// What the lines hold.
const LINES: [&str; 9] = [
    "interpolation",
    "shading",
    "diffuse",
    "ambient",
    "specular",
    "specular power",
    "scalar opacity",
    "gradient opacity",
    "colour",
];

/// Whether text begins as a volume property does: two numbers on two lines, then a line of one word. Spline patches have many
/// on the second.
pub(super) fn recognize(bytes: &[u8]) -> bool {
    let mut lines = text::lines(bytes).map(<[u8]>::trim_ascii);
    let mut number = || lines.next().and_then(|line| std::str::from_utf8(line).ok()?.parse::<f64>().ok());
    let begins = number().is_some_and(|n| [0.0, 1.0, 2.0].contains(&n)) && number().is_some();
    let third = lines.next().unwrap_or_default();
    begins && !third.is_empty() && !third.iter().any(|b| b.is_ascii_whitespace() || *b == b',')
}

/// The lines of a file.
struct Reader<'a> {
    file: &'a str,
    lines: Vec<Cow<'a, str>>,
}

impl Reader<'_> {
    fn error(&self, line: usize, found: &str, expected: impl Into<String>) -> FunctionReadError {
        let file = self.file.to_owned();
        let found = if found.is_empty() { "nothing".to_owned() } else { quoted(found) };
        let expected = expected.into();
        FunctionReadError::Line { file, line: line + 1, what: LINES[line], found, expected }
    }

    fn line(&self, line: usize) -> &str {
        self.lines.get(line).map_or("", |text| text.trim())
    }

    /// The one number of a line.
    fn number(&self, line: usize) -> Result<f64, FunctionReadError> {
        let text = self.line(line);
        let number = text.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.error(line, text, "a number"))
    }

    /// The numbers of a line after their count, `each` a point.
    fn list(&self, line: usize, each: usize) -> Result<Vec<f64>, FunctionReadError> {
        let text = self.line(line);
        let mut words = text.split_ascii_whitespace();
        let count = words.next().unwrap_or("");
        let count: usize = match count.parse() {
            Ok(count) => count,
            Err(_) => return Err(self.error(line, count, "how many numbers follow")),
        };
        if count > MAX_POINTS * each {
            return Err(FunctionReadError::TooManyPoints { file: self.file.to_owned() });
        }
        if !count.is_multiple_of(each) {
            return Err(self.error(line, &count.to_string(), format!("a multiple of {each}")));
        }
        let mut numbers = Vec::new();
        for word in words {
            let number = word.parse().ok().filter(|number: &f64| number.is_finite());
            numbers.push(number.ok_or_else(|| self.error(line, word, "a number"))?);
        }
        if numbers.len() != count {
            let found = format!("{} numbers", numbers.len());
            return Err(self.error(line, &found, format!("{count} after the first")));
        }
        Ok(numbers)
    }
}

pub(super) fn parse(file: String, bytes: &[u8]) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    let reader = Reader { file: &file, lines: text::lines(bytes).map(String::from_utf8_lossy).collect() };
    let mut notices = Vec::new();
    let interpolation = reader.number(0)?;
    let [shade, diffuse, ambient, specular, power] = {
        let mut numbers = [0.0; 5];
        for (index, number) in numbers.iter_mut().enumerate() {
            *number = reader.number(index + 1)?;
        }
        numbers
    };
    if interpolation == 0.0 {
        notices.push("the file asks for the nearest voxel; values are interpolated all the same".to_owned());
    }
    let names = [LINES[3], LINES[2], LINES[4], LINES[5]];
    let lighting = join::lighting(&file, shade != 0.0, names, [ambient, diffuse, specular, power])?;
    let opacities = reader.list(6, 2)?;
    let gradient = reader.list(7, 2)?;
    let colors = reader.list(8, 4)?;
    if !matches!(bytes.last(), Some(b'\n' | b'\r')) && reader.lines.len() == LINES.len() {
        notices.push("the last line has no end; the file may have been cut off".to_owned());
    }
    if gradient.as_chunks::<2>().0.iter().any(|point| point[1] != 1.0) {
        notices.push("opacity by the gradient was left out: cutaway has none".to_owned());
    }
    let lists = Lists {
        colors_name: LINES[8],
        colors: colors.as_chunks().0.iter().map(|&[x, r, g, b]| Node::straight(x, [r, g, b])).collect(),
        space: ColorSpace::Rgb,
        opacities_name: LINES[6],
        opacities: Some(opacities.as_chunks().0.iter().map(|&[x, y]| Node::straight(x, [y])).collect()),
    };
    let (function, _) = lists.joined(&file)?;
    let (unit_distance, lighting) = (Some(1.0), Some(lighting));
    let value = FunctionFile { function, unit_distance, lighting, name: None, has_opacities: true };
    Ok(Loaded { value, notices })
}

pub(super) fn text(file: &FunctionFile) -> (String, Vec<String>) {
    let mut notices = Vec::new();
    let mut points = join::distinct(&file.function);
    match file.unit_distance {
        Some(unit) if unit != 1.0 => {
            points.iter_mut().for_each(|point| point.opacity = per_millimetre(point.opacity, unit));
            notices.push(format!(
                "opacities were converted from {unit} mm to 1 mm, which .vp files have: exact at points, near between them"
            ));
        }
        Some(_) => {}
        None => notices.push(
            "opacities for the mean voxel spacing were written as those for 1 mm, which .vp files have"
                .to_owned(),
        ),
    }
    let light = file.lighting.clone().unwrap_or_default();
    let mut text = String::from("1\n");
    let factors = [light.diffuse, light.ambient, light.specular, light.specular_power];
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{}", u8::from(light.shade));
    factors.iter().for_each(|factor| {
        let _ = writeln!(text, "{factor}");
    });
    let opacity = |p: &ControlPoint| [p.value, p.opacity];
    let color = |p: &ControlPoint| [p.value, p.color[0], p.color[1], p.color[2]];
    text += &list_text(points.iter().flat_map(opacity), 2 * points.len());
    text += "4 0 1 255 1\n";
    text += &list_text(points.iter().flat_map(color), 4 * points.len());
    (text, notices)
}

/// The opacity of a millimetre of what has `opacity` in `unit` millimetres.
fn per_millimetre(opacity: f64, unit: f64) -> f64 {
    -f64::exp_m1(f64::ln_1p(-opacity) / unit)
}

fn list_text(numbers: impl Iterator<Item = f64>, count: usize) -> String {
    let mut text = count.to_string();
    numbers.for_each(|number| {
        let _ = write!(text, " {number}");
    });
    text + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opacity_for_another_length_is_the_same_extinction() {
        assert_eq!(per_millimetre(0.0, 3.0), 0.0);
        assert_eq!(per_millimetre(1.0, 3.0), 1.0);
        // Two millimetres of 0.5 let through a quarter.
        assert!((per_millimetre(0.75, 2.0) - 0.5).abs() < 1e-15);
    }
}
