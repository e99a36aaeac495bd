//! Check of panoramas in Radiance format: the reader rejects a file, or returns width times height pixels.
//!
//! The conversion to an environment is not checked. It takes a thousand times as long and does not parse bytes.

use crate::{Folder, check_rejection};
use glimpse_trainer::render::Image;

/// Maximum number of pixels that the reader accepts.
const MAX_PIXELS: usize = 1 << 25;

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let folder = Folder::new();
    let path = folder.write("input.hdr", bytes);
    match Image::read_panorama(&path) {
        Ok(image) => {
            assert_eq!(image.pixels.len(), image.width * image.height);
            assert!(image.pixels.len() <= MAX_PIXELS);
        }
        Err(error) => check_rejection(&error, "input.hdr"),
    }
}
