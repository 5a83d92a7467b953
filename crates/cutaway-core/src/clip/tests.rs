//! Trees against points, laws of the algebra, and the rules of the sweep.

use std::num::NonZeroU32;
use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::camera::Ray;
use crate::segment::Segment;
use Crossing::{Entering, Leaving};

/// A solid whose events are given, as those of a broken mesh may be; surfaces are numbered in their order.
#[derive(Debug)]
struct Scripted(Vec<(f64, Crossing)>);

impl Solid for Scripted {
    fn events(&self, _ray: &Ray, events: &mut Vec<Event>) {
        let numbered = self.0.iter().zip(0..);
        events.extend(numbered.map(|(&(t, crossing), surface)| Event { t, crossing, surface }));
    }

    fn normal(&self, _surface: u32, _point: DVec3) -> DVec3 {
        DVec3::X
    }

    fn bounds(&self) -> [DVec3; 2] {
        [DVec3::NEG_INFINITY, DVec3::INFINITY]
    }
}

fn scripted(events: &[(f64, Crossing)]) -> Clip {
    Clip::object(ObjectId(0), Arc::new(Scripted(events.to_vec())))
}

fn object(solid: impl Solid + 'static) -> Clip {
    Clip::object(ObjectId(0), Arc::new(solid))
}

fn slab(from: f64, to: f64) -> Clip {
    object(AxisBox::new(DVec3::new(from, -9.0, -9.0), DVec3::new(to, 9.0, 9.0)).unwrap())
}

fn union(parts: Vec<Clip>) -> Clip {
    Node::Union(parts).into()
}

fn complement(clip: Clip) -> Clip {
    Node::Complement(Box::new(clip)).into()
}

const ALL: SegmentLimit = SegmentLimit { count: SegmentCount::Auto, backmost: false };

const ALONG_X: Ray = Ray { origin: DVec3::ZERO, direction: DVec3::X };

fn range(from: f64, to: f64) -> Segment {
    Segment::new(from, to).unwrap()
}

/// Segments of `ray` within 0 to 10, and how many lines were repaired.
fn cast(clip: &Clip, ray: &Ray) -> (Vec<ClipSegment>, u64) {
    let mut sweep = Sweep::new();
    let found = sweep.cast(&FlatClip::new(clip).unwrap(), ray, range(0.0, 10.0), ALL).to_vec();
    (found, sweep.repaired())
}

fn ends(clip: &Clip) -> Vec<(f64, f64)> {
    cast(clip, &ALONG_X).0.iter().map(|s| (s.segment.t_near(), s.segment.t_far())).collect()
}

#[test]
fn everything_and_nothing() {
    assert_eq!(ends(&Clip::everything()), [(0.0, 10.0)]);
    assert_eq!(ends(&complement(Clip::everything())), []);
    assert_eq!(ends(&complement(complement(Clip::everything()))), [(0.0, 10.0)]);
    assert_eq!(ends(&union(vec![])), []);
    assert_eq!(ends(&complement(union(vec![]))), [(0.0, 10.0)]);
    assert_eq!(ends(&Node::Intersection(vec![]).into()), [(0.0, 10.0)]);
    assert_eq!(ends(&complement(Node::Intersection(vec![]).into())), []);
    assert_eq!(ends(&Node::Difference(vec![]).into()), []);
    assert_eq!(ends(&Node::Difference(vec![Clip::everything()]).into()), [(0.0, 10.0)]);
    assert_eq!(ends(&slab(2.0, 3.0).cut(Clip::everything())), []);
    assert_eq!(ends(&union(vec![slab(2.0, 3.0), Clip::everything()])), [(0.0, 10.0)]);
}

