//! The sweep: from events and a clip expression to the segments of a ray that are kept.
//!
//! Along a line, each object has a winding number: entering adds one, leaving takes one away, and the line is inside
//! while the number is not zero, so that overlapping shells of one object are their union. The sweep goes through the
//! events of all objects in order and asks the expression after each group of coincident ones. The rules:
//!
//! - **Coincident faces.** Events nearer to each other than [`COINCIDENCE`] of the ray's length are one step: the
//!   expression is asked after the last of them. So `A - A` is empty, `A ∪ A` is `A`, and what touches leaves neither a
//!   gap nor a sheet, also where two finders compute the same place with other roundings.
//! - **Which surface bounds.** Of a coincident group, the first object without whose change nothing would have changed;
//!   where there is none (`A ∪ A`), the first that changed.
//! - **Ends of the range.** Events before the range only decide in which state it begins: a camera within an object needs
//!   no rule of its own. A surface where the range itself begins or ends cuts nothing and bounds nothing, so that a
//!   volume cropped to its own box is what it was.
//! - **Parity.** Every line leaves each object as often as it enters it. Where a finder lost or doubled an event, those
//!   left without a partner are taken out; of several that enter (leave) one after another the first (last) stays. So a
//!   hole costs the piece of one object between two of its surfaces, never a streak to the end of the volume, and what
//!   lies between a doubled surface counts as inside. Such lines are counted.

use glam::DVec3;

use super::flat::State;
use super::{Crossing, Event, FlatClip, SegmentCount};
use crate::camera::Ray;
use crate::segment::Segment;

/// Events this near to each other, as a fraction of the distance to the far end of the range, are one. Distances are
/// known to about 2e-16 of that, divided by the cosine between ray and surface.
pub const COINCIDENCE: f64 = 1e-11;

/// Where a segment meets the surface of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Boundary {
    /// Which leaf of the [`FlatClip`].
    pub leaf: u32,
    /// Which part of its surface.
    pub surface: u32,
    /// Whether the ray enters the object there or leaves it.
    pub crossing: Crossing,
}

/// A stretch of a ray that is kept, and what bounds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipSegment {
    /// From where to where.
    pub segment: Segment,
    /// The surface at its near end; none where the range begins.
    pub near: Option<Boundary>,
    /// The surface at its far end; none where the range ends.
    pub far: Option<Boundary>,
}

impl ClipSegment {
    /// The unit normal in the world of the surface at the near end, out of what is kept, so against the ray; none where the
    /// object [has no surface](super::Solid::has_surface), either.
    pub fn near_normal(&self, clip: &FlatClip, ray_in_world: &Ray) -> Option<DVec3> {
        let near = self.near.filter(|near| clip.leaves()[near.leaf as usize].solid.has_surface())?;
        // Where the ray leaves the object to enter what is kept, the object was cut away: its outside is kept.
        let turned = near.crossing == Crossing::Leaving;
        Some(normal(clip, near, ray_in_world, self.segment.t_near(), turned))
    }

    /// The unit normal in the world of the surface at the far end, out of what is kept, so along the ray.
    pub fn far_normal(&self, clip: &FlatClip, ray_in_world: &Ray) -> Option<DVec3> {
        let far = self.far?;
        let turned = far.crossing == Crossing::Entering;
        Some(normal(clip, far, ray_in_world, self.segment.t_far(), turned))
    }
}

fn normal(clip: &FlatClip, at: Boundary, ray: &Ray, t: f64, turned: bool) -> DVec3 {
    let point = ray.origin + ray.direction * t;
    let outward = clip.leaves()[at.leaf as usize].normal_in_world(at.surface, point);
    if turned { -outward } else { outward }
}

/// How many segments of a ray are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SegmentLimit {
    /// How many at most.
    pub count: SegmentCount,
    /// Whether the last of a limited number goes on to the end of the last of all, so that too much is shown rather
    /// than too little (Termeer 3.2.4).
    pub backmost: bool,
}

