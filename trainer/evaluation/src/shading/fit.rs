//! Fits of shading models by least squares (Levenberg-Marquardt), from several starts.

use std::f64::consts::{PI, TAU};

use glimpse_core::geometry::{Directions, HalfDifference};
use glimpse_materials::{Brdf, Lab, NotFinite, rows};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::cosines::Cosines;
use super::model::{Parameter, Role, Shading, ShadingModel};
use crate::least_squares::Errors;

/// An error of a fit of a shading model.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ShadingError {
    /// The BRDF has a value that is not finite.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    /// No minimization ended with finite errors.
    #[error("no parameters of the shading model were found; convert to another format")]
    Diverged,
}

/// The largest number of directions whose errors are those of the loss.
const LOSS_DIRECTIONS: usize = 512;
/// The number of views: directions of the sensor, each with its own direction of the sun.
const VIEWS: usize = 192;
/// The number of directions to the sky, and to the sun, of each view.
const SKY_DIRECTIONS: usize = 24;
const SUN_DIRECTIONS: usize = 6;
const VIEW_DIRECTIONS: usize = SKY_DIRECTIONS + SUN_DIRECTIONS;
/// The radiance of the sky, and the irradiance of a surface that faces the sun. White diffuse surfaces reflect at most 1.
const SKY: f64 = 0.3;
const SUN: f64 = 2.2;
/// The radius of the sun, radians.
const SUN_RADIUS: f64 = 0.12;
/// A color difference with the weight of an error of 1 of the loss.
const DELTA_E: f64 = 50.0;
/// The number of steps of 1 in values, so that files are short.
const STEPS_OF_VALUES: f64 = 1e5;
/// The smallest change of an error that is an effect: of ln(1 + f cos), or a color difference of 0.005.
const MAX_CHANGE: f64 = 1e-4;

/// Approximates a BRDF by a shading model.
///
/// The errors are those of the [loss](glimpse_materials::loss), and differences of colors of surfaces that a sky and a sun
/// light.
///
/// # Errors
/// [`ShadingError`]
pub fn fit(brdf: &dyn Brdf, model: ShadingModel) -> Result<Shading, ShadingError> {
    let data = Data::new(brdf)?;
    let parameters = model.parameters().iter();
    let bounds: Vec<[f64; 2]> = parameters.map(|parameter| parameter.bounds).collect();
    let errors = Errors {
        count: data.count(),
        write: &|values, errors| data.errors(model, values, errors),
        bounds: &bounds,
        patience: 30,
    };
    let starts = starts(model, data.diffuse(), data.albedo());
    let fits = starts.par_iter().map(|start| errors.minimize(start));
    let best = fits
        .filter(|(error, _)| error.is_finite())
        .min_by(|(one, _), (other, _)| one.total_cmp(other));
    let (_, mut values) = best.ok_or(ShadingError::Diverged)?;
    for value in &mut values {
        *value = (*value * STEPS_OF_VALUES).round() / STEPS_OF_VALUES;
    }
    let values = with_defaults(&data, model, values);
    Ok(Shading { model, values })
}

/// Replaces values by the format's defaults where the errors stay the same, such as the roughness of a coat of weight 0.
fn with_defaults(data: &Data, model: ShadingModel, mut values: Vec<f64>) -> Vec<f64> {
    let errors_of = |values: &[f64]| {
        let mut errors = vec![0.0; data.count()];
        data.errors(model, values, &mut errors);
        errors
    };
    let fitted = errors_of(&values);
    let mut first = 0;
    let parameters = model.parameters();
    for channels in parameters.chunk_by(|one, next| one.name == next.name) {
        let mut changed = values.clone();
        for (value, parameter) in changed[first..].iter_mut().zip(channels) {
            *value = parameter.default;
        }
        let errors = errors_of(&changed);
        let mut pairs = errors.iter().zip(&fitted);
        if pairs.all(|(error, fitted)| (error - fitted).abs() < MAX_CHANGE) {
            values = changed;
        }
        first += channels.len();
    }
    values
}

/// The values of a BRDF at the directions of a fit: those of the loss, then [`VIEW_DIRECTIONS`] of each view.
struct Data {
    at: Vec<Cosines>,
    reference: Vec<[f64; 3]>,
    /// The number of directions of the loss.
    loss_count: usize,
    /// The color of each view.
    colors: Vec<Lab>,
}

impl Data {
    fn new(brdf: &dyn Brdf) -> Result<Self, ShadingError> {
        let loss = loss_directions();
        let loss_count = loss.len();
        let at = [loss, view_directions()].concat();
        let values = brdf.written_values_at(&at)?;
        let reference: Vec<[f64; 3]> = values.into_iter().map(|rgb| rgb.map(f64::from)).collect();
        let at: Vec<Cosines> = at.iter().map(Cosines::of).collect();
        let of_views = at.iter().zip(&reference).skip(loss_count);
        let radiance: Vec<[f64; 3]> = of_views
            .map(|(at, brdf)| brdf.map(|value| at.light * value))
            .collect();
        Ok(Self {
            colors: radiance.chunks(VIEW_DIRECTIONS).map(color).collect(),
            at,
            reference,
            loss_count,
        })
    }

