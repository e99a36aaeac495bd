//! CoefficientNet: a small learned map from a few readings to coefficients of principal components.
//!
//! The input of channel c at sample i is u_ic, the mapped reading (see [`coefficients`](super::coefficients)) times a scale. With
//! ū_i the mean of the three channels,
//!
//! ```text
//! z_c = bias + g sum over readings (own_i u_ic + mean_i ū_i) + sum over missing ones missing_i
//! a_c = z_c[..m] + W tanh(z_c[m..])
//! ```
//!
//! Hence all channels are treated alike, and any reading may be missing. g is the
//! [gain](dropout_gain) of the present readings. A [`StartNet`] maps all a_c to a model's initial parameters.
//!
//! The forward pass is generic over [`Scalar`] and over the [encoding](Encoding) of weights: bytes in a recipe, plain
//! numbers in training. Training also has the [adjoint](CoefficientNetGradient).

mod adjoint;
mod encoding;
mod missing;
mod start_net;

pub use adjoint::CoefficientNetGradient;
pub use encoding::{Encoding, Packed, Plain};
pub use missing::dropout_gain;
pub use start_net::{MAX_RMS, StartNet, StartNetGradient};

use crate::numeric::{Scalar, split};
use encoding::scaled;

/// Number of weights of a reading in each row: for its own channel, the mean of channels, and a missing reading.
pub(crate) const COLUMNS: usize = 3;
/// Number of color channels.
pub(crate) const CHANNELS: usize = 3;
/// Number of lists in the memory of the net: three for channels, and one for their shared sum.
pub(crate) const LISTS: usize = 4;

/// The input of the net for one sample: a reading or a missing reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<S> {
    /// u of each channel, times the scale and the gain; 0 if the reading is missing.
    pub channels: [S; 3],
    /// 0 if the reading is present, 1 if it is missing.
    pub missing: S,
}

/// The weights of the net.
///
/// There are m + h rows: m coefficients, which depend directly on the readings, and h hidden units.
#[derive(Clone, Copy, Debug)]
pub struct CoefficientNet<'a, S: Scalar, E: Encoding<S>> {
    /// m, the number of coefficients of a channel.
    pub components: usize,
    /// The weights own, mean and missing of each sample of the pattern: n x 3 x (m + h).
    pub readings: &'a [E::Weight],
    /// The factor of each row of `readings`, m + h; empty for factors of 1.
    pub scales: &'a [E::Number],
    /// The bias of each row: m + h.
    pub bias: &'a [E::Number],
    /// W: m rows of h.
    pub output: &'a [E::Weight],
    /// The factor of each row of W, m; empty for factors of 1.
    pub output_scales: &'a [E::Number],
}

