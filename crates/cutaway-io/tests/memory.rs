//! What lying headers make the readers allocate: next to nothing. A test binary of its own, for it watches the
//! allocator.

use std::io::Write;

use cutaway_io::limits::Limits;
use cutaway_io::volume::{MemoryFolder, ReadError, ReadOptions, read_volume_bytes};
use flate2::{Compression, write::GzEncoder, write::ZlibEncoder};
use peak_alloc::PeakAlloc;

#[global_allocator]
static PEAK: PeakAlloc = PeakAlloc;

/// More than any reader needs for buffers and decoders, far less than what the headers here claim.
const ALLOWED: usize = 12 << 20;

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn nrrd(encoding: &str, sizes: &str, more: &str) -> Vec<u8> {
    let count = sizes.split(' ').count();
    format!("NRRD0004\ntype: uint8\ndimension: {count}\nsizes: {sizes}\nencoding: {encoding}\n{more}\n")
        .into_bytes()
}

fn meta(sizes: &str, more: &str) -> Vec<u8> {
    format!("ObjectType = Image\nNDims = 3\nDimSize = {sizes}\nElementType = MET_UCHAR\n{more}ElementDataFile = LOCAL\n")
        .into_bytes()
}

/// A NIfTI-1 header that claims 2048 x 2048 x 2048 uint8 voxels.
fn nifti() -> Vec<u8> {
    let mut header = vec![0u8; 352];
    header[..4].copy_from_slice(&348u32.to_le_bytes());
    for (i, n) in [3i16, 2048, 2048, 2048].into_iter().enumerate() {
        header[40 + 2 * i..42 + 2 * i].copy_from_slice(&n.to_le_bytes());
    }
    header[70..72].copy_from_slice(&2i16.to_le_bytes());
    header[72..74].copy_from_slice(&8i16.to_le_bytes());
    header[108..112].copy_from_slice(&352f32.to_le_bytes());
    header[344..348].copy_from_slice(b"n+1\0");
    header
}

/// Files of a few kilobytes that claim gigabytes, all below the limit.
fn liars() -> Vec<(&'static str, Vec<u8>)> {
    let big = "2048 2048 2048";
    let some = vec![0u8; 100_000];
    // Below the largest ratio of deflate, so that only the data themselves can refute it.
    let plausible = "100 1000 1000";
    let mut million_files = nrrd("raw", "1 1 1048577", "data file: a%d 1 1048577 1");
    million_files.extend_from_slice(&some);
    vec![
        ("a.nii", nifti()),
        ("a.nii", gzip(&[nifti(), some.clone()].concat())),
        ("a.nrrd", [nrrd("raw", big, ""), some.clone()].concat()),
        ("a.nrrd", [nrrd("gzip", big, ""), gzip(&some)].concat()),
        ("a.nrrd", [nrrd("gzip", plausible, ""), gzip(&some)].concat()),
        ("a.nrrd", [nrrd("bzip2", big, ""), b"BZh91AY&SY".to_vec()].concat()),
        ("a.nrrd", [nrrd("ascii", big, ""), b"1 2 3 4".to_vec()].concat()),
        ("a.nrrd", [nrrd("hex", big, ""), b"01020304".to_vec()].concat()),
        ("a.nrrd", [nrrd("raw", "2048 2048 2048 2048", ""), some.clone()].concat()),
        (
            "a.nrrd",
            [nrrd("gzip", "3000000000 2 2 2", "kinds: list domain domain domain\n"), gzip(&some)].concat(),
        ),
        ("a.nrrd", million_files),
        ("a.mha", [meta(big, ""), some.clone()].concat()),
        ("a.mha", [meta(big, "CompressedData = True\n"), zlib(&some)].concat()),
        (
            "a.mha",
            [meta(plausible, "CompressedData = True\nCompressedDataSize = 97000\n"), zlib(&some)].concat(),
        ),
        ("a.mha", [meta(big, "BinaryData = False\n"), b"1 2 3".to_vec()].concat()),
        ("a_2048x2048x2048_uint8.raw", some.clone()),
        ("a_2048x2048x2048_uint8.raw.gz", gzip(&some)),
    ]
}

#[test]
fn nothing_is_allocated_for_data_that_are_not_there() {
    let options = ReadOptions { limits: Limits { max_bytes: 1 << 40 }, ..ReadOptions::default() };
    for (i, (name, bytes)) in liars().into_iter().enumerate() {
        PEAK.reset_peak_usage();
        let before = PEAK.current_usage();
        let result = read_volume_bytes(name, &bytes, &MemoryFolder::new(), &options);
        let used = PEAK.peak_usage() - before;
        let error = result.err().unwrap_or_else(|| panic!("liar {i} ({name}) was read"));
        assert!(used < ALLOWED, "liar {i} ({name}) took {used} bytes: {error}");
    }
    a_bomb_beyond_the_limit_is_refused_before_it_is_decoded();
    a_bomb_within_its_claim_stops_there();
}

/// 64 MiB of zeros in 64 KiB, claimed as they are: more than the limit.
fn a_bomb_beyond_the_limit_is_refused_before_it_is_decoded() {
    let bomb = gzip(&vec![0; 64 << 20]);
    let file = [nrrd("gzip", "1024 1024 64", ""), bomb].concat();
    let options = ReadOptions { limits: Limits { max_bytes: 1 << 20 }, ..ReadOptions::default() };
    PEAK.reset_peak_usage();
    let before = PEAK.current_usage();
    let result = read_volume_bytes("a.nrrd", &file, &MemoryFolder::new(), &options);
    assert!(matches!(result, Err(ReadError::TooLarge { .. })));
    assert!(PEAK.peak_usage() - before < ALLOWED);
}

/// The same bomb with a small claim: what is decoded ends with the claim.
fn a_bomb_within_its_claim_stops_there() {
    let bomb = gzip(&vec![0; 64 << 20]);
    let file = [nrrd("gzip", "64 64 64", ""), bomb].concat();
    PEAK.reset_peak_usage();
    let before = PEAK.current_usage();
    let loaded = read_volume_bytes("a.nrrd", &file, &MemoryFolder::new(), &ReadOptions::default()).unwrap();
    assert_eq!(loaded.value.voxels().len(), 64 * 64 * 64);
    assert_eq!(loaded.notices, ["a.nrrd goes on after its data: the rest ignored"]);
    assert!(PEAK.peak_usage() - before < ALLOWED);
}
