//! Pictures by their pixels: files also hold what they were made by, which is another one for any other command.

use girandole_core::image::Image;
use girandole_reference::image_file;

/// Whether the pixels of two files, given by their bytes, differ.
pub fn differ(a: &[u8], b: &[u8]) -> bool {
    decoded(a) != decoded(b)
}

fn decoded(bytes: &[u8]) -> Image {
    let kind = if bytes.starts_with(b"\x89PNG") { ".png" } else { ".exr" };
    let file = tempfile::Builder::new().suffix(kind).tempfile().expect("a temporary file");
    std::fs::write(file.path(), bytes).expect("written");
    image_file::read(file.path()).expect("a picture")
}
