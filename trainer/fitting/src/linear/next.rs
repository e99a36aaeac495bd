//! The directions to read next: those that reduce the expected loss most.
//!
//! The criterion is that of core's [belief](glimpse_core::fit::belief).

use std::f32::consts::PI;

use glimpse_core::fit::belief::{Weights, weights_length};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::gonio::Limits;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::uniform_valid;
use rayon::prelude::*;

use super::{ComponentsAt, Posterior};
use crate::route::Position;

/// The number of directions to choose from.
const CANDIDATES: usize = 1_024;
/// The number of random directions, among which those within the limits are candidates.
const MAX_DRAWN: usize = 65_536;
/// The smallest cosine of a direction to the normal: 7 degrees above the horizon.
const MIN_COSINE: f32 = 0.12;
/// The number of directions of the loss.
const LOSS_DIRECTIONS: usize = 512;
/// The seed of the candidates, and that of the directions of the loss.
const SEEDS: [u64; 2] = [77, 78];
/// The smallest difference of a candidate from all readings, in each of its angles, radians.
const MIN_DIFFERENCE: f32 = 0.01;

/// The directions to choose from.
#[derive(Clone, Debug)]
pub struct Candidates {
    at: ComponentsAt,
    loss: ComponentsAt,
}

/// A direction to read.
#[derive(Clone, Copy, Debug)]
pub struct Proposal {
    /// The direction, angles in radians.
    pub angles: Angles<f32>,
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
    pub fn new(basis: &BasisTable, limits: &Limits) -> Self {
        let [own, of_loss] = SEEDS;
        let all = uniform_valid(MAX_DRAWN, own);
        let drawn = all.into_iter().enumerate();
        let drawn = drawn.map(|(index, angles)| match (limits.in_plane, index % 2) {
            (false, _) => angles,
            (true, 0) => Angles {
                phi_d: 0.0,
                ..angles
            },
            (true, _) => Angles {
                phi_d: PI,
                ..angles
            },
        });
        let is_within = |angles: &Angles<f32>| {
            let at = HalfDifference::from_angles(*angles);
            at.cos_theta_i().min(at.cos_theta_o()) > MIN_COSINE
                && limits.check(&at.directions()).is_ok()
        };
        Self {
            at: ComponentsAt::new(basis, drawn.filter(is_within).take(CANDIDATES).collect()),
            loss: ComponentsAt::new(basis, uniform_valid(LOSS_DIRECTIONS, of_loss)),
        }
    }
}

impl Posterior {
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
        let mut posterior = self.clone();
        let mut used: Vec<Angles<f32>> = measured.to_vec();
        let mut begin = begin.iter().filter(|angles| !is_among(angles, measured));
        let proposals = (0..count).map_while(|_| {
            let angles = match begin.next() {
                Some(angles) => *angles,
                None => posterior.best(candidates, &used, position.as_ref())?,
            };
            used.push(angles);
            let seconds = position.as_mut().map_or(0.0, |each| each.move_to(angles));
            let noise = posterior.noise;
            let at = ComponentsAt::new(&posterior.basis, vec![angles]);
            posterior.belief.assume(&at.row_f64(0), noise);
            let prediction = posterior.expected_loss();
            Some(Proposal {
                angles,
                seconds,
                expected_loss: prediction.loss,
                bound: prediction.bound.unwrap_or(f32::INFINITY),
            })
        });
        proposals.collect()
    }

    /// The components at all directions.
    #[must_use]
    pub fn basis(&self) -> &BasisTable {
        &self.basis
    }

    /// The number of readings.
    #[must_use]
    pub fn readings(&self) -> usize {
        self.readings.count()
    }

    /// Predicts the loss of the expected material.
    #[must_use]
    pub fn expected_loss(&self) -> LossPrediction {
        self.loss_of(None)
    }

    /// Returns the best candidate that differs from all used directions.
    fn best(
        &self,
        candidates: &Candidates,
        used: &[Angles<f32>],
        position: Option<&Position>,
    ) -> Option<Angles<f32>> {
        let (at, loss) = (&candidates.at, &candidates.loss);
        let mut weights = Weights::new(vec![0.0; weights_length(at.components)]);
        for (i, center) in loss.mean.iter().enumerate() {
            let row = loss.row_f64(i);
            let predicted = self.belief.predict(&row);
            let [cos_theta_i, weight] = [loss.cos_theta_i[i], loss.cosines[i].value].map(f64::from);
            weights.add(
                &row,
                &predicted,
                f64::from(center.value),
                cos_theta_i,
                weight,
            );
        }
        let scores = (0..at.count()).into_par_iter().map_init(
            || self.belief.clone(),
            |belief, index| {
                let angles = at.angles[index];
                let seconds = position.map_or(1.0, |each| each.seconds_to(angles));
                match is_among(&angles, used) {
                    false => belief.reduction(&at.row_f64(index), self.noise, &weights) / seconds,
                    true => 0.0,
                }
            },
        );
        let scores: Vec<f64> = scores.collect();
        let best = scores.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        best.filter(|(_, score)| **score > 0.0)
            .map(|(index, _)| at.angles[index])
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
    use crate::linear::posterior::tests::{prior, readings};
    use crate::route::TimedMachine;

    fn posterior(count: usize) -> Posterior {
        let readings = readings(&Procedural::new(3, 7), count);
        Posterior::new(&prior(), &readings).expect("finite")
    }

    fn expected_loss_with(posterior: &Posterior, angles: &[Angles<f32>]) -> f32 {
        let mut posterior = posterior.clone();
        let noise = posterior.noise;
        for angles in angles {
            let at = ComponentsAt::new(&posterior.basis, vec![*angles]);
            posterior.belief.assume(&at.row_f64(0), noise);
        }
        posterior.expected_loss().loss
    }

    #[test]
    fn proposals_are_better_than_random_directions() {
        for readings in [0, 3] {
            let posterior = posterior(readings);
            let candidates = Candidates::new(posterior.basis(), &Limits::NONE);
            let proposals = posterior.next(&candidates, [&[], &[]], 4, &mut None);
            let own: Vec<Angles<f32>> = proposals.iter().map(|each| each.angles).collect();
            let expected = expected_loss_with(&posterior, &own);
            assert_eq!(expected, proposals[3].expected_loss);
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
        let candidates = Candidates::new(posterior.basis(), &limits);
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
        let candidates = Candidates::new(posterior.basis(), &none);
        assert!(
            posterior
                .next(&candidates, [&[], &[]], 6, &mut None)
                .is_empty()
        );
    }
}
