//! The scan session, free of I/O and of time.
//!
//! It hands out the next pair of directions, takes what was measured there, fits in slices, and
//! evaluates the result. Motors, sensor and clock are the firmware's.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::angles::{Directions, HalfDifference};
use crate::fit::{Fit, Progress, Workspace, residuals};
use crate::model::{Model, ModelKind, Sample};
use crate::recipe::Recipe;

/// Why a scan cannot begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ScanError {
    /// The recipe is for another model than this firmware's.
    Model {
        /// The firmware's model.
        firmware: ModelKind,
        /// The recipe's model.
        recipe: ModelKind,
    },
    /// The recipe's pattern does not fit the capacity that this firmware was built with.
    Capacity {
        /// Samples that there is room for.
        capacity: usize,
        /// Samples of the recipe.
        samples: usize,
    },
}

impl core::fmt::Display for ScanError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Model { firmware, recipe } => {
                write!(
                    f,
                    "the recipe is for the model {recipe}, this scan for {firmware}"
                )
            }
            Self::Capacity { capacity, samples } => {
                write!(
                    f,
                    "the recipe has {samples} samples, there is room for {capacity}"
                )
            }
        }
    }
}

impl core::error::Error for ScanError {}

/// Why a measurement was refused. It has to be taken again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MeasurementError {
    /// A channel (0 red, 1 green, 2 blue) is NaN or infinite.
    NonFinite(u8),
    /// A channel is negative.
    Negative(u8),
    /// All directions were measured already.
    Complete,
}

impl core::fmt::Display for MeasurementError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NonFinite(channel) => write!(f, "channel {channel} is not a finite number"),
            Self::Negative(channel) => write!(f, "channel {channel} is negative"),
            Self::Complete => f.write_str("all directions were measured already"),
        }
    }
}

impl core::error::Error for MeasurementError {}

/// What the sensor saw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Measurement {
    /// The BRDF in linear RGB, sr^-1 (not times the cosine).
    pub brdf: [f32; 3],
    /// True if the sensor was saturated, so that the true value is larger.
    pub saturated: bool,
}

/// How well the fit explains its measurements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Residual {
    /// The mean cosine-weighted logarithmic error over the measurements.
    pub mean: f32,
    /// The measurement that is explained worst.
    pub worst_index: u16,
    /// Its error.
    pub worst: f32,
    /// How many measurements were saturated.
    pub saturated: u16,
}

/// A scan of one material by one recipe; `CAPACITY` is the largest n that it has room for.
pub struct Scan<'a, M: Model, const CAPACITY: usize> {
    recipe: Recipe<'a>,
    workspace: &'a mut Workspace<M>,
    samples: Vec<Sample<f32>, CAPACITY>,
    saturated: u16,
    fit: Fit<'a>,
}

impl<'a, M: Model, const CAPACITY: usize> Scan<'a, M, CAPACITY> {
    /// Begins a scan.
    ///
    /// # Errors
    /// If the recipe is for another model, or for more samples than `CAPACITY`.
    pub fn new(recipe: Recipe<'a>, workspace: &'a mut Workspace<M>) -> Result<Self, ScanError> {
        if recipe.model() != M::KIND {
            return Err(ScanError::Model {
                firmware: M::KIND,
                recipe: recipe.model(),
            });
        }
        if recipe.samples() > CAPACITY {
            return Err(ScanError::Capacity {
                capacity: CAPACITY,
                samples: recipe.samples(),
            });
        }
        let fit = start(&recipe, workspace);
        Ok(Self {
            recipe,
            workspace,
            samples: Vec::new(),
            saturated: 0,
            fit,
        })
    }

    /// Forgets all measurements and begins anew.
    pub fn restart(&mut self) {
        self.samples.clear();
        self.saturated = 0;
        self.fit = start(&self.recipe, self.workspace);
    }

    /// Index of the next measurement and where to take it; None once all are taken.
    #[must_use]
    pub fn next_directions(&self) -> Option<(u16, Directions<f32>)> {
        let index = self.samples.len();
        let angles = self.recipe.pattern().nth(index)?;
        let directions = HalfDifference::from_angles(angles).directions();
        Some((index as u16, directions))
    }

    /// Takes the measurement at the directions that [`Scan::next_directions`] gives now.
    ///
    /// # Errors
    /// If the values cannot be a BRDF; the same directions are then still the next ones.
    pub fn record(&mut self, measurement: Measurement) -> Result<(), MeasurementError> {
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
        self.saturated += u16::from(measurement.saturated);
        Ok(())
    }

    /// Fits further, by at most `budget` gradients of one sample. Does nothing before all
    /// measurements are taken.
    pub fn advance_fit(&mut self, budget: usize) -> Progress {
        let budget = if self.samples.len() == self.recipe.samples() {
            budget
        } else {
            0
        };
        self.fit.advance(self.workspace, &self.samples, budget)
    }

    /// The parameters as they are now.
    #[must_use]
    pub fn parameters(&self) -> &M::Parameters<f32> {
        self.workspace.parameters()
    }

    /// The recipe.
    #[must_use]
    pub fn recipe(&self) -> &Recipe<'a> {
        &self.recipe
    }

    /// The model's BRDF in linear RGB, sr^-1 (not times the cosine), by the parameters as they
    /// are now. Black where a direction is below the horizon or not finite.
    #[must_use]
    pub fn brdf(&self, directions: &Directions<f32>) -> [f32; 3] {
        match HalfDifference::from_directions(directions) {
            Some(at) if at.is_valid() => M::brdf::<f32>(self.workspace.parameters(), &at),
            _ => [0.0; 3],
        }
    }

    /// How well the parameters explain the measurements as they are now.
    #[must_use]
    pub fn residual(&self) -> Residual {
        let mut residual = Residual {
            mean: 0.0,
            worst_index: 0,
            worst: 0.0,
            saturated: self.saturated,
        };
        let errors = residuals::<M>(self.workspace.parameters(), &self.samples);
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

fn start<'a, M: Model>(recipe: &Recipe<'a>, workspace: &mut Workspace<M>) -> Fit<'a> {
    Fit::start(
        workspace,
        recipe.initial(),
        recipe.step_sizes(),
        recipe.inner_steps(),
    )
}
