//! A scan of one material: readings in any order, a fit in slices, a fitted material. Free of I/O
//! and of time; motors, sensor and clock are the firmware's.
//!
//! The states cannot be confused: a [`Scan`] takes readings, a [`Fit`] of all of them is under way,
//! a [`Fitted`] material answers. All of it lies in a [`Memory`] of the caller's, which the next
//! recipe may use again. [`Saved`] readings outlast a reset.

mod error;
mod fit;
mod memory;
mod reading;
mod residual;
mod saved;
mod status;

pub use error::{FinishError, FitError, ScanError, SkipError};
pub use fit::{Fit, Fitted};
pub use memory::Memory;
pub use reading::{MIN_READING, Reading, ReadingError, Recorded};
pub use residual::Residual;
pub use saved::{Saved, SavedError};

#[cfg(doc)]
use crate::fit::FitMethod;
use crate::fit::Fitter;
use crate::geometry::Directions;
use crate::model::linear::Basis;
use crate::recipe::Recipe;
use memory::Stage;
use status::Status;

/// A scan of one material by one recipe, taking readings.
///
/// `K` says how they are fitted: one model, or [`AnyModel`](crate::fit::AnyModel); `CAPACITY` is the
/// largest n that there is room for.
///
/// ```
/// use glimpse_core::model::Neural;
/// use glimpse_core::recipe::Recipe;
/// use glimpse_core::scan::{Memory, Reading, Scan};
///
/// # fn read(_: &glimpse_core::geometry::Directions<f32>) -> Reading { Reading::new([0.1; 3]) }
/// # fn motors_and_watchdog() {}
/// fn scan(recipe: &[u8], memory: &mut Memory<Neural, 8>) -> Result<(), Box<dyn core::error::Error>> {
///     let recipe = Recipe::parse(recipe)?;
///     let mut scan = Scan::new(recipe, memory)?;
///     while let Some((index, directions)) = scan.next_pending() {
///         scan.record(index, read(&directions))?;
///     }
///     let mut fit = scan.fit()?;
///     while !fit.advance(8).is_complete() {
///         motors_and_watchdog();
///     }
///     let fitted = fit.finish()?;
///     println!("{:?} after a residual of {}", fitted.brdf(&MIRROR), fitted.residual().mean);
///     Ok(())
/// }
/// # use glimpse_core::geometry::Directions;
/// const MIRROR: Directions<f32> = Directions {
///     incoming: [0.6, 0.0, 0.8],
///     outgoing: [-0.6, 0.0, 0.8],
/// };
/// # scan(include_bytes!("../examples/recipes/neural-n8.recipe"), &mut Memory::new()).unwrap();
/// ```
pub struct Scan<'r, 'm, K: Fitter, const CAPACITY: usize> {
    recipe: Recipe<'r>,
    basis: Option<Basis<'r>>,
    memory: &'m mut Memory<K, CAPACITY>,
}

impl<'r, 'm, K: Fitter, const CAPACITY: usize> Scan<'r, 'm, K, CAPACITY> {
    /// Whether this firmware can scan by a recipe: before one that was sent takes the place of another.
    ///
    /// # Errors
    /// If it is for another model, or asks for more room than `CAPACITY` or the model's words.
    pub fn accept(recipe: &Recipe<'_>) -> Result<(), ScanError> {
        let samples = recipe.samples();
        if samples > CAPACITY {
            return Err(ScanError::Capacity {
                capacity: CAPACITY,
                samples,
            });
        }
        K::accept(&recipe.method(), samples)?;
        Ok(())
    }

    /// Begins a scan: whatever `memory` held before is forgotten.
    ///
    /// # Errors
    /// As [`Scan::accept`].
    pub fn new(recipe: Recipe<'r>, memory: &'m mut Memory<K, CAPACITY>) -> Result<Self, ScanError> {
        Self::accept(&recipe)?;
        memory::lay_out(&mut memory.samples, &recipe);
        let mut scan = Self {
            recipe,
            basis: None,
            memory,
        };
        scan.restart();
        Ok(scan)
    }

    /// Gives Linear the basis by which [`Fitted::brdf`] answers; other models have no use for it.
    ///
    /// # Errors
    /// [`ScanError::Basis`] if the recipe names another one.
    pub fn with_basis(mut self, basis: Basis<'r>) -> Result<Self, ScanError> {
        let named = self.recipe.method().basis_checksum();
        if named != Some(basis.of()) {
            return Err(ScanError::Basis {
                recipe: named.unwrap_or(0),
                found: basis.of(),
            });
        }
        self.basis = Some(basis);
        Ok(self)
    }

