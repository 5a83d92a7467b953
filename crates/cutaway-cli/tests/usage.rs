//! Wrong use: refused with one line, exit code 2, and no file.

mod common;

use common::{cutaway, names, run};

const RENDER: &str = "render sample:sphere:24 --resolution 32,24 -o a.png";

#[test]
fn wrong_values_are_refused_by_option() {
    let wrong: &[(&str, &[&str])] = &[
        ("--iso", &["--iso"]),
        ("--iso x", &["--iso", "`x` is not a number"]),
        ("--iso nan", &["--iso", "not a finite number"]),
        ("--iso --mode iso", &["`--iso` needs a value", "`--mode`"]),
        ("--mode iso", &["--mode iso", "isovalue"]),
        ("--mode ISO", &["--mode", "did you mean `iso`?"]),
        ("--background 1", &["--background", "found 1 numbers"]),
        ("--background 1,1,1,1,1", &["--background", "found 5 numbers"]),
        ("--background 2,0,0", &["--background", "2 is not within 0 to 1"]),
        ("--background -1,0,0", &["--background", "-1 is not within 0 to 1"]),
        ("--background red", &["--background", "`red` is not a number"]),
        ("--engine gpu", &["--engine", "auto, cpu, raycast, slices, cells, reference"]),
        ("--brick-size 9", &["brick_size is 9", "0, or a power of two of 8 to 1024"]),
        ("--brick-size -8", &["--brick-size", "`-8`"]),
        ("--engine referenc", &["did you mean `reference`?"]),
        ("--threads -1", &["--threads", "`-1`"]),
        ("--threads 100000", &["--threads", "0 to 1024"]),
        ("--threads 99999999999999999999999", &["--threads"]),
        ("--simd sse", &["--simd", "avx2"]),
        ("--bit-depth 12", &["--bit-depth", "8, 16"]),
        ("--preset CT-Bonee", &["did you mean `CT-Bone`?", "cutaway presets"]),
        ("--preset qqq", &["no preset is called `qqq`"]),
        ("--colormap virids", &["did you mean `viridis`?"]),
        ("--colormap viridis --range 5,1", &["--range is 5,1"]),
        ("--colormap viridis --range 1", &["--range takes 2 numbers"]),
        ("--colormap viridis --opacity 1", &["--opacity", "pairs"]),
        ("--colormap viridis --opacity 0,0,5,2", &["--opacity", "opacity is 2"]),
        ("--colormap viridis --opacity 10,0,5,1", &["--opacity", "must not decrease"]),
        ("--range 0,1", &["--colormap"]),
        ("--opacity 0,0,1,1", &["--colormap"]),
        ("--window 1", &["--level"]),
        ("--level 1", &["--window"]),
        ("--window 0 --level 3", &["--window is 0"]),
        ("--window -1 --level 3", &["--window is -1"]),
        ("--preset CT-Bone --colormap viridis", &["--preset", "--colormap"]),
        ("--colormap viridis --window 1 --level 1", &["--colormap", "--window"]),
        ("--opacity-unit-distance 0", &["--opacity-unit-distance", "above 0"]),
        ("--brightness -1", &["--brightness", "0 or more"]),
        ("--ambient -1", &["--ambient"]),
        ("--diffuse 1e400", &["--diffuse", "not a finite number"]),
        ("--specular 1e300", &["--specular", "expected 0 to 1000000"]),
        ("--specular-power -1", &["--specular-power"]),
        ("--diffuse-curve twosided", &["did you mean `two-sided`?"]),
        ("--light 0,0,0", &["--light", "not zero"]),
        ("--light 1,2", &["--light takes 3 numbers"]),
        ("--camera-position 1,2", &["--camera-position takes 3 numbers"]),
        ("--camera-position 0,0,0 --camera-focal-point 0,0,0", &["--camera-position", "move one of them"]),
        ("--camera-view-up 0,0,0", &["--camera-view-up"]),
        ("--camera-view-angle 180", &["--camera-view-angle", "less than 180"]),
        ("--camera-view-angle -5", &["--camera-view-angle"]),
        ("--camera-orthographic 0", &["--camera-orthographic", "above 0"]),
        ("--azimuth inf", &["--azimuth"]),
        ("--elevation nan", &["--elevation"]),
        ("--roll x", &["--roll"]),
        ("--zoom 0", &["--zoom is 0"]),
        ("--zoom -1", &["--zoom is -1"]),
        ("--zoom 1e-30", &["--zoom is 1e-30", "180 degrees"]),
        ("--step 0", &["--step", "above 0"]),
        ("--step -1", &["--step", "above 0"]),
        ("--step 1e-9", &["--step", "at least 0.001"]),
        ("--early-termination 2", &["--early-termination", "at most 1"]),
        ("--space-skipping of", &["did you mean `off`?"]),
        ("--image-interpolation adaptiv", &["did you mean `adaptive`?"]),
        ("--image-interpolation 1", &["--image-interpolation", "is 1", "2 to 16"]),
        ("--image-interpolation 2.5", &["off, adaptive or a whole number of 2 to 16"]),
        ("--dims 3,3,3", &["no raw file"]),
        ("--dims 1,2", &["--dims takes 3"]),
        ("--type unit8", &["did you mean `uint8`?"]),
        ("--header-bytes -1", &["--header-bytes"]),
        ("--volume-index 1", &["--volume-index"]),
        ("--quiet --verbose", &["--quiet", "--verbose"]),
        ("--step 0.5 --step 0.6", &["--step", "multiple times"]),
        ("extra", &["'extra'"]),
        ("-x", &["there is no option `-x`"]),
        ("--resoluton 1,1", &["did you mean `--resolution`?"]),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (options, says) in wrong {
        run(folder.path(), &format!("{RENDER} {options}")).fails(2, says);
    }
    assert_eq!(names(folder.path()), [""; 0], "nothing may be written");
}

#[test]
fn wrong_resolutions_are_refused() {
    let wrong = [
        ("0,5", "0 x 5"),
        ("5", "takes 2 numbers"),
        ("1,1,1", "found 3"),
        ("a,b", "`a` is not a number"),
        ("1.5,2", "whole numbers"),
        ("-1,5", "found -1"),
        ("nan,5", "`nan`"),
        ("inf,5", "`inf`"),
        ("99999999999,5", "0 to 4294967295"),
        ("32769,1", "32769 x 1"),
        ("32768,32768", "134217728"),
        ("", "``"),
        ("10x10", "`10x10`"),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (resolution, says) in wrong {
        let arguments = ["render", "sample:sphere:8", "-o", "a.png", "--resolution", resolution];
        cutaway(folder.path(), &arguments).fails(2, &["resolution", says]);
    }
    assert_eq!(names(folder.path()), [""; 0]);
}

/// The options of the interface that later versions will have.
const LATER: [&str; 2] = ["--turntable", "--frames"];

/// A test that knows which of these are there by now, so that none is forgotten in the list and none is ignored.
#[test]
fn options_that_do_not_exist_yet_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let help = run(folder.path(), "help render").succeeds();
    for option in LATER {
        assert!(!help.contains(&format!("{option} ")), "{option} exists: take it from this list and test it");
        for form in
            [option.to_owned(), format!("{option} 1"), format!("{option}=1"), format!("{option}=-1,0,0,0")]
        {
            let says = format!("`{option}` does not exist in this version");
            run(folder.path(), &format!("{RENDER} {form}")).fails(2, &[&says]);
        }
    }
    run(folder.path(), &format!("{RENDER} --turntabel 4")).fails(2, &["`--turntable` does not exist"]);
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn the_viewer_says_why_there_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let says = if cfg!(feature = "viewer") { "there is no display" } else { "this build has no viewer" };
    run(folder.path(), "view").fails(1, &[says]);
    run(folder.path(), "view sample:sphere:8").fails(1, &[says]);
    run(folder.path(), "view nowhere.nii").fails(1, &["nowhere.nii"]);
    run(folder.path(), "view a.nii --scene b.json").fails(2, &["--scene"]);
}

#[test]
fn outputs_that_do_not_exist_yet_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = [
        ("spin.mp4", "films do not exist"),
        ("spin.gif", "films do not exist"),
        ("frame_{frame:04}.png", "--turntable"),
        ("a.jpg", "'.jpg'"),
        ("a", "without an extension"),
        (".", "without an extension"),
        ("", "--output"),
    ];
    for (output, says) in wrong {
        cutaway(folder.path(), &["render", "sample:sphere:8", "-o", output]).fails(2, &[says]);
    }
    run(folder.path(), &format!("{RENDER} --depth-output -")).fails(2, &["--depth-output"]);
    run(folder.path(), &format!("{RENDER} --depth-output d.tif")).fails(2, &["--depth-output", "'.tif'"]);
    run(folder.path(), &format!("{RENDER} --save-scene -")).fails(2, &["--save-scene"]);
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn commands_are_guessed() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), "rendre").fails(2, &["`rendre`", "did you mean `render`?"]);
    run(folder.path(), "help inf").fails(2, &["did you mean `info`?"]);
    run(folder.path(), "qqq").fails(2, &["there is no command `qqq`"]);
    run(folder.path(), "veiw").fails(2, &["did you mean `view`?"]);
    run(folder.path(), "bench fram").fails(2, &["did you mean `frame`?"]);
    run(folder.path(), "render").fails(2, &["--output", "VOLUME"]);
    run(folder.path(), "render sample:sphere:8").fails(2, &["--output"]);
    run(folder.path(), "compare a.png").fails(2, &["<B>"]);
    run(folder.path(), "completions tcsh").fails(2, &["bash", "zsh"]);
    run(folder.path(), "bench frame sample:sphere:8 --frames 0").fails(2, &["--frames"]);
    run(folder.path(), "bench frame sample:sphere:8 --orbit nan").fails(2, &["--orbit"]);
    run(folder.path(), "bench frame sample:sphere:8 -o a.gif").fails(2, &["films"]);
}

