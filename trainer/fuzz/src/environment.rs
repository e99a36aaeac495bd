//! A panorama, Radiance or OpenEXR: it is refused, or has the pixels that it should. (What light they give is
//! no question of bytes, and takes a thousand times as long.)

use crate::{Folder, refused};
use glimpse_trainer::render::Image;

const MOST_PIXELS: usize = 1 << 25;

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    let name = match bytes.starts_with(b"#?") {
        true => "felt.hdr",
        false => "felt.exr",
    };
    let path = folder.write(name, bytes);
    match Image::read_panorama(&path) {
        Ok(image) => {
            assert_eq!(image.pixels.len(), image.width * image.height);
            assert!(image.pixels.len() <= MOST_PIXELS);
        }
        Err(error) => refused(&error, name),
    }
}
