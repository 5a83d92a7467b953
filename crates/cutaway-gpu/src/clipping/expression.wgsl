// The expression over a clip's objects, and what it says at a place on a ray: the twin of `FlatClip` in cutaway-core. A state
// is the winding number of each object, then the count of true inputs of each gate.

import package::clipping::leaf::leaves;
import package::clipping::settings::sweep;

// Of each gate: the number of true inputs that make it true, how many are true outside all objects, the gate that it goes to
// (or ROOT), and 1 where that is told the opposite. A gate comes after those it goes to.
@group(1) @binding(2) var<storage, read> gates: array<vec4u>;
// The states of all pixels of a dispatch, where one is too large for a pixel's own memory.
@group(1) @binding(6) var<storage, read_write> large_states: array<i32>;

const ROOT = 0xffffffffu;
// Words of a state that a pixel holds by itself; the host counts with it.
const OWN_WORDS = 64u;
// States are in `large_states`.
override LARGE_STATE: bool = false;

var<private> own_state: array<i32, OWN_WORDS>;
// Where the pixel's state begins in `large_states`.
var<private> state_begins: u32;
// What the expression says.
var<private> kept: bool;

fn state_word(index: u32) -> i32 {
    if LARGE_STATE {
        return large_states[state_begins + index];
    }
    return own_state[index];
}

fn set_state_word(index: u32, word: i32) {
    if LARGE_STATE {
        large_states[state_begins + index] = word;
    } else {
        own_state[index] = word;
    }
}

// The state outside all objects; `number` tells the pixels of a dispatch apart.
fn reset_state(number: u32) {
    state_begins = number * (sweep.leaf_count + sweep.gate_count);
    for (var i = 0u; i < sweep.leaf_count; i += 1u) {
        set_state_word(i, 0);
    }
    for (var i = 0u; i < sweep.gate_count; i += 1u) {
        set_state_word(sweep.leaf_count + i, i32(gates[i].y));
    }
    kept = sweep.keeps_outside == 1u;
}

// Tells the expression that the ray is now inside (outside) an object; gates above follow as far as they change.
fn set_inside(leaf: u32, inside: bool) {
    var output = leaves[leaf].output;
    var value = inside != (leaves[leaf].inverted == 1u);
    while output != ROOT {
        let gate = gates[output];
        let index = sweep.leaf_count + output;
        let inputs = state_word(index);
        let now = select(inputs - 1, inputs + 1, value);
        set_state_word(index, now);
        let holds = now >= i32(gate.x);
        if holds == (inputs >= i32(gate.x)) {
            return;
        }
        value = holds != (gate.w == 1u);
        output = gate.z;
    }
    kept = value;
}
