//! A fit in progress, and the fitted material.

use core::marker::PhantomData;

use super::plausibility;
use super::plausibility::NODES;
use super::residual::Residual;
use super::stage::{Checks, Fitting, Stage};
use crate::error::{Error, ErrorCode};
use crate::fit::{Algorithm, FitMethod, Fitter, Progress, is_finite};
use crate::geometry::{Directions, HalfDifference};
use crate::model::linear::Basis;
use crate::model::{Samples, Slot};
use crate::recipe::Recipe;

/// A fit in progress.
///
/// ```
/// # use glimpse_core::model::Phong;
/// # use glimpse_core::recipe::{Recipe, memory_words};
/// # use glimpse_core::error::{Error, ErrorCode};
/// # use glimpse_core::scan::{Reading, Scan};
/// # static RECIPE: &[u8] = include_bytes!("../../examples/recipes/phong-n8.recipe");
/// # let mut memory = [0.0; memory_words(&[RECIPE])];
/// # let mut scan = Scan::<Phong>::new(Recipe::parse(RECIPE)?, &mut memory)?;
/// assert_eq!(scan.fit().err(), Some(Error::with(ErrorCode::Incomplete, [8, 0]))); // 8 are missing, the first is 0
///
/// while let Some((index, _)) = scan.next_pending() {
///     scan.record(index, Reading::monochrome(0.2 + 0.001 * f32::from(index)))?;
/// }
/// let mut fit = scan.fit()?;
/// let progress = fit.advance(100);
/// assert_eq!((progress.done, progress.total), (100, 185)); // 20 steps on 8 samples, then 25 checks
/// assert_eq!(fit.finish().err(), Some(Error::with(ErrorCode::Unfinished, [100, 185])));
///
/// let mut fit = scan.fit_under_way().unwrap(); // resumes the fit
/// assert!(fit.advance(85).is_complete());
/// let fitted = fit.finish()?;
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Fit<'s, K: Fitter> {
    pub(super) recipe: &'s Recipe<'s>,
    pub(super) basis: Option<Basis<'s>>,
    pub(super) slots: &'s [Slot],
    pub(super) words: &'s mut [f32],
    pub(super) stage: &'s mut Stage,
    pub(super) fitting: Fitting,
    pub(super) model: PhantomData<K>,
}

impl<'s, K: Fitter> Fit<'s, K> {
    /// Does at most `budget` units of work. A unit is the gradient of one sample, a row or a channel of Linear's solve,
    /// a part of a completion, or a part of the checks at the end. The result does not depend on the budgets.
    pub fn advance(&mut self, budget: u32) -> Progress {
        let Fitting { done, channels, .. } = self.fitting;
        let method = self.recipe.method;
        let total = K::total(&method, self.recipe.samples());
        let end = done.saturating_add(budget);
        let samples = Samples::new(self.slots, self.fitting.weight());
        if done < total {
            let budget = budget.min(total.saturating_sub(done));
            self.fitting.done = K::advance(self.words, &method, samples, channels, done, budget);
        }
        let end = end.min(self.progress().total);
        let functions = Functions::of::<K>();
        while (total..end).contains(&self.fitting.done) {
            let unit = self.fitting.done.saturating_sub(total);
            self.check(unit, &functions);
            self.fitting.done = self.fitting.done.saturating_add(1);
        }
        *self.stage = Stage::Fitting(self.fitting);
        self.progress()
    }

    fn check(&mut self, unit: u32, functions: &Functions) {
        let fit = Unchecked {
            method: &self.recipe.method,
            basis: self.basis.as_ref(),
            slots: self.slots,
            words: self.words,
        };
        fit.check(unit, functions, &mut self.fitting.checks);
    }

