//! Unstructured grids as VTK's writers write them, with every option that they have, against what VTK reads from them;
//! and what such files must not do: be refused for what they also hold, or lose their values.
//!
//! `tests/golden/generator/write_vtk.py` makes the files and the values.

use std::path::{Path, PathBuf};

use cutaway_core::tetrahedra::TetrahedralMesh;
use cutaway_io::tetrahedra::{
    On, TetrahedraReadError, TetrahedraReadOptions, read_grid, read_grid_bytes, read_tetrahedra,
    read_tetrahedra_bytes,
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Golden {
    file: String,
    array: String,
    on: String,
    points: usize,
    values: Vec<f64>,
    step: Option<usize>,
}

fn tests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")
}

fn fixture(name: &str) -> PathBuf {
    tests().join("fixtures/vtk").join(name)
}

fn goldens() -> Vec<Golden> {
    let text = std::fs::read_to_string(tests().join("golden/vtk.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn options(golden: &Golden) -> TetrahedraReadOptions {
    let array = Some(golden.array.clone());
    TetrahedraReadOptions { array, time_step: golden.step, ..TetrahedraReadOptions::default() }
}

/// What is read of a golden's file is what VTK read; the result says what is not.
fn compare(golden: &Golden) -> Result<(), String> {
    let path = fixture(&golden.file);
    let grid = read_grid(&path, &options(golden)).map_err(|error| error.to_string())?;
    if grid.points().len() != golden.points {
        return Err(format!("{} points, expected {}", grid.points().len(), golden.points));
    }
    let (_, on) = grid.values().ok_or("no values")?;
    if on.name() != golden.on.trim_end_matches('s') {
        return Err(format!("values on a {}", on.name()));
    }
    let tetrahedra = grid.tetrahedra().len();
    let mesh = grid.into_mesh().map_err(|error| error.to_string())?;
    let found: Vec<f64> = match on {
        On::Points => mesh.values().iter().map(|v| f64::from(*v)).collect(),
        On::Cells => mesh.values().chunks(4).map(|four| f64::from(four[0])).collect(),
    };
    // Doubles are held as floats.
    let expected: Vec<f64> = golden.values.iter().map(|v| f64::from(*v as f32)).collect();
    let cells = if on == On::Cells { tetrahedra } else { found.len() };
    if found != expected || cells != found.len() {
        return Err(format!("{found:?}, expected {expected:?}"));
    }
    Ok(())
}

#[test]
fn report_57_80_what_vtk_writes_is_read_as_vtk_reads_it() {
    let goldens = goldens();
    assert!(goldens.len() > 200);
    let wrong: Vec<String> = goldens
        .iter()
        .filter_map(|golden| {
            let error = compare(golden).err()?;
            Some(format!("{} {} {:?}: {error}", golden.file, golden.array, golden.step))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), goldens.len(), wrong.join("\n"));
}

/// Without a name the temperature is taken: the active scalars, the first array, or the only one.
#[test]
fn report_57_the_values_that_are_meant() {
    let mut files: Vec<&str> = Vec::new();
    let goldens = goldens();
    for golden in goldens.iter().filter(|g| g.array == "temperature" && g.step.is_none()) {
        files.push(&golden.file);
        let mesh = read_tetrahedra(&fixture(&golden.file), &TetrahedraReadOptions::default()).unwrap();
        let expected: Vec<f32> = golden.values.iter().map(|v| *v as f32).collect();
        assert_eq!(mesh.value.values(), expected, "{}", golden.file);
    }
    assert!(files.len() > 60, "{}", files.len());
}

/// The tetrahedra of one grid are the same in every file of it.
#[test]
fn cells_are_those_that_were_written() {
    let of = |name: &str| {
        let grid = read_grid(&fixture(name), &TetrahedraReadOptions::default()).unwrap();
        (grid.points().to_vec(), grid.tetrahedra().to_vec(), grid.notices())
    };
    let shapes = of("shapes-51.vtk");
    // A hexahedron and a voxel of six each, a wedge of three, a pyramid of two, a tetrahedron.
    assert_eq!(shapes.1.len(), 6 + 6 + 3 + 2 + 1);
    for other in ["shapes-42.vtk", "shapes.vtu", "blocks-zlib.vtu", "blocks-lz4.vtu", "blocks-lzma.vtu"] {
        assert_eq!(of(other), shapes, "{other}");
    }
    for golden in goldens().iter().filter(|g| g.points == 5 && !g.file.starts_with("ghosts")) {
        let (_, cells, _) = of(&golden.file);
        assert_eq!(cells, [[0, 1, 2, 3], [1, 2, 3, 4]], "{}", golden.file);
    }
}

#[test]
fn cells_of_other_pieces_are_left_out() {
    for name in ["ghosts.vtk", "ghosts.vtu"] {
        let read = read_tetrahedra(&fixture(name), &TetrahedraReadOptions::default()).unwrap();
        assert_eq!(read.value.cells(), [[0, 1, 2, 3]], "{name}");
        assert!(read.notices[0].contains("vtkGhostType"), "{:?}", read.notices);
    }
}

#[test]
fn time_steps_are_chosen() {
    for name in
        ["steps-text.vtu", "steps-binary.vtu", "steps-appended.vtu", "steps-raw.vtu", "steps-zlib.vtu"]
    {
        let at = |time_step| {
            let options = TetrahedraReadOptions { time_step, ..TetrahedraReadOptions::default() };
            read_grid(&fixture(name), &options)
        };
        for (step, time) in [(0, 0.0), (1, 0.5), (2, 1.0)] {
            let grid = at(Some(step)).unwrap();
            assert_eq!(grid.time(), Some(time), "{name}");
            assert_eq!(grid.into_mesh().unwrap().values()[0], 1.0 + step as f32, "{name}");
        }
        assert!(at(None).unwrap().notices()[0].contains("time step 0 of 3"), "{name}");
        let error = at(Some(3)).map(|_| ()).unwrap_err();
        assert!(matches!(error, TetrahedraReadError::TimeStep { index: 3, steps: 3, .. }), "{error}");
    }
    let grid = read_grid(&fixture("keys-binary-51.vtk"), &TetrahedraReadOptions::default()).unwrap();
    assert_eq!(grid.time(), Some(12.5));
}

/// Lengths of arrays, encoded on their own with their own padding, as several writers do; and lines of base64.
#[test]
fn report_57_base64_in_parts() {
    use base64::Engine as _;
    use base64::engine::general_purpose::STANDARD;
    for (name, header) in [("binary-none-32.vtu", 4), ("binary-none-64.vtu", 8), ("appended-none-32.vtu", 0)]
    {
        let text = std::fs::read_to_string(fixture(name)).unwrap();
        let mut again = String::new();
        for line in text.lines() {
            let data = STANDARD.decode(line.trim()).unwrap_or_default();
            if header > 0 && data.len() > header && !line.contains('<') {
                again += &STANDARD.encode(&data[..header]);
                let rest = STANDARD.encode(&data[header..]);
                for piece in rest.as_bytes().chunks(20) {
                    again += "\n   ";
                    again += std::str::from_utf8(piece).unwrap();
                }
            } else {
                again += line;
            }
            again.push('\n');
        }
        assert!(header == 0 || again != text);
        let read = read_tetrahedra_bytes("again", again.as_bytes(), &TetrahedraReadOptions::default());
        assert_eq!(read.unwrap().value.values(), [1.0, 2.5, -3.0, 4.0, 5.0], "{name}");
    }
}

/// Every file cut short anywhere, and with single bytes changed, is read or refused in one line.
#[test]
fn damaged_files_are_refused_in_one_line() {
    let picked = [
        "raw-lz4-64.vtu",
        "binary-lzma-32.vtu",
        "raw-lzma-32-be.vtu",
        "keys-binary-51.vtk",
        "types-binary-42.vtk",
        "attributes-binary-42.vtk",
        "steps-raw.vtu",
        "cells-lz4.vtu",
    ];
    for name in picked {
        let whole = std::fs::read(fixture(name)).unwrap();
        let try_it = |bytes: &[u8]| match read_tetrahedra_bytes("a", bytes, &TetrahedraReadOptions::default())
        {
            Ok(_) => {}
            Err(error) => assert!(!error.to_string().chars().any(char::is_control), "{error}"),
        };
        for length in (0..whole.len()).step_by(7) {
            try_it(&whole[..length]);
        }
        let mut bytes = whole.clone();
        for at in 0..whole.len() {
            for other in [0, b'9', 0xff] {
                bytes[at] = other;
                try_it(&bytes);
            }
            bytes[at] = whole[at];
        }
    }
}

const GRID: &str = "# vtk DataFile Version 3.0\ntwo tetrahedra\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n\
    0 0 0\n2 0 0\n0 2 0\n0 0 2\n2 2 2\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n";

fn volume(mesh: &[[u32; 4]], points: &[cutaway_core::glam::DVec3]) -> f64 {
    let of = |cell: &[u32; 4]| {
        let [p, a, b, c] = cell.map(|i| points[i as usize]);
        (a - p).cross(b - p).dot(c - p).abs() / 6.0
    };
    mesh.iter().map(of).sum()
}

#[test]
fn report_82_grids_without_values_are_described() {
    let xml = "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"5\" NumberOfCells=\"2\">\
        <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 2 0 0 0 2 0 0 0 2 2 2 2</DataArray></Points>\
        <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 1 2 3 4</DataArray>\
        <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4 8</DataArray>\
        <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";
    for text in [GRID, xml] {
        let grid = read_grid_bytes("grid", text.as_bytes(), &TetrahedraReadOptions::default()).unwrap();
        assert_eq!((grid.points().len(), grid.tetrahedra().len()), (5, 2));
        assert!((volume(grid.tetrahedra(), grid.points()) - 4.0).abs() < 1e-12);
        assert!(grid.values().is_none() && grid.arrays().is_empty());
        let error = grid.into_mesh().map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("the grid has points and cells, but no values"), "{error}");
    }
    // What is there but cannot be the values is named.
    let vectors = format!("{GRID}POINT_DATA 5\nVECTORS velocity float\n{}", "1 2 3 ".repeat(5));
    let grid = read_grid_bytes("grid", vectors.as_bytes(), &TetrahedraReadOptions::default()).unwrap();
    let error = grid.into_mesh().map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("\"velocity\" (point data of 3 components)"), "{error}");
    for name in ["empty.vtk", "empty.vtu"] {
        let grid = read_grid(&fixture(name), &TetrahedraReadOptions::default()).unwrap();
        assert_eq!((grid.points().len(), grid.tetrahedra().len()), (0, 0));
    }
}

/// Text of whole numbers as `8.0`, and a table after the scalars of a line of its own.
#[test]
fn numbers_are_forgiven_their_form() {
    let text = GRID.replace("4 0 1 2 3", "4.0 0 1.0 2 3e0")
        + "POINT_DATA 5\nSCALARS v int\nLOOKUP_TABLE mine\n1.0 2 3 4 5\nLOOKUP_TABLE mine 2\n0 0 0 1 1 1 1 1\n";
    let read = read_tetrahedra_bytes("grid", text.as_bytes(), &TetrahedraReadOptions::default()).unwrap();
    let mesh: TetrahedralMesh = read.value;
    assert_eq!((mesh.cells()[0], mesh.values()), ([0, 1, 2, 3], &[1.0, 2.0, 3.0, 4.0, 5.0][..]));
}
