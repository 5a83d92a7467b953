use cutaway_core::camera::Camera;
use cutaway_core::glam::{DMat3, DQuat};
use proptest::prelude::*;

use super::*;

const SIZE: DVec2 = DVec2::new(670.0, 450.0);

fn vector(reach: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-reach..reach).prop_map(DVec3::from_array)
}

/// An oblique grid of 41 x 31 x 21 voxels around the origin, a box in it, seen from anywhere.
fn scene() -> impl Strategy<Value = (CropFrame, CropBox, Lens)> {
    let grid = (vector(1.0), -3.0..3.0f64, prop::array::uniform3(0.4..2.0f64), any::<bool>());
    let ends = prop::array::uniform3((0.0..0.45f64, 0.55..1.0f64));
    let seen = (vector(1.0), 120.0..300.0f64, any::<bool>());
    (grid, ends, seen).prop_map(
        |((axis, angle, spacing, mirrored), ends, (towards, distance, orthographic))| {
            let extent = DVec3::new(40.0, 30.0, 20.0);
            let turn = DQuat::from_axis_angle(axis.try_normalize().unwrap_or(DVec3::X), angle);
            let mut scale = DVec3::from_array(spacing);
            scale.x *= if mirrored { -1.0 } else { 1.0 };
            let about = DAffine3::from_scale_rotation_translation(scale, turn, DVec3::ZERO);
            let world_from_voxel = about * DAffine3::from_translation(-0.5 * extent);
            let crop = CropBox {
                min: DVec3::from_array(ends.map(|e| e.0)) * extent,
                max: DVec3::from_array(ends.map(|e| e.1)) * extent,
            };
            let towards = towards.try_normalize().unwrap_or(DVec3::Y);
            let camera = Camera {
                position: (towards * distance).to_array(),
                focal_point: [0.0; 3],
                view_up: [0.1, 0.2, 1.0],
                view_angle: 30.0,
                orthographic: orthographic.then_some(60.0),
            };
            (CropFrame { world_from_voxel, extent }, crop, Lens::new(&camera, SIZE))
        },
    )
}

fn is_within(crop: &CropBox, frame: &CropFrame) -> bool {
    let least = DVec3::splat(LEAST - 1e-9);
    crop.min.cmpge(DVec3::ZERO).all()
        && crop.max.cmple(frame.extent).all()
        && (crop.max - crop.min).cmpge(least).all()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// Inside the volume a face follows the pointer along its axis, a corner wherever it goes.
    #[test]
    fn a_handle_stays_under_the_pointer(
        (frame, crop, lens) in scene(),
        which in 0usize..14,
        way in (-200.0..200.0f64, -200.0..200.0f64),
    ) {
        let handle = CropHandle::all().nth(which).unwrap();
        prop_assume!(frame.is_usable(&crop, &lens, handle));
        let at = frame.in_world(&crop, handle);
        let start = lens.point(at).unwrap();
        let to = start + DVec2::new(way.0, way.1);
        let Some(dragged) = frame.drag(&crop, handle, &lens, [start, to]) else { return Ok(()) };
        prop_assert!(is_within(&dragged, &frame), "{dragged:?}");
        let (before, after) = (handle.in_voxel(&crop), handle.in_voxel(&dragged));
        let free = |axis: usize| {
            let room = after[axis] > 1e-9 && after[axis] < frame.extent[axis] - 1e-9;
            room && dragged.max[axis] - dragged.min[axis] > LEAST + 1e-9
        };
        let now = lens.point(frame.in_world(&dragged, handle)).unwrap();
        match handle {
            CropHandle::Face { axis, .. } => {
                for other in (0..3).filter(|other| *other != axis) {
                    prop_assert_eq!(before[other], after[other]);
                }
                if free(axis) {
                    let image = lens.image_of_line(at, frame.world_from_voxel.matrix3.col(axis)).unwrap();
                    prop_assert!((to - now).dot(image.direction).abs() < 1e-5);
                }
            }
            CropHandle::Corner(_) if (0..3).all(free) => prop_assert!(now.distance(to) < 1e-5),
            CropHandle::Corner(_) => {}
        }
    }

    /// What is kept of the facing face is what is in the rectangle, where that is along the grid; and no more than what was
    /// kept before.
    #[test]
    fn a_rectangle_trims_the_two_axes_across_the_view(
        (frame, crop, lens) in scene(),
        a in (0.0..670.0f64, 0.0..450.0f64),
        b in (0.0..670.0f64, 0.0..450.0f64),
    ) {
        let rectangle = [DVec2::new(a.0, a.1), DVec2::new(b.0, b.1)];
        let (axis, high) = frame.facing(&crop, &lens);
        let Some(trimmed) = frame.trim(&crop, &lens, rectangle) else { return Ok(()) };
        prop_assert!(is_within(&trimmed, &frame));
        prop_assert!(trimmed.min.cmpge(crop.min).all() && trimmed.max.cmple(crop.max).all());
        prop_assert_eq!((trimmed.min[axis], trimmed.max[axis]), (crop.min[axis], crop.max[axis]));
        // Each point of the face that is seen within the rectangle is still there.
        let [low, most] = [rectangle[0].min(rectangle[1]), rectangle[0].max(rectangle[1])];
        for i in 0..100 {
            let (u, v) = (f64::from(i % 10) / 9.0, f64::from(i / 10) / 9.0);
            let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut p = if high { crop.max } else { crop.min };
            p[x] = crop.min[x] + u * (crop.max[x] - crop.min[x]);
            p[y] = crop.min[y] + v * (crop.max[y] - crop.min[y]);
            let seen = lens.point(frame.world_from_voxel.transform_point3(p)).unwrap();
            if seen.cmpge(low).all() && seen.cmple(most).all() {
                let within = p.cmpge(trimmed.min - 1e-6).all() && p.cmple(trimmed.max + 1e-6).all();
                prop_assert!(within, "{p} is in the rectangle, not in {trimmed:?}");
            }
        }
    }
}

