// A stretch of the tetrahedra, in order from the eye on, that is binned and drawn at once. The host's side is `TileTask` in
// tiles/mod.rs.

struct TileTask {
    // The first of the stretch, counted from the one nearest to the eye, and how many there are in it.
    first: u32,
    count: u32,
    // How many there are in all.
    total: u32,
    // Runs of neighbours that a thread each bins, and how many are in one.
    runs: u32,
    run: u32,
    tiles_x: u32,
    tiles: u32,
    // Of each tile's list, the first entry that is drawn now.
    window: u32,
}
