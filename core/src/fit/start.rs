//! The start of a fit from coefficients, and the Gauss-Newton steps after it, in slices of work.

use core::iter::repeat_n;
use core::ops::Range;

use super::channels::{Readings, keep_gray};
use super::coefficient_net::{Packed, StartNet};
use super::gauss_newton::{GaussNewton, system_length, take_step};
use super::work;
use crate::geometry::HalfDifference;
use crate::model::Active;
use crate::numeric::{Floats, split};
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

/// The kinds of units of work.
#[derive(Clone, Copy)]
enum Unit {
    /// The units of the start.
    Activate,
    /// The offsets of some parameters.
    Offsets,
    /// A virtual reading.
    Virtual,
    /// A reading of the pattern.
    Reading,
    /// The solve of a system.
    Solve,
}

/// The work of the start.
const START: [Unit; 2] = [Unit::Activate, Unit::Offsets];
/// The work of a step.
const STEP: [Unit; 3] = [Unit::Virtual, Unit::Reading, Unit::Solve];

impl Refinement<'_> {
    fn active(&self) -> Active {
        self.steps.model.active().unwrap_or(Active::All(0))
    }

    /// The lengths of the parts of the memory: the parameters, the active parameters of theta_0, the systems, and the units
    /// of the start.
    fn lengths(&self) -> [usize; 4] {
        let (systems, count) = (self.active().systems(), self.active().count());
        [
            self.steps.initial.len(),
            systems.saturating_mul(count),
            systems.saturating_mul(system_length(count)),
            self.start.bias.len(),
        ]
    }

    /// The memory in words.
    pub(super) fn words(&self) -> usize {
        self.lengths().into_iter().fold(0, usize::saturating_add)
    }

    /// The kinds of units in their order, each with its number.
    fn work(&self, samples: usize) -> impl Iterator<Item = (Unit, usize)> {
        let units = move |unit: &Unit| match unit {
            Unit::Activate => 1,
            Unit::Offsets => self.steps.initial.len().div_ceil(PARAMETERS_PER_UNIT),
            Unit::Virtual => self.steps.virtual_readings(),
            Unit::Reading => samples,
            Unit::Solve => self.active().systems(),
        };
        let steps = repeat_n(&STEP, self.steps.steps.into()).flatten();
        let all = START.iter().chain(steps);
        all.map(move |unit| (*unit, units(unit)))
    }

    /// The number of units of work.
    pub(super) fn units(&self, samples: usize) -> u32 {
        work::total(self.work(samples))
    }

    /// Does units of work.
    #[inline(never)]
    pub(super) fn advance(
        &self,
        add_reading: AddReading,
        words: &mut [f32],
        (samples, channels): Readings<'_>,
        coefficients: [&[f32]; 3],
        units: Range<u32>,
    ) {
        let Some([parameters, initial, systems, of_start]) = split(words, self.lengths()) else {
            return;
        };
        let work = self.work(samples.len());
        work::advance(work, units, |unit, index, is_last| {
            let mut add = |at, measured, weight| {
                let weights = [weight, self.steps.error_scale];
                add_reading(parameters, at, measured, weights, systems);
            };
            match unit {
                Unit::Activate => self.activate(coefficients, of_start),
                Unit::Offsets => self.add_offsets(parameters, of_start, index),
                Unit::Virtual => {
                    let (at, brdf) = self.steps.virtual_reading(index, coefficients);
                    add(&at, brdf, 1.0 / self.steps.virtual_readings() as f32);
                }
                Unit::Reading => {
                    if let Some(sample) = samples.get(index).filter(|sample| sample.weight > 0.0) {
                        // The weight in a loss is 1 / (3 k) for k readings.
                        let weight = 3.0 * sample.weight * self.steps.reading_weight;
                        add(&sample.at, sample.measured, weight);
                    }
                }
                Unit::Solve => self.solve(index, parameters, initial, systems),
            }
            if is_last && matches!(unit, Unit::Offsets | Unit::Solve) {
                keep_gray(parameters, self.steps.model, channels);
            }
            if is_last && matches!(unit, Unit::Offsets) {
                self.keep_initial(parameters, initial);
            }
        });
    }

    /// Computes the units of the start.
    #[inline(never)]
    fn activate(&self, coefficients: [&[f32]; 3], units: &mut [f32]) {
        self.start.weights().activate(coefficients, units);
    }

    /// Adds the offsets of some parameters.
    #[inline(never)]
    fn add_offsets(&self, parameters: &mut [f32], units: &[f32], part: usize) {
        let first = part.saturating_mul(PARAMETERS_PER_UNIT);
        let mut offsets = [0.0; PARAMETERS_PER_UNIT];
        self.start.weights().offsets(first, units, &mut offsets);
        let parameters = parameters.get_mut(first..).unwrap_or_default();
        for (parameter, offset) in parameters.iter_mut().zip(offsets) {
            *parameter += offset;
        }
    }

    /// Copies the active parameters of theta_0.
    fn keep_initial(&self, parameters: &[f32], initial: &mut [f32]) {
        let active = self.active();
        let lists = initial.chunks_exact_mut(active.count().max(1));
        for (system, initial) in lists.enumerate() {
            for (k, entry) in initial.iter_mut().enumerate() {
                let parameter = parameters.get(active.index(system, k));
                *entry = parameter.copied().unwrap_or_default();
            }
        }
    }

    /// Solves a system, changes its parameters, and sets the system to 0.
    fn solve(&self, index: usize, parameters: &mut [f32], initial: &[f32], systems: &mut [f32]) {
        let count = self.active().count();
        let mut systems = systems.chunks_exact_mut(system_length(count).max(1));
        let mut initial = initial.chunks_exact(count.max(1));
        if let Some((system, initial)) = systems.nth(index).zip(initial.nth(index)) {
            let precision = self.steps.precision.iter();
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
