use std::sync::Arc;

use cutaway_core::clip::{AxisBox, Clip, FlatClip, Node, Object, Plane, Pose, Solid, Sphere};
use cutaway_core::glam::{DAffine3, DQuat, DVec3, UVec3};
use cutaway_core::volume::{Geometry, Rescale, Volume};
use cutaway_io::scene_file::{ClipSource, ClipTree};
use proptest::prelude::*;

use super::edit::{GroupKind, Place};
use super::notes::CuttingNotes;
use super::numbers::PoseNumbers;
use super::*;

/// An oblique volume.
fn volume() -> Volume {
    let turned = DAffine3::from_scale_rotation_translation(
        DVec3::new(0.4, 0.5, 0.7),
        DQuat::from_rotation_z(0.3),
        DVec3::new(-1.0, -1.0, -1.0),
    );
    volume_at(turned)
}

fn volume_at(world_from_voxel: DAffine3) -> Volume {
    let geometry = Geometry { world_from_voxel, ..Geometry::from_spacing(DVec3::ONE) };
    Volume::new(UVec3::new(5, 4, 6), vec![0u8; 120], Rescale::IDENTITY, geometry).unwrap()
}

/// Whether a tree keeps a point: the definition, without rays.
fn keeps(clip: &ClipTree, p: DVec3) -> bool {
    let p = clip.pose.object_from_world().transform_point3(p);
    match &clip.node {
        Node::Everything => true,
        Node::Leaf(ClipSource::Sphere(shape)) => shape.contains(p),
        Node::Leaf(ClipSource::Box(shape)) => shape.contains(p),
        Node::Leaf(ClipSource::Plane(shape)) => shape.contains(p),
        Node::Leaf(_) => false,
        Node::Union(parts) => parts.iter().any(|part| keeps(part, p)),
        Node::Intersection(parts) => parts.iter().all(|part| keeps(part, p)),
        Node::Difference(parts) => parts
            .split_first()
            .is_some_and(|(first, rest)| keeps(first, p) && !rest.iter().any(|part| keeps(part, p))),
        Node::Complement(part) => !keeps(part, p),
    }
}

fn kept(cutting: &Cutting, volume: &Volume, p: DVec3) -> bool {
    cutting.to_clip(volume).is_none_or(|clip| keeps(&clip, p))
}

fn vector(reach: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-reach..reach).prop_map(DVec3::from_array)
}

fn pose() -> impl Strategy<Value = Pose> {
    let moved = (vector(1.0), vector(1.0), -3.0..3.0f64, 0.4..2.0f64).prop_map(|(t, axis, angle, s)| {
        let axis = axis.try_normalize().unwrap_or(DVec3::X);
        let scale = DVec3::new(s, 1.0, -s);
        Pose::new(DAffine3::from_scale_rotation_translation(scale, DQuat::from_axis_angle(axis, angle), t))
            .unwrap()
    });
    prop_oneof![2 => Just(Pose::IDENTITY), 1 => moved]
}

fn shape() -> impl Strategy<Value = ClipSource> {
    prop_oneof![
        (vector(1.5), 0.3..1.5f64).prop_map(|(c, r)| ClipSource::Sphere(Sphere::new(c, r).unwrap())),
        (vector(1.5), 0.3..2.0f64)
            .prop_map(|(c, s)| ClipSource::Box(AxisBox::new(c - s, c + DVec3::new(s, 0.5, 1.0)).unwrap())),
        (vector(1.0), -1.0..1.0f64)
            .prop_map(|(n, d)| ClipSource::Plane(Plane::new(n + DVec3::splat(1e-3), d).unwrap())),
    ]
}

fn tree() -> impl Strategy<Value = ClipTree> {
    let crop = Just(()).prop_map(|()| {
        let shape = AxisBox::new(DVec3::ONE, DVec3::new(3.0, 2.0, 4.0)).unwrap();
        let pose = Pose::new(*volume().world_from_voxel()).unwrap();
        ClipTree::from(Node::Leaf(ClipSource::Box(shape))).with_pose(pose)
    });
    let leaf = prop_oneof![
        1 => Just(ClipTree::everything()),
        6 => (shape(), pose()).prop_map(|(s, pose)| ClipTree::from(Node::Leaf(s)).with_pose(pose)),
        2 => crop,
    ];
    leaf.prop_recursive(4, 24, 4, |inner| {
        let parts = prop::collection::vec(inner.clone(), 0..4);
        let node = prop_oneof![
            parts.clone().prop_map(Node::Union),
            parts.clone().prop_map(Node::Intersection),
            parts.prop_map(Node::Difference),
            inner.prop_map(|part| Node::Complement(Box::new(part))),
        ];
        (node, pose()).prop_map(|(node, pose)| ClipTree::from(node).with_pose(pose))
    })
}

