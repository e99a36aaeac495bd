//! The color difference CIEDE2000 of two pictures.
//!
//! Pixels are the 8-bit sRGB pixels of the written file. The conversion to CIELAB (illuminant D65, observer of 2
//! degrees) uses the constants of scikit-image's `rgb2lab`, so that `deltaE_ciede2000(rgb2lab(a), rgb2lab(b))` gives
//! the same values for the PNG files.

use glimpse_materials::{Lab, ciede2000};

use crate::render::Picture;

/// Returns the mean CIEDE2000 of two pictures of the same size over some of their pixels, 0 or more; 0 for an empty selection.
///
/// `pixels` are indices, row by row from the top left. Indices outside the pictures are ignored.
pub(super) fn mean_ciede2000(
    reference: &Picture,
    picture: &Picture,
    pixels: impl IntoIterator<Item = usize>,
) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for index in pixels {
        let (Some(one), Some(other)) = (reference.pixels.get(index), picture.pixels.get(index))
        else {
            continue;
        };
        count += 1;
        if one != other {
            sum += ciede2000(Lab::from_srgb(*one), Lab::from_srgb(*other));
        }
    }
    sum / count.max(1) as f64
}

/// Returns a picture of the CIEDE2000 of each pixel of two pictures of the same size: black for 0, white for `white`, above
/// 0, and more.
#[must_use]
pub fn color_differences(reference: &Picture, picture: &Picture, white: f64) -> Picture {
    let pixels = reference.pixels.iter().zip(&picture.pixels);
    let gray = pixels.map(|(one, other)| {
        let difference = ciede2000(Lab::from_srgb(*one), Lab::from_srgb(*other));
        [(255.0 * (difference / white).min(1.0)).round() as u8; 3]
    });
    Picture {
        width: reference.width,
        height: reference.height,
        pixels: gray.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_and_white_differ_by_100() {
        let [black, white] = [0, 255].map(|level| Picture::filled(5, 4, [level; 3]));
        let mean = mean_ciede2000(&black, &white, 0..20);
        assert!((mean - 100.0).abs() < 1e-3, "{mean}");
        for pixels in [0..20, 0..0] {
            assert_eq!(mean_ciede2000(&white, &white, pixels), 0.0);
        }
    }
}
