//! The adjoints against central differences, in f64, for every weight and every input.

use glimpse_core::fit::completion::{
    Completion, CompletionGradient, Input, Plain, Start, StartGradient,
};

use super::made::Random;

/// The largest error of a slope, relative to the largest slope of its list. The differences are of
/// fourth order, of steps of 1e-3.
const BOUND: f64 = 1e-9;

/// Compares each slope with a central difference.
fn compare(what: &str, slopes: &[f64], at: &[f64], function: impl Fn(&[f64]) -> f64) {
    let scale = slopes.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    assert!(scale > 1e-3 || slopes.is_empty(), "{what} has no slope");
    assert_eq!(slopes.len(), at.len());
    for (index, slope) in slopes.iter().enumerate() {
        let step = 1e-3;
        let mut difference = 0.0;
        for (place, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
            let mut moved = at.to_vec();
            moved[index] += place * step;
            difference += weight * function(&moved);
        }
        difference /= 12.0 * step;
        let error = (slope - difference).abs() / scale;
        assert!(
            error < BOUND,
            "{what} {index}: the slope is {slope:e}, the difference {difference:e}"
        );
    }
}

fn numbers(random: &mut Random, count: usize, size: f32) -> Vec<f64> {
    random
        .numbers(count, size)
        .into_iter()
        .map(f64::from)
        .collect()
}

/// The weights of a completion, and what it is asked.
#[derive(Clone)]
struct Case {
    components: usize,
    readings: Vec<f64>,
    bias: Vec<f64>,
    output: Vec<f64>,
    /// Three channels of each sample.
    inputs: Vec<f64>,
    missing: Vec<bool>,
    /// The loss is the sum of the coefficients times these.
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

    fn completion(&self) -> Completion<'_, f64, Plain> {
        Completion {
            components: self.components,
            readings: &self.readings,
            scales: &[],
            bias: &self.bias,
            output: &self.output,
            output_scales: &[],
        }
    }

    fn given(&self) -> Vec<Input<f64>> {
        let samples = self.inputs.chunks(3).zip(&self.missing);
        let inputs = samples.map(|(channels, missing)| Input {
            channels: [channels[0], channels[1], channels[2]],
            missing: if *missing { 1.0 } else { 0.0 },
        });
        inputs.collect()
    }

    fn state(&self) -> Vec<f64> {
        let mut state = vec![f64::NAN; self.completion().words()];
        self.completion().compute(&self.given(), &mut state);
        state
    }

    fn loss(&self) -> f64 {
        let state = self.state();
        let coefficients = self.completion().coefficients(&state).concat();
        let pairs = coefficients.iter().zip(&self.lambda);
        pairs.map(|(a, lambda)| a * lambda).sum()
    }
}

fn check(missing: &[bool], components: usize, hidden: usize) {
    let case = Case::new(missing, components, hidden);
    let completion = case.completion();
    let rows = components + hidden;
    let state = case.state();
    let (mut readings, mut bias) = (vec![0.0; case.readings.len()], vec![0.0; rows]);
    let mut output = vec![0.0; case.output.len()];
    // By the inputs it says, to the weights it adds: here the same twice.
    let mut by_inputs = vec![[f64::NAN; 3]; missing.len()];
    for _ in 0..2 {
        let mut by_state = vec![f64::NAN; completion.words()];
        for (list, lambda) in by_state
            .chunks_mut(rows)
            .zip(case.lambda.chunks(components))
        {
            list[..components].copy_from_slice(lambda);
        }
        let mut gradient = CompletionGradient {
            readings: &mut readings,
            bias: &mut bias,
            output: &mut output,
        };
        completion.adjoint(
            &case.given(),
            &state,
            &mut by_state,
            &mut gradient,
            &mut by_inputs,
        );
    }
    for slope in readings.iter_mut().chain(&mut bias).chain(&mut output) {
        *slope /= 2.0;
    }

    compare("readings", &readings, &case.readings, |list| {
        let readings = list.to_vec();
        Case {
            readings,
            ..case.clone()
        }
        .loss()
    });
    compare("bias", &bias, &case.bias, |list| {
        let bias = list.to_vec();
        Case {
            bias,
            ..case.clone()
        }
        .loss()
    });
    compare("output", &output, &case.output, |list| {
        let output = list.to_vec();
        Case {
            output,
            ..case.clone()
        }
        .loss()
    });
    // What is missing has no channels.
    for (sample, by_input) in by_inputs.iter().enumerate() {
        if !missing[sample] {
            let at = &case.inputs[3 * sample..][..3];
            compare("input", by_input, at, |channels| {
                let mut moved = case.clone();
                moved.inputs[3 * sample..][..3].copy_from_slice(channels);
                moved.loss()
            });
        }
    }

    // A weight of a reading that is there has nothing to do with its absence, and the other way
    // round.
    for (lists, missing) in readings.chunks(3 * rows).zip(missing) {
        let (of_readings, of_absence) = lists.split_at(2 * rows);
        let idle = if *missing { of_readings } else { of_absence };
        assert!(idle.iter().all(|slope| *slope == 0.0));
    }
}

