//! Round trips, foreign files and hostile files.

mod hostile;

use proptest::{collection::vec, prelude::*};

use super::*;

fn encoded(image: &Image, format: ImageFormat, bit_depth: BitDepth) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_image(image, format, bit_depth, &mut bytes).unwrap();
    bytes
}

fn decoded(bytes: &[u8], format: ImageFormat) -> Result<Image, DecodeImageError> {
    decode_image(bytes, format, &ImageLimits::default())
}

/// A 5 x 3 image with every kind of pixel, and depths with gaps.
fn sample() -> Image {
    let pixel = |i: usize| {
        let alpha = (i % 5) as f32 / 4.0;
        [alpha * (i as f32 / 15.0), alpha * 0.5, alpha * (1.0 - i as f32 / 15.0), alpha]
    };
    let depth = |i: usize| if i % 4 == 3 { f32::INFINITY } else { 100.0 + i as f32 };
    Image::new(5, 3, (0..15).map(pixel).collect()).unwrap().with_depth((0..15).map(depth).collect()).unwrap()
}

fn bits(pixels: &[[f32; 4]]) -> Vec<[u32; 4]> {
    pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

/// Any float: NaN with any payload, infinities, subnormals, -0.
fn any_float() -> impl Strategy<Value = f32> + Clone {
    any::<u32>().prop_map(f32::from_bits)
}

fn any_image<T: std::fmt::Debug>(
    value: impl Strategy<Value = T> + Clone,
) -> impl Strategy<Value = (u32, u32, Vec<[T; 4]>)> {
    let pixel = [value.clone(), value.clone(), value.clone(), value];
    (1u32..12, 1u32..40).prop_flat_map(move |(width, height)| {
        let count = (width * height) as usize;
        vec(pixel.clone(), count).prop_map(move |pixels| (width, height, pixels))
    })
}

/// Premultiplied pixels whose colours do not exceed their alpha.
fn tame_image() -> impl Strategy<Value = Image> {
    any_image(0f32..=1.0).prop_map(|(width, height, pixels)| {
        let premultiply = |[r, g, b, a]: [f32; 4]| [r * a, g * a, b * a, a];
        Image::new(width, height, pixels.into_iter().map(premultiply).collect()).unwrap()
    })
}

fn largest_difference(a: &Image, b: &Image) -> f64 {
    cutaway_core::image::compare::compare(a, b).unwrap().largest_difference
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Half a step of colour times alpha and half a step of alpha times colour are at most one step; float error besides.
    #[test]
    fn png_keeps_premultiplied_values_within_a_step(image in tame_image()) {
        let eight = decoded(&encoded(&image, ImageFormat::Png, BitDepth::Eight), ImageFormat::Png).unwrap();
        prop_assert!(largest_difference(&image, &eight) <= 1.0 / 255.0 + 1e-6);
        let sixteen = decoded(&encoded(&image, ImageFormat::Png, BitDepth::Sixteen), ImageFormat::Png).unwrap();
        prop_assert!(largest_difference(&image, &sixteen) <= 1.0 / 65535.0 + 1e-6);
    }

    #[test]
    fn png_keeps_its_own_integers((width, height, pixels) in any_image(any::<u16>())) {
        let image = Image::from_straight_u16(width, height, &pixels).unwrap();
        let back = decoded(&encoded(&image, ImageFormat::Png, BitDepth::Sixteen), ImageFormat::Png).unwrap();
        let visible = pixels.iter().map(|p| if p[3] == 0 { [0; 4] } else { *p }).collect::<Vec<_>>();
        prop_assert_eq!(back.to_straight_u16(), visible);
    }

    #[test]
    fn exr_and_npy_keep_every_bit(
        (width, height, pixels) in any_image(any_float()),
        distance in any_float(),
    ) {
        let image = Image::new(width, height, pixels).unwrap();
        let depth: Vec<_> = (0..image.pixels().len()).map(|i| distance * i as f32).collect();
        let npy = decoded(&encoded(&image, ImageFormat::Npy, BitDepth::Eight), ImageFormat::Npy).unwrap();
        prop_assert_eq!((npy.width(), npy.height()), (width, height));
        prop_assert_eq!(bits(npy.pixels()), bits(image.pixels()));

        let flat = decoded(&encoded(&image, ImageFormat::Exr, BitDepth::Eight), ImageFormat::Exr).unwrap();
        prop_assert_eq!(bits(flat.pixels()), bits(image.pixels()));
        prop_assert!(flat.depth().is_none());

        let image = image.with_depth(depth).unwrap();
        let exr = decoded(&encoded(&image, ImageFormat::Exr, BitDepth::Eight), ImageFormat::Exr).unwrap();
        prop_assert_eq!((exr.width(), exr.height()), (width, height));
        prop_assert_eq!(bits(exr.pixels()), bits(image.pixels()));
        let depth_bits = |image: &Image| image.depth().unwrap().iter().map(|d| d.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(depth_bits(&exr), depth_bits(&image));
    }
}

#[test]
fn formats_are_known_by_extension() {
    let format = |name: &str| ImageFormat::from_path(Path::new(name));
    assert_eq!(format("a/b.PNG"), Ok(ImageFormat::Png));
    assert_eq!(format("b.exr"), Ok(ImageFormat::Exr));
    assert_eq!(format("b.png.npy"), Ok(ImageFormat::Npy));
    let message = format("a/b.bmp").unwrap_err().to_string();
    assert_eq!(message, "'a/b.bmp': '.bmp' is not an image format; known are .png, .exr and .npy");
    assert!(format("png").unwrap_err().to_string().contains("a name without an extension"));
}

#[test]
fn files_are_written_and_read() {
    let folder = tempfile::tempdir().unwrap();
    for format in ImageFormat::ALL {
        let path = folder.path().join("image").with_extension(format.extension());
        write_image(&path, &sample(), BitDepth::Sixteen).unwrap();
        assert!(largest_difference(&read_image(&path).unwrap(), &sample()) < 1.0 / 65535.0);
        write_depth(&path, &sample()).unwrap();
    }
    let path = folder.path().join("missing.png");
    let message = read_image(&path).unwrap_err().to_string();
    assert!(message.contains("missing.png"), "{message}");
    let flat = Image::filled(1, 1, [0.0; 4]).unwrap();
    let message = write_depth(&path, &flat).unwrap_err().to_string();
    assert_eq!(message, format!("cannot write '{}': the image has no depth", path.display()));
    assert!(!path.exists());

    let path = folder.path().join("image.png");
    let limits = ImageLimits { file_bytes: 20, ..ImageLimits::default() };
    let message = read_image_within(&path, &limits).unwrap_err().to_string();
    assert!(message.contains("longer than the limit of 20 bytes"), "{message}");
    std::fs::rename(&path, folder.path().join("image.exr")).unwrap();
    let message = read_image(&folder.path().join("image.exr")).unwrap_err().to_string();
    let expected = "not an OpenEXR file: it begins with [89 50 4e 47], expected [76 2f 31 01]";
    assert!(message.ends_with(expected), "{message}");
}

#[test]
fn png_is_straight_and_signed() {
    let bytes = encoded(&sample(), ImageFormat::Png, BitDepth::Eight);
    let mut reader = ::png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let mut pixels = [0; 60];
    reader.next_frame(&mut pixels).unwrap();
    let info = reader.info();
    assert_eq!((info.color_type, info.bit_depth), (::png::ColorType::Rgba, ::png::BitDepth::Eight));
    let text = &info.uncompressed_latin1_text[0];
    assert_eq!((text.keyword.as_str(), text.text.as_str()), ("Software", "cutaway"));
    // Pixel 3: straight 0.2, 0.5, 0.8, alpha 0.75. Pixel 5 has no alpha.
    assert_eq!(pixels[12..16], [51, 128, 204, 191]);
    assert_eq!(pixels[20..24], [0; 4]);
}

#[test]
fn png_depth_states_its_range() {
    let mut bytes = Vec::new();
    encode_depth(&sample(), ImageFormat::Png, &mut bytes).unwrap();
    let mut reader = ::png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let mut samples = [0; 30];
    reader.next_frame(&mut samples).unwrap();
    let text = |keyword: &str| {
        let chunks = &reader.info().uncompressed_latin1_text;
        chunks.iter().find(|chunk| chunk.keyword == keyword).map(|chunk| chunk.text.clone())
    };
    assert_eq!(text("DepthMinimum").as_deref(), Some("100"));
    assert_eq!(text("DepthMaximum").as_deref(), Some("114"));
    let samples: Vec<_> = samples.as_chunks().0.iter().map(|&s| u16::from_be_bytes(s)).collect();
    // The depths are 100, 101, 102, none, ..., 114.
    assert_eq!(samples[..4], [0, 4681, 9362, png::NO_DEPTH]);
    assert_eq!(samples[14], 65534);

    let nothing = Image::filled(2, 1, [0.0; 4]).unwrap().with_depth(vec![f32::INFINITY, f32::NAN]).unwrap();
    encode_depth(&nothing, ImageFormat::Png, &mut Vec::new()).unwrap();
    let flat = Image::filled(2, 1, [0.0; 4]).unwrap().with_depth(vec![7.0, 7.0]).unwrap();
    let mut bytes = Vec::new();
    encode_depth(&flat, ImageFormat::Png, &mut bytes).unwrap();
    assert_eq!(decoded(&bytes, ImageFormat::Png).unwrap().pixels(), [[0.0, 0.0, 0.0, 1.0]; 2]);
}

#[test]
fn depth_arrays_are_what_numpy_expects() {
    let mut bytes = Vec::new();
    encode_depth(&sample(), ImageFormat::Npy, &mut bytes).unwrap();
    assert_eq!(&bytes[..10], b"\x93NUMPY\x01\x00\x76\x00");
    assert!(bytes[10..].starts_with(b"{'descr': '<f4', 'fortran_order': False, 'shape': (3, 5), }  "));
    assert_eq!((bytes[127], bytes.len()), (b'\n', 128 + 60));
    assert_eq!(bytes[128..132], 100f32.to_le_bytes());
    let back = decoded(&bytes, ImageFormat::Npy).unwrap();
    assert_eq!(back.pixel(3, 0), Some([f32::INFINITY, f32::INFINITY, f32::INFINITY, 1.0]));
}

/// Written by NumPy 2.4: `np.save(f, (np.arange(6).reshape(1, 2, 3) / 4).astype('<f8'))`.
#[test]
fn an_array_from_numpy_is_read() {
    let mut bytes =
        b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2, 3), }".to_vec();
    bytes.resize(127, b' ');
    bytes.push(b'\n');
    bytes.extend((0..6).flat_map(|i| (f64::from(i) / 4.0).to_le_bytes()));
    let image = decoded(&bytes, ImageFormat::Npy).unwrap();
    assert_eq!((image.width(), image.height()), (2, 1));
    assert_eq!(image.pixels(), [[0.0, 0.25, 0.5, 1.0], [0.75, 1.0, 1.25, 1.0]]);
}

