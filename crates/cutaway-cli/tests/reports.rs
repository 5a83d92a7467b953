//! What other programs read: statistics, benchmarks, schema, lists, comparisons; and that a reader may leave early.

mod common;

use common::{command, image, run};
use serde_json::{Value, json};

/// The names of INTERFACE's statistics and ours, sorted.
const STATISTICS: [&str; 20] = [
    "adapter",
    "classify_ms",
    "clip_ms",
    "engine",
    "frame_ms",
    "gpu_bytes",
    "gpu_ms",
    "load_ms",
    "peak_rss_bytes",
    "prepare_ms",
    "rays",
    "repaired_lines",
    "resolution",
    "samples",
    "segments",
    "simd",
    "skipped_fraction",
    "threads",
    "triangles_or_tetrahedra",
    "visible_fraction",
];

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

#[track_caller]
fn check_statistics(s: &Value, engine: &str, resolution: [u32; 2], frames: u64) {
    assert_eq!(keys(s), STATISTICS);
    assert_eq!(keys(&s["frame_ms"]), ["max", "median", "min", "n"]);
    assert_eq!((&s["engine"], &s["resolution"]), (&json!(engine), &json!(resolution)));
    assert_eq!(s["frame_ms"]["n"], frames);
    let [min, median, max] = ["min", "median", "max"].map(|k| s["frame_ms"][k].as_f64().unwrap());
    assert!(0.0 < min && min <= median && median <= max);
    for time in ["load_ms", "prepare_ms", "classify_ms", "clip_ms"] {
        assert!(s[time].as_f64().unwrap() >= 0.0, "{time}");
    }
}

#[test]
fn statistics_have_exactly_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let small = "render sample:sphere:24 --resolution 32,24 -o a.png";
    run(folder.path(), &format!("{small} --threads 2 --stats s.json")).succeeds_silently();
    let s = parsed(&std::fs::read_to_string(folder.path().join("s.json")).unwrap());
    check_statistics(&s, "cpu", [32, 24], 1);
    assert_eq!(s["threads"], 2);
    assert!(s["samples"].as_u64() > s["rays"].as_u64() && s["rays"].as_u64() > Some(0), "{s}");
    assert!((0.0..=1.0).contains(&s["skipped_fraction"].as_f64().unwrap()));

    let to_error = run(folder.path(), &format!("{small} --engine reference --stats -"));
    check_statistics(&parsed(&to_error.err), "reference", [32, 24], 1);
    assert_eq!(to_error.succeeds(), "");

    let scalar = run(folder.path(), &format!("{small} --simd scalar --stats -"));
    assert_eq!(parsed(&scalar.err)["simd"], "scalar");
}

#[test]
fn benchmarks_print_the_same_names() {
    let folder = tempfile::tempdir().unwrap();
    let scene =
        json!({ "volume": "sample:sphere:24", "render": { "resolution": [32, 24], "engine": "cpu" } });
    std::fs::write(folder.path().join("s.json"), scene.to_string()).unwrap();
    let line = "bench frame --scene s.json --frames 4 --orbit -90 -o first.npy";
    check_statistics(&parsed(&run(folder.path(), line).succeeds_silently()), "cpu", [32, 24], 4);
    assert_eq!(image(folder.path().join("first.npy")).width(), 32);
    run(folder.path(), "bench frame --scene s.json --frames 1 --stats b.json").succeeds_silently();
    check_statistics(
        &parsed(&std::fs::read_to_string(folder.path().join("b.json")).unwrap()),
        "cpu",
        [32, 24],
        1,
    );
}

#[test]
fn the_first_frame_of_a_benchmark_is_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "sample:sphere:24 --resolution 32,24";
    run(folder.path(), &format!("bench frame {scene} --frames 1 -o a.npy")).succeeds();
    run(folder.path(), &format!("render {scene} -o b.npy")).succeeds();
    assert_eq!(image(folder.path().join("a.npy")).pixels(), image(folder.path().join("b.npy")).pixels());
}

