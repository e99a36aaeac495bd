//! The outcome of core's forward pass and adjoint in double precision, one material after the other, and that of the
//! trainer's batches on lanes.

use glimpse_core::fit::coefficient_net::{
    CoefficientNet, CoefficientNetGradient, Input, Plain, StartNet, StartNetGradient,
};
use glimpse_core::model::linear::map;
use glimpse_core::numeric::Scalar;
use glimpse_kernels::Dual;
use glimpse_kernels::completion::{Batch, CompletionWeights};

use super::Outcome;
use super::case::Case;
use crate::support::to_f64;

/// Returns a standardized reading, or None if it is missing.
fn standardized_reading<S: Scalar>(case: &Case, material: usize, sample: usize) -> Option<[S; 3]> {
    let reading = case.readings[material * case.shape.samples + sample]?;
    let [weight, center, scale] = [
        case.cosine_products[sample],
        case.center[sample],
        case.scale,
    ]
    .map(S::constant);
    Some(reading.map(|value| (map(S::constant(value), weight) - center) * scale))
}

fn inputs(case: &Case, material: usize) -> Vec<Input<f64>> {
    let inputs = (0..case.shape.samples).map(|sample| {
        let reading = standardized_reading(case, material, sample);
        Input {
            missing: f64::from(u8::from(reading.is_none())),
            channels: reading.unwrap_or_default(),
        }
    });
    inputs.collect()
}

/// Converts derivatives with respect to the standardized readings to derivatives with respect to the readings of each
/// channel.
fn by_readings(case: &Case, by_inputs: &[[f64; 3]]) -> [Vec<f64>; 3] {
    let mut by_readings = [const { Vec::new() }; 3];
    for (index, by_input) in by_inputs.iter().enumerate() {
        let sample = index % case.shape.samples;
        let [weight, center, scale] = [
            case.cosine_products[sample],
            case.center[sample],
            case.scale,
        ]
        .map(Dual::from_value);
        let reading = case.readings[index].unwrap_or_default();
        for ((value, by_input), by_reading) in reading.iter().zip(by_input).zip(&mut by_readings) {
            let value = Dual {
                value: *value,
                tangent: [1.0],
            };
            let standardized: Dual<f64, 1> = (map(value, weight) - center) * scale;
            by_reading.push(by_input * standardized.tangent[0]);
        }
    }
    by_readings
}

/// Computes the outcome with core, one material after the other.
pub(super) fn core(case: &Case) -> Outcome {
    let shape = case.shape;
    let zeros = |length: usize| vec![0.0; length];
    let weights = &case.weights;
    let mut by_weights = case.weights.each_ref().map(|list| zeros(list.len()));
    let coefficient_net = CoefficientNet::<f64, Plain> {
        components: shape.components,
        readings: &weights[0],
        scales: &[],
        bias: &weights[1],
        output: &weights[2],
        output_scales: &[],
    };
    let start_net = StartNet::<f64, Plain> {
        hidden: &weights[3],
        hidden_scales: &[],
        bias: &weights[4],
        output: &weights[5],
        output_scales: &[],
    };
    let (rows, m) = (shape.rows(), shape.components);
    let (mut all_coefficients, mut initial, mut by_inputs) = (Vec::new(), Vec::new(), Vec::new());
    for material in 0..case.materials {
        let inputs = inputs(case, material);
        let mut state = zeros(coefficient_net.words());
        coefficient_net.compute(&inputs, &mut state);
        let coefficients = coefficient_net.coefficients(&state);
        let score_weights = &case.coefficient_score_weights[material * 3 * m..][..3 * m];
        let score_weights = score_weights.chunks_exact(m);
        let mut by_state = zeros(coefficient_net.words());
        let channels = by_state
            .chunks_mut(rows)
            .zip(coefficients)
            .zip(score_weights);
        for ((by_values, values), weights) in channels {
            for ((by_value, value), weight) in by_values.iter_mut().zip(values).zip(weights) {
                *by_value = weight * value;
            }
        }
        all_coefficients.extend(coefficients.concat());

        let [readings, bias, output, start_net_gradient @ ..] = &mut by_weights;
        if shape.units > 0 {
            let mut units = zeros(shape.units);
            start_net.activate(coefficients, &mut units);
            let mut by_parameters = Vec::new();
            for (parameter, value) in case.initial.iter().enumerate() {
                let value = value + start_net.offset(parameter, &units);
                let weight = case.initial_score_weights[material * shape.parameters + parameter];
                by_parameters.push(weight * value);
                initial.push(value);
            }
            let [hidden, bias, output] = start_net_gradient;
            let (red, rest) = by_state.split_at_mut(rows);
            let (green, blue) = rest.split_at_mut(rows);
            start_net.adjoint(
                coefficients,
                &units,
                &by_parameters,
                &mut zeros(shape.units),
                &mut StartNetGradient {
                    hidden,
                    bias,
                    output,
                },
                [red, green, blue].map(|list| &mut list[..m]),
            );
        }
        let mut by_material_inputs = vec![[0.0; 3]; shape.samples];
        coefficient_net.adjoint(
            &inputs,
            &state,
            &mut by_state,
            &mut CoefficientNetGradient {
                readings,
                bias,
                output,
            },
            &mut by_material_inputs,
        );
        by_inputs.extend(by_material_inputs);
    }
    Outcome {
        coefficients: all_coefficients,
        initial,
        by_weights,
        by_readings: case.by_logarithms(&by_readings(case, &by_inputs)),
    }
}

