//! Training gives the same bits on any number of threads.

use std::marker::PhantomData;

use glimpse_core::model::{CookTorrance, Neural, Phong};
use glimpse_trainer::material::{Material, Procedural};
use glimpse_trainer::meta::gradient::LaneModel;
use glimpse_trainer::meta::parameters::{Groups, Optimization};
use glimpse_trainer::meta::pattern::logits_of;
use glimpse_trainer::meta::pool::Pool;
use glimpse_trainer::meta::start::first_guess;
use glimpse_trainer::meta::training::{InnerSamples, Phase, Start, StepSizeForm, Tasks, Training};
use glimpse_trainer::sampling::sobol_valid;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

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
    let phases = [Phase {
        name: "test",
        start: Start::Previous,
        steps: STEPS,
        batch: 9,
        inner,
        outer: 64,
        rates: Groups {
            initial: 1e-3,
            step_sizes: 1e-2,
            pattern: 1e-2,
        },
        final_rate: 0.2,
        warm_up: 2,
        gain: Some(1.5),
    }];
    let form = StepSizeForm::Logarithm;
    let initial = first_guess(M::KIND, &mut ChaCha8Rng::seed_from_u64(7));
    let pattern = sobol_valid(8, 1).into_iter().flat_map(logits_of).collect();
    let mut training = Training::<M> {
        tasks: &tasks,
        phases: &phases,
        inner_steps: 10,
        seed: 11,
        step_size_form: form,
        optimization: Optimization::new(Groups {
            initial,
            step_sizes: vec![form.value(0.02); M::PARAMETERS],
            pattern,
        }),
        model: PhantomData,
    };
    let mut bits: Vec<u32> = (0..STEPS)
        .map(|step| training.step(0, step).to_bits())
        .collect();
    let values = training.optimization.values();
    bits.extend(
        values
            .each()
            .into_iter()
            .flatten()
            .map(|value| value.to_bits()),
    );
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
