//! The spectrum of a fit: each band with the model and the recipe of the fit in RGB.

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::model::ModelKind;
use glimpse_materials::{BandValues, Bands};
use rayon::prelude::*;

use super::readings::{Readings, known_readings};
use crate::linear::{Posterior, PosteriorReading};

/// Fits each band of the used readings. `known` are the readings of the posterior.
///
/// # Errors
/// If a fit fails as it would on a device.
pub(super) fn fit_bands(
    readings: &Readings,
    posterior: &Posterior,
    known: &[PosteriorReading],
) -> Result<Bands, Error> {
    let Readings {
        recipe,
        samples,
        rows,
        ..
    } = readings;
    let of_known = known_readings(samples);
    let values = of_known.iter().map(|sample| &samples[*sample].bands[..]);
    let posterior = posterior.of_bands(known, &values.collect::<Vec<_>>());
    let model = recipe.file.recipe().model();
    let fit = |band: usize| {
        // The fit of Linear is the expected material.
        if model == ModelKind::Linear {
            return Ok(posterior.coefficients_of(band));
        }
        let (posterior, readings) = posterior.with_red(band, known);
        let exact = posterior.exact(&readings);
        let outcome = recipe.scan(&posterior, &mut |sample, _| {
            let sample = usize::from(sample);
            samples.get(sample)?.used()?;
            let known = of_known.binary_search(&sample).ok()?;
            exact.get(known).copied()
        })?;
        Ok(outcome.values)
    };
    let wavelengths = rows.wavelengths.clone();
    let bands = (0..wavelengths.len()).into_par_iter().map(fit);
    let bands: Vec<Vec<f32>> = bands.collect::<Result<_, Error>>()?;
    // The last group repeats the last band.
    let values = bands.chunks(Bands::per_fit(model)).map(|group| {
        let last = group.len() - 1;
        let lists = (0..Bands::per_fit(model)).map(|band| &group[band.min(last)][..]);
        lists.collect::<Vec<_>>().concat()
    });
    let values = BandValues {
        values: values.collect(),
        wavelengths,
    };
    let bands = Bands::new(values, model, recipe.basis_of(&posterior).as_deref());
    bands.ok_or(Error::new(ErrorCode::Diverged))
}