/// Computes the outcome with the trainer's batches on lanes.
pub(super) fn lanes(case: &Case) -> Outcome {
    let shape = case.shape;
    let to_f32 = |lists: &[Vec<f64>]| -> Vec<f32> {
        let numbers = lists.iter().flatten();
        numbers.map(|number| *number as f32).collect()
    };
    let (coefficient_net, start_net) = case.weights.split_at(3);
    let (coefficient_net, start_net) = (to_f32(coefficient_net), to_f32(start_net));
    let weights = CompletionWeights {
        shape,
        coefficient_net: &coefficient_net,
        start_net: &start_net,
    };
    let mut batch = Batch::new(shape, case.materials);
    for material in 0..case.materials {
        for sample in 0..shape.samples {
            batch.set_reading(
                material,
                sample,
                standardized_reading(case, material, sample),
            );
        }
    }
    batch.complete(&weights);
    batch.activate(&weights);
    let (mut coefficients, mut initial) = (Vec::new(), Vec::new());
    for material in 0..case.materials {
        let values = batch.coefficients(material);
        let score_weights = &case.coefficient_score_weights[material * values.len()..];
        let by_coefficients: Vec<f32> = values
            .iter()
            .zip(score_weights)
            .map(|(value, weight)| value * *weight as f32)
            .collect();
        batch.set_coefficient_gradient(material, &by_coefficients);
        coefficients.extend(values);

        let offsets = batch.offsets(material);
        let values: Vec<f32> = offsets
            .iter()
            .zip(&case.initial)
            .map(|(offset, initial)| *initial as f32 + offset)
            .collect();
        let score_weights = &case.initial_score_weights[material * shape.parameters..];
        let terms = values.iter().zip(score_weights);
        let by_offsets = terms.map(|(value, weight)| value * *weight as f32);
        batch.set_offset_gradient(material, by_offsets);
        initial.extend(values);
    }
    let mut by_coefficient_net = vec![0.0; coefficient_net.len()];
    let mut by_start_net = vec![0.0; start_net.len()];
    batch.start_net_adjoint(&weights, &mut by_start_net);
    batch.adjoint(&weights, &mut by_coefficient_net);

    let (by_coefficient_net, by_start_net) = (to_f64(&by_coefficient_net), to_f64(&by_start_net));
    let mut flat = by_coefficient_net.iter().chain(&by_start_net).copied();
    let lengths = case.weights.each_ref().map(Vec::len);
    let by_weights = lengths.map(|length| flat.by_ref().take(length).collect());
    let mut by_inputs = Vec::new();
    for material in 0..case.materials {
        for sample in 0..shape.samples {
            by_inputs.push(batch.by_reading(material, sample).map(f64::from));
        }
    }
    Outcome {
        coefficients: to_f64(&coefficients),
        initial: to_f64(&initial),
        by_weights,
        by_readings: case.by_logarithms(&by_readings(case, &by_inputs)),
    }
}
