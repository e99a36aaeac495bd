//! The coefficient net of a batch of materials on lanes, with missing readings, against core's net of one material.
//! Core's own tests compare that with a reference.

use glimpse_core::fit::coefficient_net::{CoefficientNet, Input, Plain};
use glimpse_kernels::completion::{Batch, CompletionWeights, Shape, complete, split_lists};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SHAPE: Shape = Shape {
    samples: 5,
    components: 4,
    hidden: 3,
    units: 0,
    parameters: 0,
};

#[test]
fn batches_match_single_materials() {
    let random = &mut ChaCha8Rng::seed_from_u64(2);
    let lengths = SHAPE.coefficient_net_lengths();
    let weights: Vec<f32> = (0..lengths.iter().sum())
        .map(|_| random.random_range(-0.5..0.5))
        .collect();
    let [readings, bias, output] = split_lists(&weights, lengths);
    let net: CoefficientNet<'_, f32, Plain> = CoefficientNet {
        components: SHAPE.components,
        readings,
        scales: &[],
        bias,
        output,
        output_scales: &[],
    };
    // More materials than a register has lanes, and not a multiple of them.
    let materials: Vec<Vec<Option<[f32; 3]>>> = (0..27)
        .map(|_| {
            let mut reading = || {
                random
                    .random_bool(0.7)
                    .then(|| [(); 3].map(|()| random.random_range(-1.0..1.0)))
            };
            (0..SHAPE.samples).map(|_| reading()).collect()
        })
        .collect();
    let mut batch = Batch::new(SHAPE, materials.len());
    for (material, readings) in materials.iter().enumerate() {
        for (sample, reading) in readings.iter().enumerate() {
            batch.set_reading(material, sample, *reading);
        }
    }
    complete(
        &mut batch,
        &CompletionWeights {
            shape: SHAPE,
            coefficient_net: &weights,
            start_net: &[],
        },
    );
    for (material, readings) in materials.iter().enumerate() {
        let inputs = readings.iter().map(|reading| Input {
            channels: reading.unwrap_or_default(),
            missing: if reading.is_some() { 0.0 } else { 1.0 },
        });
        let mut state = vec![0.0; 4 * SHAPE.rows()];
        net.compute(&inputs.collect::<Vec<_>>(), &mut state);
        let expected = net.coefficients(&state).concat();
        for (actual, expected) in batch.coefficients(material).iter().zip(expected) {
            assert!((actual - expected).abs() < 1e-6, "{actual} {expected}");
        }
    }
}
