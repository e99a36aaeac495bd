//! StartNet: a small learned map from coefficients to the initial parameters of a descent.

use super::encoding::{Encoding, Plain};
use super::tanh;
use crate::numeric::Scalar;

/// The largest root mean square of the coefficients that the map distinguishes. Those of the training set have 1.
pub const MAX_RMS: f64 = 1.2;

/// Returns s, and the square of the length of a.
#[inline(always)]
fn limit<S: Scalar>(coefficients: [&[S]; 3]) -> (S, S) {
    let one = S::constant(1.0);
    let [mut sum, mut max] = [S::constant(0.0); 2];
    for coefficient in coefficients.into_iter().flatten() {
        sum = sum.plus_product(*coefficient, *coefficient);
        max = max + S::constant(MAX_RMS * MAX_RMS);
    }
    let is_above = sum - max;
    let excess = is_above.if_positive(sum, max) / max;
    let factor = (S::constant(-0.5) * excess.ln()).exp();
    (is_above.if_positive(factor, one), sum)
}

/// The map from coefficients to initial parameters: theta_0 = Phi + U tanh(s P a + p).
///
/// a is the list of the coefficients of red, of green, and of blue. The factor s limits the length of s a to
/// [`MAX_RMS`] times that of a list of ones: far from the training set, the map would be arbitrary. Phi are the initial
/// parameters in the recipe's descent.
#[derive(Clone, Copy, Debug)]
pub struct StartNet<'a, S: Scalar, E: Encoding<S>> {
    /// P, g rows of 3 m.
    pub hidden: &'a [E::Weight],
    /// The factor of each row of P, g; empty for factors of 1.
    pub hidden_scales: &'a [E::Number],
    /// p, a bias for each of the g units.
    pub bias: &'a [E::Number],
    /// U, a row of g for each parameter.
    pub output: &'a [E::Weight],
    /// The factor of each row of U; empty for factors of 1.
    pub output_scales: &'a [E::Number],
}

impl<S: Scalar, E: Encoding<S>> StartNet<'_, S, E> {
    /// g, the number of units.
    #[must_use]
    pub fn units(&self) -> usize {
        self.bias.len()
    }

    /// Computes tanh(s P a + p) from the coefficients of each channel, for as many units as `units` has room for.
    #[inline(always)]
    pub fn activate(&self, coefficients: [&[S]; 3], units: &mut [S]) {
        // Three times one length, because the compiler does not see that the sum of three lengths is not 0.
        let [first, ..] = coefficients;
        let components = first.len().max(1);
        let inputs = components.saturating_mul(3);
        let count = self.units().min(units.len());
        let units = units.get_mut(..count).unwrap_or_default();
        for unit in &mut *units {
            *unit = S::constant(0.0);
        }
        let mut weights = self.hidden;
        for coefficients in coefficients {
            E::add_products(weights, inputs, self.hidden_scales, coefficients, units);
            weights = weights.get(components..).unwrap_or_default();
        }
        let (factor, _) = limit(coefficients);
        for (unit, bias) in units.iter_mut().zip(self.bias) {
            *unit = tanh(factor * *unit + E::number(*bias));
        }
    }

    /// Returns the offset of a parameter from its value in Phi.
    #[inline(always)]
    pub fn offset(&self, parameter: usize, units: &[S]) -> S {
        let mut offset = [S::constant(0.0)];
        self.offsets(parameter, units, &mut offset);
        let [offset] = offset;
        offset
    }

    /// Adds the offsets of consecutive parameters, from index `first`, to `offsets`, which are 0. This takes less time
    /// than single calls of [`StartNet::offset`].
    #[inline(always)]
    pub fn offsets(&self, first: usize, units: &[S], offsets: &mut [S]) {
        let units = units.get(..self.units()).unwrap_or(units);
        let weights = self.output.get(first.saturating_mul(self.units())..);
        let weights = weights.unwrap_or_default();
        let scales = self.output_scales.get(first..).unwrap_or_default();
        E::add_products_of_units(weights, self.units(), scales, units, offsets);
    }
}

/// The gradient of the loss with respect to the weights of a [`StartNet`]. [`StartNet::adjoint`] adds to it.
#[derive(Debug)]
pub struct StartNetGradient<'g, T> {
    /// With respect to P.
    pub hidden: &'g mut [T],
    /// With respect to p.
    pub bias: &'g mut [T],
    /// With respect to U.
    pub output: &'g mut [T],
}

impl<S: Scalar> StartNet<'_, S, Plain> {
    /// Propagates derivatives from the initial parameters to the weights and the coefficients. Adds those of the
    /// weights to `gradient`, and those of the coefficients to `by_coefficients`.
    ///
    /// `units` is the result of [`StartNet::activate`] for `coefficients`. `by_units` is scratch memory of the same
    /// length. Rows have no scales in training.
    #[inline(always)]
    pub fn adjoint(
        &self,
        coefficients: [&[S]; 3],
        units: &[S],
        by_parameters: &[S],
        by_units: &mut [S],
        gradient: &mut StartNetGradient<'_, S::Sum>,
        by_coefficients: [&mut [S]; 3],
    ) {
        let one = S::constant(1.0);
        for by_unit in &mut *by_units {
            *by_unit = S::constant(0.0);
        }
        let length = self.units().max(1);
        let rows = self.output.chunks_exact(length);
        let rows = rows.zip(gradient.output.chunks_exact_mut(length));
        for ((weights, by_weights), by_parameter) in rows.zip(by_parameters) {
            let entries = weights.iter().zip(by_weights).zip(units);
            for (((weight, by_weight), unit), by_unit) in entries.zip(&mut *by_units) {
                S::add_product(by_weight, *by_parameter, *unit);
                *by_unit = by_unit.plus_product(*by_parameter, S::broadcast(*weight));
            }
        }
        let units = by_units.iter_mut().zip(units);
        for ((by_unit, unit), by_bias) in units.zip(&mut *gradient.bias) {
            *by_unit = *by_unit * (one - *unit * *unit);
            S::add_to(by_bias, *by_unit);
        }
        let (factor, squares) = limit(coefficients);
        // The derivative of s with respect to a is -s a / |a|^2 above the limit.
        let mut by_factor = S::constant(0.0);
        let inputs: usize = coefficients.iter().map(|list| list.len()).sum();
        let rows = self.hidden.chunks_exact(inputs.max(1));
        let rows = rows.zip(gradient.hidden.chunks_exact_mut(inputs.max(1)));
        let mut by_coefficients = by_coefficients;
        for ((weights, by_weights), by_unit) in rows.zip(&*by_units) {
            let mut weights = weights.iter();
            let mut by_weights = by_weights.iter_mut();
            let by_product = factor * *by_unit;
            for (values, by_values) in coefficients.iter().zip(&mut by_coefficients) {
                for (value, by_value) in values.iter().zip(by_values.iter_mut()) {
                    if let (Some(weight), Some(by_weight)) = (weights.next(), by_weights.next()) {
                        let weight = S::broadcast(*weight);
                        S::add_product(by_weight, by_product, *value);
                        *by_value = by_value.plus_product(by_product, weight);
                        by_factor = by_factor.plus_product(by_product * weight, *value);
                    }
                }
            }
        }
        let is_above = one - factor;
        let share = is_above.if_positive(by_factor / squares, S::constant(0.0));
        for (values, by_values) in coefficients.iter().zip(&mut by_coefficients) {
            for (value, by_value) in values.iter().zip(by_values.iter_mut()) {
                *by_value = *by_value - share * *value;
            }
        }
    }
}
