//! What surrounds a process: pipes with names, signals, closed streams, little memory.
#![cfg(unix)]

mod common;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use common::{command, names, nrrd, run};

/// Longer than any of these takes, on a machine that does much else.
const PATIENCE: Duration = Duration::from_secs(60);

/// Waits for a process that must end by itself.
#[track_caller]
fn ends(mut child: Child, what: &str) -> Output {
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if started.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{what}: still waiting after {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

fn ramp(folder: &Path, name: &str, side: usize) {
    let voxels: Vec<u8> = (0..side.pow(3)).map(|i| (i % 251) as u8).collect();
    std::fs::write(folder.join(name), nrrd([side; 3], "uint8", &voxels)).unwrap();
}

fn fifo(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    path
}

#[test]
fn report_b4_pipes_with_a_name_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    ramp(folder.path(), "v.nrrd", 4);
    run(folder.path(), "render v.nrrd --resolution 8,8 --engine cpu -o p.png").succeeds();
    for name in ["f.nrrd", "f.obj", "f.json", "f.png", "f.vtk", "f.txt", "f.nii.gz"] {
        fifo(folder.path(), name);
    }
    for line in [
        "render f.nrrd -o o.png",
        "render f.nii.gz -o o.png",
        "render f.vtk -o o.png",
        "render f.txt --dims 4,4,4 --type uint8 -o o.png",
        "render v.nrrd --cut f.obj -o o.png",
        "render v.nrrd --probe f.txt -o o.png",
        "render v.nrrd --transfer-function f.json -o o.png",
        "render --scene f.json -o o.png",
        "info f.nrrd",
        "info f.obj",
        "info f.json",
        "info f.txt",
        "convert f.obj o.ply",
        "convert f.txt o.ply",
        "convert f.json o.vp",
        "compare p.png f.png",
        "bench frame f.nrrd --frames 1",
    ] {
        let mut command = command(folder.path());
        let child =
            command.args(line.split(' ')).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let output = ends(child, line);
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), err.lines().count()), (Some(1), 1), "{line}: {err}");
        assert!(err.contains("named pipe") && err.contains("f."), "{line}: {err}");
    }
}

