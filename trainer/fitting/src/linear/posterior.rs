//! The Gaussian posterior of a material, given readings at any directions: the fit, and its uncertainty.
//!
//! R = s^2 rho + N is the covariance of the discrepancy at the readings, plus their noise. The mapped readings y have the
//! covariance S = Q V Q' + R, and at x the covariance k with the discrepancy. The expected coefficients are
//! a = (V^-1 + Q' R^-1 Q)^-1 Q' R^-1 y. The expected material is q'a + k' R^-1 (y - Q a): a combination of components, and of kernels
//! at the readings. Its variance is s^2 - k' R^-1 k + t' (V^-1 + Q' R^-1 Q)^-1 t with t = q - Q' R^-1 k.
//!
//! The mean of the channels has a third of R, and coefficients of its own; their differences have R.
//!
//! The evidence scales the variances: with E = y' S^-1 y / n for n readings, they are multiplied by (6 + n E) / (6 + n), if that
//! is above 1. So a material unlike the training is uncertain.

use std::sync::Arc;

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::{EPSILON, map, unmap};
use glimpse_materials::basis::{BasisTable, Kernels};
use glimpse_materials::lists::add_scaled;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::aperture::Aperture;
use super::design::{Design, Part, discrepancy_after, of_parts, without_readings};
use super::inverse::inverse;
use super::prior::{
    DIFFERENCE_SHARE, LENGTHS, MaterialPrior, PriorAt, SHARES, SparseColumns, VARIANCE, dense,
};

/// The number of readings that the prior's own scale counts as.
const PRIOR_READINGS: f64 = 6.0;

/// The shares of the way to the expected material around which readings with apertures are linearized again. The first ones are
/// damped, because the logarithm of a mean is far from linear.
const STEPS: [f64; 7] = [0.6, 0.6, 0.6, 0.6, 0.6, 1.0, 1.0];
/// The smallest variance of a mapped BRDF: rounding makes smaller ones negative.
pub(super) const MIN_VARIANCE: f64 = 1e-10;
/// The standard deviation of a reading's noise relative to the reading, if it is unknown: 2 %.
pub const DEFAULT_NOISE: f32 = 0.02;
/// The smallest standard deviation of a reading's noise, relative to the reading: no instrument is better, and the posterior
/// of exact readings would be singular. A smaller one is raised to it.
pub const MIN_NOISE: f32 = 1e-3;

/// A reading at any direction, or with any aperture.
#[derive(Clone, Debug)]
pub struct PosteriorReading {
    /// The direction, in radians, or that in the middle of the aperture.
    pub angles: Angles<f32>,
    /// The aperture; None for a reading exactly at the direction.
    pub aperture: Option<Arc<Aperture>>,
    /// The BRDF in linear RGB, sr^-1, not times the cosine, or its mean over the aperture.
    pub brdf: [f32; 3],
    /// The standard deviation of its noise, relative to the reading.
    pub noise: f32,
}

impl PosteriorReading {
    /// Creates a reading of unknown noise.
    pub fn new(angles: Angles<f32>, brdf: [f32; 3]) -> Self {
        Self {
            angles,
            aperture: None,
            brdf,
            noise: DEFAULT_NOISE,
        }
    }
}

/// The prediction of a reading from the others, or of one of a group from all outside it.
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

/// The distribution of the mapped BRDF at a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Predicted {
    /// The expected values of red, green and blue, minus the mean of the training.
    pub(super) expected: [f64; 3],
    /// The variance of each of them.
    pub(super) variance: f64,
}

/// The posterior of a material, given readings.
#[derive(Clone, Debug)]
pub struct Posterior {
    pub(super) design: Arc<Design>,
    /// y of the mean and of the differences of the channels, a column for each list.
    pub(super) targets: [DMatrix<f64>; 2],
    /// The expected coefficients of these lists.
    pub(super) coefficients: [DMatrix<f64>; 2],
    /// R^-1 (y - Q a) of these lists.
    pub(super) weights: [DMatrix<f64>; 2],
    /// y' S^-1 y of the mean, and of the differences, which have two independent lists, over 3.
    evidence: f64,
    /// The number of readings that were not removed.
    count: usize,
    /// A third of the number of channels of these readings, in which a gray one has one.
    degrees: f64,
}

