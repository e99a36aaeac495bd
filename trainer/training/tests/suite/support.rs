//! Helpers shared by several tests: materials, conversions and runs.

use std::fmt::Debug;
use std::ops::ControlFlow;

use glimpse_core::model::{Model, Neural};
use glimpse_gradcheck::parameters;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Material, NeuralBrdf, Source};
use glimpse_training::outer::{MetaValues, StepObserver};
use glimpse_training::run::TrainError;
use glimpse_training::tasks::pool::WarpedPool;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Returns materials of the built-in set.
pub(crate) fn procedural(count: usize, seed: u64) -> Vec<Box<dyn Material>> {
    let source = Source(format!("procedural:{count}:{seed}"));
    source.load().expect("the source is valid")
}

/// Returns a network with random weights. Most of its outputs are positive.
pub(crate) fn network(random: &mut ChaCha8Rng) -> NeuralBrdf {
    let list = (0..Neural::PARAMETERS).map(|_| random.random_range(-0.3..0.4f32));
    NeuralBrdf::new("network".to_owned(), parameters(list, 0.0))
}

/// Converts numbers to double precision.
pub(crate) fn to_f64(list: &[f32]) -> Vec<f64> {
    list.iter().copied().map(f64::from).collect()
}

/// Returns materials at `size` uniform directions.
pub(crate) fn pool(materials: Vec<Box<dyn Material>>, size: usize, seed: u64) -> WarpedPool {
    WarpedPool::new(materials.into(), 0, uniform_valid(size, seed))
}

/// Returns the bits of all numbers.
pub(crate) fn bits(values: &MetaValues) -> Vec<u32> {
    let numbers = values.each().into_iter().flatten();
    numbers.map(|number| number.to_bits()).collect()
}

/// Asserts that the slope of a loss along each group of its gradient is the squared norm of that group. Returns the
/// number of groups with a gradient.
pub(crate) fn assert_gradient_matches_loss(
    name: &str,
    values: &MetaValues,
    gradient: impl Fn(&MetaValues) -> (f32, MetaValues),
) -> usize {
    /// The largest change of a value. Gauss-Newton steps have a large curvature; changes of 1e-4 are lost in single
    /// precision.
    const CHANGE: f64 = 5e-4;
    let (loss, by_values) = gradient(values);
    assert!(loss > 0.0 && loss.is_finite());
    let mut compared = 0;
    for (group, direction) in by_values.each().into_iter().enumerate() {
        let numbers = || direction.iter().map(|entry| f64::from(*entry));
        let square: f64 = numbers().map(|entry| entry * entry).sum();
        if square == 0.0 {
            continue;
        }
        let largest = numbers().fold(0.0_f64, |max, entry| max.max(entry.abs()));
        let step = (0.6 * CHANGE * f64::from(loss) / square).min(CHANGE / largest);
        let loss_at = |sign: f64| {
            let mut values = values.clone();
            for (value, entry) in values.each_mut()[group].iter_mut().zip(direction) {
                *value += (sign * step * f64::from(*entry)) as f32;
            }
            f64::from(gradient(&values).0)
        };
        let slope = (loss_at(1.0) - loss_at(-1.0)) / (2.0 * step);
        let error = (slope - square).abs() / square;
        assert!(error < 0.015, "{name}, group {group}: {slope} and {square}");
        compared += 1;
    }
    compared
}

/// Returns the bits of each step's loss, and of the learned values.
pub(crate) fn run_bits(
    run: impl FnOnce(&mut StepObserver<'_>) -> Result<MetaValues, TrainError>,
) -> Vec<u32> {
    let mut all = Vec::new();
    let values = run(&mut |progress| {
        all.push(progress.loss.to_bits());
        ControlFlow::Continue(())
    });
    all.extend(bits(&values.expect("the run is not stopped")));
    all
}

/// Runs `work` on one, two and seven threads, asserts equal results, and returns the result.
pub(crate) fn assert_independent_of_threads<T: Debug + PartialEq + Send>(
    name: &str,
    work: impl Fn() -> T + Sync,
) -> T {
    let [one, two, seven] = [1, 2, 7].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads start").install(&work)
    });
    assert_eq!(one, two, "{name} on one thread and on two");
    assert_eq!(one, seven, "{name} on one thread and on seven");
    one
}
