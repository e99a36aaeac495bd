//! The sample pattern as meta-parameters: logits of coordinates scaled to their range.
//!
//! theta_h = pi/2 sigmoid(l_0), theta_d = pi/2 sigmoid(l_1), phi_d = pi sigmoid(l_2). A sample
//! with a direction below the horizon is left out of the fit and pays the barrier
//! 0.005 (theta_h^2 + theta_d^2), which pulls it back (paper, Eq. "barrier").

use std::f32::consts::{FRAC_PI_2, PI};

use glimpse_core::angles::{Angles, HalfDifference};
use glimpse_core::model::{Sample, SampleGradient};

use super::gradient::OctetSamples;
use super::pool::{NO_WEIGHTS, OctetRgb, Variation, transpose_rgb};
use crate::dual::Dual;
use crate::lanes::{Lanes, MOST_OCTETS, Octet, OctetAt, WIDTH, load_at};
use crate::material::Material;

/// Upper ends of theta_h, theta_d and phi_d; the lower ends are 0.
pub const RANGE: [f32; 3] = [FRAC_PI_2, FRAC_PI_2, PI];
/// The barrier's weight.
const BARRIER: f32 = 0.005;

/// Angles of a sample's three logits.
#[must_use]
pub fn angles_of(logits: [f32; 3]) -> Angles<f32> {
    let [theta_h, theta_d, phi_d] = [0, 1, 2].map(|i| RANGE[i] / (1.0 + (-logits[i]).exp()));
    Angles {
        theta_h,
        theta_d,
        phi_d,
    }
}

/// Logits of a sample's angles. Angles at an end of their range come out a little inside.
#[must_use]
pub fn logits_of(angles: Angles<f32>) -> [f32; 3] {
    let angles = [angles.theta_h, angles.theta_d, angles.phi_d];
    [0, 1, 2].map(|i| {
        let share = (angles[i] / RANGE[i]).clamp(1e-3, 1.0 - 1e-3);
        (share / (1.0 - share)).ln()
    })
}

/// A pattern, ready to be measured on any material.
pub struct Pattern {
    angles: Vec<Angles<f32>>,
    valid: Vec<bool>,
    at: Vec<OctetAt>,
    weights: Vec<Octet>,
}

/// A pattern measured on one material.
pub struct MeasuredPattern<'p> {
    pattern: &'p Pattern,
    values: Vec<OctetRgb>,
    /// Derivatives of each sample's channels by its angles.
    derivatives: Vec<[[f32; 3]; 3]>,
}

impl Pattern {
    /// From angles.
    #[must_use]
    pub fn new(angles: Vec<Angles<f32>>) -> Self {
        let each: Vec<_> = angles
            .iter()
            .copied()
            .map(HalfDifference::from_angles)
            .collect();
        let valid: Vec<bool> = each.iter().map(HalfDifference::is_valid).collect();
        let counted = valid.iter().filter(|valid| **valid).count().max(1);
        let weight = 1.0 / (3.0 * counted as f32);
        let mut weights = vec![Octet::default(); angles.len().div_ceil(WIDTH)];
        for (index, valid) in valid.iter().enumerate() {
            if *valid {
                weights[index / WIDTH].0[index % WIDTH] = weight;
            }
        }
        Self {
            at: each.chunks(WIDTH).map(Octet::transpose).collect(),
            angles,
            valid,
            weights,
        }
    }

    /// From logits, three for each sample.
    #[must_use]
    pub fn from_logits(logits: &[f32]) -> Self {
        Self::new(
            logits
                .as_chunks()
                .0
                .iter()
                .copied()
                .map(angles_of)
                .collect(),
        )
    }

    /// The angles.
    #[must_use]
    pub fn angles(&self) -> &[Angles<f32>] {
        &self.angles
    }

    /// What invalid samples pay.
    #[must_use]
    pub fn barrier(&self) -> f32 {
        let invalid = self
            .angles
            .iter()
            .zip(&self.valid)
            .filter(|(_, valid)| !**valid);
        invalid
            .map(|(a, _)| BARRIER * (a.theta_h * a.theta_h + a.theta_d * a.theta_d))
            .sum()
    }

