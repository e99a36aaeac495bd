//! A scan of one material: readings in any order, a fit in slices, and the fitted material. It has no I/O and no clock;
//! the firmware owns motors, sensor and time.
//!
//! Each state has a type: a [`Scan`] records readings, a [`Fit`] is in progress, and a [`Fitted`] material evaluates
//! the BRDF. All data is in the caller's memory, which another scan can use afterwards. In a
//! [`store`](crate::store), readings survive a reset.

mod evidence;
mod fit;
mod memory;
mod plausibility;
mod reading;
mod residual;
mod stage;
mod status;

pub use evidence::{Evidence, EvidenceLimits};
pub use fit::{Fit, Fitted};
pub use reading::Recorded;
pub use residual::Residual;

use core::marker::PhantomData;

use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;
use crate::geometry::Directions;
use crate::gonio::Reading;
use crate::model::Slot;
use crate::model::linear::Basis;
use crate::recipe::Recipe;
use memory::{measured_brdf, split, split_mut};
use stage::{Checks, Fitting, Stage};
use status::Status;

/// A scan of one material, recording readings.
///
/// `K` is one of the four models, or [`AnyModel`](crate::fit::AnyModel) for the model that the recipe names. The caller
/// provides the memory. [`memory_words`](crate::recipe::memory_words) computes its length from the recipe at compile
/// time. The memory holds the readings and the workspace of the fit, and is reusable for the next scan.
///
/// ```
/// use glimpse_core::model::Neural;
/// use glimpse_core::recipe::{Recipe, memory_words};
/// use glimpse_core::gonio::Reading;
/// use glimpse_core::scan::Scan;
///
/// # fn read(index: u16) -> Reading { Reading::new([0.1 + 0.01 * f32::from(index); 3]) }
/// # fn motors_and_watchdog() {}
/// static RECIPE: &[u8] = include_bytes!("../examples/recipes/neural-n8.recipe");
/// let mut memory = [0.0; memory_words(&[RECIPE])]; // or a static, with `static_cell::StaticCell`
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
pub struct Scan<'a, K: ScanModel> {
    recipe: Recipe<'a>,
    basis: Option<Basis<'a>>,
    memory: &'a mut [f32],
    /// Words of the memory that this recipe needs.
    needed: usize,
    stage: Stage,
    model: PhantomData<K>,
}

impl<'a, K: ScanModel> Scan<'a, K> {
    /// Checks that this firmware can scan with a recipe in a memory of `words` words, for example before the recipe
    /// replaces another one. Returns the number of words that the recipe needs.
    ///
    /// # Errors
    /// [`ErrorCode::Model`] if the recipe is for another model, or [`ErrorCode::Memory`] if it needs more memory.
    pub fn accept(recipe: &Recipe<'_>, words: usize) -> Result<usize, Error> {
        if let Err(firmware) = K::functions(recipe.model()) {
            let models = [firmware as u32, recipe.model() as u32];
            return Err(Error::with(ErrorCode::Model, models));
        }
        let needed = recipe.memory_words();
        if needed > words {
            return Err(Error::with(
                ErrorCode::Memory,
                [needed as u32, words as u32],
            ));
        }
        Ok(needed)
    }

    /// Begins a scan, and overwrites the content of `memory`.
    ///
    /// # Errors
    /// Fails like [`Scan::accept`].
    pub fn new(recipe: Recipe<'a>, memory: &'a mut [f32]) -> Result<Self, Error> {
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
        memory::initialize(slots, &recipe);
        Ok(scan)
    }

    /// Returns the samples and the workspace of the fit.
    fn parts(&mut self) -> (&mut [Slot], &mut [f32]) {
        let memory = self.memory.get_mut(..self.needed).unwrap_or_default();
        split_mut(memory, self.recipe.samples())
    }

    fn slots(&self) -> &[Slot] {
        split(self.memory, self.recipe.samples()).0
    }

    /// Adds the basis that [`Fitted::brdf`] needs for recipes of Linear. `trainer export --format basis` writes it.
    ///
    /// # Errors
    /// [`ErrorCode::Basis`] if the recipe names another basis, or none. Only recipes of Linear name a basis.
    pub fn with_basis(mut self, basis: Basis<'a>) -> Result<Self, Error> {
        let named = self.recipe.estimator.basis_checksum();
        if named != Some(basis.whole_checksum()) {
            let details = [named.unwrap_or(0), basis.whole_checksum()];
            return Err(Error::with(ErrorCode::Basis, details));
        }
        self.basis = Some(basis);
        Ok(self)
    }