#[test]
fn cutting_and_probing_a_box() {
    assert_eq!(ends(&Clip::everything().cut(slab(2.0, 3.0))), [(0.0, 2.0), (3.0, 10.0)]);
    assert_eq!(ends(&Clip::everything().probe(slab(2.0, 3.0))), [(2.0, 3.0)]);
    assert_eq!(ends(&Clip::everything().cut(slab(2.0, 3.0)).cut(slab(-5.0, 1.0))), [(1.0, 2.0), (3.0, 10.0)]);
    assert_eq!(
        ends(&Clip::everything().probe(slab(8.0, 30.0)).cut(slab(9.0, 9.5))),
        [(8.0, 9.0), (9.5, 10.0)]
    );
}

#[test]
fn segments_say_what_bounds_them_and_normals_face_out_of_what_is_kept() {
    let clip = Clip::everything().cut(slab(2.0, 3.0)).cut(slab(6.0, 20.0));
    let flat = FlatClip::new(&clip).unwrap();
    let mut sweep = Sweep::new();
    let found = sweep.cast(&flat, &ALONG_X, range(0.0, 10.0), ALL).to_vec();
    assert_eq!(found.len(), 2);
    assert_eq!(found[0].near, None);
    assert_eq!(found[0].far, Some(Boundary { leaf: 0, surface: 0, crossing: Entering }));
    assert_eq!(found[1].near, Some(Boundary { leaf: 0, surface: 1, crossing: Leaving }));
    assert_eq!(found[1].far, Some(Boundary { leaf: 1, surface: 0, crossing: Entering }));
    assert_eq!(found[0].near_normal(&flat, &ALONG_X), None);
    for s in &found {
        assert_eq!(s.far_normal(&flat, &ALONG_X), Some(DVec3::X));
    }
    assert_eq!(found[1].near_normal(&flat, &ALONG_X), Some(DVec3::NEG_X));
    let probe = FlatClip::new(&slab(2.0, 3.0)).unwrap();
    let found = sweep.cast(&probe, &ALONG_X, range(0.0, 10.0), ALL)[0];
    assert_eq!(found.near_normal(&probe, &ALONG_X), Some(DVec3::NEG_X));
    assert_eq!(found.far_normal(&probe, &ALONG_X), Some(DVec3::X));
}

#[test]
fn a_camera_inside_an_object_begins_in_its_state() {
    assert_eq!(ends(&Clip::everything().cut(slab(-1.0, 3.0))), [(3.0, 10.0)]);
    let inside = cast(&slab(-1.0, 3.0), &ALONG_X).0;
    assert_eq!((inside.len(), inside[0].near), (1, None));
    assert_eq!(inside[0].segment, range(0.0, 3.0));
    assert_eq!(ends(&Clip::everything().cut(slab(-1.0, 30.0))), []);
    assert_eq!(ends(&slab(-5.0, -1.0)), []);
    assert_eq!(ends(&slab(11.0, 12.0)), []);
}

#[test]
fn a_surface_where_the_range_begins_or_ends_cuts_nothing() {
    // A rounding further out or in changes nothing.
    for off in [0.0, 1e-13, -1e-13] {
        let found = cast(&slab(-off, 10.0 + off), &ALONG_X).0;
        assert_eq!(found, [ClipSegment { segment: range(0.0, 10.0), near: None, far: None }]);
        assert_eq!(ends(&Clip::everything().cut(slab(-off, 10.0 + off))), []);
        assert_eq!(ends(&Clip::everything().cut(slab(-5.0, off)).cut(slab(10.0 - off, 15.0))), [(0.0, 10.0)]);
        assert_eq!(ends(&slab(-5.0, off)), []);
        assert_eq!(ends(&slab(10.0 - off, 15.0)), []);
    }
}

