// The sweep: from the events of a pixel's ray and the clip expression to the segments that are kept. The rules are those of
// `cutaway_core::clip::Sweep`, said there: winding numbers, coincident faces, which surface bounds, parity. Two things differ,
// for numbers here are f32: what counts as coincident (see `COINCIDENCE` in sweep.rs), and that a line of more than CAPACITY
// events that do not balance is not repaired bracket by bracket; of an object that they belong to, the last crossing decides.

import package::clipping::events::{
    CAPACITY, ClipEvent, DROPPED, after_id, after_t, begin_events, event_count, events, first_round, left_out, offered,
};
import package::clipping::expression::{kept, reset_state, set_inside, set_state_word, state_word};
import package::clipping::leaf::leaves;
import package::clipping::octahedral::{octahedral_packed, octahedral_unpacked};
import package::clipping::settings::sweep;
import package::shared::frame::frame;
import package::shared::ray::{Ray, box_range, ray_of};

// What segments.wgsl reads.
@group(1) @binding(3) var<storage, read_write> ranges_out: array<vec2u>;
@group(1) @binding(4) var<storage, read_write> segments_out: array<vec4u>;

struct Counters {
    // Nodes of event lists that were asked for, and segments.
    nodes: atomic<u32>,
    segments: atomic<u32>,
    // Lines whose events did not balance, one for each object and ray; segments that are used.
    repaired: atomic<u32>,
    kept_segments: atomic<u32>,
}

@group(1) @binding(5) var<storage, read_write> counters: Counters;

// Winding numbers of objects whose events do not balance on a line too long to repair: outside, and inside.
const BROKEN = 0x1000000;

const NO_SURFACE = 0xffffffffu;

var<private> ray: Ray;
// What clipping keeps lies in here: the volume's box.
var<private> range: vec2f;
// A segment has begun, where, and at which surface: its normal, as the list holds it.
var<private> is_open: bool;
var<private> open_t: f32;
var<private> open_normal: u32;
var<private> open_at_surface: bool;
// Where the pixel's segments are in the list, how many it may write, how many there have been.
var<private> first_segment: u32;
var<private> most_segments: u32;
var<private> segment_number: u32;

// False where there is nothing to sweep: `id` is beyond the image, or the ray misses the volume.
fn begin_pixel(id: vec2u) -> bool {
    let place = sweep.first_pixel + id;
    if (id.x >= sweep.width) || (place.y >= frame.resolution.y) || (place.x >= frame.resolution.x) {
        return false;
    }
    ray = ray_of(vec2f(place));
    range = box_range(ray);
    if range.x >= range.y {
        ranges_out[place.y * frame.resolution.x + place.x] = vec2u(0u);
        return false;
    }
    reset_state(id.y * sweep.width + id.x);
    is_open = kept;
    open_t = range.x;
    open_at_surface = false;
    segment_number = 0u;
    begin_events();
    return true;
}

// Sweeps over the events that a round has found; whether there must be another one.
fn sweep_round() -> bool {
    if first_round {
        first_round = false;
        allocate_segments();
        settle_windings();
    }
    var next = 0u;
    while next < event_count {
        let t = events[next].t;
        if t > range.y + sweep.tolerance {
            return false;
        }
        var end = next + 1u;
        while end < event_count {
            if events[end].t > t + sweep.tolerance {
                break;
            }
            end += 1u;
        }
        // A group that may go on among the events of the next round waits for them, unless nothing stands before it.
        if left_out && (end == event_count) && (next > 0u) {
            break;
        }
        cross_group(next, end);
        if (segment_number >= sweep.segment_limit) && (sweep.backmost == 0u) {
            is_open = false;
            return false;
        }
        next = end;
    }
    if next > 0u {
        after_t = events[next - 1u].t;
        after_id = events[next - 1u].id;
    }
    return left_out;
}

fn finish_pixel(id: vec2u) {
    if is_open {
        add_segment(range.y);
    }
    let place = sweep.first_pixel + id;
    let count = min(segment_number, most_segments);
    ranges_out[place.y * frame.resolution.x + place.x] = vec2u(first_segment, count);
    if count > 0u {
        atomicAdd(&counters.kept_segments, count);
    }
}

// Room for as many segments as there can be: each begins at an event, but for one at the beginning, and ends at one.
fn allocate_segments() {
    most_segments = min(offered / 2u + 1u, sweep.segment_limit);
    first_segment = atomicAdd(&counters.segments, most_segments);
    // What does not fit is counted, for the host to make room.
    if first_segment + most_segments > sweep.segment_capacity {
        most_segments = 0u;
    }
}

// From sums over the line to winding numbers before its first event.
fn settle_windings() {
    var repaired = 0u;
    for (var leaf = 0u; leaf < sweep.leaf_count; leaf += 1u) {
        let sum = state_word(leaf);
        if sum == 0 {
            continue;
        }
        repaired += 1u;
        if left_out {
            set_state_word(leaf, BROKEN);
        } else {
            set_state_word(leaf, 0);
            repair(leaf, sum > 0);
        }
    }
    if repaired > 0u {
        atomicAdd(&counters.repaired, repaired);
    }
}

