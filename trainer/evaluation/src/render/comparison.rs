//! Photographs of a ball, compared with those of a fit.

use glimpse_fitting::photo::{Light, Photograph, PixelUse};
use glimpse_materials::Brdf;

use super::sheet::{displayed, level, sheet};
use super::{Image, Picture, photograph};

/// The factor of differences in the picture.
const GAIN: f64 = 8.0;

/// Returns the mean |difference| in levels of 8 bits, of f cos(theta_i) up to 1 with a gamma of 2.2, and that of ln(1 + f cos),
/// over the used pixels of a photograph.
fn errors(taken: &Photograph, fit: &Image) -> [f64; 2] {
    let uses = taken.uses();
    let used = (0..uses.len()).filter(|pixel| uses[*pixel] == Some(PixelUse::Used));
    let pairs = used.flat_map(|pixel| {
        let fit = fit.pixels[pixel].map(f64::from);
        taken.radiance(pixel).into_iter().zip(fit)
    });
    let errors = pairs.map(|(taken, fit)| {
        let loss = taken.max(0.0).ln_1p() - fit.max(0.0).ln_1p();
        [255.0 * (level(taken) - level(fit)), loss].map(f64::abs)
    });
    mean(&errors.collect::<Vec<_>>())
}

fn mean(errors: &[[f64; 2]]) -> [f64; 2] {
    let sum = |part: usize| errors.iter().map(|errors| errors[part]).sum::<f64>();
    [0, 1].map(|part| sum(part) / errors.len() as f64)
}

/// Compares photographs with those of a fit. Returns for each, and then on average, the mean |difference| in levels of 8 bits, of
/// f cos(theta_i) up to 1 with a gamma of 2.2, and that of ln(1 + f cos(theta_i)), over used pixels.
///
/// The picture has a row for each of the first 12: photograph, fit, and 8 times their difference at used pixels, with this gamma.
pub fn compare_photographs(photographs: &[Photograph], fit: &dyn Brdf) -> (Vec<[f64; 2]>, Picture) {
    let fitted = photographs.iter().map(|one| {
        let light = Light {
            intensity: None,
            ..one.light
        };
        let size = [one.picture.width, one.picture.height];
        photograph(fit, &one.ball, &light, size, 1)
    });
    let fitted: Vec<Image> = fitted.collect();
    let pairs = photographs.iter().zip(&fitted);
    let mut all: Vec<[f64; 2]> = pairs.map(|(taken, fit)| errors(taken, fit)).collect();
    all.push(mean(&all));
    let uses: Vec<_> = photographs.iter().map(Photograph::uses).collect();
    let picture = sheet(photographs, 3, |tile, image, pixel, _| {
        let taken = photographs[image].radiance(pixel);
        let fit = fitted[image].pixels[pixel].map(f64::from);
        let difference = |channel: usize| (level(taken[channel]) - level(fit[channel])).abs();
        match tile {
            0 => displayed(taken),
            1 => displayed(fit),
            _ if uses[image][pixel] != Some(PixelUse::Used) => [0; 3],
            _ => [0, 1, 2].map(|channel| (255.0 * GAIN * difference(channel)) as u8),
        }
    });
    (all, picture)
}
