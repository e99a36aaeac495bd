//! The directions to read next: those that reduce the expected loss most.
//!
//! A reading at q reduces the variance V at l by cov(l, q)^2 / (V(q) + noise), and the expected loss by the slope of ln(1 + f cos(theta_i))
//! times the change of sqrt(V).

use std::f32::consts::PI;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::gonio::Limits;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::sampling::uniform_valid;
use nalgebra::DMatrix;

use super::posterior::{DEFAULT_NOISE, MIN_VARIANCE, Posterior, PosteriorReading, linearized};
use super::prior::{DIFFERENCE_SHARE, SHARES, dense};
use super::uncertainty::{Spread, loss_directions, prediction};
use crate::route::Position;

/// The number of directions to choose from.
const CANDIDATES: usize = 1_024;
/// The number of random directions, among which those within the limits are candidates.
const MAX_DRAWN: usize = 65_536;
/// The smallest cosine of a direction to the normal: 7 degrees above the horizon.
const MIN_COSINE: f32 = 0.12;
/// The seed of the candidates.
const SEED: u64 = 77;
/// The smallest difference of a candidate from all readings, in each of its angles, radians.
const MIN_DIFFERENCE: f32 = 0.01;

/// The readings to choose from, whose values do not matter.
#[derive(Clone, Debug)]
pub struct Candidates(pub Vec<PosteriorReading>);

/// A direction to read.
#[derive(Clone, Copy, Debug)]
pub struct Proposal {
    /// The direction, or that in the middle of the aperture, angles in radians.
    pub angles: Angles<f32>,
    /// The index of the candidate; None for a direction of `begin`.
    pub candidate: Option<usize>,
    /// The time to move there and to read, in seconds. 0 without a machine.
    pub seconds: f64,
    /// The expected loss after this reading and the earlier ones.
    pub expected_loss: f32,
    /// The upper bound of that loss.
    pub bound: f32,
}

impl Candidates {
    /// Draws directions within limits. They are the same for each call. There are fewer within narrow limits, maybe none.
    #[must_use]
    pub fn new(limits: &Limits) -> Self {
        let drawn = uniform_valid(MAX_DRAWN, SEED).into_iter().enumerate();
        let drawn = drawn.map(|(index, mut angles)| {
            if limits.in_plane {
                angles.phi_d = [0.0, PI][index % 2];
            }
            angles
        });
        let is_within = |angles: &Angles<f32>| {
            let at = HalfDifference::from_angles(*angles);
            at.cos_theta_i().min(at.cos_theta_o()) > MIN_COSINE
                && limits.check(&at.directions()).is_ok()
        };
        let drawn = drawn.filter(is_within).take(CANDIDATES);
        Self(drawn.map(without_value).collect())
    }
}

fn without_value(angles: Angles<f32>) -> PosteriorReading {
    PosteriorReading::new(angles, [0.0; 3])
}

/// The joint distribution of the mapped BRDF at candidates, and at the directions of the loss.
struct Joint {
    /// The posterior at the directions of the loss.
    spreads: Vec<Spread>,
    /// The covariances of the mean of the channels, and of the differences: first the candidates, then the directions of the
    /// loss.
    covariance: [DMatrix<f64>; 2],
    /// The factor of variances.
    scale: f64,
    /// True for a candidate that states nothing about the color.
    is_gray: Vec<bool>,
}

impl Joint {
    fn new(posterior: &Posterior, candidates: &[PosteriorReading]) -> Self {
        let of_loss = loss_directions().into_iter().map(without_value);
        let all: Vec<PosteriorReading> = candidates.iter().cloned().chain(of_loss).collect();
        let at = linearized(posterior.prior(), &all, |points| posterior.expected(points));
        let (discrepancy, rest) = posterior.remainder(&at);
        let own = at.discrepancy(&at);
        let explained = posterior.explained(&discrepancy);
        let own = dense(own.len(), &own);
        let covariance = [0, 1].map(|part: usize| {
            let rest = &*rest[part];
            let of_coefficients = rest * posterior.covariance(part) * rest.transpose();
            of_coefficients + (&own - &*explained[part]) * SHARES[part]
        });
        Self {
            spreads: posterior.spreads(None, loss_directions()),
            covariance,
            scale: posterior.scale(0.0, 0),
            is_gray: at.is_gray,
        }
    }

