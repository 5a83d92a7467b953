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
    let plain = Trial::test("a_window_shows_a_picture", window_shows_a_picture);
    let shared = Trial::test("a_window_shows_pictures_that_stay_on_its_device", window_shares_its_device);
    let trials =
        vec![plain.with_ignored_flag(!ready), shared.with_ignored_flag(!ready || adapter().is_none())];
    libtest_mimic::run(&arguments, trials).exit();
}

/// The name of the best adapter, if there is one.
fn adapter() -> Option<String> {
    let output = cutaway().args(["info", "--gpu"]).output().ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    Some(said.lines().next()?.split(" (").next()?.to_owned())
}

/// The program, as it runs without a display.
fn cutaway() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cutaway"));
    command.current_dir(std::env::temp_dir());
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET", "XDG_RUNTIME_DIR"] {
        command.env_remove(name);
    }
    command
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
    shows_a_picture(&["sample:marschner-lobb:32"])
}

/// An adapter that is asked for by its name draws the window and serves the engines, a processor that plays GPU too.
fn window_shares_its_device() -> Result<(), Failed> {
    let adapter = adapter().ok_or("no adapter")?;
    let folder = tempfile::tempdir()?;
    let scene = folder.path().join("scene.json");
    let scene = scene.to_str().ok_or("a folder of another name")?;
    for engine in ["raycast", "slices", "cells"] {
        let line = ["render", "sample:marschner-lobb:32", "--engine", engine, "--resolution", "8,8"];
        let picture = folder.path().join("picture.png");
        let made = cutaway().args(line).args(["--save-scene", scene, "-o"]).arg(picture).output()?;
        if !made.status.success() {
            return Err(format!("{engine}: {}", String::from_utf8_lossy(&made.stderr)).into());
        }
        let shown = shows_a_picture(&["--gpu", &adapter, "--scene", scene]);
        shown.map_err(|e| format!("{engine}: {}", e.message().unwrap_or_default()))?;
    }
    Ok(())
}

/// Opens a window and waits for a picture in it.
fn shows_a_picture(arguments: &[&str]) -> Result<(), Failed> {
    let (_server, display) = display()?;
    let mut viewer = cutaway();
    viewer.arg("view").args(arguments).env("DISPLAY", &display).stderr(Stdio::piped());
    let mut viewer = Running(viewer.spawn()?);
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
