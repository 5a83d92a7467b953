//! Steps that concern operands: each is one to undo.

use cutaway_core::camera::{Ray, intersect_box};
use cutaway_core::clip::{FitError, Pose};
use cutaway_core::glam::DVec3;
use cutaway_core::segment::Segment;
use cutaway_io::scene_file::ClipSource;

use super::Document;
use crate::cutting::defaults::Shape;
use crate::cutting::edit::Place;
use crate::cutting::{Content, Cutting, OperandId, Operation};

impl Document {
    /// Changes what cuts, in a step of its own.
    pub fn cut<T>(&mut self, key: &'static str, change: impl FnOnce(&mut Cutting) -> T) -> Option<T> {
        self.settle();
        let mut result = None;
        self.edit(key, |state| result = Some(change(&mut state.cutting)));
        self.settle();
        result
    }

    /// Adds an operand where the selected one is (in it, if that is a group), and selects it. It cuts; in a group it does
    /// what the group's kind says.
    pub fn add_operand(&mut self, content: Content) -> Option<OperandId> {
        let selected = self.selected;
        let id = self.cut("add operand", |cutting| {
            let place = cutting.place_for_new(selected);
            let kind = place.list.and_then(|list| cutting.get(list)?.group_kind());
            cutting.add(content, kind.map_or(Operation::Cut, |kind| kind.operation()), place)
        });
        self.selected = id;
        id
    }

    /// Adds what lies in a file, or has numbers of its own.
    pub fn add_solid(&mut self, source: ClipSource) -> Option<OperandId> {
        self.add_operand(Content::Object(source))
    }

    /// Adds a shape that opens the volume where it is seen.
    ///
    /// # Errors
    /// One line, for a volume that no shape fits.
    pub fn add_shape(&mut self, shape: Shape) -> Result<Option<OperandId>, String> {
        let towards = -self.state().camera.axes().forward;
        let source = shape.for_volume(self.volume().lattice(), towards);
        Ok(self.add_solid(source.map_err(|e| format!("{}: {e}", shape.name()))?))
    }

    /// Centres an operand in the volume and scales it to its size; whether it moved.
    ///
    /// # Errors
    /// One line, for what has no size.
    pub fn fit_operand(&mut self, id: OperandId) -> Result<bool, FitError> {
        let find = |source: &_| self.solids.get(source);
        let Some(pose) = self.state().cutting.fitted(id, &find, self.volume().lattice())? else {
            return Ok(false);
        };
        Ok(self.cut("fit operand", |cutting| cutting.set_pose(id, pose)).unwrap_or(false))
    }

    /// Selects the object whose surface a ray meets first where the volume is, unless it is behind `opaque`, the point at
    /// which the picture ends; whether there is one. Where there is none, what is selected stays so.
    pub fn select_along(&mut self, ray: &Ray, opaque: Option<DVec3>) -> bool {
        let volume = self.volume().lattice();
        let voxel_from_world = volume.voxel_from_world();
        let origin = voxel_from_world.transform_point3(ray.origin);
        let direction = voxel_from_world.transform_vector3(ray.direction);
        let Some(inside) = intersect_box(origin, direction, volume.extent()) else { return false };
        // A cut surface is where opacity begins: just before it.
        let slack = 0.5 * volume.spacing().min_element();
        let end = opaque.map_or(f64::INFINITY, |p| (p - ray.origin).dot(ray.direction) + slack);
        let Some(reach) = Segment::new(inside.t_near(), inside.t_far().min(end)) else { return false };
        let find = |source: &_| self.solids.get(source);
        let Some(id) = self.state().cutting.first_hit(ray, reach, &find) else { return false };
        self.selected = Some(id);
        true
    }

    /// Puts an operand back to where it would be without a pose.
    pub fn reset_pose(&mut self, id: OperandId) {
        self.cut("reset pose", |cutting| cutting.set_pose(id, Pose::IDENTITY));
    }
}

impl Cutting {
    /// Where a new operand goes: into a selected group, behind anything else that is selected, or to the end.
    pub fn place_for_new(&self, selected: Option<OperandId>) -> Place {
        let Some(operand) = selected.and_then(|id| self.get(id)) else { return Place::END };
        match (&operand.content, self.place(operand.id)) {
            (Content::Group(_), _) => Place { list: Some(operand.id), index: usize::MAX },
            (_, Some(place)) => Place { index: place.index + 1, ..place },
            (_, None) => Place::END,
        }
    }
}
