use std::io::Write;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::*;

/// Two tetrahedra of five points, in every way that files write them.
const POINTS: [[f64; 3]; 5] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 4.0], [1.0, 1.0, 1.5]];
const CELLS: [[u32; 4]; 2] = [[0, 1, 2, 3], [1, 2, 3, 4]];
const VALUES: [f32; 5] = [1.0, 2.5, -3.0, 4.0, 100.0];

fn read(bytes: &[u8]) -> Result<Loaded<TetrahedralMesh>, TetrahedraReadError> {
    read_tetrahedra_bytes("a", bytes, &TetrahedraReadOptions::default())
}

#[track_caller]
fn assert_is_it(bytes: &[u8]) {
    let loaded = read(bytes).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(loaded.value.cells(), CELLS);
    assert_eq!(loaded.value.values(), VALUES);
    let points: Vec<[f64; 3]> = loaded.value.points().iter().map(|p| p.to_array()).collect();
    assert_eq!(points, POINTS);
    assert_eq!(loaded.notices, Vec::<String>::new());
    // Cut short anywhere, it is an error of one line and no panic.
    for length in 0..bytes.len() {
        if let Err(error) = read(&bytes[..length]) {
            assert!(!error.to_string().contains('\n'));
        }
    }
    // So it is with any one byte otherwise.
    for at in 0..bytes.len() {
        for other in [0, b'9', 0xff] {
            let mut bytes = bytes.to_vec();
            bytes[at] = other;
            let _ = read(&bytes);
        }
    }
}

fn text(values: impl IntoIterator<Item = impl std::fmt::Display>) -> String {
    values.into_iter().map(|v| format!("{v} ")).collect()
}

fn legacy_text() -> String {
    let points = text(POINTS.as_flattened());
    let cells: String = CELLS.iter().map(|c| format!("4 {}\n", text(c))).collect();
    format!(
        "# vtk DataFile Version 3.0\na title\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n{points}\n\
         CELLS 2 10\n{cells}CELL_TYPES 2\n10\n10\nCELL_DATA 2\nSCALARS c int\nLOOKUP_TABLE default\n7 8\n\
         POINT_DATA 5\nVECTORS v float\n{}\nSCALARS density float 1\nLOOKUP_TABLE default\n{}\n",
        text(POINTS.as_flattened()),
        text(VALUES)
    )
}

fn big<const N: usize, T>(values: impl IntoIterator<Item = T>, bytes: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    values.into_iter().flat_map(bytes).collect()
}

#[test]
fn legacy_text_is_read() {
    assert_is_it(legacy_text().as_bytes());
    assert_is_it(legacy_text().replace('\n', "\r\n").as_bytes());
}

#[test]
fn legacy_bytes_are_read_of_old_and_new_versions() {
    let points = big(POINTS.as_flattened().iter().map(|x| *x as f32), f32::to_be_bytes);
    let old = big(CELLS.iter().flat_map(|c| [4, c[0], c[1], c[2], c[3]]).map(|i| i as i32), i32::to_be_bytes);
    let offsets = big([0i64, 4, 8], i64::to_be_bytes);
    let names = big(CELLS.as_flattened().iter().map(|i| i64::from(*i)), i64::to_be_bytes);
    let values = big(VALUES, f32::to_be_bytes);
    for new in [false, true] {
        let mut file =
            b"# vtk DataFile Version 5.1\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n".to_vec();
        file.extend_from_slice(&points);
        if new {
            file.extend_from_slice(b"\nMETADATA\nINFORMATION 0\n\nCELLS 3 8\nOFFSETS vtktypeint64\n");
            file.extend_from_slice(&offsets);
            file.extend_from_slice(b"\nCONNECTIVITY vtktypeint64\n");
            file.extend_from_slice(&names);
        } else {
            file.extend_from_slice(b"\nCELLS 2 10\n");
            file.extend_from_slice(&old);
        }
        file.extend_from_slice(b"\nCELL_TYPES 2\n");
        file.extend_from_slice(&big([10, 10], i32::to_be_bytes));
        file.extend_from_slice(b"\nPOINT_DATA 5\nFIELD FieldData 1\ndensity 1 5 float\n");
        file.extend_from_slice(&values);
        file.push(b'\n');
        assert_is_it(&file);
    }
}

/// How a data array is written.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Text,
    Inline,
    AppendedRaw,
    AppendedBase64,
}

