//! Files that were refused or read wrongly, each with what it holds.

use std::io::Write;

use cutaway_core::volume::Volume;
use cutaway_io::transfer_function::{
    read_color_map_bytes, read_transfer_function, read_transfer_function_bytes,
};
use cutaway_io::volume::{Loaded, MemoryFolder, ReadError, ReadOptions, read_volume_bytes};
use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn open(
    name: &str,
    bytes: &[u8],
    folder: &MemoryFolder,
    index: Option<usize>,
) -> Result<Loaded<Volume>, ReadError> {
    let options = ReadOptions { volume_index: index, ..ReadOptions::default() };
    read_volume_bytes(name, bytes, folder, &options)
}

fn alone(name: &str, bytes: &[u8]) -> Result<Loaded<Volume>, ReadError> {
    open(name, bytes, &MemoryFolder::new(), None)
}

fn refused(name: &str, bytes: &[u8]) -> String {
    alone(name, bytes).map(|_| ()).unwrap_err().to_string()
}

/// The lines of a NRRD header of 3 x 4 x 5 bytes that count up, and the data.
fn nrrd(lines: &str) -> Vec<u8> {
    let header = format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 4 5\nencoding: raw\n{lines}\n");
    [header.into_bytes(), (0..60).collect()].concat()
}

#[test]
fn report_01_units_of_nrrd_become_millimetres() {
    let written = [
        ("um", 500.0),
        ("\u{b5}m", 500.0),
        ("microns", 500.0),
        ("nm", 5e5),
        ("cm", 0.05),
        ("m", 5e-4),
        ("mm", 0.5),
        ("inches", 0.5 / 25.4),
    ];
    for (unit, size) in written {
        let [x, y, z] = [1.0, 2.0, 3.0].map(|n| n * size);
        for (space, sign) in
            [("right-anterior-superior", 1.0), ("left-posterior-superior", -1.0), ("scanner-xyz", 1.0)]
        {
            let file = nrrd(&format!(
                "space: {space}\nspace directions: ({x},0,0) (0,{y},0) (0,0,{z})\nspace origin: ({},0,0)\n\
                 space units: \"{unit}\" \"{unit}\" \"{unit}\"\n",
                10.0 * size
            ));
            let loaded = alone("a.nrrd", &file).unwrap();
            let spacing = loaded.value.spacing();
            assert!(
                (spacing - cutaway_core::glam::DVec3::new(0.5, 1.0, 1.5)).length() < 1e-12,
                "{unit}: {spacing}"
            );
            assert!((loaded.value.world_from_voxel().translation.x - sign * 5.0).abs() < 1e-12, "{unit}");
            assert_eq!(loaded.notices, Vec::<String>::new(), "{unit}");
        }
        // Without directions each axis has its own unit.
        let file = nrrd(&format!(
            "spacings: {x} {y} {z}\naxis mins: {x} 0 0\nunits: \"{unit}\" \"{unit}\" \"{unit}\"\n"
        ));
        let loaded = alone("a.nrrd", &file).unwrap();
        assert!((loaded.value.spacing().z - 1.5).abs() < 1e-12, "{unit}");
        assert!((loaded.value.world_from_voxel().translation.x - 0.75).abs() < 1e-12, "{unit}");
    }
    // Units may differ from axis to axis, and those that are none are said.
    let mixed = nrrd(
        "space: ras\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace units: \"cm\" \"mm\" \"furlong\"\n",
    );
    let loaded = alone("a.nrrd", &mixed).unwrap();
    assert_eq!(loaded.value.spacing().to_array(), [10.0, 1.0, 1.0]);
    assert_eq!(loaded.notices, ["`space units` has \"furlong\": lengths are used as they are"]);
}