impl SegmentLimit {
    /// Takes what is too much off ascending segments.
    fn apply(self, segments: &mut Vec<ClipSegment>) {
        let SegmentCount::AtMost(most) = self.count else { return };
        let most = most.get() as usize;
        let Some(backmost) = segments.last().copied().filter(|_| segments.len() > most) else { return };
        segments.truncate(most);
        let last = &mut segments[most - 1];
        if self.backmost {
            let (t_near, t_far) = (last.segment.t_near(), backmost.segment.t_far());
            last.segment = Segment::new(t_near, t_far).unwrap_or(last.segment);
            last.far = backmost.far;
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct LeafEvent {
    event: Event,
    leaf: u32,
}

/// Turns events into segments, ray after ray, in buffers that it keeps: after the first rays nothing is allocated.
///
/// One of these belongs to each thread.
#[derive(Clone, Debug, Default)]
pub struct Sweep {
    /// Events of one leaf, then those of all.
    of_leaf: Vec<Event>,
    events: Vec<LeafEvent>,
    /// Winding number of each leaf.
    windings: Vec<i32>,
    /// Leaves whose state the current group changed, and the event that did it.
    changed: Vec<LeafEvent>,
    state: State,
    segments: Vec<ClipSegment>,
    repaired: u64,
    /// Leaves that a ray may meet, and what finding them takes.
    nearby: Vec<u32>,
    stack: Vec<u32>,
}

impl Sweep {
    /// With empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Lines whose events did not balance and were repaired, so far: one for each object and ray.
    pub fn repaired(&self) -> u64 {
        self.repaired
    }

    /// The kept segments of `ray_in_world` within `range`, ascending, asking every object itself that the ray may meet.
    pub fn cast(
        &mut self,
        clip: &FlatClip,
        ray_in_world: &Ray,
        range: Segment,
        limit: SegmentLimit,
    ) -> &[ClipSegment] {
        let mut nearby = std::mem::take(&mut self.nearby);
        clip.leaves_along(ray_in_world, &mut self.stack, &mut nearby);
        self.events.clear();
        for &leaf in &nearby {
            let of_leaf = |events: &mut Vec<Event>| {
                let leaf = &clip.leaves()[leaf as usize];
                leaf.solid.events(&leaf.ray_in_object(ray_in_world), events);
            };
            self.gather(leaf, of_leaf);
        }
        self.nearby = nearby;
        self.finish(clip, range, limit)
    }

    /// The kept segments within `range`, ascending. `events_of_leaf` appends the events of a leaf along the whole line,
    /// in any order, from whatever finder.
    pub fn segments(
        &mut self,
        clip: &FlatClip,
        mut events_of_leaf: impl FnMut(usize, &mut Vec<Event>),
        range: Segment,
        limit: SegmentLimit,
    ) -> &[ClipSegment] {
        self.events.clear();
        for leaf in 0..clip.leaves().len() {
            self.gather(leaf as u32, |events| events_of_leaf(leaf, events));
        }
        self.finish(clip, range, limit)
    }

    /// Adds the events of a leaf, balanced.
    fn gather(&mut self, leaf: u32, events: impl FnOnce(&mut Vec<Event>)) {
        self.of_leaf.clear();
        events(&mut self.of_leaf);
        self.of_leaf.retain(|e| !e.t.is_nan());
        self.repaired += u64::from(balance(&mut self.of_leaf));
        self.events.extend(self.of_leaf.iter().map(|&event| LeafEvent { event, leaf }));
    }

    /// Turns the events of all leaves into segments.
    fn finish(&mut self, clip: &FlatClip, range: Segment, limit: SegmentLimit) -> &[ClipSegment] {
        self.events.sort_unstable_by(|a, b| a.event.t.total_cmp(&b.event.t));
        self.sweep(clip, range);
        limit.apply(&mut self.segments);
        &self.segments
    }

    fn sweep(&mut self, clip: &FlatClip, range: Segment) {
        self.segments.clear();
        self.windings.clear();
        self.windings.resize(clip.leaves().len(), 0);
        clip.reset(&mut self.state);
        let tolerance = COINCIDENCE * range.t_far().abs().max(range.t_near().abs());
        let tolerance = if tolerance.is_finite() { tolerance } else { 0.0 };
        // Where the open segment began.
        let mut open = self.state.kept.then_some((range.t_near(), None));
        let mut next = 0;
        while let Some(first) = self.events.get(next) {
            let t = first.event.t;
            if t > range.t_far() + tolerance {
                break;
            }
            let end = next + self.events[next..].partition_point(|e| e.event.t <= t + tolerance);
            let boundary = self.step(clip, next..end);
            next = end;
            // At the ends of the range nothing is cut.
            let (t, boundary) = if t <= range.t_near() + tolerance {
                (range.t_near(), None)
            } else if t >= range.t_far() - tolerance {
                (range.t_far(), None)
            } else {
                (t, boundary)
            };
            open = match (open, self.state.kept) {
                (None, true) => Some((t, boundary)),
                (Some((t_near, near)), false) => {
                    let segment = Segment::new(t_near, t);
                    self.segments.extend(segment.map(|segment| ClipSegment { segment, near, far: boundary }));
                    None
                }
                (open, _) => open,
            };
        }
        if let Some((t_near, near)) = open {
            let segment = Segment::new(t_near, range.t_far());
            self.segments.extend(segment.map(|segment| ClipSegment { segment, near, far: None }));
        }
    }

    /// Takes a group of coincident events into account; what bounds there, if the expression changed.
    fn step(&mut self, clip: &FlatClip, group: std::ops::Range<usize>) -> Option<Boundary> {
        let kept = self.state.kept;
        let group = &mut self.events[group];
        if group.len() > 1 {
            let key = |e: &LeafEvent| (e.leaf, e.event.surface);
            group.sort_unstable_by(|a, b| key(a).cmp(&key(b)).then(a.event.t.total_cmp(&b.event.t)));
        }
        self.changed.clear();
        for of_leaf in group.chunk_by(|a, b| a.leaf == b.leaf) {
            let leaf = of_leaf[0].leaf;
            let sign = |e: &LeafEvent| if e.event.crossing == Crossing::Entering { 1 } else { -1 };
            let change: i32 = of_leaf.iter().map(sign).sum();
            let winding = &mut self.windings[leaf as usize];
            let inside = *winding != 0;
            *winding += change;
            if inside != (*winding != 0) {
                clip.set(leaf as usize, !inside, &mut self.state);
                // The change has a sign, so one of its events has it too.
                self.changed.extend(of_leaf.iter().find(|e| sign(e) == change.signum()));
            }
        }
        if kept == self.state.kept {
            return None;
        }
        let first = self.changed.first().copied()?;
        let cause = if self.changed.len() == 1 { Some(first) } else { self.cause(clip, kept) };
        let LeafEvent { event, leaf } = cause.unwrap_or(first);
        Some(Boundary { leaf, surface: event.surface, crossing: event.crossing })
    }

    /// The first changed leaf without whose change the expression would still be what it was.
    fn cause(&mut self, clip: &FlatClip, kept: bool) -> Option<LeafEvent> {
        for i in 0..self.changed.len() {
            let leaf = self.changed[i].leaf as usize;
            let inside = self.windings[leaf] != 0;
            clip.set(leaf, !inside, &mut self.state);
            let without = self.state.kept;
            clip.set(leaf, inside, &mut self.state);
            if without == kept {
                return Some(self.changed[i]);
            }
        }
        None
    }
}

/// Makes the events of one object enter as often as they leave; whether that needed any taken out.
fn balance(events: &mut Vec<Event>) -> bool {
    let entering = events.iter().filter(|e| e.crossing == Crossing::Entering).count();
    if 2 * entering == events.len() {
        return false;
    }
    events.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.surface.cmp(&b.surface)));
    // The kind that comes too often is seen as opening, from the side where it does: a line with too many ways out is
    // one with too many ways in, seen from behind. Now this is about brackets.
    let opening = if 2 * entering > events.len() { Crossing::Entering } else { Crossing::Leaving };
    if opening == Crossing::Leaving {
        events.reverse();
    }
    drop_unmatched(events, opening);
    true
}

/// Takes out the brackets without a partner; of a run of opening ones, the last.
fn drop_unmatched(events: &mut Vec<Event>, opening: Crossing) {
    let mut depth = 0usize;
    for e in events.iter_mut() {
        if e.crossing == opening {
            depth += 1;
        } else if depth > 0 {
            depth -= 1;
        } else {
            e.t = f64::NAN;
        }
    }
    let mut closing = 0usize;
    // Runs of one kind, from the last to the first.
    let mut end = events.len();
    while end > 0 {
        let kind = events[end - 1].crossing;
        let start = events[..end].iter().rposition(|e| e.crossing != kind).map_or(0, |i| i + 1);
        if kind == opening {
            let matched = closing.min(end - start);
            closing -= matched;
            events[start + matched..end].iter_mut().for_each(|e| e.t = f64::NAN);
        } else {
            closing += events[start..end].iter().filter(|e| !e.t.is_nan()).count();
        }
        end = start;
    }
    events.retain(|e| !e.t.is_nan());
}