#[test]
fn the_adjoint_of_a_completion_agrees_with_differences() {
    for (components, hidden) in [(1, 0), (1, 1), (3, 0), (3, 4), (5, 2)] {
        check(&[false], components, hidden);
        check(&[false; 5], components, hidden);
        check(&[true, false, false, true, false], components, hidden);
        check(&[false, true], components, hidden);
    }
}

/// The weights of a start, and what it is asked.
#[derive(Clone)]
struct StartCase {
    hidden: Vec<f64>,
    bias: Vec<f64>,
    output: Vec<f64>,
    /// m for each channel.
    coefficients: Vec<f64>,
    /// The loss is the sum of the offsets times these.
    lambda: Vec<f64>,
    /// How many units there is room for: those past it count for nothing.
    room: usize,
}

impl StartCase {
    fn new(components: usize, units: usize, parameters: usize, room: usize) -> Self {
        let mut random = Random((100 * components + units) as u64);
        Self {
            hidden: numbers(&mut random, units * 3 * components, 0.6),
            bias: numbers(&mut random, units, 0.5),
            output: numbers(&mut random, parameters * units, 0.8),
            coefficients: numbers(&mut random, 3 * components, 1.0),
            lambda: numbers(&mut random, parameters, 1.0),
            room,
        }
    }

    fn start(&self) -> Start<'_, f64, Plain> {
        Start {
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
        let mut units = vec![f64::NAN; self.room];
        self.start().activate(self.channels(), &mut units);
        units
    }

    fn loss(&self) -> f64 {
        let units = self.units();
        let offsets = (0..self.lambda.len()).map(|index| self.start().offset(index, &units));
        offsets
            .zip(&self.lambda)
            .map(|(offset, lambda)| offset * lambda)
            .sum()
    }
}

#[test]
fn the_adjoint_of_a_start_agrees_with_differences() {
    // Room for its units, for more, as memory that others work in too, and for fewer.
    for (components, units, parameters, room) in [
        (1, 1, 1, 1),
        (3, 2, 7, 2),
        (2, 4, 8, 4),
        (1, 1, 1, 3),
        (3, 2, 7, 5),
        (2, 4, 8, 32),
        (3, 2, 7, 1),
        (2, 4, 8, 3),
    ] {
        let case = StartCase::new(components, units, parameters, room);
        let mut hidden = vec![0.0; case.hidden.len()];
        let (mut bias, mut output) = (vec![0.0; units], vec![0.0; case.output.len()]);
        // It adds to all of them: here the same twice.
        let mut by_coefficients = vec![0.0; 3 * components];
        for _ in 0..2 {
            let mut by_units = vec![f64::NAN; room];
            let mut gradient = StartGradient {
                hidden: &mut hidden,
                bias: &mut bias,
                output: &mut output,
            };
            let (red, rest) = by_coefficients.split_at_mut(components);
            let (green, blue) = rest.split_at_mut(components);
            case.start().adjoint(
                case.channels(),
                &case.units(),
                &case.lambda,
                &mut by_units,
                &mut gradient,
                [red, green, blue],
            );
        }
        let lists = [&mut hidden, &mut bias, &mut output, &mut by_coefficients];
        lists.into_iter().flatten().for_each(|slope| *slope /= 2.0);
        compare("P", &hidden, &case.hidden, |list| {
            let hidden = list.to_vec();
            StartCase {
                hidden,
                ..case.clone()
            }
            .loss()
        });
        compare("p", &bias, &case.bias, |list| {
            let bias = list.to_vec();
            StartCase {
                bias,
                ..case.clone()
            }
            .loss()
        });
        compare("U", &output, &case.output, |list| {
            let output = list.to_vec();
            StartCase {
                output,
                ..case.clone()
            }
            .loss()
        });
        compare("a", &by_coefficients, &case.coefficients, |list| {
            let coefficients = list.to_vec();
            StartCase {
                coefficients,
                ..case.clone()
            }
            .loss()
        });
    }
}
