//! What `render` writes: images, depth, scenes; and that a scene gives its image again.

mod common;

use std::path::Path;

use common::{command, cutaway, image, names, nrrd, run};
use cutaway_io::image::{ImageFormat, ImageLimits, decode_image};

const SMALL: &str = "render sample:sphere:24 --resolution 32,24";

#[test]
fn every_format_holds_the_same_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for name in ["a.npy", "a.exr", "a.png", "A.PNG"] {
        run(folder.path(), &format!("{SMALL} -o {name}")).succeeds_silently();
    }
    run(folder.path(), &format!("{SMALL} --bit-depth 16 -o b.png")).succeeds_silently();
    let exact = image(path("a.npy"));
    assert_eq!((exact.width(), exact.height()), (32, 24));
    assert!(exact.pixels().iter().any(|p| p[3] > 0.5) && exact.pixels()[0] == [0.0; 4]);
    assert_eq!(exact.pixels(), image(path("a.exr")).pixels());
    // PNG holds straight colours, cut at white. Half a step of the colour and half a step of alpha make at most a step
    // of their product.
    for (name, step) in [("a.png", 1.01 / 255.0), ("A.PNG", 1.01 / 255.0), ("b.png", 1.01 / 65535.0)] {
        for (a, b) in exact.pixels().iter().zip(image(path(name)).pixels()) {
            for (channel, b) in a.map(|channel| channel.min(a[3])).into_iter().zip(b) {
                assert!((channel - b).abs() < step, "{name}: {channel} {b}");
            }
        }
    }
}

#[test]
fn standard_output_takes_a_png() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &format!("{SMALL} -o a.png")).succeeds_silently();
    let piped = run(folder.path(), &format!("{SMALL} -o -"));
    assert_eq!((piped.code, piped.err.as_str()), (0, ""));
    assert_eq!(piped.out, std::fs::read(folder.path().join("a.png")).unwrap());
    let decoded = decode_image(&piped.out, ImageFormat::Png, &ImageLimits::default()).unwrap();
    assert_eq!((decoded.width(), decoded.height()), (32, 24));
}

#[test]
fn backgrounds_lie_behind() {
    let folder = tempfile::tempdir().unwrap();
    let corner = |options: &str| {
        run(folder.path(), &format!("{SMALL} -o a.npy {options}")).succeeds_silently();
        image(folder.path().join("a.npy")).pixels()[0]
    };
    assert_eq!(corner(""), [0.0; 4]);
    assert_eq!(corner("--background 1,0.5,0"), [1.0, 0.5, 0.0, 1.0]);
    assert_eq!(corner("--background=1,0.5,0,0.5"), [0.5, 0.25, 0.0, 0.5]);
    assert_eq!(corner("--background 0,0,0,0"), [0.0; 4]);
}

#[test]
fn depth_is_written_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["d.npy", "d.exr", "d.png"] {
        run(folder.path(), &format!("{SMALL} -o a.exr --depth-output {name}")).succeeds_silently();
        assert!(folder.path().join(name).metadata().unwrap().len() > 100, "{name}");
    }
    // The depth that the colour image carries is the one in its own file.
    let carried = image(folder.path().join("a.exr"));
    let carried = carried.depth().expect("the file has Z");
    let bytes = std::fs::read(folder.path().join("d.npy")).unwrap();
    let numbers = bytes[bytes.len() - 32 * 24 * 4..].chunks_exact(4);
    let numbers: Vec<f32> = numbers.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    assert_eq!(carried, numbers);
    let finite: Vec<f32> = numbers.into_iter().filter(|d| d.is_finite()).collect();
    assert!(!finite.is_empty() && finite.iter().all(|d| *d > 0.0));
}

#[test]
fn the_smallest_images_are_images() {
    let folder = tempfile::tempdir().unwrap();
    for resolution in ["1,1", "1,7", "7,1", "2,2"] {
        for engine in ["cpu", "reference"] {
            let line = format!("render sample:sphere:8 --resolution {resolution} --engine {engine} -o a.npy");
            // Two pixels a side see too little of a sphere: a notice may say that the image is empty.
            run(folder.path(), &line).succeeds();
            let [width, height] = [0, 1].map(|i| resolution.split(',').nth(i).unwrap().parse().unwrap());
            let found = image(folder.path().join("a.npy"));
            assert_eq!((found.width(), found.height()), (width, height));
        }
    }
}

