//! Materials that do not change when light and sensor are exchanged.

use std::f32::consts::PI;

use glimpse_core::geometry::{Angles, HalfDifference};

use crate::Material;
use crate::loss::coarse_directions;

/// The mean of a material's BRDF and of its BRDF with light and sensor exchanged. It is reciprocal.
#[derive(Clone, Copy)]
pub struct Reciprocal<'m>(&'m dyn Material);

/// Relative differences up to this are rounding errors.
const ROUNDING: f32 = 1e-4;

impl<'m> Reciprocal<'m> {
    /// Creates the mean. None if the material is reciprocal already.
    #[must_use]
    pub fn of(material: &'m dyn Material) -> Option<Self> {
        let differs = |angles: Angles<f32>| {
            let pairs = material
                .brdf(angles)
                .into_iter()
                .zip(material.brdf(exchanged(angles)));
            pairs
                .into_iter()
                .any(|(one, other)| (one - other).abs() > ROUNDING * one.abs().max(other.abs()))
        };
        coarse_directions()
            .into_iter()
            .any(differs)
            .then_some(Self(material))
    }
}

/// Returns the angles with light and sensor exchanged.
fn exchanged(angles: Angles<f32>) -> Angles<f32> {
    Angles {
        phi_d: angles.phi_d + PI,
        ..angles
    }
}

fn mean([one, other]: [[f32; 3]; 2]) -> [f32; 3] {
    [0, 1, 2].map(|channel| 0.5 * (one[channel] + other[channel]))
}

impl Material for Reciprocal<'_> {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
        mean([angles, exchanged(angles)].map(|angles| self.0.brdf(angles)))
    }

    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
        let [(brdf, derivative), (other, other_derivative)] =
            [angles, exchanged(angles)].map(|angles| self.0.brdf_with_derivative(angles));
        let derivative =
            [0, 1, 2].map(|channel| mean([derivative[channel], other_derivative[channel]]));
        (mean([brdf, other]), derivative)
    }

    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        self.0.brdf_batch(at, brdf);
        let exchanged: Vec<HalfDifference<f32>> = at
            .iter()
            .map(|at| HalfDifference {
                dx: -at.dx,
                dy: -at.dy,
                ..*at
            })
            .collect();
        let mut others = vec![[0.0; 3]; at.len()];
        self.0.brdf_batch(&exchanged, &mut others);
        for (brdf, other) in brdf.iter_mut().zip(others) {
            *brdf = mean([*brdf, other]);
        }
    }

    fn is_reciprocal(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The BRDF depends on the difference vector's azimuth.
    struct Directed;

    impl Material for Directed {
        fn name(&self) -> &str {
            "directed"
        }

        fn brdf(&self, angles: Angles<f32>) -> [f32; 3] {
            self.brdf_with_derivative(angles).0
        }

        fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]) {
            let [value, slope] = [angles.phi_d.cos(), -angles.phi_d.sin()];
            (
                [2.0 + value, 1.0 + value * angles.theta_d, angles.theta_h],
                [
                    [0.0, 0.0, slope],
                    [0.0, value, slope * angles.theta_d],
                    [1.0, 0.0, 0.0],
                ],
            )
        }
    }

    #[test]
    fn exchange_does_not_change_mean() {
        let mean = Reciprocal::of(&Directed).expect("the BRDF is not reciprocal");
        let angles = Angles {
            theta_h: 0.3,
            theta_d: 0.7,
            phi_d: 1.1,
        };
        let at = [angles, exchanged(angles)].map(HalfDifference::from_angles);
        let mut batch = [[0.0; 3]; 2];
        mean.brdf_batch(&at, &mut batch);
        for brdf in [
            mean.brdf(angles),
            mean.brdf(exchanged(angles)),
            batch[0],
            batch[1],
        ] {
            for (value, expected) in brdf.into_iter().zip([2.0, 1.0, 0.3]) {
                assert!((value - expected).abs() < 1e-6, "{brdf:?}");
            }
        }
        let (_, derivative) = mean.brdf_with_derivative(angles);
        let expected = [[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0]];
        for (value, expected) in derivative.concat().iter().zip(expected.concat()) {
            assert!((value - expected).abs() < 1e-6, "{derivative:?}");
        }
        assert!(Reciprocal::of(&mean).is_none());
    }
}
