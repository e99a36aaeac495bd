//! A fit in progress, and the fitted material.

use core::marker::PhantomData;

use super::plausibility;
use super::plausibility::NODES;
use super::residual::Residual;
use super::state::{Checks, Fitting, Stage, State, split, split_mut};
use crate::error::{Error, ErrorCode};
use crate::fit::{Functions, PredictedLoss, Progress, ScanModel, is_finite};
use crate::geometry::{Directions, HalfDifference};
use crate::model::Samples;
use crate::recipe::Recipe;

/// A fit in progress.
///
/// ```
/// # use glimpse_core::model::Phong;
/// # use glimpse_core::recipe::{Recipe, memory_words};
/// # use glimpse_core::error::{Error, ErrorCode};
/// # use glimpse_core::gonio::Reading;
/// # use glimpse_core::scan::Scan;
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
pub struct Fit<'s, 'a, K: ScanModel> {
    state: &'s mut State<'a>,
    pub(super) fitting: Fitting,
    model: PhantomData<K>,
}

impl<'s, 'a, K: ScanModel> Fit<'s, 'a, K> {
    pub(super) fn new(state: &'s mut State<'a>, fitting: Fitting) -> Self {
        state.stage = Stage::Fitting(fitting);
        Self {
            state,
            fitting,
            model: PhantomData,
        }
    }

    /// Does at most `budget` units of work. A unit is the gradient of one sample, a row or a channel of Linear's solve,
    /// a part of another stage, or a part of the checks at the end. The result does not depend on the budgets.
    pub fn advance(&mut self, budget: u32) -> Progress {
        let Progress { done, total } = self.progress();
        let State { recipe, memory, .. } = &mut *self.state;
        let Ok(functions) = K::functions(recipe.model()) else {
            return self.progress(); // impossible: the scan has accepted the recipe
        };
        let (slots, words) = split_mut(memory, recipe);
        let estimator = &recipe.estimator;
        let units = estimator.units(slots.len());
        let end = done.saturating_add(budget).min(total);
        if done < units {
            let Fitting {
                readings, channels, ..
            } = self.fitting;
            let weight = 1.0 / (3.0 * f32::from(readings));
            let inputs = (Samples::new(slots, weight), channels);
            estimator.advance(functions, words, inputs, done, end.min(units));
        }
        for unit in done.max(units)..end {
            let checks = &mut self.fitting.checks;
            check(self.state, functions, unit.saturating_sub(units), checks);
        }
        self.fitting.done = end;
        self.state.stage = Stage::Fitting(self.fitting);
        self.progress()
    }

    /// Progress of the fit.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let samples = self.state.recipe.samples();
        let fit = self.state.recipe.estimator.units(samples);
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
        let Some(residual) = residual_of(&checks, &self.state.recipe) else {
            self.state.stage = Stage::Reading;
            return Err(Error::new(ErrorCode::Diverged));
        };
        self.state.stage = Stage::Fitted { residual, readings };
        match residual.implausible {
            Some(code) => Err(Error::new(code)),
            None => Ok(Fitted {
                state: self.state,
                residual,
                readings,
                model: PhantomData,
            }),
        }
    }
}

/// Number of units of the checks: one for the values, one for each sample, and one for each node of the albedo.
fn check_units(samples: usize) -> u32 {
    u32::from(NODES)
        .saturating_add(1)
        .saturating_add(samples as u32)
}

/// Does one unit of the checks of a complete fit.
#[inline(never)]
fn check(state: &State<'_>, functions: &Functions, unit: u32, checks: &mut Checks) {
    let estimator = &state.recipe.estimator;
    let (slots, words) = split(state.memory, &state.recipe);
    let Some(index) = unit.checked_sub(1) else {
        checks.has_overflowed = !estimator.is_finite(words);
        return;
    };
    let index = index as usize;
    match slots.get(index) {
        Some(slot) => checks.sum.add(index as u16, slot, |at| {
            estimator.at_sample(functions, words, index, at)
        }),
        None => {
            let node = index.saturating_sub(slots.len()) as u16; // below NODES
            let basis = state.basis.as_ref();
            let brdf = |at: &_| estimator.brdf(functions, words, basis, at);
            checks.albedo.add(node, brdf);
        }
    }
}

