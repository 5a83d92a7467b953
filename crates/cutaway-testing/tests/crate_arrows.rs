//! Which of our crates may import which: `cargo metadata` against the list in `docs/ARCHITECTURE.md`.

use std::process::Command;

use serde_json::Value;

/// Crates that may be published, and those of ours that each may import, for itself or for its build script.
const ALLOWED: &[(&str, &[&str])] = &[
    ("cutaway-core", &[]),
    ("cutaway-mesh", &["cutaway-core"]),
    ("cutaway-io", &["cutaway-core", "cutaway-mesh"]),
    ("cutaway-cpu", &["cutaway-core", "cutaway-mesh"]),
    ("cutaway-gpu", &["cutaway-core", "cutaway-mesh"]),
    ("cutaway-engine", &["cutaway-core", "cutaway-mesh", "cutaway-cpu", "cutaway-gpu"]),
    (
        "cutaway",
        &["cutaway-core", "cutaway-mesh", "cutaway-io", "cutaway-cpu", "cutaway-gpu", "cutaway-engine"],
    ),
    (
        "cutaway-cli",
        &[
            "cutaway",
            "cutaway-app",
            "cutaway-core",
            "cutaway-mesh",
            "cutaway-io",
            "cutaway-cpu",
            "cutaway-gpu",
            "cutaway-engine",
        ],
    ),
    ("cutaway-app", LIBRARIES),
    ("cutaway-py", LIBRARIES),
];

/// What programs and bindings are made of.
const LIBRARIES: &[&str] = &[
    "cutaway",
    "cutaway-core",
    "cutaway-mesh",
    "cutaway-io",
    "cutaway-cpu",
    "cutaway-gpu",
    "cutaway-engine",
];

/// May import everything and be imported by nothing; never published.
const TESTING: &str = "cutaway-testing";

/// The one crate whose tests, too, import none of ours: what it needs for them belongs into it.
const CORE: &str = "cutaway-core";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Normal,
    Build,
    Dev,
}

/// A crate of the workspace.
#[derive(Clone, Debug)]
struct Package {
    name: String,
    /// Whether it may be published anywhere.
    publish: bool,
    /// By their real names, whatever they are renamed to, on every platform.
    dependencies: Vec<(String, Kind)>,
}

/// What is wrong with the arrows between crates, one line each.
fn violations(packages: &[Package]) -> Vec<String> {
    let ours = |name: &str| name.starts_with("cutaway") || packages.iter().any(|p| p.name == name);
    let mut found = Vec::new();
    for package in packages {
        let name = &package.name;
        if name == TESTING {
            if package.publish {
                found.push(format!("{name} holds tests only; set `publish = false` in its Cargo.toml"));
            }
            continue;
        }
        let Some((_, allowed)) = ALLOWED.iter().find(|(known, _)| known == name) else {
            found.push(format!(
                "{name} is not in the list; say in docs/ARCHITECTURE.md who may import whom, then in ALLOWED here"
            ));
            continue;
        };
        for (dependency, kind) in package.dependencies.iter().filter(|(d, _)| ours(d)) {
            let free = *kind == Kind::Dev && name != CORE;
            if !free && !allowed.contains(&dependency.as_str()) {
                found.push(format!(
                    "{name} imports {dependency} ({kind:?} dependency); it may import {allowed:?} of ours"
                ));
            }
        }
    }
    found
}

fn packages(metadata: &Value) -> Vec<Package> {
    let list = metadata["packages"].as_array().expect("cargo metadata lists packages");
    let package = |p: &Value| Package {
        name: text(&p["name"]),
        // Null is every registry, an empty list is none.
        publish: p["publish"].as_array().is_none_or(|registries| !registries.is_empty()),
        dependencies: p["dependencies"].as_array().into_iter().flatten().map(dependency).collect(),
    };
    list.iter().map(package).collect()
}

fn dependency(d: &Value) -> (String, Kind) {
    let kind = match d["kind"].as_str() {
        None => Kind::Normal,
        Some("build") => Kind::Build,
        Some("dev") => Kind::Dev,
        Some(other) => {
            panic!("cargo metadata names a kind of dependency that this test does not know: {other}")
        }
    };
    (text(&d["name"]), kind)
}