/// Options whose scenes are saved and rendered again.
const LOOKS: [&str; 12] = [
    "sample:sphere:24",
    "sample:marschner-lobb:32 --preset MR-Default --azimuth 33 --elevation 12.3 --roll 3 --zoom 1.3",
    "sample:marschner-lobb:32 --light 1,2,-3 --brightness 1.7 --step 0.37 --early-termination 0.97",
    "sample:marschner-lobb:32 --colormap viridis --range 0.1,0.8 --opacity 0.1,0,0.5,0.7,0.8,0.1 --no-shade",
    "sample:marschner-lobb:32 --iso 0.5 --iso 0.7 --camera-orthographic 20 --specular 0.7 --specular-power 31",
    "sample:sphere:24 --mode mip --window 0.3 --level 0.1",
    "sample:sphere:24 --mode mean --opacity-unit-distance 3.3 --space-skipping off",
    "sample:sphere:24 --camera-position=-40,3,50 --camera-focal-point 11,12,13 --camera-view-up 0,1,0.1",
    "sample:sphere:24 --image-interpolation adaptive",
    "sample:sphere:24 --image-interpolation 5",
    "sample:sphere:24 --brick-size 32",
    "sample:sphere:24 --engine reference --diffuse-curve wrapped --ambient 0.3 --diffuse 0.4",
];

#[test]
fn a_saved_scene_gives_the_identical_image() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    for look in LOOKS {
        let line = format!("render {look} --resolution 33,21 -o a.npy --save-scene s.json");
        // Some of these settings are for other engines, which is said.
        run(folder.path(), &line).succeeds();
        run(folder.path(), "render --scene s.json -o b.npy --save-scene t.json").succeeds();
        assert!(image(folder.path().join("a.npy")).pixels().iter().any(|p| p[3] > 0.0), "empty: {look}");
        assert_eq!(bytes("a.npy"), bytes("b.npy"), "{look}");
        assert_eq!(bytes("s.json"), bytes("t.json"), "{look}");
    }
}

/// Eight voxels a side that tell directions apart.
fn voxels() -> Vec<u8> {
    (0..512u32).map(|i| (i * 7 % 251) as u8).collect()
}

#[test]
fn a_saved_scene_keeps_what_was_said_of_raw_data() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("blob.bin"), [vec![0; 5], voxels()].concat()).unwrap();
    let raw = "--dims 8,8,4 --type uint16 --spacing 1,1.5,3 --big-endian --header-bytes 5";
    let line = format!("render blob.bin {raw} --resolution 32,24 -o a.npy --save-scene s.json");
    run(folder.path(), &line).succeeds_silently();
    run(folder.path(), "render --scene s.json -o b.npy").succeeds_silently();
    assert_eq!(std::fs::read(path("a.npy")).unwrap(), std::fs::read(path("b.npy")).unwrap());
    let scene: serde_json::Value = serde_json::from_slice(&std::fs::read(path("s.json")).unwrap()).unwrap();
    let expected = serde_json::json!({
        "path": "blob.bin", "dims": [8, 8, 4], "type": "uint16", "spacing": [1.0, 1.5, 3.0],
        "big_endian": true, "header_bytes": 5,
    });
    assert_eq!(scene["volume"], expected);
}

#[test]
fn paths_in_a_scene_are_relative_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let deep = folder.path().join("data/deep");
    std::fs::create_dir_all(&deep).unwrap();
    std::fs::write(folder.path().join("data/v.nrrd"), nrrd([8, 8, 8], "uint8", &voxels())).unwrap();
    let in_scene = |file: &str| -> String {
        let scene: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.path().join(file)).unwrap()).unwrap();
        scene["volume"].as_str().unwrap().to_owned()
    };
    let scene = r#"{ "volume": "../v.nrrd", "render": { "resolution": [32, 24] } }"#;
    std::fs::write(deep.join("s.json"), scene).unwrap();
    // From any folder, with a scene written in any folder.
    run(folder.path(), "render --scene data/deep/s.json -o a.npy --save-scene data/s.json")
        .succeeds_silently();
    run(&deep, "render --scene s.json -o ../b.npy --save-scene ../../t.json").succeeds_silently();
    run(folder.path(), "render --scene data/s.json -o c.npy").succeeds_silently();
    run(&deep, "render --scene ../../t.json -o ../d.npy").succeeds_silently();
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    for other in ["data/b.npy", "c.npy", "data/d.npy"] {
        assert_eq!(bytes("a.npy"), bytes(other), "{other}");
    }
    // What is there is named so that the folder can be moved; a scene may replace itself.
    assert!(Path::new(&in_scene("t.json")).ends_with("v.nrrd"));
    run(folder.path(), "render data/v.nrrd --resolution 32,24 -o a.npy --save-scene data/s.json").succeeds();
    assert_eq!(in_scene("data/s.json"), "v.nrrd");
    run(folder.path(), "render --scene data/s.json -o b.npy --save-scene data/s.json").succeeds();
    run(folder.path(), "render data/v.nrrd --resolution 32,24 -o a.npy --save-scene data/deep/u.json")
        .succeeds();
    assert_eq!(in_scene("data/deep/u.json"), "../v.nrrd");
}

