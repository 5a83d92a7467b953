//! What the readers say: the main kinds of error and notice, word for word.

use std::path::Path;

use cutaway_core::volume::VoxelType;
use cutaway_io::limits::Limits;
use cutaway_io::volume::{MemoryFolder, RawOptions, ReadOptions, read_volume, read_volume_bytes};

fn fixture(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)).unwrap()
}

fn error_with(name: &str, bytes: &[u8], options: &ReadOptions) -> String {
    read_volume_bytes(name, bytes, &MemoryFolder::new(), options).unwrap_err().to_string()
}

fn error(name: &str, bytes: &[u8]) -> String {
    error_with(name, bytes, &ReadOptions::default())
}

fn notices(name: &str, bytes: &[u8], options: &ReadOptions) -> Vec<String> {
    read_volume_bytes(name, bytes, &MemoryFolder::new(), options).unwrap().notices
}

fn index(volume_index: usize) -> ReadOptions {
    ReadOptions { volume_index: Some(volume_index), ..ReadOptions::default() }
}

const NRRD: &str = "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 4 5\nencoding: raw\nendian: little\n";

fn nrrd(from: &str, to: &str) -> Vec<u8> {
    let header = NRRD.replace(from, to);
    [header.as_bytes(), b"\n", &[0; 120]].concat()
}

const META: &str =
    "ObjectType = Image\nNDims = 3\nDimSize = 3 4 5\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";

fn meta(from: &str, to: &str) -> Vec<u8> {
    [META.replace(from, to).as_bytes(), &[0; 120]].concat()
}

/// A NIfTI-1 file with bytes replaced.
fn nifti(at: usize, with: &[u8]) -> Vec<u8> {
    let mut bytes = fixture("nifti/type_int16_le.nii");
    bytes[at..at + with.len()].copy_from_slice(with);
    bytes
}

#[test]
fn unknown_and_unsupported_formats_name_what_is_supported() {
    assert_eq!(
        error("a.vti", b"<?xml version=\"1.0\"?>"),
        "a.vti: VTK's XML is not supported yet; supported are NIfTI (.nii, .nii.gz, .hdr with .img), NRRD (.nrrd, .nhdr), MetaImage (.mhd, .mha) and raw voxels (.raw, .raw.gz)"
    );
    assert_eq!(
        error("a", b"some \x01 text that is no volume"),
        "a: unknown format: the file begins with \"some \\u{1} text \"; supported are NIfTI (.nii, .nii.gz, .hdr with .img), NRRD (.nrrd, .nhdr), MetaImage (.mhd, .mha) and raw voxels, described by their name (name_256x256x128_uint8.raw), a .json file beside them or options for dimensions and type"
    );
    assert!(error("a", b"").contains("begins with nothing (it is empty)"));
    let dicom = [vec![0; 128], b"DICM".to_vec()].concat();
    assert!(error("IM0001", &dicom).starts_with("IM0001: DICOM is not supported yet"));
    assert_eq!(
        error("foot.json", b"{\"size\": [1, 2, 3]}"),
        "foot.json: this describes raw voxels and has none itself; give the .raw file beside it: the description is found by itself"
    );
    assert_eq!(
        error("foot.json", b"{}"),
        "foot.json: this is JSON and neither a volume nor a description of raw voxels; a description has \"dims\" and \"type\""
    );
    let folder = read_volume(Path::new(env!("CARGO_MANIFEST_DIR")), &ReadOptions::default());
    assert!(
        folder.unwrap_err().to_string().contains("a folder (a DICOM series, a TIFF stack, a Zarr store)")
    );
    let nothing = read_volume(Path::new("no/such/file.nrrd"), &ReadOptions::default()).unwrap_err();
    assert_eq!(nothing.to_string(), "cannot open no/such/file.nrrd: no such file");
}

