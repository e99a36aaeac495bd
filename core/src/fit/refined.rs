//! A completion, an init net, and Gauss-Newton steps, in slices of work.
//!
//! A unit of work is a part of the completion, a reading of a step, or the solution of one of a step's systems.

use core::ops::Range;

use super::algorithm::Channels;
use super::completed::{Completed, InitNet, PARAMETERS_PER_UNIT, Target};
use super::gauss_newton::{GaussNewton, system_length, take_step};
use super::method::{COMPLETION, FitMethod};
use super::start::{activate, add_offsets, keep_gray};
use crate::geometry::HalfDifference;
use crate::model::{Active, Samples};

/// Returns the memory of the fit in words: the parameters, the active ones of theta_0, the systems, the completion with
/// the units of its init net, and the predicted loss.
pub(crate) const fn refined_words(parameters: usize, active: Active, completion: usize) -> usize {
    let count = active.count();
    let system = count.saturating_add(system_length(count));
    parameters
        .saturating_add(active.systems().saturating_mul(system))
        .saturating_add(completion)
        .saturating_add(1)
}

/// Adds a reading at given parameters to the systems of a step.
pub(super) type AddReading = fn(&[f32], &HalfDifference<f32>, [f32; 3], [f32; 2], &mut [f32]);

/// Gauss-Newton steps with the completion that determines their start.
#[derive(Clone, Copy)]
pub(super) struct Refined<'m, 'a> {
    completed: &'m Completed<'a>,
    pub(super) steps: &'m GaussNewton<'a>,
    init_net: &'m InitNet<'a>,
    active: Active,
}

/// The memory of a fit, split into its parts.
struct Parts<'w> {
    parameters: &'w mut [f32],
    /// The active parameters of theta_0.
    initial: &'w mut [f32],
    systems: &'w mut [f32],
    state: &'w mut [f32],
    activations: &'w mut [f32],
    predicted_loss: &'w mut f32,
}

impl<'m, 'a> Refined<'m, 'a> {
    /// Returns the steps of a method, if it has any.
    pub(super) fn of(method: &'m FitMethod<'a>) -> Option<Self> {
        match method {
            FitMethod::Completed(completed) if COMPLETION => match &completed.target {
                Target::GaussNewton(steps, init_net) => Some(Self {
                    completed,
                    steps,
                    init_net,
                    active: steps.model.active()?,
                }),
                _ => None,
            },
            _ => None,
        }
    }

