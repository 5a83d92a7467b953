//! A clip tree laid flat for rendering: its objects with their way from the world, and the expression over them.
//!
//! The expression is a tree of *and* and *or* gates, each of which counts its true inputs. Inputs may be inverted, so
//! that a difference is an *and* with inverted inputs and a complement is no gate at all. When a ray crosses the
//! surface of an object, only the gates above it are counted again, and only as far as they change: a step of a sweep
//! costs the depth of the tree, not its size. Gates are plain numbers in one list, parents before children.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::nearby::Boxes;
use super::{Clip, Node, Object, ObjectId, Pose, PoseError, Solid, box_corners};
use crate::camera::Ray;

/// An object, ready for rays.
#[derive(Clone, Debug)]
pub struct FlatLeaf {
    /// Which object.
    pub object: ObjectId,
    /// Its surface.
    pub solid: Arc<dyn Solid>,
    object_from_world: DAffine3,
    output: Wire,
}

/// Where a value of an expression goes, as plain numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlatWire {
    /// Index of a gate; none: the value is the expression's own.
    pub gate: Option<u32>,
    /// Whether the opposite goes there.
    pub inverted: bool,
}

/// A gate of an expression, as plain numbers: for a device that is to evaluate it as [`Sweep`](super::Sweep) does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlatGate {
    /// The number of true inputs from which on it is true.
    pub threshold: u32,
    /// How many inputs are true outside all objects.
    pub true_inputs: u32,
    /// Where it goes: to a gate before it in the list, if to any.
    pub output: FlatWire,
}

impl From<Wire> for FlatWire {
    fn from(wire: Wire) -> Self {
        Self { gate: (wire.gate != ROOT).then_some(wire.gate), inverted: wire.inverted }
    }
}

impl FlatLeaf {
    /// Where its inside goes in the expression.
    pub fn output(&self) -> FlatWire {
        self.output.into()
    }

    /// All poses above the object in one, inverted.
    pub fn object_from_world(&self) -> &DAffine3 {
        &self.object_from_world
    }

    /// The ray in object space; `t` is the same, the direction's length is not.
    pub fn ray_in_object(&self, ray_in_world: &Ray) -> Ray {
        Ray {
            origin: self.object_from_world.transform_point3(ray_in_world.origin),
            direction: self.object_from_world.transform_vector3(ray_in_world.direction),
        }
    }

    /// Corners of a box along the world's axes that holds the whole surface; infinite or NaN for a half-space.
    fn bounds_in_world(&self) -> [DVec3; 2] {
        let world_from_object = self.object_from_world.inverse();
        let corners =
            box_corners(self.solid.bounds()).map(|corner| world_from_object.transform_point3(corner));
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        if !corners.iter().all(|corner| corner.is_finite()) {
            return empty;
        }
        corners.iter().fold(empty, |[low, high], corner| [low.min(*corner), high.max(*corner)])
    }

    /// The unit normal in the world, out of the object, of a part of its surface at a point on it.
    pub fn normal_in_world(&self, surface: u32, point_in_world: DVec3) -> DVec3 {
        let point_in_object = self.object_from_world.transform_point3(point_in_world);
        let normal_in_object = self.solid.normal(surface, point_in_object);
        // Normals are covectors: they go by the transpose of the inverse, reflections included.
        let normal = self.object_from_world.matrix3.transpose() * normal_in_object;
        normal.try_normalize().unwrap_or(normal_in_object)
    }
}

/// Where a value goes.
#[derive(Clone, Copy, Debug)]
struct Wire {
    /// Index of a gate, or [`ROOT`].
    gate: u32,
    inverted: bool,
}

/// The wire's end where a value is the expression's own.
const ROOT: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Gate {
    /// True inputs that make it true: 1 for *or*, all for *and*.
    threshold: u32,
    output: Wire,
}

/// The state of an expression: whether each gate's inputs hold. Made by [`FlatClip::reset`], kept between rays.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    true_inputs: Vec<u32>,
    pub(super) kept: bool,
}

/// A clip tree for rendering. Making one costs its number of nodes.
#[derive(Clone, Debug)]
pub struct FlatClip {
    leaves: Vec<FlatLeaf>,
    gates: Vec<Gate>,
    /// The state outside all objects.
    outside: State,
    /// Where the objects are, if there are many.
    boxes: Option<Boxes>,
}

