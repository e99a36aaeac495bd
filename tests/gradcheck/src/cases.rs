//! Random samples and parameters.

use std::f64::consts::{FRAC_PI_2, TAU};

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{CookTorrance, Model, Neural, NeuralParameters, Sample};
use glimpse_core::numeric::Scalar;
use proptest::prelude::*;

use super::{Forward, parameters};

/// Variables of a gradient in addition to the parameters: hx, hz, dx, dy, dz, and the reading y in red, green, blue.
pub type Variables = [f64; 8];

/// Generates random samples: uniform angles above the horizon, and measured values over five decades.
pub fn variables() -> impl Strategy<Value = Variables> {
    let angles = (0.0..FRAC_PI_2, 0.0..FRAC_PI_2, 0.0..TAU);
    let logarithms = prop::array::uniform3(-8.0..3.0f64);
    (angles, logarithms)
        .prop_map(|((theta_h, theta_d, phi_d), logarithms)| {
            // Computed here, because core implements `Scalar` for f64 only with the feature libm.
            let ((hx, hz), (sin_d, dz)) = (theta_h.sin_cos(), theta_d.sin_cos());
            let (sin_phi, cos_phi) = phi_d.sin_cos();
            let [red, green, blue] = logarithms.map(f64::exp);
            [
                hx,
                hz,
                sin_d * cos_phi,
                sin_d * sin_phi,
                dz,
                red,
                green,
                blue,
            ]
        })
        .prop_filter("above the horizon", |variables| {
            let [cos_theta_i, cos_theta_o] = cosines(*variables);
            cos_theta_i > 0.0 && cos_theta_o > 0.0
        })
}

/// Returns the cosines of theta_i and theta_o.
fn cosines(variables: Variables) -> [f64; 2] {
    let at = sample(variables.map(Forward::fixed), 0.0).at;
    [at.cos_theta_i().value, at.cos_theta_o().value]
}

/// Returns the sample with these [`Variables`].
pub fn sample<S: Scalar>(variables: [S; 8], weight: f64) -> Sample<S> {
    let [hx, hz, dx, dy, dz, red, green, blue] = variables;
    Sample {
        at: HalfDifference { hx, hz, dx, dy, dz },
        measured: [red, green, blue],
        weight: S::constant(weight),
    }
}

/// Generates parameters of the model Phong.
pub fn phong() -> impl Strategy<Value = Vec<f64>> {
    let logits = prop::collection::vec(-3.0..3.0f64, 6);
    (logits, -2.0..5.0f64).prop_map(|(mut logits, exponent)| {
        logits.push(exponent);
        logits
    })
}

/// Generates logits of the model Cook-Torrance: roughness from 0.05 to 0.95.
pub fn cook_torrance() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-3.0..3.0f64, CookTorrance::PARAMETERS)
}

/// Multiplies the entries of each layer by its scale.
pub fn scale_layers<T: Copy + core::ops::MulAssign>(network: &mut [T], scales: [T; 6]) {
    let mut rest = network;
    for (length, scale) in Neural::LAYERS.into_iter().zip(scales) {
        let (layer, after) = rest.split_at_mut(length);
        layer.iter_mut().for_each(|entry| *entry *= scale);
        rest = after;
    }
}

/// Generates weights of the model Neural. They suit the range of each layer's inputs, and the output biases leave most
/// outputs active.
pub fn neural() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.0..1.0f64, Neural::PARAMETERS).prop_map(|list| {
        let mut network: NeuralParameters<f64> = parameters(list, 0.0);
        let scales = [0.8, 0.3, 0.4, 0.3, 0.4, 0.4];
        scale_layers(&mut network, scales);
        // The last three parameters are the output biases.
        network[672..].iter_mut().for_each(|bias| *bias += 0.4);
        network.to_vec()
    })
}