/// Returns the residual of a checked fit, or None if a number is not finite.
#[inline(never)]
fn residual_of(checks: &Checks, recipe: &Recipe<'_>) -> Option<Residual> {
    let Checks {
        has_overflowed,
        mut sum,
        albedo,
    } = *checks;
    sum.residual.mean /= f32::from(sum.read.max(1));
    if has_overflowed || !sum.residual.mean.is_finite() {
        return None;
    }
    // Not the predicted loss: it follows the residual, and cannot show that the residual is too large.
    sum.residual.implausible = plausibility::check(&sum, recipe.expected_loss(), albedo);
    Some(sum.residual)
}

/// A fitted material.
///
/// ```
/// # use glimpse_core::geometry::Directions;
/// # use glimpse_core::model::Phong;
/// # use glimpse_core::recipe::{Recipe, memory_words};
/// # use glimpse_core::gonio::Reading;
/// # use glimpse_core::scan::Scan;
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
/// assert!(fitted.residual().mean < 0.06); // mean error at the readings
/// assert_eq!(fitted.values().count(), 7); // Phong's parameters
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Fitted<'s, K: ScanModel> {
    pub(super) state: &'s State<'s>,
    pub(super) residual: Residual,
    /// Number of readings that count in the fit.
    pub(super) readings: u16,
    pub(super) model: PhantomData<K>,
}

impl<K: ScanModel> Fitted<'_, K> {
    fn words(&self) -> &[f32] {
        split(self.state.memory, &self.state.recipe).1
    }

    fn predicted(&self) -> Option<PredictedLoss> {
        let estimator = &self.state.recipe.estimator;
        estimator.predicted_loss(self.words(), self.residual.mean, self.readings)
    }

    /// The BRDF in linear RGB, sr^-1, not times the cosine.
    ///
    /// None if a direction is below the horizon, not finite or not of unit length; if the value overflows; or for
    /// Linear without a basis ([`Scan::with_basis`](super::Scan::with_basis)).
    #[must_use]
    pub fn brdf(&self, directions: &Directions<f32>) -> Option<[f32; 3]> {
        let at = HalfDifference::from_directions(directions).filter(HalfDifference::is_valid)?;
        let State { recipe, basis, .. } = self.state;
        let functions = K::functions(recipe.model()).ok()?;
        let brdf = recipe
            .estimator
            .brdf(functions, self.words(), basis.as_ref(), &at)?;
        Some(brdf).filter(|brdf| is_finite(brdf))
    }

    /// The fitted values, all finite: a model's parameters in its order, or Linear's coefficients, K
    /// for red, K for green, K for blue.
    pub fn values(&self) -> impl Iterator<Item = f32> {
        let values = self.state.recipe.estimator.values_of(self.words());
        values.into_iter().flatten().copied()
    }

    /// The residual.
    #[must_use]
    pub fn residual(&self) -> Residual {
        self.residual
    }

    /// The loss predicted from this material's readings. None if the recipe has no prediction,
    /// or if the loss overflows.
    ///
    /// It is the mean of |ln(1 + f cos(theta_i)) - ln(1 + f_fitted cos(theta_i))| over all directions, like
    /// [`expected_loss`](Recipe::expected_loss). A material unlike all training materials may have a larger loss.
    #[must_use]
    pub fn predicted_loss(&self) -> Option<f32> {
        let loss = self.predicted()?.loss;
        Some(loss).filter(|loss| loss.is_finite())
    }

    /// The upper bound of the loss, which holds for 90 % of materials. None if the recipe does not state it, or if it
    /// overflows.
    ///
    /// If the recipe [bounds the loss](Recipe::bounds_partial_loss) of fits with some of the readings, the bound and
    /// [`predicted_loss`](Fitted::predicted_loss) depend on the number of readings that count in the fit. They are then for
    /// the first readings in the recipe's order, and for materials like those of the training.
    #[must_use]
    pub fn loss_bound(&self) -> Option<f32> {
        let bound = self.predicted()?.bound;
        Some(bound).filter(|bound| bound.is_finite())
    }

    /// Returns true if the readings are unlike those of all training materials, so that the predicted loss is uncertain.
    /// None if the recipe cannot tell.
    #[must_use]
    pub fn is_unlike_training(&self) -> Option<bool> {
        Some(self.predicted()?.is_unlike_training)
    }
}