impl FlatClip {
    /// Fails where poses, each of which can be undone, cannot be undone together.
    pub fn new(clip: &Clip) -> Result<Self, PoseError> {
        let outside = State { true_inputs: Vec::new(), kept: false };
        let mut flat = Self { leaves: Vec::new(), gates: Vec::new(), outside, boxes: None };
        let mut constants = Vec::new();
        flat.add(clip, Pose::IDENTITY, Wire { gate: ROOT, inverted: false }, &mut constants)?;
        let mut state = State { true_inputs: vec![0; flat.gates.len()], kept: false };
        // Gates begin with no true input. What they then say goes up its wire as a change would, outer gates first
        // (parents come before children in the list), so that whatever changes a gate finds it already counted above.
        for gate in 0..flat.gates.len() {
            let Gate { threshold, output } = flat.gates[gate];
            if (threshold == 0) != output.inverted {
                flat.raise(output, &mut state);
            }
        }
        for leaf in &flat.leaves {
            if leaf.output.inverted {
                flat.raise(leaf.output, &mut state);
            }
        }
        for wire in constants {
            if !wire.inverted {
                flat.raise(wire, &mut state);
            }
        }
        flat.outside = state;
        let boxes: Vec<_> = flat.leaves.iter().map(FlatLeaf::bounds_in_world).collect();
        flat.boxes = Boxes::new(&boxes);
        Ok(flat)
    }

    fn add(
        &mut self,
        clip: &Clip,
        above: Pose,
        output: Wire,
        constants: &mut Vec<Wire>,
    ) -> Result<(), PoseError> {
        let pose = above.after(&clip.pose)?;
        let inverted = Wire { inverted: !output.inverted, ..output };
        let (parts, threshold) = match &clip.node {
            Node::Everything => {
                constants.push(output);
                return Ok(());
            }
            Node::Leaf(Object { id, solid }) => {
                let object_from_world = *pose.object_from_world();
                self.leaves.push(FlatLeaf { object: *id, solid: solid.clone(), object_from_world, output });
                return Ok(());
            }
            Node::Complement(part) => return self.add(part, pose, inverted, constants),
            // Nothing minus anything is nothing: an *or* without inputs.
            Node::Difference(parts) if parts.is_empty() => (parts, 1),
            Node::Union(parts) => (parts, 1),
            Node::Intersection(parts) | Node::Difference(parts) => (parts, parts.len() as u32),
        };
        let gate = self.gates.len() as u32;
        self.gates.push(Gate { threshold, output });
        let subtracts = matches!(clip.node, Node::Difference(_));
        for (i, part) in parts.iter().enumerate() {
            self.add(part, pose, Wire { gate, inverted: subtracts && i > 0 }, constants)?;
        }
        Ok(())
    }

    /// The same in another world: one that an invertible map leads to.
    pub(crate) fn seen_from(&self, other_from_world: &DAffine3) -> Self {
        let world_from_other = other_from_world.inverse();
        let mut seen = self.clone();
        for leaf in &mut seen.leaves {
            leaf.object_from_world *= world_from_other;
        }
        seen
    }

    /// The objects, in the order of the tree.
    pub fn leaves(&self) -> &[FlatLeaf] {
        &self.leaves
    }

    /// The gates of the expression, parents before children.
    pub fn gates(&self) -> impl ExactSizeIterator<Item = FlatGate> {
        self.gates.iter().zip(&self.outside.true_inputs).map(|(gate, &true_inputs)| FlatGate {
            threshold: gate.threshold,
            true_inputs,
            output: gate.output.into(),
        })
    }

    /// Whether what is outside all objects is kept: all of a ray that meets none.
    pub fn keeps_outside(&self) -> bool {
        self.outside.kept
    }

    /// Replaces `found` by the objects whose boxes the line of a ray meets, ascending: all of them where they are few.
    pub(super) fn leaves_along(&self, ray_in_world: &Ray, stack: &mut Vec<u32>, found: &mut Vec<u32>) {
        match &self.boxes {
            Some(boxes) => boxes.along(ray_in_world, stack, found),
            None => {
                found.clear();
                found.extend(0..self.leaves.len() as u32);
            }
        }
    }

    /// Puts a state outside all objects.
    pub(super) fn reset(&self, state: &mut State) {
        state.true_inputs.clone_from(&self.outside.true_inputs);
        state.kept = self.outside.kept;
    }

    /// Tells the expression that a ray is now inside (outside) an object.
    pub(super) fn set(&self, leaf: usize, inside: bool, state: &mut State) {
        let output = self.leaves[leaf].output;
        self.change(output, inside != output.inverted, state);
    }

    /// An input that was false becomes true.
    fn raise(&self, wire: Wire, state: &mut State) {
        self.change(wire, true, state);
    }

    /// An input changes to `value`; gates above follow.
    fn change(&self, mut wire: Wire, mut value: bool, state: &mut State) {
        while wire.gate != ROOT {
            let gate = &self.gates[wire.gate as usize];
            let inputs = &mut state.true_inputs[wire.gate as usize];
            let before = *inputs >= gate.threshold;
            *inputs = if value { *inputs + 1 } else { *inputs - 1 };
            let after = *inputs >= gate.threshold;
            if before == after {
                return;
            }
            wire = gate.output;
            value = after != wire.inverted;
        }
        state.kept = value;
    }
}
