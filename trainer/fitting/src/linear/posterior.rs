//! The Gaussian posterior of a material's coefficients, given readings at any directions: the uncertainty of a fit.
//!
//! It is core's [belief](glimpse_core::fit::belief) about a material, in f64.
//!
//! The evidence scales it: with E the squared Mahalanobis length of the readings under the prior, divided by their number n,
//! all variances are multiplied by (6 + n E) / (6 + n). So a material unlike the training is uncertain.

use std::f64::consts::FRAC_2_PI;
use std::sync::Arc;

use glimpse_core::fit::belief::{Belief, Predicted, belief_length};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::unmap;
use glimpse_core::recipe::Recipe;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::Brdf;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::uniform_valid;

use super::ComponentsAt;

/// The number of readings that the prior's own scale counts as.
const PRIOR_READINGS: f64 = 6.0;
/// The variance of a mapped BRDF that the components do not express. It was chosen on procedural classes and RGL's
/// materials that training did not see.
const MISFIT: f64 = 0.3;
/// The ratio of the bound, which holds for 90 % of materials, to the predicted loss; chosen on the same materials.
const BOUND: f64 = 2.2;
/// The number of directions of a predicted loss.
const LOSS_DIRECTIONS: usize = 256;
/// The seed of these directions.
const LOSS_SEED: u64 = 9;
/// The variance of the channels' mean, relative to that of a channel.
const MEAN_SHARE: f64 = 1.0 / 3.0;

/// The prior of a recipe without a pattern, or of one that was made of it for some directions.
#[derive(Clone, Debug)]
pub struct CoefficientPrior {
    basis: Arc<BasisTable>,
    /// The variances of the coefficients of the mean, and of the differences.
    variance: [Vec<f64>; 2],
    /// The variance of a mapped reading's noise.
    noise: f64,
}

impl CoefficientPrior {
    /// Takes the prior of a recipe. None for recipes with a learned pattern.
    #[must_use]
    pub fn new(recipe: &Recipe<'_>, basis: Arc<BasisTable>) -> Option<Self> {
        let coefficients = recipe.estimator().coefficients()?;
        let noise = f64::from(coefficients.noise?.variance);
        let ridge = coefficients.ridge;
        let precisions = [
            (ridge.precision, noise * MEAN_SHARE),
            (ridge.difference_precision, noise),
        ];
        Some(Self {
            basis,
            variance: precisions.map(|(precision, noise)| {
                let each = precision.iter().map(|p| noise / f64::from(p));
                each.collect()
            }),
            noise,
        })
    }

    /// Returns the standard deviation of the prior's noise over that of a reading with an additional `deviation`, relative
    /// to the reading.
    #[must_use]
    pub fn scale(&self, deviation: f32) -> f32 {
        let variance = self.noise as f32;
        (variance / (variance + deviation * deviation)).sqrt()
    }
}

/// A reading at any direction.
#[derive(Clone, Copy, Debug)]
pub struct PosteriorReading {
    /// The direction, in radians.
    pub angles: Angles<f32>,
    /// The BRDF in linear RGB, sr^-1, not times the cosine.
    pub brdf: [f32; 3],
    /// The standard deviation of the prior's noise, over that of the reading.
    pub scale: f32,
}

impl PosteriorReading {
    /// Creates a reading without noise.
    #[must_use]
    pub fn new(angles: Angles<f32>, brdf: [f32; 3]) -> Self {
        Self {
            angles,
            brdf,
            scale: 1.0,
        }
    }
}

/// The prediction of a reading from the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// The distance of the reading from its expectation, in standard deviations: positive if it is larger. Of the
    /// three channels and their mean, the one of largest magnitude.
    pub z: f64,
    /// The expected BRDF in linear RGB, sr^-1, not times the cosine.
    pub expected: [f32; 3],
    /// The logarithm of the density of the mean of the channels, without a constant.
    log_density: f64,
}

/// The posterior of a material, given readings.
#[derive(Clone, Debug)]
pub struct Posterior {
    pub(super) basis: Arc<BasisTable>,
    pub(super) belief: Belief<f64, Vec<f64>>,
    pub(super) readings: ComponentsAt,
    /// The mapped readings minus the mean of the training, and the variance of their noise.
    targets: Vec<([f64; 3], f64)>,
    /// The variance of the noise of the prior.
    pub(super) noise: f64,
}