#[test]
fn coincident_faces_leave_neither_gap_nor_sheet() {
    let (a, b) = (slab(2.0, 4.0), slab(4.0, 6.0));
    assert_eq!(ends(&union(vec![a.clone(), b.clone()])), [(2.0, 6.0)]);
    assert_eq!(ends(&a.clone().probe(b.clone())), []);
    assert_eq!(ends(&a.clone().cut(b.clone())), [(2.0, 4.0)]);
    assert_eq!(ends(&a.clone().cut(a.clone())), []);
    assert_eq!(ends(&union(vec![a.clone(), complement(a.clone())])), [(0.0, 10.0)]);
    // The same where a finder rounds differently.
    let near = slab(4.0 + 1e-12, 6.0);
    assert_eq!(ends(&union(vec![a.clone(), near.clone()])), [(2.0, 6.0)]);
    assert_eq!(ends(&complement(union(vec![a.clone(), near]))), [(0.0, 2.0), (6.0, 10.0)]);
    let plane = object(Plane::new(DVec3::X, 4.0).unwrap());
    assert_eq!(ends(&a.clone().cut(plane.clone())), []);
    assert_eq!(ends(&b.clone().cut(plane)), [(4.0, 6.0)]);
    // Touching at a point of the line: a wall of no thickness cuts nothing.
    let thin = scripted(&[(5.0, Entering), (5.0, Leaving)]);
    assert_eq!(ends(&Clip::everything().cut(thin.clone())), [(0.0, 10.0)]);
    assert_eq!(ends(&thin), []);
}

#[test]
fn the_object_that_matters_bounds() {
    // All three have a face at 4; only the second one's change ends what is kept.
    let clip = union(vec![
        slab(2.0, 4.0).probe(slab(9.0, 9.5)),
        slab(3.0, 4.0),
        slab(9.0, 9.5).probe(slab(1.0, 4.0)),
    ]);
    let found = cast(&clip, &ALONG_X).0;
    assert_eq!(found[0].segment, range(3.0, 4.0));
    assert_eq!(found[0].far.map(|b| b.leaf), Some(2));
    let twice = cast(&union(vec![slab(2.0, 4.0), slab(2.0, 4.0)]), &ALONG_X).0;
    assert_eq!(twice[0].near.map(|b| (b.leaf, b.surface)), Some((0, 0)));
}

#[test]
fn overlapping_shells_of_one_object_are_their_union() {
    let shells = scripted(&[(1.0, Entering), (2.0, Entering), (3.0, Leaving), (4.0, Leaving)]);
    assert_eq!(ends(&shells), [(1.0, 4.0)]);
    assert_eq!(cast(&shells, &ALONG_X).1, 0);
    // An object wound inward has an inside all the same.
    assert_eq!(ends(&scripted(&[(1.0, Leaving), (4.0, Entering)])), [(1.0, 4.0)]);
    // At a vertex: out, out, in within one step.
    let vertex = [(1.0, Entering), (4.0, Leaving), (4.0, Leaving), (4.0, Entering)];
    let found = cast(&scripted(&vertex), &ALONG_X).0;
    assert_eq!(found[0].far.map(|b| b.crossing), Some(Leaving));
}

#[test]
fn lost_and_doubled_events_are_repaired_and_counted() {
    type Case = (&'static [(f64, Crossing)], &'static [(f64, f64)]);
    let cases: &[Case] = &[
        // Lone events.
        (&[(3.0, Entering)], &[]),
        (&[(3.0, Leaving)], &[]),
        // A way out lost at the end, a way in lost at the beginning.
        (&[(1.0, Entering), (2.0, Leaving), (3.0, Entering)], &[(1.0, 2.0)]),
        (&[(1.0, Leaving), (2.0, Entering), (3.0, Leaving)], &[(2.0, 3.0)]),
        // Lost or doubled in the middle.
        (&[(1.0, Entering), (2.0, Entering), (3.0, Leaving)], &[(1.0, 3.0)]),
        (&[(1.0, Entering), (2.0, Leaving), (3.0, Leaving)], &[(1.0, 3.0)]),
        // What is balanced before is left alone.
        (&[(1.0, Entering), (2.0, Entering), (3.0, Leaving), (4.0, Leaving), (5.0, Entering)], &[(1.0, 4.0)]),
        (&[(1.0, Entering), (2.0, Entering), (3.0, Leaving), (4.0, Entering)], &[(1.0, 3.0)]),
        (&[(1.0, Leaving), (2.0, Entering), (3.0, Entering)], &[]),
        // What is not a number is not an event.
        (&[(f64::NAN, Entering), (2.0, Entering), (3.0, Leaving), (4.0, Leaving)], &[(2.0, 4.0)]),
    ];
    for (events, expected) in cases {
        assert_eq!(ends(&scripted(events)), *expected, "{events:?}");
        assert_eq!(cast(&scripted(events), &ALONG_X).1, 1, "{events:?}");
    }
    // Only the broken object suffers.
    let clip = slab(2.0, 8.0).cut(scripted(&[(3.0, Entering)])).cut(slab(5.0, 6.0));
    assert_eq!(ends(&clip), [(2.0, 5.0), (6.0, 8.0)]);
}