    /// Progress of the fit.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let samples = self.recipe.samples();
        let fit = K::total(&self.recipe.method, samples);
        Progress {
            done: self.fitting.done,
            total: fit.saturating_add(check_units(samples)),
        }
    }

    /// Returns the fitted material, if all values, and the material at every reading, are finite and plausible.
    ///
    /// # Errors
    /// [`ErrorCode::Unfinished`] before the fit is complete. [`ErrorCode::Diverged`] if a number is not finite. An error
    /// that [is implausible](Error::is_implausible) if the readings are unlikely to come from a material;
    /// [`Scan::fitted`](super::Scan::fitted) then still returns the fit.
    pub fn finish(self) -> Result<Fitted<'s, K>, Error> {
        let progress = self.progress();
        if !progress.is_complete() {
            return Err(Error::with(
                ErrorCode::Unfinished,
                [progress.done, progress.total],
            ));
        }
        let Fitting {
            readings, checks, ..
        } = self.fitting;
        let predicted = K::predicted_loss(self.words, &self.recipe.method);
        let Some(residual) = residual_of(&checks, self.recipe, predicted) else {
            *self.stage = Stage::Reading;
            return Err(Error::new(ErrorCode::Diverged));
        };
        *self.stage = Stage::Fitted { residual, readings };
        match residual.implausible {
            Some(code) => Err(Error::new(code)),
            None => Ok(Fitted {
                recipe: self.recipe,
                basis: self.basis,
                words: self.words,
                residual,
                readings,
                model: PhantomData,
            }),
        }
    }
}

/// The model's functions for the checks of a fit. The checks are not generic, so that firmware contains them once.
struct Functions {
    values: for<'w> fn(&'w [f32], &FitMethod<'_>) -> [&'w [f32]; 3],
    predicted_loss: fn(&[f32], &FitMethod<'_>) -> Option<f32>,
    at_sample: fn(&[f32], &FitMethod<'_>, usize, &HalfDifference<f32>) -> [f32; 3],
    brdf: Brdf,
}

/// A function that returns a fit's BRDF in linear RGB, sr^-1, not times the cosine.
type Brdf =
    fn(&[f32], &FitMethod<'_>, Option<&Basis<'_>>, &HalfDifference<f32>) -> Option<[f32; 3]>;

impl Functions {
    fn of<K: Algorithm>() -> Self {
        Self {
            values: K::values,
            predicted_loss: K::predicted_loss,
            at_sample: K::at_sample,
            brdf: K::brdf,
        }
    }
}

/// Number of units of the checks: one for the values, one for each sample, and one for each node of the albedo.
fn check_units(samples: usize) -> u32 {
    u32::from(NODES)
        .saturating_add(1)
        .saturating_add(samples as u32)
}

/// A complete fit before its checks.
struct Unchecked<'s> {
    method: &'s FitMethod<'s>,
    basis: Option<&'s Basis<'s>>,
    slots: &'s [Slot],
    words: &'s [f32],
}

impl Unchecked<'_> {
    /// Does one unit of the checks.
    #[inline(never)]
    fn check(&self, unit: u32, functions: &Functions, checks: &mut Checks) {
        let Self {
            method,
            basis,
            slots,
            words,
        } = *self;
        let Some(index) = unit.checked_sub(1) else {
            let predicted = (functions.predicted_loss)(words, method);
            let mut values = (functions.values)(words, method).into_iter();
            checks.has_overflowed = predicted.is_some_and(f32::is_nan) || !values.all(is_finite);
            return;
        };
        let index = index as usize;
        match slots.get(index) {
            Some(slot) => checks.sum.add(index as u16, slot, |at| {
                (functions.at_sample)(words, method, index, at)
            }),
            None => {
                let node = index.saturating_sub(slots.len()) as u16; // below NODES
                checks
                    .albedo
                    .add(node, |at| (functions.brdf)(words, method, basis, at));
            }
        }
    }
}

/// Returns the residual of a checked fit, or None if a number is not finite.
#[inline(never)]
fn residual_of(checks: &Checks, recipe: &Recipe<'_>, predicted: Option<f32>) -> Option<Residual> {
    let Checks {
        has_overflowed,
        mut sum,
        albedo,
    } = *checks;
    sum.residual.mean /= f32::from(sum.read.max(1));
    if has_overflowed || !sum.residual.mean.is_finite() {
        return None;
    }
    // A prediction that follows the residual cannot show that the residual is too large.
    let predicted = predicted.filter(|_| recipe.method.uncertainty().is_none());
    let expected = predicted.or_else(|| recipe.expected_loss());
    sum.residual.implausible = plausibility::check(&sum, expected, albedo);
    Some(sum.residual)
}

