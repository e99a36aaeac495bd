//! A fit under way, and the material that it finds.

use super::memory::{Memory, Stage};
use super::residual::Sum;
use super::{FinishError, Residual};
use crate::fit::{Fitter, Progress};
use crate::geometry::{Directions, HalfDifference};
use crate::model::linear::Basis;
use crate::recipe::Recipe;

/// A fit of all readings, under way.
///
/// ```
/// # use glimpse_core::model::Phong;
/// # use glimpse_core::recipe::Recipe;
/// # use glimpse_core::scan::{FinishError, FitError, Memory, Reading, Scan};
/// # let recipe = Recipe::parse(include_bytes!("../../examples/recipes/phong-n8.recipe"))?;
/// # let mut memory = Memory::<Phong, 8>::new();
/// # let mut scan = Scan::new(recipe, &mut memory)?;
/// assert!(matches!(scan.fit(), Err(FitError::Incomplete { missing: 8, first: 0 })));
///
/// while let Some((index, _)) = scan.next_pending() {
///     scan.record(index, Reading::monochrome(0.2))?;
/// }
/// let mut fit = scan.fit()?;
/// let progress = fit.advance(100);
/// assert_eq!((progress.done, progress.total), (100, 160)); // 20 steps on 8 samples
/// assert!(matches!(fit.finish(), Err(FinishError::Unfinished(_))));
///
/// let mut fit = scan.fit_under_way().unwrap(); // where it was left
/// assert!(fit.advance(60).is_complete());
/// let fitted = fit.finish()?;
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
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

    /// Does at most `budget` units of work: gradients of one sample, rows and channels of
    /// Linear's solve, or parts of a completion. The result does not depend on the budgets.
    pub fn advance(&mut self, budget: u32) -> Progress {
        let Memory {
            samples, workspace, ..
        } = &mut *self.memory;
        let samples = samples.get(..self.recipe.samples()).unwrap_or_default();
        let method = self.recipe.method();
        self.done = K::advance(workspace, &method, samples, self.done, budget);
        self.memory.stage = Stage::Fitting { done: self.done };
        self.progress()
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        Progress {
            done: self.done,
            total: K::total(&self.recipe.method(), self.recipe.samples()),
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
        let method = self.recipe.method();
        let finite = K::is_finite(&self.memory.workspace, &method);
        let residual = residual(self.recipe, self.memory);
        if !(finite && residual.mean.is_finite()) {
            self.memory.stage = Stage::Reading;
            return Err(FinishError::Diverged);
        }
        self.memory.stage = Stage::Fitted(residual);
        Ok(Fitted::new(self.recipe, self.basis, self.memory, residual))
    }
}

/// The residual; its mean is not finite if the fitted material, or the error, at any reading is not.
fn residual<K: Fitter, const CAPACITY: usize>(
    recipe: &Recipe<'_>,
    memory: &Memory<K, CAPACITY>,
) -> Residual {
    let method = recipe.method();
    let samples = memory.samples.get(..recipe.samples()).unwrap_or_default();
    let mut sum = Sum::default();
    let mut read: usize = 0;
    for (index, (sample, status)) in samples.iter().zip(&memory.status).enumerate() {
        if !status.is_read() {
            continue;
        }
        if sample.weight <= 0.0 {
            sum.left_out(*status);
            continue;
        }
        read = read.saturating_add(1);
        let modelled = K::at_sample(&memory.workspace, &method, index, &sample.at);
        sum.add(index as u16, sample, *status, modelled);
    }
    sum.residual.mean /= read.max(1) as f32;
    sum.residual
}

/// A fitted material.
///
/// ```
/// # use glimpse_core::geometry::Directions;
/// # use glimpse_core::model::Phong;
/// # use glimpse_core::recipe::Recipe;
/// # use glimpse_core::scan::{FinishError, FitError, Memory, Reading, Scan};
/// # let recipe = Recipe::parse(include_bytes!("../../examples/recipes/phong-n8.recipe"))?;
/// # let mut memory = Memory::<Phong, 8>::new();
/// # let mut scan = Scan::new(recipe, &mut memory)?;
/// # while let Some((index, _)) = scan.next_pending() {
/// #     scan.record(index, Reading::monochrome(0.2))?;
/// # }
/// # let mut fit = scan.fit()?;
/// # while !fit.advance(8).is_complete() {}
/// let fitted = fit.finish()?;
///
/// let mut directions = Directions { incoming: [0.6, 0.0, 0.8], outgoing: [-0.6, 0.0, 0.8] };
/// let brdf = fitted.brdf(&directions).unwrap();
/// assert!(brdf.iter().all(|value| (0.1..0.3).contains(value)));
/// directions.outgoing = [0.0, 0.0, -1.0]; // below the horizon there is no BRDF
/// assert_eq!(fitted.brdf(&directions), None);
///
/// assert!(fitted.residual().mean < 0.05); // how well the readings are explained
/// assert_eq!(fitted.values().count(), 7); // Phong's parameters
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
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
    /// without a basis ([`Scan::with_basis`](super::Scan::with_basis)), or where it would be more than a
    /// number can hold.
    #[must_use]
    pub fn brdf(&self, directions: &Directions<f32>) -> Option<[f32; 3]> {
        let at = HalfDifference::from_directions(directions).filter(HalfDifference::is_valid)?;
        let method = self.recipe.method();
        K::brdf(&self.memory.workspace, &method, self.basis.as_ref(), &at)
    }

    /// The fitted values, all finite: a model's parameters in its order, or Linear's coefficients, m
    /// for red, m for green, m for blue.
    pub fn values(&self) -> impl Iterator<Item = f32> {
        K::values(&self.memory.workspace, self.recipe.method())
    }

    /// How well they explain the readings.
    #[must_use]
    pub fn residual(&self) -> Residual {
        self.residual
    }

    /// The loss that this fit is likely to have, by its readings: an error bar for this material, where
    /// the recipe predicts one, as those that complete readings do. None if it predicts none, or more than
    /// a number can hold.
    ///
    /// It is the mean of ln(1 + f cos(theta_i)) missed over all directions, as
    /// [`expected_loss`](Fitted::expected_loss) is; a material unlike any that the recipe was trained
    /// on may lose more.
    #[must_use]
    pub fn predicted_loss(&self) -> Option<f32> {
        let predicted = K::predicted_loss(&self.memory.workspace, &self.recipe.method());
        predicted.filter(|loss| loss.is_finite())
    }

    /// The loss to expect on a material that training never saw; None if the recipe states none.
    #[must_use]
    pub fn expected_loss(&self) -> Option<f32> {
        self.recipe.expected_loss()
    }
}
