//! Events of lines through real closed meshes: as many ways in as out, the same from every finder.
//!
//! The meshes are looked for in `meshes` of the folder that `CUTAWAY_DATA` names, or in `../shared/data` beside the
//! repository; a test whose mesh is not there shows as ignored.

mod support;

use std::sync::Arc;

use cutaway_core::camera::Ray;
use cutaway_core::glam::{DAffine3, DVec3};
use cutaway_mesh::events::{EventFinder, MeshEvents};
use cutaway_mesh::{PixelEvents, TileEvents, TileRect};
use libtest_mimic::{Arguments, Failed, Trial};
use support::{Random, bounds, fault, load, mesh_folder, view};

/// Which they are, and whether they do not meet themselves. Suzanne's eyes and Spot's parts lie in one another.
const CLOSED: [(&str, bool); 5] = [
    ("fuze_ascii.ply", true),
    ("featuretype.STL", true),
    ("octagonal_pocket.stl", true),
    ("suzanne.stl", false),
    ("spot.obj", false),
];

/// Open at the bottom: its lines need not balance, but the finders still agree.
const OPEN: &str = "stanford-bunny.obj";

fn main() {
    let arguments = Arguments::from_args();
    let trial = |name: &'static str, what: &str, test: fn(&str) -> Result<(), Failed>| {
        let there = mesh_folder().join(name).exists();
        Trial::test(format!("{name}: {what}"), move || test(name)).with_ignored_flag(!there)
    };
    let mut trials: Vec<Trial> =
        CLOSED.iter().map(|(name, _)| trial(name, "lines balance", balance)).collect();
    let names = CLOSED.iter().map(|(name, _)| *name).chain([OPEN]);
    trials.extend(names.map(|name| trial(name, "frames agree", frames)));
    libtest_mimic::run(&arguments, trials).exit();
}

fn balance(name: &str) -> Result<(), Failed> {
    let mesh = Arc::new(load(&mesh_folder().join(name)));
    let simple = CLOSED.contains(&(name, true));
    let [low, high] = bounds(&mesh);
    let size = (high - low).length();
    let finders = EventFinder::ALL.map(|finder| MeshEvents::new(Arc::clone(&mesh), finder));
    let mut random = Random(5);
    for i in 0..60_000 {
        let corners =
            mesh.corners(random.index(mesh.triangles().len())).map(|c| mesh.origin() + c.as_dvec3());
        let target = match i % 3 {
            0 => low + (random.cube() * 0.6 + 0.5) * (high - low),
            1 => corners[0],
            _ => (corners[0] + corners[1]) * 0.5,
        };
        let mut ray = random.towards(target, size);
        if i % 4 == 0 {
            let axis = DVec3::AXES[random.index(3)];
            ray = Ray { origin: target - axis * size, direction: axis };
        }
        let mut events = Vec::new();
        finders[i / 4 % 4].line(&ray, &mut events);
        // Flat faces that a line runs along are crossed anywhere along them, hence the tolerance there.
        let tolerance = if i % 4 == 0 { f64::INFINITY } else { 1e-6 * size / ray.direction.length() };
        if let Some(fault) = fault(&events, tolerance, simple) {
            return Err(format!("{ray:?}: {fault}").into());
        }
        if i % 20 == 0 {
            let mut all = Vec::new();
            finders[0].line_exhaustive(&ray, &mut all);
            for finder in &finders {
                events.clear();
                finder.line(&ray, &mut events);
                if events != all {
                    return Err(format!("{:?} {ray:?}: {events:?}, not {all:?}", finder.finder()).into());
                }
            }
        }
    }
    Ok(())
}

/// Every pixel of a frame, from every finder, with a pose.
fn frames(name: &str) -> Result<(), Failed> {
    const SIDE: u32 = 160;
    let mesh = Arc::new(load(&mesh_folder().join(name)));
    let finders = EventFinder::ALL.map(|finder| MeshEvents::new(Arc::clone(&mesh), finder));
    let pose = DAffine3::from_rotation_x(0.4);
    let (mut expected, mut tile) = (TileEvents::new(), TileEvents::new());
    for (forward, orthographic) in [(DVec3::new(0.2, 0.1, -1.0), false), (DVec3::new(1.0, 0.3, 0.2), true)] {
        let rays = view(&mesh, forward, [SIDE, SIDE], orthographic);
        let frames = finders.each_ref().map(|finder| finder.frame(&rays, &pose, SIDE, SIDE));
        for (x, y) in (0..SIDE).step_by(32).flat_map(|y| (0..SIDE).step_by(32).map(move |x| (x, y))) {
            let rect = TileRect { x, y, width: 32, height: 32 };
            frames[0].tile(rect, &mut expected);
            for (frame, finder) in frames.iter().zip(&finders) {
                frame.tile(rect, &mut tile);
                for (row, column) in (0..32).flat_map(|r| (0..32).map(move |c| (r, c))) {
                    let (found, expected) = (tile.pixel(column, row), expected.pixel(column, row));
                    if found != expected {
                        let at = format!("{:?} at {x}+{column}, {y}+{row}", finder.finder());
                        return Err(format!("{at}: {found:?}, not {expected:?}").into());
                    }
                }
            }
        }
    }
    Ok(())
}