/// Whether a value is what a schema says, as far as ours go: references, types, properties, items, choices.
fn check(root: &Value, schema: &Value, value: &Value) -> Result<(), String> {
    if let Some(path) = schema["$ref"].as_str() {
        let target = root.pointer(path.trim_start_matches('#')).ok_or(format!("no {path}"))?;
        check(root, target, value)?;
    }
    for choices in [&schema["anyOf"], &schema["oneOf"]].into_iter().filter_map(Value::as_array) {
        if !choices.iter().any(|choice| check(root, choice, value).is_ok()) {
            return Err(format!("{value} is none of the choices"));
        }
    }
    let is = |name: &Value| match name.as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("boolean") => value.is_boolean(),
        Some("number") => value.is_number(),
        Some("integer") => value.is_u64() || value.is_i64(),
        Some("null") => value.is_null(),
        other => panic!("type {other:?} is unknown to this test"),
    };
    let fits = match &schema["type"] {
        Value::Null => true,
        Value::Array(types) => types.iter().any(is),
        one => is(one),
    };
    let allowed = schema["enum"].as_array().is_none_or(|all| all.contains(value));
    if !fits || !allowed || schema.get("const").is_some_and(|only| only != value) {
        return Err(format!("{value} is not {schema}"));
    }
    for (key, inner) in value.as_object().into_iter().flatten() {
        match (schema["properties"].get(key), &schema["additionalProperties"]) {
            (Some(property), _) => check(root, property, inner).map_err(|e| format!("{key}: {e}"))?,
            (None, Value::Bool(false)) => return Err(format!("`{key}` is unknown")),
            _ => {}
        }
    }
    for item in value.as_array().into_iter().flatten() {
        if schema.get("items").is_some() {
            check(root, &schema["items"], item)?;
        }
    }
    let mut required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
    match required.find(|key| value.is_object() && value.get(key).is_none()) {
        Some(key) => Err(format!("`{key}` is missing")),
        None => Ok(()),
    }
}

/// The scene of the documentation.
fn documented() -> Value {
    json!({
        "volume": "engine_256x256x128_uint8.raw",
        "transfer_function": { "unit_distance": 1.0, "points": [
            { "value": 80, "color": [0.9, 0.7, 0.5], "opacity": 0.0 },
            { "value": 200, "color": [1, 1, 1], "opacity": 0.4 }
        ] },
        "camera": { "position": [0, -600, 120], "focal_point": [127.5, 127.5, 63.5], "view_up": [0, 0, 1], "view_angle": 30 },
        "lighting": { "shade": true, "ambient": 0.1, "diffuse": 0.9, "specular": 0.2, "specular_power": 10,
                      "diffuse_curve": "two-sided" },
        "clip": { "difference": [ "volume", { "mesh": "bunny.ply", "pose": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]] } ] },
        "clip_shading": { "impregnation": "linear", "thickness": 3, "overlay": 0.0 },
        "render": { "mode": "composite", "step": 0.5, "engine": "cpu", "resolution": [512, 512], "iso": [1, 2] }
    })
}

#[test]
fn the_schema_describes_the_documented_scene() {
    let folder = tempfile::tempdir().unwrap();
    let schema = parsed(&run(folder.path(), "schema").succeeds_silently());
    assert_eq!(check(&schema, &schema, &documented()), Ok(()));
    let described = json!({ "path": "a.bin", "spacing": [1, 1, 2], "dims": [2, 3, 4], "type": "int16",
                            "big_endian": true, "header_bytes": 5 });
    let mut raw = documented();
    raw["volume"] = described;
    assert_eq!(check(&schema, &schema, &raw), Ok(()));
    // It must be able to say no.
    for (path, wrong) in [
        ("/volume", json!(5)),
        ("/render/mode", json!("composit")),
        ("/render/resolution", json!(512)),
        ("/lighting/shade", json!(1)),
        ("/camera", json!({ "positon": [0, 0, 0] })),
        ("/clip", json!("volum")),
        ("/clip", json!({ "spher": {} })),
        ("/clip", json!({ "pose": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]] })),
        ("/clip/difference/1", json!({ "sphere": { "center": [0, 0, 0] } })),
        ("/clip_shading/impregnation", json!("some")),
        ("/transfer_function/points", json!([{ "value": 1, "color": [1, 1, 1] }])),
    ] {
        let mut scene = documented();
        *scene.pointer_mut(path).unwrap() = wrong;
        assert!(check(&schema, &schema, &scene).is_err(), "{path}");
    }
}

