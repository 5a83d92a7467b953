//! A first picture: reads a volume, cuts a sphere out of it and saves the image.

use cutaway::clip::Sphere;
use cutaway::glam::DVec3;
use cutaway::prelude::*;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let head = cutaway::read("sample:mr-head")?;
    let ball = Sphere::new(DVec3::new(-308.0, 90.0, 500.0), 60.0)?;
    let image = cutaway::render(&Scene::of(head).cut(ball).resolution(256, 256))?;

    let path = std::env::temp_dir().join("cutaway-first-picture.png");
    image.save(&path)?;
    println!("{}", path.display());
    Ok(())
}