impl Posterior {
    /// Computes the posterior. Readings with an aperture are linearized around the expected material, several times. None if a
    /// number is not finite.
    pub fn new(prior: &MaterialPrior, readings: &[PosteriorReading]) -> Option<Self> {
        let none_expected = |points: &PriorAt| vec![[0.0; 3]; points.sums.len()];
        let mut posterior = Self::at(prior, linearized(prior, readings, none_expected), readings)?;
        if readings.iter().all(|reading| reading.aperture.is_none()) {
            return Some(posterior);
        }
        let mut expected = Vec::new();
        for step in STEPS {
            let sums = linearized(prior, readings, |points| {
                expected.resize(points.sums.len(), [0.0; 3]);
                for (expected, predicted) in expected.iter_mut().zip(posterior.expected(points)) {
                    for (expected, predicted) in expected.iter_mut().zip(predicted) {
                        *expected += step * (predicted - *expected);
                    }
                }
                expected.clone()
            });
            posterior = Self::at(prior, sums, readings)?;
        }
        Some(posterior)
    }

    /// Computes the posterior of readings that are linear in sums of the mapped BRDF.
    fn at(prior: &MaterialPrior, at: PriorAt, readings: &[PosteriorReading]) -> Option<Self> {
        let mut covariance = dense(readings.len(), &at.discrepancy(&at));
        let noise = readings.iter().zip(&at.cosines);
        let noise = noise.map(|(reading, cosines)| {
            let relative = f64::from(reading.noise.max(MIN_NOISE)).powi(2);
            let Some(aperture) = &reading.aperture else {
                return relative;
            };
            let light = reading.brdf.iter().sum::<f32>().max(0.0) / 3.0;
            let light = f64::from(light) + EPSILON / f64::from(*cosines);
            relative + (aperture.resolution / light).powi(2)
        });
        let noise: Vec<f64> = noise.collect();
        for (index, noise) in noise.iter().enumerate() {
            covariance[(index, index)] += noise;
        }
        let inverse = Arc::new(inverse(covariance)?);
        let gray = (0..readings.len()).filter(|index| at.is_gray[*index]);
        let of_differences = match gray.clone().next() {
            None => inverse.clone(),
            Some(_) => Arc::new(without_readings(&inverse, gray)),
        };
        let design = Design::new((prior.clone(), at, noise), [inverse, of_differences])?;
        let brdf: Vec<[f32; 3]> = readings.iter().map(|reading| reading.brdf).collect();
        let targets = mapped(&design.at, &brdf);
        let posterior = Self::of_targets(targets, Arc::new(design));
        posterior.evidence.is_finite().then_some(posterior)
    }

    pub(super) fn of_targets(targets: [DMatrix<f64>; 2], design: Arc<Design>) -> Self {
        let coefficients = [0, 1].map(|part: usize| {
            let Part {
                gain, covariance, ..
            } = &design.parts[part];
            covariance * (gain.tr_mul(&targets[part]) / SHARES[part])
        });
        let weights = [0, 1].map(|part: usize| {
            let rest = &targets[part] - &design.at.rows * &coefficients[part];
            &*design.parts[part].inverse * rest
        });
        let of_part = |part: usize| weights[part].dot(&targets[part]) / SHARES[part];
        let [count, colored] = design.parts.each_ref().map(|part| {
            let kept = part.inverse.diagonal();
            kept.iter().filter(|entry| **entry > 0.0).count()
        });
        Self {
            evidence: (of_part(0) + of_part(1)) / 3.0,
            degrees: (count + 2 * colored) as f64 / 3.0,
            design,
            targets,
            coefficients,
            weights,
            count,
        }
    }

