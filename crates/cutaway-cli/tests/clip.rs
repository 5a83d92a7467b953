//! Clipping at the command line: order, poses, scene files, and what is refused.

mod common;

use common::{cutaway, image, names, run};
use cutaway_core::image::Image;

/// A look at the sample that does not depend on what is kept of it.
const CAMERA: &str = "--camera-position 40,-60,30 --camera-focal-point 11.5,11.5,11.5 --camera-view-up 0,0,1";

/// A small picture of a sample, by the engine that defines what is right.
const SMALL: &str = "render sample:sphere:24 --resolution 32,24 --engine reference";

/// The picture that these options make.
fn picture(options: &str) -> Image {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &format!("{SMALL} {CAMERA} {options} -o a.npy")).succeeds_silently();
    image(folder.path().join("a.npy"))
}

/// The picture that these options make, with a notice that says this.
fn picture_with_notice(options: &str, says: &str) -> Image {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(folder.path(), &format!("{SMALL} {CAMERA} {options} -o a.npy"));
    assert!(outcome.err.contains(says), "{}", outcome.err);
    outcome.succeeds();
    image(folder.path().join("a.npy"))
}

fn with_pose(options: &str, poses: &[&str]) -> Image {
    let folder = tempfile::tempdir().unwrap();
    let mut words: Vec<&str> =
        SMALL.split_whitespace().chain(CAMERA.split_whitespace()).chain(options.split_whitespace()).collect();
    for pose in poses {
        words.extend(["--clip-pose", pose]);
    }
    words.extend(["-o", "a.npy"]);
    cutaway(folder.path(), &words).succeeds_silently();
    image(folder.path().join("a.npy"))
}

fn alpha(image: &Image) -> f64 {
    image.pixels().iter().map(|p| f64::from(p[3])).sum()
}

#[track_caller]
fn assert_same(a: &Image, b: &Image) {
    let off = a.pixels().iter().flatten().zip(b.pixels().iter().flatten()).map(|(a, b)| (a - b).abs());
    let largest = off.fold(0.0f32, f32::max);
    assert!(largest < 1e-6, "{largest}");
}

#[test]
fn a_cut_and_a_probe_share_the_picture() {
    let whole = picture("--no-shade");
    let (cut, probe) =
        (picture("--no-shade --cut sphere:9,9,9,7"), picture("--no-shade --probe sphere:9,9,9,7"));
    assert!(alpha(&cut) < alpha(&whole) && alpha(&probe) < alpha(&whole) && alpha(&probe) > 1.0);
    for nothing in ["--cut sphere:9,9,9,7 --probe sphere:9,9,9,7", "--cut box:-1,99,-1,99,-1,99"] {
        assert_eq!(alpha(&picture_with_notice(nothing, "leaves nothing of the volume")), 0.0);
    }
    assert_same(&picture("--no-shade --cut sphere:999,9,9,7"), &whole);
}

#[test]
fn every_way_to_keep_a_half_keeps_the_same() {
    let half = picture("--clip-plane 0,0,2,22");
    for way in [
        "--crop 0,23,0,23,0,11",
        "--probe plane:0,0,1,11",
        "--cut plane:0,0,-1,-11",
        "--probe box:-99,99,-99,99,-99,11",
        "--cut box:-99,99,-99,99,11,99",
        "--clip-plane=0,0,1,20 --crop=-5,50,-5,50,-5,11",
    ] {
        assert_same(&picture(way), &half);
    }
    assert!(alpha(&half) > 1.0);
}

#[test]
fn a_pose_moves_the_object_before_it() {
    let expected = picture("--cut sphere:12,8,8,4 --cut sphere:3,3,3,3");
    assert_same(
        &with_pose("--cut sphere:3,3,3,3 --cut sphere:0,0,0,2", &["translate 12,8,8; scale 2"]),
        &expected,
    );
    assert_same(
        &with_pose(
            "--cut sphere:3,3,3,3 --cut sphere:0,4,0,2",
            &["scale 2", "rotate 0,0,1,-90", "translate 4,8,8"],
        ),
        &expected,
    );
    // A ball of any size and place, fitted, touches the faces of the cube that the volume is.
    let fitted = with_pose("--probe sphere:100,-3,5,0.01", &["fit"]);
    assert_same(&fitted, &picture("--probe sphere:11.5,11.5,11.5,11.5"));
    assert_same(
        &with_pose("--probe sphere:100,-3,5,0.01", &["translate 3,0,0; fit"]),
        &picture("--probe sphere:14.5,11.5,11.5,11.5"),
    );
}

const LOOKS: [&str; 6] = [
    "--cut sphere:5,5,9,7 --probe box:0,20,-3,20,1,19 --cut plane:1,1,0.3,9.7",
    "--crop 2,20,3,19,4,18 --impregnation step --impregnation-thickness 1.5",
    "--cut sphere:5,5,9,7 --clip-intensity 0.3 --impregnation none",
    "--iso 0.5 --cut plane:1,1,0.3,19.7 --cap",
    "--cut sphere:9,9,9,5 --cut sphere:15,15,15,4 --segments 1 --backmost",
    "--mode mip --clip-plane 1,0,0,9",
];