#[test]
fn a_rectangle_along_the_grid_is_met_exactly() {
    let frame = CropFrame {
        world_from_voxel: DAffine3::from_mat3(DMat3::IDENTITY),
        extent: DVec3::new(40.0, 30.0, 20.0),
    };
    let crop = CropBox { min: DVec3::ZERO, max: frame.extent };
    let camera = Camera {
        position: [20.0, -100.0, 10.0],
        focal_point: [20.0, 0.0, 10.0],
        view_up: [0.0, 0.0, 1.0],
        view_angle: 30.0,
        orthographic: Some(22.5),
    };
    // Ten points a voxel, x to the right, z up; y looks at the viewer with its small end.
    let lens = Lens::new(&camera, SIZE);
    assert_eq!(frame.facing(&crop, &lens), (1, false));
    let point = |x: f64, z: f64| 0.5 * SIZE + 10.0 * DVec2::new(x - 20.0, 10.0 - z);
    let trimmed = frame.trim(&crop, &lens, [point(5.0, 18.0), point(30.0, 4.0)]).unwrap();
    assert!(trimmed.min.distance(DVec3::new(5.0, 0.0, 4.0)) < 1e-9, "{trimmed:?}");
    assert!(trimmed.max.distance(DVec3::new(30.0, 30.0, 18.0)) < 1e-9, "{trimmed:?}");
    // From any corner to the one opposite.
    assert_eq!(frame.trim(&crop, &lens, [point(30.0, 18.0), point(5.0, 4.0)]), Some(trimmed));
    // Beside the box nothing is left; around it nothing is trimmed.
    assert_eq!(frame.trim(&crop, &lens, [point(-9.0, -9.0), point(-5.0, 40.0)]), None);
    assert_eq!(frame.trim(&crop, &lens, [point(-9.0, -9.0), point(50.0, 40.0)]), None);
}

#[test]
fn the_nearest_handle_is_picked() {
    let frame = CropFrame { world_from_voxel: DAffine3::IDENTITY, extent: DVec3::splat(20.0) };
    let crop = CropBox { min: DVec3::ZERO, max: frame.extent };
    let camera = Camera {
        position: [10.0, -100.0, 10.0],
        focal_point: [10.0; 3],
        view_up: [0.0, 0.0, 1.0],
        view_angle: 30.0,
        orthographic: Some(22.5),
    };
    let lens = Lens::new(&camera, SIZE);
    let pick = |x: f64, z: f64| frame.pick(&crop, &lens, 0.5 * SIZE + 10.0 * DVec2::new(x - 10.0, 10.0 - z));
    // Of two corners behind each other the one at y = 0; the faces across the view cannot be dragged.
    assert_eq!(pick(20.0, 0.0), Some(CropHandle::Corner(1)));
    assert_eq!(pick(20.0, 10.0), Some(CropHandle::Face { axis: 0, high: true }));
    assert_eq!(pick(10.0, 10.0), None);
}
