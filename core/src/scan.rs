//! A scan of one material: readings in any order, a fit in slices, and the fitted material. It has no I/O and no clock;
//! the firmware owns motors, sensor and time.
//!
//! Each state has a type: a [`Scan`] records readings, a [`Fit`] is in progress, and a [`Fitted`] material evaluates
//! the BRDF. All data is in the caller's memory, which another scan can use afterwards. In a
//! [`store`](crate::store), readings survive a reset.

mod evidence;
mod fit;
mod plausibility;
mod reading;
mod residual;
mod slot;
mod state;

pub use evidence::{Evidence, EvidenceLimits};
pub use fit::{Fit, Fitted};
pub use reading::Recorded;
pub use residual::Residual;

pub(crate) use reading::index_error;

use core::marker::PhantomData;

use crate::error::{Error, ErrorCode};
use crate::fit::ScanModel;
use crate::geometry::Directions;
use crate::gonio::Reading;
use crate::model::Slot;
use crate::model::linear::Basis;
use crate::recipe::Recipe;
use slot::{Status, measured_brdf, with_flag};
use state::{Checks, Fitting, Stage, State, split_mut};

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
    state: State<'a>,
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
        Self::accept(&recipe, memory.len())?;
        state::initialize(memory, &recipe);
        Ok(Self {
            state: State {
                recipe,
                basis: None,
                memory,
                stage: Stage::Reading,
            },
            model: PhantomData,
        })
    }

    /// Adds the basis that [`Fitted::brdf`] needs for recipes of Linear. `trainer export --format basis` writes it.
    ///
    /// # Errors
    /// [`ErrorCode::Basis`] if the recipe names another basis, or none. Only recipes of Linear name a basis.
    pub fn with_basis(mut self, basis: Basis<'a>) -> Result<Self, Error> {
        let named = self.state.recipe.estimator.basis_checksum();
        if named != Some(basis.checksum()) {
            let details = [named.unwrap_or(0), basis.checksum()];
            return Err(Error::with(ErrorCode::Basis, details));
        }
        self.state.basis = Some(basis);
        Ok(self)
    }

    /// The basis, if one was added.
    #[must_use]
    pub fn basis(&self) -> Option<&Basis<'a>> {
        self.state.basis.as_ref()
    }

    /// Forgets all readings and starts again.
    pub fn restart(&mut self) {
        self.state.stage = Stage::Reading;
        let slots = self.state.slots_mut().iter_mut();
        slots.for_each(|slot| Status::PENDING.put(slot));
    }

    /// The recipe.
    #[must_use]
    pub fn recipe(&self) -> &Recipe<'a> {
        &self.state.recipe
    }

    /// The pending samples in the recipe's order: index and directions.
    ///
    /// Read them in any order; [`Machine::nearest`](crate::gonio::Machine::nearest) returns the sample that the arms
    /// reach first. A recipe [in path order](Recipe::is_in_path_order) takes less time in its own order. If another recipe
    /// [tolerates missing readings](Recipe::tolerates_missing), the first samples are the
    /// most informative, and the scan may finish early.
    pub fn pending(&self) -> impl Iterator<Item = (u16, Directions<f32>)> {
        self.state.pending()
    }

    /// The first of [`Scan::pending`]. None if every sample is read or skipped.
    #[must_use]
    pub fn next_pending(&self) -> Option<(u16, Directions<f32>)> {
        self.state.next_pending()
    }

    /// Records the reading of a sample of the pattern, in any order. A second reading of the same sample replaces the
    /// first; [`gonio::Repeated`](crate::gonio::Repeated) averages readings instead. The call discards a fit in
    /// progress.
    ///
    /// # Errors
    /// [`ErrorCode::ReadingIndex`], [`ErrorCode::ReadingNonFinite`] or [`ErrorCode::ReadingNegative`]. The scan is then
    /// unchanged.
    pub fn record(&mut self, index: u16, reading: Reading) -> Result<Recorded, Error> {
        let recorded = reading::record(self.state.slots_mut(), index, reading)?;
        self.state.stage = Stage::Reading;
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
        Status::SKIP.put(reading::slot_mut(self.state.slots_mut(), index)?);
        self.state.stage = Stage::Reading;
        Ok(())
    }

    /// Skips every pending sample, so that the fit uses only the recorded readings.
    ///
    /// # Errors
    /// [`ErrorCode::ReadingRequired`] with the first pending sample if the recipe does not tolerate missing readings. The
    /// scan is then unchanged.
    pub fn finish_early(&mut self) -> Result<(), Error> {
        self.check_tolerance(self.next_pending().map_or(0, |(index, _)| index))?;
        for slot in self.state.slots_mut() {
            if Status::of(slot).is_pending() {
                Status::SKIP.put(slot);
            }
        }
        Ok(())
    }

    fn check_tolerance(&self, index: u16) -> Result<(), Error> {
        match self.state.recipe.estimator.tolerates_missing() {
            true => Ok(()),
            false => Err(Error::with(ErrorCode::ReadingRequired, [index.into(), 0])),
        }
    }

    /// The recorded reading of a sample, if any, unchanged by fits.
    #[must_use]
    pub fn reading(&self, index: u16) -> Option<Reading> {
        slot::reading(self.state.slots().get(usize::from(index))?)
    }

    /// Returns true if the readings are the first ones in the recipe's order, all unsaturated, and no sample is skipped. A
    /// [bound of their loss](Fitted::loss_bound) holds only then.
    pub(crate) fn is_prefix(&self) -> bool {
        self.state.is_prefix()
    }

    /// Changes the state of a sample. The default if the pattern has no such sample.
    fn update<T: Default>(&mut self, index: u16, change: impl FnOnce(&mut Status) -> T) -> T {
        let Some(slot) = self.state.slots_mut().get_mut(usize::from(index)) else {
            return T::default();
        };
        let mut status = Status::of(slot);
        let result = change(&mut status);
        status.put(slot);
        result
    }

    /// Counts an invalid reading of a sample. At the limit of the count since the last valid reading, it returns true and
    /// begins again.
    pub(crate) fn count_invalid_reading(&mut self, index: u16, limit: u8) -> bool {
        self.update(index, |status| status.count_invalid(limit))
    }

    /// Marks a sample as saved or not.
    pub(crate) fn mark_unsaved(&mut self, index: u16, is_unsaved: bool) {
        self.update(index, |status| status.set(Status::UNSAVED, is_unsaved));
    }

    /// Returns the first sample that is not saved, with its reading, or None if it was skipped. Marks it as saved.
    pub(crate) fn take_unsaved(&mut self) -> Option<(u16, Option<Reading>)> {
        let unsaved = |(_, slot): &(u16, &Slot)| Status::of(slot).has(Status::UNSAVED);
        let (index, _) = (0..).zip(self.state.slots()).find(unsaved)?;
        self.mark_unsaved(index, false);
        Some((index, self.reading(index)))
    }

    /// Number of samples with a reading.
    pub(crate) fn recorded(&self) -> u16 {
        with_flag(self.state.slots(), Status::READ).count() as u16 // at most MAX_SAMPLES
    }

    /// Checks a reading that is not recorded.
    ///
    /// # Errors
    /// Fails like [`Scan::record`].
    pub(crate) fn check(&self, index: u16, reading: Reading) -> Result<(), Error> {
        let samples = self.state.recipe.samples();
        match usize::from(index) < samples {
            true => reading.check(index),
            false => Err(index_error(index, samples)),
        }
    }

    /// The mean over channels and readings of the samples, sr^-1, at least 0. Readings below 0 count as 0.
    pub(crate) fn mean_reading(&self) -> f32 {
        let read = with_flag(self.state.slots(), Status::READ).flat_map(measured_brdf);
        let sum = read.filter(|value| *value > 0.0).sum::<f32>();
        sum / (3.0 * f32::from(self.recorded().max(1)))
    }

    /// Adds the evidence of the scan to the residual of its fit.
    pub(crate) fn add_evidence(&mut self, evidence: Evidence, limits: EvidenceLimits) {
        let recorded = self.recorded();
        if let Stage::Fitted { residual, .. } = &mut self.state.stage {
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
    pub fn fit(&mut self) -> Result<Fit<'_, 'a, K>, Error> {
        let readings = self.state.mark_counted()?;
        let channels = reading::check(self.state.slots())?;
        let State { recipe, memory, .. } = &mut self.state;
        let (_, words) = split_mut(memory, recipe);
        recipe.estimator.start(words, channels);
        Ok(Fit::new(
            &mut self.state,
            Fitting {
                done: 0,
                channels,
                readings,
                checks: Checks::default(),
            },
        ))
    }

    /// Begins a [`fit`](Self::fit) whose coefficients are known: those of red, green and blue, each of the recipe's
    /// components. A host completes readings at any directions with more memory than the stages net and ridge have.
    ///
    /// # Errors
    /// As [`fit`](Self::fit).
    #[cfg(feature = "training")]
    pub fn fit_from(&mut self, coefficients: [&[f32]; 3]) -> Result<Fit<'_, 'a, K>, Error> {
        let fitting = self.fit()?.fitting;
        let State { recipe, memory, .. } = &mut self.state;
        let (slots, words) = split_mut(memory, recipe);
        let done = recipe
            .estimator
            .set_coefficients(words, slots.len(), coefficients);
        Ok(Fit::new(&mut self.state, Fitting { done, ..fitting }))
    }

    /// The fit in progress. None if no fit has begun, if it is finished, or if a reading was recorded since.
    /// This is for firmware that cannot keep a [`Fit`] between two iterations of its loop.
    pub fn fit_under_way(&mut self) -> Option<Fit<'_, 'a, K>> {
        match self.state.stage {
            Stage::Fitting(fitting) => Some(Fit::new(&mut self.state, fitting)),
            _ => None,
        }
    }

    /// The fitted material. None if no fit was finished since the last reading.
    #[must_use]
    pub fn fitted(&self) -> Option<Fitted<'_, K>> {
        match self.state.stage {
            Stage::Fitted { residual, readings } => Some(Fitted {
                state: &self.state,
                residual,
                readings,
                model: PhantomData,
            }),
            _ => None,
        }
    }

    /// Returns the memory, for another scan.
    #[must_use]
    pub fn into_memory(self) -> &'a mut [f32] {
        self.state.memory
    }
}
