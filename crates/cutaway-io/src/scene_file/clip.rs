//! A clip tree as a scene file holds it: shapes by their numbers, meshes and patches by their path.
//!
//! ```json
//! { "difference": [ "volume", { "sphere": { "center": [0, 0, 0], "radius": 20 } },
//!                   { "mesh": "bunny.ply", "pose": [[1,0,0,0], [0,1,0,0], [0,0,1,0], [0,0,0,1]] } ] }
//! ```
//!
//! Numbers are checked while the file is read, so that an error has its line and column.

use std::fmt;
use std::sync::Arc;

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Serialize, Serializer};

use crate::mesh::MeshSpace;
use cutaway_core::clip::{
    AxisBox, Clip, LARGEST_COORDINATE, Node, Object, ObjectId, Plane, Pose, ShapeError, Solid, Sphere,
};

/// A clip tree whose objects are still what a file says of them.
pub type ClipTree = Clip<ClipSource>;

/// A clip tree as JSON reads and writes it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipFile(pub ClipTree);

/// What a scene file says of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum ClipSource {
    /// A triangle mesh.
    Mesh {
        /// Its file, relative to the scene file.
        path: String,
        /// The axes that its coordinates are along.
        space: MeshSpace,
    },
    /// Spline patches.
    Patches {
        /// Their file, relative to the scene file.
        path: String,
        /// How far the triangles made of them may be from them, in their own units; above 0.
        tolerance: Option<f64>,
    },
    /// A ball.
    Sphere(Sphere),
    /// A box along the axes.
    Box(AxisBox),
    /// A half-space.
    Plane(Plane),
}

/// An object that lies in a file of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExternalSolid<'a> {
    /// A triangle mesh.
    Mesh {
        /// The path, as the tree has it.
        path: &'a str,
        /// The axes that its coordinates are along.
        space: MeshSpace,
    },
    /// Spline patches.
    Patches {
        /// The path, as the tree has it.
        path: &'a str,
        /// How far triangles may be from the patches, in their own units.
        tolerance: Option<f64>,
    },
}

impl<'a> ExternalSolid<'a> {
    /// The path, as the tree has it.
    pub fn path(&self) -> &'a str {
        match self {
            Self::Mesh { path, .. } | Self::Patches { path, .. } => path,
        }
    }
}

/// What makes solids of files.
pub type LoadSolid<'a, E> = dyn FnMut(ExternalSolid<'_>) -> Result<Arc<dyn Solid>, E> + 'a;

impl ClipSource {
    /// The path of what lies in a file of its own.
    pub fn path_mut(&mut self) -> Option<&mut String> {
        match self {
            Self::Mesh { path, .. } | Self::Patches { path, .. } => Some(path),
            _ => None,
        }
    }

    /// What lies in a file of its own.
    pub fn external(&self) -> Option<ExternalSolid<'_>> {
        match self {
            Self::Mesh { path, space } => Some(ExternalSolid::Mesh { path, space: *space }),
            Self::Patches { path, tolerance } => Some(ExternalSolid::Patches { path, tolerance: *tolerance }),
            _ => None,
        }
    }

    /// The solid; `load` is asked for what lies in a file of its own.
    pub fn solid<E>(&self, load: &mut LoadSolid<'_, E>) -> Result<Arc<dyn Solid>, E> {
        Ok(match self {
            Self::Mesh { path, space } => load(ExternalSolid::Mesh { path, space: *space })?,
            Self::Patches { path, tolerance } => {
                load(ExternalSolid::Patches { path, tolerance: *tolerance })?
            }
            Self::Sphere(shape) => Arc::new(*shape),
            Self::Box(shape) => Arc::new(*shape),
            Self::Plane(shape) => Arc::new(*shape),
        })
    }
}

/// Returns the tree with solids as leaves, numbered from 0 in their order; `load` makes those that lie in files.
///
/// # Errors
/// The first error of `load`.
pub fn resolve<E>(tree: &ClipTree, load: &mut LoadSolid<'_, E>) -> Result<Clip, E> {
    let mut next = 0;
    tree.map(&mut |source| {
        let id = ObjectId(next);
        next += 1;
        Ok(Object { id, solid: source.solid(load)? })
    })
}

#[derive(Serialize, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SphereFields {
    /// Its middle.
    center: [f64; 3],
    /// Above 0.
    radius: f64,
}

#[derive(Serialize, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct BoxFields {
    /// The corner of small coordinates.
    min: [f64; 3],
    /// The corner of large coordinates: more than `min` along each axis.
    max: [f64; 3],
}

#[derive(Serialize, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PlaneFields {
    /// Out of what is kept; any length above 0.
    normal: [f64; 3],
    /// In units of the normal.
    distance: f64,
}

