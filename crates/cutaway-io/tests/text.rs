//! Text is read alike whatever editor saved it: with a byte order mark, with any of the three ends of lines; UTF-16 is
//! refused by name. One test for each format of volumes, grids, transfer functions, patches and scenes.

use cutaway_io::patches;
use cutaway_io::scene_file::read_scene;
use cutaway_io::tetrahedra::{TetrahedraReadOptions, read_tetrahedra_bytes};
use cutaway_io::transfer_function::read_transfer_function_bytes;
use cutaway_io::volume::{MemoryFolder, ReadOptions, read_volume_bytes};

/// Reads a text and gives what is in it, in a form that can be compared, or the message.
type Read = dyn Fn(&[u8]) -> Result<String, String>;

const MARK: &[u8] = b"\xef\xbb\xbf";

/// Whether a format may have its lines ended in any way (JSON and XML do anyway).
fn check(text: &str, read: &Read) {
    let plain = read(text.as_bytes()).expect("the plain text is read");
    for ending in ["\n", "\r\n", "\r"] {
        let ended = text.replace('\n', ending);
        for mark in [&b""[..], MARK] {
            let found = read(&[mark, ended.as_bytes()].concat());
            assert_eq!(found.as_ref(), Ok(&plain), "{mark:?} {ending:?}");
        }
    }
    for big in [false, true] {
        let order = |unit: u16| if big { unit.to_be_bytes() } else { unit.to_le_bytes() };
        let wide: Vec<u8> = "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(order).collect();
        let error = read(&wide).expect_err("UTF-16 is not read");
        assert!(error.contains("UTF-16") && error.contains("save it as UTF-8"), "{error}");
    }
}

fn volume(name: &'static str) -> impl Fn(&[u8]) -> Result<String, String> {
    move |bytes| {
        let folder = MemoryFolder::from([("data.raw".to_owned(), (0..210).collect())]);
        let loaded = read_volume_bytes(name, bytes, &folder, &ReadOptions::default());
        let volume = loaded.map_err(|error| error.to_string())?.value;
        Ok(format!("{:?} {:?} {}", volume.dimensions(), volume.value_range(), volume.value_clamped(1, 2, 3)))
    }
}

#[test]
fn report_64_81_detached_nrrd() {
    check(
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 7 6 5\nencoding: raw\ndata file: data.raw\n",
        &volume("volume.nhdr"),
    );
    check(
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 7 6 5\nencoding: raw\ndata file: LIST\ndata.raw\n"
            .replace("LIST", "LIST 3")
            .as_str(),
        &volume("volume.nhdr"),
    );
}

#[test]
fn report_64_81_metaimage() {
    let text = "NDims = 3\nDimSize = 7 6 5\nElementType = MET_UCHAR\nElementDataFile = data.raw\n";
    check(text, &volume("volume.mhd"));
    check(&format!("ObjectType = Image\n{text}"), &volume("no extension"));
}

/// Behind a header whose lines end in a carriage return, the first byte of the data may be a line feed.
#[test]
fn data_behind_a_header_keep_bytes_that_look_like_ends_of_lines() {
    for ending in ["\n", "\r\n", "\r"] {
        for first in [b'\n', b'\r'] {
            let nrrd =
                "NRRD0001\ntype: uint8\ndimension: 1\nsizes: 3\nencoding: raw\n\n".replace('\n', ending);
            let meta = "NDims = 2\nDimSize = 3 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
                .replace('\n', ending);
            for (name, header) in [("a.nrrd", nrrd), ("a.mha", meta)] {
                for mark in [&b""[..], MARK] {
                    let file = [mark, header.as_bytes(), &[first, b'\n', 7]].concat();
                    let read = read_volume_bytes(name, &file, &MemoryFolder::new(), &ReadOptions::default());
                    let volume = read.unwrap().value;
                    let values = [0, 1, 2].map(|x| volume.value_clamped(x, 0, 0));
                    assert_eq!(values, [f64::from(first), 10.0, 7.0], "{name} {ending:?} {first}");
                }
            }
        }
    }
}

#[test]
fn report_64_81_descriptions_of_raw_voxels() {
    check("{\"dims\": [7, 6, 5],\n \"type\": \"uint8\"}\n", &|json| {
        let folder = MemoryFolder::from([("described.json".to_owned(), json.to_vec())]);
        let data: Vec<u8> = (0..210).collect();
        let read = read_volume_bytes("described.raw", &data, &folder, &ReadOptions::default());
        Ok(format!("{:?}", read.map_err(|error| error.to_string())?.value.value_range()))
    });
}

const GRID: &str = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n\
    0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\nSCALARS v float\n\
    LOOKUP_TABLE default\n1 2\n3\n4\nMETADATA\nINFORMATION 0\n\nSCALARS w float 1\nLOOKUP_TABLE default\n1 2 3 4\n";

fn grid(bytes: &[u8]) -> Result<String, String> {
    let read = read_tetrahedra_bytes("grid", bytes, &TetrahedraReadOptions::default());
    let mesh = read.map_err(|error| error.to_string())?.value;
    Ok(format!("{:?} {:?} {:?}", mesh.points(), mesh.cells(), mesh.values()))
}

