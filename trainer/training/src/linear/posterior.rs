//! The Gaussian posterior of a material's coefficients, given readings at any directions: the uncertainty of a fit.
//!
//! The mean of the channels and their differences from it have a prior each, with variances v of the coefficients, and
//! readings with noise of variance s (s / 3 for the mean). With the components Q at the readings, the posterior covariance
//! of the coefficients is S = (Q'Q / s + diag(1 / v))^-1, and their mean z = S Q't / s.
//!
//! The evidence scales it: with E the squared Mahalanobis length of the readings under the prior, divided by their number n,
//! all variances are multiplied by (6 + n E) / (6 + n). So a material unlike the training is uncertain.

use std::f64::consts::FRAC_2_PI;
use std::sync::Arc;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::unmap;
use glimpse_core::recipe::Recipe;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::Brdf;
use glimpse_materials::basis::Basis;
use glimpse_materials::sampling::uniform_valid;
use nalgebra::{Cholesky, DMatrix, DVector, RowDVector};

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
/// The share of the differences' variance in a channel. The three differences sum to 0.
const DIFFERENCE_SHARE: f64 = 2.0 / 3.0;
/// The variance of the channels' mean, relative to that of a channel.
const MEAN_SHARE: f64 = 1.0 / 3.0;

/// The prior of a recipe without a pattern, or of one that was made of it for some directions.
#[derive(Clone, Debug)]
pub struct CoefficientPrior {
    basis: Arc<Basis>,
    /// The variances of the coefficients of the mean, and of the differences.
    variance: [DVector<f64>; 2],
    /// The variance of a mapped reading's noise.
    noise: f64,
}