#[test]
fn a_limited_number_of_segments_may_go_on_to_the_backmost_end() {
    let clip = Clip::everything().cut(slab(1.0, 2.0)).cut(slab(3.0, 4.0)).cut(slab(8.0, 9.0));
    let flat = FlatClip::new(&clip).unwrap();
    let limited = |most: u32, backmost| -> Vec<(f64, f64)> {
        let mut sweep = Sweep::new();
        let of_leaf = |leaf: usize, events: &mut Vec<Event>| {
            let leaf = &flat.leaves()[leaf];
            leaf.solid.events(&leaf.ray_in_object(&ALONG_X), events);
        };
        let count = NonZeroU32::new(most).map_or(SegmentCount::Auto, SegmentCount::AtMost);
        let limit = SegmentLimit { count, backmost };
        let found = sweep.segments(&flat, of_leaf, range(0.0, 10.0), limit);
        found.iter().map(|s| (s.segment.t_near(), s.segment.t_far())).collect()
    };
    let all = [(0.0, 1.0), (2.0, 3.0), (4.0, 8.0), (9.0, 10.0)];
    assert_eq!(limited(0, true), all);
    assert_eq!(limited(4, true), all);
    assert_eq!(limited(2, false), all[..2]);
    assert_eq!(limited(2, true), [(0.0, 1.0), (2.0, 10.0)]);
    assert_eq!(limited(1, true), [(0.0, 10.0)]);
}

#[test]
fn poses_move_objects_and_turn_their_normals() {
    let mut ball = object(Sphere::new(DVec3::ZERO, 1.0).unwrap());
    assert!(!ball.set_pose(ObjectId(7), Pose::IDENTITY));
    let stretch = DAffine3::from_translation(DVec3::new(5.0, 0.0, 0.0))
        * DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0));
    assert!(ball.set_pose(ObjectId(0), Pose::new(stretch).unwrap()));
    assert_eq!(ends(&ball), [(3.0, 7.0)]);
    let flat = FlatClip::new(&ball).unwrap();
    // An ellipsoid: the gradient of (x/2)² + y² at a point on it.
    let y = 0.6;
    let ray = Ray { origin: DVec3::new(0.0, y, 0.0), direction: DVec3::X };
    let mut sweep = Sweep::new();
    let found = sweep.cast(&flat, &ray, range(0.0, 10.0), ALL)[0];
    assert!((found.segment.t_near() - 3.4).abs() < 1e-12 && (found.segment.t_far() - 6.6).abs() < 1e-12);
    let expected = DVec3::new(-1.6 / 4.0, y, 0.0).normalize();
    assert!((found.near_normal(&flat, &ray).unwrap() - expected).length() < 1e-12);
    // A pose on a node moves all below it.
    let group = union(vec![ball.clone(), slab(8.0, 9.0)]);
    let moved = group.with_pose(Pose::new(DAffine3::from_translation(DVec3::new(1.0, 0.0, 0.0))).unwrap());
    assert_eq!(ends(&moved), [(4.0, 8.0), (9.0, 10.0)]);
}

