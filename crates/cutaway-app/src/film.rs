//! Films: frames in, a file out. A `.gif` grows beside its name and takes it at the end, whole or not at all; a name with
//! `{frame}` in it makes a picture of every frame. No frame is kept longer than it takes to write it.

use std::path::Path;

use cutaway_core::image::Image;
use cutaway_io::atomic::write_atomically;
use cutaway_io::image::{BitDepth, write_image};

use crate::render::engines::Interrupt;

/// Hundredths of a second that a frame of a GIF stands.
const DELAY: u16 = 4;

/// What transparent pixels of a frame lie on.
const BACKGROUND: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// What stands for a frame's number in a name.
const NUMBER: &str = "{frame}";

/// Makes the frame of a number.
pub type NextFrame<'a> = dyn FnMut(u32) -> Result<Image, Interrupt> + 'a;

/// Whether a film of this name is a picture a frame.
pub fn is_pictures(path: &Path) -> bool {
    path.to_string_lossy().contains(NUMBER)
}

/// Writes a film of so many frames of this size, each asked of `next` when the one before is written.
///
/// # Errors
/// One line: a name that does not say how the film is kept, a size that it cannot have, or what the file system says; or
/// what `next` ends with. Then there is no GIF, while pictures that were finished stay.
pub fn write_film(
    path: &Path,
    size: [u32; 2],
    frames: u32,
    next: &mut NextFrame<'_>,
) -> Result<(), Interrupt> {
    let name = path.to_string_lossy();
    if is_pictures(path) {
        let digits = frames.max(1).to_string().len().max(4);
        return (0..frames).try_for_each(|index| {
            let image = next(index)?;
            let path = name.replace(NUMBER, &format!("{index:0digits$}"));
            Ok(write_image(Path::new(&path), &image, BitDepth::Eight)?)
        });
    }
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gif")) {
        let line = format!("{name}: a film is a .gif, or a .png for every frame with {NUMBER} in its name");
        return Err(Interrupt::Failed(line));
    }
    let [Ok(width), Ok(height)] = size.map(u16::try_from) else {
        return Err(Interrupt::Failed(format!(
            "{name}: a GIF has at most 65535 pixels a side; found {size:?}"
        )));
    };
    // What `next` ends with is no error of the file's.
    let mut ended = None;
    let write = |out: &mut _| -> Result<(), gif::EncodingError> {
        let mut encoder = gif::Encoder::new(out, width, height, &[])?;
        encoder.set_repeat(gif::Repeat::Infinite)?;
        for index in 0..frames {
            match next(index) {
                Ok(image) => encoder.write_frame(&encoded(image, [width, height]))?,
                Err(interrupt) => {
                    ended = Some(interrupt);
                    return Err(std::io::Error::from(std::io::ErrorKind::Interrupted).into());
                }
            }
        }
        Ok(())
    };
    let written = write_atomically(path, write);
    ended.map_or_else(|| Ok(written?), Err)
}

/// A frame in 256 colours.
fn encoded(image: Image, [width, height]: [u16; 2]) -> gif::Frame<'static> {
    let mut rgba = image.over_background(BACKGROUND).to_straight_u8().into_flattened();
    let mut frame = gif::Frame::from_rgba_speed(width, height, &mut rgba, 10);
    frame.delay = DELAY;
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn gray(side: u32, value: f32) -> Result<Image, Interrupt> {
        Ok(Image::filled(side, side, [value, 0.5, 0.0, 1.0]).unwrap())
    }

    /// Noise, which no GIF makes smaller.
    fn noise(side: u32, seed: u32) -> Result<Image, Interrupt> {
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let pixels = (0..side * side).map(|_| [random(), random(), random(), 1.0]).collect();
        Ok(Image::new(side, side, pixels).unwrap())
    }

    fn entries(folder: &Path) -> Vec<PathBuf> {
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    }

    #[test]
    fn a_gif_holds_its_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spin.gif");
        write_film(&path, [5, 5], 2, &mut |index| gray(5, index as f32)).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(std::fs::File::open(&path).unwrap()).unwrap();
        let mut reds = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            assert_eq!((frame.width, frame.height, frame.delay), (5, 5, DELAY));
            reds.push(frame.buffer[0]);
        }
        assert_eq!(reds, [0, 255]);
    }

    #[test]
    fn frames_go_to_the_disk_as_they_come() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spin.gif");
        let mut sizes = Vec::new();
        let mut next = |index| {
            let [file] = entries(folder.path()).try_into().unwrap();
            assert_ne!(file, path, "it has its name only at the end");
            sizes.push(file.metadata().unwrap().len());
            noise(300, index)
        };
        write_film(&path, [300, 300], 4, &mut next).unwrap();
        // 90,000 pixels a frame, of which the writer's buffer holds 65,536 bytes.
        assert!(sizes[1] > 0 && sizes.windows(2).all(|pair| pair[0] < pair[1]), "{sizes:?}");
        assert_eq!(entries(folder.path()), [path]);
    }

    #[test]
    fn a_cancelled_gif_leaves_nothing_and_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spin.gif");
        let mut next = |index| if index < 2 { noise(300, index) } else { Err(Interrupt::Overtaken) };
        assert_eq!(write_film(&path, [300, 300], 4, &mut next), Err(Interrupt::Overtaken));
        assert!(entries(folder.path()).is_empty());
        std::fs::write(&path, "old").unwrap();
        write_film(&path, [300, 300], 4, &mut next).unwrap_err();
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(entries(folder.path()), [path]);
    }

    #[test]
    fn every_frame_can_be_a_picture() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f_{frame}.png");
        write_film(&path, [2, 2], 2, &mut |index| gray(2, index as f32)).unwrap();
        assert!(folder.path().join("f_0000.png").exists() && folder.path().join("f_0001.png").exists());
    }

    #[test]
    fn other_names_and_sizes_are_refused_before_anything_is_rendered() {
        let mut never = |_| -> Result<Image, Interrupt> { panic!("nothing is to be rendered") };
        let refused =
            |name: &str, size, next: &mut NextFrame<'_>| match write_film(Path::new(name), size, 2, next) {
                Err(Interrupt::Failed(line)) => line,
                other => panic!("{other:?}"),
            };
        let line = refused("film.mkv", [2, 2], &mut never);
        assert!(line.contains("film.mkv") && line.contains(".gif"), "{line}");
        let line = refused("film.gif", [70_000, 2], &mut never);
        assert!(line.contains("65535") && line.contains("70000"), "{line}");
        let line = refused("/nowhere/at/all.gif", [2, 2], &mut never);
        assert!(line.contains("/nowhere/at"), "{line}");
    }
}
