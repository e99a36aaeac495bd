//! The same of the code under test: of core's forward pass and adjoint, material by material in either
//! precision, and of the trainer's batches, on lanes.

use glimpse_core::fit::coefficient_net::{
    CoefficientNet, CoefficientNetGradient, InitNet, InitNetGradient, Input, Plain, standardized,
};
use glimpse_core::numeric::Scalar;
use glimpse_kernels::Dual;
use glimpse_kernels::completion::{Batch, CompletionWeights};

use super::Outcome;
use super::case::Case;

/// A reading as it enters, or none.
fn entering<S: Scalar>(case: &Case, material: usize, sample: usize) -> Option<[S; 3]> {
    let reading = case.readings[material * case.size.samples + sample]?;
    let [weight, center, scale] =
        [case.cosines[sample], case.center[sample], case.scale].map(S::constant);
    Some(reading.map(|value| standardized(S::constant(value), weight, center, scale)))
}

fn inputs<S: Scalar>(case: &Case, material: usize) -> Vec<Input<S>> {
    let inputs = (0..case.size.samples).map(|sample| {
        let entering = entering(case, material, sample);
        Input {
            missing: S::constant(if entering.is_none() { 1.0 } else { 0.0 }),
            channels: entering.unwrap_or([S::constant(0.0); 3]),
        }
    });
    inputs.collect()
}

/// From slopes by what enters to those by the readings of each channel.
fn by_readings(case: &Case, by_inputs: &[[f64; 3]]) -> [Vec<f64>; 3] {
    let mut slopes = [const { Vec::new() }; 3];
    for (place, by_input) in by_inputs.iter().enumerate() {
        let sample = place % case.size.samples;
        let [weight, center, scale] =
            [case.cosines[sample], case.center[sample], case.scale].map(Dual::from_value);
        let reading = case.readings[place].unwrap_or_default();
        for ((value, by_input), slopes) in reading.iter().zip(by_input).zip(&mut slopes) {
            let value = Dual {
                value: *value,
                tangent: [1.0],
            };
            let entering: Dual<f64, 1> = standardized(value, weight, center, scale);
            slopes.push(by_input * entering.tangent[0]);
        }
    }
    slopes
}

fn wide<S: Scalar + Into<f64>>(list: &[S]) -> Vec<f64> {
    list.iter().map(|number| (*number).into()).collect()
}

/// Core's, one material after the other.
pub(super) fn one_by_one<S>(case: &Case) -> Outcome
where
    S: Scalar<Parameter = S, Sum = S> + Into<f64>,
{
    let size = case.size;
    let constants = |list: &Vec<f64>| -> Vec<S> { list.iter().copied().map(S::constant).collect() };
    let zeros = |length: usize| vec![S::constant(0.0); length];
    let weights = case.weights.each_ref().map(constants);
    let mut by_weights = case.weights.each_ref().map(|list| zeros(list.len()));
    let completion = CoefficientNet::<S, Plain> {
        components: size.components,
        readings: &weights[0],
        scales: &[],
        bias: &weights[1],
        output: &weights[2],
        output_scales: &[],
    };
    let start = InitNet::<S, Plain> {
        hidden: &weights[3],
        hidden_scales: &[],
        bias: &weights[4],
        output: &weights[5],
        output_scales: &[],
    };
    let (rows, m) = (size.rows(), size.components);
    let (mut all, mut initial, mut by_inputs) = (Vec::new(), Vec::new(), Vec::new());
    for material in 0..case.materials {
        let inputs = inputs::<S>(case, material);
        let mut state = zeros(completion.words());
        completion.compute(&inputs, &mut state);
        let coefficients = completion.coefficients(&state);
        let scores = case.by_coefficients.chunks_exact(3 * m).nth(material);
        let scores = scores.expect("each material has its own").chunks_exact(m);
        let mut by_state = zeros(completion.words());
        for ((by, values), scores) in by_state.chunks_mut(rows).zip(coefficients).zip(scores) {
            for ((by, value), score) in by.iter_mut().zip(values).zip(scores) {
                *by = S::constant(*score) * *value;
            }
        }
        all.extend(coefficients.concat());

        let [readings, bias, output, of_start @ ..] = &mut by_weights;
        if size.units > 0 {
            let mut units = zeros(size.units);
            start.activate(coefficients, &mut units);
            let mut by_parameters = Vec::new();
            for (parameter, value) in case.initial.iter().enumerate() {
                let value = S::constant(*value) + start.offset(parameter, &units);
                let score = case.by_initial[material * size.parameters + parameter];
                by_parameters.push(S::constant(score) * value);
                initial.push(value);
            }
            let [hidden, bias, output] = of_start;
            let (red, rest) = by_state.split_at_mut(rows);
            let (green, blue) = rest.split_at_mut(rows);
            start.adjoint(
                coefficients,
                &units,
                &by_parameters,
                &mut zeros(size.units),
                &mut InitNetGradient {
                    hidden,
                    bias,
                    output,
                },
                [red, green, blue].map(|list| &mut list[..m]),
            );
        }
        let mut by_channels = vec![[S::constant(0.0); 3]; size.samples];
        completion.adjoint(
            &inputs,
            &state,
            &mut by_state,
            &mut CoefficientNetGradient {
                readings,
                bias,
                output,
            },
            &mut by_channels,
        );
        by_inputs.extend(by_channels.iter().map(|by| by.map(Into::into)));
    }
    Outcome {
        coefficients: wide(&all),
        initial: wide(&initial),
        by_weights: by_weights.each_ref().map(|list| wide(list)),
        by_readings: case.by_logarithms(&by_readings(case, &by_inputs)),
    }
}