    /// The basis, if one was added.
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

    /// The pending samples in the recipe's order: index and directions.
    ///
    /// Read them in any order; [`Machine::nearest`](crate::gonio::Machine::nearest) returns the sample that the arms
    /// reach first. A recipe [in path order](Recipe::is_in_path_order) takes less time in its own order. If another recipe
    /// [tolerates missing readings](Recipe::tolerates_missing), the first samples are the
    /// most informative, and the scan may finish early.
    pub fn pending(&self) -> impl Iterator<Item = (u16, Directions<f32>)> {
        memory::pending(self.slots())
    }

    /// The first of [`Scan::pending`]. None if every sample is read or skipped.
    #[must_use]
    pub fn next_pending(&self) -> Option<(u16, Directions<f32>)> {
        memory::next_pending(self.slots())
    }

    /// Records the reading of a sample of the pattern, in any order. A second reading of the same sample replaces the
    /// first; [`gonio::Repeated`](crate::gonio::Repeated) averages readings instead. The call discards a fit in
    /// progress.
    ///
    /// # Errors
    /// [`ErrorCode::ReadingIndex`], [`ErrorCode::ReadingNonFinite`] or [`ErrorCode::ReadingNegative`]. The scan is then
    /// unchanged.
    pub fn record(&mut self, index: u16, reading: Reading) -> Result<Recorded, Error> {
        let (slots, _) = self.parts();
        let recorded = reading::record(slots, index, reading)?;
        self.stage = Stage::Reading;
        Ok(recorded)
    }

    /// Marks a sample that cannot be read. It is no longer pending, and its reading, if any, is discarded. A later
    /// [`Scan::record`] of the sample undoes this.
    ///
    /// # Errors
    /// [`ErrorCode::ReadingRequired`] if the recipe does not [tolerate missing readings](Recipe::tolerates_missing), or
    /// [`ErrorCode::ReadingIndex`] if it has no such sample. The scan is then unchanged.
    pub fn skip(&mut self, index: u16) -> Result<(), Error> {
        self.check_tolerance(index)?;
        let (slots, _) = self.parts();
        let slot = reading::slot_mut(slots, index)?;
        Status::SKIP.put(slot);
        self.stage = Stage::Reading;
        Ok(())
    }

    /// Skips every pending sample, so that the fit uses only the recorded readings.
    ///
    /// # Errors
    /// [`ErrorCode::ReadingRequired`] with the first pending sample if the recipe does not tolerate missing readings. The
    /// scan is then unchanged.
    pub fn finish_early(&mut self) -> Result<(), Error> {
        self.check_tolerance(self.next_pending().map_or(0, |(index, _)| index))?;
        let (slots, _) = self.parts();
        for slot in slots {
            if Status::of(slot).is_pending() {
                Status::SKIP.put(slot);
            }
        }
        Ok(())
    }

    fn check_tolerance(&self, index: u16) -> Result<(), Error> {
        match self.recipe.estimator.tolerates_missing() {
            true => Ok(()),
            false => Err(Error::with(ErrorCode::ReadingRequired, [index.into(), 0])),
        }
    }

    /// The recorded reading of a sample, if any, unchanged by fits.
    #[must_use]
    pub fn reading(&self, index: u16) -> Option<Reading> {
        let slot = self.slots().get(usize::from(index))?;
        let status = Status::of(slot);
        status.is_read().then(|| Reading {
            brdf: measured_brdf(slot),
            saturated: status.is_saturated(),
        })
    }

    /// Returns true if the readings are the first ones in the recipe's order, all unsaturated, and no sample is skipped. A
    /// [bound of their loss](Fitted::loss_bound) holds only then.
    pub(crate) fn is_prefix(&self) -> bool {
        memory::is_prefix(self.slots())
    }

    /// Counts an invalid reading of a sample. Returns the count since its last valid reading.
    pub(crate) fn count_invalid_reading(&mut self, index: u16) -> u8 {
        let (slots, _) = self.parts();
        let Some(slot) = slots.get_mut(usize::from(index)) else {
            return 0;
        };
        let (status, count) = Status::of(slot).with_invalid_reading();
        status.put(slot);
        count
    }

    /// Forgets that readings of a sample were invalid.
    pub(crate) fn forget_invalid_readings(&mut self, index: u16) {
        let (slots, _) = self.parts();
        if let Some(slot) = slots.get_mut(usize::from(index)) {
            Status::of(slot).without_invalid_readings().put(slot);
        }
    }

