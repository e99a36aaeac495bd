//! Tests of materials: look-ups, derivatives, files, and error messages for damaged files.

#[path = "../../../program/tests/suite/common.rs"]
mod common;
mod damaged;
mod fitted;
mod folder;
mod formats;
mod merl;
mod pab;
mod rgl;
mod sources;

use glimpse_core::geometry::Angles;
use glimpse_core::model::{Neural, NeuralParameters, ParameterSet};
use glimpse_materials::{Brdf, BrdfWithDerivative, Material, NeuralBrdf};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Returns a network with random weights. Its outputs are positive at nearly all directions.
fn network(seed: u64) -> NeuralBrdf {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut weights = NeuralParameters::filled(0.0);
    let scales = [0.8, 0.3, 0.4, 0.3, 0.4, 0.4]
        .into_iter()
        .zip(Neural::LAYERS);
    let scales = scales.flat_map(|(scale, length)| std::iter::repeat_n(scale, length));
    for (weight, scale) in weights.iter_mut().zip(scales) {
        *weight = scale * random.random_range(-1.0..1.0_f32);
    }
    weights[672..].iter_mut().for_each(|bias| *bias += 1.0);
    NeuralBrdf::new(format!("network-{seed}"), weights)
}

/// A material given by a function.
struct FunctionMaterial<F>(F);

impl<F: Fn(Angles<f32>) -> [f32; 3] + Send + Sync> Brdf for FunctionMaterial<F> {
    fn at_angles(&self, angles: Angles<f32>) -> [f32; 3] {
        self.0(angles)
    }
}

impl<F: Fn(Angles<f32>) -> [f32; 3] + Send + Sync> Material for FunctionMaterial<F> {
    fn name(&self) -> &str {
        "function"
    }
}

/// Returns the BRDF and its derivatives at angles.
fn with_derivative(material: &dyn Material, angles: Angles<f32>) -> BrdfWithDerivative {
    material.with_derivatives(&[angles])[0]
}

/// Converts angles in radians from f64.
fn angles(radians: [f64; 3]) -> Angles<f32> {
    Angles::from_array(radians).map(|angle| angle as f32)
}
