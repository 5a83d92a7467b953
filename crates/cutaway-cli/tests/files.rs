//! Files as they come: damaged, empty, odd, of other kinds; and what `info` says of the good ones.

mod common;

use std::path::Path;

use common::{image, names, nrrd, run};
use serde_json::Value;

fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

#[test]
fn what_cannot_be_read_is_said_by_file() {
    let folder = tempfile::tempdir().unwrap();
    let whole = nrrd([8, 8, 8], "uint8", &[7; 512]);
    let files: &[(&str, &[u8], &[&str])] = &[
        ("empty.nii", b"", &["0 bytes of header"]),
        ("empty.raw", b"", &["dims"]),
        ("short.nrrd", &whole[..whole.len() - 12], &["500 bytes", "512 bytes", "cut short"]),
        ("short_4x4x4_uint8.raw", &[0; 60], &["60 bytes", "64 bytes"]),
        ("long_4x4x4_uint8.raw", &[0; 65], &["65 bytes", "64"]),
        ("blob.raw", &[0; 64], &["dims", "name_256x256x128_uint8.raw"]),
        ("damaged.nii.gz", b"\x1f\x8b\x08\0\0\0\0\0\0\xff\xff\xff\xff\xff", &["gzip", "damaged"]),
        ("text.txt", b"hello", &["unknown format", "hello"]),
        ("junk.nrrd", b"\x1b[31mred\nalert", &["magic"]),
        ("a.dcm", b"", &["DICOM is not supported"]),
        ("a.tif", b"II*\0", &["TIFF is not supported"]),
        ("picture.png", b"\x89PNG\r\n\x1a\n", &["an image", "cutaway compare"]),
        ("scene.json", br#"{"volume": "x.nrrd", "what": 1}"#, &["a scene file", "--scene scene.json"]),
        ("raw.json", br#"{"dims": [1, 2, 3]}"#, &["describes raw voxels"]),
    ];
    for (name, bytes, says) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let says = [says, &[*name][..]].concat();
        run(folder.path(), &format!("render {name} -o out.png")).fails(1, &says);
        run(folder.path(), &format!("info {name}")).fails(1, &says);
        run(folder.path(), &format!("info {name} --json")).fails(1, &says);
    }
    run(folder.path(), "render nothing.nii -o out.png").fails(1, &["cannot open nothing.nii"]);
    run(folder.path(), "info no/nothing.nii").fails(1, &["cannot open no/nothing.nii"]);
    run(folder.path(), "render . -o out.png").fails(1, &["a folder"]);
    assert!(!folder.path().join("out.png").exists());
}

#[test]
fn sizes_that_no_machine_has_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("huge.nrrd");
    for side in [65_535, 4_294_967_295] {
        std::fs::write(&file, nrrd([side; 3], "float", &[0; 100])).unwrap();
        run(folder.path(), "info huge.nrrd").fails(1, &["huge.nrrd", "limit"]);
    }
    std::fs::write(folder.path().join("v.raw"), [0; 64]).unwrap();
    let line = "info v.raw --dims 4294967295,4294967295,4294967295 --type float64";
    run(folder.path(), line).fails(1, &["v.raw", "limit"]);
    run(folder.path(), "info v.raw --dims 0,4,4 --type uint8").fails(1, &["v.raw", "dims"]);
}

#[test]
fn odd_volumes_render_to_finite_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let mut gaps: Vec<f32> = (0..512).map(|i| (i % 17) as f32).collect();
    (gaps[5], gaps[9], gaps[11]) = (f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
    let volumes = [
        ("constant", nrrd([8, 8, 8], "uint8", &[7; 512])),
        ("zero", nrrd([8, 8, 8], "float", &[0; 2048])),
        ("nan", nrrd([8, 8, 8], "float", &floats([f32::NAN; 512].into_iter()))),
        ("gaps", nrrd([8, 8, 8], "float", &floats(gaps.into_iter()))),
        ("tiny", nrrd([2, 2, 2], "uint8", &[0, 1, 2, 3, 4, 5, 6, 7])),
        ("long", nrrd([300, 2, 2], "uint8", &[3; 1200])),
    ];
    for (name, bytes) in volumes {
        std::fs::write(folder.path().join(format!("{name}.nrrd")), bytes).unwrap();
        for engine in ["cpu", "reference"] {
            for mode in ["composite", "mip", "mean", "iso --iso 3"] {
                let line =
                    format!("render {name}.nrrd --resolution 16,12 --engine {engine} --mode {mode} -o a.npy");
                run(folder.path(), &line).succeeds();
                let finite =
                    image(folder.path().join("a.npy")).pixels().iter().flatten().all(|v| v.is_finite());
                assert!(finite, "{line}");
            }
        }
    }
    let noted = run(folder.path(), "render gaps.nrrd --resolution 16,12 -o a.npy");
    assert!(noted.err.starts_with("note: ") && noted.err.contains("values are NaN"), "{}", noted.err);
    run(folder.path(), "render gaps.nrrd --resolution 16,12 -o a.npy --quiet").succeeds_silently();
}

