//! Light from all directions in files: every dialect of both formats, and what is no light in them.

use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, LineOrder, SmallVec, Vec2, WritableImage,
};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::scene::Environment;
use girandole_reference::image_file::{read_environment, read_exr};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

fn case(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests/reference/cases", name].iter().collect()
}

fn open(path: &Path) -> Result<(Image, Vec<String>), String> {
    read_environment(path, &|_| {}).map_err(|error| error.to_string())
}

/// What is read of bytes in a file of its own.
fn read(bytes: &[u8], extension: &str) -> Result<(Image, Vec<String>), String> {
    let folder = std::env::temp_dir();
    let number = std::sync::atomic::AtomicU32::fetch_add(&NUMBER, 1, std::sync::atomic::Ordering::Relaxed);
    let path = folder.join(format!("girandole-light-{}-{number}.{extension}", std::process::id()));
    std::fs::write(&path, bytes).expect("written");
    let read = open(&path);
    std::fs::remove_file(&path).expect("removed");
    read
}

static NUMBER: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);

fn mean(image: &Image) -> Vec3 {
    image.pixels.iter().sum::<Vec3>() / image.pixels.len() as f32
}

#[test]
fn a_window_of_an_environment_is_a_part_of_it() {
    let [crop, full] = ["window_crop.exr", "window_full.exr"].map(|name| open(&case(name)).expect(name));
    assert_eq!((crop.0.width, crop.0.height), (64, 32));
    assert_eq!(crop, full);
    assert_eq!(read_exr(&case("window_crop.exr")).expect("a picture"), full.0);
}