impl<'a, S: Scalar, E: Encoding<S>> CoefficientNet<'a, S, E> {
    /// m + h, the number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.bias.len()
    }

    /// h, the number of hidden units.
    #[must_use]
    pub fn hidden(&self) -> usize {
        self.rows().saturating_sub(self.components)
    }

    /// The memory of the net, in words.
    #[must_use]
    pub fn words(&self) -> usize {
        self.rows().saturating_mul(LISTS)
    }

    /// Returns the weights own, mean and missing of a sample.
    #[inline(always)]
    fn columns(&self, sample: usize) -> [&'a [E::Weight]; COLUMNS] {
        let rows = self.rows();
        let first = sample.saturating_mul(COLUMNS).saturating_mul(rows);
        let columns = self.readings.get(first..).unwrap_or_default();
        let (own, rest) = columns.split_at_checked(rows).unwrap_or_default();
        let (mean, rest) = rest.split_at_checked(rows).unwrap_or_default();
        [own, mean, rest.get(..rows).unwrap_or_default()]
    }

    /// Adds the input of a sample. `state` has [`CoefficientNet::words`] numbers, which are 0 before the first sample.
    #[inline(always)]
    pub fn add(&self, sample: usize, input: &Input<S>, state: &mut [S]) {
        let [own, mean, missing] = self.columns(sample);
        let Some([channels @ .., shared]) = split(state, [self.rows(); LISTS]) else {
            return;
        };
        // A scalar that checks for zeros skips products that are 0.
        if !input.missing.is_zero() {
            for (sum, weight) in shared.iter_mut().zip(missing) {
                *sum = sum.plus_product(input.missing, E::weight(*weight));
            }
            if S::SKIPS_ZEROS {
                return;
            }
        }
        let average = mean_of(input.channels);
        let [red, green, blue] = channels;
        let [u_red, u_green, u_blue] = input.channels;
        let sums = red.iter_mut().zip(green).zip(blue).zip(shared);
        for ((((red, green), blue), shared), (own, mean)) in sums.zip(own.iter().zip(mean)) {
            let own = E::weight(*own);
            *red = red.plus_product(u_red, own);
            *green = green.plus_product(u_green, own);
            *blue = blue.plus_product(u_blue, own);
            *shared = shared.plus_product(average, E::weight(*mean));
        }
    }

    /// Computes the rows of each channel after all samples are added. Hidden units hold their activations.
    #[inline(always)]
    pub fn activate(&self, state: &mut [S]) {
        let Some([channels @ .., shared]) = split(state, [self.rows(); LISTS]) else {
            return;
        };
        for channel in channels {
            let sums = channel.iter_mut().zip(&*shared).zip(self.bias).enumerate();
            for (row, ((sum, shared), bias)) in sums {
                let z = scaled::<S, E>(*sum + *shared, self.scales, row) + E::number(*bias);
                *sum = if row < self.components { z } else { tanh(z) };
            }
        }
    }

    /// Adds the contribution of [activated](CoefficientNet::activate) hidden units to the coefficients of a channel.
    /// Channels are 0, 1 and 2.
    #[inline(always)]
    pub fn complete(&self, channel: usize, state: &mut [S]) {
        let first = channel.saturating_mul(self.rows());
        let list = state.get_mut(first..).unwrap_or_default();
        let Some((coefficients, rest)) = list.split_at_mut_checked(self.components) else {
            return;
        };
        let hidden = rest.get(..self.hidden()).unwrap_or_default();
        let scales = self.output_scales;
        E::add_products_of_units(self.output, self.hidden(), scales, hidden, coefficients);
    }

    /// Computes coefficients and hidden units of each channel, into `state`.
    #[inline(always)]
    pub fn compute(&self, inputs: &[Input<S>], state: &mut [S]) {
        for entry in &mut *state {
            *entry = S::constant(0.0);
        }
        for (sample, input) in inputs.iter().enumerate() {
            self.add(sample, input, state);
        }
        self.activate(state);
        for channel in 0..CHANNELS {
            self.complete(channel, state);
        }
    }

    /// Returns the coefficients of each channel.
    #[inline(always)]
    pub fn coefficients<'s>(&self, state: &'s [S]) -> [&'s [S]; 3] {
        channels(state, self.rows(), self.components)
    }
}

/// Returns the first `length` entries of each channel's list. The starts of lists are `stride` entries apart.
#[inline(always)]
pub(super) fn channels<S>(list: &[S], stride: usize, length: usize) -> [&[S]; CHANNELS] {
    [0, 1, 2].map(|channel: usize| {
        let list = list.get(channel.saturating_mul(stride)..);
        list.and_then(|list| list.get(..length)).unwrap_or_default()
    })
}

#[inline(always)]
fn mean_of<S: Scalar>([red, green, blue]: [S; 3]) -> S {
    (red + green + blue) * S::constant(1.0 / 3.0)
}

/// The hyperbolic tangent: 2 sigmoid(2 x) - 1.
#[inline(always)]
fn tanh<S: Scalar>(x: S) -> S {
    let sigmoid = (x + x).sigmoid();
    sigmoid + sigmoid - S::constant(1.0)
}
