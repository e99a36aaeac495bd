//! The backward pass of a [`CoefficientNet`], for training.
//!
//! `by_x` is the derivative of the loss with respect to x.

use super::encoding::Plain;
use super::{COLUMNS, CoefficientNet, Input, LISTS, mean_of};
use crate::numeric::{Scalar, split};

/// The gradient of the loss with respect to the weights of a [`CoefficientNet`]. [`CoefficientNet::adjoint`] adds to
/// it.
#[derive(Debug)]
pub struct CoefficientNetGradient<'g, T> {
    /// With respect to the weights of readings.
    pub readings: &'g mut [T],
    /// With respect to the bias of each row.
    pub bias: &'g mut [T],
    /// With respect to W.
    pub output: &'g mut [T],
}

impl<S: Scalar> CoefficientNet<'_, S, Plain> {
    /// Propagates derivatives from the coefficients to the weights and the inputs. Adds those of the weights to
    /// `gradient`, and writes those of the inputs' channels to `by_inputs`.
    ///
    /// `state` is the result of [`CoefficientNet::compute`]. `by_state` has the same layout. On entry, it holds the
    /// derivatives with respect to each channel's coefficients; its other entries are overwritten. Rows have no scales
    /// in training. The entries of missing readings in `by_inputs` are meaningless.
    #[inline(always)]
    pub fn adjoint(
        &self,
        inputs: &[Input<S>],
        state: &[S],
        by_state: &mut [S],
        gradient: &mut CoefficientNetGradient<'_, S::Sum>,
        by_inputs: &mut [[S; 3]],
    ) {
        let rows = self.rows();
        let (zero, one) = (S::constant(0.0), S::constant(1.0));
        let Some([red, green, blue, shared]) = split(by_state, [rows; LISTS]) else {
            return;
        };
        let channels = state.chunks_exact(rows.max(1));
        for (by_channel, channel) in [&mut *red, &mut *green, &mut *blue]
            .into_iter()
            .zip(channels)
        {
            let by_rows = by_channel.split_at_mut_checked(self.components);
            let (by_coefficients, by_hidden) = by_rows.unwrap_or_default();
            let hidden = channel.get(self.components..).unwrap_or_default();
            for by_unit in &mut *by_hidden {
                *by_unit = zero;
            }
            let length = self.hidden().max(1);
            let weights = self.output.chunks_exact(length);
            let weights = weights.zip(gradient.output.chunks_exact_mut(length));
            for ((weights, by_weights), by_coefficient) in weights.zip(&*by_coefficients) {
                let entries = weights.iter().zip(by_weights).zip(hidden);
                for (((weight, by_weight), unit), by_unit) in entries.zip(&mut *by_hidden) {
                    S::add_product(by_weight, *by_coefficient, *unit);
                    *by_unit = by_unit.plus_product(*by_coefficient, S::broadcast(*weight));
                }
            }
            for (by_unit, unit) in by_hidden.iter_mut().zip(hidden) {
                *by_unit = *by_unit * (one - *unit * *unit);
            }
        }
        let sums = red.iter().zip(&*green).zip(&*blue).zip(&mut *shared);
        for ((((red, green), blue), shared), by_bias) in sums.zip(&mut *gradient.bias) {
            *shared = *red + *green + *blue;
            S::add_to(by_bias, *shared);
        }

        let columns = gradient
            .readings
            .chunks_exact_mut(COLUMNS.saturating_mul(rows).max(1));
        let samples = inputs.iter().zip(by_inputs).zip(columns);
        for (sample, ((input, by_input), by_weights)) in samples.enumerate() {
            let [own, mean, _] = self.columns(sample);
            let Some([by_own, by_mean, by_missing]) = split(by_weights, [rows; COLUMNS]) else {
                return;
            };
            let mut by_average = zero;
            let average = mean_of(input.channels);
            let entries = mean.iter().zip(by_mean).zip(by_missing).zip(&*shared);
            for (((weight, by_mean), by_missing), by_row) in entries {
                S::add_product(by_mean, *by_row, average);
                S::add_product(by_missing, *by_row, input.missing);
                by_average = by_average.plus_product(*by_row, S::broadcast(*weight));
            }
            let by_average = by_average * S::constant(1.0 / 3.0);
            *by_input = [by_average; 3];
            let by_channels = red.iter().zip(&*green).zip(&*blue);
            for (((red, green), blue), (weight, by_own)) in by_channels.zip(own.iter().zip(by_own))
            {
                let by_rows = [*red, *green, *blue];
                let entries = by_rows.iter().zip(&input.channels).zip(&mut *by_input);
                for ((by_row, value), by_value) in entries {
                    S::add_product(by_own, *by_row, *value);
                    *by_value = by_value.plus_product(*by_row, S::broadcast(*weight));
                }
            }
        }
    }
}
