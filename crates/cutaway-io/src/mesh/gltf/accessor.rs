//! Numbers in buffers.
//!
//! An accessor is a table of elements in a buffer view, or of zeros where it names none. A sparse one lists elements that
//! replace some of them.

use std::rc::Rc;

use glam::DVec3;

use super::super::error::MeshReadError;
use super::super::input::Input;
use super::buffers::{Buffers, Bytes};
use super::document::{Accessor, BufferView, Document, Sparse};
use super::entry;

/// The numbers that an accessor names: all of them are there.
pub(super) struct Numbers<'d> {
    accessor: &'d Accessor,
    field: String,
    /// `None`: zeros.
    table: Option<Table<'d>>,
    /// Numbers of the elements that are replaced, ascending, and what replaces them.
    replaced: Vec<u64>,
    replacement: Option<Table<'d>>,
    /// Elements.
    pub(super) count: u64,
}

/// Elements in a buffer.
struct Table<'d> {
    buffer: Rc<Bytes<'d>>,
    start: usize,
    stride: usize,
}

impl Table<'_> {
    /// The bytes of a number; zeros cannot happen, since [`Opening::table`] looked.
    fn bytes<const N: usize>(&self, element: u64, number: usize) -> [u8; N] {
        let at = self.start + element as usize * self.stride + number * N;
        self.buffer.as_slice().get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
    }

    /// An element that is an unsigned integer.
    fn whole(&self, component_type: u64, element: u64) -> u32 {
        match component_type {
            5121 => u32::from(u8::from_le_bytes(self.bytes(element, 0))),
            5123 => u32::from(u16::from_le_bytes(self.bytes(element, 0))),
            _ => u32::from_le_bytes(self.bytes(element, 0)),
        }
    }
}

/// Where elements are said to be.
struct Claim<'a> {
    view: u64,
    offset: u64,
    count: u64,
    /// Bytes of an element.
    size: u64,
    /// The fields that name the view and the count, for messages.
    field: &'a str,
    count_field: &'a str,
}

/// What opening an accessor takes.
struct Opening<'o, 'i, 'd> {
    input: &'o Input<'i>,
    document: &'d Document,
    buffers: &'o mut Buffers<'d>,
}

/// Opens an accessor that `field` names and checks its claims against its buffers.
pub(super) fn open<'d>(
    input: &Input<'_>,
    document: &'d Document,
    buffers: &mut Buffers<'d>,
    index: u64,
    field: &str,
) -> Result<Numbers<'d>, MeshReadError> {
    let accessor = entry(input, &document.accessors, "accessors", index, field)?;
    let field = format!("accessors[{index}]");
    let size = element_size(input, accessor, &field)?;
    let mut opening = Opening { input, document, buffers };
    let table = match accessor.buffer_view {
        None => None,
        Some(view) => Some(opening.table(&Claim {
            view,
            offset: accessor.byte_offset,
            count: accessor.count,
            size,
            field: &format!("{field}.bufferView"),
            count_field: &format!("{field}.count"),
        })?),
    };
    let mut numbers =
        Numbers { accessor, field, table, replaced: vec![], replacement: None, count: accessor.count };
    if let Some(sparse) = &accessor.sparse {
        opening.replace(&mut numbers, sparse, size)?;
    }
    Ok(numbers)
}

/// Bytes of a number of this type.
fn width(component_type: u64) -> Option<u64> {
    match component_type {
        5120 | 5121 => Some(1),
        5122 | 5123 => Some(2),
        5125 | 5126 => Some(4),
        _ => None,
    }
}

/// Bytes of an element.
fn element_size(input: &Input<'_>, accessor: &Accessor, field: &str) -> Result<u64, MeshReadError> {
    let wrong = |name: &str, found: String, expected: &str| MeshReadError::Field {
        file: input.file(),
        field: format!("{field}.{name}"),
        found,
        expected: expected.to_owned(),
    };
    let Some(width) = width(accessor.component_type) else {
        let found = accessor.component_type.to_string();
        return Err(wrong("componentType", found, "5120 to 5126, without 5124"));
    };
    match accessor.shape.as_str() {
        "SCALAR" => Ok(width),
        "VEC3" => Ok(3 * width),
        other => {
            let found = crate::volume::error::quoted(other);
            Err(wrong("type", found, "VEC3 for positions, SCALAR for indices"))
        }
    }
}

impl<'d> Opening<'_, '_, 'd> {
    fn wrong(&self, field: String, found: String, expected: String) -> MeshReadError {
        MeshReadError::Field { file: self.input.file(), field, found, expected }
    }

    /// A view, its buffer, and where the view ends in it.
    fn view(
        &mut self,
        index: u64,
        field: &str,
    ) -> Result<(&'d BufferView, Rc<Bytes<'d>>, u64), MeshReadError> {
        let view = entry(self.input, &self.document.buffer_views, "buffer views", index, field)?;
        let of_buffer = format!("bufferViews[{index}].buffer");
        let buffer = self.buffers.get(self.input, self.document, view.buffer, &of_buffer)?;
        let bytes = buffer.as_slice().len() as u64;
        match view.byte_offset.checked_add(view.byte_length).filter(|end| *end <= bytes) {
            Some(end) => Ok((view, buffer, end)),
            None => Err(self.wrong(
                format!("bufferViews[{index}].byteLength"),
                format!("{} at offset {}", view.byte_length, view.byte_offset),
                format!("no more than the {bytes} bytes of buffer {}", view.buffer),
            )),
        }
    }