    /// Returns the albedo of a diffuse surface whose BRDF is the lower tercile of the values, for each channel.
    fn diffuse(&self) -> [f64; 3] {
        std::array::from_fn(|channel| {
            let mut values: Vec<f64> = self.reference.iter().map(|rgb| rgb[channel]).collect();
            values.sort_by(f64::total_cmp);
            (PI * values[values.len() / 3]).clamp(0.01, 0.95)
        })
    }

    /// Returns the mean albedo of all views, for each channel.
    fn albedo(&self) -> [f64; 3] {
        let of_views = self.at.iter().zip(&self.reference).skip(self.loss_count);
        let of_sky = of_views.enumerate();
        let of_sky = of_sky.filter(|(index, _)| index % VIEW_DIRECTIONS < SKY_DIRECTIONS);
        [0, 1, 2].map(|channel| {
            let terms = of_sky.clone();
            let sum: f64 = terms.map(|(_, (at, brdf))| at.light * brdf[channel]).sum();
            (TAU * sum / (VIEWS * SKY_DIRECTIONS) as f64).clamp(0.01, 0.95)
        })
    }

    /// Returns the number of errors.
    fn count(&self) -> usize {
        3 * (self.loss_count + VIEWS)
    }

    /// Writes the errors of a model.
    fn errors(&self, model: ShadingModel, values: &[f64], errors: &mut [f64]) {
        let (loss_errors, color_errors) = errors.split_at_mut(3 * self.loss_count);
        let (of_loss, of_views) = self.at.split_at(self.loss_count);
        let radiance = |at: &Cosines| model.brdf(values, at).map(|brdf| at.light * brdf);
        let pairs = of_loss.iter().zip(&self.reference);
        for (errors, (at, reference)) in loss_errors.chunks_exact_mut(3).zip(pairs) {
            let pairs = radiance(at).into_iter().zip(reference);
            for (error, (fitted, reference)) in errors.iter_mut().zip(pairs) {
                *error = fitted.ln_1p() - (at.light * reference).ln_1p();
            }
        }
        let views = of_views.chunks(VIEW_DIRECTIONS).zip(&self.colors);
        for (errors, (at, reference)) in color_errors.chunks_exact_mut(3).zip(views) {
            let radiance: Vec<[f64; 3]> = at.iter().map(radiance).collect();
            errors.copy_from_slice(&color_difference(color(&radiance), *reference));
        }
    }
}

/// Returns the color of a view from the BRDF times the cosine at its directions.
fn color(brdf: &[[f64; 3]]) -> Lab {
    let (sky, sun) = brdf.split_at(SKY_DIRECTIONS);
    let mean = |channel: usize, part: &[[f64; 3]]| {
        part.iter().map(|rgb| rgb[channel]).sum::<f64>() / part.len() as f64
    };
    // The directions to the sky are distributed evenly over solid angles.
    Lab::from_linear(
        [0, 1, 2]
            .map(|channel| (SKY * TAU * mean(channel, sky) + SUN * mean(channel, sun)).min(1.0)),
    )
}

/// Returns the differences of lightness, chroma and hue, with the weights of CIE94.
fn color_difference(color: Lab, reference: Lab) -> [f64; 3] {
    let chroma = reference.a.hypot(reference.b);
    let [cosine, sine] = match chroma > 0.0 {
        true => [reference.a / chroma, reference.b / chroma],
        false => [1.0, 0.0],
    };
    let [a, b] = [color.a - reference.a, color.b - reference.b];
    [
        color.l - reference.l,
        (a * cosine + b * sine) / (1.0 + 0.045 * chroma),
        (b * cosine - a * sine) / (1.0 + 0.015 * chroma),
    ]
    .map(|difference| difference / DELTA_E)
}

/// Returns a subset of the directions of the loss.
fn loss_directions() -> Vec<HalfDifference<f32>> {
    let all = glimpse_materials::loss::coarse_directions();
    let stride = all.len().div_ceil(LOSS_DIRECTIONS);
    let some = all.into_iter().step_by(stride);
    some.map(HalfDifference::from_angles).collect()
}