#[test]
fn report_02_a_file_of_that_very_name_is_no_pattern() {
    let data: Vec<u8> = (0..24).collect();
    for name in ["dose 50%.raw", "left%20lung.raw", "scan%d.raw", "100%", "%%.raw", "a%03d.raw"] {
        let header =
            format!("NDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nElementDataFile = {name}\n");
        let folder = MemoryFolder::from([(name.to_owned(), data.clone())]);
        let volume = open("a.mhd", header.as_bytes(), &folder, None).unwrap().value;
        assert_eq!(volume.value_range(), [0.0, 23.0], "{name}");
        let header =
            format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: raw\ndata file: {name}\n");
        let volume = open("a.nhdr", header.as_bytes(), &folder, None).unwrap().value;
        assert_eq!(volume.value_range(), [0.0, 23.0], "{name}");
    }
    // A missing file is missed by its name.
    let header = "NDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nElementDataFile = dose 50%.raw\n";
    assert!(refused("a.mhd", header.as_bytes()).contains("cannot open dose 50%.raw"));
    // A pattern with a range stays one; so does a file that is called like pattern and range.
    let folder = MemoryFolder::from([
        ("s1.raw".to_owned(), data[..12].to_vec()),
        ("s2.raw".to_owned(), data[12..].to_vec()),
    ]);
    let header = header.replace("dose 50%.raw", "s%d.raw 1 2 1");
    assert_eq!(open("a.mhd", header.as_bytes(), &folder, None).unwrap().value.value_range(), [0.0, 23.0]);
    let folder = MemoryFolder::from([("s%d.raw 1 2 1".to_owned(), data.clone())]);
    assert_eq!(open("a.mhd", header.as_bytes(), &folder, None).unwrap().value.value_range(), [0.0, 23.0]);
}

/// One volume of every order of its axes and of a list and a vector among them.
#[test]
fn report_03_further_axes_anywhere() {
    let sizes = [4usize, 3, 5, 2, 3];
    let words = [
        ("domain", "(1,0,0)"),
        ("domain", "(0,2,0)"),
        ("domain", "(0,0,3)"),
        ("list", "none"),
        ("vector", "none"),
    ];
    let sample = |at: [usize; 5]| (at[0] + 4 * at[1] + 12 * at[2] + 60 * at[3] + 120 * at[4]) as i16;
    let mut orders = 0;
    for code in 0..3125usize {
        let order: Vec<usize> = (0..5).map(|k| code / 5usize.pow(k) % 5).collect();
        if (0..5).any(|axis| !order.contains(&axis)) {
            continue;
        }
        orders += 1;
        // Samples in the order of the file, its first axis fastest.
        let mut data = Vec::new();
        for index in 0..360 {
            let (mut rest, mut at) = (index, [0; 5]);
            for axis in &order {
                at[*axis] = rest % sizes[*axis];
                rest /= sizes[*axis];
            }
            data.extend_from_slice(&sample(at).to_le_bytes());
        }
        let list =
            |text: &dyn Fn(usize) -> String| order.iter().map(|axis| text(*axis) + " ").collect::<String>();
        let header = format!(
            "NRRD0004\ntype: int16\ndimension: 5\nsizes: {}\nspace: ras\nkinds: {}\nspace directions: {}\nendian: little\nencoding: raw\n\n",
            list(&|axis| sizes[axis].to_string()),
            list(&|axis| words[axis].0.to_owned()),
            list(&|axis| words[axis].1.to_owned())
        );
        let file = [header.as_bytes(), &data].concat();
        for (list_at, vector_at) in [(0, 0), (1, 2)] {
            // The index counts the further axes in the order of the file.
            let (list, vector) = (order.iter().position(|a| *a == 3), order.iter().position(|a| *a == 4));
            let index = if list < vector { list_at + 2 * vector_at } else { vector_at + 3 * list_at };
            let volume = open("a.nrrd", &file, &MemoryFolder::new(), Some(index)).unwrap().value;
            let voxel_from_world = volume.voxel_from_world();
            for (x, y, z) in [(0, 0, 0), (3, 0, 1), (1, 2, 4), (3, 2, 4)] {
                let place = cutaway_core::glam::DVec3::new(x as f64, 2.0 * y as f64, 3.0 * z as f64);
                let [i, j, k] = voxel_from_world.transform_point3(place).round().to_array().map(|n| n as i64);
                let expected = f64::from(sample([x, y, z, list_at, vector_at]));
                assert_eq!(volume.value_clamped(i, j, k), expected, "{order:?} {x} {y} {z}");
            }
        }
        let error = open("a.nrrd", &file, &MemoryFolder::new(), Some(6)).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("there is no volume 6: the file holds 6"), "{error}");
    }
    assert_eq!(orders, 120);
}