const CLIPPED: &str =
    "--engine reference --cut sphere:1,2,3,4 --crop 0,9,0,9,0,9 --segments 2 --clip-plane 0,0,1,5";

#[test]
fn saved_scenes_are_what_the_schema_describes() {
    let folder = tempfile::tempdir().unwrap();
    let schema = parsed(&run(folder.path(), "schema").succeeds());
    for look in ["", "--preset CT-Bone", "--iso 0 --light 1,2,3 --camera-orthographic 20", CLIPPED] {
        let line = format!("render sample:sphere:24 --resolution 8,8 {look} -o a.png --save-scene s.json");
        run(folder.path(), &line).succeeds();
        let scene = parsed(&std::fs::read_to_string(folder.path().join("s.json")).unwrap());
        assert_eq!(check(&schema, &schema, &scene), Ok(()), "{look}");
    }
}

#[test]
fn everything_that_presets_lists_can_be_named() {
    let folder = tempfile::tempdir().unwrap();
    let lists = parsed(&run(folder.path(), "presets --json").succeeds_silently());
    let text = run(folder.path(), "presets").succeeds_silently();
    assert_eq!(keys(&lists), ["colormaps", "presets", "samples"]);
    let strings = |v: &Value| -> Vec<String> {
        v.as_array().unwrap().iter().map(|v| v.as_str().unwrap().to_owned()).collect()
    };
    let presets = lists["presets"].as_array().unwrap();
    assert!(presets.len() >= 8);
    for preset in presets {
        assert_eq!(keys(preset), ["description", "mode", "name", "shade"]);
        let name = preset["name"].as_str().unwrap();
        assert!(text.contains(name));
        run(folder.path(), &format!("render sample:sphere:8 --resolution 4,4 --preset {name} -o a.png"))
            .succeeds();
    }
    for name in strings(&lists["colormaps"]) {
        assert!(text.contains(&name));
        run(folder.path(), &format!("render sample:sphere:8 --resolution 4,4 --colormap {name} -o a.png"))
            .succeeds();
    }
    for name in strings(&lists["samples"]) {
        assert!(text.contains(&format!("sample:{name}")));
        run(folder.path(), &format!("info sample:{name}")).succeeds_silently();
    }
}

#[test]
fn completions_are_written_for_every_shell() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = run(folder.path(), &format!("completions {shell}")).succeeds_silently();
        for word in ["cutaway", "camera-view-angle", "presets"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
}

