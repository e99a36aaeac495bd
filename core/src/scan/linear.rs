//! The scan session of the model Linear: it ends in coefficients.

use super::measuring::Measuring;
use super::{Measurement, MeasurementError, Residual, ScanError};
use crate::fit::Progress;
use crate::fit::ridge::{Factors, dot, factor_length, scratch_length};
use crate::geometry::Directions;
use crate::model::ModelKind;
use crate::model::linear::{map, unmap};
use crate::model::loss::cosine_weighted_log_error;
use crate::recipe::{Learner, Recipe, Ridge};

/// The colour channels, each with coefficients of its own.
const CHANNELS: usize = 3;

/// A scan of one material by one recipe of the model Linear; `CAPACITY` is the largest n that it
/// has room for.
///
/// It ends in coefficients. A BRDF at other directions than the measured ones takes the whole basis,
/// which is the host's: [`Ridge::basis_checksum`] names it.
pub struct LinearScan<'a, const CAPACITY: usize> {
    measuring: Measuring<'a, CAPACITY>,
    ridge: Ridge<'a>,
    factors: Factors<'a, 'a, [u8; 4], f32>,
    /// Three runs of m.
    coefficients: &'a mut [f32],
    /// t of one channel, n.
    mapped: &'a mut [f32],
    scratch: &'a mut [f32],
    /// Channels solved.
    solved: usize,
}

impl<'a, const CAPACITY: usize> LinearScan<'a, CAPACITY> {
    /// Numbers that a scan with n samples and m components takes in memory: so that a static array
    /// can have that length.
    #[must_use]
    pub const fn memory_length(samples: usize, components: usize) -> usize {
        CHANNELS
            .saturating_mul(components)
            .saturating_add(samples)
            .saturating_add(factor_length(samples, components))
            .saturating_add(scratch_length(samples, components))
    }

    /// Begins a scan, and factorizes its ridge problem: that is done before anything is measured,
    /// in one piece of some r^2 (n + m) / 2 multiplications, r = min(n, m).
    ///
    /// # Errors
    /// If the recipe is for another model, or for more samples than `CAPACITY`, if `memory` has fewer
    /// than [`LinearScan::memory_length`] numbers, or the problem cannot be factorized.
    pub fn new(recipe: Recipe<'a>, memory: &'a mut [f32]) -> Result<Self, ScanError> {
        let Learner::Ridge(ridge) = recipe.learner() else {
            return Err(ScanError::Model {
                firmware: ModelKind::Linear,
                recipe: recipe.model(),
            });
        };
        let measuring = Measuring::new(recipe)?;
        let (samples, components) = (recipe.samples(), ridge.components());
        let short = ScanError::Memory {
            needed: Self::memory_length(samples, components),
            found: memory.len(),
        };
        let (coefficients, rest) = memory
            .split_at_mut_checked(CHANNELS.saturating_mul(components))
            .ok_or(short)?;
        let (mapped, rest) = rest.split_at_mut_checked(samples).ok_or(short)?;
        let (factors, scratch) = rest
            .split_at_mut_checked(factor_length(samples, components))
            .ok_or(short)?;
        if scratch.len() < scratch_length(samples, components) {
            return Err(short);
        }
        coefficients.fill(0.0);
        let factors = ridge
            .problem()
            .factorize(factors, scratch)
            .map_err(ScanError::Ridge)?;
        Ok(Self {
            measuring,
            ridge,
            factors,
            coefficients,
            mapped,
            scratch,
            solved: 0,
        })
    }

    /// Forgets all measurements and begins anew.
    pub fn restart(&mut self) {
        self.measuring.restart();
        self.coefficients.fill(0.0);
        self.solved = 0;
    }

    /// Index of the next measurement and where to take it; None once all are taken.
    #[must_use]
    pub fn next_directions(&self) -> Option<(u16, Directions<f32>)> {
        self.measuring.next_directions()
    }

    /// Takes the measurement at the directions that [`LinearScan::next_directions`] gives now.
    ///
    /// # Errors
    /// If the values cannot be a BRDF; the same directions are then still the next ones.
    pub fn record(&mut self, measurement: Measurement) -> Result<(), MeasurementError> {
        self.measuring.record(measurement)
    }

    /// Solves further, by at most `budget` channels: progress counts them, three in all. Does
    /// nothing before all measurements are taken.
    pub fn advance_fit(&mut self, budget: usize) -> Progress {
        if self.measuring.is_complete() {
            for _ in 0..budget.min(CHANNELS.saturating_sub(self.solved)) {
                self.solve();
            }
        }
        Progress {
            done: self.solved as u32,
            total: CHANNELS as u32,
        }
    }

    /// The coefficients of the next channel.
    fn solve(&mut self) {
        let ridge = &self.ridge;
        let samples = self.measuring.samples().iter();
        let at = ridge.mean().iter().zip(ridge.median().iter());
        let at = at.zip(ridge.weight().iter());
        for ((t, sample), ((mean, median), weight)) in self.mapped.iter_mut().zip(samples).zip(at) {
            let brdf = sample.measured.get(self.solved).copied();
            *t = map(brdf.unwrap_or_default(), median, weight) - mean;
        }
        let mut channels = self
            .coefficients
            .chunks_exact_mut(ridge.components().max(1));
        if let Some(coefficients) = channels.nth(self.solved) {
            // All lengths were made to fit when the scan began: this cannot fail.
            let _ = self
                .factors
                .coefficients(self.mapped, coefficients, self.scratch);
        }
        self.solved = self.solved.saturating_add(1);
    }

    /// The coefficients as they are now, 0 before they are solved for: m for red, m for green, m
    /// for blue.
    #[must_use]
    pub fn coefficients(&self) -> &[f32] {
        self.coefficients
    }

    /// The recipe.
    #[must_use]
    pub fn recipe(&self) -> &Recipe<'a> {
        self.measuring.recipe()
    }

    /// How well the coefficients explain the measurements as they are now.
    #[must_use]
    pub fn residual(&self) -> Residual {
        let (ridge, samples) = (&self.ridge, self.measuring.samples().iter());
        let components = ridge.components().max(1);
        let rows = ridge.basis().words().chunks_exact(components);
        let at = ridge.mean().iter().zip(ridge.median().iter());
        let at = at.zip(ridge.weight().iter());
        let errors = samples.zip(rows.zip(at)).map(|(sample, (row, at))| {
            let ((mean, median), weight) = at;
            let mut modelled = [0.0; CHANNELS];
            let channels = self.coefficients.chunks_exact(components);
            for (f, coefficients) in modelled.iter_mut().zip(channels) {
                *f = unmap(dot(row, coefficients) + mean, median, weight);
            }
            let cosine = sample.at.cos_theta_i();
            cosine_weighted_log_error(sample.measured, modelled, cosine, 1.0 / 3.0)
                .error
                .value()
        });
        self.measuring.residual(errors)
    }
}
