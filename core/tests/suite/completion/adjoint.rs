//! The adjoints compared with central differences, in f64, for every weight and every input.

use glimpse_core::fit::coefficient_net::{
    CoefficientNet, CoefficientNetGradient, InitNet, InitNetGradient, Input, Plain,
};

use crate::finite_differences::assert_derivatives;
use crate::random::Random;

/// The largest error of a derivative, relative to the largest derivative of its list.
const BOUND: f64 = 1e-9;

fn numbers(random: &mut Random, count: usize, size: f32) -> Vec<f64> {
    let numbers = random.numbers(count, size).into_iter();
    numbers.map(f64::from).collect()
}

/// Accesses a list of numbers in a case.
type List<C> = fn(&mut C) -> &mut Vec<f64>;

/// Compares the derivatives with respect to each list of a case with differences of its loss.
fn assert_gradient<C: Clone>(
    case: &C,
    loss: impl Fn(&C) -> f64,
    derivatives: &[(&str, &[f64], List<C>)],
) {
    for (name, derivatives, list) in derivatives {
        let at = list(&mut case.clone()).clone();
        assert_derivatives(name, derivatives, &at, BOUND, |moved| {
            let mut other = case.clone();
            *list(&mut other) = moved;
            loss(&other)
        });
    }
}

fn halve(lists: &mut [&mut Vec<f64>]) {
    let numbers = lists.iter_mut().flat_map(|list| list.iter_mut());
    numbers.for_each(|number| *number /= 2.0);
}

/// The weights of a coefficient net, and its inputs.
#[derive(Clone)]
struct Case {
    components: usize,
    readings: Vec<f64>,
    bias: Vec<f64>,
    output: Vec<f64>,
    /// Three channels of each sample.
    inputs: Vec<f64>,
    missing: Vec<bool>,
    /// The loss is the sum of the coefficients, weighted with `lambda`.
    lambda: Vec<f64>,
}

impl Case {
    fn new(missing: &[bool], components: usize, hidden: usize) -> Self {
        let (samples, rows) = (missing.len(), components + hidden);
        let mut random = Random((100 * rows + samples) as u64);
        let mut inputs = numbers(&mut random, 3 * samples, 1.0);
        for (channels, missing) in inputs.chunks_mut(3).zip(missing) {
            if *missing {
                channels.fill(0.0);
            }
        }
        Self {
            components,
            readings: numbers(&mut random, samples * 3 * rows, 0.6),
            bias: numbers(&mut random, rows, 0.5),
            output: numbers(&mut random, components * hidden, 0.8),
            inputs,
            missing: missing.to_vec(),
            lambda: numbers(&mut random, 3 * components, 1.0),
        }
    }

    fn coefficient_net(&self) -> CoefficientNet<'_, f64, Plain> {
        CoefficientNet {
            components: self.components,
            readings: &self.readings,
            scales: &[],
            bias: &self.bias,
            output: &self.output,
            output_scales: &[],
        }
    }

    fn network_inputs(&self) -> Vec<Input<f64>> {
        let samples = self.inputs.as_chunks().0.iter().zip(&self.missing);
        let inputs = samples.map(|(channels, missing)| Input {
            channels: *channels,
            missing: f64::from(u8::from(*missing)),
        });
        inputs.collect()
    }

    fn state(&self) -> Vec<f64> {
        let mut state = vec![f64::NAN; self.coefficient_net().words()];
        self.coefficient_net()
            .compute(&self.network_inputs(), &mut state);
        state
    }

    fn loss(&self) -> f64 {
        let state = self.state();
        let coefficients = self.coefficient_net().coefficients(&state).concat();
        let pairs = coefficients.iter().zip(&self.lambda);
        pairs.map(|(a, lambda)| a * lambda).sum()
    }
}