/// Also where the data lie in several files, and are compressed.
#[test]
fn report_03_lists_between_in_parts() {
    let data: Vec<u8> = (0..48).collect();
    let header = "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 2 3 2 4\nkinds: domain list domain domain\n";
    let expected = |x: u8, y: u8, z: u8| f64::from(x + 2 + 6 * y + 12 * z);
    let folder = MemoryFolder::from([
        ("a.raw".to_owned(), gzip(&data[..24])),
        ("b.raw".to_owned(), gzip(&data[24..])),
    ]);
    let split = format!("{header}encoding: gzip\ndata file: LIST 4\na.raw\nb.raw\n");
    let whole = [format!("{header}encoding: gzip\n\n").into_bytes(), gzip(&data)].concat();
    for (name, file) in [("a.nhdr", split.into_bytes()), ("a.nrrd", whole)] {
        let volume = open(name, &file, &folder, Some(1)).unwrap().value;
        assert_eq!(volume.dimensions().to_array(), [2, 2, 4]);
        for (x, y, z) in [(0, 0, 0), (1, 0, 0), (0, 1, 3), (1, 1, 2)] {
            assert_eq!(volume.value_clamped(x.into(), y.into(), z.into()), expected(x, y, z), "{name}");
        }
    }
}

fn nifti_sized(dim: [i16; 8], intent: i16, data: &[u8]) -> Vec<u8> {
    let mut header = vec![0; 352];
    header[..4].copy_from_slice(&348i32.to_le_bytes());
    let shorts = |header: &mut Vec<u8>, at: usize, values: &[i16]| {
        for (k, value) in values.iter().enumerate() {
            header[at + 2 * k..at + 2 * k + 2].copy_from_slice(&value.to_le_bytes());
        }
    };
    shorts(&mut header, 40, &dim);
    shorts(&mut header, 68, &[intent, 2, 8]);
    for k in 0..8 {
        header[76 + 4 * k..80 + 4 * k].copy_from_slice(&1f32.to_le_bytes());
    }
    header[108..112].copy_from_slice(&352f32.to_le_bytes());
    header[344..348].copy_from_slice(b"n+1\0");
    [&header[..], data].concat()
}