#[test]
fn dialects_are_read() {
    let [magic, crlf] = ["rgbe_magic.hdr", "crlf.hdr"].map(|name| open(&case(name)).expect(name));
    assert_eq!(magic, crlf);
    assert!(mean(&magic.0).min_element() > 0.0 && magic.1.is_empty());
    let (gray, said) = open(&case("y_only.exr")).expect("gray");
    assert!(gray.pixels.iter().all(|p| p.x == p.y && p.x == p.z) && mean(&gray).x > 0.0 && said.is_empty());
    let (layer, said) = open(&case("layer_names.exr")).expect("a layer");
    assert!(mean(&layer).min_element() > 0.0 && said.is_empty());
    let (mended, said) = open(&case("inf_negative.exr")).expect("mended");
    assert!(mended.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
    assert!(said[0].contains("inf_negative.exr") && said[0].contains("replaced"), "{said:?}");
    for (image, _) in [magic, (layer, Vec::new()), (mended, Vec::new()), (gray, Vec::new())] {
        Environment::new(image).expect("an environment");
    }
}

/// The header of a Radiance picture, and a pixel whose mantissas are its place.
fn hdr(head: &str, size: &str) -> Vec<u8> {
    let pixels = (1..=8_u8).flat_map(|i| [i * 16, 0, 0, 128]);
    head.bytes().chain(size.bytes()).chain(pixels).collect()
}

#[test]
fn radiance_pictures_of_any_orientation_are_upright() {
    let head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
    let places = |image: &Image| image.pixels.iter().map(|p| (p.x * 16.0).round() as u32).collect::<Vec<_>>();
    for (size, wanted) in [
        ("-Y 2 +X 4\n", [1, 2, 3, 4, 5, 6, 7, 8]),
        ("+Y 2 +X 4\n", [5, 6, 7, 8, 1, 2, 3, 4]),
        ("-Y 2 -X 4\n", [4, 3, 2, 1, 8, 7, 6, 5]),
        ("+Y 2 -X 4\r\n", [8, 7, 6, 5, 4, 3, 2, 1]),
        ("+X 4 -Y 2\n", [1, 3, 5, 7, 2, 4, 6, 8]),
        ("-X 4 +Y 2\n", [8, 6, 4, 2, 7, 5, 3, 1]),
    ] {
        let (image, _) = read(&hdr(head, size), "hdr").expect(size);
        assert_eq!((image.width, image.height, &places(&image)[..]), (4, 2, &wanted[..]), "{size}");
    }
}

#[test]
fn headers_of_radiance_pictures_are_read() {
    let size = "-Y 2 +X 4\n";
    let plain = read(&hdr("#?RADIANCE\n\n", size), "hdr").expect("a picture").0;
    for head in [
        "#?RGBE\nFORMAT=32-bit_rle_rgbe\nGAMMA=1\n\n",
        "#?AUTOPANO11\r\nPRIMARIES=0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n",
        "# made by hand\nFORMAT=32-bit_rle_rgbe\n\n",
        "#?RADIANCE\nFORMAT = 32-bit_rle_rgbe\npfilt -x 4\nVIEW= -vth\n",
    ] {
        assert_eq!(read(&hdr(head, size), "hdr").expect(head).0, plain, "{head}");
    }
    let (exposed, _) =
        read(&hdr("#?RADIANCE\nEXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 2 1\n\n", size), "hdr").expect("one");
    for (a, b) in exposed.pixels.iter().zip(&plain.pixels) {
        assert!((*a * Vec3::new(8.0, 16.0, 8.0)).abs_diff_eq(*b, 1e-6), "{a} {b}");
    }
    for (bytes, word) in [
        (hdr("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n", size), "xyze"),
        (hdr("#?RADIANCE\nEXPOSURE=0\n\n", size), "exposure"),
        (hdr("hello\n\n", size), "no readable Radiance file"),
        (hdr("#?RADIANCE\n\n", "-Y 0 +X 4\n"), "no readable Radiance file"),
        (hdr("#?RADIANCE\n\n", "-Y 3 +X 4\n"), "twice as wide"),
        (hdr("#?RADIANCE\n\n", "-Y 4 +X 8\n"), "line 2 of 4"),
        (hdr("#?RADIANCE\n\n", "-Y 4096 +X 8192\n"), "line 1 of 4096"),
        ([&b"#?RADIANCE\n\n-Y 100000 +X 200000\n"[..], &[0; 400_000]].concat(), "2^28"),
    ] {
        let said = read(&bytes, "hdr").expect_err(word);
        assert!(said.contains(word) && !said.contains('\n'), "{said}");
    }
}

#[test]
fn runs_of_every_kind_are_read() {
    let head = b"#?RADIANCE\n\n-Y 8 +X 16\n";
    let old_row = [&[128, 64, 32, 129][..], &[1, 1, 1, 3], &[64, 64, 64, 129], &[1, 1, 1, 11]].concat();
    let channel = |values: [u8; 2]| [vec![128 + 4, values[0], 12], vec![values[1]; 12]].concat();
    let new_row =
        [vec![2, 2, 0, 16], channel([128, 64]), channel([64, 64]), channel([32, 64]), channel([129, 129])]
            .concat();
    let [old, new] =
        [old_row, new_row].map(|row| read(&[&head[..], &row.repeat(8)].concat(), "hdr").expect("one").0);
    assert_eq!(old, new);
    assert_eq!((old.pixels[3], old.pixels[4]), (Vec3::new(1.0, 0.5, 0.25), Vec3::splat(0.5)));
    // A run of more than 255 pixels, in two steps.
    let long = [
        &b"#?RADIANCE\n\n-Y 300 +X 600\n"[..],
        &[[128, 128, 128, 129, 1, 1, 1, 87, 1, 1, 1, 2]; 300].concat(),
    ]
    .concat();
    assert!(read(&long, "hdr").expect("one").0.pixels.iter().all(|p| *p == Vec3::ONE));
    // Runs that are too long, and rows of another length.
    for row in [[2, 2, 0, 16, 128 + 17, 1, 1, 1], [2, 2, 0, 15, 128 + 15, 1, 1, 1], [2, 2, 0, 16, 0, 1, 1, 1]]
    {
        assert!(read(&[&head[..], &row.repeat(8)].concat(), "hdr").is_err(), "{row:?}");
    }
}

#[test]
fn large_pictures_are_reduced_to_what_is_used() {
    // Rows of runs: 16384 × 8192 pixels in a few megabytes, bright on the left half.
    let row = |left: u8| {
        let runs =
            |value: u8| [255, value].repeat(64).into_iter().chain([128 + 64, value]).collect::<Vec<u8>>();
        let channel = |value: u8, other: u8| [runs(value), runs(other)].concat();
        [vec![2, 2, 64, 0], channel(left, 64).repeat(3), channel(129, 129)].concat()
    };
    let bytes = [&b"#?RADIANCE\n\n-Y 8192 +X 16384\n"[..], &row(128).repeat(8192)].concat();
    let shares = std::cell::RefCell::new(Vec::new());
    let path = std::env::temp_dir().join(format!("girandole-large-{}.hdr", std::process::id()));
    std::fs::write(&path, &bytes).expect("written");
    let read = read_environment(&path, &|share| shares.borrow_mut().push(share));
    std::fs::remove_file(&path).expect("removed");
    let (image, _) = read.expect("a picture");
    assert_eq!((image.width, image.height), (8192, 4096));
    let is_right = |(i, p): (usize, &Vec3)| *p == Vec3::splat(if i % 8192 < 8192 / 2 { 1.0 } else { 0.5 });
    assert!(image.pixels.iter().enumerate().all(is_right));
    let shares = shares.into_inner();
    assert!(
        shares.len() > 50 && shares.is_sorted() && shares.iter().all(|share| (0.0..=1.0).contains(share))
    );
}

/// A layer of channels, each with its samples, of 8 × 4 pixels or of another window.
fn layer(
    name: Option<&str>,
    (width, height): (usize, usize),
    position: [i32; 2],
    channels: Vec<(&str, FlatSamples)>,
    encoding: Encoding,
) -> Layer<AnyChannels<FlatSamples>> {
    let attributes = LayerAttributes {
        layer_position: Vec2(position[0], position[1]),
        ..name.map_or_else(LayerAttributes::default, LayerAttributes::named)
    };
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples));
    Layer::new((width, height), attributes, encoding, AnyChannels::sort(channels.collect()))
}