fn check_coefficient_net(missing: &[bool], components: usize, hidden: usize) {
    let case = Case::new(missing, components, hidden);
    let net = case.coefficient_net();
    let rows = components + hidden;
    let state = case.state();
    let (mut readings, mut bias) = (vec![0.0; case.readings.len()], vec![0.0; rows]);
    let mut output = vec![0.0; case.output.len()];
    // `adjoint` overwrites derivatives with respect to inputs, and adds those with respect to weights. Two equal calls
    // double the latter.
    let mut by_inputs = vec![[f64::NAN; 3]; missing.len()];
    for _ in 0..2 {
        let mut by_state = vec![f64::NAN; net.words()];
        let channels = by_state.chunks_mut(rows);
        for (list, lambda) in channels.zip(case.lambda.chunks(components)) {
            list[..components].copy_from_slice(lambda);
        }
        let mut gradient = CoefficientNetGradient {
            readings: &mut readings,
            bias: &mut bias,
            output: &mut output,
        };
        let network_inputs = case.network_inputs();
        net.adjoint(
            &network_inputs,
            &state,
            &mut by_state,
            &mut gradient,
            &mut by_inputs,
        );
    }
    halve(&mut [&mut readings, &mut bias, &mut output]);
    assert_gradient(
        &case,
        Case::loss,
        &[
            ("readings", &readings, |case| &mut case.readings),
            ("bias", &bias, |case| &mut case.bias),
            ("output", &output, |case| &mut case.output),
        ],
    );
    // A missing reading has no channels.
    for (sample, by_input) in by_inputs.iter().enumerate() {
        if !missing[sample] {
            let channels = 3 * sample..3 * sample + 3;
            let at = &case.inputs[channels.clone()];
            assert_derivatives("input", by_input, at, BOUND, |moved| {
                let mut other = case.clone();
                other.inputs[channels.clone()].copy_from_slice(&moved);
                other.loss()
            });
        }
    }
    // The derivatives of a sample's weights are 0 where they have no effect: the weights of its reading if it is
    // missing, and the weight of its absence if it is present.
    for (lists, missing) in readings.chunks(3 * rows).zip(missing) {
        let (by_reading, by_absence) = lists.split_at(2 * rows);
        let unused = if *missing { by_reading } else { by_absence };
        assert!(unused.iter().all(|derivative| *derivative == 0.0));
    }
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

/// The weights of an init net, and its inputs.
#[derive(Clone)]
struct InitNetCase {
    hidden: Vec<f64>,
    bias: Vec<f64>,
    output: Vec<f64>,
    /// m coefficients for each channel.
    coefficients: Vec<f64>,
    /// The loss is the sum of the offsets, weighted with `lambda`.
    lambda: Vec<f64>,
    /// The capacity of the memory in units. Units beyond it have no effect.
    capacity: usize,
}

impl InitNetCase {
    fn new(components: usize, units: usize, parameters: usize, capacity: usize) -> Self {
        let mut random = Random((100 * components + units) as u64);
        Self {
            hidden: numbers(&mut random, units * 3 * components, 0.6),
            bias: numbers(&mut random, units, 0.5),
            output: numbers(&mut random, parameters * units, 0.8),
            coefficients: numbers(&mut random, 3 * components, 1.0),
            lambda: numbers(&mut random, parameters, 1.0),
            capacity,
        }
    }

    fn init_net(&self) -> InitNet<'_, f64, Plain> {
        InitNet {
            hidden: &self.hidden,
            hidden_scales: &[],
            bias: &self.bias,
            output: &self.output,
            output_scales: &[],
        }
    }

    fn channels(&self) -> [&[f64]; 3] {
        let m = self.coefficients.len() / 3;
        [0, 1, 2].map(|channel| &self.coefficients[channel * m..][..m])
    }

    fn units(&self) -> Vec<f64> {
        let mut units = vec![f64::NAN; self.capacity];
        self.init_net().activate(self.channels(), &mut units);
        units
    }

    fn loss(&self) -> f64 {
        let units = self.units();
        let pairs = self.lambda.iter().enumerate();
        pairs
            .map(|(index, lambda)| lambda * self.init_net().offset(index, &units))
            .sum()
    }
}

#[test]
fn init_net_adjoint_matches_differences() {
    // The capacity equals the number of units, is larger (memory shared with other uses), or is smaller.
    for (components, units, parameters, capacity) in [
        (1, 1, 1, 1),
        (3, 2, 7, 2),
        (2, 4, 8, 4),
        (1, 1, 1, 3),
        (3, 2, 7, 5),
        (2, 4, 8, 32),
        (3, 2, 7, 1),
        (2, 4, 8, 3),
    ] {
        // Coefficients below the limit of the net, and far above.
        for scale in [1.0, 3.0] {
            let mut case = InitNetCase::new(components, units, parameters, capacity);
            for coefficient in &mut case.coefficients {
                *coefficient *= scale;
            }
            let mut hidden = vec![0.0; case.hidden.len()];
            let (mut bias, mut output) = (vec![0.0; units], vec![0.0; case.output.len()]);
            // `adjoint` adds all derivatives. Two equal calls double them.
            let mut by_coefficients = vec![0.0; 3 * components];
            for _ in 0..2 {
                let mut by_units = vec![f64::NAN; capacity];
                let mut gradient = InitNetGradient {
                    hidden: &mut hidden,
                    bias: &mut bias,
                    output: &mut output,
                };
                let (red, rest) = by_coefficients.split_at_mut(components);
                let (green, blue) = rest.split_at_mut(components);
                case.init_net().adjoint(
                    case.channels(),
                    &case.units(),
                    &case.lambda,
                    &mut by_units,
                    &mut gradient,
                    [red, green, blue],
                );
            }
            halve(&mut [&mut hidden, &mut bias, &mut output, &mut by_coefficients]);
            assert_gradient(
                &case,
                InitNetCase::loss,
                &[
                    ("hidden", &hidden, |case| &mut case.hidden),
                    ("bias", &bias, |case| &mut case.bias),
                    ("output", &output, |case| &mut case.output),
                    ("coefficients", &by_coefficients, |case| {
                        &mut case.coefficients
                    }),
                ],
            );
        }
    }
}
