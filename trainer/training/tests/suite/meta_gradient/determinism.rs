//! The gradients of schedule paper are equal bits on any number of threads.

use std::marker::PhantomData;

use glimpse_core::model::{CookTorrance, Neural, Phong};
use glimpse_kernels::LaneModel;
use glimpse_training::meta::descent::DescentObjective;
use glimpse_training::meta::objective::{InnerSamples, LossSamples, PaperObjective, RandomStreams};
use glimpse_training::meta::phase::{OuterStep, Values};

use crate::support::{assert_independent_of_threads, bits, pool, procedural};

fn gradient<M: LaneModel>(inner: InnerSamples) -> Vec<u32> {
    let pool = pool(procedural(12, 3), 1024, 5);
    let streams = RandomStreams { seed: 11 };
    let objective = DescentObjective::<M> {
        training: &pool,
        validation: &pool,
        pretrained: None,
        inner_steps: 10,
        streams,
        model: PhantomData,
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

fn assert_gradient_is_independent_of_threads<M: LaneModel>() {
    for inner in [
        InnerSamples::Pattern,
        InnerSamples::Fresh(24),
        // Long enough to be split among threads.
        InnerSamples::Fresh(600),
    ] {
        let bits = assert_independent_of_threads(&format!("{inner:?}"), || gradient::<M>(inner));
        assert!(bits.iter().all(|bits| f32::from_bits(*bits).is_finite()));
        assert!(bits.iter().any(|bits| f32::from_bits(*bits) != 0.0));
    }
}

#[test]
fn gradient_is_independent_of_threads() {
    assert_gradient_is_independent_of_threads::<Phong>();
    assert_gradient_is_independent_of_threads::<CookTorrance>();
    assert_gradient_is_independent_of_threads::<Neural>();
}