fn points() -> impl Strategy<Value = Vec<DVec3>> {
    prop::collection::vec(vector(2.0), 24)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_list_keeps_what_its_tree_keeps(tree in tree(), points in points()) {
        let volume = volume();
        let cutting = Cutting::from_clip(&tree, &volume);
        for p in points {
            prop_assert_eq!(kept(&cutting, &volume, p), keeps(&tree, p), "{} of {:?}", p, cutting);
        }
    }

    /// The tree that is rendered, flat, says of rays what the list says of points.
    #[test]
    fn the_resolved_tree_cuts_rays_where_the_list_cuts_points(tree in tree(), from in vector(3.0), to in vector(3.0)) {
        prop_assume!(from.distance(to) > 0.5);
        let volume = volume();
        let cutting = Cutting::from_clip(&tree, &volume);
        let Some(clip) = cutting.to_clip(&volume) else { return Ok(()) };
        let resolved: Clip = cutaway_io::scene_file::resolve(&clip, &mut |_| Err::<Arc<dyn Solid>, ()>(())).unwrap();
        let flat = FlatClip::new(&resolved);
        prop_assert!(flat.is_ok());
        let direction = (to - from).normalize();
        let ray = cutaway_core::camera::Ray { origin: from, direction };
        for part in 0..20 {
            let t = (f64::from(part) + 0.5) * 0.2;
            prop_assert_eq!(contains(&resolved, &ray, t), keeps(&tree, from + direction * t));
        }
    }

    #[test]
    fn notes_bring_the_list_back_whole(tree in tree(), hide in 0usize..8, alone in 0usize..8) {
        let volume = volume();
        let mut cutting = Cutting::from_clip(&tree, &volume);
        let ids: Vec<OperandId> = all_ids(&cutting.operands);
        if let Some(id) = ids.get(hide) {
            cutting.get_mut(*id).unwrap().visible = false;
            cutting.get_mut(*id).unwrap().name = "a name".to_owned();
        }
        cutting.solo = ids.get(alone).copied();
        let text = serde_json::to_string(&CuttingNotes::new(&cutting)).unwrap();
        let notes: CuttingNotes = serde_json::from_str(&text).unwrap();
        let clip = cutting.to_clip(&volume);
        let restored = notes.restore(clip.as_ref(), &volume, ClipShading::default());
        prop_assert_eq!(restored.to_clip(&volume), clip);
        prop_assert_eq!(&CuttingNotes::new(&restored), &notes);
        // Where the tree is another one, the tree counts.
        let other: ClipTree = Node::Leaf(ClipSource::Sphere(Sphere::new(DVec3::ZERO, 77.0).unwrap())).into();
        let restored = notes.restore(Some(&other), &volume, ClipShading::default());
        prop_assert_eq!(restored.to_clip(&volume), Some(other));
    }

    #[test]
    fn edits_keep_ids_distinct_and_objects_in_their_place(tree in tree(), edits in prop::collection::vec((0u8..6, 0usize..12, 0usize..12, 0usize..4), 0..30)) {
        let volume = volume();
        let mut cutting = Cutting::from_clip(&tree, &volume);
        for (edit, a, b, index) in edits {
            let ids = all_ids(&cutting.operands);
            let (Some(a), b) = (ids.get(a).copied(), ids.get(b).copied()) else { continue };
            let place = Place { list: b, index };
            match edit {
                0 => drop(cutting.remove(a)),
                1 => drop(cutting.duplicate(a)),
                2 | 3 => {
                    let before = cutting.world_from_operand(a);
                    let held = cutting.get(a).unwrap().operands().len();
                    if cutting.move_to(a, place) {
                        prop_assert!(cutting.world_from_operand(a).abs_diff_eq(before, 1e-6 * (1.0 + before.translation.length())));
                        prop_assert_eq!(cutting.place(a).unwrap().list, b);
                        prop_assert_eq!(cutting.get(a).unwrap().operands().len(), held);
                    }
                }
                4 => drop(cutting.enclose(a)),
                _ => cutting.toggle_solo(a),
            }
            let mut after = all_ids(&cutting.operands);
            prop_assert!(cutting.solo.is_none_or(|solo| after.contains(&solo)));
            let count = after.len();
            after.sort();
            after.dedup();
            prop_assert_eq!(after.len(), count);
            let _ = cutting.to_clip(&volume);
        }
    }

    #[test]
    fn numbers_of_a_pose_make_the_pose(rows in prop::array::uniform9(-2.0..2.0f64), t in vector(5.0)) {
        let affine = DAffine3 { matrix3: cutaway_core::glam::DMat3::from_cols_array(&rows), translation: t };
        prop_assume!(affine.matrix3.determinant().abs() > 0.05);
        let pose = Pose::new(affine).unwrap();
        let numbers = PoseNumbers::new(&pose);
        let again = numbers.pose().unwrap();
        prop_assert!(again.world_from_object().abs_diff_eq(affine, 1e-9), "{numbers:?}");
        // Turning about a point leaves it where it is.
        let pivot = DVec3::new(1.0, 2.0, 3.0);
        let turned = PoseNumbers { rotation: numbers.rotation + 30.0, scale: numbers.scale * 2.0, ..numbers };
        let turned = turned.around(pivot, &pose).unwrap();
        let [a, b] = [&pose, &turned].map(|p| p.world_from_object().transform_point3(pivot));
        prop_assert!(a.distance(b) < 1e-9);
    }
}

