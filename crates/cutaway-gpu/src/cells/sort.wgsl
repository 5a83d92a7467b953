// A stable radix sort of 24-bit keys, 8 bits at a time. Each of `runs` threads owns a run of neighbouring keys, which it counts
// and later moves by itself, in order: no key waits for another, and the order is the same in every frame.

// The host's side is `SortTask` in cells/mesh.rs.
struct SortTask {
    count: u32,
    // Keys of a thread.
    run: u32,
    shift: u32,
    // How many threads there are.
    runs: u32,
}

@group(0) @binding(0) var<uniform> task: SortTask;
@group(0) @binding(1) var<storage, read> from_keys: array<vec2u>;
@group(0) @binding(2) var<storage, read_write> to_keys: array<vec2u>;
// By digit, then by thread: first how many, then where the next one goes.
@group(0) @binding(3) var<storage, read_write> counts: array<u32>;
// Of each digit: how many there are of it.
@group(0) @binding(4) var<storage, read_write> totals: array<u32>;

const DIGITS = 256u;
const NOT_DRAWN = 0xffffffu;

fn digit_of(key: u32) -> u32 {
    return (key >> task.shift) & 255u;
}

@compute @workgroup_size(64)
fn count_digits(@builtin(global_invocation_id) id: vec3u) {
    for (var digit = 0u; digit < DIGITS; digit += 1u) {
        counts[digit * task.runs + id.x] = 0u;
    }
    let end = min((id.x + 1u) * task.run, task.count);
    for (var i = id.x * task.run; i < end; i += 1u) {
        counts[digit_of(from_keys[i].x) * task.runs + id.x] += 1u;
    }
}

// A thread a digit: sums over its threads.
@compute @workgroup_size(64)
fn sum_digits(@builtin(global_invocation_id) id: vec3u) {
    var sum = 0u;
    for (var run = 0u; run < task.runs; run += 1u) {
        let count = counts[id.x * task.runs + run];
        counts[id.x * task.runs + run] = sum;
        sum += count;
    }
    totals[id.x] = sum;
}

@compute @workgroup_size(64)
fn move_keys(@builtin(global_invocation_id) id: vec3u) {
    // Where each digit begins, for all that this thread owns.
    var begin = 0u;
    for (var digit = 0u; digit < DIGITS; digit += 1u) {
        counts[digit * task.runs + id.x] += begin;
        begin += totals[digit];
    }
    let end = min((id.x + 1u) * task.run, task.count);
    for (var i = id.x * task.run; i < end; i += 1u) {
        let key = from_keys[i];
        let slot = digit_of(key.x) * task.runs + id.x;
        to_keys[counts[slot]] = key;
        counts[slot] += 1u;
    }
}

// The order, and how many are drawn: the keys before the first that is not.
@group(0) @binding(5) var<storage, read_write> order: array<u32>;
// Arguments of draws, five words each, then how many tetrahedra are drawn.
@group(0) @binding(6) var<storage, read_write> draws: array<u32>;

@compute @workgroup_size(64)
fn take_order(@builtin(global_invocation_id) id: vec3u) {
    let end = min((id.x + 1u) * task.run, task.count);
    for (var i = id.x * task.run; i < end; i += 1u) {
        let key = from_keys[i];
        order[i] = key.y;
        let last = key.x != NOT_DRAWN;
        var next = NOT_DRAWN;
        if i + 1u < task.count {
            next = from_keys[i + 1u].x;
        }
        if last && (next == NOT_DRAWN) {
            draws[0] = i + 1u;
        }
    }
}

// `run` is how many tetrahedra a draw has here, `shift` how many draws there are.
@compute @workgroup_size(64)
fn make_draws(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= task.shift {
        return;
    }
    let first = id.x * task.run;
    let count = select(0u, min(draws[0] - first, task.run), draws[0] > first);
    let at = 4u + 5u * id.x;
    draws[at] = 12u * count;
    draws[at + 1u] = 1u;
    draws[at + 2u] = 0u;
    draws[at + 3u] = 5u * first;
    draws[at + 4u] = 0u;
}
