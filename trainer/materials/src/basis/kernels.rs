//! The discrepancy of a material from the components of a basis: a sum of kernels, one at each direction of its readings.

use glimpse_core::geometry::{Angles, HalfDifference};
use serde::{Deserialize, Serialize};

/// The coordinates of a pair of directions, in lengths of kernels.
pub type Place = [f32; 4];

/// The correlation of the discrepancies of a material from the components at two places: Wendland's kernel
/// (1 - r)^5 (5 r + 1) of their distance r, or None from r = 1 on, where it is 0. It is once differentiable, like a Matern kernel
/// of order 3/2, and positive definite in up to five dimensions (Wendland 1995, "Piecewise polynomial, positive definite and
/// compactly supported radial functions of minimal degree").
#[inline]
#[must_use]
pub fn correlation(one: &Place, other: &Place) -> Option<f64> {
    let pairs = one.iter().zip(other);
    let squared: f32 = pairs.map(|(a, b)| (a - b) * (a - b)).sum();
    (squared < 1.0).then(|| {
        let r = f64::from(squared).sqrt();
        (1.0 - r).powi(5) * (5.0 * r + 1.0)
    })
}

/// The directions of kernels, and the distances at which they end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Kernels {
    /// The lengths of the kernels in degrees: along sqrt(theta_h 90), along theta_d, and along phi_d, times the sines of
    /// theta_d and of 2 theta_h.
    pub lengths: [f32; 3],
    /// The directions: theta_h, theta_d and phi_d in radians.
    pub directions: Vec<[f32; 3]>,
}

impl Kernels {
    /// Returns the place of a pair of directions.
    #[must_use]
    pub fn place(lengths: [f32; 3], at: &HalfDifference<f32>) -> Place {
        const DEGREES: f32 = 180.0 / std::f32::consts::PI;
        let HalfDifference { hx, hz, dx, dy, dz } = *at;
        let [of_half, of_difference, of_azimuth] = lengths;
        // sin(2 theta_h) up to 45 degrees: near the normal, phi_d has no effect.
        let turned = if hx < hz { 2.0 * hx * hz } else { 1.0 };
        let azimuth = DEGREES * turned / of_azimuth;
        [
            90.0 * (hx / (1.0 + hz).sqrt()).max(0.0).sqrt() / of_half,
            DEGREES * (2.0 * (1.0 - dz)).max(0.0).sqrt() / of_difference,
            azimuth * dx,
            azimuth * dy.abs(),
        ]
    }

    /// Returns true if all numbers are finite, and the lengths are positive.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let mut numbers = self.directions.iter().flatten().chain(&self.lengths);
        self.lengths.iter().all(|length| *length > 0.0) && numbers.all(|number| number.is_finite())
    }

    /// Returns the sum of the kernels times these weights of red, green and blue: a list for each channel.
    #[must_use]
    pub fn sum(&self, [red, green, blue]: [&[f32]; 3]) -> KernelSum {
        let weights = red.iter().zip(green).zip(blue);
        let kernels = self.directions.iter().zip(weights);
        let kernels = kernels.map(|(angles, ((red, green), blue))| {
            let at = HalfDifference::from_angles(Angles::from_array(*angles));
            (Self::place(self.lengths, &at), [*red, *green, *blue])
        });
        KernelSum {
            lengths: self.lengths,
            kernels: kernels.collect(),
        }
    }
}

/// A sum of kernels in each channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KernelSum {
    lengths: [f32; 3],
    /// Places, and the weights of the channels.
    kernels: Vec<(Place, [f32; 3])>,
}

impl KernelSum {
    /// Returns the sums at a pair of directions.
    #[must_use]
    pub fn at(&self, at: &HalfDifference<f32>) -> [f32; 3] {
        self.sum(self.correlations(at))
    }

    /// Returns the indices and the values of the kernels that are not 0 at a pair of directions.
    pub(super) fn correlations(
        &self,
        at: &HalfDifference<f32>,
    ) -> impl Iterator<Item = (usize, f32)> + use<'_> {
        let place = Kernels::place(self.lengths, at);
        let kernels = self.kernels.iter().enumerate();
        kernels.filter_map(move |(index, (other, _))| {
            Some((index, correlation(&place, other)? as f32))
        })
    }

    /// Returns the sums of kernels with these values.
    pub(super) fn sum(&self, correlations: impl Iterator<Item = (usize, f32)>) -> [f32; 3] {
        let mut sums = [0.0; 3];
        for (index, correlation) in correlations {
            for (sum, weight) in sums.iter_mut().zip(self.kernels[index].1) {
                *sum += correlation * weight;
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::uniform_valid;

    /// At its own direction and at the mirror image of it, a kernel is 1.
    #[test]
    fn kernels_are_one_at_their_directions() {
        let angles = uniform_valid(19, 3);
        let kernels = Kernels {
            lengths: [20.0, 30.0, 40.0],
            directions: angles.iter().map(|angles| angles.to_array()).collect(),
        };
        assert!(kernels.is_valid());
        for (index, angles) in angles.iter().enumerate() {
            let mut weights = [0.0; 19];
            weights[index] = 2.0;
            let sum = kernels.sum([&weights, &[0.0; 19], &weights]);
            let [red, green, blue] = sum.at(&HalfDifference::from_angles(*angles));
            assert!(
                (red - 2.0).abs() < 1e-5 && green == 0.0 && blue == red,
                "{red}"
            );
            let mirrored = Angles {
                phi_d: -angles.phi_d,
                ..*angles
            };
            let [mirrored, ..] = sum.at(&HalfDifference::from_angles(mirrored));
            assert!((mirrored - red).abs() < 1e-5);
        }
    }
}
