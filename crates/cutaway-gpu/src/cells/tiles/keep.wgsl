// Keeps a tetrahedron's record and counts it in its tiles.

import package::cells::tiles::record::{Cell, NOT_SEEN, ROW_BITS, TEXELS, TILE, cover_of, meets, tiles_of};
import package::cells::tiles::task::TileTask;

@group(1) @binding(0) var<uniform> task: TileTask;
// By tile, then by run.
@group(1) @binding(1) var<storage, read_write> counts: array<u32>;
@group(1) @binding(2) var records: texture_storage_2d<rgba32uint, write>;

fn place_of_texel(index: u32) -> vec2u {
    return vec2u(index & ((1u << ROW_BITS) - 1u), index >> ROW_BITS);
}

fn keep(index: u32, run: u32, cell: Cell) {
    let at = index * TEXELS;
    let tiles = tiles_of(cell.low, cell.high);
    let reference = vec2u(cell.reference);
    let words = array<u32, 4>(
        reference.x | (reference.y << 14u) | (cell.entries << 28u),
        cell.pieces,
        0u,
        0u,
    );
    for (var k = 0u; k < 4u; k += 1u) {
        textureStore(records, place_of_texel(at + k), vec4u(bitcast<vec3u>(cell.planes[k]), words[k]));
    }
    textureStore(records, place_of_texel(at + 4u), bitcast<vec4u>(cell.value));
    textureStore(
        records,
        place_of_texel(at + 5u),
        vec4u(tiles.first.x | (tiles.first.y << 16u), tiles.last.x | (tiles.last.y << 16u), cell.entries, 0u),
    );
    if cell.entries == NOT_SEEN {
        return;
    }
    let cover = cover_of(cell.planes, cell.entries, cell.reference);
    var tile = tiles.first;
    while tile.y <= tiles.last.y {
        if meets(cover, tile) {
            counts[(tile.y * task.tiles_x + tile.x) * task.runs + run] += 1u;
        }
        tile.x += 1u;
        if tile.x > tiles.last.x {
            tile = vec2u(tiles.first.x, tile.y + 1u);
        }
    }
}
