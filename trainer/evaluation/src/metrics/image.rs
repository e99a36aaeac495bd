//! Errors of a picture against a reference: L2, PSNR and DSSIM.
//!
//! They are computed from the 8-bit sRGB pixels of the PNG file, divided by 255, so that other programs can check them.
//! All pixels count, including the background of the sphere. The paper does not state the scale of its values, but its
//! L2 and PSNR agree with each other on this scale. Both pictures have the same size.

use glimpse_materials::lists::add_scaled;

use crate::render::Picture;

/// The side of the SSIM window, in pixels.
const WINDOW: usize = 7;
/// The number of pixels in the window.
const WINDOW_PIXELS: f64 = (WINDOW * WINDOW) as f64;
/// The largest value of a channel.
const PEAK: f64 = 255.0;
/// The SSIM constant (K1 L)^2.
const C1: f64 = (0.01 * PEAK) * (0.01 * PEAK);
/// The SSIM constant (K2 L)^2.
const C2: f64 = (0.03 * PEAK) * (0.03 * PEAK);
/// The largest PSNR, in dB. Without this bound, the PSNR of equal pictures would be infinite, and so would means over
/// it.
const MAX_PSNR: f64 = 100.0;

/// Returns the mean squared difference over pixels and channels, for channels in \[0, 1\].
pub(crate) fn mean_squared_error(reference: &Picture, picture: &Picture) -> f64 {
    let (a, b) = (&reference.pixels, &picture.pixels);
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    let count = pairs.len().max(1) as f64;
    let sum_of_squares: u64 = pairs.map(|(a, b)| u64::from(a.abs_diff(*b)).pow(2)).sum();
    sum_of_squares as f64 / (PEAK * PEAK * count)
}

/// Returns the peak signal-to-noise ratio for a mean squared error in \[0, 1\], at most 100 dB.
pub(crate) fn psnr(mean_squared_error: f64) -> f64 {
    (-10.0 * mean_squared_error.log10()).min(MAX_PSNR)
}

/// Returns the mean structural similarity (Wang et al. 2004), in \[-1, 1\]; 1 for equal pictures.
///
/// The settings are the defaults of scikit-image: a uniform window of 7 x 7, sample variances (divided by 48),
/// K1 = 0.01, K2 = 0.03, only windows inside the picture, and the mean over the channels. NaN below 7 x 7 pixels.
pub(super) fn ssim(reference: &Picture, picture: &Picture) -> f64 {
    let width = reference.width;
    let [rows, columns] = [reference.height, width].map(|side| (side + 1).saturating_sub(WINDOW));
    let mut sum = 0.0;
    for top in 0..rows {
        for left in 0..columns {
            let mut moments = [[0; 5]; 3];
            for row in top..top + WINDOW {
                let range = row * width + left..row * width + left + WINDOW;
                let pixels = reference.pixels[range.clone()]
                    .iter()
                    .zip(&picture.pixels[range]);
                for (a, b) in pixels {
                    for ((moments, a), b) in moments.iter_mut().zip(a).zip(b) {
                        let [a, b] = [*a, *b].map(u32::from);
                        add_scaled(moments, 1, &[a, b, a * a, b * b, a * b]);
                    }
                }
            }
            sum += moments.into_iter().map(similarity).sum::<f64>();
        }
    }
    sum / (3 * columns * rows) as f64
}

/// Returns the SSIM of a window from sums over it, for one channel of two pictures a and b: of the values, their squares and
/// their product.
fn similarity([a, b, aa, bb, ab]: [u32; 5]) -> f64 {
    let [a, b] = [a, b].map(|sum| f64::from(sum) / WINDOW_PIXELS);
    let covariance =
        |sum: u32, u: f64, v: f64| (f64::from(sum) - WINDOW_PIXELS * u * v) / (WINDOW_PIXELS - 1.0);
    let variances = covariance(aa, a, a) + covariance(bb, b, b);
    let covariance_ab = covariance(ab, a, b);
    (2.0 * a * b + C1) * (2.0 * covariance_ab + C2) / ((a * a + b * b + C1) * (variances + C2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_and_opposite_pictures_have_the_smallest_and_the_largest_errors() {
        let [black, white] = [0, 255].map(|level| Picture::filled(7, 7, [level; 3]));
        for (one, other, l2, decibels, similarity) in [
            (&white, &white, 0.0, 100.0, 1.0),
            (&black, &white, 1.0, 0.0, C1 / (PEAK * PEAK + C1)),
        ] {
            let error = mean_squared_error(one, other);
            assert_eq!((error, psnr(error)), (l2, decibels));
            let actual = ssim(one, other);
            assert!((actual - similarity).abs() < 1e-12, "{actual}");
        }
    }
}
