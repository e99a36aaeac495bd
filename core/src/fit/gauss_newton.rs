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

use super::coefficients::brdf_at;
use super::ldl::{add_outer_product, factorize_row, packed_length, solve};
use crate::geometry::{Angles, HalfDifference};
use crate::model::{Active, Model, ModelKind};
use crate::numeric::{Floats, PackedRows, Real, Scalar};
use crate::section::{MAX_PRECISION, MIN_PRECISION, section};

/// The largest number of active parameters of a system.
pub const MAX_ACTIVE: usize = 22;

section! {
    /// Gauss-Newton steps toward the present readings, and V virtual ones that the coefficients determine.
    GaussNewton<'a> = 5, "gauss_newton" {
        /// 0 Phong, 1 Neural, 2 Cook-Torrance
        model: ModelKind, in 0.0 => 2.0;
        /// number of steps
        steps: u16, in 1.0 => 100.0;
        /// initial parameters, in the model's order
        initial: Floats<'a>, [Parameters];
        /// precision of each active parameter
        precision: Floats<'a>, [Active], in MIN_PRECISION => MAX_PRECISION;
        /// b, the sum of the weights of the pattern's readings. That of the virtual ones is 1
        reading_weight: f32, in f32::MIN_POSITIVE => 1e4;
        /// d, the error at which the weight of a reading is halved
        error_scale: f32, in f32::MIN_POSITIVE => 1e4;
        /// (theta_h, theta_d, phi_d) of each virtual reading, radians, both directions above the horizon
        directions: Floats<'a>, [VirtualReadings, Three], in -1000.0 => 1000.0;
        /// mapped mean at each virtual reading
        center: Floats<'a>, [VirtualReadings], in -100.0 => 100.0;
        /// components there
        rows: PackedRows<'a>, [VirtualReadings, Components], in -1e4 => 1e4;
    }
}

impl GaussNewton<'_> {
    /// V, the number of virtual readings.
    #[must_use]
    pub fn virtual_readings(&self) -> usize {
        self.center.len()
    }

    /// Returns a direction and the BRDF there (sr^-1, not times the cosine) of the coefficients of red, green and blue.
    /// Not inlined, so that its stack is released before the reading is added.
    #[inline(never)]
    #[must_use]
    pub fn virtual_reading(
        &self,
        index: usize,
        coefficients: [&[f32]; 3],
    ) -> (HalfDifference<f32>, [f32; 3]) {
        let angles = self.directions.triples().nth(index).unwrap_or_default();
        let at = HalfDifference::from_angles(Angles::from_array(angles));
        let [red, ..] = coefficients;
        let rows = self.rows.of(red.len());
        (at, brdf_at(rows, self.center, index, &at, coefficients))
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
    let count = M::ACTIVE.count();
    let mut rows = [[S::constant(0.0); MAX_ACTIVE]; 3];
    let factors = reading_rows::<M, S>(parameters, at, measured, [weight, error_scale], &mut rows);
    let mut systems = systems.chunks_exact_mut(system_length(count).max(1));
    let mut system = systems.next().unwrap_or_default();
    for (channel, (row, [scaled, slope, residual])) in rows.iter().zip(factors).enumerate() {
        if channel > 0 && matches!(M::ACTIVE, Active::PerChannel { .. }) {
            system = systems.next().unwrap_or_default();
        }
        let row = row.get(..count).unwrap_or_default();
        add_row(row, scaled, slope, residual, system);
    }
}

/// Writes the derivatives of the BRDF of each channel to `rows`. Returns for each channel the weight times the slope, the slope,
/// with which a row of the Jacobian is a derivative of ln(1 + f c), and the residual.
#[inline(always)]
pub fn reading_rows<M: Model, S: Scalar<Sum = S>>(
    parameters: &M::Parameters<S::Parameter>,
    at: &HalfDifference<S>,
    measured: [S; 3],
    [weight, error_scale]: [S; 2],
    rows: &mut [[S; MAX_ACTIVE]; 3],
) -> [[S; 3]; 3] {
    let one = S::constant(1.0);
    let [red, green, blue] = rows;
    let modeled = M::jacobian(parameters, at, [red, green, blue]);
    let cosine = at.cos_theta_i().relu();
    let mut factors = [[one; 3]; 3];
    for (factors, (f, y)) in factors.iter_mut().zip(modeled.into_iter().zip(measured)) {
        let shifted = one + f * cosine;
        let slope = cosine / shifted;
        let residual = ((one + y * cosine) / shifted).ln();
        let weight = weight * error_scale / (error_scale + residual * residual.sign());
        *factors = [weight * slope, slope, residual];
    }
    factors
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
    for (k, ((entry, precision), initial)) in right
        .iter_mut()
        .zip(precision.clone())
        .zip(initial)
        .enumerate()
    {
        if let Some(parameter) = parameters.get(active.index(index, k)) {
            *entry = entry.plus_product(precision, *initial - *parameter);
        }
    }
    for (k, precision) in precision.take(count).enumerate() {
        factorize_row(packed, k, precision);
    }
    solve(packed, right);
    for (k, delta) in right.iter().enumerate() {
        if let Some(parameter) = parameters.get_mut(active.index(index, k)) {
            *parameter = *parameter + *delta;
        }
    }
}
