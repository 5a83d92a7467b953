//! Damaged and lying files: every reader ends in a volume or in one line of text, without a panic.

use std::fs;
use std::path::Path;

use cutaway_core::volume::Volume;
use cutaway_io::limits::Limits;
use cutaway_io::volume::{Loaded, MemoryFolder, ReadError, ReadOptions, read_volume, read_volume_bytes};
use proptest::prelude::*;

/// The fixtures of a format in memory, as a folder.
fn fixtures(format: &str) -> MemoryFolder {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(format);
    let mut folder = MemoryFolder::new();
    collect(&root, "", &mut folder);
    folder
}

fn collect(path: &Path, prefix: &str, into: &mut MemoryFolder) {
    for entry in fs::read_dir(path).unwrap() {
        let entry = entry.unwrap();
        let name = format!("{prefix}{}", entry.file_name().to_str().unwrap());
        if entry.path().is_dir() {
            collect(&entry.path(), &format!("{name}/"), into);
        } else {
            into.insert(name, fs::read(entry.path()).unwrap());
        }
    }
}

/// The fixtures that differ in more than the direction of their axes or their type, and their names.
fn small_fixtures(format: &str) -> (MemoryFolder, Vec<String>) {
    let folder = fixtures(format);
    let names = folder.iter().filter(|(name, bytes)| {
        let same_again = (name.starts_with("axes_") && !name.contains("RAS"))
            || (name.contains("type_") && !name.contains("int16"));
        !same_again && !name.contains('/') && bytes.len() <= 4096 && !name.ends_with(".raw")
    });
    let names = names.map(|(name, _)| name.clone()).collect();
    (folder, names)
}

fn options() -> ReadOptions {
    ReadOptions { limits: Limits { max_bytes: 1 << 20 }, volume_index: Some(0), ..ReadOptions::default() }
}

/// Reads, and asserts what must hold of every result.
fn read(folder: &MemoryFolder, name: &str, bytes: &[u8]) -> Result<Loaded<Volume>, ReadError> {
    let result = read_volume_bytes(name, bytes, folder, &options());
    match &result {
        Ok(loaded) => {
            let dims = loaded.value.dimensions();
            assert_eq!(loaded.value.voxels().len() as u64, dims.as_u64vec3().element_product(), "{name}");
            assert!(loaded.notices.iter().all(|notice| is_one_line(notice)), "{:?}", loaded.notices);
        }
        Err(error) => assert!(is_one_line(&error.to_string()), "{name}: {error}"),
    }
    result
}

fn is_one_line(text: &str) -> bool {
    !text.is_empty() && text.len() < 1500 && !text.chars().any(char::is_control)
}

#[test]
fn files_cut_anywhere_are_errors_or_whole_volumes() {
    for format in ["nifti", "nrrd", "metaimage"] {
        let (folder, names) = small_fixtures(format);
        assert!(names.len() > 30, "{format}: {} fixtures", names.len());
        for name in names {
            let bytes = &folder[&name];
            for length in 0..bytes.len() {
                let _ = read(&folder, &name, &bytes[..length]);
            }
        }
    }
}

#[test]
fn a_single_uncompressed_file_is_an_error_at_every_shorter_length() {
    for (format, name) in [
        ("nifti", "type_int16_le.nii"),
        ("nifti", "nifti2_be.nii"),
        ("nifti", "gz.nii.gz"),
        ("nrrd", "encoding_raw.nrrd"),
        ("nrrd", "encoding_gzip.nrrd"),
        ("nrrd", "encoding_bzip2.nrrd"),
        ("metaimage", "type_MET_SHORT.mha"),
        ("raw", "name_5x4x3_int16.raw"),
    ] {
        let folder = fixtures(format);
        let bytes = &folder[name];
        assert!(read(&folder, name, bytes).is_ok(), "{name}");
        for length in 0..bytes.len() {
            assert!(read(&folder, name, &bytes[..length]).is_err(), "{name} cut to {length} bytes");
        }
    }
}

