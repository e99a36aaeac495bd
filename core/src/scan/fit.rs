//! A fit under way, and the material that it finds.

use super::memory::{Memory, Stage};
use super::{FinishError, Residual};
use crate::fit::{Fitter, Progress};
use crate::geometry::{Directions, HalfDifference};
use crate::model::linear::Basis;
use crate::model::loss::cosine_weighted_log_error;
use crate::recipe::Recipe;

/// A fit of all readings, under way.
pub struct Fit<'s, K: Fitter, const CAPACITY: usize> {
    recipe: &'s Recipe<'s>,
    basis: Option<Basis<'s>>,
    memory: &'s mut Memory<K, CAPACITY>,
    done: u32,
}

impl<'s, K: Fitter, const CAPACITY: usize> Fit<'s, K, CAPACITY> {
    pub(super) fn new(
        recipe: &'s Recipe<'s>,
        basis: Option<Basis<'s>>,
        memory: &'s mut Memory<K, CAPACITY>,
        done: u32,
    ) -> Self {
        Self {
            recipe,
            basis,
            memory,
            done,
        }
    }

    /// Does at most `budget` units of work: gradients of one sample, or rows and channels of
    /// Linear's solve. The result does not depend on the budgets.
    pub fn advance(&mut self, budget: u32) -> Progress {
        let Memory {
            samples, workspace, ..
        } = &mut *self.memory;
        let samples = samples.get(..self.recipe.samples()).unwrap_or_default();
        let learner = self.recipe.learner();
        self.done = K::advance(workspace, &learner, samples, self.done, budget);
        self.memory.stage = Stage::Fitting { done: self.done };
        self.progress()
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        Progress {
            done: self.done,
            total: K::total(&self.recipe.learner(), self.recipe.samples()),
        }
    }

    /// Looks at every value, and at the fitted material at every reading.
    ///
    /// # Errors
    /// [`FinishError::Unfinished`] before the fit is complete, [`FinishError::Diverged`] if a number
    /// is not finite.
    #[inline(never)]
    pub fn finish(self) -> Result<Fitted<'s, K, CAPACITY>, FinishError> {
        let progress = self.progress();
        if !progress.is_complete() {
            return Err(FinishError::Unfinished(progress));
        }
        let learner = self.recipe.learner();
        let finite = K::values(&self.memory.workspace, learner).all(f32::is_finite);
        let residual = residual(self.recipe, self.memory);
        if !(finite && residual.mean.is_finite()) {
            self.memory.stage = Stage::Reading;
            return Err(FinishError::Diverged);
        }
        self.memory.stage = Stage::Fitted(residual);
        Ok(Fitted::new(self.recipe, self.basis, self.memory, residual))
    }
}

/// The residual; its mean is not finite if the error at any reading is not.
fn residual<K: Fitter, const CAPACITY: usize>(
    recipe: &Recipe<'_>,
    memory: &Memory<K, CAPACITY>,
) -> Residual {
    let learner = recipe.learner();
    let samples = memory.samples.get(..recipe.samples()).unwrap_or_default();
    let mut residual = Residual::default();
    let mut before = None;
    for (index, (sample, status)) in samples.iter().zip(&memory.status).enumerate() {
        let modelled = K::at_sample(&memory.workspace, &learner, index, &sample.at);
        let cosine = sample.at.cos_theta_i();
        let loss = cosine_weighted_log_error(sample.measured, modelled, cosine, 1.0 / 3.0);
        let error = loss.error.value();
        residual.mean += error / samples.len() as f32;
        if error > residual.worst {
            residual.worst = error;
            residual.worst_index = index as u16;
        }
        let bits = sample.measured.map(f32::to_bits);
        let count = |sum: u16, flag: bool| sum.saturating_add(u16::from(flag));
        residual.repeated = count(residual.repeated, before == Some(bits));
        residual.saturated = count(residual.saturated, status.is_saturated());
        residual.clamped = count(residual.clamped, status.is_clamped());
        before = Some(bits);
    }
    residual
}

/// A fitted material.
pub struct Fitted<'s, K: Fitter, const CAPACITY: usize> {
    recipe: &'s Recipe<'s>,
    basis: Option<Basis<'s>>,
    memory: &'s Memory<K, CAPACITY>,
    residual: Residual,
}

impl<'s, K: Fitter, const CAPACITY: usize> Fitted<'s, K, CAPACITY> {
    pub(super) fn new(
        recipe: &'s Recipe<'s>,
        basis: Option<Basis<'s>>,
        memory: &'s Memory<K, CAPACITY>,
        residual: Residual,
    ) -> Self {
        Self {
            recipe,
            basis,
            memory,
            residual,
        }
    }

    /// The BRDF in linear RGB, sr^-1 (not times the cosine).
    ///
    /// None where a direction is below the horizon, not finite or not of unit length; and for Linear
    /// without a basis ([`Scan::with_basis`](super::Scan::with_basis)).
    #[must_use]
    pub fn brdf(&self, directions: &Directions<f32>) -> Option<[f32; 3]> {
        let at = HalfDifference::from_directions(directions).filter(HalfDifference::is_valid)?;
        let learner = self.recipe.learner();
        K::brdf(&self.memory.workspace, &learner, self.basis.as_ref(), &at)
    }

    /// The fitted values, all finite: a model's parameters in its order, or Linear's coefficients, m
    /// for red, m for green, m for blue.
    pub fn values(&self) -> impl Iterator<Item = f32> {
        K::values(&self.memory.workspace, self.recipe.learner())
    }

    /// How well they explain the readings.
    #[must_use]
    pub fn residual(&self) -> Residual {
        self.residual
    }

    /// The loss to expect on a material that training never saw; None if the recipe states none.
    #[must_use]
    pub fn expected_loss(&self) -> Option<f32> {
        Some(self.recipe.expected_loss())
    }
}
