//! CoefficientNet: from a few readings to coefficients of principal components, by a small learned map.
//!
//! A reading of channel c enters as u_ic, its [logarithm](standardized), centered and scaled for its
//! sample i. With ū_i the mean of the three channels,
//!
//! ```text
//! z_c = bias + g sum over readings (own_i u_ic + mean_i ū_i) + sum over missing ones missing_i
//! a_c = z_c[..m] + W tanh(z_c[m..])
//! ```
//!
//! so that channels are treated alike and any reading may be missing; g is 1, or the [dropout_gain] of those that
//! are there. A [`InitNet`] makes initial parameters of a model of all a_c.
//!
//! The forward pass is written once, over [`Scalar`] and over how weights are [kept](Encoding): bytes
//! in a recipe, plain numbers in training, whose [adjoint](CoefficientNetGradient) stands beside it.

mod adjoint;
mod encoding;
mod init_net;
mod missing;

pub use adjoint::CoefficientNetGradient;
pub use encoding::{Encoding, Packed, Plain};
pub use init_net::{InitNet, InitNetGradient};
pub use missing::{MissingPolicy, dropout_gain};

use crate::model::linear::map;
use crate::numeric::Scalar;
use encoding::scaled;

/// Weights of a reading in each row: of its own channel, of the mean of channels, and of its absence.
pub(crate) const COLUMNS: usize = 3;
/// Of color.
pub(crate) const CHANNELS: usize = 3;
/// Lists that a completion works in: three channels, and what they share.
pub(crate) const LISTS: usize = 4;

/// A reading as it enters a completion: ln((brdf w + e) / e) - `center`, times `scale`.
///
/// `brdf` is in sr^-1, not times a cosine; `weight` is w = cos(theta_i) cos(theta_o).
#[inline(always)]
pub fn standardized<S: Scalar>(brdf: S, weight: S, center: S, scale: S) -> S {
    (map(brdf, S::constant(0.0), weight) - center) * scale
}

/// A reading, or that it is missing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<S> {
    /// Its [standardized] channels, times the gain; 0 if it is missing.
    pub channels: [S; 3],
    /// 0 if it is there, 1 if it is missing.
    pub missing: S,
}

/// The weights of a completion.
///
/// There are m + h rows: m coefficients, which readings enter directly, and h hidden units.
#[derive(Debug)]
pub struct CoefficientNet<'a, S: Scalar, E: Encoding<S>> {
    /// m.
    pub components: usize,
    /// For each sample of the pattern the weights own, mean and missing: n x 3 x (m + h).
    pub readings: &'a [E::Weight],
    /// The factor of each row of `readings`: m + h, or none for 1.
    pub scales: &'a [E::Number],
    /// The bias of each row: m + h.
    pub bias: &'a [E::Number],
    /// W: m rows of h.
    pub output: &'a [E::Weight],
    /// The factor of each row of W: m, or none for 1.
    pub output_scales: &'a [E::Number],
}

impl<S: Scalar, E: Encoding<S>> Clone for CoefficientNet<'_, S, E> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<S: Scalar, E: Encoding<S>> Copy for CoefficientNet<'_, S, E> {}

impl<'a, S: Scalar, E: Encoding<S>> CoefficientNet<'a, S, E> {
    /// m + h.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.bias.len()
    }

    /// h.
    #[must_use]
    pub fn hidden(&self) -> usize {
        self.rows().saturating_sub(self.components)
    }

    /// Number of words that it works in.
    #[must_use]
    pub fn words(&self) -> usize {
        self.rows().saturating_mul(LISTS)
    }

    /// The weights own, mean and missing of a sample.
    #[inline(always)]
    fn columns(&self, sample: usize) -> [&'a [E::Weight]; COLUMNS] {
        let rows = self.rows();
        let first = sample.saturating_mul(COLUMNS).saturating_mul(rows);
        let columns = self.readings.get(first..).unwrap_or_default();
        let (own, rest) = columns.split_at_checked(rows).unwrap_or_default();
        let (mean, rest) = rest.split_at_checked(rows).unwrap_or_default();
        [own, mean, rest.get(..rows).unwrap_or_default()]
    }

    /// Adds a reading, or that it is missing. `state` has [`CoefficientNet::words`] numbers, which begin
    /// at 0.
    #[inline(always)]
    pub fn add(&self, sample: usize, input: &Input<S>, state: &mut [S]) {
        let [own, mean, missing] = self.columns(sample);
        let Some([channels @ .., shared]) = lists(state, self.rows()) else {
            return;
        };
        // A scalar that looks for zeros passes over what does not count.
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
        let [by_red, by_green, by_blue] = input.channels;
        let sums = red.iter_mut().zip(green).zip(blue).zip(shared);
        for ((((red, green), blue), shared), (own, mean)) in sums.zip(own.iter().zip(mean)) {
            let own = E::weight(*own);
            *red = red.plus_product(by_red, own);
            *green = green.plus_product(by_green, own);
            *blue = blue.plus_product(by_blue, own);
            *shared = shared.plus_product(average, E::weight(*mean));
        }
    }

    /// Once all readings are added: the rows of each channel, of hidden units after their
    /// activation.
    #[inline(always)]
    pub fn activate(&self, state: &mut [S]) {
        let Some([channels @ .., shared]) = lists(state, self.rows()) else {
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

    /// Once they are [activated](CoefficientNet::activate): adds what hidden units say to the coefficients of
    /// a channel, the first of which is 0.
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

    /// All of it: coefficients and hidden units of each channel, in `state`.
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

    /// The coefficients of each channel.
    #[inline(always)]
    pub fn coefficients<'s>(&self, state: &'s [S]) -> [&'s [S]; 3] {
        let channel = |index: usize| {
            let first = index.saturating_mul(self.rows());
            let list = state.get(first..).unwrap_or_default();
            list.get(..self.components).unwrap_or_default()
        };
        [channel(0), channel(1), channel(2)]
    }
}

/// The lists of a state: three channels, and what they share.
#[inline(always)]
fn lists<S>(state: &mut [S], rows: usize) -> Option<[&mut [S]; LISTS]> {
    let (red, rest) = state.split_at_mut_checked(rows)?;
    let (green, rest) = rest.split_at_mut_checked(rows)?;
    let (blue, shared) = rest.split_at_mut_checked(rows)?;
    Some([red, green, blue, shared.get_mut(..rows)?])
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
