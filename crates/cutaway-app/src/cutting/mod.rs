//! What is cut out of the volume, as it is edited: a list of operations, applied in order, whose operands are objects or
//! lists of their own.
//!
//! A list begins with everything (inside a group: with nothing, and its first operand is taken whatever its operation) and
//! each operand changes what is kept so far: cut takes its inside away, keep leaves only its inside, union adds it. This
//! is a clip tree ([`cutaway_core::clip::ClipFile`]) with a place for names, visibility and order; [`Cutting::to_clip`]
//! makes the tree that is rendered and saved.

use cutaway_core::clip::{AxisBox, ClipFile, ClipShading, ClipSource, Node, Pose};
use cutaway_core::glam::DVec3;
use cutaway_core::volume::Volume;

/// Tells operands apart, however they are ordered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OperandId(pub u64);

/// What an operand does with what is kept so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Operation {
    /// Its inside is taken away.
    #[default]
    Cut,
    /// Only its inside stays.
    Keep,
    /// Its inside is there, too.
    Union,
}

/// What an operand is.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// An object; paths are absolute.
    Object(ClipSource),
    /// What a list of operands leaves.
    Group(Vec<Operand>),
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
    /// The one operand that has any effect, while there is one.
    pub solo: Option<OperandId>,
}

impl Cutting {
    /// The tree that is rendered; none where nothing is cut. `volume` has the place of the crop box.
    pub fn to_clip(&self, volume: &Volume) -> Option<ClipFile> {
        let crop = self.crop.and_then(|crop| crop_node(&crop, volume));
        let operands = |o: &&Operand| o.visible && self.solo.is_none_or(|solo| o.holds(solo));
        let mut kept: Option<ClipFile> = None;
        for operand in self.operands.iter().filter(operands) {
            let Some(node) = operand.node() else { continue };
            kept = apply(kept, operand.operation, node);
        }
        match crop {
            Some(crop) => Some(kept.unwrap_or_else(ClipFile::everything).probe(crop)),
            None => kept,
        }
    }
}

/// Everything, once an operand is applied to it: none stands for everything.
fn apply(kept: Option<ClipFile>, operation: Operation, node: ClipFile) -> Option<ClipFile> {
    let all = || kept.clone().unwrap_or_else(ClipFile::everything);
    match operation {
        Operation::Cut => Some(all().cut(node)),
        Operation::Keep => Some(all().probe(node)),
        Operation::Union => kept.map(|kept| Node::Union(vec![kept, node]).into()),
    }
}

fn crop_node(crop: &CropBox, volume: &Volume) -> Option<ClipFile> {
    let shape = AxisBox::new(crop.min, crop.max).ok()?;
    let pose = Pose::new(*volume.world_from_voxel()).ok()?;
    Some(ClipFile::from(Node::Leaf(ClipSource::Box(shape))).with_pose(pose))
}

impl Operand {
    /// Whether it is the one of this id, or that is in it.
    pub fn holds(&self, id: OperandId) -> bool {
        let inside = match &self.content {
            Content::Group(operands) => operands.iter().any(|o| o.holds(id)),
            Content::Object(_) => false,
        };
        self.id == id || inside
    }

    /// What it is, in the space of its list; none for a group of nothing.
    fn node(&self) -> Option<ClipFile> {
        let node = match &self.content {
            Content::Object(source) => Node::Leaf(source.clone()).into(),
            Content::Group(operands) => {
                let mut kept: Option<ClipFile> = None;
                for operand in operands.iter().filter(|o| o.visible) {
                    let Some(node) = operand.node() else { continue };
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
