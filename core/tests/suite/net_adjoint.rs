//! The adjoints of both nets, compared with derivatives in forward mode.

use glimpse_core::fit::coefficient_net::{
    CoefficientNet, CoefficientNetGradient, Input, Plain, StartNet, StartNetGradient,
};
use glimpse_core::numeric::Scalar;
use glimpse_gradcheck::{Forward, compare};

use crate::random::Random;

/// A number of a net.
trait Number: Scalar<Parameter = Self, Sum = Self> {}
impl<S: Scalar<Parameter = S, Sum = S>> Number for S {}

fn numbers(random: &mut Random, count: usize) -> Vec<f64> {
    let numbers = random.numbers(count, 0.7).into_iter();
    numbers.map(f64::from).collect()
}

/// Splits a list into parts of these lengths.
fn split<S, const N: usize>(mut list: &[S], lengths: [usize; N]) -> [&[S]; N] {
    lengths.map(|length| list.split_off(..length).unwrap())
}

fn dot<S: Number>(a: &[S], b: &[f64]) -> S {
    let products = a.iter().zip(b).map(|(a, b)| *a * S::constant(*b));
    products.fold(S::constant(0.0), |sum, product| sum + product)
}

/// A coefficient net with its readings, as one list of numbers.
struct CoefficientCase<'a> {
    missing: &'a [bool],
    components: usize,
    lengths: [usize; 4],
}

impl CoefficientCase<'_> {
    fn net<'n, S: Number>(&self, list: &'n [S]) -> (CoefficientNet<'n, S, Plain>, Vec<Input<S>>) {
        let [readings, bias, output, channels] = split(list, self.lengths);
        let net = CoefficientNet {
            components: self.components,
            readings,
            scales: &[],
            bias,
            output,
            output_scales: &[],
        };
        let inputs = channels.as_chunks().0.iter().zip(self.missing);
        let inputs = inputs.map(|(channels, missing)| Input {
            channels: if *missing {
                [S::constant(0.0); 3]
            } else {
                *channels
            },
            missing: S::constant(f64::from(u8::from(*missing))),
        });
        (net, inputs.collect())
    }

    /// Returns the state of the net for its readings.
    fn state<S: Number>(&self, list: &[S]) -> Vec<S> {
        let (net, inputs) = self.net(list);
        let mut state = vec![S::constant(f64::NAN); net.words()];
        net.compute(&inputs, &mut state);
        state
    }
}

/// The loss is twice the sum of the coefficients, weighted with `lambda`.
fn check_coefficient_net(missing: &[bool], components: usize, hidden: usize) {
    let (samples, rows) = (missing.len(), components + hidden);
    let mut random = Random((100 * rows + samples) as u64);
    let case = CoefficientCase {
        missing,
        components,
        lengths: [samples * 3 * rows, rows, components * hidden, 3 * samples],
    };
    let at = numbers(&mut random, case.lengths.iter().sum());
    let lambda = numbers(&mut random, 3 * components);
    // Derivatives with respect to weights are added: two equal calls double them. Those to inputs are overwritten.
    let mut by = case.lengths.map(|length| vec![0.0; length]);
    for _ in 0..2 {
        let (net, inputs) = case.net(&at);
        let mut by_state = vec![f64::NAN; net.words()];
        for (list, lambda) in by_state.chunks_mut(rows).zip(lambda.chunks(components)) {
            list[..components].copy_from_slice(lambda);
        }
        let [readings, bias, output, by_inputs] = &mut by;
        let mut gradient = CoefficientNetGradient {
            readings,
            bias,
            output,
        };
        let by_inputs = by_inputs.as_chunks_mut().0;
        let state = case.state(&at);
        net.adjoint(&inputs, &state, &mut by_state, &mut gradient, by_inputs);
    }
    for (channel, by_input) in by[3].iter_mut().enumerate() {
        // A missing reading has no channels, and its entries are meaningless.
        *by_input *= if missing[channel / 3] { 0.0 } else { 2.0 };
    }
    let outcome = compare(&case.lengths, &at, &by.concat(), |list| {
        let coefficients = case.net(list).0.coefficients(&case.state(list)).concat();
        let loss = dot(&coefficients, &lambda);
        loss + loss
    });
    outcome.expect("the adjoint is correct");
}

#[test]
fn coefficient_net_adjoint_matches_forward_mode() {
    for (components, hidden) in [(1, 0), (1, 1), (3, 0), (3, 4), (5, 2)] {
        check_coefficient_net(&[false], components, hidden);
        check_coefficient_net(&[true, false, false, true, false], components, hidden);
    }
}

/// Returns a start net, and the coefficients of each channel.
fn start_net<S: Number>(list: &[S], lengths: [usize; 6]) -> (StartNet<'_, S, Plain>, [&[S]; 3]) {
    let [hidden, bias, output, coefficients @ ..] = split(list, lengths);
    let net = StartNet {
        hidden,
        hidden_scales: &[],
        bias,
        output,
        output_scales: &[],
    };
    (net, coefficients)
}

/// The loss is twice the sum of the offsets, weighted with `lambda`. Units beyond `capacity` have no effect.
fn check_start_net([components, units, parameters, capacity]: [usize; 4], scale: f64) {
    let mut random = Random((100 * components + units) as u64);
    let inputs = 3 * components;
    let lengths = [
        units * inputs,
        units,
        parameters * units,
        components,
        components,
        components,
    ];
    let mut at = numbers(&mut random, lengths.iter().sum());
    at.iter_mut()
        .rev()
        .take(inputs)
        .for_each(|coefficient| *coefficient *= scale);
    let lambda = numbers(&mut random, parameters);
    // All derivatives are added: two equal calls double them.
    let mut by = lengths.map(|length| vec![0.0; length]);
    for _ in 0..2 {
        let (net, coefficients) = start_net(&at, lengths);
        let mut state = vec![f64::NAN; capacity];
        net.activate(coefficients, &mut state);
        let mut by_units = vec![f64::NAN; capacity];
        let [hidden, bias, output, by_coefficients @ ..] = &mut by;
        let mut gradient = StartNetGradient {
            hidden,
            bias,
            output,
        };
        let by_coefficients = by_coefficients.each_mut().map(Vec::as_mut_slice);
        let by = (&mut by_units, &mut gradient);
        net.adjoint(coefficients, &state, &lambda, by.0, by.1, by_coefficients);
    }
    let outcome = compare(&lengths, &at, &by.concat(), |list| {
        let (net, coefficients) = start_net(list, lengths);
        let mut state = vec![Forward::fixed(f64::NAN); capacity];
        net.activate(coefficients, &mut state);
        let offsets = (0..parameters).map(|index| net.offset(index, &state));
        let loss = dot(&offsets.collect::<Vec<_>>(), &lambda);
        loss + loss
    });
    outcome.expect("the adjoint is correct");
}

#[test]
fn start_net_adjoint_matches_forward_mode() {
    // The capacity equals the number of units, is larger (memory shared with other uses), or is smaller.
    for shape in [[1, 1, 1, 1], [3, 2, 7, 2], [2, 4, 8, 32], [2, 4, 8, 3]] {
        // Coefficients below the limit of the net, and far above.
        for scale in [1.5, 5.0] {
            check_start_net(shape, scale);
        }
    }
}
