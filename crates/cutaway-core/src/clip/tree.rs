//! The clip tree: which part of space is kept.
//!
//! A tree's inside is what a renderer shows. Leaves are everything or objects, nodes are set operations; any node may
//! have a pose, which moves all below it. A scene file holds the same tree with the names of files for leaves;
//! [`Clip::map`] turns one into the other.

use std::sync::Arc;

use super::{Pose, Solid};

/// Tells objects of a tree apart. Ids need not be distinct: what has the same id moves together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectId(pub u32);

/// A solid in a tree. Solids are shared, never copied.
#[derive(Clone, Debug)]
pub struct Object {
    /// Which one.
    pub id: ObjectId,
    /// Its surface.
    pub solid: Arc<dyn Solid>,
}

/// A set of points: a node with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip<L = Object> {
    /// From the node's own space to that of the node above.
    pub pose: Pose,
    /// What it is.
    pub node: Node<L>,
}

/// What a set of points is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Node<L = Object> {
    /// All of space: of the volume nothing is cut.
    Everything,
    /// The inside of an object.
    Leaf(L),
    /// In any of them; of none: nothing.
    Union(Vec<Clip<L>>),
    /// In all of them; of none: everything.
    Intersection(Vec<Clip<L>>),
    /// In the first and in none of the rest; of none: nothing.
    Difference(Vec<Clip<L>>),
    /// Not in it.
    Complement(Box<Clip<L>>),
}

impl<L> From<Node<L>> for Clip<L> {
    fn from(node: Node<L>) -> Self {
        Self { pose: Pose::IDENTITY, node }
    }
}

impl<L> Clip<L> {
    /// All of space.
    pub fn everything() -> Self {
        Node::Everything.into()
    }

    /// The same with another pose.
    pub fn with_pose(self, pose: Pose) -> Self {
        Self { pose, ..self }
    }

    /// Cuts `object` away: what is kept is outside it.
    ///
    /// Cuts and probes one after another stay one difference with one intersection at its head, however many there
    /// are: `((A - B) ∩ C) - D` is `(A ∩ C) - B - D`.
    pub fn cut(mut self, object: Self) -> Self {
        match &mut self.node {
            Node::Difference(parts) if !parts.is_empty() && self.pose == Pose::IDENTITY => {
                parts.push(object);
                self
            }
            _ => Node::Difference(vec![self, object]).into(),
        }
    }

    /// Probes with `object`: what is kept is inside it.
    pub fn probe(mut self, object: Self) -> Self {
        if self.pose != Pose::IDENTITY {
            return Node::Intersection(vec![self, object]).into();
        }
        match &mut self.node {
            Node::Everything => object,
            Node::Intersection(parts) => {
                parts.push(object);
                self
            }
            Node::Difference(parts) if !parts.is_empty() => {
                let first = std::mem::replace(&mut parts[0], Node::Everything.into());
                parts[0] = first.probe(object);
                self
            }
            _ => Node::Intersection(vec![self, object]).into(),
        }
    }

    /// The same tree with other leaves; stops at the first that cannot be made. Leaves come from first to last.
    pub fn map<M, E>(&self, leaf: &mut dyn FnMut(&L) -> Result<M, E>) -> Result<Clip<M>, E> {
        let mut all = |parts: &[Self]| parts.iter().map(|part| part.map(leaf)).collect::<Result<_, E>>();
        let node = match &self.node {
            Node::Everything => Node::Everything,
            Node::Union(parts) => Node::Union(all(parts)?),
            Node::Intersection(parts) => Node::Intersection(all(parts)?),
            Node::Difference(parts) => Node::Difference(all(parts)?),
            Node::Complement(part) => Node::Complement(Box::new(part.map(leaf)?)),
            Node::Leaf(source) => Node::Leaf(leaf(source)?),
        };
        Ok(Clip { pose: self.pose, node })
    }

    /// Calls `visit` with every node that is a leaf, from first to last.
    pub fn visit_leaves(&mut self, visit: &mut dyn FnMut(&mut L, &mut Pose)) {
        match &mut self.node {
            Node::Everything => {}
            Node::Leaf(leaf) => visit(leaf, &mut self.pose),
            Node::Union(parts) | Node::Intersection(parts) | Node::Difference(parts) => {
                parts.iter_mut().for_each(|part| part.visit_leaves(visit));
            }
            Node::Complement(part) => part.visit_leaves(visit),
        }
    }
}

impl Clip {
    /// The inside of a solid.
    pub fn object(id: ObjectId, solid: Arc<dyn Solid>) -> Self {
        Node::Leaf(Object { id, solid }).into()
    }

    /// Moves every object of this id to a pose within the node above it; whether there is any. Costs a walk over the
    /// tree: nothing that a solid was prepared with changes.
    pub fn set_pose(&mut self, id: ObjectId, pose: Pose) -> bool {
        let mut found = false;
        self.visit_leaves(&mut |object, of_object| {
            if object.id == id {
                *of_object = pose;
                found = true;
            }
        });
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(name: char) -> Clip<char> {
        Node::Leaf(name).into()
    }

    #[test]
    fn cuts_and_probes_stay_flat() {
        let clip = Clip::everything().cut(leaf('b')).probe(leaf('c')).cut(leaf('d')).probe(leaf('e'));
        let kept = Node::Intersection(vec![leaf('c'), leaf('e')]).into();
        let kept = match clip.node {
            Node::Difference(parts) => (parts == [kept, leaf('b'), leaf('d')]).then_some(()),
            _ => None,
        };
        assert_eq!(kept, Some(()));
        assert_eq!(Clip::everything().probe(leaf('a')), leaf('a'));
        assert_eq!(leaf('a').probe(leaf('b')).node, Node::Intersection(vec![leaf('a'), leaf('b')]));
        let union: Clip<char> = Node::Union(vec![leaf('a'), leaf('b')]).into();
        assert_eq!(union.clone().cut(leaf('c')).node, Node::Difference(vec![union, leaf('c')]));
    }

    #[test]
    fn leaves_are_mapped_in_order_until_one_fails() {
        let clip = Clip::everything().cut(leaf('a')).probe(leaf('b')).cut(leaf('c'));
        let mut order = String::new();
        let upper = clip.map(&mut |c: &char| {
            order.push(*c);
            Ok::<_, ()>(c.to_ascii_uppercase())
        });
        assert_eq!((order.as_str(), upper.is_ok()), ("bac", true));
        assert_eq!(clip.map(&mut |c: &char| if *c == 'a' { Err(*c) } else { Ok(*c) }), Err('a'));
    }
}