impl Posterior {
    /// Computes the posterior. None if a number is not finite.
    #[must_use]
    pub fn new(prior: &CoefficientPrior, readings: &[PosteriorReading]) -> Option<Self> {
        let angles = readings.iter().map(|each| each.angles).collect();
        let at = ComponentsAt::new(&prior.basis, angles);
        let brdf = readings.iter().map(|each| each.brdf.map(|f| f.max(0.0)));
        let [red, green, blue] = at.mapped_channels(&brdf.collect::<Vec<_>>());
        let memory = vec![0.0; belief_length(at.components)];
        let variances = prior.variance.each_ref().map(|list| list.iter().copied());
        let mut belief = Belief::new(variances, memory)?;
        let targets = readings.iter().enumerate().map(|(i, reading)| {
            let noise = prior.noise / f64::from(reading.scale).powi(2);
            (
                [&red, &green, &blue].map(|channel| f64::from(channel[i])),
                noise,
            )
        });
        let targets: Vec<_> = targets.collect();
        for (i, (target, noise)) in targets.iter().enumerate() {
            belief.add(&at.row_f64(i), *target, *noise);
        }
        belief.evidence().is_finite().then(|| Self {
            basis: prior.basis.clone(),
            belief,
            readings: at,
            targets,
            noise: prior.noise,
        })
    }

    /// Returns the factor of all variances, without the evidence of a number of readings.
    fn scale(&self, without: f64, number: usize) -> f64 {
        let evidence = self.belief.evidence() - without;
        (PRIOR_READINGS + evidence.max(0.0))
            / (PRIOR_READINGS + (self.readings.count() - number) as f64)
    }

    /// Predicts each reading from the others.
    #[must_use]
    pub fn left_out(&self) -> Vec<LeftOut> {
        let each = self.targets.iter().enumerate().map(|(i, (target, noise))| {
            let predicted = self.belief.predict(&self.readings.row_f64(i));
            let [mean_variance, difference_variance] = predicted.variance;
            // Without the reading, its rest and variance are divided by 1 - h, with h = q'S q / s.
            let mean_noise = noise * MEAN_SHARE;
            let mean_share = (1.0 - mean_variance / mean_noise).max(1e-6);
            let share = (1.0 - difference_variance / noise).max(1e-6);
            let rest: Vec<f64> = target
                .iter()
                .zip(predicted.expected)
                .map(|(target, expected)| target - expected)
                .collect();
            let mean = rest.iter().sum::<f64>() * MEAN_SHARE;
            let mean_rest = mean / mean_share;
            let rests = [0, 1, 2].map(|channel: usize| (rest[channel] - mean) / share);
            let variance = [mean_noise / mean_share, noise / share];
            let squares = rests.iter().map(|rest| rest * rest);
            let own = mean_rest * mean_rest / variance[0] + squares.sum::<f64>() / variance[1];
            let scale = self.scale(own * MEAN_SHARE, 1);
            let alone = Predicted {
                expected: predicted.expected,
                variance,
            };
            let alone = alone.with_misfit(MISFIT);
            let mean_variance = scale * alone.variance[0];
            let variance = scale * alone.channel_variance();
            let of_mean = mean_rest / mean_variance.sqrt();
            let z = rests.map(|rest| (mean_rest + rest) / variance.sqrt());
            let z = z
                .into_iter()
                .chain([of_mean])
                .max_by(|a, b| a.abs().total_cmp(&b.abs()));
            let (center, weight) = (self.readings.mean[i].value, self.readings.cosines[i].value);
            LeftOut {
                z: z.unwrap_or_default(),
                expected: [0, 1, 2].map(|channel| {
                    let u = target[channel] - mean_rest - rests[channel];
                    unmap(f64::from(center) + u, f64::from(weight)).max(0.0) as f32
                }),
                log_density: -0.5 * (of_mean * of_mean + mean_variance.ln()),
            }
        });
        each.collect()
    }

    /// Returns the mean and the variance of the mapped BRDF at some directions: for each one the three channels, and the
    /// variance of each.
    fn mapped(&self, at: &ComponentsAt) -> Vec<([f64; 3], f64)> {
        let scale = self.scale(0.0, 0);
        let each = at.mean.iter().enumerate().map(|(i, center)| {
            let predicted = self.belief.predict(&at.row_f64(i)).with_misfit(MISFIT);
            let center = f64::from(center.value);
            (
                predicted.expected.map(|each| center + each),
                scale * predicted.channel_variance(),
            )
        });
        each.collect()
    }

