//! The start of a fit from coefficients, and the Gauss-Newton steps after it, in slices of work.

use super::channels::{Readings, keep_gray};
use super::coefficient_net::{Packed, StartNet};
use super::gauss_newton::{GaussNewton, system_length, take_step};
use crate::geometry::HalfDifference;
use crate::model::{Active, Samples};
use crate::numeric::Floats;
use crate::section::section;

/// Number of initial parameters that one unit of work computes.
const PARAMETERS_PER_UNIT: usize = 64;

section! {
    /// A learned map from the coefficients to the initial parameters.
    Start<'a> = 4, "start" {
        /// p, of each unit
        bias: Floats<'a>, [Units];
        /// P, a row of 3 K for each unit
        hidden: &'a [u8], [Units, Three, Components];
        /// scale of each row of P
        hidden_scales: Floats<'a>, [Units];
        /// U, a row of g for each parameter
        output: &'a [u8], [Parameters, Units];
        /// scale of each row of U
        output_scales: Floats<'a>, [Parameters];
    }
}

impl<'a> Start<'a> {
    /// The map's weights.
    #[must_use]
    pub fn weights(&self) -> StartNet<'a, f32, Packed> {
        StartNet {
            hidden: self.hidden,
            hidden_scales: self.hidden_scales.words(),
            bias: self.bias.words(),
            output: self.output,
            output_scales: self.output_scales.words(),
        }
    }
}

/// Adds a reading to the systems of a Gauss-Newton step: parameters, directions, reading, its weight and the scale of its
/// error, systems.
pub(super) type AddReading = fn(&[f32], &HalfDifference<f32>, [f32; 3], [f32; 2], &mut [f32]);

/// A start from coefficients, and Gauss-Newton steps.
#[derive(Clone, Copy, Debug)]
pub struct Refinement<'a> {
    /// The third stage.
    pub start: Start<'a>,
    /// The fourth stage.
    pub steps: GaussNewton<'a>,
}

/// The memory, split into its parts.
struct Parts<'w> {
    parameters: &'w mut [f32],
    /// The active parameters of theta_0.
    initial: &'w mut [f32],
    systems: &'w mut [f32],
    /// The units of the start.
    units: &'w mut [f32],
}