/// Returns the directions of all views: to the sky, then to the sun. The views are distributed as on a sphere that a distant
/// camera sees. The sun is anywhere above the horizon, but for one view in six around the mirror direction of the sensor.
/// Parts of the sun below the horizon are moved to its center.
fn view_directions() -> Vec<HalfDifference<f32>> {
    let fraction = |index: usize, step: f64| (0.5 + index as f64 * step).fract();
    let of_view = |view: usize| {
        let [u, v, w] = [0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_901]
            .map(|step| fraction(view, step));
        // At least 2.8 degrees above the horizon.
        let sensor = on_sphere((0.0025 + 0.9975 * u).sqrt(), 0.0);
        let sky = (0..SKY_DIRECTIONS).map(|part| {
            let z = 0.02 + 0.98 * (part as f64 + 0.5) / SKY_DIRECTIONS as f64;
            on_sphere(z, TAU * (fraction(part, 0.618_033_988_749) + w))
        });
        let sun = match view.is_multiple_of(6) {
            true => [-sensor[0], sensor[1], sensor[2]],
            false => on_sphere(0.05 + 0.95 * v, TAU * w),
        };
        let sun = (0..SUN_DIRECTIONS).map(|part| {
            let radius = SUN_RADIUS * ((part as f64 + 0.5) / SUN_DIRECTIONS as f64).sqrt();
            let moved = moved(sun, radius, TAU * fraction(part, 0.618_033_988_749));
            if moved[2] > 0.02 { moved } else { sun }
        });
        let directions = sky.chain(sun).map(|incoming| Directions {
            incoming: incoming.map(|x| x as f32),
            outgoing: sensor.map(|x| x as f32),
        });
        directions.collect::<Vec<_>>()
    };
    // Never None: both directions are above the horizon.
    let directions = (0..VIEWS).flat_map(of_view);
    directions
        .filter_map(|directions| HalfDifference::from_directions(&directions))
        .collect()
}

/// Returns a unit vector with this z and azimuth.
fn on_sphere(z: f64, phi: f64) -> [f64; 3] {
    let sine = (1.0 - z * z).sqrt();
    [sine * phi.cos(), sine * phi.sin(), z]
}

/// Returns a unit vector at this angle from `center`, in a direction given by `angle`.
fn moved(center: [f64; 3], radius: f64, angle: f64) -> [f64; 3] {
    let center = Vector3::from(center);
    let across = match center.x.abs() < 0.9 {
        true => center.cross(&Vector3::x()).normalize(),
        false => center.cross(&Vector3::y()).normalize(),
    };
    let along = center.cross(&across);
    let offset = across * angle.cos() + along * angle.sin();
    (center * radius.cos() + offset * radius.sin()).into()
}

/// Returns the starts: diffuse, glossy and metallic surfaces. Metals have the color of the albedo.
fn starts(model: ShadingModel, diffuse: [f64; 3], albedo: [f64; 3]) -> Vec<Vec<f64>> {
    let kinds = rows(include_str!("starts.csv"));
    let start = |(metallic, roughness, coat): (f64, f64, f64)| {
        let mut channels = match metallic > 0.5 {
            true => albedo.into_iter(),
            false => diffuse.into_iter(),
        };
        let value = |parameter: &Parameter| match parameter.role {
            Role::BaseColor => channels.next().unwrap_or(0.5),
            Role::Metallic => metallic,
            Role::Roughness => roughness,
            Role::Coat => coat,
            Role::Other(start) => start,
        };
        model.parameters().iter().map(value).collect()
    };
    kinds.into_iter().map(start).collect()
}

#[cfg(test)]
mod tests {
    use clap::ValueEnum;
    use glimpse_materials::loss::mean_log_error;

    use super::*;

    /// Every model finds its own parameters, or others with the same BRDF.
    #[test]
    fn fit_reproduces_own_brdf() {
        let mut without_coat = 0;
        for &model in ShadingModel::value_variants() {
            for (share, color) in [(0.3, 0.6), (0.6, 0.25)] {
                let parameters = model.parameters().iter();
                let values = parameters.map(|parameter| match parameter.role {
                    Role::BaseColor => color,
                    Role::Coat => 0.0,
                    Role::Metallic | Role::Roughness | Role::Other(_) => {
                        let [min, max] = parameter.bounds;
                        min + share * (max - min)
                    }
                });
                let original = Shading {
                    model,
                    values: values.collect(),
                };
                let fitted = fit(&original, model).expect("the BRDF is finite");
                // A coat of weight 0 has the default roughness.
                let pairs = fitted.values.windows(2).zip(model.parameters().windows(2));
                for (values, parameters) in pairs {
                    if parameters[0].role == Role::Coat && values[0] == 0.0 {
                        assert_eq!(values[1], parameters[1].default);
                        without_coat += 1;
                    }
                }
                let at = loss_directions();
                let loss = mean_log_error(&fitted, &at, &original.values_at(&at));
                assert!(loss < 2e-3, "{model:?} {share}: loss {loss}");
            }
        }
        assert!(without_coat > 0);
    }

    #[test]
    fn rejects_values_that_are_not_finite() {
        let nan = |_: &HalfDifference<f32>| [f32::NAN; 3];
        let result = fit(&nan, ShadingModel::Gltf);
        assert!(matches!(result, Err(ShadingError::NotFinite(_))));
    }
}