#[test]
fn a_saved_clip_gives_the_identical_image() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    for look in LOOKS {
        run(folder.path(), &format!("{SMALL} {CAMERA} {look} -o a.npy --save-scene s.json"))
            .succeeds_silently();
        run(folder.path(), "render --scene s.json -o b.npy --save-scene t.json").succeeds_silently();
        assert!(alpha(&image(folder.path().join("a.npy"))) > 1.0, "{look}");
        assert_eq!(bytes("a.npy"), bytes("b.npy"), "{look}");
        assert_eq!(bytes("s.json"), bytes("t.json"), "{look}");
    }
    // A rotation that is not exact in binary goes through the file too.
    let words = format!("{SMALL} {CAMERA} --cut box:0,9,0,9,0,9 -o a.npy --save-scene s.json");
    let words: Vec<&str> =
        words.split_whitespace().chain(["--clip-pose", "rotate 1,2,3,37; scale 1,2,-0.7"]).collect();
    cutaway(folder.path(), &words).succeeds_silently();
    run(folder.path(), "render --scene s.json -o b.npy --save-scene t.json").succeeds_silently();
    assert_eq!((bytes("a.npy"), bytes("s.json")), (bytes("b.npy"), bytes("t.json")));
}

#[test]
fn options_go_on_where_the_scene_file_ends() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &format!("{SMALL} {CAMERA} --cut sphere:5,5,9,7 -o a.npy --save-scene s.json"))
        .succeeds();
    let more = "--probe box:0,20,-3,20,1,19 --clip-intensity 0.2";
    run(folder.path(), &format!("render --scene s.json {more} -o b.npy")).succeeds_silently();
    let both = picture(&format!("--cut sphere:5,5,9,7 {more}"));
    assert_same(&image(folder.path().join("b.npy")), &both);
}