impl Refinement<'_> {
    fn active(&self) -> Active {
        self.steps.model.active().unwrap_or(Active::All(0))
    }

    /// The memory in words.
    pub(super) fn words(&self) -> usize {
        let (systems, count) = (self.active().systems(), self.active().count());
        let system = count.saturating_add(system_length(count));
        let words = systems.saturating_mul(system);
        let parameters = self.steps.initial.len();
        let units = self.start.bias.len();
        words.saturating_add(parameters).saturating_add(units)
    }

    fn split<'w>(&self, words: &'w mut [f32]) -> Option<Parts<'w>> {
        let (systems, count) = (self.active().systems(), self.active().count());
        let (parameters, rest) = words.split_at_mut_checked(self.steps.initial.len())?;
        let (initial, rest) = rest.split_at_mut_checked(systems * count)?;
        let (systems, rest) = rest.split_at_mut_checked(systems * system_length(count))?;
        Some(Parts {
            parameters,
            initial,
            systems,
            units: rest.get_mut(..self.start.bias.len())?,
        })
    }

    /// The units of work of the start: one for its units, and one for each [`PARAMETERS_PER_UNIT`] parameters.
    fn start_units(&self) -> u32 {
        let parameters = self.steps.initial.len().div_ceil(PARAMETERS_PER_UNIT);
        parameters.saturating_add(1) as u32
    }

    /// The units of work of a step: one for each reading, and one for each system.
    fn step_units(&self, samples: usize) -> u32 {
        let readings = samples.saturating_add(self.steps.virtual_readings());
        readings.saturating_add(self.active().systems()) as u32
    }

    /// The units of work.
    pub(super) fn units(&self, samples: usize) -> u32 {
        let steps = u32::from(self.steps.steps).saturating_mul(self.step_units(samples));
        self.start_units().saturating_add(steps)
    }

    /// Does a unit of work.
    #[inline(never)]
    pub(super) fn advance(
        &self,
        add_reading: AddReading,
        words: &mut [f32],
        (samples, channels): Readings<'_>,
        coefficients: [&[f32]; 3],
        unit: u32,
    ) {
        let Some(mut parts) = self.split(words) else {
            return;
        };
        let Some(unit) = unit.checked_sub(self.start_units()) else {
            match unit.checked_sub(1) {
                None => self.start.weights().activate(coefficients, parts.units),
                Some(part) => self.add_offsets(&mut parts, part as usize),
            }
            if unit.saturating_add(1) == self.start_units() {
                keep_gray(parts.parameters, self.steps.model, channels);
                self.keep_initial(parts);
            }
            return;
        };
        let unit = unit.checked_rem(self.step_units(samples.len()));
        let unit = unit.unwrap_or_default() as usize;
        let readings = samples.len().saturating_add(self.steps.virtual_readings());
        match unit.checked_sub(readings) {
            None => self.add_reading(parts, samples, coefficients, unit, add_reading),
            Some(system) => {
                self.solve(&mut parts, system);
                if system.saturating_add(1) == self.active().systems() {
                    keep_gray(parts.parameters, self.steps.model, channels);
                }
            }
        }
    }

    /// Adds the offsets of some parameters.
    #[inline(never)]
    fn add_offsets(&self, parts: &mut Parts<'_>, part: usize) {
        let first = part.saturating_mul(PARAMETERS_PER_UNIT);
        let mut offsets = [0.0; PARAMETERS_PER_UNIT];
        self.start
            .weights()
            .offsets(first, parts.units, &mut offsets);
        let parameters = parts.parameters.get_mut(first..).unwrap_or_default();
        for (parameter, offset) in parameters.iter_mut().zip(offsets) {
            *parameter += offset;
        }
    }

    /// Copies the active parameters of theta_0.
    fn keep_initial(&self, parts: Parts<'_>) {
        let active = self.active();
        let count = active.count().max(1);
        for (system, initial) in parts.initial.chunks_exact_mut(count).enumerate() {
            for (k, entry) in initial.iter_mut().enumerate() {
                let index = active.index(system, k);
                *entry = parts.parameters.get(index).copied().unwrap_or_default();
            }
        }
    }

    /// Adds a virtual reading, or a reading of the pattern that counts.
    fn add_reading(
        &self,
        parts: Parts<'_>,
        samples: Samples<'_>,
        coefficients: [&[f32]; 3],
        index: usize,
        add_reading: AddReading,
    ) {
        let virtual_readings = self.steps.virtual_readings();
        let (at, measured, weight) = match index.checked_sub(virtual_readings) {
            None => {
                let (at, brdf) = self.steps.virtual_reading(index, coefficients);
                (at, brdf, 1.0 / virtual_readings as f32)
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
    fn solve(&self, parts: &mut Parts<'_>, index: usize) {
        let count = self.active().count();
        let mut systems = parts.systems.chunks_exact_mut(system_length(count).max(1));
        let mut initial = parts.initial.chunks_exact(count.max(1));
        if let Some((system, initial)) = systems.nth(index).zip(initial.nth(index)) {
            let precision = self.steps.precision.iter();
            let parameters = &mut *parts.parameters;
            take_step(self.active(), index, precision, initial, system, parameters);
            system.fill(0.0);
        }
    }

    /// Returns true if the units of the start are finite. Their rounding would hide a NaN from the parameters.
    pub(super) fn has_finite_start(&self, words: &[f32]) -> bool {
        let end = self.words();
        let start = end.saturating_sub(self.start.bias.len());
        let units = words.get(start..end).unwrap_or_default();
        units.iter().all(|unit| unit.is_finite())
    }
}