    fn table(&mut self, claim: &Claim<'_>) -> Result<Table<'d>, MeshReadError> {
        let (view, buffer, view_end) = self.view(claim.view, claim.field)?;
        let (size, stride) =
            (claim.size, view.byte_stride.filter(|stride| *stride > 0).unwrap_or(claim.size));
        if !(size..=252).contains(&stride) {
            let field = format!("bufferViews[{}].byteStride", claim.view);
            return Err(self.wrong(field, stride.to_string(), format!("{size} to 252")));
        }
        let start = view.byte_offset.checked_add(claim.offset);
        let end = start.and_then(|start| match claim.count {
            0 => Some(start),
            n => (n - 1).checked_mul(stride)?.checked_add(size)?.checked_add(start),
        });
        match (start, end.filter(|end| *end <= view_end)) {
            (Some(start), Some(_)) => Ok(Table { buffer, start: start as usize, stride: stride as usize }),
            _ => Err(self.wrong(
                claim.count_field.to_owned(),
                claim.count.to_string(),
                format!("no more than fit into the {} bytes of buffer view {}", view.byte_length, claim.view),
            )),
        }
    }

    /// Reads which elements a sparse accessor replaces.
    fn replace(
        &mut self,
        numbers: &mut Numbers<'d>,
        sparse: &Sparse,
        size: u64,
    ) -> Result<(), MeshReadError> {
        let field = format!("{}.sparse", numbers.field);
        let count_field = format!("{field}.count");
        let kind = sparse.indices.component_type;
        let Some(width) = width(kind).filter(|_| matches!(kind, 5121 | 5123 | 5125)) else {
            let field = format!("{field}.indices.componentType");
            return Err(self.wrong(field, kind.to_string(), "5121, 5123 or 5125".to_owned()));
        };
        let indices = self.table(&Claim {
            view: sparse.indices.buffer_view,
            offset: sparse.indices.byte_offset,
            count: sparse.count,
            size: width,
            field: &format!("{field}.indices.bufferView"),
            count_field: &count_field,
        })?;
        numbers.replacement = Some(self.table(&Claim {
            view: sparse.values.buffer_view,
            offset: sparse.values.byte_offset,
            count: sparse.count,
            size,
            field: &format!("{field}.values.bufferView"),
            count_field: &count_field,
        })?);
        for i in 0..sparse.count {
            let index = u64::from(indices.whole(kind, i));
            let above = numbers.replaced.last().is_none_or(|last| *last < index);
            if !above || index >= numbers.count {
                return Err(self.wrong(
                    format!("{field}.indices"),
                    format!("{index} in element {i}"),
                    format!("ascending numbers below the count of {}", numbers.count),
                ));
            }
            numbers.replaced.push(index);
        }
        Ok(())
    }
}

impl<'d> Numbers<'d> {
    /// True if the accessor has neither a buffer view nor other elements.
    pub(super) fn is_zeros(&self) -> bool {
        self.table.is_none() && self.replaced.is_empty()
    }

    fn wrong(&self, input: &Input<'_>, expected: &str) -> MeshReadError {
        MeshReadError::Field {
            file: input.file(),
            field: self.field.clone(),
            found: format!("{} of type {}", self.accessor.shape, self.accessor.component_type),
            expected: expected.to_owned(),
        }
    }

    /// The table that holds an element, and its number there; `None` where it is zero.
    fn find(&self, element: u64) -> Option<(&Table<'d>, u64)> {
        match (self.replaced.binary_search(&element), &self.replacement) {
            (Ok(place), Some(table)) => Some((table, place as u64)),
            _ => self.table.as_ref().map(|table| (table, element)),
        }
    }

    /// Reads elements as vectors.
    pub(super) fn vectors(&self, input: &Input<'_>) -> Result<impl Fn(u64) -> DVec3, MeshReadError> {
        let normalized = self.accessor.normalized;
        // Quantised numbers as KHR_mesh_quantization has them.
        let scaled =
            move |value: f64, largest: f64| if normalized { (value / largest).max(-1.0) } else { value };
        if self.accessor.shape != "VEC3" || self.accessor.component_type == 5125 {
            return Err(self.wrong(input, "VEC3 of floats (5126), or of integers of 8 or 16 bits"));
        }
        Ok(move |element| {
            let Some((table, element)) = self.find(element) else { return DVec3::ZERO };
            DVec3::from_array([0, 1, 2].map(|i| match self.accessor.component_type {
                5120 => scaled(f64::from(i8::from_le_bytes(table.bytes(element, i))), 127.0),
                5121 => scaled(f64::from(u8::from_le_bytes(table.bytes(element, i))), 255.0),
                5122 => scaled(f64::from(i16::from_le_bytes(table.bytes(element, i))), 32767.0),
                5123 => scaled(f64::from(u16::from_le_bytes(table.bytes(element, i))), 65535.0),
                _ => f64::from(f32::from_le_bytes(table.bytes(element, i))),
            }))
        })
    }

    /// Reads elements as numbers of vertices.
    pub(super) fn numbers(&self, input: &Input<'_>) -> Result<impl Fn(u64) -> u32, MeshReadError> {
        let kind = self.accessor.component_type;
        if self.accessor.shape != "SCALAR" || !matches!(kind, 5121 | 5123 | 5125) {
            return Err(self.wrong(input, "SCALAR of unsigned integers (5121, 5123 or 5125)"));
        }
        Ok(move |element| self.find(element).map_or(0, |(table, element)| table.whole(kind, element)))
    }
}