#[test]
fn a_clip_in_a_scene_file_is_read_and_its_errors_have_places() {
    let folder = tempfile::tempdir().unwrap();
    let write = |clip: &str| {
        let scene = format!(
            "{{ \"volume\": \"sample:sphere:24\",\n  \"clip\": {clip},\n  \"render\": {{ \"engine\": \"reference\", \
             \"resolution\": [32, 24] }} }}"
        );
        std::fs::write(folder.path().join("s.json"), scene).unwrap();
    };
    write(r#"{ "difference": [ "volume", { "sphere": { "center": [5, 5, 9], "radius": 7 } } ] }"#);
    run(folder.path(), &format!("render --scene s.json {CAMERA} -o a.npy")).succeeds_silently();
    assert_same(&image(folder.path().join("a.npy")), &picture("--cut sphere:5,5,9,7"));
    for (clip, says) in [
        (r#"{ "sphere": { "center": [5, 5, 9], "radius": 0 } }"#, ["line 2, column", "radius is 0"]),
        (r#"{ "spher": {} }"#, ["line 2, column", "`spher`"]),
        (r#"{ "difference": [] }"#, ["line 2, column", "no operands"]),
        (r#"{ "mesh": "no.ply" }"#, ["s.json", "no.ply"]),
    ] {
        write(clip);
        run(folder.path(), "render --scene s.json -o b.npy").fails(1, &says);
    }
    // The cutting of a scene file can be rendered without its file only by saying so there: it is not ignored.
    write("\"volume\"");
    run(folder.path(), &format!("render --scene s.json {CAMERA} -o c.npy")).succeeds_silently();
    assert_same(&image(folder.path().join("c.npy")), &picture(""));
}

#[test]
fn what_cannot_be_cut_with_is_refused_by_option() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bunny.ply"), "ply\n").unwrap();
    let wrong: &[(&str, i32, &[&str])] = &[
        ("--cut sphere:1,2,3", 2, &["--cut", "sphere takes 4 numbers", "found 3"]),
        ("--cut sphere:1,2,3,-1", 2, &["--cut", "radius is -1"]),
        ("--probe box:1,0,0,1,0,1", 2, &["--probe", "box: max"]),
        ("--probe plane:0,0,0,1", 2, &["--probe", "normal"]),
        ("--cut sphere:1,2,3,nan", 2, &["--cut", "`nan`"]),
        ("--cut shpere:1,2,3,4", 1, &["shpere", "did you mean `sphere`?"]),
        ("--cut nothere.ply", 1, &["nothere.ply"]),
        ("--cut bunny.ply", 1, &["bunny.ply", "line 1", "the file is cut short"]),
        ("--cut bunny.ply --clip-events peal", 2, &["--clip-events", "did you mean `peel`?"]),
        ("--buffer-depth 24", 2, &["--buffer-depth", "`24`", "16, 32"]),
        ("--cut= ", 2, &["--cut"]),
        ("--crop 1,2,3", 2, &["--crop", "box takes 6 numbers"]),
        ("--crop 5,1,0,1,0,1", 2, &["--crop", "max"]),
        ("--clip-plane 1,0,0", 2, &["--clip-plane", "plane takes 4 numbers"]),
        ("--clip-pose fit", 2, &["--clip-pose", "before it"]),
        ("--clip-pose fit --cut sphere:1,2,3,4", 2, &["--clip-pose", "before it"]),
        ("--clip-plane 1,0,0,3 --clip-pose fit", 2, &["half-space has no size"]),
        ("--cut sphere:1,2,3,4 --clip-pose scale", 2, &["--clip-pose", "scale"]),
        ("--cut sphere:1,2,3,4 --clip-pose roll", 2, &["--clip-pose", "no step `roll`"]),
        ("--segments 0", 2, &["--segments", "`0`"]),
        ("--segments -1", 2, &["--segments"]),
        ("--segments some", 2, &["--segments", "`auto`"]),
        ("--impregnation linaer", 2, &["--impregnation", "did you mean `linear`?"]),
        ("--impregnation-thickness -1", 2, &["--impregnation-thickness", "0 to 1000000"]),
        ("--clip-intensity 2", 2, &["--clip-intensity", "0 to 1"]),
        ("--clip-intensity nan", 2, &["--clip-intensity"]),
    ];
    for (options, code, says) in wrong {
        let engine = if options.contains("--engine") { "" } else { "--engine reference" };
        let line = format!("render sample:sphere:24 --resolution 32,24 -o a.png {engine} {options}");
        run(folder.path(), &line).fails(*code, says);
    }
    assert_eq!(names(folder.path()), ["bunny.ply"], "nothing may be written");
    // The object itself must survive.
    run(folder.path(), &format!("{SMALL} {CAMERA} --cut bunny.ply -o a.png --stats bunny.ply"))
        .fails(2, &["--stats would overwrite 'bunny.ply'"]);
}

#[test]
fn options_without_effect_are_noticed() {
    let folder = tempfile::tempdir().unwrap();
    for (options, says) in [
        ("--cap", "--cap has no effect: nothing is clipped"),
        ("--segments 2", "--segments has no effect: nothing is clipped"),
        ("--clip-events bvh", "--clip-events has no effect: nothing is clipped"),
        ("--cut sphere:9,9,9,5 --buffer-depth 16", "--buffer-depth has no effect: it applies only to"),
        (
            "--cut sphere:9,9,9,5 --clip-events peel",
            "--clip-events peel has no effect with the reference engine",
        ),
        (
            "--cut sphere:9,9,9,5 --clip-events lists",
            "--clip-events lists has no effect with the reference engine",
        ),
        ("--cut sphere:9,9,9,5 --cap", "--cap has no effect in composite mode"),
        ("--mode mip --cut sphere:9,9,9,5 --impregnation step", "--impregnation has no effect in mip mode"),
    ] {
        let found = run(folder.path(), &format!("{SMALL} {CAMERA} -o a.png {options}"));
        assert!(found.err.contains(says), "{options}: {}", found.err);
        found.succeeds();
    }
}

/// A tetrahedron as text, one face left out: it is closed with a notice.
const OPEN: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";

#[test]
fn files_of_surfaces_cut_whatever_finds_their_events() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("open.obj"), OPEN).unwrap();
    let flat = r#"{ "kind": "bezier", "rows": 4, "columns": 4, "points": [
        [0,0,0],[0,1,0],[0,2,0],[0,3,0],[1,0,1],[1,1,3],[1,2,3],[1,3,1],
        [2,0,1],[2,1,3],[2,2,3],[2,3,1],[3,0,0],[3,1,0],[3,2,0],[3,3,0]] }"#;
    std::fs::write(folder.path().join("dome.json"), flat).unwrap();
    for file in ["open.obj", "dome.json"] {
        let cut = |options: &str, to: &str| {
            let line = format!("render sample:sphere:24 --resolution 32,24 --cut {file} --clip-pose fit");
            run(folder.path(), &format!("{line} -o {to} {options}"))
        };
        cut("--engine reference", "reference.npy").succeeds();
        for finder in ["auto", "raster", "bvh", "octree", "grid", "peel", "lists"] {
            cut(&format!("--engine cpu --step 0.1 --clip-events {finder}"), "cpu.npy").succeeds();
            run(folder.path(), "compare reference.npy cpu.npy --fail-above 0.003").succeeds();
        }
        run(folder.path(), &format!("{SMALL} {CAMERA} -o whole.npy")).succeeds();
        let bytes = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        assert_ne!(bytes("whole.npy"), bytes("reference.npy"), "{file} cut nothing");
    }
    run(folder.path(), "convert dome.json dome.stl --tolerance 0.01 --quiet").succeeds();
    run(folder.path(), "info dome.stl").succeeds();
    run(folder.path(), "convert open.obj b.stl --tolerance 0.01")
        .fails(2, &["--tolerance", "spline patches"]);
}