    /// Returns the row of the first direction of the loss.
    fn first_of_loss(&self) -> usize {
        self.covariance[0].nrows() - self.spreads.len()
    }

    /// Returns the sum over the directions of the loss by which a reading at a candidate would reduce the expected losses.
    fn reduction(&self, candidate: usize, slopes: &[f64]) -> f64 {
        let columns = [0, 1].map(|part: usize| self.covariance[part].column(candidate));
        let totals = [0, 1].map(|part| columns[part][candidate] + self.noise_of(part, candidate));
        let rows = (self.first_of_loss()..).zip(&self.spreads);
        let terms = rows.zip(slopes).map(|((row, spread), slope)| {
            let mean = columns[0][row].powi(2) / totals[0];
            let difference = columns[1][row].powi(2) / totals[1];
            let change = self.scale * (mean + DIFFERENCE_SHARE * difference);
            let variance = spread.deviation * spread.deviation;
            slope * (spread.deviation - (variance - change).max(0.0).sqrt())
        });
        terms.sum()
    }

    fn noise_of(&self, part: usize, candidate: usize) -> f64 {
        if part == 1 && self.is_gray[candidate] {
            return f64::INFINITY;
        }
        f64::from(DEFAULT_NOISE).powi(2) * SHARES[part]
    }

    /// Assumes a reading at a candidate, with its expected value.
    fn assume(&mut self, candidate: usize) {
        for part in 0..2 {
            let noise = self.noise_of(part, candidate);
            let covariance = &mut self.covariance[part];
            let column = covariance.column(candidate).into_owned();
            covariance.ger(-1.0 / (column[candidate] + noise), &column, &column, 1.0);
        }
        let first = self.first_of_loss();
        for (index, spread) in self.spreads.iter_mut().enumerate() {
            let [mean, difference] =
                [0, 1].map(|part: usize| self.covariance[part][(first + index, first + index)]);
            let variance = self.scale * (mean + DIFFERENCE_SHARE * difference);
            spread.deviation = variance.max(MIN_VARIANCE).sqrt();
        }
    }
}

impl Posterior {
    /// Predicts the loss of the expected material after further readings, if they have their expected values.
    #[must_use]
    pub fn expected_loss_after(&self, readings: &[PosteriorReading]) -> LossPrediction {
        let mut joint = Joint::new(self, readings);
        (0..readings.len()).for_each(|candidate| joint.assume(candidate));
        prediction(&joint.spreads)
    }

    /// Proposes up to `count` directions that were not `measured`, each one given that the earlier ones have their expected
    /// readings: first those of `begin`, then those that reduce the expected loss most. With the position of a machine's
    /// arms, which moves along, they are those that reduce it most per second.
    #[must_use]
    pub fn next(
        &self,
        candidates: &Candidates,
        [measured, begin]: [&[Angles<f32>]; 2],
        count: usize,
        position: &mut Option<Position>,
    ) -> Vec<Proposal> {
        if count == 0 {
            return Vec::new();
        }
        let begin = begin.iter().filter(|angles| !is_among(angles, measured));
        let begin = begin.take(count).copied().map(without_value);
        let mut readings: Vec<PosteriorReading> = begin.collect();
        let begun = readings.len();
        readings.extend_from_slice(&candidates.0);
        let mut joint = Joint::new(self, &readings);
        let mut used: Vec<Angles<f32>> = measured.to_vec();
        let mut chosen_before = vec![false; readings.len()];
        let proposals = (0..count).map_while(|index| {
            let chosen = if index < begun {
                index
            } else {
                let spreads = joint.spreads.iter();
                let slopes = spreads.map(|spread| spread.change() / spread.deviation);
                let slopes: Vec<f64> = slopes.collect();
                let is_open = |index: &usize| {
                    let reading = &readings[*index];
                    let is_exact = reading.aperture.is_none();
                    !(chosen_before[*index] || is_exact && is_among(&reading.angles, &used))
                };
                let open = (0..readings.len()).filter(is_open);
                let scores = open.map(|index| {
                    let reduction = joint.reduction(index, &slopes);
                    let arms = position.as_ref();
                    let seconds = arms.map_or(1.0, |arms| arms.seconds_to(readings[index].angles));
                    (index, reduction / seconds)
                });
                let best = scores.max_by(|a, b| a.1.total_cmp(&b.1));
                best.filter(|(_, score)| *score > 0.0)?.0
            };
            let angles = readings[chosen].angles;
            used.push(angles);
            chosen_before[chosen] = true;
            joint.assume(chosen);
            let prediction = prediction(&joint.spreads);
            let arms = position.as_mut();
            Some(Proposal {
                angles,
                candidate: chosen.checked_sub(begun),
                seconds: arms.map_or(0.0, |arms| arms.move_to(angles)),
                expected_loss: prediction.loss,
                bound: prediction.bound.unwrap_or(f32::INFINITY),
            })
        });
        proposals.collect()
    }
}

