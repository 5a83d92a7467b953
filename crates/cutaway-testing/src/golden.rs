//! Golden images: what was once looked at and found right.
//!
//! They lie in `goldens/images`, 8-bit PNG, small and of odd size. `CUTAWAY_BLESS=1 cargo test -p cutaway-testing` writes
//! them anew: look at each before it is committed. A failure writes what came out, what was expected and ten times the
//! difference into a folder that the message names.

use std::path::PathBuf;

use cutaway_core::image::Image;
use cutaway_core::image::compare::{compare, difference_image};
use cutaway_io::image::{BitDepth, read_image, write_image};

/// Largest RMSE from a golden image: rounding to 8 bits alone is 0.0011 (1 / 255 / sqrt 12).
const LARGEST_RMSE: f64 = 0.002;

/// Panics where an image is not the golden one of this name.
#[track_caller]
pub fn assert_golden(name: &str, image: &Image) {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("goldens/images/{name}.png"));
    if std::env::var_os("CUTAWAY_BLESS").is_some() {
        write_image(&path, image, BitDepth::Eight).expect("golden images can be written");
        return;
    }
    let expected = read_image(&path).unwrap_or_else(|e| panic!("{e}"));
    let comparison = compare(&expected, image).unwrap_or_else(|e| panic!("{name}: {e}"));
    if !comparison.exceeds(LARGEST_RMSE) {
        return;
    }
    let folder = std::env::temp_dir().join("cutaway-golden-failures");
    std::fs::create_dir_all(&folder).expect("the build folder can be written");
    let write = |what: &str, image: &Image| {
        write_image(&folder.join(format!("{name}.{what}.png")), image, BitDepth::Eight)
            .expect("it can be written");
    };
    write("actual", image);
    write("expected", &expected);
    write("difference", &difference_image(&expected, image, 10.0).expect("same size"));
    panic!("{name}: {comparison}\nsee {}", folder.display());
}