#[test]
fn samples_are_guessed_and_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = [
        ("spher", "did you mean `sphere`?"),
        ("spher:24", "did you mean `sphere`?"),
        ("qqq", "cutaway presets"),
        ("", "cutaway presets"),
        ("sphere:1", "2 to 1024"),
        ("sphere:", "2 to 1024"),
        ("sphere:9999999999999", "2 to 1024"),
        ("bonsai:12", "one size"),
    ];
    for (sample, says) in wrong {
        run(folder.path(), &format!("render sample:{sample} -o a.png")).fails(2, &[says]);
        run(folder.path(), &format!("info sample:{sample}")).fails(2, &[says]);
    }
    cutaway(folder.path(), &["render", "", "-o", "a.png"]).fails(2, &["name of the volume is empty"]);
}

#[test]
fn help_explains_with_examples() {
    let folder = tempfile::tempdir().unwrap();
    let help = run(folder.path(), "help").succeeds_silently();
    for word in
        ["render", "info", "compare", "presets", "schema", "bench", "Examples:", "cutaway help render"]
    {
        assert!(help.contains(word), "{word}\n{help}");
    }
    assert_eq!(run(folder.path(), "--help").succeeds(), help);
    let render = run(folder.path(), "help render").succeeds_silently();
    for word in
        ["Examples:", "--scene", "--save-scene", "--preset", "--camera-position", "--stats", "Sampling:"]
    {
        assert!(render.contains(word), "{word}\n{render}");
    }
    assert_eq!(run(folder.path(), "render --help").succeeds(), render);
    assert!(run(folder.path(), "--version").succeeds().starts_with("cutaway "));

    let alone = cutaway::<&str>(folder.path(), &[]);
    assert_eq!((alone.code, alone.out.len()), (2, 0));
    assert!(alone.err.contains("Usage:") && alone.err.contains("render"), "{}", alone.err);
}