    fn split<'w>(&self, words: &'w mut [f32]) -> Option<Parts<'w>> {
        let (parameters, rest) = words.split_at_mut_checked(self.steps.initial.len())?;
        let (systems, count) = (self.active.systems(), self.active.count());
        let (initial, rest) = rest.split_at_mut_checked(systems * count)?;
        let (systems, rest) = rest.split_at_mut_checked(systems * system_length(count))?;
        let (state, rest) = rest.split_at_mut_checked(self.completed.coefficient_words())?;
        let (activations, rest) = rest.split_at_mut_checked(self.init_net.units())?;
        Some(Parts {
            parameters,
            initial,
            systems,
            state,
            activations,
            predicted_loss: rest.first_mut()?,
        })
    }

    /// The innovation of a finished fit.
    pub(super) fn innovation(&self, words: &[f32]) -> Option<f32> {
        let (systems, count) = (self.active.systems(), self.active.count());
        let before = self.steps.initial.len() + systems * (count + system_length(count));
        self.completed.innovation(words.get(before..)?)
    }

    /// The units of work before the steps.
    fn units_before(&self, samples: usize) -> u32 {
        let parameters = self.steps.initial.len().div_ceil(PARAMETERS_PER_UNIT);
        let coefficients = self.completed.units(samples);
        coefficients
            .saturating_add(1)
            .saturating_add(parameters as u32)
    }

    /// The units of work of a step.
    fn units_of_step(&self, samples: usize) -> u32 {
        let readings = samples.saturating_add(self.steps.virtual_readings.len());
        readings.saturating_add(self.active.systems()) as u32
    }

    /// The units of work of the whole fit.
    pub(super) fn total(&self, samples: usize) -> u32 {
        let steps = u32::from(self.steps.steps).saturating_mul(self.units_of_step(samples));
        self.units_before(samples).saturating_add(steps)
    }

    /// Does the given units of work, and returns the new number of completed units.
    #[inline(never)]
    pub(super) fn advance(
        &self,
        words: &mut [f32],
        samples: Samples<'_>,
        channels: Channels,
        units: Range<u32>,
        add_reading: AddReading,
    ) -> u32 {
        let Range { start: done, end } = units;
        let end = end.min(self.total(samples.len())).max(done);
        let before = self.units_before(samples.len());
        for unit in done..end {
            let Some(parts) = self.split(words) else {
                return done;
            };
            match unit.checked_sub(before) {
                None => {
                    self.complete(parts, samples, unit);
                    if unit.saturating_add(1) == before {
                        keep_gray(words, self.steps.model, channels);
                        self.keep_initial(words);
                    }
                }
                Some(unit) => {
                    let unit = unit.checked_rem(self.units_of_step(samples.len()));
                    let unit = unit.unwrap_or_default() as usize;
                    let readings = samples
                        .len()
                        .saturating_add(self.steps.virtual_readings.len());
                    match unit.checked_sub(readings) {
                        None => self.add_reading(parts, samples, unit, add_reading),
                        Some(system) => {
                            self.solve(parts, system);
                            if system.saturating_add(1) == self.active.systems() {
                                keep_gray(words, self.steps.model, channels);
                            }
                        }
                    }
                }
            }
        }
        end
    }

    /// Does a unit of work before the steps.
    fn complete(&self, parts: Parts<'_>, samples: Samples<'_>, unit: u32) {
        match unit.checked_sub(self.completed.units(samples.len())) {
            None => self.completed.advance(unit, samples, parts.state),
            Some(0) => {
                let activations = parts.activations;
                *parts.predicted_loss =
                    activate(self.completed, self.init_net, parts.state, activations);
            }
            Some(index) => {
                let first = (index as usize)
                    .saturating_sub(1)
                    .saturating_mul(PARAMETERS_PER_UNIT);
                let parameters = parts.parameters.get_mut(first..).unwrap_or_default();
                add_offsets(parameters, self.init_net, first, parts.activations);
            }
        }
    }

    /// Copies the active parameters of theta_0.
    fn keep_initial(&self, words: &mut [f32]) {
        let Some(parts) = self.split(words) else {
            return;
        };
        let count = self.active.count().max(1);
        for (system, initial) in parts.initial.chunks_exact_mut(count).enumerate() {
            for (k, entry) in initial.iter_mut().enumerate() {
                let index = self.active.index(system, k);
                *entry = parts.parameters.get(index).copied().unwrap_or_default();
            }
        }
    }

    /// Adds a virtual reading, or a reading of the pattern that counts.
    fn add_reading(
        &self,
        parts: Parts<'_>,
        samples: Samples<'_>,
        index: usize,
        add_reading: AddReading,
    ) {
        let virtual_readings = self.steps.virtual_readings;
        let (at, measured, weight) = match index.checked_sub(virtual_readings.len()) {
            None => {
                let coefficients = self.completed.coefficients(parts.state);
                let Some((at, brdf)) = virtual_readings.get(index, coefficients) else {
                    return;
                };
                (at, brdf, 1.0 / virtual_readings.len() as f32)
            }
            Some(index) => {
                let Some(sample) = samples.get(index).filter(|sample| sample.weight > 0.0) else {
                    return;
                };
                // The weight in a loss is 1 / (3 k) for k readings.
                let weight = 3.0 * sample.weight * self.steps.reading_weight;
                (sample.at, sample.measured, weight)
            }
        };
        let weights = [weight, self.steps.error_scale];
        add_reading(parts.parameters, &at, measured, weights, parts.systems);
    }

    /// Solves a system, changes its parameters, and sets the system to 0.
    fn solve(&self, parts: Parts<'_>, index: usize) {
        let count = self.active.count();
        let mut systems = parts.systems.chunks_exact_mut(system_length(count).max(1));
        let mut initial = parts.initial.chunks_exact(count.max(1));
        if let Some((system, initial)) = systems.nth(index).zip(initial.nth(index)) {
            let precision = self.steps.precision.iter();
            take_step(
                self.active,
                index,
                precision,
                initial,
                system,
                parts.parameters,
            );
            system.fill(0.0);
        }
    }
}