/// A file of layers whose display window is 8 × 4 pixels from a place.
fn exr_file(start: [i32; 2], layers: Vec<Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let window = IntegerBounds::new((start[0], start[1]), (8_usize, 4_usize));
    let attributes = ImageAttributes::new(window);
    let image = exr::image::Image::from_layers(attributes, SmallVec::<[_; 2]>::from_vec(layers));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).expect("written");
    bytes.into_inner()
}

/// Radiance that tells where a pixel is.
fn place(x: i32, y: i32) -> f32 {
    (x + 10 * y + 1000) as f32
}

fn floats(size: (usize, usize), at: [i32; 2], factor: f32) -> FlatSamples {
    let pixels =
        (0..(size.0 * size.1) as i32).map(|i| (i % size.0 as i32 + at[0], i / size.0 as i32 + at[1]));
    FlatSamples::F32(pixels.map(|(x, y)| place(x, y) * factor).collect())
}

fn colors(size: (usize, usize), at: [i32; 2]) -> Vec<(&'static str, FlatSamples)> {
    vec![("R", floats(size, at, 1.0)), ("G", floats(size, at, 2.0)), ("B", floats(size, at, 3.0))]
}

#[test]
fn windows_lie_anywhere() {
    for start in [[0, 0], [-3, 7]] {
        for (size, at) in [((8, 4), [0, 0]), ((3, 2), [2, 1]), ((20, 11), [-5, -3]), ((6, 9), [-4, 2])] {
            let window = [start[0] + at[0], start[1] + at[1]];
            let bytes =
                exr_file(start, vec![layer(None, size, window, colors(size, at), Encoding::UNCOMPRESSED)]);
            let (image, _) = read(&bytes, "exr").expect("a picture");
            assert_eq!((image.width, image.height), (8, 4));
            for (i, pixel) in (0..).zip(&image.pixels) {
                let (x, y) = (i % 8, i / 8);
                let is_there =
                    x >= at[0] && x < at[0] + size.0 as i32 && y >= at[1] && y < at[1] + size.1 as i32;
                let wanted = if is_there { Vec3::new(1.0, 2.0, 3.0) * place(x, y) } else { Vec3::ZERO };
                assert_eq!(*pixel, wanted, "{start:?} {size:?} {at:?} {x} {y}");
            }
        }
    }
}

