//! glTF 2.0, as text or as GLB: <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>.
//!
//! Read are the triangles, strips and fans of the meshes that the scene's nodes show, with the nodes' transforms (a
//! mirroring one turns the windings, as the specification has it); 32-bit float and quantised positions. Buffers are the
//! binary chunk, `data:` URIs and files in the same folder or below. Points, lines, skins, morph targets and everything
//! about looks is left out. Sparse accessors, and accessors of zeros, are read. Not read: compressed meshes (Draco, meshopt).
//!
//! Nodes may show one mesh any number of times. All their vertices and triangles are counted before any of them is made.

mod accessor;
mod buffers;
mod document;
mod whole;

use cutaway_mesh::TriangleMesh;
use glam::{DMat4, DQuat, DVec3};

use super::builder::Positions;
use super::error::MeshReadError;
use super::input::Input;
use crate::volume::Place;
use crate::volume::error::{quoted, shown_name};
use crate::volume::source::Folder;
use buffers::Buffers;
use document::{Document, Head, NamedMeshes, Node, Primitive};

/// Bytes that JSON may take in memory for one byte of text: a node of two bytes and its comma.
const JSON_FACTOR: u64 = 48;

/// Most primitives of all nodes together: nodes may show one mesh again and again.
const MOST_PRIMITIVES: usize = 1 << 20;

/// The four bytes `JSON` and `BIN\0` as numbers.
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

/// Extensions that change what positions are, so that there is no way around them.
const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

pub(super) fn read(input: &mut Input<'_>, folder: &dyn Folder) -> Result<TriangleMesh, MeshReadError> {
    let bytes = input.read_all()?;
    let (json, binary) = if bytes.starts_with(b"glTF") { chunks(input, &bytes)? } else { (&bytes[..], None) };
    let needed = (json.len() as u64).saturating_mul(JSON_FACTOR);
    if needed > input.limit() {
        let what = format!("{} bytes of JSON", json.len());
        return Err(MeshReadError::TooLarge { file: input.file(), what, needed, limit: input.limit() });
    }
    check_version(input, json)?;
    let document: Document =
        serde_json::from_slice(json).map_err(|error| MeshReadError::Json { file: input.file(), error })?;
    check_compression(input, &document)?;
    let buffers = Buffers::new(folder, binary);
    let mut scene = Scene {
        input,
        document: &document,
        buffers,
        vertices: Positions::default(),
        triangles: vec![],
        primitives: 0,
        left_out: [0; 4],
    };
    scene.read_nodes()?;
    let Scene { vertices, triangles, left_out, .. } = scene;
    let names = [
        "primitives of points and lines",
        "primitives without positions",
        "skins",
        "primitives' morph targets",
    ];
    for (count, what) in left_out.into_iter().zip(names).filter(|(count, _)| *count > 0) {
        input.notice(format!("{count} {what} left out"));
    }
    vertices.into_mesh(triangles).map_err(|error| MeshReadError::Mesh { file: input.file(), error })
}

/// The JSON and the binary chunk of a GLB file.
fn chunks<'b>(input: &Input<'_>, bytes: &'b [u8]) -> Result<(&'b [u8], Option<&'b [u8]>), MeshReadError> {
    let number = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let short = |what: &str, expected: String| input.too_short(what, bytes.len() as u64, expected);
    let (Some(version), Some(length)) = (number(4), number(8)) else {
        return Err(short("GLB header", "12".to_owned()));
    };
    if version != 2 {
        return Err(MeshReadError::Unsupported {
            file: input.file(),
            found: format!("version {version} of GLB is not read"),
            hint: "convert the file to glTF 2.0",
        });
    }
    if (bytes.len() as u64) < u64::from(length) {
        return Err(short("GLB", format!("{length}")));
    }
    let (mut at, mut json, mut binary) = (12, None, None);
    while let (Some(length), Some(kind)) = (number(at), number(at + 4)) {
        let start = at + 8;
        let chunk = bytes.get(start..).and_then(|rest| rest.get(..length as usize));
        let Some(chunk) = chunk else {
            return Err(short(
                "GLB",
                format!("at least {} with the chunk at byte {at}", start as u64 + u64::from(length)),
            ));
        };
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BIN if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        at = start + chunk.len();
    }
    match json {
        // Some programs fill the chunk up with zeros instead of blanks.
        Some(json) => {
            let end = json.iter().rposition(|b| *b != 0).map_or(0, |last| last + 1);
            Ok((&json[..end], binary))
        }
        None => Err(input.syntax(Place::Byte(12), "no JSON chunk", "one after the header")),
    }
}