/// A node of a clip expression, in world units unless a pose moves it: exactly one of the shapes and operations.
#[derive(Default, Serialize, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Fields {
    /// A closed triangle mesh: its file, relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<String>,
    /// Closed spline patches: their file, relative to the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    patches: Option<String>,
    /// A ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    sphere: Option<SphereFields>,
    /// A box along the axes.
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    cuboid: Option<BoxFields>,
    /// The half-space `normal · x <= distance`.
    #[serde(skip_serializing_if = "Option::is_none")]
    plane: Option<PlaneFields>,
    /// What is in any of these.
    #[serde(skip_serializing_if = "Option::is_none")]
    union: Option<Vec<ClipFile>>,
    /// What is in all of these.
    #[serde(skip_serializing_if = "Option::is_none")]
    intersection: Option<Vec<ClipFile>>,
    /// The first minus the rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    difference: Option<Vec<ClipFile>>,
    /// What is not in this.
    #[serde(skip_serializing_if = "Option::is_none")]
    complement: Option<Box<ClipFile>>,
    /// Rows of the 4x4 matrix from the node's own space to that of the node above it, or the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<[[f64; 4]; 4]>,
    /// With `patches`: how far triangles may be from them, in their own units; above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    tolerance: Option<f64>,
    /// With `mesh`: the axes that its coordinates are along, `ras` or `lps` (which is converted to RAS); without it, what
    /// the mesh's file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    space: Option<SpaceField>,
}

/// The axes of a mesh.
#[derive(Clone, Copy, Serialize, serde::Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum SpaceField {
    /// Right, anterior, superior.
    Ras,
    /// Left, posterior, superior.
    Lps,
    /// What the file says.
    File,
}

impl SpaceField {
    fn of(space: MeshSpace) -> Option<Self> {
        match space {
            MeshSpace::File => None,
            MeshSpace::Ras => Some(Self::Ras),
            MeshSpace::Lps => Some(Self::Lps),
        }
    }

    fn space(self) -> MeshSpace {
        match self {
            Self::File => MeshSpace::File,
            Self::Ras => MeshSpace::Ras,
            Self::Lps => MeshSpace::Lps,
        }
    }
}

/// The names of which a node has exactly one.
const KINDS: [&str; 9] =
    ["mesh", "patches", "sphere", "box", "plane", "union", "intersection", "difference", "complement"];

const EXPECTED: &str = "`\"volume\"`, or an object with one of mesh, patches, sphere, box, plane, union, intersection, \
                        difference, complement, and a pose if it is moved";

impl Fields {
    fn into_clip(self) -> Result<ClipTree, String> {
        let tolerance = self.tolerance;
        let has = [
            self.mesh.is_some(),
            self.patches.is_some(),
            self.sphere.is_some(),
            self.cuboid.is_some(),
            self.plane.is_some(),
            self.union.is_some(),
            self.intersection.is_some(),
            self.difference.is_some(),
            self.complement.is_some(),
        ];
        let found: Vec<&str> = KINDS.into_iter().zip(has).filter(|(_, has)| *has).map(|(k, _)| k).collect();
        if found.len() != 1 {
            let found = if found.is_empty() { "none of them".to_owned() } else { found.join(" and ") };
            return Err(format!("a clip node is {EXPECTED}; found {found}"));
        }
        if tolerance.is_some() && self.patches.is_none() {
            return Err(format!("`tolerance` belongs to patches; found it beside `{}`", found[0]));
        }
        if self.space.is_some() && self.mesh.is_none() {
            return Err(format!("`space` belongs to a mesh; found it beside `{}`", found[0]));
        }
        let pose = self.pose.map_or(Ok(Pose::IDENTITY), Pose::from_rows).map_err(|e| e.to_string())?;
        let vector = DVec3::from_array;
        let shape = |e: ShapeError| format!("{}: {e}", found[0]);
        let node = if let Some(path) = self.mesh {
            let space = self.space.map_or(MeshSpace::File, SpaceField::space);
            Node::Leaf(ClipSource::Mesh { path: path_in_file(path, "mesh")?, space })
        } else if let Some(path) = self.patches {
            let path = path_in_file(path, "patches")?;
            Node::Leaf(ClipSource::Patches { path, tolerance: checked_tolerance(tolerance)? })
        } else if let Some(s) = self.sphere {
            Node::Leaf(ClipSource::Sphere(Sphere::new(vector(s.center), s.radius).map_err(shape)?))
        } else if let Some(b) = self.cuboid {
            Node::Leaf(ClipSource::Box(AxisBox::new(vector(b.min), vector(b.max)).map_err(shape)?))
        } else if let Some(p) = self.plane {
            Node::Leaf(ClipSource::Plane(Plane::new(vector(p.normal), p.distance).map_err(shape)?))
        } else if let Some(parts) = self.union {
            Node::Union(operands(parts, "union")?)
        } else if let Some(parts) = self.intersection {
            Node::Intersection(operands(parts, "intersection")?)
        } else if let Some(parts) = self.difference {
            Node::Difference(operands(parts, "difference")?)
        } else {
            Node::Complement(Box::new(self.complement.map_or_else(Clip::everything, |part| part.0)))
        };
        Ok(Clip { pose, node })
    }

