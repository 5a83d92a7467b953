//! Which object is at a point of the picture.

use cutaway_core::camera::Ray;
use cutaway_core::clip::Event;
use cutaway_core::glam::DAffine3;
use cutaway_core::segment::Segment;

use super::defaults::FindSolid;
use super::{Content, Cutting, Operand, OperandId, effective};

impl Cutting {
    /// The object whose surface a ray meets first within `reach`, of those that do something: hidden ones, and those
    /// beside a solo, are not met, nor is what is not read yet. Of surfaces at one place the later operand's is met, as the
    /// one that was applied last.
    pub fn first_hit(&self, ray: &Ray, reach: Segment, find: &FindSolid<'_>) -> Option<OperandId> {
        let mut search = Search { ray, reach, find, events: Vec::new(), nearest: None };
        search.list(&self.operands, self.solo, &DAffine3::IDENTITY);
        search.nearest.map(|(_, id)| id)
    }
}

struct Search<'a> {
    ray: &'a Ray,
    reach: Segment,
    find: &'a FindSolid<'a>,
    /// Of one object; kept for the next.
    events: Vec<Event>,
    nearest: Option<(f64, OperandId)>,
}

impl Search<'_> {
    fn list(&mut self, operands: &[Operand], solo: Option<OperandId>, world_from_list: &DAffine3) {
        for operand in effective(operands, solo) {
            let world = *world_from_list * *operand.pose.world_from_object();
            // The whole group is meant where it is the one.
            let solo = solo.filter(|solo| *solo != operand.id);
            match &operand.content {
                Content::Group(operands) => self.list(operands, solo, &world),
                Content::Object(source) => {
                    let Some(solid) = (self.find)(source) else { continue };
                    let object_from_world = world.inverse();
                    let ray_in_object = Ray {
                        origin: object_from_world.transform_point3(self.ray.origin),
                        direction: object_from_world.transform_vector3(self.ray.direction),
                    };
                    self.events.clear();
                    solid.events(&ray_in_object, &mut self.events);
                    let within = self.events.iter().map(|event| event.t);
                    let within = within.filter(|t| (self.reach.t_near()..=self.reach.t_far()).contains(t));
                    if let Some(t) = within.min_by(f64::total_cmp)
                        && self.nearest.is_none_or(|(nearest, _)| t <= nearest)
                    {
                        self.nearest = Some((t, operand.id));
                    }
                }
                Content::Everything => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cutting::Operation;
    use crate::cutting::edit::Place;
    use cutaway_core::clip::{AxisBox, Plane, Pose, Sphere};
    use cutaway_core::glam::{DQuat, DVec3};
    use cutaway_io::scene_file::ClipSource;

    /// Along x, from -10, as far as 20.
    fn hit(cutting: &Cutting) -> Option<OperandId> {
        hit_from(cutting, DVec3::new(-10.0, 0.1, 0.2), DVec3::X)
    }

    fn hit_from(cutting: &Cutting, origin: DVec3, direction: DVec3) -> Option<OperandId> {
        let reach = Segment::new(0.0, 20.0).unwrap();
        cutting.first_hit(&Ray { origin, direction }, reach, &|source| source.solid(&mut |_| Err(())).ok())
    }

    fn ball(center: [f64; 3]) -> Content {
        Content::Object(ClipSource::Sphere(Sphere::new(DVec3::from_array(center), 1.0).unwrap()))
    }

    fn add(cutting: &mut Cutting, content: Content) -> OperandId {
        cutting.add(content, Operation::Cut, Place::END)
    }

    #[test]
    fn the_nearest_of_every_kind_is_hit() {
        let mut cutting = Cutting::default();
        assert_eq!(hit(&cutting), None);
        let plane = ClipSource::Plane(Plane::new(DVec3::X, 6.0).unwrap());
        let plane = add(&mut cutting, Content::Object(plane));
        assert_eq!(hit(&cutting), Some(plane));
        let far = add(&mut cutting, ball([4.0, 0.0, 0.0]));
        assert_eq!(hit(&cutting), Some(far));
        let corner = ClipSource::Box(AxisBox::new(DVec3::splat(-1.0), DVec3::ONE).unwrap());
        let near = add(&mut cutting, Content::Object(corner));
        assert_eq!(hit(&cutting), Some(near));
        let beside = add(&mut cutting, ball([-5.0, 8.0, 0.0]));
        assert_eq!(hit(&cutting), Some(near));
        assert_eq!(hit_from(&cutting, DVec3::new(-10.0, 8.0, 0.0), DVec3::X), Some(beside));
        // The ray's other half is behind the eye, and what is too far is not reached.
        assert_eq!(hit_from(&cutting, DVec3::new(5.5, 0.0, 0.0), DVec3::X), Some(plane));
        assert_eq!(hit_from(&cutting, DVec3::new(-30.0, 0.0, 0.0), DVec3::X), None);
        // From within: the wall that is seen.
        assert_eq!(hit_from(&cutting, DVec3::ZERO, DVec3::Y), Some(near));
    }

    #[test]
    fn poses_of_groups_and_objects_count() {
        let mut cutting = Cutting::default();
        let inner = add(&mut cutting, ball([0.0; 3]));
        let still = add(&mut cutting, ball([3.0, 0.0, 0.0]));
        let group = cutting.enclose(inner).unwrap();
        assert_eq!(hit(&cutting), Some(inner));
        let turned = DAffine3::from_rotation_translation(DQuat::from_rotation_z(0.3), DVec3::Y * 9.0);
        cutting.set_pose(group, Pose::new(turned).unwrap());
        assert_eq!(hit(&cutting), Some(still));
        assert_eq!(hit_from(&cutting, DVec3::new(-10.0, 9.0, 0.0), DVec3::X), Some(inner));
        let back = Pose::new(turned.inverse() * DAffine3::from_scale(DVec3::splat(4.0))).unwrap();
        cutting.set_pose(inner, back);
        assert_eq!(hit(&cutting), Some(inner));
    }

    #[test]
    fn what_does_nothing_is_not_hit() {
        let mut cutting = Cutting::default();
        let near = add(&mut cutting, ball([0.0; 3]));
        let far = add(&mut cutting, ball([4.0, 0.0, 0.0]));
        cutting.get_mut(near).unwrap().visible = false;
        assert_eq!(hit(&cutting), Some(far));
        cutting.get_mut(near).unwrap().visible = true;
        cutting.solo = Some(far);
        assert_eq!(hit(&cutting), Some(far));
        cutting.solo = None;
        assert_eq!(hit(&cutting), Some(near));
        let unread =
            ClipSource::Mesh { path: "/not/read.ply".to_owned(), space: cutaway_io::mesh::MeshSpace::File };
        cutting.get_mut(near).unwrap().content = Content::Object(unread);
        assert_eq!(hit(&cutting), Some(far));
    }
}
