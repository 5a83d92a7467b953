// The sweep over peeled layers: of each mesh the layers that rays enter it through, and those that they leave it through.

import package::clipping::events::{FARTHEST, begin_round, offer_event};
import package::clipping::leaf::leaves;
import package::clipping::settings::sweep;
import package::clipping::shapes::collect_shapes;
import package::clipping::sweep::{begin_pixel, finish_pixel, range, ray, sweep_round};

// The host's side is `PeeledMesh` in clipping/peel/plan.rs; a test holds the two against each other.
struct PeeledMesh {
    leaf: u32,
    // Layers that rays enter through: the first, and how many.
    entering: u32,
    entering_count: u32,
    // Layers that rays leave through.
    leaving: u32,
    leaving_count: u32,
    // The last layer of one kind is the backmost surface: 1 of those that enter, 2 of those that leave; 0: of none.
    backmost: u32,
    // 1: layers are in half precision.
    half: u32,
    reserved: u32,
}

// t (in half precision a place between the ends of the volume), the octahedral point of the normal, and 1 where there is a surface.
@group(2) @binding(0) var peeled_layers: texture_2d_array<f32>;
// Of each mesh: what is added to its winding number before the volume, and what it comes to where the ray leaves the volume.
@group(2) @binding(1) var peeled_ends: texture_2d_array<f32>;
@group(2) @binding(2) var<storage, read> peeled_meshes: array<PeeledMesh>;

// Ids of events that stand for what is before and behind the volume: behind those of layers, before those of shapes.
const END_IDS = 0x40000000u;

var<private> next_end: u32;

// As many events as a winding number says, where no sample is.
fn offer_winding(leaf: u32, winding: i32, t: f32) {
    for (var i = 0; i < abs(winding); i += 1) {
        offer_event(t, leaf, winding > 0, 0u, next_end);
        next_end += 1u;
    }
}

// How many of the layers from `first` on the pixel has, at most `most`.
fn collect_layers(place: vec2u, mesh: PeeledMesh, entering: bool, first: u32, most: u32) -> u32 {
    for (var k = 0u; k < most; k += 1u) {
        let layer = textureLoad(peeled_layers, place, first + k, 0);
        if layer.w == 0.0 {
            return k;
        }
        let t = select(layer.x, mix(range.x, range.y, 0.5 + 0.5 * layer.x), mesh.half == 1u);
        offer_event(t, mesh.leaf, entering, pack2x16snorm(layer.yz), first + k);
    }
    return most;
}

fn collect_peeled(place: vec2u, index: u32) {
    let mesh = peeled_meshes[index];
    let ends = vec2i(round(textureLoad(peeled_ends, place, index, 0).xy));
    let before = leaves[mesh.leaf].eye_winding + ends.x;
    var most = vec2u(mesh.entering_count, mesh.leaving_count);
    if mesh.backmost != 0u {
        // The layers are of this mesh alone. Its last segment ends at the backmost layer, or with the volume; and a ray that
        // begins in a segment needs one beginning less.
        let keeps_outside = sweep.keeps_outside == 1u;
        let begins_kept = select(0u, 1u, (before != 0) != keeps_outside);
        let ends_kept = select(0u, 1u, (ends.y != 0) != keeps_outside);
        most -= select(vec2u(begins_kept, ends_kept), vec2u(ends_kept, begins_kept), mesh.backmost == 1u);
    }
    offer_winding(mesh.leaf, ends.x, -FARTHEST);
    let entered = collect_layers(place, mesh, true, mesh.entering, most.x);
    let left = collect_layers(place, mesh, false, mesh.leaving, most.y);
    // Where layers may be left out, it stays as it is behind the last of them; else what is behind the volume follows.
    let complete = (entered < most.x) && (left < most.y);
    let behind = select(before + i32(entered) - i32(left), ends.y, complete);
    offer_winding(mesh.leaf, -behind, FARTHEST);
}

fn collect_events(place: vec2u) {
    next_end = END_IDS;
    for (var index = 0u; index < arrayLength(&peeled_meshes); index += 1u) {
        collect_peeled(place, index);
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
