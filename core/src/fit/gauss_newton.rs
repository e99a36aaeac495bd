//! Damped Gauss-Newton steps from learned initial parameters.
//!
//! The readings y are those of the pattern, and virtual ones: the completed coefficients, evaluated at fixed directions.
//! With the cosine c = max(cos(theta_i), 0), a reading of a channel has the residual and the row of the Jacobian
//!
//! ```text
//! r = ln(1 + y c) - ln(1 + f c),   J = c / (1 + f c) df/dtheta
//! ```
//!
//! The absolute value of r is the error of the loss. A step adds
//!
//! ```text
//! delta = (J'WJ + P)^-1 (J'W r + P (theta_0 - theta)),   P = diag(p)
//! ```
//!
//! to the [active](Active) parameters theta: all parameters of Phong and Cook-Torrance, and the output layer of Neural.
//! In Neural's output layer the channels have no common parameters, so there is a system for each channel. f is an
//! exponential of a linear function there, and one step is nearly exact.
//!
//! The precisions p are learned: a Gaussian prior around theta_0. The weights W are u e / (e + |r|). u is 1 / V for each
//! of V virtual readings, and w / k for each of k readings of the pattern. w and e are learned. With this factor, steps
//! minimize squares of errors far below e, and absolute errors far above.

use super::component_rows::ComponentRows;
use super::ridge::{Real, add_outer_product, factorize_row_with, packed_length, solve_factorized};
use crate::geometry::{Angles, HalfDifference};
use crate::model::linear::unmap;
use crate::model::{Active, Model, ModelKind};
use crate::numeric::Floats;

/// The largest number of active parameters of a system.
const MAX_ACTIVE: usize = 22;

/// Gauss-Newton steps, read in place from a recipe.
#[derive(Clone, Copy, Debug)]
pub struct GaussNewton<'a> {
    pub(crate) model: ModelKind,
    pub(crate) steps: u16,
    pub(crate) initial: Floats<'a>,
    pub(crate) precision: Floats<'a>,
    pub(crate) reading_weight: f32,
    pub(crate) error_scale: f32,
    pub(crate) virtual_readings: VirtualReadings<'a>,
}

/// Directions, and the components of the completion there, read in place from a recipe.
#[derive(Clone, Copy, Debug)]
pub struct VirtualReadings<'a> {
    pub(crate) directions: &'a [[u8; 12]],
    pub(crate) center: Floats<'a>,
    pub(crate) components: ComponentRows<'a>,
}

impl<'a> GaussNewton<'a> {
    /// The model that is fitted.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.model
    }

    /// Number of steps.
    #[must_use]
    pub fn steps(&self) -> u16 {
        self.steps
    }

    /// The initial parameters, in the model's order.
    #[must_use]
    pub fn initial(&self) -> Floats<'a> {
        self.initial
    }

    /// The precision of each active parameter of a system.
    #[must_use]
    pub fn precision(&self) -> Floats<'a> {
        self.precision
    }

    /// The sum of the weights of the pattern's readings. That of the virtual ones is 1.
    #[must_use]
    pub fn reading_weight(&self) -> f32 {
        self.reading_weight
    }

    /// e, the error at which the weight of a reading is halved.
    #[must_use]
    pub fn error_scale(&self) -> f32 {
        self.error_scale
    }

    /// The virtual readings.
    #[must_use]
    pub fn virtual_readings(&self) -> VirtualReadings<'a> {
        self.virtual_readings
    }
}

