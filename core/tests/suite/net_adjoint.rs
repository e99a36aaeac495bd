//! The adjoints compared with central differences, in f64, for every weight and every input.

use glimpse_core::fit::coefficient_net::{
    CoefficientNet, CoefficientNetGradient, InitNet, InitNetGradient, Input, Plain,
};

use crate::finite_differences::assert_derivatives;
use crate::random::Random;

/// The largest error of a derivative, relative to the largest derivative.
const BOUND: f64 = 1e-9;

fn numbers(random: &mut Random, count: usize) -> Vec<f64> {
    let numbers = random.numbers(count, 0.7).into_iter();
    numbers.map(f64::from).collect()
}

/// Splits a list into parts of these lengths.
fn split<const N: usize>(mut list: &[f64], lengths: [usize; N]) -> [&[f64]; N] {
    lengths.map(|length| {
        let (part, rest) = list.split_at(length);
        list = rest;
        part
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The net of a list of weights and inputs, its inputs, and its state. `lengths` are those of the weights of readings, the
/// bias, W, and three channels of each sample.
fn coefficient_net<'a>(
    list: &'a [f64],
    lengths: [usize; 4],
    components: usize,
    missing: &[bool],
) -> (CoefficientNet<'a, f64, Plain>, Vec<Input<f64>>, Vec<f64>) {
    let [readings, bias, output, channels] = split(list, lengths);
    let net = CoefficientNet {
        components,
        readings,
        scales: &[],
        bias,
        output,
        output_scales: &[],
    };
    let inputs = channels.as_chunks().0.iter().zip(missing);
    let inputs = inputs.map(|(channels, missing)| Input {
        channels: if *missing { [0.0; 3] } else { *channels },
        missing: f64::from(u8::from(*missing)),
    });
    let inputs: Vec<_> = inputs.collect();
    let mut state = vec![f64::NAN; net.words()];
    net.compute(&inputs, &mut state);
    (net, inputs, state)
}

/// Compares the gradient of the loss, which is the sum of the coefficients, weighted with `lambda`.
fn check_coefficient_net(missing: &[bool], components: usize, hidden: usize) {
    let (samples, rows) = (missing.len(), components + hidden);
    let mut random = Random((100 * rows + samples) as u64);
    let lengths = [samples * 3 * rows, rows, components * hidden, 3 * samples];
    let at = numbers(&mut random, lengths.iter().sum());
    let lambda = numbers(&mut random, 3 * components);
    let (net, inputs, state) = coefficient_net(&at, lengths, components, missing);
    let [mut readings, mut bias, mut output, _] = lengths.map(|length| vec![0.0; length]);
    // `adjoint` overwrites derivatives with respect to inputs, and adds those with respect to weights. Two equal calls
    // double the latter.
    let mut by_inputs = vec![[f64::NAN; 3]; samples];
    for _ in 0..2 {
        let mut by_state = vec![f64::NAN; net.words()];
        let channels = by_state.chunks_mut(rows);
        for (list, lambda) in channels.zip(lambda.chunks(components)) {
            list[..components].copy_from_slice(lambda);
        }
        let mut gradient = CoefficientNetGradient {
            readings: &mut readings,
            bias: &mut bias,
            output: &mut output,
        };
        net.adjoint(
            &inputs,
            &state,
            &mut by_state,
            &mut gradient,
            &mut by_inputs,
        );
    }
    let mut derivatives = [readings, bias, output].concat();
    derivatives
        .iter_mut()
        .for_each(|derivative| *derivative /= 2.0);
    for (by_input, missing) in by_inputs.iter().zip(missing) {
        // A missing reading has no channels, and its entries are meaningless.
        derivatives.extend(if *missing { [0.0; 3] } else { *by_input });
    }
    assert_derivatives("coefficient net", &derivatives, &at, BOUND, |list| {
        let (net, _, state) = coefficient_net(&list, lengths, components, missing);
        dot(&net.coefficients(&state).concat(), &lambda)
    });
}

#[test]
fn coefficient_net_adjoint_matches_differences() {
    for (components, hidden) in [(1, 0), (1, 1), (3, 0), (3, 4), (5, 2)] {
        check_coefficient_net(&[false], components, hidden);
        check_coefficient_net(&[false; 5], components, hidden);
        check_coefficient_net(&[true, false, false, true, false], components, hidden);
        check_coefficient_net(&[false, true], components, hidden);
    }
}

/// The net of a list of weights and inputs, its inputs, and its units. `lengths` are those of P, p, U, and the coefficients
/// of three channels.
fn init_net(
    list: &[f64],
    lengths: [usize; 4],
    capacity: usize,
) -> (InitNet<'_, f64, Plain>, [&[f64]; 3], Vec<f64>) {
    let [hidden, bias, output, coefficients] = split(list, lengths);
    let net = InitNet {
        hidden,
        hidden_scales: &[],
        bias,
        output,
        output_scales: &[],
    };
    let coefficients = split(coefficients, [coefficients.len() / 3; 3]);
    let mut units = vec![f64::NAN; capacity];
    net.activate(coefficients, &mut units);
    (net, coefficients, units)
}

/// Compares the gradient of the loss, which is the sum of the offsets, weighted with `lambda`. Units beyond `capacity`
/// have no effect.
fn check_init_net([components, units, parameters, capacity]: [usize; 4], scale: f64) {
    let mut random = Random((100 * components + units) as u64);
    let lengths = [
        units * 3 * components,
        units,
        parameters * units,
        3 * components,
    ];
    let mut at = numbers(&mut random, lengths.iter().sum());
    for coefficient in at.iter_mut().rev().take(3 * components) {
        *coefficient *= scale;
    }
    let lambda = numbers(&mut random, parameters);
    let (net, coefficients, state) = init_net(&at, lengths, capacity);
    // `adjoint` adds all derivatives. Two equal calls double them.
    let [mut hidden, mut bias, mut output, mut by_coefficients] =
        lengths.map(|length| vec![0.0; length]);
    for _ in 0..2 {
        let mut by_units = vec![f64::NAN; capacity];
        let mut gradient = InitNetGradient {
            hidden: &mut hidden,
            bias: &mut bias,
            output: &mut output,
        };
        let (red, rest) = by_coefficients.split_at_mut(components);
        let (green, blue) = rest.split_at_mut(components);
        let by_channels = [red, green, blue];
        net.adjoint(
            coefficients,
            &state,
            &lambda,
            &mut by_units,
            &mut gradient,
            by_channels,
        );
    }
    let mut derivatives = [hidden, bias, output, by_coefficients].concat();
    derivatives
        .iter_mut()
        .for_each(|derivative| *derivative /= 2.0);
    assert_derivatives("init net", &derivatives, &at, BOUND, |list| {
        let (net, _, units) = init_net(&list, lengths, capacity);
        let offsets = (0..parameters).map(|index| net.offset(index, &units));
        dot(&offsets.collect::<Vec<_>>(), &lambda)
    });
}

#[test]
fn init_net_adjoint_matches_differences() {
    // The capacity equals the number of units, is larger (memory shared with other uses), or is smaller.
    for shape in [
        [1, 1, 1, 1],
        [3, 2, 7, 2],
        [2, 4, 8, 4],
        [1, 1, 1, 3],
        [3, 2, 7, 5],
        [2, 4, 8, 32],
        [3, 2, 7, 1],
        [2, 4, 8, 3],
    ] {
        // Coefficients below the limit of the net, and far above.
        for scale in [1.5, 5.0] {
            check_init_net(shape, scale);
        }
    }
}
