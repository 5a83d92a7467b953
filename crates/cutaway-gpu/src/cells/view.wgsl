// How points come to the image. All that is interpolated across a triangle is linear in the image, also in perspective: with
// `depth` the distance along the view from the plane of the rays' points, and w = 1 + depth / D, D the eye's distance from
// that plane, what is kept of a point is depth / w and value / w. Parallel rays have w = 1.

// The host's side is `ViewUniforms` in cells/view.rs.
struct CellView {
    // Of a point in the cells' own space (voxels, or the world of a mesh less its middle): pixels from the axis, before w.
    x: vec4f,
    y: vec4f,
    // Depth in world units.
    depth: vec4f,
    // The pixel of the axis.
    axis: vec2f,
    // 1 / D; 0 where rays are parallel.
    inverse: f32,
    // The least w: what is nearer, or behind the eye, is not drawn.
    least_w: f32,
    // The eye in the cells' space, 1; or the direction towards it, 0.
    eye: vec4f,
    size: vec2f,
    // Values in bins: (texel - offset) * scale.
    value_offset: f32,
    value_scale: f32,
    // 1 / unit distance of the transfer function, in world units.
    per_unit: f32,
    piece_last: u32,
    // Cells along each axis, of grids.
    cells_x: u32,
    cells_y: u32,
    cells_z: u32,
    // 1: cells of which nothing is visible are drawn too, for clip surfaces in them are.
    draw_all: u32,
    // 1: cells that reach behind the eye are drawn, up to the nearest plane.
    keeps_behind: u32,
    reserved_y: u32,
}

@group(2) @binding(0) var<uniform> view: CellView;

// Pixel x and y, depth / w, and 1 / w; the latter is 0 where a point is not before the eye.
fn projected(p: vec3f) -> vec4f {
    let q = vec4f(p, 1.0);
    let depth = dot(view.depth, q);
    let w = 1.0 + depth * view.inverse;
    if w < view.least_w {
        return vec4f(0.0);
    }
    let inverse_w = 1.0 / w;
    return vec4f(vec2f(dot(view.x, q), dot(view.y, q)) * inverse_w + view.axis, depth * inverse_w, inverse_w);
}

// From a place in pixels, whose centres are whole numbers.
fn clip_position(pixel: vec2f) -> vec4f {
    let share = (pixel + 0.5) / view.size;
    return vec4f(2.0 * share.x - 1.0, 1.0 - 2.0 * share.y, 0.5, 1.0);
}

// Whether the box of pixel places from lo to hi has the centre of a pixel of the image in it. The rasteriser rounds places
// to 1/256.
fn covers_a_centre(lo: vec2f, hi: vec2f) -> bool {
    let first = max(ceil(lo - 0.0079), vec2f(0.0));
    let last = min(floor(hi + 0.0079), view.size - 1.0);
    return all(first <= last);
}

fn bins_of(texel: f32) -> f32 {
    return (texel - view.value_offset) * view.value_scale;
}