impl<'a> VirtualReadings<'a> {
    /// The number of directions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// Returns true if there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// The angles of each direction as 12 bytes, little-endian f32, radians.
    #[must_use]
    pub fn directions(&self) -> &'a [[u8; 12]] {
        self.directions
    }

    /// The mean of the mapped training columns at each direction.
    #[must_use]
    pub fn center(&self) -> Floats<'a> {
        self.center
    }

    /// The components at the directions.
    #[must_use]
    pub fn components(&self) -> ComponentRows<'a> {
        self.components
    }

    /// Returns a direction and the BRDF there (sr^-1, not times the cosine) of the coefficients of red, green and blue.
    ///
    /// Not inlined, because firmware contains it once and its stack is released afterwards.
    #[inline(never)]
    #[must_use]
    pub fn get(
        &self,
        index: usize,
        coefficients: [&[f32]; 3],
    ) -> Option<(HalfDifference<f32>, [f32; 3])> {
        let angles = Angles::from_le_bytes(self.directions.get(index)?);
        let at = HalfDifference::from_angles(angles);
        let weight = at.cos_theta_i() * at.cos_theta_o();
        let center = self.center.iter().nth(index)?;
        let brdf = coefficients.map(|coefficients| {
            let mapped = self.components.combine(index, center, coefficients);
            unmap(mapped, 0.0, weight)
        });
        Some((at, brdf))
    }
}

/// The number of entries of a system of `count` parameters: a packed triangle and the right-hand side.
#[must_use]
pub const fn system_length(count: usize) -> usize {
    packed_length(count) + count
}

/// Adds a reading to the systems of a step, which follow each other in `systems`.
///
/// `measured` is a BRDF in sr^-1, not times the cosine. The numbers after it are u and e.
#[inline(always)]
pub fn add_reading<M: Model, S: Real>(
    parameters: &M::Parameters<S>,
    at: &HalfDifference<S>,
    measured: [S; 3],
    [weight, error_scale]: [S; 2],
    systems: &mut [S],
) {
    let one = S::constant(1.0);
    let count = M::ACTIVE.count();
    let mut rows = [[S::constant(0.0); MAX_ACTIVE]; 3];
    let [red, green, blue] = &mut rows;
    let modeled = M::jacobian(parameters, at, [red, green, blue]);
    let cosine = at.cos_theta_i().relu();
    let mut systems = systems.chunks_exact_mut(system_length(count).max(1));
    let mut system = systems.next().unwrap_or_default();
    for (channel, ((row, f), y)) in rows.iter().zip(modeled).zip(measured).enumerate() {
        if channel > 0 && matches!(M::ACTIVE, Active::PerChannel { .. }) {
            system = systems.next().unwrap_or_default();
        }
        let shifted = one + f * cosine;
        let slope = cosine / shifted;
        let residual = ((one + y * cosine) / shifted).ln();
        let weight = weight * error_scale / (error_scale + residual * residual.sign());
        let row = row.get(..count).unwrap_or_default();
        add_row(row, weight * slope, slope, residual, system);
    }
}

/// Adds a row of the Jacobian, times `slope`, with its residual. `scaled` is the weight times the slope.
#[inline(never)]
fn add_row<S: Real>(row: &[S], scaled: S, slope: S, residual: S, system: &mut [S]) {
    let Some((packed, right)) = system.split_at_mut_checked(packed_length(row.len())) else {
        return;
    };
    let by_residual = scaled * residual;
    for (entry, value) in right.iter_mut().zip(row) {
        *entry = entry.plus_product(by_residual, *value);
    }
    add_outer_product(packed, row.iter().copied(), scaled * slope);
}

/// Factorizes one system, replaces its right-hand side by delta, and adds delta to the parameters.
///
/// `initial` are the active parameters of theta_0 of this system.
#[inline(never)]
pub fn take_step<S: Real>(
    active: Active,
    index: usize,
    precision: impl Iterator<Item = S> + Clone,
    initial: &[S],
    system: &mut [S],
    parameters: &mut [S],
) {
    let count = active.count();
    let Some((packed, right)) = system.split_at_mut_checked(packed_length(count)) else {
        return;
    };
    for (k, ((entry, precision), initial)) in
        right.iter_mut().zip(precision.clone()).zip(initial).enumerate()
    {
        if let Some(parameter) = parameters.get(active.index(index, k)) {
            *entry = entry.plus_product(precision, *initial - *parameter);
        }
    }
    for (k, precision) in precision.take(count).enumerate() {
        factorize_row_with(packed, k, precision);
    }
    solve_factorized(packed, right);
    for (k, delta) in right.iter().enumerate() {
        if let Some(parameter) = parameters.get_mut(active.index(index, k)) {
            *parameter = *parameter + *delta;
        }
    }
}