#[test]
fn report_b4_what_a_shell_passes_is_read() {
    let folder = tempfile::tempdir().unwrap();
    ramp(folder.path(), "v.nrrd", 4);
    let function = r#"{"points": [{"value": 0, "color": [1, 1, 1], "opacity": 0.5}]}"#;
    std::fs::write(folder.path().join("t.json"), function).unwrap();
    let line = r#"cat t.json | "$0" render v.nrrd --resolution 8,8 --engine cpu --transfer-function /dev/stdin -o o.png"#;
    let output = shell(folder.path(), line);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Runs a line of a shell, to which `$0` is the program.
fn shell(folder: &Path, line: &str) -> Output {
    let mut shell = Command::new("sh");
    let program = command(folder).get_program().to_owned();
    shell
        .args(["-c", line])
        .arg(program)
        .current_dir(folder)
        .stdin(Stdio::null())
        .env_remove("XDG_RUNTIME_DIR")
        .env("RUST_BACKTRACE", "0");
    shell.output().unwrap()
}

#[test]
fn report_b4_signals_leave_nothing_behind() {
    use std::os::unix::process::ExitStatusExt;
    let folder = tempfile::tempdir().unwrap();
    ramp(folder.path(), "v.nrrd", 8);
    for (signal, number) in [("INT", 2), ("TERM", 15), ("HUP", 1)] {
        let line = "render v.nrrd --engine cpu --resolution 3000,3000 --bit-depth 16 -o out.png";
        let mut child = command(folder.path()).args(line.split(' ')).spawn().unwrap();
        let started = Instant::now();
        while !names(folder.path()).iter().any(|name| name.starts_with(".cutaway-")) {
            assert!(child.try_wait().unwrap().is_none(), "it ended before it wrote");
            assert!(started.elapsed() < 4 * PATIENCE, "it never wrote");
            std::thread::sleep(Duration::from_millis(2));
        }
        let sent =
            Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let status = child.wait().unwrap();
        if status.success() {
            // It came too late; the picture is whole.
            std::fs::remove_file(folder.path().join("out.png")).unwrap();
        } else {
            assert_eq!(status.signal(), Some(number), "{signal}: {status}");
        }
        assert_eq!(names(folder.path()), ["v.nrrd"], "{signal}");
    }
}

#[test]
fn signals_that_are_ignored_stay_ignored() {
    let folder = tempfile::tempdir().unwrap();
    ramp(folder.path(), "v.nrrd", 8);
    let line = r#"trap '' HUP; "$0" render v.nrrd --engine cpu --resolution 1500,1500 -o out.png & p=$!
        sleep 0.1; kill -HUP $p; wait $p"#;
    let output = shell(folder.path(), line);
    assert!(output.status.success(), "{}", output.status);
    assert_eq!(names(folder.path()), ["out.png", "v.nrrd"]);
}

#[test]
fn report_b4_a_closed_standard_output_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    ramp(folder.path(), "v.nrrd", 4);
    for line in [
        "render v.nrrd --engine cpu --resolution 8,8 -o -",
        "info v.nrrd",
        "presets",
        "schema",
        "--help",
        "--version",
    ] {
        // Closed, and open for reading only.
        for closed in [">&-", "1</dev/null"] {
            if closed == "1</dev/null" && line.starts_with("--") {
                continue;
            }
            let output = shell(folder.path(), &format!(r#""$0" {line} {closed}"#));
            let err = String::from_utf8_lossy(&output.stderr);
            assert_eq!((output.status.code(), err.lines().count()), (Some(1), 1), "{line} {closed}: {err}");
            assert!(err.contains("could not write to standard output"), "{line} {closed}: {err}");
        }
        // What is thrown away on purpose is no error.
        let output = shell(folder.path(), &format!(r#""$0" {line} >/dev/null && "$0" {line} 1<>/dev/null"#));
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let line = r#""$0" render v.nrrd --engine cpu --resolution 8,8 --stats - -o o.png 2>&-"#;
    assert_eq!(shell(folder.path(), line).status.code(), Some(1));
    let line = r#""$0" render v.nrrd --engine cpu --resolution 8,8 -o o.png >&- 2>&-"#;
    assert!(shell(folder.path(), line).status.success());
}

/// Whatever memory there is: a picture, or one line and exit code 1.
#[cfg(target_os = "linux")]
#[test]
fn report_b4_little_memory_ends_in_a_picture_or_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let voxels: Vec<u8> = (0..2 * 96 * 96 * 96u32).flat_map(|i| [(i.wrapping_mul(i) >> 7) as u8]).collect();
    std::fs::write(folder.path().join("v.nrrd"), nrrd([96; 3], "uint16", &voxels)).unwrap();
    let mut failed = 0;
    for options in [
        "--resolution 1500,1500",
        "--layout bricks",
        "--gradient precomputed",
        "--engine reference --resolution 8,8",
    ] {
        for megabytes in [42, 50, 60, 80, 100, 130, 170, 220, 300] {
            let line = format!(
                r#"ulimit -v {}; exec "$0" render v.nrrd --engine cpu --threads 2 {options} -o o.png"#,
                megabytes * 1024
            );
            let line = line.replace("--engine cpu --threads 2 --engine", "--threads 2 --engine");
            // The program itself needs some: what cannot even say its version says nothing here.
            let starts = format!(r#"ulimit -v {}; exec "$0" --version"#, megabytes * 1024);
            if !shell(folder.path(), &starts).status.success() {
                continue;
            }
            let output = shell(folder.path(), &line);
            let err = String::from_utf8_lossy(&output.stderr);
            // The runtime adds how to see a backtrace to its line about memory.
            let lines = err.lines().filter(|line| !line.starts_with("note: run with `RUST_BACKTRACE"));
            let fine = match output.status.code() {
                Some(0) => true,
                Some(1) => lines.count() == 1 && !err.contains("panicked"),
                _ => false,
            };
            assert!(fine, "{options}, {megabytes} MB: {}: {err}", output.status);
            failed += u32::from(!output.status.success());
        }
    }
    assert!(failed > 0, "no limit was low enough to show anything");
}