    fn from_clip(clip: &ClipTree) -> Self {
        let pose = (clip.pose != Pose::IDENTITY).then(|| clip.pose.to_rows());
        let mut fields = Self { pose, ..Self::default() };
        match &clip.node {
            // In a place of its own, all of space is still all of space: written as such by the caller.
            Node::Everything => {}
            Node::Leaf(ClipSource::Mesh { path, space }) => {
                fields.mesh = Some(path.clone());
                fields.space = SpaceField::of(*space);
            }
            Node::Leaf(ClipSource::Patches { path, tolerance }) => {
                fields.patches = Some(path.clone());
                fields.tolerance = *tolerance;
            }
            Node::Leaf(ClipSource::Sphere(s)) => {
                fields.sphere = Some(SphereFields { center: s.center().to_array(), radius: s.radius() });
            }
            Node::Leaf(ClipSource::Box(b)) => {
                fields.cuboid = Some(BoxFields { min: b.min().to_array(), max: b.max().to_array() });
            }
            Node::Leaf(ClipSource::Plane(p)) => {
                fields.plane = Some(PlaneFields { normal: p.normal().to_array(), distance: p.distance() });
            }
            Node::Union(parts) => fields.union = Some(files(parts)),
            Node::Intersection(parts) => fields.intersection = Some(files(parts)),
            Node::Difference(parts) => fields.difference = Some(files(parts)),
            Node::Complement(part) => fields.complement = Some(Box::new(ClipFile((**part).clone()))),
        }
        fields
    }
}

fn files(parts: &[ClipTree]) -> Vec<ClipFile> {
    parts.iter().cloned().map(ClipFile).collect()
}

fn path_in_file(path: String, kind: &str) -> Result<String, String> {
    if path.is_empty() {
        Err(format!("`{kind}` is empty; give a path, relative to the scene file"))
    } else {
        Ok(path)
    }
}

fn checked_tolerance(tolerance: Option<f64>) -> Result<Option<f64>, String> {
    match tolerance.filter(|t| !(*t > 0.0 && *t <= LARGEST_COORDINATE)) {
        Some(t) => Err(format!("`tolerance` is {t}; expected a length above 0")),
        None => Ok(tolerance),
    }
}

fn operands(parts: Vec<ClipFile>, kind: &str) -> Result<Vec<ClipTree>, String> {
    if parts.is_empty() {
        return Err(format!("`{kind}` has no operands; give at least one"));
    }
    Ok(parts.into_iter().map(|ClipFile(tree)| tree).collect())
}

impl Serialize for ClipFile {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0.node {
            Node::Everything => serializer.serialize_str("volume"),
            _ => Fields::from_clip(&self.0).serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for ClipFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NodeVisitor;
        impl<'de> Visitor<'de> for NodeVisitor {
            type Value = ClipFile;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a clip node: {EXPECTED}")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<ClipFile, E> {
                if text == "volume" {
                    return Ok(ClipFile(Clip::everything()));
                }
                Err(E::invalid_value(de::Unexpected::Str(text), &self))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ClipFile, A::Error> {
                let fields: Fields = Deserialize::deserialize(MapAccessDeserializer::new(map))?;
                fields.into_clip().map(ClipFile).map_err(de::Error::custom)
            }
        }
        deserializer.deserialize_any(NodeVisitor)
    }
}

