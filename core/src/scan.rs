//! A scan of one material: readings in any order, a fit in slices, a fitted material. Free of I/O
//! and of time; motors, sensor and clock are the firmware's.
//!
//! The states cannot be confused: a [`Scan`] takes readings, a [`Fit`] of all of them is under way,
//! a [`Fitted`] material answers. All of it lies in the caller's memory, which the next
//! recipe may use again. [`Saved`] readings outlast a reset.

mod error;
mod fit;
mod implausible;
mod memory;
mod plausibility;
mod reading;
mod residual;
mod saved;
mod stage;
mod status;

pub use error::{FinishError, FitError, ScanError, SkipError};
pub use fit::{Fit, Fitted};
pub use implausible::Implausible;
pub use reading::{MIN_READING, Reading, ReadingError, Recorded};
pub use residual::Residual;
pub use saved::{Saved, SavedError};

use core::marker::PhantomData;

use crate::fit::Fitter;
use crate::geometry::Directions;
use crate::model::linear::Basis;
use crate::model::{SLOT_WORDS, Slot};
use crate::recipe::Recipe;
use memory::{measured_at, split, split_mut};
use stage::{Fitting, Stage};
use status::Status;

/// A scan of one material, taking readings.
///
/// `K` is the model: one of the four, or [`AnyModel`](crate::fit::AnyModel), which does what the recipe says.
/// The memory is the caller's: a list of numbers whose length
/// [`memory_words`](crate::recipe::memory_words) computes from the recipe at compile time. It holds the readings and
/// what the fit works in, and serves one scan after the other.
///
/// ```
/// use glimpse_core::model::Neural;
/// use glimpse_core::recipe::{Recipe, memory_words};
/// use glimpse_core::scan::{Reading, Scan};
///
/// # fn read(index: u16) -> Reading { Reading::new([0.1 + 0.01 * f32::from(index); 3]) }
/// # fn motors_and_watchdog() {}
/// static RECIPE: &[u8] = include_bytes!("../examples/recipes/neural-n8.recipe");
/// let mut memory = [0.0; memory_words(&[RECIPE])]; // or a static, by `static_cell::StaticCell`
///
/// let mut scan = Scan::<Neural>::new(Recipe::parse(RECIPE)?, &mut memory)?;
/// while let Some((index, directions)) = scan.next_pending() {
///     scan.record(index, read(index))?; // moves the arms to `directions`
/// }
/// let mut fit = scan.fit()?;
/// while !fit.advance(8).is_complete() {
///     motors_and_watchdog();
/// }
/// let fitted = fit.finish()?;
/// println!("residual {}", fitted.residual().mean);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct Scan<'a, K: Fitter> {
    recipe: Recipe<'a>,
    basis: Option<Basis<'a>>,
    memory: &'a mut [f32],
    /// Words of the memory that this recipe needs.
    needed: usize,
    stage: Stage,
    model: PhantomData<K>,
}

impl<'a, K: Fitter> Scan<'a, K> {
    /// Checks that this firmware can scan with a recipe, in a memory of `words` words, before the recipe replaces
    /// another one. Returns how many words it needs.
    ///
    /// # Errors
    /// If the recipe is for another model, or needs more memory.
    pub fn accept(recipe: &Recipe<'_>, words: usize) -> Result<usize, ScanError> {
        let samples = recipe.samples();
        let work = K::words(&recipe.method, samples)?;
        let needed = samples.saturating_mul(SLOT_WORDS).saturating_add(work);
        if needed > words {
            let found = words;
            return Err(ScanError::Memory { needed, found });
        }
        Ok(needed)
    }

    /// Begins a scan. What `memory` held before is overwritten.
    ///
    /// # Errors
    /// As [`Scan::accept`].
    pub fn new(recipe: Recipe<'a>, memory: &'a mut [f32]) -> Result<Self, ScanError> {
        let needed = Self::accept(&recipe, memory.len())?;
        let mut scan = Self {
            recipe,
            basis: None,
            memory,
            needed,
            stage: Stage::Reading,
            model: PhantomData,
        };
        let (slots, _) = scan.parts();
        memory::lay_out(slots, &recipe);
        Ok(scan)
    }

