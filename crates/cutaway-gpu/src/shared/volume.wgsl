// The voxels. Values are *texels*, as the texture holds them: a constant factor and offset away from stored numbers, which
// tables, isovalues and gradients have been made for.

import package::shared::bricks::{BRICKED, Place, place_of};
import package::shared::frame::frame;

@group(0) @binding(1) var voxels: texture_3d<f32>;
@group(0) @binding(2) var voxel_sampler: sampler;

// Values between voxels come from eight voxels in f32, not from the adapter's filter.
override EXACT_FILTERING: bool = false;

fn voxel(index: vec3i) -> f32 {
    if BRICKED {
        return exact_in(place_of(vec3f(index)), vec3f(0.0));
    }
    return textureLoad(voxels, index, 0).x;
}

// The field at a position in voxel space; positions outside the volume are clamped to it.
fn value_at(p: vec3f) -> f32 {
    if BRICKED {
        return value_in(place_of(p), vec3f(0.0));
    }
    if EXACT_FILTERING {
        return exact_value(clamp(p, vec3f(0.0), frame.extent));
    }
    return textureSampleLevel(voxels, voxel_sampler, (p + 0.5) * frame.per_voxels, 0.0).x;
}

// The field `offset` voxels, one at most, from a position: what gradients are made of. Of the position's brick, for the next
// one may not be there.
fn value_beside(p: vec3f, offset: vec3f) -> f32 {
    if BRICKED {
        return value_in(place_of(p), offset);
    }
    return value_at(p + offset);
}

// The field `offset` voxels, one at most, from a place in a brick.
fn value_in(place: Place, offset: vec3f) -> f32 {
    if EXACT_FILTERING {
        return exact_in(place, offset);
    }
    if !place.resident {
        return place.value;
    }
    let texel = vec3f(place.first) + (place.local + offset * place.texels);
    return textureSampleLevel(voxels, voxel_sampler, (texel + 0.5) / vec3f(textureDimensions(voxels)), 0.0).x;
}

fn exact_in(place: Place, offset: vec3f) -> f32 {
    if !place.resident {
        return place.value;
    }
    let local = place.local + offset * place.texels;
    let whole = floor(local);
    return trilinear(texels_around(place.first + vec3i(whole)), local - whole);
}

// The voxels around a cell's position: corner c is at (c & 1, c >> 1 & 1, c >> 2).
struct Corners {
    low: vec4f,
    high: vec4f,
}

fn corners_of(cell: vec3i) -> Corners {
    if BRICKED {
        return corners_in(place_of(vec3f(cell)));
    }
    return texels_around(cell);
}

fn texels_around(at: vec3i) -> Corners {
    let low = vec4f(
        textureLoad(voxels, at, 0).x,
        textureLoad(voxels, at + vec3i(1, 0, 0), 0).x,
        textureLoad(voxels, at + vec3i(0, 1, 0), 0).x,
        textureLoad(voxels, at + vec3i(1, 1, 0), 0).x,
    );
    let high = vec4f(
        textureLoad(voxels, at + vec3i(0, 0, 1), 0).x,
        textureLoad(voxels, at + vec3i(1, 0, 1), 0).x,
        textureLoad(voxels, at + vec3i(0, 1, 1), 0).x,
        textureLoad(voxels, at + vec3i(1, 1, 1), 0).x,
    );
    return Corners(low, high);
}

// Of a brick of a coarser level: what its field is at a cell's corners, which is the field itself, for a cell lies in one of
// its own.
fn corners_in(place: Place) -> Corners {
    if !place.resident {
        return Corners(vec4f(place.value), vec4f(place.value));
    }
    let around = texels_around(place.first + vec3i(floor(place.local)));
    if place.texels == 1.0 {
        return around;
    }
    let from_corner = fract(place.local);
    var corners: array<f32, 8>;
    for (var c = 0u; c < 8u; c += 1u) {
        let corner = vec3f(f32(c & 1u), f32((c >> 1u) & 1u), f32(c >> 2u));
        corners[c] = trilinear(around, from_corner + corner * place.texels);
    }
    return Corners(
        vec4f(corners[0], corners[1], corners[2], corners[3]),
        vec4f(corners[4], corners[5], corners[6], corners[7]),
    );
}

// The last cell ends at the far face, which belongs to it.
fn cell_of(p: vec3f) -> vec3i {
    return vec3i(clamp(floor(p), vec3f(0.0), frame.extent - 1.0));
}

fn trilinear(corners: Corners, f: vec3f) -> f32 {
    // Not `mix`, which may leave a range of equal values by a rounding.
    let plane = corners.low + (corners.high - corners.low) * f.z;
    let line = plane.xy + (plane.zw - plane.xy) * f.y;
    return line.x + (line.y - line.x) * f.x;
}

fn exact_value(p: vec3f) -> f32 {
    let cell = cell_of(p);
    return trilinear(corners_of(cell), p - vec3f(cell));
}

// Central differences of the voxels, interpolated: in texels per two voxels. Interpolating differences is the same as
// taking differences of what is interpolated a voxel further, at the border too, where indices are clamped.
fn difference_at(p: vec3f) -> vec3f {
    let x = vec3f(1.0, 0.0, 0.0);
    let y = vec3f(0.0, 1.0, 0.0);
    let z = vec3f(0.0, 0.0, 1.0);
    if BRICKED {
        let place = place_of(p);
        return vec3f(
            value_in(place, x) - value_in(place, -x),
            value_in(place, y) - value_in(place, -y),
            value_in(place, z) - value_in(place, -z),
        );
    }
    return vec3f(
        value_at(p + x) - value_at(p - x),
        value_at(p + y) - value_at(p - y),
        value_at(p + z) - value_at(p - z),
    );
}

// The same of voxels in f32, whatever the adapter's filter is like: for surfaces, of which a pixel has few.
fn exact_difference_at(p: vec3f) -> vec3f {
    var d: vec3f;
    if BRICKED {
        let place = place_of(p);
        for (var axis = 0; axis < 3; axis += 1) {
            var unit = vec3f(0.0);
            unit[axis] = 1.0;
            d[axis] = exact_in(place, unit) - exact_in(place, -unit);
        }
        return d;
    }
    for (var axis = 0; axis < 3; axis += 1) {
        var unit = vec3f(0.0);
        unit[axis] = 1.0;
        d[axis] = exact_value(min(p + unit, frame.extent)) - exact_value(max(p - unit, vec3f(0.0)));
    }
    return d;
}

fn exact_gradient_at(p: vec3f) -> vec3f {
    let d = exact_difference_at(p);
    return frame.gradient_from_texel_x * d.x + frame.gradient_from_texel_y * d.y + frame.gradient_from_texel_z * d.z;
}

// The gradient in the world; its unit is the volume's value range per largest spacing.
fn gradient_at(p: vec3f) -> vec3f {
    let d = difference_at(p);
    return frame.gradient_from_texel_x * d.x + frame.gradient_from_texel_y * d.y + frame.gradient_from_texel_z * d.z;
}
