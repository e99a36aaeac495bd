//! Helpers shared by several tests: materials, conversions and runs.

use std::fmt::Debug;
use std::ops::ControlFlow;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_gradcheck::parameters;
use glimpse_kernels::Dual;
use glimpse_materials::basis::{AngleDual, Basis};
use glimpse_materials::{Material, NeuralBrdf, Procedural};
use glimpse_training::linear::ReducedBasis;
use glimpse_training::meta::linear::{OuterSamples, TaskGradient};
use glimpse_training::meta::outer::{Outcome, OuterLoop};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Returns materials of the built-in set.
pub(crate) fn procedural(count: usize, seed: u64) -> Vec<Box<dyn Material>> {
    boxed(Procedural::set(count, seed))
}

pub(crate) fn boxed<M: Material + 'static>(list: Vec<M>) -> Vec<Box<dyn Material>> {
    let list = list.into_iter();
    list.map(|material| Box::new(material) as Box<dyn Material>)
        .collect()
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

pub(crate) fn angles_from_array([theta_h, theta_d, phi_d]: [f64; 3]) -> Angles<f64> {
    Angles {
        theta_h,
        theta_d,
        phi_d,
    }
}

/// Returns the gradient of the loss of the model Linear for one material, a network. Its readings are computed in
/// double precision.
pub(crate) fn task_gradient(
    network: &NeuralBrdf,
    basis: &Basis,
    pattern: &[Angles<f64>],
    prior_precisions: &[f64],
    outer: &OuterSamples<'_>,
) -> TaskGradient {
    let reduced = ReducedBasis::new(basis, pattern);
    let factors = reduced.factorize(prior_precisions);
    let weights = network.parameters().iter();
    let weights = weights.map(|weight| Dual::from_value(f64::from(*weight)));
    let weights: NeuralParameters<Dual<f64, 3>> = parameters(weights, Dual::from_value(0.0));
    let measure = |angles: &Angles<f64>| -> [AngleDual; 3] {
        let at = HalfDifference::from_angles(Dual::variables(*angles));
        Neural::brdf::<Dual<f64, 3>>(&weights, &at)
    };
    let measured: Vec<[AngleDual; 3]> = pattern.iter().map(measure).collect();
    let inputs = (prior_precisions, &factors[..]);
    TaskGradient::new(&reduced, inputs, &measured, outer)
}

/// Returns the bits of each step's loss, of the expected loss, and of the learned values.
pub(crate) fn run_bits(run: &OuterLoop<'_>) -> Vec<u32> {
    let mut bits = Vec::new();
    let outcome = run.run(&mut |progress| {
        bits.push(progress.loss.to_bits());
        ControlFlow::Continue(())
    });
    let Outcome {
        expected_loss,
        values,
    } = outcome.expect("the run is not stopped");
    bits.push(expected_loss.loss.to_bits());
    let values = values.each().into_iter().flatten();
    bits.extend(values.map(|value| value.to_bits()));
    bits
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
