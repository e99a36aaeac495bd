//! The layer sizes and the weights of the coefficient net and the start net.

use glimpse_core::fit::coefficient_net::{CoefficientNet, Plain, StartNet};

use crate::lanes::Lanes;

/// The layer sizes of a coefficient net and its start net.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// n, the number of samples.
    pub samples: usize,
    /// m, the number of principal components.
    pub components: usize,
    /// h, the number of hidden units of the coefficient net.
    pub hidden: usize,
    /// g, the number of hidden units of the start net; 0 without an start net.
    pub units: usize,
    /// The number of parameters of the model that the start net initializes; 0 without an start net.
    pub parameters: usize,
}

impl Shape {
    /// Returns the number of rows: m coefficients and h hidden units.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.components + self.hidden
    }

    /// Returns the lengths of the coefficient net's lists of weights: readings, bias and output ([`CoefficientNet`]'s
    /// W).
    #[must_use]
    pub fn coefficient_net_lengths(&self) -> [usize; 3] {
        let rows = self.rows();
        [3 * self.samples * rows, rows, self.components * self.hidden]
    }

    /// Returns the lengths of the start net's lists of weights: hidden, bias and output ([`StartNet`]'s P, p and U).
    #[must_use]
    pub fn start_net_lengths(&self) -> [usize; 3] {
        let (components, units) = (self.components, self.units);
        [units * 3 * components, units, self.parameters * units]
    }

    /// Returns the length of the coefficient net's state: a list of rows for each channel, and one for their shared
    /// sum.
    pub(crate) fn state_len(&self) -> usize {
        4 * self.rows()
    }
}

/// Splits a flat list into three lists of the given lengths.
#[must_use]
pub fn split_lists<T>(list: &[T], [first, second, third]: [usize; 3]) -> [&[T]; 3] {
    let (a, rest) = list.split_at(first);
    let (b, rest) = rest.split_at(second);
    [a, b, &rest[..third]]
}

pub(crate) fn split_lists_mut<T>(
    list: &mut [T],
    [first, second, third]: [usize; 3],
) -> [&mut [T]; 3] {
    let (a, rest) = list.split_at_mut(first);
    let (b, rest) = rest.split_at_mut(second);
    [a, b, &mut rest[..third]]
}

/// The weights of a coefficient net and its start net as flat lists.
#[derive(Clone, Copy, Debug)]
pub struct CompletionWeights<'a> {
    /// The layer sizes.
    pub shape: Shape,
    /// The weights of the coefficient net: readings, bias and output.
    pub coefficient_net: &'a [f32],
    /// The weights of the start net: hidden, bias and output; empty without an start net.
    pub start_net: &'a [f32],
}

impl<'a> CompletionWeights<'a> {
    pub(crate) fn coefficient_net<L: Lanes>(&self) -> CoefficientNet<'a, L, Plain> {
        let [readings, bias, output] =
            split_lists(self.coefficient_net, self.shape.coefficient_net_lengths());
        CoefficientNet {
            components: self.shape.components,
            readings,
            scales: &[],
            bias,
            output,
            output_scales: &[],
        }
    }

    pub(crate) fn start_net<L: Lanes>(&self) -> StartNet<'a, L, Plain> {
        let [hidden, bias, output] = split_lists(self.start_net, self.shape.start_net_lengths());
        StartNet {
            hidden,
            hidden_scales: &[],
            bias,
            output,
            output_scales: &[],
        }
    }
}
