//! The gradients of schedule paper are equal bits on any number of threads.

use glimpse_core::model::ModelKind;
use glimpse_kernels::ModelKernels;
use glimpse_training::outer::{OuterStep, Values};
use glimpse_training::paper::descent::DescentObjective;
use glimpse_training::paper::objective::{InnerSamples, LossSamples, PaperObjective};
use glimpse_training::streams::RandomStreams;

use crate::support::{assert_independent_of_threads, bits, pool, procedural};

fn gradient(kernels: &'static ModelKernels, inner: InnerSamples) -> Vec<u32> {
    let pool = pool(procedural(12, 3), 1024, 5);
    let streams = RandomStreams { seed: 11 };
    let objective = DescentObjective {
        kernels,
        training: &pool,
        validation: &pool,
        pretrained: None,
        inner_steps: 10,
        streams,
    };
    let values = Values {
        pattern: streams.initial_pattern(0, 8),
        ..objective.initial_values()
    };
    let outer_step = OuterStep {
        phase_index: 0,
        step: 1,
        batch: 9,
    };
    let samples = LossSamples { inner, outer: 64 };
    let (loss, gradient) = objective.gradient(&values, outer_step, samples);
    let mut bits = bits(&gradient);
    bits.push(loss.to_bits());
    bits.push(objective.expected_loss(&values).loss.to_bits());
    bits
}

#[test]
fn gradient_is_independent_of_threads() {
    for model in [ModelKind::Phong, ModelKind::CookTorrance, ModelKind::Neural] {
        let kernels = ModelKernels::of(model).expect("the model has parameters");
        for inner in [
            InnerSamples::Pattern,
            InnerSamples::Fresh(24),
            // Long enough to be split among threads.
            InnerSamples::Fresh(600),
        ] {
            let name = format!("{model}, {inner:?}");
            let bits = assert_independent_of_threads(&name, || gradient(kernels, inner));
            assert!(bits.iter().all(|bits| f32::from_bits(*bits).is_finite()));
            assert!(bits.iter().any(|bits| f32::from_bits(*bits) != 0.0));
        }
    }
}
