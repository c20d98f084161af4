//! Pictures to files and back.

use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::tonemap::srgb_encode;
use girandole_reference::image_file::{read, read_environment, read_exr, write_exr, write_png};
use std::path::{Path, PathBuf};

/// A folder of a test's own, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("girandole-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for temporary files");
        Self(path)
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).expect("readable");
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn picture() -> Image {
    let pixel = |i: usize| Vec3::new(i as f32 * 1e-4, (i as f32).sin() * 1e5, -1.0 / (i as f32 + 1.0));
    Image { width: 37, height: 23, pixels: (0..37 * 23).map(pixel).collect() }
}

#[test]
fn exr_keeps_every_bit() {
    let folder = Folder::new("exr");
    let path = folder.0.join("a.exr");
    let mut image = picture();
    image.pixels[3] = Vec3::new(f32::INFINITY, f32::MIN_POSITIVE / 8.0, f32::MAX);
    write_exr(&path, &image).expect("written");
    assert_eq!(read_exr(&path).expect("read"), image);
    assert_eq!(read(&path).expect("read"), image);
    let bytes = std::fs::read(&path).expect("bytes");
    // Again, over the old one: the same bytes, and nothing else lies there.
    write_exr(&path, &image).expect("written");
    assert_eq!(std::fs::read(&path).expect("bytes"), bytes);
    assert_eq!(folder.names(), ["a.exr"]);
}

#[test]
fn exr_of_other_makers() {
    use exr::prelude::*;
    let folder = Folder::new("makers");
    let path = folder.0.join("half.exr");
    let channels = SpecificChannels::build()
        .with_channel("G")
        .with_channel("Z")
        .with_channel("B")
        .with_channel("A")
        .with_channel("R")
        .with_pixel_fn(|at: exr::math::Vec2<usize>| {
            let half = |x: f32| f16::from_f32(x);
            (half(0.5), 7.0f32, at.x() as f32, half(1.0), half(at.y() as f32))
        });
    exr::image::Image::from_channels((5, 4), channels).write().to_file(&path).expect("written");
    let image = read_exr(&path).expect("read");
    assert_eq!((image.width, image.height), (5, 4));
    assert_eq!(image.pixels[2 * 5 + 3], Vec3::new(2.0, 0.5, 3.0));

    let grey = SpecificChannels::build().with_channel("Y").with_pixel_fn(|_| (0.3f32,));
    exr::image::Image::from_channels((5, 4), grey).write().to_file(&path).expect("written");
    assert_eq!(read_exr(&path).expect("read").pixels, [Vec3::splat(0.3); 20]);

    let depths = SpecificChannels::build().with_channel("Z").with_pixel_fn(|_| (1.0f32,));
    exr::image::Image::from_channels((5, 4), depths).write().to_file(&path).expect("written");
    let sentence = read_exr(&path).expect_err("no colour").to_string();
    assert!(sentence.contains("R, G and B, or Y, but has Z"), "{sentence}");
}

#[test]
fn png_is_srgb() {
    let folder = Folder::new("png");
    let path = folder.0.join("a.png");
    let bytes: Vec<u8> = (0..7 * 5 * 3).map(|i| (i * 2) as u8).collect();
    write_png(&path, 7, 5, &bytes).expect("written");
    let image = read(&path).expect("read");
    assert_eq!((image.width, image.height), (7, 5));
    let encoded: Vec<u8> = image
        .pixels
        .iter()
        .flat_map(|p| p.to_array())
        .map(|x| (srgb_encode(x) * 255.0).round() as u8)
        .collect();
    assert_eq!(encoded, bytes);
    assert!((image.pixels[31].x - 0.4910).abs() < 1e-3, "{}", image.pixels[31]);
    assert_eq!(folder.names(), ["a.png"]);
}