#[test]
fn a_single_slice_is_described_but_not_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let voxels: Vec<u8> = (0..64).collect();
    std::fs::write(folder.path().join("slice.nrrd"), nrrd([8, 8, 1], "uint8", &voxels)).unwrap();
    run(folder.path(), "render slice.nrrd -o a.png").fails(1, &["slice.nrrd", "at least 2 along each axis"]);
    assert!(run(folder.path(), "info slice.nrrd").succeeds().contains("8 x 8 x 1"));
    assert_eq!(names(folder.path()), ["slice.nrrd"]);
}

#[test]
fn wrong_scenes_are_said_by_file() {
    let wrong: &[(&str, &[&str])] = &[
        ("", &["the file ends"]),
        ("{}", &["`volume`"]),
        ("[1, 2", &["line 1"]),
        (r#"{"volume": "sample:sphere:8"} x"#, &["trailing"]),
        (r#"{"volume": ""}"#, &["`volume` is empty"]),
        (r#"{"volume": 5}"#, &["line 1"]),
        (r#"{"volume": "nothing.nii"}"#, &["cannot open nothing.nii"]),
        (r#"{"volume": "sample:spher"}"#, &["did you mean `sphere`?"]),
        (r#"{"volume": {"path": "x", "type": "foo"}}"#, &["`foo` is no voxel type"]),
        (r#"{"volume": "sample:sphere:8", "clip": {}}"#, &["clip node", "found none of them"]),
        (r#"{"volume": "sample:sphere:8", "clip": {"mesh": "no.ply"}}"#, &["no.ply"]),
        (r#"{"volume": "sample:sphere:8", "clip_shading": {"thick": 1}}"#, &["`thick`"]),
        (r#"{"volume": "sample:sphere:8", "clip_shading": {"thickness": -1}}"#, &["thickness is -1"]),
        (r#"{"volume": "sample:sphere:8", "clip_shading": {"overlay": 2}}"#, &["overlay is 2"]),
        (r#"{"volume": "sample:sphere:8", "render": {"segments": 0}}"#, &["whole number of 1"]),
        (r#"{"volume": "sample:sphere:8", "render": {"engine": "cubes"}}"#, &["`cubes`"]),
        (
            r#"{"volume": "sample:sphere:8", "render": {"brick_size": 12}}"#,
            &["brick_size is 12", "power of two"],
        ),
        (r#"{"volume": "sample:sphere:8", "render": {"resolution": [0, 5]}}"#, &["resolution is 0 x 5"]),
        (r#"{"volume": "sample:sphere:8", "render": {"step": 0}}"#, &["step is 0"]),
        (r#"{"volume": "sample:sphere:8", "render": {"mode": "iso"}}"#, &["isovalue"]),
        (r#"{"volume": "sample:sphere:8", "render": {"iso": 5}}"#, &["line 1"]),
        (r#"{"volume": "sample:sphere:8", "transfer_function": {"points": []}}"#, &["at least one point"]),
        (
            r#"{"volume": "sample:sphere:8", "lighting": {"shade": 1}}"#,
            &["`lighting.shade`", "true or false"],
        ),
        (r#"{"volume": "sample:sphere:8", "lighting": {"wrap_power": 0}}"#, &["wrap_power"]),
        (
            r#"{"volume": "sample:sphere:8", "camera": {"position": [0,0,0], "focal_point": [0,0,0]}}"#,
            &["move one of them"],
        ),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (scene, says) in wrong {
        std::fs::write(folder.path().join("bad.json"), scene).unwrap();
        let says = [says, &["bad.json: "][..]].concat();
        run(folder.path(), "render --scene bad.json -o a.png --save-scene s.json").fails(1, &says);
    }
    assert_eq!(names(folder.path()), ["bad.json"]);
    // The same numbers from the command line are wrong use.
    std::fs::write(folder.path().join("good.json"), r#"{"volume": "sample:sphere:8"}"#).unwrap();
    run(folder.path(), "render --scene good.json -o a.png --step 0").fails(2, &["--step"]);
    run(folder.path(), "render --scene nothing.json -o a.png").fails(1, &["nothing.json"]);
    run(folder.path(), "render --scene . -o a.png").fails(1, &["."]);
}

/// A file of each kind from the readers' own fixtures: type, dimensions, orientation.
const FIXTURES: [(&str, &str, [u32; 3], Option<&str>); 8] = [
    ("raw/name_5x4x3_int16.raw", "int16", [5, 4, 3], None),
    ("raw/big_endian.raw", "uint16", [5, 4, 3], None),
    ("nrrd/gzip_big_endian.nrrd", "int16", [3, 4, 5], None),
    ("nrrd/detached.nhdr", "int16", [3, 4, 5], Some("RAS")),
    ("nrrd/axes_LPS.nrrd", "int16", [3, 4, 5], Some("LPS")),
    ("metaimage/axes_LPS.mha", "int16", [3, 4, 5], Some("LPS")),
    ("metaimage/beside.mhd", "int16", [3, 4, 5], Some("RAS")),
    ("nifti/type_uint32_be.nii", "uint32", [3, 4, 5], Some("RAS")),
];

#[test]
fn info_describes_every_format() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cutaway-io/tests/fixtures");
    for (name, kind, dims, axes) in FIXTURES {
        let text = run(&folder, &format!("info {name}")).succeeds();
        let info: Value =
            serde_json::from_str(&run(&folder, &format!("info {name} --json")).succeeds()).unwrap();
        assert_eq!((&info["type"], &info["file"]), (&kind.into(), &name.into()));
        assert_eq!(info["dims"], serde_json::json!(dims), "{name}");
        assert_eq!(info["orientation"].as_str(), axes, "{name}");
        let [x, y, z] = dims;
        for part in [&format!("{x} x {y} x {z}"), kind, axes.unwrap_or("not stated by the file")] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert!(text.lines().all(|l| l == l.trim_end()), "{text}");
    }
}

#[test]
fn info_as_json_has_its_names() {
    let folder = tempfile::tempdir().unwrap();
    let info: Value =
        serde_json::from_str(&run(folder.path(), "info sample:sphere:24 --json").succeeds_silently())
            .unwrap();
    let mut keys: Vec<&str> = info.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    let expected = [
        "bytes",
        "dims",
        "file",
        "histogram",
        "left_handed",
        "notices",
        "orientation",
        "range",
        "replaced_voxels",
        "spacing",
        "stored_as",
        "type",
        "world",
        "world_from_voxel",
    ];
    assert_eq!(keys, expected);
    assert_eq!(info["dims"], serde_json::json!([24, 24, 24]));
    assert_eq!((&info["file"], &info["world"]), (&"sample:sphere:24".into(), &"unknown".into()));
    let matrix = info["world_from_voxel"].as_array().unwrap();
    assert!(matrix.len() == 4 && matrix.iter().all(|row| row.as_array().unwrap().len() == 4));
    let counts = info["histogram"]["counts"].as_array().unwrap();
    assert_eq!(counts.iter().map(|n| n.as_u64().unwrap()).sum::<u64>(), 24 * 24 * 24);
}

/// A grid before any simulation ran: `info` says what there is, `render` what there is not.
#[test]
fn report_82_grids_without_values() {
    let folder = tempfile::tempdir().unwrap();
    let text = "# vtk DataFile Version 3.0\ntwo tetrahedra\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n\
        0 0 0\n2 0 0\n0 2 0\n0 0 2\n2 2 2\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n";
    std::fs::write(folder.path().join("grid.vtk"), text).unwrap();
    let info: Value = serde_json::from_str(&run(folder.path(), "info grid.vtk --json").succeeds()).unwrap();
    assert_eq!((&info["points"], &info["tetrahedra"], &info["flat"]), (&5.into(), &2.into(), &0.into()));
    assert_eq!(info["bounds"], serde_json::json!([[0.0, 0.0, 0.0], [2.0, 2.0, 2.0]]));
    assert!(info["values"].is_null() && info["range"].is_null(), "{info}");
    let about = run(folder.path(), "info grid.vtk").succeeds();
    assert!(about.contains("values       none"), "{about}");
    run(folder.path(), "render grid.vtk --engine cells -o a.png").fails(1, &["grid.vtk", "but no values"]);
    let vectors = format!("{text}POINT_DATA 5\nVECTORS velocity float\n{}\n", "1 2 3 ".repeat(5));
    std::fs::write(folder.path().join("grid.vtk"), vectors).unwrap();
    let about = run(folder.path(), "info grid.vtk").succeeds();
    assert!(about.contains("velocity (point data of 3 components)"), "{about}");
    // On cells, each tetrahedron has its own.
    let cells = format!("{text}CELL_DATA 2\nSCALARS material int\nLOOKUP_TABLE default\n3 8\n");
    std::fs::write(folder.path().join("grid.vtk"), cells).unwrap();
    let info: Value = serde_json::from_str(&run(folder.path(), "info grid.vtk --json").succeeds()).unwrap();
    assert_eq!(
        (&info["points"], &info["values"], &info["values_on"]),
        (&5.into(), &"material".into(), &"cell".into())
    );
    assert_eq!(info["range"], serde_json::json!([3.0, 8.0]));
}
