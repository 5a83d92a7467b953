// Blinn-Phong from the gradient; see `cutaway_core::lighting` for the curves and the rule where the gradient vanishes.

import package::shared::frame::frame;

// Samples of the volume are lit.
override SHADED: bool = true;
// 0 clamped, 1 two-sided, 2 wrapped.
override DIFFUSE_CURVE: u32 = 1u;

// What light makes of a colour: a factor, and white that is added.
struct Terms {
    factor: f32,
    white: f32,
}

const UNLIT = Terms(1.0, 0.0);

fn towards_light(direction_in_world: vec3f) -> vec3f {
    return select(frame.light, -direction_in_world, frame.headlight == 1u);
}

// Half-way between light and eye; of opposite ones there is none, and the eye's direction is taken.
fn halfway(light: vec3f, direction_in_world: vec3f) -> vec3f {
    let sum = light - direction_in_world;
    let far = length(sum);
    return select(sum / far, -direction_in_world, far == 0.0);
}

// pow(0, 0) is 1 here, as on the host.
fn power(base: f32, exponent: f32) -> f32 {
    return select(pow(max(base, 0.0), exponent), select(0.0, 1.0, exponent == 0.0), base <= 0.0);
}

fn curves(n_dot_l: f32, n_dot_h: f32) -> vec2f {
    if DIFFUSE_CURVE == 0u {
        return vec2f(max(n_dot_l, 0.0), power(n_dot_h, frame.specular_power));
    }
    if DIFFUSE_CURVE == 1u {
        return vec2f(abs(n_dot_l), power(abs(n_dot_h), frame.specular_power));
    }
    return vec2f(power(0.5 * n_dot_l + 0.5, frame.wrap_power), power(n_dot_h, frame.specular_power));
}

// The light on a surface of this unit normal.
fn terms_of_normal(normal: vec3f, direction_in_world: vec3f) -> Terms {
    let l = towards_light(direction_in_world);
    let h = halfway(l, direction_in_world);
    let d = curves(dot(normal, l), dot(normal, h));
    return Terms(frame.ambient + frame.diffuse * d.x, frame.specular * d.y);
}

// The light where the field has this gradient.
fn terms_of_gradient(gradient: vec3f, direction_in_world: vec3f) -> Terms {
    let far = length(gradient);
    if far > frame.vanishing {
        return terms_of_normal(-gradient / far, direction_in_world);
    }
    return Terms(frame.ambient + frame.diffuse * frame.mean_diffuse, frame.specular * frame.mean_specular);
}

fn lit(color: vec3f, terms: Terms) -> vec3f {
    return color * terms.factor + terms.white;
}
