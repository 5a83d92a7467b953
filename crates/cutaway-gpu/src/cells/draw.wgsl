// Draws tetrahedra: a fan of four triangles around the thick place of each, and in each fragment the integral along the
// pixel's ray from the near to the far side (Maximo, section 4.2).

import package::cells::integral::{Stretch, integral_of};
import package::cells::lattice::{corner_offset, corners_of_tet, parity_of};
import package::cells::pieces::pieces_of;
import package::cells::record::Record;
import package::cells::view::{bins_of, clip_position, projected, view};
import package::shared::face::{Face, face_of, impregnated};
import package::shared::frame::frame;
import package::shared::lighting::{SHADED, Terms, UNLIT, lit, terms_of_gradient};
import package::shared::ray::{Ray, position, ray_of};
import package::shared::segments::{CLIPPED, Segment, segment, segment_count};
import package::shared::volume::{gradient_at, voxel};

// 0 a grid under parallel rays, from its basis cell; 1 a grid, from records; 2 a mesh, from records.
override SOURCE: u32 = 0u;
// Clip surfaces are lit.
override FACES_LIT: bool = true;

// A tetrahedron of the basis cell; the host's side is `BasisTetrahedron` in cells/basis.rs.
struct Basis {
    // The thick place from the cell's first corner: pixels, and depth at its near and far end.
    thick: vec4f,
    // Weights of the corners at both ends.
    near: vec4f,
    far: vec4f,
    // Places in `corners_of_tet`.
    ring: vec4u,
}

struct Chunk {
    first: u32,
    reserved_x: u32,
    reserved_y: u32,
    reserved_z: u32,
}

@group(3) @binding(0) var<uniform> chunk: Chunk;
// Of parity 0, then of parity 1; six each.
@group(3) @binding(1) var<uniform> basis: array<Basis, 12>;
@group(3) @binding(2) var<storage, read> ordered: array<u32>;
// Tetrahedra of the chunk; of a mesh, records back to front.
@group(3) @binding(3) var<storage, read> list: array<u32>;
@group(3) @binding(4) var<storage, read> records: array<Record>;
// Points of a mesh in the image: x, y, depth / w, 1 / w; then their values in bins and gradients.
@group(3) @binding(5) var<storage, read> points: array<vec4f>;
@group(3) @binding(6) var<storage, read> gradients: array<vec4f>;

struct Varying {
    @builtin(position) position: vec4f,
    // Depth / w, near and far; value / w, near and far.
    @location(0) @interpolate(linear) ends: vec4f,
    // Gradient / w in the middle.
    @location(1) @interpolate(linear) gradient: vec3f,
    // Least and greatest value, longest depth.
    @location(2) @interpolate(flat) limits: vec3f,
    // First and last piece of the transfer function.
    @location(3) @interpolate(flat) pieces: u32,
}

fn at_pixel(pixel: vec2f, ends: vec4f, gradient: vec3f) -> Varying {
    return Varying(clip_position(pixel), ends, gradient, vec3f(0.0), 0u);
}

// The thick place, which is the first of each triangle: what is flat comes from here.
fn thick(thick_at: vec4f, values: vec4f, longest: f32, pieces: u32, gradient: vec3f) -> Varying {
    let ends = vec4f(thick_at.zw, values.xy);
    return Varying(clip_position(thick_at.xy), ends, gradient, vec3f(values.zw, longest), pieces);
}

fn block_at_place(in_chunk: u32) -> vec3u {
    let packed = ordered[1u + chunk.first + in_chunk];
    return vec3u(extractBits(packed, 0u, 10u), extractBits(packed, 10u, 10u), extractBits(packed, 20u, 10u));
}

fn grid_point(at: vec3u) -> Varying {
    let p = projected(vec3f(at));
    let q = bins_of(voxel(vec3i(at))) * p.w;
    return at_pixel(p.xy, vec4f(p.zz, q, q), vec3f(0.0));
}

fn from_basis(cell: vec3u, tet: u32, place: u32) -> Varying {
    let parity = parity_of(cell);
    let corners = corners_of_tet(tet, parity);
    let index = 6u * parity + tet;
    if place > 0u {
        return grid_point(cell + corner_offset(corners[basis[index].ring[place - 1u]]));
    }
    var s: vec4f;
    for (var k = 0u; k < 4u; k += 1u) {
        s[k] = bins_of(voxel(vec3i(cell + corner_offset(corners[k]))));
    }
    let least = min(min(s.x, s.y), min(s.z, s.w));
    let most = max(max(s.x, s.y), max(s.z, s.w));
    let from_cell = basis[index].thick;
    let origin = projected(vec3f(cell));
    let values = vec4f(dot(basis[index].near, s), dot(basis[index].far, s), least, most);
    let at = origin.xyzz + from_cell;
    return thick(at, values, from_cell.w - from_cell.z, pieces_of(least, most), vec3f(0.0));
}

