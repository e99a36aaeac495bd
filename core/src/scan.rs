//! The scan session, free of I/O and of time.
//!
//! It hands out the next pair of directions, takes what was measured there, fits in slices, and
//! evaluates the result. Motors, sensor and clock are the firmware's.
//!
//! [`Scan`] fits a model by descent, [`LinearScan`] the model Linear. A [`Record`] keeps what was
//! measured over a reset.

mod linear;
mod measuring;
mod record;

pub use linear::LinearScan;
pub use record::{Record, RecordError};

use serde::{Deserialize, Serialize};

use crate::fit::ridge::RidgeError;
use crate::fit::{Fit, Progress, Workspace, brdf, residuals};
use crate::geometry::{Directions, HalfDifference};
use crate::model::{Model, ModelKind};
use crate::recipe::{Descent, Learner, Recipe};
use measuring::Measuring;

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
    /// The recipe's ridge solve takes more memory than this firmware gives it.
    Memory {
        /// Numbers that it takes.
        needed: usize,
        /// Numbers that there is room for.
        found: usize,
    },
    /// The recipe's ridge problem has no factors.
    Ridge(RidgeError),
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
            Self::Memory { needed, found } => {
                write!(
                    f,
                    "the recipe takes memory for {needed} numbers, there is room for {found}"
                )
            }
            Self::Ridge(error) => error.fmt(f),
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
    /// How many measurements were the one before them, bit for bit. A real sensor is too noisy for
    /// that; if all but the first were, it is stuck.
    pub repeated: u16,
}

/// A scan of one material by one recipe; `CAPACITY` is the largest n that it has room for.
pub struct Scan<'a, M: Model, const CAPACITY: usize> {
    measuring: Measuring<'a, CAPACITY>,
    descent: Descent<'a>,
    workspace: &'a mut Workspace<M>,
    fit: Fit<'a>,
}

impl<'a, M: Model, const CAPACITY: usize> Scan<'a, M, CAPACITY> {
    /// Begins a scan.
    ///
    /// # Errors
    /// If the recipe is for another model, or for more samples than `CAPACITY`.
    pub fn new(recipe: Recipe<'a>, workspace: &'a mut Workspace<M>) -> Result<Self, ScanError> {
        let descent = match recipe.learner() {
            Learner::Descent(descent) if descent.model() == M::KIND => descent,
            _ => {
                return Err(ScanError::Model {
                    firmware: M::KIND,
                    recipe: recipe.model(),
                });
            }
        };
        let measuring = Measuring::new(recipe)?;
        let fit = start(&descent, workspace);
        Ok(Self {
            measuring,
            descent,
            workspace,
            fit,
        })
    }

    /// Forgets all measurements and begins anew.
    pub fn restart(&mut self) {
        self.measuring.restart();
        self.fit = start(&self.descent, self.workspace);
    }

    /// Index of the next measurement and where to take it; None once all are taken.
    #[must_use]
    pub fn next_directions(&self) -> Option<(u16, Directions<f32>)> {
        self.measuring.next_directions()
    }

    /// Takes the measurement at the directions that [`Scan::next_directions`] gives now.
    ///
    /// # Errors
    /// If the values cannot be a BRDF; the same directions are then still the next ones.
    pub fn record(&mut self, measurement: Measurement) -> Result<(), MeasurementError> {
        self.measuring.record(measurement)
    }

    /// Fits further, by at most `budget` gradients of one sample. Does nothing before all
    /// measurements are taken.
    pub fn advance_fit(&mut self, budget: usize) -> Progress {
        let budget = if self.measuring.is_complete() {
            budget
        } else {
            0
        };
        self.fit
            .advance(self.workspace, self.measuring.samples(), budget)
    }

    /// The parameters as they are now.
    #[must_use]
    pub fn parameters(&self) -> &M::Parameters<f32> {
        self.workspace.parameters()
    }

    /// The recipe.
    #[must_use]
    pub fn recipe(&self) -> &Recipe<'a> {
        self.measuring.recipe()
    }

    /// The model's BRDF in linear RGB, sr^-1 (not times the cosine), by the parameters as they
    /// are now. Black where a direction is below the horizon or not finite.
    #[must_use]
    pub fn brdf(&self, directions: &Directions<f32>) -> [f32; 3] {
        match HalfDifference::from_directions(directions) {
            Some(at) if at.is_valid() => brdf::<M>(self.workspace.parameters(), &at),
            _ => [0.0; 3],
        }
    }

    /// How well the parameters explain the measurements as they are now. Its mean is not finite if
    /// the fit diverged: such a result is none.
    #[must_use]
    pub fn residual(&self) -> Residual {
        let samples = self.measuring.samples();
        self.measuring
            .residual(residuals::<M>(self.workspace.parameters(), samples))
    }
}

fn start<'a, M: Model>(descent: &Descent<'a>, workspace: &mut Workspace<M>) -> Fit<'a> {
    Fit::start(
        workspace,
        descent.initial(),
        descent.step_sizes(),
        descent.inner_steps(),
    )
}