#[test]
fn fields_are_named_with_their_place() {
    assert_eq!(
        error("a.nrrd", &nrrd("sizes: 3 4 5", "sizes: 3 4 5 6")),
        "a.nrrd: line 4: `sizes` is \"3 4 5 6\", expected 3 sizes, as many as the dimension"
    );
    assert_eq!(
        error("a.nrrd", &nrrd("type: short", "type: long")),
        "a.nrrd: line 2: `type` is \"long\", expected signed char, uchar, short, ushort, int, uint, longlong, ulonglong, float, double or another name of one of them"
    );
    assert_eq!(
        error("a.nrrd", &nrrd("endian: little\n", "")),
        "a.nrrd: the header has no `endian`, expected little or big, as samples have more than one byte"
    );
    assert_eq!(
        error("a.nrrd", &nrrd("encoding: raw", "encoding: raw\nencoding: gzip")),
        "a.nrrd: line 6: `encoding` is there a second time, expected once only (first on line 5); remove one"
    );
    assert_eq!(
        error("a.nrrd", &nrrd("encoding: raw", "encoding\u{1b} raw")),
        "a.nrrd: line 5: found \"encoding\\u{1b} raw\", expected `field: value`, `key:=value` or `# comment`"
    );
    assert_eq!(
        error("a.mha", &meta("MET_SHORT", "MET_SHORTS")),
        "a.mha: line 4: `ElementType` is \"MET_SHORTS\", expected MET_CHAR, MET_UCHAR, MET_SHORT, MET_USHORT, MET_INT, MET_UINT, MET_LONG, MET_ULONG, MET_LONG_LONG, MET_ULONG_LONG, MET_FLOAT or MET_DOUBLE"
    );
    assert_eq!(
        error("a.nii", &nifti(42, &(-3i16).to_le_bytes())),
        "a.nii: byte 42: `dim[1]` is -3, expected at least 1"
    );
    assert_eq!(
        error("a.nii", &nifti(70, &128i16.to_le_bytes())),
        "a.nii: byte 70: `datatype` is 128 (RGB colours), expected the code of a scalar type: 2, 4, 8, 16, 64, 256, 512, 768, 1024 or 1280"
    );
    assert_eq!(
        error("a.nii", &nifti(108, &f32::NAN.to_le_bytes())),
        "a.nii: byte 108: `vox_offset` is NaN, expected a whole number of at least 352"
    );
    assert_eq!(
        error("a.nii", &nifti(344, b"\0\0\0\0")),
        "a.nii: byte 344: `magic` is \"\\0\\0\\0\\0\", expected \"n+1\", \"ni1\", \"n+2\" or \"ni2\" (Analyze 7.5 files, which have none, are not read)"
    );
}

#[test]
fn vectors_and_colours_ask_for_a_choice() {
    let hint = "; choose one component with the volume index or convert the file to one with a single number a voxel";
    let vectors = fixture("nrrd/components_first.nrrd");
    assert_eq!(
        error("a.nrrd", &vectors),
        format!(
            "a.nrrd: line 10: `kinds` is \"vector domain domain domain\", expected one number a voxel{hint}"
        )
    );
    assert_eq!(
        error("a.mha", &fixture("metaimage/channels.mha")),
        format!(
            "a.mha: line 10: `ElementNumberOfChannels` is \"2\", expected 1 (no colours or vectors){hint}"
        )
    );
    assert_eq!(
        error_with("a.nrrd", &vectors, &index(2)),
        "a.nrrd: there is no volume 2: the file holds 2, numbered from 0"
    );
    assert_eq!(
        notices("a.nrrd", &vectors, &index(1)),
        ["volume 1 of 2 taken (numbered from 0); choose with the volume index"]
    );
}

#[test]
fn sizes_are_held_against_the_file_and_the_limit() {
    let cut = &nrrd("", "")[..195];
    assert_eq!(
        error("a.nrrd", cut),
        "a.nrrd: found 118 bytes of data, expected 120 bytes (3 x 4 x 5 int16); the file is cut short or its header is wrong"
    );
    let limits = Limits { max_bytes: 1 << 30 };
    assert_eq!(
        error_with(
            "a.nrrd",
            &nrrd("3 4 5", "2048 2048 2048"),
            &ReadOptions { limits, ..ReadOptions::default() }
        ),
        "a.nrrd: 2048 x 2048 x 2048 int16 voxels need 16.0 GiB, more than the limit of 1.0 GiB; crop or resample the data first, or take a machine with more memory"
    );
    assert!(error("a.mha", &meta("3 4 5", "4294967295 4294967295 4294967295")).contains("need 16.0 EiB"));
    assert_eq!(
        error("a_3x3x3_uint8.raw", &[0; 28]),
        "a_3x3x3_uint8.raw: the file has 28 bytes, expected 27 (3 x 3 x 3 uint8 and 0 bytes of header); correct the dimensions, the type or the number of header bytes"
    );
    assert_eq!(
        error("a_3x3x3_uint8.raw", &[0; 26]),
        "a_3x3x3_uint8.raw: found 26 bytes of data, expected 27 bytes (3 x 3 x 3 uint8); the file is cut short or its header is wrong"
    );
    assert_eq!(
        error("a.raw", &[0; 26]),
        "a.raw: `dims` is not known, expected a description of the raw data; name the file like name_256x256x128_uint8.raw, put a .json file with \"dims\" and \"type\" beside it, or give dimensions and type as options"
    );
    assert_eq!(
        error("a.nii", &fixture("nifti/type_int16_le.nii")[..100]),
        "a.nii: found 100 bytes of header, expected 348 bytes; the file is cut short or its header is wrong"
    );
}

#[test]
fn damage_is_told_from_truncation() {
    let mut damaged = fixture("nrrd/encoding_gzip.nrrd");
    let trailer = damaged.len() - 8;
    damaged[trailer] ^= 1;
    let text = error("a.nrrd", &damaged);
    let expected = "the gzip data are damaged: corrupt gzip stream does not have a matching checksum";
    assert!(text.starts_with("a.nrrd: byte ") && text.ends_with(expected), "{text}");
    let text = error("a.nrrd", &nrrd("encoding: raw", "encoding: ascii"));
    assert!(text.contains("the text data are damaged: \"\\0\\0"), "{text}");
    assert_eq!(
        error("a.nrrd", &nrrd("3 4 5\nencoding: raw", "3000 400 50\nencoding: gzip")),
        "a.nrrd: byte 94: the gzip data are damaged: what the file has left of them cannot hold the 114.4 MiB that its header claims"
    );
}

