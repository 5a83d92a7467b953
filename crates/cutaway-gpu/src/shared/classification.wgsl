// What texels look like: the table of the transfer function, and behind its entries the isosurfaces.

import package::shared::frame::frame;

// Straight colour and optical depth of a whole step; then, of each isosurface, straight colour and level, ascending.
@group(0) @binding(4) var<storage, read> table: array<vec4f>;

fn classified(texel: f32) -> vec4f {
    let entry = max((texel - frame.table_offset) * frame.table_scale + 0.5, 0.0);
    return table[min(u32(entry), frame.table_last)];
}

// Colour and level of an isosurface, ascending; a level is a texel, negated where greater texels are lesser values.
fn isosurface(index: u32) -> vec4f {
    return table[frame.table_last + 1u + index];
}

// 1 - exp(-depth), also where depth is so small that the difference would be all rounding.
fn opacity_of(depth: f32) -> f32 {
    return select(1.0 - exp(-depth), depth - 0.5 * depth * depth, depth < 1e-3);
}