impl CoefficientPrior {
    /// Takes the prior of a recipe. None for recipes with a learned pattern.
    #[must_use]
    pub fn new(recipe: &Recipe<'_>, basis: Arc<Basis>) -> Option<Self> {
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
                DVector::from_iterator(precision.len(), each)
            }),
            noise,
        })
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

    /// Creates the reading of a recipe's sample, with the noise that the recipe states.
    #[must_use]
    pub fn of_sample(
        recipe: &Recipe<'_>,
        index: usize,
        angles: Angles<f32>,
        brdf: [f32; 3],
    ) -> Self {
        let coefficients = recipe.estimator().coefficients();
        let scales = coefficients.and_then(|each| each.noise?.scales.iter().nth(index));
        Self {
            scale: scales.unwrap_or(1.0),
            ..Self::new(angles, brdf)
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

/// The posterior of the mean of the channels, or of their differences from it.
#[derive(Clone, Debug)]
struct Part {
    covariance: DMatrix<f64>,
    /// The coefficients: a column for the mean, or for each channel.
    coefficients: DMatrix<f64>,
    /// For each list of targets, and each reading: the rest without the reading, and its variance.
    left_out: Vec<Vec<(f64, f64)>>,
    /// The squared Mahalanobis length of all lists.
    evidence: f64,
}

/// The posterior of a material, given readings.
#[derive(Clone, Debug)]
pub struct Posterior {
    basis: Arc<Basis>,
    parts: [Part; 2],
    readings: ComponentsAt,
    /// The mapped readings minus the mean of the training: a column for each channel.
    targets: DMatrix<f64>,
}

impl Posterior {
    /// Computes the posterior. None without readings, or if a number is not finite.
    #[must_use]
    pub fn new(prior: &CoefficientPrior, readings: &[PosteriorReading]) -> Option<Self> {
        let at = ComponentsAt::new(
            &prior.basis,
            readings.iter().map(|each| each.angles).collect(),
        );
        let brdf: Vec<[f32; 3]> = readings
            .iter()
            .map(|each| each.brdf.map(|f| f.max(0.0)))
            .collect();
        let channels = at.mapped_channels(&brdf);
        let targets = DMatrix::from_fn(at.count(), 3, |i, c| f64::from(channels[c][i]));
        let noise: Vec<f64> = readings
            .iter()
            .map(|each| prior.noise / f64::from(each.scale).powi(2))
            .collect();
        let mean = targets.column_mean();
        let differences = DMatrix::from_fn(at.count(), 3, |i, c| targets[(i, c)] - mean[i]);
        let q = rows(&at);
        let [mean_variance, difference_variance] = &prior.variance;
        let third: Vec<f64> = noise.iter().map(|noise| noise * MEAN_SHARE).collect();
        let means = DMatrix::from_column_slice(at.count(), 1, mean.as_slice());
        Some(Self {
            basis: prior.basis.clone(),
            parts: [
                Part::new(&q, mean_variance, &third, &means)?,
                Part::new(&q, difference_variance, &noise, &differences)?,
            ],
            readings: at,
            targets,
        })
    }

    /// Returns the factor of all variances, without the evidence of a number of readings.
    fn scale(&self, without: f64, number: usize) -> f64 {
        // The mean has one list, the differences have two independent ones.
        let [mean, difference] = &self.parts;
        let evidence = (mean.evidence + difference.evidence - without) / 3.0;
        (PRIOR_READINGS + evidence.max(0.0))
            / (PRIOR_READINGS + (self.readings.count() - number) as f64)
    }

    /// Predicts each reading from the others.
    #[must_use]
    pub fn left_out(&self) -> Vec<LeftOut> {
        let [mean, difference] = &self.parts;
        let each = (0..self.readings.count()).map(|i| {
            let (mean_rest, mean_variance) = mean.left_out[0][i];
            let rests = [0, 1, 2].map(|channel| difference.left_out[channel][i].0);
            let difference_variance = difference.left_out[0][i].1;
            let own = mean_rest * mean_rest / mean_variance
                + rests
                    .iter()
                    .map(|rest| rest * rest / difference_variance)
                    .sum::<f64>();
            let scale = self.scale(own, 1);
            let mean_variance = scale * (mean_variance + MISFIT * MEAN_SHARE);
            let variance =
                mean_variance + scale * (difference_variance + MISFIT) * DIFFERENCE_SHARE;
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
                    let u = self.targets[(i, channel)] - mean_rest - rests[channel];
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
        let q = rows(at);
        let [mean, difference] = &self.parts;
        let scale = self.scale(0.0, 0);
        let each = q.row_iter().zip(&at.mean).map(|(row, center)| {
            let row: RowDVector<f64> = row.into_owned();
            let center = f64::from(center.value) + (&row * &mean.coefficients)[0];
            let differences = &row * &difference.coefficients;
            let variance = mean.variance(&row)
                + MISFIT * MEAN_SHARE
                + (difference.variance(&row) + MISFIT) * DIFFERENCE_SHARE;
            (
                [0, 1, 2].map(|channel| center + differences[channel]),
                scale * variance,
            )
        });
        each.collect()
    }

    /// Returns the standard deviation of the material from a fitted BRDF at some directions (linear RGB, sr^-1, not times the
    /// cosine).
    #[must_use]
    pub fn deviations(&self, fit: &dyn Brdf, directions: Vec<Angles<f32>>) -> Vec<[f32; 3]> {
        let spreads = self.spreads(fit, directions);
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

    fn spreads(&self, fit: &dyn Brdf, directions: Vec<Angles<f32>>) -> Vec<Spread> {
        let at_fit = directions
            .iter()
            .map(|angles| HalfDifference::from_angles(*angles));
        let mut brdf = vec![[0.0; 3]; directions.len()];
        fit.evaluate(&at_fit.collect::<Vec<_>>(), &mut brdf);
        let at = ComponentsAt::new(&self.basis, directions);
        let mapped = self.mapped(&at).into_iter().zip(brdf).enumerate();
        let each = mapped.map(|(i, ((mean, variance), fit))| Spread {
            weight: f64::from(at.cosines[i].value),
            cos_theta_i: f64::from(at.cos_theta_i[i]),
            mean,
            deviation: variance.sqrt(),
            fit: fit.map(|f| f64::from(f.max(0.0))),
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

impl Part {
    /// Solves for the lists of `targets`, one in each column. `noise` has the variance of each reading.
    fn new(
        q: &DMatrix<f64>,
        variance: &DVector<f64>,
        noise: &[f64],
        targets: &DMatrix<f64>,
    ) -> Option<Self> {
        let mut weighted = q.clone();
        for (mut row, noise) in weighted.row_iter_mut().zip(noise) {
            row /= *noise;
        }
        let mut information = weighted.tr_mul(q);
        for (k, variance) in variance.iter().enumerate() {
            information[(k, k)] += 1.0 / variance;
        }
        let covariance = Cholesky::new(information)?.inverse();
        let coefficients = &covariance * weighted.tr_mul(targets);
        let rests = targets - q * &coefficients;
        let mut evidence = 0.0;
        for (i, noise) in noise.iter().enumerate() {
            evidence += rests.row(i).dot(&targets.row(i)) / noise;
        }
        let part = Self {
            covariance,
            coefficients,
            left_out: Vec::new(),
            evidence,
        };
        // Without the reading, its variance is s / (1 - h), with h = q'S q / s.
        let shares = noise.iter().zip(q.row_iter());
        let shares: Vec<f64> = shares
            .map(|(noise, row)| (1.0 - part.variance(&row.into_owned()) / noise).max(1e-6))
            .collect();
        let left_out = rests.column_iter().map(|list| {
            let each = list.iter().zip(&shares).zip(noise);
            each.map(|((rest, share), noise)| (rest / share, noise / share))
                .collect()
        });
        Some(Self {
            left_out: left_out.collect(),
            ..part
        })
        .filter(|part| part.evidence.is_finite())
    }

    /// Returns the variance at a row of components.
    fn variance(&self, row: &RowDVector<f64>) -> f64 {
        (row * &self.covariance).dot(row)
    }
}

/// Returns the components at some directions, a row for each.
fn rows(at: &ComponentsAt) -> DMatrix<f64> {
    DMatrix::from_row_slice(at.count(), at.components, &at.rows).cast::<f64>()
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
mod tests {
    use glimpse_core::model::linear::map;
    use glimpse_materials::{Material, Procedural};

    use super::*;
    use crate::linear::{COMPACT_NODES, GaussianPrior, to_compact_bytes};

    fn prior() -> CoefficientPrior {
        let set = Procedural::set(40, 1).into_iter();
        let tasks: Vec<Box<dyn Material>> = set.map(|each| Box::new(each) as _).collect();
        let GaussianPrior {
            basis,
            mean_variance,
            difference_variance,
        } = GaussianPrior::new(&tasks, 12).expect("the materials differ");
        let compact = to_compact_bytes(&basis, basis.components(), COMPACT_NODES);
        CoefficientPrior {
            basis: Arc::new(Basis::from_compact_bytes(&compact).expect("a valid basis")),
            variance: [mean_variance, difference_variance].map(DVector::from_vec),
            noise: 0.02,
        }
    }

    fn readings(material: &dyn Material, count: usize) -> Vec<PosteriorReading> {
        let angles = uniform_valid(count, 5).into_iter();
        angles
            .map(|angles| PosteriorReading::new(angles, material.brdf(angles)))
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
            let [mean, difference] = &posterior.parts;
            for (channel, fitted) in fitted.chunks(12).enumerate() {
                let expected = &mean.coefficients + difference.coefficients.column(channel);
                for (fitted, expected) in fitted.iter().zip(&expected) {
                    assert!(
                        (f64::from(*fitted) - expected).abs() < 1e-3,
                        "{fitted} {expected}"
                    );
                }
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
        let fit = |at: &HalfDifference<f32>| material.brdf(glimpse_materials::angles_of(at));
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