#[test]
fn data_files_are_named_with_what_is_wrong_about_them() {
    assert_eq!(
        error("h.nhdr", &nrrd("endian: little", "endian: little\ndata file: ../secret.raw")),
        "h.nhdr: line 7: the data file \"../secret.raw\" leads out of the header's folder; data files must lie in the header's folder or below: move it there and name it without a path"
    );
    assert_eq!(
        error("h.nhdr", &nrrd("endian: little", "endian: little\ndata file: gone.raw")),
        "cannot open gone.raw: no such file; the header names it as its data file: put it beside the header"
    );
    assert_eq!(
        error("h.mhd", &meta("LOCAL", "s%02d.raw 1 4 1")),
        "h.mhd: line 5: `ElementDataFile` is \"s%02d.raw 1 4 1\", expected a range of 5 numbers, one for each slice, not of 4"
    );
}

#[test]
fn repairs_and_remains_are_noted() {
    let plain = ReadOptions::default();
    assert_eq!(
        notices("a.nii", &fixture("nifti/float32_nonfinite.nii"), &plain)[..2],
        [
            "1 values are NaN: cells that touch them show nothing".to_owned(),
            "2 voxels that are infinite, or out of all proportion to the others, replaced by -2131.97900390625 or \
             1841.8897705078125"
                .to_owned()
        ]
    );
    let longer = [nrrd("", ""), vec![0; 7]].concat();
    assert_eq!(notices("a.nrrd", &longer, &plain), ["a.nrrd goes on after its data: 7 bytes ignored"]);
    assert_eq!(
        notices("a.nii", &fixture("nifti/four_d.nii"), &plain),
        ["volume 0 of 3 taken (numbered from 0); choose with the volume index"]
    );
}

#[test]
fn a_volume_of_a_series_is_the_one_asked_for() {
    let read = |name: &str, bytes: &[u8], i| {
        read_volume_bytes(name, bytes, &MemoryFolder::new(), &index(i)).unwrap().value.value_clamped(1, 0, 0)
    };
    let header = "type: uint8\ndimension: 4\nencoding: raw\n";
    let behind =
        [format!("NRRD0004\n{header}sizes: 2 1 1 3\n\n").as_bytes(), &[0, 1, 10, 11, 20, 21]].concat();
    let kinds = "kinds: list domain domain domain\n";
    let before =
        [format!("NRRD0004\n{header}{kinds}sizes: 3 2 1 1\n\n").as_bytes(), &[0, 10, 20, 1, 11, 21]].concat();
    let text = String::from_utf8_lossy(&before[..before.len() - 6]).replace("raw", "ascii");
    let ascii = [text.as_bytes(), b"0 10 20 1 11 21"].concat();
    for i in 0..3 {
        let expected = 10.0 * i as f64 + 1.0;
        assert_eq!(read("a.nrrd", &behind, i), expected);
        assert_eq!(read("a.nrrd", &before, i), expected);
        assert_eq!(read("a.nrrd", &ascii, i), expected);
    }
}

#[test]
fn options_describe_raw_data_over_their_name_and_their_side_file() {
    let mut folder = MemoryFolder::new();
    let json = br#"{"size": [2, 2, 1], "type": "uint8", "spacing": [1, 1, 3], "name": "x"}"#;
    folder.insert("x_variant_2x2x1_uint8.json".to_owned(), b"{\"header_bytes\": 4}".to_vec());
    folder.insert("y.json".to_owned(), json.to_vec());
    let spacing = |name: &str, bytes: &[u8], raw: RawOptions| {
        let options = ReadOptions { raw, ..ReadOptions::default() };
        let volume = read_volume_bytes(name, bytes, &folder, &options).unwrap().value;
        (volume.dimensions().to_array(), volume.spacing().z, volume.value_clamped(0, 0, 0))
    };
    let none = RawOptions::default();
    // The side file adds a header to what the name says.
    assert_eq!(
        spacing("x_variant_2x2x1_uint8.raw", &[9, 9, 9, 9, 1, 2, 3, 4], none.clone()),
        ([2, 2, 1], 1.0, 1.0)
    );
    // A variant's name leads to the data set's side file where both agree, and not where they do not.
    assert_eq!(spacing("y_small_2x2x1_uint8.raw", &[1, 2, 3, 4], none.clone()), ([2, 2, 1], 3.0, 1.0));
    assert_eq!(spacing("y_small_2x1x2_uint8.raw", &[1, 2, 3, 4], none).1, 1.0);
    let given = RawOptions {
        dims: Some([1, 1, 2]),
        voxel_type: Some(VoxelType::U16),
        big_endian: Some(true),
        spacing: Some([1.0, 1.0, 2.0]),
        ..RawOptions::default()
    };
    assert_eq!(spacing("y.raw", &[1, 2, 3, 4], given.clone()), ([1, 1, 2], 2.0, 258.0));
    // Options make a volume of any file, whatever it is called.
    assert_eq!(spacing("plain", &[1, 2, 3, 4], given), ([1, 1, 2], 2.0, 258.0));
}
