//! Meshes: what is said of them, and what they are converted to.

mod common;

use common::{command, names, run};
use cutaway_io::mesh::{MeshReadOptions, read_mesh};
use cutaway_mesh::Topology;
use serde_json::{Value, json};
use std::path::Path;

/// A cube of quads without its top, wound inward.
const OPEN_BOX: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";

fn folder_with(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn topology(path: &Path) -> Topology {
    Topology::new(&read_mesh(path, &MeshReadOptions::default()).unwrap().value)
}

#[test]
fn info_counts_and_says_what_repair_would_do() {
    let folder = folder_with(&[("box.obj", OPEN_BOX.as_bytes())]);
    let text = run(folder.path(), "info box.obj").succeeds_silently();
    for line in [
        "format       OBJ (mesh)",
        "vertices     8",
        "triangles    10",
        "bounds       0 to 1, 0 to 1, 0 to 1",
        "winding      inward",
        "shells       1 (Euler number 1)",
        "boundary     4 edges in 1 loop",
        "closed       no",
        "repair       1 hole of 4 edges capped with 2 triangles",
        "             1 shell of 12 triangles wound inward, turned outward",
        "             then closed: 8 vertices, 12 triangles, volume 1",
    ] {
        assert!(text.lines().any(|l| l == line), "missing: {line}\n{text}");
    }
    let info: Value =
        serde_json::from_str(&run(folder.path(), "info box.obj --json").succeeds_silently()).unwrap();
    let expected = json!({ "kind": "mesh", "format": "OBJ", "vertices": 8, "triangles": 10, "euler": 1,
        "boundary_edges": 4, "boundary_loops": 1, "non_manifold_edges": 0, "inconsistent_edges": 0,
        "degenerate_triangles": 0, "winding": "inward", "closed": false, "shells": 1 });
    for (key, value) in expected.as_object().unwrap() {
        assert_eq!(&info[key], value, "{key}");
    }
    assert_eq!(info["bounds"], json!([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]));
    assert_eq!(info["repair"]["refused"], Value::Null);
    assert_eq!(info["repair"]["triangles"], 12);
}

#[test]
fn convert_writes_what_its_extension_says_and_closes_what_it_is_told_to() {
    let folder = folder_with(&[("box.obj", OPEN_BOX.as_bytes())]);
    for name in ["a.ply", "a.stl", "a.OBJ"] {
        run(folder.path(), &format!("convert box.obj {name}")).succeeds_silently();
        let t = topology(&folder.path().join(name));
        assert_eq!((t.triangles, t.used_vertices, t.boundary_edges), (10, 8, 4), "{name}");
    }
    let closed = run(folder.path(), "convert a.stl closed.ply --repair");
    let notes: Vec<&str> = closed.err.lines().collect();
    let expected = [
        "note: 1 hole of 4 edges capped with 2 triangles",
        "note: 1 shell of 12 triangles wound inward, turned outward",
    ];
    assert_eq!((closed.code, notes), (0, expected.to_vec()));
    let t = topology(&folder.path().join("closed.ply"));
    assert!(t.is_closed() && (t.volume - 1.0).abs() < 1e-12);
    run(folder.path(), "convert a.stl closed.ply --repair --quiet --weld-tolerance 0").succeeds_silently();
    let text = run(folder.path(), "info closed.ply").succeeds_silently();
    assert!(text.contains("closed       yes") && text.contains("repair       none needed"), "{text}");
}

#[test]
fn what_cannot_be_converted_is_refused_and_nothing_is_written() {
    let sheet = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
    let volume = common::nrrd([2, 2, 2], "uint8", &[7; 8]);
    let files: [(&str, &[u8]); 5] = [
        ("sheet.obj", sheet),
        ("v.nrrd", &volume),
        ("a.nii", b""),
        ("bad.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
        ("text.txt", b"hello"),
    ];
    let folder = folder_with(&files);
    let refused =
        |line: &str, code, says: &[&str]| run(folder.path(), &format!("convert {line}")).fails(code, says);
    refused("sheet.obj out.stl --repair", 1, &["sheet.obj", "no volume"]);
    refused("sheet.obj out.glb", 2, &["out.glb", ".ply, .stl and .obj"]);
    refused("sheet.obj out", 2, &["out", "without an extension"]);
    refused("sheet.obj ./sheet.obj", 2, &["overwrite"]);
    refused("sheet.obj no/out.stl", 1, &["no/out.stl", "does not exist"]);
    refused("sheet.obj out.stl --repair --weld-tolerance 2", 2, &["--weld-tolerance is 2", "1e-9 to 0.1"]);
    refused("sheet.obj out.stl --weld-tolerance 0.01", 2, &["--repair"]);
    refused("v.nrrd out.stl", 2, &["v.nrrd", "a volume", "meshes only"]);
    refused("a.nii out.nrrd", 2, &["a.nii", "a volume"]);
    refused("sample:mr-head out.stl", 2, &["sample:mr-head", "a volume"]);
    refused("text.txt out.stl", 1, &["text.txt", "not a mesh"]);
    refused("nothing.stl out.ply", 1, &["cannot open nothing.stl"]);
    refused(". out.ply", 1, &["cannot open", "a folder"]);
    refused("bad.ply out.ply", 1, &["bad.ply", "line 3", "`y`"]);
    run(folder.path(), "info bad.ply").fails(1, &["bad.ply", "line 3", "`y`"]);
    run(folder.path(), "render sheet.obj -o out.png")
        .fails(1, &["sheet.obj", "a mesh, not a volume", "cutaway info"]);
    assert_eq!(names(folder.path()), ["a.nii", "bad.ply", "sheet.obj", "text.txt", "v.nrrd"]);
}

#[test]
fn help_explains_converting() {
    let folder = tempfile::tempdir().unwrap();
    let help = run(folder.path(), "help convert").succeeds_silently();
    for part in ["--repair", "--weld-tolerance", "part.glb", "Examples:"] {
        assert!(help.contains(part), "{part}\n{help}");
    }
    assert!(run(folder.path(), "help info").succeeds_silently().contains("bunny.ply"));
    assert!(command(folder.path()).arg("convert").output().unwrap().status.code() == Some(2));
}

#[test]
fn report_50_what_is_not_a_mesh_is_called_so() {
    let folder =
        folder_with(&[("empty.stl", b""), ("zeros.obj", &[0; 64]), ("junk.stl", b"hello"), ("b.glb", b"")]);
    for (name, found) in [("empty.stl", "it is empty"), ("zeros.obj", "\\0\\0"), ("b.glb", "it is empty")] {
        for command in
            [format!("info {name}"), format!("convert {name} o.ply"), format!("render {name} -o o.png")]
        {
            run(folder.path(), &command).fails(1, &[&format!("{name}: not a mesh: "), found]);
        }
    }
    run(folder.path(), "info junk.stl").fails(1, &["junk.stl"]);
}

/// The box that lies at x 1 to 3, y 1 to 4, z -1 to 2 in RAS, as 3D Slicer writes it.
const LPS_BOX: &str = "# 3D Slicer output. SPACE=LPS\nv -3 -4 -1\nv -1 -4 -1\nv -1 -1 -1\nv -3 -1 -1\nv -3 -4 2\nv -1 -4 2\n\
    v -1 -1 2\nv -3 -1 2\nf 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\n";

#[test]
fn report_26_the_axes_of_a_mesh_are_those_of_its_file_or_of_the_option() {
    let folder = folder_with(&[("lps.obj", LPS_BOX.as_bytes())]);
    let text = run(folder.path(), "info lps.obj").succeeds_silently();
    assert!(text.contains("bounds       1 to 3, 1 to 4, -1 to 2\n"), "{text}");
    assert!(text.contains("says SPACE=LPS: converted to RAS"), "{text}");
    let text = run(folder.path(), "info lps.obj --mesh-space ras").succeeds_silently();
    assert!(text.contains("bounds       -3 to -1, -4 to -1, -1 to 2\n"), "{text}");
    run(folder.path(), "info sample:mr-head --mesh-space ras").fails(2, &["--mesh-space is for meshes"]);
    // What is converted says in which axes it is.
    run(folder.path(), "convert lps.obj ras.ply --quiet").succeeds_silently();
    let text = run(folder.path(), "info ras.ply").succeeds_silently();
    assert!(text.contains("bounds       1 to 3, 1 to 4, -1 to 2\n") && !text.contains("note"), "{text}");
    // A saved scene has the axes, and gives the same image.
    let cut = "render sample:sphere:16 --cut lps.obj --mesh-space lps --clip-pose fit --resolution 24,24";
    run(folder.path(), &format!("{cut} -o a.npy --save-scene s.json --quiet")).succeeds();
    let scene = std::fs::read_to_string(folder.path().join("s.json")).unwrap();
    let scene: Value = serde_json::from_str(&scene).unwrap();
    assert_eq!(scene["clip"]["difference"][1]["space"], "lps", "{scene}");
    run(folder.path(), "render --scene s.json -o b.npy --quiet").succeeds();
    let [a, b] = ["a.npy", "b.npy"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
    assert!(a == b, "the scene gives another image");
}

#[test]
fn report_40_bounds_far_from_the_origin_are_those_of_the_file() {
    let far = OPEN_BOX.replace("v 0", "v 500000.35").replace("v 1", "v 500001.65");
    let folder = folder_with(&[("far.obj", far.as_bytes())]);
    let text = run(folder.path(), "info far.obj").succeeds_silently();
    assert!(text.contains("bounds       500000.35 to 500001.65, 0 to 1, 0 to 1\n"), "{text}");
    let info: Value =
        serde_json::from_str(&run(folder.path(), "info far.obj --json").succeeds_silently()).unwrap();
    assert_eq!(info["bounds"], json!([[500000.35, 0.0, 0.0], [500001.65, 1.0, 1.0]]));
    run(folder.path(), "convert far.obj far.ply").succeeds_silently();
    let said = run(folder.path(), "convert far.obj far.stl");
    assert!(said.err.contains("rounding moves vertices by up to"), "{}", said.err);
    said.succeeds();
    let text = run(folder.path(), "info far.ply").succeeds_silently();
    assert!(text.contains("bounds       500000.35 to 500001.65, 0 to 1, 0 to 1\n"), "{text}");
}
