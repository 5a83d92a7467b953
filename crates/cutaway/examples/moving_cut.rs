//! A mesh that cuts and moves: the volume is prepared once, and each pose costs one frame.

use cutaway::clip::{ObjectId, Pose};
use cutaway::engine::{Renderer, Request};
use cutaway::glam::{DAffine3, DVec3};
use cutaway::prelude::*;

/// A closed mesh: the corner of a cube.
const TETRAHEDRON: &str = "v 0 0 0\nv 90 0 0\nv 0 90 0\nv 0 0 90\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::temp_dir().join("cutaway-moving-cut");
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("corner.obj");
    std::fs::write(&file, TETRAHEDRON)?;

    let mesh = cutaway::read_solid(&file)?;
    let builder = Scene::of(cutaway::read("sample:mr-head")?).cut(mesh).resolution(128, 128);
    let mut clip = builder.clip().cloned().ok_or("nothing is cut")?;
    let mut scene = builder.build()?;

    let mut renderer = Renderer::default();
    for step in 0..4 {
        let place = DVec3::new(-350.0 + 20.0 * f64::from(step), 40.0, 450.0);
        clip.set_pose(ObjectId(0), Pose::new(DAffine3::from_translation(place))?);
        scene.set_clip(Some(&clip))?;
        let frame = renderer.render(&scene, &Request::default())?;
        // The volume was prepared for the first frame, and serves all others.
        assert!(step == 0 || frame.about.prepare_ms == 0.0);
        let image = frame.picture.into_image().ok_or("the image is on a device")?;
        image.save(folder.join(format!("cut-{step}.png")))?;
    }
    println!("{}", folder.display());
    Ok(())
}
