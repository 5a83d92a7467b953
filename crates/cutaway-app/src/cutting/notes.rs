//! What a clip tree cannot say of a list: names, groups, what is hidden, solo.
//!
//! A scene file has the tree, which every program reads, and beside it these notes, which hold the list whole. They are
//! believed as long as their tree is the one in the file ([`CuttingNotes::restore`]): whoever changes the one
//! need not know of the other.

use cutaway_core::clip::{ClipShading, Node, Pose};
use cutaway_core::glam::DVec3;
use cutaway_core::volume::Volume;
use cutaway_io::scene_file::{ClipFile, ClipSource, ClipTree};
use serde::{Deserialize, Serialize};

use super::{Content, CropBox, Cutting, Operand, OperandId, Operation};

/// A list of operands as a scene file has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CuttingNotes {
    /// In order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    operands: Vec<OperandNotes>,
    /// The crop box: its corners, in voxels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    crop: Option<[[f64; 3]; 2]>,
}

/// An operand as a scene file has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OperandNotes {
    name: String,
    operation: Operation,
    #[serde(default, skip_serializing_if = "is_false")]
    hidden: bool,
    #[serde(default, skip_serializing_if = "is_false")]
    solo: bool,
    /// An object with its pose, or everything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    object: Option<ClipFile>,
    /// A group, where it is one; then it has the pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    group: Option<Vec<OperandNotes>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pose: Option<[[f64; 4]; 4]>,
}

fn is_false(value: &bool) -> bool {
    !*value
}

impl CuttingNotes {
    /// The notes of a list.
    pub fn new(cutting: &Cutting) -> Self {
        let operands = cutting.operands.iter().map(|o| OperandNotes::new(o, cutting.solo)).collect();
        let crop = cutting.crop.map(|crop| [crop.min.to_array(), crop.max.to_array()]);
        Self { operands, crop }
    }

    /// Whether a tree alone says as much.
    pub fn is_empty(&self) -> bool {
        self.operands.is_empty() && self.crop.is_none()
    }

    /// Calls `visit` with every path, to be made relative to the scene file, or good here.
    pub fn visit_paths(&mut self, visit: &mut dyn FnMut(&mut String)) {
        fn along(operands: &mut [OperandNotes], visit: &mut dyn FnMut(&mut String)) {
            for operand in operands {
                if let Some(object) = &mut operand.object {
                    object.0.visit_leaves(&mut |source, _| {
                        if let Some(path) = source.path_mut() {
                            visit(path);
                        }
                    });
                }
                along(operand.group.as_deref_mut().unwrap_or_default(), visit);
            }
        }
        along(&mut self.operands, visit);
    }

    /// The list, if its tree is that of the file; else the list of the file's tree.
    pub fn restore(&self, clip: Option<&ClipTree>, volume: &Volume, shading: ClipShading) -> Cutting {
        let noted = self.cutting().filter(|cutting| cutting.to_clip(volume).as_ref() == clip);
        let read = || clip.map(|clip| Cutting::from_clip(clip, volume)).unwrap_or_default();
        Cutting { shading, ..noted.unwrap_or_else(read) }
    }

    fn cutting(&self) -> Option<Cutting> {
        let (mut next, mut solo) = (1, None);
        let operands = operands(&self.operands, &mut next, &mut solo)?;
        let crop =
            self.crop.map(|[min, max]| CropBox { min: DVec3::from_array(min), max: DVec3::from_array(max) });
        Some(Cutting { operands, crop, solo, shading: ClipShading::default() })
    }
}

fn operands(notes: &[OperandNotes], next: &mut u64, solo: &mut Option<OperandId>) -> Option<Vec<Operand>> {
    notes.iter().map(|notes| notes.operand(next, solo)).collect()
}

impl OperandNotes {
    fn new(operand: &Operand, solo: Option<OperandId>) -> Self {
        let rows = (operand.pose != Pose::IDENTITY).then(|| operand.pose.to_rows());
        let posed = |node: Node<ClipSource>| ClipTree::from(node).with_pose(operand.pose);
        let (object, group, pose) = match &operand.content {
            Content::Object(source) => (Some(posed(Node::Leaf(source.clone()))), None, None),
            // All of space has no place in a file: it is everywhere.
            Content::Everything => (Some(ClipTree::everything()), None, rows),
            Content::Group(operands) => {
                (None, Some(operands.iter().map(|o| Self::new(o, solo)).collect()), rows)
            }
        };
        Self {
            name: operand.name.clone(),
            operation: operand.operation,
            hidden: !operand.visible,
            solo: solo == Some(operand.id),
            object: object.map(ClipFile),
            group,
            pose,
        }
    }

    /// None where the notes are no operand.
    fn operand(&self, next: &mut u64, solo: &mut Option<OperandId>) -> Option<Operand> {
        let id = OperandId(*next);
        *next += 1;
        if self.solo {
            *solo = Some(id);
        }
        let outer = self.pose.map_or(Ok(Pose::IDENTITY), Pose::from_rows).ok()?;
        let (content, pose) = match (&self.object, &self.group) {
            (Some(ClipFile(object)), None) => match &object.node {
                Node::Leaf(source) => (Content::Object(source.clone()), outer.after(&object.pose).ok()?),
                Node::Everything => (Content::Everything, outer),
                _ => return None,
            },
            (None, Some(group)) => (Content::Group(operands(group, next, solo)?), outer),
            _ => return None,
        };
        let (name, operation) = (self.name.clone(), self.operation);
        Some(Operand { id, name, operation, visible: !self.hidden, pose, content })
    }
}
