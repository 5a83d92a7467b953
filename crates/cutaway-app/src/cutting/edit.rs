//! Finding, adding, moving and removing operands.

use cutaway_core::clip::Pose;
use cutaway_core::glam::DAffine3;
use cutaway_io::scene_file::ClipSource;

use super::{Content, Cutting, Operand, OperandId, Operation};

/// A place in a list of operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The group that has the list; none: the outermost list.
    pub list: Option<OperandId>,
    /// How many operands come before it; more than there are: at the end.
    pub index: usize,
}

impl Place {
    /// The end of the outermost list.
    pub const END: Self = Self { list: None, index: usize::MAX };
}

/// What a group does with all that is in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GroupKind {
    /// What is in any of them.
    Union,
    /// What is in all of them.
    Intersection,
    /// The first, changed by each of the rest in turn.
    Sequence,
}

impl GroupKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Union, Self::Intersection, Self::Sequence];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Union => "union",
            Self::Intersection => "intersection",
            Self::Sequence => "cut sequence",
        }
    }

    /// What a new operand of such a group does.
    pub fn operation(self) -> Operation {
        match self {
            Self::Union => Operation::Union,
            Self::Intersection => Operation::Keep,
            Self::Sequence => Operation::Cut,
        }
    }
}

impl Content {
    /// What an operand is called before it is given a name.
    pub fn default_name(&self) -> String {
        match self {
            Self::Object(ClipSource::Sphere(_)) => "sphere".to_owned(),
            Self::Object(ClipSource::Box(_)) => "box".to_owned(),
            Self::Object(ClipSource::Plane(_)) => "plane".to_owned(),
            Self::Object(ClipSource::Mesh { path, .. } | ClipSource::Patches { path, .. }) => {
                let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
                name.to_owned()
            }
            Self::Group(_) => "group".to_owned(),
            Self::Everything => "everything".to_owned(),
        }
    }
}

impl Operand {
    /// What a group does with all that is in it; none where this is no group.
    pub fn group_kind(&self) -> Option<GroupKind> {
        let Content::Group(operands) = &self.content else { return None };
        let all = |operation| operands.iter().all(|o| o.operation == operation);
        Some(if all(Operation::Union) {
            GroupKind::Union
        } else if all(Operation::Keep) {
            GroupKind::Intersection
        } else {
            GroupKind::Sequence
        })
    }

    /// Makes a group of the kind: what all in it do is set. A first operand, which is taken whatever it does, is there.
    pub fn set_group_kind(&mut self, kind: GroupKind) {
        if let Content::Group(operands) = &mut self.content {
            for (i, operand) in operands.iter_mut().enumerate() {
                let first_of_sequence = i == 0 && kind == GroupKind::Sequence;
                operand.operation = if first_of_sequence { Operation::Union } else { kind.operation() };
            }
        }
    }

    fn largest_id(&self) -> u64 {
        self.operands().iter().map(Self::largest_id).fold(self.id.0, u64::max)
    }

    fn renumber(&mut self, next: &mut u64) {
        self.id = OperandId(*next);
        *next += 1;
        if let Content::Group(operands) = &mut self.content {
            operands.iter_mut().for_each(|o| o.renumber(next));
        }
    }
}

fn find(operands: &[Operand], id: OperandId) -> Option<&Operand> {
    operands.iter().find_map(|o| if o.id == id { Some(o) } else { find(o.operands(), id) })
}

fn find_mut(operands: &mut [Operand], id: OperandId) -> Option<&mut Operand> {
    for operand in operands {
        if operand.id == id {
            return Some(operand);
        }
        if let Content::Group(inner) = &mut operand.content
            && let Some(found) = find_mut(inner, id)
        {
            return Some(found);
        }
    }
    None
}

impl Cutting {
    /// The operand of an id.
    pub fn get(&self, id: OperandId) -> Option<&Operand> {
        find(&self.operands, id)
    }

    /// The operand of an id, to be changed.
    pub fn get_mut(&mut self, id: OperandId) -> Option<&mut Operand> {
        find_mut(&mut self.operands, id)
    }

    /// Where an operand is.
    pub fn place(&self, id: OperandId) -> Option<Place> {
        fn within(list: Option<OperandId>, operands: &[Operand], id: OperandId) -> Option<Place> {
            let here = operands.iter().position(|o| o.id == id).map(|index| Place { list, index });
            here.or_else(|| operands.iter().find_map(|o| within(Some(o.id), o.operands(), id)))
        }
        within(None, &self.operands, id)
    }

    /// From the space of a group's list (none: the outermost) to the world.
    pub fn world_from_list(&self, list: Option<OperandId>) -> DAffine3 {
        fn along(operands: &[Operand], id: OperandId) -> Option<DAffine3> {
            let holder = operands.iter().find(|o| o.holds(id))?;
            let pose = *holder.pose.world_from_object();
            if holder.id == id { Some(pose) } else { Some(pose * along(holder.operands(), id)?) }
        }
        list.and_then(|id| along(&self.operands, id)).unwrap_or(DAffine3::IDENTITY)
    }

    /// From the space of the list that an operand is in to the world.
    pub fn world_from_list_of(&self, id: OperandId) -> DAffine3 {
        self.world_from_list(self.place(id).and_then(|place| place.list))
    }

    /// From an operand's own space to the world.
    pub fn world_from_operand(&self, id: OperandId) -> DAffine3 {
        self.world_from_list(Some(id))
    }

    /// An id that no operand has.
    pub fn new_id(&self) -> OperandId {
        let largest = self.operands.iter().map(Operand::largest_id).max();
        OperandId(largest.unwrap_or(0) + 1)
    }

