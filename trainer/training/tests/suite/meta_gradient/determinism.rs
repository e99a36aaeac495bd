//! Training gives the same bits on any number of threads.

use std::marker::PhantomData;

use glimpse_core::model::{CookTorrance, Neural, Phong};
use glimpse_kernels::LaneModel;
use glimpse_optimizer::Groups;
use glimpse_training::meta::descent::{DescentObjective, Tasks};
use glimpse_training::meta::objective::RandomStreams;
use glimpse_training::meta::options::Options;
use glimpse_training::meta::outer::Run;
use glimpse_training::meta::phase::{
    AddedSamples, InnerSamples, Phase, SearchMethod, Selection, Start, StepSizeForm,
};
use glimpse_training::meta::plan::{Effort, LossWeights, Plan, Schedule};
use glimpse_training::meta::pool::Pool;
use glimpse_training::meta::start::first_guess;

use crate::support::{bits_of, procedural, same_on_any_number_of_threads};

const STEPS: usize = 5;

/// The bits of each step's loss, and of what is learned in the end.
fn train<M: LaneModel>(inner: InnerSamples) -> Vec<u32> {
    let materials = procedural(12, 3);
    let tasks = Tasks {
        pool: Pool::new(&materials, 1024, 5),
        materials: &materials,
    };
    let phase = Phase {
        name: "test",
        start: Start::Previous,
        search: SearchMethod::Gradient,
        keep: Selection::BestValidation,
        samples: 8,
        added: AddedSamples::Sobol,
        in_order: false,
        steps: STEPS,
        batch: 9,
        inner,
        outer: 64,
        rates: Groups {
            initial: 1e-3,
            hyperparameters: 1e-2,
            pattern: 1e-2,
            ..Groups::default()
        },
        final_rate: 0.2,
        warm_up: 2,
        largest_norm: 1.0,
        weight_decay: 0.0,
        gain: Some(1.5),
    };
    let plan = Plan {
        phases: vec![phase],
        tasks: materials.len(),
        first_guess,
        step_size_form: StepSizeForm::Logarithm,
        first_step_size: 0.02,
        weighing: LossWeights::Relative,
        known: None,
    };
    let objective = DescentObjective::<M> {
        training: &tasks,
        validation: &tasks,
        plan: &plan,
        inner_steps: 10,
        streams: RandomStreams { seed: 11 },
        model: PhantomData,
    };
    let run = Run {
        objective: &objective,
        plan: &plan,
        identity: Options::new(M::KIND, 8, Schedule::Joint, Effort::Brief, 11).identity(&[]),
        seed: 11,
        checkpoints: None,
        stage: 0,
    };
    bits_of(&run)
}

fn trains_the_same_on_any_number_of_threads<M: LaneModel>() {
    for inner in [
        InnerSamples::Pattern,
        InnerSamples::Fresh(20),
        // So many that threads share one list.
        InnerSamples::Fresh(600),
        InnerSamples::Random(8),
    ] {
        let bits = same_on_any_number_of_threads(&format!("{inner:?}"), || train::<M>(inner));
        let losses = bits[..STEPS].iter().copied().map(f32::from_bits);
        for loss in losses {
            assert!(loss > 0.0 && loss.is_finite(), "{inner:?}: {loss}");
        }
    }
}

#[test]
fn phong_trains_the_same_on_any_number_of_threads() {
    trains_the_same_on_any_number_of_threads::<Phong>();
}

#[test]
fn cook_torrance_trains_the_same_on_any_number_of_threads() {
    trains_the_same_on_any_number_of_threads::<CookTorrance>();
}

#[test]
fn neural_trains_the_same_on_any_number_of_threads() {
    trains_the_same_on_any_number_of_threads::<Neural>();
}
