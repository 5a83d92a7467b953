//! Files of transfer functions: what other programs write is read, what we write comes back, what is damaged is refused.

use cutaway_core::lighting::Lighting;
use cutaway_core::transfer_function::{ControlPoint, TransferFunction, extinction};
use cutaway_io::transfer_function::{
    FunctionFile, FunctionFormat, FunctionReadError, FunctionWriteError, function_text,
    read_transfer_function, read_transfer_function_bytes, recognize, recognize_bytes,
    write_transfer_function,
};
use cutaway_io::volume::Loaded;
use proptest::prelude::*;
use std::path::Path;

const FORMATS: [(FunctionFormat, &str); 4] = [
    (FunctionFormat::Cutaway, "a.json"),
    (FunctionFormat::ParaView, "a.pv.json"),
    (FunctionFormat::Slicer, "a.vp"),
    (FunctionFormat::SlicerJson, "a.vp.json"),
];

/// Slicer's documentation gives a file like it: bone of a CT.
const VP: &str = "1\n1\n0.9\n0.1\n0.2\n10\n\
    10 -3024 0 -86.9767 0 45.3791 0.169643 347.907 0.607143 3071 0.616071\n\
    4 0 1 255 1\n\
    20 -3024 0 0 0 -86.9767 0 0.25098 1 45.3791 1 0 0 347.907 1 1 0.25098 3071 0.827451 0.658824 1\n";

const VP_JSON: &str = r#"{
    "@schema": "https://raw.githubusercontent.com/slicer/slicer/main/Modules/Loadable/VolumeRendering/Resources/Schema/volume-property-schema-v1.0.0.json#",
    "volumeProperties": [ {
        "effectiveRange": [0.0, 255.0], "isoSurfaceValues": [], "independentComponents": true,
        "interpolationType": "linear", "useClippedVoxelIntensity": false, "clippedVoxelIntensity": -1e10,
        "components": [ {
            "componentWeight": 1.0, "shade": true,
            "lighting": { "diffuse": 0.9, "ambient": 0.15, "specular": 0.25, "specularPower": 12.0 },
            "disableGradientOpacity": false, "scalarOpacityUnitDistance": 2.5,
            "rgbTransferFunction": { "type": "colorTransferFunction", "points": [
                { "x": 10.0, "color": [1.0, 0.0, 0.0], "midpoint": 0.5, "sharpness": 0.0 },
                { "x": 200.0, "color": [0.0, 1.0, 0.5], "midpoint": 0.5, "sharpness": 0.0 } ] },
            "scalarOpacity": { "type": "piecewiseLinearFunction", "points": [
                { "x": 0.0, "y": 0.0, "midpoint": 0.5, "sharpness": 0.0 },
                { "x": 100.0, "y": 0.75, "midpoint": 0.5, "sharpness": 0.0 } ] },
            "gradientOpacity": { "type": "piecewiseLinearFunction", "points": [
                { "x": 0.0, "y": 0.0, "midpoint": 0.5, "sharpness": 0.0 },
                { "x": 255.0, "y": 1.0, "midpoint": 0.5, "sharpness": 0.0 } ] }
        } ] } ] }
"#;

const PARAVIEW: &str = r#"[ {
    "ColorSpace": "RGB", "Creator": "somebody", "DefaultMap": true, "Name": "Cold and Hot",
    "NanColor": [1, 1, 0], "Points": [0, 0, 0.5, 0, 0.5, 0.25, 0.5, 0, 1, 1, 0.5, 0],
    "RGBPoints": [0, 0, 1, 1, 0.45, 0, 0, 1, 0.5, 0, 0, 0.50196078431400004, 0.55, 1, 0, 0, 1, 1, 1, 0] } ]
"#;

fn read(name: &str, text: &str) -> Result<Loaded<FunctionFile>, FunctionReadError> {
    read_transfer_function_bytes(name, text.as_bytes())
}

