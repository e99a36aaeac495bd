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

use super::ridge::{Real, factorize_row, packed_length, solve_factorized};
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
    pub(crate) rows: &'a [u8],
    pub(crate) scales: Floats<'a>,
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

    /// The weights of the components: for each direction a signed byte for each component.
    #[must_use]
    pub fn rows(&self) -> &'a [u8] {
        self.rows
    }

    /// The factor of each component.
    #[must_use]
    pub fn scales(&self) -> Floats<'a> {
        self.scales
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
        let at = HalfDifference::from_angles(angles(self.directions.get(index)?));
        let weight = at.cos_theta_i() * at.cos_theta_o();
        let center = self.center.iter().nth(index)?;
        let row = self.rows.chunks_exact(self.scales.len().max(1)).nth(index)?;
        let brdf = coefficients.map(|coefficients| {
            let mut mapped = center;
            for ((entry, scale), a) in row.iter().zip(self.scales.iter()).zip(coefficients) {
                mapped += f32::from(entry.cast_signed()) * scale * a;
            }
            unmap(mapped, 0.0, weight)
        });
        Some((at, brdf))
    }
}

/// Unpacks (theta_h, theta_d, phi_d).
fn angles(packed: &[u8; 12]) -> Angles<f32> {
    let [a, b, c, d, e, f, g, h, i, j, k, l] = *packed;
    Angles {
        theta_h: f32::from_le_bytes([a, b, c, d]),
        theta_d: f32::from_le_bytes([e, f, g, h]),
        phi_d: f32::from_le_bytes([i, j, k, l]),
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
    let mut systems = systems.chunks_exact_mut(system_length(count));
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
    let Some((mut lines, right)) = system.split_at_mut_checked(packed_length(row.len())) else {
        return;
    };
    for (index, (entry, left)) in right.iter_mut().zip(row).enumerate() {
        let left = *left * scaled;
        *entry = entry.plus_product(left, residual);
        let left = left * slope;
        let Some((line, rest)) =
            core::mem::take(&mut lines).split_at_mut_checked(index.saturating_add(1))
        else {
            return;
        };
        lines = rest;
        for (entry, other) in line.iter_mut().zip(row) {
            *entry = entry.plus_product(left, *other);
        }
    }
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
        let Some((above, rest)) = packed.split_at_mut_checked(packed_length(k)) else {
            return;
        };
        if let Some(row) = rest.get_mut(..=k) {
            if let Some(diagonal) = row.last_mut() {
                *diagonal = *diagonal + precision;
            }
            factorize_row(above, row, precision);
        }
    }
    solve_factorized(packed, right);
    for (k, delta) in right.iter().enumerate() {
        if let Some(parameter) = parameters.get_mut(active.index(index, k)) {
            *parameter = *parameter + *delta;
        }
    }
}