#[test]
fn report_64_81_unstructured_grids() {
    check(GRID, &grid);
    check(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\">\n<UnstructuredGrid>\n\
         <Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\n\
         <Points><DataArray type=\"Float32\">0 0 0\n1 0 0 0 1 0 0 0 1</DataArray></Points>\n\
         <Cells><DataArray type=\"Int32\" Name=\"connectivity\">0 1 2 3</DataArray>\n\
         <DataArray type=\"Int32\" Name=\"offsets\">4</DataArray>\n\
         <DataArray type=\"UInt8\" Name=\"types\">10</DataArray></Cells>\n\
         <PointData><DataArray type=\"Float32\" Name=\"v\">1\n2\n3\n4</DataArray></PointData>\n\
         </Piece></UnstructuredGrid></VTKFile>\n",
        &grid,
    );
}

/// The line end of a binary legacy file is what its first line has, too.
#[test]
fn binary_grids_behind_any_end_of_lines() {
    let mut text = Vec::new();
    for ending in ["\n", "\r\n", "\r"] {
        let lines = |lines: &str| lines.replace('\n', ending).into_bytes();
        text.clear();
        text.extend(lines(
            "# vtk DataFile Version 3.0\ntitle\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n",
        ));
        let points = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        text.extend(points.iter().flat_map(|c| c.to_be_bytes()));
        text.extend(lines("\nCELLS 1 5\n"));
        text.extend([4, 0, 1, 2, 3].iter().flat_map(|c: &i32| c.to_be_bytes()));
        text.extend(lines("\nCELL_TYPES 1\n"));
        text.extend(10i32.to_be_bytes());
        text.extend(lines("\nPOINT_DATA 4\nSCALARS v unsigned_char\nLOOKUP_TABLE default\n"));
        // A line feed and a carriage return are values here.
        text.extend([10, 13, 10, 1]);
        let read = read_tetrahedra_bytes("grid", &text, &TetrahedraReadOptions::default()).unwrap();
        assert_eq!(read.value.values(), [10.0, 13.0, 10.0, 1.0], "{ending:?}");
    }
}

#[test]
fn report_64_81_transfer_functions() {
    let ours = "{\"points\": [{\"value\": 0, \"color\": [0, 0, 0], \"opacity\": 0},\n\
                {\"value\": 1, \"color\": [1, 1, 1], \"opacity\": 1}]}\n";
    let paraview = "[\n{\"Name\": \"ramp\", \"RGBPoints\": [0, 0, 0, 0, 1, 1, 1, 1],\n \"Points\": [0, 0, 0.5, 0, 1, 1, 0.5, 0]}]\n";
    let slicer = "1\n1\n0.9\n0.1\n0.2\n10\n4 0 0 1 1\n4 0 1 255 1\n8 0 0 0 0 1 1 1 1\n";
    for text in [ours, paraview, slicer] {
        check(text, &|bytes| {
            let read = read_transfer_function_bytes("f", bytes).map_err(|error| error.to_string())?;
            Ok(format!("{:?} {:?}", read.value, read.notices))
        });
    }
}

#[test]
fn report_64_81_patches() {
    let numbers: Vec<String> = (1..=16).map(|n| n.to_string()).collect();
    let points: String = (0..16).map(|n| format!("{},{},0\n", n / 4, n % 4)).collect();
    let teapot = format!("1\n{}\n16\n{points}", numbers.join(","));
    let points: Vec<String> = (0..16).map(|n| format!("[{}, {}, 0]", n / 4, n % 4)).collect();
    let json = format!(
        "{{\"kind\": \"bezier\", \"rows\": 4, \"columns\": 4,\n \"points\": [{}]}}\n",
        points.join(",\n")
    );
    for text in [teapot, json] {
        check(&text, &|bytes| {
            let set = patches::read_bytes("p", bytes).map_err(|error| error.to_string())?;
            Ok(format!("{}", set.suggested_tolerance()))
        });
    }
}

#[test]
fn report_64_81_scenes() {
    check("{ \"volume\":\n \"a.nrrd\" }\n", &|bytes| {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        Ok(format!("{:?}", read_scene(file.path()).map_err(|error| error.to_string())?))
    });
}

/// Any file that begins with the mark of UTF-16 is named as such, unless something describes it as raw voxels.
#[test]
fn report_81_raw_voxels_may_begin_like_utf_16() {
    let data = [0xff, 0xfe, 1, 2, 3, 4, 5, 6];
    let read = |name| read_volume_bytes(name, &data, &MemoryFolder::new(), &ReadOptions::default());
    assert_eq!(read("a_2x2x2_uint8.raw").unwrap().value.value_range(), [1.0, 255.0]);
    let error = read("ramp.json").unwrap_err().to_string();
    assert_eq!(error, "ramp.json: this is text in UTF-16; save it as UTF-8");
}

/// JSON is taken for a description of raw voxels only where it describes some.
#[test]
fn report_84_json_that_describes_nothing() {
    let read = |json: &str| {
        read_volume_bytes("a.json", json.as_bytes(), &MemoryFolder::new(), &ReadOptions::default())
            .unwrap_err()
            .to_string()
    };
    let error = read("// by hand\n{}");
    assert!(error.contains("not JSON") && error.contains("line 1"), "{error}");
    let error = read("{\"a\": 1,\n}");
    assert!(error.contains("not JSON") && error.contains("line 2"), "{error}");
    assert!(read("{\"a\": 1}").contains("neither a volume nor a description"));
    assert!(read("{\"size\": [2, 2, 2], \"type\": \"uint8\"}").contains("give the .raw file beside it"));
}
