//! Files that lie: nothing panics, nothing large is allocated, every message says what is wrong.

use super::*;

fn npy(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

fn npy_error(header: &str) -> String {
    decoded(&npy(header, &[0; 16]), ImageFormat::Npy).unwrap_err().to_string()
}

/// Every format and depth of the sample image.
fn samples() -> Vec<(ImageFormat, Vec<u8>)> {
    let mut files: Vec<_> =
        ImageFormat::ALL.map(|format| (format, encoded(&sample(), format, BitDepth::Eight))).into();
    files.push((ImageFormat::Png, encoded(&sample(), ImageFormat::Png, BitDepth::Sixteen)));
    files
}

#[test]
fn every_truncation_is_an_error() {
    for (format, bytes) in samples() {
        assert!(decoded(&bytes, format).is_ok());
        for length in 0..bytes.len() {
            let result = decoded(&bytes[..length], format);
            assert!(result.is_err(), "{format} cut off after {length} of {} bytes was read", bytes.len());
        }
    }
}

#[test]
fn an_array_with_more_data_than_it_says_is_refused() {
    let mut bytes = encoded(&sample(), ImageFormat::Npy, BitDepth::Eight);
    bytes.push(0);
    let message = decoded(&bytes, ImageFormat::Npy).unwrap_err().to_string();
    let expected = "NPY at byte 128: found 241 bytes of data, expected 240 (3 x 5 x 4 numbers of 4 bytes)";
    assert_eq!(message, expected);
}

#[test]
fn lying_array_headers_are_refused_by_field() {
    let with = |descr: &str, order: &str, shape: &str| {
        npy_error(&format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n"))
    };
    let shape = |shape: &str| with("'<f4'", "False", shape);
    let cases = [
        (shape("(18446744073709551615, 4, 4)"), "exceed the limit of 134217728 pixels"),
        (shape("(4294967296, 4294967296, 4)"), "exceed the limit"),
        (shape("(18446744073709551616, 4, 4)"), "shape: found a number of more than 64 bits"),
        (shape("(100000, 1000, 4)"), "found 16 bytes of data, expected 1600000000"),
        (shape("(0, 99999999999)"), "found 16 bytes of data, expected 0"),
        (shape("(-1, 4)"), "shape: found '-', expected a number"),
        (shape("(2, 2, 2)"), "shape: found [2, 2, 2], expected [height, width, 4]"),
        (shape("(4,)"), "shape: found [4], expected"),
        (shape("()"), "shape: found [], expected"),
        (shape("(1, 1, 1, 1, 1)"), "shape: more than three axes"),
        (shape("None"), "found 'N', expected '('"),
        (with("'>f4'", "False", "(1, 1, 4)"), "descr: found '>f4', expected '<f4' or '<f8'"),
        (with("'|O'", "False", "(1, 1, 4)"), "descr: found '|O'"),
        (with("[('a', '<f4')]", "False", "(1, 1)"), "descr: found '[', expected a string"),
        (with("'<f4'", "True", "(1, 1, 4)"), "fortran_order: found True, expected False"),
        (with("'<f4'", "0", "(1, 1, 4)"), "fortran_order: found '0', expected False"),
        (npy_error("{'descr': '<f4', 'descr': '<f4'}"), "the key 'descr' is there twice"),
        (npy_error("{'fortran_order': False, 'shape': (1, 1, 4)}"), "the key 'descr' is missing"),
        (npy_error("{'descr': '<f4', 'fortran_order': False}"), "the key 'shape' is missing"),
        (npy_error("{'color': 1}"), "found the key 'color'"),
        (npy_error("{'descr: 1}"), "found a string without an end"),
        (npy_error("{} {"), "found '{' after the dictionary"),
        (npy_error(""), "found the end, expected '{'"),
    ];
    for (message, expected) in cases {
        assert!(message.contains(expected), "'{message}' lacks '{expected}'");
        assert!(!message.contains('\n'));
    }
    let mut newer = npy("{}", &[]);
    newer[6] = 9;
    let message = decoded(&newer, ImageFormat::Npy).unwrap_err().to_string();
    assert_eq!(message, "NPY at byte 6: found version 9.0, expected 1.0, 2.0 or 3.0");
    // No data are expected and none are there: still no image.
    let empty = npy("{'descr': '<f4', 'fortran_order': False, 'shape': (0, 5), }", &[]);
    assert!(matches!(decoded(&empty, ImageFormat::Npy), Err(DecodeImageError::Image(_))));
}

#[test]
fn longer_array_headers_are_read() {
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    let header = "{\"shape\" : (1,1,), 'fortran_order':False,'descr':'<f4'}\n";
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(0.5f32.to_le_bytes());
    assert_eq!(decoded(&bytes, ImageFormat::Npy).unwrap().pixels(), [[0.5, 0.5, 0.5, 1.0]]);
    bytes[8..12].fill(0xff);
    let message = decoded(&bytes, ImageFormat::Npy).unwrap_err().to_string();
    assert!(message.contains("ends within the header"), "{message}");
}

#[test]
fn sizes_are_checked_before_anything_is_allocated() {
    let limits = ImageLimits { pixels: 14, ..ImageLimits::default() };
    for (format, bytes) in samples() {
        let message = decode_image(&bytes, format, &limits).unwrap_err().to_string();
        assert_eq!(message, "5 x 3 pixels exceed the limit of 14 pixels");
    }
    // A PNG of 4 billion columns and rows, its header with a right checksum.
    let mut bytes = encoded(&sample(), ImageFormat::Png, BitDepth::Eight);
    bytes[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let checksum = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    let message = decoded(&bytes, ImageFormat::Png).unwrap_err().to_string();
    assert!(message.contains("exceed the limit"), "{message}");
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}

/// Replaces four bytes of the data window (x minimum, y minimum, x maximum, y maximum) in both of its places.
fn with_window(bytes: &[u8], values: [i32; 4]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let window: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    for name in [b"dataWindow\0box2i\0".as_slice(), b"displayWindow\0box2i\0"] {
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        bytes[at..at + 16].copy_from_slice(&window);
    }
    bytes
}

#[test]
fn lying_exr_windows_are_refused() {
    let bytes = encoded(&sample(), ImageFormat::Exr, BitDepth::Eight);
    assert!(decoded(&with_window(&bytes, [0, 0, 4, 2]), ImageFormat::Exr).is_ok());
    let extremes = [i32::MIN, i32::MIN + 1, -(1 << 30), -1, 0, 1, 1 << 15, 1 << 30, i32::MAX - 1, i32::MAX];
    for x0 in extremes {
        for y0 in extremes {
            for x1 in extremes {
                for y1 in extremes {
                    assert!(decoded(&with_window(&bytes, [x0, y0, x1, y1]), ImageFormat::Exr).is_err());
                }
            }
        }
    }
}

/// The decoder of DWA allocates what a file asks for; that of B44 panics where overflow is checked.
#[test]
fn lossy_exr_compressions_are_refused() {
    use ::exr::prelude::*;
    for compression in [Compression::B44, Compression::B44A, Compression::DWAA(None), Compression::DWAB(None)]
    {
        let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        let channels = SpecificChannels::rgb(|_| (f16::ONE, f16::ONE, f16::ONE));
        let layer = Layer::new((4, 4), LayerAttributes::named("lossy"), encoding, channels);
        let mut bytes = std::io::Cursor::new(Vec::new());
        ::exr::prelude::Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
        let message = decoded(&bytes.into_inner(), ImageFormat::Exr).unwrap_err().to_string();
        assert!(message.contains("expected none, RLE, ZIP, PIZ or PXR24"), "{message}");
    }
}

#[test]
fn an_exr_too_short_for_its_pixels_is_refused() {
    let bytes = encoded(&sample(), ImageFormat::Exr, BitDepth::Eight);
    let message =
        decoded(&with_window(&bytes, [0, 0, 999_999, 2]), ImageFormat::Exr).unwrap_err().to_string();
    assert!(message.contains("60000000 bytes of 1000000 x 3 pixels cannot be in a file of"), "{message}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// The result does not matter: that there is one does.
    #[test]
    fn damaged_files_never_panic(
        which in 0usize..4,
        damage in vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (format, mut bytes) = SAMPLES.with(|samples| samples[which].clone());
        for (at, value) in damage {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Err(error) = decoded(&bytes, format) {
            prop_assert!(!error.to_string().contains('\n'));
        }
    }
}

thread_local! {
    static SAMPLES: Vec<(ImageFormat, Vec<u8>)> = samples();
}