/// A fitted material.
///
/// ```
/// # use glimpse_core::geometry::Directions;
/// # use glimpse_core::model::Phong;
/// # use glimpse_core::recipe::{Recipe, memory_words};
/// # use glimpse_core::scan::{Reading, Scan};
/// # static RECIPE: &[u8] = include_bytes!("../../examples/recipes/phong-n8.recipe");
/// # let mut memory = [0.0; memory_words(&[RECIPE])];
/// # let mut scan = Scan::<Phong>::new(Recipe::parse(RECIPE)?, &mut memory)?;
/// # while let Some((index, _)) = scan.next_pending() {
/// #     scan.record(index, Reading::monochrome(0.2 + 0.001 * f32::from(index)))?;
/// # }
/// # let mut fit = scan.fit()?;
/// # while !fit.advance(8).is_complete() {}
/// let fitted = fit.finish()?;
///
/// let mut directions = Directions { incoming: [0.6, 0.0, 0.8], outgoing: [-0.6, 0.0, 0.8] };
/// let [red, green, blue] = fitted.brdf(&directions).unwrap();
/// assert!((0.1..0.3).contains(&red) && red == green && green == blue); // a gray material
/// directions.outgoing = [0.0, 0.0, -1.0]; // below the horizon
/// assert_eq!(fitted.brdf(&directions), None);
///
/// assert!(fitted.residual().mean < 0.05); // mean error at the readings
/// assert_eq!(fitted.values().count(), 7); // Phong's parameters
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Fitted<'s, K: Fitter> {
    pub(super) recipe: &'s Recipe<'s>,
    pub(super) basis: Option<Basis<'s>>,
    pub(super) words: &'s [f32],
    pub(super) residual: Residual,
    /// Number of readings that count in the fit.
    pub(super) readings: u16,
    pub(super) model: PhantomData<K>,
}

impl<K: Fitter> Fitted<'_, K> {
    /// The BRDF in linear RGB, sr^-1, not times the cosine.
    ///
    /// None if a direction is below the horizon, not finite or not of unit length; if the value overflows; or for
    /// Linear without a basis ([`Scan::with_basis`](super::Scan::with_basis)).
    #[must_use]
    pub fn brdf(&self, directions: &Directions<f32>) -> Option<[f32; 3]> {
        let at = HalfDifference::from_directions(directions).filter(HalfDifference::is_valid)?;
        let brdf = K::brdf(self.words, &self.recipe.method, self.basis.as_ref(), &at)?;
        Some(brdf).filter(|brdf| is_finite(brdf))
    }

    /// The fitted values, all finite: a model's parameters in its order, or Linear's coefficients, m
    /// for red, m for green, m for blue.
    pub fn values(&self) -> impl Iterator<Item = f32> {
        let values = K::values(self.words, &self.recipe.method);
        values.into_iter().flatten().copied()
    }

    /// The residual.
    #[must_use]
    pub fn residual(&self) -> Residual {
        self.residual
    }

    /// The loss predicted from this material's readings. Recipes that complete readings can predict it. None if the
    /// recipe does not, or if the loss overflows.
    ///
    /// It is the mean of |ln(1 + f cos(theta_i)) - ln(1 + f_fitted cos(theta_i))| over all directions, like
    /// [`expected_loss`](Fitted::expected_loss). A material unlike all training materials may have a larger loss.
    #[must_use]
    pub fn predicted_loss(&self) -> Option<f32> {
        let method = &self.recipe.method;
        let predicted = K::predicted_loss(self.words, method)?;
        let factor = method.loss_factor(self.residual.mean, self.readings);
        Some(predicted * factor).filter(|loss| loss.is_finite())
    }

    /// The upper bound of the loss, which holds for 90 % of materials. None if the recipe does not state it, or if it
    /// overflows.
    ///
    /// If the recipe [bounds the loss](Recipe::bounds_partial_loss) of fits with some of the readings, the bound and
    /// [`predicted_loss`](Fitted::predicted_loss) depend on the number of readings that count in the fit. They are then for
    /// the first readings in the recipe's order, and for materials like those of the training.
    #[must_use]
    pub fn loss_bound(&self) -> Option<f32> {
        let ratio = self.recipe.method.bound_ratio(self.readings)?;
        let bound = self.predicted_loss()? * ratio;
        Some(bound).filter(|bound| bound.is_finite())
    }

    /// Returns true if the readings are unlike those of all training materials, so that the predicted loss is uncertain.
    /// None if the recipe cannot tell.
    #[must_use]
    pub fn is_unlike_training(&self) -> Option<bool> {
        let method = &self.recipe.method;
        let innovation = K::innovation(self.words, method)?;
        Some(innovation > method.uncertainty()?.max_innovation)
    }

    /// The expected loss on a material outside the training set. None if the recipe states none.
    #[must_use]
    pub fn expected_loss(&self) -> Option<f32> {
        self.recipe.expected_loss()
    }
}