#[test]
fn pixels_of_every_kind_are_read() {
    use exr::image::Blocks;
    let size = (8, 4);
    let wanted = read(
        &exr_file([0, 0], vec![layer(None, size, [0, 0], colors(size, [0, 0]), Encoding::UNCOMPRESSED)]),
        "exr",
    )
    .expect("a picture");
    for compression in
        [Compression::RLE, Compression::ZIP1, Compression::ZIP16, Compression::PIZ, Compression::Uncompressed]
    {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 4)), Blocks::Tiles(Vec2(5, 3))] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let bytes = exr_file([0, 0], vec![layer(None, size, [0, 0], colors(size, [0, 0]), encoding)]);
            assert_eq!(read(&bytes, "exr").expect("a picture"), wanted, "{compression} {blocks:?}");
        }
    }
    let halves = (0..32).map(|i| exr::prelude::f16::from_f32(i as f32)).collect();
    let channels = vec![
        ("R", FlatSamples::F16(halves)),
        ("G", FlatSamples::U32((0..32).collect())),
        ("B", floats(size, [0, 0], 1.0)),
    ];
    let (mixed, _) =
        read(&exr_file([0, 0], vec![layer(None, size, [0, 0], channels, Encoding::UNCOMPRESSED)]), "exr")
            .expect("one");
    assert_eq!(mixed.pixels[31], Vec3::new(31.0, 31.0, place(7, 3)));
}

#[test]
fn the_layer_that_is_the_picture_is_chosen() {
    let size = (8, 4);
    let one = |value: f32| FlatSamples::F32(vec![value; 32]);
    let triple = |prefix: &str, value: f32| ["R", "G", "B"].map(|c| (format!("{prefix}{c}"), one(value)));
    let file = |channels: &[(String, FlatSamples)]| {
        let channels = channels.iter().map(|(name, samples)| (name.as_str(), samples.clone())).collect();
        exr_file([0, 0], vec![layer(None, size, [0, 0], channels, Encoding::UNCOMPRESSED)])
    };
    let with =
        |more: Vec<(String, FlatSamples)>, base: [(String, FlatSamples); 3]| [base.to_vec(), more].concat();
    let extra = vec![("A".to_owned(), one(0.5)), ("Z".into(), one(9.0)), ("N.X".into(), one(-1.0))];
    for (channels, wanted, notes) in [
        (with(extra.clone(), triple("", 2.0)), 2.0, 0),
        (with(extra.clone(), triple("diffuse.", 2.0)), 2.0, 0),
        (with(triple("diffuse.", 3.0).to_vec(), triple("", 2.0)), 2.0, 0),
        (with(triple("albedo.", 3.0).to_vec(), triple("beauty.", 2.0)), 2.0, 1),
        (with(triple("aa.", 3.0).to_vec(), triple("View.Combined.", 2.0)), 2.0, 1),
        (vec![("Y".into(), one(4.0)), ("A".into(), one(1.0))], 4.0, 0),
        (vec![("lum.Y".into(), one(4.0)), ("N.X".into(), one(1.0)), ("N.Y".into(), one(9.0))], 4.0, 0),
    ] {
        let (image, said) = read(&file(&channels), "exr").expect("a picture");
        assert!(image.pixels.iter().all(|p| *p == Vec3::splat(wanted)), "{:?}", image.pixels[0]);
        assert_eq!(said.len(), notes, "{said:?}");
    }
    // Parts of a file.
    let part = |name, value: f32| {
        let channels = ["R", "G", "B"].map(|c| (c, one(value))).to_vec();
        layer(Some(name), size, [0, 0], channels, Encoding::SMALL_LOSSLESS)
    };
    let depth = layer(Some("depth"), size, [0, 0], vec![("Z", one(1.0))], Encoding::SMALL_LOSSLESS);
    let (image, said) = read(&exr_file([0, 0], vec![depth, part("b", 5.0)]), "exr").expect("a picture");
    assert!(image.pixels[0] == Vec3::splat(5.0) && said.is_empty());
    for (channels, word) in [
        (vec![("Y".to_owned(), one(1.0)), ("RY".into(), one(0.0)), ("BY".into(), one(0.0))], "chroma"),
        (vec![("X".into(), one(1.0)), ("Y".into(), one(0.0)), ("Z".into(), one(0.0))], "needs the channels"),
        (vec![("R".into(), one(1.0))], "but has R"),
    ] {
        let said = read(&file(&channels), "exr").expect_err(word);
        assert!(said.contains(word), "{said}");
    }
}

