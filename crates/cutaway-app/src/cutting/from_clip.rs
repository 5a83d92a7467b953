//! From a clip tree, whoever wrote it, to the list that is edited.
//!
//! What a list can say is said flat: cuts and probes one after another, a union that comes first. The rest becomes
//! groups. Every tree has a list, and the list's own tree ([`Cutting::to_clip`]) keeps the same points.

use std::collections::HashMap;

use cutaway_core::clip::{Node, Pose};
use cutaway_core::volume::Volume;
use cutaway_io::scene_file::{ClipSource, ClipTree};

use super::{Content, CropBox, Cutting, Operand, OperandId, Operation};

impl Cutting {
    /// The list of a tree. A box of voxels that is kept, and to which nothing is added later, becomes the crop box.
    pub fn from_clip(clip: &ClipTree, volume: &Volume) -> Self {
        let mut reader = Reader { next: 1, named: HashMap::new() };
        let mut operands = Vec::new();
        reader.keep(&mut operands, clip);
        let crop = take_crop(&mut operands, volume);
        Self { operands, crop, ..Self::default() }
    }
}

/// The last box that is kept in the place of the volume, taken out of the list.
fn take_crop(operands: &mut Vec<Operand>, volume: &Volume) -> Option<CropBox> {
    let after_unions = operands.iter().rposition(|o| o.operation == Operation::Union).map_or(0, |at| at + 1);
    let found = operands[after_unions..].iter().rposition(|operand| {
        let is_box = matches!(operand.content, Content::Object(ClipSource::Box(_)));
        is_box
            && operand.operation == Operation::Keep
            && operand.pose.world_from_object() == volume.world_from_voxel()
    })?;
    match operands.remove(after_unions + found).content {
        Content::Object(ClipSource::Box(shape)) => Some(CropBox { min: shape.min(), max: shape.max() }),
        // Not reached: it was looked for.
        Content::Object(_) | Content::Group(_) | Content::Everything => None,
    }
}

/// Numbers and names operands as it makes them.
struct Reader {
    next: u64,
    /// How many have which name, numbers aside.
    named: HashMap<String, u64>,
}

impl Reader {
    /// Goes on with a list of the outermost kind, so that only what is in `clip` stays of what it keeps.
    fn keep(&mut self, list: &mut Vec<Operand>, clip: &ClipTree) {
        if clip.pose != Pose::IDENTITY {
            return self.push(list, Operation::Keep, clip);
        }
        match &clip.node {
            Node::Everything => {}
            Node::Intersection(parts) => parts.iter().for_each(|part| self.keep(list, part)),
            Node::Difference(parts) if !parts.is_empty() => {
                self.keep(list, &parts[0]);
                parts[1..].iter().for_each(|part| self.push(list, Operation::Cut, part));
            }
            Node::Complement(part) => self.push(list, Operation::Cut, part),
            Node::Union(parts) if list.is_empty() && !parts.is_empty() => {
                self.keep(list, &parts[0]);
                // Everything stays everything, whatever is added.
                if !list.is_empty() {
                    parts[1..].iter().for_each(|part| self.push(list, Operation::Union, part));
                }
            }
            _ => self.push(list, Operation::Keep, clip),
        }
    }

    fn push(&mut self, list: &mut Vec<Operand>, operation: Operation, clip: &ClipTree) {
        let id = OperandId(self.next);
        self.next += 1;
        let content = self.content(&clip.node);
        let mut name = content.default_name();
        let count = self.named.entry(name.clone()).or_default();
        *count += 1;
        if *count > 1 {
            name = format!("{name} {count}");
        }
        list.push(Operand { id, name, operation, visible: true, pose: clip.pose, content });
    }

    fn content(&mut self, node: &Node<ClipSource>) -> Content {
        match node {
            Node::Everything => Content::Everything,
            Node::Leaf(source) => Content::Object(source.clone()),
            Node::Intersection(parts) if parts.is_empty() => Content::Everything,
            Node::Union(parts) | Node::Difference(parts) if parts.is_empty() => self.nothing(),
            Node::Union(parts) => self.group(Operation::Union, Operation::Union, parts),
            Node::Intersection(parts) => self.group(Operation::Keep, Operation::Keep, parts),
            Node::Difference(parts) => self.group(Operation::Union, Operation::Cut, parts),
            Node::Complement(part) => {
                let mut list = Vec::new();
                self.push(&mut list, Operation::Union, &ClipTree::everything());
                self.push(&mut list, Operation::Cut, part);
                Content::Group(list)
            }
        }
    }

    fn group(&mut self, first: Operation, rest: Operation, parts: &[ClipTree]) -> Content {
        let mut list = Vec::new();
        for (i, part) in parts.iter().enumerate() {
            self.push(&mut list, if i == 0 { first } else { rest }, part);
        }
        Content::Group(list)
    }

    fn nothing(&mut self) -> Content {
        let mut list = Vec::new();
        self.push(&mut list, Operation::Union, &ClipTree::everything());
        self.push(&mut list, Operation::Cut, &ClipTree::everything());
        Content::Group(list)
    }
}
