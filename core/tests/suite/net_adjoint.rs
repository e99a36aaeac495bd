//! The adjoints of both nets, compared with central differences in f64 for every weight and every input.

use glimpse_core::fit::coefficient_net::{
    CoefficientNet, CoefficientNetGradient, Input, Plain, StartNet, StartNetGradient,
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
    lengths.map(|length| list.split_off(..length).unwrap())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The loss is the sum of the coefficients, weighted with `lambda`.
fn check_coefficient_net(missing: &[bool], components: usize, hidden: usize) {
    let (samples, rows) = (missing.len(), components + hidden);
    let mut random = Random((100 * rows + samples) as u64);
    let lengths = [samples * 3 * rows, rows, components * hidden, 3 * samples];
    let at = numbers(&mut random, lengths.iter().sum());
    let lambda = numbers(&mut random, 3 * components);
    let run = |list: &[f64], gradient: Option<&mut [Vec<f64>; 4]>| {
        let [readings, bias, output, channels] = split(list, lengths);
        let (scales, output_scales) = (&[][..], &[][..]);
        let net = CoefficientNet::<f64, Plain> {
            components,
            readings,
            scales,
            bias,
            output,
            output_scales,
        };
        let inputs = channels.as_chunks().0.iter().zip(missing);
        let inputs = inputs.map(|(channels, missing)| Input {
            channels: if *missing { [0.0; 3] } else { *channels },
            missing: f64::from(u8::from(*missing)),
        });
        let inputs: Vec<_> = inputs.collect();
        let mut state = vec![f64::NAN; net.words()];
        net.compute(&inputs, &mut state);
        if let Some([readings, bias, output, by_inputs]) = gradient {
            let mut by_state = vec![f64::NAN; net.words()];
            for (list, lambda) in by_state.chunks_mut(rows).zip(lambda.chunks(components)) {
                list[..components].copy_from_slice(lambda);
            }
            let mut gradient = CoefficientNetGradient {
                readings,
                bias,
                output,
            };
            let by_inputs = by_inputs.as_chunks_mut().0;
            net.adjoint(&inputs, &state, &mut by_state, &mut gradient, by_inputs);
        }
        dot(&net.coefficients(&state).concat(), &lambda)
    };
    // Derivatives with respect to weights are added: two equal calls double them. Those to inputs are overwritten.
    let mut gradient = lengths.map(|length| vec![0.0; length]);
    run(&at, Some(&mut gradient));
    run(&at, Some(&mut gradient));
    for (channel, by_input) in gradient[3].iter_mut().enumerate() {
        // A missing reading has no channels, and its entries are meaningless.
        *by_input *= if missing[channel / 3] { 0.0 } else { 2.0 };
    }
    assert_derivatives("coefficient net", &gradient.concat(), &at, BOUND, |list| {
        2.0 * run(&list, None)
    });
}

#[test]
fn coefficient_net_adjoint_matches_differences() {
    for (components, hidden) in [(1, 0), (1, 1), (3, 0), (3, 4), (5, 2)] {
        check_coefficient_net(&[false], components, hidden);
        check_coefficient_net(&[true, false, false, true, false], components, hidden);
    }
}

/// The loss is the sum of the offsets, weighted with `lambda`. Units beyond `capacity` have no effect.
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
    let run = |list: &[f64], gradient: Option<&mut [Vec<f64>; 6]>| {
        let [hidden, bias, output, coefficients @ ..] = split(list, lengths);
        let (hidden_scales, output_scales) = (&[][..], &[][..]);
        let net = StartNet::<f64, Plain> {
            hidden,
            hidden_scales,
            bias,
            output,
            output_scales,
        };
        let mut state = vec![f64::NAN; capacity];
        net.activate(coefficients, &mut state);
        if let Some([hidden, bias, output, by_coefficients @ ..]) = gradient {
            let mut by_units = vec![f64::NAN; capacity];
            let mut gradient = StartNetGradient {
                hidden,
                bias,
                output,
            };
            let by_coefficients = by_coefficients.each_mut().map(Vec::as_mut_slice);
            let by = (&mut by_units, &mut gradient);
            net.adjoint(coefficients, &state, &lambda, by.0, by.1, by_coefficients);
        }
        let offsets = (0..parameters).map(|index| net.offset(index, &state));
        dot(&offsets.collect::<Vec<_>>(), &lambda)
    };
    // All derivatives are added: two equal calls double them.
    let mut gradient = lengths.map(|length| vec![0.0; length]);
    run(&at, Some(&mut gradient));
    run(&at, Some(&mut gradient));
    assert_derivatives("start net", &gradient.concat(), &at, BOUND, |list| {
        2.0 * run(&list, None)
    });
}

#[test]
fn start_net_adjoint_matches_differences() {
    // The capacity equals the number of units, is larger (memory shared with other uses), or is smaller.
    for shape in [[1, 1, 1, 1], [3, 2, 7, 2], [2, 4, 8, 32], [2, 4, 8, 3]] {
        // Coefficients below the limit of the net, and far above.
        for scale in [1.5, 5.0] {
            check_start_net(shape, scale);
        }
    }
}