#[test]
fn options_win_over_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &format!("{SMALL} --no-shade --step 0.7 -o a.npy --save-scene s.json")).succeeds();
    let same = [
        // What the scene says, and what the option says, over the same beside a scene.
        ("--shade", "--shade --step 0.7"),
        ("--step 1.3", "--no-shade --step 1.3"),
        ("--preset CT-Bone --no-shade", "--preset CT-Bone --no-shade --step 0.7"),
        ("--mode mip", "--no-shade --step 0.7 --mode mip"),
        ("--iso 0", "--no-shade --step 0.7 --iso 0"),
        ("--azimuth 40", "--no-shade --step 0.7 --azimuth 40"),
        ("--brightness 0.5", "--no-shade --step 0.7 --brightness 0.5"),
    ];
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    // The transfer function in the scene is the one of composite mode: the line without a scene needs it, too.
    let scene: serde_json::Value = serde_json::from_slice(&bytes("s.json")).unwrap();
    std::fs::write(folder.path().join("tf.json"), scene["transfer_function"].to_string()).unwrap();
    for (beside, alone) in same {
        run(folder.path(), &format!("render --scene s.json {beside} -o b.npy")).succeeds();
        let function = if alone.contains("--preset") { "" } else { "--transfer-function tf.json" };
        run(folder.path(), &format!("{SMALL} {function} {alone} -o c.npy")).succeeds();
        assert!(bytes("b.npy") == bytes("c.npy"), "{beside}");
        assert!(bytes("b.npy") != bytes("a.npy"), "{beside} changed nothing");
    }
    run(folder.path(), "render sample:torus:24 --scene s.json -o b.npy").succeeds();
    assert!(bytes("a.npy") != bytes("b.npy"));
    run(folder.path(), "render --scene s.json --resolution 16,8 -o b.npy").succeeds();
    assert_eq!(image(folder.path().join("b.npy")).width(), 16);
}

#[test]
fn nothing_is_written_where_something_cannot_be() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("folder.png")).unwrap();
    std::fs::write(folder.path().join("locked.png"), "old").unwrap();
    let locked = folder.path().join("locked.png");
    let mut permissions = locked.metadata().unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&locked, permissions).unwrap();
    let before = names(folder.path());
    for (options, code, says) in [
        ("-o no/a.png", 1, "the folder 'no' does not exist"),
        ("-o folder.png", 1, "it is a folder"),
        ("-o a.png/", 1, "it is a folder"),
        ("-o locked.png", 1, "read-only"),
        ("-o locked.png/a.png", 1, "is not a folder"),
        ("-o a.png --depth-output no/d.png", 1, "'no' does not exist"),
        ("-o a.png --depth-output a.png", 2, "--output and --depth-output both write"),
        ("-o a.png --depth-output ./a.png", 2, "both write"),
        ("-o a.png --stats no/s.json", 1, "'no' does not exist"),
        ("-o a.png --stats locked.png", 1, "read-only"),
        ("-o a.png --save-scene no/s.json", 1, "'no' does not exist"),
        ("-o a.png --save-scene s.json --stats s.json", 2, "--save-scene and --stats both write"),
        ("-o a.png --save-scene s.json --step 0", 2, "--step"),
        ("-o a.png --save-scene s.json --transfer-function no.json", 1, "no.json"),
    ] {
        run(folder.path(), &format!("{SMALL} {options}")).fails(code, &[says]);
        assert_eq!(names(folder.path()), before, "{options}");
    }
    assert_eq!(std::fs::read(&locked).unwrap(), b"old");
}

