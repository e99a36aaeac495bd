//! How many multiply-accumulates the neural model takes: those of its matrix products, and
//! nothing else (no bias, activation, loss, or sum over lanes).
//!
//! With the layers' weights W1 = 5 x 21 (hy is always 0, so its row is not computed), W2 = 21 x 21
//! and W3 = 21 x 3:
//!
//! - forward: W1 + W2 + W3;
//! - backward to the hidden layers: W3 + W2, and to the sample's coordinates W1 more;
//! - accumulating the gradient by the weights: W1 + W2 + W3.
//!
//! On dual numbers a product forward or backward is three (value times value, tangent times value,
//! value times tangent). Of what is accumulated only the tangent is wanted: two.

use glimpse_training::meta::run::INNER_STEPS;

const WEIGHTS: [u64; 3] = [5 * 21, 21 * 21, 21 * 3];
const ALL: u64 = WEIGHTS[0] + WEIGHTS[1] + WEIGHTS[2];
const BUT_FIRST: u64 = WEIGHTS[1] + WEIGHTS[2];

/// The gradient by the parameters, at one sample.
pub(super) const fn gradient() -> u64 {
    ALL + BUT_FIRST + ALL
}

/// The product of Hessian and vector at one sample; with the derivatives by the sample too.
pub(super) const fn product(by_sample: bool) -> u64 {
    let backward = if by_sample { ALL } else { BUT_FIRST };
    3 * ALL + 3 * backward + 2 * ALL
}

/// An outer step of one task: at every inner step a gradient forward and a product in reverse,
/// and once the gradient over the outer samples.
pub(super) const fn outer_step(inner: usize, outer: usize, by_sample: bool) -> u64 {
    let each = gradient() + product(by_sample);
    (INNER_STEPS * inner) as u64 * each + outer as u64 * gradient()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_those_of_the_layers() {
        assert_eq!(gradient(), 1_722);
        assert_eq!(product(false), 4_557);
        assert_eq!(product(true), 4_872);
        assert_eq!(outer_step(512, 512, false), 65_178_624);
    }
}