fn loaded(text: &str) -> Loaded<FunctionFile> {
    read("a", text).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(text: &str) -> String {
    let error = read("a.x", text).expect_err(text).to_string();
    assert!(error.contains("a.x") && !error.contains('\n'), "{error}");
    error
}

#[test]
fn slicers_text_is_read_with_its_light() {
    let file = loaded(VP);
    assert!(file.notices.is_empty(), "{:?}", file.notices);
    let file = file.value;
    assert_eq!((file.unit_distance, file.has_opacities), (Some(1.0), true));
    let light = file.lighting.unwrap();
    assert!(light.shade);
    assert_eq!([light.diffuse, light.ambient, light.specular, light.specular_power], [0.9, 0.1, 0.2, 10.0]);
    let values: Vec<f64> = file.function.points().iter().map(|p| p.value).collect();
    assert_eq!(values, [-3024.0, -86.9767, 45.3791, 347.907, 3071.0]);
    assert_eq!(file.function.evaluate(45.3791), ([1.0, 0.0, 0.0], 0.169643));
    // Lines may end as on Windows.
    assert_eq!(loaded(&VP.replace('\n', " \r\n")).value.function, file.function);
}

#[test]
fn slicers_json_is_read_with_its_light_and_unit() {
    let file = loaded(VP_JSON);
    assert_eq!(file.notices, ["opacity by the gradient was left out: cutaway has none"]);
    let file = file.value;
    assert_eq!(file.unit_distance, Some(2.5));
    assert_eq!(file.lighting.unwrap().ambient, 0.15);
    // A point wherever either list has one: nothing is lost.
    let values: Vec<f64> = file.function.points().iter().map(|p| p.value).collect();
    assert_eq!(values, [0.0, 10.0, 100.0, 200.0]);
    assert_eq!(file.function.evaluate(100.0).1, 0.75);
    assert_eq!(file.function.evaluate(200.0), ([0.0, 1.0, 0.5], 0.75));
    let disabled = VP_JSON.replace("\"disableGradientOpacity\": false", "\"disableGradientOpacity\": true");
    assert!(loaded(&disabled).notices.is_empty());
}

#[test]
fn paraviews_maps_are_read_with_their_name() {
    let file = loaded(PARAVIEW);
    assert!(file.notices.is_empty(), "{:?}", file.notices);
    assert_eq!(file.value.name.as_deref(), Some("Cold and Hot"));
    assert_eq!((file.value.unit_distance, file.value.lighting), (None, None));
    assert_eq!(file.value.function.evaluate(0.5), ([0.0, 0.0, 0.501960784314], 0.25));
    // One map outside a list is one, too.
    let one = PARAVIEW.trim().trim_start_matches('[').trim_end_matches(']');
    assert_eq!(loaded(one).value.function, file.value.function);
}

#[test]
fn of_several_maps_the_first_with_values_is_taken() {
    let indexed = r#"{ "Name": "Brewer", "IndexedColors": [1, 0, 0, 0, 1, 0] }"#;
    let plain = r#"{ "Name": "gray", "RGBPoints": [0, 0, 0, 0, 10, 1, 1, 1], "IndexedColors": [1, 0, 0] }"#;
    let file = loaded(&format!("[{indexed}, {plain}, {plain}]"));
    assert_eq!(file.notices.len(), 3, "{:?}", file.notices);
    assert!(file.notices[0].contains("3 colour maps") && file.notices[0].contains("gray"));
    assert!(!file.value.has_opacities);
    assert_eq!(file.value.function.evaluate(10.0), ([1.0; 3], 0.5));
    assert!(refused(&format!("[{indexed}]")).contains("categories"));
    assert!(refused("[{\"RGBPoints\": []}]").contains("at least one"));
}

#[test]
fn what_bends_is_sampled_and_said() {
    let lab = PARAVIEW.replace("\"RGB\"", "\"Lab\"");
    let file = loaded(&lab);
    assert!(file.notices.iter().any(|n| n.contains("sampled")), "{:?}", file.notices);
    assert!((20..500).contains(&file.value.function.points().len()));
    let soft = PARAVIEW.replace("0, 0, 0.5, 0, 0.5, 0.25", "0, 0, 0.3, 0.5, 0.5, 0.25");
    assert!(loaded(&soft).notices.iter().any(|n| n.contains("sampled")));
    let unknown = refused(&PARAVIEW.replace("\"RGB\"", "\"CMYK\""));
    assert!(unknown.contains("ColorSpace") && unknown.contains("CMYK"), "{unknown}");
}

#[test]
fn errors_name_the_place_and_what_was_expected() {
    let cases = [
        (VP.replace("0.9\n", "bright\n"), &["line 3", "diffuse", "bright", "a number"][..]),
        (VP.replace("10 -3024 0", "11 -3024 0"), &["line 7", "11", "multiple of 2"]),
        (VP.replace("10 -3024 0", "12 -3024 0"), &["line 7", "10 numbers", "12 after"]),
        (VP.replace("\n0.1\n", "\n-0.1\n"), &["ambient", "-0.1", "0 to 1000000"]),
        (VP.replace("0.616071", "1.616071"), &["scalar opacity", "point 4", "1.616071", "0 to 1"]),
        (VP.replace("3071 0.827451", "inf 0.827451"), &["line 9", "inf"]),
        (VP_JSON.replace("2.5", "-2.5"), &["scalarOpacityUnitDistance", "-2.5"]),
        (VP_JSON.replace("\"scalarOpacity\":", "\"scalarOpacities\":"), &["scalarOpacity", "a function"]),
        (VP_JSON.replace("[1.0, 0.0, 0.0]", "[1.0, 0.0]"), &["line 11", "column"]),
        (PARAVIEW.replace("[1, 1, 0]", "[1, 1, 0").replace("0.5, 0, 1, 1", "0.5, 1, 1"), &["line"]),
        (
            PARAVIEW.replace("[0, 0, 1, 1, 0.45", "[0, 0, 1, 1, 0.4, 0.45"),
            &["RGBPoints", "21 numbers", "four"],
        ),
        (
            r#"{ "points": [ { "value": 1, "color": [0, 0, 2], "opacity": 0 } ] }"#.into(),
            &["point 0", "color is 2"],
        ),
        (r#"{ "points": [], "unit_distance": 1 }"#.into(), &["at least one point"]),
        (r#"{ "points": [], "unit_distance": 0 }"#.into(), &["unit_distance", "above 0"]),
        ("hello".into(), &["\"hello\"", "expected a transfer function"]),
        (String::new(), &["found nothing"]),
    ];
    for (text, words) in cases {
        let error = refused(&text);
        assert!(words.iter().all(|word| error.contains(word)), "{words:?}: {error}");
    }
}

#[test]
fn numbers_of_points_are_bounded() {
    let point = r#"{"value": 0, "color": [0, 0, 0], "opacity": 0}"#;
    let many = format!("{{\"points\": [{}]}}", vec![point; 1_000_001].join(","));
    assert!(refused(&many).contains("1000000"));
    let many = format!("[{{\"RGBPoints\": [{}]}}]", vec!["0,0,0,0"; 1_000_001].join(","));
    assert!(refused(&many).contains("1000000"));
    assert!(refused(&VP.replace("10 -3024", "999999999998 -3024")).contains("1000000"));
    // Each stretch is few points, all of them are too many.
    let stretches: Vec<String> = (0..400_000).map(|i| format!("{i},{},0,{}", i % 2, (i + 1) % 2)).collect();
    let lab = format!("[{{\"ColorSpace\": \"Lab\", \"RGBPoints\": [{}]}}]", stretches.join(","));
    assert!(refused(&lab).contains("1000000"));
}

/// Whatever is cut off is refused; only a number at the very end of a `.vp` file can be cut unseen, and that is said.
#[test]
fn truncations_are_refused_or_said() {
    let ours = function_text(&loaded(VP).value, FunctionFormat::Cutaway).0;
    for text in [VP_JSON, PARAVIEW, ours.as_str()] {
        for end in 0..text.trim_end().len() {
            assert!(read("a", &text[..end]).is_err(), "{end}");
        }
        assert!(read("a", text).is_ok());
    }
    for end in 0..VP.len() {
        match read("a", &VP[..end]) {
            Ok(file) => {
                assert_eq!(end, VP.len() - 1);
                assert!(file.notices[0].contains("cut off"), "{:?}", file.notices);
            }
            Err(error) => assert!(!error.to_string().contains('\n')),
        }
    }
}

#[test]
fn files_are_recognized_by_content_and_other_files_are_not() {
    let ours = function_text(&loaded(VP).value, FunctionFormat::Cutaway).0;
    let all = [ours.as_str(), PARAVIEW, VP, VP_JSON];
    for ((format, _), text) in FORMATS.iter().zip(all) {
        assert_eq!(recognize_bytes(text.as_bytes()), Some(*format));
        // Damaged ones still are what they were.
        assert_eq!(recognize_bytes(&text.as_bytes()[..text.len() - 4]), Some(*format));
    }
    let others = [
        r#"{ "volume": "a.nrrd", "transfer_function": { "points": [ { "opacity": 1 } ] } }"#,
        r#"{ "kind": "bezier", "points": [[0, 0, 0]], "rows": 1, "columns": 1 }"#,
        r#"{ "asset": { "version": "2.0" }, "points": "no" "#,
        "1\n1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16\n16\n0.0,0.0,0.0\n",
        "NRRD0004\n",
        "",
    ];
    for text in others {
        assert_eq!(recognize_bytes(text.as_bytes()), None, "{text}");
    }
    assert_eq!(recognize(Path::new("/nowhere/at/all.vp")), None);
}

#[test]
fn names_say_the_format_to_write() {
    let folder = tempfile::tempdir().unwrap();
    let file = loaded(VP).value;
    for (format, name) in FORMATS {
        let path = folder.path().join(name.to_uppercase());
        let notices = write_transfer_function(&path, &file).unwrap();
        assert_eq!(recognize(&path), Some(format));
        let holds_light = matches!(format, FunctionFormat::Slicer | FunctionFormat::SlicerJson);
        assert_eq!(notices.is_empty(), holds_light, "{notices:?}");
        let again = read_transfer_function(&path).unwrap().value;
        assert_eq!((again.function, again.unit_distance), (file.function.clone(), Some(1.0)));
        assert_eq!(again.lighting.is_some(), holds_light);
    }
    let error = write_transfer_function(&folder.path().join("a.txt"), &file).unwrap_err();
    assert!(matches!(error, FunctionWriteError::Extension { .. }) && error.to_string().contains(".vp.json"));
    assert!(!folder.path().join("a.txt").exists());
}

fn point() -> impl Strategy<Value = ControlPoint> {
    let value = prop_oneof![-1000..1000i32, 0..4].prop_map(f64::from);
    (value, [0.0..=1.0, 0.0..=1.0, 0.0..=1.0], prop_oneof![Just(0.0), Just(1.0), 0.0..=1.0])
        .prop_map(|(value, color, opacity)| ControlPoint { value, color, opacity })
}

/// Functions with steps, some of three and more points.
fn function() -> impl Strategy<Value = TransferFunction> {
    prop::collection::vec(point(), 1..20).prop_map(|mut points| {
        points.sort_by(|a, b| a.value.total_cmp(&b.value));
        TransferFunction::new(points).unwrap()
    })
}

fn file() -> impl Strategy<Value = FunctionFile> {
    let factors = [0.0..=1.0, 0.0..=1.0, 0.0..=2.0, 0.0..=100.0];
    let light = (any::<bool>(), factors).prop_map(|(shade, [ambient, diffuse, specular, specular_power])| {
        Lighting { shade, ambient, diffuse, specular, specular_power, ..Lighting::default() }
    });
    (function(), prop::option::of(0.01..100.0), prop::option::of(light)).prop_map(
        |(function, unit_distance, lighting)| FunctionFile {
            lighting,
            ..FunctionFile::new(function, unit_distance)
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_comes_back_point_by_point(file in file()) {
        for (format, name) in FORMATS {
            if format == FunctionFormat::Slicer {
                continue;
            }
            let again = read(name, &function_text(&file, format).0).unwrap();
            prop_assert!(again.notices.is_empty(), "{:?}", again.notices);
            prop_assert_eq!(&again.value.function, &file.function);
            if format == FunctionFormat::SlicerJson {
                prop_assert_eq!(again.value.unit_distance, Some(file.unit_distance.unwrap_or(1.0)));
                prop_assert_eq!(again.value.lighting, Some(file.lighting.clone().unwrap_or_default()));
            } else {
                prop_assert_eq!(again.value.unit_distance, file.unit_distance);
            }
        }
    }

    /// `.vp` files have no unit but the millimetre: points stay where they are, and are as dense as they were.
    #[test]
    fn slicers_text_keeps_the_extinction_of_every_point(file in file()) {
        let again = read("a.vp", &function_text(&file, FunctionFormat::Slicer).0).unwrap().value;
        prop_assert_eq!(again.function.points().len(), file.function.points().len());
        for (a, b) in again.function.points().iter().zip(file.function.points()) {
            prop_assert_eq!((a.value, a.color), (b.value, b.color));
            let unit = file.unit_distance.unwrap_or(1.0);
            // An opacity near 1 has few digits left that tell its extinction.
            let (found, expected) = (extinction(a.opacity, 1.0), extinction(b.opacity, unit));
            let clamped = (1.0 - a.opacity).min(1.0 - b.opacity) < 1e-6;
            prop_assert!(clamped || (found - expected).abs() < 1e-6 * (1.0 + expected), "{found} {expected}");
        }
    }

    #[test]
    fn nothing_that_is_damaged_breaks_a_reader(
        which in 0..4usize, at in any::<prop::sample::Index>(), byte in any::<u8>(), cut in any::<prop::sample::Index>()
    ) {
        let ours = function_text(&loaded(VP).value, FunctionFormat::Cutaway).0;
        let mut bytes = [VP, VP_JSON, PARAVIEW, ours.as_str()][which].as_bytes().to_vec();
        let index = at.index(bytes.len());
        bytes[index] = byte;
        for bytes in [&bytes[..], &bytes[..cut.index(bytes.len())]] {
            match read_transfer_function_bytes("a", bytes) {
                Ok(file) => prop_assert!(!file.value.function.points().is_empty()),
                Err(error) => prop_assert!(!error.to_string().chars().any(char::is_control)),
            }
        }
    }
}
