//! Training gives equal bits on any number of threads.

use std::marker::PhantomData;

use glimpse_core::model::{CookTorrance, Neural, Phong};
use glimpse_kernels::LaneModel;
use glimpse_optimizer::Groups;
use glimpse_training::meta::descent::{DescentObjective, TaskSet};
use glimpse_training::meta::initialization::initial_guess;
use glimpse_training::meta::objective::RandomStreams;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::outer::OuterLoop;
use glimpse_training::meta::phase::{
    AddedSamples, Initialization, InnerSamples, Phase, SearchMethod, Selection, StepSizeEncoding,
};
use glimpse_training::meta::plan::{Effort, LossWeights, Plan, Schedule};
use glimpse_training::meta::pool::Pool;

use crate::support::{assert_independent_of_threads, procedural, run_bits};

const STEPS: usize = 5;

/// Returns the bits of each step's loss and of the learned values.
fn train<M: LaneModel>(inner_samples: InnerSamples) -> Vec<u32> {
    let materials = procedural(12, 3);
    let tasks = TaskSet {
        pool: Pool::new(&materials, 1024, 5),
        materials: &materials,
    };
    let phase = Phase {
        name: "test",
        initialization: Initialization::Previous,
        search: SearchMethod::Gradient,
        selection: Selection::BestValidation,
        samples: 8,
        added_samples: AddedSamples::Sobol,
        samples_ordered: false,
        steps: STEPS,
        batch: 9,
        inner_samples,
        outer_samples: 64,
        rates: Groups {
            initial: 1e-3,
            hyperparameters: 1e-2,
            pattern: 1e-2,
            ..Groups::default()
        },
        final_rate_ratio: 0.2,
        warm_up_steps: 2,
        max_gradient_norm: 1.0,
        weight_decay: 0.0,
        augmentation_gain: Some(1.5),
    };
    let plan = Plan {
        phases: vec![phase],
        tasks: materials.len(),
        initial_parameters: initial_guess,
        step_size_encoding: StepSizeEncoding::Logarithm,
        initial_step_size: 0.02,
        loss_weights: LossWeights::Relative,
        pretrained: None,
    };
    let objective = DescentObjective::<M> {
        training: &tasks,
        validation: &tasks,
        plan: &plan,
        inner_steps: 10,
        streams: RandomStreams { seed: 11 },
        model: PhantomData,
    };
    let run = OuterLoop {
        objective: &objective,
        plan: &plan,
        identity: Options::new(M::KIND, 8, Schedule::Joint, Effort::Brief, 11).identity(&[]),
        seed: 11,
        checkpoints: None,
        stage: 0,
    };
    run_bits(&run)
}

fn assert_training_is_independent_of_threads<M: LaneModel>() {
    for inner in [
        InnerSamples::Pattern,
        InnerSamples::Fresh(20),
        // Long enough to be split among threads.
        InnerSamples::Fresh(600),
        InnerSamples::Fixed(8),
    ] {
        let bits = assert_independent_of_threads(&format!("{inner:?}"), || train::<M>(inner));
        let losses = bits[..STEPS].iter().copied().map(f32::from_bits);
        for loss in losses {
            assert!(loss > 0.0 && loss.is_finite(), "{inner:?}: {loss}");
        }
    }
}

#[test]
fn phong_training_is_independent_of_threads() {
    assert_training_is_independent_of_threads::<Phong>();
}

#[test]
fn cook_torrance_training_is_independent_of_threads() {
    assert_training_is_independent_of_threads::<CookTorrance>();
}

#[test]
fn neural_training_is_independent_of_threads() {
    assert_training_is_independent_of_threads::<Neural>();
}
