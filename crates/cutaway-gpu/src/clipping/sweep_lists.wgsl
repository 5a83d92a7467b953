// The sweep over event lists: a pixel's list begins at its head, and each node tells where the next one is.

import package::clipping::events::{begin_round, offer_event};
import package::clipping::settings::sweep;
import package::clipping::shapes::collect_shapes;
import package::clipping::sweep::{begin_pixel, finish_pixel, ray, sweep_round};
import package::shared::frame::frame;

// Of each pixel, row by row: the number of its first node, from 1; 0 of none.
@group(2) @binding(0) var<storage, read> list_heads: array<u32>;
// The number of the next node, t as f32 bits, the octahedral normal, and twice the object plus 1 where the ray enters it.
@group(2) @binding(1) var<storage, read> list_nodes: array<vec4u>;

fn collect_events(place: vec2u) {
    var number = list_heads[place.y * frame.resolution.x + place.x];
    while number != 0u {
        let node = list_nodes[number - 1u];
        offer_event(bitcast<f32>(node.y), node.w >> 1u, (node.w & 1u) == 1u, node.z, number);
        number = node.x;
    }
}

@compute @workgroup_size(8, 8)
fn sweep_pixel(@builtin(global_invocation_id) id: vec3u) {
    if !begin_pixel(id.xy) {
        return;
    }
    let place = sweep.first_pixel + id.xy;
    loop {
        begin_round();
        collect_events(place);
        collect_shapes(place, ray);
        if !sweep_round() {
            break;
        }
    }
    finish_pixel(id.xy);
}