fn mesh_point(index: u32) -> Varying {
    let p = points[index];
    let own = gradients[index];
    let q = own.w * p.w;
    return at_pixel(p.xy, vec4f(p.zz, q, q), own.xyz * p.w);
}

fn mesh_gradient(packed: vec2u) -> vec3f {
    let rest = unpack2x16snorm(packed.y);
    return vec3f(unpack2x16snorm(packed.x), rest.x) * exp2(64.0 * rest.y);
}

@vertex
fn place_vertex(@builtin(vertex_index) index: u32) -> Varying {
    let number = index / 5u;
    let place = index % 5u;
    if SOURCE == 2u {
        let record = list[number];
        if place > 0u {
            return mesh_point(records[record].ring[place - 1u]);
        }
        let own = records[record];
        return thick(own.thick, own.values, own.longest, own.pieces, mesh_gradient(own.gradient));
    }
    let entry = list[number];
    let local = vec3u(extractBits(entry, 3u, 3u), extractBits(entry, 6u, 3u), extractBits(entry, 9u, 3u));
    let cell = block_at_place(entry >> 12u) * 8u + local;
    if SOURCE == 0u {
        return from_basis(cell, entry & 7u, place);
    }
    if place > 0u {
        return grid_point(cell + corner_offset(records[number].ring[place - 1u]));
    }
    return thick(records[number].thick, records[number].values, records[number].longest, records[number].pieces, vec3f(0.0));
}

// Light in the middle of a stretch.
fn light_at(ray: Ray, t: f32, gradient: vec3f) -> Terms {
    if !SHADED {
        return UNLIT;
    }
    if SOURCE == 2u {
        return terms_of_gradient(gradient, ray.direction_in_world);
    }
    return terms_of_gradient(gradient_at(position(ray, t)), ray.direction_in_world);
}

// Colour and opacity (both of all of it) of a stretch with light in it.
fn lit_stretch(color: vec4f, terms: Terms) -> vec4f {
    return vec4f(color.xyz * terms.factor + terms.white * color.w, color.w);
}

@fragment
fn draw_pixel(in: Varying) -> @location(0) vec4f {
    let place = vec2u(in.position.xy);
    let ray = ray_of(vec2f(place));
    let w = 1.0 / (1.0 - in.ends.xy * view.inverse);
    let depths = in.ends.xy * w;
    // Of triangles thinner than rounding, what is interpolated may be anything.
    let values = clamp(in.ends.zw * w, in.limits.xx, in.limits.yy);
    let to_ray = select(ray.base * view.inverse, 1.0, frame.parallel == 1u);
    let t_near = depths.x * to_ray;
    let length = clamp(depths.y - depths.x, 0.0, 1.001 * in.limits.z) * to_ray;
    let whole = Stretch(values.x, values.y, length);
    if !CLIPPED {
        let color = integral_of(whole, in.pieces);
        if color.w <= 0.0 {
            return vec4f(0.0);
        }
        return lit_stretch(color, light_at(ray, t_near + 0.5 * length, in.gradient * w.x));
    }
    return clipped_stretch(in, ray, place, whole, t_near, w.x);
}

// The parts of a stretch that clip segments keep, values being linear along it.
fn clipped_stretch(in: Varying, ray: Ray, place: vec2u, whole: Stretch, t_near: f32, w: f32) -> vec4f {
    var sum = vec4f(0.0);
    let t_far = t_near + whole.length;
    let per_length = (whole.far - whole.near) / max(whole.length, 1e-30);
    let count = segment_count(place);
    for (var k = 0u; k < count; k += 1u) {
        let piece = segment(place, k);
        if piece.t_near >= t_far {
            break;
        }
        if piece.t_far <= t_near {
            continue;
        }
        let face = face_of(ray, piece, FACES_LIT);
        if face.present && (frame.overlay > 0.0) && (piece.t_near >= t_near) {
            let surface = lit(vec3f(1.0), face.terms);
            sum += (1.0 - sum.w) * frame.overlay * vec4f(surface, 1.0);
        }
        let a = max(piece.t_near, t_near);
        let b = min(piece.t_far, t_far);
        let near = whole.near + per_length * (a - t_near);
        let far = whole.near + per_length * (b - t_near);
        let color = integral_of(Stretch(clamp(near, in.limits.x, in.limits.y), clamp(far, in.limits.x, in.limits.y), b - a), in.pieces);
        if color.w > 0.0 {
            let middle = 0.5 * (a + b);
            let terms = impregnated(face, middle, light_at(ray, middle, in.gradient * w));
            sum += (1.0 - sum.w) * lit_stretch(color, terms);
        }
    }
    return sum;
}
