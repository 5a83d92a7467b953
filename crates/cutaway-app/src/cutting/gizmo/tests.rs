use cutaway_core::camera::Camera;
use cutaway_core::clip::Pose;
use cutaway_core::glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use proptest::prelude::*;

use super::*;

const SIZE: DVec2 = DVec2::new(670.0, 450.0);

fn vector(reach: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-reach..reach).prop_map(DVec3::from_array)
}

/// Looks at the neighbourhood of the origin from anywhere.
fn lens() -> impl Strategy<Value = Lens> {
    (vector(1.0), vector(0.2), 20.0..200.0f64, 10.0..80.0f64, any::<bool>(), vector(1.0)).prop_map(
        |(towards, focal, distance, view_angle, orthographic, up)| {
            let towards = towards.try_normalize().unwrap_or(DVec3::Y);
            let camera = Camera {
                position: (towards * distance + focal).to_array(),
                focal_point: focal.to_array(),
                view_up: (up + DVec3::Z * 1e-3).to_array(),
                view_angle,
                orthographic: orthographic.then_some(distance * 0.3),
            };
            Lens::new(&camera, SIZE)
        },
    )
}

fn pose() -> impl Strategy<Value = Pose> {
    (vector(4.0), vector(1.0), -3.0..3.0f64, prop::array::uniform3(0.2..3.0f64), any::<bool>()).prop_map(
        |(t, axis, angle, scale, mirrored)| {
            let turn = DQuat::from_axis_angle(axis.try_normalize().unwrap_or(DVec3::X), angle);
            let mut scale = DVec3::from_array(scale);
            scale.x *= if mirrored { -1.0 } else { 1.0 };
            Pose::new(DAffine3::from_scale_rotation_translation(scale, turn, t)).unwrap()
        },
    )
}

/// A drag of any handle from where it is drawn, of an object in a group that is posed, too.
fn drag() -> impl Strategy<Value = (Lens, Drag, DVec2)> {
    let handle = prop::sample::select(Handle::ALL.to_vec());
    let way = (-120.0..120.0f64, -120.0..120.0f64);
    (lens(), pose(), pose(), handle, any::<bool>(), way, 0.0..1.0f64).prop_filter_map(
        "a handle that is not seen",
        |(lens, pose, list, handle, own, way, along)| {
            let world_from_list = *list.world_from_object();
            let world = world_from_list * *pose.world_from_object();
            let axes = if own { Axes::Object } else { Axes::World };
            let frame = Frame::new(world.transform_point3(DVec3::new(0.1, 0.2, 0.3)), &world, axes);
            let start = place(&frame, &lens, handle, along)?;
            let drag = Drag { handle, frame, pose, world_from_list, start };
            frame.is_usable(handle, &lens).then_some((lens, drag, start + DVec2::new(way.0, way.1)))
        },
    )
}