#[test]
fn every_kind_of_png_is_read() {
    use ::png::{BitDepth::*, ColorType::*, Encoder};
    let read = |color, depth, palette: Option<&[u8]>, transparent: Option<&[u8]>, data: &[u8]| {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if let Some(palette) = palette {
            encoder.set_palette(palette);
        }
        if let Some(transparent) = transparent {
            encoder.set_trns(transparent);
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        decoded(&bytes, ImageFormat::Png).unwrap().pixels().to_vec()
    };
    let (black, white) = ([0.0, 0.0, 0.0, 1.0], [1.0; 4]);
    assert_eq!(read(Grayscale, One, None, None, &[0b0100_0000]), [black, white]);
    assert_eq!(read(Grayscale, Eight, None, None, &[0, 255]), [black, white]);
    assert_eq!(read(Grayscale, Eight, None, Some(&[0, 0]), &[0, 255]), [[0.0; 4], white]);
    assert_eq!(read(Grayscale, Sixteen, None, None, &[0, 0, 255, 255]), [black, white]);
    assert_eq!(read(GrayscaleAlpha, Eight, None, None, &[255, 51, 0, 255]), [[0.2; 4], black]);
    assert_eq!(read(Rgb, Eight, None, None, &[51, 102, 255, 0, 0, 0]), [[0.2, 0.4, 1.0, 1.0], black]);
    assert_eq!(read(Rgba, Sixteen, None, None, &[255; 16]), [white; 2]);
    let palette = [255, 0, 0, 0, 255, 0];
    let found = read(Indexed, Two, Some(&palette), Some(&[255, 51]), &[0b0001_0000]);
    assert_eq!(found, [[1.0, 0.0, 0.0, 1.0], [0.0, 0.2, 0.0, 0.2]]);
}

/// What other programs write: tiles, half floats, grey, extra channels, several parts.
#[test]
fn every_kind_of_exr_is_read() {
    use ::exr::prelude::*;
    let size = (20, 33);
    let sample = |x: usize, y: usize| (x + 20 * y) as f32 / 1024.0;
    let check = |bytes: Vec<u8>| {
        let image = decoded(&bytes, ImageFormat::Exr).unwrap();
        assert_eq!((image.width(), image.height()), (20, 33));
        for (i, pixel) in image.pixels().iter().enumerate() {
            // Multiples of 2^-10 below 1 are exact in half.
            assert_eq!(*pixel, [sample(i % 20, i / 20); 4], "pixel {i}");
        }
    };
    let half = |Vec2(x, y): Vec2<usize>| {
        let v = f16::from_f32(sample(x, y));
        (v, v, v, v, 7u32)
    };
    let channels = || {
        let rgba = SpecificChannels::build().with_channel("R").with_channel("G").with_channel("B");
        rgba.with_channel("A").with_channel("id").with_pixel_fn(half)
    };
    for compression in [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::PIZ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 16))] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let layer = Layer::new(size, LayerAttributes::named("beauty"), encoding, channels());
            let mut bytes = std::io::Cursor::new(Vec::new());
            ::exr::prelude::Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
            check(bytes.into_inner());
        }
    }
    let grey = SpecificChannels::build()
        .with_channel("Y")
        .with_channel("A")
        .with_pixel_fn(|Vec2(x, y)| (sample(x, y), sample(x, y)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    ::exr::prelude::Image::from_channels(size, grey).write().to_buffered(&mut bytes).unwrap();
    check(bytes.into_inner());
}

#[test]
fn an_exr_without_colours_names_its_channels() {
    let mut bytes = Vec::new();
    encode_depth(&sample(), ImageFormat::Exr, &mut bytes).unwrap();
    let message = decoded(&bytes, ImageFormat::Exr).unwrap_err().to_string();
    assert!(message.contains("found the channels Z; expected R, G and B, or Y"), "{message}");
}