/// An option that can be read but is in nobody's documentation is a trap; so is one that is described twice.
#[test]
fn every_option_of_render_is_in_the_help_with_words() {
    let folder = tempfile::tempdir().unwrap();
    let documented = [
        "--resolution",
        "--output",
        "--bit-depth",
        "--background",
        "--depth-output",
        "--engine",
        "--threads",
        "--simd",
        "--mode",
        "--iso",
        "--preset",
        "--transfer-function",
        "--colormap",
        "--range",
        "--opacity",
        "--window",
        "--level",
        "--opacity-unit-distance",
        "--brightness",
        "--shade",
        "--no-shade",
        "--ambient",
        "--diffuse",
        "--specular",
        "--specular-power",
        "--diffuse-curve",
        "--light",
        "--camera-position",
        "--camera-focal-point",
        "--camera-view-up",
        "--camera-view-angle",
        "--camera-orthographic",
        "--azimuth",
        "--elevation",
        "--roll",
        "--zoom",
        "--step",
        "--early-termination",
        "--space-skipping",
        "--brick-size",
        "--sampling",
        "--adaptive-threshold",
        "--pre-integration",
        "--gradient",
        "--layout",
        "--cut",
        "--probe",
        "--crop",
        "--clip-plane",
        "--clip-pose",
        "--mesh-space",
        "--segments",
        "--backmost",
        "--clip-events",
        "--buffer-depth",
        "--impregnation",
        "--impregnation-thickness",
        "--clip-intensity",
        "--cap",
        "--image-interpolation",
        "--stats",
        "--save-scene",
        "--scene",
        "--quiet",
        "--verbose",
    ];
    let help = run(folder.path(), "help render").succeeds();
    for option in documented {
        let line = help.lines().find(|l| l.split([' ', ',']).any(|word| word == option));
        let line = line.unwrap_or_else(|| panic!("{option} is missing\n{help}"));
        assert!(line.split_whitespace().count() > 2, "{option} has no words: {line}");
    }
}