    /// Marks a sample as not saved.
    pub(crate) fn mark_unsaved(&mut self, index: u16) {
        let (slots, _) = self.parts();
        if let Some(slot) = slots.get_mut(usize::from(index)) {
            Status::of(slot).unsaved(true).put(slot);
        }
    }

    /// Returns the first sample that is not saved, with its reading, or None if it was skipped. Marks it as saved.
    pub(crate) fn take_unsaved(&mut self) -> Option<(u16, Option<Reading>)> {
        let (slots, _) = self.parts();
        let mut slots = (0..).zip(slots.iter_mut());
        let (index, slot) = slots.find(|(_, slot)| Status::of(slot).is_unsaved())?;
        Status::of(slot).unsaved(false).put(slot);
        Some((index, self.reading(index)))
    }

    /// Number of samples with a reading.
    pub(crate) fn recorded(&self) -> u16 {
        let read = self
            .slots()
            .iter()
            .filter(|slot| Status::of(slot).is_read());
        read.count() as u16 // at most MAX_SAMPLES
    }

    /// Checks a reading that is not recorded.
    ///
    /// # Errors
    /// Fails like [`Scan::record`].
    pub(crate) fn check(&self, index: u16, reading: Reading) -> Result<(), Error> {
        let samples = self.recipe.samples();
        match usize::from(index) < samples {
            true => reading.check(index),
            false => Err(reading::index_error(index, samples)),
        }
    }

    /// The mean over channels and readings of the samples, sr^-1, at least 0. Readings below 0 count as 0.
    pub(crate) fn mean_reading(&self) -> f32 {
        let read = self
            .slots()
            .iter()
            .filter(|slot| Status::of(slot).is_read());
        let sum = read
            .flat_map(measured_brdf)
            .filter(|value| *value > 0.0)
            .sum::<f32>();
        sum / (3.0 * f32::from(self.recorded().max(1)))
    }

    /// Adds the evidence of the scan to the residual of its fit.
    pub(crate) fn add_evidence(&mut self, evidence: Evidence, limits: EvidenceLimits) {
        let recorded = self.recorded();
        if let Stage::Fitted { residual, .. } = &mut self.stage {
            *residual = residual.with_evidence(evidence, limits, recorded);
        }
    }

    /// Begins a fit of all readings. It discards an earlier fit, finished or not.
    ///
    /// If the recipe [tolerates missing readings](Recipe::tolerates_missing), the fit omits missing and saturated
    /// readings. If all readings are saturated, it uses them.
    ///
    /// # Errors
    /// [`ErrorCode::Incomplete`] if no reading was recorded, or if a reading is missing that the recipe needs.
    /// [`ErrorCode::ReadingsTooLarge`] if the readings are too large for any material.
    pub fn fit(&mut self) -> Result<Fit<'_, K>, Error> {
        let recipe = self.recipe;
        let (slots, words) = self.parts();
        let counted = memory::mark_counted(slots, &recipe);
        if counted == 0 {
            return Err(memory::incomplete(slots));
        }
        let channels = reading::check(slots)?;
        recipe.estimator.start(words, channels);
        Ok(self.fit_from(Fitting {
            done: 0,
            channels,
            readings: counted as u16, // at most MAX_SAMPLES
            checks: Checks::default(),
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

    /// The fit in progress. None if no fit has begun, if it is finished, or if a reading was recorded since.
    /// This is for firmware that cannot keep a [`Fit`] between two iterations of its loop.
    pub fn fit_under_way(&mut self) -> Option<Fit<'_, K>> {
        match self.stage {
            Stage::Fitting(fitting) => Some(self.fit_from(fitting)),
            _ => None,
        }
    }

    /// The fitted material. None if no fit was finished since the last reading.
    #[must_use]
    pub fn fitted(&self) -> Option<Fitted<'_, K>> {
        let Stage::Fitted { residual, readings } = self.stage else {
            return None;
        };
        let memory = self.memory.get(..self.needed).unwrap_or_default();
        Some(Fitted {
            recipe: &self.recipe,
            basis: self.basis,
            words: split(memory, self.recipe.samples()).1,
            residual,
            readings,
            model: PhantomData,
        })
    }

    /// Returns the memory, for another scan.
    #[must_use]
    pub fn into_memory(self) -> &'a mut [f32] {
        self.memory
    }
}
