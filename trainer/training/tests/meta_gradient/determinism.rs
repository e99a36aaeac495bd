//! Training gives the same bits on any number of threads.

use std::marker::PhantomData;
use std::ops::ControlFlow;

use glimpse_core::model::{CookTorrance, Neural, Phong};
use glimpse_kernels::LaneModel;
use glimpse_materials::{Material, Procedural};
use glimpse_optimizer::Groups;
use glimpse_training::meta::descent::{DescentTrainee, Tasks};
use glimpse_training::meta::options::Options;
use glimpse_training::meta::outer::{Outcome, Run};
use glimpse_training::meta::phase::{
    Added, InnerSamples, Keep, Phase, Search, Start, StepSizeForm,
};
use glimpse_training::meta::plan::{Effort, Plan, Schedule, Weighing};
use glimpse_training::meta::pool::Pool;
use glimpse_training::meta::start::first_guess;
use glimpse_training::meta::trainee::RandomStreams;

const STEPS: usize = 5;

/// The bits of each step's loss, and of what is learned in the end.
fn train<M: LaneModel>(inner: InnerSamples) -> Vec<u32> {
    let materials: Vec<Box<dyn Material>> = Procedural::set(12, 3)
        .into_iter()
        .map(|material| Box::new(material) as Box<dyn Material>)
        .collect();
    let tasks = Tasks {
        pool: Pool::new(&materials, 1024, 5),
        materials: &materials,
    };
    let phase = Phase {
        name: "test",
        start: Start::Previous,
        search: Search::Gradient,
        keep: Keep::BestValidation,
        samples: 8,
        added: Added::Sobol,
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
        weighing: Weighing::Relative,
        known: None,
    };
    let trainee = DescentTrainee::<M> {
        training: &tasks,
        validation: &tasks,
        plan: &plan,
        inner_steps: 10,
        streams: RandomStreams { seed: 11 },
        model: PhantomData,
    };
    let run = Run {
        trainee: &trainee,
        plan: &plan,
        identity: Options::new(M::KIND, 8, Schedule::Joint, Effort::Brief, 11).identity(&[]),
        seed: 11,
        checkpoints: None,
        stage: 0,
    };
    let mut bits = Vec::new();
    let outcome = run.finish(&mut |progress| {
        bits.push(progress.loss.to_bits());
        ControlFlow::Continue(())
    });
    let Outcome { expected, values } = outcome.expect("nothing stops it");
    bits.push(expected.loss.to_bits());
    let values = values.each().into_iter().flatten();
    bits.extend(values.map(|value| value.to_bits()));
    bits
}

fn same_on_any_number_of_threads<M: LaneModel>() {
    for inner in [
        InnerSamples::Pattern,
        InnerSamples::Fresh(20),
        // So many that threads share one list.
        InnerSamples::Fresh(600),
        InnerSamples::Random(8),
    ] {
        let outcomes = [1, 2, 7].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads start").install(|| train::<M>(inner))
        });
        let losses: Vec<f32> = outcomes[0][..STEPS]
            .iter()
            .copied()
            .map(f32::from_bits)
            .collect();
        assert!(
            losses.iter().all(|loss| *loss > 0.0 && loss.is_finite()),
            "{losses:?}"
        );
        assert_eq!(
            outcomes[0], outcomes[1],
            "{inner:?} on one thread and on two"
        );
        assert_eq!(
            outcomes[0], outcomes[2],
            "{inner:?} on one thread and on seven"
        );
    }
}

#[test]
fn phong_trains_the_same_on_any_number_of_threads() {
    same_on_any_number_of_threads::<Phong>();
}

#[test]
fn cook_torrance_trains_the_same_on_any_number_of_threads() {
    same_on_any_number_of_threads::<CookTorrance>();
}

#[test]
fn neural_trains_the_same_on_any_number_of_threads() {
    same_on_any_number_of_threads::<Neural>();
}
