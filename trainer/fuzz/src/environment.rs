//! Check of panoramas as Radiance or OpenEXR: the reader rejects a file, or returns the right number of pixels.
//!
//! The conversion to an environment is not checked: it takes a thousand times as long and does not parse bytes.

use crate::{Folder, check_refusal};
use glimpse_trainer::render::Image;

/// The reader's limit.
const MAX_PIXELS: usize = 1 << 25;

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
            assert!(image.pixels.len() <= MAX_PIXELS);
        }
        Err(error) => check_refusal(&error, name),
    }
}
