// The gradient that lights samples: which way it is found is a setting (`cutaway_core::scene::Gradient`).

import package::shared::frame::frame;
import package::shared::volume::{gradient_at, value_beside};

// Directions of the gradient in voxel space, one texel a voxel; nothing where it vanishes.
@group(2) @binding(3) var directions: texture_3d<f32>;
@group(2) @binding(4) var direction_sampler: sampler;

// 0 central differences, 1 Sobel's, 2 precomputed.
override GRADIENT: u32 = 0u;

// Values of the field that a gradient takes.
fn gradient_samples() -> u32 {
    if GRADIENT == 1u {
        return 26u;
    }
    return select(6u, 1u, GRADIENT == 2u);
}

// Differences smoothed 1 2 1 along the two other axes, in texels per two voxels. As with central differences, what is taken
// of the interpolated field is the same as interpolating what is taken of voxels.
fn sobel_at(p: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var k = -1; k <= 1; k += 1) {
        for (var j = -1; j <= 1; j += 1) {
            for (var i = -1; i <= 1; i += 1) {
                let offset = vec3f(f32(i), f32(j), f32(k));
                let smooth_by = vec3f(0.5) - 0.25 * abs(offset);
                let weights = offset * smooth_by.yzx * smooth_by.zxy;
                if any(weights != vec3f(0.0)) {
                    sum += weights * value_beside(p, offset);
                }
            }
        }
    }
    return sum;
}

// In the world, as `gradient_at`; of precomputed ones only the direction means anything.
fn light_gradient(p: vec3f) -> vec3f {
    if GRADIENT == 0u {
        return gradient_at(p);
    }
    var d = vec3f(0.0);
    if GRADIENT == 1u {
        d = sobel_at(p);
    } else {
        d = textureSampleLevel(directions, direction_sampler, (p + 0.5) / (frame.extent + 1.0), 0.0).xyz;
    }
    return frame.gradient_from_texel_x * d.x + frame.gradient_from_texel_y * d.y + frame.gradient_from_texel_z * d.z;
}