#[test]
fn errors_are_sentences_and_leave_nothing() {
    let folder = Folder::new("errors");
    let at = |name: &str| folder.0.join(name);
    let sentence = read_exr(&at("none.exr")).expect_err("missing").to_string();
    assert!(sentence.starts_with("cannot read") && sentence.contains("none.exr"), "{sentence}");
    assert!(read(Path::new("a.jpg")).expect_err("unknown").to_string().contains(".exr and .png"));

    // What is cut or spoilt is refused or read, never a panic.
    write_exr(&at("good.exr"), &picture()).expect("written");
    write_png(&at("good.png"), 3, 3, &[9; 27]).expect("written");
    let (exr, png) =
        (std::fs::read(at("good.exr")).expect("bytes"), std::fs::read(at("good.png")).expect("bytes"));
    for (good, name) in [(&exr, "bad.exr"), (&png, "bad.png")] {
        for cut in [0, 1, 7, 20, good.len() / 3, good.len() / 2, good.len() - 15] {
            std::fs::write(at(name), &good[..cut]).expect("written");
            assert!(read(&at(name)).is_err(), "{name} cut at {cut}");
        }
        for i in 0..good.len().min(400) {
            let mut spoilt = good.clone();
            spoilt[i] ^= 0x5a;
            std::fs::write(at(name), &spoilt).expect("written");
            let _ = read(&at(name));
        }
        std::fs::remove_file(at(name)).expect("removed");
    }

    // Writing to a name that is a folder, into a folder that is not there, and values that are no picture.
    std::fs::create_dir(at("taken.exr")).expect("folder");
    std::fs::write(at("taken.exr").join("full"), "").expect("written");
    let sentence = write_exr(&at("taken.exr"), &picture()).expect_err("a folder").to_string();
    assert!(sentence.starts_with("cannot write"), "{sentence}");
    assert!(write_exr(&at("no/where.exr"), &picture()).is_err());
    assert!(write_exr(&at("empty.exr"), &Image::default()).is_err());
    assert!(write_png(&at("short.png"), 3, 3, &[0; 26]).is_err());
    let mut names = folder.names();
    names.sort();
    assert_eq!(names, ["good.exr", "good.png", "taken.exr"]);
}

#[test]
fn radiance_pictures_are_read_as_they_are() {
    let folder = Folder::new("hdr");
    let path = folder.0.join("a.hdr");
    // Mantissas and an exponent that is 128 more than theirs, plain and run by run.
    let head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
    let plain = [&head[..], b"-Y 1 +X 2\n", &[128, 64, 0, 129], &[255, 1, 128, 136]].concat();
    std::fs::write(&path, &plain).expect("written");
    let image = read_environment(&path, &|_| {}).map(|read| read.0).expect("a picture");
    assert_eq!((image.width, image.height), (2, 1));
    let wanted = [Vec3::new(1.0, 0.5, 0.0), Vec3::new(255.0, 1.0, 128.0)];
    for (found, wanted) in image.pixels.iter().zip(wanted) {
        assert!(found.abs_diff_eq(wanted, 0.005 * wanted.max_element()), "{found} for {wanted}");
    }
    let rows = [128, 64, 32, 129].map(|value| [128 + 16, value]).concat();
    std::fs::write(
        &path,
        [&head[..], b"-Y 8 +X 16\n", &[&[2, 2, 0, 16][..], &rows].concat().repeat(8)].concat(),
    )
    .expect("written");
    let image = read_environment(&path, &|_| {}).map(|read| read.0).expect("a picture");
    assert!(
        image.pixels.iter().all(|p| p.abs_diff_eq(Vec3::new(1.0, 0.5, 0.25), 0.005)),
        "{:?}",
        image.pixels
    );
    // What is cut off, or no such picture.
    for bad in [&plain[..plain.len() - 3], &head[..], b"hello"] {
        std::fs::write(&path, bad).expect("written");
        assert!(read_environment(&path, &|_| {}).map(|read| read.0).is_err(), "{} bytes", bad.len());
    }
    assert!(read_environment(&folder.0.join("a.png"), &|_| {}).is_err());
}
