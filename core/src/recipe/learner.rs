//! How measurements become parameters, checked.

use super::format::{Floats, PackedDescent, PackedLearner, PackedRidge};
use super::{Field, MAX_COMPONENTS, MAX_INNER_STEPS, RecipeError};
use crate::linear::Problem;
use crate::model::ModelKind;

/// How measurements become parameters.
#[derive(Clone, Copy, Debug)]
pub enum Learner<'a> {
    /// A few steps of SGD.
    Descent(Descent<'a>),
    /// A ridge solve, the model Linear.
    Ridge(Ridge<'a>),
}

/// A few steps of SGD from a learned start, with a learned step size for each parameter.
#[derive(Clone, Copy, Debug)]
pub struct Descent<'a> {
    model: ModelKind,
    inner_steps: u16,
    initial: Floats<'a>,
    step_sizes: Floats<'a>,
}

impl<'a> Descent<'a> {
    /// The model that it fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.model
    }

    /// SGD steps of the fit.
    #[must_use]
    pub fn inner_steps(&self) -> u16 {
        self.inner_steps
    }

    /// Initial parameters, in the model's order.
    #[must_use]
    pub fn initial(&self) -> Floats<'a> {
        self.initial
    }

    /// A step size for each parameter, in the same order.
    #[must_use]
    pub fn step_sizes(&self) -> Floats<'a> {
        self.step_sizes
    }
}

/// A ridge solve on a basis that is reduced to the sampled directions; see [`crate::linear`].
#[derive(Clone, Copy, Debug)]
pub struct Ridge<'a> {
    problem: Problem<'a, [u8; 4]>,
    basis: Floats<'a>,
    mean: Floats<'a>,
    median: Floats<'a>,
    weight: Floats<'a>,
    precision: Floats<'a>,
    basis_checksum: u32,
}

impl<'a> Ridge<'a> {
    /// Basis and precisions, to be factorized.
    #[must_use]
    pub fn problem(&self) -> Problem<'a, [u8; 4]> {
        self.problem
    }

    /// m, the number of components.
    #[must_use]
    pub fn components(&self) -> usize {
        self.precision.len()
    }

    /// The components at the sampled directions, mapped: n rows of m.
    #[must_use]
    pub fn basis(&self) -> Floats<'a> {
        self.basis
    }

    /// The mean of the mapped training columns at the sampled directions.
    #[must_use]
    pub fn mean(&self) -> Floats<'a> {
        self.mean
    }

    /// The median BRDF of the training columns at the sampled directions, sr^-1 (not times a
    /// cosine).
    #[must_use]
    pub fn median(&self) -> Floats<'a> {
        self.median
    }

    /// cos(theta_i) cos(theta_o) at the sampled directions.
    #[must_use]
    pub fn weight(&self) -> Floats<'a> {
        self.weight
    }

    /// The precision of each coefficient (the paper's eta, for all of them).
    #[must_use]
    pub fn precision(&self) -> Floats<'a> {
        self.precision
    }

    /// The CRC-32 of the host's file of the whole basis, which turns coefficients into a BRDF; None
    /// if there is none.
    #[must_use]
    pub fn basis_checksum(&self) -> Option<u32> {
        Some(self.basis_checksum).filter(|checksum| *checksum != 0)
    }
}

impl<'a> Learner<'a> {
    /// Checks what a body holds, for a pattern of so many samples.
    pub(super) fn check(packed: PackedLearner<'a>, samples: usize) -> Result<Self, RecipeError> {
        match packed {
            PackedLearner::Descent(packed) => Descent::check(packed).map(Self::Descent),
            PackedLearner::Ridge(packed) => Ridge::check(packed, samples).map(Self::Ridge),
        }
    }
}

impl<'a> Descent<'a> {
    fn check(packed: PackedDescent<'a>) -> Result<Self, RecipeError> {
        if !(1..=MAX_INNER_STEPS).contains(&packed.inner_steps) {
            return Err(RecipeError::Count(Field::InnerSteps));
        }
        let Some(parameters) = packed.model.parameters() else {
            return Err(RecipeError::Model(packed.model));
        };
        Ok(Self {
            model: packed.model,
            inner_steps: packed.inner_steps,
            initial: list(packed.initial, parameters, Field::Initial)?,
            step_sizes: list(packed.step_sizes, parameters, Field::StepSizes)?,
        })
    }
}

impl<'a> Ridge<'a> {
    fn check(packed: PackedRidge<'a>, samples: usize) -> Result<Self, RecipeError> {
        let components = usize::from(packed.components);
        if !(1..=MAX_COMPONENTS).contains(&components) {
            return Err(RecipeError::Count(Field::Components));
        }
        let basis = list(
            packed.basis,
            samples.saturating_mul(components),
            Field::Basis,
        )?;
        let mean = list(packed.mean, samples, Field::Mean)?;
        let median = list(packed.median, samples, Field::Median)?;
        let weight = positive(packed.weight, samples, Field::Weight)?;
        let precision = positive(packed.precision, components, Field::Precision)?;
        if median.iter().any(|value| value < 0.0) {
            return Err(RecipeError::Negative(Field::Median));
        }
        let problem = Problem::new(basis.words(), precision.words());
        Ok(Self {
            problem: problem.map_err(|_| RecipeError::Count(Field::Basis))?,
            basis,
            mean,
            median,
            weight,
            precision,
            basis_checksum: packed.basis_checksum,
        })
    }
}

/// A list of so many finite numbers.
fn list(bytes: &[u8], length: usize, field: Field) -> Result<Floats<'_>, RecipeError> {
    let list = Floats::new(bytes)
        .filter(|list| list.len() == length)
        .ok_or(RecipeError::Count(field))?;
    if list.iter().all(f32::is_finite) {
        Ok(list)
    } else {
        Err(RecipeError::NonFinite(field))
    }
}

/// A list of so many positive, finite numbers.
fn positive(bytes: &[u8], length: usize, field: Field) -> Result<Floats<'_>, RecipeError> {
    let list = list(bytes, length, field)?;
    if list.iter().all(|value| value > 0.0) {
        Ok(list)
    } else {
        Err(RecipeError::NotPositive(field))
    }
}
