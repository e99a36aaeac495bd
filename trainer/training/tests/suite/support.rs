//! Materials, numbers and runs that several tests share.

use std::fmt::Debug;
use std::ops::ControlFlow;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, Neural, NeuralParameters, ParameterSet};
use glimpse_gradcheck::parameters;
use glimpse_kernels::Dual;
use glimpse_materials::basis::{Basis, ByAngles};
use glimpse_materials::{Material, NeuralBrdf, Procedural};
use glimpse_training::linear::Reduced;
use glimpse_training::meta::linear::{Outer, TaskGradient};
use glimpse_training::meta::outer::{Outcome, Run};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Materials of the built-in set.
pub(crate) fn procedural(count: usize, seed: u64) -> Vec<Box<dyn Material>> {
    boxed(Procedural::set(count, seed))
}

pub(crate) fn boxed<M: Material + 'static>(list: Vec<M>) -> Vec<Box<dyn Material>> {
    let list = list.into_iter();
    list.map(|material| Box::new(material) as Box<dyn Material>)
        .collect()
}

/// A network with random weights, most of whose outputs are on.
pub(crate) fn network(random: &mut ChaCha8Rng) -> NeuralBrdf {
    let list = (0..Neural::PARAMETERS).map(|_| random.random_range(-0.3..0.4f32));
    NeuralBrdf::new("network".to_owned(), parameters(list, 0.0))
}

/// Numbers in double precision.
pub(crate) fn double(list: &[f32]) -> Vec<f64> {
    list.iter().copied().map(f64::from).collect()
}

pub(crate) fn named([theta_h, theta_d, phi_d]: [f64; 3]) -> Angles<f64> {
    Angles {
        theta_h,
        theta_d,
        phi_d,
    }
}

/// The gradient of the model Linear's loss on one network, measured in double precision.
pub(crate) fn task_gradient(
    network: &NeuralBrdf,
    basis: &Basis,
    places: &[Angles<f64>],
    precision: &[f64],
    outer: &Outer<'_>,
) -> TaskGradient {
    let reduced = Reduced::new(basis, places);
    let mut buffer = Vec::new();
    let factors = reduced.factorize(precision, &mut buffer);
    let weights = network.parameters().iter();
    let weights = weights.map(|weight| Dual::from_value(f64::from(*weight)));
    let weights: NeuralParameters<Dual<f64, 3>> = parameters(weights, Dual::from_value(0.0));
    let measure = |angles: &Angles<f64>| -> [ByAngles; 3] {
        let at = HalfDifference::from_angles(Dual::variables(*angles));
        Neural::brdf::<Dual<f64, 3>>(&weights, &at)
    };
    let measured: Vec<[ByAngles; 3]> = places.iter().map(measure).collect();
    let factors = factors.expect("it can be factorized");
    TaskGradient::new(&reduced, &factors, &measured, outer).expect("lengths fit")
}

/// The bits of each step's loss, of the expected loss, and of the values that are learned.
pub(crate) fn bits_of(run: &Run<'_>) -> Vec<u32> {
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

/// Does the same on one thread, on two and on seven, asserts that it comes to the same, and returns it.
pub(crate) fn same_on_any_number_of_threads<T: Debug + PartialEq + Send>(
    what: &str,
    work: impl Fn() -> T + Sync,
) -> T {
    let [one, two, seven] = [1, 2, 7].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads start").install(&work)
    });
    assert_eq!(one, two, "{what} on one thread and on two");
    assert_eq!(one, seven, "{what} on one thread and on seven");
    one
}