/// Refuses other versions than 2: before anything else is parsed, since version 1.0 has other types everywhere.
fn check_version(input: &Input<'_>, json: &[u8]) -> Result<(), MeshReadError> {
    let unsupported = |version: &str| MeshReadError::Unsupported {
        file: input.file(),
        found: format!("version {version} of glTF is not read"),
        hint: "convert the file to glTF 2.0",
    };
    let head: Head =
        serde_json::from_slice(json).map_err(|error| MeshReadError::Json { file: input.file(), error })?;
    match head.asset.version.map(|version| version.to_string()) {
        Some(version) if version == "2" || version.starts_with("2.") => Ok(()),
        Some(version) if version.len() < 20 => Err(unsupported(&shown_name(&version))),
        Some(version) => Err(unsupported(&quoted(&version))),
        // There, the version could be left out.
        None if serde_json::from_slice::<NamedMeshes>(json).is_ok() => Err(unsupported("1.0")),
        None => Err(MeshReadError::Field {
            file: input.file(),
            field: "asset.version".to_owned(),
            found: "missing".to_owned(),
            expected: "\"2.0\"".to_owned(),
        }),
    }
}

fn check_compression(input: &Input<'_>, document: &Document) -> Result<(), MeshReadError> {
    let unsupported =
        |found: String, hint| Err(MeshReadError::Unsupported { file: input.file(), found, hint });
    let compressed = document.extensions_required.iter().find(|e| COMPRESSED.contains(&e.as_str()));
    if let Some(extension) = compressed {
        return unsupported(format!("{extension} is not read"), "save the file without mesh compression");
    }
    Ok(())
}

/// A scene while its meshes are collected.
struct Scene<'s, 'i, 'd> {
    input: &'s mut Input<'i>,
    document: &'d Document,
    buffers: Buffers<'d>,
    vertices: Positions,
    triangles: Vec<[u32; 3]>,
    primitives: usize,
    /// Points and lines, primitives without positions, skins, morph targets.
    left_out: [usize; 4],
}

/// The entry of a list that a field names.
fn entry<'d, T>(
    input: &Input<'_>,
    list: &'d [T],
    name: &str,
    index: u64,
    field: &str,
) -> Result<&'d T, MeshReadError> {
    let found = usize::try_from(index).ok().and_then(|index| list.get(index));
    found.ok_or_else(|| MeshReadError::Field {
        file: input.file(),
        field: field.to_owned(),
        found: index.to_string(),
        expected: format!("one of {} {name}, numbered from 0", list.len()),
    })
}

