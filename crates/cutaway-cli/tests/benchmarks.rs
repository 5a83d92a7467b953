//! `cutaway bench roofline` and `cutaway bench papers`: that they run, and what other programs read of them.

mod common;

use common::run;
use serde_json::{Value, json};

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

#[track_caller]
fn has_keys(value: &Value, expected: &[&str]) {
    let mut keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    let mut expected = expected.to_vec();
    keys.sort_unstable();
    expected.sort_unstable();
    assert_eq!(keys, expected);
}

fn rows<'a>(value: &'a Value, name: &str) -> &'a [Value] {
    let rows = value[name].as_array().unwrap_or_else(|| panic!("{name}: {value}"));
    assert!(!rows.is_empty(), "{name}");
    rows
}

#[track_caller]
fn is_above_zero(value: &Value) {
    assert!(value.as_f64().unwrap() > 0.0, "{value}");
}

#[test]
fn the_roofline_names_its_ceilings_and_holds_frames_against_them() {
    let folder = tempfile::tempdir().unwrap();
    let report = parsed(&run(folder.path(), "bench roofline --quick --json").succeeds_silently());
    has_keys(&report, &["about", "threads", "simd", "ceilings", "memory", "frames"]);
    for row in rows(&report, "ceilings") {
        has_keys(row, &["work", "simd", "threads", "resident", "bytes", "samples_per_second"]);
        is_above_zero(&row["samples_per_second"]);
    }
    // Every machine has the scalar kernels; the widest instructions are tried from memory, too.
    for work in ["sample", "composite", "shade"] {
        let has = |resident: &str, simd: &Value| {
            let wanted = |row: &Value| {
                row["work"] == work
                    && row["resident"] == resident
                    && row["simd"] == *simd
                    && row["threads"] == 1
            };
            rows(&report, "ceilings").iter().any(wanted)
        };
        assert!(has("cache", &json!("scalar")) && has("memory", &report["simd"]), "{work}");
        assert!(has("cache", &report["simd"]), "{work}");
    }
    for row in rows(&report, "memory") {
        has_keys(row, &["threads", "bytes", "bytes_per_second"]);
        is_above_zero(&row["bytes_per_second"]);
    }
    let names = [
        "scene",
        "work",
        "frame_ms",
        "samples",
        "skipped_fraction",
        "samples_per_second",
        "ceiling_samples_per_second",
        "ratio",
    ];
    for row in rows(&report, "frames") {
        has_keys(row, &names);
        let [frame, ceiling, ratio] = ["samples_per_second", "ceiling_samples_per_second", "ratio"]
            .map(|name| row[name].as_f64().unwrap());
        assert!((frame / ceiling / ratio - 1.0).abs() < 1e-9, "{row}");
        // What it says can be measured alone.
        let line = format!("bench frame {} --frames 1", row["scene"].as_str().unwrap());
        let alone = parsed(&run(folder.path(), &line).succeeds());
        assert_eq!(alone["samples"], row["samples"]);
    }
    let text = run(folder.path(), "bench roofline --quick").succeeds_silently();
    for part in ["Ceilings", "Reading memory", "Frames", "A ceiling is what"] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn papers_are_sections_of_rows() {
    let folder = tempfile::tempdir().unwrap();
    let report = parsed(&run(folder.path(), "bench papers --quick --json").succeeds_silently());
    has_keys(&report, &["threads", "frames", "sections"]);
    let sections = rows(&report, "sections");
    let names: Vec<&str> = sections.iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        [
            "termeer-software",
            "termeer-image-size",
            "haferburg-fetches",
            "rezk-salama-bricks",
            "termeer-ray-triangle",
            "maximo-regular",
            "maximo-unstructured"
        ]
    );
    for section in sections {
        has_keys(section, &["name", "paper", "paper_says", "measured", "rows"]);
        if section["name"] == "termeer-ray-triangle" {
            assert_eq!(rows(section, "rows").len(), 8);
            for row in rows(section, "rows") {
                has_keys(row, &["algorithm", "nanoseconds", "relative_speed", "paper_relative_speed"]);
                assert!(row["relative_speed"].as_f64().unwrap() > 0.0, "{row}");
            }
            continue;
        }
        if section["name"] == "haferburg-fetches" {
            // Without any GPU there is nothing to count.
            for row in section["rows"].as_array().unwrap() {
                is_above_zero(&row["fetches"]);
                if row["space_skipping"] == "off" {
                    assert_eq!(row["times_fewer_than_from_the_box"], 1.0, "{row}");
                }
            }
            continue;
        }
        if section["name"].as_str().is_some_and(|name| name.starts_with("maximo-")) {
            // Without any GPU there is nothing to measure.
            for row in section["rows"].as_array().unwrap() {
                is_above_zero(&row["mtet_per_s_nominal"]);
                assert!(row["drawn"].as_u64() <= row["tetrahedra"].as_u64(), "{row}");
            }
            continue;
        }
        if section["name"] == "rezk-salama-bricks" {
            // Without any GPU there is nothing to measure.
            for row in section["rows"].as_array().unwrap() {
                is_above_zero(&row["frames_per_second"]);
                if row["brick_size"] == 0 {
                    assert_eq!(row["times_as_fast_as_without_bricks"], 1.0, "{row}");
                }
            }
            continue;
        }
        for row in rows(section, "rows") {
            let names = [
                "engine",
                "adapter",
                "transfer_function",
                "volume",
                "resolution",
                "frame_ms",
                "frames_per_second",
                "samples",
                "paper_frames_per_second",
                "scene",
            ];
            has_keys(row, &names);
            let [fps, ms] =
                [&row["frames_per_second"], &row["frame_ms"]["median"]].map(|v| v.as_f64().unwrap());
            assert!((fps * ms / 1e3 - 1.0).abs() < 1e-9, "{row}");
            let line = format!("bench frame {} --frames 1", row["scene"].as_str().unwrap());
            let alone = parsed(&run(folder.path(), &line).succeeds());
            assert_eq!((&alone["samples"], &alone["resolution"]), (&row["samples"], &row["resolution"]));
        }
    }
    let sides: Vec<&Value> = rows(&sections[1], "rows").iter().map(|row| &row["resolution"][0]).collect();
    // Of the cpu engine, then of a GPU where there is one.
    assert_eq!(sides[..6], [8, 16, 24, 32, 48, 64]);
    assert!(sides.len() == 6 || sides[6..] == sides[..6], "{sides:?}");
    assert_eq!(sections[0]["rows"][0]["paper_frames_per_second"], json!([2.0, 8.0]));
}

#[test]
fn sections_can_be_chosen_and_wrong_ones_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = run(folder.path(), "bench papers termeer-software --quick").succeeds_silently();
    assert!(text.contains("termeer-software:") && !text.contains("image-size"), "{text}");
    run(folder.path(), "bench papers termer").fails(2, &["termer", "termeer-software"]);
    run(folder.path(), "bench papers --frames 0").fails(2, &["--frames"]);
    run(folder.path(), "bench rooflin").fails(2, &["did you mean `roofline`?"]);
}