fn vtu(way: Way, zlib: bool, header64: bool) -> Vec<u8> {
    let mut appended = Vec::new();
    let header = |n: usize| {
        if header64 { (n as u64).to_le_bytes().to_vec() } else { (n as u32).to_le_bytes().to_vec() }
    };
    let mut array = |name: &str, kind: &str, components: usize, words: String, bytes: Vec<u8>| {
        let tag = format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
        if way == Way::Text {
            return format!("{tag} format=\"ascii\">\n{words}\n</DataArray>\n");
        }
        // Two blocks, of which the second is shorter.
        let half = bytes.len() / 2 + 1;
        let packed: Vec<Vec<u8>> = bytes
            .chunks(half)
            .map(|chunk| {
                let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
                encoder.write_all(chunk).expect("memory");
                encoder.finish().expect("memory")
            })
            .collect();
        let mut head = Vec::new();
        let mut body = Vec::new();
        if zlib {
            head.extend([packed.len(), half, bytes.len() % half].into_iter().flat_map(header));
            head.extend(packed.iter().flat_map(|p| header(p.len())));
            body.extend(packed.concat());
        } else {
            body.extend(header(bytes.len()));
            body.extend(bytes);
        }
        let coded = match way {
            Way::AppendedRaw => [head, body].concat(),
            _ => [STANDARD.encode(head), STANDARD.encode(body)].concat().into_bytes(),
        };
        if way == Way::Inline {
            return format!(
                "{tag} format=\"binary\">\n  {}\n</DataArray>\n",
                String::from_utf8_lossy(&coded)
            );
        }
        let offset = appended.len();
        appended.extend(coded);
        format!("{tag} format=\"appended\" offset=\"{offset}\"/>\n")
    };
    let floats = big(VALUES, f32::to_le_bytes);
    let vectors = array(
        "v",
        "Float64",
        3,
        text(POINTS.as_flattened()),
        big(POINTS.as_flattened().iter().copied(), f64::to_le_bytes),
    );
    let values = array("density", "Float32", 1, text(VALUES), floats);
    let points = array(
        "p",
        "Float64",
        3,
        text(POINTS.as_flattened()),
        big(POINTS.as_flattened().iter().copied(), f64::to_le_bytes),
    );
    let names = array(
        "connectivity",
        "Int64",
        1,
        text(CELLS.as_flattened()),
        big(CELLS.as_flattened().iter().map(|i| i64::from(*i)), i64::to_le_bytes),
    );
    let offsets = array("offsets", "Int32", 1, text([4, 8]), big([4, 8], i32::to_le_bytes));
    let types = array("types", "UInt8", 1, text([10, 10]), vec![10, 10]);
    let compressor = if zlib { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
    let width = if header64 { "UInt64" } else { "UInt32" };
    let mut file = format!(
        "<?xml version=\"1.0\"?>\n<!-- <made> -->\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"{width}\"{compressor}>\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"5\" NumberOfCells=\"2\">\n\
         <PointData Scalars='density'>\n{vectors}{values}</PointData>\n<CellData></CellData>\n<Points>{points}</Points>\n\
         <Cells>{names}{offsets}{types}</Cells>\n</Piece>\n</UnstructuredGrid>\n"
    )
    .into_bytes();
    if matches!(way, Way::AppendedRaw | Way::AppendedBase64) {
        let encoding = if way == Way::AppendedRaw { "raw" } else { "base64" };
        file.extend_from_slice(format!("<AppendedData encoding=\"{encoding}\">\n _").as_bytes());
        file.extend(appended);
        file.extend_from_slice(b"\n</AppendedData>\n");
    }
    file.extend_from_slice(b"</VTKFile>\n");
    file
}

#[test]
fn vtu_is_read_in_every_encoding() {
    for way in [Way::Text, Way::Inline, Way::AppendedRaw, Way::AppendedBase64] {
        for zlib in [false, true] {
            assert_is_it(&vtu(way, zlib, zlib));
        }
    }
}

#[test]
fn several_pieces_become_one_grid() {
    let file = String::from_utf8(vtu(Way::Text, false, false)).expect("text");
    let (begin, end) =
        (file.find("<Piece").expect("a piece"), file.find("</UnstructuredGrid>").expect("an end"));
    let twice = format!("{}{}{}{}", &file[..begin], &file[begin..end], &file[begin..end], &file[end..]);
    let loaded = read(twice.as_bytes()).expect("two pieces").value;
    assert_eq!((loaded.points().len(), loaded.cells().len()), (10, 4));
    assert_eq!(loaded.cells()[3], [6, 7, 8, 9]);
}

#[test]
fn cells_of_more_corners_are_cut_so_that_faces_match() {
    // A lattice of cubes as hexahedra and voxels in turn, with a pyramid and a wedge each in a file of its own.
    let volume = |mesh: &TetrahedralMesh| -> f64 {
        let of = |cell: &[u32; 4]| {
            let [p, a, b, c] = cell.map(|i| mesh.points()[i as usize]);
            (a - p).cross(b - p).dot(c - p).abs() / 6.0
        };
        mesh.cells().iter().map(of).sum()
    };
    let n = 3;
    let at = |x: usize, y: usize, z: usize| (z * n + y) * n + x;
    let mut points = String::new();
    for i in 0..n * n * n {
        points += &format!("{} {} {}\n", i % n, i / n % n, i / n / n);
    }
    let (mut cells, mut kinds) = (String::new(), String::new());
    for i in 0..8 {
        let (x, y, z) = (i & 1, i >> 1 & 1, i >> 2);
        let corner = |c: usize| at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
        let voxel = i % 2 == 0;
        let order = if voxel { [0, 1, 2, 3, 4, 5, 6, 7] } else { [0, 1, 3, 2, 4, 5, 7, 6] };
        cells += &format!("8 {}\n", text(order.map(corner)));
        kinds += if voxel { "11 " } else { "12 " };
    }
    let head = "# vtk DataFile Version 2.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n";
    let values = text(0..n * n * n);
    let file = format!(
        "{head}POINTS 27 float\n{points}CELLS 9 75\n{cells}2 0 1\nCELL_TYPES 9\n{kinds}3\nPOINT_DATA 27\nSCALARS s float\n{values}\n"
    );
    let loaded = read(file.as_bytes()).expect("cubes");
    assert_eq!(loaded.notices.len(), 2, "{:?}", loaded.notices);
    assert!((volume(&loaded.value) - 8.0).abs() < 1e-12);
    let mut faces = std::collections::HashMap::new();
    for cell in loaded.value.cells() {
        for left_out in 0..4 {
            let mut face: Vec<u32> = (0..4).filter(|k| *k != left_out).map(|k| cell[k]).collect();
            face.sort_unstable();
            *faces.entry(face).or_insert(0) += 1;
        }
    }
    assert_eq!(faces.values().filter(|n| **n == 1).count(), 6 * 4 * 2);
    assert!(faces.values().all(|n| *n <= 2));
    for (kind, corners, expected) in [
        (13, "0 0 0  1 0 0  0 1 0  0 0 1  1 0 1  0 1 1", 0.5),
        (14, "0 0 0  1 0 0  1 1 0  0 1 0  0 0 1", 1.0 / 3.0),
    ] {
        let count = corners.split_whitespace().count() / 3;
        let names = text(0..count);
        let file = format!(
            "{head}POINTS {count} float\n{corners}\nCELLS 1 {}\n{count} {names}\nCELL_TYPES 1\n{kind}\nPOINT_DATA {count}\n\
             SCALARS s float\nLOOKUP_TABLE default\n{names}\n",
            count + 1
        );
        assert!((volume(&read(file.as_bytes()).expect("a cell").value) - expected).abs() < 1e-12, "{kind}");
    }
}

#[test]
fn what_is_wrong_is_said() {
    let text = legacy_text();
    let says = |file: &str, part: &str| {
        let error = read(file.as_bytes()).map(|_| ()).expect_err(part).to_string();
        assert!(error.contains(part), "{error}: {part}");
    };
    says("", "begins with nothing");
    says("solid x", "not an unstructured grid");
    says(&text.replace("UNSTRUCTURED_GRID", "POLYDATA"), "supported are unstructured grids");
    says(&text.replace("POINTS 5 double", "POINTS 4000000000 double"), "cut short");
    says(&text.replace("POINTS 5 double", "POINTS 5 complex"), "expected a type of numbers");
    says(
        &text.replace("CELLS 2 10\n4 0 1 2 3", "CELLS 2 10\n4 0 1 2 5"),
        "cell 0: found point 5, expected points from 0 to 4",
    );
    says(&text.replace("CELLS 2 10\n4 0", "CELLS 2 10\n9 0"), "found 1 cells and 2 cell types");
    says(&text.replace("CELLS 2 10\n4 0", "CELLS 2 10\n99 0"), "each cell's points after their number");
    says(&text.replace("10\n10\n", "10\n42\n"), "found a cell of type 42");
    says(&text.replace("SCALARS density float 1", "SCALARS density float x"), "a number of components");
    let none = text.replace("SCALARS c int\nLOOKUP_TABLE default\n7 8\n", "");
    let none = none.split("SCALARS density").next().unwrap_or_default();
    says(none, "found \"v\" (point data of 3 components), expected point or cell data of one component");
    let small =
        TetrahedraReadOptions { limits: Limits { max_bytes: 64 }, ..TetrahedraReadOptions::default() };
    let error = read_tetrahedra_bytes("a", text.as_bytes(), &small).map(|_| ()).expect_err("too large");
    assert!(matches!(error, TetrahedraReadError::TooLarge { .. }), "{error}");
    let named =
        TetrahedraReadOptions { array: Some("pressure".to_owned()), ..TetrahedraReadOptions::default() };
    let error =
        read_tetrahedra_bytes("a", text.as_bytes(), &named).map(|_| ()).expect_err("no pressure").to_string();
    assert!(error.contains("\"density\"") && error.contains("\"pressure\""), "{error}");
    let xml = String::from_utf8(vtu(Way::Text, false, false)).expect("text");
    says(&xml.replace("LittleEndian", "Middle"), "supported are LittleEndian, BigEndian");
    says(
        &xml.replace("header_type", "compressor=\"vtkSnappyDataCompressor\" header_type"),
        "vtkLZ4DataCompressor",
    );
    says(&xml.replace("NumberOfPoints=\"5\"", "NumberOfPoints=\"99999999999\""), "cut short");
    says(&xml.replace("connectivity", "connections"), "the array `connectivity` of cells");
}