#[test]
fn report_13_bytes_after_compressed_data_are_said() {
    let data: Vec<u8> = (0..60).collect();
    let junk = b"these are not the voxels";
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 3 4 5\nElementType = MET_UCHAR\n";
    let nii = gzip(&nifti_sized([3, 3, 4, 5, 1, 1, 1, 1], 0, &data));
    let nrrd = [&b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 4 5\nencoding: gzip\n\n"[..], &gzip(&data)]
        .concat();
    let mha = [header.as_bytes(), b"CompressedData = True\nElementDataFile = LOCAL\n", &zlib(&data)].concat();
    for (name, whole, kind) in [("a.nii.gz", nii, "gzip"), ("a.nrrd", nrrd, "gzip"), ("a.mha", mha, "zlib")] {
        let read = |tail: &[u8]| {
            let loaded = alone(name, &[&whole[..], tail].concat()).unwrap();
            assert_eq!(loaded.value.value_range(), [0.0, 59.0]);
            loaded.notices
        };
        assert_eq!(read(b""), Vec::<String>::new(), "{name}");
        assert_eq!(read(&[0; 512]), Vec::<String>::new(), "{name}");
        assert_eq!(read(junk), [format!("{name} goes on after its {kind} data: the rest ignored")]);
        assert_eq!(read(b"\x1f is not gzip").len(), 1, "{name}");
    }
    // A data file of its own; another member goes on with the data.
    let header = format!("{header}ElementDataFile = v.raw.gz\n");
    let read = |file: Vec<u8>| {
        let folder = MemoryFolder::from([("v.raw.gz".to_owned(), file)]);
        open("a.mhd", header.as_bytes(), &folder, None).unwrap().notices
    };
    assert_eq!(
        read([gzip(&data), junk.to_vec()].concat()),
        ["v.raw.gz goes on after its gzip data: the rest ignored"]
    );
    assert_eq!(read([gzip(&data[..20]), gzip(&data[20..])].concat()), Vec::<String>::new());
}

#[test]
fn report_83_lists_longer_than_the_axes() {
    let data: Vec<u8> = (0..24).collect();
    let mha = |lines: &str| {
        [
            format!("ObjectType = Image\n{lines}ElementType = MET_UCHAR\nElementDataFile = LOCAL\n")
                .into_bytes(),
            data.clone(),
        ]
        .concat()
    };
    let loaded =
        alone("a.mha", &mha("NDims = 2\nDimSize = 4 6\nElementSpacing = 1 2 3\nOffset = 4 5 6\n")).unwrap();
    assert_eq!(loaded.value.dimensions().to_array(), [4, 6, 1]);
    assert_eq!(loaded.value.spacing().to_array()[..2], [1.0, 2.0]);
    assert_eq!(loaded.notices[0], "`ElementSpacing` has 3 numbers for 2 axes: the first 2 are used");
    assert_eq!(loaded.notices.len(), 2);
    for (spacing, offset) in
        [("ElementSpacing", "Offset"), ("ElementSize", "Position"), ("ElementSpacing", "Origin")]
    {
        let lines = format!(
            "NDims = 3\nDimSize = 4 3 2\n{spacing} = 1 2 3 1\n{offset} = 4 5 6 0\nCenterOfRotation = 0 0 0 0\n"
        );
        let loaded = alone("a.mha", &mha(&lines)).unwrap();
        assert_eq!(loaded.value.spacing().to_array(), [1.0, 2.0, 3.0]);
        assert_eq!(loaded.value.world_from_voxel().translation.to_array(), [-4.0, -5.0, 6.0]);
        assert_eq!((loaded.value.value_range(), loaded.notices.len()), ([0.0, 23.0], 2));
    }
    // Fewer numbers, more sizes and more rows stay wrong.
    assert!(
        refused("a.mha", &mha("NDims = 3\nDimSize = 4 3 2\nElementSpacing = 1 2\n"))
            .contains("expected 3 distances")
    );
    assert!(refused("a.mha", &mha("NDims = 3\nDimSize = 4 3 2 1\n")).contains("`DimSize`"));
    let matrix = "NDims = 3\nDimSize = 4 3 2\nTransformMatrix = 1 0 0 0 1 0 0 0 1 0\n";
    assert!(refused("a.mha", &mha(matrix)).contains("`TransformMatrix`"));
}

/// Whole numbers may be written `8.0`, as other readers take them.
#[test]
fn headers_are_forgiven_the_form_of_their_numbers() {
    let data: Vec<u8> = (0..24).collect();
    let mha = "ObjectType = Image\nNDims = 3.0\nDimSize = 4.0 3 2e0\nElementNumberOfChannels = 1.0\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let nrrd = "NRRD0004\ntype: uint8\ndimension: 3.0\nsizes: 4.0 3.0 2.0\nspace: RAS\nspace directions: (1 0 0) (0, 1, 0) (0 0,1)\nencoding: raw\n\n";
    for (name, header) in [("a.mha", mha), ("a.nrrd", nrrd)] {
        let volume = alone(name, &[header.as_bytes(), &data].concat()).unwrap().value;
        assert_eq!(
            (volume.dimensions().to_array(), volume.value_range()),
            ([4, 3, 2], [0.0, 23.0]),
            "{name}"
        );
        assert!(alone(name, &[header.replace("4.0", "4.5").as_bytes(), &data].concat()).is_err());
    }
}

const RAMP: &str = "{\"Name\": \"ramp\", \"ColorSpace\": \"RGB\", \"RGBPoints\": [0, 0, 0, 0, 1, 1, 1, 1], \"Points\": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}";

#[test]
fn report_84_colour_maps_as_paraview_ships_them() {
    let plain = read_transfer_function_bytes("f", format!("[\n{RAMP}\n]\n").as_bytes()).unwrap();
    assert_eq!(plain.value.function.points().len(), 2);
    for text in [
        format!("[\n{RAMP},\n]\n"),
        format!("// edited by hand\n[\n{RAMP}\n]\n"),
        format!("/* edited\nby hand */ [ {} ]", RAMP.replace("1]}", "1, /* last */ ], }")),
    ] {
        let read = read_transfer_function_bytes("f", text.as_bytes()).unwrap();
        assert_eq!((read.value, read.notices), (plain.value.clone(), plain.notices.clone()), "{text}");
    }
    // A place in the file is that of the file.
    let error = read_transfer_function_bytes("f", format!("// a\n[{RAMP},\n\"RGBPoints\"]").as_bytes());
    assert!(error.unwrap_err().to_string().contains("line 3"));
}

#[test]
fn report_84_maps_are_chosen_by_name() {
    let maps: Vec<String> = (0..191)
        .map(|k| {
            RAMP.replace("ramp", &format!("Map {k}"))
                .replace("[0, 0, 0, 0, 1", &format!("[{k}, 0, 0, 0, 200"))
        })
        .collect();
    let text = format!("[{{\"Name\": \"labels\", \"IndexedColors\": [0, 0, 0]}},\n{},\n]", maps.join(",\n"));
    let first = read_transfer_function_bytes("maps.json", text.as_bytes()).unwrap();
    assert_eq!(first.value.name.as_deref(), Some("Map 0"));
    assert!(first.notices[0].contains("192 colour maps") && first.notices[0].contains("a colon and a name"));
    for (name, expected) in [("Map 7", 7.0), ("map 190", 190.0)] {
        let read = read_color_map_bytes("maps.json", text.as_bytes(), name).unwrap();
        assert!(read.value.function.points().iter().any(|point| point.value == expected));
        assert!(read.value.name.unwrap().eq_ignore_ascii_case(name));
    }
    let error = read_color_map_bytes("maps.json", text.as_bytes(), "Viridis").unwrap_err().to_string();
    assert!(
        error.contains("no colour map \"Viridis\"") && error.contains("\"Map 11\" and 179 more"),
        "{error}"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("maps.json");
    std::fs::write(&path, &text).unwrap();
    let named = folder.path().join("maps.json:Map 100");
    assert_eq!(read_transfer_function(&named).unwrap().value.name.as_deref(), Some("Map 100"));
    assert!(cutaway_io::transfer_function::recognize(&named).is_some());
    let error = read_transfer_function(&folder.path().join("no.json:x")).unwrap_err().to_string();
    assert!(error.contains("no.json:x"), "{error}");
}

#[test]
fn report_87_nifti_that_is_no_volume() {
    let scalars = |intent| nifti_sized([6, 1, 1, 1, 1, 5, 4, 1], intent, &(0..20).collect::<Vec<u8>>());
    for (intent, says) in [
        (3000, "CIFTI"),
        (3006, "CIFTI"),
        (3099, "CIFTI"),
        (1008, "points of a surface"),
        (1009, "triangles"),
    ] {
        let error = refused("a.nii", &scalars(intent));
        assert!(error.contains(&format!("the intent code is {intent}")) && error.contains(says), "{error}");
    }
    // The second version, big-endian.
    let mut second = vec![0u8; 544];
    second[..4].copy_from_slice(&540i32.to_be_bytes());
    second[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
    second[504..508].copy_from_slice(&3002i32.to_be_bytes());
    assert!(refused("a.dtseries.nii", &second).contains("CIFTI"));
    // Vectors are components, as in other formats.
    let vectors = |intent| nifti_sized([5, 2, 2, 2, 1, 3, 1, 1], intent, &(0..24).collect::<Vec<u8>>());
    for intent in [1006, 1007] {
        let error = refused("a.nii", &vectors(intent));
        assert!(error.contains("per voxel") && error.contains("volume index"), "{error}");
        let chosen = open("a.nii", &vectors(intent), &MemoryFolder::new(), Some(2)).unwrap();
        assert_eq!(chosen.value.value_range(), [16.0, 23.0]);
    }
    // Statistics and estimates are numbers.
    assert!(alone("a.nii", &vectors(5)).is_ok());
}

#[test]
fn report_b6_broken_spacings_are_said() {
    let says = |lines: &str| alone("a.nrrd", &nrrd(lines)).unwrap().notices.join("; ");
    assert_eq!(says("spacings: nan 1 1\n"), "`spacings` of axis 0 is NaN: 1 is used");
    assert_eq!(says("spacings: 1 1 inf\n"), "`spacings` of axis 2 is inf: 1 is used");
    assert_eq!(says("spacings: 1 1 1\naxis mins: nan 0 0\n"), "`axis mins` of axis 0 is NaN: 0 is used");
    let origin = "space: ras\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (nan,nan,nan)\n";
    assert_eq!(says(origin), "`space origin` is not a number: 0 is used");
}

#[test]
fn report_b6_broken_qforms_are_said() {
    let with = |bcd: [f32; 3]| {
        let mut file = nifti_sized([3, 3, 4, 5, 1, 1, 1, 1], 0, &(0..60).collect::<Vec<u8>>());
        file[252] = 1;
        for (k, value) in bcd.iter().enumerate() {
            file[256 + 4 * k..260 + 4 * k].copy_from_slice(&value.to_le_bytes());
        }
        alone("a.nii", &file).unwrap().notices
    };
    assert_eq!(with([0.0, 0.0, 1.0]), Vec::<String>::new());
    assert_eq!(with([0.6, 0.0, 0.8]), Vec::<String>::new());
    assert_eq!(with([f32::NAN, 0.0, 0.0]), ["the qform is singular or not finite: it is ignored"]);
    assert_eq!(with([f32::INFINITY, 0.0, 0.0]).len(), 1);
    let long = with([1.0, 1.0, 1.0]);
    assert!(long.len() == 1 && long[0].contains("squares that sum to 3, more than 1"), "{long:?}");
}

#[test]
fn report_b6_raw_voxels_must_fit_when_compressed_too() {
    for surplus in [1, 1000] {
        let file = gzip(&vec![7; 27 + surplus]);
        let error = refused("a_3x3x3_uint8.raw.gz", &file);
        assert!(error.contains("more than 27 bytes") && error.contains("correct the dimensions"), "{error}");
    }
    assert!(refused("a_3x3x3_uint8.raw.gz", &gzip(&[7; 26])).contains("found 26 bytes"));
    assert!(alone("a_3x3x3_uint8.raw.gz", &gzip(&[7; 27])).is_ok());
}

#[test]
fn report_b6_limits_and_numbers_are_true() {
    let nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 1000000000\nencoding: raw\ndata file: s%d.raw 1 1000000000 1\n";
    let error = refused("a.nhdr", nrrd.as_bytes());
    assert!(error.contains("at most 1048576 files"), "{error}");
    let mhd = "NDims = 3\nDimSize = 1 1 1000000000\nElementType = MET_UCHAR\nElementDataFile = s%d.raw 1 1000000000 1\n";
    let error = refused("a.mhd", mhd.as_bytes());
    assert!(error.contains("at most 1048576 files"), "{error}");
    let large = refused(
        "a.nrrd",
        b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 100000 100000 100000\nencoding: raw\n\n",
    );
    assert!(large.contains("more than the limit") && !large.contains("raise the memory limit"), "{large}");
    let unit = RAMP.replace("\"ColorSpace\"", "\"ScalarOpacityUnitDistance\": 1e-300, \"ColorSpace\"");
    let error = read_transfer_function_bytes("f", unit.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("found 1e-300,"), "{error}");
    let folder = MemoryFolder::from([(
        "a.json".to_owned(),
        b"{\"dims\": [\"a\", 2, 2], \"type\": \"uint8\"}".to_vec(),
    )]);
    let error = open("a.raw", &[0; 8], &folder, None).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("found the text \"a\", expected a whole number of at least 0"), "{error}");
}

/// As many points as in a scene file.
#[test]
fn report_b6_a_million_points() {
    let points = |count: usize| {
        let list: Vec<String> =
            (0..count).map(|k| format!("{{\"value\":{k},\"color\":[0,0,0],\"opacity\":0}}")).collect();
        format!("{{\"points\":[{}]}}", list.join(","))
    };
    for count in [65_537, 1_000_000] {
        let read = read_transfer_function_bytes("f", points(count).as_bytes()).unwrap();
        assert_eq!(read.value.function.points().len(), count);
    }
    let error = read_transfer_function_bytes("f", points(1_000_001).as_bytes()).unwrap_err().to_string();
    assert!(error.contains("more than 1000000 points"), "{error}");
}

/// What SimpleITK, Teem or nibabel read, too.
#[test]
fn headers_as_other_readers_take_them() {
    let data: Vec<u8> = (0..24).collect();
    let mha = "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementSpacing = 1 2 3\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let twice = mha.replace("NDims = 3\n", "NDims = 3\nNDims = 3\n");
    for header in [
        mha.replace("MET_UCHAR", "MET_UCHAR_ARRAY"),
        mha.replace("NDims", "a word that is no key\nNDims"),
        mha.replace("NDims = 3", "NDims = 5").replace("4 3 2", "4 3 2 1 1").replace("1 2 3", "1 2 3 1 1"),
        mha.replace("DimSize = ", "DimSize\t=\t"),
        twice.clone(),
    ] {
        let volume = alone("a.mha", &[header.as_bytes(), &data].concat()).unwrap().value;
        assert_eq!(
            (volume.spacing().to_array(), volume.value_range()),
            ([1.0, 2.0, 3.0], [0.0, 23.0]),
            "{header}"
        );
    }
    assert!(
        refused("a.mha", twice.replacen("NDims = 3", "NDims = 2", 1).as_bytes()).contains("a second time")
    );
    let nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nspacings: 1 2 3\nencoding: raw\n\n";
    for header in [
        nrrd.replace("4 3 2", "4, 3, 2"),
        nrrd.replace("NRRD0004", "NRRD00.01"),
        nrrd.replace(
            "spacings: 1 2 3",
            "space dimension: 3\nspace directions: (1,0,0)(0,2,0)(0,0,3)\nspace origin: none",
        ),
        nrrd.replace("uint8", "UINT8").replace("raw", "RAW"),
    ] {
        let volume = alone("a.nrrd", &[header.as_bytes(), &data].concat()).unwrap().value;
        assert_eq!(
            (volume.spacing().to_array(), volume.value_range()),
            ([1.0, 2.0, 3.0], [0.0, 23.0]),
            "{header}"
        );
    }
    let mut nifti = nifti_sized([3, 4, 3, 2, 1, 1, 1, 1], 0, &data);
    nifti[..4].copy_from_slice(&[0; 4]);
    assert_eq!(alone("a.nii", &nifti).unwrap().value.value_range(), [0.0, 23.0]);
    nifti[108..112].copy_from_slice(&352.5f32.to_le_bytes());
    let loaded = alone("a.nii", &nifti).unwrap();
    assert_eq!(
        (loaded.value.value_range(), loaded.notices),
        ([0.0, 23.0], vec!["vox_offset is 352.5: 352 is used".to_owned()])
    );
}