/// A point of a handle as it is drawn.
fn place(frame: &Frame, lens: &Lens, handle: Handle, along: f64) -> Option<DVec2> {
    let size = frame.point_size(lens)?;
    let world = match handle {
        Handle::Axis(axis) => {
            let length = lengths::ARROW_FROM + along * (lengths::ARROW_TO - lengths::ARROW_FROM);
            frame.center + frame.axes[axis] * (length * size)
        }
        Handle::ScaleAxis(axis) => frame.center + frame.scale_axes[axis] * (lengths::SCALE_BOX * size),
        Handle::Plane(across) => frame.square(across, size).into_iter().sum::<DVec3>() / 4.0,
        Handle::Scale => frame.center,
        Handle::Ring(_) | Handle::ViewRing => {
            let radius = if handle == Handle::ViewRing { lengths::VIEW_RING } else { lengths::RING };
            let circle = frame.circle(frame.ring_normal(handle, lens)?, radius * size, 64);
            let near: Vec<_> =
                circle.into_iter().filter(|p| pick::is_near_half(frame, lens, handle, *p)).collect();
            near[(along * (near.len() - 1) as f64) as usize]
        }
    };
    lens.point(world)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn a_lens_sees_points_where_its_rays_go(lens in lens(), x in 0.0..670.0f64, y in 0.0..450.0f64, t in 1.0..300.0f64) {
        let point = DVec2::new(x, y);
        let ray = lens.ray(point);
        let seen = lens.point(ray.origin + ray.direction * t).unwrap();
        prop_assert!(seen.distance(point) < 1e-6, "{seen} for {point}");
        if !lens.is_orthographic() {
            prop_assert_eq!(lens.point(ray.origin - ray.direction * t), None);
        }
    }

    /// What was grabbed of an axis, or of a plane, stays under the pointer: on the plane exactly, on the axis as far as it
    /// goes (the pointer's foot on its image).
    #[test]
    fn moving_keeps_what_was_grabbed_under_the_pointer((lens, drag, to) in drag()) {
        let frame = drag.frame;
        let axis = match drag.handle {
            Handle::Axis(axis) | Handle::Plane(axis) => frame.axes[axis],
            _ => return Ok(()),
        };
        let Some(motion) = drag.motion(&lens, to, None) else { return Ok(()) };
        prop_assert!((motion.matrix3 - DMat3::IDENTITY).abs_diff_eq(DMat3::ZERO, 0.0));
        if let Handle::Axis(_) = drag.handle {
            let grabbed = frame.center + axis * lens.along_line(drag.start, frame.center, axis).unwrap();
            let now = lens.point(motion.transform_point3(grabbed)).unwrap();
            let image = lens.image_of_line(frame.center, axis).unwrap();
            let missed = to - now;
            prop_assert!(missed.dot(image.direction).abs() < 1e-5 * (1.0 + missed.length()), "{missed} along {image:?}");
            prop_assert!(motion.translation.cross(axis).length() < 1e-9 * (1.0 + motion.translation.length()));
            // The pose has it, too: in the group's own space.
            let pose = drag.pose(&lens, to, None).unwrap();
            let moved = drag.world_from_list * *pose.world_from_object();
            let before = drag.world_from_list * *drag.pose.world_from_object();
            let shift = moved.translation - before.translation;
            prop_assert!(shift.distance(motion.translation) < 1e-7 * (1.0 + moved.translation.length()));
        } else {
            let grabbed = lens.on_plane(drag.start, frame.center, axis).unwrap();
            let now = lens.point(motion.transform_point3(grabbed)).unwrap();
            prop_assert!(now.distance(to) < 1e-5, "{now} for {to}");
        }
    }

    #[test]
    fn turning_keeps_the_centre_and_every_length((lens, drag, to) in drag()) {
        if !matches!(drag.handle, Handle::Ring(_) | Handle::ViewRing) {
            return Ok(());
        }
        let Some(motion) = drag.motion(&lens, to, None) else { return Ok(()) };
        let center = drag.frame.center;
        prop_assert!(motion.transform_point3(center).distance(center) < 1e-9 * (1.0 + center.length()));
        let product = motion.matrix3.transpose() * motion.matrix3;
        prop_assert!(product.abs_diff_eq(DMat3::IDENTITY, 1e-9));
        prop_assert!(motion.matrix3.determinant() > 0.0);
        // What was grabbed turns to the spoke that the pointer is on.
        let normal = drag.frame.ring_normal(drag.handle, &lens).unwrap();
        if normal.dot(lens.direction_to(center)).abs() > 0.2 {
            let spoke = |p| lens.on_plane(p, center, normal).unwrap() - center;
            let (from, to) = (spoke(drag.start), spoke(to));
            prop_assert!((motion.matrix3 * from).normalize().distance(to.normalize()) < 1e-6);
        }
    }

    #[test]
    fn scaling_keeps_the_centre_the_side_and_the_right_angles((lens, drag, to) in drag()) {
        if !matches!(drag.handle, Handle::Scale | Handle::ScaleAxis(_)) {
            return Ok(());
        }
        let Some(motion) = drag.motion(&lens, to, None) else { return Ok(()) };
        let center = drag.frame.center;
        prop_assert!(motion.transform_point3(center).distance(center) < 1e-9 * (1.0 + center.length()));
        for axis in drag.frame.scale_axes {
            let factor = axis.dot(motion.matrix3 * axis);
            prop_assert!((0.0099..=100.1).contains(&factor), "{factor}");
            prop_assert!((motion.matrix3 * axis - axis * factor).length() < 1e-9 * factor.max(1.0));
        }
    }

    #[test]
    fn whatever_is_dragged_wherever_the_pose_can_be_undone((lens, drag, _) in drag(), x in -1e5..1e5f64, y in -1e5..1e5f64, snap in any::<bool>()) {
        let snap = snap.then_some(Snap { length: 0.5, angle: 0.26, factor: 0.1 });
        if let Some(pose) = drag.pose(&lens, DVec2::new(x, y), snap) {
            let there_and_back = *pose.world_from_object() * *pose.object_from_world();
            prop_assert!(there_and_back.is_finite());
        }
        // Where it was pressed, nothing is done.
        if let Some(motion) = drag.motion(&lens, drag.start, None) {
            prop_assert!(motion.abs_diff_eq(DAffine3::IDENTITY, 1e-6), "{motion}");
        }
    }

    #[test]
    fn a_handle_is_picked_where_it_is_drawn((lens, drag, _) in drag()) {
        let found = drag.frame.pick(&lens, drag.start);
        prop_assert!(found.is_some(), "{:?}", drag.handle);
        // What is filled wins over what lies across it.
        if matches!(drag.handle, Handle::Scale) {
            prop_assert_eq!(found, Some(drag.handle));
        }
    }

    #[test]
    fn the_gizmo_is_as_large_however_far_it_is((lens, drag, _) in drag()) {
        let frame = drag.frame;
        let size = frame.point_size(&lens).unwrap();
        let middle = lens.point(frame.center).unwrap();
        let across = DVec3::from_array(lens.forward().any_orthonormal_vector().to_array());
        let tip = lens.point(frame.center + across * (lengths::ARROW_TO * size)).unwrap();
        prop_assert!((tip.distance(middle) - lengths::ARROW_TO).abs() < 1e-6);
    }
}

