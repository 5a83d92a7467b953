//! Films: frames in, a file out. A `.gif` is written whole at the end; a name with `{frame}` in it makes a picture of every
//! frame.

use std::path::{Path, PathBuf};

use cutaway_core::image::Image;
use cutaway_io::atomic::write_atomically;
use cutaway_io::image::{BitDepth, write_image};

/// Hundredths of a second that a frame of a GIF stands.
const DELAY: u16 = 4;

/// What transparent pixels of a frame lie on.
const BACKGROUND: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// A film on its way to its file.
#[derive(Debug)]
pub struct Film {
    path: PathBuf,
    size: [u32; 2],
    digits: usize,
    count: u32,
    /// Frames of a GIF, encoded; none where every frame is a picture.
    encoded: Option<Vec<gif::Frame<'static>>>,
}

impl Film {
    /// A film of so many frames of this size.
    ///
    /// # Errors
    /// A name that does not say how the film is kept, or a size that it cannot have.
    pub fn new(path: &Path, size: [u32; 2], frames: u32) -> Result<Self, String> {
        let name = path.to_string_lossy();
        let pictures = name.contains("{frame}");
        let is_gif = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gif"));
        if !pictures && !is_gif {
            return Err(format!(
                "{name}: a film is a .gif, or a .png for every frame with {{frame}} in its name"
            ));
        }
        if is_gif && size.iter().any(|side| *side > u32::from(u16::MAX)) {
            return Err(format!("{name}: a GIF has at most 65535 pixels a side; found {size:?}"));
        }
        let digits = frames.max(1).to_string().len().max(4);
        let encoded = (!pictures).then(Vec::new);
        Ok(Self { path: path.to_owned(), size, digits, count: 0, encoded })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// One line: the file, and what is wrong.
    pub fn add(&mut self, image: Image) -> Result<(), String> {
        let index = self.count;
        self.count += 1;
        let Some(encoded) = &mut self.encoded else {
            let number = format!("{index:0width$}", width = self.digits);
            let path = self.path.to_string_lossy().replace("{frame}", &number);
            return write_image(Path::new(&path), &image, BitDepth::Eight).map_err(|e| e.to_string());
        };
        let mut rgba = image.over_background(BACKGROUND).to_straight_u8().into_flattened();
        let [width, height] = self.size.map(|side| side as u16);
        let mut frame = gif::Frame::from_rgba_speed(width, height, &mut rgba, 10);
        frame.delay = DELAY;
        frame.make_lzw_pre_encoded();
        encoded.push(frame);
        Ok(())
    }

    /// Writes what is not written yet: the whole file, or none.
    ///
    /// # Errors
    /// One line: the file, and what is wrong.
    pub fn finish(self) -> Result<(), String> {
        let Some(frames) = self.encoded else { return Ok(()) };
        let [width, height] = self.size.map(|side| side as u16);
        let write = |out: &mut _| -> Result<(), gif::EncodingError> {
            let mut encoder = gif::Encoder::new(out, width, height, &[])?;
            encoder.set_repeat(gif::Repeat::Infinite)?;
            frames.iter().try_for_each(|frame| encoder.write_lzw_pre_encoded_frame(frame))
        };
        write_atomically(&self.path, write).map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gif_holds_its_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spin.gif");
        let mut film = Film::new(&path, [5, 3], 2).unwrap();
        for red in [0.0, 1.0] {
            film.add(Image::filled(5, 3, [red, 0.5, 0.0, 1.0]).unwrap()).unwrap();
        }
        assert!(!path.exists());
        film.finish().unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(std::fs::File::open(&path).unwrap()).unwrap();
        let mut reds = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            assert_eq!((frame.width, frame.height), (5, 3));
            reds.push(frame.buffer[0]);
        }
        assert_eq!(reds, [0, 255]);
    }

    #[test]
    fn every_frame_can_be_a_picture() {
        let folder = tempfile::tempdir().unwrap();
        let mut film = Film::new(&folder.path().join("f_{frame}.png"), [2, 2], 2).unwrap();
        film.add(Image::filled(2, 2, [0.0; 4]).unwrap()).unwrap();
        film.add(Image::filled(2, 2, [1.0; 4]).unwrap()).unwrap();
        film.finish().unwrap();
        assert!(folder.path().join("f_0000.png").exists() && folder.path().join("f_0001.png").exists());
    }

    #[test]
    fn other_names_are_refused() {
        let error = Film::new(Path::new("film.mkv"), [2, 2], 2).unwrap_err();
        assert!(error.contains("film.mkv") && error.contains(".gif"), "{error}");
    }
}