    /// Returns the posterior without a group of readings. None if a number is not finite.
    pub fn without(&self, group: &[usize]) -> Option<Self> {
        let Design {
            prior, at, noise, ..
        } = &*self.design;
        let inverses = of_parts(&self.design.inverses(), |inverse| {
            without_readings(inverse, group.iter().copied())
        });
        let design = Design::new((prior.clone(), at.clone(), noise.clone()), inverses)?;
        Some(Self::of_targets(self.targets.clone(), Arc::new(design)))
    }

    /// Returns the components at all directions.
    pub fn basis(&self) -> &BasisTable {
        &self.prior().basis
    }

    pub(super) fn prior(&self) -> &MaterialPrior {
        &self.design.prior
    }

    /// Returns the number of readings.
    pub fn readings(&self) -> usize {
        self.count
    }

    /// Returns the kernels of the expected material.
    pub fn kernels(&self) -> Kernels {
        let directions = self.design.at.components.angles.iter();
        Kernels {
            lengths: LENGTHS,
            directions: directions.map(|angles| angles.to_array()).collect(),
        }
    }

    /// Returns the coefficients of the expected material in red, green and blue: of the components, then of the
    /// [kernels](Self::kernels).
    pub fn coefficients(&self) -> [Vec<f32>; 3] {
        [0, 1, 2].map(|channel| self.coefficients_of(channel))
    }

    /// Returns those of a channel or band.
    pub fn coefficients_of(&self, channel: usize) -> Vec<f32> {
        let at = &self.design.at;
        let sum =
            |[mean, differences]: &[DMatrix<f64>; 2]| mean.column(0) + differences.column(channel);
        let (components, readings) = (sum(&self.coefficients), sum(&self.weights));
        let components = components.iter().map(|value| *value as f32);
        let sums = at.sums.iter().zip(readings.iter());
        let kernels = sums.flat_map(|(directions, reading)| {
            let weights = at.weights[directions.clone()].iter();
            weights.map(move |weight| (VARIANCE * weight * reading) as f32)
        });
        components.chain(kernels).collect()
    }

    /// Returns the factor of all variances, without the evidence of a number of readings.
    pub(super) fn scale(&self, without: f64, number: usize) -> f64 {
        let evidence = self.evidence - without;
        let degrees = self.degrees - number as f64;
        ((PRIOR_READINGS + evidence) / (PRIOR_READINGS + degrees)).max(1.0)
    }

    /// Predicts each group of readings from all others, up to a shift of the mapped readings that the group has in common.
    /// All readings of a group have its z. None for an empty group, or one with a removed reading.
    pub fn left_out(&self, groups: &[&[usize]]) -> Vec<Option<Vec<LeftOut>>> {
        let Design { at, parts, .. } = &*self.design;
        let reduced = parts.each_ref().map(|part| &*part.gain * &part.covariance);
        let of_group = |group: &&[usize]| {
            let is_removed = |i: &usize| parts[0].inverse[(*i, *i)] <= 0.0;
            if group.is_empty() || group.iter().any(is_removed) {
                return None;
            }
            let sum = |matrix: &DMatrix<f64>| matrix.select_rows(*group).row_sum();
            // With P = S^-1, the least-squares estimate of the shift is 1' (P y)_G / 1' P_GG 1, and 1 / 1' P_GG 1 is its variance.
            let precision = [0, 1].map(|part: usize| {
                let Part { inverse, gain, .. } = &parts[part];
                let columns = group.iter().map(|i| inverse.column(*i));
                let own: f64 = columns
                    .map(|column| group.iter().map(|j| column[*j]).sum::<f64>())
                    .sum();
                let explained = sum(&reduced[part]).dot(&sum(gain)) / SHARES[part];
                (own - explained).max(MIN_VARIANCE)
            });
            let [mean_variance, variance] = [0, 1].map(|part| SHARES[part] / precision[part]);
            let mean_rest = sum(&self.weights[0])[0] / precision[0];
            let rests = sum(&self.weights[1]) / precision[1];
            let rests = [rests[0], rests[1], rests[2]];
            let squares: f64 = rests.iter().map(|rest| rest * rest).sum();
            let own = mean_rest * mean_rest / mean_variance + squares / variance;
            let scale = self.scale(own / 3.0, 1);
            let channel_variance = mean_variance + DIFFERENCE_SHARE * variance;
            let of_mean = mean_rest / (scale * mean_variance).sqrt();
            let z = rests.map(|rest| (mean_rest + rest) / (scale * channel_variance).sqrt());
            let z = z.into_iter().chain([of_mean]);
            let z = z.max_by(|a, b| a.abs().total_cmp(&b.abs()));
            let readings = group.iter().map(|i| {
                let (center, weight) = (at.centers[*i], at.cosines[*i]);
                LeftOut {
                    z: z.unwrap_or_default(),
                    expected: [0, 1, 2].map(|channel| {
                        let target = self.targets[0][(*i, 0)] + self.targets[1][(*i, channel)];
                        let u = target - mean_rest - rests[channel];
                        unmap(f64::from(center[channel]) + u, f64::from(weight)).max(0.0) as f32
                    }),
                    log_density: -0.5 * (of_mean * of_mean + (scale * mean_variance).ln()),
                }
            });
            Some(readings.collect())
        };
        groups.par_iter().map(of_group).collect()
    }

