//! `cutaway view` in a real window, on a display of the test's own (Xvfb). Without one, or in a build without the viewer,
//! this shows as ignored.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use libtest_mimic::{Arguments, Failed, Trial};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ConnectionExt, ImageFormat};

const SIZE: [u16; 2] = [1000, 700];

/// How long the first picture may take on a machine that has other things to do.
const PATIENCE: Duration = Duration::from_secs(120);

fn main() {
    let arguments = Arguments::from_args();
    let ready = cfg!(feature = "viewer") && display().is_ok();
    let trial = Trial::test("a_window_shows_a_picture", window_shows_a_picture).with_ignored_flag(!ready);
    libtest_mimic::run(&arguments, vec![trial]).exit();
}

/// A process that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A display without a screen, and its number.
fn display() -> Result<(Running, String), Failed> {
    let screen = format!("{}x{}x24", SIZE[0], SIZE[1]);
    let mut server = Command::new("Xvfb")
        .args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()?;
    let output = server.stdout.take().ok_or("no output")?;
    let server = Running(server);
    let mut number = String::new();
    BufReader::new(output).read_line(&mut number)?;
    let number = number.trim();
    if number.is_empty() { Err("no display was opened".into()) } else { Ok((server, format!(":{number}"))) }
}

fn window_shows_a_picture() -> Result<(), Failed> {
    let (_server, display) = display()?;
    let folder = std::env::temp_dir();
    let viewer = Command::new(env!("CARGO_BIN_EXE_cutaway"))
        .args(["view", "sample:marschner-lobb:32"])
        .current_dir(folder)
        .env("DISPLAY", &display)
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("XDG_RUNTIME_DIR")
        .stderr(Stdio::piped())
        .spawn()?;
    let mut viewer = Running(viewer);
    let began = Instant::now();
    loop {
        std::thread::sleep(Duration::from_millis(200));
        if let Some(status) = viewer.0.try_wait()? {
            let said = viewer.0.stderr.take().map(std::io::read_to_string).transpose()?.unwrap_or_default();
            return Err(format!("it ended, {status}: {said}").into());
        }
        let colours = colours(&display)?;
        // Menus and text are grey; a picture has hundreds of colours.
        if colours > 300 {
            return Ok(());
        }
        if began.elapsed() > PATIENCE {
            return Err(format!("{colours} colours after {} s: no picture", PATIENCE.as_secs()).into());
        }
    }
}

/// How many different colours the left half of the display has, where the picture is.
fn colours(display: &str) -> Result<usize, Failed> {
    let (connection, screen) = x11rb::connect(Some(display))?;
    let root = connection.setup().roots[screen].root;
    let image = connection.get_image(ImageFormat::Z_PIXMAP, root, 0, 0, SIZE[0] / 2, SIZE[1], !0)?.reply()?;
    let mut pixels: Vec<[u8; 4]> = image.data.as_chunks::<4>().0.to_vec();
    pixels.sort_unstable();
    pixels.dedup();
    Ok(pixels.len())
}
