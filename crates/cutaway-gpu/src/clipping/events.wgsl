// The events of a pixel's ray, in order. Whoever finds events offers each of them with `offer_event`, in any order and as
// often as there are rounds; kept are the nearest that come after what earlier rounds have seen. So a ray may have any
// number of events, and only one with more than CAPACITY of them costs a second round.
//
// A source of events is a function `collect_events(place)` that offers all events of meshes on a pixel's ray before the eye
// (all on its line, where rays are parallel): its shader goes through the rounds as sweep_lists.wgsl does.

import package::clipping::expression::{set_state_word, state_word};

struct ClipEvent {
    // Along the ray, as in shared/ray.wgsl.
    t: f32,
    // Twice the object, and 1 where the ray enters it; DROPPED is added to what a repair took out.
    word: u32,
    // Of the surface, outward, in the world, in octahedral form.
    normal: u32,
    // Tells events at one t apart; the same in every round.
    id: u32,
}

const CAPACITY = 32u;
const DROPPED = 0x80000000u;
// Beyond everything.
const FARTHEST = 1e30;
// Events with ids from here on are not those of meshes.
const SHAPE_IDS = 0x80000000u;

var<private> events: array<ClipEvent, CAPACITY>;
var<private> event_count: u32;
// The key of the last event that is done with.
var<private> after_t: f32;
var<private> after_id: u32;
var<private> first_round: bool;
// Events of the whole line, counted in the first round.
var<private> offered: u32;
// There are events behind those that are kept.
var<private> left_out: bool;

fn begin_events() {
    first_round = true;
    offered = 0u;
}

fn begin_round() {
    event_count = 0u;
    left_out = false;
}

// Whether the event of this key comes before another.
fn comes_before(t: f32, id: u32, other: ClipEvent) -> bool {
    return (t < other.t) || ((t == other.t) && (id < other.id));
}

// An event of the ray that the invocation sweeps: where, of which object, whether it enters it there, and the outward normal
// in octahedral form. The ids of one ray's events differ.
fn offer_event(found_t: f32, leaf: u32, entering: bool, normal: u32, id: u32) {
    let t = clamp(found_t, -FARTHEST, FARTHEST);
    if first_round {
        offered += 1u;
        // Winding numbers begin as sums over the line, which are 0 where its events balance.
        set_state_word(leaf, state_word(leaf) + select(-1, 1, entering));
    } else if (t < after_t) || ((t == after_t) && (id <= after_id)) {
        return;
    }
    if event_count == CAPACITY {
        left_out = true;
        if !comes_before(t, id, events[CAPACITY - 1u]) {
            return;
        }
        event_count -= 1u;
    }
    var place = event_count;
    while place > 0u {
        if !comes_before(t, id, events[place - 1u]) {
            break;
        }
        events[place] = events[place - 1u];
        place -= 1u;
    }
    events[place] = ClipEvent(t, 2u * leaf + select(0u, 1u, entering), normal, id);
    event_count += 1u;
}