    /// The samples, and the words of the fit.
    fn parts(&mut self) -> (&mut [Slot], &mut [f32]) {
        let memory = self.memory.get_mut(..self.needed).unwrap_or_default();
        split_mut(memory, self.recipe.samples())
    }

    fn slots(&self) -> &[Slot] {
        split(self.memory, self.recipe.samples()).0
    }

    /// Gives Linear the basis that [`Fitted::brdf`] needs (`trainer export --format basis` writes it); `AnyModel` uses it
    /// with recipes of Linear.
    ///
    /// # Errors
    /// [`ScanError::Basis`] if the recipe names another one, or none, as recipes of other models do.
    pub fn with_basis(mut self, basis: Basis<'a>) -> Result<Self, ScanError> {
        let named = self.recipe.method.basis_checksum();
        if named != Some(basis.of()) {
            return Err(ScanError::Basis {
                recipe: named,
                found: basis.of(),
            });
        }
        self.basis = Some(basis);
        Ok(self)
    }

    /// The basis, if it was given one.
    #[must_use]
    pub fn basis(&self) -> Option<&Basis<'a>> {
        self.basis.as_ref()
    }

    /// Forgets all readings and starts again.
    pub fn restart(&mut self) {
        self.stage = Stage::Reading;
        let (slots, _) = self.parts();
        slots.iter_mut().for_each(|slot| Status::PENDING.put(slot));
    }

    /// The recipe.
    #[must_use]
    pub fn recipe(&self) -> &Recipe<'a> {
        &self.recipe
    }

    /// The pending samples, in the recipe's order: index and directions.
    ///
    /// Read them in any order; [`Machine::nearest`](crate::gonio::Machine::nearest) chooses the nearest. With a recipe
    /// that [tolerates missing readings](Recipe::tolerates_missing) a scan may finish early; then the first samples are
    /// the most informative.
    pub fn pending(&self) -> impl Iterator<Item = (u16, Directions<f32>)> {
        memory::pending(self.slots())
    }

    /// The first of [`Scan::pending`], in the recipe's order; None if every sample is read or skipped.
    #[must_use]
    pub fn next_pending(&self) -> Option<(u16, Directions<f32>)> {
        memory::next_pending(self.slots())
    }

    /// Records the reading of a sample of the pattern, in any order. A second reading of the same sample replaces the
    /// first ([`gonio::Repeated`](crate::gonio::Repeated) averages instead), and a fit that was under way is discarded.
    ///
    /// # Errors
    /// If the index is too large, or the reading is invalid. Nothing has changed then.
    pub fn record(&mut self, index: u16, reading: Reading) -> Result<Recorded, ReadingError> {
        let recipe = self.recipe;
        let (slots, _) = self.parts();
        let recorded = reading::record(slots, &recipe, index, reading)?;
        self.stage = Stage::Reading;
        Ok(recorded)
    }

    /// Marks a sample that cannot be read: it stops being pending, and loses a reading that it had. A later
    /// [`Scan::record`] of the sample undoes it.
    ///
    /// # Errors
    /// [`SkipError`] if the recipe does not [tolerate missing readings](Recipe::tolerates_missing), or has no such
    /// sample. Nothing has changed then.
    pub fn skip(&mut self, index: u16) -> Result<(), SkipError> {
        self.check_tolerance()?;
        let samples = self.recipe.samples() as u16;
        let (slots, _) = self.parts();
        let Some(slot) = slots.get_mut(usize::from(index)) else {
            return Err(SkipError::Index { index, samples });
        };
        Status::SKIPPED.put(slot);
        self.stage = Stage::Reading;
        Ok(())
    }

    /// Skips every pending sample, so that the fit uses the readings taken so far.
    ///
    /// # Errors
    /// [`SkipError::Required`] if the recipe does not tolerate missing readings. Nothing has changed then.
    pub fn finish_early(&mut self) -> Result<(), SkipError> {
        self.check_tolerance()?;
        let (slots, _) = self.parts();
        for slot in slots {
            if Status::of(slot) == Status::PENDING {
                Status::SKIPPED.put(slot);
            }
        }
        Ok(())
    }

    fn check_tolerance(&self) -> Result<(), SkipError> {
        match self.recipe.method.tolerates_missing() {
            true => Ok(()),
            false => Err(SkipError::Required),
        }
    }

    /// The reading of a sample, if it was recorded. (A fit raises values that are too far below 0 for the loss.)
    #[must_use]
    pub fn reading(&self, index: u16) -> Option<Reading> {
        let slot = self.slots().get(usize::from(index))?;
        let status = Status::of(slot);
        status.is_read().then(|| Reading {
            brdf: measured_at(slot),
            saturated: status.is_saturated(),
        })
    }

    /// Makes clamped samples pending again: a fit has raised their values, which are no longer the sensor's.
    pub(crate) fn forget_clamped(&mut self) {
        let (slots, _) = self.parts();
        let mut clamped = slots
            .iter_mut()
            .filter(|slot| Status::of(slot).is_clamped());
        let any = clamped
            .by_ref()
            .map(|slot| Status::PENDING.put(slot))
            .count()
            > 0;
        if any {
            self.stage = Stage::Reading;
        }
    }

    /// Begins a fit of all readings. An earlier fit, finished or not, is discarded.
    ///
    /// If the recipe [tolerates missing readings](Recipe::tolerates_missing), missing and saturated ones are left out,
    /// as long as one is left.
    ///
    /// # Errors
    /// [`FitError::Incomplete`] if a reading is missing that the recipe needs, or if there is none at all,
    /// [`FitError::TooLarge`] if the readings are too large for any material.
    pub fn fit(&mut self) -> Result<Fit<'_, K>, FitError> {
        let recipe = self.recipe;
        let method = recipe.method;
        let (slots, words) = self.parts();
        let counted = memory::weigh(slots, &recipe);
        if counted == 0 {
            return Err(memory::incomplete(slots));
        }
        let channels = reading::prepare(slots, &method)?;
        K::start(words, &method, channels);
        Ok(self.fit_from(Fitting {
            done: 0,
            channels,
            weight: 1.0 / (3.0 * counted as f32),
        }))
    }

    fn fit_from(&mut self, fitting: Fitting) -> Fit<'_, K> {
        self.stage = Stage::Fitting(fitting);
        let memory = self.memory.get_mut(..self.needed).unwrap_or_default();
        let (slots, words) = split_mut(memory, self.recipe.samples());
        Fit {
            recipe: &self.recipe,
            basis: self.basis,
            slots,
            words,
            stage: &mut self.stage,
            fitting,
            model: PhantomData,
        }
    }

    /// The fit that was begun and not finished; None if there is none, or a reading was recorded since. For firmware
    /// that cannot keep a [`Fit`] between two turns of its loop.
    pub fn fit_under_way(&mut self) -> Option<Fit<'_, K>> {
        match self.stage {
            Stage::Fitting(fitting) => Some(self.fit_from(fitting)),
            _ => None,
        }
    }

    /// The fitted material; None if no fit was finished since the last reading.
    #[must_use]
    pub fn fitted(&self) -> Option<Fitted<'_, K>> {
        let Stage::Fitted(residual) = self.stage else {
            return None;
        };
        let memory = self.memory.get(..self.needed).unwrap_or_default();
        Some(Fitted {
            recipe: &self.recipe,
            basis: self.basis,
            words: split(memory, self.recipe.samples()).1,
            residual,
            model: PhantomData,
        })
    }

    /// Returns the memory, for another scan.
    #[must_use]
    pub fn into_memory(self) -> &'a mut [f32] {
        self.memory
    }
}
