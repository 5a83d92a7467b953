//! What is cut out of the volume, as it is edited: a list of operations, applied in order, whose operands are objects or
//! lists of their own.
//!
//! A list begins with everything (inside a group: with nothing, and its first operand is taken whatever its operation) and
//! each operand changes what is kept so far: cut takes its inside away, keep leaves only its inside, union adds it. This
//! is a clip tree ([`cutaway_io::scene_file::ClipTree`]) with a place for names, visibility and order; [`Cutting::to_clip`]
//! makes the tree that is rendered and saved, [`Cutting::from_clip`] the list of a tree, whatever it is.
//!
//! | module | what it is |
//! |---|---|
//! | [`edit`] | finding, adding, moving, removing operands |
//! | [`from_clip`] | from a tree to a list |
//! | [`notes`] | what a tree cannot say: names, what is hidden, solo |
//! | [`defaults`] | shapes for a volume, bounds, fitting |
//! | [`numbers`] | a pose as translation, angles and factors |
//! | [`lens`] | from points of the picture to rays and back |
//! | [`hit`] | the object under a point of the picture |
//! | [`gizmo`] | dragging an object by handles |
//! | [`crop`] | dragging the crop box, and trimming it by a rectangle |
//!
//! Nothing here draws.

pub mod crop;
pub mod defaults;
pub mod edit;
pub mod from_clip;
pub mod gizmo;
pub mod hit;
pub mod lens;
pub mod notes;
pub mod numbers;
#[cfg(test)]
mod tests;

use cutaway_core::clip::{AxisBox, ClipShading, Node, Pose};
use cutaway_core::glam::DVec3;
use cutaway_core::volume::Volume;
use cutaway_io::scene_file::{ClipSource, ClipTree};

/// Tells operands apart, however they are ordered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OperandId(pub u64);

/// What an operand does with what is kept so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Operation {
    /// Its inside is taken away.
    #[default]
    Cut,
    /// Only its inside stays.
    Keep,
    /// Its inside is there, too.
    Union,
}

impl Operation {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Cut, Self::Keep, Self::Union];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cut => "cut",
            Self::Keep => "keep",
            Self::Union => "union",
        }
    }
}

/// What an operand is.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// An object; paths are absolute.
    Object(ClipSource),
    /// What a list of operands leaves.
    Group(Vec<Operand>),
    /// All of space, as trees have it that say what is *not* in something.
    Everything,
}

/// An object or a group, and what is done with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Operand {
    /// Which one.
    pub id: OperandId,
    /// What the user calls it.
    pub name: String,
    /// What it does.
    pub operation: Operation,
    /// Whether it does it.
    pub visible: bool,
    /// From its own space to that of the list it is in.
    pub pose: Pose,
    /// What it is.
    pub content: Content,
}

/// A box of voxels that is kept: `min` and `max` in voxel space, from 0 to the voxels less one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CropBox {
    /// The corner of small indices.
    pub min: DVec3,
    /// The corner of large indices.
    pub max: DVec3,
}

/// Everything that cuts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cutting {
    /// The operations, in order.
    pub operands: Vec<Operand>,
    /// A box of voxels beside them.
    pub crop: Option<CropBox>,
    /// What cut surfaces look like.
    pub shading: ClipShading,
    /// The one operand that has any effect, while there is one. The lists that it is in do with it what they do.
    pub solo: Option<OperandId>,
}

impl Cutting {
    /// The tree that is rendered; none where nothing is cut. `volume` has the place of the crop box.
    pub fn to_clip(&self, volume: &Volume) -> Option<ClipTree> {
        let crop = self.crop.and_then(|crop| crop_node(&crop, volume));
        let mut kept: Option<ClipTree> = None;
        for operand in effective(&self.operands, self.solo) {
            let Some(node) = operand.node(self.solo) else { continue };
            // Alone, a union would add to everything, and nothing were seen of it.
            let operation = match operand.operation {
                Operation::Union if self.solo.is_some() => Operation::Keep,
                operation => operation,
            };
            kept = apply(kept, operation, node);
        }
        match crop {
            Some(crop) => Some(kept.unwrap_or_else(ClipTree::everything).probe(crop)),
            None => kept,
        }
    }
}

/// The operands of a list that do something.
fn effective(operands: &[Operand], solo: Option<OperandId>) -> impl Iterator<Item = &Operand> {
    operands.iter().filter(move |o| o.visible && solo.is_none_or(|solo| o.holds(solo)))
}

/// Everything, once an operand is applied to it: none stands for everything.
fn apply(kept: Option<ClipTree>, operation: Operation, node: ClipTree) -> Option<ClipTree> {
    let all = || kept.clone().unwrap_or_else(ClipTree::everything);
    match operation {
        Operation::Cut => Some(all().cut(node)),
        Operation::Keep => Some(all().probe(node)),
        Operation::Union => kept.map(|kept| Node::Union(vec![kept, node]).into()),
    }
}

fn crop_node(crop: &CropBox, volume: &Volume) -> Option<ClipTree> {
    let shape = AxisBox::new(crop.min, crop.max).ok()?;
    let pose = Pose::new(*volume.world_from_voxel()).ok()?;
    Some(ClipTree::from(Node::Leaf(ClipSource::Box(shape))).with_pose(pose))
}

impl Operand {
    /// Whether it is the one of this id, or that is in it.
    pub fn holds(&self, id: OperandId) -> bool {
        self.id == id || self.operands().iter().any(|o| o.holds(id))
    }

    /// The operands in it.
    pub fn operands(&self) -> &[Operand] {
        match &self.content {
            Content::Group(operands) => operands,
            Content::Object(_) | Content::Everything => &[],
        }
    }

    /// What it is, in the space of its list; none for a group of nothing.
    fn node(&self, solo: Option<OperandId>) -> Option<ClipTree> {
        let node = match &self.content {
            Content::Object(source) => Node::Leaf(source.clone()).into(),
            Content::Everything => ClipTree::everything(),
            Content::Group(operands) => {
                // The whole group is meant where it is the one.
                let solo = solo.filter(|solo| *solo != self.id);
                let mut kept: Option<ClipTree> = None;
                for operand in effective(operands, solo) {
                    let Some(node) = operand.node(solo) else { continue };
                    kept = if kept.is_none() { Some(node) } else { apply(kept, operand.operation, node) };
                }
                kept?
            }
        };
        // A place of its own goes below that of the operand.
        let node = if node.pose == Pose::IDENTITY { node } else { Node::Union(vec![node]).into() };
        Some(node.with_pose(self.pose))
    }
}
