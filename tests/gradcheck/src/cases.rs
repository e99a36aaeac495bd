//! Random samples and parameters.

use std::f64::consts::{FRAC_PI_2, TAU};

use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::{CookTorrance, Model, ModelKind, Neural, NeuralParameters, Sample};
use glimpse_core::numeric::Scalar;
use proptest::prelude::*;

use super::{Traced, parameters};

/// Variables of a gradient in addition to the parameters: hx, hz, dx, dy, dz, and the reading y in red, green, blue.
pub type Variables = [f64; 8];

/// Names of the [`Variables`], in their order.
pub const VARIABLE_NAMES: [&str; 8] = ["hx", "hz", "dx", "dy", "dz", "y_r", "y_g", "y_b"];

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
    let at = sample::<Traced>(variables, 0.0).at;
    [at.cos_theta_i().0, at.cos_theta_o().0]
}

/// Returns the sample with these variables.
pub fn sample<S: Scalar>(variables: Variables, weight: f64) -> Sample<S> {
    let [hx, hz, dx, dy, dz, red, green, blue] = variables.map(S::constant);
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

/// Returns true near the edge of Phong's lobe. The slope there is as steep as (1e-5)^(q-1), too steep for central
/// differences.
fn near_edge_of_lobe(variables: Variables) -> bool {
    mirror_cosine(variables).abs() < 0.02
}

/// Returns true near grazing angles. Cook-Torrance divides by cos theta_i cos theta_o and by cos theta_d. If one of
/// these cosines is below a hundred difference steps, the function is too curved for central differences.
fn near_grazing(variables: Variables) -> bool {
    let [cos_theta_i, cos_theta_o] = cosines(variables);
    cos_theta_i.min(cos_theta_o).min(variables[4]) < 0.01
}

/// Returns true if the model is too steep at these variables for central differences along them.
pub fn is_too_steep(model: ModelKind, variables: Variables) -> bool {
    match model {
        ModelKind::Phong => near_edge_of_lobe(variables),
        ModelKind::CookTorrance => near_grazing(variables),
        _ => false,
    }
}

/// Returns <w_o, r>, where r is the mirror direction of w_i.
pub fn mirror_cosine(variables: Variables) -> f64 {
    let [hx, hz, dx, dy, dz, ..] = variables;
    // Rotating (dx, dy, dz) about y by theta_h gives w_i; w_o = 2 <h, w_i> h - w_i.
    let incoming = [hz * dx + hx * dz, dy, hz * dz - hx * dx];
    let half = [hx, 0.0, hz];
    let cosine: f64 = (0..3).map(|i| half[i] * incoming[i]).sum();
    let outgoing: [f64; 3] = std::array::from_fn(|i| 2.0 * cosine * half[i] - incoming[i]);
    let mirror = [-incoming[0], -incoming[1], incoming[2]];
    (0..3).map(|i| outgoing[i] * mirror[i]).sum()
}