fn straight() -> (Lens, Frame) {
    let camera = Camera {
        position: [0.0, -100.0, 0.0],
        focal_point: [0.0; 3],
        view_up: [0.0, 0.0, 1.0],
        view_angle: 30.0,
        orthographic: Some(45.0),
    };
    // Five points of the picture a unit of the world.
    (Lens::new(&camera, SIZE), Frame::new(DVec3::ZERO, &DAffine3::IDENTITY, Axes::World))
}

#[test]
fn handles_lie_where_they_are_expected() {
    let (lens, frame) = straight();
    let at = |x: f64, y: f64| frame.pick(&lens, 0.5 * SIZE + DVec2::new(x, -y));
    assert_eq!(at(50.0, 0.0), Some(Handle::Axis(0)));
    assert_eq!(at(0.0, 50.0), Some(Handle::Axis(2)));
    assert_eq!(at(102.0, 3.0), Some(Handle::ScaleAxis(0)));
    assert_eq!(at(30.0, 30.0), Some(Handle::Plane(1)));
    assert_eq!(at(-45.2, -45.2), Some(Handle::Ring(1)));
    assert_eq!(at(-83.4, 83.4), Some(Handle::ViewRing));
    assert_eq!(at(2.0, 2.0), Some(Handle::Scale));
    assert_eq!(at(-85.0, -30.0), None);
    assert_eq!(at(200.0, 0.0), None);
}

#[test]
fn drags_go_in_steps_where_they_are_asked_to() {
    let (lens, frame) = straight();
    let start = 0.5 * SIZE + DVec2::new(50.0, 0.0);
    let drag = Drag {
        handle: Handle::Axis(0),
        frame,
        pose: Pose::IDENTITY,
        world_from_list: DAffine3::IDENTITY,
        start,
    };
    let snap = Snap { length: 2.0, angle: 15f64.to_radians(), factor: 0.25 };
    let moved = drag.motion(&lens, start + DVec2::new(16.0, 40.0), Some(snap)).unwrap();
    assert!(moved.translation.distance(DVec3::X * 4.0) < 1e-12, "{moved}: 3.2 units are 4 in steps of 2");
    let start = 0.5 * SIZE + DVec2::new(64.0, 0.0);
    let turn = Drag { handle: Handle::ViewRing, start, ..drag };
    let turned = turn.motion(&lens, 0.5 * SIZE + DVec2::new(64.0, 64.0 * 0.3), Some(snap)).unwrap();
    let expected = DMat3::from_axis_angle(DVec3::Y, 15f64.to_radians());
    assert!(turned.matrix3.abs_diff_eq(expected, 1e-9), "{turned}");
    let start = 0.5 * SIZE + DVec2::new(102.0, 0.0);
    let stretch = Drag { handle: Handle::ScaleAxis(0), start, ..drag };
    let stretched = stretch.motion(&lens, start + DVec2::new(60.0, 0.0), Some(snap)).unwrap();
    assert!(stretched.matrix3.abs_diff_eq(DMat3::from_diagonal(DVec3::new(1.5, 1.0, 1.0)), 1e-9));
    // Through the middle and beyond: small, but there.
    let squeezed = stretch.motion(&lens, start - DVec2::new(300.0, 0.0), Some(snap)).unwrap();
    assert!((squeezed.matrix3.x_axis.x - 0.25).abs() < 1e-12);
}