fn all_ids(operands: &[Operand]) -> Vec<OperandId> {
    operands.iter().flat_map(|o| std::iter::once(o.id).chain(all_ids(o.operands()))).collect()
}

/// Whether a line is inside a tree at a place, by the events of its solids.
fn contains(clip: &Clip, ray: &cutaway_core::camera::Ray, t: f64) -> bool {
    let m = clip.pose.object_from_world();
    let ray = cutaway_core::camera::Ray {
        origin: m.transform_point3(ray.origin),
        direction: m.transform_vector3(ray.direction),
    };
    let all = |parts: &[Clip]| parts.iter().map(|part| contains(part, &ray, t)).collect::<Vec<_>>();
    match &clip.node {
        Node::Everything => true,
        Node::Leaf(Object { solid, .. }) => {
            let mut events = Vec::new();
            solid.events(&ray, &mut events);
            events.len() == 2 && (events[0].t..=events[1].t).contains(&t)
        }
        Node::Union(parts) => all(parts).contains(&true),
        Node::Intersection(parts) => !all(parts).contains(&false),
        Node::Difference(parts) => {
            all(parts).split_first().is_some_and(|(a, rest)| *a && !rest.contains(&true))
        }
        Node::Complement(part) => !contains(part, &ray, t),
    }
}

fn sphere(radius: f64) -> Content {
    Content::Object(ClipSource::Sphere(Sphere::new(DVec3::ZERO, radius).unwrap()))
}

#[test]
fn a_probe_of_voxels_is_the_crop_box_unless_something_is_added_later() {
    let volume = volume();
    let crop = CropBox { min: DVec3::ONE, max: DVec3::new(3.0, 3.0, 4.0) };
    let mut cutting = Cutting { crop: Some(crop), ..Cutting::default() };
    let again = Cutting::from_clip(&cutting.to_clip(&volume).unwrap(), &volume);
    assert_eq!((again.crop, again.operands.len()), (Some(crop), 0));
    cutting.add(sphere(1.0), Operation::Cut, Place::END);
    cutting.add(sphere(2.0), Operation::Union, Place::END);
    let again = Cutting::from_clip(&cutting.to_clip(&volume).unwrap(), &volume);
    assert_eq!((again.crop, again.operands.len()), (Some(crop), 2));
    let clip = cutting.to_clip(&volume).unwrap();
    let added: ClipTree =
        Node::Union(vec![clip, Node::Leaf(ClipSource::Sphere(Sphere::new(DVec3::X, 1.0).unwrap())).into()])
            .into();
    assert_eq!(Cutting::from_clip(&added, &volume).crop, None);
    // In another volume it is a box like any other.
    let elsewhere = Cutting::from_clip(&cutting.to_clip(&volume).unwrap(), &volume_at(DAffine3::IDENTITY));
    assert_eq!((elsewhere.crop, elsewhere.operands.len()), (None, 3));
}

#[test]
fn cuts_and_probes_are_read_flat() {
    let leaf = |r| ClipTree::from(Node::Leaf(ClipSource::Sphere(Sphere::new(DVec3::ZERO, r).unwrap())));
    let clip = ClipTree::everything().cut(leaf(1.0)).probe(leaf(2.0)).cut(leaf(3.0));
    let cutting = Cutting::from_clip(&clip, &volume());
    let read: Vec<_> = cutting.operands.iter().map(|o| (o.operation, o.name.as_str())).collect();
    assert_eq!(
        read,
        [(Operation::Keep, "sphere"), (Operation::Cut, "sphere 2"), (Operation::Cut, "sphere 3")]
    );
    assert!(cutting.operands.iter().all(|o| o.operands().is_empty()));
}

