//! The measuring half of a scan: where next, and what was seen there.

use heapless::Vec;

use super::{Measurement, MeasurementError, Residual, ScanError};
use crate::geometry::{Directions, HalfDifference};
use crate::model::Sample;
use crate::recipe::Recipe;

/// The measurements of a recipe's pattern; `CAPACITY` is the largest n that it has room for.
pub(super) struct Measuring<'a, const CAPACITY: usize> {
    recipe: Recipe<'a>,
    samples: Vec<Sample<f32>, CAPACITY>,
    saturated: u16,
}

impl<'a, const CAPACITY: usize> Measuring<'a, CAPACITY> {
    /// Nothing is measured yet.
    pub(super) fn new(recipe: Recipe<'a>) -> Result<Self, ScanError> {
        if recipe.samples() > CAPACITY {
            return Err(ScanError::Capacity {
                capacity: CAPACITY,
                samples: recipe.samples(),
            });
        }
        Ok(Self {
            recipe,
            samples: Vec::new(),
            saturated: 0,
        })
    }

    pub(super) fn restart(&mut self) {
        self.samples.clear();
        self.saturated = 0;
    }

    pub(super) fn recipe(&self) -> &Recipe<'a> {
        &self.recipe
    }

    /// What was measured so far, with the weights of a mean.
    pub(super) fn samples(&self) -> &[Sample<f32>] {
        &self.samples
    }

    pub(super) fn is_complete(&self) -> bool {
        self.samples.len() == self.recipe.samples()
    }

    pub(super) fn next_directions(&self) -> Option<(u16, Directions<f32>)> {
        let index = self.samples.len();
        let angles = self.recipe.pattern().nth(index)?;
        let directions = HalfDifference::from_angles(angles).directions();
        Some((index as u16, directions))
    }

    /// Takes the next measurement.
    #[inline(never)] // its temporaries leave the stack with it
    pub(super) fn record(&mut self, measurement: Measurement) -> Result<(), MeasurementError> {
        for (channel, value) in (0..).zip(measurement.brdf) {
            if !value.is_finite() {
                return Err(MeasurementError::NonFinite(channel));
            }
            if value < 0.0 {
                return Err(MeasurementError::Negative(channel));
            }
        }
        let angles = self.recipe.pattern().nth(self.samples.len());
        let at = HalfDifference::from_angles(angles.ok_or(MeasurementError::Complete)?);
        let sample = Sample {
            at,
            measured: measurement.brdf,
            weight: 1.0 / (3.0 * self.recipe.samples() as f32),
        };
        self.samples
            .push(sample)
            .map_err(|_| MeasurementError::Complete)?;
        let saturated = u16::from(measurement.saturated);
        self.saturated = self.saturated.saturating_add(saturated);
        Ok(())
    }

    /// The residual whose `errors` are those of the samples, in order.
    pub(super) fn residual(&self, errors: impl Iterator<Item = f32>) -> Residual {
        let mut residual = Residual {
            mean: 0.0,
            worst_index: 0,
            worst: 0.0,
            saturated: self.saturated,
            repeated: 0,
        };
        for pair in self.samples.windows(2) {
            if let [before, after] = pair {
                let same = before.measured.map(f32::to_bits) == after.measured.map(f32::to_bits);
                residual.repeated = residual.repeated.saturating_add(u16::from(same));
            }
        }
        for (index, error) in (0..).zip(errors) {
            residual.mean += error / self.samples.len() as f32;
            if error > residual.worst {
                residual.worst = error;
                residual.worst_index = index;
            }
        }
        residual
    }
}
