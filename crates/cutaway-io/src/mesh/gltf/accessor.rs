//! Numbers in buffers.

use std::rc::Rc;

use glam::DVec3;

use super::super::error::MeshReadError;
use super::super::input::Input;
use super::buffers::{Buffers, Bytes};
use super::document::{Accessor, Document};
use super::entry;

/// The numbers that an accessor names: all of them are there.
pub(super) struct Numbers<'d> {
    accessor: &'d Accessor,
    field: String,
    buffer: Rc<Bytes<'d>>,
    start: usize,
    stride: usize,
    /// Elements.
    pub(super) count: u64,
}

/// Opens an accessor that `field` names and holds its claims against its buffer.
pub(super) fn open<'d>(
    input: &Input<'_>,
    document: &'d Document,
    buffers: &mut Buffers<'d>,
    index: u64,
    field: &str,
) -> Result<Numbers<'d>, MeshReadError> {
    let accessor = entry(input, &document.accessors, "accessors", index, field)?;
    let field = format!("accessors[{index}]");
    let wrong = |name: &str, found: String, expected: String| MeshReadError::Field {
        file: input.file(),
        field: format!("{field}.{name}"),
        found,
        expected,
    };
    let view = match (accessor.buffer_view, &accessor.sparse) {
        (Some(view), None) => view,
        _ => {
            return Err(MeshReadError::Unsupported {
                file: input.file(),
                found: format!("`{field}` is sparse or compressed, which is not read"),
                hint: "save the file without sparse accessors and mesh compression",
            });
        }
    };
    let view_field = format!("{field}.bufferView");
    let found = entry(input, &document.buffer_views, "buffer views", view, &view_field)?;
    let buffer = buffers.get(input, document, found.buffer, &format!("bufferViews[{view}].buffer"))?;
    let bytes = buffer.as_slice().len() as u64;
    let view_end = found.byte_offset.checked_add(found.byte_length).filter(|end| *end <= bytes);
    let Some(view_end) = view_end else {
        let (at, length) = (found.byte_offset, found.byte_length);
        return Err(MeshReadError::Field {
            file: input.file(),
            field: format!("bufferViews[{view}].byteLength"),
            found: format!("{length} at offset {at}"),
            expected: format!("no more than the {bytes} bytes of buffer {}", found.buffer),
        });
    };
    let width = match accessor.component_type {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        other => return Err(wrong("componentType", other.to_string(), "5120 to 5126, without 5124".into())),
    };
    let size = match accessor.shape.as_str() {
        "SCALAR" => width,
        "VEC3" => 3 * width,
        other => {
            let found = crate::volume::error::quoted(other);
            return Err(wrong("type", found, "VEC3 for positions, SCALAR for indices".into()));
        }
    };
    let stride = found.byte_stride.unwrap_or(size);
    if !(size..=252).contains(&stride) {
        return Err(MeshReadError::Field {
            file: input.file(),
            field: format!("bufferViews[{view}].byteStride"),
            found: stride.to_string(),
            expected: format!("{size} to 252"),
        });
    }
    let start = found.byte_offset.checked_add(accessor.byte_offset);
    let end = start.and_then(|start| match accessor.count {
        0 => Some(start),
        n => (n - 1).checked_mul(stride)?.checked_add(size)?.checked_add(start),
    });
    match (start, end.filter(|end| *end <= view_end)) {
        (Some(start), Some(_)) => {
            let (start, stride) = (start as usize, stride as usize);
            Ok(Numbers { accessor, field, buffer, start, stride, count: accessor.count })
        }
        _ => {
            let expected =
                format!("no more than fit into the {} bytes of buffer view {view}", found.byte_length);
            Err(wrong("count", accessor.count.to_string(), expected))
        }
    }
}

impl Numbers<'_> {
    fn wrong(&self, input: &Input<'_>, expected: &str) -> MeshReadError {
        MeshReadError::Field {
            file: input.file(),
            field: self.field.clone(),
            found: format!("{} of type {}", self.accessor.shape, self.accessor.component_type),
            expected: expected.to_owned(),
        }
    }

    /// The bytes of a number; zeros cannot happen, since [`open`] looked.
    fn bytes<const N: usize>(&self, element: u64, number: usize) -> [u8; N] {
        let at = self.start + element as usize * self.stride + number * N;
        self.buffer.as_slice().get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
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
            DVec3::from_array([0, 1, 2].map(|i| match self.accessor.component_type {
                5120 => scaled(f64::from(i8::from_le_bytes(self.bytes(element, i))), 127.0),
                5121 => scaled(f64::from(u8::from_le_bytes(self.bytes(element, i))), 255.0),
                5122 => scaled(f64::from(i16::from_le_bytes(self.bytes(element, i))), 32767.0),
                5123 => scaled(f64::from(u16::from_le_bytes(self.bytes(element, i))), 65535.0),
                _ => f64::from(f32::from_le_bytes(self.bytes(element, i))),
            }))
        })
    }

    /// Reads elements as numbers of vertices.
    pub(super) fn numbers(&self, input: &Input<'_>) -> Result<impl Fn(u64) -> u32, MeshReadError> {
        let kind = self.accessor.component_type;
        if self.accessor.shape != "SCALAR" || !matches!(kind, 5121 | 5123 | 5125) {
            return Err(self.wrong(input, "SCALAR of unsigned integers (5121, 5123 or 5125)"));
        }
        Ok(move |element| match kind {
            5121 => u32::from(u8::from_le_bytes(self.bytes(element, 0))),
            5123 => u32::from(u16::from_le_bytes(self.bytes(element, 0))),
            _ => u32::from_le_bytes(self.bytes(element, 0)),
        })
    }
}