impl JsonSchema for ClipFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Clip".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut node = Fields::json_schema(generator);
        let one_of: Vec<Schema> = KINDS.iter().map(|kind| json_schema!({ "required": [kind] })).collect();
        node.insert("oneOf".to_owned(), one_of.into());
        json_schema!({
            "description": "What is kept of the volume: the inside of this expression.",
            "anyOf": [ { "type": "string", "const": "volume", "description": "Everything." }, node ],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<ClipTree, String> {
        serde_json::from_str::<ClipFile>(text).map(|file| file.0).map_err(|e| e.to_string())
    }

    const WHOLE: &str = r#"{"difference":["volume",
        {"mesh":"bunny.ply","pose":[[0.0,-1.0,0.0,5.0],[2.0,0.0,0.0,0.0],[0.0,0.0,1.0,0.0],[0.0,0.0,0.0,1.0]]},
        {"patches":"teapot.json","tolerance":0.01},
        {"union":[{"sphere":{"center":[1.0,2.0,3.0],"radius":4.5}},{"plane":{"normal":[0.0,3.0,4.0],"distance":7.0}}]},
        {"complement":{"intersection":[{"box":{"min":[0.0,0.0,0.0],"max":[1.0,2.0,3.0]}}]}}]}"#;

    #[test]
    fn every_node_is_read_and_written_without_loss() {
        let clip = read(WHOLE).unwrap();
        let text: String = WHOLE.split_whitespace().collect();
        assert_eq!(serde_json::to_string(&ClipFile(clip.clone())).unwrap(), text);
        assert_eq!(read(r#""volume""#).unwrap(), Clip::everything());
        assert_eq!(serde_json::to_string(&ClipFile(Clip::everything())).unwrap(), r#""volume""#);
    }

    #[test]
    fn objects_in_files_are_asked_for_in_order_and_numbered() {
        let clip = read(WHOLE).unwrap();
        let mut asked = Vec::new();
        let ball: Arc<dyn Solid> = Arc::new(Sphere::new(DVec3::ZERO, 1.0).unwrap());
        let resolved = resolve(&clip, &mut |external| {
            asked.push(format!("{external:?}"));
            Ok::<_, ()>(ball.clone())
        });
        assert_eq!(
            asked,
            [
                r#"Mesh { path: "bunny.ply", space: File }"#,
                r#"Patches { path: "teapot.json", tolerance: Some(0.01) }"#,
            ]
        );
        let mut ids = Vec::new();
        resolved.unwrap().visit_leaves(&mut |object, _| ids.push(object.id.0));
        assert_eq!(ids, [0, 1, 2, 3, 4]);
        assert_eq!(resolve(&clip, &mut |_| Err("no")).unwrap_err(), "no");
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let wrong = [
            (r#""volum""#, "volum"),
            ("7", "a clip node"),
            ("[]", "a clip node"),
            ("{}", "found none of them"),
            (r#"{"sphere": {"center": [0,0,0], "radius": 1}, "mesh": "a"}"#, "found mesh and sphere"),
            (r#"{"spher": {}}"#, "`spher`"),
            (r#"{"sphere": {"center": [0,0], "radius": 1}}"#, "length 2"),
            (r#"{"sphere": {"center": [0,0,0]}}"#, "`radius`"),
            (
                r#"{"sphere": {"center": [0,0,0], "radius": -1}}"#,
                "sphere: radius is -1; expected a length above 0",
            ),
            (r#"{"box": {"min": [0,0,0], "max": [1,0,1]}}"#, "box: max is"),
            (r#"{"plane": {"normal": [0,0,0], "distance": 1}}"#, "plane: normal is"),
            (r#"{"plane": {"normal": [1e300,0,0], "distance": 1}}"#, "1e30"),
            (r#"{"mesh": ""}"#, "`mesh` is empty"),
            (r#"{"mesh": "a", "tolerance": 1}"#, "`tolerance` belongs to patches"),
            (r#"{"patches": "a", "tolerance": 0}"#, "`tolerance` is 0"),
            (r#"{"union": []}"#, "`union` has no operands"),
            (r#"{"difference": []}"#, "`difference` has no operands"),
            (r#"{"complement": {"union": "volume"}}"#, "expected a sequence"),
            (r#"{"mesh": "a", "pose": [[1,0,0,0],[0,1,0,0],[0,0,0,0],[0,0,0,1]]}"#, "singular"),
            (r#"{"mesh": "a", "pose": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]}"#, "last row"),
            (r#"{"mesh": "a", "pose": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}"#, "length 3"),
        ];
        for (text, says) in wrong {
            let error = read(text).unwrap_err();
            assert!(error.contains(says) && error.contains("line 1 column"), "{text}: {error}");
            let nested = read(&format!(r#"{{"union": ["volume",{}{text}]}}"#, '\n')).unwrap_err();
            assert!(nested.contains("line 2 column"), "{text}: {nested}");
        }
    }

    #[test]
    fn depth_and_truncation_are_errors() {
        let deep = r#"{"complement":"#.repeat(100_000);
        assert!(read(&deep).unwrap_err().contains("recursion"));
        for end in (0..WHOLE.len()).filter(|end| WHOLE.is_char_boundary(*end)) {
            assert!(read(&WHOLE[..end]).is_err(), "{end}");
        }
    }
}