#[test]
fn every_byte_of_every_header_may_lie() {
    for format in ["nifti", "nrrd", "metaimage", "raw"] {
        let (mut folder, names) = small_fixtures(format);
        for name in names {
            let mut bytes = folder[&name].clone();
            for at in 0..bytes.len().min(600) {
                let original = bytes[at];
                for lie in [0, 0xff, original ^ 0x80, original.wrapping_add(1), b'9', b'-', b' ', b'\n'] {
                    bytes[at] = lie;
                    if let Some(data) = name.strip_suffix(".json") {
                        // A description is read when its data are.
                        folder.insert(name.clone(), bytes.clone());
                        let data = format!("{data}.raw");
                        if let Some(voxels) = folder.get(&data) {
                            let _ = read(&folder, &data, voxels);
                        }
                    } else {
                        let _ = read(&folder, &name, &bytes);
                    }
                }
                bytes[at] = original;
            }
        }
    }
}

#[test]
fn every_number_of_a_nifti_header_may_be_extreme() {
    let folder = fixtures("nifti");
    for name in ["type_int16_le.nii", "type_int16_be.nii", "nifti2_le.nii", "nifti2_be.nii", "four_d.nii"] {
        let good = &folder[name];
        let little = !name.contains("_be");
        for at in 0..540.min(good.len() - 8) {
            let mut lies: Vec<Vec<u8>> = Vec::new();
            for value in [0, -1, 1, i64::from(i16::MAX), i64::from(i32::MAX), i64::MAX, i64::MIN] {
                lies.extend([
                    value.to_le_bytes().to_vec(),
                    (value as i32).to_le_bytes().to_vec(),
                    (value as i16).to_le_bytes().to_vec(),
                ]);
            }
            for value in [f64::NAN, f64::INFINITY, -0.0, 1e-300, 1e300, -1.0, 1e9] {
                lies.extend([value.to_le_bytes().to_vec(), (value as f32).to_le_bytes().to_vec()]);
            }
            for mut lie in lies {
                if !little {
                    lie.reverse();
                }
                let mut bytes = good.clone();
                bytes[at..at + lie.len()].copy_from_slice(&lie);
                let _ = read(&folder, name, &bytes);
            }
        }
    }
}

#[test]
fn every_field_of_a_text_header_may_say_anything() {
    let long = "x".repeat(100_000);
    let lies = [
        "",
        "-1",
        "0",
        "1",
        "nan",
        "nan nan nan",
        "inf inf inf",
        "1e999 1 1",
        "0 0 0",
        "-3 4 5",
        "3 4",
        "3 4 5 6",
        "99999999999999999999 1 1",
        "18446744073709551615 1 1",
        "4294967296 4294967296 4294967296",
        "4294967295 4294967295 4294967295",
        "65536 65536 65536",
        "2147483647 2 1",
        "(nan,nan,nan)",
        "(0,0,0) (0,0,0) (0,0,0)",
        "(1e300,0,0) (0,1e300,0) (0,0,1e300)",
        "(1,0,0) (1,0,0) (1,0,0)",
        "none none none",
        "(((",
        "0 0 0 0 0 0 0 0 0",
        "1e-300 1e-300 1e-300",
        "../../etc/passwd",
        "/etc/passwd",
        "\u{1b}[31m",
        "LIST",
        "LIST 1",
        "LOCAL",
        "a%d 1 1000000000 1",
        "a%d 9223372036854775806 9223372036854775807 1",
        "%d%d 1 2 1",
        "a%999d 1 5 1",
        "9223372036854775807",
        "-9223372036854775808",
        "double",
        "MET_DOUBLE",
        "hex",
        "ascii",
        "bzip2",
        "gzip",
        "True",
        "False",
        "\"\"\"",
        "list list list",
        "RGB-color domain domain",
        "é€😀",
        long.as_str(),
    ];
    for format in ["nrrd", "metaimage"] {
        let (folder, names) = small_fixtures(format);
        for name in &names {
            let bytes = &folder[name];
            let separator = if format == "nrrd" { b':' } else { b'=' };
            let mut start = 0;
            for line in bytes.split_inclusive(|&b| b == b'\n') {
                if let Some(end) = line.iter().position(|&b| b == separator) {
                    for lie in lies {
                        let mut changed = bytes[..start + end + 1].to_vec();
                        changed.push(b' ');
                        changed.extend_from_slice(lie.as_bytes());
                        changed.push(b'\n');
                        changed.extend_from_slice(&bytes[start + line.len()..]);
                        let _ = read(&folder, name, &changed);
                    }
                }
                start += line.len();
                if start > 1500 {
                    break;
                }
            }
        }
    }
}