fn text(value: &Value) -> String {
    value.as_str().expect("cargo metadata gives names as text").to_owned()
}

#[test]
fn crates_import_along_the_arrows_only() {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1", "--manifest-path"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml"))
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let packages = packages(&serde_json::from_slice(&output.stdout).expect("cargo metadata is JSON"));
    for expected in ["cutaway-core", "cutaway-io", "cutaway-cpu", "cutaway-cli", "cutaway", TESTING] {
        assert!(packages.iter().any(|p| p.name == expected), "{expected} is missing from the workspace");
    }
    let imports_core = packages.iter().filter(|p| p.dependencies.iter().any(|(d, _)| d == CORE)).count();
    assert!(imports_core >= 4, "only {imports_core} crates were seen to import {CORE}");
    let found = violations(&packages);
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

fn package(name: &str, dependencies: &[(&str, Kind)]) -> Package {
    let dependencies = dependencies.iter().map(|(d, kind)| ((*d).to_owned(), *kind)).collect();
    Package { name: name.to_owned(), publish: name != TESTING, dependencies }
}

#[test]
fn good_arrows_pass() {
    let good = [
        package(CORE, &[("glam", Kind::Normal), ("proptest", Kind::Dev)]),
        package("cutaway-io", &[(CORE, Kind::Normal), (TESTING, Kind::Dev)]),
        package("cutaway-gpu", &[(CORE, Kind::Normal), ("cutaway-mesh", Kind::Build)]),
        package("cutaway-cli", &[("cutaway-gpu", Kind::Normal), ("cutaway-io", Kind::Normal)]),
        package(TESTING, &[("cutaway-cli", Kind::Normal), ("cutaway-cpu", Kind::Dev)]),
    ];
    assert_eq!(violations(&good), [""; 0]);
}

#[test]
fn each_bad_arrow_is_found_and_named() {
    let published = Package { publish: true, ..package(TESTING, &[]) };
    let cases = [
        (package(CORE, &[("cutaway-io", Kind::Normal)]), "cutaway-core imports cutaway-io"),
        (package(CORE, &[(TESTING, Kind::Dev)]), "cutaway-core imports cutaway-testing (Dev"),
        (package("cutaway-io", &[("cutaway-cpu", Kind::Build)]), "cutaway-io imports cutaway-cpu (Build"),
        (package("cutaway-cpu", &[("cutaway-io", Kind::Normal)]), "cutaway-cpu imports cutaway-io"),
        (package("cutaway-gpu", &[("cutaway-cpu", Kind::Normal)]), "cutaway-gpu imports cutaway-cpu"),
        (package("cutaway", &[("cutaway-cli", Kind::Normal)]), "cutaway imports cutaway-cli"),
        (package("cutaway-cli", &[(TESTING, Kind::Normal)]), "cutaway-cli imports cutaway-testing"),
        (package("cutaway-cli", &[("helper", Kind::Normal)]), "cutaway-cli imports helper"),
        (package("cutaway-wasm", &[]), "docs/ARCHITECTURE.md"),
        (published, "publish = false"),
    ];
    for (bad, expected) in cases {
        // `helper` is ours by being in the workspace, whatever it is called; it is not in the list either.
        let found = violations(&[bad.clone(), package("helper", &[])]);
        assert_eq!(found.len(), 2, "{bad:?}: {found:?}");
        assert!(found[0].contains(expected) && found[1].contains("helper is not in the list"), "{found:?}");
    }
}

#[test]
fn metadata_is_read_with_kinds_and_real_names() {
    let metadata = serde_json::json!({ "packages": [
        { "name": "cutaway", "publish": null, "dependencies": [
            { "name": "cutaway-core", "rename": "core", "kind": null, "target": "cfg(unix)" },
            { "name": "glam", "rename": null, "kind": "dev" },
            { "name": "cc", "kind": "build" } ] },
        { "name": TESTING, "publish": [], "dependencies": [] },
    ] });
    let read = packages(&metadata);
    let kinds = [("cutaway-core", Kind::Normal), ("glam", Kind::Dev), ("cc", Kind::Build)];
    assert_eq!(read[0].dependencies, kinds.map(|(name, kind)| (name.to_owned(), kind)));
    assert!(read[0].publish && !read[1].publish);
}