#[test]
fn what_is_no_light_is_replaced_and_counted() {
    let size = (8, 4);
    let mut red = vec![2.0; 32];
    (red[0], red[1], red[2], red[3]) = (f32::NAN, f32::INFINITY, -1.0, 70_000.0);
    let channels = vec![
        ("R", FlatSamples::F32(red)),
        ("G", FlatSamples::F32(vec![1.0; 32])),
        ("B", FlatSamples::F32(vec![1.0; 32])),
    ];
    let bytes = exr_file([0, 0], vec![layer(None, size, [0, 0], channels, Encoding::UNCOMPRESSED)]);
    let (image, said) = read(&bytes, "exr").expect("a picture");
    let reds: Vec<f32> = image.pixels[..5].iter().map(|p| p.x).collect();
    assert_eq!(reds, [0.0, 70_000.0, 0.0, 70_000.0, 2.0]);
    assert!(
        image.pixels.iter().all(|p| p.y == 1.0) && said.len() == 1 && said[0].contains("3 pixels"),
        "{said:?}"
    );
}

#[test]
fn broken_files_are_refused_in_a_sentence() {
    let size = (8, 4);
    let whole =
        exr_file([0, 0], vec![layer(None, size, [0, 0], colors(size, [0, 0]), Encoding::SMALL_LOSSLESS)]);
    let gray = std::fs::read(case("crlf.hdr")).expect("a file");
    let mut state = 7_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let (mut opened, mut refused) = (0, 0);
    for (bytes, extension) in [(&whole, "exr"), (&gray, "hdr")] {
        for round in 0..1500 {
            let mut bytes =
                bytes[..bytes.len() - if round % 4 == 0 { random(bytes.len()) } else { 0 }].to_vec();
            for _ in 0..=random(3) {
                if !bytes.is_empty() {
                    // Headers are where it hurts.
                    let at = if round % 2 == 0 { random(bytes.len()) } else { random(bytes.len().min(420)) };
                    bytes[at] = random(256) as u8;
                }
            }
            let result = catch_unwind(AssertUnwindSafe(|| read(&bytes, extension)));
            match result.unwrap_or_else(|_| panic!("{extension}, round {round}")) {
                Ok((image, _)) => {
                    opened += 1;
                    assert!(image.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
                }
                Err(said) => {
                    refused += 1;
                    assert!(said.len() < 700, "{said}");
                }
            }
        }
    }
    assert!(opened > 100 && refused > 100, "{opened} {refused}");
    // Truncated anywhere.
    for length in 0..whole.len() {
        assert!(read(&whole[..length], "exr").is_err(), "{length}");
    }
}