#[test]
fn solo_leaves_one_and_what_is_hidden_does_nothing() {
    let volume = volume();
    let mut cutting = Cutting::default();
    let small = cutting.add(sphere(0.5), Operation::Cut, Place::END);
    let group = cutting.add(Content::Group(Vec::new()), Operation::Union, Place::END);
    let inner = Place { list: Some(group), index: 0 };
    let large = cutting.add(sphere(3.0), Operation::Union, inner);
    let middle = cutting.add(sphere(1.0), Operation::Cut, Place { index: 1, ..inner });
    let at = |cutting: &Cutting, r| kept(cutting, &volume, DVec3::X * r);
    assert_eq!([0.2, 0.8, 2.0, 9.0].map(|r| at(&cutting, r)), [false, true, true, true]);
    cutting.toggle_solo(group);
    assert_eq!([0.2, 0.8, 2.0, 9.0].map(|r| at(&cutting, r)), [false, false, true, false]);
    cutting.toggle_solo(middle);
    assert_eq!([0.2, 0.8, 2.0, 9.0].map(|r| at(&cutting, r)), [true, true, false, false]);
    cutting.toggle_solo(small);
    assert_eq!([0.2, 0.8, 2.0, 9.0].map(|r| at(&cutting, r)), [false, true, true, true]);
    cutting.toggle_solo(small);
    assert_eq!(cutting.solo, None);
    cutting.get_mut(small).unwrap().visible = false;
    assert_eq!(cutting.to_clip(&volume), None, "a union adds nothing to everything");
    let hidden = cutting.with_hidden(&|source| matches!(source, ClipSource::Sphere(s) if s.radius() == 3.0));
    assert!(!hidden.get(large).unwrap().visible && hidden.get(middle).unwrap().visible);
}

#[test]
fn groups_have_kinds() {
    let mut cutting = Cutting::default();
    let group = cutting.add(Content::Group(Vec::new()), Operation::Cut, Place::END);
    for i in 1..4 {
        cutting.add(sphere(f64::from(i)), Operation::Union, Place { list: Some(group), index: 9 });
    }
    for kind in GroupKind::ALL {
        cutting.get_mut(group).unwrap().set_group_kind(kind);
        assert_eq!(cutting.get(group).unwrap().group_kind(), Some(kind));
        let operations: Vec<_> = cutting.get(group).unwrap().operands().iter().map(|o| o.operation).collect();
        assert_eq!(operations[1..], [kind.operation(); 2]);
    }
}

#[test]
fn nothing_goes_into_itself_and_names_are_told_apart() {
    let mut cutting = Cutting::default();
    let outer = cutting.add(Content::Group(Vec::new()), Operation::Cut, Place::END);
    let inner =
        cutting.add(Content::Group(Vec::new()), Operation::Union, Place { list: Some(outer), index: 0 });
    let ball = cutting.add(sphere(1.0), Operation::Union, Place { list: Some(inner), index: 0 });
    assert!(!cutting.move_to(outer, Place { list: Some(inner), index: 0 }));
    assert!(!cutting.move_to(outer, Place { list: Some(outer), index: 0 }));
    assert!(!cutting.move_to(inner, Place { list: Some(ball), index: 0 }), "a ball is no list");
    assert!(cutting.move_to(ball, Place { list: None, index: 0 }));
    assert_eq!(cutting.operands[0].id, ball);
    assert!(cutting.move_to(ball, Place { list: None, index: 2 }));
    assert_eq!(cutting.operands[1].id, ball, "behind the last");
    let copy = cutting.duplicate(ball).unwrap();
    assert_eq!(cutting.get(copy).unwrap().name, "sphere 2");
    assert_eq!(cutting.get(inner).unwrap().name, "group 2");
    assert_eq!(cutting.place(copy), Some(Place { list: None, index: 2 }));
}

#[test]
fn shapes_for_a_volume_open_it_where_it_is_seen() {
    let volume = volume();
    let find: &defaults::FindSolid<'_> = &|source| source.solid(&mut |_| Err(())).ok();
    let towards = DVec3::new(0.2, -0.9, 0.4);
    for shape in defaults::Shape::ALL {
        let source = shape.for_volume(&volume, towards).unwrap();
        let mut cutting = Cutting::default();
        let id = cutting.add(Content::Object(source), Operation::Cut, Place::END);
        let center = volume.center_in_world();
        assert!(!kept(&cutting, &volume, center + towards * 1.0), "{shape:?} cuts the near side");
        assert!(kept(&cutting, &volume, center - towards * 1.0), "{shape:?} leaves the far side");
        let fitted = cutting.fitted(id, find, &volume);
        assert_eq!(fitted.is_err(), shape == defaults::Shape::Plane);
        if let Ok(Some(pose)) = fitted {
            cutting.set_pose(id, pose);
            let at = cutting.center(id, find, center).unwrap();
            let corners = cutaway_core::clip::extremes(&volume.corners_in_world());
            assert!(at.distance(0.5 * (corners[0] + corners[1])) < 1e-9, "{at}");
        }
    }
}
