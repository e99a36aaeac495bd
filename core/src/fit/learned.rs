//! Descents and ridge solves, read in place from a recipe.

use super::ridge::Problem;
use crate::model::ModelKind;
use crate::numeric::Floats;

/// A few steps of SGD from learned initial parameters, with a learned step size for each parameter.
#[derive(Clone, Copy, Debug)]
pub struct Descent<'a> {
    pub(crate) model: ModelKind,
    pub(crate) inner_steps: u16,
    pub(crate) initial: Floats<'a>,
    pub(crate) step_sizes: Floats<'a>,
}

impl<'a> Descent<'a> {
    /// The model that the descent fits.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.model
    }

    /// Number of SGD steps.
    #[must_use]
    pub fn inner_steps(&self) -> u16 {
        self.inner_steps
    }

    /// The initial parameters, in the model's order.
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

/// A ridge solve with a basis that is reduced to the sampled directions; see [`crate::fit::ridge`].
#[derive(Clone, Copy, Debug)]
pub struct Ridge<'a> {
    pub(crate) problem: Problem<'a, [u8; 4]>,
    pub(crate) basis: Floats<'a>,
    pub(crate) mean: Floats<'a>,
    pub(crate) median: Floats<'a>,
    pub(crate) weight: Floats<'a>,
    pub(crate) precision: Floats<'a>,
    pub(crate) basis_checksum: u32,
}

impl<'a> Ridge<'a> {
    /// The problem of basis and precisions, not yet factorized.
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

    /// The median BRDF of the training columns at the sampled directions, sr^-1 (not times a cosine).
    #[must_use]
    pub fn median(&self) -> Floats<'a> {
        self.median
    }

    /// cos(theta_i) cos(theta_o) at the sampled directions.
    #[must_use]
    pub fn weight(&self) -> Floats<'a> {
        self.weight
    }

    /// The precision of each coefficient. The paper has one precision for all of them, eta.
    #[must_use]
    pub fn precision(&self) -> Floats<'a> {
        self.precision
    }

    /// The CRC-32 of the host's whole basis file, which turns coefficients into a BRDF. None without a basis.
    #[must_use]
    pub fn basis_checksum(&self) -> Option<u32> {
        Some(self.basis_checksum).filter(|checksum| *checksum != 0)
    }
}
