//! Numbers of multiply-accumulates of the neural model. Only matrix products count; biases, activations, losses and
//! sums over lanes do not.
//!
//! The layers have the weights W1 = 5 x 21 (hy is always 0, so its row is not computed), W2 = 21 x 21 and
//! W3 = 21 x 3:
//!
//! - forward: W1 + W2 + W3;
//! - backward to the hidden layers: W3 + W2; to the sample's coordinates, W1 in addition;
//! - accumulation of the gradient with respect to the weights: W1 + W2 + W3.
//!
//! With dual numbers, a product forward or backward counts three times: value times value, tangent times value, and
//! value times tangent. The accumulation only needs the tangent and counts twice.

use glimpse_training::run::INNER_STEPS;

const WEIGHTS: [u64; 3] = [5 * 21, 21 * 21, 21 * 3];
const ALL_LAYERS: u64 = WEIGHTS[0] + WEIGHTS[1] + WEIGHTS[2];
const WITHOUT_FIRST_LAYER: u64 = WEIGHTS[1] + WEIGHTS[2];

/// Returns the count of the gradient with respect to the parameters, at one sample.
const fn gradient() -> u64 {
    ALL_LAYERS + WITHOUT_FIRST_LAYER + ALL_LAYERS
}

/// Returns the count of the product of Hessian and vector at one sample. `sample_derivatives` includes the derivatives
/// with respect to the sample's coordinates.
const fn product(sample_derivatives: bool) -> u64 {
    let backward = if sample_derivatives {
        ALL_LAYERS
    } else {
        WITHOUT_FIRST_LAYER
    };
    3 * ALL_LAYERS + 3 * backward + 2 * ALL_LAYERS
}

/// Returns the count of an outer step of one task: a gradient in the forward pass and a product in the reverse pass of
/// every inner step, and one gradient over the outer samples.
pub(super) const fn outer_step(inner: usize, outer: usize, sample_derivatives: bool) -> u64 {
    let inner_step = gradient() + product(sample_derivatives);
    (INNER_STEPS * inner) as u64 * inner_step + outer as u64 * gradient()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_match_layer_sizes() {
        assert_eq!(gradient(), 1_722);
        assert_eq!(product(false), 4_557);
        assert_eq!(product(true), 4_872);
        assert_eq!(outer_step(512, 512, false), 65_178_624);
    }
}