    /// Adds an operand and says which it is. It is visible and, where there is another of its name, told apart by a
    /// number.
    pub fn add(&mut self, content: Content, operation: Operation, place: Place) -> OperandId {
        let id = self.new_id();
        let name = self.free_name(&content.default_name());
        let operand = Operand { id, name, operation, visible: true, pose: Pose::IDENTITY, content };
        self.insert(operand, place);
        id
    }

    /// Takes an operand out.
    pub fn remove(&mut self, id: OperandId) -> Option<Operand> {
        let place = self.place(id)?;
        let removed = self.list_mut(place.list)?.remove(place.index);
        self.solo = self.solo.filter(|solo| !removed.holds(*solo));
        Some(removed)
    }

    /// Puts the same once more behind an operand, and says which that is.
    pub fn duplicate(&mut self, id: OperandId) -> Option<OperandId> {
        let place = self.place(id)?;
        let mut copy = self.get(id)?.clone();
        let mut next = self.new_id().0;
        copy.renumber(&mut next);
        copy.name = self.free_name(&copy.name);
        let new = copy.id;
        self.insert(copy, Place { index: place.index + 1, ..place });
        Some(new)
    }

    /// Moves an operand to a place in the lists as they are before it is taken out; it stays where it is in the world.
    /// Whether that can be: nothing goes into itself.
    pub fn move_to(&mut self, id: OperandId, to: Place) -> bool {
        let (Some(from), Some(operand)) = (self.place(id), self.get(id)) else { return false };
        if to.list.is_some_and(|list| operand.holds(list) || !self.is_group(list)) {
            return false;
        }
        let there = self.world_from_list(to.list).inverse() * self.world_from_list(from.list);
        let pose = if from.list == to.list {
            Ok(operand.pose)
        } else {
            Pose::new(there * *operand.pose.world_from_object())
        };
        let Ok(pose) = pose else { return false };
        // What it does among others may not be what it does alone; only its solo state goes along.
        let solo = self.solo;
        let Some(mut moved) = self.remove(id) else { return false };
        moved.pose = pose;
        let behind = to.list == from.list && from.index < to.index;
        self.insert(moved, Place { index: to.index - usize::from(behind), ..to });
        self.solo = solo;
        true
    }

    /// Puts an operand into a new group in its place, and says which group.
    pub fn enclose(&mut self, id: OperandId) -> Option<OperandId> {
        let place = self.place(id)?;
        let operation = self.get(id)?.operation;
        let group = self.add(Content::Group(Vec::new()), operation, place);
        self.move_to(id, Place { list: Some(group), index: 0 }).then_some(())?;
        if let Some(operand) = self.get_mut(id) {
            operand.operation = Operation::Union;
        }
        Some(group)
    }

    /// Sets where an operand is in its list; whether there is one.
    pub fn set_pose(&mut self, id: OperandId, pose: Pose) -> bool {
        self.get_mut(id).map(|operand| operand.pose = pose).is_some()
    }

    /// Lets one operand alone have an effect, or all again.
    pub fn toggle_solo(&mut self, id: OperandId) {
        self.solo = if self.solo == Some(id) { None } else { Some(id) };
    }

    /// Every object, with the operand it belongs to.
    pub fn objects(&self) -> Vec<(OperandId, &ClipSource)> {
        fn collect<'a>(operands: &'a [Operand], found: &mut Vec<(OperandId, &'a ClipSource)>) {
            for operand in operands {
                if let Content::Object(source) = &operand.content {
                    found.push((operand.id, source));
                }
                collect(operand.operands(), found);
            }
        }
        let mut found = Vec::new();
        collect(&self.operands, &mut found);
        found
    }

    /// The same, with those hidden that are not there (yet): a mesh that is still being read neither cuts nor keeps.
    pub fn with_hidden(&self, absent: &dyn Fn(&ClipSource) -> bool) -> Self {
        let gone: Vec<OperandId> =
            self.objects().into_iter().filter(|(_, source)| absent(source)).map(|(id, _)| id).collect();
        let mut cutting = self.clone();
        for id in gone {
            if let Some(operand) = cutting.get_mut(id) {
                operand.visible = false;
            }
        }
        cutting
    }

    fn is_group(&self, id: OperandId) -> bool {
        self.get(id).is_some_and(|o| matches!(o.content, Content::Group(_)))
    }

    fn list_mut(&mut self, list: Option<OperandId>) -> Option<&mut Vec<Operand>> {
        match list {
            None => Some(&mut self.operands),
            Some(id) => match &mut self.get_mut(id)?.content {
                Content::Group(operands) => Some(operands),
                Content::Object(_) | Content::Everything => None,
            },
        }
    }

    fn insert(&mut self, operand: Operand, place: Place) {
        let list = if place.list.is_some_and(|id| self.is_group(id)) { place.list } else { None };
        if let Some(operands) = self.list_mut(list) {
            operands.insert(place.index.min(operands.len()), operand);
        }
    }

    /// A name that no operand has: `base`, or `base` and a number.
    fn free_name(&self, base: &str) -> String {
        fn has(operands: &[Operand], name: &str) -> bool {
            operands.iter().any(|o| o.name == name || has(o.operands(), name))
        }
        let stem = base.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end();
        let stem = if stem.is_empty() { base } else { stem };
        let numbered = (2..).map(|n: u64| format!("{stem} {n}"));
        std::iter::once(base.to_owned())
            .chain(numbered)
            .find(|name| !has(&self.operands, name))
            .unwrap_or_default()
    }
}