// Random trees, as values that both the clip and a point test are made of.

#[derive(Clone, Debug)]
enum Shape {
    Plane(Plane),
    Box(AxisBox),
    Ball(Sphere),
}

impl Shape {
    fn contains(&self, p: DVec3) -> bool {
        match self {
            Self::Plane(s) => s.contains(p),
            Self::Box(s) => s.contains(p),
            Self::Ball(s) => s.contains(p),
        }
    }

    fn solid(&self) -> Arc<dyn Solid> {
        match self {
            Self::Plane(s) => Arc::new(*s),
            Self::Box(s) => Arc::new(*s),
            Self::Ball(s) => Arc::new(*s),
        }
    }
}

fn contains(clip: &Clip<Shape>, p: DVec3) -> bool {
    let p = clip.pose.object_from_world().transform_point3(p);
    match &clip.node {
        Node::Everything => true,
        Node::Leaf(shape) => shape.contains(p),
        Node::Union(parts) => parts.iter().any(|c| contains(c, p)),
        Node::Intersection(parts) => parts.iter().all(|c| contains(c, p)),
        Node::Difference(parts) => {
            let mut parts = parts.iter().map(|c| contains(c, p));
            parts.next().unwrap_or(false) && !parts.any(|inside| inside)
        }
        Node::Complement(part) => !contains(part, p),
    }
}

fn resolved(clip: &Clip<Shape>) -> Clip {
    let object = |shape: &Shape| Ok::<_, ()>(Object { id: ObjectId(0), solid: shape.solid() });
    clip.map(&mut { object }).unwrap()
}

fn vector(most: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-most..most).prop_map(DVec3::from_array)
}

/// Rounded to quarters, so that faces of different objects coincide often.
fn coarse(most: f64) -> impl Strategy<Value = DVec3> {
    vector(most).prop_map(|v| (v * 4.0).round() / 4.0)
}

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        (0usize..6, -2.0f64..2.0).prop_map(|(face, d)| {
            let mut normal = DVec3::ZERO;
            normal[face / 2] = if face % 2 == 0 { 1.0 } else { -2.0 };
            Shape::Plane(Plane::new(normal, (4.0 * d).round() / 4.0).unwrap())
        }),
        (coarse(2.0), coarse(1.5))
            .prop_map(|(min, size)| { Shape::Box(AxisBox::new(min, min + size.abs() + 0.25).unwrap()) }),
        (coarse(2.0), 0.25f64..2.0)
            .prop_map(|(center, radius)| Shape::Ball(Sphere::new(center, radius).unwrap())),
    ]
}

fn pose() -> impl Strategy<Value = Pose> {
    let affine =
        (vector(1.0), -3.0f64..3.0, vector(1.0), vector(1.5)).prop_map(|(axis, angle, shift, scale)| {
            let scale = scale.map(|s| s.signum() * (0.5 + s.abs()));
            let rotation = DQuat::from_axis_angle(axis.try_normalize().unwrap_or(DVec3::X), angle);
            Pose::new(DAffine3::from_scale_rotation_translation(scale, rotation, shift)).unwrap()
        });
    prop_oneof![3 => Just(Pose::IDENTITY), 1 => affine]
}

fn tree() -> impl Strategy<Value = Clip<Shape>> {
    let leaf = prop_oneof![8 => shape().prop_map(Node::Leaf), 1 => Just(Node::Everything)];
    let node = |node: Node<Shape>, pose: Pose| Clip { node, pose };
    let leaf = (leaf, pose()).prop_map(move |(n, p)| node(n, p));
    leaf.prop_recursive(4, 24, 4, move |inner| {
        let parts = || prop::collection::vec(inner.clone(), 0..4);
        let inner_node = prop_oneof![
            parts().prop_map(Node::Union),
            parts().prop_map(Node::Intersection),
            parts().prop_map(Node::Difference),
            inner.clone().prop_map(|c| Node::Complement(Box::new(c))),
        ];
        (inner_node, pose()).prop_map(move |(n, p)| node(n, p))
    })
}