impl Scene<'_, '_, '_> {
    fn field(&self, field: String, found: impl Into<String>, expected: impl Into<String>) -> MeshReadError {
        MeshReadError::Field {
            file: self.input.file(),
            field,
            found: found.into(),
            expected: expected.into(),
        }
    }

    /// Checks that this many more vertices and triangles are within the limit.
    fn check_memory(&self, vertices: u64, triangles: u64) -> Result<(), MeshReadError> {
        let vertices = (self.vertices.len() as u64).saturating_add(vertices);
        let triangles = (self.triangles.len() as u64).saturating_add(triangles);
        self.input.check_memory(vertices, triangles, self.vertices.bytes())
    }

    /// The nodes that nothing is above of: those of the scene; without scenes, those that are nobody's children; without
    /// nodes, none.
    fn roots(&self) -> Result<Vec<u64>, MeshReadError> {
        let document = self.document;
        if document.scenes.is_empty() {
            let mut child = vec![false; document.nodes.len()];
            for &node in document.nodes.iter().flat_map(|node| &node.children) {
                if let Some(child) = child.get_mut(usize::try_from(node).unwrap_or(usize::MAX)) {
                    *child = true;
                }
            }
            return Ok((0u64..).zip(&child).filter(|(_, child)| !**child).map(|(i, _)| i).collect());
        }
        let scene = document.scene.unwrap_or(0);
        Ok(entry(self.input, &document.scenes, "scenes", scene, "scene")?.nodes.clone())
    }

    fn read_nodes(&mut self) -> Result<(), MeshReadError> {
        let document = self.document;
        if document.nodes.is_empty() && document.scenes.is_empty() {
            // A library of meshes that no scene shows.
            return (0..document.meshes.len() as u64)
                .try_for_each(|mesh| self.read_mesh(mesh, "meshes", DMat4::IDENTITY));
        }
        self.check_total()?;
        let mut reached = vec![false; document.nodes.len()];
        let mut waiting: Vec<(u64, DMat4)> =
            self.roots()?.into_iter().rev().map(|n| (n, DMat4::IDENTITY)).collect();
        while let Some((index, world_from_parent)) = waiting.pop() {
            let node = entry(self.input, &document.nodes, "nodes", index, "nodes")?;
            if std::mem::replace(&mut reached[index as usize], true) {
                return Err(self.field(format!("nodes[{index}]"), "reached twice", "a tree of nodes"));
            }
            let world_from_node = world_from_parent * self.transform(node, index)?;
            if !world_from_node.is_finite() {
                return Err(self.field(
                    format!("nodes[{index}]"),
                    "a transform that overflows",
                    "finite numbers",
                ));
            }
            self.left_out[2] += usize::from(node.skin.is_some());
            if let Some(mesh) = node.mesh {
                self.read_mesh(mesh, &format!("nodes[{index}].mesh"), world_from_node)?;
            }
            waiting.extend(node.children.iter().rev().map(|child| (*child, world_from_node)));
        }
        Ok(())
    }

    /// Counts the vertices and triangles of all nodes, and refuses what is beyond the limit. What is wrong with nodes is
    /// found later.
    fn check_total(&self) -> Result<(), MeshReadError> {
        let document = self.document;
        let sizes: Vec<(u64, u64)> = document.meshes.iter().map(|mesh| document.size_of(mesh)).collect();
        let (mut vertices, mut triangles) = (0u64, 0u64);
        let mut reached = vec![false; document.nodes.len()];
        let mut waiting = self.roots()?;
        while let Some(index) = waiting.pop() {
            let index = usize::try_from(index).unwrap_or(usize::MAX);
            let Some(node) = document.nodes.get(index) else { continue };
            if std::mem::replace(&mut reached[index], true) {
                continue;
            }
            let mesh = node.mesh.and_then(|mesh| sizes.get(usize::try_from(mesh).ok()?));
            if let Some((of_vertices, of_triangles)) = mesh {
                vertices = vertices.saturating_add(*of_vertices);
                triangles = triangles.saturating_add(*of_triangles);
            }
            waiting.extend(&node.children);
        }
        self.input.check_size(vertices, triangles)
    }

    fn transform(&self, node: &Node, index: u64) -> Result<DMat4, MeshReadError> {
        if let Some(matrix) = &node.matrix {
            return Ok(DMat4::from_cols_array(matrix));
        }
        let vector =
            |v: &Option<Box<[f64; 3]>>, default| v.as_ref().map_or(default, |v| DVec3::from_array(**v));
        let rotation = match &node.rotation {
            None => DQuat::IDENTITY,
            Some(q) => DQuat::from_array(**q),
        };
        let length = rotation.length();
        if !(length > 0.0 && length.is_finite()) {
            let found = format!("of length {length}");
            return Err(self.field(format!("nodes[{index}].rotation"), found, "a unit quaternion"));
        }
        let (scale, translation) = (vector(&node.scale, DVec3::ONE), vector(&node.translation, DVec3::ZERO));
        Ok(DMat4::from_scale_rotation_translation(scale, rotation / length, translation))
    }

    fn read_mesh(&mut self, index: u64, field: &str, world_from_node: DMat4) -> Result<(), MeshReadError> {
        let mesh = entry(self.input, &self.document.meshes, "meshes", index, field)?;
        self.primitives += mesh.primitives.len();
        if self.primitives > MOST_PRIMITIVES {
            let found = format!("{} primitives so far", self.primitives);
            return Err(self.field(format!("meshes[{index}]"), found, format!("at most {MOST_PRIMITIVES}")));
        }
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            self.read_primitive(primitive, &format!("meshes[{index}].primitives[{i}]"), world_from_node)?;
        }
        Ok(())
    }

    fn read_primitive(
        &mut self,
        primitive: &Primitive,
        field: &str,
        world_from_node: DMat4,
    ) -> Result<(), MeshReadError> {
        let mode = match primitive.mode.unwrap_or(4) {
            4 => Mode::Triangles,
            5 => Mode::Strip,
            6 => Mode::Fan,
            0..=3 => {
                self.left_out[0] += 1;
                return Ok(());
            }
            other => return Err(self.field(format!("{field}.mode"), other.to_string(), "0 to 6")),
        };
        let Some(position) = primitive.attributes.position else {
            self.left_out[1] += 1;
            return Ok(());
        };
        self.left_out[3] += usize::from(primitive.targets.is_some());
        if let Some(extension) = primitive.extensions.keys().find(|e| COMPRESSED.contains(&e.as_str())) {
            return Err(MeshReadError::Unsupported {
                file: self.input.file(),
                found: format!("`{field}` is compressed by {extension}, which is not read"),
                hint: "save the file without mesh compression",
            });
        }
        let first = self.vertices.len();
        self.read_positions(position, &format!("{field}.attributes.POSITION"), world_from_node)?;
        let count = self.vertices.len() - first;
        let numbers = match primitive.indices {
            None => Numbers::Counted,
            Some(indices) => {
                Numbers::Listed(self.read_indices(indices, &format!("{field}.indices"), count)?)
            }
        };
        // A mirroring transform turns what is outside inside.
        let mirrored = world_from_node.determinant() < 0.0;
        let corners = match &numbers {
            Numbers::Counted => count,
            Numbers::Listed(list) => list.len(),
        };
        let number = |i: usize| match &numbers {
            Numbers::Counted => (first + i) as u32,
            Numbers::Listed(list) => first as u32 + list[i],
        };
        let triangles = mode.triangles(corners);
        self.check_memory(0, triangles as u64)?;
        if corners > 0 && triangles == 0 || mode == Mode::Triangles && !corners.is_multiple_of(3) {
            self.input
                .notice(format!("{field} has {corners} corners, which make no whole number of triangles"));
        }
        self.triangles.extend((0..triangles).map(|t| {
            let [a, b, c] = mode.corners(t).map(number);
            if mirrored { [a, c, b] } else { [a, b, c] }
        }));
        Ok(())
    }

    fn read_positions(
        &mut self,
        accessor: u64,
        field: &str,
        world_from_node: DMat4,
    ) -> Result<(), MeshReadError> {
        let positions = accessor::open(self.input, self.document, &mut self.buffers, accessor, field)?;
        if positions.is_zeros() && positions.count > 0 {
            self.input.notice(format!("`accessors[{accessor}]` has no buffer view: all its values are 0"));
        }
        let reader = positions.vectors(self.input)?;
        let count = self.vertices.len() as u64 + positions.count;
        self.check_memory(positions.count, 0)?;
        if count >= u64::from(u32::MAX) {
            return Err(self.field(field.to_owned(), format!("{count} vertices so far"), "fewer than 2^32"));
        }
        for i in 0..positions.count {
            let vertex = world_from_node.transform_point3(reader(i));
            if !vertex.as_vec3().is_finite() {
                return Err(MeshReadError::NotFinite {
                    file: self.input.file(),
                    place: Place::Whole,
                    found: format!("{:?} in element {i} of `{field}`", vertex.to_array()),
                });
            }
            self.vertices.push(vertex);
        }
        Ok(())
    }

    fn read_indices(
        &mut self,
        accessor: u64,
        field: &str,
        vertices: usize,
    ) -> Result<Vec<u32>, MeshReadError> {
        let indices = accessor::open(self.input, self.document, &mut self.buffers, accessor, field)?;
        let reader = indices.numbers(self.input)?;
        // Zeros take no bytes in the file. Three numbers take as much memory as a triangle.
        self.check_memory(0, indices.count.div_ceil(3))?;
        let mut list = Vec::new();
        for i in 0..indices.count {
            let index = reader(i);
            if index as usize >= vertices {
                let found = format!("{index} in element {i}");
                return Err(self.field(
                    field.to_owned(),
                    found,
                    format!("one of {vertices} vertices, numbered from 0"),
                ));
            }
            list.push(index);
        }
        Ok(list)
    }
}

/// Which vertices corners are.
enum Numbers {
    /// One after the other.
    Counted,
    Listed(Vec<u32>),
}

/// How corners make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Triangles,
    Strip,
    Fan,
}

impl Mode {
    fn triangles(self, corners: usize) -> usize {
        match self {
            Self::Triangles => corners / 3,
            Self::Strip | Self::Fan => corners.saturating_sub(2),
        }
    }

    /// The corners of a triangle, in the specification's order.
    fn corners(self, t: usize) -> [usize; 3] {
        match self {
            Self::Triangles => [3 * t, 3 * t + 1, 3 * t + 2],
            Self::Strip => [t, t + 1 + t % 2, t + 2 - t % 2],
            Self::Fan => [t + 1, t + 2, 0],
        }
    }
}