    /// Returns the covariances of the discrepancy with the readings at some directions, and what remains of the components
    /// there after the readings of each part: q - Q' R^-1 k, a row for each direction.
    pub(super) fn remainder(&self, at: &PriorAt) -> (SparseColumns, [Arc<DMatrix<f64>>; 2]) {
        let columns = self.design.at.discrepancy(at);
        let gains = self.design.parts.each_ref().map(|part| part.gain.clone());
        let rests = of_parts(&gains, |gain| {
            let mut rest = at.rows.clone();
            for (mut row, column) in rest.row_iter_mut().zip(&columns) {
                for (index, entry) in column {
                    row -= gain.row(*index) * *entry;
                }
            }
            rest
        });
        (columns, rests)
    }

    /// Returns K' R^-1 K of each part.
    pub(super) fn explained(&self, covariances: &SparseColumns) -> [Arc<DMatrix<f64>>; 2] {
        let covariances = &dense(self.design.noise.len(), covariances);
        of_parts(&self.design.inverses(), |inverse| {
            covariances.transpose() * (inverse * covariances)
        })
    }

    /// Returns the covariance of the coefficients of a part.
    pub(super) fn covariance(&self, part: usize) -> &DMatrix<f64> {
        &self.design.parts[part].covariance
    }

    /// Predicts the mapped BRDF at some directions.
    pub(super) fn predict(&self, at: &PriorAt) -> Vec<Predicted> {
        let (columns, rests) = self.remainder(at);
        let inverses = self.design.inverses();
        let scale = self.scale(0.0, 0);
        let reduced = [0, 1].map(|part: usize| &*rests[part] * self.covariance(part));
        let means = [0, 1].map(|part: usize| &at.rows * &self.coefficients[part]);
        let predict = |(i, column): (usize, &Vec<(usize, f64)>)| {
            let mut expected = [0, 1, 2].map(|channel| means[0][(i, 0)] + means[1][(i, channel)]);
            for (row, entry) in column {
                add_scaled(&mut expected, *entry, &self.weights_of(*row));
            }
            let [mean, difference] =
                [0, 1].map(|part: usize| reduced[part].row(i).dot(&rests[part].row(i)));
            let mut discrepancy = discrepancy_after(&inverses[0], column);
            if !Arc::ptr_eq(&inverses[0], &inverses[1]) {
                let of_differences = discrepancy_after(&inverses[1], column);
                discrepancy = SHARES[0] * discrepancy + DIFFERENCE_SHARE * of_differences;
            }
            let variance = discrepancy.max(0.0) + mean + DIFFERENCE_SHARE * difference;
            Predicted {
                expected,
                variance: scale * variance.max(MIN_VARIANCE),
            }
        };
        columns.par_iter().enumerate().map(predict).collect()
    }