fn ray() -> impl Strategy<Value = Ray> {
    // Along an axis through coarse points, where lines run within faces, and anywhere.
    let straight = (coarse(3.0), 0usize..3).prop_map(|(origin, axis)| {
        let mut direction = DVec3::ZERO;
        direction[axis] = 1.0;
        Ray { origin, direction }
    });
    let oblique = (vector(4.0), vector(2.0))
        .prop_filter("a direction", |(a, b)| a.distance(*b) > 0.1)
        .prop_map(|(origin, to)| Ray { origin, direction: (to - origin).normalize() });
    prop_oneof![1 => straight, 3 => oblique]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn random_trees_agree_with_points(clip in tree(), ray in ray()) {
        let flat = FlatClip::new(&resolved(&clip)).unwrap();
        let mut sweep = Sweep::new();
        let range = range(0.0, 9.0);
        let found = sweep.cast(&flat, &ray, range, ALL).to_vec();
        prop_assert_eq!(sweep.repaired(), 0);
        for pair in found.windows(2) {
            prop_assert!(pair[0].segment.t_far() < pair[1].segment.t_near());
        }
        // Where the line runs within a face, or near an end, either side is right: points beside the ray tell.
        let beside = [DVec3::ZERO, DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        for i in 0..200 {
            let t = range.length() * (f64::from(i) + 0.5) / 200.0;
            let p = ray.origin + ray.direction * t;
            let inside = contains(&clip, p);
            if beside.iter().all(|d| contains(&clip, p + *d * 1e-7) == inside) {
                let kept = found.iter().any(|s| (s.segment.t_near()..s.segment.t_far()).contains(&t));
                prop_assert_eq!(kept, inside, "at {}", t);
            }
        }
        for s in &found {
            for (normal, along) in [(s.near_normal(&flat, &ray), -1.0), (s.far_normal(&flat, &ray), 1.0)] {
                if let Some(normal) = normal {
                    prop_assert!((normal.length() - 1.0).abs() < 1e-9);
                    prop_assert!(normal.dot(ray.direction) * along >= -1e-9, "{} {:?}", normal, s);
                }
            }
        }
    }

    #[test]
    fn laws_of_the_algebra(a in tree(), b in tree(), c in tree(), ray in ray()) {
        let [a, b, c] = [a, b, c].map(|clip| resolved(&clip));
        let flat = |clip: &Clip| {
            let flat = FlatClip::new(clip).unwrap();
            let found = Sweep::new().cast(&flat, &ray, range(0.0, 9.0), ALL).to_vec();
            found.iter().map(|s| s.segment).collect::<Vec<_>>()
        };
        let both = |x: &Clip, y: &Clip| -> Clip { Node::Intersection(vec![x.clone(), y.clone()]).into() };
        let either = |x: &Clip, y: &Clip| union(vec![x.clone(), y.clone()]);
        let not = |x: &Clip| complement(x.clone());
        let minus = |x: &Clip, y: &Clip| -> Clip { Node::Difference(vec![x.clone(), y.clone()]).into() };
        let nothing = Vec::<Segment>::new();
        prop_assert_eq!(flat(&minus(&a, &a)), nothing.clone());
        prop_assert_eq!(flat(&both(&a, &not(&a))), nothing);
        prop_assert_eq!(flat(&either(&a, &a)), flat(&a));
        prop_assert_eq!(flat(&both(&a, &a)), flat(&a));
        prop_assert_eq!(flat(&either(&a, &not(&a))), vec![range(0.0, 9.0)]);
        prop_assert_eq!(flat(&not(&not(&a))), flat(&a));
        prop_assert_eq!(flat(&either(&a, &b)), flat(&either(&b, &a)));
        prop_assert_eq!(flat(&not(&either(&a, &b))), flat(&both(&not(&a), &not(&b))));
        prop_assert_eq!(flat(&not(&both(&a, &b))), flat(&either(&not(&a), &not(&b))));
        prop_assert_eq!(flat(&minus(&a, &b)), flat(&both(&a, &not(&b))));
        prop_assert_eq!(flat(&both(&a, &either(&b, &c))), flat(&either(&both(&a, &b), &both(&a, &c))));
        prop_assert_eq!(flat(&a.clone().cut(b.clone()).probe(c.clone())), flat(&both(&minus(&a, &b), &c)));
    }

    /// Whatever the events, segments are disjoint, ascending and within the range.
    #[test]
    fn no_events_break_the_sweep(
        events in prop::collection::vec((prop_oneof![9 => -5i32..20, 1 => Just(i32::MAX)], any::<bool>()), 0..12),
        cut: bool,
    ) {
        let events: Vec<(f64, Crossing)> = events.iter().map(|&(t, entering)| {
            (if t == i32::MAX { f64::INFINITY } else { f64::from(t) }, if entering { Entering } else { Leaving })
        }).collect();
        let clip = if cut { Clip::everything().cut(scripted(&events)) } else { scripted(&events) };
        let found = ends(&clip);
        prop_assert!(found.iter().all(|s| 0.0 <= s.0 && s.0 < s.1 && s.1 <= 10.0), "{:?}", found);
        prop_assert!(found.windows(2).all(|w| w[0].1 < w[1].0), "{:?}", found);
    }
}

/// A sphere that counts how often it is asked.
#[derive(Debug)]
struct Counted {
    sphere: Sphere,
    asked: Arc<std::sync::atomic::AtomicUsize>,
}

impl Solid for Counted {
    fn events(&self, ray: &Ray, events: &mut Vec<Event>) {
        self.asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        self.sphere.events(ray, events);
    }

    fn normal(&self, surface: u32, point: DVec3) -> DVec3 {
        self.sphere.normal(surface, point)
    }

    fn bounds(&self) -> [DVec3; 2] {
        self.sphere.bounds()
    }
}

#[test]
fn report_b3_a_ray_asks_only_the_spheres_near_it() {
    let asked = Arc::new(std::sync::atomic::AtomicUsize::new(0));
    let sphere = |i: u32| {
        let center = DVec3::new(f64::from(i % 22), f64::from(i / 22 % 22), f64::from(i / 484));
        let solid = Counted { sphere: Sphere::new(center, 0.3).unwrap(), asked: asked.clone() };
        Clip::object(ObjectId(i), Arc::new(solid))
    };
    let union: Clip = Node::Union((0..22 * 22 * 22).map(sphere).collect()).into();
    let clip = FlatClip::new(&Clip::everything().cut(union)).unwrap();
    let mut sweep = Sweep::new();
    for direction in [DVec3::X, DVec3::new(1.0, 0.1, 0.05), DVec3::new(1.0, 1.0, 1.0).normalize()] {
        let ray = Ray { origin: DVec3::new(-3.0, 2.1, 3.05), direction };
        let range = Segment::new(0.0, 60.0).unwrap();
        asked.store(0, std::sync::atomic::Ordering::Relaxed);
        let found = sweep.cast(&clip, &ray, range, SegmentLimit::default()).to_vec();
        let asked = asked.load(std::sync::atomic::Ordering::Relaxed);
        assert!((10..300).contains(&asked), "{asked} of 10648 spheres for {direction}");
        let all = |leaf: usize, events: &mut Vec<Event>| {
            let leaf = &clip.leaves()[leaf];
            leaf.solid.events(&leaf.ray_in_object(&ray), events);
        };
        assert_eq!(found, sweep.segments(&clip, all, range, SegmentLimit::default()));
        assert!(found.len() > 5, "{found:?}");
    }
}
