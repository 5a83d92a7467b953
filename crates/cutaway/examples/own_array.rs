//! An array of one's own as a volume: 64 x 64 x 64 values of a function, x fastest.

use cutaway::glam::{DVec3, UVec3};
use cutaway::prelude::*;
use cutaway::transfer_function::{ControlPoint, TransferFunction};
use cutaway::volume::{Geometry, Rescale, Volume};

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let size = 64_u32;
    let middle = f64::from(size - 1) / 2.0;
    let mut values = Vec::new();
    for z in 0..size {
        for y in 0..size {
            for x in 0..size {
                let p = (UVec3::new(x, y, z).as_dvec3() - DVec3::splat(middle)) / middle;
                values.push((p.length() + 0.1 * (9.0 * p.x).sin()) as f32);
            }
        }
    }
    let geometry = Geometry::from_spacing(DVec3::new(0.5, 0.5, 0.5));
    let volume = Volume::new(UVec3::splat(size), values, Rescale::IDENTITY, geometry)?;

    let function = TransferFunction::new(vec![
        ControlPoint { value: 0.3, color: [0.9, 0.3, 0.2], opacity: 0.4 },
        ControlPoint { value: 0.5, color: [0.9, 0.8, 0.4], opacity: 0.1 },
        ControlPoint { value: 0.8, color: [0.2, 0.4, 0.9], opacity: 0.0 },
    ])?;
    let scene = Scene::of(volume).transfer_function(&function).turned(30.0, 10.0).resolution(200, 200);
    let image = cutaway::render(&scene)?;

    let path = std::env::temp_dir().join("cutaway-own-array.png");
    image.save(&path)?;
    println!("{}", path.display());
    Ok(())
}