/// The trainer's, many materials at once.
pub(super) fn side_by_side(case: &Case) -> Outcome {
    let size = case.size;
    let narrow = |lists: &[Vec<f64>]| -> Vec<f32> {
        let numbers = lists.iter().flatten();
        numbers.map(|number| *number as f32).collect()
    };
    let (completion_options, starting) = case.weights.split_at(3);
    let (completion_options, starting) = (narrow(completion_options), narrow(starting));
    let weights = CompletionWeights {
        shape: size,
        completion: &completion_options,
        start: &starting,
    };
    let mut batch = Batch::new(size, case.materials);
    for material in 0..case.materials {
        for sample in 0..size.samples {
            batch.set(material, sample, entering(case, material, sample));
        }
    }
    batch.complete(&weights);
    let (mut coefficients, mut initial) = (Vec::new(), Vec::new());
    for material in 0..case.materials {
        let found = batch.coefficients(material);
        let scores = &case.by_coefficients[material * found.len()..];
        let by: Vec<f32> = found
            .iter()
            .zip(scores)
            .map(|(value, score)| value * *score as f32)
            .collect();
        batch.set_gradient(material, &by);
        coefficients.extend(found);

        let offsets = batch.offsets(material);
        let values: Vec<f32> = offsets
            .iter()
            .zip(&case.initial)
            .map(|(offset, initial)| *initial as f32 + offset)
            .collect();
        let scores = &case.by_initial[material * size.parameters..];
        let by = values.iter().zip(scores);
        batch.set_offset_gradient(material, by.map(|(value, score)| value * *score as f32));
        initial.extend(values);
    }
    let mut by_completing = vec![0.0; completion_options.len()];
    let mut by_starting = vec![0.0; starting.len()];
    batch.adjoint(&weights, &mut by_completing, &mut by_starting);

    let (by_completing, by_starting) = (wide(&by_completing), wide(&by_starting));
    let mut flat = by_completing.iter().chain(&by_starting).copied();
    let lengths = case.weights.each_ref().map(Vec::len);
    let by_weights = lengths.map(|length| flat.by_ref().take(length).collect());
    let mut by_inputs = Vec::new();
    for material in 0..case.materials {
        for sample in 0..size.samples {
            by_inputs.push(batch.by_reading(material, sample).map(f64::from));
        }
    }
    Outcome {
        coefficients: wide(&coefficients),
        initial: wide(&initial),
        by_weights,
        by_readings: case.by_logarithms(&by_readings(case, &by_inputs)),
    }
}
