// From the tiles' order to the image.

import package::cells::tiles::record::TILE;
import package::cells::tiles::task::TileTask;

@group(0) @binding(0) var<uniform> task: TileTask;
@group(0) @binding(1) var<storage, read> image: array<vec4f>;

@vertex
fn show_all(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn show_pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    let tile = pixel / TILE;
    let local = pixel % TILE;
    let part = 2u * (local.y / 2u) + local.x / 4u;
    return image[((tile.y * task.tiles_x + tile.x) * 8u + part) * 8u + 4u * (local.y % 2u) + local.x % 4u];
}