    /// Measures a material at the pattern; derivatives are for
    /// [`MeasuredPattern::gradient_by_logits`].
    #[must_use]
    pub fn measure(&self, material: &dyn Material, variation: Variation) -> MeasuredPattern<'_> {
        let (values, derivatives): (Vec<_>, Vec<_>) = self
            .angles
            .iter()
            .zip(&self.valid)
            .map(|(angles, valid)| match valid {
                true => {
                    let (brdf, derivative) = material.brdf_with_derivative(*angles);
                    let Variation { order, gains } = variation;
                    (
                        [0, 1, 2].map(|c| gains[c] * brdf[order[c]]),
                        [0, 1, 2].map(|c| derivative[order[c]].map(|slope| gains[c] * slope)),
                    )
                }
                false => ([0.0; 3], [[0.0; 3]; 3]),
            })
            .unzip();
        MeasuredPattern {
            pattern: self,
            values: values.chunks(WIDTH).map(transpose_rgb).collect(),
            derivatives,
        }
    }
}

impl MeasuredPattern<'_> {
    /// Room for the gradient by samples, all 0.
    #[must_use]
    pub fn no_slopes(&self) -> Vec<SampleGradient<Octet>> {
        let none = SampleGradient {
            at: OctetAt::default(),
            measured: OctetRgb::default(),
        };
        vec![none; self.values.len()]
    }

    /// From the gradient by samples' coordinates and values to the one by the pattern's logits,
    /// the barrier's included.
    #[must_use]
    pub fn gradient_by_logits(&self, samples: &[SampleGradient<Octet>]) -> Vec<f32> {
        let pattern = self.pattern;
        let mut by_logits = Vec::with_capacity(3 * pattern.angles.len());
        for (index, angles) in pattern.angles.iter().enumerate() {
            let by_angles = if pattern.valid[index] {
                let lane = index % WIDTH;
                let SampleGradient { at: by, measured } = &samples[index / WIDTH];
                let at = HalfDifference::from_angles(Dual::<f32, 3>::variables(*angles));
                std::array::from_fn(|i| {
                    let through_place = by.hx.0[lane] * at.hx.tangent[i]
                        + by.hz.0[lane] * at.hz.tangent[i]
                        + by.dx.0[lane] * at.dx.tangent[i]
                        + by.dy.0[lane] * at.dy.tangent[i]
                        + by.dz.0[lane] * at.dz.tangent[i];
                    let through_value: f32 = measured
                        .iter()
                        .zip(&self.derivatives[index])
                        .map(|(by, derivative)| by.0[lane] * derivative[i])
                        .sum();
                    through_place + through_value
                })
            } else {
                let slope = 2.0 * BARRIER;
                [slope * angles.theta_h, slope * angles.theta_d, 0.0]
            };
            let angles = [angles.theta_h, angles.theta_d, angles.phi_d];
            for ((by_angle, angle), range) in by_angles.iter().zip(angles).zip(RANGE) {
                by_logits.push(by_angle * angle * (1.0 - angle / range));
            }
        }
        by_logits
    }
}

impl OctetSamples for MeasuredPattern<'_> {
    #[inline(always)]
    fn octets(&self) -> usize {
        self.values.len()
    }

    #[inline(always)]
    fn read<L: Lanes>(&self, octet: usize) -> Sample<L> {
        let last = self.values.len() - 1;
        let mut at = [&self.pattern.at[octet]; MOST_OCTETS];
        let mut values = [&self.values[octet]; MOST_OCTETS];
        let mut weights = [&NO_WEIGHTS; MOST_OCTETS];
        for k in 0..L::OCTETS {
            let index = (octet + k).min(last);
            at[k] = &self.pattern.at[index];
            values[k] = &self.values[index];
            if octet + k <= last {
                weights[k] = &self.pattern.weights[index];
            }
        }
        let [a, b, c, d] = values;
        let mut measured = [L::constant(0.0); 3];
        for (channel, y) in measured.iter_mut().enumerate() {
            *y = L::load([&a[channel], &b[channel], &c[channel], &d[channel]]);
        }
        Sample {
            at: load_at(at),
            measured,
            weight: L::load(weights),
        }
    }
}