/// Returns true if a direction is one of a list, or near it.
fn is_among(angles: &Angles<f32>, list: &[Angles<f32>]) -> bool {
    list.iter().any(|other| {
        (angles.theta_h - other.theta_h).abs() < MIN_DIFFERENCE
            && (angles.theta_d - other.theta_d).abs() < MIN_DIFFERENCE
            && (angles.phi_d - other.phi_d).abs() < MIN_DIFFERENCE
    })
}

#[cfg(test)]
mod tests {
    use glimpse_materials::Procedural;

    use super::*;
    use crate::linear::tests::{prior, readings};
    use crate::route::TimedMachine;

    fn posterior(count: usize) -> Posterior {
        let readings = readings(&Procedural::new(3, 7), count);
        Posterior::new(&prior(), &readings).expect("finite")
    }

    fn expected_loss_with(posterior: &Posterior, angles: &[Angles<f32>]) -> f32 {
        let candidates: Vec<_> = angles.iter().copied().map(without_value).collect();
        posterior.expected_loss_after(&candidates).loss
    }

    #[test]
    fn proposals_are_better_than_random_directions() {
        for readings in [0, 3] {
            let posterior = posterior(readings);
            let candidates = Candidates::new(&Limits::NONE);
            let proposals = posterior.next(&candidates, [&[], &[]], 4, &mut None);
            let own: Vec<Angles<f32>> = proposals.iter().map(|each| each.angles).collect();
            let expected = expected_loss_with(&posterior, &own);
            assert!((expected - proposals[3].expected_loss).abs() < 1e-6 * expected);
            for seed in 0..20 {
                let random = expected_loss_with(&posterior, &uniform_valid(4, seed));
                assert!(expected < random, "{expected} {random}");
            }
            // One by one, or all at once.
            let first = posterior.next(&candidates, [&[], &[]], 1, &mut None)[0].angles;
            assert_eq!(first, own[0]);
            let begun = posterior.next(&candidates, [&[], &[own[1]]], 2, &mut None);
            assert_eq!(begun[0].angles, own[1]);
            assert_ne!(begun[1].angles, own[1]);
            // Without a proposal, the loss is that of the posterior.
            let so_far = posterior.expected_loss().loss;
            assert!((expected_loss_with(&posterior, &[]) - so_far).abs() < 1e-5 * so_far);
        }
    }

    #[test]
    fn limits_hold_and_seconds_count() {
        let posterior = posterior(2);
        let limits = Limits {
            max_theta_i: 1.0,
            min_separation: 0.3,
            in_plane: true,
            ..Limits::NONE
        };
        let candidates = Candidates::new(&limits);
        let slow = TimedMachine {
            settle: 0.0,
            ..TimedMachine::default()
        };
        let seconds = |position: &mut Option<Position>| -> f64 {
            let proposals = posterior.next(&candidates, [&[], &[]], 6, position);
            for each in &proposals {
                let directions = HalfDifference::from_angles(each.angles).directions();
                assert_eq!(limits.check(&directions), Ok(()));
            }
            let mut arms = Position::new(slow);
            proposals.iter().map(|each| arms.move_to(each.angles)).sum()
        };
        let [plain, timed] = [None, Some(Position::new(slow))].map(|mut each| seconds(&mut each));
        assert!(timed < 0.7 * plain, "{timed} {plain}");
        let none = Limits {
            max_theta_i: 1e-4,
            max_theta_o: 1e-4,
            ..Limits::NONE
        };
        let candidates = Candidates::new(&none);
        assert!(
            posterior
                .next(&candidates, [&[], &[]], 6, &mut None)
                .is_empty()
        );
    }
}