    /// Returns the expected mapped BRDF at some directions, minus the mean of the training.
    pub(super) fn expected(&self, at: &PriorAt) -> Vec<[f64; 3]> {
        let predicted = self.predict(at).into_iter();
        predicted.map(|predicted| predicted.expected).collect()
    }

    /// Returns readings of this posterior as BRDFs exactly at their directions (linear RGB, sr^-1, not times the cosine). With
    /// apertures, what the expected material does not explain of a reading's mapped value is added to that of the expected
    /// material at its direction.
    pub fn exact(&self, readings: &[PosteriorReading]) -> Vec<[f32; 3]> {
        if readings.iter().all(|reading| reading.aperture.is_none()) {
            return readings.iter().map(|reading| reading.brdf).collect();
        }
        let directions = readings.iter().map(|reading| reading.angles);
        let at = self.prior().at(directions.collect());
        let expected = self.predict(&at).into_iter().enumerate();
        let exact = expected.map(|(i, predicted)| {
            [0, 1, 2].map(|channel: usize| {
                let center = f64::from(at.centers[i][channel]);
                // The expected material leaves N R^-1 (y - Q a).
                let mapped = center
                    + predicted.expected[channel]
                    + self.design.noise[i] * self.weights_of(i)[channel];
                unmap(mapped, f64::from(at.cosines[i])).max(0.0) as f32
            })
        });
        exact.collect()
    }

    /// Returns R^-1 (y - Q a) of a reading in red, green and blue.
    fn weights_of(&self, reading: usize) -> [f64; 3] {
        let [mean, differences] = &self.weights;
        [0, 1, 2].map(|channel| mean[(reading, 0)] + differences[(reading, channel)])
    }
}

/// Returns the sums of readings, linearized around the mapped BRDF, minus the mean of the training, that a function returns at
/// directions. Without apertures, it is not called.
pub(super) fn linearized(
    prior: &MaterialPrior,
    readings: &[PosteriorReading],
    expected: impl FnOnce(&PriorAt) -> Vec<[f64; 3]>,
) -> PriorAt {
    let apertures = readings.iter().map(|reading| reading.aperture.as_deref());
    let apertures: Vec<Option<&Aperture>> = apertures.collect();
    let directions = readings.iter().flat_map(|reading| match &reading.aperture {
        None => vec![reading.angles],
        Some(aperture) => aperture
            .directions
            .iter()
            .map(|(angles, _)| *angles)
            .collect(),
    });
    let points = prior.at(directions.collect());
    if apertures.iter().all(Option::is_none) {
        return points;
    }
    points.linearized(&apertures, &expected(&points))
}

/// Returns the mapped readings minus the mean of the training: the mean of the channels, and the differences from it.
pub(super) fn mapped(at: &PriorAt, brdf: &[[f32; 3]]) -> [DMatrix<f64>; 2] {
    let channels = DMatrix::from_fn(brdf.len(), 3, |reading, channel| {
        let value = map(brdf[reading][channel].max(0.0), at.cosines[reading]);
        f64::from(value - at.centers[reading][channel])
    });
    let mean = (channels.column(0) + channels.column(1) + channels.column(2)) / 3.0;
    differences_from(mean, channels)
}

/// Returns the mean of channels or bands, and their differences from it.
pub(super) fn differences_from(
    mean: DVector<f64>,
    mut channels: DMatrix<f64>,
) -> [DMatrix<f64>; 2] {
    for mut channel in channels.column_iter_mut() {
        channel -= &mean;
    }
    [DMatrix::from_columns(&[mean]), channels]
}

/// Returns how much better readings predict each other without some of them: the sum of the differences of the logarithms
/// of their densities. The arguments are the predictions of all readings, and of the others, each as a group of one.
#[must_use]
pub fn gain_without(all: &[Option<Vec<LeftOut>>], others: &[Option<Vec<LeftOut>>]) -> f64 {
    let pairs = all.iter().zip(others);
    let gains = pairs.filter_map(|(all, others)| {
        Some(others.as_ref()?.first()?.log_density - all.as_ref()?.first()?.log_density)
    });
    gains.sum()
}