// Takes out the events of an object that have no partner, where it is entered too often (or left too often, which is the
// same seen from behind). About brackets: the kind that comes too often is opening.
fn repair(leaf: u32, enters_too_often: bool) {
    let opening = 2u * leaf + select(0u, 1u, enters_too_often);
    let closing = opening ^ 1u;
    var depth = 0u;
    for (var k = 0u; k < event_count; k += 1u) {
        let i = select(event_count - 1u - k, k, enters_too_often);
        if events[i].word == opening {
            depth += 1u;
        } else if events[i].word == closing {
            if depth > 0u {
                depth -= 1u;
            } else {
                events[i].word = closing | DROPPED;
            }
        }
    }
    // From the last to the first: of a run of opening ones, the first find partners.
    var closings = 0u;
    var end = event_count;
    while end > 0u {
        let last = select(event_count - end, end - 1u, enters_too_often);
        if events[last].word == closing {
            closings += 1u;
        }
        if events[last].word != opening {
            end -= 1u;
            continue;
        }
        var start = end;
        var run = 0u;
        while start > 0u {
            let word = events[select(event_count - start, start - 1u, enters_too_often)].word;
            if (word == closing) || (word == (closing | DROPPED)) {
                break;
            }
            run += select(0u, 1u, word == opening);
            start -= 1u;
        }
        var matched = min(closings, run);
        closings -= matched;
        for (var k = start; k < end; k += 1u) {
            let i = select(event_count - 1u - k, k, enters_too_often);
            if events[i].word == opening {
                if matched > 0u {
                    matched -= 1u;
                } else {
                    events[i].word = opening | DROPPED;
                }
            }
        }
        end = start;
    }
}

fn is_inside(winding: i32) -> bool {
    return (winding != 0) && (winding != BROKEN);
}

fn sign_of(word: u32) -> i32 {
    return select(-1, 1, (word & 1u) == 1u);
}

fn cross_event(word: u32) {
    if word >= DROPPED {
        return;
    }
    let leaf = word >> 1u;
    let winding = state_word(leaf);
    var now = winding + sign_of(word);
    if winding >= BROKEN {
        now = select(BROKEN, BROKEN + 1, sign_of(word) > 0);
    }
    set_state_word(leaf, now);
    if is_inside(now) != is_inside(winding) {
        set_inside(leaf, is_inside(now));
    }
}

// Takes the coincident events from `first` to before `end` into account.
fn cross_group(first: u32, end: u32) {
    let t = events[first].t;
    let before = kept;
    for (var i = first; i < end; i += 1u) {
        cross_event(events[i].word);
    }
    if kept == before {
        return;
    }
    // At the ends of the range nothing is cut.
    let at_near = t <= range.x + sweep.tolerance;
    let at_far = t >= range.y - sweep.tolerance;
    let at = select(select(t, range.y, at_far), range.x, at_near);
    if !kept {
        if is_open {
            add_segment(at);
        }
        is_open = false;
        return;
    }
    is_open = true;
    open_t = at;
    open_at_surface = !at_near && !at_far;
    if open_at_surface {
        let event = events[cause(first, end, before)];
        open_at_surface = leaves[event.word >> 1u].bare == 0u;
        open_normal = outward_of_kept(event);
    }
}

// The normal against the ray: where the ray leaves the object to enter what is kept, the object was cut away.
fn outward_of_kept(event: ClipEvent) -> u32 {
    if (event.word & 1u) == 1u {
        return event.normal;
    }
    return octahedral_packed(-octahedral_unpacked(event.normal));
}

// Which event of a group bounds: of the first object without whose change nothing would have changed, or of the first that
// changed.
fn cause(first: u32, end: u32, before: bool) -> u32 {
    if end == first + 1u {
        return first;
    }
    var found = NO_SURFACE;
    // Objects below are done with.
    var leaf = 0u;
    loop {
        var next = NO_SURFACE;
        for (var i = first; i < end; i += 1u) {
            let of_event = events[i].word >> 1u;
            if (events[i].word < DROPPED) && (of_event >= leaf) && (of_event < next) {
                next = of_event;
            }
        }
        if next == NO_SURFACE {
            break;
        }
        leaf = next + 1u;
        let event = changing_event(next, first, end);
        if event == NO_SURFACE {
            continue;
        }
        if found == NO_SURFACE {
            found = event;
        }
        let inside = is_inside(state_word(next));
        set_inside(next, !inside);
        let without = kept;
        set_inside(next, inside);
        if without == before {
            return event;
        }
    }
    return select(found, first, found == NO_SURFACE);
}

// The first event of an object in a group that has the sense of its change; NO_SURFACE where it has not changed.
fn changing_event(leaf: u32, first: u32, end: u32) -> u32 {
    var change = 0;
    for (var i = first; i < end; i += 1u) {
        if (events[i].word >> 1u) == leaf {
            change += sign_of(events[i].word);
        }
    }
    let now = state_word(leaf);
    let was_inside = select(is_inside(now - change), (now >= BROKEN) && (change < 0), now >= BROKEN);
    if (change == 0) || (was_inside == is_inside(now)) {
        return NO_SURFACE;
    }
    for (var i = first; i < end; i += 1u) {
        if (events[i].word >> 1u) == leaf && (sign_of(events[i].word) > 0) == (change > 0) {
            return i;
        }
    }
    return NO_SURFACE;
}

// A segment ends at `t_far`.
fn add_segment(t_far: f32) {
    if open_t >= t_far {
        return;
    }
    if segment_number < most_segments {
        let surface = select(0u, 1u, open_at_surface);
        segments_out[first_segment + segment_number] =
            vec4u(bitcast<u32>(open_t), bitcast<u32>(t_far), select(0u, open_normal, open_at_surface), surface);
    } else if most_segments == sweep.segment_limit {
        // Backmost: the last of them goes on to the end of all.
        segments_out[first_segment + most_segments - 1u].y = bitcast<u32>(t_far);
    }
    segment_number += 1u;
}
