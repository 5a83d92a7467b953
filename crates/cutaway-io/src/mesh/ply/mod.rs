//! PLY, the Polygon File Format (Stanford Triangle Format): <https://paulbourke.net/dataformats/ply/>.
//!
//! Read are `x`, `y` and `z` of the element `vertex`, the list `vertex_indices` (or `vertex_index`) of `face`, and the one
//! of `tristrips`, whose strips end with -1. All other properties and elements are skipped, of whatever type they are.

mod header;
mod values;

use cutaway_mesh::TriangleMesh;
use glam::DVec3;

use super::builder::Builder;
use super::error::MeshReadError;
use super::input::{Input, is_coordinate};
use crate::text::LineEnd;
use crate::volume::Place;
use header::{Element, Encoding, Header, Property};
use values::Values;

/// Reads a file whose first line ends so.
pub(super) fn read(input: &mut Input<'_>, line_end: LineEnd) -> Result<TriangleMesh, MeshReadError> {
    input.set_line_end(line_end);
    let Header { encoding, elements } = header::read(input)?;
    if encoding == Encoding::Ascii {
        input.set_text();
    }
    let vertices = elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count);
    let faces = elements.iter().find(|e| e.name == "face").map_or(0, |e| e.count);
    input.check_size(vertices, faces)?;
    let mut builder = Builder::default();
    let mut values = Values::new(encoding);
    for element in &elements {
        let least = element.least_bytes(encoding);
        // The last line of a text need not end.
        let slack = u64::from(element.count > 0 && least > 0);
        input.check_count(&element.name, element.count - slack, least)?;
        match element.name.as_str() {
            "vertex" => read_vertices(input, &mut values, element, &mut builder)?,
            "face" => read_faces(input, &mut values, element, vertices, &mut builder)?,
            "tristrips" => read_strips(input, &mut values, element, vertices, &mut builder)?,
            _ => skip(input, &mut values, element)?,
        }
    }
    if values.surplus() > 0 {
        let rows = values.surplus();
        input.notice(format!("{rows} rows have more numbers than the header says: the surplus ignored"));
    }
    if !input.at_end()? {
        input.notice(format!("{} goes on after its last element: the rest ignored", input.file()));
    }
    builder.finish(input, 0)
}

fn read_vertices(
    input: &mut Input<'_>,
    values: &mut Values,
    element: &Element,
    builder: &mut Builder,
) -> Result<(), MeshReadError> {
    let axis = |name: &str| ["x", "y", "z"].iter().position(|axis| *axis == name);
    for name in ["x", "y", "z"] {
        if !element.properties.iter().any(|p| matches!(p, Property::Scalar { name: n, .. } if n == name)) {
            let found = format!("the element `vertex` without a number `{name}`");
            return Err(input.syntax(element.place, found, "`property float x`, `y` and `z`"));
        }
    }
    for row in 0..element.count {
        values.begin(input, element, row)?;
        let mut at = [0.0; 3];
        for property in &element.properties {
            match property {
                Property::Scalar { name, kind } => {
                    let place = values.place(input);
                    let value = values.scalar(input, *kind)?;
                    if let Some(axis) = axis(name) {
                        at[axis] = value;
                        if !is_coordinate(value) {
                            return Err(input.not_finite(place, value));
                        }
                    }
                }
                Property::List { .. } => values.skip(input, property)?,
            }
        }
        values.end();
        builder.vertex(input, DVec3::from_array(at))?;
    }
    Ok(())
}

/// Reads the list of vertices of each face or strip and hands it on with its place.
fn read_lists(
    input: &mut Input<'_>,
    values: &mut Values,
    element: &Element,
    mut take: impl FnMut(&mut Input<'_>, &[i64], Place) -> Result<(), MeshReadError>,
) -> Result<(), MeshReadError> {
    let is_indices = |p: &Property| matches!(p, Property::List { name, .. } if name == "vertex_indices" || name == "vertex_index");
    let Some(indices) = element.properties.iter().position(is_indices) else {
        let found = format!("the element `{}` without a list `vertex_indices`", element.name);
        return Err(input.syntax(element.place, found, "`property list uchar int vertex_indices`"));
    };
    let mut list = Vec::new();
    for row in 0..element.count {
        values.begin(input, element, row)?;
        let place = values.place(input);
        for (i, property) in element.properties.iter().enumerate() {
            match property {
                Property::List { count, item, .. } if i == indices => {
                    let count = values.count(input, *count, *item)?;
                    input.check_size(0, count)?;
                    list.clear();
                    for _ in 0..count {
                        list.push(values.whole(input, *item)?);
                    }
                }
                _ => values.skip(input, property)?,
            }
        }
        values.end();
        take(input, &list, place)?;
    }
    Ok(())
}

fn read_faces(
    input: &mut Input<'_>,
    values: &mut Values,
    element: &Element,
    vertices: u64,
    builder: &mut Builder,
) -> Result<(), MeshReadError> {
    let mut face = Vec::new();
    read_lists(input, values, element, |input, list, place| {
        face.clear();
        for &found in list {
            face.push(vertex(input, found, vertices, place)?);
        }
        builder.face(input, &face, place)
    })
}

fn read_strips(
    input: &mut Input<'_>,
    values: &mut Values,
    element: &Element,
    vertices: u64,
    builder: &mut Builder,
) -> Result<(), MeshReadError> {
    read_lists(input, values, element, |input, list, place| {
        for strip in list.split(|v| *v == -1) {
            for (i, corners) in strip.windows(3).enumerate() {
                let mut face = [0; 3];
                for (corner, &found) in face.iter_mut().zip(corners) {
                    *corner = vertex(input, found, vertices, place)?;
                }
                if i % 2 == 1 {
                    face.swap(0, 1);
                }
                builder.face(input, &face, place)?;
            }
        }
        Ok(())
    })
}

fn vertex(input: &Input<'_>, found: i64, vertices: u64, place: Place) -> Result<u32, MeshReadError> {
    let vertex = u32::try_from(found).ok().filter(|v| u64::from(*v) < vertices && *v < u32::MAX);
    vertex.ok_or_else(|| MeshReadError::Index { file: input.file(), place, found, vertices, first: 0 })
}

fn skip(input: &mut Input<'_>, values: &mut Values, element: &Element) -> Result<(), MeshReadError> {
    // What has no properties has no data, however many of it there are.
    let rows = if element.properties.is_empty() { 0 } else { element.count };
    for row in 0..rows {
        values.begin(input, element, row)?;
        for property in &element.properties {
            values.skip(input, property)?;
        }
        values.end();
    }
    Ok(())
}