    /// Returns the standard deviation of the material from a fitted BRDF at some directions (linear RGB, sr^-1, not times the
    /// cosine).
    #[must_use]
    pub fn deviations(&self, fit: &dyn Brdf, directions: Vec<Angles<f32>>) -> Vec<[f32; 3]> {
        let spreads = self.spreads(Some(fit), directions);
        let each = spreads.into_iter().map(|spread| {
            let deviation = |channel| spread.difference(channel, 1.0, |brdf| brdf) as f32;
            [0, 1, 2].map(deviation)
        });
        each.collect()
    }

    /// Predicts the loss of a fit: the mean of |ln(1 + f cos(theta_i)) - ln(1 + y cos(theta_i))| over all directions, with
    /// y distributed as the posterior.
    #[must_use]
    pub fn loss(&self, fit: &dyn Brdf) -> LossPrediction {
        self.loss_of(Some(fit))
    }

    /// Predicts the loss of a fit, or of the expected material.
    pub(super) fn loss_of(&self, fit: Option<&dyn Brdf>) -> LossPrediction {
        let spreads = self.spreads(fit, uniform_valid(LOSS_DIRECTIONS, LOSS_SEED));
        let losses = spreads.iter().flat_map(|spread| {
            // The mean magnitude of a normal variable.
            let step = FRAC_2_PI.sqrt();
            let logarithm = |brdf: f64| (brdf * spread.cos_theta_i).ln_1p();
            (0..3).map(move |channel| spread.difference(channel, step, logarithm))
        });
        let loss = losses.sum::<f64>() / (3 * spreads.len()) as f64;
        LossPrediction {
            loss: loss as f32,
            bound: Some((BOUND * loss) as f32),
            unlike_training: None,
        }
    }

    /// Returns the posterior at some directions. Without a fit, it is that of the expected material.
    fn spreads(&self, fit: Option<&dyn Brdf>, directions: Vec<Angles<f32>>) -> Vec<Spread> {
        let fitted = fit.map(|fit| {
            let at = directions
                .iter()
                .map(|angles| HalfDifference::from_angles(*angles));
            fit.values_at(&at.collect::<Vec<_>>())
        });
        let at = ComponentsAt::new(&self.basis, directions);
        let mapped = self.mapped(&at).into_iter().enumerate();
        let each = mapped.map(|(i, (mean, variance))| {
            let weight = f64::from(at.cosines[i].value);
            Spread {
                weight,
                cos_theta_i: f64::from(at.cos_theta_i[i]),
                mean,
                deviation: variance.sqrt(),
                fit: match &fitted {
                    Some(fitted) => fitted[i].map(|f| f64::from(f.max(0.0))),
                    None => mean.map(|mapped| unmap(mapped, weight)),
                },
            }
        });
        each.collect()
    }
}

/// The posterior of a BRDF at a direction, and a fit.
struct Spread {
    /// cos(theta_i) cos(theta_o).
    weight: f64,
    cos_theta_i: f64,
    /// The mean of the mapped BRDF.
    mean: [f64; 3],
    /// Its standard deviation.
    deviation: f64,
    /// The fitted BRDF.
    fit: [f64; 3],
}

impl Spread {
    /// Returns the root of the mean squared difference of a function of the BRDF from that of the fit, for BRDFs that are
    /// `step` standard deviations around the mean.
    fn difference(&self, channel: usize, step: f64, function: impl Fn(f64) -> f64) -> f64 {
        let at = |step: f64| {
            let mapped = self.mean[channel] + step * self.deviation;
            function(unmap(mapped, self.weight).max(0.0))
        };
        let bias = at(0.0) - function(self.fit[channel]);
        bias.hypot(0.5 * (at(step) - at(-step)))
    }
}

/// Returns how much better readings predict each other without one of them: the sum of the differences of the logarithms
/// of their densities.
#[must_use]
pub fn gain_without(all: &[LeftOut], index: usize, others: &[LeftOut]) -> f64 {
    let with = all.iter().enumerate().filter(|(i, _)| *i != index);
    let with: f64 = with.map(|(_, each)| each.log_density).sum();
    others.iter().map(|each| each.log_density).sum::<f64>() - with
}

#[cfg(test)]
pub(super) mod tests {
    use glimpse_core::model::linear::map;
    use glimpse_materials::{Material, Procedural};

    use super::*;

    /// Returns the prior of the bundled recipe `linear-any`.
    pub(crate) fn prior() -> CoefficientPrior {
        let recipe = include_bytes!("../../../recipes/any/linear-any.recipe");
        let basis = include_bytes!("../../../recipes/any/linear-any.basis");
        let recipe = Recipe::parse(recipe).expect("a valid recipe");
        let basis = BasisTable::parse(basis).expect("a valid basis");
        CoefficientPrior::new(&recipe, Arc::new(basis)).expect("a recipe without a pattern")
    }