#[test]
fn comparisons_end_as_they_find() {
    let folder = tempfile::tempdir().unwrap();
    let small = "render sample:sphere:24 --resolution 32,24";
    run(folder.path(), &format!("{small} -o a.npy --depth-output depth.npy")).succeeds();
    run(folder.path(), &format!("{small} --azimuth 40 --brightness 0.3 -o b.npy")).succeeds();
    run(folder.path(), "render sample:sphere:24 --resolution 16,16 -o small.png").succeeds();
    std::fs::write(folder.path().join("text.png"), "hello").unwrap();

    let same = parsed(&run(folder.path(), "compare a.npy a.npy --json --fail-above 0").succeeds_silently());
    for key in ["largest_difference", "mean_absolute_difference", "rmse", "psnr", "ssim"] {
        assert!(same.get(key).is_some(), "{key}");
    }
    assert_eq!((&same["rmse"], &same["ssim"], &same["psnr"]), (&json!(0.0), &json!(1.0), &Value::Null));
    let differ = parsed(&run(folder.path(), "compare a.npy b.npy --json").succeeds_silently());
    assert!(differ["rmse"].as_f64().unwrap() > 0.001 && differ["ssim"].as_f64().unwrap() < 1.0, "{differ}");

    let failed = run(folder.path(), "compare a.npy b.npy --fail-above 0.0001");
    assert_eq!(failed.code, 1);
    assert!(
        failed.err.starts_with("error: the images differ by an RMSE of") && failed.err.lines().count() == 1
    );
    assert!(String::from_utf8(failed.out).unwrap().contains("rmse"));
    run(folder.path(), "compare a.npy b.npy --fail-above 1").succeeds_silently();

    run(folder.path(), "compare a.npy b.npy --difference d.png --gain 4").succeeds_silently();
    assert_eq!(image(folder.path().join("d.png")).width(), 32);
    for (line, code, says) in [
        ("a.npy small.png", 1, "32 x 24 and 16 x 16"),
        ("a.npy nothing.png", 1, "nothing.png"),
        ("a.npy text.png", 1, "not a PNG file"),
        ("a.npy a.nii", 2, "'.nii'"),
        ("a.npy b.npy --fail-above -1", 2, "--fail-above"),
        ("a.npy b.npy --fail-above nan", 2, "--fail-above"),
        ("a.npy b.npy --difference a.npy", 2, "would overwrite 'a.npy'"),
        ("a.npy b.npy --difference no/d.png", 1, "'no' does not exist"),
        ("a.npy b.npy --difference d.txt", 2, "'.txt'"),
        ("a.npy b.npy --difference d.png --gain 0", 2, "--gain"),
        ("a.npy b.npy --gain 3", 2, "--difference"),
    ] {
        run(folder.path(), &format!("compare {line}")).fails(code, &[says]);
    }
    // Depth has infinite pixels where nothing was hit: such images are never close.
    let infinite = run(folder.path(), "compare depth.npy depth.npy --fail-above 1");
    assert!(infinite.code == 1 && infinite.err.contains("NaN or infinite"), "{}", infinite.err);
}

/// `cutaway presets | head -1` has what it wanted: no panic, no error.
#[test]
fn a_reader_of_text_may_leave() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), "render sample:sphere:8 --resolution 4,4 -o a.png").succeeds();
    for line in [
        "presets",
        "presets --json",
        "schema",
        "info sample:sphere:24",
        "info sample:sphere:24 --json",
        "compare a.png a.png",
        "compare a.png a.png --json",
        "bench frame sample:sphere:8 --resolution 4,4 --frames 1",
        "completions bash",
        "help",
        "help render",
        "--version",
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = command(folder.path()).args(line.split(' ')).stdout(writer).output().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{line}");
        assert_eq!(output.status.code(), Some(0), "{line}");
    }
}

/// A full disk is no reader that left.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    for line in ["presets", "schema", "info sample:sphere:8", "render sample:sphere:8 --resolution 4,4 -o -"]
    {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = command(folder.path()).args(line.split(' ')).stdout(full).output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr);
        assert!(err.starts_with("error: could not write to standard output: "), "{line}: {err}");
        assert_eq!((output.status.code(), err.lines().count()), (Some(1), 1), "{line}");
    }
    for line in ["render nothing.nii -o a.png", "qqq", "render sample:sphere:8 --resolution 4,4 -v -o a.png"]
    {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let status = command(folder.path()).args(line.split(' ')).stderr(full).status().unwrap();
        assert!(status.code().is_some_and(|code| code <= 2), "{line}: {status}");
    }
}

#[test]
fn verbose_says_what_was_chosen_and_quiet_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let small = "render sample:sphere:24 --resolution 32,24 -o a.png";
    let verbose = run(folder.path(), &format!("{small} --verbose")).err;
    for word in [
        "volume: sample:sphere:24, 24 x 24 x 24",
        "camera: at",
        "opacity: ",
        "mode: composite",
        "threads: load",
    ] {
        assert!(verbose.contains(word), "{word}\n{verbose}");
    }
    assert_eq!(run(folder.path(), small).succeeds_silently(), "");
    assert_eq!(run(folder.path(), &format!("{small} --quiet")).succeeds_silently(), "");
    let unused = run(folder.path(), &format!("{small} --iso 0 --mode mip"));
    assert_eq!(unused.err, "note: --iso has no effect in mip mode\n");
    run(folder.path(), &format!("{small} --iso 0 --mode mip -q")).succeeds_silently();
}