    /// The basis that it was given.
    #[must_use]
    pub fn basis(&self) -> Option<&Basis<'r>> {
        self.basis.as_ref()
    }

    /// Forgets all readings and begins anew.
    pub fn restart(&mut self) {
        self.memory.stage = Stage::Reading;
        self.memory.status.fill(Status::PENDING);
    }

    /// The recipe.
    #[must_use]
    pub fn recipe(&self) -> &Recipe<'r> {
        &self.recipe
    }

    /// Where to read yet, in the recipe's order: index of the sample, and directions.
    ///
    /// Any of them may be next: [`Machine::nearest`](crate::gonio::Machine::nearest) chooses. Where a scan
    /// may end early, by a recipe that [takes missing readings](crate::fit::FitMethod::takes_missing), the
    /// first ones tell most.
    pub fn pending(&self) -> impl Iterator<Item = (u16, Directions<f32>)> {
        memory::pending(&self.memory.samples, &self.memory.status, &self.recipe)
    }

    /// The first of [`Scan::pending`], in the recipe's order; None once all are read.
    #[must_use]
    pub fn next_pending(&self) -> Option<(u16, Directions<f32>)> {
        memory::next_pending(&self.memory.samples, &self.memory.status, &self.recipe)
    }

    /// Takes the reading of a sample of the pattern, in any order. A second reading of the same
    /// sample replaces the first ([`gonio::Repeated`](crate::gonio::Repeated) averages instead); a fit
    /// that was under way is given up.
    ///
    /// # Errors
    /// If there is no such sample, or the reading cannot be one. Nothing has changed then.
    pub fn record(&mut self, index: u16, reading: Reading) -> Result<Recorded, ReadingError> {
        let Memory {
            samples, status, ..
        } = &mut *self.memory;
        let recorded = reading::record(samples, status, &self.recipe, index, reading)?;
        self.memory.stage = Stage::Reading;
        Ok(recorded)
    }

    /// Marks a sample that cannot be read: it is no longer pending, and a reading that it had is dropped. A later
    /// [`Scan::record`] of the sample undoes it.
    ///
    /// # Errors
    /// [`SkipError`] if the recipe does not [tolerate missing readings](FitMethod::takes_missing), or has no such
    /// sample. Nothing has changed then.
    pub fn skip(&mut self, index: u16) -> Result<(), SkipError> {
        let samples = self.recipe.samples();
        self.check_tolerance()?;
        let mut places = self.memory.status.iter_mut().take(samples);
        let Some(status) = places.nth(usize::from(index)) else {
            let samples = samples as u16;
            return Err(SkipError::Index { index, samples });
        };
        *status = Status::SKIPPED;
        self.memory.stage = Stage::Reading;
        Ok(())
    }

    /// Skips every pending sample, so that the fit uses the readings taken so far.
    ///
    /// # Errors
    /// [`SkipError::Required`] if the recipe does not tolerate missing readings. Nothing has changed then.
    pub fn finish_early(&mut self) -> Result<(), SkipError> {
        self.check_tolerance()?;
        for status in &mut self.memory.status {
            if *status == Status::PENDING {
                *status = Status::SKIPPED;
            }
        }
        Ok(())
    }

    fn check_tolerance(&self) -> Result<(), SkipError> {
        match self.recipe.method().takes_missing() {
            true => Ok(()),
            false => Err(SkipError::Required),
        }
    }

    /// The reading of a sample, if it was taken. (A fit brings what is too far below 0 up to what the
    /// loss can take.)
    #[must_use]
    pub fn reading(&self, index: u16) -> Option<Reading> {
        let places = self.memory.samples.iter().zip(&self.memory.status);
        let mut places = places.take(self.recipe.samples());
        let (sample, status) = places.nth(usize::from(index))?;
        status.is_read().then(|| Reading {
            brdf: sample.measured,
            saturated: status.is_saturated(),
        })
    }

    /// Asks anew for what was too far below 0: a fit has brought it up, and so it may no longer be
    /// what was read.
    pub(crate) fn forget_clamped(&mut self) {
        for status in &mut self.memory.status {
            if status.is_clamped() {
                *status = Status::PENDING;
                self.memory.stage = Stage::Reading;
            }
        }
    }

    /// Begins a fit of all readings. One that was under way, or has ended, is forgotten.
    ///
    /// Where the recipe [can do without](FitMethod::takes_missing) some of them, those that are missing or
    /// saturated are left out, as long as there is one to go by.
    ///
    /// # Errors
    /// [`FitError::Incomplete`] if a reading is missing that the recipe needs, or if there is none at all,
    /// [`FitError::Implausible`] if the readings are no BRDF's.
    pub fn fit(&mut self) -> Result<Fit<'_, K, CAPACITY>, FitError> {
        let Memory {
            samples, status, ..
        } = &mut *self.memory;
        let counted = memory::weigh(samples, status, &self.recipe);
        if counted == 0 {
            return Err(memory::incomplete(status, &self.recipe));
        }
        let samples = self.memory.samples.get_mut(..self.recipe.samples());
        let samples = samples.unwrap_or_default();
        let method = self.recipe.method();
        reading::prepare(samples, &method)?;
        K::start(&mut self.memory.workspace, &method);
        self.memory.stage = Stage::Fitting { done: 0 };
        Ok(Fit::new(&self.recipe, self.basis, self.memory, 0))
    }

    /// The fit that was begun and not finished, where it was left; None if there is none, or a
    /// reading has come since. For firmware that cannot keep a [`Fit`] between two turns of its
    /// loop.
    pub fn fit_under_way(&mut self) -> Option<Fit<'_, K, CAPACITY>> {
        match self.memory.stage {
            Stage::Fitting { done } => Some(Fit::new(&self.recipe, self.basis, self.memory, done)),
            _ => None,
        }
    }

    /// The material that was fitted last; None if no fit was finished since the last reading.
    #[must_use]
    pub fn fitted(&self) -> Option<Fitted<'_, K, CAPACITY>> {
        match self.memory.stage {
            Stage::Fitted(residual) => {
                Some(Fitted::new(&self.recipe, self.basis, self.memory, residual))
            }
            _ => None,
        }
    }

    /// The memory, for another scan. (A scan that only borrowed it gives it back by itself.)
    #[must_use]
    pub fn into_memory(self) -> &'m mut Memory<K, CAPACITY> {
        self.memory
    }
}