    pub(crate) fn readings(material: &dyn Material, count: usize) -> Vec<PosteriorReading> {
        let angles = uniform_valid(count, 5).into_iter();
        angles
            .map(|angles| PosteriorReading::new(angles, material.at_angles(angles)))
            .collect()
    }

    /// The coefficients are those of the ridge solve in core.
    #[test]
    fn mean_is_the_ridge_solution() {
        let prior = prior();
        for count in [5, 30] {
            let readings = readings(&Procedural::new(3, 7), count);
            let posterior = Posterior::new(&prior, &readings).expect("finite");
            let precision = |part: usize, noise: f64| -> Vec<f32> {
                prior.variance[part]
                    .iter()
                    .map(|variance| (noise / variance) as f32)
                    .collect()
            };
            let precisions = [precision(0, prior.noise / 3.0), precision(1, prior.noise)];
            let brdf: Vec<[f32; 3]> = readings.iter().map(|each| each.brdf).collect();
            let fitted = posterior
                .readings
                .fit_channels([&precisions[0], &precisions[1]], &brdf);
            for (fitted, expected) in fitted.iter().zip(posterior.belief.coefficients()) {
                assert!(
                    (f64::from(*fitted) - expected).abs() < 1e-3,
                    "{fitted} {expected}"
                );
            }
        }
    }

    /// Predictions equal those of posteriors without the reading.
    #[test]
    fn left_out_readings_are_predicted_by_the_others() {
        let prior = prior();
        let all = readings(&Procedural::new(3, 7), 9);
        let left_out = Posterior::new(&prior, &all).expect("finite").left_out();
        for (index, prediction) in left_out.iter().enumerate() {
            let mut others = all.clone();
            let own = others.remove(index);
            let posterior = Posterior::new(&prior, &others).expect("finite");
            let at = ComponentsAt::new(&prior.basis, vec![own.angles]);
            let (mapped, variance) = posterior.mapped(&at)[0];
            let weight = f64::from(at.cosines[0].value);
            for (channel, expected) in prediction.expected.iter().enumerate() {
                let brdf = unmap(mapped[channel], weight).max(0.0) as f32;
                assert!(
                    (brdf - expected).abs() < 1e-4 * (1.0 + brdf),
                    "{brdf} {expected}"
                );
            }
            // The reading has noise, too.
            let variance = variance + posterior.scale(0.0, 0) * prior.noise;
            let z = [0, 1, 2].map(|channel| {
                let u = map(f64::from(own.brdf[channel]), weight);
                (u - mapped[channel]) / variance.sqrt()
            });
            let largest = z.into_iter().map(f64::abs).fold(0.0, f64::max);
            assert!(prediction.z.abs() > 0.999 * largest, "{prediction:?} {z:?}");
        }
    }

    /// More readings reduce the uncertainty, wrong ones and distant fits raise it, and the loss is that of samples.
    #[test]
    fn uncertainty_follows_readings() {
        let prior = prior();
        let material = Procedural::new(3, 7);
        let fit = |at: &HalfDifference<f32>| material.at_angles(glimpse_materials::angles_of(at));
        let loss = |readings: &[PosteriorReading]| {
            f64::from(
                Posterior::new(&prior, readings)
                    .expect("finite")
                    .loss(&fit)
                    .loss,
            )
        };
        let (few, many) = (readings(&material, 4), readings(&material, 60));
        assert!(
            loss(&many) < 0.8 * loss(&few),
            "{} {}",
            loss(&many),
            loss(&few)
        );
        // A wrong reading that is stated to be noise has no influence.
        let mut noisy = many.clone();
        (noisy[0].brdf, noisy[0].scale) = ([99.0; 3], 1e-4);
        let ratio = loss(&noisy) / loss(&many[1..]);
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
        let mut wrong = many.clone();
        for reading in wrong.iter_mut().step_by(2) {
            reading.brdf = reading.brdf.map(|f| 20.0 * f);
        }
        assert!(loss(&wrong) > 1.5 * loss(&many), "{}", loss(&wrong));
        let black = Posterior::new(&prior, &many)
            .expect("finite")
            .loss(&|_: &HalfDifference<f32>| [0.0; 3]);
        assert!(f64::from(black.loss) > 2.0 * loss(&many), "{black:?}");
        assert!(Posterior::new(&prior, &[]).is_some_and(|each| each.loss(&fit).loss.is_finite()));
    }
}