#[test]
fn what_is_read_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("v_8x8x8_uint8.raw"), voxels()).unwrap();
    std::fs::write(path("s.json"), r#"{ "volume": "v_8x8x8_uint8.raw" }"#).unwrap();
    let small = "render v_8x8x8_uint8.raw --resolution 8,8 -o a.png";
    run(folder.path(), &format!("{small} --stats v_8x8x8_uint8.raw")).fails(2, &["--stats would overwrite"]);
    run(folder.path(), &format!("{small} --save-scene ./v_8x8x8_uint8.raw")).fails(2, &["would overwrite"]);
    run(folder.path(), "render --scene s.json -o a.png --stats s.json")
        .fails(2, &["would overwrite 's.json'"]);
    assert_eq!(std::fs::read(path("v_8x8x8_uint8.raw")).unwrap(), voxels());
}

/// Files that cannot be read or folders that cannot be written are tried as another user than root, who may everything.
#[cfg(unix)]
#[test]
fn permissions_are_respected() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("v.nrrd"), nrrd([8, 8, 8], "uint8", &voxels())).unwrap();
    std::fs::create_dir(path("shut")).unwrap();
    let mode =
        |name: &str, mode| std::fs::set_permissions(path(name), PermissionsExt::from_mode(mode)).unwrap();
    mode("v.nrrd", 0o000);
    mode("shut", 0o555);
    let privileged = std::fs::File::open(path("v.nrrd")).is_ok();
    if !privileged {
        run(folder.path(), "info v.nrrd").fails(1, &["v.nrrd", "ermission denied"]);
        run(folder.path(), &format!("{SMALL} -o a.png --stats shut/s.json")).fails(1, &["permission denied"]);
        assert!(!path("a.png").exists());
    }
    mode("shut", 0o755);
}

#[cfg(unix)]
#[test]
fn file_names_need_not_be_unicode() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let [volume, output, scene] =
        [&b"caf\xff.nrrd"[..], b"bild\xfe.npy", b"s\xff.json"].map(|name| OsStr::from_bytes(name).to_owned());
    if std::fs::write(folder.path().join(&volume), nrrd([8, 8, 8], "uint8", &voxels())).is_err() {
        // File systems that take Unicode names alone need no test.
        return;
    }
    let words = |line: &str| line.split_whitespace().map(Into::into).collect::<Vec<std::ffi::OsString>>();
    let arguments =
        [words("render"), vec![volume.clone()], words("--resolution 8,8 -o"), vec![output.clone()]];
    cutaway(folder.path(), &arguments.concat()).succeeds_silently();
    assert_eq!(image(folder.path().join(&output)).width(), 8);
    cutaway(folder.path(), &[words("info"), vec![volume.clone()]].concat()).succeeds_silently();
    // JSON is Unicode: a scene file can have such a name but not hold one.
    let saving = [&arguments.concat()[..], &words("--save-scene"), std::slice::from_ref(&scene)].concat();
    cutaway(folder.path(), &saving).fails(1, &["not Unicode"]);
    assert!(!folder.path().join(&scene).exists());
}

/// `cutaway ... &` from a shell that closes is a program without any of the three streams.
#[cfg(unix)]
#[test]
fn closed_streams_do_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let program = env!("CARGO_BIN_EXE_cutaway");
    let line = format!("'{program}' {SMALL} -v -o a.png --stats s.json <&- >&- 2>&-");
    let status =
        std::process::Command::new("sh").arg("-c").arg(line).current_dir(folder.path()).status().unwrap();
    assert_eq!(status.code(), Some(0));
    assert_eq!(names(folder.path()), ["a.png", "s.json"]);
}

#[test]
fn a_reader_of_an_image_that_leaves_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let arguments: Vec<&str> = SMALL.split(' ').chain(["-o", "-"]).collect();
    let output = command(folder.path()).args(arguments).stdout(writer).output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.code() == Some(1) && err.starts_with("error: could not write to standard output"),
        "{err}"
    );
}

#[test]
fn blur_softens_the_image_and_jitter_without_a_gpu_is_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let render = "render sample:sphere:16 --resolution 40,30 --engine cpu -o";
    run(folder.path(), &format!("{render} sharp.png")).succeeds();
    run(folder.path(), &format!("{render} soft.png --blur 2")).succeeds();
    assert_ne!(
        std::fs::read(folder.path().join("sharp.png")).unwrap(),
        std::fs::read(folder.path().join("soft.png")).unwrap()
    );
    for wrong in ["-1", "65", "nan"] {
        run(folder.path(), &format!("{render} a.png --blur {wrong}")).fails(2, &["--blur"]);
    }
    let said = run(folder.path(), &format!("{render} a.png --jitter"));
    assert!(said.err.contains("--jitter has no effect with the cpu engine"), "{}", said.err);
}