proptest! {
    #[test]
    fn random_bytes_are_no_volume(bytes in prop::collection::vec(any::<u8>(), 0..2000), magic in 0usize..6) {
        let starts: [&[u8]; 6] =
            [b"", b"NRRD0004\n", b"ObjectType = Image\nNDims = 3\n", b"\x5c\x01\0\0", b"\x1f\x8b\x08\0", b"\0\0\x02\x1c"];
        let bytes = [starts[magic], &bytes].concat();
        for name in ["a.nii", "a.nrrd", "a.mhd", "a.raw", "a", "a_2x2x2_uint8.raw"] {
            let _ = read(&MemoryFolder::new(), name, &bytes);
        }
    }
}

/// The longest path that a lie can take: data named by a header, outside of its folder.
#[cfg(unix)]
mod names {
    use super::*;
    use std::os::unix::fs::symlink;

    const NRRD: &str = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: ";
    const META: &str =
        "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = ";

    /// A folder `in` with headers, beside it a secret of the right size that links in `in` lead to.
    fn folders() -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        let inside = root.path().join("in");
        fs::create_dir_all(inside.join("sub")).unwrap();
        fs::write(root.path().join("secret.raw"), [7; 8]).unwrap();
        fs::write(inside.join("sub/voxels.raw"), [1; 8]).unwrap();
        symlink("../secret.raw", inside.join("link.raw")).unwrap();
        symlink("..", inside.join("up")).unwrap();
        symlink("sub/voxels.raw", inside.join("good.raw")).unwrap();
        root
    }

    fn read_naming(root: &Path, data: &str) -> Vec<Result<Loaded<Volume>, ReadError>> {
        let headers = [
            ("h.nhdr", format!("{NRRD}{data}\n")),
            ("l.nhdr", format!("{NRRD}LIST 3\n{data}\n")),
            ("h.mhd", format!("{META}{data}\n")),
        ];
        let read = |(name, text): (&str, String)| {
            let path = root.join("in").join(name);
            fs::write(&path, text).unwrap();
            read_volume(&path, &options())
        };
        headers.into_iter().map(read).collect()
    }

    #[test]
    fn data_are_read_only_from_the_folder_of_their_header() {
        let root = folders();
        for good in ["sub/voxels.raw", "./sub/voxels.raw", "good.raw", "sub\\voxels.raw"] {
            for result in read_naming(root.path(), good) {
                assert!(result.is_ok(), "{good}: {}", result.unwrap_err());
            }
        }
        let absolute = root.path().join("secret.raw");
        let absolute = absolute.to_str().unwrap();
        for bad in
            ["../secret.raw", "sub/../../secret.raw", "link.raw", "up/secret.raw", "..\\secret.raw", absolute]
        {
            for result in read_naming(root.path(), bad) {
                assert!(matches!(result, Err(ReadError::Outside { .. })), "{bad}");
            }
        }
    }

    #[test]
    fn pairs_follow_no_link_out_of_their_folder() {
        let root = folders();
        let folder = fixtures("nifti");
        fs::write(root.path().join("in/pair.hdr"), &folder["pair.hdr"]).unwrap();
        fs::write(root.path().join("pair.img"), &folder["pair.img"]).unwrap();
        symlink("../pair.img", root.path().join("in/pair.img")).unwrap();
        let error = read_volume(&root.path().join("in/pair.hdr"), &options()).unwrap_err().to_string();
        assert!(error.contains("leads out of the folder"), "{error}");
    }

    #[test]
    fn what_is_no_regular_file_is_not_opened() {
        let error = read_volume(Path::new("/dev/zero"), &options()).unwrap_err().to_string();
        assert_eq!(
            error,
            "cannot open /dev/zero: it is a device, not a regular file; save its contents to a file and name that file"
        );
    }
}
