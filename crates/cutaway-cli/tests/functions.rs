//! Transfer functions of other programs: rendered with, told of, converted.

mod common;

use common::{image, names, run};
use serde_json::Value;

const BONES: &str = "1\n0\n0.9\n0.1\n0.2\n10\n6 0 0 0.3 0 1 0.5\n4 0 1 255 0.5\n8 0.3 1 0 0 1 1 1 0.5\n";
const MAP: &str =
    r#"[{"Name": "two\ncolours", "ColorSpace": "Lab", "RGBPoints": [0, 1, 0, 0, 250, 0, 0, 1]}]"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bones.vp"), BONES).unwrap();
    std::fs::write(folder.path().join("map.json"), MAP).unwrap();
    folder
}

#[test]
fn functions_of_other_programs_are_rendered_with() {
    let folder = folder();
    let line = "render sample:sphere:16 --resolution 24,24 --engine cpu --transfer-function";
    let run = |rest: &str| run(folder.path(), &format!("{line} {rest}"));
    let made = run("bones.vp -o a.npy");
    assert!(made.err.contains("gradient"), "{}", made.err);
    made.succeeds();
    // The same function in every other format makes the same picture; light belongs to Slicer's.
    for name in ["b.json", "b.pv.json", "b.vp", "b.vp.json"] {
        common::run(folder.path(), &format!("convert bones.vp {name} --quiet")).succeeds_silently();
        let shade = if name.contains("vp") { "" } else { "--no-shade" };
        run(&format!("{name} {shade} -o b.npy")).succeeds();
        assert_eq!(image(folder.path().join("a.npy")), image(folder.path().join("b.npy")), "{name}");
    }
    // Options win over the light of the file.
    run("bones.vp --shade -o shaded.npy").succeeds();
    assert_ne!(image(folder.path().join("a.npy")), image(folder.path().join("shaded.npy")));
}

#[test]
fn info_lists_points_and_light() {
    let folder = folder();
    let text = run(folder.path(), "info bones.vp").succeeds_silently();
    for part in ["transfer function (Slicer", "0 to 1", "length of 1", "off; ambient 0.1", "gradient"] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    let text = run(folder.path(), "info map.json").succeeds_silently();
    assert!(text.contains("two\\ncolours") && text.contains("more (--json lists all)"), "{text}");
    let json = run(folder.path(), "info bones.vp --json").succeeds_silently();
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["kind"], &json["unit_distance"]), (&"transfer function".into(), &1.0.into()));
    assert_eq!(json["points"].as_array().unwrap().len(), 3);
    assert_eq!(json["lighting"]["shade"], false);
    std::fs::write(folder.path().join("none.json"), r#"{"points": []}"#).unwrap();
    run(folder.path(), "info none.json").fails(1, &["none.json", "at least one point"]);
    run(folder.path(), "render none.json -o a.png").fails(1, &["a transfer function", "--transfer-function"]);
    run(folder.path(), "render bones.vp -o a.png").fails(1, &["a transfer function", "--transfer-function"]);
}

#[test]
fn what_a_format_cannot_hold_is_said_and_what_cannot_be_converted_refused() {
    let folder = folder();
    let converted = run(folder.path(), "convert bones.vp a.json");
    assert!(converted.err.contains("gradient") && converted.err.contains("light was left out"));
    converted.succeeds();
    let refused =
        |line: &str, code, says: &[&str]| run(folder.path(), &format!("convert {line}")).fails(code, says);
    refused("bones.vp out.ply", 2, &["out.ply", "transfer function", ".vp.json"]);
    refused("bones.vp out.json --repair", 2, &["--repair", "meshes"]);
    refused("bones.vp bones.vp", 2, &["overwrite"]);
    refused("nothing.vp out.json", 1, &["nothing.vp"]);
    std::fs::write(folder.path().join("bad.vp"), BONES.replace("6 0 0", "5 0 0")).unwrap();
    refused("bad.vp out.json", 1, &["bad.vp", "line 7", "multiple of 2"]);
    assert_eq!(names(folder.path()), ["a.json", "bad.vp", "bones.vp", "map.json"]);
}
